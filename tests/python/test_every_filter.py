"""What every filter of the family does, whatever its kind, process and sensors."""

from __future__ import annotations

import copy
import dataclasses
import math
import multiprocessing
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from family_support import (
    ALL,
    BUILT_IN,
    CASES,
    KINDS,
    PRECISE_CASES,
    RANGING_CASES,
    drive_elsewhere,
    everything,
    make,
    make_lost,
    moved,
    place_size,
    readable,
    record,
    row,
    sensors_for,
    start,
)
from filter_support import same_bits

import auvest
from auvest import FilterError, Status

NAN, INF = math.nan, math.inf
PLAIN = {"kernel": None, "recovery": None}


def require_same(a, b, columns=None):
    """Two results have the same columns, to the bit."""
    assert a.columns == b.columns
    for name in a.columns if columns is None else columns:
        assert same_bits(a[name], b[name]), name


# ---- Equivalences.

KERNELS = (
    auvest.Unit(),
    auvest.Huber(k=INF),
    auvest.Igg(k0=INF, k1=INF),
    auvest.Hampel(a=INF, b=INF, c=INF),
)


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_kernel_that_doubts_nothing_gives_the_bits_of_the_plain_filter(kind, name, dtype):
    rows = record(ALL[name])
    plain = rows.run(make(kind, name, dtype, **PLAIN))
    for kernel in KERNELS:
        f = make(kind, name, dtype, kernel=kernel, recovery=auvest.RejectionStreak())
        require_same(rows.run(f), plain)
    there = ~np.isnan(plain.nis)
    assert there.sum() == 48  # of 60 rows every fifth is missing
    assert (plain.decision == 0).all()
    assert (plain.iterations == there).all()
    assert not plain.recovered.any()
    assert (np.nan_to_num(plain.weight[there], nan=1.0) == 1).all()


@pytest.mark.parametrize(("kind", "name", "dtype"), RANGING_CASES)
def test_components_change_no_bit_from_a_known_start(kind, name, dtype):
    """No rule is for a position within 3 sigma of the range."""
    rows = record(ALL[name])
    one = rows.run(make(kind, name, dtype, **PLAIN))
    several = rows.run(make(kind, name, dtype, components=16, **PLAIN))
    for column in one.columns:
        assert same_bits(one[column], several[column]), column
    assert set(several.columns) - set(one.columns) == {"convergence", "mixture_size"}
    assert (several.mixture_size == 1).all()


@pytest.mark.parametrize("kind", KINDS)
def test_the_outliers_of_the_records_are_some(kind):
    """So that what follows has rows of every decision, and recoveries."""
    f = make(kind, "SpeedHeading", kernel="igg", recovery=auvest.RejectionStreak(rejections=2))
    result = record(ALL["SpeedHeading"]).run(f)
    assert set(result.decision) == {0, 1, 2}
    assert result.recovered.any()


LINEAR = {
    "euler": auvest.ConstantAcceleration(discretisation="euler", velocity_psd=1e-2),
    "exact": auvest.ConstantAcceleration(position_psd=1e-2, acceleration_psd=1e-3),
}
#: Position, a speed and an acceleration, mixed: half of the states are seen by nothing alone.
C = np.array([[1.0, 0.2, 0.0, 0.1, 0.0, 0.0], [0.0, 1.0, 0.5, 0.0, 0.0, 0.3]])
R = np.array([[0.04, 0.01], [0.01, 0.09]])


def textbook(x, p, phi, q, h, r, z):
    """One step of the Kalman filter, in the form of Joseph: x, P, innovation, S."""
    x, p = phi @ x, phi @ p @ phi.T + q
    s = h @ p @ h.T + r
    if np.isnan(z).any():
        return x, p, np.full(len(z), np.nan), np.full(s.shape, np.nan)
    gain = np.linalg.solve(s, h @ p).T
    innovation = z - h @ x
    rest = np.eye(len(x)) - gain @ h
    return x + gain @ innovation, rest @ p @ rest.T + gain @ r @ gain.T, innovation, s


