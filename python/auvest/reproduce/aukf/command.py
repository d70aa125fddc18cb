"""``auvest reproduce aukf``: the AUKF paper's figures and claims beside what we measure.

Writes each figure as PNG and CSV, a page README.md that sets the paper's figures and claims beside
what was measured, with all assumptions and contradictions, and results.json.

Examples
--------
  auvest reproduce aukf

  auvest reproduce aukf --runs 40 --output results

  auvest reproduce aukf --json --quiet | jq .figure3.interval_s
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.aukf import claims, measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    judged = [(one.where, one.paper, one.verdict) for one in claims.claims(result)]
    yield table("Claims of the paper", ("where", "the paper", "verdict"), judged)


command = command_of(
    measure,
    page,
    _shown,
    claims=claims,
    runs=options.PageRuns,
    seed=options.Seed,
    workers=options.Workers,
)
