"""Options of the commands that run a log through a filter: ``check`` and ``replay``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.logs.findings import Finding
from auvest.replay import Settings, find_settings
from auvest.replay.config import FilterName, KernelName, packaged_settings

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOG...", help="Folders of logs.", show_default=False)
]
Filter = Annotated[
    FilterName | None,
    typer.Option(
        "--filter",
        help="The filter.",
        show_default="that of the settings, else robust-ekf for ranges and ukf for fixes",
    ),
]
Config = Annotated[
    str | None,
    typer.Option(
        "--config",
        help="Settings: a TOML file, or one of " + ", ".join(packaged_settings()) + ".",
        metavar="FILE",
        show_default="defaults; see docs/logs.md",
    ),
]


Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="One setting over those of --config, as ranges.sigma_m=1.5; again for more.",
        metavar="SECTION.KEY=VALUE",
        show_default=False,
    ),
]
KernelOption = Annotated[
    KernelName | None,
    typer.Option(
        "--kernel", help="The robust kernel.", show_default="that of the settings, else hampel"
    ),
]

Smooth = Annotated[
    bool, typer.Option("--smooth", help="Go back over each log with what came later.")
]
Lag = Annotated[
    float | None,
    typer.Option(
        "--lag",
        help="With --smooth: only with what came within so many seconds.",
        metavar="S",
        callback=options.not_negative,
        show_default="everything that came later",
    ),
]


def require_smooth(*, smooth: bool, lag_s: float | None) -> None:
    """Refuse --lag where nothing is smoothed."""
    if lag_s is not None and not smooth:
        raise typer.BadParameter("needs --smooth.", param_hint="'--lag'")


def settings_of(
    config: str | None, changes: Sequence[str] | None = None, kernel: KernelName | None = None
) -> Settings:
    """Read the settings that --config names, else the defaults, with --set and --kernel."""
    own = [f"filter.kernel={kernel}"] if kernel is not None else []
    return find_settings(config or "", [*(changes or ()), *own])


def note_unread_settings(terminal: Terminal, config: str | None, logs: Sequence[Path]) -> None:
    """Say so where a log has settings of its own and --config names none."""
    for path in logs:
        if config is None and (own := path / "auvest.toml").exists():
            terminal.warn(f"{own} is not read: add --config {own}")


def show_findings(terminal: Terminal, findings: Iterable[Finding]) -> None:
    """Print a line for each."""
    for found in findings:
        terminal.result(f"{found.verdict.replace('_', ' '):11} {found.cause}: {found.text}")
