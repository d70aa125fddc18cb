"""RobustEkf and RobustUkf: the plain filters' bits, the paper's equations, records, bad input."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest
from filter_support import DTYPES, measure, same_bits, straight

import auvest
from auvest import Decision, LeaderRange, Odometry, SpeedHeading

X0 = [3.0, -1.0, 0.1, 0.2, 0.0, 0.0]
P0 = np.diag([0.04, 0.04, 0.01, 0.01, 1e-4, 1e-4])
LEADERS = np.array([[300.0, 0.0], [-150.0, 260.0], [-150.0, -260.0]])


def fleet(steps=60, seed=3, outliers=0.2):
    """Motions (T, 3), ranges (T,) of which two of five are missing, leaders (T, 2)."""
    rng = np.random.default_rng(seed)
    heading = 0.3 * np.sin(0.1 * np.arange(steps))
    motion = np.stack([np.full(steps, 1.5), np.full(steps, 0.2), heading], axis=1)
    c, s = np.cos(heading), np.sin(heading)
    position = np.cumsum(np.stack([1.5 * c - 0.2 * s, 1.5 * s + 0.2 * c], axis=1), axis=0)
    leader = LEADERS[np.arange(steps) % 3]
    z = np.hypot(*(position - leader).T) + rng.standard_normal(steps)
    z[rng.random(steps) < outliers] += 40.0
    z[np.arange(steps) % 5 < 2] = np.nan
    motion[:, 2] += 0.01 * rng.standard_normal(steps)
    return motion, z, leader


def slave(kind=auvest.RobustEkf, **options):
    options = {
        "process": SpeedHeading(sigma_starboard=0.05),
        "sensors": LeaderRange(),
        "kernel": "igg",
        **options,
    }
    states = 2 + options["process"].heading_bias + options["process"].speed_scale
    return kind(np.zeros(states), np.diag([4.0, 4.0, 0.01, 0.01][:states]), **options)


def everything(f):
    report = f.report
    numbers = () if report is None else (report.innovation, report.S, report.nis, report.weight)
    return [np.asarray(v).tobytes() for v in (f.x, f.P, *numbers)]


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("discretisation", ["euler", "exact"])
@pytest.mark.parametrize(
    ("plain", "robust"), [(auvest.Ekf, auvest.RobustEkf), (auvest.Ukf, auvest.RobustUkf)]
)
def test_the_unit_kernel_gives_the_bits_of_the_plain_filter(plain, robust, discretisation, dtype):
    process = auvest.ConstantAcceleration(discretisation=discretisation)
    a = plain(X0, P0, process=process, sensors=auvest.RangeBearing(), dtype=dtype)
    b = robust(
        X0,
        P0,
        process=process,
        sensors=auvest.RangeBearing(),
        kernel="unit",
        dtype=dtype,
    )
    z = measure(straight(50))
    z[7] = np.nan
    wanted, found = a.run(z, dt=0.5), b.run(z, dt=0.5)
    for name in ("x", "P", "innovation", "S", "nis", "near_field"):
        assert same_bits(getattr(wanted, name), getattr(found, name)), name
    assert (found.weight[~np.isnan(found.nis)] == 1).all()
    assert (found.iterations == np.where(np.isnan(found.nis), 0, 1)).all()


def igg(t, k0=1.5, k1=3.0):
    return 1.0 if abs(t) < k0 else k0 / abs(t) if abs(t) < k1 else 0.0


def textbook(motion, z, leader, process, sensor):
    """The same filter written from the paper's equations, with the gain form of the update."""
    x, p, rows = np.zeros(2), 4.0 * np.eye(2), []
    for (forward, starboard, heading), range_m, there in zip(motion, z, leader, strict=True):
        c, s = math.cos(heading), math.sin(heading)
        velocity = np.array([forward * c - starboard * s, forward * s + starboard * c])
        x = x + velocity  # Eq. (1), dt = 1 s
        g = np.array([[c, -s, -velocity[1]], [s, c, velocity[0]]])
        sigma = [process.sigma_forward, process.sigma_starboard, process.sigma_heading]
        p = p + g @ np.diag(np.square(sigma)) @ g.T  # Eqs. (2)-(3)
        if not math.isnan(range_m):
            d = x - there
            r = math.hypot(*d)
            h = d / r
            across = np.array([-h[1], h[0]])
            bend = across @ p @ across / (2 * r)  # second order
            innovation = range_m - r - bend
            noise = sensor.sigma_range_m**2 + sensor.sigma_leader_m**2 + 2 * bend**2
            variance = h @ p @ h + noise
            weight = igg(innovation / math.sqrt(variance))  # Eq. (20)
            if weight > 0:
                gain = p @ h / (h @ p @ h + noise / weight)
                x = x + gain * innovation
                p = p - np.outer(gain, h @ p)
            rows.append((*x, p[0, 0], p[1, 0], p[1, 1], innovation, variance, weight))
        else:
            rows.append((*x, p[0, 0], p[1, 0], p[1, 1], np.nan, np.nan, np.nan))
    return np.array(rows)