@pytest.mark.parametrize("process", LINEAR)
@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_model_gives_the_kalman_filter(kind, process):
    model = LINEAR[process]
    rng = np.random.default_rng(3)
    steps = 200
    dt = 0.5 + 0.25 * (np.arange(steps) % 3)
    t = np.cumsum(dt)
    z = np.stack([40 + 0.3 * t + 0.01 * t**2, 30 - 0.2 * t + np.sin(0.1 * t)], axis=1)
    z += rng.multivariate_normal(np.zeros(2), R, steps)
    z[::6] = np.nan
    x, p = start(model)
    f = kind(x, p, process=model, sensors=auvest.FunctionSensor(lambda x: C @ x, R), **PLAIN)
    result = f.run(z, dt=dt)
    size = np.zeros(6)
    for k in range(steps):
        x, p, innovation, s = textbook(x, p, model.Phi(dt[k]), model.Q(dt[k]), C, R, z[k])
        size = np.maximum(size, np.abs(x))
        sigma = np.sqrt(np.diag(p))
        assert (np.abs(result.x[k] - x) / (size + sigma)).max() < 1e-10
        assert (np.abs(result.P[k] - p) / np.outer(sigma, sigma)).max() < 1e-10
        np.testing.assert_allclose(result.innovation[k], innovation, rtol=0, atol=1e-9)
        np.testing.assert_allclose(result.S[k], s, rtol=0, atol=1e-10)
        if not np.isnan(z[k, 0]):
            nis = innovation @ np.linalg.solve(s, innovation)
            assert result.nis[k] == pytest.approx(nis, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_fixes_of_the_position_give_the_kalman_filter(kind):
    """In space, with a covariance that is no diagonal, by the built-in models."""
    model = auvest.WhiteAcceleration(axes=3)
    r = np.array([[1.0, 0.3, 0.1], [0.3, 2.0, -0.2], [0.1, -0.2, 0.5]])
    h = np.eye(3, 6)
    x, p = start(model)
    f = kind(x, p, process=model, sensors=auvest.Position(covariance_m2=r), **PLAIN)
    for z in x[:3] + np.random.default_rng(5).multivariate_normal(np.zeros(3), r, 60):
        f.predict(0.5)
        f.update(z)
        x, p, innovation, s = textbook(x, p, model.Phi(0.5), model.Q(0.5), h, r, z)
        np.testing.assert_allclose(f.x, x, rtol=1e-10)
        np.testing.assert_allclose(f.P, p, rtol=0, atol=1e-10)
        np.testing.assert_allclose(f.innovation, innovation, rtol=0, atol=1e-10)
        np.testing.assert_allclose(f.S, s, rtol=1e-10)


@pytest.mark.parametrize("measured", [1, 2, 4])
@pytest.mark.parametrize("states", [1, 2, 5, 9])
@pytest.mark.parametrize("kind", KINDS)
def test_a_linear_model_of_any_size_gives_the_kalman_filter(kind, states, measured):
    rng = np.random.default_rng(states + 10 * measured)
    a = np.eye(states) + 0.1 * rng.standard_normal((states, states))
    h = rng.standard_normal((measured, states))
    q, r = 0.1 * np.eye(states), np.diag(0.1 + rng.random(measured))
    process = auvest.FunctionProcess(lambda x, _: a @ x, q, state=states)
    sensor = auvest.FunctionSensor(lambda x: h @ x, r)
    x, p = np.zeros(states), np.eye(states)
    f = kind(x, p, process=process, sensors=sensor, **PLAIN)
    for z in rng.standard_normal((20, measured)):
        f.predict(0.5)
        f.update(z)
        x, p, innovation, s = textbook(x, p, a, 0.5 * q, h, r, z)
        sigma, scale = np.sqrt(np.diag(p)), np.sqrt(np.diag(s))
        assert (np.abs(f.x - x) / sigma).max() < 1e-10
        assert (np.abs(f.P - p) / np.outer(sigma, sigma)).max() < 1e-10
        assert (np.abs(f.innovation - innovation) / scale).max() < 1e-10
        assert (np.abs(f.S - s) / np.outer(scale, scale)).max() < 1e-10


# ---- Records.


@pytest.mark.parametrize("late_s", [0.0, 2.0])
@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_run_is_its_single_steps(kind, name, dtype, late_s):
    """Several sensors in one record, stations that move, rows that are missing, late ones."""
    rows = record(ALL[name])
    options = {"late_s": late_s, "kernel": "igg", "recovery": auvest.RejectionStreak(rejections=2)}
    if late_s > 0:
        rows.age_s = np.where(np.arange(len(rows)) % 3 == 1, 0.75, 0.0)
    a, b = (make(kind, name, dtype, **options) for _ in range(2))
    result = rows.run(a)
    width = rows.z.shape[1]
    assert ("interval_s" in result.columns) == (b.policy is not None)
    for k in range(len(rows)):
        rows.step(b, k)
        for column, value in row(b, width).items():
            assert same_bits(result[column][k], value), (k, column)
    assert everything(a) == everything(b)
    assert not any(result.too_late) if late_s > 0 else "too_late" not in result.columns


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_record_names_its_sensors_or_has_a_model_in_each_row(kind, name, dtype):
    rows = record(ALL[name])
    a, b, c = (make(kind, name, dtype) for _ in range(3))
    named = rows.run(a)
    models = [b.sensors[one] for one in rows.sensor]
    by_model = dataclasses.replace(rows, sensor=models).run(b)
    mixed = dataclasses.replace(rows, sensor=[*models[:3], *rows.sensor[3:]]).run(c)
    for column in named.columns:
        assert same_bits(by_model[column], named[column]), column
        assert same_bits(mixed[column], named[column]), column
    assert everything(a) == everything(b) == everything(c)


@pytest.mark.parametrize(("kind", "name", "dtype"), RANGING_CASES)
def test_an_unknown_start_is_run_and_saved_as_any(kind, name, dtype):
    """Row by row, as a record, and through a saved state in the middle of several components."""
    rows = record(ALL[name])
    late_s = 2.0 if dtype == "float32" else 0.0
    if late_s > 0:
        rows.age_s = np.where(np.arange(len(rows)) % 3 == 1, 0.75, 0.0)
    a, b, c = (make_lost(kind, name, dtype, late_s=late_s) for _ in range(3))
    result = rows.run(a)
    assert result.mixture_size.max() > 4
    width = rows.z.shape[1]
    halfway = int(np.argmax(result.mixture_size > 1)) + 1
    for k in range(len(rows)):
        rows.step(b, k)
        for column, value in row(b, width).items():
            assert same_bits(result[column][k], value), (k, column)
        if k == halfway:
            c.restore(b.save())
    assert everything(a) == everything(b)
    assert everything(a) == rows[halfway + 1 :].drive(c)[-1]


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_missing_rows_only_predict(kind, name, dtype):
    rows = record(ALL[name])
    rows.z[:] = np.nan
    a, b, c = (make(kind, name, dtype) for _ in range(3))
    result = rows.run(a)
    for k in range(len(rows)):
        given = None if rows.input is None else rows.input[k]
        b.predict(rows.dt[k], given)
        c.predict(rows.dt[k], given)
        c.update(None, rows.sensor[k])
        assert c.report is None
        if b.policy is not None:
            b.feedback()
            c.feedback()
        assert same_bits(result.x[k], b.x)
        assert same_bits(result.P[k], b.P)
    assert everything(a) == everything(b) == everything(c)
    for column in ("innovation", "S", "nis", "standardised", "weight"):
        assert np.isnan(result[column]).all(), column
    for column in ("near_field", "decision", "iterations", "recovered"):
        assert not result[column].any(), column


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_place_is_that_of_a_model_that_stands_there(kind, name, dtype):
    for sensor, model in sensors_for(ALL[name]).items():
        if place_size(model) == 0:
            continue
        there = np.array([11.0, -7.0, 2.0])[: place_size(model)]
        z = moved(model, there).h(start(ALL[name])[0])
        a, b, c = (make(kind, name, dtype) for _ in range(3))
        a.update(z, sensor, place=there)
        b.update(z, moved(model, there))
        assert everything(a) == everything(b)
        c.update(z, sensor)
        assert readable(a) != readable(c)


#: Sensors that have no place which goes without saying, with a process.
NOWHERE = {
    "LeaderRange": (auvest.LeaderRange(), "SpeedHeading", (3.0, 4.0)),
    "ScaledRange": (auvest.ScaledRange(), "OdometryConstants", (3.0, 4.0)),
    "BodyVelocity": (auvest.BodyVelocity(axes=2), "WhiteAcceleration2", 0.3),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", NOWHERE)
def test_a_measurement_from_nowhere_is_refused(kind, case):
    model, name, stated = NOWHERE[case]
    process = ALL[name]
    standing = dataclasses.replace(model, **{model.place: stated})
    z = standing.h(start(process)[0])
    f, twin = (make(kind, name, sensors={"it": model, "there": standing}) for _ in range(2))
    before = everything(f)
    lost = rf"must be given: it \({type(model).__name__}\) was made without {model.place}$"
    driven = None if not process.input else np.zeros((4, len(process.input)))
    where = np.tile(np.ravel(stated), (4, 1)).astype(float)
    where[2] = NAN
    rows = np.tile(z, (4, 1))
    for given in (z, z.tolist(), np.float32(z)):
        with pytest.raises(ValueError, match=lost):
            f.update(given, "it")
        with pytest.raises(ValueError, match=f"^place must be given: {type(model).__name__} was"):
            f.update(given, model)
    with pytest.raises(ValueError, match=lost):
        f.run(rows, dt=1.0, input=driven, sensor="it")
    for call in (f.run, f.smooth):
        with pytest.raises(ValueError, match=r"^place\[2\] must be given"):
            call(rows, dt=1.0, input=driven, sensor=["it", "there", "it", "there"], place=where)
    with pytest.raises(ValueError, match=r"^run 0: place\[2\] must be given"):
        f.run(np.stack([rows, rows]), dt=1.0, input=driven, sensor="it", place=where)
    kind_of = type(model).__name__
    needed = rf"{model.place}, which this needs: {kind_of}\({model.place}=\.\.\.\)$"
    with pytest.raises(ValueError, match=f"^{kind_of} was made without {needed}"):
        model.h(start(process)[0])
    assert everything(f) == before

    # What is missing comes from nowhere, and what the row or another sensor says is somewhere.
    f.update(None, "it")
    f.update(np.full(len(z), NAN), "it")
    f.update(z, "it", place=stated)
    twin.update(z, "there")
    rows[2] = NAN
    sensors = ["it", "there", "it", "it"]
    result = f.run(rows, dt=1.0, input=driven, sensor=sensors, place=where)
    require_same(result, twin.run(rows, dt=1.0, input=driven, sensor="there"))


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_record_may_be_split_and_go_without_covariances(kind, name, dtype):
    rows = record(ALL[name])
    a, b, c = (make(kind, name, dtype, late_s=1.0) for _ in range(3))
    whole = rows.run(a)
    parts = [rows[:23].run(b), rows[23:].run(b)]
    for name_ in whole.columns:
        assert same_bits(whole[name_], np.concatenate([part[name_] for part in parts])), name_
    lean = rows.run(c, covariance=False)
    assert set(whole.columns) - set(lean.columns) == {"P", "S"}
    for name_ in lean.columns:
        assert same_bits(whole[name_], lean[name_]), name_
    assert everything(a) == everything(b) == everything(c)


@pytest.mark.parametrize(("kind", "name"), [(k, n) for k, n in CASES if n in BUILT_IN])
def test_float32_rounds_what_float64_does(kind, name):
    rows = record(ALL[name])
    single, double = (
        rows.run(make(kind, name, dtype, **PLAIN)) for dtype in ("float32", "float64")
    )
    for column in double.columns:
        if double[column].dtype == np.float64:
            assert single[column].dtype == np.float32, column
    sigma = np.sqrt(np.diagonal(double.P, axis1=1, axis2=2))
    assert (np.abs(single.x - double.x) / (np.abs(double.x) + sigma)).max() < 1e-3
    assert not (single.x == double.x.astype(np.float32)).all()


# ---- Measurements of an earlier time.


def lateness(rows, delay):
    """For each row that at whose end its measurement arrives: later where k % 4 is 1 or 2."""
    return [min(k + delay, len(rows) - 1) if k % 4 in (1, 2) else k for k in range(len(rows))]


@pytest.mark.parametrize("delay", [1, 3])
@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_late_measurements_are_those_in_time(kind, name, dtype, delay):
    rows = record(ALL[name])
    options = {"kernel": "igg", "recovery": auvest.RejectionStreak(rejections=2), "late_s": 2.5}
    in_time, late = (make(kind, name, dtype, **options) for _ in range(2))
    arrival, now = lateness(rows, delay), np.cumsum(rows.dt)
    differed = 0
    for k in range(len(rows)):
        rows.step(in_time, k)
        late.predict(rows.dt[k], None if rows.input is None else rows.input[k])
        for j in range(k + 1):
            if arrival[j] == k:
                rows.update(late, j, age_s=now[k] - now[j])
        if all(arrival[j] <= k for j in range(k + 1)):
            assert same_bits(late.x, in_time.x)
            assert same_bits(late.P, in_time.P)
        else:
            differed += not same_bits(late.x, in_time.x)
    assert same_bits(late.x, in_time.x)
    assert same_bits(late.P, in_time.P)
    assert differed > 10


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_record_with_late_rows_is_the_record_in_time(kind, name, dtype):
    """Every other row has what was measured at the end of the row before it."""
    rows = record(ALL[name])
    rows.z[1::2] = np.nan
    shifted = copy.deepcopy(rows)
    late = slice(4, 30, 4)
    after = slice(5, 31, 4)
    shifted.z[late], shifted.z[after] = np.nan, rows.z[late]
    shifted.place[after] = rows.place[late]
    for k in range(4, 30, 4):
        shifted.sensor[k + 1] = rows.sensor[k]
    shifted.age_s = np.zeros(len(rows))
    shifted.age_s[after] = rows.dt[after]
    options = {"kernel": "igg", "recovery": auvest.RejectionStreak(rejections=2)}
    a = rows.run(make(kind, name, dtype, **options))
    b = shifted.run(make(kind, name, dtype, late_s=1.0, **options))
    assert not b.too_late.any()
    again = [k for k in range(len(rows)) if k not in range(4, 30, 4)]
    assert same_bits(a.x[again], b.x[again])
    assert same_bits(a.P[again], b.P[again])
    assert not same_bits(a.x[late], b.x[late])


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_what_is_older_than_the_window_is_too_late(kind, name, dtype):
    rows = record(ALL[name])
    rows.age_s = np.zeros(len(rows))
    old = [30, 31, 45]
    rows.age_s[old] = 4.0  # late_s and more than the longest step beyond it
    without = copy.deepcopy(rows)
    without.z[old] = np.nan
    a, b, c = (make(kind, name, dtype, late_s=3.0) for _ in range(3))
    marked, wanted = rows.run(a), without.run(b)
    assert np.flatnonzero(marked.too_late).tolist() == old
    assert not wanted.too_late.any()
    for column in marked.columns:
        if column != "too_late":
            assert same_bits(marked[column], wanted[column]), column
    assert everything(a) == everything(b)
    rows[:30].drive(c)
    c.predict(rows.dt[30], None if rows.input is None else rows.input[30])
    before = readable(c)
    with pytest.raises(
        FilterError, match=r"age_s = 4 is more than late_s = 3: make the filter with a larger"
    ) as caught:
        rows.update(c, 30)
    assert caught.value.status == Status.time_backwards
    assert readable(c) == before
    rows.update(c, 30, age_s=3.0)  # exactly the window
    assert readable(c) != before


@pytest.mark.parametrize("kind", KINDS)
def test_an_age_needs_a_window(kind):
    rows = record(ALL["SpeedHeading"])
    f = make(kind, "SpeedHeading")
    rows[:3].drive(f)
    before = readable(f)
    with pytest.raises(FilterError, match=r"age_s = 0\.5 is more than late_s = 0: make"):
        rows.update(f, 5, age_s=0.5)
    assert readable(f) == before
    with pytest.raises(ValueError, match=r"age_s\[5\] is 0\.5, but late_s of this filter is 0"):
        rows.run(f, age_s=np.where(np.arange(len(rows)) == 5, 0.5, 0.0))
    with pytest.raises(ValueError, match=r"age_s is 0\.5, but late_s of this filter is 0"):
        rows.run(f, age_s=0.5)
    assert readable(f) == before
    rows.run(f, age_s=0.0)


# ---- State.


def streak(f, rows):
    """Rejections, one less than the recovery waits for."""
    for _ in range(2):
        f.update(rows.z[0, : len(next(iter(f.sensors.values())).measures)] + 500.0, rows.sensor[0])
        assert f.report.decision == auvest.Decision.rejected


def late_events(f, rows):
    """Late measurements in memory, of a known sensor, of one elsewhere and of a foreign model."""
    f.predict(0.5, None if rows.input is None else rows.input[20])
    first = next(iter(f.sensors.values()))
    z = rows.z[0, : len(first.measures)]
    f.update(z, rows.sensor[0], age_s=0.75)
    sigma = next(k.name for k in dataclasses.fields(first) if k.name.startswith("sigma_"))
    f.update(z, dataclasses.replace(first, **{sigma: 3.0}), age_s=0.5)
    if place_size(first):
        f.update(z, rows.sensor[0], place=np.ones(3)[: place_size(first)], age_s=1.0)


def failed(f, rows):
    with pytest.raises(FilterError):
        overflow(f, rows)


SITUATIONS = {
    "fresh": ({}, lambda *_: None),
    "under way": ({}, lambda f, rows: rows[:19].drive(f)),
    "after an error": ({}, failed),
    "streak": (
        {"kernel": "igg", "recovery": auvest.RejectionStreak(rejections=2)},
        streak,
    ),
    "late": ({"late_s": 2.0}, lambda f, rows: (rows[:20].drive(f), late_events(f, rows))),
}


def overflow(f, rows):
    f.update(
        np.full(len(f.sensors[rows.sensor[0]].measures), np.finfo(f.dtype).max), rows.sensor[0]
    )


def by_save(f, twin):
    twin.restore(f.save())
    return twin


WAYS = {
    "save": by_save,
    "pickle": lambda f, _: pickle.loads(pickle.dumps(f)),
    "deepcopy": lambda f, _: copy.deepcopy(f),
    "copy": lambda f, _: copy.copy(f),
}


def prepared(case, situation):
    kind, name, dtype = case
    options, prepare = SITUATIONS[situation]
    rows = record(ALL[name])
    f, twin = (make(kind, name, dtype, **options) for _ in range(2))
    prepare(f, rows)
    rows[:5].drive(twin)  # a state of its own, to be replaced
    return f, twin, rows[20:30]


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize("case", PRECISE_CASES, ids=lambda c: f"{c[0].__name__}-{c[1]}-{c[2]}")
def test_goes_on_with_the_same_bits(case, situation):
    f, other, rest = prepared(case, situation)
    before = everything(f)
    twins = {way: carry(f, other) for way, carry in WAYS.items()}
    expected = rest.drive(copy.copy(f))
    assert expected[0] != expected[1]
    for way, twin in twins.items():
        assert everything(twin) == before, way
        assert type(twin) is type(f)
        for part in ("process", "sensors", "kernel", "recovery", "policy", "late_s", "dtype"):
            if case[1] in BUILT_IN:
                assert getattr(twin, part) == getattr(f, part), (way, part)
        assert rest.drive(twin) == expected, way
        assert everything(f) == before, way  # copies are independent
    assert rest.drive(f) == expected


@pytest.fixture(scope="module")
def elsewhere():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        yield pool


@pytest.mark.parametrize("situation", SITUATIONS)
@pytest.mark.parametrize("case", PRECISE_CASES, ids=lambda c: f"{c[0].__name__}-{c[1]}-{c[2]}")
def test_goes_on_in_a_spawned_process(case, situation, elsewhere):
    f, _, rest = prepared(case, situation)
    assert elsewhere.apply(drive_elsewhere, (f, rest)) == rest.drive(f)


def test_what_is_not_its_own_state_is_refused():
    """Each in words that name what differs."""
    f = make(auvest.Ukf, "SpeedHeading")
    before = everything(f)
    foreign = {
        "class Ekf, expected Ukf": make(auvest.Ekf, "SpeedHeading"),
        "dtype is 'float32', expected 'float64'": make(auvest.Ukf, "SpeedHeading", "float32"),
        "process is Odometry, expected SpeedHeading": make(auvest.Ukf, "Odometry"),
        "process.heading_bias is True, expected False": make(auvest.Ukf, "SpeedHeadingBias"),
        "sensors.again is missing": make(auvest.Ukf, "SpeedHeading", sensors=auvest.LeaderRange()),
        "kernel is Huber, expected None": make(auvest.Ukf, "SpeedHeading", kernel="huber"),
        "policy is FixedInterval, expected None": make(
            auvest.Ukf, "SpeedHeading", policy=auvest.FixedInterval()
        ),
        "late_s is 1.0, expected 0.0": make(auvest.Ukf, "SpeedHeading", late_s=1.0),
        "residual is 'post-fit', expected 'innovation'": make(
            auvest.Ukf, "SpeedHeading", residual="post-fit"
        ),
        "alpha is 0.5, expected 1.0": make(auvest.Ukf, "SpeedHeading", alpha=0.5),
    }
    for message, other in foreign.items():
        with pytest.raises(ValueError, match=message):
            f.restore(other.save())
        assert everything(f) == before
    whole = f.save()
    for k in range(0, len(whole), 7):
        with pytest.raises(ValueError, match=r"^state is (cut short|not from|damaged)"):
            f.restore(whole[:k] + bytes([whole[k] ^ 0x10]) + whole[k + 1 :])
        with pytest.raises(ValueError, match=r"^state is (cut short|not from|damaged)"):
            f.restore(whole[:k])
    assert everything(f) == before


# ---- Refusals: each leaves the filter as it was, and names the argument and what there is.


def row_input(rows, k=0):
    return None if rows.input is None else rows.input[k]


def first_z(f, rows):
    return np.ones(len(f.sensors[rows.sensor[0]].measures))


REFUSALS = {
    "dt negative": (
        lambda f, r: f.predict(-0.5, row_input(r)),
        ValueError,
        r"dt must not be negative, not -0\.5",
    ),
    "dt NaN": (lambda f, r: f.predict(NAN, row_input(r)), ValueError, "dt must be finite, not nan"),
    "dt text": (
        lambda f, r: f.predict("1", row_input(r)),
        TypeError,
        "dt must be a number, not str",
    ),
    "input long": (
        lambda f, _: f.predict(1.0, np.ones(9)),
        (ValueError, TypeError),
        r"input has shape \(9,\), expected|input must be None: \w+ has no input",
    ),
    "input NaN": (
        lambda f, _: f.predict(1.0, np.full(len(f.process.input), NAN)),
        (ValueError, TypeError),
        r"input\[0\] is nan|input must be None",
    ),
    "z long": (
        lambda f, r: f.update(np.ones(7), r.sensor[0]),
        ValueError,
        r"z has shape \(7,\), expected \(\d,\)",
    ),
    "z inf": (
        lambda f, r: f.update(np.append(first_z(f, r)[1:], INF), r.sensor[0]),
        ValueError,
        r"z\[\d\] is inf; all elements must be finite",
    ),
    "z text": (lambda f, r: f.update("12", r.sensor[0]), TypeError, "z must be .*, not of str"),
    "z masked": (
        lambda f, r: f.update(np.ma.masked_equal(first_z(f, r), 1.0), r.sensor[0]),
        TypeError,
        r"z must be .*, not a masked array; use z\.filled\(np\.nan\)",
    ),
    "sensor unknown": (
        lambda f, r: f.update(first_z(f, r), "Gps"),
        ValueError,
        r"sensor must be '\w+' or .*'again', not 'Gps'",
    ),
    "sensor not said": (
        lambda f, r: f.update(first_z(f, r)),
        TypeError,
        r"^sensor must be given: the filter has several \('\w+', .*'again'\)$",
    ),
    "sensor of another kind": (
        lambda f, r: f.update(first_z(f, r), f.process),
        TypeError,
        r"sensor must be an auvest\.MeasurementModel, not \w+",
    ),
    "place long": (
        lambda f, r: f.update(first_z(f, r), r.sensor[0], place=np.ones(9)),
        (ValueError, TypeError),
        r"place has shape \(9,\), expected|place must be None",
    ),
    "place NaN": (
        lambda f, r: f.update(first_z(f, r), r.sensor[0], place=[NAN, 1.0]),
        (ValueError, TypeError),
        r"place\[0\] is nan|place must be None|place has shape",
    ),
    "age negative": (
        lambda f, r: f.update(first_z(f, r), r.sensor[0], age_s=-1.0),
        ValueError,
        r"age_s must not be negative, not -1\.0",
    ),
    "age NaN": (
        lambda f, r: f.update(first_z(f, r), r.sensor[0], age_s=NAN),
        ValueError,
        "age_s must be finite, not nan",
    ),
    "run z wide": (
        lambda f, r: dataclasses.replace(r, z=np.ones((len(r), 7))).run(f),
        ValueError,
        r"z has shape \(60, 7\), expected \(T, \d\)",
    ),
    "run z inf": (
        lambda f, r: dataclasses.replace(r, z=np.where(np.isnan(r.z), INF, r.z)).run(f),
        ValueError,
        r"z\[\d+, \d\] is inf",
    ),
    "run z text": (
        lambda f, r: dataclasses.replace(r, z=np.full(r.z.shape, "1")).run(f),
        TypeError,
        "z must be .*, not of str",
    ),
    "run z bool": (
        lambda f, r: dataclasses.replace(r, z=np.full(r.z.shape, True)).run(f),
        TypeError,
        "z must be .*, not of bool",
    ),
    "run z complex": (
        lambda f, r: dataclasses.replace(r, z=r.z + 1j).run(f),
        TypeError,
        "z must be .*, not of complex128",
    ),
    "run z masked": (
        lambda f, r: dataclasses.replace(r, z=np.ma.masked_invalid(r.z)).run(f),
        TypeError,
        r"z must be .*, not a masked array; use z\.filled\(np\.nan\)",
    ),
    "run dt": (
        lambda f, r: dataclasses.replace(r, dt=-r.dt).run(f),
        ValueError,
        r"dt\[0\] must not be negative, not -0\.5",
    ),
    "run input": (
        lambda f, r: dataclasses.replace(r, input=np.ones((60, 9))).run(f),
        (ValueError, TypeError),
        r"input has shape \(60, 9\), expected|input must be None: \w+ has no input",
    ),
    "run sensor": (
        lambda f, r: dataclasses.replace(r, sensor=[*r.sensor[:-1], "Gps"]).run(f),
        ValueError,
        r"sensor must be '\w+' or .*'again', not 'Gps'",
    ),
    "run sensor rows": (
        lambda f, r: dataclasses.replace(r, sensor=r.sensor[1:]).run(f),
        ValueError,
        "sensor has 59 rows and z has 60; they must have the same",
    ),
    "run sensor not said": (
        lambda f, r: dataclasses.replace(r, sensor=None).run(f),
        TypeError,
        r"^sensor must be given: the filter has several \('\w+', .*'again'\)$",
    ),
    "run place": (
        lambda f, r: dataclasses.replace(r, place=np.ones((60, 9))).run(f),
        (ValueError, TypeError),
        r"place has shape \(60, 9\), expected|place must be None",
    ),
    "run age": (
        lambda f, r: dataclasses.replace(r, age_s=np.full(60, -1.0)).run(f),
        ValueError,
        r"age_s\[0\] must not be negative, not -1\.0",
    ),
    "run covariance": (
        lambda f, r: r.run(f, covariance=1),
        TypeError,
        "covariance must be True or",
    ),
    "restore": (
        lambda f, _: f.restore(b"auvest"),
        ValueError,
        "^state is cut short: it has 6 bytes",
    ),
}
#: As above, of the core: the status is what it said, and all else as it was.
FAILURES = {
    "too late": (
        lambda f, r: f.update(first_z(f, r), r.sensor[0], age_s=1e6),
        r"update: age_s = 1e\+06 is more than late_s = 2: make the filter with a larger late_s$",
        Status.time_backwards,
    ),
    "overflow": (overflow, "update: .*not be finite", Status.overflow),
}


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_refusal_changes_nothing(kind, name, dtype):
    rows = record(ALL[name])
    f = make(kind, name, dtype, late_s=2.0)
    rows[:6].drive(f)
    before = everything(f)
    for refusal, (call, error, message) in REFUSALS.items():
        with pytest.raises(error, match=message) as caught:
            call(f, rows)
        assert not isinstance(caught.value, FilterError), refusal
        assert everything(f) == before, refusal


@pytest.mark.parametrize("failure", FAILURES)
@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_failure_changes_nothing_but_the_status(kind, name, dtype, failure):
    rows = record(ALL[name])
    f = make(kind, name, dtype, late_s=2.0)
    rows[:6].drive(f)
    twin, before = copy.copy(f), readable(f)
    call, message, status = FAILURES[failure]
    with pytest.raises(FilterError, match=message) as caught:
        call(f, rows)
    assert caught.value.status == f.status == status
    assert readable(f) == before
    assert rows[6:20].drive(f) == rows[6:20].drive(twin)


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_row_that_fails_leaves_the_filter_at_the_row_before(kind, name, dtype):
    rows = record(ALL[name])
    a, b = (make(kind, name, dtype, late_s=2.0) for _ in range(2))
    rows.z[12] = np.where(np.isnan(rows.z[12]), np.nan, np.finfo(dtype).max)
    with pytest.raises(FilterError, match=r"run at row 12: .*not be finite") as caught:
        rows.run(a)
    wanted = rows[:12].run(b)
    require_same(caught.value.partial, wanted)
    assert readable(a) == readable(b)
    assert a.status == Status.overflow
    assert rows[13:].drive(a) == rows[13:].drive(b)


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_wrong_constructions_name_the_argument(kind, name):
    process, sensors = ALL[name], sensors_for(ALL[name])
    x0, p0 = start(process)
    n = len(x0)

    def require(error, message, *args, **options):
        x, p = args or (x0, p0)
        with pytest.raises(error, match=message):
            kind(x, p, **{"process": process, "sensors": sensors, **options})

    require(ValueError, rf"x0 has shape \({n + 1},\), expected \({n},\)", np.append(x0, 0.0), p0)
    require(
        ValueError,
        rf"P0 has shape \({n}, {n + 1}\), expected \({n}, {n}\)",
        x0,
        np.ones((n, n + 1)),
    )
    require(ValueError, r"P0\[\d, \d\] is -", x0, -p0)
    require(TypeError, r"process must be an auvest\.ProcessModel, not str", process="line")
    require(TypeError, "sensors must be a measurement model, a sequence", sensors=3)
    require(ValueError, "dtype must be 'float32' or 'float64', not 'half'", dtype="half")
    require(ValueError, "kernel must be 'igg', .* not 'l1'", kernel="l1")
    require(TypeError, r"recovery must be an auvest\.RejectionStreak", kernel="igg", recovery=3)
    require(
        ValueError,
        "recovery is for filters with a kernel",
        kernel=None,
        recovery=auvest.RejectionStreak(),
    )
    require(TypeError, r"policy must be an auvest\.FixedInterval or .*, not float", policy=0.5)
    require(ValueError, r"late_s must not be negative, not -1\.0", late_s=-1)
    require(ValueError, "late_s must be finite, not inf", late_s=INF)
    require(ValueError, "residual must be 'innovation' or 'post-fit'", residual="both")
    require(ValueError, r"max_iterations must lie in 2\.\.255, not 1", max_iterations=1)
    require(ValueError, "tolerance must not be negative", tolerance=-1e-9)
    require(ValueError, r"reference has shape \(3,\), expected \(2,\)", reference=np.ones(3))
    require(TypeError, "unexpected keyword argument 'measurement'", measurement=None)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_that_sees_other_states_is_refused(kind):
    nameless = auvest.FunctionProcess(lambda x, _: x, np.eye(2), state=2)
    message = (
        "RangeBearing observes x_m, y_m, but the state of FunctionProcess begins with x_0, x_1"
    )
    with pytest.raises(ValueError, match=message):
        kind(np.zeros(2), np.eye(2), process=nameless, sensors=auvest.RangeBearing())
    f = kind(np.zeros(2), np.eye(2), process=nameless, sensors=())
    with pytest.raises(ValueError, match=message):
        f.update([1.0, 0.0], auvest.RangeBearing())
    with pytest.raises(TypeError, match="sensor must be a model: this filter has none"):
        f.update([1.0, 0.0])


# ---- Threads.


INSIDE, LEAVE = threading.Event(), threading.Event()


def held(x):
    INSIDE.set()
    assert LEAVE.wait(60)
    return x[:2]


@pytest.mark.parametrize("kind", KINDS)
def test_a_second_thread_is_refused_and_disturbs_nothing(kind):
    """The sensor's function holds one thread inside while the other tries everything."""
    LEAVE.set()
    sensor = auvest.FunctionSensor(held, np.eye(2))
    x0, p0 = start(ALL["ExactAcceleration"])
    f = kind(x0, p0, process=ALL["ExactAcceleration"], sensors=sensor)
    other = kind(x0, p0, process=ALL["ExactAcceleration"], sensors=sensor)
    saved = f.save()
    attempts = {
        "predict": lambda: f.predict(0.5),
        "update": lambda: f.update([1.0, 2.0]),
        "missing": lambda: f.update(None),
        "run": lambda: f.run([[1.0, 2.0]], dt=0.5),
        "x": lambda: f.x,
        "P": lambda: f.P,
        "report": lambda: f.report,
        "nis": lambda: f.nis,
        "innovation": lambda: f.innovation,
        "near_field": lambda: f.near_field,
        "save": f.save,
        "restore": lambda: f.restore(saved),
        "copy": lambda: copy.copy(f),
        "pickle": lambda: pickle.dumps(f),
    }
    if f.policy is not None:
        attempts["feedback"] = f.feedback
        attempts["interval"] = lambda: f.interval
        attempts["tau"] = lambda: f.tau
    with ThreadPoolExecutor(1) as pool:
        try:
            for action in (lambda: f.update([40.5, 31.0]), lambda: f.run([[40.5, 31.0]], dt=0.5)):
                INSIDE.clear()
                LEAVE.clear()
                future = pool.submit(action)
                assert INSIDE.wait(60)
                for attempt in attempts.values():
                    with pytest.raises(RuntimeError, match="in use by another thread"):
                        attempt()
                LEAVE.set()
                future.result(60)
        finally:
            LEAVE.set()
    other.update([40.5, 31.0])
    other.run([[40.5, 31.0]], dt=0.5)
    assert readable(f) == readable(other)


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_one_filter_per_thread_agrees(kind, name, dtype):
    """Copies of one filter share its models, not its state."""
    rows = record(ALL[name])
    f = make(kind, name, dtype)
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda g: rows.run(g), [copy.copy(f) for _ in range(4)]))
    expected = rows.run(f)
    for result in results:
        require_same(result, expected)


