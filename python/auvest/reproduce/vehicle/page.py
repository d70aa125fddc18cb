"""The page of ``auvest reproduce vehicle``."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan

from auvest.reproduce import markdown
from auvest.reproduce.markdown import rows
from auvest.reproduce.vehicle import measure


def page(result: measure.Reproduction) -> str:
    """Return the page."""
    distances = [
        distance
        for row in result.rows
        for name in ("settled", "all", "position")
        if not isnan(distance := row.distance(name))
    ]
    near = sum(distance <= 2 for distance in distances)
    free = [check for check in result.checks if check.name.startswith("settled")]
    by_name = {(row.source, row.track, row.interval_s): row for row in result.rows}
    clean = by_name["robust_model_aided", "lawnmower", 0.5].settled.value
    dirty = by_name["robust_model_aided_outliers", "lawnmower", 0.5].settled.value
    adaptive = [row for row in result.rows if row.source in measure.POLICIES]
    fixed = [by_name["ukf", row.track, row.interval_s] for row in adaptive]
    better = [a.settled.value < b.settled.value for a, b in zip(adaptive, fixed, strict=True)]
    return markdown.page(
        __name__,
        result=result,
        measure=measure,
        lawnmower=_table(result, "lawnmower"),
        circle=_table(result, "circle"),
        compared=len(distances),
        near=near,
        share=100 * near / len(distances),
        farthest=max(distances),
        checks=rows(
            (check.name, f"{check.value:.5f}", f"{check.expected:.5f}", "yes" if check.ok else "no")
            for check in free
        ),
        checked=len(free),
        tolerance=measure.NOISE_FREE_TOLERANCE_M,
        held=sum(check.ok for check in free),
        runs_table=rows(_reference_rows(result)),
        digits=len(result.checks) - len(free),
        digits_held=sum(check.ok for check in result.checks) - sum(check.ok for check in free),
        better=sum(better),
        policies=len(better),
        robust=100 * (dirty / clean - 1),
        consistency=rows(
            (
                f"{c.bias_deg:g}",
                f"{c.model_position:g}",
                f"{c.current_walk:g}",
                f"{c.nees_position:.2f}",
                f"{100 * c.nees_position_inside:.0f} %",
                f"{c.nees:.2f}",
                f"{100 * c.nees_inside:.0f} %",
                f"{c.nis:.2f}",
                f"{100 * c.nis_inside:.0f} %",
            )
            for c in result.consistency
        ),
        energy=rows(
            (
                e.policy,
                e.track,
                f"{e.position_m:.2f}",
                f"{e.mean_interval_s:.3f}",
                f"{e.fixed_s:.3f}",
                f"{e.charge_mah_h:.1f}",
                f"{e.fixed_charge_mah_h:.1f}",
                f"{e.quiet_interval_s:.3f}",
                f"{e.busy_interval_s:.3f}",
            )
            for e in result.energy
        ),
        assumptions=rows((what, f"{value:g}") for _, what, value in measure.ASSUMPTIONS),
    )


def reference(row: measure.Row, name: str = "settled") -> str:
    """Print what the prototype gave."""
    known = row.reference
    if known is None or isnan(known[name][0]):
        return "-"
    value, error = known[name]
    return f"{value:.3f}" if isnan(error) else f"{value:.3f} ± {error:.3f}"


def _reference_rows(result: measure.Reproduction) -> Iterator[tuple[str, ...]]:
    for name, run in measure.reference_runs().items():
        mine = [check for check in result.checks if check.name.startswith(f"{name}, ")]
        last = mine[-12:]
        places = ", ".join(f"{check.value:.3f}" for check in last[:3])
        wanted = ", ".join(f"{check.expected:.3f}" for check in last[:3])
        held = f"{sum(check.ok for check in mine)} of {len(mine)}"
        time = run["rows"][-1][0]
        yield (name, run["vehicle"], run["what"], f"{time} s", places, wanted, held)


def label(row: measure.Row) -> str:
    """Name a row, with what it does not share with the others."""
    prototype = row.model_position == measure.PROTOTYPE_POSITION
    return row.source + (", Q of the prototype" if prototype else "")


def _table(result: measure.Reproduction, track: str) -> str:
    return rows(
        (
            label(row),
            f"{row.mean_interval_s:.2f}" if row.mean_interval_s > 0 else "-",
            row.settled.text(3),
            reference(row),
            row.all.text(2),
            reference(row, "all"),
            row.position.text(2),
            reference(row, "position"),
            f"{row.rudder_deg_s:.1f}",
        )
        for row in result.rows
        if row.track == track
    )
