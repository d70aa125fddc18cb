"""The sketch beacon_navigation on the simulated board: late ranges, with the bits of the desk.

What the sketch reported as measured is filtered again in Python, float32, and everything that it
computed must follow from it.
"""

import json
import math
import re
from dataclasses import dataclass, field

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest import Ekf, Igg, LeaderRange, RejectionStreak, SpeedHeading, telemetry
from auvest.board import Report, SerialLine
from auvest.cli import app
from auvest.firmware import sketch

pytest_plugins = ["board_support"]

BEACONS = [(0.0, 0.0), (120.0, 0.0), (60.0, 90.0)]
DELAY_S = 2.3
IMPLAUSIBLE = 14  # of Status in auvest/status.hpp


@dataclass
class Run:
    """What the sketch did: its lines as rows, and what the simulator counted."""

    rows: list = field(default_factory=list)
    truth: list = field(default_factory=list)
    comments: list = field(default_factory=list)
    report: Report | None = None

    def column(self, name):
        return np.array([row[name] for row in self.rows])


@pytest.fixture(scope="module")
def programs(build_sketch, example, root):
    """The sketch for the chips that have room for it."""
    folder = root / "firmware/library/examples/beacon_navigation"
    uno = build_sketch(folder, board=sketch.UNO)
    return {"atmega2560": example("beacon_navigation").elf, "atmega328p": uno.elf}


def motion_of(sample, speed, heading):
    return telemetry.frame(
        f"MOTION,{sample},{telemetry.decimal(speed, 4)},{telemetry.decimal(heading, 5)}"
    )


def range_of(sample, range_m):
    return telemetry.frame(f"RANGE,{sample},{telemetry.decimal(range_m, 3)}")


def sound_motion(sample, speed, heading):
    return [(0.01, motion_of(sample, speed, heading))]


def sound_range(sample, range_m):
    return [(DELAY_S, range_of(sample, range_m))]


@pytest.fixture
def play(board, programs):
    """Return a function that runs the sketch with a vehicle that turns among the beacons.

    ``motion(sample, speed, heading)`` and ``answer(sample, range)`` give the answers to a request:
    pairs of the delay after it (s) and the text.
    """

    def play(samples, motion=sound_motion, answer=sound_range, mcu="atmega2560"):
        run, reader = Run(), telemetry.Reader()
        random = np.random.default_rng(1)
        x, y, heading = 12.0, 9.0, 0.3
        with board(programs[mcu], mcu=mcu, limit_s=samples + 10.0) as running:
            for event in running:
                assert isinstance(event, SerialLine), event
                sample = telemetry.requested_sample(event.text, "ODO")
                if sample is not None:
                    heading += 0.02
                    x, y = x + math.cos(heading), y + math.sin(heading)
                    run.truth.append((x, y))
                    read = 1 + random.normal(0, 0.05), heading + random.normal(0, 0.03)
                    answers = motion(sample, *read)
                elif event.text.startswith("$INTERROGATE,"):
                    sample, beacon = map(int, telemetry.body_of(event.text).split(",")[1:])
                    assert beacon == sample % 3
                    away = math.dist((x, y), BEACONS[beacon])
                    answers = answer(sample, away + random.normal(0, 0.5))
                else:
                    row = reader.read(event.text)
                    (run.rows if isinstance(row, dict) else run.comments).append(row or event.text)
                    if len(run.rows) == samples:
                        break
                    continue
                for delay_s, text in answers:
                    running.send(text, delay_s)
        run.report = running.report
        return run

    return play


def assert_same_bits(run):
    """Every number of every line is the desk's; they are floats, so equality means equal bits."""
    desk = Ekf(
        np.float32([10, 10]),
        np.float32(25) * np.eye(2),
        process=SpeedHeading(sigma_forward=0.05, sigma_heading=0.05),
        sensors=LeaderRange(sigma_range_m=0.5),
        kernel=Igg(k0=1.5, k1=3.0),
        recovery=RejectionStreak(),
        late_s=8.0,
        dtype="float32",
    )
    u = [1.0, 0.0, 0.0]
    for row in run.rows:
        if math.isfinite(row["speed_m_s"]):
            u = [row["speed_m_s"], 0.0, row["heading_rad"]]
        desk.predict(row["dt_s"], u)
        wanted = {"nis": math.nan, "weight": math.nan}
        if math.isfinite(row["nis"]):
            desk.update(row["range_m"], place=BEACONS[int(row["beacon"])], age_s=row["age_s"])
            wanted = {"nis": desk.report.nis, "weight": desk.report.weight[0]}
        wanted |= {"x_m": desk.x[0], "y_m": desk.x[1], "P00_m2": desk.P[0, 0]}
        wanted |= {"P10_m2": desk.P[1, 0], "P11_m2": desk.P[1, 1]}
        for name, value in wanted.items():
            assert row[name] == value or (row[name] != row[name] and value != value), (
                f"sample {row['sample']:.0f}, {name}: {row[name]!r} on the chip, {value!r} here"
            )