# ---- Put together.


def test_odometry_with_ranges_robust_adaptive_and_late():
    """A pose by odometry, ranges to a leader and fixes, a budget for the position: all at once."""
    process = auvest.Odometry(sigma_distance=0.05, sigma_drift=0.3, sigma_turn=0.01)
    f = auvest.Ukf(
        [0.0, 0.0, 0.0],
        np.diag([0.04, 0.04, 0.01]),
        process=process,
        sensors={
            "leader": auvest.LeaderRange(leader=(60.0, 10.0), sigma_range_m=0.3),
            "gps": auvest.Position(covariance_m2=[[0.5, 0.1], [0.1, 0.4]]),
        },
        kernel="huber",
        policy=auvest.CovarianceBudget(position_sigma_m=1.2, min_s=0.25, max_s=4.0),
        late_s=3,
    )
    in_time = copy.copy(f)
    rng = np.random.default_rng(8)
    truth = np.zeros(3)
    intervals, weights = [], []
    for k in range(200):
        dt = f.interval
        motion = np.array([1.2 * dt, 0.0, 0.05 * dt])
        truth = process.f(truth, dt, motion)
        sigma = np.array([0.3 * dt**0.5, 0.3 * dt**0.5, 0.01 * dt**0.5])
        noisy = motion + sigma * rng.standard_normal(3)
        name = ("leader", "gps")[k % 2]
        z = f.sensors[name].h(truth) + 0.3 * rng.standard_normal(1 + k % 2)
        if k % 9 == 4:
            z += 15.0
        for g in (f, in_time):
            g.predict(dt, noisy)
        if k % 5 == 3:  # comes after one more prediction of half a second
            in_time.update(z, name)
            for g in (f, in_time):
                g.predict(0.5, [0.6, 0.0, 0.025])
            truth = process.f(truth, 0.5, [0.6, 0.0, 0.025])
            f.update(z, name, age_s=0.5)
        else:
            for g in (f, in_time):
                g.update(z, name)
        weights.append(f.report.weight.min())
        for g in (f, in_time):
            g.feedback()
        intervals.append(f.interval)
        assert same_bits(f.x, in_time.x)
        assert same_bits(f.P, in_time.P)
    assert np.array(weights)[4::9].max() < 0.5  # Huber: 1.345 of 15 m / 0.7 m
    assert len(set(intervals)) > 50
    error = f.x - truth
    assert error @ np.linalg.solve(f.P, error) < 21.1  # 99.99 % of chi-square with 3


