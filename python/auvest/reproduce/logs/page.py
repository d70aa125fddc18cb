"""The page of ``auvest reproduce logs``."""

from __future__ import annotations

from auvest.replay import find_settings
from auvest.reproduce import markdown
from auvest.reproduce.logs import measure


def page(result: measure.Reproduction) -> str:
    """Return the Markdown page."""
    held = result.held()
    target_m = measure.TARGETS["hat_charles"].rmse_m
    best = max(result.compass, key=lambda row: row.log_likelihood)
    chosen = find_settings("hat_charles")
    confirmed = (best.sigma_heading_rad, best.sigma_turn) == (
        chosen.start.sigma_heading_rad,
        chosen.odometry.sigma_turn,
    )
    return markdown.page(
        __name__,
        measure=measure,
        kernel=measure.KERNEL.capitalize(),
        held=sum(held.values()),
        targets=len(held),
        kernels=", ".join(measure.KERNELS),
        sets=markdown.table(*measure.set_table(result)),
        walks=", ".join(f"{walk:.3f} over {t:g} s" for t, walk in result.heading_walk.items()),
        baseline=result.baseline_walk_rmse_m,
        compass_target=target_m,
        chosen=chosen,
        confirmed="as the table confirms" if confirmed else "but the table says otherwise",
        above=sum(row.rmse_m > target_m for row in result.compass),
        beliefs=len(result.compass),
        compass=_compass(result),
        tracking=markdown.table(*measure.tracking_table(result)),
    )


def _compass(result: measure.Reproduction) -> str:
    rows = []
    for heading in measure.COMPASS_RAD:
        cells = [
            f"{r.log_likelihood:.2f}, {r.rmse_m:.3f} m"
            for r in result.compass
            if r.sigma_heading_rad == heading
        ]
        rows.append([f"{heading:g}", *cells])
    return markdown.table(
        ("start / rad", *(f"{w:g} rad/sqrt(s)" for w in measure.COMPASS_WALK)), rows
    )
