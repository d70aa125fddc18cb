"""The sketch slave_tracking on the simulated board: SLATF with the bits of the host, half asleep.

As it comes, with 64 particles of one covariance and a gate, and as the paper has it, with 48.

The world is the paper's scenario. What the sketch reported as measured is replayed on the host
(firmware/parity), and everything that it computed must follow from it.
"""

import re
from dataclasses import dataclass, field
from functools import reduce
from operator import getitem

import numpy as np
import pytest

from auvest import _core, telemetry
from auvest.board import PinChange, Report, SerialLine
from auvest.commands.capture import TRIGGER_PIN
from auvest.firmware.sketch import SketchError
from firmware.parity import slatf
from firmware.parity.slatf import MASTER, READING, SLAVE, Record, World, paper_world
from firmware.parity.targets import AVR_PARTICLES, SLATF_TARGETS
from tests.slow import SLOW

pytest_plugins = ["board_support"]

TICKS_PER_S = 250_000
PARTICLES = 64
SOUND_M_S = 1500.0
HOST = SLATF_TARGETS[0]
#: Filters that the sketch may have, and of those on the host.
SHARED, PAPER = "slatf-shared", ("slatf2", "slatf1")
KINDS = sum(1 << slatf.KINDS.index(kind) for kind in (SHARED, *PAPER))

#: Column of the sketch, and the way to it in a row of the host's trace.
ESTIMATES = {
    "x_m": ("slave_x", 0),
    "y_m": ("slave_x", 1),
    "P00_m2": ("slave_P", 0),
    "P10_m2": ("slave_P", 1),
    "P11_m2": ("slave_P", 2),
    "master_x_m": ("masters", 0, "x", 0),
    "master_y_m": ("masters", 0, "x", 1),
    "master_vx_m_s": ("masters", 0, "x", 2),
    "master_vy_m_s": ("masters", 0, "x", 3),
    "master_P00_m2": ("masters", 0, "P", 0),
    "master_P10_m2": ("masters", 0, "P", 1),
    "master_P11_m2": ("masters", 0, "P", 2),
    "n_eff": ("effective_size",),
    "resamplings": ("resamplings",),
}


IMPLAUSIBLE, IMPOSSIBLE_RANGE = 14, 11  # of Status in auvest/status.hpp


@dataclass
class Run:
    """What the sketch did: its lines as rows, when it pinged, what the simulator counted."""

    rows: list = field(default_factory=list)
    pings_s: list = field(default_factory=list)
    comments: list = field(default_factory=list)
    report: Report | None = None

    def column(self, name):
        return np.array([row[name] for row in self.rows])


def motion(sample):
    """The answer of log and compass, and its delay in s."""
    speed, heading = paper_world().readings["u"][sample - 1]
    return [(0.005, telemetry.frame(f"MOTION,{sample},{speed:.6f},{heading:.6f}"))]


def echo(sample):
    """The sonar's answer, when the sound is back."""
    range_m, bearing = paper_world().readings["z"][sample - 1]
    return [(2 * float(range_m) / SOUND_M_S, telemetry.answer(sample, range_m, bearing))]


@pytest.fixture
def play(board):
    """Return a function that runs the sketch for a number of samples, with its instruments."""

    def play(elf, samples, motion=motion, echo=echo):
        run, reader = Run(), telemetry.Reader()
        with board(elf, watch=[TRIGGER_PIN], limit_s=2.0 * samples + 10) as running:
            for event in running:
                if isinstance(event, PinChange):
                    if event.level:
                        run.pings_s.append(event.time_s)
                    continue
                assert isinstance(event, SerialLine), event
                for request, answers in (("ODO", motion), ("PING", echo)):
                    sample = telemetry.requested_sample(event.text, request)
                    if sample is not None:
                        for delay_s, text in answers(sample):
                            running.send(text, delay_s)
                        break
                else:
                    row = reader.read(event.text)
                    if not isinstance(row, dict):
                        run.comments.append(event.text)
                    else:
                        run.rows.append(row)
                    if len(run.rows) == samples:
                        break
        run.report = running.report
        return run

    return play


