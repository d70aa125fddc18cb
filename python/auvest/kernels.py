"""Robust kernels and the recovery from lock-out, for :class:`auvest.RobustEkf` and its kin."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import as_array, as_kind, as_number, require_range
from auvest._fields import Checked, integer

if TYPE_CHECKING:
    from auvest._core import _Kernel

_DEFAULTS = _core.kernel_defaults()
_REJECTIONS = _core.robust_update_defaults()["rejections"]


@dataclass(frozen=True)
class Kernel:
    """What the kernels have in common; not for direct use."""

    name: ClassVar[str]

    def weight(self, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Weight, ``psi(t) / t`` in 0..1, of residuals ``t`` (K,) in multiples of sigma."""
        return self._map("weight", t)

    def rho(self, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Loss of residuals ``t`` (K,) in multiples of sigma; near 0 it is ``t**2 / 2``."""
        return self._map("rho", t)

    def _map(self, function: str, t: npt.ArrayLike) -> npt.NDArray[np.float64]:
        residuals = as_array("t", t, (None,), np.dtype(np.float64))
        values: npt.NDArray[np.float64] = getattr(core_kernel(self, "float64"), function)(residuals)
        return values

    def _check_ascending(self, *names: str) -> None:
        """Thresholds are positive and in ascending order; inf means that what lies beyond is not.

        Raises
        ------
        ValueError, TypeError
            If one is not.
        """
        for name in names:
            value = as_number(name, getattr(self, name), "positive", infinite=True)
            object.__setattr__(self, name, value)
        values = [getattr(self, name) for name in names]
        if values != sorted(values):
            given = ", ".join(f"{name}={value}" for name, value in zip(names, values, strict=True))
            raise ValueError(f"{' <= '.join(names)} is required, not {given}")


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
    k: float = _DEFAULTS["huber"]["k"]

    def __post_init__(self) -> None:
        self._check_ascending("k")


@dataclass(frozen=True, kw_only=True)
class Hampel(Kernel):
    """Hampel's kernel (Andrews et al. 1972): the influence falls from ``b`` and ends at ``c``.

    Parameters
    ----------
    a, b, c : float
        Thresholds in sigma: full weight below ``a``, rejected from ``c`` on; ``0 < a <= b <= c``.
    """

    name: ClassVar[str] = "hampel"
    a: float = _DEFAULTS["hampel"]["a"]
    b: float = _DEFAULTS["hampel"]["b"]
    c: float = _DEFAULTS["hampel"]["c"]

    def __post_init__(self) -> None:
        self._check_ascending("a", "b", "c")
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
    k0: float = _DEFAULTS["igg"]["k0"]
    k1: float = _DEFAULTS["igg"]["k1"]

    def __post_init__(self) -> None:
        self._check_ascending("k0", "k1")


@dataclass(frozen=True, kw_only=True)
class RejectionStreak(Checked):
    """Recovery from lock-out: a streak of rejections widens the position's covariance.

    A rejection counts 4 up, or 7 if it repeats the innovation of a recent one seen along the same
    line, or 1 if it contradicts that; an acceptance counts 2 down. At ``4 * rejections`` the
    position variance grows until the worst of the rejected innovations would stand at one sigma.

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
        f"not {type(kernel).__name__}"
    )


def core_kernel(kernel: Kernel, dtype: str) -> _Kernel[Any]:
    """Build the core's kernel in this precision."""
    params = asdict(kernel)
    require_range({k: v for k, v in params.items() if v != float("inf")}, dtype)
    built: _Kernel[Any] = getattr(getattr(_core, f"Kernel_{dtype}"), kernel.name)(params)
    return built
