"""Programs on the boards of QEMU: what is counted of them, and what ends a run."""

import pytest

from firmware import chips
from firmware.chips import CHIPS

#: Takes 400 bytes of zeros, 8 that start from something, and a kilobyte of stack.
PROGRAM = """
#include "board.hpp"

volatile uint8_t zeros[400];
volatile uint32_t numbers[2] = {1, 2};
struct Started {
  Started() { zeros[3] = 7; }
} started;

__attribute__((noinline)) uint8_t deep(uint8_t x) {
  volatile uint8_t bytes[1024];
  for (uint16_t i = 0; i < sizeof bytes; ++i) bytes[i] = x;
  return bytes[x];
}

int main() {
  board::write(static_cast<uint8_t>(board::read() + 1));
  board::write(zeros[3]);
  board::write(static_cast<uint8_t>(numbers[1]));
  board::write(deep(9));
  board::finish();
}
"""


@pytest.fixture
def built(tmp_path):
    """Return a function that compiles a program for a chip."""

    def built(name, source):
        (tmp_path / "program.cpp").write_text(source)
        return chips.build(CHIPS[name], [tmp_path / "program.cpp"], tmp_path / "program.elf")

    return built


@pytest.mark.parametrize("name", CHIPS)
def test_a_program_is_counted_and_run(name, built, tmp_path):
    program = built(name, PROGRAM)
    run = chips.run(CHIPS[name], program, b"\x2a", tmp_path)
    assert run.trace == bytes([43, 7, 2, 9])
    assert 1024 < run.stack_bytes < 1024 + 160
    # The variables, and none of the harness; those that start from something are in flash too. A
    # global with a constructor takes a byte.
    sizes = chips.sizes(CHIPS[name], program)
    assert 408 <= sizes.ram <= 416
    assert 100 < sizes.flash < 500


@pytest.mark.parametrize("name", ["cortex-m0", "riscv32imc"])
@pytest.mark.parametrize(
    "body",
    [
        "board::fail();",
        "board::read(); board::finish();",  # past the end
        "reinterpret_cast<void (*)()>(0xfffffff0u)();",  # no memory there
        "",  # main returns
    ],
)
def test_what_goes_wrong_ends_the_run_as_a_failure(name, body, built, tmp_path):
    program = built(name, f'#include "board.hpp"\nint main() {{ {body} }}\n')
    with pytest.raises(chips.ChipError, match=f"running on {name} failed"):
        chips.run(CHIPS[name], program, b"", tmp_path)


def test_a_stack_that_meets_the_data_is_a_failure(built, tmp_path):
    """The micro:bit has 16 KB; without the check it would overwrite the variables in silence."""
    source = PROGRAM.replace("[1024]", "[15 * 1024]").replace("zeros[400]", "zeros[2000]")
    program = built("cortex-m0", source)
    with pytest.raises(chips.ChipError, match="running on cortex-m0 failed"):
        chips.run(CHIPS["cortex-m0"], program, b"\x2a", tmp_path)


def test_a_compiler_that_fails_is_quoted(built):
    with pytest.raises(chips.ChipError, match=r"compiling for cortex-m7 failed(?s:.*)nonsense"):
        built("cortex-m7", "nonsense\n")


def test_a_missing_tool_is_named_with_its_package(monkeypatch, built, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(chips.ChipError, match="apt-get install gcc-riscv64-unknown-elf picolibc"):
        built("riscv32imc", PROGRAM)
    with pytest.raises(chips.ChipError, match="apt-get install qemu-system-misc"):
        chips.run(CHIPS["riscv32imc"], tmp_path / "program.elf", b"", tmp_path)
