"""The library's own float routines for AVR: the bits of IEEE 754, as NumPy has them."""

import subprocess

import numpy as np
import pytest

pytest_plugins = ["board_support"]

PROGRAM = """
#include <math.h>

#include "board.hpp"

float read() {
  union { uint8_t bytes[4]; float value; } word;
  for (uint8_t i = 0; i < 4; ++i) word.bytes[i] = board::read();
  return word.value;
}

void write(float value) {
  union { float value; uint8_t bytes[4]; } word = {value};
  for (uint8_t i = 0; i < 4; ++i) board::write(word.bytes[i]);
}

int main() {
  for (uint32_t count = COUNT; count > 0; --count) {
    volatile float a = read();
    volatile float b = read();
    board::begin(1);
    volatile float product = a * b;
    board::end(1);
    board::begin(2);
    volatile float sum = a + b;
    board::end(2);
    board::begin(3);
    volatile float quotient = a / b;
    board::end(3);
    board::begin(4);
    volatile float root = sqrt(a);
    board::end(4);
    write(product);
    write(sum);
    write(a - b);
    write(quotient);
    write(root);
  }
  board::finish();
}
"""

OPERATIONS = ("product", "sum", "difference", "quotient", "root")

# Zero, subnormals, both sides of the ends of the range and of 1, infinity, NaN.
SPECIAL = np.array(
    [
        *(0x00000000, 0x00000001, 0x007FFFFF, 0x00800000, 0x00800001, 0x0F800000, 0x10000000),
        *(0x3F7FFFFF, 0x3F800000, 0x3F800001, 0x3FFFFFFF, 0x40000000),
        *(0x7E7FFFFF, 0x7F000000, 0x7F7FFFFF, 0x7F800000, 0x7FC00000),
    ],
    "<u4",
)


def operands():
    """Pairs of floats: any bits, neighbours in size, and every pair of special values."""
    rng = np.random.default_rng(1)
    count = 100_000
    any_bits = rng.integers(0, 1 << 32, (count, 2), dtype="<u4")
    # Exponents that differ by at most 27, where addition rounds, cancels and carries; mantissas
    # with long runs of ones and zeros, where ties are.
    exponent = rng.integers(28, 227, (count, 1)) + rng.integers(0, 28, (count, 2))
    bits = rng.integers(0, 1 << 23, (count, 2))
    run = rng.integers(0, 24, (count, 2))
    mantissa = np.where(rng.random((count, 2)) < 0.5, bits, bits >> run << run)
    mantissa = np.where(rng.random((count, 2)) < 0.2, (1 << 23) - 1 - mantissa, mantissa)
    sign = rng.integers(0, 2, (count, 2))
    near = (sign << 31 | exponent << 23 | mantissa).astype("<u4")
    # Sums at or next to a tie, half of them with a carry out of the first place.
    shift = rng.integers(1, 25, 60_000)
    low = (1 << shift >> rng.integers(0, 3, shift.size)) + rng.integers(-1, 2, shift.size)
    small = rng.integers(0, 1 << 23, shift.size) >> shift << shift | low & ((1 << 23) - 1)
    large = rng.integers(0, 1 << 23, shift.size) | rng.integers(0, 2, shift.size) * 0x7F0000
    exponent = rng.integers(60, 200, shift.size)
    ties = np.stack([(exponent + shift) << 23 | large, exponent << 23 | small], -1)
    # A few units in the last place apart, of the opposite sign: cancellation.
    close = near[:20_000].copy()
    close[:, 1] = (close[:, 0] ^ 0x80000000) + rng.integers(-40, 40, len(close))
    # Products and quotients at the lower end of the range, many of them with few bits, so that ties
    # are among the subnormal results; subnormal operands.
    count = 20_000
    run = rng.integers(0, 24, (3, count, 2))
    mantissa = rng.integers(0, 1 << 23, run.shape) >> run << run
    low = rng.integers(0, 100, (2, count))
    high = [127 - low[0] + rng.integers(-26, 4, count), 127 + low[1] + rng.integers(-3, 26, count)]
    exponent = np.zeros(run.shape, int)
    exponent[:2] = np.stack([low, np.clip(high, 1, 254)], -1)
    ends = (exponent << 23 | mantissa) | rng.integers(0, 2, run.shape) << 31
    # Quotients next to a tie: (2 Q + 1) B = 2^25 A + 1 or - 1, with 2 Q + 1 of 25 bits.
    b = rng.integers(1 << 22, 1 << 23, 40_000) * 2 + 1
    inverse = b.copy()
    for _ in range(4):  # doubles the bits that are right, of which 3 are
        inverse = inverse * (2 - b * inverse) % (1 << 25)
    odd = np.where(np.arange(len(b)) % 2, inverse, (1 << 25) - inverse)
    a = (odd * b + 1) >> 25
    a, b = np.stack([a, b], -1)[(odd >> 24 == 1) & (a >> 23 == 1)].T
    hard = np.stack([a, b], -1) & ((1 << 23) - 1) | 127 << 23
    signed = np.concatenate([SPECIAL, SPECIAL | 0x80000000])
    special = np.stack(np.meshgrid(signed, signed), -1).reshape(-1, 2)
    pairs = np.concatenate([any_bits, near, ties, close, ends.reshape(-1, 2), hard, special])
    return pairs.astype("<u4").view("<f4")


