"""What instruments are off by, and stay off by, estimated beside the pose: [constants]."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from auvest._arguments import Floats
from auvest.logs import LogFolder
from auvest.models import Odometry, OdometryConstants, ProcessModel
from auvest.replay.config import Settings

#: Where the constants begin in the state, and how many there can be.
FIRST, MOST = 3, 5
#: The variance of a state that is no constant: it is not used, and any number does.
UNUSED = 1.0


@dataclass(frozen=True)
class Found:
    """A constant at the end of a run.

    Attributes
    ----------
    name : str
        Its key in [constants]; with a dot and a number, of a source's own.
    value, sigma : float
        What it is, and its standard deviation.
    prior : float
        The standard deviation that the settings gave it.
    indistinguishable : bool
        Whether 0 lies within two standard deviations: there may be no such error.
    """

    name: str
    value: float
    sigma: float
    prior: float
    indistinguishable: bool

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    @property
    def text(self) -> str:
        """In words, with a unit."""
        unit = next((unit for end, unit in _UNITS if self.name.split(".")[0].endswith(end)), "")
        said = f"{self.value:+.3g} ± {self.sigma:.2g}{unit}"
        return f"{said}, indistinguishable from none" if self.indistinguishable else said


_UNITS = (("_rad_s", " rad/s"), ("_rad", " rad"), ("_m", " m"))


class Constants:
    """The constants that the settings ask for, and where each is in the state.

    Parameters
    ----------
    settings : Settings
        The settings.

    Attributes
    ----------
    priors : dict of str to float
        Those in the state, in order, and the standard deviation of each.

    Raises
    ------
    ValueError
        If there are more than the state has places for.
    """

    def __init__(self, settings: Settings) -> None:
        own = settings.constants
        keys = ("range_scale", "range_offset_m", "speed_factor", "turn_offset_rad_s")
        self.priors = {key: getattr(own, key) for key in keys if getattr(own, key) > 0}
        for source, said in settings.ranges.sources.items():
            if said.constant_offset_m is not None:
                self.priors[f"range_offset_m.{source}"] = said.constant_offset_m
        if len(self.priors) > MOST:
            raise ValueError(
                f"[constants] {len(self.priors)} of them are too many, {MOST} at most: "
                f"{', '.join(self.priors)}"
            )
        if self.priors and settings.filter.components > 1:
            raise ValueError("[constants] and [filter] components do not go together")
        self._compass = own.compass_offset_rad
        self._share = own.walk / 60.0  # per sqrt(s)
        self._noise = settings.odometry

    def __bool__(self) -> bool:
        return bool(self.priors)

    def place(self, name: str) -> int:
        """Give the place of a constant in the state; 0 if it is not there."""
        return FIRST + list(self.priors).index(name) if name in self.priors else 0

    def offset_of(self, source: int) -> int:
        """Give the place of the offset of a source's ranges: its own, else that of all."""
        return self.place(f"range_offset_m.{source}") or self.place("range_offset_m")

    def require(self, log: LogFolder, *, steered: bool) -> None:
        """Refuse constants of what a log has not.

        Parameters
        ----------
        log : LogFolder
            The log.
        steered : bool
            Whether headings say how the craft turns.
        """
        if self._compass > 0 and not steered:
            raise ValueError(
                "[constants] compass_offset_rad: no compass says how the craft is headed in "
                f"{log.path}"
            )
        if steered and self.place("turn_offset_rad_s"):
            raise ValueError(
                "[constants] turn_offset_rad_s is for turns and yaw rates, but headings say how "
                f"the craft turns in {log.path}"
            )

    @property
    def process(self) -> ProcessModel:
        """The process whose state has them."""
        noise = self._noise
        sigmas: dict[str, Any] = {
            key: getattr(noise, key)
            for key in ("sigma_distance", "sigma_drift", "sigma_turn", "sigma_turned")
        }
        if not self:
            return Odometry(**sigmas)
        walks = {f"walk_{k}": self._share * prior for k, prior in enumerate(self.priors.values())}
        return OdometryConstants(
            **sigmas,
            **walks,
            speed_state=self.place("speed_factor"),
            turn_state=self.place("turn_offset_rad_s"),
        )

    def begin(self, pose: list[float], sigmas: list[float]) -> tuple[list[float], list[float]]:
        """Give the state and its standard deviations at the start."""
        sigmas = [*sigmas[:2], math.hypot(sigmas[2], self._compass)]
        if not self:
            return pose, sigmas
        unused = MOST - len(self.priors)
        return [*pose, *[0.0] * MOST], [*sigmas, *self.priors.values(), *[UNUSED] * unused]

    def found(self, x: Floats, covariance: Floats, deviation_rad: float) -> list[Found]:
        """Give them at the end: from the state, and from how far its heading is off the compass."""
        named = {name: (float(x[k]), k, prior) for name, prior in self.priors.items()
                 for k in [self.place(name)]}  # fmt: skip
        if self._compass > 0:
            named["compass_offset_rad"] = (deviation_rad, 2, self._compass)
        made = []
        for name, (value, k, prior) in named.items():
            sigma = math.sqrt(float(covariance[k, k]))
            made.append(Found(name, value, sigma, prior, abs(value) < 2 * sigma))
        return made
