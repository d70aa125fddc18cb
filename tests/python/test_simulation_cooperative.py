"""The cooperative scenario: reproducible, its noises and timings do what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from result_support import cooperative_result

import auvest
from auvest.simulation import cooperative
from auvest.simulation.cooperative import RangeNoise, Scenario, simulate, slave_filter

SHORT = {"runs": 6, "steps": 600}


def rmse(filter_=None, **options):
    scenario = Scenario(**{**SHORT, **options})
    result = simulate(slave_filter() if filter_ is None else filter_, scenario)
    assert not result.failed.any()
    return result.rmse_m


def test_same_seed_same_numbers_whatever_the_workers():
    scenario = Scenario(**SHORT, late=0.3, dropout=0.1, timing="own-time")
    a = simulate(slave_filter(), scenario, workers=1)
    b = simulate(slave_filter(), scenario, workers=5)
    names = ("error", "covariance", "nis", "weight", "samples", "status")
    for name in (*names, "taken", "too_late", "lost", "overflowed"):
        assert np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True), name
    c = simulate(slave_filter(), Scenario(**SHORT, late=0.3, dropout=0.1, seed=2))
    assert not np.array_equal(a.error, c.error)


def test_a_run_is_what_the_filter_itself_does():
    """Without noise of its own, dead reckoning in Python lands where the scenario does."""
    scenario = Scenario(runs=1, steps=50, sigma_speed=0.0, sigma_heading=0.0)
    result = simulate(slave_filter(), scenario)
    slave, leaders = cooperative.tracks(50)
    f = slave_filter()
    moved = np.diff(slave, axis=0, prepend=[[0.0, 0.0]])
    motion = np.stack(
        [np.hypot(*moved.T), np.zeros(50), np.arctan2(moved[:, 1], moved[:, 0])], axis=1
    )
    for k in range(50):
        f.predict(1.0, motion[k])
        if (k + 1) % 5 == 0:
            # The range that the scenario drew, from what it reports of it.
            leader = tuple(leaders[k, (k + 1) // 5 % 2])
            expected = np.hypot(*(f.x - leader))
            across = np.array([-(f.x - leader)[1], (f.x - leader)[0]]) / expected
            bend = across @ f.P @ across / (2 * expected)
            size = math.sqrt(result.nis[0, k])
            reports = []
            for sign in (1, -1):
                g = slave_filter()
                g.restore(f.save())
                along = (f.x - leader) / expected
                s = along @ f.P @ along + 1 + 2 * bend**2
                model = auvest.LeaderRange(leader=leader)
                g.update(expected + bend + sign * size * math.sqrt(s), model)
                reports.append(g)
            errors = [np.abs(g.x - slave[k] - result.error[0, k]).max() for g in reports]
            assert min(errors) < 1e-9
            f = reports[int(np.argmin(errors))]


def test_timing_matters_as_it_should():
    clean = {"steps": 3000, "runs": 10}
    at_once = rmse(**clean)
    own = rmse(timing="own-time", **clean)
    fresh = rmse(timing="as-if-fresh", **clean)
    # Own time lacks the last two ranges at any moment; the error of dead reckoning over 10 s is
    # 0.1 * sqrt(10) m along and 1.5 * 0.0175 * sqrt(10) m across the course.
    assert at_once < own < math.hypot(at_once, 0.33 + 0.09)
    assert fresh > 3 * own  # 10 s at 1.5 m/s


def test_late_and_lost_messages_cost_information_not_consistency():
    for options in ({"late": 0.8}, {"dropout": 0.5}):
        scenario = Scenario(runs=20, steps=1500, timing="own-time", random_start=True, **options)
        result = simulate(slave_filter("unit"), scenario)
        assert auvest.metrics.nees_consistency(result.nees, 2).consistent
        assert not result.too_late.any()


def test_messages_that_are_not_taken_are_counted():
    def counts(**options):
        scenario = Scenario(runs=3, steps=1000, timing="own-time", **options)
        result = simulate(slave_filter("unit"), scenario)
        assert result.too_late.tolist() == [0, 0, 0]
        return result.taken, result.lost, result.overflowed

    # Each is complete two ranges after it was measured: all but the last two of 200 arrive.
    taken, lost, overflowed = counts()
    assert (taken.tolist(), lost.tolist(), overflowed.tolist()) == ([198] * 3, [0] * 3, [0] * 3)

    taken, lost, overflowed = counts(dropout=1.0)
    assert (taken.tolist(), lost.tolist(), overflowed.tolist()) == ([0] * 3, [200] * 3, [0] * 3)

    # A range each second that takes 3 to 22 s: up to eight are on their way, at the end too, and
    # Little's law says how many arrive: 8 of them, 12.5 s each, where there are always eight.
    assert cooperative.MESSAGES_IN_FLIGHT == 8
    taken, lost, overflowed = counts(range_every=1, late=1.0, late_steps=20)
    assert not lost.any()
    left = 1000 - taken - overflowed
    assert ((left >= 0) & (left <= 8)).all()
    assert np.all(taken < 1000 * 8 / 12.5)
    assert np.all(taken > 1000 * 7 / 12.5)


@pytest.mark.parametrize(
    "noise",
    [
        RangeNoise(outlier_fraction=0.2),
        RangeNoise(kind="multipath", outlier_fraction=0.2, outlier_sigma_m=30.0),
        RangeNoise(kind="student", degrees_of_freedom=2),
    ],
)
def test_every_kernel_beats_the_plain_filter_in_heavy_tails(noise):
    plain = rmse(slave_filter("unit"), noise=noise, runs=12)
    for kernel in ("igg", "huber", "hampel"):
        assert rmse(slave_filter(kernel), noise=noise, runs=12) < 0.9 * plain


def test_multipath_is_one_sided():
    """The plain filter's innovations are too long by the mean of a half-normal, 0.8 sigma."""
    noise = RangeNoise(kind="multipath", outlier_fraction=1.0, outlier_sigma_m=30.0, sigma_m=1e-3)
    scenario = Scenario(runs=40, steps=5, noise=noise)
    first = simulate(slave_filter("unit", recovery=None), scenario)
    # One range at step 5: nis = (range error)^2 / S with S close to 2.3 m^2.
    size = np.sqrt(first.nis[:, 4])
    assert size.mean() * math.sqrt(2.3) == pytest.approx(0.8 * 30.0, rel=0.25)


