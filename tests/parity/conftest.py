"""Builds each replay program once and runs records through it."""

from __future__ import annotations

import shlex

import numpy as np
import pytest

from firmware.parity.targets import ReplayError
from tests.firmware.board_support import runner  # noqa: F401 (a fixture)
from tests.parity.python_leg import replay_in_python


@pytest.fixture(scope="session")
def replay(tmp_path_factory, request):
    """Return a function that replays a record, given as bytes, on a target.

    ``extra`` are further flags and sources of the program.
    """
    folder = tmp_path_factory.mktemp("replay")
    programs = {}

    def replay(target, record, *extra):
        key = target.name, extra
        board = request.getfixturevalue("runner") if target.machine == "avr" else None
        try:
            if key not in programs:
                programs[key] = target.build(folder / str(len(programs)), *extra)
            (folder / "record").write_bytes(record)
            return target.replay(programs[key], folder / "record", folder / "trace", board)
        except ReplayError as error:
            pytest.fail(f"{target.name} {shlex.join(map(str, extra))}: {error}", pytrace=False)

    return replay


@pytest.fixture(scope="session")
def expected():
    """Return a function that gives the trace of a record in Python; each is made once."""
    traces: dict[str, np.ndarray] = {}

    def expected(record):
        if record.name not in traces:
            traces[record.name] = replay_in_python(record)
        return traces[record.name]

    return expected
