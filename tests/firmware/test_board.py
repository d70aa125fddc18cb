"""The simulated board keeps the chip's time, and sees what the chip would hide.

Expected cycles are those of the ATmega2560's datasheet, added up by hand.
"""

import itertools
import pickle
import subprocess

import pytest

from auvest.board import (
    Board,
    BoardError,
    Finished,
    PinChange,
    SerialLine,
    WaitsForInput,
    find_runner,
)

pytest_plugins = ["board_support"]

HEAD = """
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdlib.h>
#include "board.hpp"
#define NOINLINE __attribute__((noinline))
"""

# Polled serial port. 16 MHz / (8 * 17) = 117,647 baud: the nearest to 115,200, 2.1 % fast.
SERIAL = """
inline void serial_begin(uint8_t a = _BV(U2X0), uint8_t ubrr = 16, uint8_t c = 0x06) {
  UCSR0A = a;
  UCSR0C = c;
  UBRR0H = 0;
  UBRR0L = ubrr;
  UCSR0B = _BV(RXEN0) | _BV(TXEN0);
}
inline void put(uint8_t byte) {
  while (!(UCSR0A & _BV(UDRE0))) {}
  UDR0 = byte;
}
NOINLINE inline void print(const char* text) {
  while (*text) put(uint8_t(*text++));
}
inline uint8_t get() {
  while (!(UCSR0A & _BV(RXC0))) {}
  return UDR0;
}
"""
FRAME = 8 * 17 * 10  # cycles of a byte: 8 per bit times 17, start + 8 + stop


def program(body, globals_=""):
    """Put statements into main, after which the program finishes."""
    serial = SERIAL if "serial_begin" in body else ""
    return f"{HEAD}{serial}{globals_}\nint main() {{\n{body}\nboard::finish();\nfor (;;) {{}}\n}}\n"


def failure(run):
    """Return reason and message of a run that failed, as the report and stderr have them."""
    assert run.code == 1
    (line,) = run.error.splitlines()
    assert line.endswith(f": {run.report.reason}: {run.report.message}")
    return run.report.reason, run.report.message


# ---- Cycles --------------------------------------------------------------------------------------


def test_counted_loop(compile_avr, run_board):
    body = """
    board::begin(1);
    asm volatile("ldi r24, 100\\n1: dec r24\\n brne 1b" ::: "r24");
    board::end(1);
    board::begin(2);
    board::end(2);
    """
    report = run_board(compile_avr(program(body))).report
    # ldi 1, 100 times dec 1 and brne 2 (the last one 1), and the ldi of the end's mark.
    assert report.sections[1].median == 1 + 100 * 3 - 1 + 1
    assert report.sections[2].median == 1


# Datasheet, section 34 (instruction set), for a 22-bit program counter.
INSTRUCTIONS = {
    "nop": 1,
    "add r24, r25": 1,
    "adiw r24, 1": 2,
    "sbiw r24, 1": 2,
    "movw r24, r18": 1,
    "mul r24, r25": 2,
    "muls r24, r25": 2,
    "fmul r20, r21": 2,
    "in r24, 0x3d": 1,
    "out 0x2a, r24": 1,
    "sbi 0x05, 0": 2,
    "cbi 0x05, 0": 2,
    "lds r24, 0x0300": 2,
    "sts 0x0300, r24": 2,
    "ldi r26, 0 $ ldi r27, 3 $ ld r24, X": 1 + 1 + 2,
    "ldi r26, 0 $ ldi r27, 3 $ ld r24, X+": 1 + 1 + 2,
    "ldi r26, 1 $ ldi r27, 3 $ ld r24, -X": 1 + 1 + 2,
    "ldi r26, 0 $ ldi r27, 3 $ st X, r24": 1 + 1 + 2,
    "ldi r30, 0 $ ldi r31, 3 $ ldd r24, Z+4": 1 + 1 + 2,
    "ldi r30, 0 $ ldi r31, 3 $ std Z+4, r24": 1 + 1 + 2,
    "push r24 $ pop r24": 2 + 2,
    "lpm r24, Z": 3,
    "elpm r24, Z+": 3,
    "rjmp 1f $ 1: nop": 2 + 1,
    "jmp 1f $ 1: nop": 3 + 1,
    "rcall 1f $ rjmp 2f $ 1: ret $ 2: nop": 4 + 5 + 2 + 1,
    "call 1f $ rjmp 2f $ 1: ret $ 2: nop": 5 + 5 + 2 + 1,
    "ldi r24, 1 $ dec r24 $ brne 1f $ 1: nop": 1 + 1 + 1 + 1,
    "ldi r24, 2 $ dec r24 $ brne 1f $ 1: nop": 1 + 1 + 2 + 1,
    "ldi r24, 1 $ sbrc r24, 0 $ nop": 1 + 1 + 1,
    "ldi r24, 0 $ sbrc r24, 0 $ nop": 1 + 2,
    "ldi r24, 0 $ sbrc r24, 0 $ lds r24, 0x0300": 1 + 3,
    "cpse r24, r24 $ nop": 2,
}


