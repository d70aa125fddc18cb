"""Records of the filters that localise and track: what a slave meets, and a filter that meets it.

One world is the paper's scenario, that of ``simulation/slat.hpp`` (configuration R1), computed in
C++; the other has what it has not (:func:`encounter`). Records and traces are little-endian 32-bit
words (see ``slatf_replay.hpp``).
"""

from __future__ import annotations

import math
import subprocess
import tempfile
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from auvest import (
    CompassMotion,
    EkfSlat,
    Imm,
    PiecewiseAcceleration,
    Slatf,
    SlatfJoint,
    Sonar,
    UnicycleMotion,
)
from auvest.firmware.hil_slat import Newcomer, SlatRecord, steps_of_run
from auvest.slat import Lanes, SlatFilter
from firmware.parity.targets import AVR_PARTICLES, HERE, INCLUDES, MASTERS, PARTICLES, Target

Kind = Literal[
    "slatf1",
    "slatf2",
    "slatf1-unicycle",
    "slatf2-unicycle",
    "slatf-joint",
    "slatf-joint-unicycle",
    "ekf-slat",
    "ekf-slat-unicycle",
    "slatf1-imm",
    "slatf2-unicycle-imm",
    "ekf-slat-imm",
    "ekf-slat-unicycle-imm",
    "slatf-shared",
]
#: In the order of the enumeration in C++.
KINDS: tuple[Kind, ...] = Kind.__args__  # type: ignore[attr-defined]

#: A belief: mean, and the lower triangle of the covariance row by row.
SLAVE = np.dtype([("x", "<f4", 2), ("P", "<f4", 3)])
SLAVE_WITH_HEADING = np.dtype([("x", "<f4", 3), ("P", "<f4", 6)])
MASTER = np.dtype([("x", "<f4", 6), ("P", "<f4", 21)])

#: A reading of speed [m/s] and heading [rad], good for dt [s]; the master's planned velocity
#: change in that time [m/s]; and the echo that followed, if one was heard.
READING = np.dtype(
    [("dt", "<f4"), ("u", "<f4", 2), ("change", "<f4", 2), ("heard", "<u4"), ("z", "<f4", 2)]
)

#: What the sonar hears, and how long after the reading began [s]; a master of -1: nobody knows.
ECHO = np.dtype([("after_s", "<f4"), ("z", "<f4", 2), ("master", "<i4")])


@dataclass(frozen=True, eq=False)
class Step:
    """A reading, good for dt [s], with the planned velocity changes and the echoes in that time."""

    dt: npt.NDArray[Any]
    u: npt.NDArray[Any]
    changes: npt.NDArray[Any]
    echoes: npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class World:
    """What the slave of the paper meets while communication is broken.

    Attributes
    ----------
    slave : ndarray, dtype SLAVE
        Its state when communication broke.
    master : ndarray, dtype MASTER
        What it was told of the master.
    readings : ndarray, dtype READING, shape (400,)
        What it then measured.
    """

    slave: npt.NDArray[Any]
    master: npt.NDArray[Any]
    readings: npt.NDArray[Any]

    @property
    def masters(self) -> npt.NDArray[Any]:
        """What it was told, of all masters."""
        return self.master.reshape(1)

    @property
    def steps(self) -> list[Step]:
        """The readings, each with the echo at its end."""
        steps = []
        for row in self.readings:
            echoes = np.zeros(int(row["heard"] != 0), ECHO)
            echoes["after_s"], echoes["z"] = row["dt"], row["z"]
            steps.append(Step(row["dt"], row["u"], row["change"].reshape(1, 2), echoes))
        return steps


@dataclass(frozen=True, eq=False)
class Encounter:
    """What a slave meets that comes across masters: :func:`encounter`."""

    slave: npt.NDArray[Any]
    masters: npt.NDArray[Any]
    steps: list[Step]


@cache
def paper_world(seed: int = 1) -> World:
    """Let C++ play the scenario of section 7, 400 s with 200 pings.

    Parameters
    ----------
    seed : int
        Of the noise.

    Returns
    -------
    World
        What the slave meets.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "slatf_world"
        flags = ["-std=c++11", "-O1", "-ffp-contract=off"]
        source = str(HERE / "slatf_world.cpp")
        subprocess.run(["g++", *flags, *INCLUDES, source, "-o", str(program)], check=True)
        words = subprocess.run([program, str(seed)], check=True, capture_output=True).stdout
    slave, master = SLAVE.itemsize, SLAVE.itemsize + MASTER.itemsize
    return World(
        np.frombuffer(words[:slave], SLAVE)[0],
        np.frombuffer(words[slave:master], MASTER)[0],
        np.frombuffer(words[master:], READING),
    )


def paper_echoes(count: int) -> World:
    """Give the paper's world until its so manieth echo."""
    world = paper_world()
    last = np.flatnonzero(world.readings["heard"])[count - 1]
    return replace(world, readings=world.readings[: last + 1])


