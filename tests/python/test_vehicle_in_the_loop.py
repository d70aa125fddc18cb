"""The vehicle of `auvest mission`: its lines, its world, and the command at a port with a board.

The real sketch on the simulated board is in tests/firmware/test_mission.py.
"""

from __future__ import annotations

import itertools
import json
import math
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kept import Kept, written
from typer.testing import CliRunner

from auvest import mission_line, telemetry
from auvest._core import PilotMode, StatusError
from auvest.cli import app
from auvest.commands.mission import _table
from auvest.simulation import mission, vehicle_in_the_loop
from auvest.simulation.vehicle_in_the_loop import (
    ChipFlight,
    ChipTwin,
    Vehicle,
    VehicleError,
    chip_mission,
    fly_on_desk,
    new_pilot,
)
from auvest.telemetry import LineError

# ---- Lines ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5", 1.5),
        ("-0.25", -0.25),
        ("0.1", np.float32(1) / np.float32(10)),
        (".5", 0.5),
        ("7.", 7.0),
        ("-.125", -0.125),
        ("123456789", np.float32(123456789)),
        ("0.00000001", np.float32(1) / np.float32(1e8)),
    ],
)
def test_numbers_are_digits_over_a_power_of_ten(text: str, value: float) -> None:
    assert telemetry.number(text).tobytes() == np.float32(value).tobytes()


@pytest.mark.parametrize(
    "text", ["", "-", ".", "nan", "inf", "1e3", "+1", "1.2.3", "--1", " 1", "1234567890", "0x1"]
)
def test_what_is_no_number(text: str) -> None:
    with pytest.raises(LineError, match="not a number of up to nine digits"):
        telemetry.number(text)


def test_readings_come_back_to_half_a_digit() -> None:
    values = np.array([-3.14159265, 0.0123456, -0.104719, 0.0000049, 1.49996, -0.05004, 5.0123])
    lines = mission_line.readings(17, values)
    assert [line.split(",")[0] for line in lines] == ["$COMPASS", "$GYRO", "$LOG", "$DEPTH"]
    listener = mission_line.Listener()
    listener.begin(17)
    assert all(map(listener.take, lines))
    assert listener.heard == mission_line.ALL_HEARD
    digits = np.array([1e-5] * 4 + [1e-4] * 2 + [1e-3])
    assert (np.abs(listener.values - values) <= 0.5 * digits + 1e-6).all()


def test_a_sensor_without_a_reading_says_nothing() -> None:
    values = np.array([0.1, np.nan, 0.0, 0.0, np.nan, np.nan, 5.0])
    lines = mission_line.readings(3, values)
    assert [line.split(",")[0] for line in lines] == ["$GYRO", "$DEPTH"]


def test_a_listener_takes_what_is_due_and_nothing_twice() -> None:
    listener = mission_line.Listener()
    listener.begin(4)
    gyro = telemetry.frame("GYRO,4,0.1,0.2")
    assert listener.take(gyro)
    refused = [
        gyro,
        telemetry.frame("LOG,3,1.5,0"),
        telemetry.frame("LOG,4,1.5"),
        telemetry.frame("LOG,-4,1.5,0"),
        telemetry.frame("FIX,5,10,0.5,0"),
        telemetry.frame("FIX,4,10,0.5"),
        telemetry.frame("GPGGA,4,1,2"),
        gyro[:-1],
    ]
    assert not any(map(listener.take, refused))
    assert listener.refused == len(refused)
    assert listener.heard == 2
    early = [mission_line.fix(k, 10.0, 0.5, 0.0) for k in (1, 2, 3)]
    assert list(map(listener.take, early)) == [True, True, False]
    assert [fix.sample for fix in listener.fixes] == [1, 2]
    listener.close()
    assert not listener.take(telemetry.frame("DEPTH,4,5.0"))


def test_requests_and_commands() -> None:
    assert mission_line.is_ready(telemetry.frame("READY"))
    assert mission_line.request(telemetry.frame("SENSE,9,1")) == mission_line.Request(9, True)
    assert mission_line.request(telemetry.frame("SENSE,9,0")) == mission_line.Request(9, False)
    bits = [struct.pack(">f", value).hex() for value in (0.125, -0.5, 15.0)]
    line = telemetry.frame(",".join(["STEER", "9", *bits]))
    assert mission_line.command(line) == mission_line.Command(9, (0.125, -0.5, 15.0))
    for other in (line[:-1], line.replace("9", "8"), telemetry.frame("STEER,9"), "", "# STEER"):
        assert mission_line.command(other) is None
        assert mission_line.request(other) is None


# ---- The world -----------------------------------------------------------------------------------