def test_instructions_take_the_datasheet_s_cycles(compile_avr, run_board):
    sections = "".join(
        f'board::begin({i});\nasm volatile("{code.replace(" $ ", chr(92) + "n")}" ::: "r0", "r1", '
        f'"r18", "r19", "r20", "r21", "r24", "r25", "r26", "r27", "r30", "r31", "memory");\n'
        f"board::end({i});\n"
        for i, code in enumerate(INSTRUCTIONS, 1)
    )
    report = run_board(compile_avr(program(sections))).report
    measured = {code: report.sections[i].median - 1 for i, code in enumerate(INSTRUCTIONS, 1)}
    assert measured == INSTRUCTIONS


def test_a_call_is_shorter_on_a_chip_with_a_16_bit_program_counter(compile_avr, run_board):
    body = 'board::begin(1); asm volatile("rcall 1f\\nrjmp 2f\\n1: ret\\n2: nop"); board::end(1);'
    elf = compile_avr(program(body), mcu="atmega328p")
    report = run_board(elf, "--mcu", "atmega328p").report
    assert report.sections[1].median - 1 == 3 + 4 + 2 + 1


def test_section_statistics(compile_avr, run_board):
    spin = """
    NOINLINE void spin(uint8_t turns) {
      board::begin(7);
      asm volatile("1: dec %0\\n brne 1b" : "+r"(turns));
      board::end(7);
    }
    """
    body = "spin(50); spin(2); spin(4); spin(3); spin(5);"
    section = run_board(compile_avr(program(body, spin))).report.sections[7]
    first, smallest, median = (3 * turns - 1 + 1 for turns in (50, 2, 4))
    assert (section.count, section.first, section.maximum) == (5, first, first)
    assert (section.minimum, section.median) == (smallest, median)


def test_nested_sections(compile_avr, run_board):
    body = """
    board::begin(1);
    board::begin(2);
    asm volatile("nop\\nnop\\nnop");
    board::end(2);
    board::end(1);
    """
    sections = run_board(compile_avr(program(body))).report.sections
    assert sections[2].median == 3 + 1
    # ldi, out, the inner section, out, ldi.
    assert sections[1].median == 1 + 1 + 4 + 1 + 1


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("board::end(3);", "end of section 3, which is not open"),
        ("board::begin(3); board::begin(3);", "begin of section 3, which is open"),
        ("GPIOR0 = 0;", "unknown mark 0"),
        ("GPIOR0 = 202;", "unknown mark 202"),
    ],
)
def test_wrong_marks(compile_avr, run_board, body, message):
    reason, text = failure(run_board(compile_avr(program(body))))
    assert reason == "crashed"
    assert text.startswith(message)


# ---- Memory --------------------------------------------------------------------------------------

# The frame of hold<size>: 3 bytes of return address, 2 of the saved frame pointer, the array.
HOLD = """
template <int size> NOINLINE void fill() {
  volatile uint8_t frame[size] __attribute__((unused));
  for (int i = 0; i < size; ++i) frame[i] = 1;
}
template <int size, int inner> NOINLINE void hold() {
  volatile uint8_t frame[size] __attribute__((unused));
  for (int i = 0; i < size; ++i) frame[i] = 1;
  fill<inner>();
  frame[0] = 2;
}
"""


def test_stack_of_a_section(compile_avr, run_board):
    body = """
    board::begin(1); fill<40>(); board::end(1);
    fill<90>();
    board::begin(2); fill<20>(); board::end(2);
    board::begin(1); fill<30>(); board::end(1);
    board::begin(3); board::end(3);
    """
    report = run_board(compile_avr(program(body, HOLD))).report
    assert {k: s.stack_bytes for k, s in report.sections.items()} == {1: 45, 2: 25, 3: 0}
    # crt calls main: 3 bytes more.
    assert report.stack_bytes == 3 + 5 + 90


@pytest.mark.parametrize("outer", [234, 238, 242, 246])
def test_stack_pointer_is_judged_only_when_whole(compile_avr, run_board, outer):
    # The inner frame begins just above a multiple of 256 and ends below it: while only one half
    # of the stack pointer is written, it is 0x2000 and not 0x20f0.
    body = f"board::begin(1); hold<{outer}, 16>(); board::end(1);"
    report = run_board(compile_avr(program(body, HOLD))).report
    assert report.ram_end - report.lowest_stack_pointer > 256
    assert report.sections[1].stack_bytes == 5 + outer + 5 + 16


