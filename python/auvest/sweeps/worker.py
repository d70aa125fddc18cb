"""What computes tasks away from who asked for them, and whether it may.

Run by :mod:`auvest.sweeps.processes` as a process of its own, and called on Dask's workers.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import traceback
from dataclasses import dataclass

from auvest.montecarlo import Columns
from auvest.sweeps.plan import Task, run_task


@dataclass(frozen=True)
class Failure:
    """A task that could not be done: the exception, which may be none that can be sent."""

    text: str


def attempt(task: Task) -> Columns | Failure:
    """Do a task; what it raises is given in words."""
    try:
        return run_task(task)
    except ValueError as error:
        return Failure(str(error))
    except Exception:
        return Failure(traceback.format_exc())


def report() -> str:
    """Say what computes here: the version; with what is wrong behind it, if anything is."""
    from auvest._core import self_test
    from auvest.commands.version import version

    result = self_test()
    return version() if result.ok else f"{version()}, but its self-test fails ({result})"


def serve() -> None:
    """Do tasks from stdin, one by one, until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who has started this process
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get among the answers
    while True:
        try:
            task = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(attempt(task), answers)
        answers.flush()