def test_the_pilot_in_its_world_is_the_simulated_mission_to_the_bit() -> None:
    """Sensors, filter, guidance, control and hull, 800 s: no command differs in a bit."""
    plan = chip_mission(runs=2, usbl_outliers=0.05)
    expected = mission.simulate(plan, workers=1)
    for run in range(2):
        flown = fly_on_desk(plan, run, rounded=False, delay_s=0.0)
        assert flown.finished
        assert len(flown.command) == round(expected.duration_s[run] * 10)
        np.testing.assert_array_equal(flown.command, expected.command[run, : len(flown.command)])
        np.testing.assert_array_equal(flown.pose, expected.pose[run, : len(flown.pose)])
        first = fly_on_desk(plan, run, rounded=False, delay_s=0.0, samples=1_000)
        np.testing.assert_array_equal(first.pose, flown.pose[:1_000])
        assert flown.settled_rms_m() == pytest.approx(expected.settled_rms_m[run], abs=1e-6)
        assert flown.all_rms_m == pytest.approx(expected.all_rms_m[run], abs=1e-6)
        assert flown.position_rms_m == pytest.approx(expected.position_rms_m[run], abs=1e-6)


def test_text_and_delay_cost_less_than_two_centimetres() -> None:
    """8 seeds, in pairs: what a line adds to the cross-track error, each alone and together."""
    plan = chip_mission(runs=8)
    desk = mission.simulate(plan, record=False).settled_rms_m
    for rounded, delay_s in ((True, 0.0), (False, 0.02), (True, 0.02)):
        line = [
            fly_on_desk(plan, run, rounded=rounded, delay_s=delay_s).settled_rms_m()
            for run in range(8)
        ]
        difference = line - desk
        print(f"rounded {rounded}, {delay_s} s: {1e3 * difference.mean():+.2f} mm")
        assert abs(difference.mean()) < 0.02
        assert difference.any()


def test_what_the_sketch_chooses_is_not_to_be_had() -> None:
    with pytest.raises(ValueError, match="guidance is chosen in the sketch"):
        chip_mission(guidance="adaptive")


def test_a_pilot_refuses_a_plan_and_settings() -> None:
    plan = chip_mission()
    with pytest.raises(StatusError, match="outside its stated range"):
        new_pilot(plan, np.array([[0.0, 0.0], [5.0, 0.0]])).start(0.0, 0.0, 0.0)
    with pytest.raises(KeyError, match="unknown setting"):
        new_pilot(plan, hold=1.0)


def test_a_vehicle_notices_another_board() -> None:
    vehicle = Vehicle(chip_mission())
    assert vehicle.hear(telemetry.frame("READY"), 0.0) == [(0.0, vehicle.start_line)]
    assert len(vehicle.hear(telemetry.frame("SENSE,1,0"), 0.1)) == 4
    with pytest.raises(VehicleError, match="asks for sample 5, but 2 is due"):
        vehicle.hear(telemetry.frame("SENSE,5,0"), 0.2)
    with pytest.raises(VehicleError, match="begun anew"):
        vehicle.hear(telemetry.frame("READY"), 0.3)


# ---- A board at a port ---------------------------------------------------------------------------


COLUMNS = telemetry.frame(
    "COLUMNS,MISSION,sample#,time_s,mode#,awake_us#,refused#,missed#,implausible#,late#"
)


class PortWithPilot:
    """Stands for serial.Serial: a board whose sketch is the pilot on the desk."""

    samples = 1000
    wrong_at = 0
    silent_after = 10**9

    def __init__(self, *_: object, **__: object) -> None:
        self._pilot = new_pilot(chip_mission())
        self._twin = ChipTwin(self._pilot)
        self._out = [telemetry.frame("READY")]
        self._heard: list[str] = []

    def __enter__(self) -> PortWithPilot:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def readline(self) -> bytes:
        return (self._out.pop(0) + "\r\n").encode("latin-1") if self._out else b""

    def write(self, data: bytes) -> None:
        lines = data.decode("latin-1").split()
        if not lines:
            return
        if self._twin.listener.start is None:
            self._twin.start(lines[0])
            self._out.append(COLUMNS)
        else:
            command = list(self._twin.step(lines))
            k = self._twin.sample
            if k == self.wrong_at:
                command[0] += 1e-4
            bits = [struct.pack(">f", value).hex() for value in command]
            self._out.append(telemetry.frame(",".join(["STEER", str(k), *bits])))
            mode = int(self._pilot.mode)
            self._out.append(telemetry.frame(f"MISSION,{k},{k / 10},{mode},12000,0,0,0,0"))
        if self._twin.sample < self.silent_after:
            ping = int(self._pilot.wants_fix())
            self._out.append(telemetry.frame(f"SENSE,{self._twin.sample + 1},{ping}"))


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., tuple[int, dict, str]]:
    """Return a function that calls the command at a port with this board."""

    def call(board: type[PortWithPilot], *arguments: str) -> tuple[int, dict, str]:
        module = ModuleType("serial")
        module.Serial = board  # type: ignore[attr-defined]
        module.SerialException = OSError  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "serial", module)
        # A clock of its own: on a busy machine what the command takes would be the chip's delay.
        ticks = itertools.count()
        clock = SimpleNamespace(monotonic=lambda: 1e-6 * next(ticks))
        monkeypatch.setattr("auvest.commands.mission.time", clock)
        output = ["--output", str(tmp_path), "--json"]
        result = CliRunner().invoke(app, ["mission", "--port", "COM1", *arguments, *output])
        return result.exit_code, json.loads(result.stdout or "{}"), result.stderr

    return call


