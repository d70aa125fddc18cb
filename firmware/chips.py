"""Chips that QEMU has a board of: how a program for them is compiled, and how it is run.

A program is C++ over ``firmware/qemu/board.hpp``; ``firmware/qemu/start.cpp`` starts it, without
the C library's start-up, and counts its stack. QEMU's time is not the chip's, so no cycles are
counted.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from auvest.firmware import hil

ROOT = Path(__file__).resolve().parents[1]
QEMU = ROOT / "firmware" / "qemu"
INCLUDES = (
    f"-I{QEMU}",
    f"-I{ROOT / 'firmware' / 'library' / 'src'}",
    f"-I{ROOT / 'cpp' / 'include'}",
    "-isystem",
    "/usr/include/eigen3",
)

#: As the Arduino cores of these chips compile a sketch, and with the one flag that they lack.
SKETCH_FLAGS = (
    *("-Os", "-std=gnu++11", "-ffp-contract=off", "-fno-threadsafe-statics", "-Wall", "-Wextra"),
    *("-ffunction-sections", "-fdata-sections", "-fno-unwind-tables"),
    "-fno-asynchronous-unwind-tables",
)
_COMMON = ("-fno-exceptions", "-fno-rtti", "-DEIGEN_NO_IO", "-DEIGEN_NO_MALLOC")
_EIGEN = ("-DEIGEN_DONT_VECTORIZE", "-DEIGEN_NO_DEBUG")
_LINK = ("-nostdlib", "-Wl,--gc-sections", "-T", str(QEMU / "board.ld"))
_LIBRARIES = ("-Wl,--start-group", "-lm", "-lc", "-lgcc", "-Wl,--end-group")

#: The Debian package of each command.
PACKAGES = {
    **hil.PACKAGES,
    "riscv64-unknown-elf-g++": "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf",
    "qemu-system-riscv32": "qemu-system-misc",
}
#: What only a program that hangs takes, s: an end for the command, no bound on speed.
_TIMEOUT_S = 1800


class ChipError(RuntimeError):
    """A program could not be built or run; the message says what is missing or went wrong."""


@dataclass(frozen=True)
class Memory:
    """Where flash and RAM of a board are, and their sizes in bytes."""

    flash: int
    flash_bytes: int
    ram: int
    ram_bytes: int


@dataclass(frozen=True)
class Chip:
    """A chip, its compiler, and the board of QEMU that has it.

    Attributes
    ----------
    name : str
    tools : str
        What the names of its compiler's commands begin with.
    flags : tuple of str
        Those that choose the chip and its C library.
    qemu : tuple of str
        The emulator with its board.
    memory : Memory
        Of that board.
    """

    name: str
    tools: str
    flags: tuple[str, ...]
    qemu: tuple[str, ...]
    memory: Memory

    @property
    def compiler(self) -> str:
        """Command of the compiler."""
        return f"{self.tools}-g++"


@dataclass(frozen=True)
class Sizes:
    """Bytes of a program: code, constants and what variables start from; variables."""

    flash: int
    ram: int


@dataclass(frozen=True)
class Run:
    """Deepest stack of a run, and what the program has written."""

    stack_bytes: int
    trace: bytes


def _arm(name: str, machine: str, flags: Sequence[str], memory: Memory) -> Chip:
    chosen = (*flags, "-mthumb", "--specs=nano.specs")
    return Chip(name, "arm-none-eabi", chosen, ("qemu-system-arm", "-machine", machine), memory)


_NRF51 = Memory(0, 256 << 10, 0x20000000, 16 << 10)
_MPS2 = Memory(0, 4 << 20, 0x20000000, 4 << 20)
_VIRT = Memory(0x80000000, 4 << 20, 0x80400000, 4 << 20)

_M7 = ("-mcpu=cortex-m7", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16")

_CHIPS = (
    _arm("cortex-m0", "microbit", ["-mcpu=cortex-m0"], _NRF51),
    # The same instructions, scheduled for the shorter pipeline.
    _arm("cortex-m0plus", "microbit", ["-mcpu=cortex-m0plus"], _NRF51),
    *(_arm(name, *board, _MPS2) for name, board in hil.CORTEX.items()),
    _arm("cortex-m7", "mps2-an500", _M7, _MPS2),
    # Debian has no C++ library for it: the headers are those for AVR, and Eigen is told so.
    Chip(
        "riscv32imc",
        "riscv64-unknown-elf",
        (
            *("-march=rv32imc", "-mabi=ilp32", "--specs=picolibc.specs"),
            *("-DEIGEN_MAX_CPP_VER=3", "-isystem", str(ROOT / "firmware" / "avr_std")),
        ),
        ("qemu-system-riscv32", "-machine", "virt", "-bios", "none"),
        _VIRT,
    ),
)
CHIPS = {chip.name: chip for chip in _CHIPS}


def build(
    chip: Chip, sources: Sequence[Path], program: Path, flags: Sequence[str | Path] = SKETCH_FLAGS
) -> Path:
    """Compile a program.

    Parameters
    ----------
    chip : Chip
    sources : sequence of Path
        C++ over ``board.hpp``, with a ``main``.
    program : Path
        What is made; beside it goes a folder with its objects.
    flags : sequence
        Of the compiler, and further include paths, which are searched first.

    Returns
    -------
    Path
        `program`.

    Raises
    ------
    ChipError
        If a tool is missing or fails.
    """
    require(chip.compiler)
    objects = program.with_name(f"{program.name}.objects")
    objects.mkdir(parents=True, exist_ok=True)
    compiler = [chip.compiler, *map(str, flags), *_COMMON, *_EIGEN, *chip.flags, *INCLUDES]
    made = []
    for source in (QEMU / "start.cpp", *sources):
        made.append(objects / f"{source.stem}.o")  # board.ld knows the harness by start.o
        _call([*compiler, "-c", str(source), "-o", str(made[-1])], f"compiling for {chip.name}")
    memory = ",".join(
        f"--defsym={name}={value:#x}"
        for name, value in (
            ("flash_begin", chip.memory.flash),
            ("flash_bytes", chip.memory.flash_bytes),
            ("ram_begin", chip.memory.ram),
            ("ram_bytes", chip.memory.ram_bytes),
        )
    )
    command = [chip.compiler, *chip.flags, f"-Wl,{memory}", *_LINK, *map(str, made), *_LIBRARIES]
    _call([*command, "-o", str(program)], f"linking for {chip.name}")
    return program


def sizes(chip: Chip, program: Path) -> Sizes:
    """Give the bytes of a program, the harness left out."""
    text = _call([f"{chip.tools}-size", "-A", str(program)], "asking for the sizes").decode()
    section = {
        name: int(size)
        for name, size, *_ in (line.split() for line in text.splitlines() if line[:1] == ".")
    }
    code = sum(section.get(name, 0) for name in (".text", ".ARM.extab", ".ARM.exidx"))
    data = section.get(".data", 0)
    return Sizes(code + data, data + section.get(".bss", 0))


def run(chip: Chip, program: Path, record: bytes, folder: Path) -> Run:
    """Run a program on a record.

    Parameters
    ----------
    chip : Chip
    program : Path
        From :func:`build`.
    record : bytes
        What it reads.
    folder : Path
        For its files; of one run at a time.

    Raises
    ------
    ChipError
        If it fails, crashes or does not end, or its stack met its data.
    """
    require(chip.qemu[0])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "record.bin").write_bytes(record)
    _call(hil.semihosted(chip.qemu, program.resolve()), f"running on {chip.name}", folder)
    stack = int.from_bytes((folder / "stack.bin").read_bytes(), "little")
    return Run(stack, (folder / "trace.bin").read_bytes())


def require(command: str) -> None:
    """Raise ChipError, with the package to install, if a command is missing."""
    if shutil.which(command) is None:
        raise ChipError(f"{command} is missing: apt-get install {PACKAGES[command]}")


def _call(command: Sequence[str], what: str, folder: Path | None = None) -> bytes:
    try:
        done = subprocess.run(
            command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT_S
        )
    except subprocess.TimeoutExpired:
        raise ChipError(f"{what} took more than {_TIMEOUT_S} s: {' '.join(command)}") from None
    if done.returncode != 0:
        said = (done.stderr or done.stdout).decode(errors="replace")
        raise ChipError(
            f"{what} failed with exit code {done.returncode}\n{' '.join(command)}\n{said}"
        )
    return done.stdout
