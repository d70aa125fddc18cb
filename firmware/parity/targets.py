"""The targets on which a record is replayed: how the program is built and how it is run.

Each target compiles one of the ``main`` functions beside this file around ``replay.hpp`` or
``slatf_replay.hpp`` or ``vehicle_replay.hpp``.
"""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from auvest.firmware import hil
from firmware import chips

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "firmware/parity"
BENCH = ROOT / "firmware/bench"
WASM = ROOT / "firmware/wasm"
INCLUDES = (f"-I{ROOT / 'cpp/include'}", f"-I{ROOT / 'cpp'}", "-I/usr/include/eigen3")

_WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-Werror")
_EIGEN = ("-DEIGEN_NO_IO", "-DEIGEN_NO_MALLOC", "-DEIGEN_DONT_VECTORIZE")

#: The Debian package of each command.
PACKAGES = {
    "g++": "g++",
    "clang++": "clang",
    "wasm-ld": "lld",
    "node": "nodejs",
    "avr-g++": "gcc-avr avr-libc",
    **chips.PACKAGES,
}

#: Simulated seconds that a replay on the ATmega2560 may take.
_LIMIT_S = 600
#: What only a replay that hangs takes, s: an end for the command, no bound on speed.
_TIMEOUT_S = 1800


class ReplayError(RuntimeError):
    """A program could not be built, or did not end well."""


@dataclass(frozen=True)
class Target:
    """A compiler with its flags, and what runs the program.

    Attributes
    ----------
    name : str
    compiler : str
        Command of the compiler.
    flags : tuple of str
        Its flags, but for the include paths.
    machine : {"host", "avr", "mps2-an385", "mps2-an386", "chip", "wasm"}
        The computer itself, the simulated ATmega2560 board, a board of QEMU with newlib's files,
        that of the chip of this name in :data:`firmware.chips.CHIPS`, without any, or WebAssembly
        in node.
    library : tuple of Path
        What the Arduino library compiles beside the headers.
    header : str
        What is replayed: ``replay.hpp``, ``slatf_replay.hpp`` or ``vehicle_replay.hpp``.
    """

    name: str
    compiler: str
    flags: tuple[str, ...]
    machine: Literal["host", "avr", "mps2-an385", "mps2-an386", "chip", "wasm"]
    library: tuple[Path, ...] = ()
    header: str = "replay.hpp"

    @property
    def sources(self) -> tuple[Path, ...]:
        """What is compiled."""
        if self.machine in ("avr", "chip", "wasm"):
            return (HERE / "avr.cpp", *self.library)
        if self.machine == "host":
            return (HERE / "host.cpp",)
        return (HERE / "host.cpp", BENCH / "cortex_m.cpp")

    def build(self, program: Path, *extra: str | Path) -> Path:
        """Compile the replay program; ``extra`` are further flags and sources.

        Raises
        ------
        ReplayError
            If the compiler is missing or fails.
        """
        require(self.compiler)
        own = [f'-DAUVEST_REPLAY="{self.header}"']
        if self.machine == "avr":
            own += [f"-I{ROOT / 'firmware/board'}", f"-I{ROOT / 'firmware/avr_std'}"]
        if self.machine == "wasm":
            require("wasm-ld")
            own.append(f"-I{WASM}")
        if self.machine == "chip":
            flags = (*self.flags, *extra, *own, f"-I{ROOT / 'cpp'}")
            try:
                return chips.build(chips.CHIPS[self.name], self.sources, program, flags)
            except chips.ChipError as error:
                raise ReplayError(str(error)) from None
        # Before the library's own path: what is in `extra` is found first.
        command = [self.compiler, *self.flags, *map(str, extra), *own, *INCLUDES]
        command += [*map(str, self.sources), "-o", str(program)]
        _run(command, f"compiling for {self.name}")
        return program

    def replay(self, program: Path, record: Path, trace: Path, board: Path | None) -> bytes:
        """Run the program on a record and give its trace.

        Parameters
        ----------
        program : Path
            From :meth:`build`.
        record, trace : Path
            Files: the record, and where the trace goes.
        board : Path
            The runner ``auvest-board``; only the ATmega2560 uses it.

        Raises
        ------
        ReplayError
            If the program fails, crashes or does not end.
        """
        files = [str(record), str(trace)]
        if self.machine == "chip":
            try:
                folder = trace.with_name(f"{trace.name}.run")
                return chips.run(chips.CHIPS[self.name], program, record.read_bytes(), folder).trace
            except chips.ChipError as error:
                raise ReplayError(str(error)) from None
        if self.machine == "host":
            command = [str(program), *files]
        elif self.machine == "avr":
            command = [str(board), "--input", files[0], "--output", files[1]]
            command += ["--limit", str(_LIMIT_S), str(program)]
        elif self.machine == "wasm":
            require("node")
            command = ["node", str(WASM / "replay.mjs"), str(program), *files]
        else:
            require("qemu-system-arm")
            command = hil.qemu(self.machine, program, files)
        _run(command, f"replaying on {self.name}")
        return trace.read_bytes()


def require(command: str) -> None:
    """Raise ReplayError, with the package to install, if a command is missing."""
    if shutil.which(command) is None:
        raise ReplayError(f"{command} is missing: apt-get install {PACKAGES[command]}")


