"""Range and bearing from a fixed station, the sensor of the AUKF paper (Deng, Yin, Duan 2019)."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import not_negative, pair, positive
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("RangeBearing")


@dataclass(frozen=True, kw_only=True)
class RangeBearing(MeasurementModel):
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

    measures = ("range_m", "bearing_rad")
    place = "station"

    station: tuple[float, float] = pair((_DEFAULTS["station_x_m"], _DEFAULTS["station_y_m"]))
    sigma_range_m: float = positive(_DEFAULTS["sigma_range_m"])
    sigma_bearing_rad: float = positive(_DEFAULTS["sigma_bearing_rad"])
    near_field: float = not_negative(_DEFAULTS["near_field"])

    def _core_params(self) -> dict[str, float]:
        params = super()._core_params()
        params["station_x_m"], params["station_y_m"] = params.pop("station")  # type: ignore[misc]
        return params
