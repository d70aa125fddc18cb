"""The experiments behind ``auvest reproduce aukf`` (Deng, Yin, Duan 2019, section 3).

:func:`measure` runs them, :func:`summary` is their machine-readable result, :func:`tables`
are the numbers of the figures. The page that judges the paper's claims is made in
:mod:`auvest.reproduce.aukf.page`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from auvest import Aukf, FixedInterval, MahalanobisInterval
from auvest.intervals import IntervalPolicy
from auvest.reproduce.estimate import Estimate, Floats
from auvest.reproduce.ticks import Ticks
from auvest.simulation._runs import standard_error
from auvest.simulation.paper_aukf import (
    ASSUMPTIONS,
    FIXED_INTERVAL_S,
    NOISE_KINDS,
    P0_SIGMA,
    STEPS,
    TAU0_STUDIED,
    NoiseKind,
    observed_positions,
    paper_filter,
    paper_noise,
    paper_track,
)
from auvest.simulation.tracking import Noise, Scenario, TrackingResult, sensor_of, simulate

DEFAULT_RUNS = 200
DEFAULT_SEED = 1

#: Noise of the paper's own size, three readings of "(0, 1)": range scale (m), bearing scale (rad).
LOUD_SCALES = ((1.0, 0.01), (1.0, 0.1), (1.0, 1.0))
#: A start known no better than that noise: 1 m, 1 m/s, 1 m/s^2.
WIDE_P0_SIGMA = (1.0, 1.0, 1.0)
#: Distance of the times at which the error between samples is taken, s.
PROBE_PERIOD_S = 0.1
#: Below this the interval counts as collapsed, s.
COLLAPSED_S = 0.1
#: Constant errors of the estimate, m, for finding 4.
OFFSETS_M = (1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6)
#: Error of a step over that of the step before, for finding 4.
GROWTHS = (-1.0, 0.0, 0.5, 1.0, 2.0, 10.0)
GROWING_OFFSETS_M = (1e-3, 1.0, 1e3)
#: T(0) and T_min, s, for the law's two fixed points.
START_INTERVALS = (
    (0.5, 0.02), (0.02, 0.02), (0.5, 0.002), (0.05, 0.002), (0.02, 0.002), (0.01, 0.002),
    (0.002, 0.002),
)  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """The filters on one noise.

    ``equal_rate`` is the UKF at the AUKF's mean interval: as many samples in the same time.
    ``same_time`` is the UKF at 0.5 s for as long as the AUKF's 60 steps take.
    """

    noise: Noise
    ukf: TrackingResult
    aukf: TrackingResult
    equal_rate: TrackingResult
    same_time: TrackingResult
    ekf: TrackingResult


@dataclass(frozen=True)
class Loud:
    """The law under noise of the paper's size."""

    noise: Noise
    wide_start: bool
    interval_s: Floats
    collapsed: float


@dataclass(frozen=True)
class Offset:
    """What the law makes of an error of ``offset_m`` that grows to ``growth`` times that."""

    offset_m: float
    growth: float
    mahalanobis_squared: float
    tau: float


@dataclass(frozen=True)
class Start:
    """Where the law ends when it starts from this interval."""

    initial_s: float
    min_s: float
    quiet_s: float
    noisy_s: float
    collapsed: float


