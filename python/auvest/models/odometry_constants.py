"""Dead reckoning by increments, with what instruments are off by in the state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from auvest import _core
from auvest._fields import not_negative
from auvest.models._constants import STATE, place
from auvest.models.odometry import Odometry

_DEFAULTS = _core.process_defaults("OdometryConstants")


def _walk(number: int) -> Any:
    return not_negative(_DEFAULTS[f"walk_{number}"])


@dataclass(frozen=True, kw_only=True)
class OdometryConstants(Odometry):
    """As :class:`Odometry`, with five constants behind the pose; one that nobody uses does no harm.

    Each is what an instrument is off by and stays off by, or walks: the relative error of the
    speed, the offset of the turn rate (rad/s), and those that sensors name
    (:class:`ScaledRange`). What is known of one before is its variance in ``P0``; any positive
    number does for one that nobody uses.

    Parameters
    ----------
    sigma_distance, sigma_drift, sigma_turn, sigma_turned : float
        As of :class:`Odometry`.
    speed_state, turn_state : int
        Places in the state, 3 to 7, of the relative error of the speed (distances are ``1 + error``
        times what is measured) and of what is added to the turn rate, rad/s; 0: not estimated.
    walk_0, walk_1, walk_2, walk_3, walk_4 : float
        Random walks of the five, their unit per sqrt(s), not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    state = STATE  # type: ignore[assignment]

    speed_state: int = place()
    turn_state: int = place()
    walk_0: float = _walk(0)
    walk_1: float = _walk(1)
    walk_2: float = _walk(2)
    walk_3: float = _walk(3)
    walk_4: float = _walk(4)
