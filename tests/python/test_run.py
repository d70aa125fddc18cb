"""Whole records: run() is the steps, to the bit; precision over long records; threads."""

from __future__ import annotations

import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

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

LAWS = (
    auvest.MahalanobisInterval(),
    auvest.CovarianceBudget(),
    auvest.FixedInterval(interval_s=0.4),
)


def record(steps=60):
    """A record with gaps and uneven times."""
    z = measure(straight(steps))
    z[7] = z[8] = z[31] = np.nan
    dt = 0.5 + 0.1 * np.sin(np.arange(steps))
    return z, dt


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", FILTERS)
def test_run_is_predict_and_update(kind, dtype):
    z, dt = record()
    a, b = make(kind, dtype), make(kind, dtype)
    result = a.run(z, dt=dt)
    for k in range(len(z)):
        b.predict(dt[k])
        b.update(z[k])
        if kind is auvest.Aukf:
            b.feedback()
            assert b.interval == result.interval_s[k]
        assert same_bits(result.x[k], b.x)
        assert same_bits(result.P[k], b.P)
        assert same_bits(result.innovation[k], b.innovation)
        assert same_bits(result.S[k], b.S)
        assert same_bits(result.nis[k], np.asarray(b.nis, dtype))
        assert result.near_field[k] == b.near_field
    assert everything(a) == everything(b)
    assert len(result) == len(z)
    assert np.isnan(result.nis[[7, 8, 31]]).all()
    assert np.isfinite(np.delete(result.nis, [7, 8, 31])).all()
    assert ("interval_s" in result.columns) == (kind is auvest.Aukf)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("law", LAWS)
def test_run_with_the_filters_own_interval(law, dtype):
    z, _ = record()
    reference = straight(60) + 0.01
    a, b = make(auvest.Aukf, dtype, policy=law), make(auvest.Aukf, dtype, policy=law)
    result = a.run(z, reference=reference)
    for k in range(len(z)):
        b.predict()
        b.update(z[k])
        assert b.feedback(reference[k]) == result.interval_s[k]
        assert same_bits(result.x[k], b.x)
    assert everything(a) == everything(b)
    assert a.interval == result.interval_s[-1]


def test_counts_are_those_of_single_steps():
    """What became of the measurements is said where a result is shown."""

    def ranging():
        sensor = auvest.LeaderRange(leader=(200.0, 250.0))
        process = auvest.SpeedHeading()
        start = ([0.0, 0.0], np.eye(2))
        return auvest.RobustEkf(*start, process=process, sensors=sensor, late_s=3)

    rng = np.random.default_rng(1)
    gone = np.arange(1, 101)
    z = np.hypot(200 - gone, 250) + rng.standard_normal(100)
    z[20:60:10] += [2.8, -2.8, 60, 90]
    z[70:73] = np.nan
    age_s = np.zeros(100)
    age_s[80] = 5
    given = {"dt": 1.0, "input": np.tile([1.0, 0.0, 0.0], (100, 1)), "age_s": age_s}
    single = ranging()
    decisions = []
    for k in range(100):
        single.predict(1.0, [1.0, 0.0, 0.0])
        if np.isfinite(z[k]) and age_s[k] == 0:
            single.update(z[k])
            decisions.append(single.report.decision.name)
    wanted = {name: decisions.count(name) for name in ("accepted", "downweighted", "rejected")}
    assert wanted["rejected"] == 2
    assert 0 < wanted["downweighted"] < 10
    result = ranging().run(z, **given)
    assert result.counts == {**wanted, "missing": 3, "too_late": 1, "recovered": 0}
    said = f"100 rows, {wanted['accepted']} accepted, {wanted['downweighted']} downweighted, "
    assert f"({said}2 rejected, 3 missing, 1 too late: x (100, 2)" in repr(result)
    assert said in result._repr_html_()
    # Of many runs those rows that were done: the second ends before its row 10.
    dt = np.ones((2, 100))
    dt[1, 10] = 1e9
    both = ranging().run(np.stack([z, z])[..., np.newaxis], **{**given, "dt": dt})
    assert repr(both).startswith("RunsResult(2 runs, ")
    ten = ranging().run(z[:10], **{**given, "input": given["input"][:10], "age_s": age_s[:10]})
    assert both.counts == {name: n + ten.counts[name] for name, n in result.counts.items()}


