"""``run`` of many records: arguments, threads, and what the runs give. The runs are all C++.

A stack is checked as one long record; only where that is refused are its runs looked at one by one,
to say which of them it is.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from auvest import _core, montecarlo
from auvest._arguments import as_real
from auvest._core import Status
from auvest._texts import counted
from auvest.errors import FilterError, Interrupted
from auvest.filters.results import RunResult, RunsResult

if TYPE_CHECKING:
    from auvest.filters._base import GaussianFilter

#: Rows of a Gaussian sum that take less than half a second.
_SLOW_ROWS = 16384


def lanes() -> str:
    """Name the widest lanes in which filters run here."""
    return _core.slat_lanes(True)[-1]


def is_stack(z: object) -> bool:
    """Whether this is an array of three axes: many records."""
    return _axes(z) == 3


def run_many(
    filter: GaussianFilter,  # noqa: A002 (its name in this package)
    z: npt.ArrayLike,
    dt: npt.ArrayLike | None,
    input: npt.ArrayLike | None,
    sensor: Any,
    place: npt.ArrayLike | None,
    age_s: npt.ArrayLike | None,
    reference: npt.ArrayLike | None,
    *,
    covariance: bool,
    workers: int,
) -> RunsResult:
    """Do what ``run`` says of many records."""
    stack = as_real("z", z, (None, None, None))
    runs, rows = stack.shape[:2]
    if stack.size == 0:
        raise ValueError(f"z is empty: shape {stack.shape}, expected at least one run of one row")
    # name: how many axes the argument of one run has
    axes = {"dt": 1, "input": 2, "place": 2, "age_s": 1, "reference": 2}
    given = {"dt": dt, "input": input, "place": place, "age_s": age_s, "reference": reference}
    used, which = filter._sensors_used(sensor)
    handles = [filter._handle(one) for one in used]
    if which is not None and len(which) != rows:
        raise ValueError(
            f"sensor has {counted(len(which), 'row')} and each run of z has {rows}; they "
            "must have the same"
        )
    own = {name for name in given if _is_per_run(name, given[name], axes[name], runs)}

    def of_run(r: int) -> dict[str, Any]:
        return {name: value[r] if name in own else value for name, value in given.items()}  # type: ignore[index]

    if filter._slow:  # threads would wait for each other
        single = [_alone(filter, stack[r], sensor, of_run(r), covariance) for r in range(runs)]
        return _stacked(single, rows)
    try:
        flat = filter._as_columns(
            stack.reshape(runs * rows, -1),
            used=used,
            handles=handles,
            which=None if which is None else np.tile(which, runs),
            **{name: _flat(given[name], runs, name in own) for name in given},
        )
    except (ValueError, TypeError):
        for r in range(runs):
            try:
                filter._as_columns(stack[r], used=used, handles=handles, which=which, **of_run(r))
            except (ValueError, TypeError) as error:
                raise type(error)(f"run {r}: {error}") from None
        raise
    record: dict[str, Any] = {
        name: None if column is None else column.reshape(runs, rows, *column.shape[1:])
        for name, column in flat.items()
        if name != "sensor"
    }
    driven = record["input"]
    filter._look_for_degrees(record["z"][0], None if driven is None else driven[0], used, which)
    shared = {"sensor": None if which is None else which[np.newaxis]}
    columns = _columns(filter, record["z"], covariance=covariance)
    width = lanes()

    with filter._taken() as core:

        def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
            mine = slice(first, first + count)
            done, _, status = _core.run_each(
                core, {**_of(record, mine), **shared}, handles, _of(columns, mine), width
            )
            return {"run": np.arange(first, first + count), "rows": done, "status": status}

        several = filter.components > 1
        chunk = montecarlo.chunk_for(runs, rows, workers, side_by_side=not several)
        if several:
            chunk = max(1, min(chunk, _SLOW_ROWS // rows))
        try:
            ends = montecarlo.run(part, runs, chunk=chunk, workers=workers)
        except montecarlo.Interrupted as stop:
            done = (
                None if stop.partial is None else _result(filter, columns, stop.partial, covariance)
            )
            raise Interrupted(done) from None
    return _result(filter, columns, ends, covariance)


def _axes(value: object) -> int:
    """Count the axes of what may become an array; 0 if it cannot, which is refused elsewhere."""
    try:
        return np.ndim(value)  # type: ignore[arg-type]
    except ValueError:  # rows of different lengths
        return 0


def _is_per_run(name: str, value: Any, axes: int, runs: int) -> bool:
    """Whether an argument has an axis for the runs in front."""
    if value is None or _axes(value) != axes + 1:
        return False
    if len(value) != runs:
        raise ValueError(
            f"{name} has {counted(len(value), 'run')} and z has {runs}; they must have the same"
        )
    return True


def _flat(value: Any, runs: int, own: bool) -> Any:
    """Give an argument of all runs, one behind the other."""
    if value is None or _axes(value) == 0:  # one number for all rows
        return value
    array = np.asarray(value)
    if own:
        return array.reshape(-1, *array.shape[2:])
    return np.tile(array, (runs, *(1,) * (array.ndim - 1)))


def _of(arrays: Mapping[str, Any], runs: slice) -> dict[str, Any]:
    return {name: None if array is None else array[runs] for name, array in arrays.items()}


def _columns(filter: GaussianFilter, z: Any, *, covariance: bool) -> dict[str, Any]:  # noqa: A002
    """Make room for what the runs tell."""
    runs, rows, m = z.shape
    n = len(filter.process.state)
    number = filter.dtype
    shapes: dict[str, tuple[tuple[int, ...], npt.DTypeLike]] = {
        "x": ((n,), number),
        "P": ((n, n), number),
        "innovation": ((m,), number),
        "S": ((m, m), number),
        "nis": ((), number),
        "near_field": ((), np.bool_),
        "standardised": ((m,), number),
        "weight": ((m,), number),
        "decision": ((), np.uint8),
        "iterations": ((), np.uint8),
        "recovered": ((), np.bool_),
        "interval_s": ((), number),
        "too_late": ((), np.bool_),
        "convergence": ((), np.uint8),
        "mixture_size": ((), np.uint8),
    }
    absent = set() if covariance else {"P", "S"}
    if filter.components == 1:
        absent |= {"convergence", "mixture_size"}
    return {
        name: None if name in absent else np.empty((runs, rows, *shape), dtype)
        for name, (shape, dtype) in shapes.items()
    }


def _result(
    filter: GaussianFilter,  # noqa: A002
    columns: dict[str, Any],
    ends: Mapping[str, npt.NDArray[Any]],
    covariance: bool,
) -> RunsResult:
    """Give the runs that are done; nothing is known of the rows that they have not."""
    runs = ends["run"]
    some = {
        name: column if column is None or len(runs) == len(column) else column[runs]
        for name, column in columns.items()
    }
    for k in np.flatnonzero(ends["status"] != int(Status.ok)):
        for column in some.values():
            if column is not None:
                column[k, ends["rows"][k] :] = np.nan if column.dtype.kind == "f" else 0
    asked = filter._asked_for(some, len(runs), covariance=covariance)
    return RunsResult(**asked, rows=ends["rows"], status=ends["status"])


def _alone(
    filter: GaussianFilter,  # noqa: A002
    z: npt.NDArray[Any],
    sensor: Any,
    given: dict[str, Any],
    covariance: bool,
) -> tuple[RunResult, Status]:
    """Do one run of a filter that calls functions of Python; what these raise is raised."""
    try:
        return copy.copy(filter).run(z, sensor=sensor, covariance=covariance, **given), Status.ok
    except FilterError as error:
        if error.__cause__ is not None:
            raise
        partial: RunResult = error.partial
        return partial, error.status


def _stacked(single: list[tuple[RunResult, Status]], rows: int) -> RunsResult:
    """Put the results of single runs into one."""
    whole: dict[str, Any] = dict.fromkeys(RunResult.__dataclass_fields__)
    for name in single[0][0].columns:
        first = single[0][0][name]
        fill = np.nan if first.dtype.kind == "f" else 0
        whole[name] = np.full((len(single), rows, *first.shape[1:]), fill, first.dtype)
        for r, (result, _) in enumerate(single):
            whole[name][r, : len(result)] = result[name]
    return RunsResult(
        **whole,
        rows=np.array([len(result) for result, _ in single], np.int64),
        status=np.array([int(status) for _, status in single], np.uint8),
    )
