"""Hardware in the loop: a record through one filter on the desk and on a chip, bit by bit.

:func:`run` plays a :class:`~auvest.firmware.hil_record.Record` (or ``SlatRecord``, of a filter that
localises and tracks) to a target and compares what comes back with Python's filter in float32.
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._headers import firmware_folder, include_folders
from auvest.board import Board, WaitsForInput
from auvest.firmware import hil_record, hil_slat, simulator
from auvest.firmware.hil_bench import Bench, answer_of, bench
from auvest.firmware.hil_record import Record, Words
from auvest.firmware.hil_serial import over_serial
from auvest.firmware.hil_slat import SlatRecord
from auvest.firmware.package import package
from auvest.firmware.sketch import Compiled, compile_sketch
from auvest.logs import LogFolder
from auvest.logs.origin import local_origin, shifted
from auvest.models._compile import find_compiler
from auvest.replay import checks
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import replay_of
from auvest.replay.slat import Companion
from auvest.telemetry import LineError

#: Targets but for ``serial:PORT``, and how each is called.
TARGETS = {
    "host": "this computer",
    "atmega2560": "ATmega2560, simulated",
    "cortex-m3": "Cortex-M3 in QEMU",
    "cortex-m4f": "Cortex-M4F in QEMU",
}
SERIAL = "serial:"

#: The board of QEMU and the flags of the compiler for each Cortex-M.
CORTEX: dict[str, tuple[Literal["mps2-an385", "mps2-an386"], tuple[str, ...]]] = {
    "cortex-m3": ("mps2-an385", ("-mcpu=cortex-m3",)),
    "cortex-m4f": (
        "mps2-an386",
        ("-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
    ),
}
_COMMON = ("-std=c++11", "-O2", "-ffp-contract=off")
_CHIP = ("-DEIGEN_NO_IO", "-DEIGEN_NO_MALLOC", "-fno-exceptions", "-fno-rtti", "-mthumb")
#: The Debian packages of the commands for them.
PACKAGES = {
    "arm-none-eabi-g++": "gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib",
    "qemu-system-arm": "qemu-system-arm",
}
#: Words of an answer before those that are compared: its number and its microseconds.
_NUMBER, _STATUS, _MICROSECONDS, _NUMBERS = range(4)
_CLOCK_HZ = 16_000_000
#: What only a program that hangs takes, s.
_TIMEOUT_S = 1800

AnyRecord: TypeAlias = Record | SlatRecord
Progress = Callable[[int, int], None]


class HilError(RuntimeError):
    """A program could not be built or played to; the message says what is missing or went wrong."""


@dataclass(frozen=True)
class Difference:
    """The first number that a target has with other bits than the desk.

    Attributes
    ----------
    row : int
        0 is the start, k the k-th row.
    field : str
        Which number.
    target, desk : float
        What it is there, and here; of ``status`` a whole number.
    target_bits, desk_bits : int
        Their bits.
    ulp : int or None
        How many floats lie between them, one of the two included; None where one is no number.
    """

    row: int
    field: str
    target: float
    desk: float
    target_bits: int
    desk_bits: int
    ulp: int | None

    def __str__(self) -> str:
        there, here = (f"{value:.9g}" for value in (self.target, self.desk))
        apart = "" if self.ulp is None else f", {self.ulp:,} ulp apart"
        return (
            f"row {self.row}, {self.field}: {there} ({self.target_bits:08x}) there, "
            f"{here} ({self.desk_bits:08x}) on the desk{apart}"
        )


@dataclass(frozen=True, eq=False)
class Leg:
    """What a target made of a record.

    Attributes
    ----------
    target : str
    words : ndarray of uint32, shape (T + 1, fields)
        Bits after the start and after each row.
    differing : int
        How many of them are not those of the desk.
    difference : Difference or None
        The first of them.
    microseconds : ndarray, shape (T + 1,), or None
        Time of each step by the target's own clock; None: it has none.
    figures : dict
        What else was counted: flash, RAM, stack, cycles; damaged and repeated frames.
    """

    target: str
    words: Words
    differing: int
    difference: Difference | None
    microseconds: npt.NDArray[np.uint32] | None
    figures: dict[str, int] = field(default_factory=dict)

    def awake_share(self, record: AnyRecord) -> float | None:
        """Give the share of the record's time in which the filter computes, where it is known."""
        if self.microseconds is None or not record.dt.sum() > 0:
            return None
        return 1e-6 * float(self.microseconds[1:].sum()) / float(record.dt.sum(dtype=float))

    def document(self, record: AnyRecord) -> dict[str, Any]:
        """For JSON."""
        return {
            "target": self.target,
            "rows": len(record),
            "numbers": int(self.words.size),
            "differing": self.differing,
            "difference": None if self.difference is None else vars(self.difference),
            "microseconds_median": self._median_us,
            "awake_share": self.awake_share(record),
            **self.figures,
        }

    @property
    def _median_us(self) -> float | None:
        return None if self.microseconds is None else float(np.median(self.microseconds[1:]))


