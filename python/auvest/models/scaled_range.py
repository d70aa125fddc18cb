"""Range whose scale and offset are constants among the states."""

from __future__ import annotations

from dataclasses import dataclass

from auvest.models._constants import STATE, place
from auvest.models.leader_range import LeaderRange


@dataclass(frozen=True, kw_only=True)
class ScaledRange(LeaderRange):
    """Range (m) to a leader or a beacon, by an instrument with a scale and an offset of its own.

    For :class:`OdometryConstants`: a range is ``1 + scale`` times the distance, plus the offset.
    Each beacon may have an offset of its own.

    Parameters
    ----------
    leader, sigma_range_m, sigma_leader_m, smallest_range_m, largest_range_m
        As of :class:`LeaderRange`.
    scale_state, offset_state : int
        Places of the scale error and of the offset (m) in the state, 3 to 7; 0: none.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    observes = STATE

    scale_state: int = place()
    offset_state: int = place()