def test_stack_equals_the_high_water_mark_in_memory(compile_avr, run_board):
    globals_ = (
        HOLD
        + """
    extern uint8_t __heap_start;
    static volatile uint8_t data[100];
    // Before main, with nothing on the stack: paint everything above the static data.
    __attribute__((naked, used, section(".init3"))) void paint() {
      asm volatile("ldi r26, lo8(__heap_start)\\nldi r27, hi8(__heap_start)\\nldi r24, 0xc5\\n"
                   "1: st X+, r24\\ncpi r27, 0x22\\nbrne 1b");
    }
    """
    )
    body = """
    data[0] = 1;
    hold<200, 77>();
    const uint8_t* p = &__heap_start;
    while (*p == 0xc5) ++p;
    board::write(uint8_t(uint16_t(p)));
    board::write(uint8_t(uint16_t(p) >> 8));
    """
    run = run_board(compile_avr(program(body, globals_)))
    # The stack pointer is the next free byte: one below the lowest that was written.
    assert int.from_bytes(run.output, "little") == run.report.lowest_stack_pointer + 1
    assert run.report.free_bytes == run.report.lowest_stack_pointer + 1 - run.report.static_end


def test_static_data_and_heap(compile_avr, run_board):
    body = """
    data[9] = 1;
    void* p = malloc(100);
    board::write(p != 0);
    """
    report = run_board(compile_avr(program(body, "static volatile uint8_t data[1000];"))).report
    # malloc puts two bytes of length before a block; its own variables are a few bytes.
    assert report.heap_bytes == 102
    assert 0x200 + 1000 <= report.static_end <= 0x200 + 1000 + 16
    assert report.free_bytes == report.lowest_stack_pointer + 1 - report.static_end - 102


RECURSION = """
static volatile uint8_t data[7000];
NOINLINE void deeper(int n) {
  volatile uint8_t frame[20] __attribute__((unused));
  frame[0] = uint8_t(n);
  if (n > 0) deeper(n - 1);
  frame[1] = 1;
}
"""


@pytest.mark.parametrize(("allocated", "fits"), [(0, 40), (500, 20)])
def test_stack_overflow(compile_avr, run_board, allocated, fits):
    # 8192 - 7000 bytes are left for the heap and the stack; a call takes 25 to 29.
    body = f"data[0] = 1; board::write(malloc({allocated}) != 0); deeper(%d);"
    assert run_board(compile_avr(program(body % (fits - 5), RECURSION))).code == 0
    run = run_board(compile_avr(program(body % (2 * fits), RECURSION)))
    reason, message = failure(run)
    assert reason == "stack overflow"
    assert "in _Z6deeperi" in message
    end = run.report.static_end + run.report.heap_bytes
    assert f"which ends at {end:#06x}" in message
    assert end - 30 < run.report.lowest_stack_pointer + 1 < end


def test_the_stack_may_use_the_last_free_byte(compile_avr, run_board):
    # One push of one byte, with the stack pointer set just above the static data.
    code = """
    asm volatile("ldi r24, lo8(__heap_start + {0})\\nldi r25, hi8(__heap_start + {0})\\n"
                 "cli\\nout 0x3e, r25\\nout 0x3d, r24\\npush r24" ::: "r24", "r25");
    """
    assert run_board(compile_avr(program(code.format(0)))).code == 0
    reason, _ = failure(run_board(compile_avr(program(code.format(-1)))))
    assert reason == "stack overflow"


@pytest.mark.parametrize(
    ("access", "message"),
    [
        ("*(volatile uint8_t*)0x2200 = 1;", "write to 0x2200"),
        ("*(volatile uint8_t*)0xffff = 1;", "write to 0xffff"),
        ("(void)*(volatile uint8_t*)0x2200;", "read from 0x2200"),
    ],
)
def test_access_outside_of_the_memory(compile_avr, run_board, access, message):
    last_byte = "*(volatile uint8_t*)0x2000 = 1; (void)*(volatile uint8_t*)0x21ff;"
    assert run_board(compile_avr(program(last_byte))).code == 0
    reason, text = failure(run_board(compile_avr(program(access))))
    assert reason == "illegal access"
    assert text.startswith(message)
    assert "in main" in text


