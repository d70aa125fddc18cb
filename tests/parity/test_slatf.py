"""SLATF 1.0 and 2.0 give the same bits on every target: all numbers of all particles, each echo.

The record is the paper's scenario at noise level 3, 400 readings and 200 echoes; the reference is
the host's scalar code. The ATmega2560 has as many particles as its RAM holds, the others the
paper's 100.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from auvest import slat
from auvest.board import Board
from firmware.parity.slatf import FIELDS, Record, paper_world
from firmware.parity.targets import AVR_PARTICLES, PARTICLES, SLATF_TARGETS
from tests.parity.comparison import differing_bits
from tests.parity.slatf_python_leg import FIELDS as SHOWN
from tests.parity.slatf_python_leg import replay_in_python

#: Particles come in blocks (auvest/particles/lanes.hpp).
BLOCK = 16
KINDS = tuple(FIELDS)
TARGET = {target.name: target for target in SLATF_TARGETS}
REFERENCE = TARGET["gcc-O0"]
IDE = TARGET["atmega2560-ide"]

#: Echoes on the ATmega2560 with -O2; the IDE's options get all 200, each half a second of its time.
SHORT = 20


def first_echoes(count):
    """The paper's world until its so manieth echo."""
    world = paper_world()
    last = np.flatnonzero(world.readings["heard"])[count - 1]
    return replace(world, readings=world.readings[: last + 1])


def record_for(target, kind):
    if target.machine != "avr":
        return Record(kind, PARTICLES)
    world = paper_world() if target == IDE else first_echoes(SHORT)
    return Record(kind, AVR_PARTICLES, world)


@pytest.fixture(scope="module")
def traces(build, runner, tmp_path_factory):
    """Return a function that gives the trace of a target and a kind.

    All targets are built and run at once on all cores, the longest first.
    """
    folder = tmp_path_factory.mktemp("slatf")

    def replay(target):
        program, found = build(target), {}
        for kind in KINDS:
            record = record_for(target, kind)
            files = [folder / f"{target.name}-{kind}.{part}" for part in ("record", "trace")]
            files[0].write_bytes(record.to_bytes())
            found[kind] = record.trace_of(target.replay(program, *files, runner))
        return found

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        first = sorted(SLATF_TARGETS, key=lambda target: target != IDE)
        jobs = {target.name: pool.submit(replay, target) for target in first}
    return lambda target, kind: jobs[target.name].result()[kind]


@pytest.fixture(scope="module")
def wanted(traces, replay):
    """Return a function that gives the reference's trace for a kind and a number of particles."""
    few = {}

    def wanted(kind, particles):
        if particles == PARTICLES:
            return traces(REFERENCE, kind)
        if kind not in few:
            record = Record(kind, particles)
            few[kind] = record.trace_of(replay(REFERENCE, record.to_bytes()))
        return few[kind]

    return wanted


def first_difference(expected, found):
    """Say where two traces part: echo, field, values; None if they do not."""
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        for name in expected.dtype.names:
            if not np.array_equal(a[name], b[name]):
                where = tuple(np.argwhere(np.atleast_1d(a[name] != b[name]))[0])
                one, other = (np.atleast_1d(row[name])[where] for row in (a, b))
                place = [int(i) for i in where]
                return f"echo {k}, {name}{place}: expected {one:#010x}, found {other:#010x}"
    return None


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", SLATF_TARGETS[1:], ids=lambda target: target.name)
def test_every_target_gives_the_bits_of_the_host(target, kind, traces, wanted):
    found = traces(target, kind)
    echoes, particles, numbers = found["particles"].shape
    expected = wanted(kind, particles)[:echoes]
    bits = differing_bits(expected, found)
    print(
        f"{kind} on {target.name}: {bits} bits differ in {echoes} echoes, {particles} particles "
        f"of {numbers} numbers"
    )
    assert bits == 0, first_difference(expected, found)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lanes", slat.available_lanes("float32"))
def test_python_gives_the_bits_of_the_host(kind, lanes, wanted):
    expected = wanted(kind, PARTICLES)
    trace, poses = replay_in_python(Record(kind, PARTICLES), lanes)
    for name in SHOWN:
        assert np.array_equal(trace[name], expected[name]), name
    assert np.array_equal(poses, expected["particles"][:, :, 1:3])


def test_a_build_that_fuses_products_is_noticed(replay, wanted):
    record = Record("slatf1", PARTICLES)
    fused = replay(REFERENCE, record.to_bytes(), "-O2", "-ffp-contract=fast", "-mfma")
    expected = wanted("slatf1", PARTICLES)
    assert first_difference(expected, record.trace_of(fused)) is not None


@pytest.mark.parametrize("particles", [AVR_PARTICLES, PARTICLES])
@pytest.mark.parametrize("kind", KINDS)
def test_the_record_is_worth_it(kind, particles, wanted):
    """Resampled often, no status, no number that is none, and a mean that is the particles'."""
    rows = wanted(kind, particles)
    assert rows["particles"].shape == (200, particles, FIELDS[kind])
    assert not rows["status"].any()
    numbers = rows["particles"].view("<f4").astype(float)
    assert np.isfinite(numbers).all()
    # 1.0 is left with few particles after nearly every echo, 2.0 after every fifth.
    assert rows["resamplings"][-1] > (150 if kind == "slatf1" else 20)
    weights = np.exp(numbers[:, :, 0])
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-4)
    mean = np.einsum("tn,tni->ti", weights, numbers[:, :, 1:3])
    np.testing.assert_allclose(rows["slave_x"].view("<f4"), mean, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize("kind", KINDS)
def test_the_largest_set_that_fits(kind, build, runner, tmp_path):
    """What is left beside the deepest stack does not hold another block of particles."""
    record = tmp_path / "record"
    record.write_bytes(Record(kind, AVR_PARTICLES, first_echoes(10)).to_bytes())
    with Board(build(IDE), runner=runner, input=record) as board:
        report = board.run()
    more = BLOCK * 4 * FIELDS[kind]
    print(
        f"{kind}: N = {AVR_PARTICLES}, stack {report.stack_bytes} B, never used "
        f"{report.free_bytes} B; {BLOCK} particles more would take {more} B"
    )
    assert AVR_PARTICLES >= 40
    assert 0 < report.free_bytes < more
