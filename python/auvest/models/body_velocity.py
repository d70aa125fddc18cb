"""Velocity over ground in the axes of the vehicle: a Doppler log (DVL) as a measurement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from auvest import _core
from auvest._fields import integer, number, positive, unstated
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("BodyVelocity3")


@dataclass(frozen=True, kw_only=True)
class BodyVelocity(MeasurementModel):
    """Velocity over ground, forward, sideways and (3 axes) along z, m/s, with pitch and roll out.

    For processes whose state is position, then velocity. Sideways is 90 degrees from forward, from
    +x towards +y.

    Parameters
    ----------
    axes : {2, 3}
        In the plane or in space.
    heading_rad : float
        From +x towards +y, when it was measured; where it is left out, ``place`` says so in
        ``update`` and ``run``.
    sigma_forward_m_s, sigma_sideways_m_s, sigma_vertical_m_s : float
        Standard deviations, m/s, positive. An error of the heading turns the velocity: add it,
        times the speed, in squares to ``sigma_sideways_m_s``.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    structural = ("axes",)
    place = "heading_rad"
    _elsewhere = _DEFAULTS["heading_rad"]

    axes: Literal[2, 3] = integer(2, 2, 3)
    heading_rad: float | None = unstated(number(_elsewhere))
    sigma_forward_m_s: float = positive(_DEFAULTS["sigma_forward_m_s"])
    sigma_sideways_m_s: float = positive(_DEFAULTS["sigma_sideways_m_s"])
    sigma_vertical_m_s: float = positive(_DEFAULTS["sigma_vertical_m_s"])

    @property
    def observes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Position (which it does not see) and velocity."""
        names = "xyz"[: self.axes]
        return (*(f"{i}_m" for i in names), *(f"v{i}_m_s" for i in names))

    @property
    def measures(self) -> tuple[str, ...]:  # type: ignore[override]
        """In the vehicle's axes."""
        return ("forward_m_s", "sideways_m_s", "vertical_m_s")[: self.axes]

    def _core_params(self) -> dict[str, float]:
        heading_rad = self._elsewhere if self.heading_rad is None else self.heading_rad
        return {**super()._core_params(), "heading_rad": heading_rad}

    @property
    def core_name(self) -> str:
        """One class of the core per number of axes."""
        return f"BodyVelocity{self.axes}"
