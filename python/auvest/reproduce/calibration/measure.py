"""Noises ten times off, and what calibration makes of them: ``auvest reproduce calibration``."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import Settings, find_settings, replay
from auvest.replay.calibration import calibrate, noises_of, with_noises
from auvest.reproduce.ticks import Ticks

#: Largest RMSE after calibration over that of the documented settings. goats14's truth is a batch
#: solution with noises of its own.
SETS: Mapping[str, float] = {
    "goats14": 1.15, "hat_charles": 1.1, "labyrinth_uwb": 1.1, "mrclam6": 1.1, "ugps_pier59": 1.1,
}  # fmt: skip
#: How far off the settings are.
OFF = (0.1, 10.0)
#: Share of the truth that is to lie within three sigma, and the largest mean sigma over the RMSE.
INSIDE, SIGMA = 0.95, 2.0


@dataclass(frozen=True)
class Figures:
    """What a set's logs gave with some settings: means over them.

    Attributes
    ----------
    rmse_m : float
        Position, against the truth; where there is none, of the predictions of withheld fixes.
    inside_3_sigma, sigma_m : float or None
        Share of the truth within three sigma, and the mean standard deviation of the position;
        None without a truth.
    """

    rmse_m: float
    inside_3_sigma: float | None
    sigma_m: float | None


@dataclass(frozen=True)
class Row:
    """One set, from settings that are off.

    Attributes
    ----------
    set_name, noise : str
        ``noise`` is "all" or the one that is off.
    times : float
        How far.
    wrong, right : Figures
        With the settings that are off, and with those found.
    replays : int
        How often each log was replayed.
    processor_s : float
        What that took.
    """

    set_name: str
    noise: str
    times: float
    wrong: Figures
    right: Figures
    replays: int
    processor_s: float


@dataclass(frozen=True)
class Bench:
    """All that is measured; ``documented`` are the figures of the documented settings, by set."""

    documented: dict[str, Figures]
    rows: list[Row]

    def held(self) -> dict[str, bool]:
        """Whether each set comes back from all settings, and whether its sigmas are honest."""
        found = {}
        for name in self.documented:
            most = SETS[name] * self.documented[name].rmse_m
            rows = [row for row in self.rows if row.set_name == name]
            found[name] = all(row.right.rmse_m <= most for row in rows)
            if self.documented[name].sigma_m is not None:
                found[f"{name}, sigmas"] = all(honest(row.right) for row in rows)
        return found


def honest(figures: Figures) -> bool:
    """Whether the standard deviations are neither too small nor too large."""
    if figures.inside_3_sigma is None or figures.sigma_m is None:
        return True
    return figures.inside_3_sigma >= INSIDE and figures.sigma_m <= SIGMA * figures.rmse_m


def measure(*, data: Path, progress: Callable[[int, int], None] | None = None) -> Bench:
    """Import every set below ``data``, spoil its settings, and calibrate.

    Raises
    ------
    ValueError
        If a set is not there or not what it should be; the message names the file.
    """
    with TemporaryDirectory() as temporary:
        logs = {}
        for name in SETS:
            folders = IMPORTERS[name](data / name, Path(temporary) / name)
            logs[name] = [LogFolder(folder) for folder in folders]
        logs["ugps_pier59"] = logs["ugps_pier59"][:1]  # the noises were chosen on the other
        spoiled = {name: spoilt(logs[name][0], find_settings(name)) for name in SETS}
        tick = Ticks(sum(map(len, spoiled.values())), progress)
        documented, rows = {}, []
        for name in SETS:
            documented[name] = figures(logs[name], find_settings(name))
            for (noise, times), settings in spoiled[name].items():
                rows.append(_row(name, noise, times, logs[name], settings))
                tick()
    return Bench(documented, rows)


def spoilt(log: LogFolder, settings: Settings) -> dict[tuple[str, float], Settings]:
    """Give the settings with all noises, and with each, so many times off."""
    noises = noises_of(log, settings)
    found = {}
    for which in [noises, *([noise] for noise in noises)]:
        name = "all" if which is noises else which[0].name
        for times in OFF:
            values = [times * noise.of(settings) for noise in which]
            found[name, times] = with_noises(settings, which, values)
    return found


def figures(logs: list[LogFolder], settings: Settings) -> Figures:
    """Replay the logs."""
    rmse, inside, sigma = [], [], []
    for log in logs:
        result = replay(log, settings, causes=False)
        numbers, errors = result.numbers, result.errors.columns()
        if numbers["truth"]:
            rmse.append(numbers["rmse_m"])
            inside.append(numbers["inside_3_sigma"])
            sigma.append(np.hypot(errors["sigma_x_m"], errors["sigma_y_m"]).mean())
        else:
            rmse.append(numbers["held_out_rmse_m"])
    return Figures(
        rmse_m=float(np.mean(rmse)),
        inside_3_sigma=float(np.mean(inside)) if inside else None,
        sigma_m=float(np.mean(sigma)) if sigma else None,
    )


def _row(name: str, noise: str, times: float, logs: list[LogFolder], settings: Settings) -> Row:
    begun = time.process_time()
    found = calibrate(logs, settings)
    took = time.process_time() - begun
    wrong, right = figures(logs, settings), figures(logs, found.settings)
    return Row(name, noise, times, wrong, right, found.replays, took)


def summary(result: Bench) -> dict[str, Any]:
    """Everything as plain values, for results.json."""
    return {**asdict(result), "most": dict(SETS), "held": result.held()}


def rmse_table(result: Bench) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table."""
    header = ["set", "off", "times", "before", "after", "over documented", "inside 3 sigma",
              "mean sigma"]  # fmt: skip
    rows = []
    for name, documented in result.documented.items():
        rows.append([name, "documented", "", "", *_cells(documented, documented)])
        for row in result.rows:
            if row.set_name == name:
                cells = _cells(row.right, documented)
                before = f"{row.wrong.rmse_m:.3f}"
                rows.append([name, row.noise, f"{row.times:g}", before, *cells])
    return header, rows


def _cells(figures: Figures, documented: Figures) -> list[str]:
    inside, sigma = figures.inside_3_sigma, figures.sigma_m
    return [
        f"{figures.rmse_m:.3f}",
        f"{figures.rmse_m / documented.rmse_m:.2f}",
        "" if inside is None else f"{100 * inside:.1f} %",
        "" if sigma is None else f"{sigma:.3f}",
    ]
