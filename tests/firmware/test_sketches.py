"""The example sketches: they compile cleanly, run, and say what they should; memory is watched."""

import re
import shutil

import numpy as np
import pytest

from auvest import ConstantAcceleration, RangeBearing, Ukf
from auvest.board import BoardError
from auvest.firmware.sketch import UNO, SketchError
from auvest.simulation import paper_aukf
from auvest.simulation.tracking import Scenario, simulate
from firmware import replay_record
from tests.slow import SLOW

pytest_plugins = ["board_support"]

EXAMPLES = "firmware/library/examples"
SKETCHES = [
    "beacon_navigation",
    "first_steps",
    "mission",
    "power_cuts",
    "replay",
    "slave_tracking",
    "tracking_loop",
]


@pytest.fixture
def text(board):
    """Return a function that runs a sketch for a time; it gives the lines and the report."""

    def text(elf, for_s):
        with board(elf, for_s=for_s) as running:
            lines = [event.text for event in running if hasattr(event, "text")]
        return lines, running.report

    return text


@pytest.mark.parametrize("name", SKETCHES)
def test_no_warning_is_ours(example, name):
    theirs = ("/cores/arduino/", "/variants/")
    ours = [
        line
        for line in example(name).report.splitlines()
        if "warning:" in line and not any(folder in line for folder in theirs)
    ]
    assert not ours


def test_examples_are_all_tested(root):
    assert sorted(path.name for path in (root / EXAMPLES).iterdir()) == SKETCHES


def test_first_steps(example, text):
    """The student's first numbers are the desk's."""
    filter_ = Ukf(
        np.float32([3, 4, 0.1, 0.2, 0, 0]),
        np.float32(0.01) * np.eye(6),
        process=ConstantAcceleration(discretisation="euler"),
        sensors=RangeBearing(),
        alpha=1.0,
        dtype="float32",
    )
    filter_.predict(0.5)
    filter_.update(np.float32([3.6, 0.65]))
    lines, _ = text(example("first_steps").elf, 0.1)
    assert lines == ["ok", f"x = {filter_.x[0]:.3f} m, y = {filter_.x[1]:.3f} m"]


def test_first_steps_on_an_uno(example, build_sketch, root, text, board):
    there, _ = text(example("first_steps").elf, 0.1)
    elf = build_sketch(root / EXAMPLES / "first_steps", board=UNO).elf
    with board(elf, mcu="atmega328p", for_s=0.1) as running:
        here = [event.text for event in running if hasattr(event, "text")]
    assert here == there
    print(f"UNO: stack {running.report.stack_bytes} B, never used {running.report.free_bytes} B")
    assert running.report.free_bytes >= 100


def test_replay(example, text):
    """All 60 estimates are those of the simulation on the desk, and the sketch says so itself."""
    lines, report = text(example("replay").elf, 2.0)
    rows = np.array([line.split(",") for line in lines if line[0].isdigit()], dtype=float)
    noise = paper_aukf.paper_noise()
    desk = simulate(
        paper_aukf.paper_filter("aukf", noise=noise, dtype="float32"),
        Scenario(track=paper_aukf.paper_track(), noise=noise, runs=1, seed=1),
    )
    assert rows[:, 0].tolist() == list(range(1, 61))
    # Four decimals are printed.
    np.testing.assert_allclose(rows[:, 1:3], desk.x[0, :, :2], atol=5.1e-5)
    np.testing.assert_allclose(rows[:, 3], desk.interval_s[0], atol=5.1e-5)

    cycles = rows[:, 4]
    print(f"replay: {np.median(cycles):.0f} cycles a step, at most {cycles.max():.0f}")
    assert cycles.min() > 40_000
    assert cycles.max() < 200_000  # 12.5 ms

    remarks = dict(line.removeprefix("# ").split(": ") for line in lines if ": " in line)
    assert remarks["status"] == "ok"
    assert remarks["last state"] == "the same bits as on the desk"
    assert remarks["self-test"] == "ok"
    # Painted RAM and the simulator agree to the byte.
    assert int(remarks["bytes of stack used"]) == report.stack_bytes
    assert int(remarks["bytes of RAM never used"]) == report.free_bytes


def test_replay_counts_what_the_simulator_counts(build_sketch, root, text, tmp_path):
    """The cycles printed by the sketch, against a section of the simulated board."""
    folder = tmp_path / "replay"
    shutil.copytree(root / EXAMPLES / "replay", folder)
    shutil.copy(root / "firmware/board/board.hpp", folder)
    sketch = (folder / "replay.ino").read_text()
    step = "status = step(kRecord[k]);"
    assert sketch.count(step) == 1
    sketch = sketch.replace(step, f"board::begin(1); {step} board::end(1);")
    (folder / "replay.ino").write_text('#include "board.hpp"\n' + sketch)
    lines, report = text(build_sketch(folder).elf, 2.0)
    cycles = np.array([line.split(",")[4] for line in lines if line[0].isdigit()], dtype=int)
    section = report.sections[1]
    assert section.count == 60
    # Counted in eights, with a few instructions around the call.
    assert abs(int(np.median(cycles)) - section.median) <= 24
    assert abs(cycles.max() - section.maximum) <= 24


def test_record_is_the_simulations(root):
    """The header in the example is what its command writes now."""
    header = root / EXAMPLES / "replay" / "record.h"
    assert header.read_text() == replay_record.header(), "run python -m firmware.replay_record"


