"""Policies for the sampling interval of :class:`auvest.Aukf`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from auvest import _core
from auvest._arguments import as_kind, as_number, require_range
from auvest._fields import Checked, positive

if TYPE_CHECKING:
    from auvest._core import _Interval

_FIXED = _core.fixed_interval_defaults()
_BUDGET = _core.covariance_budget_defaults()
_LAW = {name: _core.mahalanobis_interval_defaults(name) for name in ("figure3", "table1")}


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


@dataclass(frozen=True, init=False)
class MahalanobisInterval:
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

    preset: Literal["figure3", "table1"]
    initial_s: float
    min_s: float
    max_s: float
    tau0: float
    scale: float
    epsilon: float
    gamma1_m2: float
    gamma2: float
    ratio_max: float
    tau_min: float
    tau_max: float

    def __init__(
        self,
        preset: Literal["figure3", "table1"] = "figure3",
        *,
        initial_s: float | None = None,
        min_s: float | None = None,
        max_s: float | None = None,
        tau0: float | None = None,
        scale: float | None = None,
        epsilon: float | None = None,
        gamma1_m2: float | None = None,
        gamma2: float | None = None,
        ratio_max: float | None = None,
        tau_min: float | None = None,
        tau_max: float | None = None,
    ) -> None:
        as_kind("preset", preset, ("figure3", "table1"))
        given = {
            "initial_s": initial_s,
            "min_s": min_s,
            "max_s": max_s,
            "tau0": tau0,
            "scale": scale,
            "epsilon": epsilon,
            "gamma1_m2": gamma1_m2,
            "gamma2": gamma2,
            "ratio_max": ratio_max,
            "tau_min": tau_min,
            "tau_max": tau_max,
        }
        object.__setattr__(self, "preset", preset)
        for name, value in given.items():
            chosen = _LAW[preset][name] if value is None else as_number(name, value)
            object.__setattr__(self, name, chosen)
        _set_positive(self, "initial_s", "min_s", "max_s", "epsilon", "gamma1_m2", "gamma2")
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
        interval: _Interval = build(params)
    except _core.StatusError as error:
        raise ValueError(f"{policy} does not suit {dtype}: {error}") from None
    return interval


def _set_positive(policy: Any, *names: str) -> None:
    for name in names:
        object.__setattr__(policy, name, as_number(name, getattr(policy, name), "positive"))


def _check_limits(policy: CovarianceBudget | MahalanobisInterval) -> None:
    if not policy.min_s <= policy.initial_s <= policy.max_s:
        raise ValueError(
            "min_s <= initial_s <= max_s is required, not "
            f"min_s={policy.min_s}, initial_s={policy.initial_s}, max_s={policy.max_s}"
        )
