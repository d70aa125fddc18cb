"""Recording a board: its text, a serial port with a board behind it, and all that can go wrong.

The real sketch on the simulated board is recorded in tests/firmware.
"""

from __future__ import annotations

import fcntl
import itertools
import json
import math
import os
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
import tty
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from processes import PATIENCE_S, lines_of, start_program, wait_until
from typer.testing import CliRunner, Result

from auvest import board, telemetry
from auvest._texts import then
from auvest.cli import app
from auvest.commands import capture
from auvest.commands.capture import SimulatedSonar
from auvest.simulation.tracking import Noise, Track
from auvest.telemetry import LineError, Reader

#: As the sketch names them: whole numbers with #.
NAMES = (
    "sample#,time_s,dt_s,range_m,bearing_rad,desired_x_m,desired_y_m,x_m,y_m,vx_m_s,vy_m_s,"
    "ax_m_s2,ay_m_s2,P00_m2,P10_m2,P11_m2,nis,interval_s,status#,missed#,refused#,late#,awake_us#"
)
HEADER = telemetry.frame(f"COLUMNS,AUV,{NAMES}")
COLUMNS = "section," + NAMES.replace("#", "")


def bits(value: float) -> str:
    return struct.pack(">f", value).hex()


def sample_line(k: int, missing: bool = False) -> str:
    """Write the line that the sketch sends for a sample."""
    z = ["", ""] if missing else [bits(0.5 * k), bits(1.1)]
    state = [bits(v) for v in (k / 3, 0.2 * k, 0.1, 0.2, 0.01, 0.02)]
    cells = [
        str(k), f"{0.5 * k:.6f}", bits(0.5), *z, bits(0.1 * k), bits(0.2 * k), *state,
        bits(1e-7), bits(0.0), bits(4e-4), "" if missing else bits(1.5), bits(0.5),
        "0", str(int(missing)), "0", "0", "15000",
    ]  # fmt: skip
    return telemetry.frame(",".join(["AUV", *cells]))


def plain(text: str) -> str:
    return " ".join("".join(c if c.isascii() else " " for c in text).split())


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["capture", *arguments])


# ---- Text ----------------------------------------------------------------------------------------


def test_checksum_is_crc_32() -> None:
    # The check value that every catalogue of CRCs has for it.
    assert telemetry.frame("123456789") == "$123456789*cbf43926"
    assert telemetry.body_of("$123456789*CBF43926") == "123456789"


@pytest.mark.parametrize(
    "line",
    ["", "$", "$AUV", "AUV*cbdd6335", "$AUV*", "$AUV*5", "$AUV*zzdd6335", "$AUV*cbdd6336",
     "$AUV*cbdd63355", "x$AUV*cbdd6335", "$A$UV*cbdd6335", "$AUV*cbdd6335\r"],
)  # fmt: skip
def test_a_line_that_is_not_whole_is_refused(line: str) -> None:
    assert telemetry.body_of("$AUV*cbdd6335") == "AUV"
    with pytest.raises(LineError):
        telemetry.body_of(line)


def test_a_damaged_line_is_told_both_checksums() -> None:
    """That of "123456789", which every catalogue has, for a line that lost its last character."""
    said = f"^checksum cbf43926, but {zlib.crc32(b'12345678'):08x} computed: "
    with pytest.raises(LineError, match=said):
        telemetry.body_of("$12345678*cbf43926")


@pytest.mark.parametrize("line", ["$AUV,1,2*55", "# columns: sample,time_s"])
def test_a_sketch_of_an_earlier_version_is_told_to_be_loaded_anew(line: str) -> None:
    with pytest.raises(LineError, match=r"earlier version.*: load it anew"):
        Reader().read(line)


def test_two_lost_points_are_noticed() -> None:
    """Exclusive or of all characters does not see it: 0.7 m became 700,000 m."""
    whole = telemetry.answer(10, 0.7, 1.107149)
    with pytest.raises(LineError):
        telemetry.body_of(whole.replace(".", ""))


