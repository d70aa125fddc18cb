"""What the filters report: :class:`Report` of an update, :class:`RunResult` of a run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest._core import Decision, Status
from auvest.results import Result

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Report:
    """What an update reports; m numbers in a measurement.

    Attributes
    ----------
    innovation : ndarray, shape (m,)
        Measured minus predicted, or a position error (m) where ``near_field``.
    S : ndarray, shape (m, m)
        Covariance of the innovation before any weight.
    nis : float
        Normalised innovation squared before any weight, chi-square with m degrees of freedom.
    near_field : bool
        True if the measurement was taken as a position (see :class:`auvest.RangeBearing`).
    standardised, weight : ndarray, shape (m,)
        The residuals that the kernel judged, in sigma, and the weights it gave, 0..1.
    decision : Decision
        accepted, downweighted or rejected.
    iterations : int
        Until the weights were final; innovations take 1.
    recovered : bool
        True if the recovery widened the covariance after this update.
    """

    innovation: Floats
    S: Floats
    nis: float
    near_field: bool
    standardised: Floats
    weight: Floats
    decision: Decision
    iterations: int
    recovered: bool


@dataclass(frozen=True, eq=False)
class Mixture:
    """The Gaussians that a belief is made of: where the craft may be, and how likely each is.

    Attributes
    ----------
    weight : ndarray, shape (k,)
        Their probabilities; the sum is 1.
    x : ndarray, shape (k, n)
        Their means.
    P : ndarray, shape (k, n, n)
        Their covariances.
    """

    weight: Floats
    x: Floats
    P: Floats

    def __len__(self) -> int:
        return len(self.weight)


@dataclass(frozen=True, repr=False, eq=False)
class RunResult(Result):
    """What ``run`` returns; row k of each column is the state of affairs after row k of the record.

    T rows, n states, m numbers in a measurement: where sensors differ, those of the largest, and
    NaN behind the numbers of the others. Where a measurement is missing, floats of the update are
    NaN and ``iterations`` is 0. A column in brackets is there if it was asked for.

    Attributes
    ----------
    x : ndarray, shape (T, n)
        Estimates.
    P : ndarray, shape (T, n, n)
        Covariances [``covariance=True``].
    innovation : ndarray, shape (T, m)
        Innovations.
    S : ndarray, shape (T, m, m)
        Covariances of the innovations before any weight [``covariance=True``].
    nis : ndarray, shape (T,)
        Normalised innovation squared before any weight, chi-square with as many degrees of freedom
        as the measurement has numbers.
    near_field : ndarray of bool, shape (T,)
        True where the measurement was taken as a position (see :class:`auvest.RangeBearing`).
    standardised : ndarray, shape (T, m)
        The residuals that the kernel judged, in sigma.
    weight : ndarray, shape (T, m)
        The weights it gave, 0..1.
    decision : ndarray of uint8, shape (T,)
        What became of the measurement, an :class:`auvest.Decision`; 0 where it is missing.
    iterations : ndarray of uint8, shape (T,)
        Until the weights were final; innovations take 1.
    recovered : ndarray of bool, shape (T,)
        True where the recovery widened the covariance.
    interval_s : ndarray, shape (T,)
        Interval that the policy chose for the next sample, s [filters with a policy].
    too_late : ndarray of bool, shape (T,)
        True where a measurement was older than the filter remembers, and was left out [filters with
        ``late_s``].
    convergence : ndarray of uint8, shape (T,)
        What the ranges said about where the craft is, an :class:`auvest.Convergence` [filters with
        ``components``].
    mixture_size : ndarray of uint8, shape (T,)
        How many Gaussians the belief was made of [filters with ``components``].
    """

    x: Floats
    P: Floats
    innovation: Floats
    S: Floats
    nis: Floats
    near_field: npt.NDArray[np.bool_]
    standardised: Floats
    weight: Floats
    decision: npt.NDArray[np.uint8]
    iterations: npt.NDArray[np.uint8]
    recovered: npt.NDArray[np.bool_]
    interval_s: Floats
    too_late: npt.NDArray[np.bool_]
    convergence: npt.NDArray[np.uint8]
    mixture_size: npt.NDArray[np.uint8]

    @property
    def counts(self) -> dict[str, int]:
        """How many rows had a measurement that was, by these names.

        ``accepted``, ``downweighted`` or ``rejected`` (see :class:`auvest.Decision`), ``missing``
        or ``too_late``; ``recovered`` are those of them at which the covariance was widened.
        """
        taken = self.iterations > 0
        counts = {
            name: int(np.count_nonzero(taken & (self.decision == int(decision))))
            for name, decision in Decision.__members__.items()
        }
        late = int(np.count_nonzero(self.too_late)) if "too_late" in self.columns else 0
        missing = self._rows_done() - int(np.count_nonzero(taken)) - late
        recovered = int(np.count_nonzero(self.recovered))
        return {**counts, "missing": missing, "too_late": late, "recovered": recovered}

    def _rows_done(self) -> int:
        return self.iterations.size

    def _summary(self) -> str:
        found = [
            f"{count} {name.replace('_', ' ')}" for name, count in self.counts.items() if count
        ]
        return ", ".join([super()._summary(), *found])


@dataclass(frozen=True, repr=False, eq=False)
class RunsResult(RunResult):
    """What ``run`` returns for many records: the columns of each run, and how it ended.

    The columns are those of :class:`RunResult` with an axis for the runs in front: ``x`` is of
    shape (runs, T, n). A run ends before the first row that is refused. From there on its floats
    are NaN and its other columns 0; ``rows`` and ``status`` say so, and no other run is touched.

    Attributes
    ----------
    rows : ndarray of int, shape (runs,)
        Rows that were done.
    status : ndarray of uint8, shape (runs,)
        How each run ended: values of :class:`auvest.Status`, 0 is ok.
    """

    rows: npt.NDArray[np.int64]
    status: npt.NDArray[np.uint8]

    _length_of = "runs"

    def _rows_done(self) -> int:
        return int(self.rows.sum())

    @property
    def failed(self) -> npt.NDArray[np.bool_]:
        """Runs with a row that was refused, shape (runs,)."""
        return self.status != int(Status.ok)

    def run(self, number: int) -> RunResult:
        """Give the result of one run: the rows that it has done."""
        ends = ("rows", "status")
        done = int(self.rows[number])
        columns = {name: self[name][number][:done] for name in self.columns if name not in ends}
        absent = {field.name: None for field in fields(RunResult) if field.name not in columns}
        return RunResult(**columns, **absent)  # type: ignore[arg-type]

    def to_pandas(self, columns: Iterable[str] | None = None) -> pd.DataFrame:
        """Make a pandas DataFrame of all runs, whose index is (run, row).

        See :meth:`RunResult.to_pandas`; ``rows`` and ``status`` are not in it.
        """
        names = None if columns is None else list(columns)
        frames = {r: self.run(r).to_pandas(names) for r in range(len(self))}
        import pandas as pd

        return pd.concat(frames, names=["run", "row"])


@dataclass(frozen=True, repr=False, eq=False)
class SmoothResult(RunResult):
    """What ``smooth`` returns: what the filter did, and what is known of each row afterwards.

    The columns of :class:`RunResult`, and those of the smoother. Without a lag ``smoothed_P`` is
    at most ``P``, but before a recovery from lock-out, where ``P`` was too small.

    Attributes
    ----------
    smoothed_x : ndarray, shape (T, n)
        Estimates with all later measurements, or those within the lag.
    smoothed_P : ndarray, shape (T, n, n)
        Their covariances [``covariance=True``].
    """

    smoothed_x: Floats
    smoothed_P: Floats
