"""The power switch of the simulated board, and a sketch whose estimate outlives cuts.

Times are those of the ATmega2560's datasheet (section 8.3).
"""

import shutil
from dataclasses import replace

import pytest

from auvest import telemetry
from auvest.board import BoardError, SerialLine
from firmware import power_cuts
from firmware.power_cuts import MEMORY, SLOT, WRONG

pytest_plugins = ["board_support"]

HEAD = """
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/wdt.h>
#include "board.hpp"
inline uint8_t* place(uint16_t at) { return reinterpret_cast<uint8_t*>(at); }
"""


def program(body, globals_=""):
    """Put statements into main, after which the program finishes."""
    return f"{HEAD}{globals_}\nint main() {{\n{body}\nboard::finish();\nfor (;;) {{}}\n}}\n"


# ---- The memory ----------------------------------------------------------------------------------


def test_a_byte_takes_its_time_and_is_kept(compile_avr, run_board, tmp_path):
    body = """
    board::write(eeprom_read_byte(place(7)));
    board::begin(1);
    eeprom_write_byte(place(7), 0x5a);
    board::end(1);
    board::write(EECR & _BV(EEPE));   // on its way
    board::begin(2);
    eeprom_busy_wait();
    board::end(2);
    board::write(eeprom_read_byte(place(7)));
    """
    elf = compile_avr(program(body))
    options = ("--eeprom", tmp_path / "eeprom")
    run = run_board(elf, *options)
    assert run.output == bytes([0xFF, 1 << 1, 0x5A])
    assert run.report.sections[1].median < 60
    written = run.report.sections[1].median + run.report.sections[2].median
    assert abs(written - 3.4e-3 * 16e6) < 100
    assert run_board(elf, *options).output[0] == 0x5A
    memory = (tmp_path / "eeprom").read_bytes()
    assert memory == b"\xff" * 7 + b"\x5a" + b"\xff" * (4096 - 8)
    assert run_board(elf).output[0] == 0xFF  # no file: erased


def test_reading_halts_the_chip_for_four_cycles(compile_avr, run_board):
    body = """
    board::begin(1); asm volatile("sbi 0x1f, 0"); board::end(1);   // EERE
    board::begin(2); asm volatile("sbi 0x1f, 3"); board::end(2);   // EERIE: no halt
    """
    sections = run_board(compile_avr(program(body))).report.sections
    assert sections[1].median - sections[2].median == 4


@pytest.mark.parametrize(
    ("how", "written"),
    [
        ("sbi 0x1f, 2 $ sbi 0x1f, 1", True),
        ("sbi 0x1f, 2 $ nop $ nop $ sbi 0x1f, 1", True),
        ("sbi 0x1f, 1", False),  # EEMPE must come first
        ("sbi 0x1f, 2 $ nop $ nop $ nop $ nop $ sbi 0x1f, 1", False),  # and has cleared itself
    ],
)
def test_a_write_needs_its_two_bits_within_four_cycles(compile_avr, run_board, how, written):
    how = how.replace(" $ ", "\\n")
    body = f"""
    EEAR = 3; EEDR = 0x12;
    asm volatile("{how}");
    eeprom_busy_wait();
    board::write(eeprom_read_byte(place(3)));
    """
    assert run_board(compile_avr(program(body))).output == (b"\x12" if written else b"\xff")


def test_erasing_and_writing_alone(compile_avr, run_board):
    """A write without an erase only clears bits; each half takes 1.8 ms."""
    body = """
    eeprom_write_byte(place(3), 0x3c);
    eeprom_busy_wait();
    EEAR = 3; EEDR = 0x0f;
    EECR = _BV(EEPM1);
    board::begin(1); EECR |= _BV(EEMPE); EECR |= _BV(EEPE); eeprom_busy_wait(); board::end(1);
    board::write(eeprom_read_byte(place(3)));
    EECR = _BV(EEPM0);
    EECR |= _BV(EEMPE); EECR |= _BV(EEPE); eeprom_busy_wait();
    board::write(eeprom_read_byte(place(3)));
    """
    run = run_board(compile_avr(program(body)))
    assert run.output == b"\x0c\xff"
    assert abs(run.report.sections[1].median - 1.8e-3 * 16e6) < 100


