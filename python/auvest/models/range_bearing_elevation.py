"""Slant range, bearing and elevation from a fixed station: a USBL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from auvest import _core
from auvest._arguments import as_array, require_range_limits
from auvest._fields import not_negative, number, positive
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("RangeBearingElevation")


@dataclass(frozen=True, kw_only=True)
class RangeBearingElevation(MeasurementModel):
    """Slant range (m), bearing and elevation (rad) from a station, for states with ``x, y, z``.

    The bearing counts from +x towards +y, the elevation from the horizontal towards +z: where z
    points down it is the depression.

    Parameters
    ----------
    station : (float, float, float)
        Position of the station, m from a local origin.
    sigma_range_m, sigma_bearing_rad, sigma_elevation_rad : float
        Standard deviations of the three noises, positive. An instrument's error across the line of
        sight is an angle on the sphere: ``sigma_bearing_rad`` is that over the cosine of the
        elevation.
    near_field : float
        Where the station, or the vertical through it, is nearer than this many standard deviations
        of the position, the measurement is taken as the position it points to. 0 switches this off
        except on them.
    smallest_range_m, largest_range_m : float
        What the instrument can measure, m: a range outside is refused, for it is a code or a fault;
        defaults: 0 and infinity. A smallest one below 0 is for readings whose noise is not cut off
        at 0.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    observes = ("x_m", "y_m", "z_m")
    measures = ("range_m", "bearing_rad", "elevation_rad")
    place = "station"

    station: tuple[float, float, float] = (
        _DEFAULTS["station_x_m"],
        _DEFAULTS["station_y_m"],
        _DEFAULTS["station_z_m"],
    )
    sigma_range_m: float = positive(_DEFAULTS["sigma_range_m"])
    sigma_bearing_rad: float = positive(_DEFAULTS["sigma_bearing_rad"])
    sigma_elevation_rad: float = positive(_DEFAULTS["sigma_elevation_rad"])
    near_field: float = not_negative(_DEFAULTS["near_field"])
    smallest_range_m: float = number(_DEFAULTS["smallest_range_m"])
    largest_range_m: float = positive(_DEFAULTS["largest_range_m"], infinite=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_range_limits(self.smallest_range_m, self.largest_range_m)
        station = as_array("station", self.station, (3,), np.dtype(np.float64))
        object.__setattr__(self, "station", tuple(station.tolist()))

    def _core_params(self) -> dict[str, float]:
        params = super()._core_params()
        for axis, value in zip("xyz", params.pop("station"), strict=True):  # type: ignore[call-overload]
            params[f"station_{axis}_m"] = value
        return params
