"""The page of ``auvest reproduce mrclam6``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from auvest.reproduce import markdown
from auvest.reproduce.mrclam6 import measure
from auvest.reproduce.mrclam6.measure import CALIBRATION, MASTER, NAMES, Reproduction, summary


def page(result: Reproduction) -> str:
    """Return the Markdown page."""
    return page_of(summary(result))


def page_of(results: Mapping[str, Any]) -> str:
    """Return the Markdown page of a summary."""
    return markdown.page(
        __name__,
        **results,
        measure=measure,
        both="Both hold for the means over runs." if results["met"] else "Not both hold.",
        rows=markdown.rows(map(_row, results["filters"])),
        slatf=results["filters"][-1],
        turn_offset=-CALIBRATION[1][1],
        shares=markdown.series(MASTER.share, 1),
    )


def _row(row: Mapping[str, Any]) -> list[object]:
    names = ["slave_rmse_m", "ratio", "ratio_worst", "relative_rmse_m", "relative_rmse_worst_m"]
    names += ["ratio_of_track_means", "relative_track_mean_m"]
    mastered = row["filter"] != "dead_reckoning"
    cells = (
        f"{row[name]:.3f}" if mastered or not name.startswith("relative") else "" for name in names
    )
    return [NAMES[row["filter"]], row["runs"], *cells]
