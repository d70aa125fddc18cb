"""Dead reckoning through the water, with the current in the state."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import not_negative
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("SpeedHeadingCurrent")


@dataclass(frozen=True, kw_only=True)
class SpeedHeadingCurrent(ProcessModel):
    """Dead reckoning in a current, state ``[x, y, Vx, Vy]`` (m, m/s): the model-aided filter.

    What drives a prediction is ``[forward speed, starboard speed, heading]`` (m/s, m/s, rad), the
    speeds through the water. Axes as in :class:`SpeedHeading`. ``Vx`` and ``Vy`` are the current.

    Parameters
    ----------
    position_psd : float
        White noise of the position, m^2/s, not negative. The default is for a compass that may be
        off by 1 degree.
    current_psd : float
        Random walk of the current, m^2/s^3, not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    state = ("x_m", "y_m", "current_x_m_s", "current_y_m_s")
    input = ("forward_m_s", "starboard_m_s", "heading_rad")

    position_psd: float = not_negative(_DEFAULTS["position_psd"])
    current_psd: float = not_negative(_DEFAULTS["current_psd"])