@dataclass(frozen=True)
class Reproduction:
    """Everything measured; Monte Carlo results keep all runs."""

    runs: int
    seed: int
    failed_runs: int
    noises: dict[NoiseKind, Comparison]
    centred: dict[NoiseKind, Comparison]
    table1: TrackingResult
    table1_loud: TrackingResult
    tau0: dict[float, TrackingResult]
    loud: list[Loud]
    offsets: list[Offset]
    growths: list[Offset]
    starts: list[Start]
    float32_difference_m: float


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Run all experiments.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each.
    seed : int
        Seed of the noise; every experiment uses the same.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in experiments.
    """
    flights = 5 * (2 * len(NOISE_KINDS) - 1) + 2 + len(TAU0_STUDIED)
    flights += 2 * 3 * len(LOUD_SCALES) + 2 * len(START_INTERVALS) + 1
    tick = Ticks(flights, progress)
    failed_runs = 0

    def fly(
        noise: Noise,
        name: str = "aukf",
        *,
        policy: IntervalPolicy | None = None,
        steps: int = STEPS,
        p0_sigma: tuple[float, float, float] = P0_SIGMA,
        dtype: str = "float64",
    ) -> TrackingResult:
        filter_ = paper_filter(
            name,  # type: ignore[arg-type]
            noise=noise,
            policy=policy,
            p0_sigma=p0_sigma,
            dtype=dtype,  # type: ignore[arg-type]
        )
        scenario = Scenario(
            track=paper_track(),
            noise=noise,
            steps=steps,
            runs=runs,
            seed=seed,
            probe_period_s=PROBE_PERIOD_S,
        )
        nonlocal failed_runs
        result = simulate(filter_, scenario, workers=workers)
        failed_runs += int(result.failed.sum())
        tick()
        return result

    def compare(noise: Noise) -> Comparison:
        aukf = fly(noise)
        steps = max(1, round(float(np.nanmax(aukf.time_s, axis=1).mean()) / FIXED_INTERVAL_S))
        mean = float(intervals(aukf).mean())
        return Comparison(
            noise=noise,
            ukf=fly(noise, "ukf"),
            aukf=aukf,
            equal_rate=fly(noise, policy=FixedInterval(interval_s=mean)),
            same_time=fly(noise, "ukf", steps=steps),
            ekf=fly(noise, "ekf"),
        )

    def loud(kind: NoiseKind, scale: tuple[float, float], *, wide: bool) -> Loud:
        noise = paper_noise(kind, range_m=scale[0], bearing_rad=scale[1])
        pace = intervals(fly(noise, p0_sigma=WIDE_P0_SIGMA if wide else P0_SIGMA))
        return Loud(noise, wide, pace.mean(axis=0), collapsed(pace))

    def start(initial_s: float, min_s: float) -> Start:
        law = MahalanobisInterval(initial_s=initial_s, min_s=min_s)
        quiet = intervals(fly(paper_noise(range_m=1e-6, bearing_rad=1e-6), policy=law))
        noisy = intervals(fly(normal, policy=law))
        ends = [float(pace[:, -1].mean()) for pace in (quiet, noisy)]
        return Start(initial_s, min_s, ends[0], ends[1], collapsed(noisy))

    noises = {kind: compare(paper_noise(kind)) for kind in NOISE_KINDS}
    centred: dict[NoiseKind, Comparison] = {
        kind: compare(paper_noise(kind, centred=True)) for kind in NOISE_KINDS if kind != "normal"
    }
    normal = paper_noise("normal")
    literal = MahalanobisInterval("table1")
    single = fly(normal, "ukf", dtype="float32")
    difference = single.x[..., :2] - noises["normal"].ukf.x[..., :2]
    return Reproduction(
        runs=runs,
        seed=seed,
        noises=noises,
        centred=centred,
        table1=fly(normal, policy=literal),
        table1_loud=fly(paper_noise("normal", range_m=1.0), policy=literal),
        tau0={value: fly(normal, policy=MahalanobisInterval(tau0=value)) for value in TAU0_STUDIED},
        loud=[
            loud(kind, scale, wide=wide)
            for kind in NOISE_KINDS
            for scale in LOUD_SCALES
            for wide in (False, True)
        ],
        offsets=[_offset(value) for value in OFFSETS_M],
        growths=[_offset(value, growth) for growth in GROWTHS for value in GROWING_OFFSETS_M],
        starts=[start(*seconds) for seconds in START_INTERVALS],
        float32_difference_m=float(np.abs(difference).max()),
        failed_runs=failed_runs,  # of all flights above: they come first
    )


def _offset(offset_m: float, growth: float = 1.0) -> Offset:
    """Let the law see an estimate that lies beside the reference."""
    model = paper_filter("aukf", noise=paper_noise())
    x0 = model.x.copy()
    reference = x0[:2].copy()
    velocity = x0[2:4].copy()
    across = np.array([velocity[1], -velocity[0]]) / np.hypot(*velocity)
    interval_s = FIXED_INTERVAL_S
    x0[:2] += offset_m * across
    x0[2:4] += (growth - 1.0) * offset_m / interval_s * across
    aukf = Aukf(x0, model.P, process=model.process, reference=reference)
    aukf.predict(interval_s)
    aukf.feedback(reference + interval_s * velocity)
    return Offset(offset_m, growth, aukf.mahalanobis_squared, aukf.tau)


# Quantities of a Monte Carlo result.


def intervals(result: TrackingResult) -> Floats:
    """T(0), T(1), ... (runs, steps): the interval that led to each sample, s."""
    return np.diff(result.time_s, axis=1, prepend=0.0)


def collapsed(pace: Floats) -> float:
    """Share of the runs whose last five intervals have a mean below :data:`COLLAPSED_S`."""
    return float((pace[:, -5:].mean(axis=1) < COLLAPSED_S).mean())


def rms(square: Floats) -> Estimate:
    """Root of a mean of squares, and its standard error, from one mean square per run."""
    value = float(np.sqrt(square.mean()))
    return Estimate(value, standard_error(square) / (2 * value) if value else math.nan)


def square_per_run(result: TrackingResult, axis: int | None = None) -> Floats:
    """Mean squared position error of each run, or that along one axis, m^2."""
    e = result.error
    square = e**2 if axis is None else e[..., axis : axis + 1] ** 2
    return np.asarray(square.sum(axis=-1).mean(axis=1))


def rmse(result: TrackingResult, axis: int | None = None) -> Estimate:
    """Root mean squared position error over all runs and steps, m."""
    return rms(square_per_run(result, axis))


def rmse_over_time(result: TrackingResult) -> Estimate:
    """Root mean squared position error at even times, between samples too, m."""
    return rms(_square_over_time(result))


def _square_over_time(result: TrackingResult) -> Floats:
    return np.asarray(result.probe_square_sum / result.probe_count)


def excess(a: TrackingResult, b: TrackingResult) -> Estimate:
    """RMSE of a over that of b, less one; the runs are paired, they share their random numbers."""
    return _excess(square_per_run(a), square_per_run(b))


def excess_over_time(a: TrackingResult, b: TrackingResult) -> Estimate:
    """:func:`excess` of the errors at even times, which counts no part of the track twice."""
    return _excess(_square_over_time(a), _square_over_time(b))


def _excess(square_a: Floats, square_b: Floats) -> Estimate:
    ratio = float(np.sqrt(square_a.mean() / square_b.mean()))
    spread = standard_error(square_a - ratio**2 * square_b) / float(square_b.mean())
    return Estimate(ratio - 1, spread / (2 * ratio))


def halves(result: TrackingResult) -> tuple[float, float]:
    """Root mean squared position error of the first and of the second half of the steps, m."""
    square = (result.error**2).sum(axis=-1)
    middle = square.shape[1] // 2
    return float(np.sqrt(square[:, :middle].mean())), float(np.sqrt(square[:, middle:].mean()))


def roughness(result: TrackingResult) -> float:
    """How unsmooth the estimated track is: rms second difference of its error per step, m."""
    kink = np.diff(result.error, n=2, axis=1)
    return float(np.sqrt((kink**2).sum(axis=-1).mean()))


def raw_ratio(result: TrackingResult, gamma1_m2: float) -> Floats:
    """M(k) of Eq. (7) before it is clamped, (runs, steps - 1)."""
    desired = (np.diff(result.truth, axis=1) ** 2).sum(axis=-1)
    estimated = (np.diff(result.x[..., :2], axis=1) ** 2).sum(axis=-1)
    return np.asarray(desired / (estimated + gamma1_m2))


@dataclass(frozen=True)
class Reaction:
    """Correlations of the interval with the error that led to it.

    ``error`` and ``previous`` take the errors of the last sample and of the one before; ``growth``
    is the correlation of tau with the logarithm of their ratio.
    """

    error: float
    previous: float
    growth: float


def reaction(result: TrackingResult, first: int = 15) -> Reaction:
    """Find what the interval follows; the mean of each step is taken out, since all drift."""
    size = np.sqrt((result.error**2).sum(axis=-1))
    after = intervals(result)[:, first + 1 :]
    grown = np.log(size[:, 1:] / size[:, :-1])
    return Reaction(
        _correlation(size[:, first:-1], after),
        _correlation(size[:, first - 1 : -2], after),
        _correlation(grown[:, first:], result.tau[:, first + 1 :]),
    )


def _correlation(a: Floats, b: Floats) -> float:
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    scale = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return float((a * b).sum()) / scale if scale > 0 else float("nan")


# Machine-readable result.


def summary(result: Reproduction) -> dict[str, Any]:
    """Make the JSON of ``auvest reproduce aukf --json``, without the claims."""
    normal = result.noises["normal"]
    return {
        "runs": result.runs,
        "seed": result.seed,
        "steps": STEPS,
        "failed_runs": result.failed_runs,
        "figure3": {
            "interval_s": intervals(normal.aukf).mean(axis=0),
            "ukf_interval_s": intervals(normal.ukf).mean(axis=0),
            "collapsed": collapsed(intervals(normal.aukf)),
        },
        "table1": {
            "interval_s": intervals(result.table1).mean(axis=0),
            "max_interval_s": intervals(result.table1).max(axis=0),
            "t_min_s": MahalanobisInterval("table1").min_s,
        },
        "errors": {kind: _errors(case) for kind, case in result.noises.items()},
        "errors_bias_removed": {kind: _errors(case) for kind, case in result.centred.items()},
        "tau0": {
            f"{tau0:g}": {
                **_both("rmse", rmse(run), "_m"),
                "interval_s": intervals(run).mean(axis=0),
                "mean_interval_s": float(intervals(run).mean()),
                "true_end_m": run.truth[:, -1].mean(axis=0),
            }
            for tau0, run in result.tau0.items()
        },
        "findings": {
            "loud_noise": [
                {
                    "noise": case.noise.kind,
                    "range_m": case.noise.range_m,
                    "bearing_rad": case.noise.bearing_rad,
                    "start_sigma": WIDE_P0_SIGMA if case.wide_start else P0_SIGMA,
                    "interval_s": case.interval_s,
                    "collapsed": case.collapsed,
                }
                for case in result.loud
            ],
            "constant_offset": [asdict(case) for case in result.offsets],
            "growing_offset": [asdict(case) for case in result.growths],
            "correlations": {
                kind: asdict(reaction(case.aukf)) for kind, case in result.noises.items()
            },
            "start_interval": [asdict(case) for case in result.starts],
            "float32_difference_m": result.float32_difference_m,
        },
        "assumptions": [asdict(one) for one in ASSUMPTIONS],
    }


def _both(name: str, estimate: Estimate, unit: str = "") -> dict[str, float]:
    value, error = f"{name}{unit}", f"{name}_standard_error{unit}"
    return {value: estimate.value, error: estimate.standard_error}


def _errors(case: Comparison) -> dict[str, Any]:
    aukf = _both("aukf_rmse", rmse(case.aukf), "_m")
    return {
        **_both("ukf_rmse", rmse(case.ukf), "_m"),
        **aukf,
        **_both("aukf_excess", excess(case.aukf, case.ukf)),
        "ukf_rmse_x_m": rmse(case.ukf, 0).value,
        "aukf_rmse_x_m": rmse(case.aukf, 0).value,
        "ekf_rmse_m": rmse(case.ekf).value,
        "ukf_nees": float(case.ukf.nees.mean()),
        "aukf_nees": float(case.aukf.nees.mean()),
        "mean_interval_s": float(intervals(case.aukf).mean()),
        "runs": len(case.aukf.x),
        "equal_rate": {
            **_both("ukf_rmse", rmse(case.equal_rate), "_m"),
            **aukf,
            **_both("aukf_excess", excess(case.aukf, case.equal_rate)),
            "interval_s": float(intervals(case.equal_rate).mean()),
            "over_time": {
                "ukf_rmse_m": rmse_over_time(case.equal_rate).value,
                "aukf_rmse_m": rmse_over_time(case.aukf).value,
                **_both("aukf_excess", excess_over_time(case.aukf, case.equal_rate)),
            },
        },
        "same_time": {
            **_both("ukf_rmse", rmse(case.same_time), "_m"),
            "samples": case.same_time.x.shape[1],
        },
    }


# CSV.


def tables(result: Reproduction) -> dict[str, dict[str, Floats]]:
    """Collect the numbers of Figs 1 to 10, columns by file stem."""
    uniform, normal = result.noises["uniform"], result.noises["normal"]
    pace, table1 = intervals(normal.aukf), intervals(result.table1)
    files = {
        "fig01": _track_table(uniform.ukf),
        "fig02": _track_table(uniform.aukf),
        "fig03": {
            "step": _steps(),
            "ukf_interval_s": intervals(normal.ukf).mean(axis=0),
            "aukf_interval_s": pace.mean(axis=0),
            "aukf_interval_p05_s": np.quantile(pace, 0.05, axis=0),
            "aukf_interval_p95_s": np.quantile(pace, 0.95, axis=0),
            "aukf_interval_one_run_s": pace[0],
            "table1_interval_s": table1.mean(axis=0),
        },
    }
    for number, tau0 in enumerate(TAU0_STUDIED, start=4):
        files[f"fig{number:02d}"] = _track_table(result.tau0[tau0])
    for number, kind in enumerate(NOISE_KINDS, start=8):
        case = result.noises[kind]
        files[f"fig{number:02d}"] = {
            "step": _steps() + 1,
            "ukf_error_x_m": case.ukf.error[0, :, 0],
            "aukf_error_x_m": case.aukf.error[0, :, 0],
            "ukf_rms_error_x_m": rms_per_step(case.ukf, 0),
            "aukf_rms_error_x_m": rms_per_step(case.aukf, 0),
            "equal_rate_ukf_rms_error_x_m": rms_per_step(case.equal_rate, 0),
        }
    return files


def rms_per_step(result: TrackingResult, axis: int) -> Floats:
    """Root mean square over runs of the error along one axis, per step, m."""
    return np.asarray(np.sqrt((result.error[..., axis] ** 2).mean(axis=0)))


def _steps() -> Floats:
    return np.arange(STEPS, dtype=np.float64)


def _track_table(result: TrackingResult, run: int = 0) -> dict[str, Floats]:
    seen = observed_positions(result.z[run], paper_station())
    columns = {
        "step": np.arange(1.0, len(seen) + 1),
        "time_s": result.time_s[run],
        "interval_s": intervals(result)[run],
    }
    for name, xy in (
        ("true", result.truth[run]),
        ("observed", seen),
        ("estimated", result.x[run, :, :2]),
    ):
        columns[f"{name}_x_m"], columns[f"{name}_y_m"] = xy[:, 0], xy[:, 1]
    return columns


def paper_station() -> tuple[float, float]:
    """Position of the base station, m: Table 1."""
    return sensor_of(paper_filter("ukf", noise=paper_noise())).station