def test_an_adaptive_filter_may_be_robust():
    """Aukf(kernel=...) rejects what the plain one follows, and goes on choosing its interval."""
    rows = 60
    x0 = [3.0, -1.0, 0.1, 0.2, 0.0, 0.0]
    p0 = np.diag([0.04, 0.04, 0.01, 0.01, 1e-4, 1e-4])
    robust, plain = auvest.Aukf(x0, p0, kernel="igg"), auvest.Aukf(x0, p0)
    assert robust.kernel == auvest.Igg()
    station = np.array(auvest.RangeBearing().station)
    for f in (robust, plain):
        now, outliers, worst = 0.0, 0, 0.0
        for k in range(rows):
            f.predict()
            now += f.interval
            position = np.array([3.0 + 0.1 * now, -1.0 + 0.2 * now])
            offset = position - station
            z = np.array([np.hypot(*offset), np.arctan2(offset[1], offset[0])])
            z[0] += 3.0 if k % 10 == 5 else 0.0
            f.update(z)
            outliers += f.report.weight[0] == 0
            interval = f.feedback(position)
            assert 0 < interval <= f.policy.max_s
            worst = max(worst, float(np.hypot(*(f.x[:2] - position))))
        if f is robust:
            assert outliers == 6
            assert worst < 0.05
        else:
            assert outliers == 0
            assert worst > 0.5


