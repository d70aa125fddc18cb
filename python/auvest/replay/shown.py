"""What pages show of measurements beside their table: where craft and source were, how often."""

from __future__ import annotations

import math

import numpy as np

from auvest._arguments import Floats
from auvest.replay import tables
from auvest.replay.tables import Batch, Columns


class Shown:
    """Goes through the batches of one replay in their order."""

    def __init__(self) -> None:
        self._estimate: Floats = np.full((1, 3), np.nan)  # the last: time, x, y
        self._compared_s = math.nan

    def of(self, batch: Batch) -> Columns:
        """Give the measurements of the next batch with the columns ``tables.SHOWN``."""
        measured, estimates = batch.measurements, batch.estimates
        time_s = measured["time_s"]
        rows = np.column_stack([estimates[name] for name in ("time_s", "x_m", "y_m")])
        track = np.concatenate([self._estimate, rows])
        # The first row stands for all times before the second, whatever its own.
        at = track[np.searchsorted(track[1:, 0], time_s, side="right")]
        self._estimate = track[-1:]
        compared = np.flatnonzero(~np.isnan(measured["nis"]))
        compared = compared[np.argsort(time_s[compared], kind="stable")]
        interval = np.full(len(time_s), np.nan)
        interval[compared] = np.diff(time_s[compared], prepend=self._compared_s)
        if len(compared):
            self._compared_s = float(time_s[compared[-1]])
        values = (*at[:, 1:].T, *batch.places.T, batch.ranges_m, interval)
        return {**measured, **dict(zip(tables.SHOWN, values, strict=True))}
