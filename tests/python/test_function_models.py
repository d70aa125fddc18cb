"""Models as Python functions: the built-in ones written again, what they raise, what is saved."""

from __future__ import annotations

import copy
import functools
import math
import pickle

import numpy as np
import pytest
from family_support import KINDS, everything, fix, glider, readable, turner
from filter_support import same_bits

import auvest
from auvest import FilterError, FunctionProcess, FunctionSensor

STATE = auvest.ConstantAcceleration.state
STATION = (0.2, 2.0)
X0 = [50.2, 2.0, 0.0, 0.2, 0.0, 0.0]
P0 = np.diag([0.04, 0.04, 0.01, 0.01, 1e-4, 1e-4])


def accelerate(x, dt):
    half = dt * dt / 2
    return [
        x[0] + dt * x[2] + half * x[4],
        x[1] + dt * x[3] + half * x[5],
        x[2] + dt * x[4],
        x[3] + dt * x[5],
        x[4],
        x[5],
    ]


def driven_noise(dt):
    """The integral of Phi(s) diag(q) Phi(s)' over 0..dt."""
    model = auvest.ConstantAcceleration()
    p, v, a = model.position_psd, model.velocity_psd, model.acceleration_psd
    axis = np.array(
        [
            [p * dt + v * dt**3 / 3 + a * dt**5 / 20, v * dt**2 / 2 + a * dt**4 / 8, a * dt**3 / 6],
            [v * dt**2 / 2 + a * dt**4 / 8, v * dt + a * dt**3 / 3, a * dt**2 / 2],
            [a * dt**3 / 6, a * dt**2 / 2, a * dt],
        ]
    )
    return np.kron(axis, np.eye(2))


def transition(_, dt):
    phi = np.eye(6)
    phi[range(4), range(2, 6)] = dt
    phi[(0, 1), (4, 5)] = dt * dt / 2
    return phi


def range_bearing(x):
    dx, dy = x[0] - STATION[0], x[1] - STATION[1]
    return [math.sqrt(dx * dx + dy * dy), math.atan2(dy, dx)]


def slope(x):
    dx, dy = x[0] - STATION[0], x[1] - STATION[1]
    r2 = dx * dx + dy * dy
    r = math.sqrt(r2)
    return [[dx / r, dy / r, 0, 0, 0, 0], [-dy / r2, dx / r2, 0, 0, 0, 0]]


def track(steps):
    """An ellipse about the station, 30 to 50 m from it, at half a metre per second."""
    angle = 0.5 / 40 * 0.5 * np.arange(1, steps + 1)
    truth = np.array(STATION) + np.stack([50 * np.cos(angle), 30 * np.sin(angle)], axis=1)
    d = truth - STATION
    z = np.stack([np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0])], axis=1)
    z += np.random.default_rng(4).standard_normal(z.shape) * [0.05, 0.01]
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    z[::50] = np.nan
    return z


def written_again(jacobians):
    f = FunctionProcess(accelerate, driven_noise, transition if jacobians else None, state=STATE)
    h = FunctionSensor(
        range_bearing, np.diag([0.05, 0.01]) ** 2, slope if jacobians else None, angles=(1,)
    )
    return f, h


@pytest.mark.parametrize("jacobians", [False, True])
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind.__name__ in ("Ekf", "Ukf", "Ckf")])
def test_the_built_in_models_written_again(kind, jacobians):
    """Over 10,000 steps, relative to the size of each state."""
    if jacobians and kind is not auvest.Ekf:
        pytest.skip("only the EKF asks for Jacobians")
    z = track(10_000)
    options = {} if kind is auvest.Ekf else {"alpha": 1.0} if kind is auvest.Ukf else {}
    process, sensor = written_again(jacobians)
    ours = kind(X0, P0, process=process, sensors=sensor, **options).run(z, dt=0.5)
    wanted = kind(
        X0,
        P0,
        process=auvest.ConstantAcceleration(),
        sensors=auvest.RangeBearing(station=STATION, near_field=0.0),
        **options,
    ).run(z, dt=0.5)
    size = np.abs(wanted.x).max(axis=0)
    assert (np.abs(ours.x - wanted.x) / size).max() < 1e-9
    sigma = np.sqrt(np.diagonal(wanted.P, axis1=1, axis2=2))
    scale = sigma[:, :, None] * sigma[:, None, :]
    assert (np.abs(ours.P - wanted.P) / scale).max() < 1e-9
    np.testing.assert_allclose(ours.innovation, wanted.innovation, rtol=0, atol=1e-8)
    assert np.isnan(ours.nis[::50]).all()
    assert not wanted.near_field.any()


