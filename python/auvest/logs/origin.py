"""A local origin for logs in the coordinates of a map, such as UTM.

Megametres leave float32 steps of half a metre, and float64 a loss of digits that nobody needs.
"""

from __future__ import annotations

from auvest.logs.changed import Change, ChangedLog, columns_changed
from auvest.logs.reader import LogFolder

#: Coordinates beyond this, m, are those of a map.
FAR_M = 20_000.0
#: The origin lies on a grid of this, m, so that it is easily subtracted by hand.
GRID_M = 1000.0


def local_origin(log: LogFolder) -> tuple[float, float] | None:
    """Give the origin (m) that a replay subtracts, or None if the log's own will do."""
    x, y = _somewhere(log)
    if max(abs(x), abs(y)) <= FAR_M:
        return None
    return GRID_M * round(x / GRID_M), GRID_M * round(y / GRID_M)


def shifted(log: LogFolder, origin: tuple[float, float] | None) -> LogFolder:
    """Give the log in coordinates that count from this origin; None: the log itself."""
    if origin is None:
        return log

    def shift(first: int) -> Change:
        return columns_changed(
            {first: lambda rows: rows[:, first] - origin[0],
             first + 1: lambda rows: rows[:, first + 1] - origin[1]}
        )  # fmt: skip

    places = {"beacons.csv": 1, "leaders.csv": 2, "start.csv": 1, "truth.csv": 1,
              "positions.csv": 1, "masters.csv": 2, "master_truth.csv": 2}  # fmt: skip
    return ChangedLog(log, {name: shift(first) for name, first in places.items()})


def _somewhere(log: LogFolder) -> tuple[float, float]:
    """Give a place of the log: the start, else the first beacon, leader, position or master."""
    names = {"start.csv": 1, "beacons.csv": 1, "leaders.csv": 2, "positions.csv": 1,
             "masters.csv": 2}  # fmt: skip
    for name, first in names.items():
        if name in log:
            for rows, _ in log[name].chunks():
                return float(rows[0, first]), float(rows[0, first + 1])
    return 0.0, 0.0
