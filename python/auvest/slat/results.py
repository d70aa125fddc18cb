"""What ``run`` of the SLAT filters returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.results import Result


@dataclass(frozen=True, repr=False, eq=False)
class SlatRun(Result):
    """What ``run`` returns: row k is the state of affairs at ``time_s[k]``, the end of reading k.

    Attributes
    ----------
    time_s : ndarray, shape (T,)
        The record's times without the first, s.
    x : ndarray, shape (T, n)
        Estimated poses of the slave: n = 2 or 3, as the motion says.
    P : ndarray, shape (T, n, n)
        Their covariances.
    masters_x : ndarray, shape (T, M, 6)
        Estimated masters ``[x, y, vx, vy, ax, ay]``; NaN before a master is born.
    masters_P : ndarray, shape (T, M, 6, 6)
        Their covariances.
    effective_size : ndarray, shape (T,)
        N_eff of the last update, Eq. (33), before any resampling; 0 without particles.
    resamplings : ndarray of int, shape (T,)
        Resamplings since the start of the filter.
    log_likelihood : ndarray, shape (T,)
        Logarithm of the density of all echoes since the start of the filter.
    nis : ndarray, shape (T,)
        Of the last update of :class:`EkfSlat`, 2 degrees of freedom per echo; 0 for the others.
    refused, rebirths : ndarray of int, shape (T,)
        Echoes refused by the gate, and masters born again, since the start of the filter.
    """

    time_s: Floats
    x: Floats
    P: Floats
    masters_x: Floats
    masters_P: Floats
    effective_size: Floats
    resamplings: npt.NDArray[np.int64]
    log_likelihood: Floats
    nis: Floats
    refused: npt.NDArray[np.int64]
    rebirths: npt.NDArray[np.int64]
