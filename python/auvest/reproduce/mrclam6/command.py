"""``auvest reproduce mrclam6``: SLATF and EKF-SLAT with an IMM master on real robots.

Each track of the UTIAS recording (one robot seen by another for at least 15 s) is run through dead
reckoning, EKF-SLAT and SLATF 2.0 with an IMM master of unknown velocity. Writes a page README.md, a
picture and results.json. The recording is not part of auvest: DIR/mrclam6 holds groundtruth.csv,
odometry.csv and sightings.csv.

Examples
--------
  auvest reproduce mrclam6 --data recordings

  AUVEST_DATA=recordings auvest reproduce mrclam6 --json --quiet | jq '.filters'
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.mrclam6 import measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    rows = [
        (
            measure.NAMES[row["filter"]],
            str(row["runs"]),
            f"{row['slave_rmse_m']:.3f}",
            f"{row['ratio']:.3f} ({row['ratio_worst']:.3f})",
            f"{row['relative_rmse_m']:.3f} ({row['relative_rmse_worst_m']:.3f})"
            if row["filter"] != "dead_reckoning"
            else "",
        )
        for row in measure.summary(result)["filters"]
    ]
    yield table(
        f"{len(result.tracks)} tracks, RMSE over all steps; (worst run)",
        ("filter", "runs", "slave / m", "over dead reckoning", "relative / m"),
        rows,
    )


command = command_of(
    measure,
    page,
    _shown,
    data=options.Data,
    runs=Annotated[
        int, typer.Option("--runs", min=1, max=1000, help="Runs of SLATF 2.0 over all tracks.")
    ],
    seed=options.Seed,
)
