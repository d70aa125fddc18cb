"""Two cases for the filters that cost more than EKF-SLAT: SLATF with joint Gaussians, and an IMM.

All is simulated; all filters of a case meet the same noise, so they are compared run by run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import (
    ConstantAcceleration,
    ConstantVelocity,
    CoordinatedTurn,
    EkfSlat,
    Imm,
    PiecewiseAcceleration,
    Slatf,
    SlatfJoint,
)
from auvest._arguments import Floats
from auvest.simulation._runs import standard_error
from auvest.simulation.paper_slatf import LEVELS, PARTICLES, paper_scenario
from auvest.simulation.slat import SlatResult, SlatScenario, Vehicle, simulate
from auvest.slat import SlatFilter
from auvest.slat.models import Master

DEFAULT_RUNS = 40
DEFAULT_SEED = 1

#: Course and speed of all masters, and the turn, are its.
PAPER_MASTER = SlatScenario().masters[0]

# ---- Two masters that cross ----------------------------------------------------------------------

#: They start so far apart, abeam of each other, meet after this time, and go on.
GAP_M = 50.0
MEET_S = 100.0
#: Where the middle between them starts; the slave starts at (0, 0) m.
AHEAD_M = (0.0, 100.0)
#: Sonars of the paper that cannot tell the two apart when they meet.
CROSSING_LEVELS = (LEVELS[0], LEVELS[1])
#: A run has swapped its masters at the end if it has in most of the last pings.
LAST_PINGS = 10

CROSSING_FILTERS: Mapping[str, str] = {
    "told": "EKF-SLAT, told whose echo it is",
    "ekf_slat": "EKF-SLAT",
    "slatf2": "SLATF 2.0",
    "slatf_joint": "SLATF, joint",
}

# ---- A master that turns -------------------------------------------------------------------------

#: What each single model is tried with; the best is compared: process noise of the paper's model of
#: constant acceleration (m/s^2), and of constant velocity (m^2/s^3).
ACCELERATIONS_M_S2 = (1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
VELOCITY_PSDS = (1e-2, 1e-1, 3e-1, 1.0, 3.0, 10.0)

#: The IMM, the same for both: masters hold what they do (hardly any noise in any model) and change
#: it once in 200 s; a manoeuvre begins with 0.1 m/s^2, 1 degree per second at 10 kn.
VELOCITY_PSD, ACCELERATION_PSD, SWITCH_RATE_HZ = 1e-5, 1e-6, 0.005
SHARE = (0.6, 0.2, 0.2)
#: The same with one number changed, to see what hangs on it.
IMM_CHANGES: Mapping[str, tuple[float, float, float]] = {
    "switching 4 times as often": (VELOCITY_PSD, ACCELERATION_PSD, 4 * SWITCH_RATE_HZ),
    "10 times the noise in the straight model": (
        10 * VELOCITY_PSD,
        ACCELERATION_PSD,
        SWITCH_RATE_HZ,
    ),
    "10 times the noise in the other two": (VELOCITY_PSD, 10 * ACCELERATION_PSD, SWITCH_RATE_HZ),
}

#: The paper's scenario at level 3, the master's plan unknown; and with better dead reckoning.
TURNING_LEVEL = LEVELS[2]
PRECISE_SPEED_M_S, PRECISE_HEADING_RAD = 0.2, 0.03


def crossing_scenario(level: int, *, runs: int, seed: int) -> SlatScenario:
    """Make the scenario of two masters that cross, heard by the sonar of ``CROSSING_LEVELS``."""
    course, speed = PAPER_MASTER.heading_rad, PAPER_MASTER.speed_m_s
    inwards = math.asin(GAP_M / 2 / (speed * MEET_S))
    masters = tuple(
        Vehicle(
            x_m=AHEAD_M[0] - side * GAP_M / 2 * math.sin(course),
            y_m=AHEAD_M[1] + side * GAP_M / 2 * math.cos(course),
            heading_rad=course - side * inwards,
            speed_m_s=speed,
            turn_rate_rad_s=0.0,
        )
        for side in (1, -1)
    )
    paper = paper_scenario(CROSSING_LEVELS[level], runs=runs, seed=seed)
    return replace(paper, masters=masters, duration_s=2 * MEET_S, identified=False)


def turning_scenario(*, precise: bool, runs: int, seed: int) -> SlatScenario:
    """Make the scenario of one master that turns, and nobody has said so."""
    paper = replace(paper_scenario(TURNING_LEVEL, runs=runs, seed=seed), plan_known=False)
    if not precise:
        return paper
    return replace(paper, sigma_speed_m_s=PRECISE_SPEED_M_S, sigma_heading_rad=PRECISE_HEADING_RAD)


def imm(
    velocity_psd: float = VELOCITY_PSD,
    acceleration_psd: float = ACCELERATION_PSD,
    switch_rate_hz: float = SWITCH_RATE_HZ,
    share: tuple[float, float, float] = SHARE,
) -> Imm:
    """Make the master's three models."""
    return Imm(
        straight=ConstantVelocity(velocity_psd=velocity_psd, sigma_acceleration_m_s2=0.1),
        accelerated=ConstantAcceleration(
            position_psd=0.0, velocity_psd=0.0, acceleration_psd=acceleration_psd
        ),
        turning=CoordinatedTurn(
            position_psd=0.0, velocity_psd=0.0, acceleration_psd=acceleration_psd, slow_m_s=0.1
        ),
        share=share,
        switch_rate_hz=switch_rate_hz,
    )