def headed(heading, sensors):
    """A record of 100 s: a heading drives the process and fixes come, or it is a bearing."""
    if isinstance(sensors, auvest.Position):
        process = auvest.SpeedHeading()
        filter_ = auvest.Ekf(np.zeros(2), np.eye(2), process=process, sensors=sensors)
        return filter_, np.zeros((100, 2)), np.stack([np.ones(100), np.zeros(100), heading], 1)
    process = auvest.WhiteAcceleration()
    filter_ = auvest.Ekf([50.0, 0, 0, 0], np.eye(4), process=process, sensors=sensors)
    return filter_, np.stack([np.full(100, 50.0), heading], 1), None


@pytest.mark.parametrize("sensors", [auvest.Position(), auvest.RangeBearing()])
def test_angles_in_degrees_are_suspected(sensors):
    """Through north they jump by 360; radians that are wrapped, or not, by 4 pi at most."""
    degrees = (350 + 0.2 * np.arange(100)) % 360
    where = "input: heading_rad" if isinstance(sensors, auvest.Position) else "z: bearing_rad"
    for many in (False, True):
        filter_, z, driven = headed(degrees, sensors)
        z = np.stack([z, z]) if many else z
        with pytest.warns(UserWarning, match=f"{where} goes from 359.8 to 0 .*Degrees") as told:
            filter_.run(z, dt=1.0, input=driven)
        assert told[0].filename == __file__
    turns = np.radians(7.0 * np.arange(100))  # almost two, not wrapped
    for radians in (turns + 100, np.remainder(turns, 2 * np.pi), np.radians(degrees)):
        filter_, z, driven = headed(radians, sensors)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            filter_.run(z, dt=1.0, input=driven)


@pytest.mark.parametrize("kind", FILTERS)
def test_covariances_may_be_left_out(kind):
    z, dt = record()
    a, b = make(kind), make(kind)
    whole, lean = a.run(z, dt=dt), b.run(z, dt=dt, covariance=False)
    assert same_bits(whole.x, lean.x)
    assert same_bits(whole.nis, lean.nis)
    for name in ("P", "S"):
        with pytest.raises(AttributeError, match=f"{name} was not asked for"):
            getattr(lean, name)
    assert len(lean) == len(z)
    assert everything(a) == everything(b)  # S of the last update too
    with pytest.raises(TypeError, match="covariance must be"):
        b.run(z, dt=dt, covariance="no")


def test_a_record_may_be_split():
    z, dt = record()
    a, b = make(auvest.Ukf), make(auvest.Ukf)
    whole = a.run(z, dt=dt)
    parts = [b.run(z[:23], dt=dt[:23]), b.run(z[23:], dt=dt[23:])]
    assert same_bits(whole.P, np.concatenate([p.P for p in parts]))
    assert everything(a) == everything(b)


def test_layout_and_type_of_the_input_do_not_matter():
    z = np.round(measure(straight(40)))  # integers
    expected = make(auvest.Ukf).run(z, dt=0.5)
    stride = np.zeros((80, 4))
    stride[::2, ::2] = z
    for given in (
        z.astype(np.int64),
        z.astype(np.float32),
        np.asfortranarray(z),
        stride[::2, ::2],
        z[::-1].copy()[::-1],
        z.astype(">f8"),
        z.tolist(),
    ):
        assert same_bits(make(auvest.Ukf).run(given, dt=0.5).x, expected.x)
    assert same_bits(make(auvest.Ukf).run(z, dt=np.full(40, 0.5)).x, expected.x)
    assert same_bits(make(auvest.Ukf).run(z, dt=np.float32(0.5)).x, expected.x)


