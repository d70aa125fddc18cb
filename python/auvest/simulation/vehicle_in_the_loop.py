"""A vehicle in the loop: hull and sensors here, the pilot on a chip at the other end of a line.

The chip runs the sketch ``mission``; :class:`Vehicle` answers it. The world is that of
:func:`auvest.simulation.mission.simulate` with the same seed and run, so the two can be set side by
side. :func:`fly_on_desk` flies it with the chip's own pilot compiled here, with or without what the
line adds: numbers rounded to the digits of the text, a command that comes later than its sample.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import _core, mission_line
from auvest._core import PilotMode
from auvest.board import Board, Finished, SerialLine
from auvest.intervals import FixedInterval
from auvest.simulation import mission
from auvest.simulation.mission import Mission
from auvest.telemetry import LineError, Reader, Row

Floats = npt.NDArray[np.float64]
#: Rudder and stern planes, rad; propeller, rev/s.
Steering = tuple[float, ...]

#: Given the number of a sample and its lines: what is sent instead, with delays, s.
Disturb = Callable[[int, list[str]], list[tuple[float, str]]]

PERIOD_S = 0.1
#: From a sample to the command, s, on a line of 115,200 baud: readings, computing, command.
DELAY_S = 0.02
#: What is answered later than this misses its sample: the sketch waits for 40 ms, and a line takes
#: some of them.
TIMEOUT_S = 0.03
_FROM_REST = (0.0, 0.0, 15.0)


def chip_mission(**options: Any) -> Mission:
    """Give the mission that the sketch flies as it is: its filter, guidance and track.

    Parameters
    ----------
    **options
        What is left to choose of :class:`~auvest.simulation.mission.Mission`: the current, the
        sensors' errors, runs and seed.

    Raises
    ------
    ValueError
        If an option is out of range, or is the sketch's own to choose.
    """
    own = {"track", "estimate", "guidance", "interval", "kernel", "recovery", "dtype", "period_s"}
    own |= {
        "usbl_noise_m",
        "usbl_noise_rad",
        "degrees_of_freedom",
        "path",
        "arc_m",
        "switch_m",
        "end_m",
        "lookahead_m",
        "speed_m_s",
        "depth_m",
    }
    taken = own & options.keys()
    if taken:
        raise ValueError(f"{min(taken)} is chosen in the sketch")
    return mission.source("robust_model_aided", "lawnmower", dtype="float32", **options)


def new_pilot(
    plan: Mission, corners: Floats = mission.LAWNMOWER, **changes: float
) -> _core.Pilot_float32:
    """Make the pilot of the sketch, with its bits.

    Parameters
    ----------
    plan : Mission
        Of :func:`chip_mission`.
    corners : ndarray, shape (n, 2)
        What the sketch has in plan.h.
    **changes
        What has been changed in its config.h: ``hold_s``, ``compass_s``, ``lost_m``.
    """
    if not isinstance(plan.interval, FixedInterval):
        raise ValueError("the pilot here has a fixed interval, as the sketch has")
    settings = {
        "period_s": plan.period_s,
        "speed_m_s": plan.speed_m_s,
        "depth_m": plan.depth_m,
        "end_m": plan.end_m,
        "switch_m": plan.switch_m,
        "lookahead_m": plan.lookahead_m,
        "station_x_m": 0.0,
        "station_y_m": 0.0,
        "sigma_range_m": plan.usbl_noise_m,
        "sigma_bearing_rad": plan.usbl_noise_rad,
        **changes,
    }
    return _core.Pilot_float32(corners.astype(np.float32), settings, plan.interval.interval_s)


@dataclass
class Flight:
    """What became of a run: a row per sample that was steered under way.

    Attributes
    ----------
    sample : list of int
        Its number; sample 1 is at time 0.
    pose : list of ndarray, shape (6,)
        North, east, down, m; roll, pitch, yaw, rad.
    command : list of (float, float, float)
        Rudder, stern planes, rad; propeller, rev/s.
    estimate_m : list of (float, float)
        Where the pilot takes itself to be.
    leg : list of int
        That it is on.
    finished : bool
        The plan was flown to its end.
    """

    sample: list[int] = field(default_factory=list)
    pose: list[Floats] = field(default_factory=list)
    command: list[Steering] = field(default_factory=list)
    estimate_m: list[tuple[float, float]] = field(default_factory=list)
    leg: list[int] = field(default_factory=list)
    finished: bool = False

    def add(self, sample: int, pose: Floats, command: Steering, pilot: _core.Pilot_float32) -> None:
        """Add a sample as it is after its command."""
        x, y = map(float, pilot.x[:2])
        self.sample.append(sample)
        self.pose.append(pose)
        self.command.append(command)
        self.estimate_m.append((x, y))
        self.leg.append(pilot.leg)

    def beside(self) -> tuple[Floats, Floats]:
        """Along-track and cross-track of the vehicle on its leg, m."""
        place = np.array(self.pose)[:, :2]
        begin = mission.LAWNMOWER[self.leg]
        leg = mission.LAWNMOWER[np.array(self.leg) + 1] - begin
        ahead = leg / np.linalg.norm(leg, axis=1, keepdims=True)
        offset = place - begin
        cross = offset[:, 1] * ahead[:, 0] - offset[:, 0] * ahead[:, 1]
        return np.asarray((offset * ahead).sum(axis=1)), np.asarray(cross)

    @property
    def all_rms_m(self) -> float:
        """Cross-track error, root mean square, corners too."""
        return rms(self.beside()[1])

    def settled_rms_m(self, *, settled_m: float = 50.0) -> float:
        """Cross-track error from so far into a leg, root mean square."""
        along, cross = self.beside()
        return rms(cross[along >= settled_m])

    @property
    def position_rms_m(self) -> float:
        """Error of the estimate, root mean square."""
        error = np.array(self.estimate_m) - np.array(self.pose)[:, :2]
        return rms(np.hypot(*error.T))


def rms(values: Floats) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.square(values).mean())) if len(values) else float("nan")


def age_of(fix: mission_line.Fix, sample: int) -> np.float32:
    """Age of a fix at a sample, as the sketch computes it."""
    age = np.float32(sample - fix.sample) * np.float32(PERIOD_S) - fix.delay_s
    return age if age > 0 else np.float32(0)


@dataclass
class ChipTwin:
    """The sketch's pilot on the desk, fed lines as the sketch is."""

    pilot: _core.Pilot_float32
    listener: mission_line.Listener = field(default_factory=mission_line.Listener)
    sample: int = 0

    def start(self, line: str) -> None:
        """Take the line that says where the vehicle begins."""
        self.listener.take(line)
        assert self.listener.start is not None
        x, y, heading = map(float, self.listener.start)
        self.pilot.start(x, y, heading)

    def step(self, lines: Sequence[str], late: Sequence[str] = ()) -> Steering:
        """Take the lines of the next sample, and those that come behind it; give the command."""
        self.sample += 1
        self.listener.begin(self.sample)
        if self.pilot.wants_fix():
            self.pilot.asked()
        for line in lines:
            self.listener.take(line)
        self.pilot.predict(self.listener.values, self.listener.heard, PERIOD_S)
        for fix in self.listener.fixes:
            range_m, bearing_rad = map(float, fix.z)
            self.pilot.update(range_m, bearing_rad, float(age_of(fix, self.sample)))
        self.listener.fixes.clear()
        _, *command = self.pilot.steer()
        self.listener.close()
        for line in late:
            self.listener.take(line)
        return tuple(command)


