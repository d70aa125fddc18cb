"""Traces side by side, bit by bit, of the targets that are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from auvest.firmware.hil import ulps
from firmware.parity.targets import Target
from tests.slow import ASKED, SLOW

#: Other flags and compilers for machines that the remaining targets have, too; the lanes of SSE2
#: are those of the Python module as well.
FURTHER = {
    *("gcc-O3-march=native", "clang-O0", "clang-O3-march=native-sse2"),
    *("atmega2560-O2", "cortex-m3"),
}


def asked_for(target: Target) -> bool:
    """Whether a target is replayed: the further ones and the chips of QEMU are slow tests.

    Of WebAssembly, the Kalman filters are replayed in scalars and SLATF in lanes.
    """
    further = target.name in FURTHER or target.machine == "chip"
    return ASKED or not (further or (target.name == "wasm32" and target.header != "replay.hpp"))


def target_params(targets):
    """Parameters of a test, one for each target."""
    return [
        pytest.param(target, id=target.name, marks=() if asked_for(target) else SLOW)
        for target in targets
    ]


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
