"""Range and bearing from a fixed station, the sensor of the AUKF paper (Deng, Yin, Duan 2019)."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._arguments import require_range_limits
from auvest._fields import not_negative, number, pair, positive
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("RangeBearing")


@dataclass(frozen=True, kw_only=True)
class RangeBearing(MeasurementModel):
    """Range (m) and bearing (rad, from +x towards +y) from a fixed station, Eq. (6).

    Parameters
    ----------
    station : (float, float)
        Position of the station, m from a local origin.
    sigma_range_m, sigma_bearing_rad : float
        Standard deviations of the two noises, positive. The paper does not state them.
    near_field : float
        Where the range is below this many position standard deviations ``sqrt(P_xx + P_yy)`` the
        measurement is taken as the position it points to; there the bearing has no useful slope.
        0 switches this off except on the station itself.
    smallest_range_m, largest_range_m : float
        What the instrument can measure, m: a range outside is refused, for it is a code or a fault;
        defaults: 0 and infinity. A smallest one below 0 is for readings whose noise is not cut off
        at 0.

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
    smallest_range_m: float = number(_DEFAULTS["smallest_range_m"])
    largest_range_m: float = positive(_DEFAULTS["largest_range_m"], infinite=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_range_limits(self.smallest_range_m, self.largest_range_m)

    def _core_params(self) -> dict[str, float]:
        params = super()._core_params()
        params["station_x_m"], params["station_y_m"] = params.pop("station")  # type: ignore[misc]
        return params
