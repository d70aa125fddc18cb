"""The experiments behind ``auvest reproduce slatf`` (Lu, Chen, Liu, Ma, He 2020, section 7).

:func:`measure` runs them, :func:`summary` is their machine-readable result, :func:`tables` are the
numbers of the figures. The page that judges the paper's claims is made in
:mod:`auvest.reproduce.slatf.page`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from auvest.reproduce.estimate import Estimate, Floats
from auvest.simulation._runs import standard_error
from auvest.simulation.paper_aukf import DTypeName
from auvest.simulation.paper_slatf import (
    ASSUMPTIONS,
    FILTERS,
    LEVELS,
    PARTICLES,
    RUNS,
    FilterName,
    Level,
    paper_filter,
    paper_scenario,
)
from auvest.simulation.slat import SlatResult, SlatScenario, simulate

DEFAULT_RUNS = RUNS
DEFAULT_SEED = 1
DEFAULT_PARTICLES = PARTICLES
DEFAULT_DTYPE: DTypeName = "float32"

#: Filters that do not hear the sonar: the noise level does not matter to them.
DEAF: tuple[FilterName, ...] = ("dr", "dr_compensated")
#: The level whose 2.0 the paper has at 17.6 m.
BEST_LEVEL = LEVELS[3]
#: Particles of the variant with more of them.
MANY = 1000
#: q tried where the filter does not know the master's plan, m/s^2.
UNPLANNED_M_S2 = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


@dataclass(frozen=True)
class Variant:
    """The best level with one assumption changed."""

    what: str
    rmse: dict[FilterName, Estimate]


@dataclass(frozen=True)
class Reproduction:
    """Everything measured; the results keep all runs."""

    runs: int
    particles: int
    seed: int
    dtype: DTypeName
    levels: dict[int, dict[FilterName, SlatResult]]
    variants: tuple[Variant, ...]

    @property
    def failed_runs(self) -> int:
        """Runs whose status is not ok, all levels and filters."""
        return sum(int(one.failed.sum()) for row in self.levels.values() for one in row.values())


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    particles: int = DEFAULT_PARTICLES,
    seed: int = DEFAULT_SEED,
    dtype: DTypeName = DEFAULT_DTYPE,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Run all experiments.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each.
    particles : int
        N of SLATF 1.0, 2.0 and joint.
    seed : int
        Each level draws its own noise from it, which all filters of the level meet.
    dtype : {"float32", "float64"}
        Precision of the filters; float32 runs in vector lanes and gives the vehicle's bits.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in runs.
    """
    jobs = len(LEVELS) * len(FILTERS) + _VARIANT_JOBS
    done = 0

    def fly(name: FilterName, scenario: SlatScenario, **changes: Any) -> SlatResult:
        nonlocal done
        options = {"particles": particles, "dtype": dtype, **changes}
        prototype = paper_filter(name, scenario, **options)
        report = None
        if progress is not None:
            report = lambda part, _: progress(done + part, jobs * runs)  # noqa: E731
        result = simulate(prototype, scenario, workers=workers, progress=report)
        done += runs
        return result

    levels: dict[int, dict[FilterName, SlatResult]] = {}
    for level in LEVELS:
        scenario = paper_scenario(level, runs=runs, seed=seed)
        levels[level.number] = {name: fly(name, scenario) for name in FILTERS}
    variants = _variants(levels, paper_scenario(BEST_LEVEL, runs=runs, seed=seed), fly)
    return Reproduction(
        runs=runs,
        particles=particles,
        seed=seed,
        dtype=dtype,
        levels=levels,
        variants=tuple(variants),
    )


#: Simulations of _variants().
_VARIANT_JOBS = 2 + 3 + 2 * 2 + 3 + 1 + len(UNPLANNED_M_S2)


def _variants(
    levels: dict[int, dict[FilterName, SlatResult]],
    scenario: SlatScenario,
    fly: Callable[..., SlatResult],
) -> Iterable[Variant]:
    """Change the assumptions one by one at the best level."""
    listeners: tuple[FilterName, ...] = ("slatf1", "slatf2", "ekf_slat")
    done = levels[BEST_LEVEL.number]
    yield Variant("R1", {name: rmse(done[name]) for name in listeners})
    yield Variant(
        f"N = {MANY}",
        {name: rmse(fly(name, scenario, particles=MANY)) for name in ("slatf1", "slatf2")},
    )
    yield Variant(
        "bias of the heading's noise left in, as in the paper",
        {name: rmse(fly(name, scenario, compensate_bias=False)) for name in listeners},
    )
    for sigma in (0.02, 0.5):
        changed = replace(scenario, prior_velocity_m_s=sigma)
        yield Variant(
            f"master's velocity told to {sigma:g} m/s instead of {scenario.prior_velocity_m_s:g}",
            {name: rmse(fly(name, changed)) for name in ("slatf2", "ekf_slat")},
        )
    slow = replace(scenario, odometry_s=2.0, odometry_per_ping=1)
    yield Variant(
        "readings every 2 s instead of 1 s", {name: rmse(fly(name, slow)) for name in listeners}
    )
    yield Variant(
        "covariance of the pose carried, Eq. (50)",
        {"slatf2": rmse(fly("slatf2", scenario, carry_covariance=True))},
    )
    unplanned = replace(scenario, plan_known=False)
    tried = {q: rmse(fly("ekf_slat", unplanned, acceleration_m_s2=q)) for q in UNPLANNED_M_S2}
    best = min(tried, key=lambda q: tried[q].value)
    yield Variant(
        f"u(k) of the master unknown; q = {best:g} m/s^2, the best of "
        + ", ".join(f"{q:g}" for q in UNPLANNED_M_S2),
        {"ekf_slat": tried[best]},
    )