def test_the_models_themselves():
    process, sensor = written_again(jacobians=False)
    built_in, x = auvest.ConstantAcceleration(), np.array([3.0, -40.0, 0.5, 2.0, 0.1, -0.2])
    np.testing.assert_allclose(process.f(x, 0.5), built_in.f(x, 0.5), rtol=1e-15)
    np.testing.assert_allclose(process.Q(0.5), built_in.Q(0.5), rtol=1e-13)
    np.testing.assert_allclose(process.Phi(0.5, x), built_in.Phi(0.5), rtol=0, atol=1e-11)
    exact, _ = written_again(jacobians=True)
    np.testing.assert_array_equal(exact.Phi(0.5, x), built_in.Phi(0.5))
    wanted = auvest.RangeBearing(station=STATION).h(x)
    np.testing.assert_allclose(sensor.h(x), wanted, rtol=1e-15)
    np.testing.assert_allclose(sensor.h(np.stack([x, x])), np.stack([wanted] * 2), rtol=1e-15)
    per_second = FunctionProcess(accelerate, np.diag(np.arange(6.0)), state=6)
    np.testing.assert_array_equal(per_second.Q(0.5), 0.5 * np.diag(np.arange(6.0)))
    assert per_second.state == ("x_0", "x_1", "x_2", "x_3", "x_4", "x_5")