# ---- An encounter --------------------------------------------------------------------------------

_SLAVE_M_S = 1.5
_SLAVE_RAD_S = 0.02
_START_RAD = 0.4
#: Of the masters: place and velocity, from when on they turn [s] and how fast [rad/s].
_MASTERS = (
    ((60.0, 40.0), (1.2, 0.5), 8.0, 0.12),
    ((20.0, -50.0), (0.8, 1.0), math.inf, 0.0),
)
#: Seconds after the beginning of a reading at which the masters are heard, reading by reading in
#: turn: both at once in between; one in between, the other at the end; none; one at the beginning.
_HEARD: tuple[tuple[tuple[int, float], ...], ...] = (
    ((0, 0.25), (1, 0.25)),
    ((1, 0.5), (0, 1.0)),
    (),
    ((0, 0.0),),
)
#: The second master is heard from this reading on.
_SECOND = 4
#: The reading in which an echo is wrong, if one is.
_OUTLIER = 16


def encounter(
    motion: CompassMotion | UnicycleMotion, masters: int, *, known: bool, outlier_m: float
) -> Encounter:
    """Play 24 s in which a slave in a turn hears two masters, or one, of which the first turns.

    Echoes come between the readings, several at a time, or not at all. The bearing is that of the
    paper with a compass, else it is measured from the slave's own heading.

    Parameters
    ----------
    motion : CompassMotion or UnicycleMotion
        Of the slave, whose readings have its noise.
    masters : {1, 2}
    known : bool
        Whether the slave is told whose echo it hears.
    outlier_m : float
        By how much the range of one echo is wrong.
    """
    rng = np.random.default_rng(11)
    compass = isinstance(motion, CompassMotion)
    steps = []
    for k in range(24):
        speed = _SLAVE_M_S + motion.sigma_speed_m_s * rng.standard_normal()
        noise = rng.standard_normal()
        if isinstance(motion, CompassMotion):
            turn = _START_RAD + _SLAVE_RAD_S * (k + 0.5) + motion.sigma_heading_rad * noise
        else:
            turn = _SLAVE_RAD_S + motion.sigma_yaw_rate_rad_s * noise
        there = masters if k >= _SECOND else 1
        heard = [(n, after) for n, after in _HEARD[k % len(_HEARD)] if n < there]
        echoes = np.zeros(len(heard), ECHO)
        for echo, (n, after) in zip(echoes, heard, strict=True):
            z = _range_bearing(k + after, n, from_heading=not compass) + rng.normal(0, (0.5, 0.02))
            z[0] += outlier_m * (k == _OUTLIER and n == 0)
            z[1] = math.remainder(z[1], 2 * math.pi)
            echo["after_s"], echo["z"], echo["master"] = after, z, n if known else -1
        changes = [_master(k + 1.0, n)[1] - _master(float(k), n)[1] for n in range(masters)]
        u = np.array([speed, turn], "<f4")
        steps.append(Step(np.array(1.0, "<f4"), u, np.array(changes, "<f4"), echoes))
    slave = np.zeros((), SLAVE if compass else SLAVE_WITH_HEADING)
    slave["x"][2:] = _START_RAD
    slave["P"][[0, 2]] = 0.25
    slave["P"][5:] = 0.01
    told = np.zeros(masters, MASTER)
    for n in range(masters):
        place, velocity = _master(0.0, n)
        told["x"][n, :4] = *(place + rng.normal(0, 1.0, 2)), *(velocity + rng.normal(0, 0.1, 2))
        told["P"][n, np.cumsum(np.arange(1, 7)) - 1] = 1.0, 1.0, 0.01, 0.01, 0.01, 0.01
    return Encounter(slave, told, steps)


def _slave(time_s: float) -> tuple[npt.NDArray[Any], float]:
    """Give place [m] and heading [rad] of the slave, on its circle."""
    heading = _START_RAD + _SLAVE_RAD_S * time_s
    radius = _SLAVE_M_S / _SLAVE_RAD_S
    x = radius * (math.sin(heading) - math.sin(_START_RAD))
    return np.array([x, radius * (math.cos(_START_RAD) - math.cos(heading))]), heading


