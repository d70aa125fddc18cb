"""Constants: found where there are, and their price where there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import Settings, find_settings, replay
from auvest.replay.constants import Found
from auvest.reproduce.constants import trials
from auvest.reproduce.constants.trials import ERRORS, Error
from auvest.reproduce.ticks import Ticks

#: What is asked of each recording, as --set has it.
RECORDINGS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "labyrinth_uwb": (("constants.range_scale=0.05",),),
    "goats14": (("constants.range_scale=0.05",),
                ("constants.speed_factor=0.15", "constants.turn_offset_rad_s=0.01")),
    "hat_charles": (("constants.range_scale=0.05",),),
    "mrclam6": (("constants.speed_factor=0.15", "constants.turn_offset_rad_s=0.01"),),
}  # fmt: skip
#: The largest RMSE of labyrinth_uwb with a range scale, m.
LABYRINTH_M = 0.055
#: The largest RMSE over that of the run that knows: with an error, and without one.
KNOWN, WITHOUT = 1.10, 1.05
#: Two standard deviations hold 95 % of what is found; of a few trials at least:
FOUND = 0.9


@dataclass(frozen=True)
class Row:
    """One error over all its trials.

    Attributes
    ----------
    name : str
        The constant.
    size, prior : float
        What is to be found, and what the settings say of it.
    known_m, found_m, without_m, ignored_m : float
        Mean RMSE of the runs that know the error, that find it, that look where there is none, and
        that do not look.
    off : list of float
        How far off the constant was at the end, in its standard deviations, of each trial.
    sigma : float
        Mean standard deviation at the end.
    indistinguishable : int
        Of how many trials without an error it was said that there may be none.
    """

    name: str
    size: float
    prior: float
    known_m: float
    found_m: float
    without_m: float
    ignored_m: float
    off: list[float]
    sigma: float
    indistinguishable: int

    @property
    def within(self) -> float:
        """Share of the trials in which it was found within two standard deviations."""
        return float(np.mean(np.abs(self.off) <= 2))


@dataclass(frozen=True)
class Recording:
    """One set with constants: mean RMSE of its logs without and with them, and what was found."""

    set_name: str
    changes: tuple[str, ...]
    without_m: float
    with_m: float
    found: list[list[str]]


@dataclass(frozen=True)
class Bench:
    """All that is measured."""

    rows: list[Row]
    recordings: list[Recording]

    def held(self) -> dict[str, bool]:
        """Whether each aim is reached."""
        found = {}
        for row in self.rows:
            found[f"{row.name}, found"] = row.within >= FOUND
            found[f"{row.name}, as known"] = row.found_m <= KNOWN * row.known_m
            found[f"{row.name}, without"] = row.without_m <= WITHOUT * row.known_m
        for one in self.recordings:
            if one.set_name == "labyrinth_uwb":
                found[one.set_name] = one.with_m <= LABYRINTH_M
        return found


def measure(
    *,
    runs: int = 10,
    seed: int = 0,
    data: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Bench:
    """Simulate and replay.

    Raises
    ------
    ValueError
        If a set is not there or not what it should be; the message names the file.
    """
    tick = Ticks(len(ERRORS) * runs + len(RECORDINGS), progress)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows = [_row(folder / one.name, one, range(seed, seed + runs), tick) for one in ERRORS]
        recordings = []
        for name, asked in RECORDINGS.items() if data is not None else ():
            assert data is not None
            logs = [LogFolder(one) for one in IMPORTERS[name](data / name, folder / name)]
            recordings += [_recording(name, changes, logs) for changes in asked]
            tick()
    return Bench(rows, recordings)


def _row(folder: Path, error: Error, seeds: range, tick: Ticks) -> Row:
    rmse: dict[str, list[float]] = {"known": [], "found": [], "without": [], "ignored": []}
    off, sigma, none = [], [], 0
    looks, plain = trials.settings({error.name: error.prior}), trials.settings({})
    for seed in seeds:
        clean = trials.write(folder / f"clean{seed}", error.name, 0.0, seed)
        wrong = trials.write(folder / f"wrong{seed}", error.name, error.size, seed)
        for name, log, settings in (
            ("known", clean, plain), ("found", wrong, looks), ("without", clean, looks),
            ("ignored", wrong, plain),
        ):  # fmt: skip
            numbers = _numbers(log, settings)
            rmse[name].append(numbers["rmse_m"])
            if name == "found":
                found = Found(**numbers["constants"][0])
                off.append((found.value - error.size) / found.sigma)
                sigma.append(found.sigma)
            if name == "without":
                none += Found(**numbers["constants"][0]).indistinguishable
        tick()
    means = {f"{name}_m": float(np.mean(values)) for name, values in rmse.items()}
    mean = float(np.mean(sigma))
    return Row(error.name, error.size, error.prior, **means, off=off, sigma=mean,
               indistinguishable=none)  # fmt: skip


def _numbers(log: LogFolder, settings: Settings) -> dict[str, Any]:
    return replay(log, settings, causes=False).numbers


def _recording(name: str, changes: tuple[str, ...], logs: list[LogFolder]) -> Recording:
    without = [_numbers(log, find_settings(name))["rmse_m"] for log in logs]
    found = [_numbers(log, find_settings(name, changes)) for log in logs]
    texts = [[f"{one['name']} {Found(**one).text}" for one in each["constants"]] for each in found]
    rmse = [each["rmse_m"] for each in found]
    return Recording(name, changes, float(np.mean(without)), float(np.mean(rmse)), texts)


def summary(result: Bench) -> dict[str, Any]:
    """Everything as plain values, for results.json."""
    return {**asdict(result), "held": result.held()}


def trial_table(result: Bench) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of the surveys."""
    header = ["constant", "error", "prior", "sigma at the end", "within 2 sigma", "ignored",
              "known", "found", "no error, looked for", "said to be none"]  # fmt: skip
    rows = [
        [
            row.name, f"{row.size:.3g}", f"{row.prior:g}", f"{row.sigma:.2g}",
            f"{np.sum(np.abs(row.off) <= 2)} of {len(row.off)}", f"{row.ignored_m:.2f}",
            f"{row.known_m:.3f}",
            f"{row.found_m:.3f} ({row.found_m / row.known_m:.2f})",
            f"{row.without_m:.3f} ({row.without_m / row.known_m:.2f})",
            f"{row.indistinguishable} of {len(row.off)}",
        ]
        for row in result.rows
    ]  # fmt: skip
    return header, rows


def recording_table(result: Bench) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of the recordings."""
    rows = [
        [
            one.set_name, f"{one.without_m:.3f}", f"{one.with_m:.3f}",
            "; ".join(", ".join(texts) for texts in one.found),
        ]
        for one in result.recordings
    ]  # fmt: skip
    return ["set", "without", "with", "found"], rows
