""":class:`Slatf`: SLATF 1.0 and 2.0 (Lu, Chen, Liu, Ma, He 2020)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import DType, as_dtype, as_integer, as_kind, as_number
from auvest._build import lacks
from auvest.slat._base import MASTER, ParticleSlatFilter
from auvest.slat.models import Imm, Master, PiecewiseAcceleration, core_master
from auvest.slat.results import SlatRun

for _line in lacks():
    warnings.warn(f"auvest was {_line}", RuntimeWarning, stacklevel=2)

#: Particles that a filter takes at most: 0.5 kB each in float32.
MAX_PARTICLES = 10_000_000
#: Resamplings, as a share of N, beyond which the covariance is called too small.
OVERCONFIDENT_SHARE = 0.3


class OverconfidenceWarning(UserWarning):
    """A filter claims to know more than it can."""


Lanes = Literal["scalar", "sse2", "avx2", "avx512"]


def available_lanes(dtype: npt.DTypeLike = "float32") -> tuple[str, ...]:
    """Give the instruction sets in whose lanes particles can run here, the widest last.

    The bits do not depend on the choice. In float64 particles run one by one.
    """
    return tuple(_core.slat_lanes(as_dtype(dtype) == np.dtype(np.float32)))


class Slatf(ParticleSlatFilter):
    """SLATF 1.0 and 2.0: a particle filter over the slave's pose with an EKF per master in each.

    The paper's filter. Its covariance is too small: at N = 100 the truth lies in its 95 % ellipse
    two times in three, and less often the longer it runs, because the drift that slave and masters
    share is held by points alone, which die out as particles are resampled. Take
    :class:`SlatfJoint` with ``covariance="shared"`` where the covariance matters.

    Parameters
    ----------
    x0 : array_like, shape (n,)
        The slave's pose when communication breaks: ``[x, y]`` or ``[x, y, heading]``, m, rad.
    P0 : array_like, shape (n, n)
        Its covariance, from which particles are drawn; may be singular or zero.
    version : {2, 1}
        1: poses are drawn from the motion. 2: from motion and measurement.
    particles : int
        N, 1 to 10 million.
    motion : CompassMotion or UnicycleMotion
    master : PiecewiseAcceleration or Imm
    sonar : Sonar
    resampling : {"systematic", "stratified", "residual", "multinomial"}
    resample_below : float
        Resample where N_eff falls below this share of N, in 0..1, Eq. (33).
    carry_covariance : bool
        2.0 only: Eq. (50) to the letter, see docs/algorithms/slatf.md.
    gate : float
        An echo whose NIS (2 degrees of freedom) exceeds this in a particle says nothing to it.
        The default, 13.8, loses one good echo in 1,000; 0: no gate and no recovery, as in the
        paper.
    recover_after, recover_of : int
        A master of whose last ``recover_of`` echoes (at most 16) ``recover_after`` were refused, at
        places where one vehicle can have been, is born again at the last of them. Must exceed the
        longest burst of wrong echoes that agree with each other. 0: never.
    fastest_m_s : float
        No master moves faster between two echoes.
    forget_after_s : float
        An echo that ends a longer silence of its master is its rebirth; 0: never. What a master
        did in the silence is else charged to the slave: for masters whose plan is not known.
    rebirth_velocity_m_s, rebirth_acceleration_m_s2 : float
        Standard deviations of a master that is born again, about zero.
    longest_step_s : float
        A longer prediction is refused with ``Status.step_too_long``: it is a wrong time stamp.
        Infinite: none is.
    monte_carlo : bool
        The slave's covariance includes the error that resampling has left in its mean, as far as N
        tells it; False: as in the paper.
    birth_velocity_m_s, birth_acceleration_m_s2 : float
        Standard deviations of a master that is born from an unknown echo, see the algorithm's
        page; velocity 0: no births. Needs a gate.
    lanes : {"scalar", "sse2", "avx2", "avx512"}, optional
        Instruction set; default: the widest of :func:`available_lanes`. The bits are the same.
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.
    seed, stream : int
        Of the filter's random numbers, 0 to 2^64 - 1: streams of one seed have none in common.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _defaults = _core.slatf_defaults()
    _max_particles = MAX_PARTICLES
    _masters = (PiecewiseAcceleration, Imm)

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        version: Literal[1, 2] = 2,
        master: Master = MASTER,
        lanes: Lanes | None = None,
        dtype: npt.DTypeLike = "float64",
        **options: Any,
    ) -> None:
        if isinstance(master, Imm):
            as_kind("lanes", lanes or "scalar", ("scalar",))  # with an Imm particles run one by one
            lanes = "scalar"
        self._lanes = _as_lanes(lanes, as_dtype(dtype))
        settings = {"version": as_integer("version", version, 1, 2)}
        super().__init__(x0, P0, master=master, dtype=dtype, settings=settings, **options)

    def _as_params(self, given: Mapping[str, Any]) -> dict[str, Any]:
        params = super()._as_params(given)
        as_number("birth_acceleration_m_s2", params["birth_acceleration_m_s2"], "positive")
        self._births = params["birth_velocity_m_s"] > 0
        if self._births and params["gate"] == 0:
            raise ValueError("birth_velocity_m_s needs a gate above 0: births are decided by it")
        return params

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        available = available_lanes(self._dtype)
        if self._lanes not in available:  # pickled on a processor that has more
            self._lanes = available[-1]
        settings = self._settings
        return core.slatf(
            motion,
            core_master(settings["master"], self._dtype.name),
            params,
            settings["resampling"],
            settings["version"],
            settings["particles"],
            self._lanes,
        )

    @property
    def overconfident(self) -> bool:
        """More was resampled than N particles bear: the covariance is far too small by now."""
        return self.resamplings > OVERCONFIDENT_SHARE * self.particles

    def __repr__(self) -> str:
        if not self.overconfident:
            return super().__repr__()
        many = f"resamplings={self.resamplings}: its covariance is too small"
        return f"{super().__repr__()[:-1]}, {many})"

    def run(self, *args: Any, **options: Any) -> SlatRun:
        """See :meth:`SlatFilter.run`; warns where it becomes :attr:`overconfident`."""
        before = self.overconfident
        result = super().run(*args, **options)
        if self.overconfident and not before:
            warnings.warn(
                f"{self.resamplings} resamplings of {self.particles} particles: the covariance is "
                "too small. Take SlatfJoint(covariance='shared'), or more particles",
                OverconfidenceWarning,
                stacklevel=2,
            )
        return result

    @property
    def version(self) -> int:
        """1 or 2."""
        return int(self._settings["version"])

    @property
    def lanes(self) -> str:
        """The instruction set in whose lanes the particles run."""
        return self._lanes


def _as_lanes(lanes: str | None, dtype: DType) -> str:
    available = available_lanes(dtype)
    if lanes is None:
        return available[-1]
    as_kind("lanes", lanes, get_args(Lanes))
    if lanes not in available:
        raise ValueError(
            f"lanes {lanes!r} do not run here in {dtype.name}; {', '.join(available)} do"
        )
    return lanes
