"""What a log consists of: its files, their columns, and what a value of each can be.

The limits are wide enough for any vehicle and narrow enough to catch the usual wrong units:
degrees, milliseconds, millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

_TURN = 2 * math.pi + 1e-6


@dataclass(frozen=True)
class Column:
    """One column: its name with the unit, the limits of a value, and what lies behind a breach.

    ``cause`` is the breach's name in :data:`auvest.logs.findings.CAUSES`.
    """

    name: str
    low: float
    high: float
    suspicion: str = ""
    integer: bool = False
    cause: str = "unreadable"

    @property
    def expected(self) -> str:
        """What a value must be, in words."""
        kind = "an integer" if self.integer else "a number"
        return f"{kind} from {self.low:.6g} to {self.high:.6g}"

    def takes(self, values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Say of each value whether it can stand in this column; NaN cannot."""
        good = (values >= self.low) & (values <= self.high)
        if self.integer:
            good &= values == np.floor(values)
        return np.asarray(good, bool)


_COLUMNS = {
    column.name: column
    for column in (
        Column("time_s", -1e11, 1e11, "milliseconds or nanoseconds?", cause="milliseconds"),
        Column("source", 0, 1e9, integer=True),
        Column("forward_m", -1e4, 1e4, "millimetres?", cause="millimetres"),
        Column("left_m", -1e4, 1e4, "millimetres?", cause="millimetres"),
        Column("turn_rad", -_TURN, _TURN, "degrees?", cause="degrees"),
        Column("speed_m_s", -50, 50, "millimetres per second?", cause="millimetres"),
        Column("yaw_rate_rad_s", -20, 20, "degrees per second?", cause="degrees"),
        Column("range_m", 0, 1e5, "millimetres, or a code for 'no echo'?", cause="millimetres"),
        Column("bearing_rad", -_TURN, _TURN, "degrees?", cause="degrees"),
        Column("heading_rad", -_TURN, _TURN, "degrees?", cause="degrees"),
        Column("x_m", -1e7, 1e7, "millimetres?", cause="millimetres"),
        Column("y_m", -1e7, 1e7, "millimetres?", cause="millimetres"),
        Column("sigma_m", 0, 1e4, "millimetres?", cause="millimetres"),
    )
}


def _layout(*names: str) -> tuple[Column, ...]:
    return tuple(_COLUMNS[name] for name in names)


#: The files of a log and the columns each may have; one of the layouts, in any order of columns.
FILES: Mapping[str, tuple[tuple[Column, ...], ...]] = {
    "odometry.csv": (
        _layout("time_s", "forward_m", "left_m", "turn_rad"),
        _layout("time_s", "speed_m_s", "yaw_rate_rad_s"),
    ),
    "ranges.csv": (_layout("time_s", "source", "range_m"),),
    "fixes.csv": (_layout("time_s", "source", "range_m", "bearing_rad"),),
    "beacons.csv": (_layout("source", "x_m", "y_m"),),
    "leaders.csv": (
        _layout("time_s", "source", "x_m", "y_m"),
        _layout("time_s", "source", "x_m", "y_m", "sigma_m"),
    ),
    "start.csv": (_layout("time_s", "x_m", "y_m", "heading_rad"),),
    "truth.csv": (
        _layout("time_s", "x_m", "y_m"),
        _layout("time_s", "x_m", "y_m", "heading_rad"),
    ),
}
