"""Options of the commands that run a log through a filter: ``check`` and ``replay``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.logs.findings import Finding, Verdict
from auvest.logs.layout import FILES, SPELLINGS, WHAT
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


def _show_layout(wanted: bool) -> None:
    if not wanted:
        return
    lines = [
        "A log is a folder of these files, CSV with a header. Columns in [] may be missing.",
        "",
    ]
    for name, layouts in FILES.items():
        lines.append(f"{name:17} {WHAT[name]}")
        lines += [f"  {'or' if k else '':2} {layout}" for k, layout in enumerate(layouts)]
    lines += ["", "Other names of columns, which say what they are:"]
    for names, others in SPELLINGS.items():
        lines.append(f"  {','.join(names):14} {' or '.join(','.join(one) for one in others)}")
    lines += [
        "",
        "Angles count from +x towards +y; compass_rad and azimuth_rad clockwise from north.",
        "A craft that localises itself has odometry.csv, and ranges, fixes or positions; one that",
        "is tracked has fixes or positions alone; one that hears masters odometry.csv, echoes.csv.",
        "'auvest init' reads files of other names, units and separators.",
    ]
    Terminal(as_json=False, quiet=False).result("\n".join(lines))
    raise typer.Exit


Layout = Annotated[
    bool,
    typer.Option(
        "--layout",
        help="Show the files and columns of a log, and stop.",
        is_eager=True,
        callback=_show_layout,
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
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 1 unless the verdict on each log is sound.")
]


def require_sound(terminal: Terminal, verdicts: Iterable[tuple[str, Verdict]]) -> None:
    """End with 1 if a log's verdict is another: what --strict asks for."""
    other = [f"{log} is {v.replace('_', ' ')}" for log, v in verdicts if v != "sound"]
    if other:
        terminal.fail(f"--strict: {'; '.join(other)}", ExitCode.FAILED)


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
