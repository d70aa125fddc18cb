"""The page of ``auvest reproduce intervals``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from auvest import RangeBearing
from auvest.reproduce import markdown
from auvest.reproduce.intervals import measure


def page(result: measure.Reproduction) -> str:
    """Return the Markdown page."""
    cases = result.cases
    won = [case for case in cases if case.dominates]
    calm = [case for case in cases if case.noise != "lognormal"]
    figures = [figures for case in cases for figures in case.policies.values()]
    errors = [100 * one.above_error for one in figures]
    return markdown.page(
        __name__,
        result=result,
        measure=measure,
        tracks="; ".join(f"{n} (from {_pair(t.position)} m)" for n, t in measure.TRACKS.items()),
        station=_pair(RangeBearing().station),
        near=_ranges("near"),
        far=_ranges("far"),
        level=100 * measure.LEVEL,
        won=len(won),
        points=len(cases),
        calm_won=sum(case.dominates for case in calm),
        calm=len(calm),
        against_fixed=sum(c.policies["budget"].above < c.policies["fixed"].above for c in cases),
        clearly=sum(case.clearly_less for case in won),
        others=_counted(case.track for case in won if not case.clearly_less),
        cases=_table(cases),
        above_errors=f"{min(errors):.1f} to {max(errors):.1f}",
        worst_rate=_worst_rate(cases),
    )


def _table(cases: Iterable[measure.Case]) -> str:
    header = ["track", "noise", "budget / m", "T / s"]
    header += [f"RMSE / m, {name}" for name in measure.NAMES.values()]
    header += [f"above / %, {name}" for name in measure.NAMES.values()]
    header += ["dominates"]
    rows = [
        [
            case.track,
            case.noise,
            f"{measure.BUDGET_SIGMAS * case.sigma_m:.2f}",
            f"{case.policies['budget'].interval_s:.3f}",
            *(f"{case.policies[name].rmse_m:.3f}" for name in measure.POLICIES),
            *(f"{100 * case.policies[name].above:.1f}" for name in measure.POLICIES),
            "yes" if case.dominates else f"no: {_why_not(case)}",
        ]
        for case in cases
    ]
    return markdown.table(header, rows)


def _counted(names: Iterable[str]) -> str:
    counts = Counter(names)
    return "; ".join(f"{name} ({count})" for name, count in counts.items()) or "none"


def _pair(values: tuple[float, float]) -> str:
    return f"({values[0]:g}, {values[1]:g})"


def _ranges(prefix: str) -> str:
    """Give the shortest and the longest range of the tracks so called."""
    ranges = []
    for name, track in measure.TRACKS.items():
        if name.startswith(prefix):
            for second in range(round(measure.DURATION_S) + 1):
                ranges.append(RangeBearing().h([*track.position_at(second), 0, 0, 0, 0])[0])
    return f"{min(ranges):.0f} to {max(ranges):.0f}"


def _worst_rate(cases: list[measure.Case]) -> float:
    return max(
        100 * abs(f.interval_s / case.policies["budget"].interval_s - 1)
        for case in cases
        for f in case.policies.values()
    )


def _why_not(case: measure.Case) -> str:
    reasons = []
    if case.rmse_ratio > 1 + measure.LEVEL:
        reasons.append(f"RMSE +{100 * (case.rmse_ratio - 1):.1f} %")
    for name in ("fixed", "law"):
        rival, own = case.policies[name], case.policies["budget"]
        if own.above >= rival.above:
            reasons.append(f"time above {100 * own.above:.1f} against {100 * rival.above:.1f} %")
    return ", ".join(reasons)
