"""Process and measurement models.

Those of the AUKF paper (Deng, Yin, Duan 2019); dead reckoning and ranges to leaders for the
M-estimation EKF (Li, Du, Fan, Chen, Mao, Luo 2020).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import Bound, as_array, as_flag, as_kind, as_number, as_pair, require_range

if TYPE_CHECKING:
    from auvest._core import _Process, _Sensor

_NOISE = _core.constant_acceleration_defaults()
_SENSOR = _core.range_bearing_defaults()
_SPEED_HEADING = _core.speed_heading_defaults()
_ODOMETRY = _core.odometry_defaults()
_LEADER = _core.leader_range_defaults()


@dataclass(frozen=True, kw_only=True)
class ConstantAcceleration:
    """Constant acceleration in the plane, state ``[x, y, vx, vy, ax, ay]``, Eqs. (4) and (5).

    Parameters
    ----------
    discretisation : {"exact", "euler"}
        "exact": ``Phi`` with the ``dt^2 / 2`` term and ``Q`` the integral of the driving noise.
        "euler": exactly the paper's Eq. (4), without that term, and ``Q = dt diag(q)``.
    position_psd, velocity_psd, acceleration_psd : float
        Power spectral densities of the white noises that drive the three pairs of states, in
        m^2/s, m^2/s^3 and m^2/s^5; not negative. The paper does not state them.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    discretisation: Literal["exact", "euler"] = "exact"
    position_psd: float = _NOISE["position_psd"]
    velocity_psd: float = _NOISE["velocity_psd"]
    acceleration_psd: float = _NOISE["acceleration_psd"]

    def __post_init__(self) -> None:
        as_kind("discretisation", self.discretisation, ("exact", "euler"))
        for name in ("position_psd", "velocity_psd", "acceleration_psd"):
            value = as_number(name, getattr(self, name), "not negative")
            object.__setattr__(self, name, value)

    def Phi(self, dt: float) -> npt.NDArray[np.float64]:
        """Transition matrix (6, 6) over ``dt >= 0`` seconds, in float64."""
        phi: npt.NDArray[np.float64] = core_process(self, "float64").Phi(_as_time(dt))
        return phi

    def Q(self, dt: float) -> npt.NDArray[np.float64]:
        """Covariance (6, 6) of the process noise of ``dt >= 0`` seconds, in float64."""
        q: npt.NDArray[np.float64] = core_process(self, "float64").Q(_as_time(dt))
        return q


@dataclass(frozen=True, kw_only=True)
class RangeBearing:
    """Range (m) and bearing (rad, from +x towards +y) from a fixed station, Eq. (6).

    Parameters
    ----------
    station : (float, float)
        Position of the station, m.
    sigma_range_m, sigma_bearing_rad : float
        Standard deviations of the two noises, positive. The paper does not state them.
    near_field : float
        Where the range is below this many position standard deviations ``sqrt(P_xx + P_yy)`` the
        measurement is taken as the position it points to; there the bearing has no useful slope.
        0 switches this off except on the station itself.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    station: tuple[float, float] = (_SENSOR["station_x_m"], _SENSOR["station_y_m"])
    sigma_range_m: float = _SENSOR["sigma_range_m"]
    sigma_bearing_rad: float = _SENSOR["sigma_bearing_rad"]
    near_field: float = _SENSOR["near_field"]

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "station", as_pair("station", self.station))
        for name in ("sigma_range_m", "sigma_bearing_rad"):
            set_field(self, name, as_number(name, getattr(self, name), "positive"))
        set_field(self, "near_field", as_number("near_field", self.near_field, "not negative"))

    def h(self, x: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Range (m) and bearing (rad) without noise.

        Parameters
        ----------
        x : array_like, shape (6,) or (K, 6)
            States.

        Returns
        -------
        ndarray, shape (2,) or (K, 2)
            On the station itself the range is 0 and the bearing 0.
        """
        dtype = np.dtype(np.float64)
        one = np.ndim(x) < 2 or np.shape(x) == (6, 1)
        states = as_array("x", x, (6,) if one else (None, 6), dtype)
        z: npt.NDArray[np.float64] = core_sensor(self, "float64").h(states.reshape(-1, 6))
        return z.reshape(2) if one else z


