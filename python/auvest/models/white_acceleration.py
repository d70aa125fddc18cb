"""Nearly constant velocity, in the plane or in space (Bar-Shalom, Li, Kirubarajan 2001, 6.2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from auvest import _core
from auvest._arguments import as_integer
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

    axes: Literal[2, 3] = 2
    velocity_psd: float = _DEFAULTS["velocity_psd"]
    vertical_velocity_psd: float = _DEFAULTS["vertical_velocity_psd"]

    def __post_init__(self) -> None:
        as_integer("axes", self.axes, 2, 3)
        self._set_numbers("not negative", "velocity_psd", "vertical_velocity_psd")

    @property
    def state(self) -> tuple[str, ...]:  # type: ignore[override]
        """Position, then velocity."""
        names = "xyz"[: self.axes]
        return (*(f"{i}_m" for i in names), *(f"v{i}_m_s" for i in names))

    @property
    def core_name(self) -> str:
        """One class of the core per number of axes."""
        return f"WhiteAcceleration{self.axes}"
