"""The scenario of section 7 of the SLATF paper under Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from result_support import slat_result

from auvest import (
    CompassMotion,
    DeadReckoning,
    EkfSlat,
    PiecewiseAcceleration,
    Slatf,
    Sonar,
    UnicycleMotion,
)
from auvest.simulation import slat
from auvest.simulation.paper_slatf import FILTERS, LEVELS, paper_filter, paper_scenario
from auvest.simulation.slat import SlatScenario, Vehicle, paper_masters, simulate

SHORT = SlatScenario(duration_s=60, runs=7)
START, CERTAIN = np.zeros(2), np.zeros((2, 2))


def test_the_truth_is_section_7() -> None:
    result = simulate(DeadReckoning(START, CERTAIN), SlatScenario(runs=1))
    t = result.time_s
    assert np.array_equal(t, np.arange(2.0, 401.0, 2.0))
    speed, rate = 5.1444, np.pi / 120
    slave = speed * np.outer(t, [np.cos(np.pi / 6), np.sin(np.pi / 6)])
    assert result.truth == pytest.approx(slave, rel=1e-12)
    straight = np.minimum(t, 240)
    angle = np.pi / 12 + rate * np.maximum(t - 240, 0)
    radius = speed / rate
    master = speed * np.outer(straight, [np.cos(np.pi / 12), np.sin(np.pi / 12)]) + [0, 300]
    master += radius * np.stack(
        [np.sin(angle) - np.sin(np.pi / 12), np.cos(np.pi / 12) - np.cos(angle)], axis=1
    )
    assert result.masters[:, 0] == pytest.approx(master, rel=1e-9)


def test_dead_reckoning_errs_as_its_noise_says() -> None:
    """Var of a sum of independent increments: 400 (2^2 + (5.1444 0.3)^2) about, per two axes."""
    result = simulate(DeadReckoning(START, CERTAIN), SlatScenario(runs=400))
    end = result.error[:, -1]
    heading, speed, sigma = 0.3, 5.1444, 2.0
    # E[(V cos w e^(s^2/2))^2] less the square of the mean, along and across.
    growth = np.exp(heading**2)
    along = (speed**2 + sigma**2) * growth * (1 + np.exp(-2 * heading**2)) / 2 - speed**2
    across = (speed**2 + sigma**2) * growth * (1 - np.exp(-2 * heading**2)) / 2
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    for axis, expected in ((np.array([c, s]), along), (np.array([-s, c]), across)):
        off = end @ axis
        assert abs(off.mean()) < 4 * np.sqrt(400 * expected / 400)
        assert off.var() == pytest.approx(400 * expected, rel=4 * np.sqrt(2 / 400))
    assert result.covered == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("name", list(FILTERS))
def test_workers_do_not_change_the_result(name: Any) -> None:
    scenario = replace(paper_scenario(LEVELS[2], runs=7), duration_s=60)
    one, three = (
        simulate(paper_filter(name, scenario, dtype="float32"), scenario, workers=w) for w in (1, 3)
    )
    for field in one.__dataclass_fields__:
        if field != "scenario":
            assert getattr(one, field).tobytes() == getattr(three, field).tobytes()
    assert not one.failed.any()


def test_run_r_does_not_depend_on_the_number_of_runs() -> None:
    few, many = (simulate(Slatf(START, CERTAIN), replace(SHORT, runs=n)) for n in (3, 11))
    assert np.array_equal(many.error[:3], few.error)
    assert not np.array_equal(many.error[0], many.error[1])
    other = simulate(Slatf(START, CERTAIN), replace(SHORT, runs=3, seed=2))
    assert not np.array_equal(other.error, few.error)


def test_all_filters_meet_the_same_noise() -> None:
    """With a useless sonar every filter is dead reckoning, and all the same dead reckoning."""
    scenario = replace(SHORT, sigma_range_m=1e6, sigma_bearing_rad=1e3)
    reckoned = simulate(DeadReckoning(START, CERTAIN), scenario)
    joint = simulate(EkfSlat(START, CERTAIN, sonar=scenario.sonar), scenario)
    assert joint.error == pytest.approx(reckoned.error, abs=1e-2)


def test_the_prototype_is_not_touched() -> None:
    filter_ = Slatf([3, 4], np.eye(2))
    poses = filter_.poses
    simulate(filter_, SHORT)
    assert np.array_equal(filter_.poses, poses)
    assert filter_.masters == 0


def test_variants_reach_the_filter() -> None:
    plain = simulate(Slatf(START, CERTAIN), SHORT)
    assert plain.heard.tolist() == [30] * 7
    silent = simulate(Slatf(START, CERTAIN), replace(SHORT, silent_from_s=20, silent_to_s=40))
    assert silent.heard.tolist() == [20] * 7
    lossy = simulate(Slatf(START, CERTAIN), replace(SHORT, dropout=0.5, runs=40))
    assert lossy.heard.mean() == pytest.approx(15, abs=4 * np.sqrt(7.5 / 40))
    three = replace(SHORT, masters=paper_masters(3), identified=False)
    result = simulate(Slatf(START, CERTAIN, gate=16), three)
    assert result.heard.tolist() == [90] * 7
    assert result.master_error.shape == (7, 30, 3, 2)
    assert np.isfinite(result.master_error).all()
    wild = replace(SHORT, outlier=0.1, runs=20)
    bare, gated = (simulate(EkfSlat(START, CERTAIN, gate=g), wild).rmse_m for g in (0, 16))
    assert bare > 3 * gated
    stiff = EkfSlat(START, CERTAIN, master=PiecewiseAcceleration(acceleration_m_s2=0), gate=0)
    turning = SlatScenario(runs=5)
    assert simulate(stiff, turning).rmse_m < 50
    assert simulate(stiff, replace(turning, plan_known=False)).rmse_m > 100
    assert np.isnan(simulate(DeadReckoning(START, CERTAIN), SHORT).master_error).all()


def test_rmse_is_the_mean_over_runs_of_the_root_over_time() -> None:
    result = simulate(Slatf(START, CERTAIN), SHORT)
    per_run = [np.sqrt((e**2).sum(axis=-1).mean()) for e in result.error]
    assert result.rmse_m == pytest.approx(np.mean(per_run), rel=1e-12)
    assert result.rmse_standard_error_m == pytest.approx(np.std(per_run, ddof=1) / np.sqrt(7))
    solved = np.linalg.solve(result.covariance, result.error[..., None])[..., 0]
    assert result.nees == pytest.approx((result.error * solved).sum(axis=-1), rel=1e-6)


def test_the_figures_of_a_result_by_hand() -> None:
    """Squares of 25 and 1 in one run; 49, and nothing after a failure, in the other."""
    nan = np.nan
    error = [[[3, -4], [0, 1]], [[7, 0], [nan, nan]]]
    result = slat_result(error, status=np.array([0, 3]))
    assert result.failed.tolist() == [False, True]
    assert result.run_rmse_m == pytest.approx([np.sqrt(13), 7.0])
    assert result.rmse_m == pytest.approx((np.sqrt(13) + 7) / 2)
    # 95 % of a chi-square value with 2 degrees of freedom is below -2 ln 0.05 = 5.99.
    assert result.covered == pytest.approx(1 / 3)
    p = np.array([[4.0, 1.0], [1.0, 1.0]])  # its inverse is [[1, -1], [-1, 4]] / 3
    wide = slat_result(error, covariance=np.broadcast_to(p, (2, 2, 2, 2)))
    assert wide.nees[0] == pytest.approx([(9 + 2 * 12 + 4 * 16) / 3, 4 / 3])
    assert wide.covered == pytest.approx(1 / 3)
    # Particles in one place claim to be certain.
    certain = slat_result(error, covariance=np.zeros((2, 2, 2, 2)))
    assert certain.nees[0].tolist() == [np.inf, np.inf]
    assert certain.covered == 0.0
    assert np.isnan(slat_result(error[:1]).rmse_standard_error_m)


@pytest.mark.parametrize(
    ("duration_s", "odometry_s", "odometry_per_ping", "pings"),
    [
        (400, 1, 2, 200),
        (0.3, 0.1, 1, 3),  # 0.3 / 0.1 is below 3 by a rounding
        (5, 1, 2, 2),
        (1.6, 1, 2, 1),
    ],
)
def test_pings_of_a_run(
    duration_s: float, odometry_s: float, odometry_per_ping: int, pings: int
) -> None:
    scenario = SlatScenario(
        duration_s=duration_s, odometry_s=odometry_s, odometry_per_ping=odometry_per_ping, runs=2
    )
    assert scenario.pings == pings
    result = simulate(DeadReckoning(START, CERTAIN), scenario)
    assert result.error.shape == (2, pings, 2)


def test_limits_of_a_scenario() -> None:
    runs = slat.MAX_PINGS // 2
    assert SlatScenario(duration_s=4, runs=runs).runs == runs
    with pytest.raises(
        ValueError, match=r"^10000001 runs of 2 pings are more than 20000000 pings: "
    ):
        SlatScenario(duration_s=4, runs=runs + 1)
    sure = SlatScenario(dropout=1, outlier=1)
    assert (sure.dropout, sure.outlier) == (1.0, 1.0)


def test_a_scenario_tells_the_filter_its_noise() -> None:
    scenario = SlatScenario(
        sigma_speed_m_s=0.5, sigma_heading_rad=0.25, sigma_range_m=3.0, sigma_bearing_rad=0.125
    )
    motion, sonar = scenario.motion, scenario.sonar
    assert (motion.sigma_speed_m_s, motion.sigma_heading_rad) == (0.5, 0.25)
    assert motion.compensate_bias
    assert (sonar.sigma_range_m, sonar.sigma_bearing_rad) == (3.0, 0.125)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SlatScenario(masters=()), "masters must be a tuple of 1 to 4 Vehicle"),
        (lambda: SlatScenario(masters=(1,)), r"masters\[0\] must be an auvest.Vehicle"),
        (lambda: SlatScenario(slave=3), "slave must be an auvest.Vehicle"),
        (lambda: SlatScenario(duration_s=0), "duration_s must be positive"),
        (
            lambda: SlatScenario(duration_s=1),
            "^duration_s = 1 is too short for one ping: a ping comes every 2 s$",
        ),
        (
            lambda: SlatScenario(duration_s=1e12),
            "^50 runs of 20000001 pings are more than 20000000 pings: fewer runs, or a shorter dur",
        ),
        (lambda: SlatScenario(dropout=1.5), r"dropout must lie in 0\.\.1, not 1.5"),
        (lambda: SlatScenario(odometry_per_ping=0), "odometry_per_ping must lie in 1"),
        (lambda: SlatScenario(sigma_speed_m_s=-1), "sigma_speed_m_s must not be negative"),
        (lambda: SlatScenario(identified=1), "identified must be True or False"),
        (lambda: SlatScenario(runs=0), "runs must lie in 1"),
        (lambda: SlatScenario(seed=2**64), "seed must lie in"),
        (lambda: Vehicle(speed_m_s=np.nan), "speed_m_s must be finite"),
        (lambda: paper_masters(5), r"count must lie in 1\.\.4"),
        (lambda: simulate(3), "filter must be an auvest.Slatf"),
        (lambda: simulate(Slatf(START, CERTAIN), 3), "scenario must be an auvest.SlatScenario"),
        (
            lambda: simulate(Slatf(np.zeros(3), np.eye(3), motion=UnicycleMotion())),
            "filter.motion must be an auvest.CompassMotion",
        ),
        (
            lambda: simulate(Slatf(START, CERTAIN, sonar=Sonar(bearing="slave_to_master"))),
            "must have the scenario's bearing, 'master_to_slave'",
        ),
    ],
)
def test_bad_input(make: Callable[[], object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def test_a_filter_that_fails_says_so() -> None:
    """A prior of 1e25 m: its square has no float."""
    scenario = replace(SHORT, prior_position_m=1e25)
    result = simulate(EkfSlat(START, CERTAIN, dtype="float32"), scenario)
    assert result.failed.all()
    assert np.isnan(result.error).all()
    assert CompassMotion() == scenario.motion
