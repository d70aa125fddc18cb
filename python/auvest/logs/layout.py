"""What a log consists of: its files, their columns, and what a value of each can be.

The limits are wide enough for any vehicle and narrow enough to catch the usual wrong units:
degrees, milliseconds, millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

#: A full turn, however it was rounded.
TURN = 2 * math.pi + 1e-4

#: What a time beyond so many seconds is in, as no clock of seconds tells it.
TIME_UNITS: Mapping[str, float] = {"ns": 1e17, "us": 1e14, "ms": 1e11}

Unit: TypeAlias = Literal["s", "m", "m/s", "rad", "rad/s", "deg", ""]


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
        return f"{kind} from {self.low:.10g} to {self.high:.10g}"

    @property
    def span(self) -> str:
        """The limits with the unit."""
        return f"{self.low:.10g}..{self.high:.10g} {self.unit}".rstrip()

    def breach(self, value: float, given: str = "") -> str:
        """Say what is wrong with a value that the column does not take, shown as it was given."""
        shown = given or f"{value:.10g}"
        if not math.isfinite(value) or (self.integer and value % 1):
            return f"{shown} is not {self.expected}"
        return f"{shown} lies outside {self.span}"

    @property
    def unit(self) -> Unit:
        """The unit that its name ends with."""
        units: tuple[tuple[str, Unit], ...] = (
            ("_rad_s", "rad/s"), ("_m_s", "m/s"), ("_rad", "rad"), ("_deg", "deg"), ("_m", "m"),
            ("_s", "s"),
        )  # fmt: skip
        return next((unit for end, unit in units if self.name.endswith(end)), "")

    def suspect(self, value: float) -> tuple[str, str]:
        """Say in words what a value beyond the limits is a sign of ("": of nothing), and its cause.

        Less than a limit of 0 is no length in millimetres.
        """
        if not math.isfinite(value) or value < self.low == 0:
            code = self.name == "range_m" and math.isfinite(value)
            return ("a code for 'no echo'?", "no_echo") if code else ("", "unreadable")
        if self.name == "time_s":
            if value < 0:
                return "", "unreadable"
            if value < TIME_UNITS["us"]:
                return "milliseconds?", "milliseconds"
            return "microseconds?" if value < TIME_UNITS["ns"] else "nanoseconds?", "microseconds"
        if self.name == "temperature_c" and value < self.low:
            return "a code for 'no value'?", self.cause
        return self.suspicion, self.cause

    def takes(self, values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Say of each value whether it can stand in this column; NaN cannot."""
        good = (values >= self.low) & (values <= self.high)
        if self.integer:
            good &= values == np.floor(values)
        return np.asarray(good, bool)


@dataclass(frozen=True)
class Layout:
    """The columns that a file must have, and those that it may have beside them."""

    required: tuple[Column, ...]
    optional: tuple[Column, ...] = ()

    @property
    def columns(self) -> tuple[Column, ...]:
        """All of them, in the order of rows."""
        return self.required + self.optional

    def __str__(self) -> str:
        text = ",".join(column.name for column in self.required)
        also = ",".join(column.name for column in self.optional)
        return f"{text}[,{also}]" if also else text


def _length(name: str, limit: float = 1e4, low: float | None = None) -> Column:
    low = -limit if low is None else low
    return Column(name, low, limit, "millimetres?", cause="millimetres")


def _speed(name: str) -> Column:
    return Column(name, -50, 50, "millimetres per second?", cause="millimetres")


def _angle(name: str) -> Column:
    return Column(name, -TURN, TURN, "degrees?", cause="degrees")


#: Every column that a file can have, by its name.
COLUMNS: Mapping[str, Column] = {
    column.name: column
    for column in (
        Column("time_s", -TIME_UNITS["ms"], TIME_UNITS["ms"]),
        Column("time", -TIME_UNITS["ms"], TIME_UNITS["ms"]),
        Column("source", 0, 1e9, integer=True),
        _length("forward_m"),
        _length("distance_m"),
        _length("left_m"),
        _length("starboard_m"),
        _angle("turn_rad"),
        _speed("speed_m_s"),
        _speed("forward_m_s"),
        _speed("left_m_s"),
        _speed("starboard_m_s"),
        _speed("down_m_s"),
        _speed("vx_m_s"),
        _speed("vy_m_s"),
        Column("ax_m_s2", -100, 100),
        Column("ay_m_s2", -100, 100),
        Column("yaw_rate_rad_s", -20, 20, "degrees per second?", cause="degrees"),
        Column("range_m", 0, 1e5, "millimetres, or a code for 'no echo'?", cause="millimetres"),
        _angle("bearing_rad"),
        _angle("azimuth_rad"),
        Column("elevation_rad", -1.6, 1.6, "degrees?", cause="degrees"),
        Column("depression_rad", -1.6, 1.6, "degrees?", cause="degrees"),
        _angle("heading_rad"),
        _angle("compass_rad"),
        _length("x_m", 1e7),
        _length("y_m", 1e7),
        _length("depth_m", 12_000, -1000),
        _length("sigma_m", low=0),
        Column("sigma_velocity_m_s", 0, 50, "millimetres per second?", cause="millimetres"),
        Column("sigma_acceleration_m_s2", 0, 100),
        Column("temperature_c", -5, 60, "kelvin?"),
        Column("salinity_psu", 0, 60),
        Column("latitude_deg", -90, 90),
        Column("longitude_deg", -360, 360),
    )
}


def _layout(required: str, optional: str = "") -> Layout:
    def columns(names: str) -> tuple[Column, ...]:
        return tuple(COLUMNS[name] for name in names.split(",") if name)

    return Layout(columns(required), columns(optional))


