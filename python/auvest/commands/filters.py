"""``auvest filters``: which filters there are, with which models, and where each runs.

A filter runs under Python in any case. "chip" says that it is built for the vehicle, "parity" that
tests show the same float32 bits on every target, "budget" that docs/budgets.md has what it costs.

Examples
--------
  auvest filters

  auvest filters --json
"""

from __future__ import annotations

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import Terminal, to_json
from auvest.registry import FILTERS


def command(as_json: options.Json = False, quiet: options.Quiet = False) -> None:
    """List the filters."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    rows = [entry.row() for entry in FILTERS.values()]
    if as_json:
        print(to_json(rows))
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("filter", "class", "replay", "chip", "parity", "budget", "note"):
        table.add_column(heading)
    for row in rows:
        marks = ("yes" if row[key] else "-" for key in ("replay", "chip", "parity", "budget"))
        table.add_row(row["name"], row["class"], *marks, row["note"])
    terminal.result(table)
    for family in ("gaussian", "slat"):
        first = next(entry for entry in FILTERS.values() if entry.family == family)
        names = ", ".join(entry.name for entry in FILTERS.values() if entry.family == family)
        terminal.result(f"\n{names}")
        terminal.result(f"  processes  {', '.join(first.processes)}")
        terminal.result(f"  sensors    {', '.join(first.sensors)}")
