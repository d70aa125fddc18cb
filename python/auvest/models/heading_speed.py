"""Compass, log and sway log together, as a measurement."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import positive
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("HeadingSpeed")


@dataclass(frozen=True, kw_only=True)
class HeadingSpeed(MeasurementModel):
    """Heading (rad) and velocity through the water, ahead and to starboard (m/s): compass and log.

    For :class:`PlanarHull`, which has them in its state; :class:`SpeedHeadingCurrent` is driven by
    them instead.

    Parameters
    ----------
    sigma_heading_rad : float
        Standard deviation, rad, positive. What the bias of the compass is known to belongs to it.
    sigma_forward_m_s, sigma_starboard_m_s : float
        Standard deviations, m/s, positive. For a craft without a log: far larger than its speed,
        and any number in its place.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    observes = ("x_m", "y_m", "heading_rad", "forward_m_s", "starboard_m_s")
    measures = ("heading_rad", "forward_m_s", "starboard_m_s")

    sigma_heading_rad: float = positive(_DEFAULTS["sigma_heading_rad"])
    sigma_forward_m_s: float = positive(_DEFAULTS["sigma_forward_m_s"])
    sigma_starboard_m_s: float = positive(_DEFAULTS["sigma_starboard_m_s"])
