"""Where the sources of ranges are: beacons that stand, leaders whose positions were recorded."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from auvest.logs.reader import Rows


class Sources:
    """Positions of all sources, fed with the leaders' positions chunk by chunk.

    Parameters
    ----------
    beacons : mapping of int to (float, float)
        Positions (m) of those that stand.
    gap_s : float
        Between two positions of a leader that are further apart in time than this, none is known.
    """

    def __init__(self, beacons: Mapping[int, tuple[float, float]], gap_s: float) -> None:
        self.gap_s = gap_s
        self._beacons = dict(beacons)
        self._leaders: dict[int, Rows] = {}

    def add(self, rows: Rows) -> None:
        """Take new lines of leaders.csv, in the order of time."""
        if rows.shape[1] == 4:
            rows = np.column_stack([rows, np.zeros(len(rows))])
        for source in np.unique(rows[:, 1]).astype(int).tolist():
            new = np.delete(rows[rows[:, 1] == source], 1, axis=1)
            old = self._leaders.get(source)
            self._leaders[source] = new if old is None else np.concatenate([old, new])

    def locate(self, time_s: Rows, source: Rows) -> Rows:
        """Give x, y and their standard deviation (m) at these times; NaN where not known.

        Between two positions of a leader it goes along a straight line.
        """
        places = np.full((len(time_s), 3), np.nan)
        for name in np.unique(source).astype(int).tolist():
            mine = source == name
            if name in self._beacons:
                places[mine] = (*self._beacons[name], 0.0)
            elif name in self._leaders:
                places[mine] = self._along(self._leaders[name], time_s[mine])
        return places

    def forget(self, before: float) -> None:
        """Drop what no time from ``before`` on can ask for."""
        for source, track in self._leaders.items():
            k = int(np.searchsorted(track[:, 0], before, side="right")) - 1
            self._leaders[source] = track[max(k, 0) :]

    def _along(self, track: Rows, time_s: Rows) -> Rows:
        at = track[:, 0]
        after = np.clip(np.searchsorted(at, time_s, side="left"), 0, len(at) - 1)
        before = np.clip(np.searchsorted(at, time_s, side="right") - 1, 0, len(at) - 1)
        gap = at[after] - at[before]
        known: npt.NDArray[np.bool_] = (at[before] <= time_s) & (time_s <= at[after])
        known &= gap <= self.gap_s
        share = np.divide(time_s - at[before], gap, out=np.zeros_like(gap), where=gap > 0)
        place: Rows = track[before, 1:] + share[:, None] * (track[after, 1:] - track[before, 1:])
        place[~known] = np.nan
        return place
