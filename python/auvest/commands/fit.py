"""``auvest fit``: which filters fit a chip with so much flash and RAM.

--ram and --flash are what your chip has, in bytes: all of its RAM, and the flash that the
bootloader leaves (32256 of an UNO's, 253952 of a MEGA2560's). Each filter was measured as a program
that holds it and nothing else: code and constants in flash; variables, and the deepest stack of a
whole run, in RAM. What is left is for your own code. --stack keeps RAM for your own functions and
interrupts.

The same filter takes other sizes on other chips. Without --chip the table says for each of them
whether the filter fits; with one it says what the filter takes and what it leaves. A dash: it has
no figures there, as it does not fit the chip itself.

The figures come with auvest (docs/boards.md); nothing is compiled. With models of your own: auvest
cost.

Examples
--------
  auvest fit --ram 2048 --flash 32256

  auvest fit --ram 2048 --flash 32256 --stack 500 --chip atmega328p

  auvest fit --ram 20480 --flash 65536 --chip cortex-m3 --json
"""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.firmware.fit import CHIPS, FILTERS, SHORT, Fit, fit

_LARGEST = 2**32


def command(
    ram: Annotated[int, typer.Option(min=1, max=_LARGEST, help="Bytes of RAM of the chip.")],
    flash: Annotated[
        int,
        typer.Option(min=1, max=_LARGEST, help="Bytes of flash that the bootloader leaves."),
    ],
    stack: Annotated[
        int,
        typer.Option(
            min=0, max=_LARGEST, help="Bytes of RAM to keep for your own functions and interrupts."
        ),
    ] = 0,
    chip: Annotated[
        list[str] | None,
        typer.Option(help=f"Chip, may be repeated: {', '.join(CHIPS)}.", show_default="all"),
    ] = None,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    chips = list(dict.fromkeys(chip or CHIPS))
    with terminal.usage_errors():
        try:
            rows = fit(ram, flash, stack, chips)
        except FileNotFoundError as error:
            terminal.fail(str(error), ExitCode.FAILED)
    asked = {"ram_bytes": ram, "flash_bytes": flash, "stack_reserve_bytes": stack, "chips": chips}
    filters = [row.row() for row in rows]
    terminal.result_json({"command": "fit", "version": version(), **asked, "filters": filters})
    if len(chips) == 1:
        terminal.result(_one_chip(chips[0], rows))
        terminal.result("")
        terminal.result(_what())
    else:
        terminal.result(_all_chips(chips, rows))
    if not any(row.fits for row in rows):
        terminal.result("\nno filter fits")


def _all_chips(chips: list[str], rows: list[Fit]) -> Table:
    found = {(row.filter, row.chip): row.fits for row in rows}
    table = _table()
    for chip in chips:
        table.add_column(SHORT[chip])
    for name in FILTERS:
        marks = (found.get((name, chip)) for chip in chips)
        table.add_row(name, *("-" if fits is None else "yes" if fits else "no" for fits in marks))
    return table


def _one_chip(chip: str, rows: list[Fit]) -> Table:
    table = _table(CHIPS[chip])
    table.add_column("fits")
    for heading in ("flash", "RAM", "stack", "flash left", "RAM left"):
        table.add_column(heading, justify="right", no_wrap=True)
    found = {row.filter: row for row in rows}
    for name in FILTERS:
        row = found.get(name)
        if row is None:
            table.add_row(name, "-")
            continue
        numbers = (row.flash_bytes, row.static_ram_bytes, row.stack_bytes)
        left = (row.flash_left_bytes, row.ram_left_bytes)
        cells = (f"{value:,}" for value in (*numbers, *left))
        table.add_row(name, "yes" if row.fits else "no", *cells)
    return table


def _what() -> Table:
    table = _table()
    table.add_column("what it is")
    for name, what in FILTERS.items():
        table.add_row(name, what)
    return table


def _table(title: str | None = None) -> Table:
    table = Table(box=None, pad_edge=False, title=title, title_justify="left", title_style="bold")
    table.add_column("filter", no_wrap=True)
    return table