def test_every_result_is_rounded_as_ieee_754_says(compile_avr, run_board, root, tmp_path):
    pairs = operands()
    elf = compile_avr(PROGRAM, f"-DCOUNT={len(pairs)}UL", root / "firmware/library/src/avr_float.S")
    record = tmp_path / "operands.bin"
    record.write_bytes(pairs.tobytes())
    run = run_board(elf, "--input", record, "--limit", "1000")
    found = np.frombuffer(run.output, "<f4").reshape(-1, len(OPERATIONS))
    assert len(found) == len(pairs)
    a, b = pairs.T
    with np.errstate(all="ignore"):
        wanted = np.stack([a * b, a + b, a - b, a / b, np.sqrt(a)], axis=-1)
    same = (found.view("<u4") == wanted.view("<u4")) | (np.isnan(found) & np.isnan(wanted))
    wrong = {
        name: [[f"{bits:#010x}" for bits in pair] for pair in pairs.view("<u4")[~good][:3]]
        for name, good in zip(OPERATIONS, same.T, strict=True)
        if not good.all()
    }
    assert not wrong, f"{np.count_nonzero(~same)} wrong, the first operands: {wrong}"


def test_they_take_less_flash_and_no_more_cycles_than_those_of_the_toolchain(
    compile_avr, run_board, root, tmp_path
):
    rng = np.random.default_rng(2)
    pairs = rng.uniform(0.1, 10, (2_000, 2)).astype("<f4")
    record = tmp_path / "operands.bin"
    record.write_bytes(pairs.tobytes())
    flash, cycles = [], []
    for sources in ([root / "firmware/library/src/avr_float.S"], []):
        elf = compile_avr(PROGRAM, "-DCOUNT=2000", *sources)
        size = subprocess.run(["avr-size", elf], capture_output=True, text=True, check=True)
        flash.append(int(size.stdout.splitlines()[1].split()[0]))
        sections = run_board(elf, "--input", record).report.sections
        # 32 cycles of each are loads and stores of the test's.
        cycles.append(np.array([sections[i].median - 32 for i in (1, 2, 3, 4)]))
    assert flash[0] < flash[1] - 150, flash
    # The root starts as a quotient, which costs some cycles.
    assert (cycles[0] < np.array([0.9, 0.9, 0.95, 1.1]) * cycles[1]).all(), cycles


# ---- The contract of avr_float.S -----------------------------------------------------------------

