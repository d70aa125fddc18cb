"""Tasks on the workers of a Dask cluster (``auvest[dask]``).

Every worker is asked what it is before it gets a task, those too that come later. Tasks are handed
out a few at a time to each, so that one that is lost with its worker is soon given to another.
"""

from __future__ import annotations

import asyncio
import math
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, suppress
from typing import Any

from auvest._texts import listed
from auvest.commands.version import version
from auvest.errors import SweepError
from auvest.montecarlo import Columns
from auvest.sweeps.plan import Task
from auvest.sweeps.processes import ATTEMPTS, rows_of
from auvest.sweeps.worker import attempt, report

#: Tasks on their way to each thread of a worker: one that runs and one that waits.
_AHEAD = 2
#: How often it is looked which workers there are, s.
_LOOK_S = 1.0
#: Rows that are done are on their way for so long at most, s.
_FETCH_S = 10.0
#: So long it is waited for a worker, s; the second where others were refused.
_PATIENCE_S, _PATIENCE_REFUSED_S = 60.0, 5.0


class Dask:
    """Does tasks on the workers of a cluster.

    Parameters
    ----------
    scheduler : str or distributed.Client
        Address, as ``tcp://host:8786``, or a client that is connected.
    warn : callable, optional
        Called with a sentence for each worker that is refused; default: :func:`warnings.warn`.

    Attributes
    ----------
    refused : dict of str to str
        Workers that got no task, by their addresses: what is wrong with each.
    """

    def __init__(self, scheduler: Any, *, warn: Callable[[str], object] = warnings.warn) -> None:
        self._scheduler = scheduler
        self._warn = warn
        self.refused: dict[str, str] = {}

    def __call__(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Columns]]:
        """Do tasks; give each with its rows when it is done.

        Raises
        ------
        SweepError
            If there is no cluster, it goes away, no worker may compute, or a task fails.
        """
        try:
            from distributed import Client
        except ImportError:
            raise SweepError(
                "a scheduler needs Dask, which is not installed: pip install 'auvest[dask]'"
            ) from None
        with ExitStack() as stack:
            client = self._scheduler
            if not isinstance(client, Client):
                try:
                    client = stack.enter_context(Client(self._scheduler, timeout=20))
                except (OSError, ValueError, asyncio.TimeoutError) as error:
                    raise SweepError(f"no scheduler at {self._scheduler}: {error}") from None
            try:
                yield from _Run(client, self.refused, self._warn).rows(tasks)
            except (OSError, CancelledError) as error:  # what becomes of tasks without a scheduler
                raise SweepError(f"the scheduler is gone: {error}") from None


class _Run:
    """Tasks on their way through a cluster."""

    def __init__(self, client: Any, refused: dict[str, str], warn: Callable[[str], object]) -> None:
        self._client = client
        self._refused = refused
        self._warn = warn
        self._threads: dict[str, int] = {}  # of the workers that may compute
        self._todo: list[Task] = []
        self._sent: dict[Any, tuple[Task, str]] = {}
        self._losses: dict[str, int] = {}

    def rows(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Columns]]:
        """Do tasks; give each with its rows when it is done."""
        from distributed import wait

        self._todo = list(reversed(tasks))
        looked = idle = -math.inf
        try:
            while self._todo or self._sent:
                if time.monotonic() - looked >= _LOOK_S:
                    self._look()
                    looked = time.monotonic()
                self._send()
                if not self._sent:
                    idle = looked if idle == -math.inf else idle
                    self._require_patience(looked - idle)
                    time.sleep(_LOOK_S)
                    continue
                idle = -math.inf
                try:
                    ready = wait(list(self._sent), timeout=_LOOK_S, return_when="FIRST_COMPLETED")
                except asyncio.TimeoutError:
                    continue
                for future in ready.done:
                    task, worker = self._sent.pop(future)
                    if future.status != "finished":
                        why = future.exception() if future.status == "error" else future.status
                        self._lose(task, str(why))
                        continue
                    try:
                        answer = future.result(timeout=_FETCH_S)
                    except asyncio.TimeoutError:
                        self._sent[future] = (task, worker)  # lost with its worker, or slow
                        continue
                    yield task, rows_of(task, answer)
        finally:
            with suppress(OSError):
                self._client.cancel(list(self._sent), force=True)

    def _look(self) -> None:
        """See which workers there are, ask the new ones, take back what the lost ones had."""
        there = self._workers()
        self._threads = {name: n for name, n in self._threads.items() if name in there}
        gone = [f for f, (_, worker) in self._sent.items() if worker not in self._threads]
        if gone:
            self._client.cancel(gone, force=True)
        for future in gone:
            self._lose(self._sent.pop(future)[0], "the worker is gone")
        for name in there:
            if name in self._threads or name in self._refused:
                continue
            try:
                found = self._client.run(report, workers=[name])[name]
            except Exception as error:  # it has no auvest, or one without sweeps; or it is gone
                if name not in self._workers():
                    continue
                self._refuse(name, f"gives no answer ({error})")
                continue
            if found == version():
                self._threads[name] = there[name]["nthreads"]
            else:
                self._refuse(name, f"has auvest {found}")

    def _refuse(self, name: str, why: str) -> None:
        self._refused[name] = why
        self._warn(f"worker {name} is refused: it {why}; auvest {version()} is needed")

    def _workers(self) -> dict[str, Any]:
        workers: dict[str, Any] = self._client.sync(self._client.scheduler.identity)["workers"]
        return workers

    def _lose(self, task: Task, why: str) -> None:
        """Take a task back, unless it has taken too many workers with it."""
        self._losses[task.key] = self._losses.get(task.key, 0) + 1
        if self._losses[task.key] == ATTEMPTS:
            raise SweepError(f"{ATTEMPTS} workers could not do {listed(task.parameters)}: {why}")
        self._todo.append(task)

    def _require_patience(self, idle_s: float) -> None:
        """End if no worker has come for too long; where some were refused none may be meant to."""
        if idle_s >= (_PATIENCE_REFUSED_S if self._refused else _PATIENCE_S):
            reasons = "; ".join(f"{name} {why}" for name, why in self._refused.items())
            raise SweepError(
                f"no worker of the cluster can be used; auvest {version()} is needed: {reasons}"
                if reasons
                else "the cluster has no worker"
            )

    def _send(self) -> None:
        """Give tasks to the workers that have the fewest."""
        load = dict.fromkeys(self._threads, 0)
        for _, worker in self._sent.values():
            load[worker] += 1
        for depth in range(1, _AHEAD + 1):
            for worker, threads in self._threads.items():
                while self._todo and load[worker] < threads * depth:
                    task = self._todo.pop()
                    # pure=False: a task that was lost is another one for the scheduler.
                    future = self._client.submit(attempt, task, workers=[worker], pure=False)
                    self._sent[future] = (task, worker)
                    load[worker] += 1
