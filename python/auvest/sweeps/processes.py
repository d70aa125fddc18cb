"""Tasks on the cores of this machine, in processes.

Not :class:`concurrent.futures.ProcessPoolExecutor`: there a process that is killed takes all others
with it, and the caller's own program is run again in every one.
"""

from __future__ import annotations

import json
import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from typing import IO, cast

from auvest._texts import listed
from auvest.errors import SweepError
from auvest.montecarlo import Columns
from auvest.sweeps.plan import Task
from auvest.sweeps.worker import Failure, attempt

#: A task that has ended so many processes is given up.
ATTEMPTS = 3

_SERVE = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from auvest.sweeps.worker import serve; serve()"
)


def serially(tasks: Sequence[Task]) -> Iterator[tuple[Task, Columns]]:
    """Do tasks one by one, here."""
    for task in tasks:
        yield task, rows_of(task, attempt(task))


def rows_of(task: Task, answer: Columns | Failure) -> Columns:
    """Give the rows of an answer.

    Raises
    ------
    SweepError
        If it is none.
    """
    if isinstance(answer, Failure):
        raise SweepError(
            f"runs {task.first} to {task.first + task.count - 1} of {listed(task.parameters)}: "
            f"{answer.text}"
        )
    return answer


class Processes:
    """Does tasks in processes; each that dies is replaced, and its task done again.

    Parameters
    ----------
    workers : int
        How many processes.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._running: dict[int, subprocess.Popen[bytes]] = {}
        self._stopped = False

    @property
    def pids(self) -> list[int]:
        """Processes that are running."""
        return [process.pid for process in list(self._running.values())]

    def __call__(self, tasks: Sequence[Task]) -> Iterator[tuple[Task, Columns]]:
        """Do tasks; give each with its rows when it is done.

        Raises
        ------
        SweepError
            If a task fails, or has ended :data:`ATTEMPTS` processes.
        """
        todo: queue.SimpleQueue[Task] = queue.SimpleQueue()
        done: queue.SimpleQueue[tuple[Task, Columns | Failure]] = queue.SimpleQueue()
        for task in tasks:
            todo.put(task)
        self._stopped = False
        threads = [
            threading.Thread(target=self._serve, args=(number, todo, done), daemon=True)
            for number in range(min(self._workers, len(tasks)))
        ]
        for thread in threads:
            thread.start()
        try:
            for _ in tasks:
                task, answer = done.get()
                yield task, rows_of(task, answer)
        finally:
            self._stopped = True
            for process in list(self._running.values()):
                process.kill()
            for thread in threads:
                thread.join()

    def _serve(
        self,
        number: int,
        todo: queue.SimpleQueue[Task],
        done: queue.SimpleQueue[tuple[Task, Columns | Failure]],
    ) -> None:
        """Have a process do tasks until there are none."""
        try:
            while not self._stopped:
                try:
                    task = todo.get_nowait()
                except queue.Empty:
                    return
                done.put((task, self._answer(number, task)))
        finally:
            self._end(number)

    def _end(self, number: int) -> None:
        """End a process, if there is one, and its pipes."""
        process = self._running.pop(number, None)
        if process is not None:
            process.kill()
            process.communicate()

    def _answer(self, number: int, task: Task) -> Columns | Failure:
        for _ in range(ATTEMPTS):
            if self._stopped:
                break
            if number not in self._running:
                self._running[number] = _start()
            process = self._running[number]
            asked, told = cast(IO[bytes], process.stdin), cast(IO[bytes], process.stdout)
            try:
                pickle.dump(task, asked)
                asked.flush()
                answer: Columns | Failure = pickle.load(told)
                return answer
            except (EOFError, OSError, pickle.UnpicklingError):
                self._end(number)
        return Failure(f"its process has ended {ATTEMPTS} times without an answer")


def _start() -> subprocess.Popen[bytes]:
    # A process has one core: no library may start threads for the others.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", _SERVE, json.dumps(sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=environment,
    )
