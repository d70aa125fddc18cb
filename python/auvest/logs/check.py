"""What the files of a log show before any filter runs: what is there, rates, gaps, suspicions.

:func:`survey` reads every file once, a chunk at a time, but the truth, which nothing here looks at.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._texts import short
from auvest.logs.findings import Finding, finding
from auvest.logs.layout import FILES
from auvest.logs.origin import local_origin
from auvest.logs.reader import TRUTHS, CsvTable, LogError, LogFolder, Rows

#: Half of the lines follow with less than this on the one before in any log of seconds, s: the
#: slowest odometry that a velocity may be taken from, and the slowest fixes.
SLOW_ODOMETRY_S = 10.0
SLOW_FIXES_S = 60.0
#: A craft that moves by metres and is slower than this on the whole is one whose clock is too fast.
SLOW_M_S = 0.02
#: Faster turning than this, rad/s, is no vehicle's: degrees.
FAST_TURN_RAD_S = 3.0
#: Faster than this, m/s, is no vehicle: lengths in millimetres or centimetres.
FAST_M_S = 50.0
#: Sources that lie closer together than this share of their ranges are at one place, as degrees or
#: kilometres put them.
ONE_PLACE = 5e-3
#: Steps of the clock that are longer than so many usual ones, in all files at once, are jumps.
JUMP_STEPS = 10
#: A silence shorter than this is no jump forwards, and a shorter way back none backwards, s.
SILENCE_S, BACK_S = 60.0, 10.0
#: Values that drivers write where no echo came; others are found by how often they are there.
CODES = (0.0, 999.0, 999.9, 999.99, 9999.0, 9999.9, 9999.99, 99999.0, 65.535, 655.35, 6553.5,
         65535.0, 32.767, 327.67, 3276.7, 32767.0, 4294967.295)  # fmt: skip
#: So often a code, and so often (and in this share of a source's lines) any other value.
CODE_LINES, REPEATED_LINES, REPEATED_SHARE = 2, 12, 0.05
#: The value before or after a code is so many times farther off than a range from the next.
CODE_JUMP = 4.0
#: Steps of a replay per line of a log; more are refused.
STEPS_PER_LINE = 1000
#: The least and the most x and y of no place at all.
NOWHERE = np.array([[math.inf, math.inf], [-math.inf, -math.inf]])
#: A file's name is so much like that of a log's file that this may be meant.
NEAR_NAME = 0.7
#: Longest and most telling steps that are remembered.
_KEPT = 8


@dataclass(frozen=True)
class Limits:
    """What of the settings of a replay the survey asks for.

    Attributes
    ----------
    gap_s : float
        So long a velocity holds, s.
    reorder_s : float
        So late a line may be, s.
    max_step_s : float
        Longest step between lines of velocities, s.
    """

    gap_s: float = 15.0
    reorder_s: float = 0.0
    max_step_s: float = 0.1


@dataclass
class Step:
    """One step of a file's clock: from ``start_s`` to ``end_s``, which stands at ``line``."""

    start_s: float
    end_s: float
    line: int
    moving: bool = False

    @property
    def length_s(self) -> float:
        """How long it is."""
        return self.end_s - self.start_s


@dataclass
class Repeated:
    """One value of a source that comes again and again."""

    lines: int = 0
    first_line: int = 0
    jumps: list[float] = field(default_factory=list)


