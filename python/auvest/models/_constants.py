"""What a process with constants and the sensors that read them have in common."""

from __future__ import annotations

import sys
from typing import Any

from auvest._arguments import as_integer
from auvest._fields import taken

#: Names of the states: a pose, and the constants behind it.
POSE = ("x_m", "y_m", "theta_rad")
STATE = (*POSE, *(f"constant_{number}" for number in range(5)))


def place() -> Any:
    """Take the place of a constant in the state; 0: none."""

    def take(name: str, given: object) -> int:
        value = as_integer(name, given, -sys.maxsize, sys.maxsize)
        if value != 0 and not len(POSE) <= value < len(STATE):
            raise ValueError(f"{name} must be 0 or {len(POSE)}..{len(STATE) - 1}, not {value}")
        return value

    return taken(0, take, type="integer", minimum=0, maximum=len(STATE) - 1)
