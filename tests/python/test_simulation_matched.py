"""The world that is what the filter takes it for: its noise has the size that it says."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import auvest
from auvest import metrics
from auvest.simulation import matched

X0 = np.array([30.0, 40.0, 0.1, 0.2, 0.0, 0.0])
P0 = np.diag([0.04, 0.04, 0.01, 0.01, 1e-4, 1e-4])
PROCESS = auvest.ConstantAcceleration(velocity_psd=1e-3)
#: 50 m away the bearing is worth 0.5 m, the range 0.1 m.
SENSOR = auvest.RangeBearing(station=(0.0, 0.0), sigma_range_m=0.1, sigma_bearing_rad=0.01)


def ekf(x, p):
    return auvest.Ekf(x, p, process=PROCESS, sensors=SENSOR)


def simulate(make=ekf, process=PROCESS, sensor=SENSOR, **options):
    given = {"x0": X0, "P0": P0, "steps": 40, "runs": 20, "seed": 3, **options}
    return matched.simulate(make, process, sensor, **given)


def test_a_filter_with_the_noise_of_the_world_is_consistent():
    errors = simulate()
    nis = metrics.nis_consistency(errors.nis, 2, level=0.999)
    assert nis.low < 2 < nis.high < 2.3
    assert nis.consistent
    nees = metrics.nees_consistency(metrics.nees(errors.error, errors.P), 6, level=0.999)
    assert nees.consistent


@pytest.mark.parametrize("name", ["sigma_range_m", "sigma_bearing_rad"])
def test_each_number_of_a_fix_has_its_own_noise(name):
    """Of one doubled sigma, and only of it, the NIS of a sure filter tells: 4 + 1 for 1 + 1."""
    still = auvest.ConstantAcceleration(position_psd=0.0, velocity_psd=0.0, acceleration_psd=1e-20)
    # Not what the filter takes it for.
    world = dataclasses.replace(SENSOR, **{name: 2 * getattr(SENSOR, name)})

    def sure(x, p):
        return auvest.Ekf(x, p, process=still, sensors=SENSOR)

    errors = simulate(sure, still, world, P0=1e-12 * np.eye(6))
    # 800 values; one squared normal deviate has a variance of 2, four of them one of 32.
    assert errors.nis.mean() == pytest.approx(5.0, abs=4 * np.sqrt((32 + 2) / 800))


def test_every_run_draws_its_own_and_the_same_again():
    errors, again = simulate(runs=3), simulate(runs=2)
    for k in range(2):
        assert np.array_equal(errors.error[k], again.error[k])  # whatever the number of runs
        assert not np.isclose(errors.nis[k], errors.nis[k + 1]).any()
    assert not np.isclose(simulate(runs=1, seed=4).nis, errors.nis[:1]).any()


def test_the_start_is_a_draw_from_the_belief():
    """A first step of no time, and a fix that says next to nothing: the error is that of x0."""
    # 50 m away: ten of its sigmas, so that no range is below 0.
    blind = auvest.RangeBearing(station=(0.0, 0.0), sigma_range_m=5.0, sigma_bearing_rad=1e3)
    tilted = P0.copy()
    tilted[0, 2] = tilted[2, 0] = 0.018  # a correlation of 0.9 between x and its velocity

    def make(x, p):
        assert np.array_equal(x, X0)
        assert np.array_equal(p, tilted)
        return auvest.Ekf(x, p, process=PROCESS, sensors=blind)

    errors = simulate(make, sensor=blind, P0=tilted, steps=1, runs=2000, interval_s=1e-9)
    start = errors.error[:, 0]
    covariance = start.T @ start / 2000
    sigma = np.sqrt(np.diag(tilted))
    # Standard error of a correlation of 0: 1 / sqrt(2000) = 0.022.
    expected = tilted / np.outer(sigma, sigma)
    assert covariance / np.outer(sigma, sigma) == pytest.approx(expected, abs=0.13)


def test_the_error_is_the_estimate_less_the_truth():
    """A filter that believes no fix stays where it began; its innovation is the truth less that."""
    exact = auvest.RangeBearing(station=(0.0, 0.0), sigma_range_m=1e-9, sigma_bearing_rad=1e-9)
    blind = auvest.RangeBearing(station=(0.0, 0.0), sigma_range_m=1e6, sigma_bearing_rad=1e3)
    made = []

    def make(x, p):
        made.append(auvest.Ekf(x, p, process=PROCESS, sensors=blind))
        return made[-1]

    errors = simulate(make, sensor=exact, steps=1, runs=5)
    for f, error in zip(made, errors.error[:, 0], strict=True):
        estimate = f.x[:2]
        truth = estimate - error[:2]
        assert np.hypot(*truth) - np.hypot(*estimate) == pytest.approx(f.innovation[0], abs=1e-3)


def test_an_aukf_is_sampled_when_it_asks():
    """With a fixed interval of 2 s it is the UKF that is sampled every 2 s."""

    def aukf(x, p):
        policy = auvest.FixedInterval(interval_s=2.0)
        return auvest.Aukf(x, p, process=PROCESS, sensors=SENSOR, policy=policy)

    def ukf(x, p):
        return auvest.Ukf(x, p, process=PROCESS, sensors=SENSOR)

    asked = simulate(aukf, steps=5, runs=2, interval_s=0.5)
    assert np.array_equal(asked.error, simulate(ukf, steps=5, runs=2, interval_s=2.0).error)
    calls = []
    simulate(ukf, steps=5, runs=3, progress=lambda: calls.append(1))
    assert len(calls) == 3
