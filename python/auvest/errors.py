"""What the filters raise when a step cannot be done.

Wrong arguments are plain ``ValueError`` and ``TypeError`` that name the argument.
"""

from __future__ import annotations

from typing import Any

from auvest._core import Status, describe


class FilterError(ValueError):
    """A filter could not do a step; it stays as it was before that step.

    Attributes
    ----------
    status : Status
        What the core reported.
    step : int or None
        Row of the record that failed, for ``run``; else None.
    partial : RunResult or None
        Results of the rows before it, for ``run``; else None.
    """

    def __init__(
        self,
        action: str,
        status: Status,
        *,
        step: int | None = None,
        partial: Any = None,
        hint: str = "",
    ) -> None:
        where = "" if step is None else f" at row {step}"
        super().__init__(f"{action}{where}: {hint or describe(status)}")
        self.hint = hint
        self.action = action
        self.status = status
        self.step = step
        self.partial = partial

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (self.action, self.status, self.step, self.partial, self.hint)


def _rebuild(action: str, status: Status, step: int | None, partial: Any, hint: str) -> FilterError:
    return FilterError(action, status, step=step, partial=partial, hint=hint)


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during work that keeps what was done.

    Attributes
    ----------
    partial : object
        What was done, as it would have been returned; None: nothing.
    """

    def __init__(self, partial: Any) -> None:
        super().__init__()
        self.partial = partial


class ModelError(ValueError):
    """A header with models cannot be loaded; the message begins with the line that is wrong."""


class SweepError(RuntimeError):
    """A sweep cannot go on: a task or a cluster failed. What was computed is kept."""
