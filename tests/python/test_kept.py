"""What commands print and write, whole, beside what is kept of them (kept.py)."""

from __future__ import annotations

import contextlib
import inspect
import json
import shlex
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from kept import Kept, written
from test_check import arc
from test_init import recorders
from test_log_columns import spatial_log
from test_replay import fixes_log, increments_log
from test_replay_slat import sea
from typer.main import get_command
from typer.testing import CliRunner

import auvest
from auvest import guidance, metrics, vehicle
from auvest.cli import app
from auvest.replay import config
from auvest.replay.toml import settings_text
from auvest.reproduce.mistakes import measure
from auvest.reproduce.mistakes.injected import MISTAKES
from auvest.simulation import cooperative, mission, slat, tracking


def told(folder: Path, line: str) -> str:
    """Return what a command prints, and what it writes into ``folder / "out"``."""
    done = CliRunner().invoke(app, shlex.split(line.replace("OUT", str(folder / "out"))))
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    said = f"$ auvest {line}\n{done.stdout}{done.stderr}\nexit code {done.exit_code}\n"
    return said + written(folder / "out")


def test_arguments_and_their_defaults(kept: Kept) -> None:
    """Of all that the package offers, its scenarios and the settings of a replay."""
    places = (auvest, cooperative, mission, slat, tracking, vehicle, guidance, metrics, config)
    lines = []
    for place in places:
        for name in sorted(getattr(place, "__all__", None) or vars(place)):
            one = getattr(place, name)
            if callable(one) and not name.startswith("_") and "auvest" in str(one.__module__):
                with contextlib.suppress(ValueError):  # of compiled ones
                    lines.append(f"{place.__name__}.{name}{inspect.signature(one)}")
    settings = json.dumps(asdict(config.Settings()), indent=1)
    kept("arguments.txt", "\n".join([*dict.fromkeys(lines), settings, ""]), exact=True)


def test_options_and_their_defaults(kept: Kept) -> None:
    def options(command: Any, name: str) -> Iterator[str]:
        if hasattr(command, "list_commands"):
            with command.context_class(command) as context:
                for word in command.list_commands(context):
                    yield from options(command.get_command(context, word), f"{name} {word}")
        else:
            with command.make_context(name, [], resilient_parsing=True) as context:
                for one in context.command.params:
                    yield f"{name} {' '.join(one.opts)} {one.default!r}"

    kept("options.txt", "\n".join(options(get_command(app), "auvest")) + "\n", exact=True)


COMMANDS = {
    "simulate_aukf": "simulate aukf --runs 3 --no-figure",
    "simulate_aukf_lognormal": "simulate aukf --runs 2 --noise lognormal --dtype float64 "
    "--no-figure",
    "simulate_slatf": "simulate slatf --runs 2 --duration 40 --particles 30 --log --no-figure",
    "simulate_slatf_unknown": "simulate slatf --runs 2 --duration 40 --particles 30 "
    "--filter slatf-joint --masters 3 --association unknown --outlier 0.1 --gate 16 "
    "--plan unknown --no-figure",
    "simulate_mekf": "simulate mekf --runs 2 --steps 200 --no-figure",
    "simulate_mekf_late": "simulate mekf --runs 2 --steps 200 --filter ukf --kernel hampel "
    "--late 0.3 --dropout 0.2 --displaced 20 --no-figure",
    "simulate_mission": "simulate mission --runs 2 --track circle --outliers 0.05 --kernel igg "
    "--no-figure",
    "reproduce_vehicle": "reproduce vehicle --runs 2",
    "reproduce_slat_cases": "reproduce slat-cases --runs 2 --particles 30",
    "reproduce_slat_robust": "reproduce slat-robust --runs 8",
    "reproduce_constants": "reproduce constants --runs 1",
}


@pytest.fixture(autouse=True)
def no_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have pages be those that are made without the recordings."""
    monkeypatch.delenv("AUVEST_DATA", raising=False)


@pytest.mark.parametrize("name", COMMANDS)
def test_simulations_and_pages(name: str, tmp_path: Path, kept: Kept) -> None:
    kept(f"{name}.txt", told(tmp_path, f"{COMMANDS[name]} --output OUT"))


LOGS = {
    "check": "check LOG",
    "check_json": "check LOG --json",
    "init": "init LOG",
    "replay": "replay LOG --write estimates,measurements,errors --format csv --output OUT",
    "replay_smooth": "replay LOG --smooth --write estimates --format csv --every 7 --output OUT",
    "replay_aukf": "replay LOG --filter robust-ukf --kernel hampel --write errors --output OUT",
    "compare": "compare LOG --filter ekf --filter robust-ukf --output OUT",
    # Its files have all digits of an optimum, which other sines move by more than the last of six.
    "calibrate": "calibrate LOG --output LOG/calibrated",
}


@pytest.mark.parametrize("name", LOGS)
def test_logs(name: str, tmp_path: Path, kept: Kept) -> None:
    log = arc(tmp_path / "log", 300)
    kept(f"log_{name}.txt", told(tmp_path, LOGS[name].replace("LOG", str(log))))


def test_logs_of_recorders(tmp_path: Path, kept: Kept) -> None:
    log = recorders(tmp_path / "log")
    text = told(tmp_path, f"init {log}")
    kept("log_recorders.txt", text + (log / "auvest.toml").read_text(encoding="utf-8"))


def two_masters(folder: Path) -> None:
    """Echoes of one master, and from 20 s on of two."""
    sea(folder, sources=(7, 3))
    header, *lines = (folder / "echoes.csv").read_text().splitlines()
    heard = [line for line in lines if line.split(",")[1] == "7" or float(line.split(",")[0]) > 20]
    (folder / "echoes.csv").write_text("\n".join([header, *heard]) + "\n")


OTHER_LOGS = {
    "echoes": (two_masters, "--filter slatf2 --set slat.max_masters=2"),
    "echoes_joint": (partial(sea, increments=True), "--filter slatf-joint"),
    "fixes": (fixes_log, "--filter aukf"),
    "fixes_ukf": (fixes_log, "--filter ukf --smooth"),
    "increments": (increments_log, "--filter ckf --set ranges.every_s=2 --set odometry.gap_s=3"),
    "spatial": (spatial_log, "--filter robust-ukf --kernel igg"),
}


@pytest.mark.parametrize("name", OTHER_LOGS)
def test_replays_of_other_logs(name: str, tmp_path: Path, kept: Kept) -> None:
    log = tmp_path / "log"
    log.mkdir()
    make, options = OTHER_LOGS[name]
    make(log)
    what = "estimates,measurements,errors" + (",masters" if "echoes" in name else "")
    replay = f"replay {log} {options} --write {what} --format csv --output OUT"
    kept(f"log_{name}.txt", told(tmp_path, f"check {log}") + told(tmp_path, replay))


@pytest.mark.parametrize(
    ("name", "kind"), [(name, kind) for name, one in MISTAKES.items() for kind in one.kinds]
)
def test_mistakes(name: str, kind: str, tmp_path: Path, kept: Kept) -> None:
    settings = tmp_path / "own.toml"
    settings.write_text(settings_text(measure.trial(name, kind, 1, tmp_path / "log"), {}))
    text = told(tmp_path, f"check {tmp_path / 'log'} --config {settings}")
    kept(f"mistake_{name.replace(' ', '_')}_{kind}.txt", text)
