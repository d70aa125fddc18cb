"""Builds each replay program once and runs records through it."""

from __future__ import annotations

import itertools
import shlex

import numpy as np
import pytest

from firmware.parity.targets import ReplayError
from tests.firmware.board_support import runner  # noqa: F401 (a fixture)
from tests.parity.python_leg import replay_in_python


@pytest.fixture(scope="session")
def build(tmp_path_factory):
    """Return a function that builds a target's replay program, each once, and gives its path.

    ``extra`` are further flags and sources of the program.
    """
    folder = tmp_path_factory.mktemp("programs")
    names = itertools.count()
    programs = {}

    def build(target, *extra):
        key = target, extra
        if key not in programs:
            try:
                programs[key] = target.build(folder / str(next(names)), *extra)
            except ReplayError as error:
                _fail(target, extra, error)
        return programs[key]

    return build


@pytest.fixture(scope="session")
def replay(build, tmp_path_factory, request):
    """Return a function that replays a record, given as bytes, on a target."""
    folder = tmp_path_factory.mktemp("replay")

    def replay(target, record, *extra):
        board = request.getfixturevalue("runner") if target.machine == "avr" else None
        program = build(target, *extra)
        (folder / "record").write_bytes(record)
        try:
            return target.replay(program, folder / "record", folder / "trace", board)
        except ReplayError as error:
            _fail(target, extra, error)

    return replay


def _fail(target, extra, error):
    pytest.fail(f"{target.name} {shlex.join(map(str, extra))}: {error}", pytrace=False)


@pytest.fixture(scope="session")
def expected():
    """Return a function that gives the trace of a record in Python; each is made once."""
    traces: dict[str, np.ndarray] = {}

    def expected(record):
        if record.name not in traces:
            traces[record.name] = replay_in_python(record)
        return traces[record.name]

    return expected