# ---- Crashes and resets --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "reason", "message"),
    [
        ('asm volatile(".word 0x0001");', "crashed", "illegal instruction at"),
        ('asm volatile("jmp 0x8000");', "crashed", "jump to 0x8000, where there is no code, at"),
        ('asm volatile("jmp __data_load_end");', "crashed", "jump to"),
        ('asm volatile("jmp 0");', "reset", "jump to 0 "),
        ("void (*volatile null)() = 0; null();", "reset", "jump to 0 "),
        ("TIMSK0 = 1; TCCR0B = 1; sei(); for (;;) {}", "reset", "jump to 0 "),
        ("wdt_enable(WDTO_15MS); for (;;) {}", "reset", "reset by the watchdog at"),
        ("cli(); SMCR = _BV(SE); sleep_cpu();", "crashed", "sleep with interrupts disabled"),
        ("sei(); SMCR = _BV(SE) | _BV(SM1); sleep_cpu();", "crashed", "a sleep deeper than idle"),
        ("board::fail();", "failed", "the program reports a failure at"),
        ("for (;;) {}", "limit", "the time allowed is over at"),
    ],
)
def test_failures(compile_avr, run_board, body, reason, message):
    run = run_board(compile_avr(program(body)), "--limit", "0.1")
    assert failure(run)[0] == reason
    assert run.report.message.startswith(message)
    assert ", cycle " in run.report.message


def test_the_watchdog_s_time(compile_avr, run_board):
    report = run_board(compile_avr(program("wdt_enable(WDTO_15MS); for (;;) {}"))).report
    # 2048 cycles of the watchdog's 128 kHz are 16 ms; the start-up takes a few hundred cycles.
    assert 256_000 < report.cycles < 257_000


def test_a_fed_watchdog_is_quiet(compile_avr, run_board):
    body = "wdt_enable(WDTO_15MS); for (uint32_t i = 0; i < 200000; ++i) wdt_reset();"
    report = run_board(compile_avr(program(body))).report
    assert report.reason == "finished"
    assert report.cycles > 4 * 256_000


def test_limit_and_for(compile_avr, run_board):
    elf = compile_avr(program("for (;;) {}"))
    assert run_board(elf, "--limit", "0.01").code == 1
    run = run_board(elf, "--for", "0.01")
    assert (run.code, run.report.reason) == (0, "elapsed")
    # rjmp takes two cycles, so the end may be seen one late.
    assert run.report.cycles in (160_000, 160_001)


# ---- Streams -------------------------------------------------------------------------------------


def test_streams(compile_avr, run_board):
    data = bytes((7 * i + (i >> 8)) & 0xFF for i in range(100_000))
    body = "for (uint32_t i = 0; i < 100000; ++i) board::write(board::read() ^ 0x5a);"
    run = run_board(compile_avr(program(body)), stream=data)
    assert run.code == 0
    assert run.output == bytes(b ^ 0x5A for b in data)


def test_the_input_stream_has_an_end(compile_avr, run_board):
    elf = compile_avr(program("for (uint8_t i = 0; i < 5; ++i) board::write(board::read());"))
    assert run_board(elf, stream=b"12345").output == b"12345"
    run = run_board(elf, stream=b"1234")
    assert failure(run) == ("illegal access", "read past the end of the input stream")
    assert run.output[:4] == b"1234"


# ---- Serial port ---------------------------------------------------------------------------------

ECHO = """
serial_begin();
DDRB = _BV(7);
for (;;) {
  const uint8_t byte = get();
  PINB = _BV(7);
  if (byte == '!') break;
  put(byte);
}
"""


def test_echo_keeps_the_time_of_every_byte(compile_avr, board):
    text = "".join(chr(33 + 1 + i % 90) for i in range(100))
    with board(compile_avr(program(ECHO)), watch=["PORTB7"]) as desk:
        desk.send(text, delay_s=0.001)
        changes, lines = [], []
        for event in desk:
            if isinstance(event, PinChange):
                changes.append(event)
            elif isinstance(event, SerialLine):
                lines.append(event)
                desk.send("!")
    assert [line.text for line in lines] == [text]
    assert desk.report.serial_overruns == 0
    received = [change.cycle for change in changes][: len(text) + 1]
    # The first byte has arrived one frame after its start bit; a poll sees it within 20 cycles.
    expected = [16_000 + FRAME * (i + 1) for i in range(len(text) + 1)]
    late = [a - b for a, b in zip(received, expected, strict=True)]
    assert 0 <= min(late) <= max(late) <= 20
    # The echo of the last byte is over one frame after it was written.
    assert FRAME < lines[0].cycle - received[-1] < FRAME + 40
    assert lines[0].time_s == lines[0].cycle / 16e6


def test_lines_pass_unchanged(compile_avr, board):
    text = bytes(i for i in range(256) if i not in b"\n!").decode("latin-1")
    with board(compile_avr(program(ECHO))) as desk:
        desk.send(text)
        assert next(iter(desk)).text == text


