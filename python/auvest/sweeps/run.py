"""The sweep itself: what is not there is computed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from auvest import montecarlo
from auvest._arguments import as_workers
from auvest._outputs import shared_folder
from auvest.errors import Interrupted
from auvest.montecarlo import Columns
from auvest.sweeps.dask import Dask
from auvest.sweeps.parts import Parts
from auvest.sweeps.plan import Plan, Task, read_plan
from auvest.sweeps.processes import Processes, serially
from auvest.sweeps.result import SweepResult

#: Does tasks in any order, and gives each with its rows when it is done.
Executor: TypeAlias = Callable[[Sequence[Task]], Iterator[tuple[Task, Columns]]]

#: Folder of the parts in that of a sweep.
PARTS = "parts"


def sweep(
    config: Path | str | Mapping[str, Any],
    *,
    output: Path | str | None = None,
    workers: int | None = None,
    part: tuple[int, int] | None = None,
    scheduler: Any = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult:
    """Compute what is not yet there of a grid or list of parameters.

    Parameters
    ----------
    config : path or mapping
        Settings: a TOML file, or what would be in it (docs/sweeps.md).
    output : path, optional
        Folder in which every finished task is kept, as a Parquet file in ``parts``; tasks that are
        there are taken over, whoever computed them. Default: nothing is kept.
    workers : int, optional
        Processes on this machine, 1 to 256; default: one per processor. The rows do not depend on
        it.
    part : (int, int), optional
        ``(i, n)``: compute only the i-th of n parts of the tasks, i from 1; for an array of jobs
        that share a folder.
    scheduler : str or distributed.Client, optional
        Compute on the workers of this Dask cluster, as ``tcp://host:8786``. Workers of another
        version of auvest, or whose :func:`auvest.self_test` fails, get no task.
    executor : callable, optional
        What computes the tasks instead: takes a list of tasks, yields each with its rows.
    progress : callable, optional
        Called as ``progress(tasks_done, tasks)`` in the calling thread.

    Returns
    -------
    SweepResult
        Of all that is there, the other parts too.

    Raises
    ------
    ValueError, TypeError
        If the settings or an argument are wrong, or the folder holds something else.
    SweepError
        If a task fails, or there is no cluster; what was computed is kept.
    OSError
        If a part cannot be written.
    auvest.montecarlo.Interrupted
        After Ctrl-C; ``partial`` holds what is there as a SweepResult.

    Examples
    --------
    >>> import auvest
    >>> result = auvest.sweep(
    ...     {
    ...         "sweep": {"scenario": "tracking", "runs": 20},
    ...         "grid": {"noise.range_m": [0.05, 0.5], "filter.kind": ["ekf", "ukf"]},
    ...     },
    ...     workers=1,
    ... )
    >>> len(result.rows), len(result.rows[0]["rmse_m"])
    (4, 20)
    >>> mean, standard_error = result.values("rmse_m")
    >>> bool(mean[2] > mean[0])  # more noise, more error
    True
    """
    plan = read_plan(config)
    if scheduler is not None and workers is not None:
        raise ValueError("workers are those of the scheduler: give one of the two")
    run = executor or (Dask(scheduler) if scheduler is not None else _local(workers))
    mine = plan.tasks if part is None else plan.part(*part)
    kept = None
    if output is not None:
        shared_folder(Path(output), "sweep")
        kept = Parts(Path(output) / PARTS)
    there: dict[str, Columns] = {}
    todo: list[Task] = []
    for task in mine:
        old = None if kept is None else kept.read(task)
        if old is None:
            todo.append(task)
        else:
            there[task.key] = old
    computed = 0
    try:
        if progress is not None:
            progress(len(mine) - len(todo), len(mine))
        if todo:
            with closing(run(todo)) as answers:  # type: ignore[type-var]
                for task, columns in answers:
                    if kept is not None:
                        kept.write(task, columns)
                    there[task.key] = columns
                    computed += 1
                    if progress is not None:
                        progress(len(mine) - len(todo) + computed, len(mine))
    except KeyboardInterrupt:
        raise Interrupted(_result(plan, there, kept, computed)) from None
    return _result(plan, there, kept, computed)


def _local(workers: int | None) -> Executor:
    count = as_workers(workers)
    return serially if count == 1 else Processes(count)


def _result(
    plan: Plan, there: Mapping[str, Columns], kept: Parts | None, computed: int
) -> SweepResult:
    """Collect what is there, by this call or any other."""
    found: list[dict[int, Columns]] = [{} for _ in plan.points]
    missing = 0
    for task in plan.tasks:
        columns = there.get(task.key)
        if columns is None and kept is not None:
            columns = kept.read(task)
        if columns is None:
            missing += 1
            continue
        run = np.arange(task.first, task.first + task.count)
        found[task.point][task.first] = {"run": run, **columns}
    rows = [montecarlo.join(parts) if parts else {} for parts in found]
    return SweepResult(plan, rows, missing, computed)
