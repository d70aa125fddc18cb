"""Measures of error and consistency."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._arguments import as_integer, as_number


def rmse(error: npt.ArrayLike) -> float:
    """Root of the mean squared length of error vectors.

    Parameters
    ----------
    error : array_like, shape (..., k)
        Error vectors; those with a NaN are left out.

    Returns
    -------
    float
        In the unit of ``error``; NaN if no vector is left.
    """
    square = np.square(np.asarray(error, dtype=np.float64)).sum(axis=-1)
    square = square[~np.isnan(square)]
    return float(np.sqrt(square.mean())) if square.size else float("nan")


def nees(
    error: npt.ArrayLike,
    P: npt.ArrayLike,
) -> npt.NDArray[np.float64]:
    """Normalised estimation error squared, ``e' P^-1 e``.

    Parameters
    ----------
    error : array_like, shape (..., k)
        Error vectors.
    P : array_like, shape (..., k, k)
        Covariances that the filter claims.

    Returns
    -------
    ndarray, shape (...)
        Chi-square with k degrees of freedom for a consistent filter; NaN where an input is.

    Raises
    ------
    ValueError
        If the shapes do not fit.
    """
    e = np.asarray(error, dtype=np.float64)
    p = np.asarray(P, dtype=np.float64)
    if e.ndim < 1 or p.shape != (*e.shape, e.shape[-1]):
        raise ValueError(
            f"error has shape {e.shape} and P {p.shape}; expected (..., k) and (..., k, k)"
        )
    known: Any = np.isfinite(e).all(axis=-1) & np.isfinite(p).all(axis=(-2, -1))
    solved = np.linalg.solve(p[known], e[known][..., np.newaxis])[..., 0]
    result = np.full(e.shape[:-1], np.nan)
    result[known] = (e[known] * solved).sum(axis=-1)
    return result


def chi2_bounds(dof: int, count: int = 1, level: float = 0.95) -> tuple[float, float]:
    """Bounds between which the mean of ``count`` independent chi-square values lies.

    Parameters
    ----------
    dof : int
        Degrees of freedom of each: 2 for the NIS of range and bearing, k for the NEES of k states.
    count : int
        How many independent values the mean is over.
    level : float
        Probability of lying between the bounds, in (0, 1).

    Returns
    -------
    (float, float)
        Lower and upper bound.
    """
    as_integer("dof", dof, 1, 10**9)
    as_integer("count", count, 1, 10**9)
    if not 0 < as_number("level", level) < 1:
        raise ValueError(f"level must lie between 0 and 1, not {level}")
    tail = (1 - level) / 2
    from scipy import stats  # here, because it is slow to import

    low, high = stats.chi2.ppf([tail, 1 - tail], dof * count) / count
    return float(low), float(high)
