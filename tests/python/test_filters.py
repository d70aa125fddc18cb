"""The filters step by step: what they expose, missing measurements, and life near the station."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from filter_support import (
    DTYPES,
    FILTERS,
    PAPER,
    STATION,
    everything,
    make,
    measure,
    require_sound,
    same_bits,
    straight,
)

import auvest
from auvest import _core


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", FILTERS)
def test_attributes_before_and_after_an_update(kind, dtype):
    f = make(kind, dtype)
    assert f.dtype == np.dtype(dtype)
    assert f.x.dtype == f.P.dtype == f.innovation.dtype == f.S.dtype == np.dtype(dtype)
    assert (f.x.shape, f.P.shape, f.innovation.shape, f.S.shape) == ((6,), (6, 6), (2,), (2, 2))
    assert np.isnan(f.innovation).all()
    assert np.isnan(f.S).all()
    assert np.isnan(f.nis)
    assert f.near_field is False
    assert f.status == auvest.Status.ok

    f.predict(0.5)
    f.update([4.0, -0.8])
    # h at the predicted position (3.05, -0.9): range 4.0608 m, bearing atan2(-2.9, 2.85).
    expected = np.array([4.0 - np.hypot(2.85, 2.9), -0.8 - np.arctan2(-2.9, 2.85)])
    # The transform shifts the range by at most sigma^2 / (2 r) = 6 mm, the bearing by less.
    assert np.abs(f.innovation - expected).max() < 0.008
    assert f.nis == pytest.approx(f.innovation @ np.linalg.solve(f.S, f.innovation), rel=1e-4)
    assert f.near_field is False


@pytest.mark.parametrize("kind", FILTERS)
def test_arrays_are_copies(kind):
    f = make(kind)
    f.update([4.0, -0.8])
    before = everything(f)
    for name in ("x", "P", "innovation", "S"):
        getattr(f, name)[...] = 99.0
    assert everything(f) == before
    x0, p0 = np.zeros(6), np.eye(6)
    g = kind(x0, p0, **PAPER)
    x0[:], p0[:] = 7.0, 7.0
    assert (g.x == 0).all()
    assert (np.eye(6) == g.P).all()


@pytest.mark.parametrize("z", [None, [np.nan, np.nan], np.full(2, np.nan, np.float32)])
@pytest.mark.parametrize("kind", FILTERS)
def test_a_missing_measurement_changes_no_estimate_and_clears_the_innovation(kind, z):
    f = make(kind)
    f.update([4.0, -0.8])
    x, p = f.x, f.P
    f.update(z)
    assert same_bits(f.x, x)
    assert same_bits(f.P, p)
    assert np.isnan(f.nis)
    assert np.isnan(f.innovation).all()
    assert np.isnan(f.S).all()
    assert f.near_field is False


def test_prediction_by_hand():
    # x = 3 + 0.5 * 0.1, with a = 0.2: euler leaves the position at that, exact adds a t^2 / 2.
    x0 = [3.0, -1.0, 0.1, 0.2, 0.2, 0.0]
    for discretisation, x in (("euler", 3.05), ("exact", 3.075)):
        f = auvest.Ukf(
            x0, np.eye(6), process=auvest.ConstantAcceleration(discretisation=discretisation)
        )
        f.predict(0.5)
        assert f.x == pytest.approx([x, -0.9, 0.2, 0.2, 0.2, 0.0], abs=1e-15)


@pytest.mark.parametrize("discretisation", ["euler", "exact"])
def test_process_matrices(discretisation):
    model = auvest.ConstantAcceleration(discretisation=discretisation)
    phi, q = model.Phi(0.5), model.Q(0.5)
    assert phi[0].tolist() == [1, 0, 0.5, 0, 0.125 if discretisation == "exact" else 0, 0]
    assert phi[3].tolist() == [0, 0, 0, 1, 0, 0.5]
    assert (q == q.T).all()
    if discretisation == "euler":
        psd = [model.position_psd, model.velocity_psd, model.acceleration_psd]
        assert q == pytest.approx(np.diag(0.5 * np.repeat(psd, 2)), rel=1e-15)
    else:  # an exact discretisation does not care whether a step is taken in one or in two
        half = model.Phi(0.25)
        twice = half @ model.Q(0.25) @ half.T + model.Q(0.25)
        assert q == pytest.approx(twice, rel=1e-12, abs=1e-18)
        assert model.Phi(0.5) == pytest.approx(half @ half, rel=1e-15)
    f = auvest.Ekf(np.zeros(6), np.eye(6), process=model)
    f.predict(0.5)
    assert pytest.approx(phi @ phi.T + q, rel=1e-13, abs=1e-15) == f.P


def test_range_bearing_of_one_state_and_of_many():
    model = auvest.RangeBearing(station=(1.0, 2.0))
    x = np.zeros((3, 6))
    x[0, :2], x[1, :2], x[2, :2] = (4.0, 6.0), (1.0, 1.0), (1.0, 2.0)
    z = model.h(x)
    assert z == pytest.approx(np.array([[5, np.arctan2(4, 3)], [1, -np.pi / 2], [0, 0]]))
    assert same_bits(model.h(x[0]), z[0])
    with pytest.raises(ValueError, match="not finite: is it too large"):
        model.h([0.0, 1e308])


def test_defaults_are_those_of_the_core():
    for kind in auvest.models.SENSORS.values():
        assert kind().values("float64").tolist() == list(
            _core.sensor_defaults(kind().core_name).values()
        )
    for kind in auvest.models.PROCESSES.values():
        model = kind()
        defaults = _core.process_defaults(model.core_name)
        assert model.values("float64").tolist() == list(defaults.values())
    assert dataclasses.asdict(auvest.FixedInterval()) == _core.fixed_interval_defaults()
    assert dataclasses.asdict(auvest.CovarianceBudget()) == _core.covariance_budget_defaults()
    for preset in ("figure3", "table1"):
        law = dataclasses.asdict(auvest.MahalanobisInterval(preset))
        assert law.pop("preset") == preset
        assert law == _core.mahalanobis_interval_defaults(preset)
    for kind in (auvest.Ukf, auvest.Aukf):
        f = make(kind)
        points = {"alpha": f.alpha, "beta": f.beta, "kappa": f.kappa}
        assert points == _core.sigma_points_defaults()


def test_an_override_replaces_one_value_of_a_preset():
    law = auvest.MahalanobisInterval("table1", tau0=0.3)
    assert law.tau0 == 0.3
    assert (law.gamma1_m2, law.gamma2) == (10.0, 100.0)  # Table 1
    assert law == auvest.MahalanobisInterval("table1", tau0=0.3)
    assert law != auvest.MahalanobisInterval("figure3", tau0=0.3)


@pytest.mark.parametrize("kind", FILTERS)
def test_two_stations_fix_what_one_sees_badly(kind):
    # At 100 m a bearing error of 0.1 rad is 10 m across the line of sight, which a second station
    # abeam measures by range to 0.05 m.
    first = auvest.RangeBearing(station=(0.0, 0.0), sigma_range_m=0.05, sigma_bearing_rad=0.1)
    second = dataclasses.replace(first, station=(100.0, 100.0))
    x0 = [101.0, 1.0, 0, 0, 0, 0]
    p0 = np.diag([25.0, 25.0, 1e-4, 1e-4, 1e-6, 1e-6])
    truth = np.array([100.0, 0.0, 0, 0, 0, 0])
    f = kind(x0, p0, process=PAPER["process"], sensors=first)
    f.update(first.h(truth))
    assert f.P[1, 1] > 16  # 1 / (1 / 5^2 + 1 / 10^2) = 20
    f.update(second.h(truth), second)
    assert np.sqrt(f.P[1, 1]) < 0.06
    assert np.abs(f.x[:2] - truth[:2]).max() < 0.2
    assert f.sensors == {"RangeBearing": first}


def test_float32_rounds_what_float64_does():
    a, b = make(auvest.Ukf, "float32"), make(auvest.Ukf, "float64")
    for z in measure(straight(20)):
        for f in (a, b):
            f.predict(0.5)
            f.update(z)
    assert not same_bits(a.x.astype(np.float64), b.x)
    # 20 steps of a few dozen roundings of 6e-8, on coordinates of a few metres.
    assert np.abs(a.x - b.x).max() < 1e-5


def test_aukf_uses_its_interval():
    aukf = make(auvest.Aukf)
    ukf = make(auvest.Ukf)
    assert aukf.interval == 0.5  # T(0) of Table 1
    aukf.predict()
    ukf.predict(0.5)
    assert same_bits(aukf.x, ukf.x)
    aukf.update([4.0, -0.8])
    interval = aukf.feedback([3.1, -0.8])
    assert interval == aukf.interval
    # Eq. (8) with tau(0) = 0.5, scale = 0.1, T(0) = 0.5, T_max = 1.
    assert interval == pytest.approx(0.5 * 0.1 * 0.5 + 0.5 * aukf.ratio, rel=1e-12)
    # Eq. (12) with eps = 1.6, gamma2 = 1, at most 0.99.
    assert aukf.tau == pytest.approx(min(0.99, 1.6 / (aukf.mahalanobis_squared + 1)), rel=1e-12)
    # (4 - 1)^2 / 4 is the most that one of four points can have.
    assert 0 < aukf.mahalanobis_squared < 2.25 + 1e-9


def test_ratio_by_hand():
    # Eq. (7): d_t = 0.05 along x, d_e = |x - x0|, gamma1 = 1e-4.
    f = make(auvest.Aukf, reference=[3.0, -1.0])
    f.predict()
    f.feedback([3.05, -1.0])
    d_e2 = 0.05**2 + 0.1**2  # 0.5 s at (0.1, 0.2) m/s
    assert f.ratio == pytest.approx(0.05**2 / (d_e2 + 1e-4), rel=1e-9)


def test_without_a_reference_the_estimate_is_desired():
    f, told = make(auvest.Aukf), make(auvest.Aukf)
    for row in measure(straight(12)):
        for g in (f, told):
            g.predict()
            g.update(row)
        assert f.feedback() == told.feedback(told.x[:2])
        assert (f.tau, f.ratio, f.mahalanobis_squared) == (
            told.tau,
            told.ratio,
            told.mahalanobis_squared,
        )
    assert told.feedback(told.x[[0, 0]]) != f.feedback()  # the law looks at both coordinates


def test_reference_at_the_start_matters_to_the_law():
    near, far = make(auvest.Aukf), make(auvest.Aukf, reference=[4.0, -1.0])
    for f in (near, far):
        f.predict()
        f.feedback([3.02, -0.97])
    assert near.ratio < far.ratio  # the second desired track has moved by a metre


@pytest.mark.parametrize(
    "policy",
    [
        auvest.FixedInterval(interval_s=0.3),
        auvest.CovarianceBudget(initial_s=0.3),
        auvest.MahalanobisInterval(initial_s=0.3),
    ],
)
def test_the_first_interval_is_that_of_the_policy(policy):
    assert make(auvest.Aukf, policy=policy).interval == 0.3


@pytest.mark.parametrize(
    "policy", [auvest.FixedInterval(interval_s=0.3), auvest.CovarianceBudget()]
)
def test_other_policies(policy):
    f = make(auvest.Aukf, policy=policy)
    assert f.policy == policy
    f.predict()
    f.update([4.0, -0.8])
    interval = f.feedback()
    if isinstance(policy, auvest.FixedInterval):
        assert interval == 0.3
    else:
        budget = policy.position_sigma_m**2

        def variance(dt):
            phi, q = f.process.Phi(dt), f.process.Q(dt)
            return np.trace((phi @ f.P @ phi.T + q)[:2, :2])

        step = (policy.max_s - policy.min_s) / 2**10  # of the bisection
        assert policy.min_s < interval < policy.max_s
        assert variance(interval) <= budget < variance(interval + step)
    with pytest.raises(AttributeError, match="tau belongs to MahalanobisInterval"):
        _ = f.tau


@pytest.mark.parametrize("dtype", DTYPES)
def test_overflow_is_a_filter_error_and_leaves_the_filter_alone(dtype):
    f = make(auvest.Ukf, dtype, longest_step_s=np.inf)
    before = everything(f)
    big = 1e30 if dtype == "float32" else 1e300
    with pytest.raises(auvest.FilterError, match=r"predict\(dt=.*\): .*not be finite") as caught:
        f.predict(big)
    assert caught.value.status == f.status == auvest.Status.overflow
    assert caught.value.step is None
    assert everything(f) == before
    with pytest.raises(auvest.FilterError, match=r"update: .*not be finite"):
        f.update([big, 0.0])
    assert everything(f) == before
    f.update([4.0, -0.8])
    assert f.status == auvest.Status.ok


# ---- Near the station. The fix of one measurement is about sigma_r = 0.05 m along the bearing and
# ---- r * 0.01 rad across it; "recovers" means: at the end the position error is consistent with
# ---- the covariance (NEES below 13.8, the 99.9 % point of chi-square with 2 degrees of freedom)
# ---- and the standard deviation claimed is the one a filter has that never came near the station.

ALL = [(kind, dtype) for kind in (auvest.Ekf, auvest.Ukf) for dtype in DTYPES]
NARROW = [*ALL, *((auvest.Ukf, dtype, 1e-6) for dtype in DTYPES)]


def near_station(case, x0, p0, **options):
    kind, dtype, *alpha = case
    if alpha:
        options["alpha"] = alpha[0]
    return kind(x0, np.diag(p0), dtype=dtype, **{**PAPER, **options})


def require_recovery(f, result, truth, sigma):
    require_sound(result)
    error = f.x[:2] - truth[-1]
    assert auvest.metrics.nees(error, f.P[:2, :2]) < 13.8
    assert np.sqrt(np.trace(f.P[:2, :2])) < sigma


@pytest.mark.parametrize("case", NARROW)
def test_start_on_the_station(case):
    truth = straight(100, STATION)
    z = measure(truth, seed=11)
    f = near_station(case, [*STATION, 0.1, 0.2, 0, 0], [0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4])
    result = f.run(z, dt=0.5)
    assert result.near_field[0]
    # Range 11 m at the end: 0.11 m across per measurement, averaged over some seconds.
    require_recovery(f, result, truth, 0.11)
    assert np.hypot(*(result.x[10:, :2] - truth[10:]).T).max() < 0.3


@pytest.mark.parametrize("case", NARROW)
def test_start_on_the_station_without_near_field_form(case):
    # near_field = 0 still takes the position form where the bearing has no slope at all.
    sensor = auvest.RangeBearing(near_field=0.0)
    f = near_station(
        case, [*STATION, 0, 0, 0, 0], [0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4], sensors=sensor
    )
    f.update([0.3, 1.0])
    assert f.near_field
    fix = STATION + 0.3 * np.array([np.cos(1.0), np.sin(1.0)])
    # sigma 0.1 m before, 0.05 m and 0.003 m for the fix: it has at least 80 % of the weight.
    assert np.abs(f.x[:2] - fix).max() < 0.2 * 0.3


@pytest.mark.parametrize("case", NARROW)
def test_bearings_across_pi(case):
    # Back and forth 5 m west of the station: an unwrapped innovation would be 6.28 rad, or 31 m.
    angle = 2 * np.pi * 0.5 * np.arange(1, 601) / 60
    truth = np.stack([np.full(600, -4.8), 2.0 + 3.0 * np.sin(angle)], axis=1)
    z = measure(truth, seed=12)
    assert (np.abs(np.diff(z[:, 1])) > 6).sum() >= 9  # it crosses
    f = near_station(
        case,
        [-4.8, 2.0, 0, 0.31, 0, 0],
        [0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4],
        process=auvest.ConstantAcceleration(velocity_psd=1e-2),
    )
    result = f.run(z, dt=0.5)
    assert np.abs(result.innovation[:, 1]).max() < 0.2
    # Five times the 0.05 m of a fix at this range.
    assert np.hypot(*(result.x[:, :2] - truth).T).max() < 0.25
    require_recovery(f, result, truth, 0.07)


@pytest.mark.parametrize("case", NARROW)
def test_range_below_a_micrometre(case):
    # 75 s at 1e-7 m from the station on a small circle, then away at 0.2 m/s.
    k = np.arange(150)
    circle = STATION + 1e-7 * np.stack([np.cos(k), np.sin(k)], axis=1)
    truth = np.concatenate([circle, straight(150, STATION, (0.12, 0.16))])
    z = measure(truth, seed=13)
    f = near_station(
        case,
        [*STATION, 0, 0, 0, 0],
        [0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4],
        process=auvest.ConstantAcceleration(velocity_psd=1e-3),
        sensors=auvest.RangeBearing(smallest_range_m=-1.0),  # the noise is not cut off at 0
    )
    result = f.run(z, dt=0.5)
    assert result.near_field[:150].all()
    assert not result.near_field[-100:].any()
    # While it rests the fix is good to 0.05 m; four of them.
    assert np.hypot(*(result.x[20:150, :2] - truth[20:150]).T).max() < 0.2
    require_recovery(f, result, truth, 0.15)


@pytest.mark.parametrize("near_field", [3.0, 0.0])
@pytest.mark.parametrize("case", NARROW)
def test_sigma_points_on_both_sides_of_the_station(case, near_field):
    # The estimate is 0.7 m from the station with a standard deviation of 5 m.
    truth = straight(100, (1.2, 3.0))
    z = measure(truth, seed=14)
    f = near_station(
        case,
        [0.7, 1.5, 0, 0, 0, 0],
        [25.0, 25.0, 0.04, 0.04, 1e-4, 1e-4],
        sensors=auvest.RangeBearing(near_field=near_field),
    )
    result = f.run(z, dt=0.5)
    require_recovery(f, result, truth, 0.12)
    if near_field:
        # The first measurement alone gives the position to 0.05 m.
        assert np.hypot(*(result.x[1:, :2] - truth[1:]).T).max() < 0.3
