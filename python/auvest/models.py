"""Process and measurement models of the AUKF paper (Deng, Yin, Duan 2019)."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_array, as_kind, as_number, as_pair, require_range

if TYPE_CHECKING:
    from auvest._core import _Process, _Sensor

_NOISE = _core.constant_acceleration_defaults()
_SENSOR = _core.range_bearing_defaults()


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


def _as_time(dt: float) -> float:
    return as_number("dt", dt, "not negative")


@lru_cache(maxsize=64)
def core_process(model: ConstantAcceleration, dtype: str) -> _Process[Any]:
    """Build the core's process model in this precision."""
    params = asdict(model)
    stem = "EulerAcceleration" if params.pop("discretisation") == "euler" else "ExactAcceleration"
    require_range(params, dtype)
    process: _Process[Any] = getattr(_core, f"{stem}_{dtype}")(params)
    return process


@lru_cache(maxsize=256)
def core_sensor(model: RangeBearing, dtype: str) -> _Sensor[Any]:
    """Build the core's measurement model in this precision."""
    params = asdict(model)
    params["station_x_m"], params["station_y_m"] = params.pop("station")
    require_range(params, dtype, squared=("sigma_range_m", "sigma_bearing_rad"))
    sensor: _Sensor[Any] = getattr(_core, f"RangeBearing_{dtype}")(params)
    return sensor