def test_every_changed_character_is_noticed() -> None:
    line = sample_line(3)
    reader = Reader()
    reader.read(HEADER)
    assert reader.read(line) is not None
    for i in range(len(line)):
        changed = line[:i] + chr(ord(line[i]) ^ 1) + line[i + 1 :]
        if changed.lower() == line.lower():
            continue  # a checksum may be written in either case
        with pytest.raises(LineError):
            reader.read(changed)


def test_numbers_keep_their_bits() -> None:
    reader = Reader()
    reader.read(telemetry.frame("COLUMNS,AUV,sample#,time_s,a,b,c,d,e"))
    row = reader.read(telemetry.frame("AUV,12345678,12345678.5,33d6bf95,80000000,,1.25,ovf"))
    assert row is not None
    assert row["sample"] == 12345678  # eight digits, and yet a whole number
    assert row["time_s"] == 12345678.5
    assert row["a"] == float(np.float32(1e-7))
    assert math.copysign(1, row["b"]) == -1
    assert math.isnan(row["c"])
    assert row["d"] == 1.25
    assert math.isnan(row["e"])  # what Arduino prints for more than 2^32


def test_eight_digits_of_a_count_are_a_number_and_of_a_float_its_bits() -> None:
    reader = Reader()
    reader.read(telemetry.frame("COLUMNS,MINE,count#,speed_m_s"))
    row = reader.read(telemetry.frame("MINE,40490000,40490000"))
    assert row == {"count": 40490000.0, "speed_m_s": 3.140625}  # 2 (1 + 0x490000 / 2^23)


def test_samples_need_the_names_of_their_columns() -> None:
    reader = Reader()
    assert reader.read(sample_line(1)) is None
    assert reader.others == {"AUV"}
    reader.read(HEADER)
    assert reader.others == set()
    with pytest.raises(LineError, match="2 values for 23 columns"):
        reader.read(telemetry.frame("AUV,1,2"))
    with pytest.raises(LineError, match="not a number"):
        reader.read(telemetry.frame("AUV," + ",".join(["one"] * 23)))


def test_the_kind_that_is_described_first_is_read() -> None:
    reader = Reader()
    reader.read(telemetry.frame("COLUMNS,ONE,a"))
    reader.read(telemetry.frame("COLUMNS,TWO,b"))
    assert (reader.kind, reader.columns) == ("ONE", ("a",))
    assert reader.read(telemetry.frame("ONE,1")) == {"a": 1.0}
    assert reader.read(telemetry.frame("TWO,1")) is None
    assert reader.others == {"TWO"}


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        ("1_0", "not a number"),
        ("\u0661", "no character of a serial line"),  # one, to float()
        ("infinity", "not a number"),
        (" 1", "not a number"),
        ("0x10", "not a number"),
    ],
)
def test_a_number_that_no_sketch_sends_is_a_damaged_line(cell: str, message: str) -> None:
    reader = Reader()
    reader.read(telemetry.frame("COLUMNS,AUV,sample#,a"))
    line = f"$AUV,1,{cell}*00000000" if not cell.isascii() else telemetry.frame(f"AUV,1,{cell}")
    with pytest.raises(LineError, match=message):
        reader.read(line)
    assert telemetry.requested_sample(f"$PING,{cell}*00000000") is None
    if cell.isascii():
        assert telemetry.requested_sample(telemetry.frame(f"PING,{cell}")) is None


@pytest.mark.parametrize(
    "text",
    ["AUV,sample,time_s,sample", "AUV,sample#,sample", "AUV,sample,,a", "AUV,1a", "AUV,a##", "AUV",
     "", "auv,a", ",a"],
)  # fmt: skip
def test_what_is_no_description_is_refused_and_the_last_one_stays(text: str) -> None:
    reader = Reader()
    reader.read(telemetry.frame("COLUMNS,AUV,sample#,a"))
    with pytest.raises(LineError, match="not a description of columns"):
        reader.read(telemetry.frame(f"COLUMNS,{text}"))
    assert (reader.kind, reader.columns) == ("AUV", ("sample", "a"))


