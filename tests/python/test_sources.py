"""Where the sources of ranges are: beacons, and leaders along the lines between their positions."""

from __future__ import annotations

import numpy as np
import pytest

from auvest.replay.sources import Sources

NAN = np.nan


def leader(*rows: list[float], gap_s: float = 2.0) -> Sources:
    """Source 7 with lines ``[time, x, y]`` or ``[time, x, y, sigma]``; source 3 is a beacon."""
    sources = Sources({3: (1.0, 2.0)}, gap_s)
    sources.add(np.insert(np.array(rows), 1, 7.0, axis=1))
    return sources


def located(sources: Sources, times: list[float], source: int = 7) -> list[list[float]]:
    places: list[list[float]] = sources.locate(
        np.array(times), np.full(len(times), float(source))
    ).tolist()
    return places


def test_beacons_stand_and_are_certain() -> None:
    assert located(leader([0.0, 0.0, 0.0]), [-1e9, 1e9], source=3) == [[1.0, 2.0, 0.0]] * 2
    np.testing.assert_array_equal(located(leader([0.0, 0.0, 0.0]), [0.0], source=4), [[NAN] * 3])


def test_leaders_without_a_sigma_are_certain() -> None:
    sources = leader([0.0, 10.0, 20.0], [2.0, 14.0, 10.0])
    assert located(sources, [0.0, 0.5, 2.0]) == [[10, 20, 0], [11, 17.5, 0], [14, 10, 0]]


def test_sigma_goes_along_the_line_too() -> None:
    sources = leader([0.0, 10.0, 20.0, 1.0], [2.0, 14.0, 10.0, 3.0])
    assert located(sources, [0.0, 0.5, 2.0]) == [[10, 20, 1], [11, 17.5, 1.5], [14, 10, 3]]


def test_between_positions_too_far_apart_none_is_known() -> None:
    """A gap as long as it may be is bridged, one longer is not; its ends are known."""
    sources = leader([0.0, 0, 0], [2.0, 4, 0], [4.001, 8, 0], gap_s=2.0)
    known = ~np.isnan(located(sources, [-0.001, 0.0, 1.0, 2.0, 3.0, 4.001, 4.002]))[:, 0]
    assert known.tolist() == [False, True, True, True, False, True, False]


def test_each_leader_has_its_own_track() -> None:
    sources = leader([0.0, 0, 0], [2.0, 4, 0])
    sources.add(np.array([[0.0, 8.0, 100.0, 0.0], [2.0, 8.0, 100.0, 6.0]]))
    both = sources.locate(np.array([1.0, 1.0, 1.0]), np.array([8.0, 3.0, 7.0]))
    assert both.tolist() == [[100, 3, 0], [1, 2, 0], [2, 0, 0]]


@pytest.mark.parametrize("before", [2.0, 2.5, 3.0])
def test_the_position_before_is_kept(before: float) -> None:
    """What is asked for from ``before`` on may lie on the line that began earlier."""
    sources = leader([0.0, 0, 0], [1.0, 1, 0], [2.0, 2, 0], [3.0, 3, 0])
    sources.forget(before)
    assert located(sources, [before]) == [[before, 0.0, 0.0]]
    sources.add(np.array([[4.0, 7.0, 4.0, 0.0]]))
    assert located(sources, [3.5]) == [[3.5, 0.0, 0.0]]
    np.testing.assert_array_equal(located(sources, [1.5]), [[NAN] * 3])  # forgotten
    sources.forget(99.0)
    assert located(sources, [4.0]) == [[4.0, 0.0, 0.0]]