def record_of(
    log: LogFolder,
    settings: Settings,
    filter_name: FilterName | None = None,
    *,
    rows: int | None = None,
) -> AnyRecord:
    """Take the rows of a log as ``auvest replay`` would give them to this filter.

    Parameters
    ----------
    log, settings, filter_name
        As for :func:`auvest.replay.replay`.
    rows : int, optional
        So many at most; default: all.

    Raises
    ------
    ValueError
        If the log, the settings or the filter do not fit, or there is no row.
    """
    name = checks.filter_of(log, settings, filter_name)
    engine = replay_of(shifted(log, local_origin(log)), settings, name)
    if isinstance(engine, Companion):
        return hil_slat.record_of_replay(engine, rows)
    return hil_record.record_of_replay(engine, rows)


def run(
    record: AnyRecord,
    target: str,
    folder: Path,
    *,
    desk: Words | None = None,
    flags: Sequence[str] = (),
    progress: Progress | None = None,
) -> Leg:
    """Build the bench of a record for a target, play the record to it, and compare.

    Parameters
    ----------
    record : Record or SlatRecord
        What is played.
    target : str
        One of :data:`TARGETS`, or ``serial:PORT``.
    folder : Path
        For sources and programs.
    desk : ndarray, optional
        What ``record.on_desk()`` gives.
    flags : sequence of str
        Further flags of the compiler, on the computer and on Cortex-M.
    progress : callable, optional
        Called with the rows that are done, and all, where they go one by one.

    Raises
    ------
    HilError, LineLost, SketchError, SimulatorError, FileNotFoundError, ModelError
        If a tool is missing or fails; the message says what to install.
    BoardError
        If the program fails on the simulated board.
    """
    program = bench(record)
    folder.mkdir(parents=True, exist_ok=True)
    if flags and (target == "atmega2560" or target.startswith(SERIAL)):
        raise ValueError(f"flags are not for {target}: Arduino's core has its own")
    figures: dict[str, int] = {}
    if target == "host":
        lines = _on_host(program, folder, flags)
    elif target == "atmega2560":
        lines = _on_avr(program, folder, figures, progress)
    elif target in CORTEX:
        lines = _on_cortex(program, folder, target, flags)
    elif target.startswith(SERIAL):
        lines = over_serial(program, target.removeprefix(SERIAL), figures, progress)
    else:
        raise ValueError(f"target must be {', '.join(TARGETS)} or serial:PORT, not {target!r}")
    answers = _table(lines, program, len(record.fields))
    desk = record.on_desk() if desk is None else desk
    words = np.delete(answers, (_NUMBER, _MICROSECONDS), axis=1)
    difference = first_difference(words, desk, record.fields)
    clock = answers[:, _MICROSECONDS].astype(np.uint32)
    return Leg(
        target=target,
        words=words,
        differing=int((words != desk).sum()),
        difference=difference,
        microseconds=clock if clock.any() else None,
        figures=figures,
    )


def first_difference(there: Words, here: Words, fields: Sequence[str]) -> Difference | None:
    """Name the first number with other bits."""
    different = np.argwhere(there != here)
    if len(different) == 0:
        return None
    row, column = different[0].tolist()
    given = (there[row, column], here[row, column])
    of_target, of_desk = (float(word.view(np.float32) if column else word) for word in given)
    ulp = None
    if column and not np.isnan([of_target, of_desk]).any():
        ulp = ulps(*given)
    return Difference(row, fields[column], of_target, of_desk, int(given[0]), int(given[1]), ulp)


def ulps(a: int | np.uint32, b: int | np.uint32) -> int:
    """Give the distance of two float32, by their bits, in steps from a float to the next."""
    return abs(_ordered(int(a)) - _ordered(int(b)))


def _ordered(bits: int) -> int:
    """Give the place of a float among all: neighbours differ by 1, and both zeros are 0."""
    return bits if bits < 1 << 31 else (1 << 31) - bits


def _table(lines: Sequence[str], program: Bench, fields: int) -> Words:
    """Give the words of all answers, a line each.

    Raises
    ------
    HilError
        If they are not one answer per row.
    """
    rows = []
    for line in lines:
        try:
            kind, words = answer_of(line)
        except LineError as error:
            raise HilError(f"the bench answers what is no answer: {error}") from None
        if kind == "N":
            raise HilError(f"the bench refuses row {words[0]}: {program.rows[words[0]]}")
        if kind == "A":
            rows.append(words)
    counted = [words[_NUMBER] for words in rows] == list(range(len(program.rows)))
    if not counted or {len(words) for words in rows} != {fields + 2}:
        raise HilError(f"the bench has answered {len(rows)} of {len(program.rows)} rows")
    return np.array(rows, np.uint32)