def slat_filter(name: str, scenario: SlatScenario, particles: int = PARTICLES) -> SlatFilter:
    """Set up a filter of the crossing: it knows the noise of all sensors, and no echo is wrong."""
    x0, P0 = _start(scenario)
    master = PiecewiseAcceleration()
    models: dict[str, Any] = {"motion": scenario.motion, "master": master, "sonar": scenario.sonar}
    if name == "slatf2":
        return Slatf(x0, P0, version=2, particles=particles, gate=0, monte_carlo=False, **models)
    if name == "slatf_joint":
        room = len(scenario.masters)
        return SlatfJoint(x0, P0, particles=particles, max_masters=room, gate=0, **models)
    return ekf_slat(scenario, master)


def ekf_slat(scenario: SlatScenario, master: Master) -> EkfSlat:
    """Set up EKF-SLAT with a model of the master."""
    x0, P0 = _start(scenario)
    return EkfSlat(x0, P0, motion=scenario.motion, master=master, sonar=scenario.sonar, gate=0)


def _start(scenario: SlatScenario) -> tuple[Floats, Floats]:
    """Return where the slave starts, which it knows."""
    return np.array([scenario.slave.x_m, scenario.slave.y_m]), np.zeros((2, 2))


@dataclass(frozen=True)
class Cases:
    """Everything measured: numbers for JSON and the page, curves for the figures."""

    results: dict[str, Any]
    curves: dict[str, Floats]


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    particles: int = PARTICLES,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Cases:
    """Run both cases.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each filter, at least 2.
    seed : int
        Of the noise.
    particles : int
        Of SLATF 2.0 and joint.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in runs.
    """
    jobs = len(CROSSING_LEVELS) * len(CROSSING_FILTERS)
    jobs += 2 * (len(ACCELERATIONS_M_S2) + len(VELOCITY_PSDS) + 1 + len(IMM_CHANGES))
    done = 0

    def fly(prototype: SlatFilter, scenario: SlatScenario) -> SlatResult:
        nonlocal done
        report = None
        if progress is not None:
            report = lambda part, _: progress(done + part, jobs * runs)  # noqa: E731
        result = simulate(prototype, scenario, workers=workers, progress=report)
        done += runs
        return result

    curves: dict[str, Floats] = {}
    crossing = [
        _crossing(k, fly, crossing_scenario(k, runs=runs, seed=seed), particles, curves)
        for k in range(len(CROSSING_LEVELS))
    ]
    turning = [
        _turning(fly, turning_scenario(precise=precise, runs=runs, seed=seed), curves, str(precise))
        for precise in (False, True)
    ]
    results = {
        "runs": runs,
        "seed": seed,
        "particles": particles,
        "crossing": crossing,
        "turning": turning,
    }
    return Cases(results, curves)


Fly = Callable[[SlatFilter, SlatScenario], SlatResult]


def _crossing(
    number: int, fly: Fly, scenario: SlatScenario, particles: int, curves: dict[str, Floats]
) -> dict[str, Any]:
    found: dict[str, SlatResult] = {}
    for name in CROSSING_FILTERS:
        world = replace(scenario, identified=name == "told")
        found[name] = fly(slat_filter(name, world, particles), world)
    ends = {
        name: swapped(result)[:, -LAST_PINGS:].mean(axis=1) > 0.5 for name, result in found.items()
    }
    if number == 0:
        curves["crossing_time_s"] = found["ekf_slat"].time_s
        for name in CROSSING_FILTERS:
            curves[f"crossing_swapped_{name}"] = swapped(found[name]).mean(axis=0)
        wrong = np.flatnonzero(ends["ekf_slat"] & ~ends["slatf_joint"])
        shown = int(wrong[0]) if wrong.size else 0
        curves["crossing_masters"] = found["ekf_slat"].masters
        for name in ("ekf_slat", "slatf_joint"):
            curves[f"crossing_{name}"] = found[name].masters + found[name].master_error[shown]
    masters = {name: _rmse(result.master_error) for name, result in found.items()}
    slaves = {name: result.run_rmse_m for name, result in found.items()}
    return {
        "sigma_range_m": scenario.sigma_range_m,
        "sigma_bearing_rad": scenario.sigma_bearing_rad,
        "filters": {
            name: {
                "slave_rmse_m": _mean(slaves[name]),
                "master_rmse_m": _mean(masters[name]),
                "swapped": float(ends[name].mean()),
                "covered": result.covered,
                "failed_runs": int(result.failed.sum()),
            }
            for name, result in found.items()
        },
        "joint_less_ekf_slat": {
            "slave_rmse_m": _mean(slaves["slatf_joint"] - slaves["ekf_slat"]),
            "master_rmse_m": _mean(masters["slatf_joint"] - masters["ekf_slat"]),
        },
        "joint_less_slatf2": {
            "slave_rmse_m": _mean(slaves["slatf_joint"] - slaves["slatf2"]),
            "master_rmse_m": _mean(masters["slatf_joint"] - masters["slatf2"]),
        },
    }


