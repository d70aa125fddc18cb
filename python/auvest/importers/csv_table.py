"""Tables with a header and a time for each row, as loggers of people's own scripts leave them.

Water Linked's loggers write such tables: velocities of the DVL, positions of Underwater GPS.
"""

from __future__ import annotations

import csv
from collections.abc import Container, Iterator
from pathlib import Path
from typing import ClassVar

from auvest._texts import other_cells
from auvest.importers.recording import Message, Recording, nanoseconds, text_lines, value_of
from auvest.logs.reader import CARRIAGE_RETURN

#: Columns that hold the time in seconds, the first of them that a table has.
_TIMES = ("timestamp", "timestamp_abs", "time_s", "t")


class CsvTableRecording(Recording):
    """A table; its one topic is named by the columns it has, else ``row``."""

    name: ClassVar[str] = "csv"
    title: ClassVar[str] = "CSV table with a header"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        """See :class:`Recording`."""
        header = head.partition(b"\n")[0]
        return path.suffix.lower() == ".csv" and b"," in header

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        names: list[str] = []
        blank = rows = 0
        for number, line, ended in text_lines(self.path):
            where = f"line {number}"
            if not line.strip():
                blank = blank or number
                continue
            if blank:
                raise self.error(f"line {blank}", "is blank, and rows follow")
            if not ended:
                raise self.error(where, "does not end with a line end: truncated")
            try:
                (cells,) = csv.reader([line], strict=True)
            except (csv.Error, ValueError) as error:
                why = CARRIAGE_RETURN if "\r" in line else f"is no row of cells: {error}"
                raise self.error(where, why) from None
            if not names:
                names = self._header([cell.strip() for cell in cells])
                topic = _topic(set(names))
                clock = next((names.index(time) for time in _TIMES if time in names), None)
                continue
            if len(cells) != len(names):
                raise self.error(where, other_cells(len(cells), len(names)))
            rows += 1
            if rows == 1 and clock is not None and _other_unit(cells[clock]):
                clock = None  # a mapping says which
            if topics is None or topic in topics:
                time_ns = None if clock is None else nanoseconds(cells[clock])
                if clock is not None and time_ns is None:
                    shown = cells[clock].strip()[:40]
                    raise self.error(where, f"{names[clock]} is {shown!r}, which is no time in s")
                yield Message(
                    topic, time_ns, dict(zip(names, map(value_of, cells), strict=True)), where
                )
        if not names:
            raise self.error("line 1", "has no header")

    def _header(self, names: list[str]) -> list[str]:
        for name in names:
            if not name or value_of(name) != name:
                raise self.error("line 1", f"{name!r} is not the name of a column")
            if names.count(name) > 1:
                raise self.error("line 1", f"has the column {name} twice")
        return names


def _other_unit(cell: str) -> bool:
    """Whether a time is a number, but not of seconds."""
    return isinstance(value_of(cell), (int, float)) and nanoseconds(cell) is None


def _topic(names: set[str]) -> str:
    if {"vx", "vy", "vz", "velocity_valid"} <= names:
        return "velocity"
    if {"position_valid", "x", "y", "z"} <= names:
        return "position"
    if {"range", "east", "north", "up"} <= names:
        return "usbl"
    return "row"