@pytest.mark.parametrize("x", [0.3, 30.0, -3e3, 1e7])
def test_derivatives_are_as_right_as_they_are_said_to_be(x):
    """exp, sin and a cubic about the scale of the argument: 1e-11 of the size of f."""
    scale = max(1.0, abs(x))

    def f(state, _):
        t = state[0] / scale
        return [math.exp(t), math.sin(3 * t), t**3]

    process = FunctionProcess(f, np.eye(3), state=3)
    t = x / scale
    found = process.Phi(1.0, [x, 0.0, 0.0])[:, 0] * scale
    np.testing.assert_allclose(found, [math.exp(t), 3 * math.cos(3 * t), 3 * t * t], atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_angles_are_wrapped(kind):
    """A heading and a bearing that pass pi: the same as a turn that starts elsewhere."""

    def filter_from(heading):
        x, y = 10 * math.cos(heading), 10 * math.sin(heading)
        return kind([x, y, heading], np.diag([0.1, 0.1, 0.01]), process=turner(), sensors=fix())

    f = filter_from(3.1)
    for _ in range(10):
        f.predict(0.5, [0.1, 0.3])
        bearing = math.atan2(f.x[1] + 3.0, f.x[0] - 5.0)
        f.update([math.hypot(f.x[0] - 5.0, f.x[1] + 3.0), bearing + 2 * math.pi])
        assert abs(f.innovation[1]) < 0.1
    # 3.1 + 10 * 0.5 * 0.3 rad is beyond pi: the state came back in at -pi.
    assert f.x[2] == pytest.approx(3.1 + 1.5 - 2 * math.pi, abs=0.05)
    assert f.P[2, 2] < 0.1


# ---- Exceptions.


class Trouble(Exception):
    """What a function of the user raises."""


def failing(function, when):
    """The function; it raises Trouble while when[0] is true."""

    def called(*args):
        if when[0]:
            raise Trouble("no more")
        return function(*args)

    return called


MEMBERS = ("f", "Q", "process jacobian", "h", "sensor jacobian")


def fragile(kind, member, when, **options):
    functions = dict(
        zip(MEMBERS, (accelerate, driven_noise, transition, range_bearing, slope), strict=True)
    )
    functions[member] = failing(functions[member], when)
    process = FunctionProcess(
        functions["f"], functions["Q"], functions["process jacobian"], state=STATE
    )
    sensor = FunctionSensor(
        functions["h"], np.diag([0.05, 0.01]) ** 2, functions["sensor jacobian"], angles=(1,)
    )
    return kind(
        X0,
        P0,
        process=process,
        sensors=sensor,
        **options,
    )


@pytest.mark.parametrize("late_s", [0.0, 2.0])
@pytest.mark.parametrize("member", MEMBERS)
@pytest.mark.parametrize("kind", KINDS)
def test_what_a_function_raises_comes_out_and_changes_nothing(kind, member, late_s):
    when = [False]
    f = fragile(kind, member, when, late_s=late_s)
    z = track(8)[1:]
    f.run(z[:3], dt=0.5)
    twin, before = copy.copy(f), readable(f)
    asked = isinstance(f, auvest.Ekf) or "jacobian" not in member
    when[0] = True
    if member in ("f", "Q", "process jacobian"):
        step = lambda: f.predict(0.5)  # noqa: E731
    else:
        step = lambda: f.update(z[3])  # noqa: E731
    if asked:
        with pytest.raises(Trouble, match="no more"):
            step()
        assert readable(f) == before
        with pytest.raises(FilterError, match="run at row 0") as caught:
            f.run(z[3:], dt=0.5)
        assert isinstance(caught.value.__cause__, Trouble)
        assert readable(f) == before
    when[0] = False
    for g in (f, twin):
        g.predict(0.5)
        g.update(z[3])
    assert readable(f) == readable(twin)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_raised_in_a_record_names_the_row(kind):
    calls = [0]

    def h(x):
        calls[0] += 1
        if calls[0] > limit:
            raise Trouble("no more")
        return range_bearing(x)

    sensor = FunctionSensor(h, np.diag([0.05, 0.01]) ** 2, slope, angles=(1,))
    process = auvest.ConstantAcceleration()
    f, g = (kind(X0, P0, process=process, sensors=sensor) for _ in range(2))
    z, limit = track(20)[1:], math.inf
    g.run(z[:7], dt=0.5)
    limit, calls[0] = calls[0], 0
    with pytest.raises(FilterError, match="run at row 7") as caught:
        f.run(z, dt=0.5)
    assert isinstance(caught.value.__cause__, Trouble)
    assert len(caught.value.partial) == 7
    assert readable(f) == readable(g)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sensor_that_is_not_the_filters_own_raises_too(kind):
    when = [True]
    f = fragile(kind, "h", [False])
    foreign = FunctionSensor(failing(range_bearing, when), np.eye(2))
    before = readable(f)
    with pytest.raises(Trouble):
        f.update([50.0, 0.1], foreign)
    assert readable(f) == before
    with pytest.raises(FilterError) as caught:  # and nothing is left over for later errors
        f.update([1e300, 0.1])
    assert caught.value.__cause__ is None
    when[0] = False
    f.update([50.0, 0.1], foreign)


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf, auvest.Aukf])
def test_what_a_policy_asks_may_fail_too(kind):
    """The budget looks up to max_s ahead, where no prediction of the record ever went."""

    def noise(dt):
        if dt > 1.0:
            raise Trouble("unknown")
        return driven_noise(dt)

    f = kind(
        X0,
        P0,
        process=FunctionProcess(accelerate, noise, state=STATE),
        sensors=auvest.RangeBearing(),
        policy=auvest.CovarianceBudget(initial_s=0.5, max_s=4.0),
    )
    f.predict()
    before = readable(f)
    with pytest.raises(Trouble, match="unknown"):
        f.feedback()
    assert readable(f) == before
    with pytest.raises(Trouble, match="unknown"):
        f.run([[50.0, 0.0]], dt=0.5)
    assert readable(f) == before