@pytest.mark.parametrize(
    ("setting", "frame"),
    [
        ("_BV(U2X0), 16, 0x06", 8 * 17 * 10),  # 8N1
        ("0, 8, 0x06", 16 * 9 * 10),
        ("0, 103, 0x06", 16 * 104 * 10),  # 9600 baud
        ("_BV(U2X0), 16, 0x0e", 8 * 17 * 11),  # two stop bits
        ("_BV(U2X0), 16, 0x26", 8 * 17 * 11),  # parity
        ("_BV(U2X0), 16, 0x04", 8 * 17 * 9),  # seven bits
    ],
)
def test_frames(compile_avr, board, setting, frame):
    body = f'serial_begin({setting}); DDRB = 1; PORTB = 1; print("0123456789\\r\\n"); get();'
    with board(compile_avr(program(body)), watch=["PORTB0"]) as desk:
        change, line = (event for _, event in zip(range(2), desk, strict=False))
    assert line.text == "0123456789"
    assert 0 <= line.cycle - change.cycle - 12 * frame < 40


INTERRUPTS = """
static volatile uint8_t count;
ISR(USART0_RX_vect) {
  PINB = _BV(7);
  board::write(UDR0);
  ++count;
}
ISR(TIMER1_COMPA_vect) {}
static const char* volatile text;
ISR(USART0_UDRE_vect) {
  if (*text) UDR0 = uint8_t(*text++);
  else UCSR0B &= uint8_t(~_BV(UDRIE0));
}
"""


def test_interrupts_follow_each_other_while_bytes_wait(compile_avr, board, tmp_path):
    body = """
    serial_begin();
    UCSR0B |= _BV(RXCIE0);
    DDRB = _BV(7);
    for (uint16_t i = 0; i < 2000; ++i) asm volatile("nop");  // longer than three frames
    sei();
    while (count < 3) {}
    """
    elf, output = compile_avr(program(body, INTERRUPTS)), tmp_path / "output"
    with board(elf, watch=["PORTB7"], output=output) as desk:
        desk.send("ab")
        changes = [event.cycle for event in desk if isinstance(event, PinChange)]
    assert output.read_bytes() == b"ab\n"
    assert len(changes) == 3
    assert all(20 < b - a < 80 for a, b in itertools.pairwise(changes))


def test_an_interrupt_comes_back_while_its_cause_holds(compile_avr, board, tmp_path):
    # The handler reads the byte at its third call only.
    handler = """
    static volatile uint8_t calls;
    ISR(USART0_RX_vect) { if (++calls == 3) (void)UDR0; }
    """
    body = "serial_begin(); UCSR0B |= _BV(RXCIE0); sei(); while (calls < 3) {} _delay_ms(1);"
    elf = compile_avr(program(f"{body} board::write(calls);", f"#include <util/delay.h>{handler}"))
    output = tmp_path / "output"
    with board(elf, limit_s=0.01, output=output) as desk:
        desk.send("")
        assert desk.run().reason == "finished"
    assert output.read_bytes() == b"\x03"


def test_bytes_not_read_in_time_are_lost(compile_avr, board, tmp_path):
    body = """
    serial_begin();
    for (uint16_t i = 0; i < 10000; ++i) asm volatile("nop");  // longer than eleven frames
    board::write(UCSR0A & _BV(DOR0));
    while (UCSR0A & _BV(RXC0)) board::write(UDR0);
    board::write(get());
    """
    elf, output = compile_avr(program(body)), tmp_path / "output"
    with board(elf, output=output) as desk:
        desk.send("0123456789")
        desk.send("A", delay_s=0.01)
        assert desk.run().serial_overruns == 8
    # Two places in the buffer and one in the shift register; then it goes on.
    assert output.read_bytes() == b"\x08012A"


def test_interrupt_driven_output_has_no_gaps(compile_avr, board):
    body = """
    serial_begin();
    DDRB = 1;
    text = "0123456789\\n";
    PORTB = 1;
    UCSR0B |= _BV(UDRIE0);
    sei();
    while (!(UCSR0A & _BV(TXC0)) || *text) {}
    """
    with board(compile_avr(program(body, INTERRUPTS)), watch=["PORTB0"]) as desk:
        change, line, finished = desk
    assert line.text == "0123456789"
    # Once, the way to the first interrupt; a gap would come ten times.
    assert 0 <= line.cycle - change.cycle - 11 * FRAME < 80
    assert 0 <= finished.report.cycles - line.cycle < 60


def test_a_line_in_flight_at_the_end_arrives(compile_avr, run_board):
    assert run_board(compile_avr(program('serial_begin(); print("bye\\n");'))).serial == b"bye\n"