def test_late_ranges_with_the_bits_of_the_desk(play):
    run = play(samples=61)
    assert_same_bits(run)
    ages = run.column("age_s")
    assert np.isnan(ages[:3]).all(), "the first range is under way"
    assert (ages[3:] == 3).all(), "taken at the first sample after 2.3 s"
    assert run.column("beacon")[3:].tolist() == [k % 3 for k in range(1, 59)]
    for counter in ("missed", "refused", "implausible", "late", "status"):
        assert not run.column(counter).any(), counter
    error = np.hypot(*(np.stack([run.column("x_m"), run.column("y_m")], axis=1) - run.truth).T)
    sigma = np.sqrt(run.column("P00_m2") + run.column("P11_m2"))
    assert error[20:].max() < 1.5  # 3 sigma of one range
    assert sigma[20:].max() < 0.6
    assert run.column("gated")[-1] <= 2  # of 58 with a gate of 3 sigma
    assert run.report.serial_overruns == 0
    assert run.report.awake_share < 0.05
    (remark,) = (text for text in run.comments if isinstance(text, str) and "RAM" in text)
    assert int(re.search(r"\d+", remark)[0]) == run.report.free_bytes


def test_an_uno_says_the_same(play):
    mega, uno = play(samples=20), play(samples=20, mcu="atmega328p")
    for there, here in zip(mega.rows, uno.rows, strict=True):
        del there["awake_us"], here["awake_us"]
        np.testing.assert_equal(here, there)
    print(f"UNO: stack {uno.report.stack_bytes} B, never used {uno.report.free_bytes} B")
    assert uno.report.free_bytes >= 100


#: What comes instead of a reading: the answers, lines refused, readings missed and implausible.
READINGS = {
    "nothing": (lambda *_: [], 0, 1, 0),
    "wrong checksum": (lambda *z: [(0.01, motion_of(*z) + "0")], 1, 1, 0),
    "another sample": (lambda n, v, h: [(0.01, motion_of(n - 1, v, h))], 1, 1, 0),
    "one number": (lambda n, v, _: [(0.01, telemetry.frame(f"MOTION,{n},{v:.3f}"))], 1, 1, 0),
    "no number": (lambda n, *_: [(0.01, telemetry.frame(f"MOTION,{n},nan,0.5"))], 1, 1, 0),
    "another instrument": (lambda *_: [(0.01, telemetry.frame("GPGGA,123519"))], 1, 1, 0),
    "too late": (lambda *z: [(0.3, motion_of(*z))], 0, 1, 0),
    "too fast": (lambda n, _, h: [(0.01, motion_of(n, 3.5, h))], 0, 0, 1),
    "too fast a change": (lambda n, v, h: [(0.01, motion_of(n, v - 2.5, h))], 0, 0, 1),
    "degrees": (lambda n, v, _: [(0.01, motion_of(n, v, 57.0))], 0, 0, 1),
    "turned round": (lambda n, v, h: [(0.01, motion_of(n, v, h + 2.0))], 0, 0, 1),
    "a turn more": (lambda n, v, h: [(0.01, motion_of(n, v, h - 2 * math.pi))], 0, 0, 0),
}


def test_a_wrong_reading_costs_a_reading(play):
    """Each fault meets one sample, the reading before stands for it; it is counted and named."""
    at = {3 + 2 * i: fault for i, fault in enumerate(READINGS.values())}

    def motion(sample, *read):
        return at[sample][0](sample, *read) if sample in at else sound_motion(sample, *read)

    run = play(motion=motion, samples=4 + 2 * len(READINGS))
    assert_same_bits(run)
    counts = {name: run.column(name) for name in ("refused", "missed", "implausible")}
    for name, (sample, (_, *wanted)) in zip(READINGS, at.items(), strict=True):
        found = [column[sample - 1] - column[sample - 2] for column in counts.values()]
        assert found == wanted, name
        row = run.rows[sample - 1]
        assert math.isnan(row["speed_m_s"]) == any(wanted), name
        assert row["status"] == (IMPLAUSIBLE if wanted[2] else 0), name
    for column, total in zip(
        counts.values(), zip(*(f[1:] for f in READINGS.values()), strict=True), strict=True
    ):
        # The reading that came too late is refused at the sample after it.
        assert column[-1] in (sum(total), sum(total) + 1)


