"""Traces side by side, bit by bit."""

from __future__ import annotations

import numpy as np

from auvest.firmware.hil import ulps


def differing_bits(a: np.ndarray, b: np.ndarray) -> int:
    """How many bits differ between two traces."""
    return sum((x ^ y).bit_count() for x, y in zip(a.tobytes(), b.tobytes(), strict=True))


def first_difference(expected: np.ndarray, found: np.ndarray) -> str | None:
    """Describe the first number that differs: step, field, values, distance; None if none does."""
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        for name in expected.dtype.names or ():
            wanted, given = np.atleast_1d(a[name]), np.atleast_1d(b[name])
            for i in np.flatnonzero(wanted != given):
                where = f"step {k}, {name}" + (f"[{i}]" if len(wanted) > 1 else "")
                return f"{where}: {_difference(wanted[i], given[i])}"
    return None


def _difference(wanted: np.generic, given: np.generic) -> str:
    if wanted.dtype == np.uint8:
        return f"expected {wanted}, found {given}"
    a, b = (np.array(v).view(np.float32)[()] for v in (wanted, given))
    distance = ulps(wanted, given)
    return f"expected {a!s} ({wanted:#010x}), found {b!s} ({given:#010x}), {distance} ulp apart"
