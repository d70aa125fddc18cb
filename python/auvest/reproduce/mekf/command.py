"""``auvest reproduce mekf``: the M-estimation EKF paper beside what we measure.

Range-only cooperative localisation with outliers: EKF, IGG, Huber and Hampel over contamination,
message timing and kinds of noise; consistency; lock-out. Writes the figures as PNG and CSV, a page
README.md and results.json.

Examples
--------
  auvest reproduce mekf

  auvest reproduce mekf --runs 10 --output results

  auvest reproduce mekf --json --quiet | jq .contamination
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.mekf import claims, measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    judged = claims.claims(result)
    for title, own in (("Claims of the paper", False), ("Targets of this project", True)):
        yield table(
            title,
            ("where", "claim", "measured", ""),
            [(one.where, one.claim, one.measured, one.verdict) for one in judged if one.own == own],
        )
    yield table(
        "RMSE / m over contamination",
        ("outliers", *measure.KERNELS),
        [
            (
                f"{100 * fraction:g} % at {sigma:g} m",
                *(row[name].rmse.text(3) for name in measure.KERNELS),
            )
            for (fraction, sigma), row in result.contamination.items()
        ],
        right=range(1, 1 + len(measure.KERNELS)),
    )


command = command_of(
    measure,
    page,
    _shown,
    claims=claims,
    runs=Annotated[
        int, typer.Option("--runs", min=2, max=500, help="Monte Carlo runs of each world.")
    ],
    seed=options.Seed,
    workers=options.Workers,
)
