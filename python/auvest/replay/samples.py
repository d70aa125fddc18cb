"""A table that keeps at most so many rows, evenly taken, however many pass through: for figures."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from auvest.replay.tables import Columns

#: Points of one curve that a reader who zooms in can still tell apart, in a page of some megabytes.
LIMIT = 10_000


class Samples:
    """Every k-th row of all that were added, k doubling as they grow.

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
        self._stride = 1
        self._seen = 0
        self._kept = 0

    def add(self, rows: Columns) -> None:
        """Take the next rows."""
        count = len(rows["time_s"])
        first = -self._seen % self._stride
        self._seen += count
        part = {name: rows[name][first :: self._stride].copy() for name in self._parts[0]}
        self._parts.append(part)
        self._kept += len(part["time_s"])
        while self._kept > 2 * self._limit:
            self._stride *= 2
            merged = {name: values[::2].copy() for name, values in self.columns().items()}
            self._parts = [merged]
            self._kept = len(merged["time_s"])

    @property
    def stride(self) -> int:
        """Which rows were kept: every so-many-th."""
        return self._stride

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Give what was kept."""
        parts = [part for part in self._parts if len(part["time_s"])] or self._parts[:1]
        return {name: np.concatenate([part[name] for part in parts]) for name in self._parts[0]}
