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

Float64s = npt.NDArray[np.float64]
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
        there = ", ".join(type(sensor).__name__ for sensor in sensors) or "none"
        raise ValueError(f"filter must have one {kind.__name__} as its only sensor; it has {there}")
    return sensors[0]


def mean_of_rows(values: Float64s) -> Float64s:
    """Mean of what is known in each row, (runs, steps); NaN where nothing is.

    Sums and a division: a row gives the same bits whichever rows stand beside it.
    """
    known = ~np.isnan(values)
    count = known.sum(axis=1)
    total = np.where(known, values, 0.0).sum(axis=1)
    mean: Float64s = np.full(len(values), np.nan)
    np.divide(total, count, out=mean, where=count > 0)
    return mean


def nees_of_plane(error: Float64s, covariance: Float64s) -> Float64s:
    """Normalised error squared of a position, (..., 2) and (..., 2, 2), in closed form.

    The same bits everywhere, as :func:`auvest.metrics.nees` with its solver has not. Infinite where
    the covariance is zero.
    """
    e, p = error, covariance
    determinant = p[..., 0, 0] * p[..., 1, 1] - p[..., 0, 1] ** 2
    square = (
        e[..., 0] ** 2 * p[..., 1, 1]
        - 2 * e[..., 0] * e[..., 1] * p[..., 0, 1]
        + e[..., 1] ** 2 * p[..., 0, 0]
    )
    nees: Float64s = np.full(square.shape, np.inf)
    np.divide(square, determinant, out=nees, where=~(determinant <= 0))
    return nees


def standard_error(per_run: Floats) -> float:
    """Give the standard error of the mean of a number per run; NaN for one run."""
    if len(per_run) < 2:
        return math.nan
    return float(per_run.std(ddof=1) / np.sqrt(len(per_run)))
