"""What `auvest hil` plays: a filter in float32, and the rows of a record that it is given.

A row is a prediction and at most one measurement. :func:`record_of_replay` takes the rows that
``auvest replay`` gives to the filter; :class:`Record` may also be made by hand, of any filter
with models of the registry. ``on_desk`` gives the bits that every chip must find.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._core import Status
from auvest._state import describe
from auvest.errors import FilterError
from auvest.filters import GaussianFilter
from auvest.models import MeasurementModel
from auvest.replay.engine import Replay

Words = npt.NDArray[np.uint32]
_Numbers = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Record:
    """A filter at its start, and rows for it: T rows, m numbers in the largest measurement.

    Attributes
    ----------
    filter : GaussianFilter
        In float32, as it is before the first row; never changed.
    sensors : tuple of MeasurementModel
        What measures.
    sensor : ndarray of int, shape (T,)
        Which of them, in each row.
    dt : ndarray, shape (T,)
        Time that the row predicts over, s.
    z : ndarray, shape (T, m)
        Measurements; NaN throughout where there is none, and behind those of smaller sensors.
    input : ndarray, shape (T, k)
        What drives the process; k is 0 where nothing does.
    place : ndarray, shape (T, p)
        What ``sensor.place`` names, then; NaN: as the model has it. p is 0 where all are.
    age : ndarray, shape (T,), optional
        How long before the row it was measured, s, where the filter has ``late_s``; default: 0.
    """

    filter: GaussianFilter
    sensors: tuple[MeasurementModel, ...]
    sensor: npt.NDArray[np.int_]
    dt: _Numbers
    z: _Numbers
    input: _Numbers
    place: _Numbers
    age: _Numbers | None = None

    def __post_init__(self) -> None:
        filter_ = self.filter
        if filter_.dtype != np.float32:
            raise ValueError(f"the filter must be in float32, not in {filter_.dtype}")
        columns: list[npt.NDArray[Any]] = [self.sensor, self.dt, self.z, self.input, self.place]
        if self.age is not None:
            columns.append(self.age)
            if filter_.late_s == 0:
                raise ValueError("age is for a filter with late_s")
        if len({len(column) for column in columns}) != 1:
            raise ValueError(
                "sensor, dt, z, input, place and age must have the same number of rows"
            )
        places = self.place if self.place.shape[1] else None
        filter_._require_standing(self.z, places, list(self.sensors), self.sensor)

    def __len__(self) -> int:
        return len(self.dt)

    @property
    def measured(self) -> npt.NDArray[np.bool_]:
        """Whether each row has a measurement."""
        return np.asarray(~np.isnan(self.z).all(axis=1))

    @property
    def start(self) -> Words:
        """The words of row 0: x0 and the lower triangle of P0."""
        x = self.filter.x
        return bits(np.concatenate([x, self.filter.P[np.tril_indices(len(x))]]))

    @property
    def fields(self) -> list[str]:
        """Names of the numbers after each row; the first is no float."""
        state = self.filter.process.state
        names = ["status", *(f"x[{name}]" for name in state)]
        names += [f"P[{a}, {b}]" for i, a in enumerate(state) for b in state[: i + 1]]
        names.append("nis")
        if self.filter.kernel is not None:
            names += [f"weight[{i}]" for i in range(self.z.shape[1])]
        if self.filter.components > 1:
            names += ["components", "convergence"]
        return [*names, "interval"] if self.filter.policy is not None else names

    def on_desk(self) -> Words:
        """Give the bits after the start and after each row, shape (T + 1, fields)."""
        filter_ = in_float32(self.filter)
        lower = np.tril_indices(len(filter_.x))
        weights = np.full(self.z.shape[1] if filter_.kernel is not None else 0, np.nan, np.float32)
        measured = self.measured
        placed = place_given(self)
        places = [len(place_names(model)) for model in self.sensors]
        lines = []
        for k in range(-1, len(self)):
            said, nis, weight = int(Status.ok), np.nan, weights.copy()
            if k >= 0:
                model = self.sensors[self.sensor[k]]
                size = len(model.measures)
                try:
                    filter_.predict(
                        float(self.dt[k]), self.input[k] if self.input.shape[1] else None
                    )
                    if measured[k]:
                        place = self.place[k, : places[self.sensor[k]]] if placed[k] else None
                        age = None if self.age is None else float(self.age[k])
                        filter_.update(self.z[k, :size], model, place=place, age_s=age)
                        report = filter_.report
                        assert report is not None
                        nis = report.nis
                        weight[:size] = report.weight[: len(weight)]
                        said |= int(report.decision) << 8 | int(report.near_field) << 16
                        said |= int(report.recovered) << 24
                    if filter_.policy is not None:
                        filter_.feedback()
                except FilterError as error:
                    said |= int(error.status)
            numbers = [filter_.x, filter_.P[lower], np.array([nis]), weight]
            if filter_.components > 1:
                numbers.append(np.array([len(filter_.mixture.weight), filter_.convergence]))
            if filter_.policy is not None:
                numbers.append(np.array([filter_.interval]))
            floats = bits(np.concatenate(numbers).astype(np.float32))
            lines.append(np.concatenate([np.array([said], np.uint32), floats]))
        return np.array(lines)


def record_of_replay(replay: Replay, most: int | None) -> Record:
    """Take the rows that a replay gives to its filter, so many at most.

    Raises
    ------
    ValueError
        If there are none.
    """
    heard = _Heard(most)
    replay.listener = heard
    for _ in replay.batches():
        if heard.enough:
            break
    return heard.record()


class _Heard:
    """Collects the rows that a replay gives to its filter."""

    def __init__(self, most: int | None) -> None:
        self._most = most
        self._start: GaussianFilter | None = None
        self._sensors: dict[str, MeasurementModel] = {}
        self._parts: list[tuple[Any, ...]] = []
        self._count = 0

    @property
    def enough(self) -> bool:
        return self._most is not None and self._count >= self._most

    def __call__(
        self, filter_: GaussianFilter, z: npt.NDArray[Any], rows: Mapping[str, Any]
    ) -> None:
        if self._start is None:
            self._start = in_float32(filter_)
        given = rows.get("sensor") or next(iter(filter_.sensors.values()))
        models = given if isinstance(given, list) else [given] * len(z)
        numbers = {id(model): self._number(model) for model in models}
        which = np.array([numbers[id(model)] for model in models], int)
        z = np.reshape(z, (len(z), -1))
        driven = rows.get("input", np.empty((len(z), 0)))
        place = rows.get("place", np.empty((len(z), 0)))
        age = rows.get("age_s", np.zeros(len(z)))
        self._parts.append((which, rows["dt"], z, driven, place, age))
        self._count += len(z)

    def _number(self, model: MeasurementModel) -> int:
        """Give the number of a model, the same for equal ones."""
        key = json.dumps(describe(model))
        self._sensors.setdefault(key, model)
        return list(self._sensors).index(key)

    def record(self) -> Record:
        if self._start is None:
            raise ValueError("the log has no row for a filter")
        which, *columns = (_joined(part) for part in zip(*self._parts, strict=True))
        dt, z, driven, place, age = (c[: self._most].astype(np.float32) for c in columns)
        return Record(
            filter=self._start,
            sensors=tuple(self._sensors.values()),
            sensor=which[: self._most],
            dt=dt,
            z=z,
            input=driven,
            place=place,
            age=age if self._start.late_s > 0 else None,
        )


def _joined(parts: Sequence[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Put rows after each other; NaN behind those of sensors with fewer numbers."""
    if parts[0].ndim == 1:
        return np.concatenate(parts)
    width = max(part.shape[1] for part in parts)
    filled = (
        np.pad(part, ((0, 0), (0, width - part.shape[1])), constant_values=np.nan) for part in parts
    )
    return np.concatenate(list(filled))