def test_run_takes_another_station():
    other = auvest.RangeBearing(station=(5.0, 5.0))
    z = measure(straight(50), other.station)
    a, b = make(auvest.Ukf), make(auvest.Ukf, sensors=other)
    assert same_bits(a.run(z, dt=0.5, sensor=other).x, b.run(z, dt=0.5).x)


@pytest.mark.parametrize("kind", FILTERS)
def test_a_row_that_cannot_be_done(kind):
    z, dt = record()
    z[20, 0] = 1e30  # finite in float32, its square is not
    a, b = make(kind, "float32"), make(kind, "float32")
    expected = b.run(z[:20], dt=dt[:20])
    with pytest.raises(auvest.FilterError, match=r"run at row 20: .*not be finite") as caught:
        a.run(z, dt=dt)
    error = caught.value
    assert (error.step, error.status) == (20, auvest.Status.overflow)
    assert same_bits(error.partial.x, expected.x)
    assert same_bits(error.partial.S, expected.S)
    assert everything(a) == everything(b)  # at the last good row
    assert a.status == auvest.Status.overflow


def test_a_first_row_that_cannot_be_done():
    f = make(auvest.Ukf, "float32")
    before = everything(f)
    with pytest.raises(auvest.FilterError, match="run at row 0") as caught:
        f.run([[1e30, 0.0]], dt=0.5)
    assert caught.value.partial.x.shape == (0, 6)
    assert everything(f) == before


# ---- float32 against float64 over a long record.

LONG = 10_000
FAR = (10.0, -20.0)


def far_track():
    """A figure of eight, 1.4 hours, 320 to 660 m from the station."""
    t = 0.5 * np.arange(1, LONG + 1)
    w = 2 * np.pi / 700.0
    return np.stack([490 + 180 * np.cos(w * t), 170 * np.sin(2 * w * t)], axis=1)


@pytest.mark.parametrize("discretisation", ["euler", "exact"])
@pytest.mark.parametrize("alpha", [1.0, 1e-3, 1e-6])
def test_float32_follows_float64(alpha, discretisation):
    truth = far_track()
    distance = np.hypot(*(truth - FAR).T)
    assert distance.max() > 650
    z = measure(truth, FAR, (1.0, 0.05), seed=20)
    sensor = auvest.RangeBearing(station=FAR, sigma_range_m=1.0, sigma_bearing_rad=0.05)
    process = auvest.ConstantAcceleration(
        discretisation=discretisation,
        position_psd=2e-2,
        velocity_psd=2e-3,
        acceleration_psd=2e-4,
    )
    x0 = [*(truth[0] + 3.0), 0.0, 3.0, 0.0, 0.0]
    p0 = np.diag([100.0, 100.0, 10.0, 10.0, 1.0, 1.0])
    single, double = (
        auvest.Ukf(x0, p0, process=process, sensors=sensor, alpha=alpha, dtype=dtype).run(z, dt=0.5)
        for dtype in ("float32", "float64")
    )
    # 2e-3 m is 33 ulp of a float32 coordinate of 650 m.
    assert np.hypot(*(single.x - double.x)[:, :2].T).max() < 2e-3
    require_sound(single)
    require_sound(double)
    # And they follow the track: a fix has a standard deviation of 0.05 rad * 650 m = 32 m.
    assert auvest.metrics.rmse(double.x[100:, :2] - truth[100:]) < 10


