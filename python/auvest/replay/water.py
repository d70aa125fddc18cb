"""Ranges by the speed of sound that water.csv tells, where the instrument took another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.logs import LogError, LogFolder
from auvest.logs.changed import Change, columns_changed
from auvest.logs.reader import CsvTable, Rows
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
        for value in values[_outside(name, values)].flat:
            low, high, _ = VALID[name]
            raise ValueError(
                f"{name} must lie in {low:g}..{high:g}, where the formula holds, not {value:.10g}"
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
    _require_valid(table, "temperature_c", rows[:, 1])
    if "salinity_psu" in table.names:
        _require_valid(table, "salinity_psu", salinity)
    elif _outside("salinity_psu", salinity).any():
        refusal = _refusal("salinity_psu", settings.water.salinity_psu)
        raise LogError(table.path, f"[water] salinity_psu: {refusal}")
    order = np.argsort(rows[:, 0], kind="stable")
    rows, salinity = rows[order], salinity[order]
    depth = np.zeros(len(rows))
    if "depth.csv" in log:
        track = _rows(log, "depth.csv")
        if len(track):
            depth = np.interp(rows[:, 0], *track[np.argsort(track[:, 0], kind="stable")].T)
            depth = np.maximum(depth, 0.0)  # they are noisy at the surface
            for value in depth[_outside("depth_m", depth)]:
                path = log["depth.csv"].path
                raise LogError(path, _refusal("depth_m", value), column="depth_m")
    factor = sound_speed_m_s(rows[:, 1], salinity, depth) / settings.water.assumed_m_s

    def corrected(ranges: Rows) -> Floats:
        scaled: Floats = ranges[:, 2] * np.interp(ranges[:, 0], rows[:, 0], factor)
        return scaled

    return dict.fromkeys(("ranges.csv", "fixes.csv"), columns_changed({2: corrected}))


def _outside(name: str, values: Floats) -> npt.NDArray[np.bool_]:
    low, high, _ = VALID[name]
    return ~((values >= low) & (values <= high))


def _refusal(name: str, value: float) -> str:
    low, high, unit = VALID[name]
    return (
        f"{value:.10g} is outside {low:g}..{high:g}{unit}, where the formula for the speed of "
        "sound holds"
    )


def _require_valid(table: CsvTable, name: str, values: Floats) -> None:
    """Refuse a column of the whole file where the formula does not hold."""
    for k in np.flatnonzero(_outside(name, values)):
        raise LogError(table.path, _refusal(name, values[k]), line=int(k) + 2, column=name)


def _rows(log: LogFolder, name: str) -> Rows:
    parts = [np.empty((0, len(log[name].columns)))]
    return np.concatenate(parts + [rows for rows, _ in log[name].chunks()])