class VehicleError(RuntimeError):
    """The chip is not at the sample that the vehicle is at."""


class Vehicle:
    """Hull and sensors of a run, which answer the chip's lines.

    The world moves one period per sample; a command acts from the moment that it comes, as long
    after the sample's request as the line and the chip have taken.

    Parameters
    ----------
    plan : Mission
        Of :func:`chip_mission`.
    run : int
        Its number; the seed is the mission's.
    disturb : Disturb, optional
        Given the number of a sample and its lines, what is sent instead: pairs of delay (s) and
        text.
    pilot : Pilot_float32, optional
        The sketch's, if that is not as it comes: see :func:`new_pilot`.

    Attributes
    ----------
    run : int
        Its number.
    twin : ChipTwin
        The chip's pilot on the desk, fed the same lines: where the chip takes itself to be.
    flight : Flight
        The samples under way.
    differing : int
        Commands of the chip that are not the twin's, to the bit.
    delays_s : list of float
        From each request to its command.
    start_line : str
        What the chip is told before its first sample.
    """

    def __init__(
        self,
        plan: Mission,
        run: int = 0,
        disturb: Disturb | None = None,
        pilot: _core.Pilot_float32 | None = None,
    ) -> None:
        self.run = run
        self.twin = ChipTwin(pilot or new_pilot(plan))
        self.flight = Flight()
        self.differing = 0
        self.delays_s: list[float] = []
        self._world = new_world(plan, run)
        x, y = self._world.guess_m
        self.start_line = mission_line.start(x, y, self._world.heading_rad)
        self._disturb = disturb
        self._asked: list[int] = []
        self._sample = 0
        self._requested_s = 0.0
        self._answers: list[tuple[float, str]] = []
        self._held: Steering = _FROM_REST
        self._command: Steering | None = None

    def hear(self, line: str, time_s: float) -> list[tuple[float, str]]:
        """Take a line that ended at this time; what is answered, each with its delay, s.

        Raises
        ------
        VehicleError
            If the chip begins anew, or has begun without this vehicle.
        """
        if mission_line.is_ready(line):
            if self.twin.sample:
                raise VehicleError("the board has begun anew: it was reset")
            if self.twin.listener.start is None:
                self.twin.start(self.start_line)
            return [(0.0, self.start_line)]
        request = mission_line.request(line)
        if request is not None:
            return self._answer(request, time_s)
        command = mission_line.command(line)
        if command is not None and command.sample == self._sample:
            self._command = command.values
            self.delays_s.append(time_s - self._requested_s)
        return []

    def _answer(self, request: mission_line.Request, time_s: float) -> list[tuple[float, str]]:
        self.finish()
        if request.sample != self.twin.sample + 1:
            raise VehicleError(
                f"the board asks for sample {request.sample}, but {self.twin.sample + 1} is due: "
                "reset it, and look at the line"
            )
        self._sample, self._requested_s = request.sample, time_s
        lines = sense(self._world, request.sample, request.ping, self._asked)
        self._answers = [(0.0, line) for line in lines]
        if self._disturb is not None:
            self._answers = self._disturb(request.sample, lines)
        return self._answers

    def finish(self) -> None:
        """End the sample that is under way: the world moves on by a period."""
        if not self._sample:
            return
        twin = self.twin
        in_time = [text for delay_s, text in self._answers if delay_s < TIMEOUT_S]
        wanted = twin.step(in_time, [text for d, text in self._answers if d >= TIMEOUT_S])
        self.flight.finished = twin.pilot.mode == PilotMode.finished
        delay_s, command = PERIOD_S, self._held  # a command that is lost: the one before goes on
        if self._command is not None:
            self.differing += _bits(self._command) != _bits(wanted)
            delay_s = min(max(self.delays_s[-1], 0.0), PERIOD_S)
            command = self._command
        if twin.pilot.mode == PilotMode.under_way:
            self.flight.add(self._sample, self._world.pose, command, twin.pilot)
        end_s = self._sample * PERIOD_S
        for held, span_s, until_s in (
            (self._held, delay_s, end_s - PERIOD_S + delay_s),
            (command, PERIOD_S - delay_s, end_s),
        ):
            if span_s > 0:
                self._world.advance(held, span_s, until_s)
        self._held, self._command, self._sample = command, None, 0


