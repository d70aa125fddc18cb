"""The claims of the AUKF paper about its simulation, judged by what we measure.

Every number comes from one :class:`auvest.reproduce.aukf.measure.Reproduction`; the verdicts follow
from the numbers by the rules written here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from auvest import MahalanobisInterval
from auvest.reproduce.aukf.measure import (
    Reproduction,
    excess,
    excess_over_time,
    halves,
    intervals,
    raw_ratio,
    reaction,
    rms_per_step,
    rmse,
    roughness,
)
from auvest.reproduce.claims import NO, PARTLY, YES, Claim, Claims, graded, settled
from auvest.reproduce.estimate import Estimate, all_below_zero
from auvest.reproduce.markdown import number, series
from auvest.simulation.paper_aukf import FIXED_INTERVAL_S, NOISE_KINDS, STEPS, NoiseKind

# Verdicts besides those of every paper.
PRESET = "reproduced with preset figure3; contradicts Table 1"
CONTRADICTED = "contradicted by the paper's own equations"
UNDEFINED = "cannot be judged: not stated"

_claim = Claims(__name__, Claim)


def claims(result: Reproduction) -> list[Claim]:
    """Every claim of the paper that its text makes about the simulation, judged."""
    judged = [
        *_introduction(result),
        *_law_claims(result),
        *_track_claims(result),
        *_interval_claims(result),
        *_tau0_claims(result),
        *_error_claims(result),
    ]
    return settled(judged, result.runs)


def _introduction(result: Reproduction) -> Iterator[Claim]:
    cases = result.noises.items()
    worst = max(abs(rmse(case.ekf).value / rmse(case.ukf).value - 1) for _, case in cases)
    yield _claim("ekf", NO if worst < 0.02 else YES, worst=percent(worst))
    even = {kind: excess_over_time(case.aukf, case.equal_rate) for kind, case in cases}
    yield _claim("adapting", _small(even), excesses=by_noise(even))


def _law_claims(result: Reproduction) -> Iterator[Claim]:
    law, table1 = MahalanobisInterval(), MahalanobisInterval("table1")
    normal = result.noises["normal"]
    ratio = raw_ratio(normal.aukf, law.gamma1_m2)
    yield _claim(
        "ratio",
        CONTRADICTED,
        above_limit=_share(ratio > 0.9),
        above_1=_share(ratio > 1),
        table1=table1,
        median=number(float(np.median(raw_ratio(normal.ukf, table1.gamma1_m2))), 2),
    )
    raw_tau = law.epsilon / (normal.aukf.mahalanobis_squared + law.gamma2)
    yield _claim("tau", PARTLY, limit=number(tau_limit(table1)), above_1=_share(raw_tau > 1))
    distances = [one.mahalanobis_squared for one in result.offsets]
    yield _claim("distance", CONTRADICTED, least=min(distances), most=max(distances))


def _track_claims(result: Reproduction) -> Iterator[Claim]:
    case = result.noises["uniform"]
    ukf, aukf = halves(case.ukf), halves(case.aukf)
    yield _claim("ukf_track", graded(partly=ukf[1] > ukf[0]), ukf=ukf)
    yield _claim("aukf_track", graded(aukf[1] > aukf[0]), aukf=aukf)
    more = excess(case.aukf, case.ukf)
    yield _claim(
        "tracking_error",
        graded(more.below_zero),
        steps=STEPS,
        ukf=rmse(case.ukf).text(4),
        aukf=rmse(case.aukf).text(4),
        more=signed(more),
    )
    smooth = [1e3 * roughness(one) for one in (case.aukf, case.ukf, case.equal_rate)]
    yield _claim("smoothness", graded(smooth[0] < min(smooth[1:])), mm=smooth)
    largest = np.sqrt(np.square(case.aukf.error).sum(axis=-1)).max()
    yield _claim("acceptable", UNDEFINED, largest=largest, range=case.aukf.z[..., 0].max())


def _interval_claims(result: Reproduction) -> Iterator[Claim]:
    case = result.noises["normal"]
    mean = intervals(case.aukf).mean(axis=0)
    literal = intervals(result.table1)
    first, last = mean[:6], mean[-20:]
    yield _claim(
        "first_interval",
        PRESET if first.min() < FIXED_INTERVAL_S else NO,
        runs=result.runs,
        lowest=first.min(),
        step=first.argmin(),
        table1=series(literal.mean(axis=0)[:5]),
    )
    above = mean > FIXED_INTERVAL_S
    yield _claim(
        "last_interval",
        PRESET if above.any() and last.max() - last.min() < 0.1 else NO,
        above=above.argmax() if above.any() else None,
        last=(last.min(), last.max()),
        jumps=np.percentile(intervals(case.aukf)[:, -20:], (5, 95)),
        table1=literal[:, 4:].max(),
    )
    yield _claim(
        "mostly_above", PRESET if above.mean() > 0.5 else NO, above=above.sum(), steps=STEPS
    )
    ukf, aukf = (np.abs(one.error).sum(axis=-1).sum(axis=1).mean() for one in (case.ukf, case.aukf))
    yield _claim("feedback", graded(aukf < ukf), steps=STEPS, ukf=ukf, aukf=aukf)
    follows = {kind: reaction(one.aukf) for kind, one in result.noises.items()}
    yield _claim(
        "reaction",
        graded(partly=all(one.error < 0 for one in follows.values())),
        error=", ".join(f"{one.error:.2f} ({kind})" for kind, one in follows.items()),
        previous=", ".join(f"{one.previous:.2f}" for one in follows.values()),
    )
    rate, fixed = 1 / float(mean.mean()), 1 / FIXED_INTERVAL_S
    saved = 1 - rate * FIXED_INTERVAL_S
    yield _claim(
        "energy",
        PRESET if saved > 0 else NO,
        rate=rate,
        fixed=fixed,
        saved=percent(saved),
        interval=mean.mean(),
    )


def _tau0_claims(result: Reproduction) -> Iterator[Claim]:
    reference = result.noises["normal"].ukf.truth[:, -1].mean(axis=0)
    shift = {
        tau0: float(np.hypot(*(one.truth[:, -1].mean(axis=0) - reference)))
        for tau0, one in result.tau0.items()
    }
    shifts = ", ".join(f"{value:.2f} m ({tau0:g})" for tau0, value in shift.items())
    yield _claim("tau0_shift", PARTLY, shifts=shifts)
    nearest = min(shift, key=lambda tau0: shift[tau0])
    yield _claim("tau0_closest", graded(nearest in (0.3, 0.5)), nearest=nearest)
    errors = {tau0: rmse(one) for tau0, one in result.tau0.items()}
    best = min(errors, key=lambda tau0: errors[tau0].value)
    apart = f", 0.5 is {signed(excess(result.tau0[0.5], result.tau0[best]))} against it"
    yield _claim(
        "tau0_error",
        graded(best == 0.5),
        errors=", ".join(f"{value.text(4)} m ({tau0:g})" for tau0, value in errors.items()),
        best=best,
        apart=apart if best != 0.5 else "",
    )
    yield _claim("tau0_choice", NO, same=forgotten(result))


def _error_claims(result: Reproduction) -> Iterator[Claim]:
    for figure, kind in enumerate(NOISE_KINDS, start=8):
        case = result.noises[kind]
        more = excess(case.aukf, case.ukf)
        yield _claim(
            "x_error",
            graded(more.below_zero),
            figure=figure,
            noise=paper_name(kind),
            aukf=rmse(case.aukf, 0).value,
            ukf=rmse(case.ukf, 0).value,
            below=_share(rms_per_step(case.aukf, 0) < rms_per_step(case.ukf, 0)),
            more=signed(more),
            equal=signed(excess(case.aukf, case.equal_rate)),
        )
    over = {kind: excess(case.aukf, case.same_time) for kind, case in result.noises.items()}
    yield _claim("all_noises", graded(all_below_zero(over.values())), over=by_noise(over))


def _share(which: npt.NDArray[np.bool_]) -> str:
    return percent(float(which.mean()))


def tau_limit(law: MahalanobisInterval) -> float:
    """Largest tau that Eq. (12) can give."""
    return law.epsilon / law.gamma2


def forgotten(result: Reproduction) -> int:
    """First step from which the mean intervals for all tau(0) differ by less than 0.01 s."""
    means = np.stack([intervals(one).mean(axis=0) for one in result.tau0.values()])
    apart = np.flatnonzero(means.max(axis=0) - means.min(axis=0) >= 0.01)
    return int(apart[-1]) + 1 if apart.size else 0


def _small(excesses: dict[NoiseKind, Estimate]) -> str:
    """Judge a gain under all noises: below 5 % it is there, but not what the paper shows."""
    if not all_below_zero(excesses.values()):
        return NO
    return YES if max(one.value for one in excesses.values()) < -0.05 else PARTLY


def percent(share: float) -> str:
    """Print a share with two or three digits."""
    value = 100 * share
    if 0 < abs(value) < 0.1:
        return "less than 0.1 %"
    text = f"{value:.1f}" if abs(value) < 10 else f"{value:.0f}"
    return text.removesuffix(".0") + " %"


def signed(value: Estimate) -> str:
    """Print an excess."""
    return Estimate(100 * value.value, 100 * value.standard_error).text(1, " %", "+")


def by_noise(values: dict[NoiseKind, Estimate]) -> str:
    """Print the excesses under all noises."""
    return ", ".join(f"{signed(value)} ({kind})" for kind, value in values.items())


def paper_name(kind: NoiseKind) -> str:
    """Say it as the paper does."""
    return {"uniform": "uniform", "normal": "Gaussian", "lognormal": "logarithmic"}[kind]
