"""`auvest hil`: rows of a log, the program for them, this computer as target, and the line.

The chips' legs are in tests/firmware.
"""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import family_support
import numpy as np
import pyarrow.parquet as pa_parquet
import pytest
from test_replay import SETTINGS, increments_log
from test_replay_slat import EXACT, sea
from typer.testing import CliRunner

import auvest
from auvest import telemetry
from auvest.cli import app
from auvest.firmware import hil, hil_bench, hil_serial, hil_slat, hil_trace
from auvest.firmware.cost import registered
from auvest.firmware.hil_bench import ANEW, Bench, answer_of, bench, row_frame
from auvest.firmware.hil_record import Record, place_names
from auvest.logs import LogFolder
from auvest.replay import settings_from
from auvest.replay.engine import replay_of
from firmware.hil_line import BENCHES, Noise, served

CONFIG = """[start]
sigma_position_m = 0.5
sigma_heading_rad = 0.1
[odometry]
sigma_distance = 0.1
sigma_drift = 0.05
sigma_turn = 0.02
[ranges]
sigma_m = 0.3
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of 20 s with an outlier, and beside it its settings."""
    folder = tmp_path_factory.mktemp("hil") / "log"
    folder.mkdir()
    increments_log(folder)
    (folder.parent / "log.toml").write_text(CONFIG)
    return folder


@pytest.fixture(scope="module")
def record(log: Path) -> Record:
    return hil.record_of(LogFolder(log), SETTINGS)


def family_record(kind: type[Any], name: str, **options: Any) -> Record:
    """The record of the filters' tests: sensors in turn, missing rows, outliers, moved stations."""
    filter_ = family_support.make(kind, name, "float32", **options)
    given = family_support.record(filter_.process)
    names = list(filter_.sensors)
    driven = np.empty((len(given), 0)) if given.input is None else given.input
    columns = (given.dt, given.z, driven, given.place)
    return Record(
        filter_,
        tuple(filter_.sensors.values()),
        np.array([names.index(name) for name in given.sensor]),
        *(np.asarray(column, np.float32) for column in columns),
    )


def call(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["hil", *arguments])


# ---- Rows and the desk ---------------------------------------------------------------------------


def test_rows_are_those_that_a_replay_gives_to_its_filter(log: Path, record: Record) -> None:
    """In float64 the same rows give the estimates that the replay writes down."""
    from auvest.replay.engine import Localiser

    replayed = Localiser(LogFolder(log), SETTINGS, "robust-ekf")
    estimates = np.concatenate([b.estimates["x_m"] for b in replayed.batches()])
    assert len(record) == 40 + 20  # a row per step, and one per range at its end
    assert record.measured.sum() == 20
    assert record.dt.sum() == 20
    desk = record.on_desk()
    x = desk[1:, 1].view(np.float32)
    ends = np.append(np.flatnonzero(record.dt[1:] > 0), len(record) - 1)  # last rows of their times
    np.testing.assert_allclose(x[ends], estimates, atol=1e-3)


def test_the_desk_is_the_filter_in_float32(record: Record) -> None:
    """The same bits as `run` gives, rows without measurement included."""
    filter_ = auvest.RobustEkf(
        record.filter.x, record.filter.P, process=record.filter.process,
        sensors=record.sensors, dtype="float32",
    )  # fmt: skip
    result = filter_.run(
        record.z, dt=record.dt, input=record.input, place=record.place,
        sensor=record.sensors[0],
    )  # fmt: skip
    desk = dict(zip(record.fields, record.on_desk().T, strict=True))
    nan = np.full(1, np.nan, np.float32)
    assert np.array_equal(desk["x[y_m]"][1:], result.x[:, 1].copy().view(np.uint32))
    assert np.array_equal(desk["nis"], np.concatenate([nan, result.nis]).view(np.uint32))
    weight = np.concatenate([nan, result.weight[:, 0]])
    assert np.array_equal(desk["weight[0]"], weight.view(np.uint32))
    assert np.array_equal(desk["status"][1:] >> 8 & 0xFF, result.decision)
    assert int(auvest.Decision.rejected) in result.decision  # the outlier


