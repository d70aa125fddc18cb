"""``auvest import``: published recordings as logs that ``auvest replay`` reads.

Knows goats14, hat_charles, labyrinth_uwb, mrclam6 and ugps_pier59 as the project's validation data
have them, and mrclam: the original text files of any UTIAS MR.CLAM set. What is taken from each is
said in docs/logs.md.

Examples
--------
  auvest import goats14 data/goats14 logs

  auvest import mrclam MRCLAM_Dataset6 logs/mrclam6
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from auvest.commands import options
from auvest.commands.console import Terminal, shown
from auvest.commands.version import version
from auvest.logs.importers import IMPORTERS

SetName = Literal["goats14", "hat_charles", "labyrinth_uwb", "mrclam6", "mrclam", "ugps_pier59"]


def command(
    name: Annotated[SetName, typer.Argument(metavar="SET", help="Which set.", show_default=False)],
    source: Annotated[Path, typer.Argument(metavar="DIR", help="Its folder.", show_default=False)],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="OUT", help="Folder for the logs; made if missing.", show_default=False
        ),
    ],
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Import; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    with terminal.usage_errors(), terminal.writing(output):
        folders = IMPORTERS[name](source, output, force=force)
    terminal.result_json(
        {"command": "import", "version": version(), "logs": [str(folder) for folder in folders]}
    )
    for folder in folders:
        terminal.result(f"log       {shown(folder)}")
