"""Depth of a vehicle in space."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import positive
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("Depth")


@dataclass(frozen=True, kw_only=True)
class Depth(MeasurementModel):
    """The third coordinate (m) of a state that begins with ``x, y, z``, counted as the state does.

    Parameters
    ----------
    sigma_m : float
        Standard deviation, m, positive.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    observes = ("x_m", "y_m", "z_m")
    measures = ("z_m",)

    sigma_m: float = positive(_DEFAULTS["sigma_m"])
