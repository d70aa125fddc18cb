"""Hulls, guidance, control, allocation and the model-aided filter: the same bits on every target.

The mission is one of 600 s at 10 Hz, its readings those of the desk in float; the reference is the
host's program without optimisation, which in turn has the bits of the desk's own loop and of
Python. On the ATmega2560 the IDE's build gets every record in full, but a quarter of the hulls that
follow the long mission's commands, two billion cycles, unless slow tests are asked for; with -O2 it
gets their beginnings.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from auvest._core import PilotMode, Status
from firmware.parity.targets import VEHICLE_TARGETS
from firmware.parity.vehicle import NAMES, all_records, first_steps
from tests.parity import vehicle_python_leg
from tests.parity.comparison import asked_for, differing_bits, first_difference, target_params
from tests.slow import ASKED

TARGET = {target.name: target for target in VEHICLE_TARGETS}
REFERENCE = TARGET["gcc-O0"]
IDE = TARGET["atmega2560-ide"]

#: Steps of each record on the ATmega2560 with -O2.
SHORT = 60
#: Steps of these records there with the IDE's options.
QUARTER = {} if ASKED else {"hull6": 1_500, "hull3": 1_500}

MISSIONS = tuple(name for name in NAMES if name.startswith("mission"))
HULLS = tuple(name for name in NAMES if name.startswith("hull"))
SOUND = tuple(name for name in NAMES if name != "pilot")  # in which nothing is refused


@pytest.fixture(scope="module")
def records():
    """Give the records by name; the desk flies the missions first."""
    found = {record.name: record for record in all_records()}
    assert tuple(found) == NAMES
    return found


@pytest.fixture(scope="module")
def traces(build, runner, records, tmp_path_factory):
    """Return a function that gives the trace of a target and a record.

    All targets are built and run at once on all cores, the longest first.
    """
    folder = tmp_path_factory.mktemp("vehicle")

    def replay(target):
        program, found = build(target), {}
        for name, record in records.items():
            if target.machine == "avr":
                steps = QUARTER.get(name) if target == IDE else SHORT
                record = record if steps is None else first_steps(record, steps)
            files = [folder / f"{target.name}-{name}.{part}" for part in ("record", "trace")]
            files[0].write_bytes(record.to_bytes())
            found[name] = record.trace_of(target.replay(program, *files, runner))
        return found

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        asked = filter(asked_for, VEHICLE_TARGETS)
        first = sorted(asked, key=lambda target: target != IDE)
        jobs = {target.name: pool.submit(replay, target) for target in first}
    return lambda target, name: jobs[target.name].result()[name]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("target", target_params(VEHICLE_TARGETS[1:]))
def test_every_target_gives_the_bits_of_the_host(target, name, traces):
    found = traces(target, name)
    wanted = traces(REFERENCE, name)[: len(found)]
    bits = differing_bits(wanted, found)
    print(f"{name} on {target.name}: {bits} bits differ in {len(found)} steps")
    assert bits == 0, first_difference(wanted, found)


# ---- The host against the desk and Python --------------------------------------------------------


def as_floats(bits):
    return np.ascontiguousarray(bits).view("<f4")


def same(wanted, found, *names):
    """Assert that two traces have the same bits in these fields."""
    for name in names:
        parts = np.argwhere(wanted[name] != found[name])
        assert len(parts) == 0, f"{name} differs first in step {parts[0][0]}"


@pytest.mark.parametrize("name", MISSIONS)
def test_the_host_commands_what_the_desk_does(name, records, traces):
    """The program that is fed the readings is the loop of simulation/mission.hpp."""
    found = as_floats(traces(REFERENCE, name)["command"])
    np.testing.assert_array_equal(found, records[name].rows["command"])


@pytest.mark.parametrize("name", MISSIONS)
def test_python_flies_the_mission_with_the_bits_of_the_host(name, records, traces):
    flown = vehicle_python_leg.fly(records[name])
    same(traces(REFERENCE, name), flown, "x", "nis", "command")


@pytest.mark.parametrize("name", MISSIONS)
def test_the_filter_in_python_has_the_bits_of_the_host(name, records, traces):
    wanted = traces(REFERENCE, name)
    headings = as_floats(wanted["heading"])
    same(wanted, vehicle_python_leg.filter_beside(records[name], headings), "x", "P", "nis")


@pytest.mark.parametrize("name", HULLS)
def test_the_hull_in_python_has_the_bits_of_the_host(name, records, traces):
    wanted = traces(REFERENCE, name)["x"]
    np.testing.assert_array_equal(vehicle_python_leg.move(records[name]), wanted)


def test_the_rov_in_python_has_the_bits_of_the_host(records, traces):
    wanted = traces(REFERENCE, "rov")
    found = vehicle_python_leg.move_rov(records["rov"], as_floats(wanted["command"]))
    np.testing.assert_array_equal(found, wanted["x"])


def test_the_pilot_in_python_has_the_bits_of_the_host(records, traces):
    wanted = traces(REFERENCE, "pilot")
    same(wanted, vehicle_python_leg.pilot_through(records["pilot"]), *vehicle_python_leg.PILOTED)


# ---- The records do what they are for ------------------------------------------------------------


@pytest.mark.parametrize("name", ["mission", "hull6-zigzag", "rov"])
def test_a_build_that_fuses_products_is_noticed(name, records, replay, traces):
    record = records[name]
    fused = replay(REFERENCE, record.to_bytes(), "-O2", "-ffp-contract=fast", "-mfma")
    wanted = traces(REFERENCE, name)
    assert first_difference(wanted, record.trace_of(fused)) is not None


def test_the_pilot_meets_what_its_record_is_for(traces):
    rows = traces(REFERENCE, "pilot")
    assert not rows["predicted"].any()
    assert not rows["steered"].any()
    modes = [PilotMode(mode) for mode in rows["mode"]]
    assert set(modes) == {PilotMode.under_way, PilotMode.silent, PilotMode.finished}
    changes = [k for k in range(1, len(modes)) if modes[k] != modes[k - 1]]
    # A gyro and a depth that are silent for 2.5 s stop it after one; compass and log are stood in
    # for. Its plan of 280 m, less the corners that it cuts, ends after 186 s.
    assert changes[:4] == [170, 185, 340, 355]
    assert len(changes) == 5
    assert 1800 < changes[4] < 1900
    assert set(rows["leg"]) == {0, 1, 2}
    refusals = {Status(int(code)) for code in set(rows["corrected"])}
    assert refusals == {Status.ok, Status.time_backwards, Status.bad_parameter}
    assert rows["implausible"][-1] == 5


@pytest.mark.parametrize("name", SOUND)
def test_nothing_is_refused_and_every_number_is_one(name, traces):
    rows = traces(REFERENCE, name)
    assert not rows["status"].any()
    for field in set(rows.dtype.names) - {"status", "nis", "weight", "spare"}:
        if rows[field].dtype == np.uint32:
            assert np.isfinite(as_floats(rows[field])).all(), field


def test_the_records_reach_what_they_are_for(records, traces):
    long = traces(REFERENCE, "mission")
    assert len(long) == 6000
    assert sorted(set(long["leg"])) == [0, 1, 2, 3, 4, 5, 6]
    weights = as_floats(long["weight"])
    assert (weights == 0).any(), "a fix must be thrown out"
    assert ((weights > 0) & (weights < 1)).any(), "and one believed in part"
    limit = np.float32(np.radians(15))
    assert (np.abs(as_floats(long["command"])[:, 0]) == limit).any(), "the rudder must saturate"
    laws = {records[name].law for name in MISSIONS}
    assert len(laws) == 5
    assert {records[name].kernel for name in MISSIONS} == {"unit", "huber", "hampel", "igg"}
    for name in MISSIONS[2:]:
        assert traces(REFERENCE, name)["on_arc"].sum() > 100
    # Six degrees of freedom are not three: the torpedo pitches and rolls.
    assert np.abs(as_floats(traces(REFERENCE, "hull6-zigzag")["x"])[:, 3:5]).max() > 0.05
    astern = as_floats(traces(REFERENCE, "hull6-zigzag")["x"])[:, 6]
    assert astern.min() < -1 < 1 < astern.max()
    rov = traces(REFERENCE, "rov")
    assert 0 < rov["saturated"].sum() < len(rov)
    # It gets there, but for what the integral has still to take up of the current.
    away = as_floats(rov["x"])[-1, :3] - records["rov"].rows[-1, :3]
    assert np.linalg.norm(away) < 1
    for name in ("hull6", "hull3"):
        assert len(records[name].rows) == 6000
