"""``auvest reproduce vehicle``: what a filter in the loop is worth to a vehicle that steers itself.

The closed-loop table of a torpedo on two tracks beside the values of an independent prototype, the
values without any random number, consistency, and what each interval policy costs. Writes a page
README.md, pictures and results.json.

Examples
--------
  auvest reproduce vehicle

  auvest reproduce vehicle --runs 10 --json --quiet | jq '.closed_loop[0]'
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.vehicle import measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    for track in ("lawnmower", "circle"):
        yield table(
            f"{track}: cross-track RMS, m",
            ("position from", "T / s", "settled", "prototype", "position"),
            [
                (
                    page.label(row),
                    f"{row.mean_interval_s:.2f}",
                    row.settled.text(3),
                    page.reference(row),
                    f"{row.position.value:.2f}",
                )
                for row in result.rows
                if row.track == track
            ],
            right={1, 2, 3, 4},
        )


command = command_of(
    measure,
    page,
    _shown,
    runs=options.PageRuns,
    seed=options.Seed,
    workers=options.Workers,
)