# ---- Clocks that jump, ranges that are none, coordinates without a local origin.


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_step_longer_than_the_longest_is_refused_and_changes_nothing(kind, name, dtype):
    rows = record(ALL[name])
    given = None if rows.input is None else rows.input[0]
    f = make(kind, name, dtype)
    assert f.longest_step_s == 3600
    rows[:5].drive(f)
    before = readable(f)
    for dt in (3601.0, 86400.0, 1.7e9):  # a clock of its own, a day, seconds since 1970
        with pytest.raises(FilterError, match=r"longer than longest_step_s = 3600 s") as caught:
            f.predict(dt, given)
        assert caught.value.status == Status.step_too_long
        assert readable(f) == before
    assert f.status == Status.step_too_long
    f.predict(3600.0, given)
    assert f.status == Status.ok

    limited = make(kind, name, dtype, longest_step_s=0.25)
    limited.predict(0.25, given)
    with pytest.raises(FilterError, match=r"dt = 0\.26 s is longer than longest_step_s = 0\.25 s"):
        limited.predict(0.26, given)
    unlimited = make(kind, name, dtype, longest_step_s=INF)
    unlimited.predict(7200.0, given)


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_run_ends_before_a_row_with_a_clock_that_jumped_and_goes_on_behind_it(kind, name, dtype):
    rows = record(ALL[name])
    a, b = (make(kind, name, dtype) for _ in range(2))
    jumped = copy.deepcopy(rows)
    jumped.dt[20] = 5000.0
    with pytest.raises(FilterError, match=r"run at row 20: dt = 5000 s is longer") as caught:
        jumped.run(a)
    assert caught.value.step == 20
    assert caught.value.status == Status.step_too_long
    require_same(caught.value.partial, rows[:20].run(b))
    require_same(rows[20:].run(a), rows[20:].run(b))