class SourceSeen:
    """What a source's ranges look like."""

    def __init__(self) -> None:
        self.lines = 0
        self.low_m = math.inf
        self.high_m = -math.inf
        self.repeated: dict[float, Repeated] = {}
        self.same_time = 0
        self._steps: list[float] = []
        self._last = (math.nan, math.nan)

    def add(self, time_s: Rows, range_m: Rows, line: npt.NDArray[np.intp]) -> None:
        """Take the next ranges."""
        self.lines += len(range_m)
        self.low_m = min(self.low_m, float(range_m.min()))
        self.high_m = max(self.high_m, float(range_m.max()))
        before = np.concatenate([[self._last[1]], range_m[:-1]])
        self.same_time += int((np.diff(time_s, prepend=self._last[0]) == 0).sum())
        change = np.abs(range_m - before)
        moved = change[change > 0]
        if len(moved):
            self._steps.append(float(np.median(moved)))
        values, counts = np.unique(range_m, return_counts=True)
        often = (counts > 1) | np.isin(values, CODES) | np.isin(values, list(self.repeated))
        often |= values == self._last[1]
        order = np.argsort(-counts[often], kind="stable")[:100]
        for value in values[often][order].tolist():
            here = range_m == value
            seen = self.repeated.setdefault(value, Repeated(0, int(line[np.argmax(here)])))
            seen.lines += int(here.sum())
            away = change[(here != (before == value)) & np.isfinite(before)]
            seen.jumps += away[: 100 - len(seen.jumps)].tolist()
        if len(self.repeated) > 1000:  # memory stays bounded
            most = sorted(self.repeated.items(), key=lambda item: -item[1].lines)[:500]
            self.repeated = dict(most)
        self._last = (float(time_s[-1]), float(range_m[-1]))

    def codes(self) -> Iterator[tuple[float, Repeated]]:
        """Give the values that stand for "no echo"."""
        usual = float(np.median(self._steps)) if self._steps else 0.0
        for value, seen in self.repeated.items():
            known = value in CODES
            enough = CODE_LINES if known else max(REPEATED_LINES, REPEATED_SHARE * self.lines)
            if seen.lines < enough:
                continue
            jump = float(np.median(seen.jumps)) if seen.jumps else 0.0
            if value == 0 or jump > (0.5 * CODE_JUMP if known else CODE_JUMP) * max(usual, 1e-9):
                yield value, seen


