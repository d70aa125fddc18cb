"""Records of a vehicle: a mission, its pilot, a hull and an ROV: the same bits on every target.

What the sensors of a mission tell comes from the desk (``simulation/mission.hpp``), in float.
Records and traces are little-endian 32-bit words (see ``vehicle_replay.hpp``).
"""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from firmware.parity.targets import HERE, INCLUDES

Rows: TypeAlias = npt.NDArray[Any]
Track: TypeAlias = Literal["lawnmower", "circle"]
Law: TypeAlias = Literal["adaptive", "crab", "line-of-sight", "integral", "vector-field"]
Method: TypeAlias = Literal["rk4", "semi-implicit"]

#: Period of the loop, s.
PERIOD_S = 0.1

# In the order of the enumerations.
_KINDS = ("mission", "hull", "rov", "pilot")
_TRACKS = ("lawnmower", "circle")
_LAWS = ("adaptive", "crab", "line-of-sight", "integral", "vector-field")
_KERNELS = ("unit", "huber", "hampel", "igg")
_METHODS = ("rk4", "semi-implicit")

#: What the sensors told in a step; NaN: nothing.
READING = np.dtype(
    [
        ("compass", "<f4"),
        ("rates", "<f4", 2),
        ("depth", "<f4"),
        ("log", "<f4", 2),
        ("pitch", "<f4"),
        ("fix", "<f4", 2),
    ]
)
#: A step of a mission on the desk: the readings, and what rudder, stern planes and propeller were
#: then told.
DESK_STEP = np.dtype([*READING.descr, ("command", "<f4", 3)])


@dataclass(frozen=True, eq=False, kw_only=True)
class Record:
    """What happens to a vehicle, and the form of what a target makes of it.

    Attributes
    ----------
    name : str
    kept : int, optional
        Only so many steps of it.
    """

    name: str
    kept: int | None = None

    #: Words of the trace before its first row: statuses of what was set up.
    prefix: ClassVar[int] = 1

    @property
    def rows(self) -> Rows:
        """What is told, step by step."""
        raise NotImplementedError

    @property
    def trace(self) -> np.dtype[Any]:
        """What a target shows after a step; floats as their bits."""
        raise NotImplementedError

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        raise NotImplementedError

    def trace_of(self, data: bytes) -> Rows:
        """Take a trace apart.

        Raises
        ------
        ValueError
            If something refused to start or the trace is not of this record.
        """
        begin, steps = 4 * self.prefix, len(self.rows)
        if any(data[:begin]):
            raise ValueError(f"{self.name}: statuses {np.frombuffer(data[:begin], '<u4')}")
        if len(data) != begin + steps * self.trace.itemsize:
            raise ValueError(f"{self.name}: a trace of {len(data)} bytes is not of {steps} steps")
        return np.frombuffer(data, self.trace, offset=begin)


def _words(*values: int) -> bytes:
    return np.array(values, "<u4").tobytes()


def _numbers(*values: npt.ArrayLike) -> bytes:
    return b"".join(np.asarray(value, "<f4").tobytes() for value in values)


