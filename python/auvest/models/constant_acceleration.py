"""Constant acceleration in the plane, the process of the AUKF paper (Deng, Yin, Duan 2019)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from auvest import _core
from auvest._fields import choice, not_negative
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("ExactAcceleration")


@dataclass(frozen=True, kw_only=True)
class ConstantAcceleration(ProcessModel):
    """Constant acceleration in the plane, state ``[x, y, vx, vy, ax, ay]``, Eqs. (4) and (5).

    Parameters
    ----------
    discretisation : {"exact", "euler"}
        "exact": ``Phi`` with the ``dt^2 / 2`` term and ``Q`` the integral of the driving noise.
        "euler": exactly the paper's Eq. (4), without that term, and ``Q = dt diag(q)``.
    position_psd, velocity_psd, acceleration_psd : float
        Power spectral densities of the white noises that drive the three pairs of states, in
        m^2/s, m^2/s^3 and m^2/s^5; not negative. The paper does not state them.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    structural = ("discretisation",)
    state = ("x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2")

    discretisation: Literal["exact", "euler"] = choice("exact", "euler")
    position_psd: float = not_negative(_DEFAULTS["position_psd"])
    velocity_psd: float = not_negative(_DEFAULTS["velocity_psd"])
    acceleration_psd: float = not_negative(_DEFAULTS["acceleration_psd"])

    @property
    def core_name(self) -> str:
        """``EulerAcceleration`` or ``ExactAcceleration``."""
        return f"{self.discretisation.capitalize()}Acceleration"
