"""The filters that localise and track give the same bits on every target, after each echo.

SLATF 1.0 and 2.0 meet the paper's scenario at noise level 3, 400 readings and 200 echoes. All
filters, with both motions, births, echoes of unknown masters and interacting models, meet an
encounter (``firmware/parity/slatf.py``). Compared are all numbers of all particles; the reference
is the host's scalar code. The ATmega2560 has as many particles and masters as its RAM holds.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from auvest import slat
from auvest.board import Board
from firmware.parity import slatf
from firmware.parity.slatf import all_records, fields_of, paper_echoes
from firmware.parity.targets import AVR_PARTICLES, PARTICLES, SLATF_TARGETS
from tests.parity.comparison import asked_for, differing_bits
from tests.parity.slatf_python_leg import replay_in_python
from tests.slow import ASKED, SLOW

#: Particles come in blocks (auvest/particles/lanes.hpp).
BLOCK = 16
TARGET = {target.name: target for target in SLATF_TARGETS}
REFERENCE = TARGET["gcc-O0"]
IDE = TARGET["atmega2560-ide"]

#: In the paper's scenario, and in the encounter.
PAPER = ("slatf1", "slatf2")
RECORDS = all_records()
ON_CHIP = all_records(chip=True)

#: Echoes of the paper's scenario on the ATmega2560, each half a second of its time; where slow
#: tests are asked for the IDE's options get all 200.
SHORT = 20


#: What every target replays: each filter once, with both motions, births, echoes of unknown masters
#: and interacting models among them. A program of all kinds takes a compiler a minute: the others
#: are for the reference, whose bits Python must have, and where slow tests are asked for.
CHOSEN = ("slatf1", "slatf2-births", "slatf-joint", "ekf-slat", "ekf-slat-unicycle-imm")


def all_names_for(target):
    """The records of a target. Its program in lanes has the Slatf with one model of a master."""
    names = ON_CHIP if target.machine == "avr" else RECORDS
    if "-DAUVEST_KINDS=0xf" in target.flags:
        return [name for name in names if slatf.KINDS.index(RECORDS[name].kind) < 4]
    return list(names)


def is_asked_for(target, name):
    """Whether a record is replayed. Those of the paper have a program on the chip anyway."""
    always = target == REFERENCE or name in CHOSEN or (target == IDE and name in PAPER)
    return asked_for(target) and (ASKED or always)


def names_for(target):
    return [name for name in all_names_for(target) if is_asked_for(target, name)]


def program_for(target, name):
    """The flags of the program: one for each record on the chip, elsewhere one for all."""
    if ASKED or target == REFERENCE or target.machine == "avr":
        return record_for(target, name).program(target)
    kinds = sum({1 << slatf.KINDS.index(RECORDS[name].kind) for name in names_for(target)})
    return "-UAUVEST_KINDS", f"-DAUVEST_KINDS={kinds}"


def record_for(target, name):
    if target.machine != "avr":
        return RECORDS[name]
    short = name in PAPER and not (target == IDE and ASKED)
    return replace(ON_CHIP[name], world=paper_echoes(SHORT)) if short else ON_CHIP[name]


@pytest.fixture(scope="module")
def traces(build, runner, tmp_path_factory):
    """Return a function that gives the trace of a target and a record.

    All targets are built and run at once on all cores, the longest first.
    """
    folder = tmp_path_factory.mktemp("slatf")

    def replay(target):
        found = {}
        for name in names_for(target):
            record = record_for(target, name)
            program = build(target, *program_for(target, name))
            files = [folder / f"{target.name}-{name}.{part}" for part in ("record", "trace")]
            files[0].write_bytes(record.to_bytes())
            found[name] = record.trace_of(target.replay(program, *files, runner))
        return found

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        first = sorted(filter(asked_for, SLATF_TARGETS), key=lambda target: target.machine != "avr")
        jobs = {target.name: pool.submit(replay, target) for target in first}
    return lambda target, name: jobs[target.name].result()[name]


@pytest.fixture(scope="module")
def wanted(traces, replay):
    """Return a function that gives the reference's trace of a record, or of that for the chip."""
    small = {}

    def wanted(name, *, chip=False):
        if not chip:
            return traces(REFERENCE, name)
        if name not in small:
            record = ON_CHIP[name]
            small[name] = record.trace_of(replay(REFERENCE, record.to_bytes()))
        return small[name]

    return wanted


