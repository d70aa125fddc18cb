"""Dead reckoning by speed and heading (Li, Du, Fan, Chen, Mao, Luo 2020)."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._fields import flag, not_negative
from auvest.models._base import ProcessModel

_DEFAULTS = _core.process_defaults("SpeedHeading")


@dataclass(frozen=True, kw_only=True)
class SpeedHeading(ProcessModel):
    """Dead reckoning by speed and heading, Eqs. (1) to (3), state ``[x, y]`` (m) and options.

    What drives a prediction is ``[forward speed, starboard speed, heading]`` (m/s, m/s, rad). x is
    north, y east and the heading clockwise from north; or x east, y north, the heading from east
    anticlockwise and the second speed to port.

    Parameters
    ----------
    sigma_forward, sigma_starboard : float
        Noise of the two speeds, m/s/sqrt(Hz), not negative.
    sigma_heading : float
        Noise of the heading, rad/sqrt(Hz), not negative.
    heading_bias : bool
        Estimate the error of the compass (rad), the state after the position.
    speed_scale : bool
        Estimate the relative error of the speed, the last state.
    bias_walk, scale_walk : float
        Random walks of these two, rad/sqrt(s) and 1/sqrt(s), not negative.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    structural = ("heading_bias", "speed_scale")
    input = ("forward_m_s", "starboard_m_s", "heading_rad")

    sigma_forward: float = not_negative(_DEFAULTS["sigma_forward"])
    sigma_starboard: float = not_negative(_DEFAULTS["sigma_starboard"])
    sigma_heading: float = not_negative(_DEFAULTS["sigma_heading"])
    heading_bias: bool = flag(False)
    speed_scale: bool = flag(False)
    bias_walk: float = not_negative(_DEFAULTS["bias_walk"])
    scale_walk: float = not_negative(_DEFAULTS["scale_walk"])

    @property
    def state(self) -> tuple[str, ...]:  # type: ignore[override]
        """Position, and what of the instruments is estimated with it."""
        bias = ("heading_bias_rad",) if self.heading_bias else ()
        scale = ("speed_scale",) if self.speed_scale else ()
        return ("x_m", "y_m", *bias, *scale)

    @property
    def core_name(self) -> str:
        """One class of the core per set of states."""
        return f"SpeedHeading{'Bias' * self.heading_bias}{'Scale' * self.speed_scale}"