def test_lines_of_the_world_wait_for_the_line_to_be_free(compile_avr, board, tmp_path):
    body = "serial_begin(); for (uint8_t i = 0; i < 12; ++i) board::write(get());"
    elf, output = compile_avr(program(body)), tmp_path / "output"
    with board(elf, output=output) as desk:
        desk.send("late", delay_s=0.01)
        desk.send("first", delay_s=0.001)
        desk.send("", delay_s=0.001)
        desk.run()
    assert output.read_bytes() == b"first\n\nlate\n"


# ---- Timers --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("timer", "mode", "clock"),
    [(1, "TCCR1A = _BV(WGM10)", "TCCR1B = _BV(CS11) | _BV(CS10)"),
     (2, "TCCR2A = _BV(WGM20)", "TCCR2B = _BV(CS22)")],
)  # fmt: skip
def test_a_timer_in_the_mode_of_arduino_s_core_counts(compile_avr, run_board, timer, mode, clock):
    """To 255 and back, one in 64 cycles: after 6,400 it is at 100, and has not been back at 0."""
    body = f"""
    {mode};
    {clock};
    __builtin_avr_delay_cycles(6400);
    const uint8_t count = TCNT{timer};
    board::write(count);
    board::write(TIFR{timer} & 1);
    """
    assert list(run_board(compile_avr(program(body))).output) == [100, 0]


# ---- Sleep ---------------------------------------------------------------------------------------

# Timer1 interrupts every 16,000 cycles; its handler does nothing. r24 counts the wake-ups.
SLEEPER = """
ISR(TIMER1_COMPA_vect, ISR_NAKED) { asm volatile("reti"); }
"""


def sleeper(wakes):
    body = f"""
    SMCR = _BV(SE);
    OCR1A = 15999;
    TIMSK1 = _BV(OCIE1A);
    TCCR1B = _BV(WGM12) | _BV(CS10);
    sei();
    asm volatile("ldi r24, {wakes}\\n1: sleep\\ndec r24\\nbrne 1b" ::: "r24");
    """
    return program(body, SLEEPER)


def test_share_of_time_awake(compile_avr, run_board):
    few, many = (run_board(compile_avr(sleeper(wakes))).report for wakes in (100, 200))
    assert many.cycles - few.cycles == 100 * 16_000
    # Each time: response 5, and 5 more out of sleep, jmp in the vector 3, reti 5, dec 1, brne 2,
    # sleep 1.
    asleep = many.cycles_asleep - few.cycles_asleep
    assert 100 * 16_000 - asleep == 100 * (5 + 5 + 3 + 5 + 1 + 2 + 1)
    assert many.awake_share == 1 - many.cycles_asleep / many.cycles
    assert 0.001 < many.awake_share < 0.002


def test_interrupt_response(compile_avr, run_board):
    # Awake, in a loop of one-cycle and two-cycle instructions: the same work with and without 50
    # interrupts differs by 50 times response 5, jmp 3, reti 5.
    body = """
    OCR1A = 999;
    TCCR1B = _BV(WGM12) | _BV(CS10);
    TIMSK1 = {} * _BV(OCIE1A);
    sei();
    board::begin(1);
    asm volatile("1: sbiw r24, 1\\nbrne 1b" :: "w"(10000));
    board::end(1);
    """
    without, interrupted = (
        run_board(compile_avr(program(body.format(on), SLEEPER))).report.sections[1].median
        for on in (0, 1)
    )
    assert without == 2 + 10_000 * 4 - 1 + 1
    # 40,000 cycles of work and about 530 of interrupts: 40 times.
    assert interrupted - without == 40 * (5 + 3 + 5)


def test_sleep_without_the_enable_bit_does_nothing(compile_avr, run_board):
    report = run_board(compile_avr(program("sei(); sleep_cpu();"))).report
    assert report.reason == "finished"
    assert report.cycles_asleep == 0


def test_sleep_until_a_byte_arrives(compile_avr, board):
    body = """
    serial_begin();
    UCSR0B |= _BV(RXCIE0);
    SMCR = _BV(SE);
    sei();
    while (count < 3) sleep_cpu();
    """
    with board(compile_avr(program(body, INTERRUPTS))) as desk:
        desk.send("ab", delay_s=0.5)
        report = desk.run()
    assert 0 <= report.cycles - (8_000_000 + 3 * FRAME) < 100
    assert report.cycles - report.cycles_asleep < 700


# ---- The world -----------------------------------------------------------------------------------