def test_the_ready_interrupt_is_a_level(compile_avr, run_board):
    """It comes again as long as the memory is ready, and not while a byte is written."""
    globals_ = """
    volatile uint8_t came = 0;
    ISR(EE_READY_vect) {
      came = came + 1;
      if (came == 3) EECR = 0;
    }
    """
    body = """
    sei();
    EECR |= _BV(EERIE);
    for (uint8_t i = 0; i < 100; ++i) asm volatile("nop");
    board::write(came);
    eeprom_write_byte(place(0), 1);
    came = 1;
    EECR |= _BV(EERIE);
    for (uint16_t i = 0; i < 10000; ++i) asm volatile("nop");   // 1.9 ms and more
    board::write(came);
    while (came < 3) {}
    board::write(eeprom_read_byte(place(0)));
    """
    assert run_board(compile_avr(program(body, globals_))).output == b"\x03\x01\x01"


# ---- The switch ----------------------------------------------------------------------------------

#: Writes 0x11 and then 0x22, ... to places 0, 1, ...; each takes 54,400 cycles.
WRITER = program("for (uint8_t i = 0; i < 8; ++i) eeprom_write_byte(place(i), 0x11 * (i + 1));")


def test_a_byte_under_way_at_a_cut_reads_back_as_anything(compile_avr, run_board, tmp_path):
    elf = compile_avr(WRITER)
    torn = []
    for seed in range(20):
        memory = tmp_path / f"eeprom{seed}"
        run = run_board(elf, "--eeprom", memory, "--cut", 130_000, "--seed", seed)
        assert (run.code, run.report.reason) == (0, "cut")
        assert 130_000 <= run.report.cycles < 130_010
        content = memory.read_bytes()
        assert content[:2] == b"\x11\x22"
        assert content[3:] == b"\xff" * 4093
        torn.append(content[2])
    assert len(set(torn)) > 15
    again = run_board(elf, "--eeprom", tmp_path / "again", "--cut", 130_000, "--seed", 3)
    assert again.report.reason == "cut"
    assert (tmp_path / "again").read_bytes()[2] == torn[3]


def test_a_cut_from_python(compile_avr, board, tmp_path):
    globals_ = "#include <avr/io.h>"
    body = "DDRB = 1; eeprom_write_byte(place(5), 1); PORTB = 1; for (;;) {}"
    elf = compile_avr(program(body, globals_))
    with board(elf, watch=["PORTB0"], eeprom=tmp_path / "eeprom") as running:
        for event in running:
            if hasattr(event, "pin"):
                with pytest.raises(ValueError, match="delay_s must not be negative"):
                    running.cut(-1.0)
                running.cut(10.0)
                running.cut(0.01)  # takes its place
                begun = event.cycle
    assert running.report.reason == "cut"
    assert 0 <= running.report.cycles - begun - 160_000 < 10
    assert (tmp_path / "eeprom").read_bytes()[5] == 1  # it had ended by then
    with pytest.raises(RuntimeError, match="with Board"):
        running.cut()


@pytest.mark.parametrize(
    ("cause", "bits"), [("power-on", 1), ("external", 2), ("brown-out", 4), ("watchdog", 8)]
)
def test_the_cause_of_a_reset(compile_avr, run_board, cause, bits):
    elf = compile_avr(program("board::write(MCUSR);"))
    assert run_board(elf, "--reset-cause", cause).output == bytes([bits])


def test_a_watchdog_that_has_bitten_goes_on(compile_avr, run_board):
    """With its shortest time, 16 ms: a program that does not stop it is reset for ever."""
    wait = "for (uint32_t i = 0; i < 200000; ++i) asm volatile('nop');".replace("'", '"')
    careless = compile_avr(program(wait))
    assert run_board(careless, "--reset-cause", "power-on").report.reason == "finished"
    run = run_board(careless, "--reset-cause", "watchdog")
    assert run.report.reason == "reset"
    assert 256_000 <= run.report.cycles < 256_010  # 2048 of its 128 kHz, from the start
    careful = compile_avr(program(f"MCUSR = 0; wdt_disable(); {wait}"))
    assert run_board(careful, "--reset-cause", "watchdog").report.reason == "finished"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reset_cause": "luck"}, "--reset-cause must be power-on, external, brown-out or"),
        ({"cut_cycle": -1}, "--cut must be a whole number"),
        ({"seed": -1}, "--seed must be a whole number"),
        ({"eeprom": "/no/such/folder/eeprom"}, "cannot write /no/such/folder/eeprom"),
    ],
)
def test_wrong_arguments(compile_avr, board, options, message):
    with pytest.raises(ValueError, match=message), board(compile_avr(program("")), **options) as b:
        b.run()