ROUTINES = {"__addsf3": 2, "__subsf3": 1, "__mulsf3": 0, "__divsf3": 3, "sqrtf": 4}
KEPT = [*range(2, 18), 28, 29]

CALLS = """
#include "board.hpp"

extern "C" {
uint8_t operands[8], seen[24];
void probe();
}

int main() {
  for (uint16_t count = COUNT; count > 0; --count) {
    for (uint8_t i = 0; i < 8; ++i) operands[i] = board::read();
    probe();
    for (uint8_t i = 0; i < 24; ++i) board::write(seen[i]);
  }
  board::finish();
}
"""


def probe_of(routine):
    """Assembler that calls it with 0xa0 + n in each register n that a call leaves alone.

    ``seen`` becomes the result, those registers, r1 and SREG, which had I set. The call is section
    1, so that its stack is measured.
    """
    lines = [".global probe", "probe:", *(f"push r{n}" for n in KEPT)]
    lines += [f"ldi r18, {0xA0 + n}\n mov r{n}, r18" for n in KEPT]
    lines += [
        f"lds r{22 + i}, operands + {i}\n lds r{18 + i}, operands + {4 + i}" for i in range(4)
    ]
    lines += ["sei", "ldi r26, 2", "out 0x1e, r26", f"call {routine}"]
    lines += ["in r27, 0x3f", "cli", "ldi r26, 3", "out 0x1e, r26"]  # GPIOR0; SREG
    lines += [f"sts seen + {i}, r{n}" for i, n in enumerate([22, 23, 24, 25, *KEPT, 1, 27])]
    lines += [f"pop r{n}" for n in reversed(KEPT)]
    return "\n".join(["#define __SFR_OFFSET 0", ".text", *lines, "ret", ""])


@pytest.mark.parametrize("routine", ROUTINES)
def test_a_call_changes_what_the_contract_says_and_takes_no_stack(
    routine, compile_avr, run_board, root, tmp_path
):
    rng = np.random.default_rng(3)
    signed = np.concatenate([SPECIAL, SPECIAL | 0x80000000])
    special = np.stack(np.meshgrid(signed, signed), -1).reshape(-1, 2)
    pairs = np.concatenate([rng.integers(0, 1 << 32, (2_000, 2)), special]).astype("<u4")
    probe = tmp_path / "probe.S"
    probe.write_text(probe_of(routine))
    routines = root / "firmware/library/src/avr_float.S"
    elf = compile_avr(CALLS, f"-DCOUNT={len(pairs)}", probe, routines)
    run = run_board(elf, stream=pairs.tobytes())
    seen = np.frombuffer(run.output, "u1").reshape(-1, 24)
    a, b = pairs.view("<f4").T
    with np.errstate(all="ignore"):
        wanted = (a * b, a - b, a + b, a / b, np.sqrt(a))[ROUTINES[routine]]
    result = np.ascontiguousarray(seen[:, :4]).view("<f4")[:, 0]
    assert np.array_equal(result, wanted, equal_nan=True)
    assert (seen[:, 4:22] == 0xA0 + np.array(KEPT)).all()
    assert not seen[:, 22].any(), "r1 is zero"
    assert (seen[:, 23] & 0x80).all(), "interrupts stay on"
    assert run.report.sections[1].stack_bytes == 3, "the return address of a chip with 256 KB"


def test_the_routines_can_be_left_out(compile_avr, root):
    """Then nothing of the file is left, and avr-libc's routines, which are larger, are linked."""
    routines = root / "firmware/library/src/avr_float.S"
    made = {}
    for name, flags in {"ours": (), "theirs": ("-DAUVEST_NO_AVR_FLOAT",)}.items():
        elf = compile_avr(PROGRAM, "-DCOUNT=1UL", *flags, routines)
        called = ["avr-nm", elf]
        made[name] = subprocess.run(called, capture_output=True, text=True, check=True).stdout
    assert "divide_special" in made["ours"]
    assert "divide_special" not in made["theirs"]
    assert "__divsf3" in made["theirs"]