# ---- Targets -------------------------------------------------------------------------------------


def _on_host(program: Bench, folder: Path, flags: Sequence[str]) -> list[str]:
    compiler, _ = find_compiler()
    built = build_host(program, folder, compiler, flags)
    return _play(program, folder, "host", lambda files: [str(built), *files])


def build_host(
    program: Bench, folder: Path, compiler: Sequence[str], flags: Sequence[str] = ()
) -> Path:
    """Compile a bench for this computer."""
    built = folder / "bench-host"
    command = [*compiler, *_COMMON, *flags, *_includes(program, folder)]
    _call([*command, str(_source("main.cpp")), "-o", str(built)], "compiling for this computer")
    return built


def _on_cortex(program: Bench, folder: Path, target: str, flags: Sequence[str]) -> list[str]:
    for name in PACKAGES:
        if shutil.which(name) is None:
            raise HilError(f"{name} is not installed: apt install {PACKAGES[name]}")
    machine, chip = CORTEX[target]
    built = folder / f"bench-{target}.elf"
    command = ["arm-none-eabi-g++", *_COMMON, *_CHIP, *chip, *flags, *_includes(program, folder)]
    command += ["--specs=rdimon.specs", f"-T{_source('mps2.ld')}"]
    command += [str(_source("main.cpp")), str(_source("cortex_m.cpp")), "-o", str(built)]
    _call(command, f"compiling for {target}")
    return _play(program, folder, target, lambda files: qemu(machine, built, files))


def _on_avr(
    program: Bench, folder: Path, figures: dict[str, int], progress: Progress | None
) -> list[str]:
    runner = simulator.find_or_build()
    compiled = build_sketch(program, folder)
    # A row takes some tenths of a second at most.
    limit_s = 60.0 + len(program.rows)
    answers = []
    with Board(compiled.elf, runner=runner, limit_s=limit_s, raw=True) as board:
        waits = (event for event in board if isinstance(event, WaitsForInput))
        for k, row in enumerate(program.rows):
            answers.append(next(waits).output)
            board.feed(f"{row}\n".encode("ascii"))
            if progress is not None:
                progress(k, len(program.rows) - 1)
        answers.append(next(waits).output)
    report = board.report
    step = report.sections[1]
    figures.update(
        flash_bytes=compiled.flash,
        static_ram_bytes=compiled.ram,
        stack_bytes=report.stack_bytes,
        cycles_min=step.minimum,
        cycles_median=step.median,
        cycles_max=step.maximum,
    )
    return b"".join(answers).decode("ascii").splitlines()


def build_sketch(program: Bench, folder: Path, *, serial: bool = False) -> Compiled:
    """Compile a bench for the MEGA2560, as the Arduino IDE does."""
    sketch = program.write(folder, serial=serial)
    return compile_sketch(sketch, package(folder), folder / "compiled")


def qemu(machine: str, program: Path, arguments: Sequence[str]) -> list[str]:
    """Give the command that runs a program on a board of QEMU with an ARM."""
    return semihosted(("qemu-system-arm", "-machine", machine), program, arguments)


def semihosted(emulator: Sequence[str], program: Path, arguments: Sequence[str] = ()) -> list[str]:
    """Give the command that runs a program on a board, its files those of this computer."""
    command = [*emulator, "-nographic", "-monitor", "none", "-serial", "none"]
    given = "".join(f",arg={part}" for part in (program.stem, *arguments))
    command += ["-kernel", str(program)]
    return [*command, "-semihosting-config", f"enable=on,target=native{given}"]


def _play(
    program: Bench, folder: Path, target: str, command: Callable[[list[str]], list[str]]
) -> list[str]:
    """Run a program that reads the rows from a file and writes its answers to one."""
    rows, answers = _files(program, folder, target)
    _call(command([str(rows), str(answers)]), f"running on {target}")
    return answers.read_text("ascii").splitlines()


def _files(program: Bench, folder: Path, target: str) -> tuple[Path, Path]:
    """Write the rows; give their file and that for the answers."""
    rows = folder / f"rows-{target}.txt"
    rows.write_text("\n".join(program.rows) + "\n", encoding="ascii")
    return rows, folder / f"answers-{target}.txt"


def _source(name: str) -> Path:
    return firmware_folder() / "bench" / name


def _includes(program: Bench, folder: Path) -> list[str]:
    sketch = program.write(folder)
    return [f"-I{sketch}", *(f"-isystem{path}" for path in include_folders())]


def _call(command: Sequence[str], what: str) -> None:
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=_TIMEOUT_S
        )
    except subprocess.TimeoutExpired:
        raise HilError(f"{what} took more than {_TIMEOUT_S} s") from None
    if done.returncode != 0:
        said = "\n".join((done.stderr or done.stdout).splitlines()[:8])
        raise HilError(f"{what} failed with exit code {done.returncode}:\n{said}")