def test_a_file_that_is_too_long(compile_avr, board, tmp_path):
    (tmp_path / "eeprom").write_bytes(bytes(4097))
    message = "--eeprom: 4097 bytes, the atmega2560 has 4096"
    with (
        pytest.raises(ValueError, match=message),
        board(compile_avr(program("")), eeprom=tmp_path / "eeprom"),
    ):
        pass


# ---- The sketch ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def often(build_sketch, tmp_path_factory):
    """Return the sketch with a checkpoint every two seconds, and the filter marked."""
    folder = tmp_path_factory.mktemp("often")
    elf = build_sketch(power_cuts.edited(folder, power_cuts.OFTEN)).elf
    return shutil.copy(elf, folder / "often.elf")


def start(board, elf, eeprom, for_s, clock=False, **options):
    """Run the sketch from a start to a cut; give the bodies of its lines by kind."""
    craft, bodies = power_cuts.Craft(), {}
    with board(elf, eeprom=eeprom, cut_cycle=round(16e6 * for_s), **options) as running:
        for event in running:
            if isinstance(event, SerialLine):
                reply = craft.answer(event.text, event.time_s, clock=clock)
                if reply is not None:
                    running.send(reply, 0.005)
                kind, *cells = telemetry.body_of(event.text).split(",")
                bodies.setdefault(kind, []).append(cells)
    return bodies


def test_cuts_at_random_moments(often, runner):
    found = power_cuts.attack(often, 25, seed=4, runner=runner)
    assert {name: getattr(found, name) for name in WRONG} == dict.fromkeys(WRONG, 0)
    resumed = found.resumed_newest + found.resumed_one_before
    assert found.cuts == 25
    assert resumed + found.resumed_none + found.cut_before_resuming == 25
    assert found.resumed_newest > 3
    assert found.resumed_one_before > 3
    assert found.cut_while_writing > 3
    assert found.longest_age_s < found.longest_bound_s


def test_starts_are_counted_and_the_count_outlives_them(often, board, tmp_path):
    memory = tmp_path / "eeprom"
    boots = [start(board, often, memory, 0.1)["BOOT"] for _ in range(3)]
    assert boots == [[["1", "1"]], [["2", "1"]], [["3", "1"]]]


def test_age_without_and_with_a_clock(often, board, tmp_path):
    def age(resumed):
        (cells,) = resumed["RESUME"]
        return [power_cuts.number(cells[i]) for i in (3, 4)]

    memory = tmp_path / "eeprom"
    start(board, often, memory, 0.8)
    longest_off = power_cuts.setting("kLongestOff")
    one = age(start(board, often, memory, 0.3))  # cut before its own checkpoint is complete
    two = age(start(board, often, memory, 0.8, clock=True))
    # Another start that came to nothing: once more the longest time without power.
    assert one[0] == two[0] == 0
    assert longest_off + 2 < one[1] < longest_off + 9
    assert longest_off < two[1] - one[1] < longest_off + 7
    # The clock starts anew with the board here: the checkpoint is of that second, or the next.
    with_clock = age(start(board, often, memory, 0.3, clock=True))
    assert with_clock == [0, 1]


def test_what_is_too_old_is_not_resumed(often, board, tmp_path):
    """Here the count of starts is lost, and with it all that is known of the age."""
    memory = tmp_path / "eeprom"
    for _ in range(2):
        start(board, often, memory, 2.0)
    content = memory.read_bytes()
    lines = start(board, often, memory, 1.0)
    assert float(lines["CRAFT"][0][1]) > 30  # seconds since the first start, about
    memory.write_bytes(content[:MEMORY] + b"\xff" * 16)
    lines = start(board, often, memory, 1.0)
    assert lines["BOOT"] == [["1", "1"]]
    assert power_cuts.number(lines["RESUME"][0][4]) > power_cuts.setting("kOldest")
    assert lines["CRAFT"][0][1] == "0.500000"
    variance = power_cuts.number(lines["CRAFT"][0][8])
    assert variance < power_cuts.setting("kSigmaStart") ** 2