def test_so_many_rows_as_are_wanted(log: Path) -> None:
    assert len(hil.record_of(LogFolder(log), SETTINGS, rows=7)) == 7


@pytest.mark.parametrize("name", ["slatf2", "slatf-joint", "ekf-slat"])
def test_rows_of_echoes_are_those_that_a_replay_gives_to_its_filter(
    name: Any, tmp_path: Path
) -> None:
    """In float32 the same bits; masters come in when they are first heard."""
    sea(tmp_path, sources=(7, 3))
    options = {"slat": {"particles": 40, "max_masters": 2}, "filter": {"dtype": "float32"}}
    settings = settings_from({**EXACT, **options})
    record = hil.record_of(LogFolder(tmp_path), settings, name)
    assert isinstance(record, hil_slat.SlatRecord)
    newcomers = [k for k, row in enumerate(record.rows) if isinstance(row, hil_slat.Newcomer)]
    assert len(newcomers) == record.room == 2
    assert newcomers[0] > 0
    assert max(len(row.z) for row in record.rows if isinstance(row, hil_slat.Step)) == 2
    engine = replay_of(LogFolder(tmp_path), settings, name)
    wanted = np.concatenate([b.estimates["y_m"] for b in engine.batches()]).astype(np.float32)
    found = record.on_desk()[1:, record.fields.index("slave x[y]")].view(np.float32)
    assert not record.on_desk()[:, 0].any()
    np.testing.assert_array_equal(found[record.dt > 0], wanted)
    few = hil.record_of(LogFolder(tmp_path), settings, name, rows=7)
    assert len(few) == 7
    assert len(bench(few).rows) == 8


def test_a_log_of_echoes_on_this_computer(tmp_path: Path) -> None:
    (tmp_path / "log").mkdir()
    sea(tmp_path / "log")
    settings = "[slat]\nparticles = 20\ncovariance = 'shared'\n[slave]\nsigma_speed_m_s = 0.05\n"
    (tmp_path / "log.toml").write_text(settings)
    done = call(str(tmp_path / "log"), "--config", str(tmp_path / "log.toml"), "--flags", "-O0",
                "--output", str(tmp_path / "out"), "--rows", "60", "--json")  # fmt: skip
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    (leg,) = document["legs"]
    assert document["filter"] == "slatf-joint"
    assert (leg["rows"], leg["differing"]) == (60, 0)
    table = pa_parquet.read_table(tmp_path / "out" / "host.parquet")
    assert table["time_s"][-1].as_py() == pytest.approx(5.9, abs=0.11)
    assert "decision" not in table.column_names
    weights = [table[f"weight[{i}]"][-1].as_py() for i in range(20)]
    assert sum(weights) == pytest.approx(1, rel=1e-5)


def test_the_names_of_a_place_are_those_of_the_core() -> None:
    assert place_names(auvest.LeaderRange()) == ["leader_x_m", "leader_y_m"]
    assert place_names(auvest.BodyVelocity()) == ["heading_rad"]
    assert place_names(auvest.Depth()) == []


@pytest.mark.parametrize("name", family_support.BUILT_IN)
def test_a_program_is_written_for_every_process_and_its_sensors(name: str) -> None:
    record = family_record(auvest.Ckf, name)
    program = bench(record)
    assert "@" not in program.header
    types = {registered()[model.core_name] for model in record.sensors}
    assert program.header.count("using Sensor") == len(types)
    assert len(program.rows) == len(record) + 1
    assert f"kDigest = 0x{program.digest:08x}" in program.header


def test_another_parameter_is_another_program(record: Record) -> None:
    sensors = tuple(replace(model, sigma_range_m=0.31) for model in record.sensors)
    assert bench(replace(record, sensors=sensors)).digest != bench(record).digest


