"""Dead reckoning by increments."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import not_negative
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("Odometry")


@dataclass(frozen=True, kw_only=True)
class Odometry(ProcessModel):
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
        Noise of the heading that goes with time, rad/sqrt(s), not negative.
    sigma_turned : float
        Noise of the heading relative to the turn of an increment, not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    state = ("x_m", "y_m", "theta_rad")
    input = ("forward_m", "sideways_m", "turn_rad")

    sigma_distance: float = not_negative(_DEFAULTS["sigma_distance"])
    sigma_drift: float = not_negative(_DEFAULTS["sigma_drift"])
    sigma_turn: float = not_negative(_DEFAULTS["sigma_turn"])
    sigma_turned: float = not_negative(_DEFAULTS["sigma_turned"])