@pytest.mark.parametrize("alpha", [1.0, 1e-6])
def test_a_million_steps_through_the_station(alpha):
    # A Lissajous figure that passes through the station every 120 s, for six days.
    steps, chunk = 1_000_000, 100_000
    f = auvest.Ukf(
        [*STATION, 0.26, 0.31, 0.0, 0.0],
        np.diag([0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4]),
        **{**PAPER, "process": auvest.ConstantAcceleration(velocity_psd=1e-3)}
        | {"sensors": auvest.RangeBearing(smallest_range_m=-1.0)},  # noise is not cut off at 0
        alpha=alpha,
        dtype="float32",
    )
    near = 0
    for first in range(0, steps, chunk):
        t = 0.5 * np.arange(first + 1, first + chunk + 1)
        figure = [5 * np.sin(2 * np.pi * t / 120), 4 * np.sin(2 * np.pi * t / 80)]
        truth = STATION + np.stack(figure, axis=1)
        result = f.run(measure(truth, seed=first), dt=0.5)
        assert np.isfinite(result.x).all()
        p = result.P.astype(np.float64)
        assert (p == np.swapaxes(p, 1, 2)).all()
        np.linalg.cholesky(p)  # raises unless all are positive definite
        near += int(result.near_field.sum())
        error = result.x[:, :2] - truth
        # A fix is good to 0.05 m or so; six times that, 1e6 times.
        assert np.hypot(*error.T).max() < 0.3
        # Consistent throughout: the mean NEES of 2 states, correlated over some ten steps.
        nees = auvest.metrics.nees(error, p[:, :2, :2])
        assert 1.5 < nees.mean() < 2.2
    assert near > 1000


# ---- Threads.

#: A busy machine may keep a second thread from running beside the first, but not so often.
TRIES = 20


def test_run_releases_the_gil():
    f = make(auvest.Ukf, "float32")
    z = measure(straight(500_000, velocity=(1e-4, 1e-4)))
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        longest = [1.0]
        for _ in range(TRIES):
            if longest[-1] < 0.5:
                break
            ticks.clear()
            start = time.perf_counter()
            f.run(z, dt=1e-3)
            end = time.perf_counter()
            seen = np.array([start, *(t for t in ticks if start < t < end), end])
            longest.append(np.diff(seen).max() / (end - start))
    finally:
        stop.set()
        thread.join()
    # With the GIL held the only long gap would be nearly all of the time.
    assert longest[-1] < 0.5


def test_threads_with_a_filter_each_agree():
    z, dt = record()

    def job(_):
        return make(auvest.Ukf, "float32").run(np.tile(z, (50, 1)), dt=np.tile(dt, 50))

    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(job, range(8)))
    for result in results[1:]:
        assert same_bits(result.P, results[0].P)


def test_a_filter_in_use_refuses_a_second_thread():
    z = measure(straight(500_000, velocity=(1e-4, 1e-4)))
    expected = make(auvest.Ukf, "float32").run(z, dt=1e-3)
    refused = 0
    with ThreadPoolExecutor(1) as pool:
        for _ in range(TRIES):
            f = make(auvest.Ukf, "float32")
            future = pool.submit(f.run, z, dt=1e-3)
            while not future.done():
                time.sleep(0.002)
                try:
                    f.predict(0.0)
                except RuntimeError as error:
                    refused += "in use by another thread" in str(error)
            assert same_bits(future.result().x[-1], expected.x[-1])
            if refused > 0:
                break
    assert refused > 0


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_the_window_reaches_back_all_of_late_s_whatever_the_steps(kind):
    """Predictions end 0, 0.1, 0.6, 1.1, 1.6 and 2.1 s ago: 1.9 s ago is nearest to the last."""
    in_time, late, other = (make(kind, late_s=2.0) for _ in range(3))
    for k, dt in enumerate([0.5] * 6 + [0.1]):
        for f in (in_time, late, other):
            f.predict(dt)
        if k == 1:
            in_time.update([4.0, -0.8])
    late.update([4.0, -0.8], age_s=1.9)
    assert same_bits(late.x, in_time.x)
    assert same_bits(late.P, in_time.P)
    with pytest.raises(
        auvest.FilterError,
        match=r"age_s = 2\.1 is more than late_s = 2: make the filter with a larger late_s$",
    ):
        other.update([4.0, -0.8], age_s=2.1)
