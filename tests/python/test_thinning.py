"""Thinning: measurements of one source that are far enough apart, to the microsecond of a log."""

from __future__ import annotations

import numpy as np

from auvest.replay.thinning import Thinning


def passed(every_s: float, times: list[float], sources: list[int] | None = None) -> list[bool]:
    names = np.array([0] * len(times) if sources is None else sources, dtype=float)
    result: list[bool] = Thinning(every_s).passed(np.array(times), names).tolist()
    return result


def test_times_of_a_grid_pass_whatever_their_rounding() -> None:
    """The distance of 0.4 from 0.1 + 0.2 is below 0.1 by a rounding."""
    times = [0.1, 0.2, 0.1 + 0.2, 0.4, 0.5]
    assert times[3] - times[2] < 0.1
    assert passed(0.1, times) == [True] * 5


def test_less_than_a_microsecond_early_is_in_time() -> None:
    assert passed(1.0, [0.0, 1.0 - 0.9e-6]) == [True, True]
    assert passed(1.0, [0.0, 1.0 - 1.1e-6]) == [True, False]


def test_time_is_counted_from_the_last_that_passed() -> None:
    """Not from the last that came: 1.2 is 1.2 after 0, if only 0.6 after 0.6."""
    assert passed(1.0, [0.0, 0.6, 1.2, 1.8, 2.2]) == [True, False, True, False, True]


def test_each_source_has_its_own_time() -> None:
    times, sources = [0.0, 0.5, 1.0, 1.5], [1, 2, 1, 2]
    assert passed(1.0, times, sources) == [True] * 4
    assert passed(1.5, times, sources) == [True, True, False, False]


def test_it_goes_on_over_calls() -> None:
    thinning = Thinning(1.0)
    one = np.array([7.0])
    assert thinning.passed(np.array([0.0]), one).tolist() == [True]
    assert thinning.passed(np.array([0.5]), one).tolist() == [False]
    assert thinning.passed(np.array([1.0]), one).tolist() == [True]


def test_without_a_least_time_all_pass() -> None:
    assert passed(0.0, [0.0, 0.0, 0.0]) == [True] * 3