# ---- Filter, guidance and control ----------------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class MissionRecord(Record):
    """A mission of the torpedo with a model-aided estimate, fixes every 0.5 s.

    Attributes
    ----------
    arc_m : float
        Radius of the arcs between the legs of the lawnmower; 0: corners.
    seconds : float
        Where the mission ends, if its track does not.
    kernel : {"unit", "huber", "hampel", "igg"}
        Of the filter.
    rejections : int
        After which it recovers; 0: never.
    outliers : float
        Share of ranges that are late.
    """

    track: Track = "lawnmower"
    law: Law = "crab"
    kernel: str = "igg"
    rejections: int = 6
    arc_m: float = 0.0
    speed_m_s: float = 1.5
    seconds: float = 600.0
    outliers: float = 0.05
    seed: int = 1

    prefix: ClassVar[int] = 3

    @property
    def rows(self) -> Rows:
        """What the sensors told and the desk commanded, dtype DESK_STEP."""
        return self._flown[1][: self.kept]

    @property
    def start_m(self) -> Rows:
        """Position where the estimate begins."""
        return self._flown[0]

    @property
    def _flown(self) -> tuple[Rows, Rows]:
        names = _TRACKS.index(self.track), _LAWS.index(self.law), _KERNELS.index(self.kernel)
        flight = self.arc_m, self.speed_m_s, self.seconds, self.outliers, self.seed
        return _fly(*names, self.rejections, *flight)

    @property
    def readings(self) -> Rows:
        """What the sensors told alone, dtype READING."""
        readings = np.zeros(len(self.rows), READING)
        for name in READING.names or ():
            readings[name] = self.rows[name]
        return readings

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        kinds = _KINDS.index("mission"), _LAWS.index(self.law), _TRACKS.index(self.track)
        return b"".join(
            [
                _words(*kinds),
                _numbers(self.arc_m, self.speed_m_s, 5.0, PERIOD_S),
                _words(_KERNELS.index(self.kernel), self.rejections),
                _numbers(self.start_m, [0.0, 0.0]),
                _words(len(self.rows)),
                self.readings.tobytes(),
            ]
        )

    @property
    def trace(self) -> np.dtype[Any]:
        """What a target shows after a step; floats as their bits."""
        return np.dtype(
            [
                ("x", "<u4", 4),
                ("P", "<u4", 10),
                ("nis", "<u4"),
                ("weight", "<u4"),
                ("heading", "<u4"),
                ("along", "<u4"),
                ("cross", "<u4"),
                ("direction", "<u4"),
                ("wanted", "<u4", 2),
                ("reference", "<u4"),
                ("command", "<u4", 3),
                ("integrals", "<u4", 2),
                ("status", "u1"),
                ("leg", "u1"),
                ("on_arc", "u1"),
                ("spare", "u1"),
            ]
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class PilotRecord(Record):
    """What the pilot of the sketch hears of a mission: sensors silent or wrong, fixes late.

    Attributes
    ----------
    mission : MissionRecord
        Where the readings come from.
    """

    mission: MissionRecord

    #: What it hears in a step.
    READING: ClassVar[np.dtype[Any]] = np.dtype(
        [("heard", "<u4"), ("values", "<f4", 7), ("fix", "<f4", 2), ("age", "<f4")]
    )

    @property
    def rows(self) -> Rows:
        """What it hears, dtype READING."""
        told = self.mission.rows
        rows = np.zeros(len(told), self.READING)
        rows["heard"] = 15
        order = ("compass", "pitch", "rates", "log", "depth")
        rows["values"] = np.column_stack([told[name] for name in order])
        rows["fix"], rows["age"] = np.nan, np.nan
        # Of three fixes one comes at once, one late, and one now and then too late for the memory.
        for number, k in enumerate(np.flatnonzero(~np.isnan(told["fix"][:, 0]))):
            late = (0, 4, 17 if number % 9 == 2 else 12)[number % 3]
            if k + late < len(rows):
                rows["fix"][k + late], rows["age"][k + late] = told["fix"][k], 0.1 * late
        for first, steps, sensor in ((100, 40, 1), (160, 25, 2), (240, 30, 4), (330, 25, 8)):
            rows["heard"][first : first + steps] &= 15 - sensor
        for step, column, value in ((70, 0, 9.0), (75, 3, np.nan), (80, 4, 50.0), (85, 6, -9.0)):
            rows["values"][step, column] = value
        rows["fix"][np.flatnonzero(~np.isnan(rows["age"]))[30], 0] = -5.0
        return rows[: self.kept]

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        head = _words(_KINDS.index("pilot")) + _numbers(self.mission.start_m, [0.0])
        return head + _words(len(self.rows)) + self.rows.tobytes()

    @property
    def trace(self) -> np.dtype[Any]:
        """What a target shows after a step; floats as their bits."""
        return np.dtype(
            [
                ("x", "<u4", 4),
                ("P", "<u4", 10),
                ("nis", "<u4"),
                ("heading", "<u4"),
                ("cross", "<u4"),
                ("command", "<u4", 3),
                ("predicted", "u1"),
                ("corrected", "u1"),
                ("steered", "u1"),
                ("mode", "u1"),
                ("leg", "u1"),
                ("asks", "u1"),
                ("implausible", "<u2"),
            ]
        )


@cache
def _world() -> tuple[Path, tempfile.TemporaryDirectory[str]]:
    """Compile ``vehicle_world.cpp`` into a folder that lives as long as the program here."""
    folder = tempfile.TemporaryDirectory()
    program = Path(folder.name) / "vehicle_world"
    flags = ["-std=c++11", "-O1", "-ffp-contract=off"]
    source = str(HERE / "vehicle_world.cpp")
    subprocess.run(["g++", *flags, *INCLUDES, source, "-o", str(program)], check=True)
    return program, folder


@cache
def _fly(*arguments: float) -> tuple[Rows, Rows]:
    """Fly a mission on the desk: where the estimate began, and the steps."""
    program, _ = _world()
    done = subprocess.run([program, *map(str, arguments)], check=True, capture_output=True)
    return np.frombuffer(done.stdout[:8], "<f4"), np.frombuffer(done.stdout[8:], DESK_STEP)


# ---- Hulls ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class HullRecord(Record):
    """Commands of the torpedo `remus100`.

    Attributes
    ----------
    freedom : {3, 6}
    method : {"rk4", "semi-implicit"}
    h : float
        Step, s.
    commands : ndarray of float32, shape (steps, 3)
    start : ndarray of float32
        Pose, velocities through the water, actuators.
    current_m_s : tuple of float
        North, east, down; in the plane the last is not used.
    """

    freedom: int
    method: Method
    commands: Rows
    start: Rows
    h: float = PERIOD_S
    current_m_s: tuple[float, float, float] = (0.2, -0.15, 0.0)

    @property
    def rows(self) -> Rows:
        """The commands."""
        return self.commands[: self.kept]

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        return b"".join(
            [
                _words(_KINDS.index("hull"), self.freedom, _METHODS.index(self.method)),
                _numbers(self.h, self.current_m_s, self.start),
                _words(len(self.rows)),
                _numbers(self.rows),
            ]
        )

    @property
    def trace(self) -> np.dtype[Any]:
        """What a target shows after a step; floats as their bits."""
        return np.dtype([("x", "<u4", len(self.start)), ("status", "<u4")])


@dataclass(frozen=True, eq=False, kw_only=True)
class RovRecord(Record):
    """Poses that the ROV `bluerov2_heavy` is to take: controller, allocation and hull in a loop.

    Attributes
    ----------
    wanted : ndarray of float32, shape (steps, 6)
    current_m_s : tuple of float
    """

    wanted: Rows
    current_m_s: tuple[float, float, float] = (0.3, -0.2, 0.1)

    prefix: ClassVar[int] = 2

    @property
    def rows(self) -> Rows:
        """The poses."""
        return self.wanted[: self.kept]

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        head = _words(_KINDS.index("rov")) + _numbers(PERIOD_S, self.current_m_s)
        return head + _words(len(self.rows)) + _numbers(self.rows)

    @property
    def trace(self) -> np.dtype[Any]:
        """What a target shows after a step; floats as their bits."""
        return np.dtype(
            [
                ("demand", "<u4", 6),
                ("thrust", "<u4", 8),
                ("scale", "<u4", 3),
                ("command", "<u4", 8),
                ("x", "<u4", 20),
                ("status", "u1"),
                ("saturated", "u1"),
                ("spare", "<u2"),
            ]
        )


# ---- The records ---------------------------------------------------------------------------------

#: Names of all records.
NAMES = (
    "mission",
    "mission-circle",
    "mission-adaptive",
    "mission-line-of-sight",
    "mission-integral",
    "mission-vector-field",
    "hull6",
    "hull3",
    "hull6-zigzag",
    "hull6-semi-implicit",
    "hull3-semi-implicit",
    "rov",
    "pilot",
)


def zigzag(steps: int, h: float) -> Rows:
    """Full rudder to either side, the nose up and down, the propeller ahead and astern."""
    t = h * np.arange(steps)
    rudder = np.where(t % 14 < 7, 0.3, -0.3)  # beyond the limit of 15 degrees
    planes = 0.03 * np.sin(1.3 * t)
    speed = np.where(t % 40 < 25, 20.0, np.where(t % 40 < 33, 0.0, -15.0))
    return np.stack([rudder, planes, speed], axis=1).astype("<f4")


def _stations() -> Rows:
    """Every 15 s another place and heading; some so far that the thrusters are at their limits."""
    places = np.array([[0, 0, 0, 0], [1, -0.5, 0.5, 1.57], [6, 4, 3, -3.0], [6, 4, 3, 3.0]])
    rows = np.zeros((600, 6), "<f4")
    rows[:, [0, 1, 2, 5]] = places[np.arange(len(rows)) // 150]
    return rows


@cache
def all_records() -> tuple[Record, ...]:
    """All records, the long mission first."""
    long = MissionRecord(name="mission", speed_m_s=1.0)
    arcs = MissionRecord(name="arcs", arc_m=15.0, seconds=130.0)
    commands = long.rows["command"]
    rest = [20.0, 20.0, 5.0, *np.zeros(12)]
    plane = [20.0, 20.0, *np.zeros(7)]
    turning = [0.0, 0.0, 5.0, 0.1, -0.1, 3.0, 1.2, 0.1, -0.1, 0.1, 0.05, -0.1, 0.0, 0.0, 10.0]
    return (
        long,
        MissionRecord(name="mission-circle", track="circle", seconds=120.0, seed=2),
        replace(arcs, name="mission-adaptive", law="adaptive", kernel="hampel", seed=3),
        replace(arcs, name="mission-line-of-sight", law="line-of-sight", seed=4),
        replace(arcs, name="mission-integral", law="integral", kernel="huber", seed=5),
        replace(
            arcs,
            name="mission-vector-field",
            law="vector-field",
            kernel="unit",
            rejections=0,
            outliers=0.0,
            seed=6,
        ),
        HullRecord(name="hull6", freedom=6, method="rk4", commands=commands, start=_f4(rest)),
        HullRecord(name="hull3", freedom=3, method="rk4", commands=commands, start=_f4(plane)),
        HullRecord(
            name="hull6-zigzag",
            freedom=6,
            method="rk4",
            commands=zigzag(800, 0.05),
            start=_f4(turning),
            h=0.05,
            current_m_s=(0.4, 0.3, 0.1),
        ),
        HullRecord(
            name="hull6-semi-implicit",
            freedom=6,
            method="semi-implicit",
            commands=zigzag(2000, 0.02),
            start=_f4(turning),
            h=0.02,
        ),
        HullRecord(
            name="hull3-semi-implicit",
            freedom=3,
            method="semi-implicit",
            commands=zigzag(2000, 0.02),
            start=_f4(plane),
            h=0.02,
        ),
        RovRecord(name="rov", wanted=_stations()),
        PilotRecord(name="pilot", mission=MissionRecord(name="legs", seconds=200.0, seed=7)),
    )


def _f4(values: npt.ArrayLike) -> Rows:
    return np.asarray(values, "<f4")


def first_steps(record: Record, steps: int) -> Record:
    """Give the beginning of a record."""
    return replace(record, kept=steps)