def _bits(command: Steering) -> bytes:
    return np.array(command, np.float32).tobytes()


def new_world(plan: Mission, run: int) -> _core.MissionWorld:
    """Set up hull, current and sensors of a run, as ``simulate`` does."""
    return _core.MissionWorld(mission.core_scenario(plan), plan.seed, run)


def sense(world: _core.MissionWorld, sample: int, ping: bool, asked: list[int]) -> list[str]:
    """Write what the sensors have at a sample: first fixes that have arrived, then the readings.

    Sample 1 is at time 0. ``asked`` has the samples that asked for a fix, and is kept up.
    """
    if ping:
        world.ask()
        asked.append(sample)
    lines = []
    for range_m, bearing_rad, valid_s in world.take_fixes():
        by = max(k for k in asked if (k - 1) * PERIOD_S <= valid_s + 1e-9)
        delay_s = max(0.0, valid_s - (by - 1) * PERIOD_S)
        lines.append(mission_line.fix(by, range_m, bearing_rad, delay_s))
    return lines + mission_line.readings(sample, world.sense())


def fly_on_desk(
    plan: Mission, run: int = 0, *, rounded: bool, delay_s: float, samples: int | None = None
) -> Flight:
    """Fly a run with the chip's pilot here.

    Parameters
    ----------
    plan : Mission
        Of :func:`chip_mission`.
    run : int
        Its number.
    rounded : bool
        Whether readings are rounded to the digits of the line's text.
    delay_s : float
        From a sample to the moment at which its command acts.
    samples : int, optional
        How many to fly at most; default: to the end of the plan.

    Returns
    -------
    Flight
        With neither, that of ``simulate``, to the bit.
    """
    world, pilot, flight = new_world(plan, run), new_pilot(plan), Flight()
    twin = ChipTwin(pilot)
    asked: list[int] = []
    x, y = world.guess_m
    if rounded:
        twin.start(mission_line.start(x, y, world.heading_rad))
    else:
        pilot.start(x, y, world.heading_rad)
    held: Steering = _FROM_REST
    most = int(plan.most_s / PERIOD_S)
    for sample in range(1, (most if samples is None else min(samples, most)) + 1):
        if rounded:
            command = twin.step(sense(world, sample, pilot.wants_fix(), asked))
        else:
            ping = pilot.wants_fix()
            pilot.predict(world.sense().astype(np.float32), mission_line.ALL_HEARD, PERIOD_S)
            if ping:
                pilot.asked()
                world.ask()
            for range_m, bearing_rad, valid_s in world.take_fixes():
                pilot.update(range_m, bearing_rad, world.time_s - valid_s)
            command = tuple(pilot.steer()[1:])
        if pilot.mode == PilotMode.finished:
            flight.finished = True
            break
        flight.add(sample, world.pose, command, pilot)
        end = sample * PERIOD_S
        if delay_s > 0:
            world.advance(held, delay_s, end - PERIOD_S + delay_s)
        world.advance(command, PERIOD_S - delay_s, end)
        held = command
    return flight


