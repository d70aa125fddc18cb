"""Policies for the sampling interval of :class:`auvest.Aukf`."""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from auvest import _core
from auvest._arguments import as_number, require_range
from auvest._fields import Checked, choice, positive

if TYPE_CHECKING:
    from auvest._core import _Interval

_FIXED = _core.fixed_interval_defaults()
_BUDGET = _core.covariance_budget_defaults()
_LAW = {name: _core.mahalanobis_interval_defaults(name) for name in ("figure3", "table1")}


def _of_preset() -> Any:
    """Take a number; None stands for that of the preset."""
    return field(default=None)


@dataclass(frozen=True, kw_only=True)
class FixedInterval(Checked):
    """A constant sampling interval: with it an AUKF is a UKF.

    Parameters
    ----------
    interval_s : float
        Interval in seconds, positive.
    """

    interval_s: float = positive(_FIXED["interval_s"])


@dataclass(frozen=True, kw_only=True)
class CovarianceBudget(Checked):
    """The largest interval after which the predicted position is still within an error budget.

    Not in the paper. It needs no reference track.

    Parameters
    ----------
    position_sigma_m : float
        Budget for ``sqrt(P_xx + P_yy)`` just before an update, m, positive.
    min_s, max_s : float
        Limits of the interval, s: ``0 < min_s <= initial_s <= max_s``.
    initial_s : float
        Interval before the first update, s.
    """

    position_sigma_m: float = positive(_BUDGET["position_sigma_m"])
    min_s: float = positive(_BUDGET["min_s"])
    max_s: float = positive(_BUDGET["max_s"])
    initial_s: float = positive(_BUDGET["initial_s"])

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_limits(self)


@dataclass(frozen=True)
class MahalanobisInterval(Checked):
    """The paper's interval law, Eqs. (7) to (12).

    ``M(k) = d_t^2 / (d_e^2 + gamma1)`` (7), ``T(k) = (1 - tau) scale T(k-1) + tau M(k) max_s`` (8),
    ``tau(k+1) = epsilon / (d^2 + gamma2)`` (12), each clamped to its limits.

    Parameters
    ----------
    preset : {"figure3", "table1"}
        Where the values come from that are not given. "figure3" shows what the paper's Fig. 3
        shows; "table1" is its Table 1 to the letter, which contradicts Fig. 3: the interval falls
        to ``min_s``.
    initial_s, min_s, max_s : float, optional
        T(0) and the limits of the interval, s: ``0 < min_s <= initial_s <= max_s``. The paper does
        not state ``min_s``.
    tau0 : float, optional
        tau(0): ``tau_min <= tau0 <= tau_max``.
    scale : float, optional
        phi of Eq. (8), in 0..1.
    epsilon, gamma2 : float, optional
        Constants of Eq. (12), positive.
    gamma1_m2 : float, optional
        gamma1 of Eq. (7), m^2, positive.
    ratio_max : float, optional
        Upper limit of M(k), above 0 and at most 1.
    tau_min, tau_max : float, optional
        Limits of tau: ``0 < tau_min <= tau_max < 1``.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    preset: Literal["figure3", "table1"] = choice("figure3", "table1")
    _: KW_ONLY
    initial_s: float = _of_preset()
    min_s: float = _of_preset()
    max_s: float = _of_preset()
    tau0: float = _of_preset()
    scale: float = _of_preset()
    epsilon: float = _of_preset()
    gamma1_m2: float = _of_preset()
    gamma2: float = _of_preset()
    ratio_max: float = _of_preset()
    tau_min: float = _of_preset()
    tau_max: float = _of_preset()

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in _LAW[self.preset].items():
            given = getattr(self, name)
            chosen = value if given is None else as_number(name, given)
            object.__setattr__(self, name, chosen)
        for name in ("initial_s", "min_s", "max_s", "epsilon", "gamma1_m2", "gamma2"):
            as_number(name, getattr(self, name), "positive")
        _check_limits(self)
        if not 0 <= self.scale <= 1:
            raise ValueError(f"scale must lie in 0..1, not {self.scale}")
        if not 0 < self.ratio_max <= 1:
            raise ValueError(f"ratio_max must be above 0 and at most 1, not {self.ratio_max}")
        if not 0 < self.tau_min <= self.tau0 <= self.tau_max < 1:
            raise ValueError(
                "0 < tau_min <= tau0 <= tau_max < 1 is required, not "
                f"tau_min={self.tau_min}, tau0={self.tau0}, tau_max={self.tau_max}"
            )


IntervalPolicy: TypeAlias = FixedInterval | MahalanobisInterval | CovarianceBudget


def core_interval(policy: IntervalPolicy, dtype: str) -> _Interval:
    """Build the core's policy in this precision."""
    params = asdict(policy)
    params.pop("preset", None)
    require_range(params, dtype)
    core = getattr(_core, f"Interval_{dtype}")
    build = {
        FixedInterval: core.fixed,
        MahalanobisInterval: core.mahalanobis,
        CovarianceBudget: core.covariance_budget,
    }[type(policy)]
    try:
        return build(params)
    except _core.StatusError as error:
        raise ValueError(f"{policy} does not suit {dtype}: {error}") from None


def _check_limits(policy: CovarianceBudget | MahalanobisInterval) -> None:
    if not policy.min_s <= policy.initial_s <= policy.max_s:
        raise ValueError(
            "min_s <= initial_s <= max_s is required, not "
            f"min_s={policy.min_s}, initial_s={policy.initial_s}, max_s={policy.max_s}"
        )
