"""The page of ``auvest reproduce aukf``: every number on it comes from one Reproduction."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from auvest import MahalanobisInterval
from auvest.reproduce import markdown
from auvest.reproduce.aukf import measure
from auvest.reproduce.aukf.claims import (
    by_noise,
    claims,
    forgotten,
    paper_name,
    percent,
    signed,
    tau_limit,
)
from auvest.reproduce.aukf.measure import (
    WIDE_P0_SIGMA,
    Comparison,
    Loud,
    Reproduction,
    excess,
    excess_over_time,
    halves,
    intervals,
    raw_ratio,
    reaction,
    rmse,
)
from auvest.reproduce.claims import assumption_rows, claim_rows, tally
from auvest.reproduce.estimate import Estimate, Floats
from auvest.reproduce.markdown import number, rows, series, table
from auvest.simulation.paper_aukf import (
    ASSUMPTIONS,
    FIXED_INTERVAL_S,
    NOISE_KINDS,
    P0_SIGMA,
    TAU0_STUDIED,
    NoiseKind,
)

#: Steps at which the page lists the interval.
SHOWN_STEPS = (0, 1, 2, 4, 8, 15, 30, 59)
#: What an independent prototype gave there, means of 40 runs, s.
PROTOTYPE_S = (0.50, 0.48, 0.31, 0.38, 0.52, 0.57, 0.60, 0.60)
#: Speed of the vehicle at the start, squared, m^2/s^2.
SPEED_SQUARED = 0.05


def page(result: Reproduction) -> str:
    """README.md: figures, claims, assumptions and contradictions."""
    judged = claims(result)
    normal = result.noises["normal"]
    mean = intervals(normal.aukf).mean(axis=0)
    cases = result.noises.items()
    equal = {kind: excess_over_time(case.aukf, case.equal_rate) for kind, case in cases}
    more = {kind: excess(case.aukf, case.ukf) for kind, case in cases}
    law, table1 = MahalanobisInterval(), MahalanobisInterval("table1")
    tau = tau_limit(table1)
    literal = intervals(result.table1)
    distances = normal.aukf.mahalanobis_squared
    steady = law.epsilon / (1.5 + law.gamma2)
    like = sum(_like_figure3(case.interval_s) for case in result.loud)
    return markdown.page(
        __name__,
        result=result,
        measure=measure,
        law=law,
        table1=table1,
        noise=normal.noise,
        start_s=mean[0],
        dip_s=mean[:6].min(),
        settled_s=mean[-20:].mean(),
        ranking=_ranking(more),
        more=by_noise(more),
        ranking_at_equal_rate=_ranking(equal, "a UKF with as many samples in the same time"),
        more_at_samples=by_noise({k: excess(case.aukf, case.equal_rate) for k, case in cases}),
        more_over_time=by_noise(equal),
        claims=len(judged),
        tally=tally(judged),
        claim_rows=claim_rows(judged),
        ukf=halves(result.noises["uniform"].ukf),
        aukf=halves(result.noises["uniform"].aukf),
        shown_steps=", ".join(map(str, SHOWN_STEPS)),
        shown_pace=series(mean[list(SHOWN_STEPS)]),
        figures=rows(_figures(result)),
        errors=rows(_errors(result)),
        bias="; ".join(_bias(result)),
        float32_difference=number(result.float32_difference_m, 2),
        tau_limit=number(tau),
        interval_limit_s=tau * table1.max_s / (1 - (1 - tau) * table1.scale),
        limit_pace=series(_limit_pace(table1)),
        median_ratio=number(float(np.median(raw_ratio(normal.ukf, table1.gamma1_m2))), 2),
        table1_pace=series(literal.mean(axis=0)[:6]),
        table1_largest_s=literal[:, 4:].max(),
        table1_loud_pace=series(intervals(result.table1_loud).mean(axis=0)[:6]),
        distance_mean=np.nanmean(distances),
        distance_largest=np.nanmax(distances),
        pace=_pace(mean),
        stuck_s=1.5 * law.gamma1_m2 / SPEED_SQUARED,
        starts=rows(_starts(result)),
        known_start=_sigmas(P0_SIGMA),
        wide_start=_sigmas(WIDE_P0_SIGMA),
        loud=rows(_loud(result)),
        wide_collapsed=_collapsed(case for case in result.loud if case.wide_start),
        known_collapsed=_collapsed(case for case in result.loud if not case.wide_start),
        like_figure3=like or "None",
        loud_cases=len(result.loud),
        offsets=rows(
            (f"{one.offset_m:g}", f"{one.mahalanobis_squared:.3f}", f"{one.tau:.3f}")
            for one in result.offsets
        ),
        growths=_growths(result),
        growth_correlations=", ".join(
            f"{reaction(case.aukf).growth:.2f} ({kind})" for kind, case in cases
        ),
        steady_s=steady * law.ratio_max * law.max_s / (1 - (1 - steady) * law.scale),
        tau0=rows(
            (f"{value:g}", series(intervals(one).mean(axis=0)[:9]))
            for value, one in result.tau0.items()
        ),
        forgotten=forgotten(result),
        assumptions=assumption_rows(ASSUMPTIONS),
    )


def _figures(result: Reproduction) -> Iterator[tuple[object, ...]]:
    """Rows of Figs 4 to 10."""
    for figure, tau0 in enumerate(TAU0_STUDIED, start=4):
        one = result.tau0[tau0]
        pace = series(intervals(one).mean(axis=0)[[1, 2, 4, 8]])
        ours = f"RMSE {rmse(one).text(4)} m; T at steps 1, 2, 4, 8: {pace} s"
        yield figure, f"AUKF track, tau(0) = {tau0:g}", ours
    for figure, kind in enumerate(NOISE_KINDS, start=8):
        case = result.noises[kind]
        ukf, aukf = rmse(case.ukf, 0).value, rmse(case.aukf, 0).value
        paper = f"x error, {paper_name(kind)} noise: AUKF generally lower"
        yield figure, paper, f"rms x error: UKF {ukf:.4f} m, AUKF {aukf:.4f} m"


def _errors(result: Reproduction) -> Iterator[tuple[str, ...]]:
    for kind, case in result.noises.items():
        yield _error_row(kind, case)
    for kind, case in result.centred.items():
        yield _error_row(f"{kind}, bias removed", case)


def _error_row(name: str, case: Comparison) -> tuple[str, ...]:
    return (
        name,
        rmse(case.ukf).text(4),
        rmse(case.aukf).text(4),
        signed(excess(case.aukf, case.ukf)),
        rmse(case.equal_rate).text(4),
        signed(excess(case.aukf, case.equal_rate)),
        rmse(case.same_time).text(4),
        rmse(case.ekf).text(4),
        f"{intervals(case.aukf).mean():.3f}",
        f"{case.ukf.nees.mean():.2f}, {case.aukf.nees.mean():.2f}",
    )


def _bias(result: Reproduction) -> Iterator[str]:
    for kind, clean in result.centred.items():
        kept = result.noises[kind]
        mean = kept.noise.mean
        yield (
            f"{kind} {mean[0]:.3f} m and {mean[1]:.4f} rad make the UKF's RMSE "
            f"{rmse(kept.ukf).value / rmse(clean.ukf).value:.1f} times and the AUKF's "
            f"{rmse(kept.aukf).value / rmse(clean.aukf).value:.1f} times as large"
        )


def _limit_pace(law: MahalanobisInterval) -> list[float]:
    """T(0) to T(4) of Eq. (8) with M and, from T(2) on, tau at their largest, s."""
    pace, tau = [law.initial_s], law.tau0
    for _ in range(4):
        pace.append((1 - tau) * law.scale * pace[-1] + tau * law.ratio_max * law.max_s)
        tau = tau_limit(law)
    return pace


def _pace(mean: Floats) -> str:
    paces = [
        ("here", *(f"{value:.2f}" for value in mean[list(SHOWN_STEPS)])),
        ("prototype, 40 runs", *(f"{value:.2f}" for value in PROTOTYPE_S)),
    ]
    return table(("step", *map(str, SHOWN_STEPS)), paces)


def _starts(result: Reproduction) -> Iterator[tuple[str, ...]]:
    for s in result.starts:
        last = (f"{s.quiet_s:.3f}", f"{s.noisy_s:.3f}", percent(s.collapsed))
        yield f"{s.initial_s:g}", f"{s.min_s:g}", *last


def _loud(result: Reproduction) -> Iterator[tuple[str, ...]]:
    for case in result.loud:
        yield (
            case.noise.kind,
            f"{case.noise.range_m:g} m, {case.noise.bearing_rad:g} rad",
            "noise-sized" if case.wide_start else "known",
            series(case.interval_s[[4, 15, 30, 59]], 2),
            f"{case.interval_s[-20:].mean():.2f}",
            percent(case.collapsed),
        )


def _collapsed(cases: Iterable[Loud]) -> str:
    shares = [case.collapsed for case in cases]
    return f"{percent(min(shares))} to {percent(max(shares))}"


def _like_figure3(mean: Floats) -> bool:
    dips = bool((mean[:6] < FIXED_INTERVAL_S).any())
    rises = bool((mean[:16] > FIXED_INTERVAL_S).any())
    settles = bool((mean[-20:] > 0.55).all() and (mean[-20:] < 0.65).all())
    return dips and rises and settles


def _growths(result: Reproduction) -> str:
    sizes = [one.offset_m for one in result.growths if one.growth == result.growths[0].growth]
    cells = []
    for growth in dict.fromkeys(one.growth for one in result.growths):
        same = [one for one in result.growths if one.growth == growth]
        distances = [f"{one.mahalanobis_squared:.3f}" for one in same]
        cells.append((f"{growth:g}", *distances, f"{same[0].tau:.3f}"))
    header = ("error over that of the step before", *(f"d^2, e = {e:g} m" for e in sizes), "tau")
    return table(header, cells)


def _ranking(excesses: dict[NoiseKind, Estimate], rival: str = "the UKF") -> str:
    below = [one.below_zero for one in excesses.values()]
    if all(below):
        size = max(-one.value for one in excesses.values())
        return f"The AUKF beats {rival}, by at most {percent(size)}."
    if any(below):
        return f"The AUKF beats {rival} under some noises only."
    return f"The AUKF does not beat {rival}."


def _sigmas(sigma: tuple[float, float, float]) -> str:
    return f"{sigma[0]:g} m, {sigma[1]:g} m/s, {sigma[2]:g} m/s^2"
