"""The bits of before: what a change of structure must leave as it was.

``golden.json`` has the SHA-256 of each record and of its trace in Python (of a vehicle: on the
host, which has Python's bits), as they were when they were first carried to the targets; the other
tests here say that all targets have them. A change that means to change bits says so by writing
the file anew:

    python -m tests.parity.test_golden
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from firmware.parity import slatf, vehicle
from firmware.parity.targets import VEHICLE_TARGETS, Target
from tests.parity import python_leg, records, robust_records, slatf_python_leg

FILE = Path(__file__).with_name("golden.json")
GOLDEN: dict[str, list[str]] = json.loads(FILE.read_text(encoding="utf-8"))


def digest(*arrays: np.ndarray | bytes) -> str:
    total = hashlib.sha256()
    for array in arrays:
        total.update(array if isinstance(array, bytes) else np.ascontiguousarray(array).tobytes())
    return total.hexdigest()


#: Compiles the replay program of a target, once, and gives its path.
Build: TypeAlias = Callable[[Target], Path]


def all_traces() -> dict[str, Callable[[Build], list[str]]]:
    """By name: a function that gives the digests of a record and of its trace."""
    found: dict[str, Callable[[Build], list[str]]] = {}
    for record in records.all_records():
        found[f"gaussian/{record.name}"] = lambda _, r=record: [
            digest(r.to_bytes()),
            digest(python_leg.replay_in_python(r)),
        ]
    for record in robust_records.all_records():
        found[f"robust/{record.name}"] = lambda _, r=record: [
            digest(r.to_bytes()),
            digest(r.replay_in_python()),
        ]
    for name, slat_record in slatf.all_records().items():
        found[f"slat/{name}"] = lambda _, r=slat_record: [
            digest(r.to_bytes()),
            digest(*slatf_python_leg.replay_in_python(r, "scalar")),
        ]
    for name in vehicle.NAMES:
        found[f"vehicle/{name}"] = lambda build, n=name: vehicle_digests(n, build)
    return found


def vehicle_digests(name: str, build: Build) -> list[str]:
    record = next(record for record in vehicle.all_records() if record.name == name)
    target = VEHICLE_TARGETS[0]
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / part for part in ("record", "trace")]
        files[0].write_bytes(record.to_bytes())
        trace = target.replay(build(target), *files, None)
    return [digest(record.to_bytes()), digest(record.trace_of(trace))]


TRACES = all_traces()


@pytest.mark.parametrize("name", GOLDEN)
def test_the_bits_are_those_of_before(name, build):
    record, trace = TRACES[name](build)
    assert record == GOLDEN[name][0], "the record itself has changed"
    assert trace == GOLDEN[name][1]


def test_every_record_has_its_bits_stored():
    assert sorted(TRACES) == sorted(GOLDEN)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        build = cache(lambda target: target.build(Path(folder) / "replay"))
        now = {name: trace(build) for name, trace in sorted(TRACES.items())}
    FILE.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")
