"""``auvest reproduce slat-cases``: where SlatfJoint and the IMM earn their place, and by how much.

Two masters that cross while nobody says whose echo is whose, and a master that turns unannounced.
Writes a page README.md, pictures and results.json.

Examples
--------
  auvest reproduce slat-cases

  auvest reproduce slat-cases --runs 10 --json --quiet | jq '.crossing[0]'
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.slat_cases import measure, page


def _shown(cases: measure.Cases) -> Iterator[Table]:
    for case in cases.results["turning"]:
        yield table(
            f"A master that turns: odometry {case['sigma_speed_m_s']:g} m/s, "
            f"{case['sigma_heading_rad']:g} rad",
            ("model", "noise", "relative / m", "slave / m"),
            [
                (
                    row["model"],
                    row["noise"],
                    f"{row['relative_rmse_m']['mean']:.2f}",
                    f"{row['slave_rmse_m']['mean']:.2f}",
                )
                for row in case["models"]
            ],
        )


command = command_of(
    measure,
    page,
    _shown,
    runs=options.PageRuns,
    seed=options.Seed,
    particles=Annotated[
        int,
        typer.Option("--particles", min=1, max=10_000, help="Particles of SLATF 2.0 and joint."),
    ],
    workers=options.Workers,
)
