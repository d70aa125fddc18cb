"""Measures of error and consistency."""

from __future__ import annotations

from dataclasses import dataclass

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

    Examples
    --------
    >>> rmse([[3.0, 4.0], [0.0, 5.0]])  # each 5 m long
    5.0
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
        Chi-square with k degrees of freedom for a consistent filter; NaN where an input is, and
        where P is singular, as that of a start which is known exactly.

    Raises
    ------
    ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> nees([[2.0, 0.0], [0.0, 2.0]], [[[4.0, 0.0], [0.0, 1.0]]] * 2).tolist()  # 1 and 2 sigma
    [1.0, 4.0]
    """
    e = np.asarray(error, dtype=np.float64)
    p = np.asarray(P, dtype=np.float64)
    if e.ndim < 1 or p.shape != (*e.shape, e.shape[-1]):
        raise ValueError(
            f"error has shape {e.shape} and P {p.shape}; expected (..., k) and (..., k, k)"
        )
    known = np.asarray(np.isfinite(e).all(axis=-1) & np.isfinite(p).all(axis=(-2, -1)))
    known[known] = np.linalg.slogdet(p[known])[0] != 0  # by the pivots that solve divides by
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

    Examples
    --------
    >>> low, high = chi2_bounds(2, 100)  # the mean of 100 NIS of range and bearing
    >>> f"{low:.2f} to {high:.2f}"
    '1.63 to 2.41'
    """
    as_integer("dof", dof, 1, 10**9)
    as_integer("count", count, 1, 10**9)
    if not 0 < as_number("level", level) < 1:
        raise ValueError(f"level must lie between 0 and 1, not {level}")
    tail = (1 - level) / 2
    from scipy.special import gammaincinv  # here, because it is slow to import

    low, high = 2 * gammaincinv(0.5 * dof * count, [tail, 1 - tail]) / count
    return float(low), float(high)


@dataclass(frozen=True)
class Consistency:
    """Whether means of NEES or NIS are what a consistent filter has.

    Attributes
    ----------
    mean : float
        Mean over what is independent: all NIS; for the NEES the runs at the last step.
    low, high : float
        Bounds of that mean for a consistent filter.
    steps_inside : float
        Share of the steps whose mean over the runs lies in the bounds for so many runs; about the
        level for a consistent filter.
    """

    mean: float
    low: float
    high: float
    steps_inside: float

    @property
    def consistent(self) -> bool:
        """True if the mean lies in its bounds."""
        return self.low <= self.mean <= self.high


def nis_consistency(nis: npt.ArrayLike, dof: int, level: float = 0.95) -> Consistency:
    """Judge a filter by its NIS, which is white for a consistent filter.

    Parameters
    ----------
    nis : array_like, shape (runs, steps)
        NaN where there is no measurement.
    dof : int
        Numbers in a measurement.
    level : float
        Probability of the bounds, in (0, 1).

    Examples
    --------
    >>> import numpy as np
    >>> nis = np.random.default_rng(1).chisquare(1, size=(20, 100))
    >>> nis_consistency(nis, dof=1).consistent, nis_consistency(1.2 * nis, dof=1).consistent
    (True, False)
    """
    values = _runs_and_steps("nis", nis)
    known = values[np.isfinite(values)]
    return _judge(values, known, dof, level)


def nees_consistency(nees: npt.ArrayLike, dof: int, level: float = 0.95) -> Consistency:
    """Judge a filter by its NEES over runs that start from draws of its belief.

    Errors of one run are correlated over time, so only the last step counts for the mean.

    Parameters
    ----------
    nees : array_like, shape (runs, steps)
    dof : int
        Components of the error.
    level : float
        Probability of the bounds, in (0, 1).
    """
    values = _runs_and_steps("nees", nees)
    last = values[:, -1]
    return _judge(values, last[np.isfinite(last)], dof, level)


def _runs_and_steps(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2:
        raise ValueError(f"{name} has shape {array.shape}, expected (runs, steps)")
    if not np.isfinite(array).any():
        raise ValueError(f"{name} has no finite element")
    return array


def _judge(
    values: npt.NDArray[np.float64], known: npt.NDArray[np.float64], dof: int, level: float
) -> Consistency:
    low, high = chi2_bounds(dof, max(1, known.size), level)
    finite = np.isfinite(values)
    counts = finite.sum(axis=0)
    sums = np.where(finite, values, 0.0).sum(axis=0)
    bounds = {count: chi2_bounds(dof, count, level) for count in set(counts.tolist()) - {0}}
    inside = [
        bounds[count][0] <= total / count <= bounds[count][1]
        for count, total in zip(counts.tolist(), sums.tolist(), strict=True)
        if count
    ]
    mean = float(known.mean()) if known.size else float("nan")
    return Consistency(mean, low, high, float(np.mean(inside)))
