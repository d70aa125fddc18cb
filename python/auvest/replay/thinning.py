"""Which measurements a filter gets where not all are used, and which rows tables keep."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from auvest.logs.reader import Rows
from auvest.replay.tables import Columns

#: Times that differ by less are the same: logs are written with a microsecond or so.
SAME_S = 1e-6


class Thinning:
    """Lets a measurement pass if the last that passed from the same source is long enough ago.

    Parameters
    ----------
    every_s : float
        Least time between two of one source, s; 0: all pass.
    """

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._last: dict[float, float] = {}

    def passed(self, time_s: Rows, source: Rows) -> npt.NDArray[np.bool_]:
        """Say which pass; they come in the order of time."""
        if self._every_s == 0:
            return np.ones(len(time_s), bool)
        used = np.zeros(len(time_s), bool)
        for k, (time, name) in enumerate(zip(time_s.tolist(), source.tolist(), strict=True)):
            if time - self._last.get(name, -math.inf) >= self._every_s - SAME_S:
                self._last[name] = time
                used[k] = True
        return used


class Spacing:
    """Keeps the rows of the first time in each period of a table, however it comes in parts.

    Parameters
    ----------
    every_s : float
        Length of the periods, which count from the first row, s; 0: all rows are kept.
    """

    def __init__(self, every_s: float) -> None:
        self._every_s = every_s
        self._first_s = math.nan
        self._period = -math.inf
        self._kept_s = math.nan

    def kept(self, rows: Columns) -> Columns:
        """Give the rows that are kept of the next."""
        time = rows["time_s"]
        if self._every_s == 0 or len(time) == 0:
            return rows
        if math.isnan(self._first_s):
            self._first_s = float(time[0])
        period = np.floor((time - self._first_s + SAME_S) / self._every_s)
        begins = np.diff(period, prepend=self._period) > 0
        begun = np.maximum.accumulate(np.where(begins, np.arange(len(time)), -1))
        kept_s = np.where(begun >= 0, time[begun], self._kept_s)
        self._period, self._kept_s = float(period[-1]), float(kept_s[-1])
        return {name: values[time == kept_s] for name, values in rows.items()}
