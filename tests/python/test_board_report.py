"""What a simulated board says: its report by hand, and events from a runner that is a script."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from auvest.board import Board, BoardError, Finished, PinChange, Report, SerialLine

REPORT: dict[str, Any] = {
    "reason": "finished",
    "message": "",
    "frequency_hz": 8_000_000,
    "cycles": 4_000_000,
    "cycles_asleep": 3_000_000,
    "ram_end": 0x21FF,
    "static_end": 0x0500,
    "heap_bytes": 0x20,
    "lowest_stack_pointer": 0x2000,
    "serial_overruns": 3,
    "sections": {
        "2": {
            "count": 5,
            "first": 90,
            "minimum": 70,
            "median": 80,
            "maximum": 99,
            "stack_bytes": 12,
        }
    },
    "pins": [{"cycle": 2_000_000, "pin": "PORTB7", "level": True}],
}


def test_the_figures_of_a_report_by_hand() -> None:
    report = Report.from_json(json.dumps(REPORT))
    assert report.time_s == 0.5
    assert report.awake_share == 0.25
    assert report.stack_bytes == 0x1FF  # the stack pointer began at the end of the memory
    # From 0x520, behind the heap, to 0x2000, which the stack pointer has not used yet.
    assert report.free_bytes == 0x2001 - 0x520
    assert report.sections[2].median == 80
    assert report.pins == (PinChange(time_s=0.25, pin="PORTB7", level=True, cycle=2_000_000),)
    assert report.serial_overruns == 3


#: Says what it is told to say, a line for each "go", and writes down what it was told.
RUNNER = """#!{python}
import json, sys
from pathlib import Path
sys.stdin.reconfigure(encoding="latin-1")
told = open({told!r}, "w", encoding="latin-1")
def tell(text):
    told.write(text + "\\n")
    told.flush()
tell(json.dumps(sys.argv[1:]))
script = json.loads(Path({script!r}).read_text())
print("start", flush=True)
for line in sys.stdin:
    tell(line.rstrip("\\n"))
    if line.startswith(("go", "stop")):
        message = script["lines"].pop(0) if line.startswith("go") else script["end"]
        print(message, flush=True)
        if message.startswith("report"):
            break
sys.stderr.write(script.get("stderr", ""))
sys.exit(script["code"])
"""


class Bench:
    """A board whose runner plays a script."""

    def __init__(self, folder: Path, *lines: str, code: int = 0, **report: Any) -> None:
        end = f"report {json.dumps({**REPORT, **report})}"
        self._told = folder / "told"
        script = folder / "script.json"
        script.write_text(json.dumps({"lines": [*lines, end], "end": end, "code": code}))
        self.elf = folder / "sketch.elf"
        self.elf.write_bytes(b"")
        self.runner = folder / "auvest-board"
        self.runner.write_text(
            RUNNER.format(python=sys.executable, told=str(self._told), script=str(script))
        )
        self.runner.chmod(0o755)

    def board(self, **options: Any) -> Board:
        return Board(self.elf, runner=self.runner, **options)

    @property
    def told(self) -> list[str]:
        return self._told.read_text(encoding="latin-1").splitlines()


def test_events_have_their_time_and_lines_are_sent_after_it(tmp_path: Path) -> None:
    bench = Bench(tmp_path, "serial 1000000 ?,3  x", "pin 1500000 PORTB7 1", "pin 1500001 PORTB6 0")
    events = []
    with bench.board(frequency_hz=2_000_000) as board:
        for event in board:
            events.append(event)
            if isinstance(event, SerialLine):
                board.send("12.5,\xb5", delay_s=0.25)
                board.send("now")
            if not isinstance(event, Finished):
                with pytest.raises(RuntimeError, match="no report yet"):
                    _ = board.report
        with pytest.raises(RuntimeError, match="not running"):
            board.send("too late")
    assert events[:3] == [
        SerialLine(time_s=0.5, text="?,3  x", cycle=1_000_000),
        PinChange(time_s=0.75, pin="PORTB7", level=True, cycle=1_500_000),
        PinChange(time_s=0.7500005, pin="PORTB6", level=False, cycle=1_500_001),
    ]
    assert events[3] == Finished(board.report)
    assert board.report.cycles == 4_000_000
    # A quarter of a second of 2 MHz.
    assert bench.told[1:] == ["go", "send 500000 12.5,\xb5", "send 0 now", "go", "go", "go"]


def test_the_runner_is_told_what_to_run(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    with bench.board(watch=["PORTB7", "all"], limit_s=2.5, mcu="atmega328p") as board:
        board.run()
    arguments = json.loads(bench.told[0])
    assert arguments == [
        "--interactive", "--mcu", "atmega328p", "--frequency", "16000000", "--limit", "2.5",
        "--watch", "PORTB7", "--watch", "all", "--reset-cause", "power-on", "--seed", "1",
        "--", str(bench.elf),
    ]  # fmt: skip
    with bench.board(for_s=0.5, limit_s=9.0, input=tmp_path / "in", output=tmp_path / "out"):
        pass
    arguments = json.loads(bench.told[0])
    assert arguments[5:11] == [
        "--for", "0.5", "--input", str(tmp_path / "in"), "--output", str(tmp_path / "out"),
    ]  # fmt: skip
    assert bench.told[1:] == ["stop"]  # leaving the block ends a run that is not over
    with bench.board(eeprom=tmp_path / "kept", reset_cause="watchdog", cut_cycle=7, seed=3):
        pass
    assert json.loads(bench.told[0])[7:-2] == [
        "--eeprom", str(tmp_path / "kept"), "--reset-cause", "watchdog",
        "--seed", "3", "--cut", "7",
    ]  # fmt: skip


def test_a_failure_is_an_error_with_its_report(tmp_path: Path) -> None:
    bench = Bench(tmp_path, "serial 8 hello", code=1, reason="reset", message="at 0x123")
    with bench.board() as board, pytest.raises(BoardError, match=r"^reset: at 0x123$") as caught:
        board.run()
    assert caught.value.report.reason == "reset"
    assert caught.value.report.cycles == 4_000_000


def test_a_board_refuses(tmp_path: Path) -> None:
    bench = Bench(tmp_path, "serial 8 hello")
    with pytest.raises(ValueError, match="watch must be a sequence of pins"):
        bench.board(watch="PORTB7")
    with pytest.raises(ValueError, match="limit_s must be positive"):
        bench.board(limit_s=0.0)
    with pytest.raises(FileNotFoundError, match="elf: no file"):
        Board(tmp_path / "none.elf", runner=bench.runner)
    with pytest.raises(FileNotFoundError, match="no program nowhere: build it with"):
        Board(bench.elf, runner="nowhere")
    with bench.board() as board:
        next(iter(board))
        with pytest.raises(ValueError, match="text must be one line"):
            board.send("two\nlines")
        with pytest.raises(ValueError, match="one byte per character"):
            board.send("\u20ac")
        with pytest.raises(ValueError, match="delay_s must not be negative"):
            board.send("x", delay_s=-1e-9)
    assert bench.told[1:] == ["go", "stop"]  # nothing of that was sent
