""":class:`SlatfJoint`: SLATF with joint Gaussians as particles."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_integer, as_kind
from auvest.slat._base import MAX_MASTERS, ParticleSlatFilter
from auvest.slat.models import core_params

CovarianceOf = Literal["particle", "shared"]


class SlatfJoint(ParticleSlatFilter):
    """SLATF whose particles are joint Gaussians of slave and masters.

    They draw only what the sonar sees, range and bearing of one master, and keep the drift that
    slave and masters share as a Gaussian: as precise and as consistent as :class:`EkfSlat` with
    100 particles where that is enough, with more than one answer where it is not. See
    docs/algorithms/slatf.md.

    Parameters
    ----------
    x0, P0, motion, master, sonar, resampling, resample_below, dtype, seed, stream
        As for :class:`Slatf`.
    gate, recover_after, recover_of, fastest_m_s, forget_after_s, rebirth_velocity_m_s, \
rebirth_acceleration_m_s2, longest_step_s
        As for :class:`Slatf`.
    covariance : {"particle", "shared"}
        "shared": one covariance for all particles, which differ by metres where the covariance
        depends on kilometres. A particle then takes 36 bytes in place of 180 (one master, float32)
        and a twentieth of the time. It is wrong where particles hold different answers, so echoes
        of ``UNKNOWN_MASTER`` are refused then.
    particles : int
        N, 1 to 1 million.
    kept : float
        Share of the covariance of range and bearing that is not drawn, in 0..1; default 0.5, with
        a shared covariance 0.8. 0: they become a point, as in SLATF 2.0. 1: nothing is drawn,
        every particle is an :class:`EkfSlat`.
    max_masters : int
        Masters that it can hold, 1 to ``MAX_MASTERS``. With room for one only it is some ten times
        smaller and faster.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _max_particles = 1_000_000

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        covariance: CovarianceOf = "particle",
        max_masters: int = 1,
        **options: Any,
    ) -> None:
        as_kind("covariance", covariance, get_args(CovarianceOf))
        self._shared = covariance == "shared"
        self._defaults = (
            _core.slatf_shared_defaults() if self._shared else _core.slatf_joint_defaults()
        )
        self._max_masters = as_integer("max_masters", max_masters, 1, MAX_MASTERS)
        settings = {"max_masters": self._max_masters, "covariance": covariance}
        super().__init__(x0, P0, settings=settings, **options)

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        settings = self._settings
        return core.slatf_joint(
            motion,
            core_params(settings["master"], self._dtype.name),
            params,
            settings["resampling"],
            settings["particles"],
            self._max_masters,
            self._shared,
        )

    @property
    def kept(self) -> float:
        """Share of the covariance of range and bearing that is not drawn."""
        return float(self._settings["kept"])

    @property
    def covariance(self) -> str:
        """Whose the covariance is: of each "particle", or "shared"."""
        return str(self._settings["covariance"])
