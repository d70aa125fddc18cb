"""``auvest reproduce constants``: instruments that are off by a constant, and what finds it.

Simulated surveys in which ranges are 7 % too long, the log reads a tenth too little, the gyro is
0.01 rad/s off or the compass 5 degrees: the constant is estimated with the pose, and set beside the
run that knows it; and beside it where there is no error to find. With the recordings, what becomes
of those. Writes a page README.md and results.json.

Examples
--------
  auvest reproduce constants --data recordings

  auvest reproduce constants --runs 3 --json --quiet | jq .held
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.constants import measure, page


def _shown(result: measure.Bench) -> Iterator[Table]:
    header, rows = measure.trial_table(result)
    names, *numbers = zip(header, *rows, strict=True)  # on its side, for terminals are narrow
    yield table("Simulated surveys", names, numbers, right=range(1, len(names)))
    if result.recordings:
        yield table("Recordings", *measure.recording_table(result))


command = command_of(
    measure,
    page,
    _shown,
    figures=False,
    runs=Annotated[int, typer.Option("--runs", min=1, max=1000, help="Surveys of each error.")],
    seed=options.Seed,
    data=options.OptionalData,
)