def test_models_raise_what_their_functions_raise():
    when = [True]
    process = FunctionProcess(
        failing(accelerate, when), failing(driven_noise, when), failing(transition, when), state=6
    )
    for ask in (
        lambda: process.f(np.zeros(6), 0.5),
        lambda: process.Q(0.5),
        lambda: process.Phi(0.5),
        lambda: FunctionSensor(failing(range_bearing, when), np.eye(2)).h(np.zeros(6)),
    ):
        with pytest.raises(Trouble):
            ask()
    when[0] = False
    assert process.Q(0.5).shape == (6, 6)


WRONG_RESULTS = {
    "f short": ("f", lambda x, _: x[:5], r"f gave an array of shape \(5,\), expected \(6,\)"),
    "f nothing": ("f", lambda *_: None, r"f gave an array of shape \(\), expected \(6,\)"),
    "f text": ("f", lambda *_: ["a"] * 6, "could not convert string to float"),
    "Q flat": ("Q", lambda _: np.zeros(6), r"Q gave an array of shape \(6,\), expected \(6, 6\)"),
    "jacobian": (
        "process jacobian",
        lambda *_: np.eye(5),
        r"jacobian gave an array of shape \(5, 5\), expected \(6, 6\)",
    ),
    "h long": ("h", lambda x: x[:3], r"h gave an array of shape \(3,\), expected \(2,\)"),
    "H transposed": (
        "sensor jacobian",
        lambda _: np.zeros((6, 2)),
        r"jacobian gave an array of shape \(6, 2\), expected \(2, 6\)",
    ),
}


@pytest.mark.parametrize("case", WRONG_RESULTS)
def test_results_of_the_wrong_kind_are_refused(case):
    member, function, message = WRONG_RESULTS[case]
    functions = dict(
        zip(MEMBERS, (accelerate, driven_noise, transition, range_bearing, slope), strict=True)
    )
    functions[member] = function
    f = auvest.Ekf(
        [50.0, 2.0, 0.0, 0.2, 0.0, 0.0],
        np.eye(6),
        process=FunctionProcess(
            functions["f"], functions["Q"], functions["process jacobian"], state=STATE
        ),
        sensors=FunctionSensor(functions["h"], np.eye(2), functions["sensor jacobian"]),
    )
    before = readable(f)
    step = f.update if member in ("h", "sensor jacobian") else f.predict
    with pytest.raises(ValueError, match=message) as caught:
        step([50.0, 0.0] if step == f.update else 0.5)
    assert not isinstance(caught.value, FilterError)
    assert readable(f) == before


@pytest.mark.parametrize("member", MEMBERS)
def test_results_that_are_not_finite_are_refused(member):
    when = [False]
    functions = dict(
        zip(MEMBERS, (accelerate, driven_noise, transition, range_bearing, slope), strict=True)
    )
    whole = functions[member]
    functions[member] = lambda *args: np.asarray(whole(*args)) * (math.nan if when[0] else 1.0)
    process = FunctionProcess(
        functions["f"], functions["Q"], functions["process jacobian"], state=STATE
    )
    sensor = FunctionSensor(functions["h"], np.eye(2), functions["sensor jacobian"])
    f = auvest.Ekf([50.0, 2.0, 0.0, 0.2, 0.0, 0.0], np.eye(6), process=process, sensors=sensor)
    f.predict(0.5)
    before = readable(f)
    when[0] = True
    step = f.update if member in ("h", "sensor jacobian") else f.predict
    with pytest.raises(FilterError, match="not be finite"):
        step([50.0, 0.0] if step == f.update else 0.5)
    assert readable(f) == before


# ---- Saving, and what is refused.