def numbers_of(row):
    """All words of a row, each with its name and place."""
    if row.dtype.names:
        for name in row.dtype.names:
            for place, word in numbers_of(row[name]):
                yield f"{name}{place}" if place.startswith("[") else f"{name}.{place}", word
    elif row.ndim:
        for i, part in enumerate(row):
            for place, word in numbers_of(part):
                yield f"[{i}]{place}", word
    else:
        yield "", row


def first_difference(expected, found):
    """Say where two traces part: row, field, values; None if they do not."""
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        for (place, one), (_, other) in zip(numbers_of(a), numbers_of(b), strict=True):
            if one != other:
                return f"row {k}, {place}: expected {one:#010x}, found {other:#010x}"
    return None


def pairs():
    for target in SLATF_TARGETS[1:]:
        for name in all_names_for(target):
            marks = () if is_asked_for(target, name) else SLOW
            yield pytest.param(target, name, id=f"{target.name}-{name}", marks=marks)


@pytest.mark.parametrize(("target", "name"), list(pairs()))
def test_every_target_gives_the_bits_of_the_host(target, name, traces, wanted):
    found = traces(target, name)
    expected = wanted(name, chip=target.machine == "avr")[: len(found)]
    bits = differing_bits(expected, found)
    print(f"{name} on {target.name}: {bits} bits differ in {len(found)} rows of {found.itemsize} B")
    assert bits == 0, first_difference(expected, found)


def in_python():
    for name, record in RECORDS.items():
        laned = name in all_names_for(SLATF_TARGETS[-1])
        lanes = slat.available_lanes("float32") if laned else ()
        for lane in lanes or ("scalar",):
            yield pytest.param(record, name, lane, id=f"{name}-{lane}")


@pytest.mark.parametrize(("record", "name", "lanes"), list(in_python()))
def test_python_gives_the_bits_of_the_host(record, name, lanes, wanted):
    expected = wanted(name)
    trace, poses = replay_in_python(record, lanes)
    for field in trace.dtype.names:
        if field == "particles":
            pose = record.motion.pose_states
            assert np.array_equal(poses, expected["particles"][:, :, 1 : 1 + pose])
        else:
            assert np.array_equal(trace[field], expected[field]), field


@SLOW
@pytest.mark.parametrize("name", RECORDS)
def test_a_build_that_fuses_products_is_noticed(name, replay, wanted):
    record = RECORDS[name]
    fused = replay(REFERENCE, record.to_bytes(), "-O2", "-ffp-contract=fast", "-mfma")
    assert first_difference(wanted(name), record.trace_of(fused)) is not None


# ---- The records do what they are for ------------------------------------------------------------


def floats(words):
    return np.ascontiguousarray(words).view("<f4").astype(float)


@pytest.mark.parametrize("chip", [False, True])
@pytest.mark.parametrize("name", PAPER)
def test_the_record_is_worth_it(name, chip, wanted):
    """Resampled often, no status, no number that is none, and a mean that is the particles'."""
    rows = wanted(name, chip=chip)
    assert rows["particles"].shape == (200, AVR_PARTICLES if chip else PARTICLES, fields_of(name))
    # 1.0 is left with few particles after nearly every echo, 2.0 after every fifth.
    assert rows["resamplings"][-1] > (150 if name == "slatf1" else 20)
    assert rows["resamplings"][SHORT - 1] >= 3


BOTH = [(name, False) for name in RECORDS] + [(name, True) for name in ON_CHIP]
MEETING = [(name, chip) for name, chip in BOTH if name not in PAPER]