def test_a_board_at_a_port_flies_to_the_end(call: Callable[..., tuple[int, dict, str]]) -> None:
    code, document, error = call(PortWithPilot)
    assert code == 0, error
    values = document["results"]
    assert values["finished_runs"] == 1
    assert values["differing_commands"] == 0
    assert values["commands"] > 4000
    assert values["awake_share_by_board"] == pytest.approx(0.12, rel=1e-3)
    assert values["awake_share_simulated"] is None
    # The clock's few microseconds are the delay: what is left is the rounding.
    assert abs(values["difference_m"]) < 0.005
    assert values["largest_difference_m"] == abs(values["difference_m"])  # of one run
    assert Path(document["files"]["figure"]).stat().st_size > 10_000
    rows = Path(document["files"]["samples"]).read_text().splitlines()
    assert len(rows) > 4000
    assert rows[0].startswith("sample,north_m,east_m,depth_m,estimate_north_m")


def test_a_command_that_is_wrong_by_a_bit_is_told(
    call: Callable[..., tuple[int, dict, str]],
) -> None:
    class Wrong(PortWithPilot):
        wrong_at = 20

    code, document, error = call(Wrong, "--duration", "5", "--no-figure")
    assert code == 1
    assert document["results"]["differing_commands"] == 1
    assert "1 command of the chip is not that of its pilot here" in error


