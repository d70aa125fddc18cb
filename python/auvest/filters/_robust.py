"""What makes a filter a robust one by default: kernel and recovery, the same for all."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from auvest.filters._base import GaussianFilter
from auvest.kernels import Kernel, KernelName, RejectionStreak

_STREAK = RejectionStreak()


class RobustByDefault(GaussianFilter):
    """Stands before a filter among the bases of its robust preset; not for direct use."""

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        kernel: Kernel | KernelName = "hampel",
        recovery: RejectionStreak | None = _STREAK,
        **options: Any,
    ) -> None:
        super().__init__(x0, P0, kernel=kernel, recovery=recovery, **options)
