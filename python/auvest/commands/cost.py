"""``auvest cost``: what a filter with these models takes on the MEGA2560, before you own one.

Compiles the filter as the Arduino IDE does, runs it on the simulated chip over a record that is
simulated with the models, and compares every bit with Python in float32. Flash, RAM, stack and
cycles are those of the chip: the simulation is exact.

A model is a struct of your header (docs/models.md) or a class of the package; parameters in
brackets. Needs the Arduino core, avr-gcc and simavr; what is missing is named.

Examples
--------
  auvest cost my_models.hpp

  auvest cost my_models.hpp --filter aukf --process MyAcceleration --sensor MyRangeBearing

  auvest cost --filter robust-ekf --process "SpeedHeading(heading_bias=True)" --sensor LeaderRange

  auvest cost my_models.hpp --x0 10,20,1,0 --sigma0 3,3,0.5,0.5 --json
"""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from auvest.board import BoardError
from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.firmware.cost import KERNELS, POLICIES, Cost, measure
from auvest.firmware.simulator import SimulatorError
from auvest.firmware.sketch import SketchError
from auvest.registry import FILTERS

_NAMES = ", ".join(entry.name for entry in FILTERS.values() if entry.family == "gaussian")
_RECORD = "Record"


def command(
    header: Annotated[
        Path | None,
        typer.Argument(
            metavar="HEADER",
            help="Header with models of your own.",
            exists=True,
            dir_okay=False,
            readable=True,
            show_default=False,
        ),
    ] = None,
    filter_name: Annotated[
        str, options.option(options.FILTER, f"One of {_NAMES}.", "--filter")
    ] = "ukf",
    process: Annotated[
        str | None,
        options.option(options.FILTER, "Process; default: the first of the header.", "--process"),
    ] = None,
    sensor: Annotated[
        list[str] | None,
        options.option(
            options.FILTER, "Sensor, may be repeated; default: those of the header.", "--sensor"
        ),
    ] = None,
    kernel: Annotated[
        str | None,
        options.option(options.FILTER, f"Robust kernel: {', '.join(KERNELS)}.", "--kernel"),
    ] = None,
    policy: Annotated[
        str | None,
        options.option(options.FILTER, f"Interval policy: {', '.join(POLICIES)}.", "--policy"),
    ] = None,
    x0: Annotated[
        str | None, options.option(_RECORD, "Start, like 10,20,1,0; default: 0.", "--x0")
    ] = None,
    sigma0: Annotated[
        str | None, options.option(_RECORD, "Its standard deviations; default: 1.", "--sigma0")
    ] = None,
    input_: Annotated[
        str | None,
        options.option(_RECORD, "Mean of what drives the process; default: 0.", "--input"),
    ] = None,
    dt: Annotated[
        float, options.option(_RECORD, "Seconds between rows.", "--dt", check=options.positive)
    ] = 0.5,
    steps: Annotated[
        int, typer.Option(min=1, max=100_000, help="Rows.", rich_help_panel=_RECORD)
    ] = 300,
    seed: options.Seed = 1,
    output: Annotated[
        Path | None,
        options.option(
            "Output",
            "Keep the sketch and the programs in this folder.",
            "--output",
            file_okay=False,
        ),
    ] = None,
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Measure; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    with ExitStack() as stack:
        new = terminal.new_folder(output, "cost", force=force) if output is not None else None
        folder = new.part if new else Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(terminal.usage_errors())
        progress = stack.enter_context(terminal.progress("Compiling and running"))
        try:
            cost = measure(
                header,
                output=folder,
                filter=filter_name,
                process=process,
                sensors=sensor or (),
                kernel=kernel,
                policy=policy,
                x0=_numbers("--x0", x0),
                sigma0=_numbers("--sigma0", sigma0),
                input=_numbers("--input", input_),
                dt=dt,
                steps=steps,
                seed=seed,
                progress=progress,
            )
        except (BoardError, FileNotFoundError, SimulatorError, SketchError) as error:
            terminal.fail(str(error), ExitCode.FAILED)
    if new is not None:
        terminal.publish(new)
    terminal.result_json({"command": "cost", "version": version(), **cost.row()})
    terminal.result(_table(cost))
    if cost.difference is None:
        terminal.result(
            f"chip and desk agree in every bit: {cost.numbers:,} numbers over {cost.steps:,} rows"
        )
        return
    terminal.fail(f"chip and desk differ from {cost.difference}", ExitCode.FAILED)


def _numbers(name: str, text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not like 1,2.5,0", param_hint=name) from None


def _table(cost: Cost) -> Table:
    parts = [cost.filter, cost.process, *cost.sensors, cost.kernel, cost.policy]
    title = f"{', '.join(part for part in parts if part)} on the ATmega2560"
    made = Table(title=title, title_justify="left", title_style="bold", box=None, show_header=False)
    for justify in ("left", "right", "left"):
        made.add_column(justify=justify)
    made.add_row(
        "flash", f"{cost.flash_bytes:,} B", f"{cost.flash_above_empty_bytes:,} above empty"
    )
    made.add_row("static RAM", f"{cost.static_ram_bytes:,} B", "of 8,192")
    made.add_row("stack", f"{cost.stack_bytes:,} B", "deepest")
    for name in ("min", "median", "max"):
        cycles: int = getattr(cost, f"cycles_{name}")
        time = f"{cycles / 16e3:.2f} ms at 16 MHz"
        made.add_row(f"a step, {name}", f"{cycles:,} cycles", time)
    return made
