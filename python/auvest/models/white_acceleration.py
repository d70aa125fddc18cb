"""Nearly constant velocity, in the plane or in space (Bar-Shalom, Li, Kirubarajan 2001, 6.2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from auvest import _core
from auvest._fields import integer, not_negative
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("WhiteAcceleration3")


@dataclass(frozen=True, kw_only=True)
class WhiteAcceleration(ProcessModel):
    """Nearly constant velocity, driven by white accelerations: position, then velocity.

    Parameters
    ----------
    axes : {2, 3}
        State ``[x, y, vx, vy]`` or, with the depth, ``[x, y, z, vx, vy, vz]`` (m, m/s).
    velocity_psd, vertical_velocity_psd : float
        Power spectral densities of the accelerations along x and y, and along z, m^2/s^3, not
        negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    structural = ("axes",)

    axes: Literal[2, 3] = integer(2, 2, 3)
    velocity_psd: float = not_negative(_DEFAULTS["velocity_psd"])
    vertical_velocity_psd: float = not_negative(_DEFAULTS["vertical_velocity_psd"])

    @property
    def state(self) -> tuple[str, ...]:  # type: ignore[override]
        """Position, then velocity."""
        names = "xyz"[: self.axes]
        return (*(f"{i}_m" for i in names), *(f"v{i}_m_s" for i in names))

    @property
    def core_name(self) -> str:
        """One class of the core per number of axes."""
        return f"WhiteAcceleration{self.axes}"
