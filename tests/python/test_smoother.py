"""``smooth`` of every filter: closed forms, and what holds of any process and precision."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from family_support import (
    ALL,
    KINDS,
    PRECISE_CASES,
    make,
    record,
    start,
)
from filter_support import same_bits

import auvest
from auvest import FilterError
from auvest.filters import _base
from auvest.registry import FILTERS

PLAIN = {"kernel": None, "recovery": None}


def smooth(rows, f, **options):
    given = {
        "dt": rows.dt,
        "input": rows.input,
        "sensor": rows.sensor,
        "place": rows.place if rows.place.size > 0 else None,
        "age_s": rows.age_s,
    }
    return f.smooth(rows.z, **{**given, **options})


# ---- Closed forms --------------------------------------------------------------------------------


def joint(x0, P0, model, dt, z, r, until):
    """All states of a linear record given the measurements of its first rows, at once.

    The prior of all of them is a Gaussian whose covariances the motion gives; the measurements of
    the position are taken as one of all.
    """
    n, rows = len(x0), len(dt)
    means, spread, across = [], [], np.zeros((rows * n, rows * n))
    x, P = x0, P0
    phis = [model.Phi(step) for step in dt]
    for k, phi in enumerate(phis):
        x, P = phi @ x, phi @ P @ phi.T + model.Q(dt[k])
        means.append(x)
        spread.append(P)
        block = P
        for j in range(k, rows):
            across[k * n : k * n + n, j * n : j * n + n] = block
            across[j * n : j * n + n, k * n : k * n + n] = block.T
            if j + 1 < rows:
                block = block @ phis[j + 1].T
    mean = np.concatenate(means)
    seen = [k for k in range(until) if not np.isnan(z[k, 0])]
    h = np.zeros((2 * len(seen), rows * n))
    for i, k in enumerate(seen):
        h[2 * i, k * n] = h[2 * i + 1, k * n + 1] = 1.0
    s = h @ across @ h.T + np.kron(np.eye(len(seen)), r)
    gain = np.linalg.solve(s, h @ across).T
    mean = mean + gain @ (z[seen].ravel() - h @ mean)
    across = across - gain @ s @ gain.T
    blocks = [across[k * n : k * n + n, k * n : k * n + n] for k in range(rows)]
    return mean.reshape(rows, n), np.array(blocks)


R = np.array([[1.0, 0.3], [0.3, 2.0]])


@pytest.mark.parametrize("lag_s", [None, 4.0])
@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_model_gives_the_dense_gaussian(kind, lag_s):
    model = auvest.ConstantAcceleration(position_psd=1e-2, velocity_psd=1e-2, acceleration_psd=1e-3)
    rng = np.random.default_rng(3)
    dt = 0.5 + 0.25 * (np.arange(24) % 3)
    t = np.cumsum(dt)
    z = np.stack([40 + 0.3 * t + 0.01 * t**2, 30 - 0.2 * t + np.sin(0.1 * t)], axis=1)
    z += rng.multivariate_normal(np.zeros(2), R, 24)
    z[::6] = np.nan
    x0, P0 = start(model)
    sensor = auvest.Position(covariance_m2=R.tolist())
    result = kind(x0, P0, process=model, sensors=sensor, **PLAIN).smooth(z, dt=dt, lag_s=lag_s)
    for k in range(24):
        until = 24 if lag_s is None else int(np.searchsorted(t, t[k] + lag_s * 1.0001))
        x, P = (part[k] for part in joint(x0, P0, model, dt, z, R, until))
        sigma = np.sqrt(np.diag(P))
        assert (np.abs(result.smoothed_x[k] - x) / sigma).max() < 1e-9
        assert (np.abs(result.smoothed_P[k] - P) / np.outer(sigma, sigma)).max() < 1e-9
    assert (np.abs(result.smoothed_x - result.x)[:12, :2].max(axis=0) > 0.3).all()


# ---- What holds of every filter ------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_what_comes_later_only_adds(kind, name, dtype):
    """P_s <= P as matrices, the last row is the filter's, and P_s is a covariance."""
    rows = record(ALL[name])
    plain = make(kind, name, dtype, **PLAIN)
    result = smooth(rows, plain)
    run = rows.run(make(kind, name, dtype, **PLAIN))
    for column in run.columns:
        assert same_bits(run[column], result[column]), column
    assert same_bits(plain.x, run.x[-1])
    assert same_bits(result.smoothed_x[-1], result.x[-1])
    assert same_bits(result.smoothed_P[-1], result.P[-1])
    P, smoothed = (np.asarray(result[c], float) for c in ("P", "smoothed_P"))
    assert np.isfinite(result.smoothed_x).all()
    assert same_bits(smoothed, smoothed.transpose(0, 2, 1))
    sigma = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    scale = sigma[:, :, None] * sigma[:, None, :]
    rounding = 1e-3 if dtype == "float32" else 1e-9
    assert np.linalg.eigvalsh(smoothed / scale).min() > -rounding
    assert np.linalg.eigvalsh((P - smoothed) / scale).min() > -rounding
    assert (np.diagonal(smoothed, axis1=1, axis2=2)[:50] < 0.999 * sigma[:50] ** 2).any()