def test_other_columns_than_before_are_another_sketch() -> None:
    reader = Reader()
    reader.read(HEADER)
    with pytest.raises(LineError, match="another sketch"):
        reader.read(telemetry.frame("COLUMNS,AUV,sample#,a"))
    assert reader.read(sample_line(1)) is not None


def test_a_start_of_the_board_says_why() -> None:
    boot = Reader().read(telemetry.frame("BOOT,17,8"))
    assert boot == telemetry.Boot(17, 8)
    reasons = {1: "power came on", 3: "power came on and its reset pin", 8: "its watchdog"}
    for cause, reason in reasons.items():
        assert telemetry.Boot(1, cause).reason == reason
    assert telemetry.Boot(1, 0).reason.startswith("unknown")
    for body in ("BOOT", "BOOT,1", "BOOT,1,2,3", "BOOT,a,1", "BOOT,1,-1"):
        with pytest.raises(LineError, match="not a start"):
            Reader().read(telemetry.frame(body))


def test_from_what_a_board_resumes() -> None:
    """As the sketch power_cuts says it, or with less behind the age."""
    reader = Reader()
    line = telemetry.frame(f"RESUME,7,60,12345678,{bits(1.5)},{bits(75)}")
    assert reader.read(line) == telemetry.Resumed(7, 1.5, 75.0)
    assert reader.others == set()
    for body in (
        "RESUME",
        "RESUME,7,60,89abcdef,3fc00000",
        "RESUME,x,60,89abcdef,3fc00000,3fc00000",
        "RESUME,7,60,89abcdef,1.5,75",
    ):
        with pytest.raises(LineError, match="not what a board resumes from"):
            reader.read(telemetry.frame(body))


def test_other_lines_are_no_samples() -> None:
    reader = Reader()
    for line in ("", "# bytes of RAM never used: 5000", telemetry.frame("PING,3")):
        assert reader.read(line) is None


def test_requests() -> None:
    assert telemetry.requested_sample(telemetry.frame("PING,17")) == 17
    for line in ("$PING,17*00000000", "$PING,", telemetry.frame("PING,x"), sample_line(1), "#"):
        assert telemetry.requested_sample(line) is None
    assert telemetry.answer(17, 1.5, -0.25) == telemetry.frame("SONAR,17,1.500000,-0.250000")


def test_requests_of_the_odometer() -> None:
    """What is asked of one instrument is not asked of the other."""
    asked = telemetry.frame("ODO,3")
    assert telemetry.requested_sample(asked, "ODO") == 3
    assert telemetry.requested_sample(asked) is None
    assert telemetry.requested_sample(telemetry.frame("PING,3"), "ODO") is None


def test_an_answer_is_given_to_the_micrometre_and_microradian() -> None:
    """Half of that more or less is rounded."""
    body = telemetry.body_of(telemetry.answer(3, 12.3456784, -1.2345676))
    assert body == "SONAR,3,12.345678,-1.234568"


def test_a_number_for_a_sketch_has_nine_digits_at_most() -> None:
    """The reader on the chip takes no more, nor exponents."""
    assert telemetry.answer(1, 12345.6789123, 0.5) == telemetry.frame("SONAR,1,12345.6789,0.500000")
    assert telemetry.decimal(-999999999.0, 3) == "-999999999"
    for value in (999999999.6, -1e30, math.nan, math.inf):
        with pytest.raises(ValueError, match="nine digits"):
            telemetry.decimal(value, 3)


# ---- The simulated sonar -------------------------------------------------------------------------


def test_simulated_sonar_measures_the_track() -> None:
    sonar = SimulatedSonar(Noise(range_m=0.0, bearing_rad=0.0))
    assert sonar.measure(1, 100.0) is not None  # half a second after the start of the track
    text, delay_s = sonar.measure(2, 110.0) or ("", 0.0)
    x, y = Track(kind="straight").position_at(10.5)
    assert sonar.truth[2] == (x, y)
    distance = math.hypot(x - 0.2, y - 2.0)
    assert text == telemetry.answer(2, distance, math.atan2(y - 2.0, x - 0.2))
    assert delay_s == pytest.approx(2e-3 + 2 * distance / 1500)