CLOCK = """
#include <auvest_wake_timer.h>

namespace wake_timer = auvest_board::wake_timer;

void setup() {
  Serial.begin(115200);
  wake_timer::begin();
  noInterrupts();  // the overflow has to wait
  uint32_t last = wake_timer::now_unguarded();
  const uint32_t start = last;
  bool forwards = true;
  while (last - start < 80000ul && forwards) {
    const uint32_t now = wake_timer::now_unguarded();
    forwards = now - last < 100;
    last = now;
  }
  interrupts();
  const uint32_t after = wake_timer::now();
  Serial.println(forwards && after - last < 100 ? "forwards" : "a step");
}

void loop() {}
"""


def test_clock_goes_forwards_while_its_overflow_waits(build_sketch, text):
    lines, _ = text(build_sketch(CLOCK).elf, 0.5)
    assert lines == ["forwards"]


# ---- Memory --------------------------------------------------------------------------------------

STACK = """
#include <Arduino.h>
#include <auvest_board.h>

// Writes all of a frame of this size.
__attribute__((noinline)) void fill(int size) {
  volatile uint8_t* frame = static_cast<uint8_t*>(__builtin_alloca(size));
  for (int i = 0; i < size; ++i) frame[i] = 1;
}

void* volatile kept;
void use(void* memory) { kept = memory; }

void setup() {
  Serial.begin(115200);
  %s
  Serial.println(auvest_board::stack_used());
  Serial.println(auvest_board::ram_unused());
}

void loop() {}
"""


@pytest.mark.parametrize(
    "work",
    ["fill(100);", "fill(5000);", "free(malloc(700)); fill(900);", "use(malloc(700)); fill(200);"],
)
def test_painted_ram_agrees_with_the_simulator(build_sketch, text, work):
    # The prints that follow stay above the deepest frame.
    (used, unused), report = text(build_sketch(STACK % work).elf, 0.1)
    assert int(used) == report.stack_bytes
    assert int(unused) == report.free_bytes


def test_pattern_looks_like_no_common_value(root):
    """0 and 0xff are what memory holds without us."""
    header = (root / "firmware/library/src/auvest_board.h").read_text()
    pattern = int(re.search(r"kPattern = (0x\w+);", header)[1], 16)
    assert pattern not in (0x00, 0xFF)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        # A buffer that takes all the RAM, and a reserve that is more than there is.
        ("telemetry.h", "kCapacity = 88 +", "kCapacity = 7000 +"),
        ("config.h", "kStackReserve = 2048", "kStackReserve = 8000"),
    ],
)
def test_too_large_a_sketch_is_refused(build_sketch, root, tmp_path, file, old, new):
    folder = tmp_path / "tracking_loop"
    shutil.copytree(root / EXAMPLES / "tracking_loop", folder)
    source = (folder / file).read_text()
    assert source.count(old) == 1
    (folder / file).write_text(source.replace(old, new))
    with pytest.raises(SketchError, match="less than kStackReserve bytes of RAM to the stack"):
        build_sketch(folder)


def test_globals_beyond_the_ram_are_refused(build_sketch):
    """What no static_assert sees: the linker adds up all globals."""
    source = STACK % "Serial.println(big[analogRead(0)]);"
    with pytest.raises(SketchError, match=r"section `\.bss' is not within region"):
        build_sketch(source.replace("void setup", "volatile uint8_t big[8192];\nvoid setup"))


# ---- The watchdog --------------------------------------------------------------------------------

GUARDED = ["beacon_navigation", "mission", "power_cuts", "slave_tracking", "tracking_loop"]


@pytest.mark.parametrize("name", GUARDED)
def test_the_watchdog_guards_the_loop(name, root):
    """First in setup(), once in loop(), and never in an interrupt. What it does: below, if slow."""
    text = (root / EXAMPLES / name / f"{name}.ino").read_text()
    assert text.count("void setup() {\n  wdt_enable(WDTO_2S);\n") == 1
    assert text.count("void loop() {\n  wdt_reset();\n") == 1
    assert not re.search(r"ISR\(", text)


@SLOW
@pytest.mark.parametrize("name", [name for name in GUARDED if name != "power_cuts"])
def test_a_loop_that_hangs_is_ended_by_the_watchdog(name, build_edited, board):
    """Two seconds after it was last fed; the loop hangs in its first pass."""
    hang = ("  wdt_reset();\n\n", "  wdt_reset();\n  for (;;) {\n  }\n\n")
    if name == "mission":  # which waits for the vehicle first
        hang = ("    vehicle.announce();\n", "    for (;;) {\n    }\n")
    elf = build_edited(name, [(f"{name}.ino", *hang)]).elf
    bites = pytest.raises(BoardError, match="reset by the watchdog")
    with bites as error, board(elf, for_s=4.0) as running:
        running.run()
    at_s = error.value.report.cycles / error.value.report.frequency_hz
    assert 2.0 < at_s < 2.0 * 1.1 + 0.2


@SLOW
@pytest.mark.parametrize("name", GUARDED)
def test_a_sketch_whose_instruments_are_silent_is_not_ended(name, example, board):
    with board(example(name).elf, for_s=6.0) as running:
        assert running.run().reason == "elapsed"
