"""The mistakes: each takes the files of a clean trial and spoils them as people do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from auvest.reproduce.mistakes.trials import Files, Rows

RANGING = ("leaders", "beacons")
ALL = (*RANGING, "tracking")


@dataclass(frozen=True)
class Mistake:
    """One mistake.

    Attributes
    ----------
    cause : str
        What it must be called.
    what : str
        What was done.
    kinds : tuple of str
        To which kinds of trial it applies.
    spoil : callable
        Changes the files before they are written.
    spoil_text : callable, optional
        Changes a folder that is written.
    """

    cause: str
    what: str
    kinds: tuple[str, ...]
    spoil: Callable[[Files, np.random.Generator], None] = lambda _files, _random: None
    spoil_text: Callable[[Path], None] = lambda _folder: None


def _measured(files: Files) -> dict[str, Rows]:
    return files["ranges.csv"] if "ranges.csv" in files else files["fixes.csv"]


def _times(compute: Callable[[Rows], Rows]) -> Callable[[Files, np.random.Generator], None]:
    def spoil(files: Files, _random: np.random.Generator) -> None:
        for columns in files.values():
            if "time_s" in columns:
                columns["time_s"] = compute(columns["time_s"])

    return spoil


def _no_lines(files: Files, _random: np.random.Generator) -> None:
    files["odometry.csv"] = {name: rows[:0] for name, rows in files["odometry.csv"].items()}


def _no_file(files: Files, _random: np.random.Generator) -> None:
    del files["odometry.csv"]


def _gap(files: Files, _random: np.random.Generator) -> None:
    time = files["odometry.csv"]["time_s"]
    kept = (time < 500.0) | (time > 560.0)
    files["odometry.csv"] = {name: rows[kept] for name, rows in files["odometry.csv"].items()}


def _degrees(files: Files, _random: np.random.Generator) -> None:
    if "fixes.csv" in files:
        fixes = files["fixes.csv"]
        fixes["bearing_rad"] = np.degrees(fixes["bearing_rad"])
        return
    odometry = files["odometry.csv"]
    name = "turn_rad" if "turn_rad" in odometry else "yaw_rate_rad_s"
    odometry[name] = np.degrees(odometry[name])


def _heading(turn: float, offset: float) -> Callable[[Files, np.random.Generator], None]:
    def spoil(files: Files, _random: np.random.Generator) -> None:
        def changed(angle: Rows) -> Rows:
            return np.angle(np.exp(1j * (turn * angle + offset)))

        if "fixes.csv" in files:
            files["fixes.csv"]["bearing_rad"] = changed(files["fixes.csv"]["bearing_rad"])
            return
        odometry = files["odometry.csv"]
        name = "turn_rad" if "turn_rad" in odometry else "yaw_rate_rad_s"
        odometry[name] = turn * odometry[name]
        files["start.csv"]["heading_rad"] = changed(files["start.csv"]["heading_rad"])

    return spoil


def _exchanged(files: Files, _random: np.random.Generator) -> None:
    sources = files["leaders.csv" if "leaders.csv" in files else "beacons.csv"]
    sources["x_m"], sources["y_m"] = sources["y_m"], sources["x_m"]


def _slant(files: Files, _random: np.random.Generator) -> None:
    measured = _measured(files)
    measured["range_m"] = np.hypot(measured["range_m"], 60.0)


def _late(files: Files, _random: np.random.Generator) -> None:
    files["ranges.csv"]["time_s"] = files["ranges.csv"]["time_s"] + 3.0


def _scaled(files: Files, _random: np.random.Generator) -> None:
    measured = _measured(files)
    measured["range_m"] = 1.07 * measured["range_m"]


def _knots(files: Files, _random: np.random.Generator) -> None:
    odometry = files["odometry.csv"]
    for name in ("forward_m", "left_m", "speed_m_s", "left_m_s"):
        if name in odometry:
            odometry[name] = odometry[name] * 3600 / 1852


def _code(value: float) -> Callable[[Files, np.random.Generator], None]:
    def spoil(files: Files, random: np.random.Generator) -> None:
        measured = _measured(files)
        lost = random.random(len(measured["range_m"])) < 0.12
        measured["range_m"] = np.where(lost, value, measured["range_m"])

    return spoil


def _one_source(files: Files, _random: np.random.Generator) -> None:
    measured = _measured(files)
    mine = measured["source"] == 1
    measured["range_m"] = measured["range_m"] + np.where(mine, 25.0, 0.0)


def _stray_file(folder: Path) -> None:
    (folder / "battery.csv").write_text("time_s,voltage_v\n0.0,12.5\n")


def _text(change: Callable[[str], str]) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        for name in ("ranges.csv", "fixes.csv"):
            path = folder / name
            if path.exists():
                path.write_text(change(path.read_text()))

    return spoil


def _float32(time: Rows) -> Rows:
    return (1.764288e9 + time).astype(np.float32).astype(np.float64)


MISTAKES: Mapping[str, Mistake] = {
    "milliseconds": Mistake(
        "milliseconds", "all times in milliseconds since boot", ALL, _times(lambda t: 1e3 * t)
    ),
    "microseconds": Mistake(
        "microseconds", "all times in microseconds since boot", ALL, _times(lambda t: 1e6 * t)
    ),
    "times equal": Mistake(
        "times_equal", "times since 1970 written from a float32", ALL, _times(_float32)
    ),
    "clock forwards": Mistake(
        "clock_jump", "the clock is set an hour on in the middle", ALL,
        _times(lambda t: t + np.where(t > 450, 3600.0, 0.0)),
    ),
    "clock back": Mistake(
        "clock_jump", "the clock is set five minutes back in the middle", ALL,
        _times(lambda t: t - np.where(t > 450, 300.0, 0.0)),
    ),
    "no lines": Mistake("no_odometry", "odometry.csv has its header only", RANGING, _no_lines),
    "no odometry": Mistake("no_odometry", "there is no odometry.csv", RANGING, _no_file),
    "odometry gap": Mistake("odometry_gap", "a minute of odometry is missing", RANGING, _gap),
    "degrees": Mistake("degrees", "turns or bearings in degrees", ALL, _degrees),
    "compass mirrored": Mistake(
        "heading_mirrored", "heading from north, clockwise", ALL, _heading(-1.0, np.pi / 2)
    ),
    "compass turned": Mistake(
        "heading_turned", "heading from another axis, 90 degrees off", ALL,
        _heading(1.0, np.pi / 2),
    ),
    "axes exchanged": Mistake(
        "axes_exchanged", "x and y of the sources exchanged", ALL, _exchanged
    ),
    "slant": Mistake("slant_range", "60 m of depth between craft and sources", ALL, _slant),
    "latency": Mistake("latency", "ranges stamped 3 s late", RANGING, _late),
    "scale": Mistake("range_scale", "ranges 7 % too long", ALL, _scaled),
    "knots": Mistake("speed_scale", "speeds in knots", RANGING, _knots),
    "no echo 0": Mistake("no_echo", "0 where no echo came", ALL, _code(0.0)),
    "no echo 65.535": Mistake("no_echo", "65.535 where no echo came", ALL, _code(65.535)),
    "no echo 9999": Mistake("no_echo", "9999 where no echo came", ALL, _code(9999.0)),
    "no echo 400": Mistake("no_echo", "400, the end of the scale", ALL, _code(400.0)),
    "one source": Mistake("source_off", "ranges of one source 25 m too long", ALL, _one_source),
    "battery.csv": Mistake(
        "ignored_file", "a file that is not read", ALL, spoil_text=_stray_file
    ),
    "semicolons": Mistake(
        "separator", "semicolons and decimal commas", ALL,
        spoil_text=_text(lambda text: text.replace(",", ";").replace(".", ",")),
    ),
    "decimal commas": Mistake(
        "decimal_comma", "decimal commas between commas", ALL,
        spoil_text=_text(lambda text: text.replace(".", ",")),
    ),
}  # fmt: skip
