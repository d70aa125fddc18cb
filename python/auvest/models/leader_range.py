"""Range to a leader of known position (Li, Du, Fan, Chen, Mao, Luo 2020)."""

from __future__ import annotations

from dataclasses import dataclass

from auvest import _core
from auvest._arguments import require_range_limits
from auvest._fields import not_negative, number, pair, positive, unstated
from auvest.models._base import MeasurementModel

_DEFAULTS = _core.sensor_defaults("LeaderRange")


@dataclass(frozen=True, kw_only=True)
class LeaderRange(MeasurementModel):
    """Range (m) to a leader of known position, Eqs. (4) and (5); one per message, any leader.

    Parameters
    ----------
    leader : (float, float)
        Where the leader was when the range was taken, m from a local origin; where it is left out,
        ``place`` says so in ``update`` and ``run``.
    sigma_range_m : float
        Standard deviation of the range, positive.
    sigma_leader_m : float
        Standard deviation of the leader's position per axis, not negative; adds to the noise of the
        range: ``R = sigma_range_m**2 + sigma_leader_m**2``.
    smallest_range_m, largest_range_m : float
        What the instrument can measure, m: a range outside is refused, for it is a code or a fault;
        defaults: 0 and infinity. A smallest one below 0 is for readings whose noise is not cut off
        at 0.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    measures = ("range_m",)
    place = "leader"
    _elsewhere = (_DEFAULTS["leader_x_m"], _DEFAULTS["leader_y_m"])

    leader: tuple[float, float] | None = unstated(pair(_elsewhere))
    sigma_range_m: float = positive(_DEFAULTS["sigma_range_m"])
    sigma_leader_m: float = not_negative(_DEFAULTS["sigma_leader_m"])
    smallest_range_m: float = number(_DEFAULTS["smallest_range_m"])
    largest_range_m: float = positive(_DEFAULTS["largest_range_m"], infinite=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_range_limits(self.smallest_range_m, self.largest_range_m)

    def _core_params(self) -> dict[str, float]:
        params = super()._core_params()
        del params["leader"]
        x_m, y_m = self._elsewhere if self.leader is None else self.leader
        return {**params, "leader_x_m": x_m, "leader_y_m": y_m}