@pytest.mark.parametrize("lag_s", [None, 0.0, 3.0, 1e6])
@pytest.mark.parametrize("kind", KINDS)
def test_blocks_change_no_bit(kind, lag_s, monkeypatch):
    rows = record(ALL["Odometry"])
    late = np.where(np.arange(60) % 4 == 1, 1.7, 0.0)
    for options, age in ((PLAIN, None), ({}, None), ({"late_s": 2.0}, late)):
        rows.age_s = age
        monkeypatch.setattr(_base, "_BLOCK", 8192)
        whole = smooth(rows, make(kind, "Odometry", **options), lag_s=lag_s)
        monkeypatch.setattr(_base, "_BLOCK", 7)
        blocks = smooth(rows, make(kind, "Odometry", **options), lag_s=lag_s)
        for column in whole.columns:
            assert same_bits(whole[column], blocks[column]), column
        if lag_s == 0.0 and age is None:
            assert same_bits(whole.smoothed_x, whole.x)
            assert same_bits(whole.smoothed_P, whole.P)
        if lag_s == 1e6:
            everything = smooth(rows, make(kind, "Odometry", **options))
            assert same_bits(whole.smoothed_x, everything.smoothed_x)
            assert same_bits(whole.smoothed_P, everything.smoothed_P)


@pytest.mark.parametrize("kind", KINDS)
def test_a_late_measurement_counts_at_its_own_time(kind):
    """As if it had come in time: the last of every four rows has what the first two measured."""
    rows = record(ALL["Odometry"])
    rows.dt[:] = 1.0
    in_time = smooth(rows, make(kind, "Odometry"))
    late = copy.deepcopy(rows)
    moved = [k for k in range(60) if k % 4 == 2]
    late.age_s = np.zeros(60)
    for k in moved:  # one second late, in place of what is measured then
        rows.z[k + 1] = np.nan
        late.z[k + 1], late.z[k] = rows.z[k], np.nan
        late.sensor[k + 1], late.place[k + 1] = rows.sensor[k], rows.place[k]
        late.age_s[k + 1] = 1.0
    in_time = smooth(rows, make(kind, "Odometry"))
    result = smooth(late, make(kind, "Odometry", late_s=3.0))
    assert not result.too_late.any()
    assert same_bits(result.smoothed_x, in_time.smoothed_x)
    assert same_bits(result.smoothed_P, in_time.smoothed_P)
    assert not same_bits(result.x, in_time.x)


@pytest.mark.parametrize("kind", KINDS)
def test_the_intervals_that_a_policy_chose_are_those_gone_back(kind):
    rows = record(ALL["ExactAcceleration"])
    policy = auvest.CovarianceBudget(initial_s=1.0, min_s=0.5, max_s=4.0, position_sigma_m=1.0)
    chosen = smooth(rows, make(kind, "ExactAcceleration", policy=policy), dt=None)
    assert len(np.unique(chosen.interval_s)) > 2
    dt = np.concatenate([[1.0], chosen.interval_s[:-1]])
    given = smooth(rows, make(kind, "ExactAcceleration", policy=policy), dt=dt)
    assert same_bits(chosen.smoothed_x, given.smoothed_x)


def test_a_covariance_that_is_not_asked_for_is_not_there():
    rows = record(ALL["Odometry"])
    full = smooth(rows, make(auvest.Ekf, "Odometry"))
    result = smooth(rows, make(auvest.Ekf, "Odometry"), covariance=False)
    assert {"P", "S", "smoothed_P"}.isdisjoint(result.columns)
    assert same_bits(result.smoothed_x, full.smoothed_x)
    assert "smoothed_x_0" in full.to_pandas().columns


def test_what_is_wrong_is_refused_and_a_row_that_fails_is_named():
    rows = record(ALL["Odometry"])
    f = make(auvest.Ekf, "Odometry", longest_step_s=10.0)
    before = f.save()
    for lag_s in (-1.0, math.nan, math.inf, "3"):
        with pytest.raises((ValueError, TypeError), match="lag_s"):
            smooth(rows, f, lag_s=lag_s)
    assert f.save() == before
    rows.dt[7] = 20.0
    with pytest.raises(FilterError, match=r"smooth at row 7: dt = 20 s is longer") as caught:
        smooth(rows, f)
    assert caught.value.step == 7
    assert len(caught.value.partial) == 7
    assert same_bits(f.x, caught.value.partial.x[-1])


