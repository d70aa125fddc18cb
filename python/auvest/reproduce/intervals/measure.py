"""The interval policies side by side: ``auvest reproduce intervals``.

Not in the paper. For each track, noise and error budget, the covariance budget runs first; the
other policies are then set so that they take as many samples in the same time, and all are judged
on the plane (error, samples per second) and by the time that the error spends above the budget.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import hypot
from typing import Any

import numpy as np

from auvest import (
    Aukf,
    ConstantAcceleration,
    CovarianceBudget,
    FixedInterval,
    MahalanobisInterval,
    RangeBearing,
)
from auvest.intervals import IntervalPolicy
from auvest.reproduce.ticks import Ticks
from auvest.simulation._runs import standard_error
from auvest.simulation.tracking import Noise, Scenario, Track, TrackingResult, simulate

DEFAULT_RUNS = 200
DEFAULT_SEED = 1

#: The error budget over the standard deviation that the policy keeps: two sigma.
BUDGET_SIGMAS = 2.0
DURATION_S = 120.0
PROBE_PERIOD_S = 0.1
MIN_S, MAX_S = 0.1, 3.0
#: A start as uncertain as this, and drawn from it: m, m/s, m/s^2.
P0_SIGMA = (0.5, 0.1, 0.02)
#: Standard deviations of the noise, whatever its kind: m, rad.
NOISE_SIGMA = (0.05, 0.01)
#: How far the vehicle wanders from its desired track, m, and in what time, s.
WANDER_M, WANDER_PERIOD_S = 0.5, 30.0
#: RMSE above the best of the policies by at most this much counts as level.
LEVEL = 0.02

TRACKS: Mapping[str, Track] = {
    "near, straight": Track(
        kind="straight", position=(-30.0, 8.0), velocity=(0.6, 0.0), acceleration=(0.0, 0.0)
    ),
    "near, turning": Track(
        kind="turn", position=(6.0, 2.0), velocity=(0.0, 0.8), turn_rate=0.05
    ),
    "far, straight": Track(
        kind="straight", position=(60.0, 20.0), velocity=(0.8, 0.4), acceleration=(0.0, 0.0)
    ),
    "far, turning": Track(
        kind="turn", position=(60.0, 2.0), velocity=(0.0, -1.5), turn_rate=0.03
    ),
}  # fmt: skip
#: Standard deviations to keep, m.
BUDGETS: Mapping[str, tuple[float, ...]] = {
    "near": (0.12, 0.18, 0.25),
    "far": (0.30, 0.45, 0.70),
}
NOISES = ("normal", "uniform", "lognormal")

#: The policies, in the order of the tables.
POLICIES = ("budget", "fixed", "law", "law_truth")
NAMES: Mapping[str, str] = {
    "budget": "covariance budget",
    "fixed": "fixed interval",
    "law": "the paper's law",
    "law_truth": "the law, shown the truth",
}


@dataclass(frozen=True)
class Figures:
    """How a policy did."""

    interval_s: float
    rmse_m: float
    above: float
    above_error: float  # standard error of `above`
    failed: int


@dataclass(frozen=True)
class Case:
    """One track, noise and budget: what each policy made of it."""

    track: str
    noise: str
    sigma_m: float
    policies: dict[str, Figures]

    @property
    def rivals(self) -> list[Figures]:
        """The policies that the covariance budget is measured against."""
        return [self.policies["fixed"], self.policies["law"]]

    @property
    def less_time_above(self) -> bool:
        """Whether the covariance budget spends less time above the error budget than both."""
        return all(self.policies["budget"].above < rival.above for rival in self.rivals)

    @property
    def clearly_less(self) -> bool:
        """Whether the time above is less than both by more than two standard errors."""
        own = self.policies["budget"]
        return all(
            rival.above - own.above > 2 * hypot(rival.above_error, own.above_error)
            for rival in self.rivals
        )

    @property
    def rmse_ratio(self) -> float:
        """RMSE of the covariance budget over the best of the three."""
        budget = self.policies["budget"].rmse_m
        return budget / min(budget, *(rival.rmse_m for rival in self.rivals))

    @property
    def dominates(self) -> bool:
        """Less time above, and an RMSE that is the best or level with it."""
        return self.less_time_above and self.rmse_ratio <= 1 + LEVEL


@dataclass(frozen=True)
class Reproduction:
    """All that was measured; after Ctrl-C only the first of the points."""

    runs: int
    seed: int
    cases: list[Case]

    @property
    def unfinished(self) -> str:
        """What there is if it is not all, in words."""
        done, total = len(self.cases), len(points())
        return f"{done} of {total} points" if done < total else ""

    @property
    def failed_runs(self) -> int:
        """Runs that ended with a status other than ok."""
        return sum(f.failed for case in self.cases for f in case.policies.values())


def points() -> list[tuple[str, str, float]]:
    """Return all points to measure: track, noise, standard deviation to keep (m)."""
    return [
        (track, noise, sigma)
        for track in TRACKS
        for noise in NOISES
        for sigma in BUDGETS[track.split(",")[0]]
    ]


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Compare the policies at all points; Ctrl-C keeps those that are done.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each policy at each point.
    seed : int
        Seed.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in points.
    """
    cases: list[Case] = []
    tick = Ticks(len(points()), progress)
    try:
        for point in points():
            cases.append(measure_case(*point, runs=runs, seed=seed, workers=workers))
            tick()
    except KeyboardInterrupt:
        if not cases:
            raise
    return Reproduction(runs, seed, cases)