def test_a_model_that_the_registry_does_not_have_is_named() -> None:
    assert hil_bench._type("BodyVelocity3", 5) == "auvest::BodyVelocity<float, 5, 3>"
    with pytest.raises(ValueError, match=r"^Drifter is no model of the registry"):
        hil_bench._type("Drifter", 4)


def test_a_trace_has_the_parts_of_a_status_word(tmp_path: Path, record: Record) -> None:
    """From the lowest byte: status, decision, near field, recovered."""
    words = np.zeros((len(record) + 1, len(record.fields)), np.uint32)
    words[1, 0], words[2, 0], words[3, 0] = 0x01_00_02_0E, 0x00_01_00_00, 0x00_00_10_F1
    words[2, 1] = 0x3FC00000  # 1.5
    hil_trace.write_trace(tmp_path / "trace.parquet", record, words, None)
    told = pa_parquet.read_table(tmp_path / "trace.parquet").slice(0, 4).to_pydict()
    assert told["status"] == [0, 14, 0, 0xF1]  # also of a target that answers what none may
    assert told["decision"] == [0, 2, 0, 16]
    assert told["near_field"] == [False, False, True, False]
    assert told["recovered"] == [False, True, False, False]
    assert told[record.fields[1]] == [0.0, 0.0, 1.5, 0.0]
    np.testing.assert_allclose(told["time_s"], np.concatenate([[0], np.cumsum(record.dt[:3])]))


def test_a_record_that_cannot_be_is_refused() -> None:
    options: dict[str, Any] = {"process": auvest.Odometry(), "sensors": auvest.LeaderRange()}
    rows = (np.zeros(1, int), *(np.zeros((1, n), np.float32) for n in (1, 1, 3, 2)))
    age = np.zeros(1, np.float32)
    for more, ages, message in (
        ({}, None, "must be in float32"),
        ({"dtype": "float32"}, age, "age is for a filter with late_s"),
        ({"dtype": "float32", "late_s": 1.0}, np.zeros(2, np.float32), "number of rows"),
    ):
        filter_ = auvest.Ekf([0, 0, 0], np.eye(3), **options, **more)
        with pytest.raises(ValueError, match=message):
            Record(filter_, (auvest.LeaderRange(),), *rows, ages)
    filter_ = auvest.Ekf([0, 0, 0], np.eye(3), **options, dtype="float32")
    nowhere = (*rows[:-1], np.full((1, 2), np.nan, np.float32))
    with pytest.raises(ValueError, match=r"^place\[0\] must be given: LeaderRange was made"):
        Record(filter_, (auvest.LeaderRange(),), *nowhere)


def test_late_measurements_of_a_log_are_played_with_their_age(log: Path) -> None:
    settings = replace(SETTINGS, ranges=replace(SETTINGS.ranges, latency_s=0.7))
    record = hil.record_of(LogFolder(log), settings)
    assert record.filter.late_s > 0
    assert record.age is not None
    assert 0 < record.age[record.measured].max() <= record.filter.late_s
    assert "LateMemory" in bench(record).header


# ---- The comparison ------------------------------------------------------------------------------


def test_the_first_difference_is_named_with_its_bits() -> None:
    here = np.array([[0, 0x3F800000, 0x80000000], [0, 0x40000000, 0x7FC00000]], np.uint32)
    names = ["status", "x[x_m]", "nis"]
    assert hil.first_difference(here.copy(), here, names) is None
    there = here.copy()
    there[1, 1] += 3
    found = hil.first_difference(there, here, names)
    assert found is not None
    assert (found.row, found.field, found.ulp) == (1, "x[x_m]", 3)
    assert str(found) == (
        "row 1, x[x_m]: 2.00000072 (40000003) there, 2 (40000000) on the desk, 3 ulp apart"
    )
    there[0, 2] = 1  # the smallest float beside -0
    found = hil.first_difference(there, here, names)
    assert found is not None
    assert (found.row, found.field, found.ulp) == (0, "nis", 1)
    there[0, 0] = 11
    found = hil.first_difference(there, here, names)
    assert found is not None
    assert (found.field, found.target, found.ulp) == ("status", 11, None)