def _master(time_s: float, n: int) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Give place [m] and velocity [m/s] of master n: straight, then on a circle."""
    place, velocity, turns_s, rate = _MASTERS[n]
    v = np.array(velocity)
    straight = min(time_s, turns_s)
    angle = rate * (time_s - straight)
    p = np.array(place) + straight * v
    if angle == 0:
        return p, v
    c, s = math.cos(angle), math.sin(angle)
    arc = np.array([[s, c - 1], [1 - c, s]]) / rate
    return p + arc @ v, np.array([[c, -s], [s, c]]) @ v


def _range_bearing(time_s: float, n: int, *, from_heading: bool) -> npt.NDArray[Any]:
    slave, heading = _slave(time_s)
    dx, dy = _master(time_s, n)[0] - slave
    bearing = math.atan2(dy, dx) - heading if from_heading else math.atan2(-dy, -dx)
    return np.array([math.hypot(dx, dy), bearing])


# ---- Records -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Record:
    """A filter and the world that it meets; the defaults are those of R1 at noise level 3.

    Attributes
    ----------
    kind : Kind
    particles : int
        0 for a filter that has none.
    room : int
        Masters that there is room for.
    told : int
        Masters that the filter is told when it starts, of those of the world.
    planned : bool
        Whether it knows the masters' velocity changes.
    """

    kind: Kind
    particles: int
    world: World | Encounter = field(default_factory=paper_world)
    seed: int = 1
    room: int = 1
    told: int = 1
    planned: bool = True
    motion: CompassMotion | UnicycleMotion = field(
        default_factory=lambda: CompassMotion(sigma_speed_m_s=2.0, sigma_heading_rad=0.3)
    )
    master: PiecewiseAcceleration | Imm = field(
        default_factory=lambda: PiecewiseAcceleration(acceleration_m_s2=1e-4)
    )
    sonar: Sonar = field(default_factory=lambda: Sonar(sigma_range_m=1.0, sigma_bearing_rad=0.06))
    resample_below: float = 0.5
    carry_covariance: bool = False
    gate: float = 0.0
    birth_velocity_m_s: float = 0.0
    birth_acceleration_m_s2: float = 0.01
    kept: float = 0.5

    def filter(self, lanes: Lanes) -> SlatFilter:
        """Make it in Python, without the masters; a `Slatf` runs in the lanes of this set."""
        motion = self.motion.pose_states
        x0, P0 = self.world.slave["x"], symmetric(self.world.slave["P"], motion)
        models: dict[str, Any] = {"motion": self.motion, "sonar": self.sonar, "gate": self.gate}
        models |= {"master": self.master, "dtype": "float32", "recover_after": 0}
        if self.kind.startswith("ekf"):
            return EkfSlat(x0, P0, **models)
        particles: dict[str, Any] = {"particles": self.particles, "seed": self.seed}
        particles |= {"resample_below": self.resample_below}
        joint: dict[str, Any] = {"kept": self.kept, "max_masters": self.room}
        if self.kind == "slatf-shared":
            del models["recover_after"]
            return SlatfJoint(x0, P0, **models, **particles, **joint, covariance="shared")
        if self.kind.startswith("slatf-joint"):
            return SlatfJoint(x0, P0, **models, **particles, **joint)
        return Slatf(
            x0,
            P0,
            **models,
            **particles,
            version=1 if self.kind.startswith("slatf1") else 2,
            carry_covariance=self.carry_covariance,
            birth_velocity_m_s=self.birth_velocity_m_s,
            birth_acceleration_m_s2=self.birth_acceleration_m_s2,
            monte_carlo=False,
            lanes=lanes,
        )

    def for_bench(self) -> SlatRecord:
        """Give the record as hardware in the loop plays it."""
        steps = self.world.steps
        told = self.world.masters[: self.told]
        times = np.concatenate([[0.0], np.cumsum([float(step.dt) for step in steps])])
        echoes = [step.echoes for step in steps]
        heard = [time + part["after_s"] for time, part in zip(times[:-1], echoes, strict=True)]
        played = steps_of_run(
            times,
            np.array([step.u for step in steps]),
            z=np.concatenate([part["z"] for part in echoes]),
            z_time_s=np.concatenate(heard),
            master=np.concatenate([part["master"] for part in echoes]),
            changes=np.array([step.changes for step in steps]) if self.planned else None,
        )
        masters = [Newcomer(one["x"], symmetric(one["P"], 6)) for one in told]
        return SlatRecord(self.filter("scalar"), [*masters, *played], self.room)

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        steps = self.world.steps
        counts = [KINDS.index(self.kind), self.particles, self.room, self.told]
        births = [self.birth_velocity_m_s, self.birth_acceleration_m_s2]
        bearings = ("master_to_slave", "slave_to_master", "from_heading")
        parts = [
            np.array([*counts, len(steps), self.seed, self.planned], "<u4"),
            np.array([self.resample_below], "<f4"),
            np.array([self.carry_covariance], "<u4"),
            np.array([self.gate, *births, self.kept], "<f4"),
            np.array([self.sonar.sigma_range_m, self.sonar.sigma_bearing_rad], "<f4"),
            np.array([bearings.index(self.sonar.bearing)], "<u4"),
            np.array([v for v in asdict(self.motion).values() if not isinstance(v, bool)], "<f4"),
            np.array([v for v in asdict(self.motion).values() if isinstance(v, bool)], "<u4"),
            self._master_numbers(),
            self.world.slave,
            self.world.masters[: self.told],
        ]
        for step in steps:
            changes = np.zeros((self.room, 2), "<f4")
            known = step.changes[: self.room]
            changes[: len(known)] = known
            parts += [step.dt, step.u, changes, np.array(len(step.echoes), "<u4"), step.echoes]
        return b"".join(part.tobytes() for part in parts)

    def _master_numbers(self) -> npt.NDArray[Any]:
        if isinstance(self.master, PiecewiseAcceleration):
            return np.array([self.master.acceleration_m_s2], "<f4")
        models: list[dict[str, Any]] = [
            asdict(self.master.straight),
            asdict(self.master.accelerated),
            asdict(self.master.turning),
        ]
        numbers = [v for model in models for v in model.values() if not isinstance(v, str)]
        return np.array([self.master.switch_rate_hz, *self.master.share, *numbers], "<f4")

    def program(self, target: Target) -> tuple[str, ...]:
        """Give the flags with which a target's program is compiled for this record.

        All filters in one program do not fit into the flash of the ATmega2560, nor the room that
        others need into its RAM. The one with one covariance is a program of its own anywhere.
        """
        kinds = 1 << KINDS.index(self.kind)
        if target.machine != "avr":
            return (f"-DAUVEST_KINDS={kinds}",) if self.kind == "slatf-shared" else ()
        capacity = f"-DAUVEST_PARTICLES={max(1, self.particles)}", f"-DAUVEST_MASTERS={self.room}"
        return (f"-DAUVEST_KINDS={kinds}", *capacity)

    @property
    def trace(self) -> np.dtype[Any]:
        """What the filter shows after a reading with echoes; floats as their bits."""
        pose = self.motion.pose_states
        master: list[Any] = [("x", "<u4", 6), ("P", "<u4", 21)]
        if isinstance(self.master, Imm):
            master.append(("modes", "<u4", 3))
        rows: list[Any] = [("particles", "<u4", (self.particles, fields_of(self.kind, self.room)))]
        rows += [("slave_x", "<u4", pose), ("slave_P", "<u4", pose * (pose + 1) // 2)]
        rows.append(("masters", master, self.room))
        if self.particles:
            rows += [("effective_size", "<u4"), ("log_likelihood", "<u4"), ("resamplings", "<u4")]
        else:
            rows += [("nis", "<u4"), ("log_likelihood", "<u4")]
        return np.dtype([*rows[not self.particles :], ("status", "<u4")])

    def trace_of(self, data: bytes) -> npt.NDArray[Any]:
        """Take a trace apart.

        Parameters
        ----------
        data : bytes
            What a replay program wrote.

        Returns
        -------
        ndarray, dtype `trace`
            A row for each reading with echoes.

        Raises
        ------
        ValueError
            If the filter refused something or the trace is not of this record.
        """
        prefix = 4 * (1 + self.told)
        rows = sum(len(step.echoes) > 0 for step in self.world.steps)
        if any(data[:prefix]):
            statuses = np.frombuffer(data[:prefix], "<u4").tolist()
            raise ValueError(f"{self.kind}: statuses of reset and add_master: {statuses}")
        if len(data) != prefix + rows * self.trace.itemsize:
            raise ValueError(f"{self.kind}: a trace of {len(data)} bytes is not of {rows} rows")
        return np.frombuffer(data, self.trace, offset=prefix)


def symmetric(lower: npt.NDArray[Any], n: int) -> npt.NDArray[np.float32]:
    """Make a covariance of its lower triangle."""
    matrix = np.zeros((n, n), np.float32)
    matrix[np.tril_indices(n)] = lower
    return matrix + np.tril(matrix, -1).T


def fields_of(kind: Kind, masters: int = 1) -> int:
    """Count the numbers of a particle with room for so many masters.

    Log weight, pose (but for 1.0 with its covariance), masters: a belief (with one covariance for
    all, its mean), or of an Imm the combined
    one, those of its three models and their probabilities. With joint Gaussians the covariances
    between slave and masters too.
    """
    pose = 3 if "unicycle" in kind else 2
    if kind == "slatf-shared":
        return 1 + pose + 6 * masters
    covariance = 0 if kind.startswith("slatf1") else pose * (pose + 1) // 2
    master = 27 * 4 + 3 if kind.endswith("imm") else 27
    joint = kind.startswith("slatf-joint")
    cross = sum(6 * (pose + 6 * n) for n in range(masters)) if joint else 0
    return 1 + pose + covariance + masters * master + cross


def shared_record() -> Record:
    """Give the paper's 200 echoes to N = 100 particles with one covariance, as they come.

    With the gate and the recovery; the ATmega2560 has room for as many.
    """
    return Record("slatf-shared", PARTICLES, gate=13.8, kept=0.8)


def all_records(*, chip: bool = False) -> dict[str, Record]:
    """Give all records by their names.

    Parameters
    ----------
    chip : bool
        Those that the RAM of the ATmega2560 holds: fewer particles, one master where two do not
        fit. A Slatf with an Imm is not among them: its smallest set of particles does not fit.
    """
    particles, room = (16, 1) if chip else (PARTICLES, MASTERS)
    compass: dict[str, Any] = {
        "motion": CompassMotion(sigma_speed_m_s=0.1, sigma_heading_rad=0.05),
        "sonar": Sonar(sigma_range_m=0.5, sigma_bearing_rad=0.02),
    }
    unicycle: dict[str, Any] = {
        "motion": UnicycleMotion(),
        "sonar": Sonar(sigma_range_m=0.5, sigma_bearing_rad=0.02, bearing="from_heading"),
    }

    def met(kind: Kind, masters: int, *, known: bool = False, **settings: Any) -> Record:
        models = {**(unicycle if "unicycle" in kind else compass), **settings}
        count = 0 if kind.startswith("ekf") else particles
        # Of an outlier a master would be born, and a third one only where there is room for it.
        outlier_m = 0.0 if settings.get("birth_velocity_m_s") else 60.0
        world = encounter(models["motion"], masters, known=known, outlier_m=outlier_m)
        models = {"gate": 16.0, "told": masters, **models}
        if "imm" in kind:
            models |= {"master": Imm(), "planned": False}
        return Record(kind, count, world, room=masters, **models)

    births: dict[str, Any] = {"told": 1, "planned": False, "birth_velocity_m_s": 2.0}
    births["master"] = PiecewiseAcceleration(acceleration_m_s2=0.1)
    paper = AVR_PARTICLES if chip else PARTICLES
    records = {
        "slatf1": Record("slatf1", paper),
        "slatf2": Record("slatf2", paper),
        "slatf1-births": met("slatf1-unicycle", 2, **births),
        "slatf2-births": met("slatf2-unicycle", 2, **births),
        "slatf2-unknown": met("slatf2", 2, carry_covariance=True),
        "slatf-joint": met("slatf-joint", room),
        "slatf-joint-unicycle": met("slatf-joint-unicycle", room, known=True, kept=0.0),
        "ekf-slat": met("ekf-slat", 2),
        "ekf-slat-unicycle": met("ekf-slat-unicycle", 2, known=True),
        "slatf1-imm": met("slatf1-imm", 1),
        "slatf2-unicycle-imm": met("slatf2-unicycle-imm", 1),
        "ekf-slat-imm": met("ekf-slat-imm", room),
        "ekf-slat-unicycle-imm": met("ekf-slat-unicycle-imm", 1),
    }
    too_large = ("slatf1-imm", "slatf2-unicycle-imm") if chip else ()
    return {name: record for name, record in records.items() if name not in too_large}
