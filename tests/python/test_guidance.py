"""The smooth paths under Python: geometry done by hand, and what is refused or warned of.

The curves themselves are held in tests/cpp/guidance/test_curves.cpp.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from auvest.guidance import CurvePart, DubinsPath, PathPoint, SplinePath, shortest_curve

# Out to the north and back 40 m to the east of it: two lanes.
LANES = [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 40.0, math.pi], [0.0, 40.0, math.pi]]


def test_the_shortest_curve_is_known() -> None:
    """Half a circle of the radius, clockwise; and on the spot 60, 300 and 60 degrees."""
    parts = shortest_curve(LANES[1], LANES[2], 20.0)
    assert all(isinstance(part, CurvePart) for part in parts)
    assert sum(part.length_m for part in parts) == pytest.approx(20 * math.pi)
    assert {part.side for part in parts if part.length_m > 1e-6} == {1}
    back = shortest_curve((0, 0, 0), (0, 0, math.pi), 15.0)
    assert [part.length_m for part in back] == pytest.approx(
        [5 * math.pi, 25 * math.pi, 5 * math.pi]
    )
    assert back[0].side == -back[1].side == back[2].side != 0


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_path_is_followed_to_its_end(dtype: str) -> None:
    path = DubinsPath(LANES, radius_m=20.0, dtype=dtype)
    assert path.locate(30.0, 3.0) == PathPoint(0.0, 30.0, 3.0, 0.0)
    assert path.remaining_m == pytest.approx(70.0)
    beside = path.locate(100 + 22 * math.sin(0.5), 20 - 22 * math.cos(0.5))  # 2 m outside
    assert path.leg == 1
    assert beside.curvature == pytest.approx(1 / 20)
    assert beside.cross_m == pytest.approx(-2.0, abs=1e-4)
    assert beside.direction_rad == pytest.approx(0.5, abs=1e-5)
    assert beside.along_m == pytest.approx(10.0, abs=1e-3)
    for north in (99, 60, -10):  # past the end of the arc, along the lane, past the last pose
        path.locate(north, 40.0)
    assert path.finished
    assert path.remaining_m == pytest.approx(-10.0, abs=1e-3)


def test_float32_has_the_numbers_of_the_chip() -> None:
    found = {}
    for dtype in ("float32", "float64"):
        found[dtype] = np.array(SplinePath([[0, 0], [60, 10], [90, 60]], dtype=dtype).locate(20, 7))
    assert (found["float32"] == found["float32"].astype(np.float32)).all()
    assert (found["float64"] != found["float32"]).any()
    np.testing.assert_allclose(found["float32"], found["float64"], atol=1e-4)


def test_a_spline_through_a_line_is_the_line() -> None:
    path = SplinePath([[0, 0], [30, 40], [90, 120]])
    point = path.locate(0.6 * 20 - 0.8 * 3, 0.8 * 20 + 0.6 * 3)
    assert point.along_m == pytest.approx(20)
    assert point.cross_m == pytest.approx(3)
    assert point.direction_rad == pytest.approx(math.atan2(4, 3))
    assert point.curvature == pytest.approx(0, abs=1e-12)


def test_what_the_hull_cannot_turn_is_warned_of() -> None:
    with pytest.warns(UserWarning, match="leg 0: .* shorter than the hull's turning circle"):
        DubinsPath(LANES, radius_m=14.0, hull_m=14.3)
    with pytest.warns(UserWarning, match="leg 1: .* turning circle"):
        SplinePath([[0, 0], [100, 0], [105, 10], [100, 20]], hull_m=14.3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        DubinsPath(LANES, radius_m=14.5, hull_m=14.3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DubinsPath(LANES[:1]), "leg 0: a plan needs at least two"),
        (lambda: DubinsPath([LANES[0], LANES[1], LANES[1]]), "leg 1: two waypoints coincide"),
        (lambda: DubinsPath(LANES, radius_m=0.0), "radius_m must be positive"),
        (lambda: DubinsPath([[0, 0], [1, 1]]), "plan"),
        (lambda: DubinsPath(LANES, radius_m=1e-60, dtype="float32"), "does not suit float32"),
        (lambda: SplinePath([[0, 0], [math.nan, 1]]), "plan"),
        (lambda: SplinePath([[0, 0], [1, 1]], hull_m=-1), "hull_m must not be negative"),
        (lambda: shortest_curve((0, 0), (1, 1, 0), 5), "start"),
        (lambda: shortest_curve((0, 0, 0), (1, 1, 0), -5), "radius_m must be positive"),
    ],
)
def test_what_cannot_be_flown_is_refused(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


def test_a_place_that_is_none_is_refused_and_changes_nothing() -> None:
    path = DubinsPath(LANES)
    path.locate(30.0, 0.0)
    with pytest.raises(ValueError, match="x_m must be finite"):
        path.locate(math.nan, 0.0)
    assert path.remaining_m == pytest.approx(70.0)
