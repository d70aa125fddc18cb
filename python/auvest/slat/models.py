"""What the filters of :mod:`auvest.slat` are made of: the slave's motion, the master, the sonar."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from auvest import _core
from auvest._arguments import as_array, require_range, require_range_limits
from auvest._fields import Checked, choice, flag, instance, not_negative, number, positive
from auvest.models import ConstantAcceleration

_COMPASS = _core.compass_motion_defaults()
_UNICYCLE = _core.unicycle_motion_defaults()
_MASTER = _core.piecewise_acceleration_defaults()
_IMM = _core.imm_defaults()
_SONAR = _core.sonar_defaults()


@dataclass(frozen=True, kw_only=True)
class CompassMotion(Checked):
    """Dead reckoning from measured speed (m/s) and heading (rad), Eq. (2) of the SLATF paper.

    The pose is ``[x, y]`` (m), the reading ``u = [speed, heading]``; measured = true + noise.

    Parameters
    ----------
    sigma_speed_m_s, sigma_heading_rad : float
        Standard deviations of one reading, not negative; the heading's at most 3.
    compensate_bias : bool
        A noisy heading shortens every displacement by ``exp(-sigma^2 / 2)`` on average: 4.4 % at
        0.3 rad. True: that is made up for. False: as in the paper.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    sigma_speed_m_s: float = not_negative(_COMPASS["sigma_speed_m_s"])
    sigma_heading_rad: float = not_negative(_COMPASS["sigma_heading_rad"])
    compensate_bias: bool = flag(_COMPASS["compensate_bias"])

    name: ClassVar[str] = "compass"
    pose_states: ClassVar[int] = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sigma_heading_rad > 3:
            raise ValueError(f"sigma_heading_rad must be at most 3, not {self.sigma_heading_rad}")


@dataclass(frozen=True, kw_only=True)
class UnicycleMotion(Checked):
    """Dead reckoning from measured speed (m/s) and yaw rate (rad/s).

    The pose is ``[x, y, heading]`` (m, rad), the reading ``u = [speed, yaw rate]``.

    Parameters
    ----------
    sigma_speed_m_s, sigma_yaw_rate_rad_s : float
        Standard deviations of one reading, not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    sigma_speed_m_s: float = not_negative(_UNICYCLE["sigma_speed_m_s"])
    sigma_yaw_rate_rad_s: float = not_negative(_UNICYCLE["sigma_yaw_rate_rad_s"])

    name: ClassVar[str] = "unicycle"
    pose_states: ClassVar[int] = 3


Motion: TypeAlias = CompassMotion | UnicycleMotion


@dataclass(frozen=True, kw_only=True)
class PiecewiseAcceleration(Checked):
    """A master with state ``[x, y, vx, vy, ax, ay]`` whose acceleration jumps at random, Eq. (4).

    Parameters
    ----------
    acceleration_m_s2 : float
        q, standard deviation of the jump of each prediction, m/s^2, not negative.
    position_psd : float
        Power spectral density of a random walk of the position, m^2/s, not negative; the paper has
        none. See :func:`no_harm`.

    Raises
    ------
    ValueError, TypeError
        If the argument lies outside its range.
    """

    acceleration_m_s2: float = not_negative(_MASTER["acceleration_m_s2"])
    position_psd: float = not_negative(_MASTER["position_psd"])


@dataclass(frozen=True, kw_only=True)
class ConstantVelocity(Checked):
    """A master that goes straight, state ``[x, y, vx, vy, ax, ay]``; one model of an :class:`Imm`.

    Parameters
    ----------
    velocity_psd : float
        Power spectral density of the white accelerations, m^2/s^3, not negative.
    sigma_acceleration_m_s2 : float
        Standard deviation of the acceleration that a manoeuvre begins with, m/s^2, not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    velocity_psd: float = not_negative(_IMM["straight"]["velocity_psd"])
    sigma_acceleration_m_s2: float = not_negative(_IMM["straight"]["sigma_acceleration_m_s2"])


@dataclass(frozen=True, kw_only=True)
class CoordinatedTurn(Checked):
    """A master that turns at the rate ``(v x a) / |v|^2`` of its state; a model of an :class:`Imm`.

    Parameters
    ----------
    position_psd, velocity_psd, acceleration_psd : float
        Power spectral densities of the white noises that drive the three pairs of states, in
        m^2/s, m^2/s^3 and m^2/s^5; not negative.
    slow_m_s : float
        Speed far below which a direction of motion cannot be told, m/s, positive.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    position_psd: float = not_negative(_IMM["turning"]["position_psd"])
    velocity_psd: float = not_negative(_IMM["turning"]["velocity_psd"])
    acceleration_psd: float = not_negative(_IMM["turning"]["acceleration_psd"])
    slow_m_s: float = positive(_IMM["turning"]["slow_m_s"])


@dataclass(frozen=True, kw_only=True)
class Imm(Checked):
    """Interacting multiple models: a master whose manoeuvres nobody announces.

    It goes straight, accelerates or turns. A motion is drawn anew ``switch_rate_hz`` times per
    second on average, and is then each of the three as often as ``share`` says
    (docs/algorithms/slatf.md).

    Parameters
    ----------
    straight : ConstantVelocity
    accelerated : ConstantAcceleration
        With the discretisation "exact".
    turning : CoordinatedTurn
    share : (float, float, float)
        Not negative, with sum 1.
    switch_rate_hz : float
        Not negative; 0: a master keeps its motion.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    straight: ConstantVelocity = instance(ConstantVelocity)
    accelerated: ConstantAcceleration = instance(ConstantAcceleration)
    turning: CoordinatedTurn = instance(CoordinatedTurn)
    share: tuple[float, float, float] = (1 / 3, 1 / 3, 1 / 3)
    switch_rate_hz: float = not_negative(_IMM["switch_rate_hz"])

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.accelerated.discretisation != "exact":
            raise ValueError("accelerated must have the discretisation 'exact'")
        share = as_array("share", self.share, (3,), np.dtype(np.float64))
        if (share < 0).any() or abs(share.sum() - 1) > 1e-3:
            raise ValueError(
                f"share must be three numbers of at least 0 with sum 1, not {self.share}"
            )
        object.__setattr__(self, "share", tuple(float(part) for part in share))