REQUESTS = """
serial_begin();
DDRB = _BV(7);
TCCR1B = _BV(CS12) | _BV(CS10);  // 15.6 kHz
for (uint8_t i = 0; i < 4; ++i) {
  print("# note\\n?range\\n");
  PORTB |= _BV(7);
  bool first = true;
  TCNT1 = 0;
  for (;;) {
    if (TCNT1 > 1000) break;
    if (!(UCSR0A & _BV(RXC0))) continue;
    const uint8_t byte = UDR0;
    if (first) PORTB &= uint8_t(~_BV(7));
    first = false;
    board::write(byte);
    if (byte == '\\n') break;
  }
  PORTB &= uint8_t(~_BV(7));
}
"""


def test_answers_from_a_file(compile_avr, run_board, tmp_path):
    answers = tmp_path / "answers.csv"
    answers.write_text("delay_ms,text\n10,$RNG,12.5,0.3*4f\n0,\n20.5,second\n")
    elf = compile_avr(program(REQUESTS))
    run = run_board(elf, "--answers", answers, "--watch", "PORTB7")
    assert run.serial == b"# note\n?range\n" * 4
    # The second request has no answer, the fourth no row.
    assert run.output == b"$RNG,12.5,0.3*4f\nsecond\n"
    waits = [b.cycle - a.cycle for a, b in itertools.pairwise(run.report.pins)]
    # The pin rises when the newline has been handed over, up to two frames before its end.
    for wait, delay_s in ((waits[0], 0.01), (waits[4], 0.0205)):
        assert 0 < wait - (delay_s * 16e6 + FRAME) < 2 * FRAME + 100
    assert min(waits[2], waits[6]) > 1000 * 1024 - 1024
    other = run_board(elf, "--answers", answers, "--request", "# n")
    assert other.output == run.output
    nobody = run_board(elf, "--answers", answers, "--request", "!")
    assert nobody.output == b""


