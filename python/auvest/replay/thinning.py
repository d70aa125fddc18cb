"""Which measurements a filter gets where not all are used; the others are predicted."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from auvest.logs.reader import Rows

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
