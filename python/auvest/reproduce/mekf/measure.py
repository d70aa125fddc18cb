"""The experiments behind ``auvest reproduce mekf`` (Li, Du, Fan, Chen, Mao, Luo 2020).

The paper's lake experiment cannot be repeated: neither its data nor its sensors' values are given.
What is reproduced is its setting (:mod:`auvest.simulation.cooperative`) and its claim.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from auvest import (
    Aukf,
    ConstantAcceleration,
    Hampel,
    Huber,
    Igg,
    RangeBearing,
    RejectionStreak,
    Unit,
    metrics,
)
from auvest.kernels import Kernel
from auvest.reproduce.estimate import Estimate, Floats
from auvest.reproduce.ticks import Ticks
from auvest.simulation import cooperative, matched
from auvest.simulation.cooperative import RangeNoise, Result, Scenario, Timing, slave_filter

DEFAULT_RUNS = 50
DEFAULT_SEED = 1

#: The filters by the names in tables; "ekf" has no kernel.
KERNELS: Mapping[str, Kernel] = {"ekf": Unit(), "igg": Igg(), "huber": Huber(), "hampel": Hampel()}

#: The filters by the names in figures.
LABELS: Mapping[str, str] = {
    "ekf": "EKF",
    "igg": "M-EKF (IGG)",
    "huber": "Huber",
    "hampel": "Hampel",
    "ukf": "UKF",
    "aukf": "AUKF",
}

#: Fraction of outliers and their standard deviation (m), with the RMSE (m) of the reference: a
#: prototype of the same case with other random numbers, 20 runs.
CONTAMINATION: Mapping[tuple[float, float], Mapping[str, float]] = {
    (0.0, 10.0): {"ekf": 0.95, "igg": 0.97, "huber": 0.96},
    (0.05, 10.0): {"ekf": 1.63, "igg": 0.99, "huber": 1.00},
    (0.1, 10.0): {"ekf": 2.19, "igg": 1.00, "huber": 1.05},
    (0.2, 10.0): {"ekf": 2.97, "igg": 1.03, "huber": 1.14},
    (0.1, 30.0): {"ekf": 6.04, "igg": 0.99, "huber": 1.06},
}

#: The case of the paper's figures: 5 % at 10 sigma, ranges as its messages bring them.
FIGURE_NOISE = RangeNoise(outlier_fraction=0.05)
#: Width of the bins of the error over time, steps.
BIN = 120
#: Steps between the rows of the tracks' table.
TRACK_STEP = 10

#: Other worlds, all with ranges at their own time.
WORLDS: Mapping[str, Scenario] = {
    "clean": Scenario(timing="own-time"),
    "multipath, 10 % late by 30 m": Scenario(
        timing="own-time",
        noise=RangeNoise(kind="multipath", outlier_fraction=0.1, outlier_sigma_m=30.0),
    ),
    "Student's t, 3 degrees of freedom": Scenario(
        timing="own-time", noise=RangeNoise(kind="student")
    ),
    "5 %, half of the messages lost": Scenario(timing="own-time", noise=FIGURE_NOISE, dropout=0.5),
    "5 %, half of the messages late": Scenario(timing="own-time", noise=FIGURE_NOISE, late=0.5),
}

#: Errors of Q and R, as factors, that the NEES and the NIS must see; (1, 1) is none.
FACTORS = ((1.0, 1.0), (4.0, 1.0), (0.25, 1.0), (1.0, 4.0), (1.0, 0.25))
CONSISTENCY_RUNS = 200
CONSISTENCY_STEPS = 1500

#: Error of the start that the filter does not know of, m.
DISPLACEMENT_M = 200.0
DISPLACED_RUNS = 96
DISPLACED_STEPS = 1000
DIRECTIONS = 12


@dataclass(frozen=True)
class Score:
    """One filter in one world."""

    rmse_m: float
    standard_error_m: float
    rejected: float
    recoveries: int
    too_late: int
    failed_runs: int

    @property
    def rmse(self) -> Estimate:
        """Both as one, m."""
        return Estimate(self.rmse_m, self.standard_error_m)


@dataclass(frozen=True)
class Judged:
    """NEES and NIS of one filter with its noise multiplied by these factors."""

    filter: str
    q_factor: float
    r_factor: float
    nees: metrics.Consistency
    nis: metrics.Consistency


@dataclass(frozen=True)
class Displaced:
    """Runs that start 200 m off, in all directions, with P0 as if they did not.

    Attributes
    ----------
    back : int
        Runs that were within 3 sigma after at most 12 ranges.
    slowest : int or None
        Ranges until the last run was within 3 sigma; None if one never was.
    settled : int
        Runs whose median NEES over the second half is within 3 sigma.
    median_end_m, rmse_end_m : float
        Error over the second half, m.
    """

    back: int
    slowest: int | None
    settled: int
    median_end_m: float
    rmse_end_m: float


@dataclass(frozen=True)
class OverTime:
    """RMS error of the filters in bins of time, and one run's tracks."""

    time_h: Floats
    rms_m: dict[str, Floats]
    slave: Floats
    leaders: Floats
    errors: dict[str, Floats]

    @property
    def improvement(self) -> Floats:
        """Share by which IGG is better than the EKF."""
        return 1 - self.rms_m["igg"] / self.rms_m["ekf"]


