"""The unscented Kalman filter, and its presets: robust, and with an interval of its own."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_instance, as_points
from auvest.filters._base import GaussianFilter, Sensors
from auvest.filters._robust import RobustByDefault
from auvest.intervals import IntervalPolicy, MahalanobisInterval
from auvest.models import ConstantAcceleration, ProcessModel, RangeBearing

_POINTS = _core.sigma_points_defaults()
_PROCESS = ConstantAcceleration()
_SENSOR = RangeBearing()
_LAW = MahalanobisInterval()


class Ukf(GaussianFilter):
    """Unscented Kalman filter in deviation form, sigma points redrawn after the prediction.

    Parameters
    ----------
    x0, P0, process, sensors, kernel, recovery, policy, late_s, longest_step_s, dtype
        As for :class:`auvest.Ekf`.
    components, headings
        As for :class:`auvest.Ekf`.
    alpha : float
        Spread of the sigma points, in 1e-8..1. Where a model has no closed form (see
        docs/models.md) it must not be small.
    beta : float
        At least ``alpha**2``; 2 suits a Gaussian.
    kappa : float, optional
        Secondary scaling, above -n; default: 3 - n, which matches the fourth moments of a Gaussian.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _linearisation = 1

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel,
        alpha: float = _POINTS["alpha"],
        beta: float = _POINTS["beta"],
        kappa: float | None = None,
        **options: Any,
    ) -> None:
        as_instance("process", process, ProcessModel)
        states = len(process.state)
        points = as_points(alpha, beta, 3 - states if kappa is None else kappa, states)
        super().__init__(x0, P0, process=process, parameters=points, **options)

    @property
    def alpha(self) -> float:
        """Spread of the sigma points."""
        return self._parameters["alpha"]

    @property
    def beta(self) -> float:
        """Weight of prior knowledge."""
        return self._parameters["beta"]

    @property
    def kappa(self) -> float:
        """Secondary scaling."""
        return self._parameters["kappa"]


class RobustUkf(RobustByDefault, Ukf):
    """A :class:`Ukf` with a robust kernel; see :class:`auvest.RobustEkf`.

    Parameters
    ----------
    x0, P0
        As for :class:`auvest.Ekf`.
    kernel, recovery
        As for :class:`auvest.Ekf`; here Hampel's kernel and a recovery from lock-out are the
        default.
    **options
        Everything else of :class:`Ukf`.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """


class Aukf(Ukf):
    """Adaptive UKF (Deng, Yin, Duan 2019): a :class:`Ukf` that chooses its own sampling interval.

    A step is ``predict()``, ``update(z)``, ``feedback(reference)``; the sensor is read
    ``interval`` seconds after the step before.

    Parameters
    ----------
    x0, P0
        As for :class:`auvest.Ekf`.
    process, sensors
        Default: the models of the paper.
    policy : MahalanobisInterval, CovarianceBudget or FixedInterval
        The interval policy; default: the paper's law, [AUKF 7] to [AUKF 12].
    **options
        Everything else of :class:`Ukf`.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel = _PROCESS,
        sensors: Sensors = _SENSOR,
        policy: IntervalPolicy = _LAW,
        **options: Any,
    ) -> None:
        as_instance("policy", policy, IntervalPolicy.__args__)
        super().__init__(x0, P0, process=process, sensors=sensors, policy=policy, **options)