class FileSeen:
    """What one file with times looks like."""

    def __init__(self, table: CsvTable, reorder_s: float) -> None:
        self.table = table
        self.name = table.name
        self.lines = 0
        self.first_s = math.nan
        self.last_s = math.nan
        self.back: Step | None = None  # the first line that is too old
        self.long: list[Step] = []  # the longest steps
        self.equal = 0
        self.first_equal: int | None = None
        self.sources: dict[int, SourceSeen] = {}
        self.path_m = 0.0
        self.corners = NOWHERE  # of leaders
        self._speeds: list[float] = []
        self._turns: list[float] = []
        self._medians: list[tuple[float, int]] = []
        self._newest = math.nan
        self._previous: Rows | None = None
        self._reorder_s = reorder_s

    @property
    def usual_step_s(self) -> float:
        """Usual time from one line to the next, s."""
        if not self._medians:
            return math.nan
        steps, counts = np.array(sorted(self._medians)).T
        at = np.searchsorted(np.cumsum(counts), 0.5 * counts.sum())
        return float(steps[min(int(at), len(steps) - 1)])

    @property
    def usual_turn_rad_s(self) -> float:
        """Usual rate of turning, rad/s."""
        return float(np.median(self._turns)) if self._turns else 0.0

    @property
    def usual_speed_m_s(self) -> float:
        """Usual speed of increments, m/s."""
        return float(np.median(self._speeds)) if self._speeds else 0.0

    @property
    def span_s(self) -> float:
        """From the first time to the last, s."""
        return self.last_s - self.first_s

    def add(self, rows: Rows, first: int) -> None:
        """Take the next rows, the first of which stands at line ``first``."""
        time = rows[:, 0]
        if math.isnan(self.first_s):
            self.first_s = self.last_s = self._newest = float(time[0])
        self.lines += len(rows)
        newest = np.maximum.accumulate(np.concatenate([[self._newest], time]))
        late = np.flatnonzero(newest[:-1] - time > self._reorder_s)
        if len(late) and self.back is None:
            k = int(late[0])
            self.back = Step(float(newest[k]), float(time[k]), first + k)
        self.last_s = self._newest = float(newest[-1])
        whole = rows if self._previous is None else np.concatenate([self._previous, rows])
        start = first - (len(whole) - len(rows))
        self._steps(whole, start, newest)
        if "source" in self.table.names and "range_m" in self.table.names:
            for source in np.unique(rows[:, 1]).astype(int).tolist():
                mine = rows[:, 1] == source
                seen = self.sources.setdefault(source, SourceSeen())
                seen.add(time[mine], rows[mine, 2], first + np.flatnonzero(mine))
        if self.name == "leaders.csv":
            self.corners = _around(self.corners, rows[:, 2:4])
        self._previous = rows[-1:]

    def _steps(self, rows: Rows, first: int, newest: Rows) -> None:
        step = np.diff(np.maximum(rows[:, 0], newest[: len(rows)]))
        step = np.maximum(step, 0.0)
        if len(step) == 0:
            return
        moving = np.zeros(len(step), bool)
        if self.name == "odometry.csv":
            moving = self._drive(rows, step)
        if "heading_rad" in self.table.names:
            turned = np.angle(np.exp(1j * np.diff(self.table.column(rows, "heading_rad"))))
            self._turns += _middle(np.abs(turned)[step > 0] / step[step > 0])
        # Several leaders stand at one time.
        counted = step[step > 0] if self.name == "leaders.csv" else step
        if len(counted):
            self._medians.append((float(np.median(counted)), len(counted)))
        equal = np.flatnonzero(step == 0)
        self.equal += len(equal)
        if len(equal) and self.first_equal is None:
            self.first_equal = first + 1 + int(equal[0])
        for k in np.argsort(-step, kind="stable")[:_KEPT].tolist():
            end = float(rows[k + 1, 0])
            self.long.append(Step(end - float(step[k]), end, first + 1 + k, bool(moving[k])))
        self.long = sorted(self.long, key=lambda one: -one.length_s)[:_KEPT]

    def _drive(self, rows: Rows, step: Rows) -> Any:
        """Add up what the odometry says; whether the craft moves during each step."""
        known = step > 0
        table = self.table
        if "forward_m" in table.names:
            length = np.hypot(rows[1:, 1], table.column(rows[1:], "left_m", 0.0))
            self.path_m += float(length.sum())
            turned = table.column(rows[1:], "turn_rad", 0.0)
            self._turns += _middle(np.abs(turned)[known] / step[known])
            # An increment says what the craft did all through its step, unless it is far too short.
            usual = float(np.median(length[known] / step[known])) if known.any() else 0.0
            self._speeds.append(usual)
            return length < 0.25 * usual * step
        self.path_m += float((np.abs(rows[:-1, 1]) * step).sum())
        sideways = table.column(rows, "left_m_s", 0.0)
        rate = table.column(rows, "yaw_rate_rad_s", 0.0)
        self._turns += _middle(np.abs(rate[1:]))
        return (rows[:-1, 1] != 0) | (rate[:-1] != 0) | (sideways[:-1] != 0)

    def document(self) -> dict[str, Any]:
        """For JSON."""
        longest = self.long[0] if self.long else None
        made: dict[str, Any] = {
            "lines": self.lines,
            "first_s": self.first_s,
            "last_s": self.last_s,
            "usual_step_s": self.usual_step_s,
            "longest_step_s": longest.length_s if longest else None,
            "longest_step_line": longest.line if longest else None,
        }
        if self.sources:
            made["sources"] = {
                str(source): {"lines": seen.lines, "low_m": seen.low_m, "high_m": seen.high_m}
                for source, seen in sorted(self.sources.items())
            }
        return made


def _around(corners: Rows, places: Rows) -> Rows:
    """Widen a box by these places."""
    return np.array([np.minimum(corners[0], places.min(0)), np.maximum(corners[1], places.max(0))])


def _middle(values: Rows) -> list[float]:
    return [float(np.median(values))] if len(values) else []


