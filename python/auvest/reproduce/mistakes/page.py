"""The page of ``auvest reproduce mistakes``."""

from __future__ import annotations

from auvest.reproduce import markdown
from auvest.reproduce.mistakes import measure
from auvest.reproduce.mistakes.injected import MISTAKES


def page(result: measure.Bench) -> str:
    """Return the Markdown page."""
    held = result.held()
    recordings = markdown.table(*measure.recording_table(result))
    return markdown.page(
        __name__,
        mistakes=len(MISTAKES),
        held=sum(held.values()),
        aims=len(held),
        target=f"{100 * measure.TARGET:.0f}",
        table=markdown.table(*measure.mistake_table(result)),
        recordings=recordings if result.recordings else "Made without the recordings.",
    )