@pytest.mark.parametrize("kind", KINDS)
def test_what_no_module_names_is_not_saved_and_says_why(kind):
    def local(x, _):
        return x

    double, same = np.eye(6), lambda x, _: x
    nameless = "is not a function that a module names; define it at the top of a module"
    cases = (
        (rf"f cannot be saved: .*<lambda>' {nameless}", same, double, None),
        (rf"f cannot be saved: .*\.local' {nameless}", local, double, None),
        (rf"Q cannot be saved: .*<lambda>' {nameless}", accelerate, lambda _: double, None),
        (rf"jacobian cannot be saved: .*' {nameless}", accelerate, double, lambda *_: double),
        (r"f cannot be saved: .*partial\(", functools.partial(local), double, None),
    )
    filters = [
        (reason, kind(np.ones(6), double, process=FunctionProcess(f, q, jacobian, state=STATE)))
        for reason, f, q, jacobian in cases
    ]
    sensor = FunctionSensor(lambda x: x[:1], 1.0)
    process = auvest.ConstantAcceleration()
    filters.append(
        (
            r"h cannot be saved: .*<lambda>'",
            kind(np.ones(6), double, process=process, sensors=sensor),
        )
    )
    for reason, f in filters:
        with pytest.raises(ValueError, match=reason):
            f.save()
        with pytest.raises(ValueError, match=reason):
            pickle.dumps(f)
        assert same_bits(copy.copy(f).x, f.x)  # copies need no names
        assert same_bits(copy.deepcopy(f).P, f.P)


@pytest.mark.parametrize("kind", KINDS)
def test_a_foreign_function_in_the_window_is_saved_by_name_or_refused(kind):
    f = kind(np.ones(6) * 30, np.eye(6), process=auvest.ConstantAcceleration(), late_s=2.0)
    f.predict(0.5)
    nameless = copy.copy(f)
    f.update([30.0, 1.0], FunctionSensor(range_bearing, np.eye(2), angles=(1,)))
    twin = pickle.loads(pickle.dumps(f))
    for g in (f, twin):
        g.predict(0.5)
        g.update([29.0, 1.1], auvest.RangeBearing(), age_s=1.0)
    assert everything(twin) == everything(f)
    nameless.update([30.0], FunctionSensor(lambda x: x[:1], 1.0))
    with pytest.raises(ValueError, match="h cannot be saved"):
        nameless.save()


@pytest.mark.parametrize("kind", KINDS)
def test_another_function_of_the_same_name_elsewhere_is_another_model(kind):
    f = kind([1.0, 2.0, 0.1, 0.1], np.eye(4), process=glider(), sensors=fix())
    other = FunctionProcess(glider().function, np.eye(4), state=glider().state)
    g = kind([1.0, 2.0, 0.1, 0.1], np.eye(4), process=other, sensors=fix())
    with pytest.raises(
        ValueError, match=r"process\.Q is 'family_support:glide_noise', expected \[\["
    ):
        g.restore(f.save())
    twin = kind([0.0, 2.0, 0.1, 0.1], 2 * np.eye(4), process=glider(), sensors=fix())
    twin.restore(f.save())
    assert everything(twin) == everything(f)


@pytest.mark.parametrize("kind", KINDS)
def test_float32_is_refused(kind):
    message = "is for float64: a Python function has no float32 bits; write the model in C"
    x0, p0 = np.ones(4), np.eye(4)
    with pytest.raises(ValueError, match=f"FunctionProcess {message}"):
        kind(x0, p0, process=glider(), sensors=(), dtype="float32")
    x0, p0 = np.ones(6), np.eye(6)
    with pytest.raises(ValueError, match=f"FunctionSensor {message}"):
        kind(X0, P0, process=auvest.ConstantAcceleration(), sensors=fix(), dtype="float32")
    f = kind(X0, P0, process=auvest.ConstantAcceleration(), sensors=(), dtype="float32")
    with pytest.raises(ValueError, match=f"FunctionSensor {message}"):
        f.update([1.0, 2.0], fix())


@pytest.mark.parametrize("kind", KINDS)
def test_one_state_is_enough(kind):
    process = FunctionProcess(lambda x, _: x, [[0.1]], state=("depth_m",))
    sensor = FunctionSensor(lambda x: x[0], 0.5)
    f = kind([3.0], [[1.0]], process=process, sensors=sensor, kernel="unit", recovery=None)
    f.predict(1.0)
    f.update(4.0)
    # P = 1.1, S = 1.6, gain 1.1 / 1.6.
    assert f.x[0] == pytest.approx(3.0 + 1.1 / 1.6, abs=1e-12)
    assert f.P[0, 0] == pytest.approx(1.1 * 0.5 / 1.6, abs=1e-12)