def test_agrees_with_the_equations():
    process = SpeedHeading(sigma_forward=0.2, sigma_starboard=0.05, sigma_heading=0.02)
    sensor = LeaderRange(sigma_range_m=0.8, sigma_leader_m=0.6)
    motion, z, leader = fleet()
    f = slave(process=process, sensors=sensor, recovery=None)
    found = f.run(z, dt=1.0, input=motion, place=leader)
    wanted = textbook(motion, z, leader, process, sensor)
    weights = wanted[:, 7]
    known = weights[~np.isnan(weights)]
    assert (known == 0).any()
    assert ((known > 0) & (known < 1)).any(), "the record must reach all segments"
    table = np.column_stack(
        [found.x, found.P[:, 0, 0], found.P[:, 1, 0], found.P[:, 1, 1], found.innovation[:, 0],
         found.S[:, 0, 0], found.weight[:, 0]]
    )  # fmt: skip
    np.testing.assert_allclose(table, wanted, rtol=1e-10, atol=1e-10)
    expected = np.select([known == 0, known < 1], [2, 1], 0)
    assert (found.decision[~np.isnan(weights)] == expected).all()


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", [auvest.RobustEkf, auvest.RobustUkf])
@pytest.mark.parametrize("states", [(False, False), (True, False), (False, True), (True, True)])
def test_a_record_gives_the_bits_of_its_steps(kind, states, dtype):
    motion, z, leader = fleet()
    process = SpeedHeading(heading_bias=states[0], speed_scale=states[1])
    a, b = (slave(kind, process=process, dtype=dtype) for _ in range(2))
    found = a.run(z, dt=1.0, input=motion, place=leader)
    for k in range(len(z)):
        b.predict(1.0, motion[k])
        b.update(z[k], LeaderRange(leader=tuple(leader[k])))
        report = b.report
        assert same_bits(found.x[k], b.x)
        assert same_bits(found.P[k], b.P)
        assert (report is None) == bool(np.isnan(z[k]))
        if report is not None:
            assert same_bits(found.innovation[k], report.innovation)
            assert same_bits(found.S[k], report.S)
            assert same_bits(found.weight[k], report.weight)
            assert same_bits(found.standardised[k], report.standardised)
            assert found.decision[k] == int(report.decision)
            assert found.iterations[k] == report.iterations
    assert everything(a) == everything(b)