def range_sensors(process):
    return {
        name: model
        for name, model in sensors_for(process).items()
        if hasattr(model, "smallest_range_m")
    }


@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_range_that_the_sensor_cannot_measure_is_refused_by_name(kind, name, dtype):
    x0 = start(ALL[name])[0]
    f = make(kind, name, dtype)
    before = readable(f)
    assert range_sensors(ALL[name])
    for sensor, model in range_sensors(ALL[name]).items():
        z = model.h(x0)
        z[0] = -1.0
        with pytest.raises(
            FilterError,
            match=rf"{sensor} cannot measure a range of -1 m; its ranges are 0 m or more;",
        ) as caught:
            f.update(z, sensor)
        assert caught.value.status == Status.impossible_range
        assert readable(f) == before
        limited = dataclasses.replace(model, smallest_range_m=1.0, largest_range_m=500.0)
        for none in (0.0, 0.99, 500.1, 9999.0):
            z[0] = none
            with pytest.raises(FilterError, match=r"its ranges are 1 to 500 m") as caught:
                f.update(z, limited)
            assert caught.value.status == Status.impossible_range
            assert readable(f) == before
        f.update(np.full(len(z), NAN), limited)  # missing
        assert f.status == Status.ok


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_ends_before_a_row_with_a_negative_range(kind):
    f = make(kind, "SpeedHeading")
    with pytest.raises(
        FilterError, match=r"run at row 2: LeaderRange cannot measure a range of -1"
    ):
        f.run(
            [40.0, NAN, -1.0, 40.0],
            dt=0.1,
            input=np.zeros((4, 3)),
            sensor=auvest.LeaderRange(leader=(1.0, 2.0)),
        )


