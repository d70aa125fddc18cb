"""The page of ``auvest reproduce calibration``."""

from __future__ import annotations

from auvest.reproduce import markdown
from auvest.reproduce.calibration import measure


def page(result: measure.Bench) -> str:
    """Return the Markdown page."""
    held = result.held()
    return markdown.page(
        __name__,
        held=sum(held.values()),
        aims=len(held),
        settings=len(result.rows),
        most=max(row.replays for row in result.rows),
        slowest_s=max(row.processor_s for row in result.rows),
        inside=f"{100 * measure.INSIDE:.0f}",
        sigma=measure.SIGMA,
        table=markdown.table(*measure.rmse_table(result)),
    )
