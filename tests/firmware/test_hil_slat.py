"""`auvest hil` of the filters that localise and track: every record of parity on every target."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from auvest import DeadReckoning, slat
from auvest.firmware import hil
from auvest.firmware.hil_bench import bench
from auvest.registry import FILTERS
from firmware.parity.slatf import KINDS, all_records, shared_record
from tests.slow import SLOW

pytest_plugins = ["board_support"]

RECORDS = {**all_records(), "slatf-shared": shared_record()}
ON_CHIP = {**all_records(chip=True), "slatf-shared": shared_record()}


def record_for(target, name):
    return (ON_CHIP if target == "atmega2560" else RECORDS)[name].for_bench()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Programs; Arduino's core among them is compiled once."""
    return tmp_path_factory.mktemp("hil")


def pairs():
    for target in hil.TARGETS:
        for name in ON_CHIP if target == "atmega2560" else RECORDS:
            short = (target, name) == ("host", "slatf2-births")
            yield pytest.param(target, name, id=f"{target}-{name}", marks=() if short else SLOW)


@pytest.mark.parametrize(("target", "name"), list(pairs()))
def test_every_target_keeps_every_bit(target, name, folder, runner, monkeypatch):
    monkeypatch.setenv("AUVEST_BOARD", str(runner))
    record = record_for(target, name)
    flags = ("-O0",) if target == "host" else ()
    leg = hil.run(record, target, folder, flags=flags)
    assert leg.difference is None, str(leg.difference)
    assert leg.words.shape == (len(record) + 1, len(record.fields))
    print(f"{name} on {target}: {leg.words.size:,} numbers, 0 differ; {leg.figures}")


def test_every_filter_of_the_registry_for_the_chip_has_a_record():
    kinds = {kind.removesuffix("-imm").removesuffix("-unicycle") for kind in KINDS}
    chip = {name for name, entry in FILTERS.items() if entry.family == "slat" and entry.chip}
    assert kinds == chip | {"slatf-shared"}  # a SlatfJoint, too


@pytest.mark.parametrize("name", RECORDS)
def test_a_program_is_written_for_every_record(name):
    record = RECORDS[name].for_bench()
    program = bench(record)
    assert "@" not in program.header
    assert len(program.rows) == len(record) + 1
    if "imm" in name:
        assert record.on_desk().shape == (len(record) + 1, len(record.fields))


@pytest.mark.parametrize("name", ["slatf-joint-unicycle", "ekf-slat"])
def test_rows_are_what_a_run_does(name):
    """Echoes between the readings, several at a time, at the very beginning: the same bits."""
    record = RECORDS[name]
    steps = record.world.steps
    start = np.zeros(1, steps[0].echoes.dtype)
    start["z"], start["master"] = steps[0].echoes["z"][0], 0
    first = replace(steps[0], echoes=np.concatenate([start, steps[0].echoes]))
    record = replace(record, world=replace(record.world, steps=[first, *steps[1:]]))
    played = record.for_bench()
    desk = dict(zip(played.fields, played.on_desk().T, strict=True))
    assert [row.dt is None for row in played.rows[2:]] == [True] + [False] * (len(played) - 3)
    assert not desk["status"].any()
    ran = record.filter("scalar")
    for newcomer in played.rows[:2]:
        ran.add_master(newcomer.x, newcomer.P)
    times = np.arange(len(steps) + 1.0)
    parts = [step.echoes for step in record.world.steps]
    result = ran.run(
        times,
        np.array([step.u for step in steps]),
        z=np.concatenate([part["z"] for part in parts]),
        z_time_s=np.concatenate([t + p["after_s"] for t, p in zip(times[:-1], parts, strict=True)]),
        master=np.concatenate([part["master"] for part in parts]),
        changes=np.array([step.changes for step in steps]),
    )
    now = np.cumsum(played.dt)
    ends = np.flatnonzero((played.dt > 0) & (now == np.round(now)))
    assert len(ends) == len(steps)
    for field, column in (
        ("slave x[y]", result.x[:, 1]),
        ("master 1 x[vx]", result.masters_x[:, 1, 2]),
        ("log_likelihood", result.log_likelihood),
    ):
        assert np.array_equal(desk[field][1:][ends], column.astype(np.float32).view(np.uint32))


def test_a_record_that_cannot_be_is_refused():
    record = RECORDS["ekf-slat"].for_bench()
    x0, P0 = np.zeros(2), np.eye(2)
    reckoning = DeadReckoning(x0, P0, dtype="float32")
    with pytest.raises(ValueError, match="DeadReckoning is for the desk only"):
        replace(record, filter=reckoning)
    with pytest.raises(ValueError, match="must be in float32, not in float64"):
        replace(record, filter=slat.EkfSlat(x0, P0))
    with pytest.raises(ValueError, match="room is 1: it must be from the 2 masters told to the 4"):
        replace(record, room=1)
    births = RECORDS["slatf2-births"]
    with pytest.raises(ValueError, match="2 masters, but room is 1"):
        replace(births.for_bench(), room=1).on_desk()


@SLOW
@pytest.mark.skipif(
    sys.platform != "linux" or " fma " not in Path("/proc/cpuinfo").read_text(),
    reason="this processor has no fused multiply-add",
)
def test_fused_multiply_add_is_named_at_its_first_row(folder):
    leg = hil.run(
        RECORDS["slatf2"].for_bench(), "host", folder, flags=("-mfma", "-ffp-contract=fast")
    )
    assert leg.difference is not None
    assert leg.difference.row <= 2
    assert leg.differing > 1000
