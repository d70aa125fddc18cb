"""Mistakes in simulated logs: ``auvest reproduce mistakes``.

Each mistake is put into clean simulated trials of every kind to which it applies, and ``check`` is
asked what is wrong. It has named the cause if that is among at most two that it names; what it says
of the innovations alone ("innovations", "recoveries") names none. Clean trials must be sound.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from auvest.importers.sets import IMPORTERS
from auvest.replay import Settings, checks, find_settings
from auvest.replay.checks import Checked
from auvest.reproduce.mistakes.injected import ALL, MISTAKES
from auvest.reproduce.mistakes.trials import KINDS, write
from auvest.reproduce.ticks import Ticks

#: Share of the trials of a mistake in which its cause must be named.
TARGET = 0.9
#: Causes that say that something is wrong, not what.
SYMPTOMS = ("innovations", "recoveries")
#: Recordings that are checked with the settings of their set.
SETS = ("goats14", "hat_charles", "mrclam6", "labyrinth_uwb", "ugps_pier59")
CLEAN = "clean"
#: Clean trials with every standard deviation in the settings a tenth of the true one.
TENTH = "sigmas a tenth"


@dataclass(frozen=True)
class Row:
    """One mistake on one kind of trial.

    Attributes
    ----------
    mistake, kind : str
        Keys of :data:`MISTAKES` (or "clean", or "sigmas a tenth") and :data:`KINDS`.
    cause : str
        What it must be called; "" of clean trials.
    runs, right : int
        How many trials, and in how many of them the answer was right.
    wrong : tuple of str
        The other answers.
    """

    mistake: str
    kind: str
    cause: str
    runs: int
    right: int
    wrong: tuple[str, ...]


@dataclass(frozen=True)
class Recording:
    """One recording with its own settings."""

    name: str
    verdict: str
    causes: tuple[str, ...]


@dataclass(frozen=True)
class Bench:
    """All that ``auvest reproduce mistakes`` measures; ``recordings`` is empty without data."""

    rows: list[Row]
    recordings: list[Recording]

    def share(self, mistake: str) -> float:
        """In which share of a mistake's trials, of all kinds, the answer was right."""
        mine = [row for row in self.rows if row.mistake == mistake]
        return sum(row.right for row in mine) / sum(row.runs for row in mine)

    @property
    def mistakes(self) -> list[str]:
        """The mistakes that were tried."""
        return list(dict.fromkeys(row.mistake for row in self.rows))

    def held(self) -> dict[str, bool]:
        """Whether each aim is reached, by its name."""
        made = {
            name: self.share(name) >= (1.0 if name == CLEAN else TARGET) for name in self.mistakes
        }
        for one in self.recordings:
            made[one.name] = one.verdict != "not_trusted"
        return made


