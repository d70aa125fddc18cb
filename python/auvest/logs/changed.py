"""A log whose rows are changed as they are read: another origin, or a mistake undone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from auvest.logs import reader
from auvest.logs.layout import FILES, Column
from auvest.logs.reader import CsvTable, LogFolder, Rows

#: Takes rows of a file, which it must not change in place, and gives others.
Change = Callable[[Rows], Rows]


class ChangedTable(CsvTable):
    """A file of a log seen through a change of its rows.

    Parameters
    ----------
    table : CsvTable
        The file.
    change : callable
        What becomes of its rows.
    """

    def __init__(self, table: CsvTable, change: Change) -> None:
        self.path, self.name, self.columns = table.path, table.name, table.columns
        self.ignored, self.bytes, self.bytes_read = table.ignored, table.bytes, 0
        self._table = table
        self._change = change

    def chunks(self) -> Iterator[tuple[Rows, int]]:
        """Give the changed rows, chunk by chunk."""
        for rows, line in self._table.chunks():
            self.bytes_read = self._table.bytes_read
            yield self._change(rows), line


class HeldTable(CsvTable):
    """Rows of a file of a log in memory.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        Which file of a log it is.
    columns : tuple of Column
        Its layout.
    rows : ndarray
        The rows.
    """

    def __init__(self, path: Path, name: str, columns: tuple[Column, ...], rows: Rows) -> None:
        self.path, self.name, self.columns = path, name, columns
        self.ignored, self.bytes, self.bytes_read = [], rows.nbytes, 0
        self._rows = rows

    def chunks(self) -> Iterator[tuple[Rows, int]]:
        """Give the rows, chunk by chunk."""
        for k in range(0, len(self._rows), reader.CHUNK_LINES):
            yield self._rows[k : k + reader.CHUNK_LINES], 2 + k


class ChangedLog(LogFolder):
    """A log of which some files are changed as they are read.

    Parameters
    ----------
    log : LogFolder
        The log.
    changes : mapping of str to callable
        What becomes of the rows of a file, by its name; files that the log has not do not matter.
    """

    def __init__(self, log: LogFolder, changes: Mapping[str, Change]) -> None:
        self.path, self.frame = log.path, log.frame
        self.tables = {
            name: ChangedTable(table, changes[name]) if name in changes else table
            for name, table in log.tables.items()
        }


class HeldLog(LogFolder):
    """The beginning of a log in memory, for many runs; without its truth.

    Parameters
    ----------
    log : LogFolder
        The log.
    lines : int
        How many lines of each file.
    measurements : int
        A log of which a file has more of them ends with that one.
    start : tuple of float, optional
        Time, x, y and heading of the start, where the log has no file that says so.
    """

    def __init__(
        self,
        log: LogFolder,
        lines: int,
        measurements: int,
        start: tuple[float, ...] | None = None,
    ) -> None:
        self.path, self.frame = log.path, log.frame
        held = {
            name: _first(table, lines)
            for name, table in log.tables.items()
            if name not in reader.TRUTHS
        }
        measured = (
            held[name] for name in ("ranges.csv", "fixes.csv", "positions.csv") if name in held
        )
        end_s = max(
            (float(rows[measurements - 1, 0]) for rows in measured if len(rows) > measurements),
            default=math.inf,
        )
        for name, rows in held.items():
            if "time_s" in log[name].names:
                held[name] = rows[rows[:, 0] <= end_s]
        self.tables = {
            name: HeldTable(log[name].path, name, log[name].columns, rows)
            for name, rows in held.items()
        }
        said = self.tables.get("start.csv")
        if start is not None and (said is None or "heading_rad" not in said.names):
            columns = FILES["start.csv"][0].columns
            rows = np.array([start], dtype=np.float64)
            path = log.path / "start.csv"
            self.tables["start.csv"] = HeldTable(path, "start.csv", columns, rows)


def _first(table: CsvTable, lines: int) -> Rows:
    parts = [np.empty((0, len(table.columns)))]
    for rows, _ in table.chunks():
        parts.append(rows[:lines])
        lines -= len(rows)
        if lines <= 0:
            break
    return np.concatenate(parts)


def columns_changed(columns: Mapping[int, Callable[[Rows], npt.ArrayLike]]) -> Change:
    """Make a change that computes columns, by number, from the rows as they were."""

    def change(rows: Rows) -> Rows:
        made = rows.copy()
        for column, compute in columns.items():
            made[:, column] = compute(rows)
        return made

    return change
