"""The page of ``auvest reproduce aukf``: the paper's figures and claims, and what we measure.

Every number on the page comes from one :class:`auvest.reproduce.aukf.Reproduction`; the verdicts
follow from the numbers by the rules written here.
"""

from __future__ import annotations

import numpy as np

from auvest import MahalanobisInterval
from auvest.reproduce.aukf import (
    COLLAPSED_S,
    WIDE_P0_SIGMA,
    Comparison,
    Estimate,
    Floats,
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
from auvest.reproduce.claims import NO, PARTLY, YES, Claim, tally
from auvest.reproduce.markdown import fill, number, series, table
from auvest.scenarios.paper_aukf import (
    ASSUMPTIONS,
    FIXED_INTERVAL_S,
    NOISE_KINDS,
    P0_SIGMA,
    STEPS,
    TAU0_STUDIED,
    NoiseKind,
)

# Verdicts besides those of every paper.
PRESET = "reproduced with preset figure3; contradicts Table 1"
CONTRADICTED = "contradicted by the paper's own equations"
UNDEFINED = "cannot be judged: not stated"

#: Steps at which spec and page list the interval.
SHOWN_STEPS = (0, 1, 2, 4, 8, 15, 30, 59)
#: What an independent prototype gave there, means of 40 runs, s.
PROTOTYPE_S = (0.50, 0.48, 0.31, 0.38, 0.52, 0.57, 0.60, 0.60)


def claims(result: Reproduction) -> list[Claim]:
    """Every claim of the paper that its text makes about the simulation, judged."""
    return [
        *_introduction(result),
        *_law_claims(result),
        *_track_claims(result),
        *_interval_claims(result),
        *_tau0_claims(result),
        *_error_claims(result),
    ]


def _introduction(result: Reproduction) -> list[Claim]:
    worst = max(
        abs(rmse(case.ekf).value / rmse(case.ukf).value - 1) for case in result.noises.values()
    )
    over_time = {
        kind: excess_over_time(case.aukf, case.equal_rate) for kind, case in result.noises.items()
    }
    return [
        Claim(
            "Introduction",
            "the EKF's linearisation costs accuracy that the UKF keeps",
            f"RMSE of EKF and UKF differ by at most {_percent(worst)} in this scenario",
            NO if worst < 0.02 else YES,
        ),
        Claim(
            "Abstract; 2.1",
            "a constant sampling interval lets errors accumulate; adapting it lowers the "
            "influence of process and sensor noise",
            "AUKF against a UKF with the same number of samples in the same time: RMSE "
            + _by_noise(over_time)
            + " (errors at even times)",
            _small(over_time),
        ),
    ]


def _law_claims(result: Reproduction) -> list[Claim]:
    law = MahalanobisInterval()
    normal = result.noises["normal"].aukf
    ratio = raw_ratio(normal, law.gamma1_m2)
    raw_tau = law.epsilon / (normal.mahalanobis_squared + law.gamma2)
    table1 = MahalanobisInterval("table1")
    tiny = float(np.median(raw_ratio(result.noises["normal"].ukf, table1.gamma1_m2)))
    low, high = _extremes([one.mahalanobis_squared for one in result.offsets])
    return [
        Claim(
            "2.1, Eq. (7)",
            "gamma1 keeps M(k) below 1; M lies in (0, 0.9) and is about 0.9 when the estimated "
            "displacement comes close to the desired one",
            f"Eq. (7) as printed exceeds 0.9 in {_percent(float((ratio > 0.9).mean()))} of the "
            f"steps and 1 in {_percent(float((ratio > 1).mean()))} (preset figure3), so M must be "
            f"clamped; with Table 1's gamma1 = {table1.gamma1_m2:g} m^2 the UKF's track has a "
            f"median M of {number(tiny, 2)}",
            CONTRADICTED,
        ),
        Claim(
            "2.2, Eq. (12)",
            "tau lies in (0, 1)",
            f"with Table 1's gamma2 it is at most {number(_tau_limit(table1))}; with preset "
            f"figure3 the raw value exceeds 1 in {_percent(float((raw_tau > 1).mean()))} of the "
            "steps (where d^2 < 0.6) and is clamped",
            PARTLY,
        ),
        Claim(
            "2.2, Eqs. (9) to (11)",
            "the distance d(k) holds the deviation of the estimate from the truth",
            f"an estimate that is off by a constant, from 1 um to 1000 km: d^2 stays within "
            f"{low:.2f} to {high:.2f}, and is not larger for the larger errors (finding 4)",
            CONTRADICTED,
        ),
    ]


def _track_claims(result: Reproduction) -> list[Claim]:
    case = result.noises["uniform"]
    ukf, aukf = halves(case.ukf), halves(case.aukf)
    more = excess(case.aukf, case.ukf)
    smooth = [roughness(one) for one in (case.aukf, case.ukf, case.equal_rate)]
    largest = float(np.sqrt(np.square(case.aukf.error).sum(axis=-1)).max())
    return [
        Claim(
            "3.1, Fig. 1",
            "the UKF's estimate deviates more in the second half and tends to diverge",
            f"RMSE of the UKF, uniform noise: {ukf[0]:.3f} m in the first half, {ukf[1]:.3f} m in "
            "the second. It grows with the range, through bearing noise and bias; the filter does "
            "not diverge",
            PARTLY if ukf[1] > ukf[0] else NO,
        ),
        Claim(
            "3.1, Fig. 2",
            "the AUKF has little variance in the first half and deviates more in the second",
            f"RMSE of the AUKF, uniform noise: {aukf[0]:.3f} m and {aukf[1]:.3f} m",
            YES if aukf[1] > aukf[0] else NO,
        ),
        Claim(
            "3.1, Figs 1 and 2",
            "the AUKF's mean tracking error is slightly below the UKF's; it follows the track "
            "better",
            f"RMSE over {STEPS} steps: UKF {_pm(rmse(case.ukf))} m, AUKF {_pm(rmse(case.aukf))} m "
            f"({_signed(more)}); the AUKF's 60 steps last longer and lead further from the station",
            _lower(more),
        ),
        Claim(
            "3.1; 4",
            "the AUKF's track is smoother and more stable",
            "rms second difference of the estimate's error per step: AUKF "
            f"{1e3 * smooth[0]:.1f} mm, UKF {1e3 * smooth[1]:.1f} mm, UKF at the AUKF's mean "
            f"interval {1e3 * smooth[2]:.1f} mm",
            YES if smooth[0] < min(smooth[1:]) else NO,
        ),
        Claim(
            "3.1",
            "the error stays within an acceptable range",
            f"no range is given; the largest error of all runs is {largest:.2f} m at ranges up to "
            f"{float(case.aukf.z[..., 0].max()):.0f} m",
            UNDEFINED,
        ),
    ]


def _interval_claims(result: Reproduction) -> list[Claim]:
    case = result.noises["normal"]
    mean = intervals(case.aukf).mean(axis=0)
    literal = intervals(result.table1)
    first = mean[:6]
    above = int(np.argmax(mean > FIXED_INTERVAL_S)) if (mean > FIXED_INTERVAL_S).any() else None
    last = mean[-20:]
    settled = float(last.max() - last.min()) < 0.1
    follows = {kind: reaction(one.aukf) for kind, one in result.noises.items()}
    summed = [
        float(np.abs(one.error).sum(axis=-1).sum(axis=1).mean()) for one in (case.ukf, case.aukf)
    ]
    rate = 1 / float(mean.mean())
    saved = 1 - rate * FIXED_INTERVAL_S
    return [
        Claim(
            "3.2, Fig. 3",
            "the AUKF's interval is at first slightly below 0.5 s",
            f"mean over {result.runs} runs: lowest value {first.min():.3f} s at step "
            f"{int(first.argmin())}; Table 1: {series(literal.mean(axis=0)[:5])} s",
            PRESET if first.min() < FIXED_INTERVAL_S else NO,
        ),
        Claim(
            "3.2, Fig. 3",
            "then it rises above 0.5 s and tends to a constant",
            f"above 0.5 s from step {above}; the last twenty means lie in {last.min():.3f} to "
            f"{last.max():.3f} s; one run goes on jumping between {_p(case, 5):.2f} and "
            f"{_p(case, 95):.2f} s (5 and 95 %). Table 1: never above "
            f"{literal[:, 4:].max():.3f} s after step 3",
            PRESET if above is not None and settled else NO,
        ),
        Claim(
            "3.2, Fig. 3",
            "the AUKF's interval is mostly above the UKF's",
            f"the mean is above 0.5 s at {int((mean > FIXED_INTERVAL_S).sum())} of {STEPS} steps",
            PRESET if (mean > FIXED_INTERVAL_S).mean() > 0.5 else NO,
        ),
        Claim(
            "3.2",
            "feedback at every step keeps the accumulated error below the UKF's",
            f"sum of |x error| + |y error| over the {STEPS} steps, Gaussian noise: AUKF "
            f"{summed[1]:.2f} m, UKF {summed[0]:.2f} m",
            YES if summed[1] < summed[0] else NO,
        ),
        Claim(
            "3.2",
            "a large difference of estimate and truth shortens the interval, a small one "
            "lengthens it",
            "correlation of the interval with the error of the sample before it: "
            + ", ".join(f"{one.error:.2f} ({kind})" for kind, one in follows.items())
            + "; with that of the sample before that: "
            + ", ".join(f"{one.previous:.2f}" for one in follows.values())
            + ". The sign is the paper's; but what tau sees is not the size of the error, only how "
            "it changed since the step before (finding 4), and Eq. (8) uses it one step late",
            PARTLY if all(one.error < 0 for one in follows.values()) else NO,
        ),
        Claim(
            "3.2",
            "longer intervals save energy and computing",
            f"{rate:.2f} samples per second instead of {1 / FIXED_INTERVAL_S:.2f}: "
            f"{_percent(saved)} fewer; a fixed interval of {mean.mean():.3f} s saves as much",
            PRESET if saved > 0 else NO,
        ),
    ]


def _tau0_claims(result: Reproduction) -> list[Claim]:
    reference = result.noises["normal"].ukf.truth[:, -1].mean(axis=0)
    shift = {
        tau0: float(np.hypot(*(one.truth[:, -1].mean(axis=0) - reference)))
        for tau0, one in result.tau0.items()
    }
    errors = {tau0: rmse(one) for tau0, one in result.tau0.items()}
    best = min(errors, key=lambda tau0: errors[tau0].value)
    apart = excess(result.tau0[0.5], result.tau0[best])
    nearest = min(shift, key=lambda tau0: shift[tau0])
    same = _forgotten(result)
    return [
        Claim(
            "3.3, Figs 4 to 7",
            "near tau(0) = 0 and 1 the true and observed tracks shift",
            "end of the true track, distance from the UKF's: "
            + ", ".join(f"{value:.2f} m ({tau0:g})" for tau0, value in shift.items())
            + ". The truth is stepped with the filter's own interval, so it ends elsewhere by as "
            "much as the first intervals differ",
            PARTLY,
        ),
        Claim(
            "3.3, Figs 5 and 6",
            "for tau(0) in 0.3 to 0.5 the tracks are closest to the UKF's",
            f"the end of the true track is closest for tau(0) = {nearest:g} and moves away as "
            "tau(0) grows",
            YES if nearest in (0.3, 0.5) else NO,
        ),
        Claim(
            "3.3, Fig. 6",
            "near tau(0) = 0.5 the error is smallest",
            "RMSE: "
            + ", ".join(f"{_pm(value)} m ({tau0:g})" for tau0, value in errors.items())
            + f"; smallest for {best:g}"
            + (f", 0.5 is {_signed(apart)} against it" if best != 0.5 else "")
            + ". The difference is that of the distance covered",
            YES if best == 0.5 else NO,
        ),
        Claim(
            "3.3",
            "choose tau(0) in 0.3 to 0.5",
            f"the choice is forgotten: from step {same} on the mean intervals for all four values "
            "differ by less than 0.01 s",
            NO,
        ),
    ]


def _error_claims(result: Reproduction) -> list[Claim]:
    found = []
    figures = dict(zip(NOISE_KINDS, (8, 9, 10), strict=True))
    for kind, figure in figures.items():
        case = result.noises[kind]
        below = float((rms_per_step(case.aukf, 0) < rms_per_step(case.ukf, 0)).mean())
        more = excess(case.aukf, case.ukf)
        equal = excess(case.aukf, case.equal_rate)
        found.append(
            Claim(
                f"3.4, Fig. {figure}",
                f"{_paper_name(kind)} noise: the AUKF's x error is generally below the UKF's",
                f"rms x error {rmse(case.aukf, 0).value:.4f} m against "
                f"{rmse(case.ukf, 0).value:.4f} m; below it at {_percent(below)} of the steps; "
                f"position RMSE {_signed(more)}, at equal rate {_signed(equal)}",
                _lower(more),
            )
        )
    over = {kind: excess(case.aukf, case.same_time) for kind, case in result.noises.items()}
    found.append(
        Claim(
            "3.4; 4",
            "the AUKF resists noise better and accumulates less error under all three noises",
            "against a UKF at 0.5 s for the same time (more samples): RMSE " + _by_noise(over),
            YES if all(_below(one) for one in over.values()) else NO,
        )
    )
    return found


# The page.


def page(result: Reproduction) -> str:
    """README.md: figures, claims, assumptions and contradictions."""
    judged = claims(result)
    parts = [
        _head(result, judged),
        "## Figures\n",
        _figure_table(result),
        _gallery(),
        "## Claims\n",
        table(
            ("where", "the paper says", "we measure", "verdict"),
            [(c.where, c.paper, c.measured, f"**{c.verdict}**") for c in judged],
        ),
        "## Errors\n",
        _errors(result),
        "## Where the paper contradicts itself\n",
        _finding1(result),
        _finding2(result),
        _finding3(result),
        _finding4(result),
        "## Assumptions\n",
        "What the paper's text leaves open (its figures were not available to us as images).\n",
        table(
            ("quantity", "the paper", "here", "why"),
            [(a.quantity, a.paper, a.ours, a.reason) for a in ASSUMPTIONS],
        ),
    ]
    return fill("\n".join(parts).rstrip("\n")) + "\n"


def _head(result: Reproduction, judged: list[Claim]) -> str:
    mean = intervals(result.noises["normal"].aukf).mean(axis=0)
    more = {kind: excess(case.aukf, case.ukf) for kind, case in result.noises.items()}
    equal = {
        kind: excess_over_time(case.aukf, case.equal_rate) for kind, case in result.noises.items()
    }
    at_samples = {kind: excess(case.aukf, case.equal_rate) for kind, case in result.noises.items()}
    law, literal = MahalanobisInterval(), MahalanobisInterval("table1")
    return f"""# Reproduction: the adaptive UKF of Deng, Yin and Duan (2019)

Deng F., Yin H., Duan M.: *Adaptive UKF algorithm based on AUV tracking*, Journal of Chongqing
University 42(1), 2019, doi 10.11835/j.issn.1000-582X.2019.01.010 (in Chinese). Section, equation
and figure numbers are the paper's.

Made by `auvest reproduce aukf --runs {result.runs} --seed {result.seed}`; do not edit. Each number
is a mean over {result.runs} runs unless one run is named; ± is one standard error. The numbers of
each figure are in the CSV file of its name, all others in `results.json`.

In short:

- **Fig. 3 is reproduced, but not with Table 1.** With gamma1 = {law.gamma1_m2:g} m^2 and gamma2 =
  {law.gamma2:g} the interval starts at {mean[0]:.2f} s, dips to {mean[:6].min():.2f} s and settles
  at {mean[-20:].mean():.2f} s; with Table 1's {literal.gamma1_m2:g} and {literal.gamma2:g} it falls
  to {literal.min_s:g} s.
- **{_ranking(more)}** Over {STEPS} steps its RMSE is {_by_noise(more)}: its intervals are longer,
  so it takes fewer samples and ends further from the station.
- **{_ranking(equal, "a UKF with as many samples in the same time")}** At the samples its RMSE is
  {_by_noise(at_samples)}, at even times {_by_noise(equal)}.
- **tau does not see the size of the error**, only how it changed since the step before (finding 4).

Of {len(judged)} claims: {tally(judged)}.
"""


def _figure_table(result: Reproduction) -> str:
    uniform, normal = result.noises["uniform"], result.noises["normal"]
    mean = intervals(normal.aukf).mean(axis=0)
    rows: list[tuple[str, str, str]] = [
        (
            "1",
            "UKF track, uniform noise: second half off",
            f"RMSE {halves(uniform.ukf)[0]:.3f} m, then {halves(uniform.ukf)[1]:.3f} m",
        ),
        (
            "2",
            "AUKF track, uniform noise: closer",
            f"RMSE {halves(uniform.aukf)[0]:.3f} m, then {halves(uniform.aukf)[1]:.3f} m",
        ),
        (
            "3",
            "interval: 0.5 s, slightly below, then above and constant",
            f"T at steps {', '.join(map(str, SHOWN_STEPS))}: {series(mean[list(SHOWN_STEPS)])} s",
        ),
    ]
    for index, tau0 in enumerate(TAU0_STUDIED, start=4):
        one = result.tau0[tau0]
        rows.append(
            (
                f"{index}",
                f"AUKF track, tau(0) = {tau0:g}",
                f"RMSE {_pm(rmse(one))} m; T at steps 1, 2, 4, 8: "
                f"{series(intervals(one).mean(axis=0)[[1, 2, 4, 8]])} s",
            )
        )
    for index, kind in enumerate(NOISE_KINDS, start=8):
        case = result.noises[kind]
        rows.append(
            (
                f"{index}",
                f"x error, {_paper_name(kind)} noise: AUKF generally lower",
                f"rms x error: UKF {rmse(case.ukf, 0).value:.4f} m, AUKF "
                f"{rmse(case.aukf, 0).value:.4f} m",
            )
        )
    return table(("Fig.", "the paper's text", "ours"), rows)


def _gallery() -> str:
    files = [f"fig{index:02d}" for index in range(1, 11)]
    rows = [
        [f"![{stem}]({stem}.png)" for stem in files[start : start + 2]]
        for start in range(0, len(files), 2)
    ]
    return table(("", ""), rows)


def _errors(result: Reproduction) -> str:
    header = (
        "noise", "UKF, 0.5 s", "AUKF", "AUKF against UKF", "UKF at equal rate",
        "AUKF against that", "UKF, 0.5 s, same time", "EKF, 0.5 s", "mean T / s", "NEES UKF, AUKF",
    )  # fmt: skip
    rows = [_error_row(kind, case) for kind, case in result.noises.items()]
    rows += [_error_row(f"{kind}, bias removed", case) for kind, case in result.centred.items()]
    bias = []
    for kind, clean in result.centred.items():
        kept = result.noises[kind]
        mean = kept.noise.mean
        bias.append(
            f"{kind} {mean[0]:.3f} m and {mean[1]:.4f} rad make the UKF's RMSE "
            f"{rmse(kept.ukf).value / rmse(clean.ukf).value:.1f} times and the AUKF's "
            f"{rmse(kept.aukf).value / rmse(clean.aukf).value:.1f} times as large"
        )
    return (
        f"Position RMSE in m over {STEPS} steps. *Equal rate*: a UKF at the AUKF's mean interval, "
        "as many samples in the same time. *Same time*: a UKF at 0.5 s for as long as the AUKF's "
        "steps take. NEES of the position, 2 if the filter knows its error.\n\n"
        + table(header, rows)
        + "\nWhat the bias of the noise costs: "
        + "; ".join(bias)
        + ". No filter here can tell a bias from a position.\n\n"
        + f"In float32, as on the ATmega2560, the UKF with alpha = 1e-6 differs from float64 by at "
        f"most {number(result.float32_difference_m, 2)} m over all runs (Gaussian noise): the "
        "deviation form keeps the paper's alpha usable.\n"
    )


def _error_row(name: str, case: Comparison) -> tuple[str, ...]:
    return (
        name,
        _pm(rmse(case.ukf)),
        _pm(rmse(case.aukf)),
        _signed(excess(case.aukf, case.ukf)),
        _pm(rmse(case.equal_rate)),
        _signed(excess(case.aukf, case.equal_rate)),
        _pm(rmse(case.same_time)),
        _pm(rmse(case.ekf)),
        f"{intervals(case.aukf).mean():.3f}",
        f"{case.ukf.nees.mean():.2f}, {case.aukf.nees.mean():.2f}",
    )


def _finding1(result: Reproduction) -> str:
    law = MahalanobisInterval("table1")
    tau = _tau_limit(law)
    limit = tau * law.max_s / (1 - (1 - tau) * law.scale)
    pace, now = [law.initial_s], law.tau0
    for _ in range(4):
        pace.append((1 - now) * law.scale * pace[-1] + now * law.ratio_max * law.max_s)
        now = tau
    literal = intervals(result.table1)
    figure3 = result.noises["normal"].aukf
    ratio = float(np.median(raw_ratio(result.noises["normal"].ukf, law.gamma1_m2)))
    distances = figure3.mahalanobis_squared
    return f"""### 1. Table 1 excludes Fig. 3

Eq. (12) with Table 1's eps = {law.epsilon:g} and gamma2 = {law.gamma2:g} gives tau <= eps / gamma2
= {number(tau)}, whatever d is. Then Eq. (8) tends to at most tau T_max / (1 - (1 - tau) phi) =
{limit:.4f} s, even for M = 1. From tau(0) = {law.tau0:g} and with M at its largest,
{law.ratio_max:g}: {series(pace)} s. Table 1's gamma1 = {law.gamma1_m2:g} m^2 makes it worse: for
displacements of 0.1 m per step M is {number(ratio, 2)} (median over the UKF's steps), and T falls
to T_min = {law.min_s:g} s. Measured with preset table1: {series(literal.mean(axis=0)[:6])} s; the
largest value of any run after step 3 is {literal[:, 4:].max():.3f} s. With range noise of 1 m:
{series(intervals(result.table1_loud).mean(axis=0)[:6])} s.

Four points in the plane have d^2 <= (4 - 1)^2 / 4 = 2.25, and 1.5 on average over the points;
measured: mean {np.nanmean(distances):.2f}, largest {np.nanmax(distances):.3f}. So T > 0.5 s needs
gamma2 of about 1 and gamma1 far below the squared displacement of a step.
"""


def _finding2(result: Reproduction) -> str:
    law = MahalanobisInterval()
    mean = intervals(result.noises["normal"].aukf).mean(axis=0)
    rows = [
        ("here", *(f"{value:.2f}" for value in mean[list(SHOWN_STEPS)])),
        ("prototype, 40 runs", *(f"{value:.2f}" for value in PROTOTYPE_S)),
    ]
    start = table(
        ("T(0) / s", "T_min / s", "last T, noise 1 um / s", "noise 0.05 m / s",
         f"runs below {COLLAPSED_S:g} s"),
        [
            (f"{s.initial_s:g}", f"{s.min_s:g}", f"{s.quiet_s:.3f}", f"{s.noisy_s:.3f}",
             _percent(s.collapsed))
            for s in result.starts
        ],
    )  # fmt: skip
    speed2 = 0.05
    return f"""### 2. What gives Fig. 3, and what the law does besides

gamma1 = {law.gamma1_m2:g} m^2, gamma2 = {law.gamma2:g}, tau(0) = {law.tau0:g}, T_min =
{law.min_s:g} s and Gaussian noise of {result.noises["normal"].noise.range_m:g} m and
{result.noises["normal"].noise.bearing_rad:g} rad (preset figure3). Mean interval at some steps, s:

{table(("step", *map(str, SHOWN_STEPS)), rows)}
The dip is as deep as the first estimates jump, which P0 decides (not stated in the paper).

The law has two stable states. Once T is small the displacement is small, gamma1 rules Eq. (7), M
is small and T stays at T_min: without noise if T_min is below about 1.5 gamma1 / v^2 =
{1.5 * law.gamma1_m2 / speed2:.3f} s, with noise also from above that. The same law from other
starts:

{start}"""


def _finding3(result: Reproduction) -> str:
    rows = [
        (
            case.noise.kind,
            f"{case.noise.range_m:g} m, {case.noise.bearing_rad:g} rad",
            "noise-sized" if case.wide_start else "known",
            series(case.interval_s[[4, 15, 30, 59]], 2),
            f"{case.interval_s[-20:].mean():.2f}",
            _percent(case.collapsed),
        )
        for case in result.loud
    ]
    known = [case for case in result.loud if not case.wide_start]
    wide = [case for case in result.loud if case.wide_start]
    like = sum(_like_figure3(case.interval_s) for case in result.loud)
    return f"""### 3. Noise of the paper's size does not give Fig. 3

The paper's noises are "(0, 1)" in metres: jumps of the estimate far above the displacement of 0.1 m
per step. The law reads noise as motion, M becomes small and T falls. Preset figure3; *known* start:
P0 as in the figures ({_sigmas(P0_SIGMA)}); *noise-sized*: {_sigmas(WIDE_P0_SIGMA)}.

{
        table(
            (
                "noise",
                "scale",
                "start",
                "T at steps 4, 15, 30, 59 / s",
                "mean of the last 20 / s",
                f"runs below {COLLAPSED_S:g} s at the end",
            ),
            rows,
        )
    }
With a noise-sized start {_percent(min(c.collapsed for c in wide))} to
{_percent(max(c.collapsed for c in wide))} of the runs end collapsed. With a start known to
{P0_SIGMA[0]:g} m the filter smooths the noise for some time and {
        _percent(min(c.collapsed for c in known))
    } to {_percent(max(c.collapsed for c in known))} do. {like if like else "None"} of the {
        len(result.loud)
    } cases has the shape of Fig. 3 (dip below 0.5 s within five steps,
above it by step 15, last twenty means within 0.55 to 0.65 s).
"""


def _finding4(result: Reproduction) -> str:
    law = MahalanobisInterval()
    rows = [
        (f"{one.offset_m:g}", f"{one.mahalanobis_squared:.3f}", f"{one.tau:.3f}")
        for one in result.offsets
    ]
    sizes = [one.offset_m for one in result.growths if one.growth == result.growths[0].growth]
    changes = []
    for growth in dict.fromkeys(one.growth for one in result.growths):
        same = [one for one in result.growths if one.growth == growth]
        cells = [f"{one.mahalanobis_squared:.3f}" for one in same]
        changes.append((f"{growth:g}", *cells, f"{same[0].tau:.3f}"))
    steady = law.epsilon / (1.5 + law.gamma2)
    fixed = steady * law.ratio_max * law.max_s / (1 - (1 - steady) * law.scale)
    tau0 = [
        (f"{value:g}", series(intervals(one).mean(axis=0)[:9]))
        for value, one in result.tau0.items()
    ]
    return f"""### 4. tau carries nothing about the size of the error

The Mahalanobis distance does not change under affine maps: all errors a thousand times as large
give the same d^2. If the estimate moves as the reference does and is off by a constant e, Eqs. (9)
to (11) give d^2 = 1.5 for every e. Asked of the implementation, with e at a right angle to the
track:

{table(("e / m", "d^2", "tau"), rows)}
(Far from that range the four points are collinear to machine precision and the regularised
covariance gives the distance along the line, 0.75.) What d^2 does see is how the error changed from
one step to the next, as a ratio g, d^2 = 3/4 + 3/2 g^2 / (1 + g^2):

{
        table(
            ("error over that of the step before", *(f"d^2, e = {e:g} m" for e in sizes), "tau"),
            changes,
        )
    }
A growing error makes tau smaller and the next interval but one shorter. Correlation of tau with the
logarithm of that ratio: {
        ", ".join(
            f"{reaction(case.aukf).growth:.2f} ({kind})" for kind, case in result.noises.items()
        )
    }. An error that grows and then stays is forgotten.

The steady state of
Eq. (8) at d^2 = 1.5 and M = {law.ratio_max:g} is {fixed:.2f} s: Fig. 3's constant holds no
information on the error.

tau(0) acts on T(1) only; d(1) sets tau from then on. Mean intervals at steps 0 to 8, s:

{table(("tau(0)", "T"), tau0)}
From step {_forgotten(result)} on they differ by less than 0.01 s, so Figs 4 to 7 can differ only
through the first seconds.
"""


# Small helpers.


def _tau_limit(law: MahalanobisInterval) -> float:
    return law.epsilon / law.gamma2


def _forgotten(result: Reproduction) -> int:
    """First step from which the mean intervals for all tau(0) differ by less than 0.01 s."""
    means = np.stack([intervals(one).mean(axis=0) for one in result.tau0.values()])
    apart = np.flatnonzero(means.max(axis=0) - means.min(axis=0) >= 0.01)
    return int(apart[-1]) + 1 if apart.size else 0


def _like_figure3(mean: Floats) -> bool:
    dips = bool((mean[:6] < FIXED_INTERVAL_S).any())
    rises = bool((mean[:16] > FIXED_INTERVAL_S).any())
    settles = bool((mean[-20:] > 0.55).all() and (mean[-20:] < 0.65).all())
    return dips and rises and settles


def _p(case: Comparison, percent: float) -> float:
    return float(np.percentile(intervals(case.aukf)[:, -20:], percent))


def _below(value: Estimate) -> bool:
    """Below zero by more than two standard errors."""
    return value.value < -2 * value.standard_error


def _lower(more: Estimate) -> str:
    return YES if _below(more) else NO


def _small(excesses: dict[NoiseKind, Estimate]) -> str:
    """Judge a gain under all noises: below 5 % it is there, but not what the paper shows."""
    if not all(_below(one) for one in excesses.values()):
        return NO
    return YES if max(one.value for one in excesses.values()) < -0.05 else PARTLY


def _percent(share: float) -> str:
    value = 100 * share
    if 0 < abs(value) < 0.1:
        return "less than 0.1 %"
    text = f"{value:.1f}" if abs(value) < 10 else f"{value:.0f}"
    return text.removesuffix(".0") + " %"


def _ranking(excesses: dict[NoiseKind, Estimate], rival: str = "the UKF") -> str:
    if all(_below(one) for one in excesses.values()):
        size = max(-one.value for one in excesses.values())
        return f"The AUKF beats {rival}, by at most {_percent(size)}."
    if any(_below(one) for one in excesses.values()):
        return f"The AUKF beats {rival} under some noises only."
    return f"The AUKF does not beat {rival}."


def _signed(value: Estimate) -> str:
    return f"{100 * value.value:+.1f} % ± {100 * value.standard_error:.1f} %"


def _pm(value: Estimate) -> str:
    return f"{value.value:.4f} ± {value.standard_error:.4f}"


def _by_noise(values: dict[NoiseKind, Estimate]) -> str:
    return ", ".join(f"{_signed(value)} ({kind})" for kind, value in values.items())


def _paper_name(kind: NoiseKind) -> str:
    return {"uniform": "uniform", "normal": "Gaussian", "lognormal": "logarithmic"}[kind]


def _sigmas(sigma: tuple[float, float, float]) -> str:
    return f"{sigma[0]:g} m, {sigma[1]:g} m/s, {sigma[2]:g} m/s^2"


def _extremes(values: list[float]) -> tuple[float, float]:
    return min(values), max(values)
