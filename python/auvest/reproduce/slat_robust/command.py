"""``auvest reproduce slat-robust``: SLAT filters that know how far off they are, and come back.

SlatfJoint with one covariance beside EKF-SLAT: consistent at every noise level and over hours,
with wrong echoes, with a master lost in a silence and, with --data, on real robots. Writes a page
README.md and results.json.

Examples
--------
  auvest reproduce slat-robust --data recordings

  auvest reproduce slat-robust --runs 20 --json --quiet | jq '.lock_out'
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.slat_robust import measure, page


def _shown(robust: measure.Robust) -> Iterator[Table]:
    yield table(
        "SlatfJoint with one covariance",
        ("level", "RMSE / m", "of EKF-SLAT", "NEES", "covered"),
        [
            (
                str(row["number"]),
                f"{row['filters']['slatf_joint']['rmse_m']:.1f}",
                f"{row['ratio']:.3f}",
                f"{row['filters']['slatf_joint']['nees']:.2f}",
                f"{100 * row['filters']['slatf_joint']['covered']:.0f} %",
            )
            for row in robust.results["levels"]
        ],
    )


command = command_of(
    measure,
    page,
    _shown,
    figures=False,
    runs=Annotated[int, typer.Option("--runs", min=8, max=100_000, help="Monte Carlo runs.")],
    seed=options.Seed,
    data=Annotated[
        Path | None,
        typer.Option("--data", help="Folder of the recordings; without it no real robots."),
    ],
    workers=options.Workers,
)
