"""The same sweep in every way there is to compute it, and what Dask costs.

``python -m tests.sweeps`` does 64 points of 6,000 runs seven times, some minutes on two cores; the
tests do it small. All ways must give the same digest of all rows.
"""

from __future__ import annotations

import argparse
import logging
import os
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

import auvest
from auvest.montecarlo import Interrupted
from auvest.sweeps import dask, read_plan
from auvest.sweeps.plan import Task
from auvest.sweeps.processes import Processes
from auvest.sweeps.run import PARTS

Settings = Mapping[str, Any]

#: 64 points of 6,000 runs.
LONG: Settings = {
    "sweep": {"scenario": "tracking", "runs": 6000, "runs_per_task": 2000},
    "fixed": {"filter.kind": "aukf", "steps": 60},
    "grid": {
        "filter.alpha": [1e-6, 1e-3, 0.1, 1.0],
        "noise.range_m": [0.02, 0.05, 0.1, 0.2],
        "noise.dropout": [0.0, 0.2],
        "interval.tau0": [0.1, 0.5],
    },
}

#: Twelve tasks, whatever they do.
TWELVE: Settings = {
    "sweep": {"scenario": "tracking", "runs": 6, "runs_per_task": 1},
    "grid": {"noise.dropout": [0.0, 0.2]},
}
_TASK_S = 5.0


@contextmanager
def cluster(workers: int = 2) -> Iterator[Any]:
    """Give a client of a Dask cluster on this machine, whose workers are processes."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as made,
        Client(made) as client,
    ):
        yield client


def after(tasks: int, act: Callable[[], object]) -> Callable[[int, int], None]:
    """Give a progress callback that acts once, when so many tasks are done."""
    acted = []

    def progress(done: int, _total: int) -> None:
        if done >= tasks and not acted:
            acted.append(True)
            act()

    return progress


def interrupt() -> None:
    """Do as Ctrl-C does."""
    raise KeyboardInterrupt


def serially(settings: Settings, folder: Path) -> Any:
    """Compute in this process."""
    return auvest.sweep(settings, output=folder, workers=1)


def in_processes(settings: Settings, folder: Path) -> Any:
    """Compute in two processes."""
    return auvest.sweep(settings, output=folder, workers=2)


def with_a_process_killed(settings: Settings, folder: Path) -> Any:
    """Compute in two processes, of which one is killed on the way."""
    executor = Processes(2)
    kill = after(3, lambda: os.kill(executor.pids[0], signal.SIGKILL))
    return auvest.sweep(settings, output=folder, executor=executor, progress=kill)


def stopped_and_resumed(settings: Settings, folder: Path) -> Any:
    """Stop after a third of the tasks, and go on."""
    try:
        whole = read_plan(settings).tasks
        auvest.sweep(settings, output=folder, workers=2, progress=after(len(whole) // 3, interrupt))
    except Interrupted as stop:
        done = stop.partial.computed
        result = auvest.sweep(settings, output=folder, workers=1)
        assert done == len(whole) // 3, done
        assert result.computed == len(whole) - done, result.computed
        return result
    raise AssertionError("it was not stopped")


def in_three_parts(settings: Settings, folder: Path) -> Any:
    """Compute three parts in folders of their own, and copy them together."""
    merged = folder / "merged"
    auvest.sweep(settings, output=merged, part=(1, 3), workers=1)
    for number in (2, 3):
        own = folder / str(number)
        auvest.sweep(settings, output=own, part=(number, 3), workers=1)
        shutil.copytree(own / PARTS, merged / PARTS, dirs_exist_ok=True)
    result = auvest.sweep(settings, output=merged, workers=1)
    assert result.computed == 0, result.computed
    return result


def on_dask(settings: Settings, folder: Path, client: Any) -> Any:
    """Compute on a cluster."""
    return auvest.sweep(settings, output=folder, scheduler=client)


def on_dask_with_a_worker_killed(settings: Settings, folder: Path, client: Any) -> Any:
    """Compute on a cluster, of which one worker is killed on the way."""
    pids = list(client.run(os.getpid).values())
    kill = after(3, lambda: os.kill(pids[0], signal.SIGKILL))
    return auvest.sweep(settings, output=folder, executor=dask.Dask(client), progress=kill)


HERE = (serially, in_processes, with_a_process_killed, stopped_and_resumed, in_three_parts)
ON_DASK = (on_dask, on_dask_with_a_worker_killed)


def processor_s() -> float:
    """Give the time of processors that this process and those it has waited for have used, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _measured(way: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    start = time.perf_counter()
    result = way(*arguments)
    return result, time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--overhead", action="store_true", help="only what Dask costs")
    only_overhead = parser.parse_args().overhead
    if not only_overhead:
        every_way()
    print(overhead())


def every_way() -> None:
    """Compute the long sweep in every way, and print what each took."""
    digests = set()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for way in (*HERE, *ON_DASK):
            with cluster() if way in ON_DASK else nullcontext() as client:
                more = () if client is None else (client,)
                result, took = _measured(way, LONG, folder / way.__name__, *more)
            digests.add(result.digest())
            print(f"{way.__name__}: {took:.1f} s, {result.digest()}", flush=True)
    print("the same digest" if len(digests) == 1 else "DIGESTS DIFFER")


def _sleep(task: Task) -> Any:
    time.sleep(_TASK_S)
    return {"value": np.zeros(task.count)}


def overhead() -> str:
    """Measure what Dask takes for itself, beside tasks that only wait.

    So it is measured on a machine that is busy with other things too: computing would take longer
    there on two workers than on one.
    """
    start = processor_s()
    with cluster():
        pass
    empty = processor_s() - start
    dask.attempt = _sleep  # type: ignore[assignment]
    tasks = read_plan(TWELVE).tasks
    start = processor_s()
    with cluster() as client:
        begin = time.perf_counter()
        done = len(list(dask.Dask(client)(tasks)))
        took = time.perf_counter() - begin
    used = processor_s() - start - empty
    whole = done * _TASK_S
    return (
        f"{done} tasks of {_TASK_S:g} s on two workers: {took:.1f} s where {whole / 2:g} s is the "
        f"least; {used:.1f} s of processor time beside those of the tasks, "
        f"{100 * used / whole:.1f} % (and {empty:.1f} s to start and end a cluster)"
    )


if __name__ == "__main__":
    main()
