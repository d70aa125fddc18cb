"""``auvest init``: a first settings file for a folder of recordings.

LOG is a folder of CSV files: a log as --layout shows it, or what recorders left. Files and
columns with other names, units or separators are guessed by their names and numbers. The log is
then checked as 'auvest check' does it, and LOG/auvest.toml written: what is which, noises and gaps
as far as they show, and the findings as comments. Read it before you trust it.

Examples
--------
  auvest init my_log

  auvest replay my_log --config my_log/auvest.toml

  auvest init --schema > settings.schema.json
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from auvest.commands import log_options, options
from auvest.commands.console import Terminal, shown
from auvest.commands.files import write_text
from auvest.commands.version import version
from auvest.logs.reader import not_a_folder
from auvest.replay.first import first_settings
from auvest.replay.schema import SCHEMA


def command(
    log: Annotated[
        Path | None, typer.Argument(metavar="LOG", help="Folder.", show_default=False)
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON Schema of settings, and nothing else.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace LOG/auvest.toml.")] = False,
    layout: log_options.Layout = False,  # noqa: ARG001 (shown when it is read)
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if schema:
        print(SCHEMA.read_text(encoding="utf-8"), end="")
        return
    with terminal.usage_errors():
        if log is None:
            raise ValueError("LOG: a folder is missing (see --layout)")
        if not log.is_dir():
            raise ValueError(f"LOG: {log}: {not_a_folder(log)}")
        path = log / "auvest.toml"
        if path.exists() and not force:
            raise ValueError(f"{path} is there already; --force replaces it")
        made = first_settings(log)
    with terminal.writing(log):
        write_text(path, made.text)
    terminal.result_json(
        {
            "command": "init",
            "version": version(),
            "settings": str(path),
            "verdict": made.checked.verdict,
            "unknown": made.unknown,
            "findings": [one.document() for one in made.checked.findings],
        }
    )
    terminal.result(f"settings    {shown(path)}")
    for name, one in made.files.items():
        taken = [
            f"{column} from {own!r}" + (f" in {one.units[column]}" if column in one.units else "")
            for column, own in one.columns.items()
        ]
        terminal.result(f"{name:11} {', '.join([one.file or name, *taken])}")
    for name in made.unknown:
        terminal.warn(f"{name}: nothing is known of it")
    log_options.show_findings(terminal, made.checked.findings)
    terminal.result(f"verdict     {made.checked.verdict.replace('_', ' ')}")