@pytest.mark.parametrize("kind", ["normal", "uniform", "lognormal"])
@pytest.mark.parametrize("centred", [False, True])
def test_simulated_noise_has_the_stated_moments(kind: str, centred: bool) -> None:
    noise = Noise(kind=kind, range_m=0.05, bearing_rad=0.01, centred=centred)  # type: ignore[arg-type]
    sonar = SimulatedSonar(noise, seed=3)
    draws = np.array([sonar._draw()[:2] for _ in range(40_000)])
    # Four standard errors; those of a lognormal's deviation are large.
    for i in range(2):
        sigma = noise.standard_deviation[i]
        assert draws[:, i].mean() == pytest.approx(noise.mean[i], abs=4 * sigma / 200)
        assert draws[:, i].std() == pytest.approx(sigma, rel=0.15)


def test_dropouts_and_seeds() -> None:
    def answers(seed: int, dropout: float) -> list[object]:
        sonar = SimulatedSonar(Noise(dropout=dropout), seed=seed)
        return [sonar.measure(k, float(k)) for k in range(1000)]

    lost = answers(1, 0.3).count(None)
    assert lost == pytest.approx(300, abs=60)
    assert answers(1, 0.0) == answers(1, 0.0)
    assert answers(1, 0.0) != answers(2, 0.0)
    assert None not in answers(1, 0.0)


# ---- A board behind a serial port ----------------------------------------------------------------


#: A pseudo-terminal in packet mode: its other side has thrown away what it had received.
TIOCPKT_FLUSHREAD = 1


