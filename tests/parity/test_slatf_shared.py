"""SLATF with one covariance for N = 100 particles: the same bits on every target.

The paper's scenario at noise level 3, 200 echoes, with gate and recovery. The ATmega2560 has as
many particles as the desk. Minutes of compilers and of its simulated time: with AUVEST_SLOW_TESTS.
"""

from __future__ import annotations

import numpy as np
import pytest

from auvest.board import Board
from firmware.parity.slatf import fields_of, shared_record
from firmware.parity.targets import PARTICLES, SLATF_TARGETS
from tests.parity.comparison import differing_bits
from tests.parity.slatf_python_leg import replay_in_python
from tests.parity.test_slatf import first_difference
from tests.slow import SLOW

pytestmark = SLOW

RECORD = shared_record()
#: In lanes it is the particles of Slatf that run.
TARGETS = [target for target in SLATF_TARGETS if "lanes" not in " ".join(target.flags).lower()]
IDE = next(target for target in TARGETS if target.name == "atmega2560-ide")


@pytest.fixture(scope="module")
def wanted(replay):
    """Return the trace of the host without optimisation."""
    flags = RECORD.program(TARGETS[0])
    return RECORD.trace_of(replay(TARGETS[0], RECORD.to_bytes(), *flags))


@pytest.mark.parametrize("target", TARGETS[1:], ids=lambda target: target.name)
def test_every_target_gives_the_bits_of_the_host(target, replay, wanted):
    found = RECORD.trace_of(replay(target, RECORD.to_bytes(), *RECORD.program(target)))
    bits = differing_bits(wanted, found)
    print(f"{target.name}: {bits} bits differ in {len(found)} rows of {found.itemsize} B")
    assert bits == 0, first_difference(wanted, found)


def test_python_gives_the_bits_of_the_host(wanted):
    trace, poses = replay_in_python(RECORD, "scalar")
    assert np.array_equal(poses, wanted["particles"][:, :, 1:3])
    for field in set(trace.dtype.names) - {"particles"}:
        assert np.array_equal(trace[field], wanted[field]), field


def test_the_record_is_worth_it(wanted):
    """All of it, no status, particles that are resampled now and then."""
    assert wanted["particles"].shape == (200, PARTICLES, fields_of("slatf-shared"))
    assert not wanted["status"].any()
    assert np.isfinite(wanted.copy().view("<f4")).all()
    assert wanted["resamplings"][-1] > 10


def test_it_fits_the_ram_with_500_bytes_to_spare(build, runner, tmp_path):
    file = tmp_path / "record"
    file.write_bytes(RECORD.to_bytes())
    program = build(IDE, *RECORD.program(IDE))
    with Board(program, runner=runner, input=file, limit_s=600.0) as board:
        report = board.run()
    print(f"never used: {report.free_bytes} B of the 8,192")
    assert report.free_bytes >= 500