@dataclass(frozen=True)
class Reproduction:
    """Everything measured."""

    runs: int
    seed: int
    contamination: dict[tuple[float, float], dict[str, Score]]
    timing: dict[Timing, dict[str, Score]]
    worlds: dict[str, dict[str, Score]]
    over_time: OverTime
    consistency: list[Judged]
    displaced: dict[str, Displaced]
    displaced_runs: int

    @property
    def improvement(self) -> float:
        """Share by which IGG is better than the EKF at 5 % of outliers."""
        row = self.contamination[(0.05, 10.0)]
        return 1 - row["igg"].rmse_m / row["ekf"].rmse_m

    @property
    def loss(self) -> float:
        """Share by which IGG is worse than the EKF without outliers."""
        row = self.contamination[(0.0, 10.0)]
        return row["igg"].rmse_m / row["ekf"].rmse_m - 1

    @property
    def failed_runs(self) -> int:
        """Runs that ended with a status other than ok."""
        tables = (self.contamination, self.timing, self.worlds)
        return sum(
            s.failed_runs for table in tables for row in table.values() for s in row.values()
        )


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    steps: int = cooperative.PAPER_STEPS,
    consistency_runs: int = CONSISTENCY_RUNS,
    displaced_runs: int = DISPLACED_RUNS,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Run all experiments.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each world.
    seed : int
        Seed of the noise; every experiment uses the same.
    steps : int
        Steps of 1 s of each run.
    consistency_runs, displaced_runs : int
        Runs of the two experiments that are not about the RMSE.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in experiments.
    """
    total = (len(CONTAMINATION) + len(cooperative.TIMINGS) + len(WORLDS)) * len(KERNELS)
    tick = Ticks(total + 4 * len(FACTORS) + 3, progress)

    def fly(name: str, scenario: Scenario) -> Result:
        world = {**vars(scenario), "runs": runs, "seed": seed, "steps": steps}
        result = cooperative.simulate(
            slave_filter(KERNELS[name]), Scenario(**world), workers=workers
        )
        tick()
        return result

    def row(scenario: Scenario) -> dict[str, Score]:
        return {name: score(fly(name, scenario)) for name in KERNELS}

    contamination = {
        key: row(Scenario(noise=RangeNoise(outlier_fraction=key[0], outlier_sigma_m=key[1])))
        for key in CONTAMINATION
    }
    timing: dict[Timing, dict[str, Score]] = {}
    figures: dict[str, Result] = {}
    for kind in cooperative.TIMINGS:
        results = {name: fly(name, Scenario(timing=kind, noise=FIGURE_NOISE)) for name in KERNELS}
        timing[kind] = {name: score(result) for name, result in results.items()}
        if kind == "own-time":
            figures = {name: results[name] for name in ("ekf", "igg")}
    return Reproduction(
        runs=runs,
        seed=seed,
        contamination=contamination,
        timing=timing,
        worlds={name: row(scenario) for name, scenario in WORLDS.items()},
        over_time=over_time(figures),
        consistency=consistency(consistency_runs, seed, workers, tick),
        displaced=displaced(displaced_runs // DIRECTIONS, seed, workers, tick),
        displaced_runs=displaced_runs // DIRECTIONS * DIRECTIONS,
    )


def score(result: Result) -> Score:
    """Reduce a simulation to the numbers of a table."""
    taken = result.weight[~np.isnan(result.weight)]
    return Score(
        rmse_m=result.rmse_m,
        standard_error_m=result.rmse_standard_error_m,
        rejected=float((taken == 0).mean()) if taken.size else float("nan"),
        recoveries=int(result.recoveries.sum()),
        too_late=int(result.too_late.sum()),
        failed_runs=int(result.failed.sum()),
    )


def over_time(results: dict[str, Result]) -> OverTime:
    """Reduce the runs of Figs 5 and 6."""
    steps = results["ekf"].error.shape[1]
    width = min(BIN, steps)
    bins = steps // width
    slave, leaders = cooperative.tracks(steps)
    rms = {}
    for name, result in results.items():
        square = np.square(result.error[:, : bins * width]).sum(axis=-1)
        rms[name] = np.sqrt(square.reshape(len(square), bins, width).mean(axis=(0, 2)))
    return OverTime(
        time_h=(np.arange(bins) + 0.5) * width / 3600,
        rms_m=rms,
        slave=slave,
        leaders=leaders,
        errors={name: result.error[0] for name, result in results.items()},
    )


def consistency(
    runs: int, seed: int, workers: int | None, tick: Callable[[], None]
) -> list[Judged]:
    """Judge NEES and NIS of EKF, UKF, robust EKF and AUKF with right and wrong Q and R."""
    judged = []
    world = Scenario(runs=runs, seed=seed, steps=CONSISTENCY_STEPS, random_start=True)
    for name, kind in (("ekf", "ekf"), ("ukf", "ukf"), ("igg", "ekf")):
        kernel = KERNELS["igg" if name == "igg" else "ekf"]
        for q, r in FACTORS:
            filter_ = slave_filter(kernel, kind=kind, q_factor=q, r_factor=r)  # type: ignore[arg-type]
            result = cooperative.simulate(filter_, world, workers=workers)
            nees = metrics.nees_consistency(result.nees, 2)
            judged.append(Judged(name, q, r, nees, metrics.nis_consistency(result.nis, 1)))
            tick()
    for q, r in FACTORS:
        errors = driven(q, r, runs=runs, seed=seed)
        nees = metrics.nees_consistency(metrics.nees(errors.error, errors.P), 6)
        judged.append(Judged("aukf", q, r, nees, metrics.nis_consistency(errors.nis, 2)))
        tick()
    return judged


def driven(q_factor: float, r_factor: float, *, runs: int, seed: int) -> matched.Errors:
    """Let an AUKF with these errors of Q and R track a vehicle that is driven by noise."""
    psd = {"position_psd": 1e-2, "velocity_psd": 1e-2, "acceleration_psd": 1e-3}
    sigma = {"sigma_range_m": 0.2, "sigma_bearing_rad": 0.01}
    process = ConstantAcceleration(**{k: q_factor * v for k, v in psd.items()})  # type: ignore[arg-type]
    sensor = RangeBearing(**{k: r_factor**0.5 * v for k, v in sigma.items()})
    return matched.simulate(
        lambda x0, p0: Aukf(x0, p0, process=process, sensors=sensor),
        ConstantAcceleration(**psd),  # type: ignore[arg-type]
        RangeBearing(**sigma),  # type: ignore[arg-type]
        x0=[30.0, 10.0, 0.2, 0.1, 0.0, 0.0],
        P0=np.diag([0.25, 0.25, 0.04, 0.04, 0.01, 0.01]),
        steps=40,
        runs=runs,
        seed=seed,
    )


def displaced(
    runs_each: int, seed: int, workers: int | None, tick: Callable[[], None]
) -> dict[str, Displaced]:
    """Start 200 m off in all directions, P0 unchanged, in the two-leader geometry."""
    filters = {
        "igg, recovery": slave_filter("igg"),
        "igg, no recovery": slave_filter("igg", recovery=None),
        "huber": slave_filter("huber", recovery=RejectionStreak()),
    }
    results = {}
    for name, filter_ in filters.items():
        parts = []
        for d in range(DIRECTIONS):
            angle = 2 * np.pi * (d + 0.5) / DIRECTIONS
            world = Scenario(
                runs=runs_each,
                seed=seed + d,
                steps=DISPLACED_STEPS,
                offset_m=(DISPLACEMENT_M * np.cos(angle), DISPLACEMENT_M * np.sin(angle)),
            )
            parts.append(cooperative.simulate(filter_, world, workers=workers))
        results[name] = _displaced(parts)
        tick()
    return results


def _displaced(parts: list[Result]) -> Displaced:
    nees = np.concatenate([part.nees for part in parts])
    weight = np.concatenate([part.weight for part in parts])
    error = np.concatenate([np.hypot(*np.moveaxis(part.error, -1, 0)) for part in parts])
    ranges = np.cumsum(~np.isnan(weight), axis=1)
    within = nees <= 9
    seen = within & (ranges >= 1)
    needed = np.where(seen.any(axis=1), ranges[np.arange(len(seen)), seen.argmax(axis=1)], -1)
    half = nees.shape[1] // 2
    end = error[:, half:]
    return Displaced(
        back=int(((needed > 0) & (needed <= 12)).sum()),
        slowest=int(needed.max()) if (needed > 0).all() else None,
        settled=int((np.median(nees[:, half:], axis=1) <= 9).sum()),
        median_end_m=float(np.median(end)),
        rmse_end_m=float(np.sqrt(np.square(end).mean())),
    )


def summary(result: Reproduction) -> dict[str, Any]:
    """Make the machine-readable result."""
    return {
        "runs": result.runs,
        "seed": result.seed,
        "improvement_at_5_percent": result.improvement,
        "loss_on_clean_data": result.loss,
        "contamination": [
            {
                "fraction": fraction,
                "outlier_sigma": sigma,
                **{name: s.rmse_m for name, s in row.items()},
                "standard_error": {name: s.standard_error_m for name, s in row.items()},
                "reference": dict(CONTAMINATION[fraction, sigma]),
                "runs": result.runs,
            }
            for (fraction, sigma), row in result.contamination.items()
        ],
        "timing": {k: {n: asdict(s) for n, s in row.items()} for k, row in result.timing.items()},
        "worlds": {k: {n: asdict(s) for n, s in row.items()} for k, row in result.worlds.items()},
        "consistency": [
            {
                "filter": j.filter,
                "q_factor": j.q_factor,
                "r_factor": j.r_factor,
                "nees": {**asdict(j.nees), "consistent": j.nees.consistent},
                "nis": {**asdict(j.nis), "consistent": j.nis.consistent},
            }
            for j in result.consistency
        ],
        "displaced": {name: asdict(d) for name, d in result.displaced.items()},
    }


def tables(result: Reproduction) -> dict[str, dict[str, Floats]]:
    """Give the numbers of the figures by file stem."""
    over = result.over_time
    fig05 = {"time_s": np.arange(1.0, len(over.slave) + 1)[::TRACK_STEP]}
    places = {"slave": over.slave, "leader_1": over.leaders[:, 0], "leader_2": over.leaders[:, 1]}
    places.update({name: over.slave + error for name, error in over.errors.items()})
    for name, place in places.items():
        fig05[f"{name}_x_m"], fig05[f"{name}_y_m"] = place[::TRACK_STEP].T
    fig06 = {"time_h": over.time_h}
    fig06.update({f"{name}_rms_error_m": rms for name, rms in over.rms_m.items()})
    fig06["improvement_percent"] = 100 * over.improvement
    kernels = {
        "fraction": np.array([key[0] for key in result.contamination]),
        "outlier_sigma_m": np.array([key[1] for key in result.contamination]),
    }
    for name in KERNELS:
        rows = [row[name] for row in result.contamination.values()]
        kernels[f"{name}_rmse_m"] = np.array([s.rmse_m for s in rows])
        kernels[f"{name}_standard_error_m"] = np.array([s.standard_error_m for s in rows])
    return {"fig05": fig05, "fig06": fig06, "kernels": kernels}