class PortWithBoard:
    """A pseudo-terminal; a thread speaks as the board. Answers that it gets are kept."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self._tell_of_flushes(True)
        self.name = os.ttyname(slave)
        self.slave = slave
        self.answers: list[str] = []

    def speak(self, script: Callable[[PortWithBoard], None]) -> None:
        threading.Thread(target=self._speak, args=(script,), daemon=True).start()

    def _speak(self, script: Callable[[PortWithBoard], None]) -> None:
        self.wait_until_open()
        script(self)

    def wait_until_open(self, process: subprocess.Popen[str] | None = None) -> None:
        """Whoever opens the port throws away what came before: return when that is done."""
        opened = False
        while not opened:
            if select.select([self.master], [], [], 1.0)[0]:
                opened = bool(os.read(self.master, 1)[0] & TIOCPKT_FLUSHREAD)
            elif process is not None:
                assert process.poll() is None, process.communicate()
        self._tell_of_flushes(False)

    def _tell_of_flushes(self, wanted: bool) -> None:
        fcntl.ioctl(self.master, termios.TIOCPKT, struct.pack("i", wanted))

    def say(self, text: str, end: str = "\r\n") -> None:
        os.write(self.master, (text + end).encode("latin-1"))

    def listen(self) -> None:
        received = b""
        while not received.endswith(b"\n"):
            received += os.read(self.master, 1)
        self.answers.append(received.decode().strip())

    def unplug(self) -> None:
        master, self.master = self.master, -1  # first: the other end acts at once
        os.close(master)


@pytest.fixture
def port() -> Iterator[PortWithBoard]:
    port = PortWithBoard()
    yield port
    os.close(port.slave)
    if port.master >= 0:
        os.close(port.master)


def test_port_is_recorded_to_the_bit(port: PortWithBoard, tmp_path: Path) -> None:
    def script(board: PortWithBoard) -> None:
        board.say("ra,1*22222222")  # the rest of a line that began before we listened
        board.say("# auvest tracking_loop")
        board.say(HEADER)
        for k in range(1, 6):
            board.say(telemetry.frame(f"PING,{k}"))
            line = sample_line(k, missing=k == 3)
            board.say(line[:20], end="")  # lines come in pieces
            time.sleep(0.15)
            board.say(line[20:])
            board.say(line[:-1] + "?")  # and damaged

    port.speak(script)
    output = tmp_path / "dive"
    result = call("--port", port.name, "--steps", "5", "--output", str(output), "--json")
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)["results"]
    assert (values["samples"], values["missed"]) == (5, 0)  # the last line says 0 missed
    assert values["damaged_lines"] in (5, 6)  # the last may come after we have left
    assert values["awake_share_by_board"] == pytest.approx(0.03)  # 15 ms of 0.5 s
    assert values["awake_share_simulated"] is None
    assert values["rmse_m"] is None

    header, *rows = (output / "record.csv").read_text().splitlines()
    assert header == COLUMNS
    table = [dict(zip(COLUMNS.split(","), row.split(","), strict=True)) for row in rows]
    assert [row["time_s"] for row in table] == ["0.5", "1", "1.5", "2", "2.5"]
    for k, row in enumerate(table, start=1):
        assert np.float32(row["P00_m2"]) == np.float32(1e-7)
        assert np.float32(row["x_m"]) == np.float32(k / 3)
    assert table[2]["range_m"] == table[2]["nis"] == ""
    assert sorted(path.name for path in output.iterdir()) == [
        ".auvest.json", "figure.png", "record.csv", "results.json",
    ]  # fmt: skip


def test_a_board_that_restarts_begins_a_section(port: PortWithBoard, tmp_path: Path) -> None:
    """Once its line is heard, once it is lost; counters of the sections add up."""

    def script(board: PortWithBoard) -> None:
        board.say(telemetry.frame("BOOT,4,1"))
        board.say(
            telemetry.frame(f"RESUME,0,0,{bits(0)},{bits(0)},{bits(0)},0,{bits(0)},{bits(0)}")
        )
        board.say(HEADER)
        for k in (1, 2, 3, 3):
            board.say(sample_line(k, missing=k == 3))
        board.say(telemetry.frame("BOOT,5,8"))
        board.say(
            telemetry.frame(f"RESUME,7,60,89abcdef,{bits(1.5)},{bits(75)},0,{bits(0)},{bits(0)}")
        )
        board.say(HEADER)
        for k in (1, 2):
            board.say(sample_line(k, missing=True))
        for k in (1, 2):
            board.say(sample_line(k))

    port.speak(script)
    output = tmp_path / "dive"
    result = call("--port", port.name, "--steps", "7", "--output", str(output), "--json")
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)["results"]
    assert values["restarts"] == [
        {"after_s": 1.5, "section": 2, "reason": "its watchdog"},
        {"after_s": 1.0, "section": 3, "reason": "not said: that line was lost"},
    ]
    none = {"checkpoint": 0, "least_age_s": 0.0, "most_age_s": 0.0}
    seventh = {"checkpoint": 7, "least_age_s": 1.5, "most_age_s": 75.0}
    assert values["resumptions"] == [{"section": 1, **none}, {"section": 2, **seventh}]
    table = capture._table({k: math.nan if v is None else v for k, v in values.items()}, "")
    cells = [str(cell) for column in table.columns for cell in column.cells]
    assert {"1 of 2", "the last from 1.5 to 75 s old"} <= set(cells)
    assert "the board restarted after 1.5 s" in plain(result.stderr)
    assert values["damaged_lines"] == 1  # sample 3 came twice
    assert values["missed"] == 2  # one in each of the first two sections
    assert values["duration_s"] == pytest.approx(3.0)  # 0.5 to 1.5, then 1 s and 1 s
    rows = (output / "record.csv").read_text().splitlines()[1:]
    assert [row.split(",")[:2] for row in rows] == [
        ["1", "1"], ["1", "2"], ["1", "3"], ["2", "1"], ["2", "2"], ["3", "1"], ["3", "2"],
    ]  # fmt: skip


def test_any_sketch_that_names_its_columns_is_recorded(port: PortWithBoard, tmp_path: Path) -> None:
    def script(board: PortWithBoard) -> None:
        board.say(telemetry.frame("COLUMNS,TANK,sample#,depth_m,valve#"))
        for k in range(1, 4):
            board.say(telemetry.frame(f"TANK,{k},{bits(0.1 * k)},12345678"))

    port.speak(script)
    result = call("--port", port.name, "--steps", "3", "--output", str(tmp_path / "tank"), "--json")
    assert result.exit_code == 0, result.output
    values = json.loads(result.stdout)["results"]
    assert values["samples"] == 3
    assert values["missed"] is None
    assert (tmp_path / "tank" / "figure.png").stat().st_size > 1000
    header, *rows = (tmp_path / "tank" / "record.csv").read_text().splitlines()
    assert header == "section,sample,depth_m,valve"
    assert np.float32(rows[1].split(",")[2]) == np.float32(0.2)
    assert rows[1].endswith(",12345678")


def test_play_sonar_answers_each_request(port: PortWithBoard, tmp_path: Path) -> None:
    def script(board: PortWithBoard) -> None:
        board.say(HEADER)
        for k in range(1, 4):
            board.say(telemetry.frame(f"PING,{k}"))
            board.listen()
            board.say(sample_line(k))

    port.speak(script)
    result = call(
        "--port", port.name, "--play-sonar", "--steps", "3", "--no-figure",
        "--output", str(tmp_path),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "position RMSE" in plain(result.stdout)
    assert [telemetry.body_of(a).split(",")[:2] for a in port.answers] == [
        ["SONAR", "1"], ["SONAR", "2"], ["SONAR", "3"],
    ]  # fmt: skip
    assert "true_x_m" in (tmp_path / "record.csv").read_text().splitlines()[0]


def test_an_unplugged_board_keeps_its_samples(port: PortWithBoard, tmp_path: Path) -> None:
    def script(board: PortWithBoard) -> None:
        board.say(HEADER)
        for k in range(1, 4):
            board.say(sample_line(k))
        record = tmp_path.with_name(f"{tmp_path.name}.unfinished") / "record.csv"
        wait_until(lambda: lines_of(record) == 4, "the samples are recorded")
        board.unplug()

    port.speak(script)
    result = call("--port", port.name, "--output", str(tmp_path), "--no-figure")
    assert result.exit_code == 1
    assert "the samples until then are kept" in plain(result.stderr)
    assert len((tmp_path / "record.csv").read_text().splitlines()) == 4
    assert json.loads((tmp_path / "results.json").read_text())["complete"] is False


def test_a_silent_port(
    port: PortWithBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(capture, "SILENCE_S", 0.3)
    result = call("--port", port.name, "--output", str(tmp_path))
    assert result.exit_code == 1
    assert "no sample has come" in plain(result.stderr)
    assert "no sample for 0.3 s" in plain(result.stderr)
    assert "115200 baud?" in plain(result.stderr)
    assert not (tmp_path / "record.csv").exists()


def test_a_board_that_was_not_reset(
    port: PortWithBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its samples have come without the names of their columns: say what helps."""
    said = threading.Event()

    def script(board: PortWithBoard) -> None:
        for k in range(1, 6):
            board.say(telemetry.frame(f"PING,{k}"))
            board.say(sample_line(k))
        said.set()

    # The clock stands until all is said; then a second goes by with each line that is read.
    seconds = itertools.count()
    clock = SimpleNamespace(monotonic=lambda: next(seconds) if said.is_set() else 0)
    monkeypatch.setattr(capture, "time", clock)
    monkeypatch.setattr(capture, "SILENCE_S", 5)

    port.speak(script)
    result = call("--port", port.name, "--output", str(tmp_path))
    assert result.exit_code == 1
    assert "reset the board" in plain(result.stderr)