@dataclass
class ChipFlight:
    """A run of the chip: what it reported, what the vehicle did, what the simulator counted.

    Attributes
    ----------
    vehicle : Vehicle
        That it steered.
    rows : list of dict
        Its samples.
    comments : list of str
        What else it said.
    damaged : int
        Lines from the chip that could not be read.
    awake_share : float
        NaN for a real board.
    stack_bytes : int
        Deepest stack; 0 for a real board.
    serial_overruns : int
        Bytes that the chip lost.
    """

    vehicle: Vehicle
    rows: list[Row] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    damaged: int = 0
    last_damage: str = ""
    awake_share: float = float("nan")
    stack_bytes: int = 0
    serial_overruns: int = 0
    reader: Reader = field(default_factory=Reader)

    def hear(self, line: str, time_s: float) -> list[tuple[float, str]]:
        """Take a line; what the vehicle answers."""
        answers = self.vehicle.hear(line, time_s)
        try:
            row = self.reader.read(line)
        except LineError as error:
            self.damaged += 1
            self.last_damage = str(error)
            return answers
        if isinstance(row, dict):
            self.rows.append(row)
        elif line.startswith("#"):
            self.comments.append(line)
        return answers

    def over(self, samples: int | None) -> bool:
        """Whether so many samples are over or, without a number, the plan, and reported so."""
        if samples is not None:
            return self.vehicle.twin.sample >= samples
        return bool(self.rows) and self.rows[-1]["mode"] == int(PilotMode.finished)


def fly_simulated(
    elf: str | os.PathLike[str],
    chip: ChipFlight,
    *,
    samples: int | None = None,
    runner: str | os.PathLike[str] | None = None,
    progress: Callable[[], None] | None = None,
) -> None:
    """Fly a run with the sketch on the simulated board, to the end of its plan.

    Parameters
    ----------
    elf : path
        The compiled sketch.
    chip : ChipFlight
        Takes what it does.
    samples : int, optional
        Where to stop instead.
    runner : path, optional
        The program ``auvest-board``.
    progress : callable, optional
        Called now and then.

    Raises
    ------
    BoardError
        If the sketch does what no chip should do.
    FileNotFoundError
        If the simulator is not there.
    """
    with Board(elf, runner=runner, limit_s=2000.0) as board:
        for event in board:
            if isinstance(event, SerialLine):
                known = len(chip.rows)
                for delay_s, text in chip.hear(event.text, event.time_s):
                    board.send(text, delay_s)
                if progress is not None and len(chip.rows) > known:
                    progress()
            if isinstance(event, Finished) or chip.over(samples):
                break
    chip.vehicle.finish()
    chip.awake_share, chip.stack_bytes = board.report.awake_share, board.report.stack_bytes
    chip.serial_overruns = board.report.serial_overruns
