"""A world that is what the filter takes it for: the noise of its own models and nothing else.

What consistency is measured in: with the filter's ``Q`` and ``R`` those of the world, NEES and NIS
are chi-square; with wrong ones they are not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from auvest._arguments import as_instance, as_integer
from auvest.filters import Aukf, Ekf, Ukf
from auvest.models import ConstantAcceleration, RangeBearing


@dataclass(frozen=True)
class Errors:
    """What :func:`simulate` returns.

    Attributes
    ----------
    error : ndarray, shape (runs, steps, 6)
        Errors of the estimate after each update.
    P : ndarray, shape (runs, steps, 6, 6)
        What the filter thinks of them.
    nis : ndarray, shape (runs, steps)
        Normalised innovation squared, 2 degrees of freedom.
    """

    error: npt.NDArray[np.float64]
    P: npt.NDArray[np.float64]
    nis: npt.NDArray[np.float64]


def simulate(
    make: Callable[[npt.NDArray[np.float64], npt.NDArray[np.float64]], Ekf | Ukf | Aukf],
    process: ConstantAcceleration,
    sensor: RangeBearing,
    *,
    x0: npt.ArrayLike,
    P0: npt.ArrayLike,
    steps: int,
    runs: int,
    seed: int,
    interval_s: float = 0.5,
    progress: Callable[[], None] | None = None,
) -> Errors:
    """Let filters estimate draws of their own process.

    Parameters
    ----------
    make : callable
        ``make(x0, P0)`` gives a fresh filter. An :class:`auvest.Aukf` is sampled at the intervals
        that it chooses, without a reference.
    process, sensor
        The world's.
    x0, P0 : array_like, shapes (6,) and (6, 6)
        The true start is drawn from their Gaussian.
    steps, runs, seed : int
        Run r draws from stream r of the seed.
    interval_s : float
        Time between samples of the other filters, s.
    progress : callable, optional
        Called after each run.
    """
    as_instance("process", process, ConstantAcceleration)
    as_instance("sensor", sensor, RangeBearing)
    steps, runs = as_integer("steps", steps, 1, 10**6), as_integer("runs", runs, 1, 10**6)
    mean, covariance = np.asarray(x0, np.float64), np.asarray(P0, np.float64)
    start_root = np.linalg.cholesky(covariance)
    sigma = np.array([sensor.sigma_range_m, sensor.sigma_bearing_rad])
    error = np.empty((runs, steps, 6))
    p = np.empty((runs, steps, 6, 6))
    nis = np.empty((runs, steps))
    for run in range(runs):
        rng = np.random.default_rng([seed, run])
        truth = mean + start_root @ rng.standard_normal(6)
        filter_ = make(mean, covariance)
        for k in range(steps):
            dt = filter_.interval if isinstance(filter_, Aukf) else interval_s
            root = np.linalg.cholesky(process.Q(dt))
            truth = process.Phi(dt) @ truth + root @ rng.standard_normal(6)
            z = sensor.h(truth) + sigma * rng.standard_normal(2)
            filter_.predict(dt)
            filter_.update(z)
            if isinstance(filter_, Aukf):
                filter_.feedback()
            error[run, k] = filter_.x - truth
            p[run, k] = filter_.P
            nis[run, k] = filter_.nis
        if progress is not None:
            progress()
    return Errors(error, p, nis)