def _run(command: list[str], what: str) -> None:
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=_TIMEOUT_S
        )
    except subprocess.TimeoutExpired:
        raise ReplayError(f"{what} took more than {_TIMEOUT_S} s: {' '.join(command)}") from None
    if done.returncode != 0:
        raise ReplayError(
            f"{what} failed with exit code {done.returncode}\n{' '.join(command)}\n"
            f"{done.stdout}{done.stderr}"
        )


def _host(compiler: str, *flags: str) -> Target:
    name = "-".join([{"g++": "gcc", "clang++": "clang"}[compiler], *(f.lstrip("-") for f in flags)])
    common = ("-std=c++11", "-ffp-contract=off", *_WARNINGS)
    return Target(name, compiler, (*flags, *common), "host")


def _avr(name: str, *flags: str, library: tuple[Path, ...] = ()) -> Target:
    chip = ("-mmcu=atmega2560", "-DF_CPU=16000000UL")
    common = (*chip, "-std=gnu++11", "-fno-exceptions", *flags, *_WARNINGS)
    return Target(name, "avr-g++", common, "avr", library)


def _cortex(name: str) -> Target:
    machine, flags = hil.CORTEX[name]
    common = ("-O2", "-std=c++11", "-ffp-contract=off", "-mthumb", *flags, *_EIGEN, *_WARNINGS)
    common += ("-fno-exceptions", "-fno-rtti", "--specs=rdimon.specs", f"-T{BENCH / 'mps2.ld'}")
    return Target(name, "arm-none-eabi-g++", common, machine)


def _wasm(name: str, *flags: str) -> Target:
    common = ("--target=wasm32-wasi", "-O2", "-std=c++11", "-ffp-contract=off", *_EIGEN, *flags)
    # Without assertions, which would print: then the host gives the program nothing but board.hpp.
    common += ("-DEIGEN_NO_DEBUG", "-fno-exceptions", "-fno-rtti", *_WARNINGS)
    # A function that is called, not a command that begins and ends: so no arguments, files or exit.
    common += ("-mexec-model=reactor", "-Wl,--export=main", "-Wl,-z,stack-size=1048576")
    return Target(name, "clang++", common, "wasm")


TARGETS = (
    _host("g++", "-O0"),
    _host("g++", "-O3", "-march=native"),
    _host("clang++", "-O0"),
    _host("clang++", "-O3", "-march=native"),
    # As the Arduino IDE compiles a sketch, with the library's assembler routines; and without them.
    _avr(
        "atmega2560-ide",
        *("-Os", "-flto", "-fuse-linker-plugin", "-fpermissive", "-fno-threadsafe-statics"),
        *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"),
        "-DAUVEST_ARDUINO_LIBRARY",
        library=tuple(sorted((ROOT / "firmware" / "library" / "src").glob("*.S"))),
    ),
    _avr("atmega2560-O2", "-O2"),
    _cortex("cortex-m4f"),
    _cortex("cortex-m3"),
    _wasm("wasm32"),
)


def _chip(name: str) -> Target:
    chip = chips.CHIPS[name]
    return Target(name, chip.compiler, (*chips.SKETCH_FLAGS, *_WARNINGS), "chip")


#: Chips with another compiler or other floats than those above: software on a Cortex-M0, the newer
#: unit of a Cortex-M7, software and another C library on RISC-V. With the options of a sketch.
CHIP_TARGETS = tuple(map(_chip, ("cortex-m0", "cortex-m7", "riscv32imc")))


# ---- SLAT ----------------------------------------------------------------------------------------

#: Particles of the paper; and what the RAM of the ATmega2560 holds beside the stack: whole blocks
#: of 16 (auvest/particles/lanes.hpp).
PARTICLES, AVR_PARTICLES = 100, 48

#: Masters that the programs off the ATmega2560 have room for.
MASTERS = 2


def _slat(target: Target, name: str = "", *flags: str) -> Target:
    if target.machine != "avr":  # there the program is of one record, see Record.program()
        flags = (f"-DAUVEST_PARTICLES={PARTICLES}", f"-DAUVEST_MASTERS={MASTERS}", *flags)
    flags = (*target.flags, *flags)
    return replace(target, name=target.name + name, flags=flags, header="slatf_replay.hpp")


#: The lanes of a target in which SLATF 1.0 and 2.0 run, too: of SSE2, and of the widest set that
#: there is; of WebAssembly. (gcc's lanes against its scalar code: tests/cpp/simd.)
LANES = {
    "clang-O3-march=native": (("sse2",), ("default_arch",)),
    "wasm32": (("wasm", "-msimd128"),),
}

#: The same for the filters that localise and track.
SLATF_TARGETS = (
    *map(_slat, TARGETS),
    *(
        _slat(target, f"-{lanes}", f"-DAUVEST_LANES={lanes}", "-DAUVEST_KINDS=0xf", *flags)
        for target in TARGETS
        for lanes, *flags in LANES.get(target.name, ())
    ),
)


# ---- A vehicle -----------------------------------------------------------------------------------

#: The same for hulls, guidance, control and the model-aided filter.
VEHICLE_TARGETS = tuple(replace(target, header="vehicle_replay.hpp") for target in TARGETS)


# ---- A fixed lag ---------------------------------------------------------------------------------

#: Predictions that the program of ``smoother_replay.hpp`` looks back.
LAG = 12

#: The same for the fixed lag, which is compiled where a compiler or a library may make a
#: difference.
SMOOTHER_TARGETS = tuple(
    replace(target, header="smoother_replay.hpp")
    for target in TARGETS
    if target.name in ("gcc-O3-march=native", "atmega2560-ide", "cortex-m4f", "wasm32")
)