@pytest.mark.parametrize(("name", "chip"), BOTH)
def test_the_trace_is_sound(name, chip, wanted):
    """No status, no number that is none, and means that are the particles'."""
    rows = wanted(name, chip=chip)
    assert not rows["status"].any()
    assert np.isfinite(rows.copy().view("<f4")).all()
    if "particles" not in rows.dtype.names:
        return
    numbers = floats(rows["particles"])
    weights = np.exp(numbers[:, :, 0])
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-4)
    mean = np.einsum("tn,tni->ti", weights, numbers[:, :, 1:3])
    np.testing.assert_allclose(floats(rows["slave_x"])[:, :2], mean, rtol=1e-4, atol=1e-2)


@pytest.mark.parametrize(("name", "chip"), MEETING)
def test_the_encounter_is_followed(name, chip, wanted):
    """Slave and masters are found where they are, but for what the filter itself deems unlikely."""
    record = (ON_CHIP if chip else RECORDS)[name]
    last = wanted(name, chip=chip)[-1]
    end_s = float(len(record.world.steps))
    places = [(slatf._slave(end_s)[0], floats(last["slave_x"]), floats(last["slave_P"]))]
    for n in range(record.room):
        master = last["masters"][n]
        places.append((slatf._master(end_s, n)[0], floats(master["x"]), floats(master["P"])))
    for truth, x, P in places:
        error = x[:2] - truth
        nees = error @ np.linalg.solve([[P[0], P[1]], [P[1], P[2]]], error)
        assert nees < -2 * math.log(1e-4)


@pytest.mark.parametrize("name", ["slatf1-births", "slatf2-births"])
def test_a_master_is_born_when_it_is_first_heard(name, wanted):
    rows, steps = wanted(name), RECORDS[name].world.steps
    there = rows["masters"]["P"][:, :, 0] != 0
    heard = [k for k, step in enumerate(steps) if len(step.echoes)]
    assert there[:, 0].all()
    assert there[:, 1].tolist() == [k >= slatf._SECOND for k in heard]
    assert all((step.echoes["master"] == slat.UNKNOWN_MASTER).all() for step in steps)


@pytest.mark.parametrize("name", [name for name in RECORDS if name.endswith("imm")])
def test_the_turn_of_the_first_master_is_told_from_the_others(name, wanted):
    modes = floats(wanted(name)["masters"]["modes"][:, 0])
    np.testing.assert_allclose(modes.sum(axis=1), 1, rtol=1e-5)
    straight = int(slatf._MASTERS[0][2] * 3 / 4)  # of four readings three have echoes
    assert modes[:straight].argmax(axis=1)[-1] == 0
    assert modes[-1].argmax() == 2


@pytest.mark.parametrize("name", PAPER)
def test_the_largest_set_that_fits(name, build, runner, tmp_path):
    """What is left beside the deepest stack does not hold another block of particles."""
    record = replace(ON_CHIP[name], world=paper_echoes(10))
    file = tmp_path / "record"
    file.write_bytes(record.to_bytes())
    with Board(build(IDE, *record.program(IDE)), runner=runner, input=file) as board:
        report = board.run()
    block = BLOCK * 4 * fields_of(name)
    particles = block * AVR_PARTICLES // BLOCK  # they lie on the stack
    print(
        f"{name}: N = {AVR_PARTICLES}, stack beside them {report.stack_bytes - particles} B, "
        f"never used {report.free_bytes} B; {BLOCK} particles more would take {block} B"
    )
    assert AVR_PARTICLES >= 40
    assert 0 < report.free_bytes < block


@pytest.mark.parametrize("kind", ["slatf1-imm", "slatf2-unicycle-imm"])
def test_particles_with_an_imm_do_not_fit_into_the_chip(kind):
    """Beside the smallest set less is left of the 8 KB than any of the filters takes of stack."""
    assert 8192 - BLOCK * 4 * fields_of(kind) < 1000