@pytest.fixture(scope="module")
def sketch(build_edited):
    """Return the sketch as it comes, compiled."""
    return build_edited("slave_tracking").elf


@pytest.fixture(scope="session")
def on_the_host(tmp_path_factory):
    """Return a function that replays on the host what a run has measured."""
    folder = tmp_path_factory.mktemp("host")
    program = HOST.build(folder / "replay", f"-DAUVEST_KINDS={KINDS}")

    def on_the_host(run, kind=SHARED, turn_from_s=240):
        world = measured_world(run, turn_from_s)
        paper = kind in PAPER
        guards = {} if paper else {"gate": 13.8, "kept": 0.8}
        record = Record(kind, AVR_PARTICLES if paper else PARTICLES, world, **guards)
        (folder / "record").write_bytes(record.to_bytes())
        trace = HOST.replay(program, folder / "record", folder / "trace", None)
        return record.trace_of(trace)

    return on_the_host


def measured_world(run, turn_from_s):
    """What the sketch says that it met; the master's plan in float, as the sketch computes it."""
    slave, master = np.zeros((), SLAVE), np.zeros((), MASTER)
    velocity = planned_velocity(np.float32(0), turn_from_s)
    master["x"][1], master["x"][2:4] = 300, velocity
    sigma = np.repeat(np.float32([1.0, 0.05, 1e-4]), 2)
    master["P"][np.cumsum(np.arange(1, 7)) - 1] = sigma * sigma
    readings = np.zeros(len(run.rows), READING)
    last, before_s = np.float32([5.1444, 0.5235988]), np.float32(0)
    for row, reading in zip(run.rows, readings, strict=True):
        seconds, rest = divmod(round(row["time_s"] * TICKS_PER_S), TICKS_PER_S)
        now_s = np.float32(seconds) + np.float32(rest) * np.float32(1 / TICKS_PER_S)
        if np.isfinite(row["speed_m_s"]):
            last = np.float32([row["speed_m_s"], row["heading_rad"]])
        reading["dt"], reading["u"] = row["dt_s"], last
        after = planned_velocity(now_s, turn_from_s)
        reading["change"] = after - planned_velocity(before_s, turn_from_s)
        before_s = now_s
        if np.isfinite(row["range_m"]):
            reading["heard"], reading["z"] = 1, (row["range_m"], row["bearing_rad"])
    return World(slave, master, readings)


def planned_velocity(time_s, turn_from_s):
    turning = max(time_s - np.float32(turn_from_s), np.float32(0))
    heading = np.float32([0.26179939]) + np.float32(0.026179939) * turning
    direction = np.concatenate([_core.cos(heading), _core.sin(heading)])
    return np.float32(5.1444) * direction


def assert_same_bits(run, trace):
    """Every estimate after an echo is the host's; they are floats, so equality means equal bits."""
    heard = [row for row in run.rows if np.isfinite(row["range_m"])]
    gated = 0
    for row, wanted in zip(heard, trace, strict=True):
        for name, way in ESTIMATES.items():
            value = reduce(getitem, way, wanted)
            value = float(value if name == "resamplings" else value.view(np.float32))
            assert row[name] == value, (
                f"sample {row['sample']:.0f}, {name}: {row[name]!r} on the chip, {value!r} here"
            )
        assert row["status"] == (IMPLAUSIBLE if row["gated"] > gated else 0)
        assert wanted["status"] == 0
        gated = row["gated"]