def test_float32_runs_too():
    result = simulate(slave_filter(dtype="float32"), Scenario(**SHORT))
    wanted = simulate(slave_filter(), Scenario(**SHORT))
    assert result.rmse_m == pytest.approx(wanted.rmse_m, rel=1e-2)


def test_the_figures_of_a_result_by_hand():
    """Mean squares of two runs: (0 + 2) / 2 = 1 and (36 + 62) / 2 = 49."""
    a = [[[0.0, 0.0], [1.0, -1.0]], [[0.0, 6.0], [math.sqrt(62), 0.0]]]
    result = cooperative_result(a)
    assert result.rmse_per_run_m == pytest.approx([1.0, 7.0])
    assert result.rmse_m == pytest.approx(5.0)  # of 25
    # The mean square has the standard error |1 - 49| / 2 = 24; d sqrt(m) = dm / (2 sqrt(m)).
    assert result.rmse_standard_error_m == pytest.approx(2.4)
    assert math.isnan(cooperative_result(a[:1]).rmse_standard_error_m)
    # Rows after the end of a run do not count.
    result = cooperative_result([[[3.0, 4.0], [np.nan, np.nan]], [[0.0, 0.0], [0.0, 1.0]]])
    assert result.rmse_per_run_m == pytest.approx([5.0, math.sqrt(0.5)])
    assert result.rmse_m == pytest.approx(math.sqrt(26 / 3))
    # e' P^-1 e with P = diag(4, 9).
    spread = np.broadcast_to(np.diag([4.0, 9.0]), (1, 1, 2, 2))
    result = cooperative_result([[[2.0, 6.0]]], covariance=spread)
    assert result.nees == pytest.approx(1 + 4)


def test_factors_are_of_variances():
    plain = slave_filter()
    wide = slave_filter(q_factor=4.0, r_factor=9.0)
    halved = slave_filter(r_factor=0.25, sigma_range_m=3.0)
    sigmas = [f.sensors["LeaderRange"].sigma_range_m for f in (plain, wide, halved)]
    assert sigmas == [1.0, 3.0, 1.5]
    for name in ("sigma_forward", "sigma_heading"):
        assert getattr(wide.process, name) == 2 * getattr(plain.process, name) > 0


def test_what_a_simulation_cannot_take_is_refused():
    f = auvest.RobustEkf([0, 0, 0], np.eye(3), process=auvest.Odometry())
    with pytest.raises(ValueError, match="filter must have a SpeedHeading of two states"):
        simulate(f)
    f = auvest.Ekf(np.zeros(6), np.eye(6), process=auvest.ConstantAcceleration())
    with pytest.raises(ValueError, match="filter must have a SpeedHeading of two states"):
        simulate(f)
    f = auvest.Ekf([0, 0], np.eye(2), process=auvest.SpeedHeading())
    with pytest.raises(ValueError, match=r"one LeaderRange as its only sensor; it has none$"):
        simulate(f)
    several = {"a": auvest.Position(), "b": auvest.LeaderRange()}
    f = auvest.Ekf([0, 0], np.eye(2), process=auvest.SpeedHeading(), sensors=several)
    with pytest.raises(ValueError, match=r"only sensor; it has Position, LeaderRange$"):
        simulate(f)
    with pytest.raises(TypeError, match=r"filter must be an auvest\.Ekf or auvest\.Ukf, not Slatf"):
        simulate(auvest.Slatf([0, 0], np.eye(2)))
    with pytest.raises(ValueError, match=r"dropout must lie in 0\.\.1, not 1\.5"):
        Scenario(dropout=1.5)
    for every in (0, 11):  # longer than the filter's memory
        with pytest.raises(ValueError, match=rf"range_every must lie in 1\.\.10, not {every}"):
            Scenario(range_every=every)
    assert Scenario(range_every=10).range_every == 10
    with pytest.raises(ValueError, match="timing must be 'at-once'"):
        Scenario(timing="late")
    with pytest.raises(ValueError, match="outlier_sigma_m must be positive"):
        RangeNoise(outlier_sigma_m=0.0)
    with pytest.raises(ValueError, match="runs \\* steps must be at most"):
        Scenario(runs=10_000)
