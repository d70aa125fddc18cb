"""The way back over a replay: what each estimate gains by what came later.

The forward pass leaves its batches on disk, and with each the rows that the filter took. From the
end of the log every batch is smoothed from the filter as it was at its start, and then all are
given in their order again: so a day's log takes the memory of a stretch.
"""

from __future__ import annotations

import copy
import pickle
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest.filters import GaussianFilter
from auvest.filters._base import lookahead, rows_of
from auvest.logs.reader import Rows
from auvest.replay import tables
from auvest.replay.tables import Batch, Columns

if TYPE_CHECKING:
    from typing_extensions import Self

#: Headings and their standard deviations, rad, of states and covariances.
Heading: TypeAlias = Callable[[Floats, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Track:
    """How the states of a batch lie in its rows, and what becomes of states in its tables.

    Attributes
    ----------
    final : ndarray of int, shape (K,)
        The rows after which an estimate was written.
    at : ndarray, shape (K + 1,)
        Times of the estimate before and of these, s.
    before : (ndarray, ndarray)
        State and covariance before the first row.
    truth : ndarray, shape (L, 3+)
        Time, x and y of the truth within the batch.
    carry : callable
        Positions at times, from the states at others: ``carry(states, at, time_s)``.
    heading : callable
        See :data:`Heading`.
    """

    final: npt.NDArray[np.intp]
    at: Floats
    before: tuple[Floats, Floats]
    truth: Rows
    carry: Callable[[Floats, Floats, Rows], Floats]
    heading: Heading


class Smoothing:
    """Keeps a replay's batches until they are smoothed; a context.

    Parameters
    ----------
    folder : Path, optional
        Where the batches are in between; default: where the system has temporary files.
    lag_s : float, optional
        As for :meth:`GaussianFilter.smooth`.
    """

    def __init__(self, folder: Path | None, lag_s: float | None) -> None:
        self._directory = tempfile.TemporaryDirectory(prefix=".smoothing-", dir=folder)
        self._folder = Path(self._directory.name)
        self._lag_s = lag_s
        # Of each batch the filter before its rows, and the core's sensors.
        self._filters: list[GaussianFilter | None] = []
        self._sensors: list[list[Any]] = []
        self._filter: GaussianFilter | None = None
        self._parts: list[tuple[dict[str, Any], list[Any]]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._directory.cleanup()

    def rows(self, filter_: GaussianFilter, z: Rows, rows: Mapping[str, Any]) -> None:
        """Note rows that the filter is about to take."""
        if not self._parts:
            self._filter = copy.copy(filter_)
        names = ("dt", "input", "sensor", "place", "age_s")
        dt, driven, sensor, place, age_s = map(rows.get, names)
        self._parts.append(filter_._as_record(z, dt, driven, sensor, place, age_s, None))

    def add(self, batch: Batch) -> None:
        """Take a batch, made of the rows noted since the one before."""
        record, sensors = _joined(self._parts)
        self._save("batch", len(self._filters), (batch, record))
        self._filters.append(self._filter if self._parts else None)
        self._sensors.append(sensors)
        self._parts = []

    def drop(self) -> None:
        """Forget rows of a batch that was not finished."""
        self._parts = []

    def batches(self) -> Iterator[Batch]:
        """Go back over all, and give the batches in their order with what was smoothed."""
        start = self._go_back()
        for k in range(len(self._filters)):
            batch, _ = self._load("batch", k)
            track: Track | None = batch.track
            if track is None:
                yield _unsmoothed(batch)
                continue
            x, P = self._load("smoothed", k)
            if start is None:
                start = track.before
            yield _with(batch, track, np.concatenate([start[0], x]), np.concatenate([start[1], P]))
            start = (x[-1:], P[-1:]) if len(x) else start

    def _go_back(self) -> tuple[Floats, Floats] | None:
        """Smooth the batches from the last to the first; give the belief at the start."""
        known: Any = None
        ahead: tuple[dict[str, Any], list[Any]] | None = None  # the rows behind a batch, if asked
        for k in reversed(range(len(self._filters))):
            batch, record = self._load("batch", k)
            filter_ = self._filters[k]
            if filter_ is None:
                track = batch.track
                if track is not None:
                    self._save("smoothed", k, (track.before[0][:0], track.before[1][:0]))
                continue
            count = len(record["z"])
            rows, sensors = record, self._sensors[k]
            if ahead is not None:
                rows, sensors = _joined([(rows, sensors), ahead])
            x, P, known = filter_._back(filter_._filter, rows, sensors, count, known, self._lag_s)
            final = batch.track.final
            self._save("smoothed", k, (x[final].astype(float), P[final].astype(float)))
            reach = lookahead(rows, filter_.late_s, self._lag_s)(0)
            ahead = (rows_of(rows, 0, reach), sensors) if reach > 0 else None
        if known is None or self._lag_s is not None:
            return None
        return known[0][None].astype(float), known[1][None].astype(float)

    def _save(self, name: str, k: int, content: Any) -> None:
        with (self._folder / f"{name}-{k}").open("wb") as file:
            pickle.dump(content, file, protocol=pickle.HIGHEST_PROTOCOL)

    def _load(self, name: str, k: int) -> Any:
        with (self._folder / f"{name}-{k}").open("rb") as file:
            return pickle.load(file)


def _joined(parts: list[tuple[dict[str, Any], list[Any]]]) -> tuple[dict[str, Any], list[Any]]:
    """Make one record of several, each with its sensors."""
    if not parts:
        return {}, []
    columns: dict[str, list[Any]] = {name: [] for name in parts[0][0]}
    every: dict[int, Any] = {}
    for record, sensors in parts:
        which = record["sensor"]
        if which is None:
            which = np.zeros(len(record["z"]), np.int32)
        for name, column in record.items():
            columns[name].append(column)
        own = np.zeros(len(sensors), np.int32)
        for k in np.unique(which).tolist():
            every.setdefault(id(sensors[k]), sensors[k])
            own[k] = list(every).index(id(sensors[k]))
        columns["sensor"][-1] = own[which]
    counts = [len(record["z"]) for record, _ in parts]
    whole = {name: _whole(some, counts, _FILL.get(name)) for name, some in columns.items()}
    return whole, list(every.values())


#: What stands in a column of a record where a part of it has none, or fewer numbers.
_FILL = {"z": np.nan, "place": np.nan, "age_s": 0.0}


def _whole(
    parts: list[npt.NDArray[Any] | None], counts: list[int], fill: float | None
) -> npt.NDArray[Any] | None:
    """Make one column of several."""
    there = [part for part in parts if part is not None]
    if not there:
        return None
    if fill is None:
        return np.concatenate(there)
    width = max(part.shape[1:] for part in there)
    whole = np.full((sum(counts), *width), fill, there[0].dtype)
    for part, count, end in zip(parts, counts, np.cumsum(counts), strict=True):
        if part is not None:
            whole[(slice(end - count, end), *map(slice, part.shape[1:]))] = part
    return whole


def _with(batch: Batch, track: Track, states: Floats, covariances: Floats) -> Batch:
    """Add the columns of the smoothed states, the first of which is before the batch."""
    where = np.searchsorted(track.at, track.truth[:, 0], side="right") - 1
    error = track.carry(states, track.at, track.truth[:, 0]) - track.truth[:, 1:3]
    errors = {
        "error_x_m": error[:, 0],
        "error_y_m": error[:, 1],
        "sigma_x_m": np.sqrt(covariances[where, 0, 0]),
        "sigma_y_m": np.sqrt(covariances[where, 1, 1]),
    }
    pose = tables.pose(states[1:], covariances[1:], *track.heading(states[1:], covariances[1:]))
    return _wider(batch, pose, errors)


def _unsmoothed(batch: Batch) -> Batch:
    """Add empty columns to a batch before the filter ran."""
    nothing = np.empty(0)
    return _wider(
        batch,
        dict.fromkeys(tables.POSE, nothing),
        dict.fromkeys((name.removeprefix("smoothed_") for name in tables.SMOOTHED_ERRORS), nothing),
    )


def _wider(batch: Batch, pose: Columns, errors: Columns) -> Batch:
    return replace(
        batch,
        track=None,
        estimates={**batch.estimates, **{f"smoothed_{k}": v for k, v in pose.items()}},
        errors={**batch.errors, **{f"smoothed_{k}": v for k, v in errors.items()}},
    )