EAST, NORTH = 388096.0, 3948996.0


@pytest.mark.parametrize("kind", KINDS)
def test_coordinates_without_a_local_origin_are_refused_in_float32(kind):
    """A metre of a craft at a northing of UTM is four numbers of float32."""
    motion = {"process": auvest.SpeedHeading(), "sensors": auvest.LeaderRange()}
    P0 = np.eye(2) * 0.01
    with pytest.raises(
        ValueError,
        match=r"x0 = \(388096, 3948996\) is too far from the origin: float32 tells "
        r"0\.25 m apart there.*Subtract a local origin, such as \(390000, 3950000\)",
    ):
        kind([EAST, NORTH], P0, dtype="float32", **motion)
    fine = kind([EAST, NORTH], P0, **motion)
    for _ in range(500):
        fine.predict(0.1, [0.5, 0.0, 0.0])
    assert fine.x[0] - EAST == pytest.approx(25.0, abs=0.01)

    f = kind([0.0, 0.0], P0, dtype="float32", **motion)
    far = auvest.LeaderRange(leader=(EAST, NORTH), sigma_range_m=0.5)
    with pytest.raises(
        ValueError, match=r"leader = \(388096, 3948996\) is too far from the origin"
    ):
        f.update([10.0], far)
    with pytest.raises(FilterError, match=r"place = \(388096, 3948996\) is too far") as caught:
        f.update([10.0], auvest.LeaderRange(sigma_range_m=0.5), place=(EAST, NORTH))
    assert caught.value.status == Status.far_from_origin
    with pytest.raises(ValueError, match=r"station = \(388096, 3948996\) is too far"):
        kind(
            [0.0, 0.0],
            P0,
            process=auvest.SpeedHeading(),
            sensors=auvest.RangeBearing(station=(EAST, NORTH)),
            dtype="float32",
        )


