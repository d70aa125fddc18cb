"""Ranges by the speed of sound that water.csv tells, where the instrument took another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.logs import LogError, LogFolder
from auvest.logs.changed import Change, columns_changed
from auvest.logs.reader import Rows
from auvest.replay.config import Settings

#: Where the formula holds: temperature (°C), salinity (psu) and depth (m).
VALID = ((0.0, 35.0), (0.0, 45.0), (0.0, 1000.0))


def sound_speed_m_s(
    temperature_c: npt.ArrayLike, salinity_psu: npt.ArrayLike, depth_m: npt.ArrayLike
) -> Floats:
    """Speed of sound in water, m/s, to 1 m/s (Medwin 1975).

    Parameters
    ----------
    temperature_c, salinity_psu, depth_m : array_like
        0 to 35 °C, 0 to 45 psu, 0 to 1000 m, of shapes that go together.

    Raises
    ------
    ValueError
        If a value lies outside of where the formula holds.
    """
    given = [np.asarray(one, np.float64) for one in (temperature_c, salinity_psu, depth_m)]
    for name, values, (low, high) in zip(
        ("temperature_c", "salinity_psu", "depth_m"), given, VALID, strict=True
    ):
        if not ((values >= low) & (values <= high)).all():
            raise ValueError(f"{name} must lie in {low:g}..{high:g}, where the formula holds")
    t, s, z = given
    speed: Floats = (
        1449.2 + t * (4.6 + t * (-0.055 + t * 0.00029)) + (1.34 - 0.01 * t) * (s - 35.0) + 0.016 * z
    )
    return speed


def range_changes(log: LogFolder, settings: Settings) -> dict[str, Change]:
    """Give what becomes of the ranges: times the speed of sound then over the one assumed.

    Raises
    ------
    LogError
        If the water is not one for which the formula holds.
    """
    if "water.csv" not in log:
        return {}
    table = log["water.csv"]
    rows = _rows(log, "water.csv")
    if len(rows) == 0:
        raise LogError(table.path, "has no line below the header")
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    depth = np.zeros(len(rows))
    if "depth.csv" in log:
        track = _rows(log, "depth.csv")
        if len(track):
            depth = np.interp(rows[:, 0], *track[np.argsort(track[:, 0], kind="stable")].T)
    salinity = table.column(rows, "salinity_psu", settings.water.salinity_psu)
    try:
        # Depths are noisy at the surface.
        speed = sound_speed_m_s(rows[:, 1], salinity, np.maximum(depth, 0.0))
    except ValueError as error:
        raise LogError(table.path, str(error)) from None
    factor = speed / settings.water.assumed_m_s

    def corrected(ranges: Rows) -> Floats:
        scaled: Floats = ranges[:, 2] * np.interp(ranges[:, 0], rows[:, 0], factor)
        return scaled

    return dict.fromkeys(("ranges.csv", "fixes.csv"), columns_changed({2: corrected}))


def _rows(log: LogFolder, name: str) -> Rows:
    parts = [np.empty((0, len(log[name].columns)))]
    return np.concatenate(parts + [rows for rows, _ in log[name].chunks()])
