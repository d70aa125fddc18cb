"""The claims of the SLATF paper about its simulation, judged by what we measure.

Every number comes from one :class:`auvest.reproduce.slatf.measure.Reproduction`; the verdicts
follow from the numbers by the rules written here.
"""

from __future__ import annotations

from collections.abc import Iterable

from auvest.reproduce.claims import Claim, Claims, graded, settled
from auvest.reproduce.estimate import Estimate, all_below_zero
from auvest.reproduce.slatf.measure import (
    BEST_LEVEL,
    FIG6_LEVELS,
    Reproduction,
    difference,
    rms_per_ping,
    rmse,
)
from auvest.simulation.paper_slatf import FILTERS, LEVELS, FilterName, Level

#: Levels of Table 1, from loud to precise.
TABLE1 = LEVELS[:4]


_claim = Claims(__name__, Claim)


def claims(result: Reproduction) -> list[Claim]:
    """Every claim that the paper's text makes about the simulation, judged."""
    judged = [
        _dead_reckoning(result),
        _beaten(result, "slatf1"),
        _beaten(result, "slatf2"),
        _two_beats_one(result),
        _one_degrades(result),
        _two_does_not(result),
        _diverges(result),
        _values(result, "slatf1"),
        _values(result, "slatf2"),
        _best(result),
    ]
    return settled(judged, result.runs)


def _dead_reckoning(result: Reproduction) -> Claim:
    rows = [(at(result, level, "dr"), level.paper["dr"]) for level in TABLE1 if level.paper]
    near = [_near(ours, printed) for ours, printed in rows]
    return _claim(
        "dead_reckoning",
        graded(all(near), partly=any(near)),
        paper=", ".join(f"{printed:.1f} m" for _, printed in rows),
        ours=_each(ours for ours, _ in rows),
        compensated=_each(at(result, level, "dr_compensated") for level in TABLE1),
    )


def _beaten(result: Reproduction, name: FilterName) -> Claim:
    plain, fair = (
        [apart(result, level, name, rival) for level in TABLE1]
        for rival in ("dr", "dr_compensated")
    )
    return _claim(
        "beaten",
        graded(all_below_zero(fair), partly=all_below_zero(plain)),
        name=FILTERS[name],
        gain=span(-one.value for one in plain),
        fair=where(fair),
    )


def _two_beats_one(result: Reproduction) -> Claim:
    less = [apart(result, level, "slatf2", "slatf1") for level in TABLE1]
    verdict = graded(all_below_zero(less), partly=all_below_zero(less[2:]))
    return _claim("two_beats_one", verdict, less=_each(less))


def _one_degrades(result: Reproduction) -> Claim:
    first, fourth, last = (
        at(result, level, "slatf1") for level in (LEVELS[0], BEST_LEVEL, LEVELS[6])
    )
    return _claim(
        "one_degrades",
        graded(fourth.value - first.value > 2 * _joint(first, fourth)),
        first=first.text(1),
        fourth=fourth.text(1),
        last=last.text(1),
    )


def _two_does_not(result: Reproduction) -> Claim:
    row = [at(result, LEVELS[n - 1], "slatf2") for n in FIG6_LEVELS]
    gap = row[-1].value - row[0].value
    return _claim(
        "two_does_not",
        graded(gap < -2 * _joint(row[0], row[-1]), partly=gap < 0.2 * row[0].value),
        levels=", ".join(map(str, FIG6_LEVELS)),
        rmse=", ".join(one.text(1) for one in row),
    )


def _diverges(result: Reproduction) -> Claim:
    row = {
        name: [float(rms_per_ping(result.levels[level.number][name])[-1]) for level in TABLE1]
        for name in ("slatf1", "slatf2", "dr_compensated")
    }
    end = {name: errors[TABLE1.index(BEST_LEVEL)] for name, errors in row.items()}
    worst = end["slatf1"] > sorted(row["slatf1"] + row["slatf2"])[-2]
    verdict = graded(worst and end["slatf1"] > end["dr_compensated"], partly=worst)
    return _claim("diverges", verdict, **end)


def _values(result: Reproduction, name: FilterName) -> Claim:
    pairs = [
        (level.number, at(result, level, name), level.paper[name])
        for level in TABLE1
        if level.paper and not (level is BEST_LEVEL and name == "slatf2")
    ]
    near = [_near(ours, paper) for _, ours, paper in pairs]
    return _claim(
        "values",
        graded(all(near), partly=any(near)),
        name=FILTERS[name],
        paper=", ".join(f"{paper:.1f} m (level {n})" for n, _, paper in pairs),
        ours=", ".join(f"{ours.text(1)} m ({n})" for n, ours, _ in pairs),
        near=sum(near),
        count=len(near),
    )


def _best(result: Reproduction) -> Claim:
    ours = at(result, BEST_LEVEL, "slatf2")
    return _claim(
        "best",
        graded(_near(ours, paper_best())),
        paper=paper_best(),
        ours=ours.text(1),
        particles=result.particles,
        joint=at(result, BEST_LEVEL, "ekf_slat").text(1),
    )


# Words and comparisons.


def _each(estimates: Iterable[Estimate]) -> str:
    return ", ".join(f"{one.text(1)} m" for one in estimates)


def at(result: Reproduction, level: Level, name: FilterName) -> Estimate:
    """RMSE of a filter at a level, m."""
    return rmse(result.levels[level.number][name])


def apart(result: Reproduction, level: Level, name: FilterName, rival: FilterName) -> Estimate:
    """RMSE of a filter less that of its rival, m."""
    row = result.levels[level.number]
    return difference(row[name], row[rival])


def paper_dr() -> str:
    """RMSE of dead reckoning in the paper, m."""
    printed = [level.paper["dr"] for level in TABLE1 if level.paper]
    return span(printed)


def paper_best() -> float:
    """RMSE of 2.0 at level 4 in the paper, m."""
    assert BEST_LEVEL.paper is not None
    return BEST_LEVEL.paper["slatf2"]


def _joint(a: Estimate, b: Estimate) -> float:
    return float((a.standard_error**2 + b.standard_error**2) ** 0.5)


def _near(ours: Estimate, paper: float) -> bool:
    """Tell whether they agree within 3 standard errors and 5 %."""
    return abs(ours.value - paper) <= 3 * ours.standard_error + 0.05 * paper


def where(less: list[Estimate]) -> str:
    """Say at which levels of Table 1 a filter is ahead."""
    ahead = [level for level, one in zip(TABLE1, less, strict=True) if one.below_zero]
    if not ahead:
        return "no level"
    if len(ahead) == len(TABLE1):
        return "all four levels"
    return f"levels {', '.join(str(level.number) for level in ahead)} only"


def span(values: Iterable[float]) -> str:
    """Print the least and the largest value."""
    listed = list(values)
    return f"{min(listed):.0f} to {max(listed):.0f}"
