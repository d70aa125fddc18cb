"""What the sketch ``mission`` and its vehicle say to each other: all that knows the format here.

Its twin on the chip is ``mission_line.h`` of the sketch, which names every line. Lines and numbers
are those of :mod:`auvest.telemetry`.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from auvest.telemetry import LineError, body_of, decimal, frame, number

#: Of each sensor: name of its line, bit in ``heard``, decimals, and the places of its numbers among
#: the seven readings (heading, pitch, pitch rate, yaw rate, speed ahead, to starboard, depth).
SENSORS = (
    ("COMPASS", 1, 5, slice(0, 2)),
    ("GYRO", 2, 5, slice(2, 4)),
    ("LOG", 4, 4, slice(4, 6)),
    ("DEPTH", 8, 3, slice(6, 7)),
)
ALL_HEARD = 15
#: Fixes that the chip takes in one sample.
FIXES = 2


@dataclass(frozen=True)
class Request:
    """The chip asks for readings, and for a fix if ``ping``."""

    sample: int
    ping: bool


@dataclass(frozen=True)
class Command:
    """Rudder and stern planes, rad, and propeller, rev/s, with all their bits."""

    sample: int
    values: tuple[float, float, float]


@dataclass(frozen=True)
class Fix:
    """Range, m, and bearing, rad, asked for at a sample; so ``delay_s`` later."""

    sample: int
    z: npt.NDArray[np.float32]
    delay_s: np.float32


def is_ready(line: str) -> bool:
    """Whether the chip waits to be told where it starts."""
    return line == frame("READY")


def request(line: str) -> Request | None:
    """Read a request for readings; None for any other line."""
    cells = _cells(line, "SENSE", 2)
    return None if cells is None else Request(int(cells[0]), cells[1] == "1")


def command(line: str) -> Command | None:
    """Read a command for the actuators; None for any other line."""
    cells = _cells(line, "STEER", 4)
    if cells is None:
        return None
    rudder, planes, propeller = (struct.unpack(">f", bytes.fromhex(c))[0] for c in cells[1:])
    return Command(int(cells[0]), (rudder, planes, propeller))


def start(x_m: float, y_m: float, heading_rad: float) -> str:
    """Write where the vehicle is put into the water."""
    return frame(f"START,{decimal(x_m, 4)},{decimal(y_m, 4)},{decimal(heading_rad, 6)}")


def readings(sample: int, values: Sequence[float] | npt.NDArray[np.float64]) -> list[str]:
    """Write the seven readings of a sample; a sensor with a NaN is silent."""
    lines = []
    for name, _, decimals, places in SENSORS:
        if all(map(math.isfinite, values[places])):
            numbers = [decimal(value, decimals) for value in values[places]]
            lines.append(frame(",".join([name, str(sample), *numbers])))
    return lines


def fix(sample: int, range_m: float, bearing_rad: float, delay_s: float) -> str:
    """Write a fix that was asked for at a sample, and how long after that it was so."""
    numbers = decimal(range_m, 3), decimal(bearing_rad, 5), decimal(delay_s, 4)
    return frame(",".join(["FIX", str(sample), *numbers]))


@dataclass
class Listener:
    """Takes the vehicle's lines as the chip does.

    Attributes
    ----------
    values : ndarray of float32, shape (7,)
        The readings; those that were not heard in this sample are those of before.
    heard : int
        Which sensors were, as the bits in :data:`SENSORS`.
    fixes : list of Fix
        That have come and have not been forgotten.
    refused : int
        Lines that were of no use.
    start : (float32, float32, float32) or None
        Where the vehicle begins.
    """

    values: npt.NDArray[np.float32] = field(default_factory=lambda: np.zeros(7, np.float32))
    heard: int = 0
    fixes: list[Fix] = field(default_factory=list)
    refused: int = 0
    start: tuple[np.float32, ...] | None = None
    _sample: int = 0

    def begin(self, sample: int) -> None:
        """Begin a sample: what comes from here on belongs to it."""
        self._sample, self.heard = sample, 0

    def close(self) -> None:
        """End a sample: readings that come from here on are too late."""
        self.heard = ALL_HEARD

    def take(self, line: str) -> bool:
        """Take a line; False if it is of no use."""
        try:
            name, *cells = body_of(line).split(",")
            taken = self._take(name, cells)
        except LineError:
            taken = False
        self.refused += not taken
        return taken

    def _take(self, name: str, cells: list[str]) -> bool:
        if name == "START":
            numbers = tuple(map(number, cells))
            if self.start is not None or len(numbers) != 3:
                return False
            self.start = numbers
            return True
        if not cells or not re.fullmatch(r"\d{1,9}", cells[0]):
            return False
        sample, numbers = int(cells[0]), tuple(map(number, cells[1:]))
        if name == "FIX":
            if len(numbers) != 3 or len(self.fixes) == FIXES or sample > self._sample:
                return False
            self.fixes.append(Fix(sample, np.array(numbers[:2]), numbers[2]))
            return True
        for kind, bit, _, places in SENSORS:
            if kind != name:
                continue
            right = len(numbers) == places.stop - places.start and sample == self._sample
            if not right or self.heard & bit:
                return False
            self.values[places] = numbers
            self.heard |= bit
            return True
        return False


def _cells(line: str, name: str, count: int) -> list[str] | None:
    if not line.startswith(f"${name},"):
        return None
    try:
        cells = body_of(line).split(",")[1:]
    except LineError:
        return None
    return cells if len(cells) == count else None
