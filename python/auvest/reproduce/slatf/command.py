"""``auvest reproduce slatf``: the SLATF paper's table, figures and claims beside ours.

Writes each figure as PNG and CSV, a page README.md that sets the paper's table, figures and claims
beside what was measured, with all assumptions, and results.json.

Examples
--------
  auvest reproduce slatf

  auvest reproduce slatf --runs 200 --output results

  auvest reproduce slatf --json --quiet | jq '.table1[] | [.level, .slatf1, .slatf2]'
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.slatf import claims, measure, page
from auvest.simulation.paper_aukf import DTypeName
from auvest.simulation.paper_slatf import FilterName

#: Short, so that the table fits into 80 columns.
_HEADS: Mapping[FilterName, str] = {
    "dr": "DR",
    "dr_compensated": "no bias",
    "slatf1": "SLATF 1.0",
    "slatf2": "SLATF 2.0",
    "slatf_joint": "joint",
    "ekf_slat": "EKF",
}


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    rows = []
    for row in measure.table1(result):
        paper = row["paper"] or {}
        cells = (
            f"{row[name]:.1f}" + (f" ({paper[name]:.0f})" if name in paper else "")
            for name in _HEADS
        )
        noise = f"{row['sigma_r']:g} m, {row['sigma_theta']:g}"
        rows.append((str(row["level"]), noise, *cells))
    made = table(
        f"RMSE of the slave's position / m, {result.runs} runs, "
        f"N = {result.particles} (the paper's in brackets)",
        ("level", "noise", *_HEADS.values()),
        rows,
        right=range(2, 2 + len(_HEADS)),
    )
    for column in made.columns[2:]:
        column.no_wrap = True
    yield made


command = command_of(
    measure,
    page,
    _shown,
    claims=claims,
    runs=options.PageRuns,
    particles=Annotated[
        int, typer.Option(min=1, max=100_000, help="N of SLATF 1.0, 2.0 and joint.")
    ],
    dtype=Annotated[
        DTypeName,
        typer.Option(help="Precision; float32 gives the bits of the vehicle and is faster."),
    ],
    seed=options.Seed,
    workers=options.Workers,
)
