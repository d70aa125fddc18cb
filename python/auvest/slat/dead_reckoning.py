""":class:`DeadReckoning`: the baseline, which hears no echo."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from auvest.slat._base import COMPASS, SlatFilter
from auvest.slat.models import Motion


class DeadReckoning(SlatFilter):
    """Dead reckoning with the interface of the other filters. It hears no echo and has no masters.

    Parameters
    ----------
    x0, P0, motion, dtype
        As for :class:`Slatf`. ``CompassMotion(compensate_bias=False)`` is the paper's.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _deaf = True

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = COMPASS,
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        super().__init__(x0, P0, motion=motion, dtype=dtype)

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        del params
        return core.dead_reckoning(motion)
