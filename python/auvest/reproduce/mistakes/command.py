"""``auvest reproduce mistakes``: the usual mistakes in simulated logs, and what 'check' says.

Twenty-four mistakes (units, clocks, axes, compass, latency, depth, codes for 'no echo', separators
...) are put into clean simulated trials of three kinds, and it is counted how often the right cause
is named; clean trials, and the recordings if there are any, must raise no alarm. Writes a page
README.md and results.json.

Examples
--------
  auvest reproduce mistakes --data recordings

  auvest reproduce mistakes --runs 2 --clean 5 --json --quiet | jq .held
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.mistakes import measure, page


def _shown(result: measure.Bench) -> Iterator[Table]:
    header, rows = measure.mistake_table(result)
    wanted = ("mistake", "cause", "leaders", "beacons", "tracking", "right")
    places = [header.index(name) for name in wanted]
    yield table("Named the right cause", wanted, [[row[k] for k in places] for row in rows])
    if result.recordings:
        yield table("Recordings", *measure.recording_table(result))


command = command_of(
    measure,
    page,
    _shown,
    figures=False,
    runs=Annotated[
        int, typer.Option("--runs", min=1, max=1000, help="Trials of each mistake and kind.")
    ],
    clean=Annotated[
        int, typer.Option("--clean", min=1, max=10_000, help="Clean trials of each kind.")
    ],
    seed=options.Seed,
    data=options.OptionalData,
    workers=Annotated[
        int | None,
        typer.Option(
            "--workers", min=1, max=256, help="Processes.", show_default="one per processor"
        ),
    ],
)
