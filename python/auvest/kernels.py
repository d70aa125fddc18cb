"""Robust kernels and the recovery from lock-out, for :class:`auvest.RobustEkf` and its kin."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_array, as_kind, require_range, type_name
from auvest._fields import Checked, integer, positive

if TYPE_CHECKING:
    from auvest._core import _Kernel

_DEFAULTS = _core.kernel_defaults()
_REJECTIONS = _core.robust_update_defaults()["rejections"]


@dataclass(frozen=True)
class Kernel(Checked):
    """What the kernels have in common; not for direct use.

    Thresholds are positive and in ascending order; inf means that what lies beyond is not.
    """

    name: ClassVar[str]

    def __post_init__(self) -> None:
        super().__post_init__()
        params = asdict(self)
        if [*params.values()] != sorted(params.values()):
            given = ", ".join(f"{name}={value}" for name, value in params.items())
            raise ValueError(f"{' <= '.join(params)} is required, not {given}")

    def weight(self, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Weight, ``psi(t) / t`` in 0..1, of residuals ``t`` (K,) in multiples of sigma."""
        return self._map("weight", t)

    def rho(self, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Loss of residuals ``t`` (K,) in multiples of sigma; near 0 it is ``t**2 / 2``."""
        return self._map("rho", t)

    def _map(self, function: str, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        residuals = as_array("t", t, (None,), np.dtype(np.float64))
        return getattr(core_kernel(self, "float64"), function)(residuals)


@dataclass(frozen=True, kw_only=True)
class Unit(Kernel):
    """Least squares: every residual counts fully. The filter with it is the filter without one."""

    name: ClassVar[str] = "unit"


@dataclass(frozen=True, kw_only=True)
class Huber(Kernel):
    """Huber's kernel (1964): squares up to ``k`` sigma, absolute values beyond; rejects nothing.

    Parameters
    ----------
    k : float
        Threshold in sigma, positive; 1.345 keeps 95 % efficiency on Gaussian noise.
    """

    name: ClassVar[str] = "huber"
    k: float = positive(_DEFAULTS["huber"]["k"], infinite=True)


@dataclass(frozen=True, kw_only=True)
class Hampel(Kernel):
    """Hampel's kernel (Andrews et al. 1972): the influence falls from ``b`` and ends at ``c``.

    Parameters
    ----------
    a, b, c : float
        Thresholds in sigma: full weight below ``a``, rejected from ``c`` on; ``0 < a <= b <= c``.
    """

    name: ClassVar[str] = "hampel"
    a: float = positive(_DEFAULTS["hampel"]["a"], infinite=True)
    b: float = positive(_DEFAULTS["hampel"]["b"], infinite=True)
    c: float = positive(_DEFAULTS["hampel"]["c"], infinite=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.c == float("inf") and self.b != float("inf"):
            raise ValueError(f"c must be finite where b is, not c={self.c} with b={self.b}")


@dataclass(frozen=True, kw_only=True)
class Igg(Kernel):
    """The three segments of Eq. (20) (Zhou 1989): full, ``k0 / |t|``, rejected.

    Parameters
    ----------
    k0, k1 : float
        Thresholds in sigma: full weight below ``k0``, rejected from ``k1`` on; ``0 < k0 <= k1``.
    """

    name: ClassVar[str] = "igg"
    k0: float = positive(_DEFAULTS["igg"]["k0"], infinite=True)
    k1: float = positive(_DEFAULTS["igg"]["k1"], infinite=True)


@dataclass(frozen=True, kw_only=True)
class RejectionStreak(Checked):
    """Recovery from lock-out: a streak of rejections widens the position's covariance.

    A rejection counts 4 up, or 7 if it repeats the innovation of a recent one seen along the same
    line, or 1 if it contradicts that; an acceptance counts 2 down. At ``4 * rejections`` the
    position variance grows until the worst of the rejected innovations would stand at one sigma.
    That is done five times at once and then once in fifty measurements: recoveries that repeat are
    a wrong model, and the filter's ``status`` is then ``Status.recoveries_repeat``.

    Parameters
    ----------
    rejections : int
        Rejections in a row that it takes if none repeats another, 1..60.
    """

    rejections: int = integer(_REJECTIONS, 1, 60)


KernelName: TypeAlias = Literal["igg", "huber", "hampel", "unit"]

#: The kernels by name.
KERNELS: dict[str, type[Kernel]] = {kind.name: kind for kind in (Igg, Huber, Hampel, Unit)}


def as_kernel(kernel: object) -> Kernel:
    """Take a kernel, or the name of one for its default thresholds."""
    if isinstance(kernel, Kernel) and type(kernel) in KERNELS.values():
        return kernel
    if isinstance(kernel, str):
        return KERNELS[as_kind("kernel", kernel, tuple(KERNELS))]()
    raise TypeError(
        "kernel must be an auvest.Igg, Huber, Hampel or Unit, or a name of one, "
        f"not {type_name(kernel)}"
    )


def core_kernel(kernel: Kernel, dtype: str) -> _Kernel[Any]:
    """Build the core's kernel in this precision."""
    params = asdict(kernel)
    require_range({k: v for k, v in params.items() if v != float("inf")}, dtype)
    return getattr(getattr(_core, f"Kernel_{dtype}"), kernel.name)(params)
