""":class:`SlatfJoint`: SLATF with joint Gaussians as particles."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_integer
from auvest.slat._base import MAX_MASTERS, ParticleSlatFilter
from auvest.slat.models import core_params


class SlatfJoint(ParticleSlatFilter):
    """SLATF whose particles are joint Gaussians of slave and masters.

    They draw only what the sonar sees, range and bearing of one master, and keep the drift that
    slave and masters share as a Gaussian: as precise as :class:`EkfSlat` with 100 particles where
    that is enough, with more than one answer where it is not. See docs/algorithms/slatf.md.

    Parameters
    ----------
    x0, P0, motion, master, sonar, resampling, resample_below, gate, dtype, seed
        As for :class:`Slatf`.
    particles : int
        N, 1 to 1 million.
    kept : float
        Share of the covariance of range and bearing that is not drawn, in 0..1. 0: they become a
        point, as in SLATF 2.0. 1: nothing is drawn, every particle is an :class:`EkfSlat`.
    max_masters : int
        Masters that it can hold, 1 to ``MAX_MASTERS``. With room for one only it is some ten times
        smaller and faster.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _defaults = _core.slatf_joint_defaults()
    _max_particles = 1_000_000

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        max_masters: int = 1,
        **options: Any,
    ) -> None:
        self._max_masters = as_integer("max_masters", max_masters, 1, MAX_MASTERS)
        super().__init__(x0, P0, settings={"max_masters": self._max_masters}, **options)

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        settings = self._settings
        return core.slatf_joint(
            motion,
            core_params(settings["master"], self._dtype.name),
            params,
            settings["resampling"],
            settings["particles"],
            self._max_masters,
        )

    @property
    def kept(self) -> float:
        """Share of the covariance of range and bearing that is not drawn."""
        return float(self._settings["kept"])