@dataclass
class Survey:
    """What a log's files show.

    Attributes
    ----------
    files : dict of str to FileSeen
        Those with times.
    findings : list of Finding
        What is wrong with them.
    """

    files: dict[str, FileSeen]
    findings: list[Finding]

    def refuse(self, log: LogFolder, limits: Limits) -> None:
        """End a replay that cannot be right, before it writes.

        Raises
        ------
        LogError
            If the odometry has no line, or velocities would be gone through in more than
            :data:`STEPS_PER_LINE` steps per line of the log.
        """
        if "odometry.csv" not in self.files:
            return
        odometry = self.files["odometry.csv"]
        if odometry.lines == 0:
            raise LogError(
                odometry.table.path,
                "has no line below the header: the craft would stand still",
                cause="no_odometry",
            )
        if "forward_m" in odometry.table.names:
            return
        moved = [seen for name, seen in self.files.items() if name != "leaders.csv" and seen.lines]
        first = min(seen.first_s for seen in moved)
        last = max(seen.last_s for seen in moved)
        lines = sum(seen.lines for seen in moved)
        if last - first > STEPS_PER_LINE * lines * limits.max_step_s:
            causes = [one for one in self.findings if one.verdict == "not_trusted"]
            why = f" {causes[0].text}" if causes else " Do all files have one clock, in seconds?"
            raise LogError(
                log["odometry.csv"].path,
                f"{lines} lines over {short(last - first, 4)} s: more than {STEPS_PER_LINE} steps "
                f"of {limits.max_step_s:g} s for each line.{why}",
                column="time_s",
                cause=causes[0].cause if causes else "clocks_apart",
            )


def survey(log: LogFolder, limits: Limits) -> Survey:
    """Read the files of a log, all but its truth, and say what they show.

    Raises
    ------
    LogError
        If one cannot be read.
    """
    files = {}
    for name, table in log.tables.items():
        if "time_s" not in table.names or name in TRUTHS or name == "masters.csv":
            continue  # what is told of masters has one time, not a clock
        files[name] = FileSeen(table, limits.reorder_s)
        for rows, first in table.chunks():
            files[name].add(rows, first)
    read = {table.path.name for table in log.tables.values()}
    found = [*ignored_files(log.path, read), *_ignored_columns(log)]
    units = list(_units(files, limits))
    found += units
    found += _clocks(files)
    if not any(one.verdict == "not_trusted" for one in units):
        found += _gaps(files, limits)
    found += _sources(files)
    found += _places(log, files)
    return Survey(files, found + list(_origin(log)))


def from_error(error: LogError) -> Finding:
    """Make a finding of what ended the reading."""
    file = "" if error.path.is_dir() else error.path.name
    message = str(error).removeprefix(f"{error.path}, line {error.line}").removeprefix(
        str(error.path)
    )  # fmt: skip
    return finding(error.cause, message.lstrip(",: "), file=file, line=error.line)


def _ignored_columns(log: LogFolder) -> Iterator[Finding]:
    """Name the columns that are of no use."""
    for table in log.tables.values():
        others = [one for one in log.tables.values() if one.path == table.path]
        unused = [name for name in table.ignored if all(name in one.ignored for one in others)]
        if table is not others[0]:  # said already
            continue
        turned: list[str] = []
        if table.name == "odometry.csv" and "compass.csv" in log:
            turned = sorted({"turn_rad", "yaw_rate_rad_s", "heading_rad"} & set(table.names))
            unused = [*unused, *turned]
        if unused:
            more = "; compass.csv says how the craft turns" if turned else ""
            message = f"not read: {', '.join(unused)}{more}"
            yield finding("ignored_column", message, file=table.path.name, line=1)


def ignored_files(folder: Path, read: Collection[str] = ()) -> Iterator[Finding]:
    """Name the tables in a log's folder that no log has, beside those that are read."""
    for path in sorted(folder.iterdir()):
        table = path.suffix.lower() in (".csv", ".tsv", ".txt", ".dat")
        if path.name in read:
            continue
        if path.name in FILES or not table or path.name.startswith(".") or not path.is_file():
            continue
        stems = [name.removesuffix(".csv") for name in FILES]
        meant = difflib.get_close_matches(path.stem.lower(), stems, 1, NEAR_NAME)
        hint = " (auvest check --layout lists them)"
        if meant:
            hint = f"; is it meant to be {meant[0]}.csv?"
        message = f"is not read: no file of a log has that name{hint}"
        yield finding("ignored_file", message, file=path.name)