@pytest.mark.parametrize("row", ["abc", "-1,text", "5", "5;text", "nan,x"])
def test_a_bad_answers_file_is_refused(compile_avr, runner, tmp_path, row):
    answers = tmp_path / "answers.csv"
    answers.write_text(f"delay_ms,text\n1,fine\n{row}\n")
    elf = compile_avr(program(""))
    done = subprocess.run([runner, "--answers", answers, elf], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == f"auvest-board: {answers}:3: expected delay_ms,text\n"


def test_the_world_in_python_is_deterministic(compile_avr, board):
    elf = compile_avr(program(REQUESTS))

    def play():
        with board(elf, watch=["PORTB7"]) as desk:
            events = []
            for event in desk:
                events.append(event)
                if isinstance(event, SerialLine) and event.text.startswith("?"):
                    desk.send(f"{len(events)}", delay_s=0.003 * len(events))
        return events

    events = play()
    assert play() == events
    assert isinstance(events[-1], Finished)
    changes = [event for event in events if isinstance(event, PinChange)]
    assert tuple(changes) == events[-1].report.pins
    assert [change.level for change in changes] == [True, False] * 4
    times = [event.cycle for event in events[:-1]]
    assert times == sorted(times)


def test_pin_changes_to_the_cycle(compile_avr, run_board):
    body = """
    DDRB = _BV(7); DDRL = _BV(0);
    asm volatile("sbi 0x05, 7\\nnop\\nnop\\nnop\\ncbi 0x05, 7\\nsbi 0x03, 7");
    PORTL = 1;
    PORTL = 1;
    """
    elf = compile_avr(program(body))
    run = run_board(elf, "--watch", "PORTB7", "--watch", "PORTL0")
    pins = [(change.pin, change.level) for change in run.report.pins]
    assert pins == [("PORTB7", True), ("PORTB7", False), ("PORTB7", True), ("PORTL0", True)]
    up, down, toggle, _ = (change.cycle for change in run.report.pins)
    assert (down - up, toggle - down) == (2 + 3, 2)
    assert run_board(elf, "--watch", "all").report == run.report
    assert run_board(elf, "--watch", "PORTL0").report.pins == run.report.pins[-1:]


def test_leaving_the_block_stops_the_run(compile_avr, board):
    # The short line is on its way when the run is stopped: nobody listens any more.
    body = 'serial_begin(); for (;;) print("tick\\n\\n");'
    with board(compile_avr(program(body))) as desk:
        with pytest.raises(RuntimeError, match="no report yet"):
            _ = desk.report
        for event in desk:
            assert event.text == "tick"
            break
    assert desk.report.reason == "stopped"
    with pytest.raises(RuntimeError, match="with Board"):
        desk.send("more")


def test_an_error_in_the_world_is_raised_and_ends_the_runner(compile_avr, board):
    with (
        pytest.raises(ZeroDivisionError),
        board(compile_avr(program("for (;;) {}")), for_s=0.01) as desk,
    ):
        _ = 1 / 0
    assert desk._process.poll() is not None


def test_a_failure_is_an_exception(compile_avr, board):
    with (
        board(compile_avr(program('asm volatile("jmp 0");'))) as desk,
        pytest.raises(BoardError, match=r"^reset: jump to 0 .* in main") as error,
    ):
        desk.run()
    assert error.value.report is desk.report
    assert pickle.loads(pickle.dumps(error.value)).report == desk.report


def test_raw_bytes_pass_at_once_and_the_chip_waits_for_them(compile_avr, board):
    echo = "for (uint8_t i = 0; i < 6; ++i) board::write(board::read() ^ 0x5a);"
    elf = compile_avr(program(echo))
    given = bytes([0, 10, 13, 255, 65, 90])
    wanted = bytes(byte ^ 0x5A for byte in given)
    with board(elf, raw=True) as desk:
        events = iter(desk)
        first = next(events)
        assert isinstance(first, WaitsForInput)
        assert first.output == b""
        desk.feed(given[:2])
        desk.feed(given[2:5])  # before the next event is asked for: behind the first
        second = next(events)
        assert second.output == wanted[:5]
        assert first.cycle < second.cycle < first.cycle + 200  # of a UART: 7,000
        assert second.time_s == second.cycle / 16e6
        desk.feed(given[5:])
        assert isinstance(next(events), Finished)
    with board(elf, raw=True) as desk:
        events = iter(desk)
        next(events)
        with pytest.raises(BoardError, match="read past the end of the input stream"):
            next(events)


def test_options_of_board(compile_avr, board, tmp_path):
    stream, output = tmp_path / "in", tmp_path / "out"
    stream.write_bytes(b"xy")
    elf = compile_avr(program("board::write(board::read()); for (;;) {}"), mcu="atmega328p")
    options = {"mcu": "atmega328p", "frequency_hz": 8_000_000, "input": stream, "output": output}
    with board(elf, for_s=0.5, **options) as desk:
        report = desk.run()
    assert (report.reason, report.ram_end) == ("elapsed", 0x8FF)
    assert report.frequency_hz == 8_000_000
    assert report.time_s == pytest.approx(0.5, abs=1e-6)
    assert output.read_bytes() == b"x"
    with board(elf, limit_s=0.5, **options) as desk, pytest.raises(BoardError, match=r"^limit"):
        desk.run()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"watch": ["PORTB8"]}, "PORTB8 is not a pin"),
        ({"watch": ["PORTZ1"]}, "PORTZ1 is not a pin"),
        ({"watch": "PORTB7"}, "watch must be a sequence"),
        ({"mcu": "z80"}, "simavr knows no z80"),
        ({"limit_s": 0.0}, "limit_s must be positive"),
        ({"for_s": -1.0}, "for_s must be positive"),
        ({"input": "/no/such/file"}, "cannot read /no/such/file"),
        ({"output": "/no/such/file"}, "cannot write /no/such/file"),
    ],
)
def test_wrong_arguments(compile_avr, board, options, message):
    with pytest.raises(ValueError, match=message), board(compile_avr(program("")), **options) as b:
        b.run()


def test_wrong_lines(compile_avr, board):
    with board(compile_avr(program(""))) as desk:
        for text in ("two\nlines", "5 €"):
            with pytest.raises(ValueError, match="text must"):
                desk.send(text)
        with pytest.raises(ValueError, match="delay_s must not be negative"):
            desk.send("x", delay_s=-1e-3)


def test_files_that_are_no_program(runner, tmp_path):
    with pytest.raises(FileNotFoundError, match="elf: no file"):
        Board(tmp_path / "none.elf", runner=runner)
    (tmp_path / "text.elf").write_text("hello")
    for path in (tmp_path / "text.elf", runner):  # the runner is an ELF file, but for the host
        with (
            pytest.raises(ValueError, match="not an ELF file for an AVR"),
            Board(path, runner=runner),
        ):
            pass


def test_finding_the_runner(runner, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("AUVEST_BOARD", raising=False)
    with pytest.raises(FileNotFoundError, match="AUVEST_BUILD_FIRMWARE=ON"):
        find_runner()
    with pytest.raises(FileNotFoundError, match=r"no program /nowhere/board"):
        find_runner("/nowhere/board")
    monkeypatch.setenv("PATH", str(runner.parent))
    assert find_runner() == runner
    monkeypatch.setenv("AUVEST_BOARD", "/nowhere/board")
    assert find_runner(runner) == runner
    with pytest.raises(FileNotFoundError, match="/nowhere/board"):
        find_runner()
