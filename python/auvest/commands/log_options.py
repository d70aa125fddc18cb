"""Options of the commands that run a log through a filter: ``check`` and ``replay``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from auvest.replay import Settings, find_settings
from auvest.replay.config import FilterName, packaged_settings

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


def settings_of(config: str | None) -> Settings:
    """Read the settings that --config names; without it, the defaults."""
    return Settings() if config is None else find_settings(config)
