"""What is no number where one is wanted: a TypeError that names the argument and the unit."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest

from auvest import ConstantAcceleration, RangeBearing, Slatf, Ukf

#: Each would be a number to NumPy or to Python, or looks like one.
NO_NUMBERS: tuple[Any, ...] = (
    np.timedelta64(2, "s"),
    np.timedelta64(2, "ns"),  # an integer to Python's numbers
    np.array(2, "m8[ms]"),
    np.datetime64("2026-01-01"),
    datetime(2026, 1, 1),
    timedelta(seconds=2),
    True,
    np.True_,
    2j,
    np.complex128(2),
    "2",
    b"2",
)


def ukf(**options: Any) -> Ukf:
    sensor = RangeBearing()
    process = ConstantAcceleration()
    return Ukf(np.ones(6), 0.1 * np.eye(6), process=process, sensors=sensor, **options)


def slatf() -> Slatf:
    return Slatf([0, 0], np.eye(2), particles=4)


CALLS: dict[str, tuple[Callable[[Any], object], str]] = {
    "predict": (lambda v: ukf().predict(v), "dt must be .*; its unit is s"),
    "predict of a slave": (lambda v: slatf().predict(v, [1, 0]), "dt must be .*; its unit is s"),
    "a record's steps": (lambda v: ukf().run([[1.0, 0.1]], dt=v), "dt must be .*; its unit is s"),
    "age": (lambda v: ukf(late_s=5).update([1.0, 0.1], age_s=v), "age_s must be .* unit is s"),
    "window": (lambda v: ukf(late_s=v), "late_s must be .*; its unit is s"),
    "sigma": (lambda v: RangeBearing(sigma_range_m=v), "sigma_range_m must be .*; its unit is m"),
    "angle": (lambda v: RangeBearing(sigma_bearing_rad=v), "sigma_bearing_rad .*; its unit is rad"),
    "z": (lambda v: ukf().update([v, 0.1]), "z must be an array of shape .2,. of real numbers"),
    "reading": (lambda v: slatf().predict(1, [v, 0]), "u must be an array of shape .2,. of real"),
    "station": (lambda v: RangeBearing(station=(v, 0)), "station must be an array of shape .2,."),
    "particles": (lambda v: Slatf([0, 0], np.eye(2), particles=v), "particles must be an integer"),
}


@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
@pytest.mark.parametrize("call", CALLS)
def test_what_is_no_number_is_refused_by_name_and_unit(call: str, value: Any) -> None:
    take, message = CALLS[call]
    with pytest.raises(TypeError, match=message):
        take(value)


def test_the_way_to_the_number_is_shown() -> None:
    filter_ = ukf()
    before = filter_.x
    with pytest.raises(TypeError, match=r"not timedelta64; .*: dt / np\.timedelta64\(1, 's'\)$"):
        filter_.predict(np.timedelta64(2, "ns"))
    with pytest.raises(TypeError, match=r"not timedelta; its unit is s: dt\.total_seconds\(\)$"):
        filter_.predict(timedelta(seconds=2))  # type: ignore[arg-type]
    assert np.array_equal(filter_.x, before)


def test_numbers_of_every_kind_are_numbers() -> None:
    """Of one value each, and to the same bits."""
    made = []
    for dt in (2, 2.0, np.int8(2), np.float32(2), np.array(2), np.array(2.0)):
        filter_ = ukf()
        filter_.predict(dt)
        made.append(filter_.x.tobytes())
    assert len(set(made)) == 1
