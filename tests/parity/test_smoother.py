"""The fixed lag gives the same bits on every target; the reference is ``smooth`` of Python."""

from __future__ import annotations

import numpy as np
import pytest

import auvest
from firmware.parity.targets import LAG, SMOOTHER_TARGETS
from tests.slow import SLOW

STEP = np.dtype(
    [("measured", "<u4"), ("dt", "<f4"), ("input", "<f4", 3), ("z", "<f4"), ("leader", "<f4", 2)]
)
TRACE = np.dtype(
    [
        ("predict", "<u4"), ("update", "<u4"), ("lag", "<u4"),
        ("then_x", "<u4", 2), ("then_P", "<u4", 4), ("x", "<u4", 2), ("P", "<u4", 4),
    ]
)  # fmt: skip
X0 = np.array([30.0, -20.0], np.float32)
P0 = np.array([[400.0, 30.0], [30.0, 250.0]], np.float32)


def record() -> np.ndarray:
    """Make 60 steps around two leaders, every third measured, some ranges far too long."""
    rng = np.random.default_rng(4)
    steps = np.zeros(60, STEP)
    k = np.arange(60)
    steps["dt"] = 1.0
    steps["input"] = np.column_stack([1.2 + 0.3 * np.sin(0.2 * k), 0.1 * np.cos(k), 0.05 * k])
    steps["measured"] = k % 3 == 2
    steps["leader"] = np.where((k % 6 == 2)[:, None], [120.0, 40.0], [-70.0, 90.0])
    position, theta = np.array([42.0, -29.0]), steps["input"][:, 2].astype(float)
    forward, starboard = steps["input"][:, 0], steps["input"][:, 1]
    track = position + np.cumsum(
        np.column_stack(
            [
                forward * np.cos(theta) - starboard * np.sin(theta),
                forward * np.sin(theta) + starboard * np.cos(theta),
            ]
        ),
        axis=0,
    )
    off = np.where(k % 15 == 8, 60.0, 0.0)
    steps["z"] = np.hypot(*(track - steps["leader"]).T) + rng.standard_normal(60) + off
    return steps


def smoothed(steps: np.ndarray) -> auvest.filters.SmoothResult:
    """Give the reference: the lag of so many steps of one second."""
    f = auvest.RobustEkf(
        X0, P0, process=auvest.SpeedHeading(), sensors=auvest.LeaderRange(),
        kernel=auvest.Igg(), recovery=auvest.RejectionStreak(), dtype="float32",
    )  # fmt: skip
    z = np.where(steps["measured"] != 0, steps["z"], np.nan)
    return f.smooth(z, dt=1.0, input=steps["input"], place=steps["leader"], lag_s=float(LAG))


def as_bits(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, "<f4").view("<u4").reshape(len(values), -1)


def targets():
    for target in SMOOTHER_TARGETS:
        marks = SLOW if target.machine == "wasm" else ()
        yield pytest.param(target, id=target.name, marks=marks)


@pytest.mark.parametrize("target", list(targets()))
def test_every_target_gives_the_bits_of_python(target, replay):
    steps = record()
    head = np.array([len(steps)], "<u4").tobytes() + X0.tobytes() + P0.tobytes()
    found = replay(target, head + steps.tobytes())
    assert int.from_bytes(found[:4], "little") == 0
    trace = np.frombuffer(found[4:], TRACE)
    assert not trace["predict"].any()
    assert not trace["update"].any()
    np.testing.assert_array_equal(trace["lag"], np.minimum(np.arange(1, 61), LAG))
    wanted = smoothed(steps)
    np.testing.assert_array_equal(trace["x"], as_bits(wanted.x))
    np.testing.assert_array_equal(trace["P"], as_bits(wanted.P))
    # Row j is what is known LAG steps later; the first of the trace that look back to a row.
    np.testing.assert_array_equal(trace["then_x"][LAG:], as_bits(wanted.smoothed_x)[: 60 - LAG])
    np.testing.assert_array_equal(trace["then_P"][LAG:], as_bits(wanted.smoothed_P)[: 60 - LAG])


def test_the_record_reaches_what_it_is_for():
    """Weights below 1, and a lag that says more than the filter."""
    result = smoothed(record())
    assert (result.decision == int(auvest.Decision.rejected)).any()
    assert (np.abs(result.smoothed_x - result.x)[:48].max(axis=0) > 1.0).all()
