"""The library's assembler kernels for AVR: the bits of the C++ that they stand for."""

import subprocess

import numpy as np
import pytest

pytest_plugins = ["board_support"]

# The same text on the board, where AUVEST_ARDUINO_LIBRARY brings the assembler, and on the host.
PROGRAM = """
#include "auvest/math/angle.hpp"
#include "auvest/math/linear_algebra.hpp"

namespace math = auvest::math;

#if defined(__AVR__)
#include "board.hpp"

uint8_t read_byte() { return board::read(); }
void write_byte(uint8_t byte) { board::write(byte); }
#else
#include <cstdio>

uint8_t read_byte() { return static_cast<uint8_t>(std::getchar()); }
void write_byte(uint8_t byte) { std::putchar(byte); }
#endif

float read() {
  uint32_t bits = 0;
  for (uint8_t i = 0; i < 4; ++i) bits = bits >> 8 | static_cast<uint32_t>(read_byte()) << 24;
  return math::from_bits(bits);
}

void write(float value) {  // one NaN for all: their payloads are each target's own
  uint32_t bits = math::is_nan(value) ? 0x7fc00000u : math::to_bits(value);
  for (uint8_t i = 0; i < 4; ++i, bits >>= 8) write_byte(static_cast<uint8_t>(bits));
}

// Beyond the ends of y nothing may be written.
void kernels() {
  float u[7], v[7], y[9];
  for (float& value : u) value = read();
  for (float& value : v) value = read();
  const float start = read();
  const float fence = 12345.0f;
  for (int count = 0; count <= 7; ++count) {
    write(math::plus_dot(start, u, v, count));
    write(math::minus_dot(start, u, v, count));
    if (count > 0) {
      write(math::dot(u, v, count));
      write(math::all_finite(u, count) ? 1.0f : 0.0f);
    }
    y[0] = y[8] = fence;
    for (int i = 0; i < 7; ++i) y[i + 1] = v[i];
    math::add_scaled(start, u, y + 1, count);
    for (float value : y) write(value);
  }
}

void angles() {
  const float angle = read();
  write(math::wrap(angle));
  write(math::sin(angle));
  write(math::atan2(angle, 0.75f));
  write(math::atan2(0.75f, angle));
}

int main() {
  for (uint32_t count = ROWS; count > 0; --count) kernels();
  for (uint32_t count = ANGLES; count > 0; --count) angles();
#if defined(__AVR__)
  board::finish();
#endif
}
"""


def rows():
    """Rows of 15 numbers: of ordinary size, of any bits, and with zeros, infinities and NaN."""
    rng = np.random.default_rng(1)
    ordinary = rng.normal(size=(400, 15)) * 10.0 ** rng.integers(-3, 4, (400, 15))
    any_bits = rng.integers(0, 1 << 32, (100, 15), dtype="<u4").view("<f4")
    special = np.array([0.0, -0.0, 1.0, -1.0, 1e-45, 3e38, np.inf, -np.inf, np.nan, 2.5])
    mixed = np.where(rng.random((100, 15)) < 0.2, rng.choice(special, (100, 15)), ordinary[:100])
    with np.errstate(over="ignore"):
        return np.concatenate([ordinary, any_bits, mixed]).astype("<f4")


def angles():
    """Angles of every size, next to the multiples of pi/4, and not finite."""
    rng = np.random.default_rng(2)
    any_bits = rng.integers(0, 1 << 32, 4_000, dtype="<u4").view("<f4")
    around = rng.uniform(-100, 100, 2_000).astype("<f4")
    multiples = (rng.integers(-(10**6), 10**6, 1_000) * (np.pi / 4)).astype("<f4")
    steps = rng.integers(-2, 3, multiples.size).astype("<i4")
    next_to = (multiples.view("<i4") + steps).view("<f4")
    special = [0.0, -0.0, np.pi, -np.pi, 9.424777, 9.424778, -9.424778, 3e38, -3e38]
    special += [1e-45, 1e-38, -2e-39, np.inf, -np.inf, np.nan]
    special += [16.849556, 1009.59283, 1010.59283]  # rounded up to -2, -2 and -1
    return np.concatenate([any_bits, around, next_to, np.array(special, "<f4")])


def test_the_board_has_the_bits_of_the_host(compile_avr, run_board, root, tmp_path):
    numbers, turns = rows(), angles()
    counts = [f"-DROWS={len(numbers)}", f"-DANGLES={len(turns)}"]
    headers = [f"-I{root / 'cpp/include'}", "-I/usr/include/eigen3"]
    record = tmp_path / "numbers.bin"
    record.write_bytes(numbers.tobytes() + turns.tobytes())

    source = tmp_path / "host.cpp"
    source.write_text(PROGRAM)
    host = tmp_path / "host"
    command = ["g++", "-std=c++11", "-O1", "-ffp-contract=off", *counts, *headers]
    subprocess.run([*command, source, "-o", host], check=True)
    with record.open("rb") as numbers_in:
        wanted = subprocess.run([host], stdin=numbers_in, capture_output=True, check=True).stdout

    library = root / "firmware/library/src"
    elf = compile_avr(
        PROGRAM,
        *(*counts, "-DAUVEST_ARDUINO_LIBRARY", f"-I{root / 'firmware/avr_std'}", *headers),
        *(library / name for name in ("avr_angle.S", "avr_float.S", "avr_kernels.S")),
    )
    run = run_board(elf, "--limit", "1000", stream=record.read_bytes())

    per_row = 8 * (2 + 9) + 7 * 2
    size = per_row * len(numbers)
    assert len(wanted) == 4 * (size + 4 * len(turns))
    found, true = (np.frombuffer(output, "<u4") for output in (run.output, wanted))
    assert found.size == true.size
    wrong = np.flatnonzero(found[:size] != true[:size])
    assert wrong.size == 0, f"{wrong.size} wrong, first: row and place {divmod(wrong[0], per_row)}"
    wrong = np.flatnonzero(found[size:] != true[size:])
    assert wrong.size == 0, f"{wrong.size} wrong, first: {turns[wrong[0] // 4]} at {wrong[0] % 4}"


@pytest.mark.parametrize("compiler", ["arm-none-eabi-gcc", "gcc"])
def test_other_chips_take_the_assembler_sources_as_empty(compiler, root, tmp_path):
    """Arduino compiles every source of a library for every board."""
    sources = sorted((root / "firmware/library/src").glob("*.S"))
    assert sources
    for source in sources:
        command = [compiler, "-c", "-x", "assembler-with-cpp", source, "-o", tmp_path / "empty.o"]
        subprocess.run(command, check=True)