Master: TypeAlias = PiecewiseAcceleration | Imm


@dataclass(frozen=True, kw_only=True)
class Sonar(Checked):
    """Range (m) and bearing (rad) between slave and master, Eqs. (5) and (6).

    Parameters
    ----------
    sigma_range_m, sigma_bearing_rad : float
        Standard deviations, above 1e-6.
    bearing : {"master_to_slave", "slave_to_master", "from_heading"}
        Where the bearing points: from the x axis, from the master to the slave (the paper's), or
        from the slave to the master; or from the slave's heading to the master, which needs a
        heading in the pose (:class:`UnicycleMotion`).
    smallest_range_m, largest_range_m : float
        What the instrument can measure, m: a range outside is refused, for it is a code or a fault;
        defaults: 0 and infinity. A smallest one below 0 is for readings whose noise is not cut off
        at 0.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    sigma_range_m: float = positive(_SONAR["sigma_range_m"])
    sigma_bearing_rad: float = positive(_SONAR["sigma_bearing_rad"])
    bearing: Literal["master_to_slave", "slave_to_master", "from_heading"] = choice(
        "master_to_slave", "slave_to_master", "from_heading"
    )
    smallest_range_m: float = number(_SONAR["smallest_range_m"])
    largest_range_m: float = positive(_SONAR["largest_range_m"], infinite=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_range_limits(self.smallest_range_m, self.largest_range_m)
        for name in ("sigma_range_m", "sigma_bearing_rad"):
            value = getattr(self, name)
            if value <= 1e-6:
                raise ValueError(f"{name} must be above 1e-6, not {value}")


def no_harm(*, position_psd: float = 0.1, forget_after_s: float = 2.0) -> dict[str, Any]:
    """Make options of a filter that does no harm to the slave where no master's plan is known.

    A master is a slow random walk without a velocity, and is born again after a silence: what it
    did meanwhile is not charged to the slave. On real robots the slave is then as good as by dead
    reckoning or a little better, at gaps for which other models double its error
    (docs/reproduction/mrclam6). Give the masters that you add a velocity and an acceleration of
    zero with the standard deviations ``rebirth_velocity_m_s`` and ``rebirth_acceleration_m_s2``
    that stand in the result.

    Parameters
    ----------
    position_psd : float
        Of the random walk, m^2/s on each axis. 0.1 for masters that move at 0.03 to 0.08 m/s.
    forget_after_s : float
        The 95 % point of the intervals between sightings is a good choice.

    Returns
    -------
    dict
        Keyword arguments of :class:`EkfSlat`, :class:`SlatfJoint` and :class:`Slatf`.
    """
    return {
        "master": PiecewiseAcceleration(acceleration_m_s2=0, position_psd=position_psd),
        "forget_after_s": forget_after_s,
        "rebirth_velocity_m_s": 1e-3,
        "rebirth_acceleration_m_s2": 1e-3,
    }


def core_master(master: Master, dtype: str) -> dict[str, Any]:
    """Make the dict that the core takes for a master in this precision."""
    if isinstance(master, PiecewiseAcceleration):
        return core_params(master, dtype)
    params: dict[str, Any] = asdict(master)
    params["accelerated"].pop("discretisation")
    rate = params["switch_rate_hz"]
    for part in (
        *(params[name] for name in ("straight", "accelerated", "turning")),
        {"rate": rate},
    ):
        require_range(part, dtype)
    return params


def core_params(model: Motion | PiecewiseAcceleration, dtype: str) -> dict[str, Any]:
    """Make the dict that the core takes for a model in this precision."""
    params = asdict(model)
    require_range(params, dtype, squared=tuple(params))
    return params


@lru_cache(maxsize=64)
def core_sonar(model: Sonar, dtype: str) -> _core._Sonar:
    """Build the core's sonar in this precision."""
    params = asdict(model)
    bearing = params.pop("bearing")
    finite = {name: value for name, value in params.items() if value != math.inf}
    require_range(finite, dtype, squared=("sigma_range_m", "sigma_bearing_rad"))
    return getattr(_core, f"Sonar_{dtype}")(params, bearing)