def test_answers_that_are_not_one_per_row_are_no_comparison(record: Record) -> None:
    program = bench(record)
    answer = telemetry.frame("A," + ",".join(["00000000"] * 12))
    with pytest.raises(hil.HilError, match="answered 1 of 61 rows"):
        hil._table([answer], program, 10)
    with pytest.raises(hil.HilError, match="refuses row 0: "):
        hil._table([telemetry.frame("N,00000000")], program, 10)
    with pytest.raises(hil.HilError, match="no answer: not a whole line"):
        hil._table([answer[:-1] + "x"], program, 10)


# ---- This computer as target ---------------------------------------------------------------------


def test_a_log_on_this_computer(log: Path, record: Record, tmp_path: Path) -> None:
    output = tmp_path / "out"
    done = call(str(log), "--config", str(log.parent / "log.toml"), "--flags", "-O0",
                "--output", str(output), "--json")  # fmt: skip
    assert done.exit_code == 0, done.output
    (leg,) = json.loads(done.stdout)["legs"]
    assert (leg["target"], leg["rows"], leg["differing"]) == ("host", 60, 0)
    assert leg["numbers"] == 61 * (1 + 3 + 6 + 1 + 1)
    table = pa_parquet.read_table(output / "host.parquet")
    assert (output / "host.parquet").read_bytes() == (output / "desk.parquet").read_bytes()
    bits = np.ascontiguousarray(table["P[y_m, x_m]"].to_numpy()).view(np.uint32)
    assert np.array_equal(bits, record.on_desk()[:, record.fields.index("P[y_m, x_m]")])
    assert table["time_s"][-1].as_py() == 20
    assert json.loads((output / "results.json").read_text())["legs"] == [leg]
    assert (output / "bench" / "bench.ino").is_file()
    assert "| host | 732 | 0 |" in (output / "README.md").read_text()


def late(record: Record) -> Record:
    """The same with ages from 0 s to some that are too late."""
    age = 0.6 * (np.arange(len(record)) % 7)
    return replace(record, age=age.astype(np.float32))


def test_all_sensors_of_a_process_on_this_computer(tmp_path: Path) -> None:
    """Six sensors in turn, where the station moves, some late, a policy, parameters that are not
    the defaults; a row that must be refused is refused there too, and the rows go on."""
    record = late(family_record(
        auvest.Aukf, "WhiteAcceleration3", policy=auvest.CovarianceBudget(position_sigma_m=3.0),
        kernel=auvest.Igg(k0=1.2, k1=4.0), recovery=auvest.RejectionStreak(rejections=3),
        alpha=0.5, longest_step_s=0.9, late_s=3.0,
    ))  # fmt: skip
    desk = record.on_desk()
    status = auvest.Status
    said = {status(int(word) & 0xFF) for word in desk[:, 0]}
    assert said == {status.ok, status.step_too_long, status.time_backwards}  # dt: 0.5, 0.75, 1 s
    assert len({int(word) >> 8 & 0xFF for word in desk[:, 0]}) == 3  # every decision
    leg = hil.run(record, "host", tmp_path, desk=desk, flags=("-O0",))
    assert leg.difference is None
    assert leg.words.size == 61 * (1 + 6 + 21 + 1 + 3 + 1)


def test_a_start_that_is_not_known_on_this_computer(tmp_path: Path) -> None:
    """From a ring for each of two headings to one place; late measurements all the same."""
    lost = family_support.make_lost(
        auvest.RobustEkf, "Odometry", "float32", headings=2, components=16, late_s=3.0
    )
    record = late(replace(family_record(auvest.RobustEkf, "Odometry", late_s=3.0), filter=lost))
    desk = record.on_desk()
    components = desk[:, record.fields.index("components")].view(np.float32)
    assert components[0] == 2
    assert components.max() > 8
    assert components.min() == 1
    assert len(set(desk[:, record.fields.index("convergence")].tolist())) > 2
    leg = hil.run(record, "host", tmp_path, desk=desk, flags=("-O0",))
    assert leg.difference is None


