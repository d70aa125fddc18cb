"""``auvest library``: write the Arduino library, a zip for the IDE or PlatformIO.

All that it takes came with auvest: no compiler, no Arduino. In the IDE: Sketch > Include Library >
Add .ZIP Library. Examples are under File > Examples > auvest.

Examples
--------
  auvest library

  auvest library --output ~/Downloads

  auvest library --output auvest.zip
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from auvest._outputs import new_file
from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.firmware import package


def command(
    output: Annotated[
        Path | None,
        typer.Option(
            help="The zip, or a folder that takes it under its own name.",
            show_default=f"{package.NAME}-VERSION.zip here",
        ),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Write it; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    path = output or Path()
    if path.is_dir():
        path /= package.file_name()
    try:
        content = package.archive()
        with new_file(path) as file:
            file.write(content)
    except OSError as error:
        terminal.fail(str(error), ExitCode.FAILED)
    terminal.result_json({"command": "library", "version": version(), "file": str(path)})
    terminal.files({"library": path})
