"""The page of ``auvest reproduce slatf``: every number on it comes from one Reproduction."""

from __future__ import annotations

from collections.abc import Iterator

from auvest.reproduce import markdown
from auvest.reproduce.claims import assumption_rows, claim_rows, tally
from auvest.reproduce.markdown import table
from auvest.reproduce.slatf import measure
from auvest.reproduce.slatf.claims import (
    TABLE1,
    apart,
    at,
    claims,
    paper_best,
    paper_dr,
    span,
    where,
)
from auvest.simulation.paper_slatf import ASSUMPTIONS, FILTERS, LEVELS, FilterName, Level

_COMPARED: tuple[FilterName, ...] = ("slatf1", "slatf2", "ekf_slat")


def page(result: measure.Reproduction) -> str:
    """README.md: table, figures, claims, sensitivity and assumptions."""
    judged = claims(result)
    rows = [{name: at(result, level, name).value for name in FILTERS} for level in LEVELS]
    dr, compensated = ([row[name] for row in rows] for name in measure.DEAF)
    two = [row["slatf2"] for row in rows]
    many = next(one for one in result.variants if one.what == f"N = {measure.MANY}")
    return markdown.page(
        __name__,
        result=result,
        dr=span(dr),
        paper_dr=paper_dr(),
        one_at_1=at(result, LEVELS[0], "slatf1"),
        one_at_7=at(result, LEVELS[6], "slatf1"),
        two_least=min(two),
        two_most=max(two),
        paper_best=paper_best(),
        two_at_best=at(result, measure.BEST_LEVEL, "slatf2").text(1),
        ekf_at_best=at(result, measure.BEST_LEVEL, "ekf_slat").text(1),
        compensated=span(compensated),
        one_beats=where([apart(result, level, "slatf1", "dr_compensated") for level in TABLE1]),
        joint_ratio=max(row["slatf_joint"] / row["ekf_slat"] for row in rows),
        two_ratio=max(row["slatf2"] / row["ekf_slat"] for row in rows),
        ekf_best=sum(row["ekf_slat"] == min(row.values()) for row in rows),
        levels=len(LEVELS),
        claims=len(judged),
        tally=tally(judged),
        table1=table(("level", "noise", *FILTERS.values()), _table1(result)),
        best_level=measure.BEST_LEVEL.number,
        many=many,
        two_with_many=many.rmse["slatf2"].text(1),
        told="; ".join(_told(result)),
        mean_and_variance=table(
            ("level", *FILTERS.values()),
            [
                [level.number, *(_mean_and_variance(result, level, name) for name in FILTERS)]
                for level in LEVELS
            ],
        ),
        claim_rows=claim_rows(judged),
        sensitivity=table(
            ("changed", *(FILTERS[name] for name in _COMPARED)),
            [
                [one.what, *(one.rmse[n].text(1) if n in one.rmse else "" for n in _COMPARED)]
                for one in result.variants
            ],
        ),
        assumptions=assumption_rows(ASSUMPTIONS),
    )


def _table1(result: measure.Reproduction) -> Iterator[list[str]]:
    for level in LEVELS:
        cells = [f"{level.number}", f"{level.sigma_range_m:g} m, {level.sigma_bearing_rad:g} rad"]
        for name in FILTERS:
            paper = level.paper.get(name) if level.paper else None
            printed = "" if paper is None else f", *{paper:.1f}*"
            cells.append(at(result, level, name).text(1) + printed)
        yield cells


def _told(result: measure.Reproduction) -> Iterator[str]:
    for one in result.variants:
        if "velocity told" in one.what:
            ekf, two = one.rmse["ekf_slat"].text(1), one.rmse["slatf2"].text(1)
            yield f"{one.what}: {ekf} m (EKF-SLAT), {two} m (2.0)"


def _mean_and_variance(result: measure.Reproduction, level: Level, name: FilterName) -> str:
    one = result.levels[level.number][name]
    return f"{measure.mean_error(one):.1f}; {measure.error_variance(one):.0f}"