CONSTRUCTIONS = {
    "f": (
        lambda: FunctionProcess(3, np.eye(2), state=2),
        TypeError,
        "f must be a function, not int",
    ),
    "Q shape": (
        lambda: FunctionProcess(accelerate, np.eye(3), state=2),
        ValueError,
        r"Q has shape \(3, 3\), expected \(2, 2\)",
    ),
    "Q indefinite": (
        lambda: FunctionProcess(accelerate, np.diag([1.0, -1.0]), state=2),
        ValueError,
        "Q must be symmetric and positive semidefinite",
    ),
    "Q skew": (
        lambda: FunctionProcess(accelerate, [[1.0, 0.5], [0.0, 1.0]], state=2),
        ValueError,
        "Q must be symmetric and positive semidefinite",
    ),
    "jacobian": (
        lambda: FunctionProcess(accelerate, np.eye(2), 1.0, state=2),
        TypeError,
        "jacobian must be a function, not float",
    ),
    "no states": (
        lambda: FunctionProcess(accelerate, np.eye(2), state=0),
        ValueError,
        r"state must lie in 1\.\.9, not 0",
    ),
    "ten states": (
        lambda: FunctionProcess(accelerate, np.eye(10), state=10),
        ValueError,
        r"state must lie in 1\.\.9, not 10",
    ),
    "ten names": (
        lambda: FunctionProcess(accelerate, np.eye(10), state=tuple("abcdefghij")),
        ValueError,
        r"the number of states must lie in 1\.\.9, not 10",
    ),
    "state text": (
        lambda: FunctionProcess(accelerate, np.eye(2), state="xy"),
        TypeError,
        "state must be a number or a sequence of names, not a str",
    ),
    "inputs": (
        lambda: FunctionProcess(accelerate, np.eye(2), state=2, input=tuple("abcdefghi")),
        ValueError,
        "input must have at most 8 names, not 9",
    ),
    "angles": (
        lambda: FunctionProcess(accelerate, np.eye(2), state=2, angles=(0, 2)),
        ValueError,
        r"angles\[1\] must lie in 0\.\.1, not 2",
    ),
    "h": (lambda: FunctionSensor(None, 1.0), TypeError, "^h must be a function, not None$"),
    "R zero": (lambda: FunctionSensor(fix, 0.0), ValueError, r"R\[0, 0\] is 0\.0; a variance must"),
    "R skew": (
        lambda: FunctionSensor(fix, [[1.0, 0.5], [0.0, 1.0]]),
        ValueError,
        "R must be symmetric",
    ),
    "R large": (
        lambda: FunctionSensor(fix, np.eye(5)),
        ValueError,
        r"the size of R must lie in 1\.\.4, not 5",
    ),
    "R indefinite": (
        lambda: FunctionSensor(fix, [[1.0, 2.0], [2.0, 1.0]]),
        ValueError,
        "R must be positive definite",
    ),
    "sensor angles": (
        lambda: FunctionSensor(fix, np.eye(2), angles=(2,)),
        ValueError,
        r"angles\[0\] must lie in 0\.\.1, not 2",
    ),
    "a sensor of five states": (
        lambda: auvest.Ekf(
            np.ones(5),
            np.eye(5),
            process=FunctionProcess(accelerate, np.eye(5), state=("x_m", "y_m", "a", "b", "c")),
            sensors=auvest.RangeBearing(),
        ),
        ValueError,
        "RangeBearing is made for 2, 3, 4, 6, 8 states, not for 5",
    ),
}


@pytest.mark.parametrize("case", CONSTRUCTIONS)
def test_wrong_constructions_are_refused(case):
    call, error, message = CONSTRUCTIONS[case]
    with pytest.raises(error, match=message):
        call()
