"""Bringing the files of a log together in the order of time, a chunk at a time.

The order of lines in a file is the order in which things were recorded. A line may be late, that
is, older than one before it: within a window it is put in its place, beyond that it is counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from auvest.logs.reader import CsvTable, LogError, Rows

#: So many lines are remembered of those that came too late.
LINES_KEPT = 5


@dataclass
class Late:
    """What became of late lines.

    Attributes
    ----------
    reordered : int
        Lines that were late and were put in their place.
    dropped : int
        Lines that were later than the window allows, and could not be used.
    lines : list of int
        The first of the dropped, by line number.
    """

    reordered: int = 0
    dropped: int = 0
    lines: list[int] = field(default_factory=list)


class Stream:
    """The rows of one file in the order of time.

    Parameters
    ----------
    table : CsvTable
        The file; its first column is the time.
    reorder_s : float
        How late a line may be, s.
    required : bool
        True: a line that is later than that is an error, because nothing after it would be right.
        False: it is counted.
    """

    def __init__(self, table: CsvTable, *, reorder_s: float, required: bool) -> None:
        self.table = table
        self.late = Late()
        self.horizon = -math.inf  # all rows before this time are known
        self._reorder_s = reorder_s
        self._required = required
        self._chunks = table.chunks()
        self._newest = -math.inf
        self._waiting: Rows = np.empty((0, len(table.columns)))

    def advance(self) -> None:
        """Read one chunk more; moves the horizon."""
        chunk = next(self._chunks, None)
        if chunk is None:
            self.horizon = math.inf
            return
        rows, first = chunk
        time = rows[:, 0]
        newest = np.maximum.accumulate(np.concatenate([[self._newest], time]))
        behind = newest[:-1] - time
        dropped = behind > self._reorder_s
        if dropped.any():
            self._note(rows, behind, dropped, first)
            rows, behind = rows[~dropped], behind[~dropped]
        self.late.reordered += int((behind > 0).sum())
        self._newest = float(newest[-1])
        self.horizon = self._newest - self._reorder_s
        waiting = np.concatenate([self._waiting, rows])
        self._waiting = waiting[np.argsort(waiting[:, 0], kind="stable")]

    def take(self, before: float) -> Rows:
        """Give, and forget, the rows before that time."""
        count = int(np.searchsorted(self._waiting[:, 0], before, side="left"))
        taken, self._waiting = self._waiting[:count], self._waiting[count:]
        return taken

    def _note(self, rows: Rows, behind: Rows, dropped: npt.NDArray[np.bool_], first: int) -> None:
        lines = (np.flatnonzero(dropped) + first).tolist()
        if self._required:
            i = lines[0] - first
            raise LogError(
                self.table.path,
                f"{rows[i, 0]:.10g} is {behind[i]:.3g} s older than a line before it, and the "
                f"window for late lines is {self._reorder_s:g} s: shuffled?",
                line=lines[0],
                column="time_s",
            )
        self.late.dropped += len(lines)
        self.late.lines += lines[: LINES_KEPT - len(self.late.lines)]


def merge(streams: Mapping[str, Stream]) -> Iterator[tuple[dict[str, Rows], float]]:
    """Give the rows of all files up to a common time, again and again until all are read.

    Parameters
    ----------
    streams : mapping of str to Stream
        The files.

    Yields
    ------
    (dict of str to ndarray, float)
        The new rows of each file, and the time (s) before which nothing is missing; infinity at
        the end.
    """
    while True:
        slowest = min(streams.values(), key=lambda stream: stream.horizon)
        if slowest.horizon == math.inf:
            return
        slowest.advance()
        horizon = min(stream.horizon for stream in streams.values())
        if horizon > -math.inf:
            yield {name: stream.take(horizon) for name, stream in streams.items()}, horizon
