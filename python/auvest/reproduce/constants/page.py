"""The page of ``auvest reproduce constants``."""

from __future__ import annotations

from auvest.reproduce import markdown
from auvest.reproduce.constants import measure, trials


def page(result: measure.Bench) -> str:
    """Return the Markdown page."""
    held = result.held()
    recordings = markdown.table(*measure.recording_table(result))
    return markdown.page(
        __name__,
        held=sum(held.values()),
        aims=len(held),
        runs=len(result.rows[0].off),
        sigma=trials.SIGMA_RANGE_M,
        detours=f"{100 * trials.DETOURS:.0f}",
        known=f"{100 * (measure.KNOWN - 1):.0f}",
        without=f"{100 * (measure.WITHOUT - 1):.0f}",
        share=f"{100 * measure.FOUND:.0f}",
        labyrinth=measure.LABYRINTH_M,
        trials=markdown.table(*measure.trial_table(result)),
        recordings=recordings if result.recordings else "Made without the recordings.",
    )
