"""The portable functions as Python sees them; the exhaustive checks are tests/cpp/math."""

from __future__ import annotations

import numpy as np
import pytest

from auvest import _core

RNG = np.random.default_rng(1)
ANGLES = np.concatenate([RNG.uniform(-10, 10, 100_000), RNG.uniform(-1e4, 1e4, 100_000)])
POSITIVE = np.exp(RNG.uniform(-87, 88, 200_000))


def ulps(value, exact):
    """Error of float32 values in units of the last place of the exact result."""
    return np.abs(value.astype(np.float64) - exact) / np.spacing(np.abs(exact.astype(np.float32)))


@pytest.mark.parametrize(
    ("name", "x"),
    [
        ("sin", ANGLES),
        ("cos", ANGLES),
        ("exp", RNG.uniform(-87, 88, 200_000)),
        ("log", POSITIVE),
    ],
)
def test_float32_functions_are_right_to_two_ulp(name, x):
    x = x.astype(np.float32)
    y = getattr(_core, name)(x)
    assert y.dtype == np.float32
    assert ulps(y, getattr(np, name)(x.astype(np.float64))).max() <= 2


def test_atan2_is_right_to_two_ulp():
    y, x = (RNG.standard_normal(200_000).astype(np.float32) for _ in range(2))
    exact = np.arctan2(y.astype(np.float64), x.astype(np.float64))
    assert ulps(_core.atan2(y, x), exact).max() <= 2


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "log", "wrap"])
def test_float64_functions_agree_with_numpy(name):
    x = POSITIVE[POSITIVE < 100] if name in ("exp", "log") else ANGLES
    expected = np.angle(np.exp(1j * x)) if name == "wrap" else getattr(np, name)(x)
    assert getattr(_core, name)(x) == pytest.approx(expected, rel=1e-13, abs=1e-12)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_wrap_lies_in_the_half_open_circle(dtype):
    pi = dtype(np.pi)
    x = np.array([0, pi, -pi, 3 * pi, np.nextafter(pi, dtype(4)), -3.0, 7.0, 1e4], dtype)
    y = _core.wrap(x)
    assert ((y > -pi) & (y <= pi)).all()
    assert y[:3].tolist() == [0, pi, pi]
    exact = np.angle(np.exp(1j * x.astype(np.float64)))
    turned = np.abs(np.exp(1j * y.astype(np.float64)) - np.exp(1j * exact))
    assert turned.max() < 4 * np.finfo(dtype).eps
    assert np.isnan(_core.wrap(np.array([np.nan, np.inf], dtype))).all()


def test_shape_is_kept_and_other_dtypes_are_refused():
    assert _core.sin(np.zeros((3, 4, 2), np.float32)).shape == (3, 4, 2)
    for bad in (np.zeros(3, np.int32), np.zeros(3, np.float16), [0.0]):
        with pytest.raises(TypeError):
            _core.sin(bad)
    with pytest.raises(ValueError, match="same shape"):
        _core.atan2(np.zeros(3), np.zeros(4))


def test_random_streams_repeat_and_differ():
    first, again, other = _core.Random(7, 1), _core.Random(7, 1), _core.Random(7, 2)
    a = first.normal_float64(10_000)
    assert (a == again.normal_float64(10_000)).all()
    b = other.normal_float64(10_000)
    # Mean and correlation of 1e4 deviates have a standard deviation of 0.01: five of them.
    assert abs(a.mean()) < 0.05
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.05
    u = first.uniform_float32(10_000)
    assert u.dtype == np.float32
    assert 0 <= u.min() < 0.01
    assert 0.99 < u.max() < 1
    with pytest.raises(ValueError, match="count must not be negative"):
        first.uniform_float64(-1)
