"""Motion between the lines of an odometry file: constant velocity and turn rate in the body frame.

Both kinds of odometry become the same thing. A velocity holds from its line to the next, but no
longer than a gap may be; then the craft is taken to stand, for nothing is known. An
increment is the chord of the arc driven since the line before. Either way a piece of it, of any
length in time, is again an arc: with velocity u (complex, forward + i left) and turn rate w, in a
time dt the craft moves by

    u dt phi(w dt),   phi(a) = (exp(i a) - 1) / (i a),

in the frame of the pose it had before, and turns by w dt. Where a compass says how the craft is
headed, the turn is the difference of headings: the heading of the run, less the compass's, is then
what is not known of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.logs import LogError
from auvest.logs.reader import CsvTable, Rows
from auvest.replay.config import OdometrySettings

Complex = npt.NDArray[np.complex128]


def phi(angle: Rows) -> Complex:
    """Chord of the unit arc that turns by ``angle``."""
    return np.sinc(angle / (2 * np.pi)) * np.exp(0.5j * angle)


def wrapped(angle: Rows) -> Rows:
    """Give angles in (-pi, pi]."""
    turned: Rows = np.pi - np.remainder(np.pi - angle, 2 * np.pi)
    return turned


def dead_reckon(pose: Rows, chord: Complex, turn: Rows) -> Rows:
    """Poses (K + 1, 3) along these steps, the first being where they begin, ``pose`` (1, 3)."""
    heading = np.cumsum(np.concatenate([pose[0, 2:], turn]))
    steps = chord * np.exp(1j * heading[:-1])
    place = np.cumsum(np.concatenate([[complex(pose[0, 0], pose[0, 1])], steps]))
    return np.column_stack([place.real, place.imag, heading])


@dataclass
class Segments:
    """Times (K + 1,) between which the velocities (K,) and turn rates (K,) hold."""

    edges: Rows
    velocity: Complex
    turn_rate: Rows

    def steps(self, start: Rows, dt: Rows) -> tuple[Complex, Rows]:
        """Chord (m) and turn (rad) of steps that lie within one segment each."""
        if len(self.velocity) == 0:  # nothing is known yet: only steps of no time are asked for
            return np.zeros(len(start), complex), np.zeros(len(start))
        k = np.clip(np.searchsorted(self.edges, start, side="right") - 1, 0, len(self.velocity) - 1)
        turn = self.turn_rate[k] * dt
        return self.velocity[k] * dt * phi(turn), turn


class Compass:
    """Headings of a compass of its own rate, joined with the lines of odometry.

    Parameters
    ----------
    gap_s : float
        A velocity holds no longer, s.
    increments : bool
        Whether the odometry has increments; else velocities.
    """

    def __init__(self, gap_s: float, *, increments: bool) -> None:
        self._gap_s = gap_s
        self._increments = increments
        self._time: Rows = np.empty(0)
        self._moved: Complex = np.empty(0, complex)
        self._headings: Rows = np.empty((0, 2))
        self._done_s = -np.inf
        self._held = (-np.inf, 0j)

    def joined(
        self, time_s: Rows, moved: Complex, headings: Rows, *, last: bool
    ) -> tuple[Rows, Complex, Rows]:
        """Give times, increments or velocities, and the headings then, as far as all are known.

        Velocities have a line for each of both files: the craft turns between their own.
        """
        self._time = np.concatenate([self._time, time_s])
        self._moved = np.concatenate([self._moved, moved])
        turned = headings.copy()
        if len(turned):
            before = self._headings[-1, 1] if len(self._headings) else turned[0, 1]
            turned[:, 1] = before + np.cumsum(wrapped(np.diff(turned[:, 1], prepend=before)))
        self._headings = np.concatenate([self._headings, turned])
        known = self._headings[-1, 0] if len(self._headings) else -np.inf
        count = len(self._time) if last else int(np.searchsorted(self._time, known, side="right"))
        if len(self._headings) == 0 or (count == 0 and self._increments):
            return np.empty(0), np.empty(0, complex), np.empty(0)
        time, step = self._time[:count], self._moved[:count]
        self._time, self._moved = self._time[count:], self._moved[count:]
        if not self._increments:
            time, step = self._filled(time, step)
        heading = np.interp(time, *self._headings.T)
        if len(time):
            self._done_s = float(time[-1])
        keep = max(int(np.searchsorted(self._headings[:, 0], self._done_s, side="right")) - 1, 0)
        self._headings = self._headings[keep:]
        return time, step, heading

    def _filled(self, time_s: Rows, velocity: Complex) -> tuple[Rows, Complex]:
        """Put the lines of the compass between those of the velocities, which hold on."""
        lines = self._headings[:, 0]
        extra = np.setdiff1d(lines[lines > self._done_s], time_s)
        held_s = np.concatenate([[self._held[0]], time_s])
        held = np.concatenate([[self._held[1]], velocity])
        k = np.searchsorted(held_s, extra, side="right") - 1
        over = extra - held_s[k] > self._gap_s
        filled = np.where(over, 0.0, held[k])
        self._held = (float(held_s[-1]), complex(held[-1]))
        time = np.concatenate([time_s, extra])
        order = np.argsort(time, kind="stable")
        return time[order], np.concatenate([velocity, filled])[order]


def lengths_of(table: CsvTable, edges: Rows) -> Rows:
    """Give how long increments last, s, of which each ends where the next begins.

    Raises
    ------
    LogError
        If two end at one time.
    """
    lengths = np.diff(edges)
    if (lengths <= 0).any():
        end = float(edges[1:][int(np.argmax(lengths <= 0))])
        raise LogError(
            table.path,
            f"two increments end at {end:.10g} s",
            line=table.line_of(end, 2),
            column="time_s",
            cause="times_equal",
        )
    return lengths


class Motion:
    """The odometry of a log as segments, fed chunk by chunk.

    Parameters
    ----------
    table : CsvTable
        The file: increments that end at their time, or velocities that hold from then on.
    start_s : float
        When the run starts; before the first velocity the craft stands still.
    settings : OdometrySettings
        Calibration.
    compass : bool
        Whether headings come beside it, from a compass of its own.
    """

    def __init__(
        self, table: CsvTable, start_s: float, settings: OdometrySettings, *, compass: bool = False
    ) -> None:
        self.increments = "forward_m" in table.names
        self.steered = compass or not {"turn_rad", "yaw_rate_rad_s"} & set(table.names)
        self._table = table
        self._settings = settings
        # Until the first line: nothing is known of increments, and velocity is zero.
        self._segments = Segments(np.array([start_s]), np.zeros(0, complex), np.zeros(0))
        self._held = (0j, 0.0)
        self._begun = False
        self._compass = Compass(settings.gap_s, increments=self.increments) if compass else None
        self._headed: tuple[float, float] | None = None  # time and heading of the last line
        self._line_s = start_s

    @property
    def edges(self) -> Rows:
        """Times of the lines that are still needed."""
        return self._segments.edges

    @property
    def known_until(self) -> float:
        """Where the last line stands, s."""
        return float(self._segments.edges[-1])

    def add(self, rows: Rows, headings: Rows | None = None, *, last: bool = False) -> None:
        """Take new lines, in the order of time.

        Parameters
        ----------
        rows : ndarray, shape (n, columns)
            Lines of the file.
        headings : ndarray, shape (k, 2), optional
            Lines of the compass.
        last : bool
            Whether these are the last of both.
        """
        time, table = rows[:, 0], self._table
        if self.increments:
            moved = rows[:, 1] + 1j * table.column(rows, "left_m", 0.0)
        else:
            moved = rows[:, 1] + 1j * table.column(rows, "left_m_s", 0.0)
        if self._compass is not None:
            assert headings is not None
            time, moved, heading = self._compass.joined(time, moved, headings, last=last)
            turn = self._turns(time, heading)
        elif self.steered:
            turn = self._turns(time, table.column(rows, "heading_rad"))
        else:
            turn = table.column(rows, "turn_rad" if self.increments else "yaw_rate_rad_s")
        if self.increments:
            new = self._driven(time, moved, turn)
        elif self.steered:
            new = self._steered(time, moved, turn)
        else:
            new = self._turned(time, moved, turn)
        old = self._segments
        self._segments = Segments(
            np.concatenate([old.edges, new.edges]),
            np.concatenate([old.velocity, new.velocity]),
            np.concatenate([old.turn_rate, new.turn_rate]),
        )

    def _driven(self, time_s: Rows, moved: Complex, turned: Rows) -> Segments:
        """Give the segments of increments that end at these times."""
        s = self._settings
        if not self._begun:  # increments that end before the start have been driven
            kept = time_s > self.known_until
            time_s, moved, turned = time_s[kept], moved[kept], turned[kept]
            self._begun = len(time_s) > 0
        edges = np.concatenate([[self.known_until], time_s])
        dt = lengths_of(self._table, edges)
        turn = turned if self.steered else s.turn_factor * turned + s.turn_offset_rad_s * dt
        chord = s.speed_factor * moved
        return Segments(edges[1:], chord / dt / phi(turn), turn / dt)

    def _turned(self, time_s: Rows, speed: Complex, yaw_rate: Rows) -> Segments:
        """Give the segments up to lines of velocities and rates of turning."""
        s = self._settings
        velocity = s.speed_factor * speed
        turn_rate = s.turn_factor * yaw_rate + s.turn_offset_rad_s
        new = self._held_no_longer(
            np.maximum(time_s, self.known_until),
            np.concatenate([[self._held[0]], velocity[:-1]])[: len(time_s)],
            np.concatenate([[self._held[1]], turn_rate[:-1]])[: len(time_s)],
        )
        if len(time_s):
            self._held = (complex(velocity[-1]), float(turn_rate[-1]))
        return new

    def _steered(self, time_s: Rows, speed: Complex, turned: Rows) -> Segments:
        """Give the segments up to lines of velocities and headings."""
        velocity = self._settings.speed_factor * speed
        before = np.concatenate([[self._line_s], time_s])[: len(time_s)]
        step = time_s - before
        rate = np.divide(turned, step, out=np.zeros_like(turned), where=step > 0)
        new = self._held_no_longer(
            np.maximum(time_s, self.known_until),
            np.concatenate([[self._held[0]], velocity[:-1]])[: len(time_s)],
            rate,
        )
        if len(time_s):
            self._held = (complex(velocity[-1]), 0.0)
            self._line_s = float(time_s[-1])
        return new

    def _turns(self, time_s: Rows, heading: Rows) -> Rows:
        """Give the turn up to each line since the one before; lines of one time have one heading.

        The first line after others of its time stays: what is turned goes with the time.
        """
        if len(time_s) == 0:
            return time_s
        first = self._headed or (float(time_s[0]), float(heading[0]))
        heading = heading.copy()
        for k in np.flatnonzero(np.diff(time_s, prepend=first[0]) <= 0):
            heading[k] = heading[k - 1] if k > 0 else first[1]
        self._headed = (float(time_s[-1]), float(heading[-1]))
        return wrapped(np.diff(heading, prepend=first[1]))

    def until(self, limit: float) -> Segments:
        """All segments that are still needed, the last of a velocity log reaching to the limit."""
        s = self._segments
        if self.increments or limit <= self.known_until:
            return s
        end = self._held_no_longer(
            np.array([limit]), np.array([self._held[0]]), np.array([self._held[1]])
        )
        return Segments(
            np.concatenate([s.edges, end.edges]),
            np.concatenate([s.velocity, end.velocity]),
            np.concatenate([s.turn_rate, end.turn_rate]),
        )

    def _held_no_longer(self, edges: Rows, velocity: Complex, turn_rate: Rows) -> Segments:
        """Segments up to these edges, the first from where the last ends; long ones are parted."""
        before = np.concatenate([[self.known_until], edges])[: len(edges)]
        moving = (velocity != 0) | (turn_rate != 0)
        long = np.flatnonzero(moving & (edges - before > self._settings.gap_s))
        if len(long) == 0:
            return Segments(edges, velocity, turn_rate)
        return Segments(
            np.insert(edges, long, before[long] + self._settings.gap_s),
            np.insert(velocity, long + 1, 0.0),
            # A compass turns whether it is known how fast the craft moves or not.
            np.insert(turn_rate, long + 1, turn_rate[long] if self.steered else 0.0),
        )

    def forget(self, before: float) -> None:
        """Drop segments that end at or before a time."""
        s = self._segments
        k = int(np.searchsorted(s.edges, before, side="right")) - 1
        k = min(max(k, 0), len(s.velocity))
        self._segments = Segments(s.edges[k:], s.velocity[k:], s.turn_rate[k:])


def carry(
    segments: Segments, poses: Floats, at: Rows, time_s: Rows, *, speed_state: int = 0
) -> Rows:
    """Positions (K, 2) at these times by dead reckoning from the last pose before each.

    ``poses`` (N, 3 or more) belong to the times ``at`` (N,), and no segment ends between one of
    these and the next time that is asked for. At ``speed_state`` they have what the speed is off
    by; 0: nowhere.
    """
    k = np.searchsorted(at, time_s, side="right") - 1
    chord, _ = segments.steps(at[k], time_s - at[k])
    if speed_state > 0:
        chord = chord * (1 + poses[k, speed_state])
    step = chord * np.exp(1j * poses[k, 2])
    return poses[k, :2] + np.column_stack([step.real, step.imag])