def test_keeping_costs_little(often, build_sketch, runner, tmp_path):
    never = build_sketch(power_cuts.edited(tmp_path, power_cuts.NEVER)).elf
    cost = power_cuts.measure(often, never, power_cuts.OFTEN_S, runner)
    share = cost.share(power_cuts.setting("kCheckpointPeriod"))
    print(f"a checkpoint: {cost.checkpoint_cycles:.0f} cycles, {share:.2%} of the filter's time")
    assert cost.checkpoint_cycles > 100 * SLOT  # an interrupt for each byte
    assert share < power_cuts.MOST_SHARE


def test_a_loop_that_hangs_is_ended_by_the_watchdog(build_edited, board, tmp_path):
    hang = "  if (sample.number == 3) for (;;) {}\n"
    sketch = build_edited(
        "power_cuts", [("power_cuts.ino", "  wdt_reset();\n", f"  wdt_reset();\n{hang}")]
    )
    memory = tmp_path / "eeprom"
    with pytest.raises(BoardError, match="reset by the watchdog") as error:
        start(board, sketch.elf, memory, 6.0)
    assert error.value.report.cycles == pytest.approx((1.6 + 2.1) * 16e6, rel=0.05)
    lines = start(board, sketch.elf, memory, 0.3, reset_cause="watchdog")
    assert lines["BOOT"] == [["2", "8"]]
    assert lines["RESUME"][0][0] == "1"


# ---- The proof itself ----------------------------------------------------------------------------


def test_what_is_wrong_is_seen(often, board, tmp_path):
    """Each fault that the attack counts, put before the judge."""
    lines = start(board, often, tmp_path / "eeprom", 1.0)
    begun = power_cuts.Begun(1, int(lines["SAVE"][0][1], 16), 1000.1, 1000.1)
    before = power_cuts.newest((tmp_path / "eeprom").read_bytes())
    assert (before.sequence, before.sum) == (1, begun.sum)
    (cells,) = start(board, often, tmp_path / "eeprom", 0.3)["RESUME"]

    def judged(cells=cells, at_s=1030.0, before=before, **history):
        found = power_cuts.Found()
        history = {"begun": [begun], "complete": begun, **history}
        power_cuts.judge(cells, at_s, False, before, power_cuts.History(**history), found)
        return {name for name in WRONG if getattr(found, name)}

    assert judged() == set()
    assert judged(at_s=1000.0) == {"age_wrong"}
    assert judged(at_s=1100.0) == {"age_wrong"}
    assert judged([*cells[:2], f"{begun.sum ^ 1:08x}", *cells[3:]]) == {"mixes"}
    assert judged(["0", *cells[1:]]) == {"older"}
    later = replace(begun, sequence=2, sum=5)
    assert judged(complete=later, begun=[begun, later]) == {"older"}
    assert judged([*cells[:6], "3f800000", cells[7]]) == {"other_state"}
    assert judged(before=replace(before, sum=7)) == {"other_state"}


def test_endurance_is_what_the_documents_say(root):
    """A byte is written once in as many periods as there are slots."""
    assert power_cuts.endurance_years(1000, 100, 365.25 * 86400 / 1e5) == pytest.approx(10)
    assert (MEMORY, SLOT) == (4080, 111)
    period_s = power_cuts.setting("kCheckpointPeriod")
    years = f"{power_cuts.endurance_years(MEMORY, SLOT, period_s):.1f} years"
    config = (root / "firmware/library/examples/power_cuts/config.h").read_text()
    assert f"With {period_s:.0f} s the EEPROM of a MEGA2560 lives for {years}" in config
    page = " ".join((root / "firmware/README.md").read_text().split())
    assert f"every {period_s:.0f} s, a MEGA2560 lasts {years}" in page
    uno = f"{power_cuts.endurance_years(1024 - 16, SLOT, period_s):.1f} years"
    assert f"an UNO, with 1 KB, {uno}" in page
