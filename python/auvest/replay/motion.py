"""Motion between the lines of an odometry file: constant velocity and turn rate in the body frame.

Both kinds of odometry become the same thing. A velocity holds from its line to the next, but no
longer than a gap may be; then the craft is taken to stand, for nothing is known. An
increment is the chord of the arc driven since the line before. Either way a piece of it, of any
length in time, is again an arc: with velocity u (complex, forward + i left) and turn rate w, in a
time dt the craft moves by

    u dt phi(w dt),   phi(a) = (exp(i a) - 1) / (i a),

in the frame of the pose it had before, and turns by w dt.
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
    """

    def __init__(self, table: CsvTable, start_s: float, settings: OdometrySettings) -> None:
        self.increments = "turn_rad" in table.names
        self._table = table
        self._settings = settings
        # Until the first line: nothing is known of increments, and velocity is zero.
        self._segments = Segments(np.array([start_s]), np.zeros(0, complex), np.zeros(0))
        self._held = (0j, 0.0)
        self._begun = False

    @property
    def edges(self) -> Rows:
        """Times of the lines that are still needed."""
        return self._segments.edges

    @property
    def known_until(self) -> float:
        """Where the last line stands, s."""
        return float(self._segments.edges[-1])

    def add(self, rows: Rows) -> None:
        """Take new lines, in the order of time."""
        s = self._settings
        if self.increments:
            if not self._begun:  # increments that end before the start have been driven
                rows = rows[rows[:, 0] > self.known_until]
                self._begun = len(rows) > 0
            edges = np.concatenate([[self.known_until], rows[:, 0]])
            dt = np.diff(edges)
            if (dt <= 0).any():
                time = float(rows[int(np.argmax(dt <= 0)), 0])
                raise LogError(
                    self._table.path,
                    f"two increments end at {time:.10g} s",
                    line=self._table.line_of(time, 2),
                    column="time_s",
                    cause="times_equal",
                )
            turn = s.turn_factor * rows[:, 3] + s.turn_offset_rad_s * dt
            chord = s.speed_factor * (rows[:, 1] + 1j * rows[:, 2])
            new = Segments(edges[1:], chord / dt / phi(turn), turn / dt)
        else:
            velocity = s.speed_factor * rows[:, 1] + 0j
            turn_rate = s.turn_factor * rows[:, 2] + s.turn_offset_rad_s
            new = self._held_no_longer(
                np.maximum(rows[:, 0], self.known_until),
                np.concatenate([[self._held[0]], velocity[:-1]])[: len(rows)],
                np.concatenate([[self._held[1]], turn_rate[:-1]])[: len(rows)],
            )
            if len(rows):
                self._held = (complex(velocity[-1]), float(turn_rate[-1]))
        old = self._segments
        self._segments = Segments(
            np.concatenate([old.edges, new.edges]),
            np.concatenate([old.velocity, new.velocity]),
            np.concatenate([old.turn_rate, new.turn_rate]),
        )

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
            np.insert(turn_rate, long + 1, 0.0),
        )

    def forget(self, before: float) -> None:
        """Drop segments that end at or before a time."""
        s = self._segments
        k = int(np.searchsorted(s.edges, before, side="right")) - 1
        k = min(max(k, 0), len(s.velocity))
        self._segments = Segments(s.edges[k:], s.velocity[k:], s.turn_rate[k:])


def carry(segments: Segments, poses: Floats, at: Rows, time_s: Rows) -> Rows:
    """Positions (K, 2) at these times by dead reckoning from the last pose before each.

    ``poses`` (N, 3) belong to the times ``at`` (N,), and no segment ends between one of these and
    the next time that is asked for.
    """
    k = np.searchsorted(at, time_s, side="right") - 1
    chord, _ = segments.steps(at[k], time_s - at[k])
    step = chord * np.exp(1j * poses[k, 2])
    return poses[k, :2] + np.column_stack([step.real, step.imag])