@pytest.mark.skipif(
    sys.platform != "linux" or " fma " not in Path("/proc/cpuinfo").read_text(),
    reason="this processor has no fused multiply-add",
)
def test_fused_multiply_add_is_named_at_its_first_row(log: Path, tmp_path: Path) -> None:
    done = call(str(log), "--config", str(log.parent / "log.toml"), "--json", "--output",
                str(tmp_path / "out"), "--flags", "-mfma -ffp-contract=fast")  # fmt: skip
    assert done.exit_code == 1
    (leg,) = json.loads(done.stdout)["legs"]
    first = leg["difference"]
    assert leg["differing"] > 100
    assert 1 <= first["row"] <= 2
    assert 1 <= first["ulp"] <= 8
    said = " ".join(done.stderr.split())
    assert f"host differs from row {first['row']}, {first['field']}: " in said


# ---- The line ------------------------------------------------------------------------------------


def test_rows_come_through_a_line_that_damages_loses_and_doubles(
    record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hil_serial, "PATIENCE_S", 0.3)
    program, noise = bench(record), Noise(0.2, seed=3)
    with BENCHES["host"](program, tmp_path) as (first, answer):
        assert answer_of(first) == ("B", [program.digest, 0])
        start, row, later = program.rows[:3]
        # No other digit, letter or end of a row is taken, nor a row that is not the next.
        for k, old in enumerate(start):
            new = "$" if old == "R" else "0" if old != "0" else "1"
            assert answer_of(answer(start[:k] + new + start[k + 1 :])) == ("N", [0])
        for wrong in (row, row_frame(0, 1), start[:-9], f"{start}0", row_frame(*range(60))):
            assert answer_of(answer(wrong)) == ("N", [0])
        once = answer(f"half a line{start}\r")
        assert answer_of(once)[0] == "A"
        assert answer(start) == once
        assert answer_of(answer(later)) == ("N", [1])
        taken = answer(row)
        assert answer_of(taken)[1][0] == 1
        assert answer(row) == taken
        assert answer_of(answer(start)) == ("N", [2])
        with served(answer(row_frame(ANEW)), answer, noise) as line:
            leg = hil.run(record, f"serial:{line.port}", tmp_path)
    assert leg.difference is None
    assert noise.damaged > 15
    assert leg.figures["repeated_rows"] > 5


class Script:
    """A line whose other end says what is written here; None: nothing, for too long."""

    def __init__(self, *said: str | None) -> None:
        self.said, self.sent = list(said), []  # type: ignore[var-annotated]

    def write(self, line: str) -> None:
        self.sent.append(line)

    def read(self, until_s: float) -> str | None:
        del until_s
        return self.said.pop(0) if self.said else None


def says(kind: str, *words: int) -> str:
    return telemetry.frame(",".join([kind, *(f"{word:08x}" for word in words)]))


PROGRAM = Bench("", 0x1234, [row_frame(0, 5), row_frame(1, 6)])
BOOT = says("B", 0x1234, 0)


def test_a_row_is_sent_again_until_its_own_answer_comes() -> None:
    line = Script(
        BOOT, says("N", 0), "$A,garbage", None, says("A", 0, 7), says("A", 0, 7), says("A", 0, 7),
        f"half a line{says('A', 1, 8)}",
    )  # fmt: skip
    figures: dict[str, int] = {}
    assert hil_serial.play(line, PROGRAM, figures) == [says("A", 0, 7), says("A", 1, 8)]
    assert line.sent == [PROGRAM.rows[0]] * 4 + [PROGRAM.rows[1]]
    assert figures == {"damaged_frames": 2, "repeated_rows": 3}