# Quantities of a Monte Carlo result.


def rmse(result: SlatResult) -> Estimate:
    """Take the paper's RMSE: per run over time, averaged over the runs, m."""
    return Estimate(result.rmse_m, result.rmse_standard_error_m)


def difference(a: SlatResult, b: SlatResult) -> Estimate:
    """RMSE of a less that of b, m; the runs are paired, they share their random numbers."""
    apart = a.run_rmse_m - b.run_rmse_m
    return Estimate(float(apart.mean()), standard_error(apart))


def mean_error(result: SlatResult) -> float:
    """Mean distance between estimate and truth, over pings and runs, m."""
    return float(result.distance_m.mean())


def error_variance(result: SlatResult) -> float:
    """Variance of that distance, m^2."""
    return float(result.distance_m.var())


def rms_per_ping(result: SlatResult) -> Floats:
    """Root mean square error over the runs at each ping, m."""
    return np.sqrt(np.square(result.distance_m).mean(axis=0))


# Machine-readable result.


def table1(result: Reproduction) -> list[dict[str, Any]]:
    """Table 1 and the levels that Fig. 6 adds: one object per level, RMSE in m."""
    return [_table1_row(result, level) for level in LEVELS]


def _table1_row(result: Reproduction, level: Level) -> dict[str, Any]:
    row = {name: rmse(one) for name, one in result.levels[level.number].items()}
    return {
        "level": level.number,
        "sigma_r": level.sigma_range_m,
        "sigma_theta": level.sigma_bearing_rad,
        **{name: value.value for name, value in row.items()},
        "se": {name: value.standard_error for name, value in row.items()},
        "paper": None if level.paper is None else dict(level.paper),
        "runs": result.runs,
        "particles": result.particles,
    }


def summary(result: Reproduction) -> dict[str, Any]:
    """Make the JSON of ``auvest reproduce slatf --json``, without the claims."""
    return {
        "runs": result.runs,
        "particles": result.particles,
        "seed": result.seed,
        "dtype": result.dtype,
        "failed_runs": result.failed_runs,
        "table1": table1(result),
        "errors": {
            str(number): {
                name: {
                    "mean_error_m": mean_error(one),
                    "error_variance_m2": error_variance(one),
                    "covered_95": one.covered,
                    "resamplings": float(one.resamplings.mean()),
                }
                for name, one in row.items()
            }
            for number, row in result.levels.items()
        },
        "variants": [
            {"what": one.what, "rmse": {name: asdict(e) for name, e in one.rmse.items()}}
            for one in result.variants
        ],
        "assumptions": [asdict(one) for one in ASSUMPTIONS],
    }


#: The levels of the figures, Fig. 6's in the order of falling noise.
FIG3_LEVELS = (1, 2, 3, 4)
FIG4_LEVELS = (1, 3)
FIG5_LEVELS = (2, 4)
FIG6_LEVELS = (5, 3, 6, 4, 7)


def tables(result: Reproduction) -> dict[str, dict[str, Floats]]:
    """Make the numbers of Figs 2 to 6 and of Table 1, columns by name."""
    return {
        "fig02": _tracks(result),
        "fig03": _over_levels(result, FIG3_LEVELS),
        "fig04": _over_time(result, FIG4_LEVELS),
        "fig05": _over_time(result, FIG5_LEVELS),
        "fig06": _over_levels(result, FIG6_LEVELS),
        "table1": _table1(result),
    }


def _tracks(result: Reproduction) -> dict[str, Floats]:
    any_run = result.levels[1]["dr"]
    columns = {"time_s": any_run.time_s}
    for name, track in (("slave", any_run.truth), ("master", any_run.masters[:, 0])):
        columns[f"{name}_x_m"], columns[f"{name}_y_m"] = track[:, 0], track[:, 1]
    return columns


def _over_levels(result: Reproduction, numbers: tuple[int, ...]) -> dict[str, Floats]:
    columns = {
        "level": np.array(numbers, float),
        "sigma_range_m": np.array([LEVELS[n - 1].sigma_range_m for n in numbers]),
        "sigma_bearing_rad": np.array([LEVELS[n - 1].sigma_bearing_rad for n in numbers]),
    }
    for name in FILTERS:
        row = [result.levels[n][name] for n in numbers]
        columns[f"{name}_rmse_m"] = np.array([rmse(one).value for one in row])
        columns[f"{name}_mean_error_m"] = np.array([mean_error(one) for one in row])
        columns[f"{name}_error_variance_m2"] = np.array([error_variance(one) for one in row])
    return columns


def _table1(result: Reproduction) -> dict[str, Floats]:
    """Give our RMSE with its standard error, and the paper's, at its levels."""
    levels = [level for level in LEVELS if level.paper]
    columns = {"level": np.array([level.number for level in levels], float)}
    for name in FILTERS:
        ours = [rmse(result.levels[level.number][name]) for level in levels]
        columns[f"{name}_rmse_m"] = np.array([one.value for one in ours])
        columns[f"{name}_rmse_se_m"] = np.array([one.standard_error for one in ours])
        paper = [(level.paper or {}).get(name, np.nan) for level in levels]
        if not np.isnan(paper).all():
            columns[f"{name}_paper_rmse_m"] = np.array(paper)
    return columns


def _over_time(result: Reproduction, numbers: tuple[int, ...]) -> dict[str, Floats]:
    columns = {"time_s": result.levels[1]["dr"].time_s}
    for name in FILTERS:
        if name in DEAF:
            columns[f"{name}_rms_error_m"] = rms_per_ping(result.levels[numbers[0]][name])
            continue
        for n in numbers:
            columns[f"{name}_level{n}_rms_error_m"] = rms_per_ping(result.levels[n][name])
    return columns