def measure_case(
    name: str,
    kind: str,
    sigma_m: float,
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    workers: int | None = None,
) -> Case:
    """Compare the policies at one point of :func:`points`.

    Parameters
    ----------
    name, kind, sigma_m
        The point.
    runs : int
        Monte Carlo runs of each policy.
    seed : int
        Seed; all policies meet the same starts and draw from the same streams.
    workers : int, optional
        Threads.
    """
    straight = TRACKS[name]
    steered = replace(straight, wander_m=WANDER_M, wander_period_s=WANDER_PERIOD_S)
    unit = Noise(kind=kind, range_m=1.0, bearing_rad=1.0)  # type: ignore[arg-type]
    noise = replace(
        unit,
        range_m=NOISE_SIGMA[0] / unit.standard_deviation[0],
        bearing_rad=NOISE_SIGMA[1] / unit.standard_deviation[1],
        centred=True,
    )

    def fly(policy: IntervalPolicy, track: Track = steered, count: int = runs) -> TrackingResult:
        return simulate(
            _filter(track, policy),
            Scenario(
                track=track,
                noise=noise,
                steps=round(DURATION_S / MIN_S) * 4,
                duration_s=DURATION_S,
                runs=count,
                seed=seed,
                random_start=True,
                probe_period_s=PROBE_PERIOD_S,
                budget_m=BUDGET_SIGMAS * sigma_m,
            ),
            workers=workers,
        )

    budget = fly(
        CovarianceBudget(position_sigma_m=sigma_m, min_s=MIN_S, max_s=MAX_S, initial_s=0.5)
    )
    interval_s = budget.mean_interval_s

    def law_at_that_rate(track: Track) -> TrackingResult:
        # The law's mean interval grows with T_max: bisect its logarithm on few runs.
        low, high = np.log(0.1 * interval_s), np.log(10 * interval_s)
        for _ in range(9):
            middle = 0.5 * (low + high)
            if fly(_law(np.exp(middle)), track, min(runs, 20)).mean_interval_s > interval_s:
                high = middle
            else:
                low = middle
        return fly(_law(np.exp(0.5 * (low + high))), track)

    return Case(
        name,
        kind,
        sigma_m,
        {
            "budget": _figures(budget),
            "fixed": _figures(fly(FixedInterval(interval_s=interval_s))),
            "law": _figures(law_at_that_rate(steered)),
            "law_truth": _figures(law_at_that_rate(straight)),
        },
    )


def _law(max_s: float) -> MahalanobisInterval:
    return MahalanobisInterval(max_s=max_s, min_s=min(MIN_S, max_s / 20), initial_s=min(0.5, max_s))


def _filter(track: Track, policy: IntervalPolicy) -> Aukf:
    return Aukf(
        np.array(track.start),
        np.diag(np.repeat(np.square(P0_SIGMA), 2)),
        process=ConstantAcceleration(),
        sensors=RangeBearing(sigma_range_m=NOISE_SIGMA[0], sigma_bearing_rad=NOISE_SIGMA[1]),
        policy=policy,
        alpha=1e-3,
    )


def _figures(result: TrackingResult) -> Figures:
    return Figures(
        interval_s=result.mean_interval_s,
        rmse_m=result.rmse_over_time_m,
        above=result.time_above_budget,
        above_error=standard_error(result.probe_above / result.probe_count),
        failed=int(result.failed.sum()),
    )


def summary(result: Reproduction) -> dict[str, Any]:
    """Return the machine-readable result."""
    return {
        "runs": result.runs,
        "seed": result.seed,
        "budget_sigmas": BUDGET_SIGMAS,
        "cases": [
            {
                "track": case.track,
                "noise": case.noise,
                "error_budget_m": BUDGET_SIGMAS * case.sigma_m,
                **{
                    name: {
                        "mean_interval_s": f.interval_s,
                        "samples_per_s": 1 / f.interval_s,
                        "rmse_m": f.rmse_m,
                        "time_above_budget": f.above,
                        "time_above_budget_standard_error": f.above_error,
                        "failed_runs": f.failed,
                    }
                    for name, f in case.policies.items()
                },
                "less_time_above": case.less_time_above,
                "rmse_over_best": case.rmse_ratio,
                "dominates": case.dominates,
            }
            for case in result.cases
        ],
    }
