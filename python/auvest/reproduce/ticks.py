"""Progress of a list of experiments."""

from __future__ import annotations

from collections.abc import Callable


class Ticks:
    """Counts what is done: call it after each experiment.

    Parameters
    ----------
    total : int
        How many there are.
    progress : callable, optional
        Called as ``progress(done, total)``.
    """

    def __init__(self, total: int, progress: Callable[[int, int], None] | None) -> None:
        self._done = 0
        self._total = total
        self._progress = progress

    def __call__(self) -> None:
        """Count one more."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)
