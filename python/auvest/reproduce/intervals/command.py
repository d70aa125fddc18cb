"""``auvest reproduce intervals``: the interval policies side by side at equal sampling rate.

For near and far, straight and turning tracks and three noises: RMSE and time above the error budget
of the covariance budget, the fixed interval and the paper's law. Writes a page README.md, a picture
and results.json.

Examples
--------
  auvest reproduce intervals

  auvest reproduce intervals --runs 50 --json --quiet | jq '.cases[0]'
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.intervals import measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    rows = []
    for case in result.cases:
        figures = [case.policies[name] for name in ("budget", "fixed", "law")]
        rows.append(
            (
                case.track,
                case.noise,
                f"{measure.BUDGET_SIGMAS * case.sigma_m:.2f}",
                f"{figures[0].interval_s:.3f}",
                " | ".join(f"{f.rmse_m:.3f}" for f in figures),
                " | ".join(f"{100 * f.above:.1f}" for f in figures),
                "yes" if case.dominates else "no",
            )
        )
    yield table(
        "At equal sampling rate: covariance budget | fixed interval | the paper's law",
        ("track", "noise", "budget / m", "T / s", "RMSE / m", "above / %", "dominates"),
        rows,
    )


command = command_of(
    measure,
    page,
    _shown,
    runs=options.PageRuns,
    seed=options.Seed,
    workers=options.Workers,
)
