"""Smooth paths through the water: the shortest that a hull can fly between poses, and splines.

The paths are C++ (``cpp/include/auvest/guidance``, docs/algorithms/guidance.md), as are the laws
that follow them. Axes are north and east; angles count from north towards east.
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_array, as_dtype, as_number, require_range

_DUBINS = _core.dubins_defaults()
_SPLINE = _core.spline_defaults()


class PathPoint(NamedTuple):
    """Where a vehicle is beside its path.

    Attributes
    ----------
    direction_rad : float
        The path's own direction there.
    along_m : float
        Distance from where the leg, or the arc or line of it, begins.
    cross_m : float
        How far to starboard of the path the vehicle is.
    curvature : float
        Of the path, 1/m; positive clockwise from above.
    """

    direction_rad: float
    along_m: float
    cross_m: float
    curvature: float


class CurvePart(NamedTuple):
    """A part of a Dubins curve.

    Attributes
    ----------
    side : {1, 0, -1}
        An arc clockwise from above, a line, an arc anticlockwise.
    length_m : float
    """

    side: int
    length_m: float


def shortest_curve(
    start: npt.ArrayLike, end: npt.ArrayLike, radius_m: float
) -> tuple[CurvePart, CurvePart, CurvePart]:
    """Give the shortest curve between two poses that turns on no less than a radius (Dubins).

    Parameters
    ----------
    start, end : array_like, shape (3,)
        North, east, m, and direction, rad.
    radius_m : float
        Of its arcs, positive.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    """
    wide = np.dtype(np.float64)
    begin, goal = as_array("start", start, (3,), wide), as_array("end", end, (3,), wide)
    radius = as_number("radius_m", radius_m, "positive")
    first, middle, last = _core.shortest_curve(begin.tolist(), goal.tolist(), radius)
    return CurvePart(*first), CurvePart(*middle), CurvePart(*last)


class _Path:
    """What the paths have in common."""

    _core: Any

    def _begin(
        self, kind: str, plan: npt.ArrayLike, width: int, dtype: npt.DTypeLike, **radii: float
    ) -> None:
        precision = as_dtype(dtype)
        require_range(radii, precision.name)
        rows = as_array("plan", plan, (None, width), precision)
        self._core = getattr(_core, f"{kind}_{precision.name}")(rows, radii)
        if (warning := self._core.warning()) is not None:
            leg, why = warning
            warnings.warn(f"leg {leg}: {why}", stacklevel=3)

    def locate(self, x_m: float, y_m: float) -> PathPoint:
        """Go on along the path where that is due, and say where a vehicle is beside it.

        Parameters
        ----------
        x_m, y_m : float
            The vehicle, north and east.

        Raises
        ------
        ValueError, TypeError
            If the place is none.
        """
        return PathPoint(*self._core.locate(as_number("x_m", x_m), as_number("y_m", y_m)))

    @property
    def leg(self) -> int:
        """Which it is on, from 0."""
        leg: int = self._core.leg
        return leg

    @property
    def finished(self) -> bool:
        """Whether the end of the plan has been passed; the path then goes straight on."""
        finished: bool = self._core.finished
        return finished

    @property
    def remaining_m(self) -> float:
        """To the end of the leg as of the last place; negative beyond the end of the plan."""
        remaining: float = self._core.remaining_m
        return remaining


class DubinsPath(_Path):
    """Poses joined by the shortest curves of arcs and lines.

    Parameters
    ----------
    plan : array_like, shape (n, 3)
        North, east, m, and direction, rad; two poses or more, no two in a row the same.
    radius_m : float
        Of the arcs, positive.
    hull_m : float
        Radius of the smallest circle that the hull turns on: a warning tells of smaller arcs.
    dtype : {"float64", "float32"}
        float32 gives the bits of the chip.

    Raises
    ------
    ValueError, TypeError
        If the plan cannot be flown (the message names the leg) or an argument is wrong.

    Warns
    -----
    UserWarning
        If the hull cannot turn so tightly.
    """

    def __init__(
        self,
        plan: npt.ArrayLike,
        *,
        radius_m: float = _DUBINS["radius_m"],
        hull_m: float = _DUBINS["hull_m"],
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        radius = as_number("radius_m", radius_m, "positive")
        hull = as_number("hull_m", hull_m, "not negative")
        self._begin("DubinsPath", plan, 3, dtype, radius_m=radius, hull_m=hull)


class SplinePath(_Path):
    """A smooth curve through waypoints: Catmull and Rom's cubics on the lengths of their chords.

    Parameters
    ----------
    plan : array_like, shape (n, 2)
        North and east, m; two waypoints or more, no two in a row the same.
    hull_m : float
        Radius of the smallest circle that the hull turns on: a warning tells of tighter bends.
    dtype : {"float64", "float32"}
        float32 gives the bits of the chip.

    Raises
    ------
    ValueError, TypeError
        If the plan cannot be flown (the message names the leg) or an argument is wrong.

    Warns
    -----
    UserWarning
        If the hull cannot turn so tightly.
    """

    def __init__(
        self,
        plan: npt.ArrayLike,
        *,
        hull_m: float = _SPLINE["hull_m"],
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        hull = as_number("hull_m", hull_m, "not negative")
        self._begin("SplinePath", plan, 2, dtype, hull_m=hull)