def _units(files: dict[str, FileSeen], limits: Limits) -> Iterator[Finding]:
    for name, seen in files.items():
        if seen.lines > 2 and seen.usual_turn_rad_s > FAST_TURN_RAD_S:
            message = f"the craft would turn by {seen.usual_turn_rad_s:.3g} rad/s: degrees?"
            yield finding("degrees", message, file=name)
        step = seen.usual_step_s
        # Lines of one time are of several sources, known or not.
        several = "source" in seen.table.names or name == "echoes.csv"
        if seen.lines > 2 and seen.equal > 0.5 * (seen.lines - 1) and not several:
            message = f"{seen.equal} of {seen.lines} lines have the time of the line before"
            yield finding("times_equal", message, file=name, line=seen.first_equal)
            continue
        same = sum(one.same_time for one in seen.sources.values())
        if seen.lines > 2 and same > 0.5 * (seen.lines - len(seen.sources)):
            message = f"{same} of {seen.lines} lines have the time of the source's line before"
            yield finding("times_equal", message, file=name, line=seen.first_equal)
            continue
        if name == "odometry.csv" and seen.lines > 2:
            velocities = "forward_m" not in seen.table.names
            slow = velocities and step > max(SLOW_ODOMETRY_S, limits.gap_s)
            crawl = not velocities and seen.path_m < SLOW_M_S * seen.span_s and seen.path_m > 5
            if slow or (crawl and step > 5):
                yield _thousandths(name, step, seen)
                continue
            if seen.usual_speed_m_s > FAST_M_S:
                message = (
                    f"the craft would move at {seen.usual_speed_m_s:.3g} m/s: millimetres or "
                    "centimetres for metres?"
                )
                yield finding("millimetres", message, file=name)
        if name == "fixes.csv" and seen.lines > 2 and step > SLOW_FIXES_S:
            reach = max(one.high_m - one.low_m for one in seen.sources.values())
            if 1 < reach < SLOW_M_S * seen.span_s * len(seen.sources):
                yield _thousandths(name, step, seen)


def _thousandths(name: str, step: float, seen: FileSeen) -> Finding:
    units = (("milliseconds", 1e-3), ("microseconds", 1e-6), ("nanoseconds", 1e-9))
    unit, size = units[(step > 6e4) + (step > 6e7)]
    message = (
        f"lines are {short(step, 4)} s apart, {short(seen.span_s, 4)} s in all: {unit} for "
        f"seconds? Then they are {short(step * size)} s apart"
    )
    cause = "milliseconds" if unit == "milliseconds" else "microseconds"
    return finding(cause, message, file=name, line=2)


def _clocks(files: dict[str, FileSeen]) -> Iterator[Finding]:
    for name, seen in files.items():
        if seen.back is not None and -seen.back.length_s > BACK_S:
            by = -seen.back.length_s
            message = f"the clock goes back by {short(by, 4)} s, to {seen.back.end_s:.10g} s"
            yield finding("clock_jump", message, file=name, line=seen.back.line)
    main = _main(files)
    if main is None or main.lines < 2:
        return
    for name, other in files.items():
        if other is main or other.lines < 2:
            continue
        apart = max(other.first_s, main.first_s) - min(other.last_s, main.last_s)
        ratio = (other.span_s / main.span_s) if main.span_s > 0 else math.inf
        if apart <= 0 and 0.01 < ratio < 100:
            continue
        file, times = (name, ratio) if ratio > 1 else (main.name, 1 / max(ratio, 1e-12))
        cause = "clocks_apart"
        if 300 < times < 3000:
            cause = "milliseconds"
        elif 3e5 < times < 3e6:
            cause = "microseconds"
        message = (
            f"{name} goes from {other.first_s:.10g} to {other.last_s:.10g}, {main.name} from "
            f"{main.first_s:.10g} to {main.last_s:.10g}: one clock, in seconds?"
        )
        yield finding(cause, message, file=file, line=2)


def _main(files: dict[str, FileSeen]) -> FileSeen | None:
    """Give the file that has the clock of the log."""
    names = ("odometry.csv", "fixes.csv", "positions.csv")
    return next((files[name] for name in names if name in files), None)


