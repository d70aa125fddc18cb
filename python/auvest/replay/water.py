"""Ranges by the speed of sound that water.csv tells, where the instrument took another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.logs import LogError, LogFolder
from auvest.logs.changed import Change, columns_changed
from auvest.logs.reader import Rows
from auvest.replay.config import Settings

#: Where the formula holds, and the unit.
VALID = {
    "temperature_c": (0.0, 35.0, ""),
    "salinity_psu": (0.0, 45.0, ""),
    "depth_m": (0.0, 1000.0, " m"),
}


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
    for name, values in zip(VALID, given, strict=True):
        if (k := _first_outside(name, values)) is not None:
            low, high, _ = VALID[name]
            raise ValueError(
                f"{name} must lie in {low:g}..{high:g}, where the formula holds, "
                f"not {values.flat[k]:.10g}"
            )
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
    salinity = table.column(rows, "salinity_psu", settings.water.salinity_psu)
    for name, values in (("temperature_c", rows[:, 1]), ("salinity_psu", salinity)):
        if (k := _first_outside(name, values)) is not None:
            refusal = _refusal(name, values[k])
            if name in table.names:
                raise LogError(table.path, refusal, line=k + 2, column=name)
            raise LogError(table.path, f"[water] {name}: {refusal}")
    order = np.argsort(rows[:, 0], kind="stable")
    rows, salinity = rows[order], salinity[order]
    depth = np.zeros(len(rows))
    if "depth.csv" in log:
        track = _rows(log, "depth.csv")
        if len(track):
            depth = np.interp(rows[:, 0], *track[np.argsort(track[:, 0], kind="stable")].T)
            depth = np.maximum(depth, 0.0)  # they are noisy at the surface
            if (k := _first_outside("depth_m", depth)) is not None:
                path = log["depth.csv"].path
                raise LogError(path, _refusal("depth_m", depth[k]), column="depth_m")
    factor = sound_speed_m_s(rows[:, 1], salinity, depth) / settings.water.assumed_m_s

    def corrected(ranges: Rows) -> Floats:
        scaled: Floats = ranges[:, 2] * np.interp(ranges[:, 0], rows[:, 0], factor)
        return scaled

    return dict.fromkeys(("ranges.csv", "fixes.csv"), columns_changed({2: corrected}))


def _first_outside(name: str, values: Floats) -> int | None:
    """Give the place of the first value for which the formula does not hold."""
    low, high, _ = VALID[name]
    outside = np.flatnonzero(~((values >= low) & (values <= high)))
    return int(outside[0]) if len(outside) else None


def _refusal(name: str, value: float) -> str:
    low, high, unit = VALID[name]
    return (
        f"{value:.10g} is outside {low:g}..{high:g}{unit}, where the formula for the speed of "
        "sound holds"
    )


def _rows(log: LogFolder, name: str) -> Rows:
    parts = [np.empty((0, len(log[name].columns)))]
    return np.concatenate(parts + [rows for rows, _ in log[name].chunks()])
