"""``run`` of many records: the bits of each record by itself, whatever the lanes and threads."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from family_support import ALL, BUILT_IN, PRECISE_CASES, make, make_lost, record
from filter_support import same_bits

import auvest
from auvest import FilterError, Status, _core
from auvest.errors import Interrupted
from auvest.filters import _many

NAN = math.nan
RUNS, REFUSED_RUN, REFUSED_ROW = 5, 3, 20


def alone(f, z, **given):
    """One run by a copy of the filter: its result and how it ended."""
    try:
        return copy.copy(f).run(z, **given), Status.ok
    except FilterError as error:
        return error.partial, error.status


def require_each_alone(f, z, result, shared, own):
    """Each run of a stack is that of the record by itself, to the bit."""
    before = f.save()
    for r in range(len(z)):
        one, status = alone(f, z[r], **shared, **{name: value[r] for name, value in own.items()})
        assert result.status[r] == int(status)
        assert result.rows[r] == len(one)
        mine = result.run(r)
        assert mine.columns == one.columns
        for name in one.columns:
            assert mine[name].dtype == one[name].dtype
            assert same_bits(mine[name], one[name]), (name, r)
            beyond = result[name][r, len(one) :]
            assert np.isnan(beyond).all() if beyond.dtype.kind == "f" else not beyond.any()
    assert f.save() == before


def noisy(rows, rng):
    """Records like this one with other noise, other missing rows and a clock that jumped in one."""
    z = np.repeat(rows.z[np.newaxis], RUNS, axis=0)
    z[1:] += 0.1 * rng.standard_normal(z[1:].shape)
    z[rng.random(z.shape[:2]) < 0.1] = NAN
    dt = np.repeat(rows.dt[np.newaxis], RUNS, axis=0)
    dt[REFUSED_RUN, REFUSED_ROW] = 4000.0  # longest_step_s is an hour
    return z, dt


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize(("kind", "name", "dtype"), PRECISE_CASES)
def test_a_stack_gives_the_bits_of_each_record(kind, name, dtype, robust):
    options = {"kernel": "igg", "recovery": auvest.RejectionStreak(rejections=2)}
    f = make(kind, name, dtype, **(options if robust else {"kernel": None, "recovery": None}))
    rows = record(ALL[name])
    z, dt = noisy(rows, np.random.default_rng(7))
    shared = {
        "input": rows.input,
        "sensor": rows.sensor,
        "place": rows.place if rows.place.size > 0 else None,
    }
    result = f.run(z, dt=dt, **shared)
    assert isinstance(result, auvest.RunsResult)
    assert list(np.flatnonzero(result.failed)) == [REFUSED_RUN]
    assert result.status[REFUSED_RUN] == int(Status.step_too_long)
    assert result.rows[REFUSED_RUN] == REFUSED_ROW
    require_each_alone(f, z, result, shared, {"dt": dt})


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_filter_of_late_measurements_takes_stacks_too(name):
    kind = auvest.Ukf
    f = make(kind, name, late_s=2.0)
    rows = record(ALL[name])
    z, dt = noisy(rows, np.random.default_rng(8))
    age = np.where(np.arange(len(rows)) % 7 == 6, 0.4, 0.0)
    place = rows.place if rows.place.size > 0 else None
    shared = {"input": rows.input, "sensor": rows.sensor, "place": place, "age_s": age}
    result = f.run(z, dt=dt, **shared, workers=2)
    require_each_alone(f, z, result, shared, {"dt": dt})


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_gaussian_sum_takes_stacks_too(dtype):
    f = make_lost(auvest.Ekf, "SpeedHeading", dtype)
    rows = record(ALL["SpeedHeading"])
    z, dt = noisy(rows, np.random.default_rng(9))
    shared = {"input": rows.input, "sensor": rows.sensor, "place": rows.place}
    result = f.run(z, dt=dt, **shared)
    require_each_alone(f, z, result, shared, {"dt": dt})
    assert result.mixture_size.max() > 1


# ---- In lanes.

LANES = ("scalar", "sse2", "avx2", "avx512")


@pytest.fixture(params=LANES)
def lanes(request, monkeypatch):
    """Each instruction set in turn; what the processor lacks is skipped."""
    if request.param not in _core.slat_lanes(True):
        pytest.skip(f"this processor has no {request.param}")
    monkeypatch.setattr(_many, "lanes", lambda: request.param)
    return request.param


@pytest.fixture
def counted(monkeypatch):
    """How many rows were not done in lanes, and how many in all."""
    count = {"alone": 0, "rows": 0}
    real = _core.run_each

    def run_each(*arguments):
        rows, single, status = real(*arguments)
        count["alone"] += int(single.sum())
        count["rows"] += int(rows.sum())
        return rows, single, status

    monkeypatch.setattr(_core, "run_each", run_each)
    return count


KERNELS = {
    "plain": {},
    "huber": {"kernel": "huber"},
    "hampel": {"kernel": "hampel", "recovery": auvest.RejectionStreak(rejections=2)},
    "igg": {"kernel": "igg", "recovery": auvest.RejectionStreak(rejections=1)},
}
PROCESSES = {
    "euler": auvest.ConstantAcceleration(discretisation="euler"),
    "exact": auvest.ConstantAcceleration(discretisation="exact"),
    "course": auvest.SpeedHeading(sigma_forward=0.3, sigma_starboard=0.1),
}


def in_lanes(kind, process, dtype, **options):
    """A filter whose models stand in lanes, from beside the station: the near field, too."""
    model = PROCESSES[process]
    n = len(model.state)
    x0 = np.array([0.5, 2.3, 0.4, 0.3, 0.01, 0.02])[:n]
    p0 = np.diag([0.3, 0.2, 0.05, 0.05, 0.02, 0.02][:n]) ** 2
    p0[0, 1] = p0[1, 0] = 0.01
    sensors = {
        "station": auvest.RangeBearing(station=(0.2, 2.0), sigma_range_m=0.1),
        "leader": auvest.LeaderRange(leader=(20.0, -5.0), sigma_range_m=0.2),
    }
    if kind is auvest.Ukf:
        options = {"alpha": 1e-3, **options}
    return kind(x0, p0, process=model, sensors=sensors, dtype=dtype, **options)


def echoes(f, runs, rows, *, outliers=0.15):
    """Records of a wandering craft: both sensors in turn, places that move, missing rows, outliers
    that are small, large and in a row, and in run 7 a range that no instrument measures.
    """
    rng = np.random.default_rng(11)
    time = 0.5 * np.arange(1, rows + 1)
    track = np.stack([0.5 + 0.4 * time, 2.3 + 0.3 * time + np.sin(0.2 * time)], axis=1)
    sensor = ["station" if k % 3 else "leader" for k in range(rows)]
    place = np.full((runs, rows, 2), NAN)
    place[:, 5::4] = rng.normal([3.0, 1.0], 1.0, (runs, len(range(5, rows, 4)), 2))
    z = np.full((runs, rows, 2), NAN)
    for r in range(runs):
        for k in range(rows):
            own = np.array([0.2, 2.0] if sensor[k] == "station" else [20.0, -5.0])
            at = own if np.isnan(place[r, k, 0]) else place[r, k]
            gap = track[k] - at
            z[r, k, 0] = abs(np.hypot(*gap) + 0.1 * rng.standard_normal())
            if sensor[k] == "station":
                z[r, k, 1] = np.arctan2(gap[1], gap[0]) + 0.01 * rng.standard_normal()
    wild = rng.random((runs, rows)) < outliers
    z[wild, 0] += 3 * rng.random(wild.sum()) ** 3
    z[3, 20:30, 0] += 5.0  # a bias that stays: the recovery
    z[rng.random((runs, rows)) < 0.05] = NAN
    z[7, 25] = [-9999.0, 0.0 if sensor[25] == "station" else NAN]
    given = {"dt": 0.5, "sensor": sensor}
    if f.process.input:
        heading = 0.6 + 0.1 * np.sin(time)
        given["input"] = np.stack([0.5 + 0.0 * time, 0.1 * np.cos(time), heading], axis=1)
    return z, given, {"place": place}


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_every_width_has_the_bits_of_each_record(lanes, counted, kind, process, dtype, kernel):
    f = in_lanes(kind, process, dtype, **KERNELS[kernel])
    z, shared, own = echoes(f, 21, 40)  # a whole block and the beginning of one
    result = f.run(z, **shared, **own)
    require_each_alone(f, z, result, shared, own)
    assert list(np.flatnonzero(result.failed)) == [7]
    assert result.status[7] == int(Status.impossible_range)
    assert result.near_field.any()
    if kernel != "plain":
        assert (result.decision == int(auvest.Decision.downweighted)).any()
    if kernel == "igg":
        assert result.recovered.any()
    # One row is refused; what else is not ordinary is rare.
    limit = counted["rows"] if lanes == "scalar" else 0.02 * counted["rows"]
    assert 0 < counted["alone"] <= limit + 1


@pytest.mark.usefixtures("lanes")
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("alpha", [1e-6, 1e-3, 1.0])
def test_points_near_and_far_have_the_same_bits(dtype, alpha):
    """Deviations in closed form: to first order below epsilon, else whole; lanes may differ."""
    f = in_lanes(auvest.Ukf, "euler", dtype, alpha=alpha)
    z, shared, own = echoes(f, 17, 40, outliers=0.0)
    require_each_alone(f, z, f.run(z, **shared, **own), shared, own)


@pytest.mark.parametrize(
    "policy",
    [
        auvest.MahalanobisInterval(preset="figure3"),
        auvest.CovarianceBudget(position_sigma_m=0.15),
        auvest.FixedInterval(interval_s=0.7),
    ],
    ids=lambda policy: type(policy).__name__,
)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_each_lane_has_its_own_interval(lanes, counted, dtype, policy):
    f = in_lanes(auvest.Aukf, "euler", dtype, policy=policy)
    z, shared, own = echoes(f, 18, 40)
    z[7, 25] = NAN
    reference = {"reference": np.random.default_rng(2).normal(5.0, 2.0, (18, 40, 2))}
    for dt, desired in (({"dt": 0.5}, {}), ({}, reference)):
        given = {name: value for name, value in shared.items() if name != "dt"} | dt
        result = f.run(z, **given, **own, **desired)
        require_each_alone(f, z, result, given, {**own, **desired})
    varied = np.ptp(result.interval_s, axis=0).max() > 0
    assert varied == (not isinstance(policy, auvest.FixedInterval))
    assert counted["alone"] <= (counted["rows"] if lanes == "scalar" else 0.02 * counted["rows"])


@pytest.mark.usefixtures("lanes")
def test_rows_that_are_not_ordinary_are_the_runs_own_affair(counted):
    """Some km from the origin floats are fine enough for this P, but lanes do not ask closely."""
    f = auvest.Ekf(
        [3000.0, 2500.0],
        1e-6 * np.eye(2),
        process=auvest.SpeedHeading(sigma_forward=1e-4, sigma_heading=0.0),
        sensors=auvest.LeaderRange(leader=(2990.0, 2490.0), sigma_range_m=1e-3),
        dtype="float32",
    )
    z = np.hypot(10, 10) + np.random.default_rng(4).normal(0, 1e-3, (9, 50, 1))
    shared = {"dt": 0.1, "input": np.zeros((50, 3))}
    result = f.run(z, **shared)
    require_each_alone(f, z, result, shared, {})
    assert not result.failed.any()
    assert counted["alone"] == counted["rows"] == 9 * 50


# ---- Arguments and results.


def stack_of(runs=3, rows=4):
    f = auvest.Ekf(
        [1.0, 2.0],
        np.eye(2),
        process=auvest.SpeedHeading(),
        sensors={"gps": auvest.Position(), "leader": auvest.LeaderRange(leader=(9.0, 9.0))},
    )
    z = np.random.default_rng(1).normal(1.0, 0.5, (runs, rows, 2))
    given = {"dt": 1.0, "input": np.zeros((rows, 3)), "sensor": "gps"}
    return f, z, given


def test_the_result_does_not_depend_on_the_workers():
    f = in_lanes(auvest.Ukf, "euler", "float32")
    z, shared, own = echoes(f, 70, 30)
    one, many = (f.run(z, **shared, **own, workers=n) for n in (1, 3))
    for name in one.columns:
        assert same_bits(one[name], many[name]), name


def test_after_ctrl_c_the_runs_that_are_done_are_kept(monkeypatch):
    f = in_lanes(auvest.Ukf, "euler", "float32")
    z, shared, own = echoes(f, 70, 30)
    whole = f.run(z, **shared, **own)

    def stop(task, runs, *, chunk, workers):
        assert (runs, chunk, workers) == (70, 32, 1)
        raise Interrupted(task(32, 32))  # the second chunk was quicker than the first

    monkeypatch.setattr(_many.montecarlo, "run", stop)
    with pytest.raises(Interrupted) as interrupt:
        f.run(z, **shared, **own, workers=1)
    partial = interrupt.value.partial
    assert len(partial) == 32
    for name in whole.columns:
        assert same_bits(partial[name], whole[name][32:64]), name
    assert f.x.shape == (6,)  # nobody is inside any more


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dt": np.ones((2, 4))}, "dt has 2 runs and z has 3; they must have the same"),
        ({"dt": np.ones((3, 5))}, "run 0: dt has 5 rows and z has 4; they must have the same"),
        ({"input": np.zeros((2, 4, 3))}, "input has 2 runs and z has 3; they must have the same"),
        (
            {"input": np.zeros((5, 3))},
            "run 0: input has 5 rows and z has 4; they must have the same",
        ),
        (
            {"sensor": ["gps"] * 5},
            "sensor has 5 rows and each run of z has 4; they must have the same",
        ),
        ({"dt": [[1.0], [1.0, 2.0]]}, "run 0: dt must be an array of shape .T,., not rows of diff"),
        ({"workers": 0}, "workers must lie in 1..256, not 0"),
    ],
)
def test_arguments_of_other_sizes_are_refused(change, message):
    f, z, given = stack_of()
    before = f.save()
    with pytest.raises(ValueError, match=f"^{message}"):
        f.run(z, **{**given, **change})
    assert f.save() == before


def test_a_number_that_is_none_is_named_with_its_run():
    f, z, given = stack_of()
    z[2, 1, 0] = math.inf
    with pytest.raises(ValueError, match=r"^run 2: z\[1, 0\] is inf; all elements must be finite$"):
        f.run(z, **given)
    with pytest.raises(ValueError, match=r"^z is empty: shape \(0, 4, 2\)"):
        f.run(z[:0], **given)


def test_columns_are_those_that_were_asked_for():
    f, z, given = stack_of()
    result = f.run(z, **given, covariance=False)
    assert "P" not in result.columns
    assert "interval_s" not in result.columns
    assert result.x.shape == (3, 4, 2)
    assert len(result) == 3
    assert result.run(1).x.shape == (4, 2)
    table = result.to_pandas(["x"])
    assert list(table.columns) == ["x_0", "x_1"]
    assert table.loc[(2, 3), "x_1"] == result.x[2, 3, 1]


def test_what_a_function_of_python_raises_is_raised():
    def broken(x):
        raise KeyError(f"no such reading at {x}")

    f = auvest.Ukf(
        [1.0, 2.0],
        np.eye(2),
        process=auvest.SpeedHeading(),
        sensors=auvest.FunctionSensor(broken, np.eye(1)),
    )
    with pytest.raises(FilterError) as error:
        f.run(np.ones((2, 3, 1)), dt=1.0, input=np.zeros((3, 3)))
    assert isinstance(error.value.__cause__, KeyError)