def _turning(
    fly: Fly, scenario: SlatScenario, curves: dict[str, Floats], label: str
) -> dict[str, Any]:
    models: dict[str, list[tuple[str, Master]]] = {
        "constant acceleration": [
            (f"{q:g} m/s^2", PiecewiseAcceleration(acceleration_m_s2=q)) for q in ACCELERATIONS_M_S2
        ],
        "constant velocity": [
            (f"{psd:g} m^2/s^3", imm(velocity_psd=psd, share=(1.0, 0.0, 0.0)))
            for psd in VELOCITY_PSDS
        ],
        "IMM": [
            ("as set", imm()),
            *((what, imm(*changes)) for what, changes in IMM_CHANGES.items()),
        ],
    }
    rows: list[dict[str, Any]] = []
    relative: dict[str, Floats] = {}
    slave: dict[str, Floats] = {}
    for model, variants in models.items():
        found = [(what, fly(ekf_slat(scenario, master), scenario)) for what, master in variants]
        apart = [_rmse(result.master_error - result.error[:, :, None]) for _, result in found]
        # The IMM is taken as it is set, the others with the noise that suits them best.
        best = 0 if model == "IMM" else int(np.argmin([one.mean() for one in apart]))
        relative[model], slave[model] = apart[best], found[best][1].run_rmse_m
        square = np.square(found[best][1].master_error[:, :, 0] - found[best][1].error).sum(axis=-1)
        curves[f"turning_{label}_{model}"] = np.sqrt(square.mean(axis=0))
        curves["turning_time_s"] = found[best][1].time_s
        for k, (what, result) in enumerate(found):
            rows.append(
                {
                    "model": model,
                    "noise": what,
                    "compared": k == best,
                    "relative_rmse_m": _mean(apart[k]),
                    "slave_rmse_m": _mean(result.run_rmse_m),
                    "covered": result.covered,
                    "failed_runs": int(result.failed.sum()),
                }
            )
    return {
        "sigma_speed_m_s": scenario.sigma_speed_m_s,
        "sigma_heading_rad": scenario.sigma_heading_rad,
        "models": rows,
        "imm_less": {
            model: {
                "relative_rmse_m": _mean(relative["IMM"] - relative[model]),
                "slave_rmse_m": _mean(slave["IMM"] - slave[model]),
            }
            for model in ("constant acceleration", "constant velocity")
        },
    }


def swapped(result: SlatResult) -> npt.NDArray[np.bool_]:
    """Say where the two masters are taken for each other, shape (runs, pings).

    There the two estimates lie, in sum, nearer to the true position of the other master.
    """
    estimate = result.master_error + result.masters
    apart = estimate[:, :, :, None, :] - result.masters[None, :, None, :, :]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    right = distance[..., 0, 0] + distance[..., 1, 1]
    return distance[..., 0, 1] + distance[..., 1, 0] < right


def _rmse(error: Floats) -> Floats:
    """Root mean square of each run over pings and masters of errors (runs, pings, M, 2)."""
    return np.sqrt(np.square(error).sum(axis=-1).mean(axis=(1, 2)))


def _mean(per_run: Floats) -> dict[str, float]:
    return {"mean": float(per_run.mean()), "standard_error": standard_error(per_run)}


# ---- The page ------------------------------------------------------------------------------------

#: A difference counts from so many standard errors on.
CLEAR = 2.0


def lower(difference: Mapping[str, float]) -> bool:
    """Say whether a mean difference lies clearly below zero."""
    return difference["mean"] < -CLEAR * difference["standard_error"]


def summary(cases: Cases) -> dict[str, Any]:
    """Give the numbers, for results.json."""
    return cases.results