@pytest.mark.parametrize("kind", [SHARED, "slatf2", pytest.param("slatf1", marks=SLOW)])
def test_a_minute_with_the_bits_of_the_host(kind, sketch, build_edited, play, on_the_host):
    particles, elf = PARTICLES, sketch
    if kind in PAPER:  # with as many as the chip has room for, and nothing that guards it
        particles = AVR_PARTICLES
        filter_ = (
            f"auvest::{kind.capitalize()}<Motion, Master, 1, auvest::SystematicResampling, "
            "auvest::OneLane<float>, auvest::NoSafeguards>"
        )
        settings = {"Filter": filter_, "kParticles": particles, "kGate": 0, "kStackReserve": 1280}
        elf = build_edited("slave_tracking", **settings).elf
    samples = 61 if kind == SHARED else 16
    run = play(elf, samples)
    assert_same_bits(run, on_the_host(run, kind))
    assert np.isfinite(run.column("range_m")).sum() == samples // 2
    if kind == SHARED:  # half a minute of the others has none
        assert run.column("resamplings")[-1] > 0
    for counter in ("missed", "refused", "late"):
        assert not run.column(counter).any(), counter

    # Each ping is at its moment, and every two seconds at least one is slept away.
    spacing = np.diff(run.pings_s)
    assert np.abs(spacing - 2).max() < 1e-4
    awake = run.column("awake_us")[1:]
    period = awake[: len(awake) // 2 * 2].reshape(-1, 2).sum(axis=1) * 1e-6
    print(
        f"{kind}, N = {particles}: awake {run.report.awake_share:.1%} simulated, at most "
        f"{period.max():.2f} s of 2 s; stack {run.report.stack_bytes} B, "
        f"never used {run.report.free_bytes} B"
    )
    assert period.max() < 1
    assert run.report.awake_share < 0.5
    assert run.report.serial_overruns == 0
    if kind == SHARED:
        assert run.report.free_bytes >= 500
        (remark,) = (text for text in run.comments if "RAM" in text)
        assert int(re.search(r"\d+", remark)[0]) == run.report.free_bytes


#: What comes instead of an answer, after how long (s), and how many lines are refused for it.
LOST = {
    "wrong checksum": ("{answer}0", 0.005, 1),
    "half a line": ("{answer:.12}", 0.005, 1),
    "another sample": (telemetry.frame("SONAR,1,300,-1.5"), 0.005, 1),
    "another instrument": (telemetry.frame("GPGGA,123519"), 0.005, 1),
    "garbage": ("\xff\xfe\x00*$$*,,\x80%", 0.005, 3),
    "too late": ("{answer}", 0.7, 0),
}


def test_what_does_not_come_is_missed_and_nothing_else(build_edited, play, on_the_host):
    """A fault of each kind for the sonar, then for log and compass; and the master turns."""
    faults = list(LOST.values())
    at = {2 * i + 4: fault for i, fault in enumerate(faults)}  # pings: even samples
    at |= {2 * i + 5 + 2 * len(faults): fault for i, fault in enumerate(faults)}

    def disturbed(answers):
        def disturb(sample):
            if sample not in at:
                return answers(sample)
            text, delay_s, _ = at[sample]
            return [(delay_s, text.format(answer=answers(sample)[0][1]))]

        return disturb

    edits = [("master_plan.h", "turn_from = 240;", "turn_from = 6;")]
    elf = build_edited("slave_tracking", edits).elf

    # At odd samples there is no ping, at even ones the reading is sound.
    def motion_(sample):
        return (disturbed(motion) if sample % 2 else motion)(sample)

    run = play(elf, 32, motion_, disturbed(echo))
    assert_same_bits(run, on_the_host(run, turn_from_s=6))
    missed, refused = run.column("missed"), run.column("refused")
    for sample, (_, _, lines) in at.items():
        measured = "range_m" if sample % 2 == 0 else "speed_m_s"
        assert np.isnan(run.rows[sample - 1][measured])
        assert missed[sample - 1] - missed[sample - 2] == 1
        assert refused[sample - 1] - refused[sample - 2] == lines
    assert missed[-1] == len(at)
    # The plan turns and the echoes do not: those are beyond the gate in the end.
    gated = np.diff(run.column("gated"), prepend=0)
    assert gated.any()
    assert np.array_equal(run.column("status"), np.where(gated > 0, IMPLAUSIBLE, 0))
    assert not run.column("late").any()


def test_what_cannot_be_is_named_and_not_taken(sketch, play, on_the_host):
    """Beyond a limit of the value or of its change: counted, and as if it had not come."""
    range_m = float(paper_world().readings["z"][3][0])
    readings = {3: (25.0, 0.5), 5: (5.0, 30.0), 7: (-21.0, 0.5)}
    echoes = {4: (range_m + 110.0, -1.5), 6: (460.0, -1.5), 8: (300.0, 7.0)}

    def motion_(sample):
        if sample not in readings:
            return motion(sample)
        speed, heading = readings[sample]
        return [(0.005, telemetry.frame(f"MOTION,{sample},{speed:.3f},{heading:.4f}"))]

    def echo_(sample):
        if sample not in echoes:
            return echo(sample)
        return [(0.4, telemetry.answer(sample, *echoes[sample]))]

    run = play(sketch, 12, motion_, echo_)
    wrong = [3, 4, 5, 6, 7, 8]
    assert [row["sample"] for row in run.rows if row["status"]] == wrong
    assert run.column("implausible").tolist() == [0, 0, 1, 2, 3, 4, 5, 6, 6, 6, 6, 6]
    named = [IMPOSSIBLE_RANGE if sample == 6 else IMPLAUSIBLE for sample in wrong]
    assert [run.rows[sample - 1]["status"] for sample in wrong] == named
    assert not run.column("missed").any()
    for sample in wrong:
        assert np.isnan(run.rows[sample - 1]["range_m" if sample % 2 == 0 else "speed_m_s"])
    heard = [row["sample"] for row in run.rows if np.isfinite(row["range_m"])]
    assert heard == [2, 10, 12]
    assert_same_bits(run, on_the_host(run))


def test_late_samples_cover_what_really_passed(build_edited, play, on_the_host):
    """Three readings a second are too many for them: said so, and still the host's bits."""
    run = play(build_edited("slave_tracking", kPeriod="0.3f").elf, 16)
    assert_same_bits(run, on_the_host(run))
    assert run.column("late")[-1] > 3
    assert np.abs(np.diff(run.column("time_s")) - run.column("dt_s")[1:]).max() < 1e-5


def test_more_particles_do_not_compile(build_edited):
    with pytest.raises(SketchError, match="less than kStackReserve bytes of RAM to the stack"):
        build_edited("slave_tracking", kParticles="160")


def test_a_gate_with_a_way_back(sketch, play, on_the_host):
    """Echoes far off the estimate are refused and named; six that agree are a master reborn.

    From sample 6 on the sonar hears the master 60 m further away, as if it had moved in silence.
    """

    def echo_(sample):
        range_m, bearing = paper_world().readings["z"][sample - 1]
        range_m += 60.0 if sample >= 6 else 0.0
        return [(0.45, telemetry.answer(sample, range_m, bearing))]

    run = play(sketch, 20, motion, echo_)
    pinged = [row for row in run.rows if row["sample"] % 2 == 0]
    assert [row["gated"] for row in pinged] == [0, 0, 1, 2, 3, 4, 5, 6, 6, 6]
    assert [row["rebirths"] for row in pinged] == [0] * 7 + [1] * 3
    named = [IMPLAUSIBLE if 6 <= row["sample"] <= 16 else 0 for row in pinged]
    assert [row["status"] for row in pinged] == named
    assert not run.column("implausible").any()
    # The master is where it is heard, and the slave has learnt nothing from what was refused.
    trace = on_the_host(run)
    for row, wanted in zip(pinged, trace, strict=True):
        assert row["master_x_m"] == float(wanted["masters"][0]["x"][0].view(np.float32))
        assert row["x_m"] == float(wanted["slave_x"][0].view(np.float32))