def in_float32(filter_: GaussianFilter) -> GaussianFilter:
    """Give a filter like this one, at its estimate, in the precision of the chip."""
    options: dict[str, Any] = {**filter_._options, **filter_._parameters}
    if filter_.policy is not None:
        options["policy"] = filter_.policy
    return type(filter_)(
        filter_.x,
        filter_.P,
        process=filter_.process,
        sensors=filter_.sensors,
        dtype="float32",
        components=filter_.components,
        headings=filter_.headings,
        kernel=filter_.kernel,
        recovery=filter_.recovery,
        **options,
    )


def place_given(record: Record) -> npt.NDArray[np.bool_]:
    """Whether each row says where its sensor stood."""
    if record.place.shape[1] == 0:
        return np.zeros(len(record), bool)
    return record.measured & ~np.isnan(record.place[:, 0])


def place_names(model: MeasurementModel) -> list[str]:
    """Give the names in the core of what ``model.place`` names, in its order."""
    if model.place is None:
        return []
    now = getattr(model.standing(), model.place)
    other = tuple(value + 1 for value in now) if isinstance(now, Sequence) else now + 1
    moved: Any = replace(model, **{model.place: other})  # type: ignore[type-var]
    before, after = model._core_params(), moved._core_params()
    return [name for name in model._core_defaults() if before[name] != after[name]]


def bits(numbers: npt.ArrayLike) -> Words:
    """Give the bits of floats."""
    return np.ascontiguousarray(numbers, np.float32).view(np.uint32)
