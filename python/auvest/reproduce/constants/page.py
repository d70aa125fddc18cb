"""The page of ``auvest reproduce constants``."""

from __future__ import annotations

from auvest.reproduce import markdown
from auvest.reproduce.constants import measure, trials


def page(result: measure.Bench) -> str:
    """Return the Markdown page."""
    held = result.held()
    there = bool(result.recordings)
    text = markdown.page(
        __name__,
        held=sum(held.values()),
        aims=len(held),
        runs=len(result.rows[0].off),
        sigma=trials.SIGMA_RANGE_M,
        detours=f"{100 * trials.DETOURS:.0f}",
        known=f"{100 * (measure.KNOWN - 1):.0f}",
        without=f"{100 * (measure.WITHOUT - 1):.0f}",
        share=f"{100 * measure.FOUND:.0f}",
        data=" --data DIR" * there,
        labyrinth=f"; labyrinth_uwb is at most {measure.LABYRINTH_M:g} m off" * there,
        trials=markdown.table(*measure.trial_table(result)),
        recordings=markdown.table(*measure.recording_table(result)),
    )
    return text if there else text.partition("\n## Recordings")[0]
