"""Ctrl-C at the right moment: nothing is left half done, and nobody waits for long."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Mapping
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from typing_extensions import Self

#: After the first slice of a record so many rows are done at once as take so long, s.
_SLICE_S = 0.05
#: A step of any filter of the core takes less than 20 us for up to so many particles.
_ROWS, _PARTICLES = 16384, 25

S = TypeVar("S")


class HeldInterrupts:
    """Ctrl-C that comes at a time when it would leave halves behind waits until that is over.

    ``with HeldInterrupts() as held:`` around a loop, and ``with held:`` around what must be done
    as a whole. Outside of the main thread, where no Ctrl-C arrives, it does nothing.
    """

    def __init__(self) -> None:
        self._entered = 0
        self._pending = False
        self._before: Callable[[int, FrameType | None], Any] | None = None

    def __enter__(self) -> Self:
        if not self._entered and threading.current_thread() is threading.main_thread():
            before = signal.getsignal(signal.SIGINT)
            if callable(before):  # else it is ignored, as under nohup, or not Python's
                self._before = before
                signal.signal(signal.SIGINT, self._arrived)
        self._entered += 1
        return self

    def __exit__(self, *_: object) -> None:
        self._entered -= 1
        if not self._entered and self._before is not None:
            signal.signal(signal.SIGINT, self._before)
            self._before = None
        if self._entered < 2 and self._pending:
            self._pending = False
            raise KeyboardInterrupt

    def take(self) -> bool:
        """Say whether Ctrl-C has come, and do not raise it any more."""
        pending, self._pending = self._pending, False
        return pending

    def _arrived(self, number: int, frame: FrameType | None) -> None:
        if self._entered > 1:
            self._pending = True
        elif self._before is not None:
            self._before(number, frame)


def first_slice(particles: int = 1) -> int:
    """Choose the rows of a first slice: most records are one slice, which needs no copy."""
    return max(1, _ROWS * _PARTICLES // max(_PARTICLES, particles))


def in_slices(
    rows: int, first_rows: int, work: Callable[[int, int], tuple[int, S, Mapping[str, Any]]], ok: S
) -> tuple[int, S, dict[str, Any], bool]:
    """Have a record done in slices short enough that Ctrl-C is answered within half a second.

    Parameters
    ----------
    rows : int
        Of the record.
    first_rows : int
        Of the first slice: what surely takes less than half a second.
    work : callable
        ``work(first, end)`` does these rows and gives how many it did, the status, and columns of
        at least as many rows; columns that were not asked for are
        empty or None; a filter goes on where the slice before ended, with the same bits.
    ok : object
        The status of a slice that was done.

    Returns
    -------
    (int, status, dict, bool)
        Rows done, status of the last slice, columns of all, and whether Ctrl-C has ended it.
    """
    if threading.current_thread() is not threading.main_thread():
        return (*_plain(work(0, rows)), False)  # no Ctrl-C arrives here
    with HeldInterrupts() as held, held:
        first, size, asked = 0, first_rows, list[str]()
        whole: dict[str, Any] = {}
        while True:
            end = min(rows, first + size)
            began = time.perf_counter()
            done, status, columns = work(first, end)
            took = time.perf_counter() - began
            if first == 0 and end == rows:
                return done, status, dict(columns), held.take()
            if first == 0:
                whole = dict(columns)
                asked = [name for name, column in columns.items() if column is not None]
                asked = [name for name in asked if len(columns[name]) >= done]
                for name in asked:
                    shape = (rows, *columns[name].shape[1:])
                    whole[name] = np.empty(shape, columns[name].dtype)
            for name in asked:
                whole[name][first : first + done] = columns[name][:done]
            first += done
            interrupted = held.take()
            if interrupted or status != ok or first == rows:
                return first, status, whole, interrupted
            size = max(1, int(size * min(8.0, _SLICE_S / max(took, 1e-6))))


def _plain(given: tuple[int, S, Mapping[str, Any]]) -> tuple[int, S, dict[str, Any]]:
    done, status, columns = given
    return done, status, dict(columns)
