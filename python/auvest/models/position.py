"""A fix of the position: GPS at the surface, or a USBL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from auvest._arguments import as_covariance
from auvest.models._base import MeasurementModel

_FLOAT64 = np.dtype(np.float64)


@dataclass(frozen=True, kw_only=True)
class Position(MeasurementModel):
    """A fix of the position, 2 or 3 numbers (m) on the axes of the state, with any covariance.

    Parameters
    ----------
    covariance_m2 : array_like, shape (2, 2) or (3, 3)
        Covariance of the fix, m^2, symmetric positive definite; 3 numbers need a process whose
        state begins with ``x, y, z``. A fix is one model: where the covariance changes from fix to
        fix, give ``update`` a new one.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    structural = ("covariance_m2",)

    covariance_m2: tuple[tuple[float, ...], ...] | npt.ArrayLike = ((1.0, 0.0), (0.0, 1.0))

    def __post_init__(self) -> None:
        axes = 3 if np.shape(self.covariance_m2)[:1] == (3,) else 2
        matrix = as_covariance("covariance_m2", self.covariance_m2, axes, _FLOAT64)
        smallest = np.linalg.eigvalsh(matrix)[0]
        if smallest <= 0:
            raise ValueError(
                "covariance_m2 must be positive definite, "
                f"but its smallest eigenvalue is {smallest:.3g}"
            )
        rows = tuple(tuple(row) for row in matrix.tolist())
        object.__setattr__(self, "covariance_m2", rows)

    @property
    def observes(self) -> tuple[str, ...]:  # type: ignore[override]
        """The axes."""
        return ("x_m", "y_m", "z_m")[: self._axes]

    @property
    def measures(self) -> tuple[str, ...]:  # type: ignore[override]
        """The axes."""
        return self.observes

    @property
    def core_name(self) -> str:
        """One class of the core per number of axes."""
        return f"Position{self._axes}"

    @property
    def _axes(self) -> int:
        return len(self.covariance_m2)  # type: ignore[arg-type]

    def _core_params(self) -> dict[str, float]:
        matrix = np.array(self.covariance_m2)
        return dict(zip(self._core_defaults(), matrix[np.tril_indices(self._axes)], strict=True))
