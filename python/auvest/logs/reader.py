"""Strict reading of a log: every complaint names file, line and column.

Files are read in chunks, so that memory does not grow with their length.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt

from auvest._outputs import is_plain_file
from auvest.logs.layout import FILES, Column

Rows = npt.NDArray[np.float64]

#: Lines read at once: a few megabytes, and long enough that the cost of a chunk does not count.
CHUNK_LINES = 32768
#: More than any file has that is read as a whole: beacons.csv and start.csv.
SMALL_FILE_LINES = 100_000


class LogError(ValueError):
    """A log cannot be used as it is.

    Attributes
    ----------
    path : Path
        The file, or the folder if a file is missing.
    line : int or None
        Line of the file, counted from 1; None if the complaint is about the whole file.
    column : str or None
        Name of the column.
    cause : str
        What is wrong, one of :data:`auvest.logs.findings.CAUSES`.
    """

    def __init__(
        self,
        path: Path,
        message: str,
        *,
        line: int | None = None,
        column: str | None = None,
        cause: str = "unreadable",
    ) -> None:
        where = [str(path)]
        if line is not None:
            where.append(f"line {line}")
        if column is not None:
            where.append(f"column {column}")
        super().__init__(f"{', '.join(where)}: {message}")
        self.path = path
        self.line = line
        self.column = column
        self.cause = cause


class CsvTable:
    """One file of a log.

    Parameters
    ----------
    path : Path
        The file; its name says which columns it must have (:data:`auvest.logs.FILES`).

    Attributes
    ----------
    columns : tuple of Column
        The layout that the file has; rows come with their values in this order.
    bytes : int
        Size of the file.
    bytes_read : int
        How much of it was read so far.

    Raises
    ------
    LogError
        If the file cannot be read or its header is not one of the layouts.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            if path.exists() and not is_plain_file(path):  # a pipe would be waited for
                raise LogError(path, "is not a file")
            self.bytes = path.stat().st_size
            with path.open(encoding="utf-8-sig", newline="\n") as file:
                header = file.readline()
        except OSError as error:
            raise LogError(path, f"cannot be read: {error.strerror or error}") from None
        except UnicodeDecodeError:
            raise LogError(path, "is not UTF-8 text") from None
        self.bytes_read = 0
        self._refuse_separator(header)
        names = [name.strip() for name in header.rstrip("\r\n").split(",")]
        self.columns = self._match(names)
        self._order = [names.index(column.name) for column in self.columns]
        self._in_order = self._order == list(range(len(names)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    def chunks(self) -> Iterator[tuple[Rows, int]]:
        """Give the rows (n, columns) and the line number of the first, chunk by chunk.

        Raises
        ------
        LogError
            At the first line that is not what the layout says.
        """
        line = 2
        blank: list[str] = []  # such lines at the end of the file are none, others are errors
        try:
            with self.path.open(encoding="utf-8-sig", newline="\n") as file:
                self.bytes_read = len(file.readline())
                while chunk := list(islice(file, CHUNK_LINES)):
                    self.bytes_read += sum(map(len, chunk))
                    lines, blank = _without_blank_end(blank + chunk)
                    if lines:
                        yield self._parse(lines, line), line
                        line += len(lines)
        except OSError as error:
            raise LogError(self.path, f"cannot be read: {error.strerror or error}") from None
        except UnicodeDecodeError:
            raise LogError(self.path, f"is not UTF-8 text after line {line - 1}") from None

    def whole(self) -> Rows:
        """All rows of a small file.

        Raises
        ------
        LogError
            As ``chunks``, or if the file has more than :data:`SMALL_FILE_LINES` lines.
        """
        parts = []
        for rows, line in self.chunks():
            if line - 1 + len(rows) > SMALL_FILE_LINES:
                raise LogError(self.path, f"has more than {SMALL_FILE_LINES} lines")
            parts.append(rows)
        return np.concatenate(parts) if parts else np.empty((0, len(self.columns)))

    def line_of(self, time_s: float, occurrence: int) -> int | None:
        """Line at which a time stands for the n-th time, to name it in an error."""
        for rows, first in self.chunks():
            found = np.flatnonzero(rows[:, 0] == time_s)
            if len(found) >= occurrence:
                return first + int(found[occurrence - 1])
            occurrence -= len(found)
        return None

    def _refuse_separator(self, header: str) -> None:
        for mark, name in ((";", "semicolons"), ("\t", "tabs")):
            if mark in header and "," not in header:
                raise LogError(
                    self.path,
                    f"cells are parted by {name}; the separator is a comma, and the decimal mark a "
                    "point",
                    line=1,
                    cause="separator",
                )

    def _match(self, names: list[str]) -> tuple[Column, ...]:
        layouts = FILES[self.path.name]
        for layout in layouts:
            if sorted(names) == sorted(column.name for column in layout):
                return layout
        known = {column.name for layout in layouts for column in layout}
        for name in names:
            stem = name.split("_")[0]
            meant = [other for other in sorted(known) if other.split("_")[0] == stem]
            if name not in known and meant:
                raise LogError(
                    self.path, f"its unit is not known here; expected {meant[0]}", line=1,
                    column=name,
                )  # fmt: skip
        expected = " or ".join(",".join(column.name for column in layout) for layout in layouts)
        raise LogError(self.path, f"the header must be {expected}, not {','.join(names)}", line=1)

    def _parse(self, lines: list[str], first: int) -> Rows:
        if not lines[-1].endswith("\n"):
            raise LogError(
                self.path, "does not end with a line end: truncated", line=first + len(lines) - 1
            )
        rows: Rows = np.empty((0, 0))
        with suppress(ValueError):
            rows = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2)
        if rows.shape != (len(lines), len(self.columns)):
            rows = np.array([self._parse_line(text, first + i) for i, text in enumerate(lines)])
        if not self._in_order:
            rows = rows[:, self._order]
        self._check(rows, first)
        return rows

    def _parse_line(self, text: str, line: int) -> list[float]:
        cells = text.rstrip("\r\n").split(",")
        if len(cells) != len(self.columns):
            comma = len(cells) > len(self.columns) and all(map(_digits, cells))
            why = "decimal commas?" if comma else "truncated?"
            raise LogError(
                self.path, f"{len(cells)} cells, expected {len(self.columns)}: {why}",
                line=line, cause="decimal_comma" if comma else "unreadable",
            )  # fmt: skip
        values = []
        for k, cell in enumerate(cells):
            try:
                values.append(float(cell.replace("_", "?")))  # 1_000 is Python's, not a number
            except ValueError:
                name = self.columns[self._order.index(k)].name
                what = f"{cell.strip()!r} is not a number" if cell.strip() else "is empty"
                raise LogError(self.path, what, line=line, column=name) from None
        return values

    def _check(self, rows: Rows, first: int) -> None:
        for k, column in enumerate(self.columns):
            values = rows[:, k]
            good = column.takes(values)
            if good.all():
                continue
            i = int(np.argmin(good))
            value = float(values[i])
            hint = f" ({column.suspicion})" if column.suspicion and math.isfinite(value) else ""
            missing = "; leave out the row where there is no measurement" if value != value else ""
            raise LogError(
                self.path,
                f"{value:.10g} is not {column.expected}{hint}{missing}",
                line=first + i,
                column=column.name,
                cause=_cause(column, value),
            )


def _without_blank_end(lines: list[str]) -> tuple[list[str], list[str]]:
    """Part lines where nothing but blank ones follow."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return lines[:end], lines[end:]


def _digits(cell: str) -> bool:
    """Whether a cell is what a decimal comma leaves of a number."""
    bare = cell.strip().strip('"').lstrip("+-")
    return bare.isdecimal() and bare.isascii()


def _cause(column: Column, value: float) -> str:
    """Say what a value beyond its column's limits is a sign of."""
    if not math.isfinite(value):
        return "unreadable"
    if column.name == "time_s":
        return "milliseconds" if abs(value) < 1e14 else "microseconds"
    return column.cause if value > 0 or column.low < 0 else "no_echo"


class LogFolder:
    """A log: the files of :data:`auvest.logs.FILES` that its folder has.

    Parameters
    ----------
    path : Path
        The folder.
    truth : bool
        False: truth.csv is left out where the run does not start from it.

    Raises
    ------
    LogError
        If it is not a folder with measurements: odometry.csv with ranges.csv, or fixes.csv, and
        beside them beacons.csv, leaders.csv or both.
    """

    def __init__(self, path: Path, *, truth: bool = True) -> None:
        self.path = path
        if not path.is_dir():
            raise LogError(path, "is not a folder; a log is a folder of CSV files (docs/logs.md)")
        names = [name for name in FILES if (path / name).exists()]
        if not truth and ("start.csv" in names or "fixes.csv" in names):
            names = [name for name in names if name != "truth.csv"]
        self.tables = {name: CsvTable(path / name) for name in names}
        if "fixes.csv" not in self and "ranges.csv" not in self:
            raise LogError(path, "has neither ranges.csv nor fixes.csv")
        if "fixes.csv" in self and "ranges.csv" in self:
            raise LogError(path, "has ranges.csv and fixes.csv; one log is for one filter")
        if "ranges.csv" in self and "odometry.csv" not in self:
            raise LogError(path, "has ranges.csv but no odometry.csv", cause="no_odometry")
        if "fixes.csv" in self and "odometry.csv" in self:
            raise LogError(path, "has fixes.csv and odometry.csv; a tracked craft tells nothing")
        if "beacons.csv" not in self and "leaders.csv" not in self:
            raise LogError(path, "has neither beacons.csv nor leaders.csv: where are the sources?")

    def __contains__(self, name: object) -> bool:
        return name in self.tables

    def __getitem__(self, name: str) -> CsvTable:
        return self.tables[name]

    @property
    def tracking(self) -> bool:
        """True if fixes of a craft are recorded, False if its own odometry and ranges are."""
        return "fixes.csv" in self

    def beacons(self) -> dict[int, tuple[float, float]]:
        """Give the positions (m) of the sources that do not move."""
        if "beacons.csv" not in self:
            return {}
        table = self["beacons.csv"]
        places: dict[int, tuple[float, float]] = {}
        for k, (source, x, y) in enumerate(table.whole().tolist()):
            if int(source) in places:
                raise LogError(
                    table.path, f"source {int(source)} is there twice", line=k + 2, column="source"
                )
            places[int(source)] = (x, y)
        return places
