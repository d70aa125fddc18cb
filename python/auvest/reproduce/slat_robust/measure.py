"""SLAT filters that know how far off they are, and come back: ``auvest reproduce slat-robust``.

SlatfJoint with one covariance beside EKF-SLAT, both as they come: with a gate and recovery. In the
SLATF paper's scenario (configuration R1), over six hours, with echoes at twice the range, with a
master that is lost during a silence; and on the recording mrclam6, where no master's plan is known.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from auvest import EkfSlat, Slatf, SlatfJoint
from auvest._arguments import Floats
from auvest.reproduce.mrclam6 import measure as real
from auvest.reproduce.ticks import Ticks
from auvest.simulation._runs import standard_error
from auvest.simulation.paper_slatf import LEVELS, Level, paper_scenario
from auvest.simulation.slat import SlatResult, SlatScenario, Vehicle, simulate
from auvest.slat import OverconfidenceWarning, SlatFilter, no_harm

__all__ = ["check", "measure", "summary"]

DEFAULT_RUNS = 200
DEFAULT_SEED = 1
PARTICLES = 100
#: Runs of the lock-out, of six hours, and of a particle filter on the recording, as shares of all.
LOCKED_SHARE, HOURS_SHARE, REAL_SHARE = 0.5, 0.25, 0.12

NAMES = {"slatf_joint": "SlatfJoint, one covariance", "ekf_slat": "EKF-SLAT"}
REAL_NAMES = {
    "ekf_slat": "EKF-SLAT, no harm",
    "slatf_joint": "SlatfJoint, one covariance, no harm",
    "slatf2": "SLATF 2.0, no harm",
    "considered": "EKF-SLAT, slave considered",
}
#: Longest gap between sightings and shortest duration of a track, s.
GAPS_S = ((6.0, 15.0), (15.0, 40.0), (30.0, 60.0))

#: What is heard, on level 3: probability of echoes at twice the range, and how many in a row.
WRONG = {
    "clean": (0.0, 1),
    "5 %": (0.05, 1),
    "10 %": (0.1, 1),
    "bursts of 5": (0.01, 5),
}
#: The master turns where nobody hears it, and the slave does not know its plan.
SILENCE_S = (240.0, 300.0)
#: A master whose error relative to the slave is larger at the end is lost, m.
LOST_M = 300.0


def check(*, data: Path | None, **_: object) -> None:
    """Refuse a folder without the recording."""
    if data is not None:
        real.check(data=data)


@dataclass(frozen=True)
class Robust:
    """Everything measured."""

    results: dict[str, Any]


def slat_filter(name: str, scenario: SlatScenario, **options: Any) -> SlatFilter:
    """Set up a filter as it comes: it knows the noise of all sensors."""
    start = np.array([scenario.slave.x_m, scenario.slave.y_m]), np.zeros((2, 2))
    models: dict[str, Any] = {"motion": scenario.motion, "sonar": scenario.sonar, **options}
    if name == "ekf_slat":
        return EkfSlat(*start, **models)
    return SlatfJoint(*start, covariance="shared", particles=PARTICLES, **models)


def six_hours(runs: int, seed: int) -> SlatScenario:
    """Make the scenario in which nothing tells for hours where the pair is.

    The slave goes round on a circle of 60 m, the master stands; an echo every other second.
    """
    return SlatScenario(
        slave=Vehicle(
            x_m=160, heading_rad=np.pi / 2, speed_m_s=0.6, turn_start_s=0, turn_rate_rad_s=0.01
        ),
        masters=(Vehicle(y_m=0, heading_rad=0, speed_m_s=0),),
        duration_s=21_600,
        sigma_speed_m_s=0.1,
        sigma_heading_rad=0.05,
        sigma_range_m=1,
        sigma_bearing_rad=0.03,
        prior_position_m=0.1,
        prior_velocity_m_s=0.01,
        prior_acceleration_m_s2=1e-3,
        runs=runs,
        seed=seed,
    )


def locked_out(runs: int, seed: int, doubled: float) -> SlatScenario:
    """Make the scenario of the silence."""
    level = LEVELS[2]
    return replace(
        paper_scenario(level, runs=runs, seed=seed),
        plan_known=False,
        silent_from_s=SILENCE_S[0],
        silent_to_s=SILENCE_S[1],
        doubled=doubled,
    )


def measure(
    *,
    data: Path | None = None,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Robust:
    """Run all parts.

    Parameters
    ----------
    data : Path, optional
        Where the recording is; None: without it.
    runs : int
        Monte Carlo runs of each filter, at least 8; of the longer parts fewer, see the module.
    seed : int
        Of the noise.
    workers : int, optional
        Threads; default: one per processor.
    progress : callable, optional
        Called as ``progress(parts_done, parts)``.
    """
    parts: list[tuple[str, Callable[[], Any]]] = [
        ("levels", lambda: [_level(level, runs, seed, workers) for level in LEVELS]),
        ("six_hours", lambda: _six_hours(max(2, round(HOURS_SHARE * runs)), seed, workers)),
        ("wrong_echoes", lambda: _wrong_echoes(runs, seed, workers)),
        ("lock_out", lambda: _lock_outs(max(2, round(LOCKED_SHARE * runs)), seed, workers)),
    ]
    if data is not None:
        folder = data
        parts.append(
            ("mrclam6", lambda: _recording(folder, max(2, round(REAL_SHARE * runs)), seed))
        )
    ticks = Ticks(len(parts), progress)
    results: dict[str, Any] = {"runs": runs, "seed": seed, "particles": PARTICLES}
    for name, part in parts:
        results[name] = part()
        ticks()
    return Robust(results)


def figures_of(result: SlatResult) -> dict[str, float]:
    """Give RMSE, NEES and coverage of the slave, and what was refused."""
    return {
        "rmse_m": result.rmse_m,
        "standard_error_m": standard_error(result.run_rmse_m),
        "worst_m": float(result.run_rmse_m.max()),
        "nees": float(np.nanmean(result.nees)),
        "covered": result.covered,
        "refused": float(result.refused.sum() / max(1, result.heard.sum())),
        "rebirths": int(result.rebirths.sum()),
        "echoes": int(result.heard.sum()),
        "failed_runs": int(result.failed.sum()),
    }


def _fly(scenario: SlatScenario, workers: int | None) -> dict[str, SlatResult]:
    return {
        name: simulate(slat_filter(name, scenario), scenario, workers=workers) for name in NAMES
    }


def _level(level: Level, runs: int, seed: int, workers: int | None) -> dict[str, Any]:
    scenario = paper_scenario(level, runs=runs, seed=seed)
    found = {name: figures_of(result) for name, result in _fly(scenario, workers).items()}
    return {
        "number": level.number,
        "sigma_range_m": level.sigma_range_m,
        "sigma_bearing_rad": level.sigma_bearing_rad,
        "filters": found,
        "ratio": found["slatf_joint"]["rmse_m"] / found["ekf_slat"]["rmse_m"],
    }


def _six_hours(runs: int, seed: int, workers: int | None) -> dict[str, Any]:
    results = _fly(six_hours(runs, seed), workers)
    found = {name: figures_of(result) for name, result in results.items()}
    worst = results["slatf_joint"].run_rmse_m / results["ekf_slat"].run_rmse_m
    return {
        "runs": runs,
        "filters": found,
        "ratio": found["slatf_joint"]["rmse_m"] / found["ekf_slat"]["rmse_m"],
        "worst_ratio": float(worst.max()),
    }


def _wrong_echoes(runs: int, seed: int, workers: int | None) -> dict[str, Any]:
    clean = paper_scenario(LEVELS[2], runs=runs, seed=seed)
    rows: dict[str, Any] = {}
    for case, (doubled, in_a_row) in WRONG.items():
        scenario = replace(clean, doubled=doubled, doubled_in_a_row=in_a_row)
        rows[case] = {
            name: {**figures_of(result), "relative_rmse_m": float(relative(result).mean())}
            for name, result in _fly(scenario, workers).items()
        }
    return rows


def relative(result: SlatResult) -> Floats:
    """RMSE of the master's position relative to the slave's of each run, m."""
    apart = result.master_error[:, :, 0] - result.error
    return np.sqrt(np.square(apart).sum(axis=-1).mean(axis=1))


def _lock_outs(runs: int, seed: int, workers: int | None) -> dict[str, Any]:
    rows: dict[str, Any] = {}
    for case, doubled, recover in (
        ("without recovery", 0.0, False),
        ("with recovery", 0.0, True),
        ("with recovery, 10 % at twice the range", 0.1, True),
    ):
        scenario = locked_out(runs, seed, doubled)
        rows[case] = {}
        for name in NAMES:
            options = {} if recover else {"recover_after": 0}
            result = simulate(slat_filter(name, scenario, **options), scenario, workers=workers)
            apart = result.master_error[:, :, 0] - result.error
            last = np.hypot(apart[:, -30:, 0], apart[:, -30:, 1])  # the last minute
            rows[case][name] = {
                "runs": runs,
                "found_again": int((last[:, -1] < LOST_M).sum()),
                "last_minute_m": float(np.sqrt(np.square(last).mean())),
                "rebirths_per_run": float(result.rebirths.mean()),
                "slave_rmse_m": result.rmse_m,
            }
    return rows


def real_filter(name: str, track: real.Track, seed: int) -> SlatFilter:
    """Set up a filter for a track of the recording, with what does no harm, and its master."""
    start, none = track.slave_truth[0], np.zeros((3, 3))
    options: dict[str, Any] = {"motion": real.MOTION, "sonar": real.SONAR, **no_harm()}
    if name == "ekf_slat":
        filter_: SlatFilter = EkfSlat(start, none, **options)
    elif name == "considered":
        filter_ = EkfSlat(start, none, consider=True, **options)
    elif name == "slatf_joint":
        filter_ = SlatfJoint(
            start, none, covariance="shared", particles=PARTICLES, seed=seed, **options
        )
    else:
        filter_ = Slatf(start, none, particles=PARTICLES, seed=seed, **options)
    x, P = real.first_master(track)
    for i in range(2, 6):
        name_of = "rebirth_velocity_m_s" if i < 4 else "rebirth_acceleration_m_s2"
        P[i, i] = options[name_of] ** 2
    filter_.add_master(x, P)
    return filter_


def _follow(track: real.Track, name: str, seed: int) -> real.Path2D:
    filter_ = real_filter(name, track, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverconfidenceWarning)  # only means are compared
        run = filter_.run(track.time_s, track.u, z=track.z, z_time_s=track.z_time_s)
    return real.Path2D(slave=run.x[:, :2], master=run.masters_x[:, 0, :2])


def _recording(data: Path, runs: int, seed: int) -> list[dict[str, Any]]:
    recording = real.Recording(data)
    rows = []
    for gap_s, duration_s in GAPS_S:
        tracks = recording.tracks(gap_s, duration_s)
        blind = real.compare(tracks, [real.follow(track, "dead_reckoning") for track in tracks])
        found: dict[str, Any] = {}
        for name in REAL_NAMES:
            figures = [
                real.compare(tracks, [_follow(track, name, seed + run) for track in tracks])
                for run in range(runs if name.startswith("slatf") else 1)
            ]
            ratios = np.array([one.slave_m for one in figures]) / blind.slave_m
            found[name] = {
                "runs": len(figures),
                "ratio": float(ratios.mean()),
                "worst_ratio": float(ratios.max()),
                "relative_m": float(np.mean([one.relative_m for one in figures])),
            }
        rows.append(
            {
                "gap_s": gap_s,
                "duration_s": duration_s,
                "tracks": len(tracks),
                "dead_reckoning_m": blind.slave_m,
                "filters": found,
            }
        )
    return rows


def summary(robust: Robust) -> dict[str, Any]:
    """Give the numbers, for results.json."""
    return robust.results
