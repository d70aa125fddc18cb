"""``auvest hil``: a recorded log through the filter on a chip, bit by bit beside the desk.

A LOG is a folder as 'auvest replay' takes it. A program with the log's filter, models and settings
is made for each target and is played the rows that a replay gives to the filter. After each row it
answers with state, covariance, NIS, weights and status, and every bit is compared with Python's
filter in float32. The first number that differs is named; exit code 1 then.

Targets: host is this computer (needs g++ and Eigen), atmega2560 a simulated MEGA2560 (avr-gcc,
arduino-builder, Arduino's core, simavr), cortex-m3 and cortex-m4f are boards of QEMU, serial:PORT
is a board of yours (pyserial). What is missing is named. For a board of yours load the sketch
'bench' of the output folder first; that it is the right one is checked, and what the line damages
or loses is sent again.

The output folder gets the bits of each target as Parquet, the sketch, a report and results.json.

Examples
--------
  auvest hil logs/goats14 --config goats14 --filter robust-ekf

  auvest hil logs/goats14 --config goats14 --target atmega2560 --target cortex-m4f

  auvest hil my_echoes --filter slatf2 --target cortex-m4f        a slave that tracks its masters

  auvest hil my_log --target serial:/dev/ttyACM0 --rows 500

  auvest hil my_log --flags "-mfma -ffp-contract=fast"      would a build like this keep the bits?
"""

from __future__ import annotations

import shlex
import tempfile
from pathlib import Path
from typing import Annotated, Any

import typer

from auvest.board import BoardError
from auvest.commands import log_options, options
from auvest.commands.console import Terminal, shown, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_results, write_text
from auvest.commands.version import version
from auvest.errors import FilterError, ModelError
from auvest.firmware import hil
from auvest.firmware.hil import SERIAL, TARGETS, AnyRecord, HilError, Leg
from auvest.firmware.hil_bench import bench
from auvest.firmware.hil_record import Words
from auvest.firmware.hil_serial import LineLost
from auvest.firmware.simulator import SimulatorError
from auvest.firmware.sketch import SketchError
from auvest.logs import LogFolder
from auvest.replay import checks

_HEADER = ("target", "numbers", "differing", "median step", "awake", "first difference")


def command(
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="Folder of a log.", show_default=False)
    ],
    filter_name: log_options.Filter = None,
    config: log_options.Config = None,
    target: Annotated[
        list[str] | None,
        typer.Option(
            "--target",
            help=f"{', '.join(TARGETS)} or {SERIAL}PORT; may be repeated.",
            show_default="host",
        ),
    ] = None,
    rows: Annotated[
        int | None, typer.Option(min=1, help="So many rows of the log.", show_default="all")
    ] = None,
    flags: Annotated[
        str, typer.Option(help="Further flags of the compiler, on the host and Cortex-M.")
    ] = "",
    output: options.Output = Path("auvest-output/hil"),
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Play; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    targets = list(dict.fromkeys(target or ["host"]))
    for one in targets:
        if one not in TARGETS and not one.startswith(SERIAL):
            raise typer.BadParameter(
                f"{one!r} is not {', '.join(TARGETS)} or {SERIAL}PORT", param_hint="'--target'"
            )
    with terminal.usage_errors():
        settings = log_options.settings_of(config)
        folder = LogFolder(log, reading=settings.reading)
        name = checks.filter_of(folder, settings, filter_name)
        try:
            record = hil.record_of(folder, settings, name, rows=rows)
        except FilterError as error:
            terminal.fail(f"{shown(folder.path)}: {error}", ExitCode.FAILED)
    new = terminal.new_folder(output, "hil", force=force)
    with terminal.usage_errors(), terminal.writing(new.path):
        bench(record).write(new.part, serial=True)
        desk = record.on_desk()
        legs = []
        for one in targets:
            with (
                tempfile.TemporaryDirectory() as build,
                terminal.progress(f"{shown(one)}, rows") as progress,
            ):
                try:
                    leg = hil.run(
                        record,
                        one,
                        Path(build),
                        desk=desk,
                        flags=shlex.split(flags),
                        progress=progress,
                    )
                except ModelError as error:
                    terminal.fail(str(error), ExitCode.FAILED)
                except LineLost as error:
                    terminal.publish(new)
                    sketch = f"the sketch bench is in {shown(output)}"
                    terminal.fail(f"{one}: {error}; {sketch}", ExitCode.FAILED)
                except (BoardError, FileNotFoundError, HilError, SimulatorError, SketchError) as e:
                    terminal.fail(f"{one}: {e}", ExitCode.FAILED)
            legs.append(leg)
        document = {
            "command": "hil",
            "version": version(),
            "log": folder.path.resolve().name,
            "filter": name,
            "legs": [leg.document(record) for leg in legs],
        }
        _write(new.part, record, desk, legs, document)
    terminal.publish(new)
    terminal.result_json(document)
    lines = [_line(leg, record) for leg in legs]
    title = f"{document['log']}, {name}: {len(record):,} rows"
    terminal.result(table(title, _HEADER, lines, right={1, 2, 3, 4}))
    terminal.result(f"bits      {shown(output)}: desk and each target as .parquet")
    differing = [leg for leg in legs if leg.difference is not None]
    if not differing:
        terminal.result("all agree with the desk in every bit")
        return
    terminal.fail(
        "\n".join(f"{leg.target} differs from {leg.difference}" for leg in differing),
        ExitCode.FAILED,
    )


def _write(
    folder: Path,
    record: AnyRecord,
    desk: Words,
    legs: list[Leg],
    document: dict[str, Any],
) -> None:
    """Write the bits of desk and targets, the report and results.json."""
    from auvest.firmware.hil_trace import write_trace  # here, because pyarrow takes long to import

    write_trace(folder / "desk.parquet", record, desk, None)
    for leg in legs:
        stem = leg.target.replace("/", "-").replace(":", "-")
        write_trace(folder / f"{stem}.parquet", record, leg.words, leg.microseconds)
    write_results(folder, document)
    rows = [_HEADER, ("---",) * len(_HEADER), *(_line(leg, record) for leg in legs)]
    text = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    write_text(
        folder / "README.md",
        f"# {document['filter']} over {document['log']}, {len(record):,} rows\n\n"
        f"Compared with Python's filter in float32, every bit.\n\n{text}\n",
    )


def _line(leg: Leg, record: AnyRecord) -> tuple[str, ...]:
    values = leg.document(record)
    time_us, awake = values["microseconds_median"], values["awake_share"]
    return (
        leg.target,
        f"{values['numbers']:,}",
        f"{leg.differing:,}",
        "" if time_us is None else f"{1e-3 * time_us:.2f} ms",
        "" if awake is None else f"{100 * awake:.2f} %",
        "none" if leg.difference is None else str(leg.difference),
    )
