"""The command line ``auvest``: the tree of commands. Each command is a module of its own.

To add one: write ``commands/<verb>_<noun>.py`` with a function ``command`` and its ``HELP``, and
register it below.
"""

from __future__ import annotations

from typing import Annotated

import typer

from auvest.commands import (
    capture,
    import_log,
    replay,
    reproduce_aukf,
    reproduce_intervals,
    reproduce_logs,
    reproduce_mekf,
    reproduce_mrclam6,
    reproduce_slatf,
    simulate_aukf,
    simulate_mekf,
    simulate_slatf,
)
from auvest.commands.console import EXIT_CODES
from auvest.commands.version import version

_CONTEXT = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="auvest",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_show_locals=False,
    context_settings=_CONTEXT,
    help=f"""Estimators for small autonomous underwater vehicles: simulate, reproduce, compare.

Results go to stdout, messages and progress to stderr; --json gives one JSON object on stdout.

First steps:

  auvest simulate aukf               the paper's scenario, a table and a figure

  auvest simulate aukf --help        all its options, with examples

  auvest reproduce aukf              every figure and claim of the paper beside ours

  auvest reproduce intervals         the interval policies at equal sampling rate

  auvest simulate slatf              a slave without communication pings its master

  auvest reproduce slatf             Table 1 and every figure of the paper beside ours

  auvest simulate mekf               ranges with outliers: EKF and robust kernels

  auvest reproduce mekf              the M-estimation EKF paper beside ours

  auvest reproduce logs              real recordings: our filters beside the baselines

  auvest reproduce mrclam6           real robots: SLATF and EKF-SLAT with an IMM master

  auvest replay --help               your own recordings through any filter

  auvest capture --help              record what a board reports, real or simulated

{EXIT_CODES}
""",
)

simulate = typer.Typer(
    no_args_is_help=True, help="Simulate a filter in its scenario, many runs.", name="simulate"
)
reproduce = typer.Typer(
    no_args_is_help=True, help="Reproduce a paper's figures and judge its claims.", name="reproduce"
)
app.add_typer(simulate)
app.add_typer(reproduce)

app.command("capture", help=capture.HELP)(capture.command)
app.command("import", help=import_log.HELP)(import_log.command)
app.command("replay", help=replay.HELP)(replay.command)
simulate.command("aukf", help=simulate_aukf.HELP)(simulate_aukf.command)
reproduce.command("aukf", help=reproduce_aukf.HELP)(reproduce_aukf.command)
simulate.command("slatf", help=simulate_slatf.HELP)(simulate_slatf.command)
reproduce.command("slatf", help=reproduce_slatf.HELP)(reproduce_slatf.command)
simulate.command("mekf", help=simulate_mekf.HELP)(simulate_mekf.command)
reproduce.command("mekf", help=reproduce_mekf.HELP)(reproduce_mekf.command)
reproduce.command("intervals", help=reproduce_intervals.HELP)(reproduce_intervals.command)
reproduce.command("logs", help=reproduce_logs.HELP)(reproduce_logs.command)
reproduce.command("mrclam6", help=reproduce_mrclam6.HELP)(reproduce_mrclam6.command)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"auvest {version()}")
        raise typer.Exit


@app.callback()
def _main(
    show_version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and stop."
        ),
    ] = False,
) -> None:
    pass
