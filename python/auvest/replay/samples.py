"""A table that keeps at most so many rows, one of each k, however many pass through it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from auvest.replay.tables import Columns

#: Points of one curve that a reader who zooms in can still tell apart, in a page of some megabytes.
LIMIT = 10_000


class Samples:
    """One of every k rows in a row, k doubling as they grow.

    Which of the k is drawn by lot, the same however the rows come: a row at equal distances would
    be of the same source each time where several take their turns.

    Parameters
    ----------
    columns : tuple of str
        Names of the columns.
    limit : int, optional
        How many rows at most, or up to twice as many; default: as many as a figure shows.
    """

    def __init__(self, columns: tuple[str, ...], limit: int | None = None) -> None:
        self._limit = LIMIT if limit is None else limit
        self._parts: list[Columns] = [{name: np.empty(0) for name in columns}]
        self._numbers: list[npt.NDArray[np.int64]] = [np.empty(0, np.int64)]  # of these rows
        self._doublings = 0
        self._seen = 0
        self._kept = 0

    def add(self, rows: Columns) -> None:
        """Take the next rows."""
        count = len(rows["time_s"])
        taken = np.arange(count)
        for doubling in range(1, self._doublings + 1):
            taken = taken[_drawn(self._seen + taken, doubling)]
        self._parts.append({name: rows[name][taken].copy() for name in self._parts[0]})
        self._numbers.append(self._seen + taken)
        self._seen += count
        self._kept += len(taken)
        while self._kept > 2 * self._limit:
            self._doublings += 1
            numbers = np.concatenate(self._numbers)
            stay = _drawn(numbers, self._doublings)
            self._parts = [{name: values[stay] for name, values in self.columns().items()}]
            self._numbers = [numbers[stay]]
            self._kept = len(self._numbers[0])

    @property
    def stride(self) -> int:
        """Of how many rows one was kept."""
        return int(2**self._doublings)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Give what was kept."""
        parts = [part for part in self._parts if len(part["time_s"])] or self._parts[:1]
        return {name: np.concatenate([part[name] for part in parts]) for name in self._parts[0]}


def _drawn(numbers: npt.NDArray[np.int64], doubling: int) -> npt.NDArray[np.bool_]:
    """Say which rows stay at a doubling: of each two blocks side by side those in one."""
    second = (numbers >> (doubling - 1)) & 1
    # A hash of the number of the pair; its highest bit is the lot.
    lot = (numbers >> doubling).astype(np.uint64) + np.uint64(doubling << 40)
    lot *= np.uint64(0x9E3779B97F4A7C15)
    lot ^= lot >> np.uint64(32)
    lot *= np.uint64(0xD6E8FEB86659FD93)
    drawn: npt.NDArray[np.bool_] = second == (lot >> np.uint64(63)).astype(np.int64)
    return drawn
