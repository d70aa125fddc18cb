"""``auvest reproduce logs``: real recordings through the filters, beside the targets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.reproduce import logs

HELP = """\
Needs the recordings, which are not part of the package: the folder with goats14, hat_charles,
mrclam6, labyrinth_uwb and ugps_pier59. Writes a page README.md and results.json.

Examples:

  auvest reproduce logs --data ../shared/data

  AUVEST_DATA=../shared/data auvest reproduce logs --json --quiet | jq .held
"""


def command(
    data: Annotated[
        Path,
        typer.Option(
            envvar="AUVEST_DATA",
            file_okay=False,
            help="Folder of the recordings.",
            show_default=False,
        ),
    ],
    output: options.Output = Path("auvest-output/reproduce-logs"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Replay; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    terminal.make_folder(output)
    try:
        with terminal.progress("sets") as progress, terminal.usage_errors():
            result = logs.measure(data, progress)
    except KeyboardInterrupt:
        terminal.fail("interrupted: nothing is written", ExitCode.INTERRUPTED)
    document = {"command": "reproduce logs", "version": version(), **logs.summary(result)}
    with terminal.writing(output):
        (output / "results.json").write_text(console.to_json(document) + "\n", encoding="utf-8")
        (output / "README.md").write_text(logs.page(result), encoding="utf-8")
    terminal.result_json(document)
    header, rows = logs.set_table(result)
    short = [
        header.index(name) for name in ("set", "odometry", "EKF", logs.KERNEL, "target", "holds")
    ]
    terminal.result(
        _table(
            "Position RMSE / m: odometry alone, EKF, robust EKF",
            [header[k] for k in short],
            [[row[k] for k in short] for row in rows],
        )
    )
    terminal.result(_table("RMSE of predicted fixes / m", *logs.tracking_table(result)))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"results   {output / 'results.json'}")


def _table(title: str, header: list[str], rows: list[list[str]]) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold")
    for name in header:
        table.add_column(name)
    for row in rows:
        table.add_row(*row)
    return table