@dataclass(frozen=True, kw_only=True)
class SpeedHeading:
    """Dead reckoning by speed and heading, Eqs. (1) to (3), state ``[x, y]`` (m) and options.

    What drives a prediction is ``[forward speed, starboard speed, heading]`` (m/s, m/s, rad). x is
    north, y east and the heading clockwise from north; or x east, y north, the heading from east
    anticlockwise and the second speed to port.

    Parameters
    ----------
    sigma_forward, sigma_starboard : float
        Noise of the two speeds, m/s/sqrt(Hz), not negative.
    sigma_heading : float
        Noise of the heading, rad/sqrt(Hz), not negative.
    heading_bias : bool
        Estimate the error of the compass (rad), the state after the position.
    speed_scale : bool
        Estimate the relative error of the speed, the last state.
    bias_walk, scale_walk : float
        Random walks of these two, rad/sqrt(s) and 1/sqrt(s), not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    sigma_forward: float = _SPEED_HEADING["sigma_forward"]
    sigma_starboard: float = _SPEED_HEADING["sigma_starboard"]
    sigma_heading: float = _SPEED_HEADING["sigma_heading"]
    heading_bias: bool = False
    speed_scale: bool = False
    bias_walk: float = _SPEED_HEADING["bias_walk"]
    scale_walk: float = _SPEED_HEADING["scale_walk"]

    def __post_init__(self) -> None:
        names = ("sigma_forward", "sigma_starboard", "sigma_heading", "bias_walk", "scale_walk")
        _set_numbers(self, "not negative", *names)
        for name in ("heading_bias", "speed_scale"):
            object.__setattr__(self, name, as_flag(name, getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class Odometry:
    """Dead reckoning by increments, state ``[x, y, theta]`` (m, m, rad); theta is not wrapped.

    What drives a prediction is the motion since the last one in the frame of the pose then,
    ``[forward, sideways, turn]`` (m, m, rad): sideways is to the left where angles run from +x
    anticlockwise, to starboard where they run clockwise from north.

    Parameters
    ----------
    sigma_distance : float
        Noise of the position relative to the distance of an increment, not negative.
    sigma_drift : float
        Noise of the position that goes with time, m/sqrt(s), not negative.
    sigma_turn : float
        Noise of the heading, rad/sqrt(s), not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    sigma_distance: float = _ODOMETRY["sigma_distance"]
    sigma_drift: float = _ODOMETRY["sigma_drift"]
    sigma_turn: float = _ODOMETRY["sigma_turn"]

    def __post_init__(self) -> None:
        _set_numbers(self, "not negative", "sigma_distance", "sigma_drift", "sigma_turn")


@dataclass(frozen=True, kw_only=True)
class LeaderRange:
    """Range (m) to a leader of known position, Eqs. (4) and (5); one per message, any leader.

    Parameters
    ----------
    leader : (float, float)
        Where the leader was when the range was taken, m.
    sigma_range_m : float
        Standard deviation of the range, positive.
    sigma_leader_m : float
        Standard deviation of the leader's position per axis, not negative; adds to the noise of the
        range: ``R = sigma_range_m**2 + sigma_leader_m**2``.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    leader: tuple[float, float] = (_LEADER["leader_x_m"], _LEADER["leader_y_m"])
    sigma_range_m: float = _LEADER["sigma_range_m"]
    sigma_leader_m: float = _LEADER["sigma_leader_m"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "leader", as_pair("leader", self.leader))
        _set_numbers(self, "positive", "sigma_range_m")
        _set_numbers(self, "not negative", "sigma_leader_m")

    def h(self, position: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Ranges (K,) without noise of positions (K, 2), m."""
        rows = as_array("position", position, (None, 2), np.dtype(np.float64))
        z: npt.NDArray[np.float64] = core_sensor(self, "float64").h(rows)
        return z


ProcessModel: TypeAlias = ConstantAcceleration | SpeedHeading | Odometry
MeasurementModel: TypeAlias = RangeBearing | LeaderRange


def process_name(model: ProcessModel) -> str:
    """Give the name of the core's class for this model, without the precision."""
    if isinstance(model, ConstantAcceleration):
        return "EulerAcceleration" if model.discretisation == "euler" else "ExactAcceleration"
    if isinstance(model, Odometry):
        return "Odometry"
    bias = "Bias" if model.heading_bias else ""
    return f"SpeedHeading{bias}{'Scale' if model.speed_scale else ''}"


def state_count(model: ProcessModel) -> int:
    """Count the states."""
    if isinstance(model, ConstantAcceleration):
        return 6
    if isinstance(model, Odometry):
        return 3
    return 2 + model.heading_bias + model.speed_scale


def input_count(model: ProcessModel) -> int:
    """Count the numbers that drive a prediction; 0: none."""
    return 0 if isinstance(model, ConstantAcceleration) else 3


def _set_numbers(model: Any, bound: Bound, *names: str) -> None:
    for name in names:
        object.__setattr__(model, name, as_number(name, getattr(model, name), bound))


def _as_time(dt: float) -> float:
    return as_number("dt", dt, "not negative")


@lru_cache(maxsize=64)
def core_process(model: ProcessModel, dtype: str) -> _Process[Any]:
    """Build the core's process model in this precision."""
    params = asdict(model)
    for structural in ("discretisation", "heading_bias", "speed_scale"):
        params.pop(structural, None)
    require_range(params, dtype)
    process: _Process[Any] = getattr(_core, f"{process_name(model)}_{dtype}")(params)
    return process


@lru_cache(maxsize=256)
def core_sensor(model: MeasurementModel, dtype: str) -> _Sensor[Any]:
    """Build the core's measurement model in this precision."""
    params = asdict(model)
    place = "station" if isinstance(model, RangeBearing) else "leader"
    params[f"{place}_x_m"], params[f"{place}_y_m"] = params.pop(place)
    squared = tuple(name for name in params if name.startswith("sigma_"))
    require_range(params, dtype, squared=squared)
    sensor: _Sensor[Any] = getattr(_core, f"{type(model).__name__}_{dtype}")(params)
    return sensor