def test_a_board_that_has_not_restarted_is_asked_to_begin_anew() -> None:
    line = Script(None, says("A", 9, 7), BOOT, says("A", 0, 7), says("A", 1, 8))
    assert len(hil_serial.play(line, PROGRAM, {})) == 2
    assert line.sent == [row_frame(ANEW), *PROGRAM.rows]


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ((says("B", 0x1235, 0),), "the board runs the bench 00001235, not 00001234"),
        ((), "no bench answers: load the sketch bench"),
        ((BOOT, says("A", 0, 7), BOOT), "started anew at row 1"),
        ((BOOT, says("A", 0, 7), says("N", 0)), "started anew at row 1"),
        ((BOOT, says("A", 0, 7)), "row 1 was sent 20 times"),
    ],
)
def test_what_is_wrong_with_a_board_is_said(said: tuple[str, ...], message: str) -> None:
    with pytest.raises(hil_serial.LineLost, match=message):
        hil_serial.play(Script(*said), PROGRAM, {})


@pytest.mark.parametrize(
    "line", [says("A", 1)[:-1], "$A,1*7c7f5f32", telemetry.frame("A,0000000g")]
)
def test_what_is_no_answer_is_refused(line: str) -> None:
    with pytest.raises(telemetry.LineError):
        answer_of(line)


# ---- What is missing -----------------------------------------------------------------------------


def test_wrong_usage_names_the_option(log: Path, tmp_path: Path) -> None:
    output = ("--output", str(tmp_path / "out"))
    for arguments, words in (
        (
            ("--target", "avr"),
            "'avr' is not host, atmega2560, cortex-m3, cortex-m4f or serial:PORT",
        ),
        (("--target", "atmega2560", "--flags", "-O0"), "flags are not for atmega2560"),
        (("--filter", "aukf"), "filter aukf chooses when to take a fix"),
        (("--rows", "0"), "--rows"),
    ):
        done = call(str(log), *arguments, *output)
        assert done.exit_code == 2, done.output
        assert words in " ".join(done.stderr.replace("│", " ").split())
    assert call(str(tmp_path / "no log"), *output).exit_code == 2
    assert not (tmp_path / "out").exists()


def test_what_is_not_installed_is_named(
    record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(hil.HilError, match="compiling for this computer failed"):
        hil.run(record, "host", tmp_path, flags=("-fno-such-flag",))
    monkeypatch.setattr(hil.shutil, "which", lambda name: None if "qemu" in name else "/bin/true")
    with pytest.raises(hil.HilError, match="apt install qemu-system-arm"):
        hil.run(record, "cortex-m3", tmp_path)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(hil.HilError, match="apt install gcc-arm-none-eabi"):
        hil.run(record, "cortex-m3", tmp_path)
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(hil_serial.LineLost, match=r"pip install 'auvest\[serial\]'"):
        hil.run(record, "serial:/dev/ttyACM0", tmp_path)


def test_what_fails_on_a_chip_is_named_with_its_target(
    record: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the name that was asked for, not by that of the machine which QEMU has for it."""
    monkeypatch.setattr(hil.shutil, "which", lambda _: "/bin/true")
    asked = []

    def call(command: list[str], what: str) -> None:
        asked.append((Path(command[0]).name, what))
        if command[0].startswith("qemu"):
            raise hil.HilError(f"{what} failed")

    monkeypatch.setattr(hil, "_call", call)
    with pytest.raises(hil.HilError, match="running on cortex-m4f failed"):
        hil.run(record, "cortex-m4f", tmp_path)
    compiler, emulator = asked
    assert compiler == ("arm-none-eabi-g++", "compiling for cortex-m4f")
    assert emulator == ("qemu-system-arm", "running on cortex-m4f")


def test_a_port_that_is_not_there_leaves_the_sketch(log: Path, tmp_path: Path) -> None:
    output = tmp_path / "out"
    done = call(str(log), "--target", "serial:/dev/no-such-port", "--output", str(output))
    assert done.exit_code == 1
    assert "the sketch bench is in" in " ".join(done.stderr.split())
    assert "#define AUVEST_BENCH_SERIAL 1" in (output / "bench" / "bench.ino").read_text()