def test_a_record_from_a_board_is_never_overwritten(port: PortWithBoard, tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text("precious")
    result = call("--port", port.name, "--output", str(tmp_path))
    assert result.exit_code == 2
    assert "choose another --output" in plain(result.stderr)
    assert (tmp_path / "record.csv").read_text() == "precious"


@pytest.mark.parametrize(("steps", "code"), [((), 0), (("--steps", "9"), 130)])
def test_interrupt_keeps_all_that_has_come(
    port: PortWithBoard, tmp_path: Path, steps: tuple[str, ...], code: int
) -> None:
    """Without --steps Ctrl-C is how a recording ends; with it, it is an interruption."""
    command = [sys.executable, "-m", "auvest", "capture", "--port", port.name, *steps]
    with start_program([*command, "--output", tmp_path, "--no-figure"]) as process:
        port.wait_until_open(process)
        port.say(HEADER)
        for k in range(1, 4):
            port.say(sample_line(k))
        # Each sample is on the disk before the command has ended.
        record = tmp_path.with_name(f"{tmp_path.name}.unfinished") / "record.csv"
        wait_until(lambda: lines_of(record) == 4, "the samples are recorded", process)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == code, err
    assert "3 samples" in plain(out)
    assert ("interrupted: 3 of 9" in plain(err)) == (code == 130)


# ---- Wrong usage ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["--port", "--simulator", "one of the two"]),
        (["--port", "p", "--simulator", __file__], ["one of the two"]),
        (["--port", "p", "--noise", "uniform"], ["--noise", "--play-sonar"]),
        (["--port", "p", "--range-noise", "1"], ["--range-noise", "--play-sonar"]),
        (["--port", "p", "--seed", "2"], ["--seed", "--play-sonar"]),
        (["--simulator", __file__, "--baud", "9600"], ["--baud", "--port"]),
        (["--simulator", __file__, "--play-sonar"], ["--play-sonar", "--port"]),
        (["--simulator", "no-such.elf"], ["--simulator", "no-such.elf"]),
        (["--simulator", __file__, "--dropout", "1"], ["--dropout", "probability"]),
        (["--simulator", __file__, "--range-noise", "nan"], ["--range-noise", "finite"]),
        (["--simulator", __file__, "--steps", "0"], ["--steps"]),
    ],
)
def test_wrong_usage_names_the_option(
    arguments: list[str], words: list[str], tmp_path: Path
) -> None:
    result = call(*arguments, "--output", str(tmp_path))
    assert result.exit_code == 2
    for word in words:
        assert word in plain(result.stderr)
    assert not list(tmp_path.iterdir())


