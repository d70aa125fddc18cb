"""Robots that see each other: a recording of several, and the tracks that can be cut out of it.

A track is one robot, the master, as another, the slave, sees it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.logs.reader import Rows

#: A track has no longer gap between two sightings, s, and lasts so long.
GAP_S = 6.0
DURATION_S = 15.0
#: Truth is interpolated between samples that are at most so far apart, s.
TRUTH_GAP_S = 0.35


@dataclass(frozen=True)
class Robots:
    """A recording of several robots.

    Attributes
    ----------
    odometry : mapping of int to ndarray, shape (n, 3)
        By robot: time (s), speed (m/s) and yaw rate (rad/s), which hold until the next.
    truth : mapping of int to ndarray, shape (n, 4)
        Time (s), position (m) and heading (rad).
    sightings : ndarray, shape (n, 5)
        Time (s), who saw whom, range (m), and bearing from the heading of who saw (rad).
    """

    odometry: Mapping[int, Rows]
    truth: Mapping[int, Rows]
    sightings: Rows

    def tracks(
        self, gap_s: float = GAP_S, duration_s: float = DURATION_S
    ) -> Iterator[tuple[int, int, Rows]]:
        """Give slave, master, and sightings (time, range, bearing), where the truth is known."""
        for slave in self.truth:
            for master in self.truth:
                seen = (self.sightings[:, 1] == slave) & (self.sightings[:, 2] == master)
                echoes = self.sightings[seen][:, [0, 3, 4]]
                known = self.has_truth(slave, echoes[:, 0]) & self.has_truth(master, echoes[:, 0])
                echoes = echoes[known]
                for run in np.split(echoes, np.flatnonzero(np.diff(echoes[:, 0]) > gap_s) + 1):
                    if len(run) and run[-1, 0] - run[0, 0] >= duration_s:
                        yield slave, master, run

    def has_truth(self, robot: int, time_s: Rows) -> npt.NDArray[np.bool_]:
        """Say at which times the truth of a robot is known."""
        known = self.truth[robot][:, 0]
        after = np.searchsorted(known, time_s)
        inside = (after > 0) & (after < len(known))
        after = np.clip(after, 1, len(known) - 1)
        return inside & (known[after] - known[after - 1] <= TRUTH_GAP_S)

    def pose(self, robot: int, time_s: Floats) -> Rows:
        """Give the true poses of a robot, along lines between samples."""
        truth = self.truth[robot]
        columns = (truth[:, 1], truth[:, 2], np.unwrap(truth[:, 3]))
        return np.column_stack([np.interp(time_s, truth[:, 0], column) for column in columns])


def within(rows: Rows, begin_s: float, end_s: float, *, beyond: int) -> Rows:
    """Give the rows of a stretch of time with one before it, and so many behind it."""
    first = max(int(np.searchsorted(rows[:, 0], begin_s, side="right")) - 1, 0)
    last = int(np.searchsorted(rows[:, 0], end_s, side="right")) + beyond
    return rows[first:last]
