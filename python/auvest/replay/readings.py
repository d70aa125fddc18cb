"""What a slave reads, and what masters plan: numbers that hold from the time of their line on."""

from __future__ import annotations

import math

import numpy as np

from auvest._arguments import Floats
from auvest.logs.reader import Rows


class Held:
    """Numbers that hold until the next, fed chunk by chunk; zero before the first.

    Parameters
    ----------
    columns : int
        How many numbers a line has.
    gap_s : float
        None holds longer; then those of ``stops`` are zero, s.
    stops : tuple of bool, optional
        Which; default: all.
    """

    def __init__(
        self, columns: int, gap_s: float = math.inf, stops: tuple[bool, ...] | None = None
    ) -> None:
        self._gap_s = gap_s
        self._goes_on = ~np.array(stops or (True,) * columns)
        self.edges: Rows = np.empty(0)  # times from which on each holds
        self._values: Rows = np.empty((0, columns))
        self._integral: Rows = np.empty((0, columns))

    def add(self, time_s: Rows, values: Rows) -> None:
        """Take new lines, in the order of time."""
        if len(time_s) == 0:
            return
        edges = np.concatenate([self.edges, time_s])
        values = np.concatenate([self._values, values])
        new = len(self.edges)
        long = np.flatnonzero(np.diff(edges) > self._gap_s)
        long = long[long >= new - 1]
        edges = np.insert(edges, long + 1, edges[long] + self._gap_s)
        values = np.insert(values, long + 1, values[long] * self._goes_on, axis=0)
        first = max(new - 1, 0)
        step = np.diff(edges[first:])[:, None]
        begin = self._integral[first:new] if new else np.zeros_like(values[:1])
        integral = np.cumsum(np.concatenate([begin, values[first:-1] * step]), axis=0)
        self.edges, self._values = edges, values
        self._integral = np.concatenate([self._integral[:first], integral])

    def until(self, limit: float) -> Rows:
        """Give the edges up to a time, with that at which the last holds no longer."""
        self._stop(limit)
        return self.edges[self.edges <= limit]

    def at(self, time_s: Rows) -> Rows:
        """Give what holds from these times on, shape (n, columns)."""
        if len(self.edges) == 0:
            return np.zeros((len(time_s), self._values.shape[1]))
        k = np.searchsorted(self.edges, time_s, side="right") - 1
        values: Rows = np.where((k >= 0)[:, None], self._values[np.maximum(k, 0)], 0.0)
        return values

    def means(self, time_s: Floats, factors: tuple[float, ...] | float = 1.0) -> Rows:
        """Give means from each time (T + 1,) to the next, times factors, shape (T, columns)."""
        if len(self.edges) == 0:
            return np.zeros((len(time_s) - 1, self._values.shape[1]))
        self._stop(float(time_s[-1]))
        end = max(float(self.edges[-1]), float(time_s[-1])) + 1.0
        edges = np.append(self.edges, end)
        beyond = self._integral[-1] + self._values[-1] * (end - self.edges[-1])
        integral = np.concatenate([self._integral, beyond[None]])
        at = np.column_stack([np.interp(time_s, edges, column) for column in integral.T])
        means: Rows = np.array(factors) * np.diff(at, axis=0) / np.diff(time_s)[:, None]
        return means

    def forget(self, before: float) -> None:
        """Drop what no time from ``before`` on can ask for."""
        k = max(int(np.searchsorted(self.edges, before, side="right")) - 1, 0)
        self.edges, self._values = self.edges[k:], self._values[k:]
        self._integral = self._integral[k:]

    def _stop(self, limit: float) -> None:
        """Have the last hold no longer than the gap, if a time beyond it is asked for."""
        if len(self.edges) and limit > self.edges[-1] + self._gap_s:
            last = self._values[-1] * self._goes_on
            if not np.array_equal(last, self._values[-1]):
                self.add(np.array([self.edges[-1] + self._gap_s]), last[None])
