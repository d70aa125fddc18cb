""":class:`DeadReckoning`: the baseline, which hears no echo."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

import numpy.typing as npt

from auvest import _core
from auvest.slat._base import COMPASS, SlatFilter
from auvest.slat.models import Motion


class DeadReckoning(SlatFilter):
    """Dead reckoning with the interface of the other filters. It hears no echo and has no masters.

    Parameters
    ----------
    x0, P0, motion, dtype
        As for :class:`Slatf`. ``CompassMotion(compensate_bias=False)`` is the paper's.
    longest_step_s : float
        A longer prediction is refused; infinite: none is.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _deaf = True
    _defaults = MappingProxyType({"longest_step_s": _core.ekf_slat_defaults()["longest_step_s"]})

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = COMPASS,
        dtype: npt.DTypeLike = "float64",
        **options: Any,
    ) -> None:
        super().__init__(x0, P0, motion=motion, dtype=dtype, **options)

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        return core.dead_reckoning(motion, params["longest_step_s"])