def test_a_board_that_falls_silent_keeps_its_samples(
    call: Callable[..., tuple[int, dict, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Silent(PortWithPilot):
        silent_after = 30

    monkeypatch.setattr("auvest.commands.mission.SILENCE_S", 0.2)
    code, document, error = call(Silent, "--no-figure")
    assert code == 1
    assert "no line for 0.2 s" in error
    assert document["results"]["samples"] == 30
    assert document["complete"] is False


def test_a_board_that_says_nothing(
    call: Callable[..., tuple[int, dict, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Mute(PortWithPilot):
        def readline(self) -> bytes:
            return b""

    monkeypatch.setattr("auvest.commands.mission.SILENCE_S", 0.2)
    code, document, error = call(Mute)
    assert (code, document) == (1, {})
    assert "the chip has not steered" in error


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give one of the two"),
        (["--port", "COM1", "--simulator", __file__], "give one of the two"),
        (["--port", "COM1", "--runs", "2"], "belongs to --simulator"),
        (["--simulator", __file__, "--baud", "9600"], "belongs to --port"),
    ],
)
def test_options_that_do_not_go_together(arguments: list[str], message: str) -> None:
    result = CliRunner().invoke(app, ["mission", *arguments])
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.replace("│", " ").split())


def test_runs_that_are_flown_are_not_flown_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kept: Kept
) -> None:
    """A board fails in run 1 of 3: the same command flies 1 and 2, and reports as of one go."""
    flown: list[int] = []
    failing = {1}

    def fly(_elf: Path, chip: ChipFlight, *, samples: int, progress: Callable[[], None]) -> None:
        run = chip.vehicle.run
        flown.append(run)
        chip.hear(telemetry.frame("READY"), 0.0)
        chip.hear(COLUMNS, 0.0)
        for k in range(1, samples + 1):
            chip.hear(telemetry.frame(f"SENSE,{k},{int(k % 5 == 0)}"), 0.1 * k)
            chip.hear(telemetry.frame(f"MISSION,{k},{k / 10},1,{900 * run},{run},0,0,2"), 0.1 * k)
            progress()
            if run in failing and k == 20:
                raise VehicleError("the board has begun anew")
        chip.vehicle.finish()
        chip.awake_share, chip.stack_bytes = 0.1 + 0.01 * run, 1000 + run

    monkeypatch.setattr("auvest.commands.mission.fly_simulated", fly)
    sketch = tmp_path / "sketch.elf"
    sketch.write_bytes(b"one")

    def call(name: str, seed: int = 1) -> tuple[int, str, dict]:
        output = ["--output", str(tmp_path / name), "--workers", "1", "--no-figure", "--json"]
        flight = ["--runs", "3", "--duration", "6", "--seed", str(seed)]
        result = CliRunner().invoke(app, ["mission", "--simulator", str(sketch), *flight, *output])

        return result.exit_code, result.stderr, json.loads(result.stdout)["results"]

    code, error, values = call("a")
    assert (code, flown) == (1, [0, 1])
    assert "begun anew; 1 of 3 runs are done and kept; the same command goes on" in error
    assert (values["runs"], values["samples"]) == (2, 60 + 19)  # the sample that failed is not over
    failing.clear()
    code, error, resumed = call("a")
    assert (code, flown) == (0, [0, 1, 1, 2]), error
    assert not (tmp_path / "a.runs").exists()
    flown.clear()
    whole = call("b")[2]
    assert flown == [0, 1, 2]
    assert resumed == whole
    assert whole["late"] == 6
    assert whole["lines_refused"] == 0 + 1 + 2
    assert whole["stack_bytes"] == 1002
    assert whole["awake_share_simulated"] == pytest.approx(0.11)
    assert whole["awake_share_by_board"] == pytest.approx((0 + 900 + 1800) * 1e-6 * 59 / (3 * 5.9))
    kept("mission.txt", written(tmp_path / "a"))
    runs = (tmp_path / "a" / "runs.csv").read_text()
    assert runs == (tmp_path / "b" / "runs.csv").read_text()
    assert (tmp_path / "a" / "samples.csv").read_text() == (
        tmp_path / "b" / "samples.csv"
    ).read_text()

    for changed in ("seed", "sketch"):  # of another experiment nothing is taken over
        failing.add(1)
        call("c")
        failing.clear()
        flown.clear()
        if changed == "sketch":
            sketch.write_bytes(b"two")
        call("c", seed=2 if changed == "seed" else 1)
        assert flown == [0, 1, 2], changed


def test_each_number_of_a_mission_has_its_row() -> None:
    counts = ("differing_commands", "commands", "readings_missed", "lines_refused", "implausible")
    counts += ("late", "damaged_lines", "stack_bytes", "finished_runs", "runs", "samples")
    values: dict[str, Any] = {name: 11 + k for k, name in enumerate(counts)}
    for k, name in enumerate(("settled_rms_m", "desk_settled_rms_m", "difference_m", "all_rms_m")):
        values |= {name: 1.5 + k, f"{name}_se": math.nan if k == 1 else 0.25}
    values |= {"largest_difference_m": 0.5, "by_rounding_m": 0.0625, "by_delay_m": -0.125}
    values |= {"position_rms_m": 0.375, "command_delay_s": 0.002, "longest_command_delay_s": 0.003}
    values |= {"awake_share_simulated": 0.125, "awake_share_by_board": 0.25}
    made = _table(values, "COM3")
    assert str(made.title) == "COM3: 19 of 20 runs to the end, 21 samples"
    rows = [[str(cell) for cell in column.cells] for column in made.columns[:2]]
    assert dict(zip(*rows, strict=True)) == {
        "cross-track RMS, settled / m": "1.5000 ± 0.2500",
        "the same without a chip / m": "2.5000",  # of one run nobody knows an error
        "difference / m": "3.5000 ± 0.2500",
        "  largest of a run / m": "0.5000",
        "  of text rounded / m": "+0.0625",
        "  of the command's delay / m": "-0.1250",
        "cross-track RMS, corners too / m": "4.5000 ± 0.2500",
        "position error of the estimate / m": "0.375",
        "commands that differ": "11 of 12",
        "time awake": "12.5 %",
        "deepest stack / B": "18",
        "sample to command, mean / ms": "2.0",
        "longest / ms": "3.0",
        "readings missed": "13",
        "lines refused": "14",
        "readings implausible": "15",
        "deadlines missed": "16",
        "lines damaged": "17",
    }
    values["awake_share_simulated"] = math.nan  # at a port
    rows = [[str(cell) for cell in column.cells] for column in _table(values, "COM3").columns[:2]]
    at_port = dict(zip(*rows, strict=True))
    assert at_port["time awake"] == "25.0 %"
    assert "deepest stack / B" not in at_port


def test_without_a_board_nothing_is_left(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("AUVEST_BOARD", str(tmp_path / "none"))
    arguments = ["--simulator", __file__, "--output", str(tmp_path / "out")]
    result = CliRunner().invoke(app, ["mission", *arguments])
    assert result.exit_code == 1
    assert "the chip has not steered: no program" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_modes_have_the_numbers_of_the_line() -> None:
    assert int(PilotMode.under_way) == 1
    assert int(PilotMode.finished) == 2
    assert chip_mission().period_s == vehicle_in_the_loop.PERIOD_S
