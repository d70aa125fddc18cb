""":class:`EkfSlat`: slave and masters in one Gaussian."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_instance
from auvest.slat._base import COMPASS, MASTER, MAX_MASTERS, SONAR, SlatFilter
from auvest.slat.models import Imm, Master, Motion, PiecewiseAcceleration, Sonar, core_master

#: Masters that :class:`EkfSlat` can track with an :class:`~auvest.Imm`.
MAX_IMM_MASTERS = _core.slat_max_imm_masters


class EkfSlat(SlatFilter):
    """Slave and masters in one extended Kalman filter: the yardstick for the particle filters.

    Parameters
    ----------
    x0, P0, motion, master, sonar, dtype
        As for :class:`Slatf`.
    gate, recover_after, recover_of, fastest_m_s, forget_after_s, rebirth_velocity_m_s, \
rebirth_acceleration_m_s2, longest_step_s
        As for :class:`Slatf`.
    consider : bool
        The slave is considered, not estimated (Schmidt-Kalman): echoes tell of the masters, with
        all that is not known of the slave, and never correct it.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _defaults = _core.ekf_slat_defaults()

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = COMPASS,
        master: Master = MASTER,
        sonar: Sonar = SONAR,
        dtype: npt.DTypeLike = "float64",
        **options: Any,
    ) -> None:
        as_instance("master", master, (PiecewiseAcceleration, Imm))
        self._max_masters = MAX_IMM_MASTERS if isinstance(master, Imm) else MAX_MASTERS
        settings = {"master": master}
        super().__init__(
            x0, P0, motion=motion, sonar=sonar, dtype=dtype, settings=settings, **options
        )

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        return core.ekf_slat(
            motion, core_master(self._settings["master"], self._dtype.name), params
        )

    @property
    def nis(self) -> float:
        """NIS of the last update: chi-square, 2 degrees of freedom per echo."""
        return float(self._reading("nis"))
