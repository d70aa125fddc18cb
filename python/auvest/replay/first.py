"""A first settings file for a folder, of what its files show and ``auvest check`` finds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from auvest.logs.check import FileSeen
from auvest.logs.guess import guess
from auvest.logs.reading import FileReading
from auvest.replay.checks import Checked, check
from auvest.replay.config import Settings, settings_from
from auvest.replay.toml import SCHEMA_LINE, file_sections

#: A gap is so many usual steps long.
GAP_STEPS = 10
#: Spread of the innovations over their sigma beyond which another sigma is written.
SPREAD_TIMES = 1.5


@dataclass(frozen=True)
class First:
    """A first settings file.

    Attributes
    ----------
    text : str
        The file.
    checked : Checked
        What ``auvest check`` says with it.
    files : dict of str to FileReading
        The files of a log that were taken for something, by their names there.
    unknown : list of str
        Tables of which nothing is known.
    """

    text: str
    checked: Checked
    files: dict[str, FileReading]
    unknown: list[str]


def first_settings(folder: Path) -> First:
    """Guess, check, and write down what was found."""
    guessed = guess(folder)
    files = {name: replace(one, where="auvest.toml") for name, one in guessed.files.items()}
    seen = check(folder, Settings(files=files))
    document = _document(seen)
    settings = replace(settings_from(document, "auvest.toml"), files=files)
    checked = check(folder, settings)
    text = _text(document, files, checked, guessed.unknown)
    return First(text, checked, files, guessed.unknown)


def _document(seen: Checked) -> dict[str, dict[str, Any]]:
    """Give what the files and the innovations show of settings."""
    made: dict[str, dict[str, Any]] = {}
    default = Settings()

    def step(name: str) -> float:
        file: FileSeen | None = seen.files.get(name)
        usual = math.nan if file is None or file.lines < 2 else file.usual_step_s
        return float(f"{GAP_STEPS * usual:.2g}")

    odometry = seen.files.get("odometry.csv")
    velocities = odometry is not None and "speed_m_s" in odometry.table.names
    if velocities and step("odometry.csv") > default.odometry.gap_s:
        made["odometry"] = {"gap_s": step("odometry.csv")}
    if step("leaders.csv") > default.log.leader_gap_s:
        made["log"] = {"leader_gap_s": step("leaders.csv")}
    late = [-one.back.length_s for one in seen.files.values() if one.back is not None]
    if late and max(late) < 10:
        made.setdefault("log", {})["reorder_s"] = float(f"{1.1 * max(late):.2g}")
    # What most measurements say, if nothing is wrong but sigmas.
    wrong = {one.cause for one in seen.findings if one.verdict != "sound"}
    wrong -= {"noise_too_small", "innovations", "recoveries", "odometry_gap"}
    sources = [] if seen.health is None or wrong else seen.health.sources
    spreads = sorted(one.spread_m for one in sources if math.isfinite(one.spread_m))
    if spreads and "ranges.csv" in seen.files:
        usual = spreads[len(spreads) // 2]
        sigma = default.ranges.sigma_m
        if usual > 0 and not 1 / SPREAD_TIMES < usual / sigma < SPREAD_TIMES:
            made["ranges"] = {"sigma_m": float(f"{usual:.2g}")}
    return made


def _text(
    document: Mapping[str, Mapping[str, Any]],
    files: Mapping[str, FileReading],
    checked: Checked,
    unknown: list[str],
) -> str:
    lines = [
        SCHEMA_LINE,
        "# Written by auvest init: a first guess. Read it, and compare sigmas with what you know",
        "# of your instruments. docs/logs.md says what else there is.",
        "#",
        f"# auvest check says: {checked.verdict.replace('_', ' ')}",
        *(f"#   {one.cause}: {_plain(one.text)}" for one in checked.findings),
        *(f"# Nothing is known of {_plain(name)}." for name in unknown),
    ]
    for name, one in files.items():
        lines += file_sections(name.removesuffix(".csv"), one)
    for section, values in document.items():
        lines += ["", f"[{section}]", *(f"{key} = {value!r}" for key, value in values.items())]
    kinds = set(checked.files)
    if "ranges" not in document and "ranges.csv" in kinds:
        lines += ["", "[ranges]", f"# sigma_m = {Settings().ranges.sigma_m}"]
    return "\n".join(lines) + "\n"


def _plain(text: str) -> str:
    """Give a text that can stand in a comment."""
    return "".join(one if one.isprintable() else "?" for one in text)