def test_a_port_that_is_not_there(tmp_path: Path) -> None:
    result = call("--port", "/dev/no-such-port", "--output", str(tmp_path))
    assert result.exit_code == 1
    said = "Error: no sample has come: /dev/no-such-port: No such file or directory"
    assert plain(result.stderr) == said


def test_a_question_ends_its_sentence() -> None:
    rest = "the samples until then are kept"
    assert then("is it at 9600 baud?", rest) == f"is it at 9600 baud? T{rest[1:]}"
    assert then("it is gone", rest) == f"it is gone; {rest}"


def test_without_pyserial_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    result = call("--port", "/dev/ttyACM0", "--output", str(tmp_path))
    assert result.exit_code == 1
    assert "pip install 'auvest[serial]'" in plain(result.stderr)


def test_without_the_simulator_its_build_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AUVEST_BOARD", "no-such-runner")
    monkeypatch.setattr(board.shutil, "which", lambda _: None)  # type: ignore[attr-defined]
    result = call("--simulator", __file__, "--output", str(tmp_path))
    assert result.exit_code == 1
    assert "AUVEST_BUILD_FIRMWARE" in plain(result.stderr)


def test_a_record_stays_if_what_comes_after_it_fails(
    port: PortWithBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def script(board: PortWithBoard) -> None:
        board.say(HEADER)
        for k in range(1, 4):
            board.say(sample_line(k))

    def full(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(capture, "_figure", full)
    port.speak(script)
    result = call("--port", port.name, "--steps", "3", "--output", str(tmp_path / "dive"))
    assert result.exit_code == 1
    assert "what was recorded is in" in plain(result.stderr)
    assert lines_of(tmp_path / "dive.unfinished" / "record.csv") == 4
    assert not (tmp_path / "dive").exists()