#: The files of a log and the columns each may have, in any order: the first layout whose columns
#: are all there counts.
FILES: Mapping[str, tuple[Layout, ...]] = {
    "odometry.csv": (
        _layout("time_s,forward_m,left_m,turn_rad"),
        _layout("time_s,forward_m,turn_rad"),
        _layout("time_s,speed_m_s,yaw_rate_rad_s", "left_m_s"),
        _layout("time_s,forward_m,heading_rad", "left_m"),
        _layout("time_s,speed_m_s,heading_rad", "left_m_s"),
        _layout("time_s,forward_m", "left_m"),
        _layout("time_s,speed_m_s", "left_m_s"),
    ),
    "compass.csv": (_layout("time_s,heading_rad"),),
    "ranges.csv": (_layout("time_s,source,range_m"),),
    "fixes.csv": (_layout("time_s,source,range_m,bearing_rad", "elevation_rad"),),
    "positions.csv": (_layout("time_s,x_m,y_m", "sigma_m,depth_m"),),
    "echoes.csv": (
        _layout("time_s,source,range_m,bearing_rad"),
        _layout("time_s,range_m,bearing_rad"),
    ),
    "masters.csv": (
        _layout(
            "time_s,source,x_m,y_m",
            "vx_m_s,vy_m_s,ax_m_s2,ay_m_s2,sigma_m,sigma_velocity_m_s,sigma_acceleration_m_s2",
        ),
    ),
    "plans.csv": (_layout("time_s,source,ax_m_s2,ay_m_s2"),),
    "velocities.csv": (_layout("time_s,forward_m_s,left_m_s,heading_rad", "down_m_s"),),
    "depth.csv": (_layout("time_s,depth_m"),),
    "water.csv": (_layout("time_s,temperature_c", "salinity_psu"),),
    "beacons.csv": (_layout("source,x_m,y_m", "depth_m"),),
    "leaders.csv": (_layout("time_s,source,x_m,y_m", "sigma_m,depth_m"),),
    "start.csv": (_layout("time_s,x_m,y_m,heading_rad"), _layout("time_s,x_m,y_m")),
    "truth.csv": (_layout("time_s,x_m,y_m", "heading_rad"),),
    "master_truth.csv": (_layout("time_s,source,x_m,y_m"),),
    "origin.csv": (_layout("latitude_deg,longitude_deg"),),
}

#: What is in each, for those who make a log.
WHAT: Mapping[str, str] = {
    "odometry.csv": "how the craft moved: increments since the line before, or velocities",
    "compass.csv": "how it was headed, where that has a rate of its own",
    "ranges.csv": "ranges to sources, by number",
    "fixes.csv": "range and bearing of the craft from a station",
    "positions.csv": "where it was: GPS, USBL",
    "echoes.csv": "range and bearing of masters, as the craft's sonar hears them",
    "masters.csv": "what is told of a master, and from when on",
    "plans.csv": "accelerations that masters have announced",
    "velocities.csv": "velocity over ground and heading that a tracked craft tells",
    "depth.csv": "how deep it was: ranges are then slant",
    "water.csv": "the water, for the speed of sound",
    "beacons.csv": "sources that stand; no times",
    "leaders.csv": "sources that move",
    "start.csv": "one line: where the run starts",
    "truth.csv": "where it really was: only to score",
    "master_truth.csv": "where masters really were: only to score",
    "origin.csv": "one line: where on Earth (0, 0) is",
}

#: Other columns that can stand in the place of one, or of two: what they are is in their names.
SPELLINGS: Mapping[tuple[str, ...], tuple[tuple[str, ...], ...]] = {
    ("time_s",): (("time",),),
    ("forward_m",): (("distance_m",),),
    ("left_m",): (("starboard_m",),),
    ("speed_m_s",): (("forward_m_s",),),
    ("left_m_s",): (("starboard_m_s",),),
    ("heading_rad",): (("compass_rad",),),
    ("bearing_rad",): (("azimuth_rad",),),
    ("elevation_rad",): (("depression_rad",),),
    ("x_m", "y_m"): (("latitude_deg", "longitude_deg"),),
}


@dataclass(frozen=True)
class Match:
    """The layout that a header has.

    Attributes
    ----------
    columns : tuple of Column
        What rows hold, in their order.
    given : tuple of str
        The column of the file that each comes from: itself, or its other spelling.
    """

    columns: tuple[Column, ...]
    given: tuple[str, ...]


def match(name: str, header: Collection[str]) -> Match | None:
    """Find the first layout of a file whose columns are all in a header; None if there is none."""
    for layout in FILES[name]:
        required = [_given(layout, column.name, header) for column in layout.required]
        if None in required:
            continue
        optional = [(column, _given(layout, column.name, header)) for column in layout.optional]
        there = [(column, given) for column, given in optional if given is not None]
        return Match(
            layout.required + tuple(column for column, _ in there),
            (*(given for given in required if given), *(given for _, given in there)),
        )
    return None


def _given(layout: Layout, column: str, header: Collection[str]) -> str | None:
    """Say which column of a header gives one of the layout."""
    if column in header:
        return column
    own = {other.name for other in layout.columns}
    for names, spellings in SPELLINGS.items():
        for other in spellings if column in names else ():
            if all(one in header and one not in own for one in other):
                return other[names.index(column)]
    return None


def near(name: str, columns: tuple[Column, ...]) -> set[str]:
    """Give all columns of the layouts that have these among theirs: what else could be meant."""
    wanted = {column.name for column in columns}
    layouts = [{one.name for one in layout.columns} for layout in FILES[name]]
    found = set().union(*(names for names in layouts if wanted <= names))
    return found | {
        other
        for names, spellings in SPELLINGS.items()
        if set(names) <= found
        for one in spellings
        for other in one
    }
