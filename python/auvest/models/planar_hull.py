"""A torpedo in the plane that is driven by its own commands, with the current in the state."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import not_negative, positive
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("PlanarHull")


@dataclass(frozen=True, kw_only=True)
class PlanarHull(ProcessModel):
    """A torpedo (``remus100``) in the plane, driven by rudder and propeller; a log is not needed.

    The state is ``[x, y, heading, forward, starboard, yaw rate, Vx, Vy]`` (m, rad, m/s, rad/s,
    m/s): the velocities are through the water, ``Vx`` and ``Vy`` are the current. x is north, y
    east, the heading from north to east. What drives a prediction is ``[rudder, propeller]`` (rad,
    rev/s) as they are over the step: the fin follows its command within 0.1 s, the propeller within
    1 s. The equations are those of :class:`auvest.vehicle.Hull` with 3 degrees of freedom; how much
    they are worth hangs on how well the hull is known (docs/algorithms/guidance.md).

    Parameters
    ----------
    surge_psd, sway_psd : float
        Noise of the forces ahead and to starboard, N^2 s, not negative.
    yaw_psd : float
        Of the moment in yaw, N^2 m^2 s, not negative.
    position_psd : float
        White noise of the position, m^2/s, not negative.
    current_psd : float
        Random walk of the current, m^2/s^3, not negative.
    step_s : float
        The longest step of Runge and Kutta's method, s, 0.01 to 0.5; a prediction takes as many as
        it needs.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    state = (
        "x_m",
        "y_m",
        "heading_rad",
        "forward_m_s",
        "starboard_m_s",
        "yaw_rate_rad_s",
        "current_x_m_s",
        "current_y_m_s",
    )
    input = ("rudder_rad", "propeller_rev_s")

    surge_psd: float = not_negative(_DEFAULTS["surge_psd"])
    sway_psd: float = not_negative(_DEFAULTS["sway_psd"])
    yaw_psd: float = not_negative(_DEFAULTS["yaw_psd"])
    position_psd: float = not_negative(_DEFAULTS["position_psd"])
    current_psd: float = not_negative(_DEFAULTS["current_psd"])
    step_s: float = positive(_DEFAULTS["step_s"])

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.01 <= self.step_s <= 0.5:
            raise ValueError(f"step_s must lie in 0.01..0.5, not {self.step_s:g}")