def _gaps(files: dict[str, FileSeen], limits: Limits) -> Iterator[Finding]:
    odometry = files.get("odometry.csv")
    main = _main(files)
    if main is None:
        return
    jumps = [step for step in main.long if _is_jump(step, files)]
    for step in sorted(jumps, key=lambda one: one.line)[:3]:
        message = (
            f"no file has a line from {step.start_s:.10g} to {step.end_s:.10g} s: did the clock "
            "jump, or was the recorder off?"
        )
        yield finding("clock_jump", message, file=main.name, line=step.line)
    if odometry is None:
        return
    for step in sorted(odometry.long, key=lambda one: one.line):
        if step not in jumps and step.moving and step.length_s > limits.gap_s:
            message = (
                f"no line for {short(step.length_s)} s while the craft moves; a velocity holds for "
                f"{limits.gap_s:g} s"
            )
            yield finding("odometry_gap", message, file="odometry.csv", line=step.line)


def _is_jump(step: Step, files: dict[str, FileSeen]) -> bool:
    """Whether all files are silent, for much longer than usual, and the craft did not stand."""
    if step.length_s < SILENCE_S or ("odometry.csv" in files and not step.moving):
        return False
    for seen in files.values():
        if seen.lines < 3:
            continue
        if step.length_s < JUMP_STEPS * seen.usual_step_s:
            return False
        if seen.first_s >= step.end_s or seen.last_s <= step.start_s:
            continue
        if not any(
            one.start_s <= step.start_s + seen.usual_step_s + 1
            and one.end_s >= step.end_s - 1
            and one.length_s > 0.5 * step.length_s
            for one in seen.long
        ):
            return False
    return True


def _sources(files: dict[str, FileSeen]) -> Iterator[Finding]:
    names = ("ranges.csv", "fixes.csv", "positions.csv", "echoes.csv")
    measured = [files[name] for name in names if name in files]
    if not any(seen.lines for seen in measured):
        yield finding("no_measurements", "has no line below the header", file=measured[0].name)
    if "odometry.csv" in files and files["odometry.csv"].lines == 0:
        yield finding("no_odometry", "has no line below the header", file="odometry.csv")
    for seen in measured:
        for source, one in sorted(seen.sources.items()):
            for value, repeated in one.codes():
                message = (
                    f"source {source}: {value:g} m stands in {repeated.lines} of {one.lines} "
                    "lines: a code for 'no echo'? Leave such lines out"
                )
                yield finding("no_echo", message, file=seen.name, line=repeated.first_line)


def _places(log: LogFolder, files: dict[str, FileSeen]) -> Iterator[Finding]:
    measured = files.get("ranges.csv") or files.get("fixes.csv")
    if measured is None or len(measured.sources) < 2:
        return
    corners = files["leaders.csv"].corners if "leaders.csv" in files else NOWHERE
    beacons = [place for source, place in log.beacons().items() if source in measured.sources]
    if beacons:
        corners = _around(corners, np.array(beacons))
    apart = float(np.hypot(*(corners[1] - corners[0])))
    usual = float(np.mean([0.5 * (one.low_m + one.high_m) for one in measured.sources.values()]))
    if apart < ONE_PLACE * usual:
        message = (
            f"all sources lie within {apart:.2g} m, {usual:.3g} m from the craft: degrees or "
            "kilometres for metres?"
        )
        file = "leaders.csv" if "leaders.csv" in files else "beacons.csv"
        yield finding("lengths_apart", message, file=file, verdict="doubtful")


def _origin(log: LogFolder) -> Iterator[Finding]:
    origin = local_origin(log)
    if origin is not None:
        message = (
            f"coordinates are far from (0, 0): ({origin[0]:.0f}, {origin[1]:.0f}) m is subtracted "
            "as a local origin; results are in the log's coordinates"
        )
        yield finding("local_origin", message)
    earth = log.frame.origin
    if earth is not None and "origin.csv" not in log:
        message = (
            f"x and y count from latitude {earth[0]:.7f}, longitude {earth[1]:.7f} (deg), the "
            "first place of the log; origin.csv would say another"
        )
        yield finding("earth_origin", message)