#: What comes instead of a range: the answers; what the filter makes of it; lines refused.
RANGES = {
    "nothing": (lambda *_: [], "", 0),
    "wrong checksum": (lambda *z: [(DELAY_S, range_of(*z) + "0")], "", 1),
    "no number": (lambda n, _: [(DELAY_S, telemetry.frame(f"RANGE,{n},inf"))], "", 1),
    "two numbers": (lambda n, r: [(DELAY_S, telemetry.frame(f"RANGE,{n},{r:.3f},1"))], "", 1),
    "not yet asked": (lambda n, r: [(DELAY_S, range_of(n + 9, r))], "", 1),
    "twice": (lambda *z: [(DELAY_S, range_of(*z)), (2.4, range_of(*z))], "taken", 1),
    "half a second later": (lambda *z: [(2.8, range_of(*z))], "taken", 0),
    "a second later": (lambda *z: [(3.5, range_of(*z))], "taken", 0),
    "too late": (lambda *z: [(8.5, range_of(*z))], "", 1),
    "no echo": (lambda n, _: [(DELAY_S, range_of(n, 9999.0))], "implausible", 0),
    "negative": (lambda n, _: [(DELAY_S, range_of(n, -1.0))], "implausible", 0),
    "far off": (lambda n, r: [(DELAY_S, range_of(n, r + 40.0))], "implausible", 0),
    "an outlier": (lambda n, r: [(DELAY_S, range_of(n, r + 5.0))], "gated", 0),
}


def test_a_wrong_range_costs_a_range(play):
    """Each fault meets one range: it is named and counted, and the estimate is the desk's."""
    at = {12 + 2 * i: fault for i, fault in enumerate(RANGES.values())}

    def answer(sample, range_m):
        return (at[sample][0] if sample in at else sound_range)(sample, range_m)

    run = play(answer=answer, samples=47)
    assert_same_bits(run)
    rows = {row["sample"] - row["age_s"]: row for row in run.rows if row["age_s"] > 0}
    for name, (sample, (_, fate, _)) in zip(RANGES, at.items(), strict=True):
        assert (sample in rows) == bool(fate), name
        if not fate:
            continue
        row = rows[sample]
        assert (row["status"] == IMPLAUSIBLE) == (fate == "implausible"), name
        assert math.isfinite(row["nis"]) == (fate != "implausible"), name
        if fate != "implausible":
            assert (row["weight"] == 0) == (fate == "gated"), name
            assert (row["nis"] >= 9) == (fate == "gated"), name
        # Behind a range that came before it, it waits for a sample of its own.
        assert row["age_s"] == (5 if name == "a second later" else 3), name
    last = run.rows[-1]
    fates = [fate for _, fate, _ in RANGES.values()]
    assert last["refused"] == sum(lines for *_, lines in RANGES.values())
    assert last["implausible"] == fates.count("implausible")
    assert last["gated"] == fates.count("gated")
    assert last["missed"] == fates.count("")
    assert np.count_nonzero(run.column("status")) == fates.count("implausible")


def test_a_vehicle_that_is_elsewhere_is_found_again(play):
    """Ranges that agree with each other, and not with the estimate: it is widened, and follows."""

    def answer(sample, range_m):
        return sound_range(sample, range_m + (5.0 if sample > 10 else 0.0))

    run = play(answer=answer, samples=40)
    assert_same_bits(run)
    sigma = np.sqrt(run.column("P00_m2") + run.column("P11_m2"))
    gated = run.column("weight") == 0
    assert gated[13:17].all(), "what contradicts is not believed"
    assert sigma[17:24].max() > 3 * sigma[12], "but they agree with each other"
    assert not gated[-6:].all(), "and so they are believed"


def test_capture_records_it(programs, runner, tmp_path, monkeypatch):
    """With nobody who answers: the table has every sample, and all of its columns."""
    monkeypatch.setenv("AUVEST_BOARD", str(runner))
    call = ["capture", "--simulator", str(programs["atmega2560"]), "--output", str(tmp_path)]
    result = CliRunner().invoke(app, [*call, "--steps", "12", "--no-figure", "--json"])
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)["results"]
    assert values["samples"] == 12
    # Twelve readings, and the interrogations that the ninth and later ones have taken the place of.
    assert values["missed"] == 12 + 4
    assert values["not_ok"] == 0
    header = (tmp_path / "record.csv").read_text().splitlines()[0]
    assert header.startswith(
        "section,sample,time_s,dt_s,speed_m_s,heading_rad,beacon,range_m,age_s,"
    )
