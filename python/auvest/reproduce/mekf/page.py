"""The page of ``auvest reproduce mekf``: what was asked or claimed beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping

from auvest.reproduce import markdown
from auvest.reproduce.markdown import number, rows, table
from auvest.reproduce.mekf import measure
from auvest.reproduce.mekf.claims import claims

_KERNEL_NAMES = [measure.LABELS[name] for name in measure.KERNELS]


def page(result: measure.Reproduction) -> str:
    """Return the page."""
    judged = claims(result)
    worlds = {**{f"timing {kind}": row for kind, row in result.timing.items()}, **result.worlds}
    return markdown.page(
        __name__,
        result=result,
        measure=measure,
        claims=rows((c.where, c.claim, c.measured, c.verdict) for c in judged if not c.own),
        targets=rows((c.claim, c.measured, c.verdict) for c in judged if c.own),
        contamination=table(
            ("outliers", *_KERNEL_NAMES),
            [
                (f"{100 * key[0]:g} % at {key[1]:g} m", *_cells(row, measure.CONTAMINATION[key]))
                for key, row in result.contamination.items()
            ],
        ),
        worlds=table(
            ("world", *_KERNEL_NAMES), [(name, *_cells(row, {})) for name, row in worlds.items()]
        ),
        consistency=rows(map(_consistency, result.consistency)),
        displaced=rows(
            (name, *_displaced(d, result.displaced_runs)) for name, d in result.displaced.items()
        ),
    )


def _cells(row: Mapping[str, measure.Score], reference: Mapping[str, float]) -> list[str]:
    return [
        row[name].rmse.text(2) + (f" ({reference[name]:.2f})" if name in reference else "")
        for name in measure.KERNELS
    ]


def _consistency(j: measure.Judged) -> tuple[str, ...]:
    return (
        measure.LABELS[j.filter],
        f"{j.q_factor:g}",
        f"{j.r_factor:g}",
        f"{j.nees.mean:.2f}",
        f"{j.nees.low:.2f} .. {j.nees.high:.2f}",
        f"{100 * j.nees.steps_inside:.0f} %",
        f"{j.nis.mean:.3f}",
        f"{j.nis.low:.3f} .. {j.nis.high:.3f}",
        f"{100 * j.nis.steps_inside:.0f} %",
    )


def _displaced(d: measure.Displaced, runs: int) -> tuple[str, ...]:
    return (
        f"{d.back} of {runs}",
        "never" if d.slowest is None else f"{d.slowest}",
        f"{d.settled} of {runs}",
        number(d.median_end_m),
        number(d.rmse_end_m),
    )
