"""The cubature Kalman filter (Arasaratnam, Haykin 2009)."""

from __future__ import annotations

from auvest.filters._base import GaussianFilter


class Ckf(GaussianFilter):
    """Cubature Kalman filter: 2 n points of equal weight, none at the centre, nothing to tune.

    Its covariance is that about the mean, so that no term is negative. Where a model has no closed
    form its points lie wide enough for float32.

    Parameters
    ----------
    x0, P0, process, sensors, kernel, recovery, policy, late_s, longest_step_s, dtype
        As for :class:`auvest.Ekf`.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _linearisation = 2
