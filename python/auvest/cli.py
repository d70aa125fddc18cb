"""The command line ``auvest``: the tree of commands. Each command is a module of its own.

To add one: write ``commands/<verb>_<noun>.py`` (``reproduce/<noun>/command.py``) with a function
``command``, and put it into the table below with the line that stands first in its help and in that
of its group. What the module's docstring says below its first line is the help, with examples. The
module is imported when the command is called: ``auvest --help`` waits for none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from inspect import cleandoc
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from auvest.commands.exit_codes import EXIT_CODES

#: First line of help of each command, by the words that call it.
COMMANDS: Mapping[tuple[str, ...], str] = {
    ("calibrate",): "Find the noises of the settings by the innovations of logs alone.",
    ("capture",): "Record what a sketch reports: a CSV file, a figure, a table.",
    ("check",): "Check a log before it is used: what is there, and what may be wrong with it.",
    ("compare",): "Replay a recorded run through several filters, side by side.",
    ("cost",): (
        "Measure a filter with your models on the simulated MEGA2560: flash, RAM, stack, cycles."
    ),
    ("export",): "Write results of a replay for Foxglove (MCAP) or as a ROS 2 bag.",
    ("filters",): "List the filters: what each takes, and where it runs with the same bits.",
    ("fit",): "Say which filters fit a chip with so much RAM and flash.",
    ("hil",): "Play a log to the filter on a chip, and compare every bit with the desk.",
    ("import",): "Turn a recording into a log for 'auvest replay', or list what it holds.",
    ("init",): "Write a first settings file for a folder of recordings.",
    ("library",): "Write the Arduino library: a zip for the IDE or PlatformIO.",
    ("mission",): "Play the vehicle that the sketch mission steers, on a board or simulated.",
    ("replay",): "Replay recorded runs through a filter.",
    ("sweep",): (
        "Sweep a grid or list of parameters over a scenario or a log, on all cores or a cluster."
    ),
    ("version",): "Show the version, and what this build lacks.",
    ("simulate", "aukf"): (
        "Simulate the AUKF paper's scenario and show errors, intervals and consistency."
    ),
    ("simulate", "slatf"): "Simulate the SLATF paper's scenario and show errors and consistency.",
    ("simulate", "mekf"): (
        "Simulate range-only cooperative localisation and show errors, weights and consistency."
    ),
    ("simulate", "mission"): (
        "Simulate a vehicle that steers itself along a track by its own estimate."
    ),
    ("reproduce", "aukf"): (
        "Reproduce the AUKF paper (Deng, Yin, Duan 2019): Figs 1 to 10 and every claim."
    ),
    ("reproduce", "slatf"): (
        "Reproduce the SLATF paper (Lu, Chen, Liu, Ma, He 2020): Table 1, Figs 2 to 6, all claims."
    ),
    ("reproduce", "mekf"): (
        "Reproduce the M-estimation EKF paper (Li, Du, Fan, Chen, Mao, Luo 2020): Figs 5 and 6."
    ),
    ("reproduce", "intervals"): "Compare the interval policies at equal mean sampling rate.",
    ("reproduce", "logs"): (
        "Replay the validation recordings and set the errors beside the targets."
    ),
    ("reproduce", "calibration"): (
        "Make the noises of the settings ten times off, and calibrate them by the recordings."
    ),
    ("reproduce", "constants"): (
        "Find what instruments are off by, in simulated surveys and in the recordings."
    ),
    ("reproduce", "vehicle"): (
        "Fly the vehicle that the AUKF paper describes: what each estimate is worth in the loop."
    ),
    ("reproduce", "slat-cases"): (
        "Cases in which SlatfJoint and the IMM earn their place, and by how much."
    ),
    ("reproduce", "mistakes"): (
        "Put the usual mistakes into clean simulated logs, and see what 'auvest check' says."
    ),
    ("reproduce", "slat-robust"): (
        "SLAT filters that know how far off they are, and find a lost master again."
    ),
    ("reproduce", "mrclam6"): (
        "Track real robots that see each other, with one setting for all tracks."
    ),
}

app = typer.Typer(
    name="auvest",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_show_locals=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_GROUPS = {
    "simulate": "Simulate a filter in its scenario, many runs.",
    "reproduce": "Reproduce a paper's figures and judge its claims.",
}


def _module(words: tuple[str, ...]) -> str:
    """Name the module of a command."""
    if words[0] == "reproduce":
        return f"auvest.reproduce.{words[1].replace('-', '_')}.command"
    if words == ("import",):
        return "auvest.commands.import_log"  # no module can be called "import"
    return f"auvest.commands.{'_'.join(words)}"


def _lazy(words: tuple[str, ...], line: str) -> type[TyperCommand]:
    """Make what stands in the tree of commands until the command is called."""

    class Lazy(TyperCommand):
        def make_context(self, *arguments: Any, **options: Any) -> Any:
            from auvest.commands.console import discard_unpublished

            found = import_module(_module(words))
            real = typer.Typer(rich_markup_mode="rich", add_completion=False)
            about = (found.__doc__ or "").partition("\n\n")[2]
            about = about.replace("Examples\n--------\n", "Examples:\n\n")
            text = f"{line}\n\n{about}\n{EXIT_CODES}\n"
            real.command(self.name, help=text)(found.command)
            context = typer.main.get_command(real).make_context(*arguments, **options)
            context.call_on_close(discard_unpublished)
            return context

    return Lazy


def _grow() -> None:
    branches: dict[tuple[str, ...], typer.Typer] = {(): app}
    for name, text in _GROUPS.items():
        branches[(name,)] = typer.Typer(name=name, no_args_is_help=True, help=text)
        app.add_typer(branches[(name,)])
    for words, line in COMMANDS.items():
        cls = _lazy(words, line)
        branches[words[:-1]].command(words[-1], cls=cls, help=line)(lambda: None)


_grow()


def _show_version(wanted: bool) -> None:
    if wanted:
        from auvest.commands.version import lines

        typer.echo("\n".join(lines()))
        raise typer.Exit


def _main(
    show_version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and stop."
        ),
    ] = False,
) -> None:
    """Estimators for small autonomous underwater vehicles: simulate, reproduce, compare.

    Results go to stdout, messages and progress to stderr; --json gives one JSON object on stdout.

    First steps:

      auvest simulate aukf               the paper's scenario, a table and a figure

      auvest simulate aukf --help        all its options, with examples

      auvest reproduce aukf              every figure and claim of the paper beside ours

      auvest reproduce intervals         the interval policies at equal sampling rate

      auvest simulate slatf              a slave without communication pings its master

      auvest reproduce slatf             Table 1 and every figure of the paper beside ours

      auvest simulate mekf               ranges with outliers: EKF and robust kernels

      auvest simulate mission            a torpedo steers itself by its own estimate

      auvest sweep --help                any of these over a grid, on all cores or a cluster

      auvest reproduce mekf              the M-estimation EKF paper beside ours

      auvest reproduce logs              real recordings: our filters beside the baselines

      auvest reproduce mrclam6           real robots: SLATF and EKF-SLAT with an IMM master

      auvest init my_log                 a first settings file: which of your files is what

      auvest check my_log                what is wrong with a recording, before it is used

      auvest replay --help               your own recordings through any filter

      auvest calibrate my_log            sigmas from the log alone, as settings to use

      auvest compare --help              a recording through several filters, side by side

      auvest cost my_models.hpp          what your models take on the chip, and their bits there

      auvest hil my_log                  a recording through the filter on chips, bit by bit

      auvest mission --help              the vehicle in the loop of a board that steers it

      auvest capture --help              record what a board reports, real or simulated
    """


app.callback(help=f"{cleandoc(_main.__doc__ or '')}\n\n{EXIT_CODES}\n")(_main)
