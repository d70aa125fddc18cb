"""From a recording to a log, row by row, as a mapping says."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from auvest._outputs import NewFolder, OutputError
from auvest._texts import counted
from auvest.importers.expressions import WITHIN_S, MappingError, NoSuchField, NotANumber, step
from auvest.importers.formats import open_recording
from auvest.importers.mapping import INCREMENTS, LogMapping, Table
from auvest.importers.recording import Message, Recording, RecordingError
from auvest.logs.reader import LogError, LogFolder

#: Rows that may wait for another topic at once.
_MOST_WAITING = 1000


@dataclass(frozen=True)
class Imported:
    """A log that was made: where, how many rows of each file, and what a user should know."""

    path: Path
    rows: dict[str, int]
    notes: list[str]


def import_recording(
    recording: Recording, mapping: LogMapping, output: Path, *, force: bool = False
) -> Imported:
    """Make a log of a recording, whole or not at all.

    Parameters
    ----------
    recording : Recording
        As :func:`auvest.importers.open_recording` finds it.
    mapping : LogMapping
        Which topics become what.
    output : Path
        The log's folder.
    force : bool
        As :class:`auvest._outputs.NewFolder` takes it.

    Raises
    ------
    LogError
        If the recording cannot be read, or holds what no log can.
    MappingError
        If the mapping names fields that messages do not have.
    """
    given, wanted = recording.path.resolve(), output.resolve()
    if given.is_relative_to(wanted) or wanted.is_relative_to(given):
        raise OutputError(f"the log would be {output}, in or above its source: name another OUT")
    with NewFolder(output, f"import {recording.name}", force=force) as new:
        writing = _Writing(new.part, recording, mapping)
        writing.run()
        notes = writing.notes()
        try:
            LogFolder(new.part)
        except LogError as error:  # other recordings of the dive may bring what is missing
            where, _, what = str(error).removeprefix(str(new.part)).partition(": ")
            what = f"{where.strip('/')} {what}".strip()
            notes.append(f"not yet a log that can be replayed: {what}")
        new.publish()
    return Imported(new.path, dict(writing.rows), notes)


class _Writing:
    """The files of one log while they are written."""

    def __init__(self, folder: Path, recording: Recording, mapping: LogMapping) -> None:
        self.rows: Counter[str] = Counter()
        self._folder = folder
        self._recording = recording
        self._mapping = mapping
        self._files: dict[str, TextIO] = {}
        self._left_out: Counter[str] = Counter()
        self._headers: dict[str, tuple[str, ...]] = {}
        self._goes_back: Counter[str] = Counter()
        self._last_s: dict[str, float] = {}

    def run(self) -> None:
        """Write every file.

        Raises
        ------
        LogError
            If nothing is left.
        """
        with ExitStack() as stack:
            for table in self._mapping.tables:
                self._open(table, stack)
            for name in dict.fromkeys(table.recording for table in self._mapping.tables):
                tables = [table for table in self._mapping.tables if table.recording == name]
                recording = self._recording
                if name is not None:
                    recording = open_recording(recording.path.parent / name)
                self._read(recording, [_Source(table) for table in tables if not table.rows])
        if not any(self.rows[table.file] for table in self._mapping.tables if not table.rows):
            tables = [table for table in self._mapping.tables if not table.rows]
            topics = ", ".join(dict.fromkeys(str(table.topic or table.type) for table in tables))
            why = "; ".join(f"{count} {what}" for what, count in self._left_out.items())
            raise LogError(
                self._recording.path,
                f"holds nothing for a log; {self._mapping.name} is of {topics}"
                + (f" ({why})" if why else ""),
            )
        for table in self._mapping.tables:
            alone = table.beside is not None and not self.rows[table.beside]
            if alone or (table.unless is not None and self.rows[table.unless]):
                del self.rows[table.file]
        for file in self._headers:
            if not self.rows[file]:
                (self._folder / file).unlink()

    def notes(self) -> list[str]:
        """Say what was left out."""
        constant = {table.file for table in self._mapping.tables if table.rows}
        empty = sorted(file for file in {*self._headers} - constant if not self.rows[file])
        return [
            *(f"nothing for {file}" for file in empty),
            *(f"left out: {count} {what}" for what, count in self._left_out.items()),
            *(f"passed over: {count} x {what}" for what, count in self._recording.skipped.items()),
            *(
                f"{file}: times go back {counted(count, 'time')}"
                for file, count in (+self._goes_back).items()
            ),
        ]

    def _open(self, table: Table, stack: ExitStack) -> None:
        names = tuple(column.name for column in table.columns)
        if self._headers.setdefault(table.file, names) != names:
            raise MappingError(f"{table.file} is given different columns by two tables")
        if table.file not in self._files:
            path = self._folder / table.file
            file = stack.enter_context(path.open("w", encoding="utf-8", newline="\n"))
            self._files[table.file] = file
            file.write(",".join(names) + "\n")
        for row in table.rows:
            self._write(table, [row[name] for name in names])

    def _read(self, recording: Recording, sources: list[_Source]) -> None:
        needed = {topic for source in sources for topic in source.table.topics}
        topics = {source.table.topic for source in sources if source.table.topic} | needed
        by_type = any(source.table.type is not None for source in sources)
        latest: dict[str, Message] = {}
        untimed = 0
        for message in recording.messages(None if by_type else topics) if sources else ():
            if message.time_ns is None and self._mapping.period_s is not None:
                time_ns = round(untimed * self._mapping.period_s * 1e9)
                message = Message(message.topic, time_ns, message.values, message.where)
                untimed += 1
            if message.topic in needed:
                latest[message.topic] = message
            for source in sources:
                source.require_one(recording, message)
                if message.topic in source.others:
                    source.nearer(message)
                if message.topic == source.topic:
                    source.wait(message, latest)
                for ready, beside in source.ready(message):
                    self._row(recording, source, ready, beside)
        for source in sources:
            for ready, beside in source.waiting:
                self._row(recording, source, ready, beside)

    def _row(
        self, recording: Recording, source: _Source, message: Message, beside: dict[str, Message]
    ) -> None:
        table = source.table
        if not table.takes(message):
            self._left_out[f"messages of {message.topic} that are not {_shown(table)}"] += 1
            return
        if table.fresh and source.repeats(message):
            self._left_out[f"messages of {message.topic} that repeat the one before"] += 1
            return
        try:
            values = {name: part.evaluate(message, beside) for name, part in table.values.items()}
            pose = [part.evaluate(message, beside) for part in table.pose]
        except NoSuchField:
            if not self._mapping.lenient:
                raise
            self._left_out[f"messages of {message.topic} without a field for {table.file}"] += 1
            return
        except (NotANumber, OverflowError) as error:
            raise RecordingError(recording.path, message.where, str(error)) from None
        if "time_s" not in values:
            values["time_s"] = self._time(recording, message)
        if table.pose and None in pose:
            self._left_out[f"messages of {message.topic} without a pose"] += 1
            return
        if table.pose and not source.moves(values, pose):
            return
        row = []
        for column in table.columns:
            value = values[column.name]
            if value is None:
                self._left_out[f"messages of {message.topic} without {column.name}"] += 1
                return
            if not column.low <= value <= column.high or (column.integer and value % 1):
                suspicion, _ = column.suspect(value)
                hint = f" ({suspicion})" if suspicion else ""
                raise RecordingError(
                    recording.path, message.where,
                    f"{column.name}: {column.breach(value)}{hint}",
                )  # fmt: skip
            row.append(int(value) if column.integer else float(value))
        time_s = row[0]
        self._goes_back[table.file] += time_s < self._last_s.get(table.file, time_s)
        self._last_s[table.file] = time_s
        self._write(table, row)

    def _time(self, recording: Recording, message: Message) -> float:
        time_ns = message.stamp_ns if self._mapping.clock == "stamp" else message.time_ns
        if time_ns is None:
            what = "no time"
            other = (
                'time_s = {field = "...", unit = "ms"} tells where it is, or period_s how long it '
                "is from one message to the next"
            )
            if self._mapping.clock == "stamp":
                what, other = "no stamp", 'clock = "recorded" takes the time of the recording'
            raise RecordingError(
                recording.path, message.where, f"{message.topic} has {what}; in a mapping, {other}"
            )
        return time_ns / 1e9

    def _write(self, table: Table, row: list[float]) -> None:
        self._files[table.file].write(",".join(map(repr, row)) + "\n")
        self.rows[table.file] += 1


class _Source:
    """A table, and what it must remember from one message to the next.

    A row with numbers of other topics waits for the messages of these that are nearest in time:
    which of two topics comes first in a file says nothing.
    """

    def __init__(self, table: Table) -> None:
        self.table = table
        self.topic = table.topic
        self.others = table.topics
        self.waiting: deque[tuple[Message, dict[str, Message]]] = deque()
        self._before: Message | None = None
        self._pose: tuple[float, float, float] | None = None

    def wait(self, message: Message, latest: dict[str, Message]) -> None:
        """Take a message that makes a row."""
        beside = {topic: latest[topic] for topic in self.others if topic in latest}
        self.waiting.append((message, beside))

    def nearer(self, other: Message) -> None:
        """Let rows that wait take a message if it is nearer to them."""
        for message, beside in self.waiting:
            known = beside.get(other.topic)
            if known is None or _apart_ns(message, other) < _apart_ns(message, known):
                beside[other.topic] = other

    def ready(self, now: Message) -> Iterator[tuple[Message, dict[str, Message]]]:
        """Give the rows for which nothing nearer can come, in their order."""
        while self.waiting:
            message, beside = self.waiting[0]
            waits = any(
                topic not in beside or _time_of(beside[topic]) < _time_of(message)
                for topic in self.others
            )
            late = _apart_ns(now, message) > WITHIN_S * 1e9  # or the clock has jumped back
            if waits and not late and len(self.waiting) < _MOST_WAITING:
                return
            yield self.waiting.popleft()

    def require_one(self, recording: Recording, message: Message) -> None:
        """Find the topic of a type, and refuse a second one, whose rows would be mixed in."""
        kind = self.table.type
        if kind is None or recording.types.get(message.topic) != kind:
            return
        if self.topic not in (None, message.topic):
            raise MappingError(
                f"{recording.path} has {kind} as {self.topic} and {message.topic}; a mapping with "
                "topic = says which is meant"
            )
        self.topic = message.topic

    def repeats(self, message: Message) -> bool:
        before, self._before = self._before, message
        return before is not None and before.values == message.values

    def moves(self, values: dict[str, float | None], pose: list[float | None]) -> bool:
        """Put in the motion since the pose before; False at the first."""
        x, y, heading = pose
        before, self._pose = self._pose, (x or 0.0, y or 0.0, heading or 0.0)
        if before is None:
            return False
        values |= zip(INCREMENTS, step(before, self._pose), strict=True)
        return True


def _time_of(message: Message) -> int:
    return message.time_ns or 0


def _apart_ns(one: Message, other: Message) -> int:
    return abs(_time_of(one) - _time_of(other))


def _shown(table: Table) -> str:
    return ", ".join(f"{name} = {_text(wanted)}" for name, wanted in table.when.items())


def _text(wanted: object) -> str:
    return str(wanted).lower() if isinstance(wanted, bool) else str(wanted)