def measure(
    *,
    runs: int = 20,
    clean: int = 200,
    seed: int = 1,
    data: Path | None = None,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Bench:
    """Check ``runs`` trials of each mistake and kind, and ``clean`` clean ones of each kind.

    Raises
    ------
    ValueError
        If a recording is not there or not what it should be.
    """
    cases = [(name, kind, runs) for name, one in MISTAKES.items() for kind in one.kinds]
    cases += [(TENTH, kind, runs) for kind in ALL] + [(CLEAN, kind, clean) for kind in ALL]
    tick = Ticks(len(cases) + len(SETS) * (data is not None), progress)
    rows = []
    with ProcessPoolExecutor(workers or os.cpu_count()) as pool:
        for name, kind, count in cases:
            one = partial(answer, name, kind)
            seeds = [seed + k for k in range(count)]
            rows.append(_row(name, kind, pool.map(one, seeds, chunksize=4)))
            tick()
    recordings: list[Recording] = []
    for name in SETS if data is not None else ():
        assert data is not None
        recordings += _recordings(name, data)
        tick()
    return Bench(rows, recordings)


def trial(mistake: str, kind: str, seed: int, folder: Path) -> Settings:
    """Write a trial with a mistake, and give the settings for it."""
    random = np.random.default_rng([seed, list(KINDS).index(kind)])
    files = KINDS[kind].make(random)
    settings = KINDS[kind].settings
    if mistake in MISTAKES:
        MISTAKES[mistake].spoil(files, random)
    write(folder, files)
    if mistake in MISTAKES:
        MISTAKES[mistake].spoil_text(folder)
    return _tenth(settings) if mistake == TENTH else settings


def answer(mistake: str, kind: str, seed: int) -> tuple[str, ...]:
    """Say which causes ``check`` names in such a trial."""
    with TemporaryDirectory() as temporary:
        settings = trial(mistake, kind, seed, Path(temporary))
        return causes(checks.check(Path(temporary), settings))


def causes(checked: Checked) -> tuple[str, ...]:
    """Give what was named, each once."""
    return tuple(dict.fromkeys(found.cause for found in checked.findings))


def right(mistake: str, named: Iterable[str]) -> bool:
    """Whether an answer is right."""
    if mistake == CLEAN:
        return not list(named)
    told = [cause for cause in named if cause not in SYMPTOMS]
    return _cause(mistake) in told and len(told) <= 2


def _cause(mistake: str) -> str:
    if mistake in MISTAKES:
        return MISTAKES[mistake].cause
    return "noise_too_small" if mistake == TENTH else ""


def _row(mistake: str, kind: str, answers: Iterable[tuple[str, ...]]) -> Row:
    given = list(answers)
    wrong = [", ".join(named) or "nothing" for named in given if not right(mistake, named)]
    return Row(mistake, kind, _cause(mistake), len(given), len(given) - len(wrong), tuple(wrong))


def _tenth(settings: Settings) -> Settings:
    """Make every standard deviation a tenth."""

    def smaller(section: Any, power: int = 1) -> Any:
        changed = {
            name: value / 10**power
            for name, value in vars(section).items()
            if name.startswith("sigma") or name.endswith("psd")
        }
        return replace(section, **changed)

    return replace(
        settings,
        start=smaller(settings.start),
        odometry=smaller(settings.odometry),
        ranges=smaller(settings.ranges),
        fixes=smaller(settings.fixes),
        process=smaller(settings.process, 2),
    )


def _recordings(name: str, data: Path) -> list[Recording]:
    with TemporaryDirectory() as temporary:
        found = []
        for folder in IMPORTERS[name](data / name, Path(temporary)):
            checked = checks.check(folder, find_settings(name))
            label = name if folder.name == name else f"{name}, {folder.name}"
            found.append(Recording(label, checked.verdict, causes(checked)))
        return found


def summary(result: Bench) -> dict[str, Any]:
    """Give all numbers, for JSON."""
    return {
        "held": result.held(),
        "rows": [vars(row) for row in result.rows],
        "recordings": [vars(one) for one in result.recordings],
    }


def mistake_table(result: Bench) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of mistakes."""
    header = ["mistake", "what was done", "cause", *ALL, "right", "otherwise"]
    cells = []
    for name in result.mistakes:
        mine = {row.kind: row for row in result.rows if row.mistake == name}
        wrong = [text for row in mine.values() for text in row.wrong]
        most = sorted(set(wrong), key=lambda text: (-wrong.count(text), text))[:2]
        cells.append(
            [
                name,
                _what(name),
                _cause(name) or "none",
                *(
                    f"{mine[kind].right} of {mine[kind].runs}" if kind in mine else ""
                    for kind in ALL
                ),
                f"{100 * result.share(name):.0f} %",
                "; ".join(f"{wrong.count(text)}: {text}" for text in most),
            ]
        )
    return header, cells


def _what(name: str) -> str:
    if name in MISTAKES:
        return MISTAKES[name].what
    return "nothing" if name == CLEAN else "every sigma of the settings a tenth of the true one"


def recording_table(result: Bench) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of recordings."""
    cells = [[one.name, one.verdict, ", ".join(one.causes)] for one in result.recordings]
    return ["recording", "verdict", "causes"], cells