def test_the_instruments_errors_are_found():
    """Compass 0.1 rad off, speed 5 % too low: 600 s of ranges without noise give both."""
    steps = 600
    heading = 0.01 * np.arange(steps)
    position = np.cumsum(1.5 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    leader = LEADERS[np.arange(steps) % 3]
    z = np.hypot(*(position - leader).T)
    motion = np.stack([np.full(steps, 1.5 / 1.05), np.zeros(steps), heading - 0.1], axis=1)
    f = slave(process=SpeedHeading(heading_bias=True, speed_scale=True))
    f.run(z, dt=1.0, input=motion, place=leader)
    assert f.x[2] == pytest.approx(0.1, abs=3 * math.sqrt(f.P[2, 2]))
    assert f.x[3] == pytest.approx(0.05, abs=3 * math.sqrt(f.P[3, 3]))
    assert math.sqrt(f.P[2, 2]) < 0.02
    assert math.sqrt(f.P[3, 3]) < 0.02


def test_odometry_turns_its_increments():
    f = auvest.RobustEkf([1.0, 2.0, math.pi / 2], 1e-4 * np.eye(3), process=Odometry())
    f.predict(1.0, [3.0, 1.0, 0.5])
    np.testing.assert_allclose(f.x, [1.0 - 1.0, 2.0 + 3.0, math.pi / 2 + 0.5], atol=1e-14)
    variance = 1e-4 + 0.05**2 * 10 + 0.1**2
    np.testing.assert_allclose(f.P[0, 0], variance + 1e-4 * 3.0**2, rtol=1e-12)
    # d(x, y) / d theta = (-3, -1)
    np.testing.assert_allclose(f.P[1, 0], 1e-4 * 3.0 * 1.0, rtol=1e-12)
    np.testing.assert_allclose(f.P[2, :2], [-1e-4 * 3.0, -1e-4 * 1.0], rtol=1e-12)


@pytest.mark.parametrize("carry", [copy.deepcopy, lambda f: pickle.loads(pickle.dumps(f))])
@pytest.mark.parametrize("dtype", DTYPES)
def test_a_copy_goes_on_with_the_same_bits_in_the_middle_of_a_streak(carry, dtype):
    f = slave(dtype=dtype)
    for _ in range(2):
        f.update(900.0, LeaderRange(leader=(300.0, 0.0)))
    assert f.report.decision == Decision.rejected
    g = carry(f)
    assert everything(f) == everything(g)
    assert g.report.decision == Decision.rejected
    h = slave(dtype=dtype)
    h.restore(f.save())
    for each in (f, g, h):
        recovered = []
        for _ in range(2):
            each.update(900.0, LeaderRange(leader=(300.0, 0.0)))
            recovered.append(each.report.recovered)
        assert recovered == [False, True]
    assert everything(f) == everything(g) == everything(h)


@pytest.mark.parametrize(
    ("kernel", "wanted"),
    [
        (auvest.Unit(), [1, 1, 1, 1, 1]),
        (auvest.Huber(k=1.5), [1, 1, 0.75, 0.3, 0.15]),
        (auvest.Igg(k0=1.5, k1=5.0), [1, 1, 0.75, 0, 0]),
        (auvest.Hampel(a=1.5, b=3.0, c=8.0), [1, 1, 0.75, 0.18, 0]),
    ],
)
def test_weights_of_the_kernels(kernel, wanted):
    t = np.array([0.0, -1.0, 2.0, -5.0, 10.0])
    np.testing.assert_allclose(kernel.weight(t), wanted, rtol=1e-15)
    steps = np.linspace(0, 10, 100_001)
    psi = kernel.weight(steps) * steps
    area = np.concatenate([[0.0], np.cumsum((psi[1:] + psi[:-1]) / 2 * 1e-4)])
    np.testing.assert_allclose(kernel.rho(steps), area, atol=6e-4)  # psi' jumps by at most 3


def test_a_name_stands_for_the_default_kernel():
    assert slave(kernel="igg").kernel == auvest.Igg()
    for kind in (auvest.RobustEkf, auvest.RobustUkf):  # one default where a filter is robust
        assert kind([0, 0], np.eye(2), process=SpeedHeading()).kernel == auvest.Hampel()


CASES = {
    "kernel name": (lambda: slave(kernel="l1"), ValueError, r"kernel must be 'igg', .* not 'l1'"),
    "kernel type": (lambda: slave(kernel=1.5), TypeError, "kernel must be an auvest.Igg"),
    "k0": (lambda: auvest.Igg(k0=0.0), ValueError, "k0 must be positive"),
    "k1": (lambda: auvest.Igg(k1=1.0), ValueError, "k0 <= k1 is required, not k0=1.5, k1=1.0"),
    "hampel": (lambda: auvest.Hampel(c=math.inf), ValueError, "c must be finite"),
    "hampel order": (
        lambda: auvest.Hampel(a=2.0, b=1.0, c=3.0),
        ValueError,
        r"a <= b <= c is required, not a=2\.0, b=1\.0, c=3\.0",
    ),
    "rejections": (lambda: auvest.RejectionStreak(rejections=0), ValueError, r"1\.\.60, not 0"),
    "recovery": (lambda: slave(recovery=6), TypeError, "recovery must be an auvest.Reje"),
    "residual": (lambda: slave(residual="both"), ValueError, "residual must be 'innovation' or"),
    "iterations": (lambda: slave(max_iterations=1), ValueError, r"max_iterations .* 2\.\.255"),
    "tolerance": (lambda: slave(tolerance=-1.0), ValueError, "tolerance must not be negative"),
    "process": (
        lambda: auvest.RobustEkf([0, 0], np.eye(2), process=LeaderRange()),
        TypeError,
        "process must be an auvest.ProcessModel",
    ),
    "x0": (
        lambda: auvest.RobustEkf([0, 0], np.eye(3), process=Odometry()),
        ValueError,
        r"x0 has shape \(2,\), expected \(3,\)",
    ),
    "P0": (
        lambda: auvest.RobustEkf([0, 0], np.ones((2, 2)), process=SpeedHeading()),
        ValueError,
        "P0 must be positive definite in float64",
    ),
    "kappa": (lambda: slave(auvest.RobustUkf, kappa=-2.0), ValueError, "kappa must be above -2"),
    "speed": (lambda: SpeedHeading(sigma_forward=-1.0), ValueError, "sigma_forward must not be"),
    "bias": (lambda: SpeedHeading(heading_bias=1), TypeError, "heading_bias must be True or"),
    "turn": (lambda: Odometry(sigma_turn=math.nan), ValueError, "sigma_turn must be finite"),
    "range": (lambda: LeaderRange(sigma_range_m=0.0), ValueError, "sigma_range_m must be posi"),
    "leader": (lambda: LeaderRange(leader=(1.0, math.inf)), ValueError, r"leader\[1\] is inf"),
}


@pytest.mark.parametrize("case", CASES)
def test_wrong_parameters_are_refused(case):
    action, error, message = CASES[case]
    with pytest.raises(error, match=message):
        action()


MOTION = [1.5, 0.0, 0.1]
CALLS = {
    "no motion": (lambda f: f.predict(1.0), TypeError, r"input must be an array of shape \(3,\)"),
    "short motion": (lambda f: f.predict(1.0, [1.0, 0.0]), ValueError, "input has shape"),
    "motion nan": (lambda f: f.predict(1.0, [1.0, 0.0, math.nan]), ValueError, r"input\[2\]"),
    "dt": (lambda f: f.predict(-1.0, MOTION), ValueError, "dt must not be negative"),
    "z inf": (lambda f: f.update(math.inf), ValueError, r"z\[0\] is inf"),
    "z pair": (lambda f: f.update([1.0, 2.0]), ValueError, r"z has shape \(2,\), expected \(1,\)"),
    "measurement": (lambda f: f.update(1.0, SpeedHeading()), TypeError, "sensor must be an"),
    "run shape": (
        lambda f: f.run(np.ones((4, 2)), dt=1.0, input=np.tile(MOTION, (4, 1))),
        ValueError,
        r"z has shape \(4, 2\), expected \(T, 1\)",
    ),
    "run motion": (
        lambda f: f.run(np.ones(4), dt=1.0, input=np.tile(MOTION, (3, 1)), place=np.ones((4, 2))),
        ValueError,
        "input has 3 rows and z has 4",
    ),
    "run position": (
        lambda f: f.run(np.ones(2), dt=1.0, input=np.tile(MOTION, (2, 1)), place=[[1, 2]]),
        ValueError,
        "^place has 1 row and z has 2; they must have the same$",
    ),
    "state": (lambda f: f.restore(b"?"), ValueError, "state is not from save"),
}


@pytest.mark.parametrize("case", CALLS)
def test_wrong_calls_are_refused_and_leave_the_filter(case):
    f = slave()
    f.predict(1.0, MOTION)
    f.update(300.0, LeaderRange(leader=(300.0, 0.0)))
    before = everything(f)
    action, error, message = CALLS[case]
    with pytest.raises(error, match=message):
        action(f)
    assert everything(f) == before


def test_motion_is_refused_where_nothing_takes_it():
    f = auvest.RobustEkf(X0, P0, process=auvest.ConstantAcceleration())
    with pytest.raises(TypeError, match="input must be None: ConstantAcceleration has no input"):
        f.predict(1.0, MOTION)


def test_a_row_that_fails_leaves_the_filter_at_the_row_before():
    motion, z, leader = fleet(steps=20)
    motion[11] = [1e308, 1e308, 0.5]
    f, g = slave(), slave()
    with pytest.raises(auvest.FilterError, match="at row 11") as caught:
        f.run(z, dt=np.where(np.arange(20) == 11, 1e10, 1.0), input=motion, place=leader)
    assert caught.value.step == 11
    g.run(z[:11], dt=1.0, input=motion[:11], place=leader[:11])
    assert everything(f)[:2] == everything(g)[:2]
    assert len(caught.value.partial) == 11


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", [auvest.RobustEkf, auvest.RobustUkf])
def test_rejections_of_what_does_not_see_the_position_do_not_widen_it(kind, dtype):
    """A velocity log that fails: the slope of the position in it is 0, or rounding."""
    p0 = np.diag([4.0, 4.0, 0.04, 0.04])
    p0[0, 2] = p0[2, 0] = p0[1, 3] = p0[3, 1] = 0.2
    f = kind(
        [40.0, 30.0, 0.4, 0.3],
        p0,
        process=auvest.WhiteAcceleration(),
        sensors=auvest.BodyVelocity(heading_rad=0.0),
        recovery=auvest.RejectionStreak(rejections=2),
        dtype=dtype,
    )
    before = f.P
    for _ in range(4):
        f.update([30.0, 30.0])
        assert f.report.decision == Decision.rejected
    assert f.report.recovered  # that is all that the rule can do: the position is not to blame
    assert same_bits(f.P, before)


@pytest.mark.parametrize("kind", [auvest.RobustEkf, auvest.RobustUkf])
def test_without_a_recovery_nothing_ends_a_lock_out(kind):
    """What is rejected leaves the belief as it is, however often; a streak would widen it."""
    alone, helped = (slave(kind, recovery=r) for r in (None, auvest.RejectionStreak()))
    start = alone.P
    for _ in range(20):
        for f in (alone, helped):
            f.update(500.0, place=[100.0, 0.0])
        assert alone.report.decision == Decision.rejected
        assert not alone.report.recovered
        assert same_bits(alone.P, start)
    assert helped.P[0, 0] > 100 * start[0, 0]


@pytest.mark.parametrize(("kernel", "jump"), [("igg", 1.5 / 3.0), ("hampel", 0.0), ("huber", 0.0)])
def test_two_precisions_part_where_a_weight_jumps(kernel, jump):
    """A residual that stands at IGG's k1 to the last digits is half believed, or rejected."""
    p, r = 0.5, 1.0
    f = auvest.RobustEkf(
        [0, 0],
        p * np.eye(2),
        kernel=kernel,
        process=SpeedHeading(),
        sensors=LeaderRange(leader=(100, 0)),
    )
    edge = {"igg": auvest.Igg().k1, "hampel": auvest.Hampel().c, "huber": auvest.Huber().k}[kernel]
    probe = copy.deepcopy(f)
    probe.update(100.0)  # says where the innovation is 0, and S
    at_the_edge = 100.0 - probe.innovation[0] - edge * np.sqrt(probe.S[0, 0])
    ends = []
    for off in (-1e-6, 1e-6):  # what float32 makes of 100 m
        one = copy.deepcopy(f)
        one.update(at_the_edge + off)
        ends.append(one.x)
    # With the weight w the noise is r / w, and the innovation is `edge` times its deviation.
    wanted = p / (p + r / jump) * edge * np.sqrt(p + r) if jump else 0.0
    assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(wanted, rel=1e-4, abs=1e-5)