# ---- The truth -----------------------------------------------------------------------------------


def ranged(rng, rows, displaced=(0.0, 0.0), drift=1.0):
    """A craft that drifts among four beacons as its model says: filter, record and truth."""
    model = auvest.Odometry(
        sigma_distance=0.05 * drift, sigma_drift=0.1 * drift, sigma_turn=0.01 * drift
    )
    P0 = np.diag([2.0, 2.0, 0.05]) ** 2
    x0 = np.array([0.0, 0.0, 0.3])
    pose = x0 + np.linalg.cholesky(P0) @ rng.standard_normal(3)
    beacons = np.array([[60.0, 40.0], [-50.0, 70.0], [10.0, -80.0], [90.0, -30.0]])
    motion = np.column_stack(
        [np.full(rows, 1.2), np.zeros(rows), 0.05 * np.sin(0.05 * np.arange(rows))]
    )
    truth, z = np.empty((rows, 3)), np.full(rows, np.nan)
    places = beacons[np.arange(rows) // 5 % 4]
    for k in range(rows):
        noise = np.sqrt(np.diag(model.Q(1.0, motion[k]))) * rng.standard_normal(3)
        pose = model.f(pose, 1.0, motion[k]) + noise
        truth[k] = pose
        if k % 5 == 4:
            z[k] = np.hypot(*(pose[:2] - places[k])) + 0.5 * rng.standard_normal()
    x0 = x0 + np.array([*displaced, 0.0])
    options = {"process": model, "sensors": auvest.LeaderRange(sigma_range_m=0.5)}
    record = {"z": z, "dt": 1.0, "input": motion, "place": places}
    return (x0, P0, options), record, truth


def nees(error, P):
    return np.einsum("ki,kij,kj->k", error, np.linalg.inv(P), error)


def test_the_smoother_is_nearer_and_as_honest_as_the_filter():
    """100 runs: the error is less, and its size in sigmas that of 3 numbers, as the filter's.

    The mean NEES of one run spreads by 0.7 (rows go together), that of 100 by 0.07.
    """
    rng = np.random.default_rng(11)
    square, consistent = np.zeros(2), np.zeros(2)
    for _ in range(100):
        (x0, P0, options), rows, truth = ranged(rng, 200)
        result = auvest.Ekf(x0, P0, **options).smooth(**rows)
        both = (result.x, result.P), (result.smoothed_x, result.smoothed_P)
        for k, (x, P) in enumerate(both):
            square[k] += np.square((x - truth)[:, :2]).sum()
            consistent[k] += nees(x - truth, P).mean() / 100
    assert math.sqrt(square[1] / square[0]) < 0.6
    assert abs(consistent - 3).max() < 3 * 0.07
    assert abs(consistent[1] - 3) < abs(consistent[0] - 3) + 0.07


@pytest.mark.parametrize("kind", [auvest.RobustEkf, auvest.RobustUkf])
def test_a_displaced_start_is_smoothed_back(kind):
    """The filter is 60 m off until its recovery; the smoother knows it from the first row on."""
    rng = np.random.default_rng(5)
    (x0, P0, options), rows, truth = ranged(rng, 400, displaced=(45.0, -40.0), drift=0.1)
    result = kind(x0, P0, **options).smooth(**rows)
    assert result.recovered.any()
    off = np.hypot(*(result.x - truth)[:, :2].T)
    smoothed = np.hypot(*(result.smoothed_x - truth)[:, :2].T)
    assert off[:10].min() > 50
    assert smoothed.max() < 6


@pytest.mark.parametrize("kind", KINDS)
def test_a_start_that_was_not_known_is_found_afterwards(kind):
    """Several Gaussians: the first rows have what only the ranges of later ones said."""
    rng = np.random.default_rng(2)
    (x0, P0, options), rows, truth = ranged(rng, 120)
    P0 = P0.copy()
    P0[0, 0] = P0[1, 1] = 2000.0**2
    x0 = x0 + np.array([300.0, 500.0, 0.0])
    result = kind(x0, P0, components=16, **options).smooth(**rows)
    assert (result.mixture_size > 1).any()
    smoothed = np.hypot(*(result.smoothed_x - truth)[:, :2].T)
    assert np.hypot(*(result.x - truth)[3, :2]) > 100
    assert smoothed.max() < 6
    P = np.asarray(result.smoothed_P)
    sigma = np.sqrt(np.diagonal(P, axis1=1, axis2=2))
    assert np.linalg.eigvalsh(P / (sigma[:, :, None] * sigma[:, None, :])).min() > -1e-9


def test_every_filter_that_replays_is_among_these():
    names = {one.cls for one in FILTERS.values() if one.replay and one.family == "gaussian"}
    assert names == {kind.__name__ for kind in KINDS}
