"""What the simulations have in common: many runs of a filter, and what they give."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from auvest import metrics, montecarlo
from auvest._arguments import Floats
from auvest._core import Status
from auvest.filters import GaussianFilter
from auvest.models import MeasurementModel

R = TypeVar("R")
S = TypeVar("S", bound=MeasurementModel)


class Runs:
    """Base of the results, dataclasses whose arrays have a row per run."""

    error: npt.NDArray[np.float64]
    status: npt.NDArray[np.uint8]

    @property
    def failed(self) -> npt.NDArray[np.bool_]:
        """Runs whose status is not ok, shape (runs,)."""
        return self.status != int(Status.ok)

    @property
    def rmse_m(self) -> float:
        """Root mean square position error over all runs, m."""
        return metrics.rmse(self.error)


def collect(make: Callable[..., R], task: montecarlo.Task, runs: int, **options: Any) -> R:
    """Do the runs of a task and make a result of their columns; after Ctrl-C of those done.

    Parameters
    ----------
    make : callable
        Makes the result.
    task, runs, **options
        As for :func:`auvest.montecarlo.run`.
    """
    try:
        return make(**montecarlo.run(task, runs, **options))
    except montecarlo.Interrupted as stop:
        if stop.partial is not None:
            stop.partial = make(**stop.partial)
        raise


def only_sensor(
    filter: GaussianFilter,  # noqa: A002 (its name in this package)
    kind: type[S],
) -> S:
    """Give the sensor of a filter that has one of this kind, and no other.

    Raises
    ------
    ValueError
        If it has other sensors.
    """
    sensors = list(filter.sensors.values())
    if len(sensors) != 1 or not isinstance(sensors[0], kind):
        raise ValueError(f"filter must have one {kind.__name__} as its sensor, not {sensors}")
    return sensors[0]


def standard_error(per_run: Floats) -> float:
    """Give the standard error of the mean of a number per run; NaN for one run."""
    if len(per_run) < 2:
        return math.nan
    return float(per_run.std(ddof=1) / np.sqrt(len(per_run)))