@pytest.mark.parametrize("kind", KINDS)
def test_a_filter_that_drifts_far_from_its_origin_says_so(kind):
    f = kind([0.0, 0.0], np.eye(2) * 0.01, process=auvest.SpeedHeading(), dtype="float32")

    def drift():
        for _ in range(3000):
            before[:] = f.x, f.P
            f.predict(1.0, [5e4, 0.0, 0.0])

    before = []
    with pytest.raises(FilterError, match=r"x = \(.*\) is too far from the origin") as caught:
        drift()
    assert caught.value.status == f.status == Status.far_from_origin
    assert same_bits(f.x, before[0])
    assert same_bits(f.P, before[1])
    # Half a unit in the last place is a tenth of sigma there, as it was when it began to be.
    half = 0.5 * float(np.spacing(f.x[0]))
    assert half / math.sqrt(f.P[0, 0]) < 1 / 7.9


@pytest.mark.parametrize("what", ["ranges", "range and bearing", "fixes"])
@pytest.mark.parametrize("kind", [auvest.RobustEkf, auvest.RobustUkf, auvest.Ckf])
def test_a_robust_filter_comes_back_from_a_bad_time_stamp_within_the_limit(kind, what):
    """A prediction of 50 min by mistake takes the estimate 3 km away.

    Ranges alone have another solution where the belief is wider than the leaders are apart; the
    points of a Ukf do not decide it, and its covariance says so.
    """
    rng = np.random.default_rng(0)
    options = (
        {}
        if issubclass(kind, auvest.RobustEkf | auvest.RobustUkf)
        else {"kernel": "hampel", "recovery": auvest.RejectionStreak()}
    )
    f = kind([0.0, 0.0], np.eye(2) * 4, process=auvest.SpeedHeading(), **options)
    leaders = [(200.0, 0.0), (0.0, 200.0), (-200.0, -100.0)]
    truth = np.zeros(2)
    errors = []
    for k in range(200):
        motion = [1.0, 0.0, 0.02 * k]
        f.predict(1.0, motion)
        truth += [math.cos(motion[2]), math.sin(motion[2])]
        if k == 50:
            f.predict(3000.0, motion)
        leader = leaders[k % 3]
        away = truth - leader
        if what == "ranges":
            f.update(np.hypot(*away) + rng.normal(), auvest.LeaderRange(leader=leader))
        elif what == "fixes":
            f.update(truth + rng.normal(size=2), auvest.Position())
        else:
            sonar = auvest.RangeBearing(station=leader, sigma_range_m=1.0)
            z = [np.hypot(*away) + rng.normal(), np.arctan2(away[1], away[0])]
            f.update(z + np.array([0.0, 0.01 * rng.normal()]), sonar)
        errors.append(np.hypot(*(f.x - truth)))
    assert max(errors[40:50]) < 3
    assert errors[50] > 2900
    if (kind, what) == (auvest.RobustUkf, "ranges"):
        assert max(errors[-10:]) < 2 * math.sqrt(np.trace(f.P))
        return
    assert max(errors[95:]) < 10
    assert f.status == Status.ok


def test_recoveries_that_repeat_are_named_and_end():
    """Ranges that are a fifth too long: no belief is right, however wide."""
    rng = np.random.default_rng(1)
    f = auvest.RobustEkf([0.0, 0.0], np.eye(2), process=auvest.SpeedHeading(), kernel="igg")
    leaders = np.array([(300.0, 0.0), (-150.0, 260.0), (-150.0, -260.0)])
    truth, recovered, named = np.zeros(2), 0, 0
    for k in range(600):
        motion = [1.0, 0.0, 0.02 * k]
        f.predict(2.0, motion)
        truth += 2 * np.array([math.cos(motion[2]), math.sin(motion[2])])
        z = 1.2 * np.hypot(*(truth - leaders[k % 3])) + rng.normal()
        f.update(z, auvest.LeaderRange(leader=leaders[k % 3]))
        recovered += f.report.recovered
        named += f.status == Status.recoveries_repeat
    assert 5 <= recovered <= 5 + 600 / 50
    assert named > 0
    twin = copy.deepcopy(f)
    pickled = pickle.loads(pickle.dumps(f))
    assert twin.status == pickled.status == f.status
