"""The simulated board for tests: the runner, built once, and programs for it.

A test file takes the fixtures with ``pytest_plugins = ["board_support"]``.
"""

import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from auvest.board import Board, Report

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "firmware"


def tool(name, package):
    """Find a program, or fail with the Debian package that has it."""
    path = shutil.which(name)
    if path is None:
        pytest.fail(f"{name} is missing: apt-get install {package}", pytrace=False)
    return path


def run_tool(*command):
    """Run a command; its failure is the test's, with all that it printed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        text = f"{' '.join(map(str, command))}\n{done.stdout}\n{done.stderr}"
        pytest.fail(text, pytrace=False)
    return done.stdout


@dataclass(frozen=True)
class Run:
    """One call of the runner: exit code, stderr, report and serial output."""

    code: int
    error: str
    report: Report
    serial: bytes
    output: bytes


@pytest.fixture(scope="session")
def runner():
    """Return the path of auvest-board, built here by CMake."""
    cmake = tool("cmake", "cmake")
    run_tool(cmake, "-S", ROOT, "-B", BUILD, "-D", "AUVEST_BUILD_FIRMWARE=ON")
    run_tool(cmake, "--build", BUILD, "--target", "auvest-board")
    (path,) = BUILD.rglob("auvest-board")
    return path


@pytest.fixture
def compile_avr(tmp_path):
    """Return a function that compiles C++ source for the ATmega2560 and returns the ELF's path."""

    def compile_avr(source, *flags, mcu="atmega2560"):
        compiler = tool("avr-g++", "gcc-avr avr-libc")
        (tmp_path / "program.cpp").write_text(source)
        elf = tmp_path / "program.elf"
        run_tool(
            compiler,
            f"-mmcu={mcu}",
            "-std=c++11",
            "-DF_CPU=16000000UL",
            *("-Os", "-Wall", "-Wextra", "-Werror"),
            f"-I{ROOT / 'firmware' / 'board'}",
            *flags,
            tmp_path / "program.cpp",
            *("-o", elf),
        )
        return elf

    return compile_avr


@pytest.fixture
def run_board(runner, tmp_path):
    """Return a function that calls the runner with a program; the world is in files."""

    def run_board(elf, *options, stream=None):
        files = {name: tmp_path / f"board.{name}" for name in ("report", "serial", "output")}
        given = [part for name, path in files.items() for part in (f"--{name}", path)]
        if stream is not None:
            (tmp_path / "board.input").write_bytes(stream)
            given += ["--input", tmp_path / "board.input"]
        done = subprocess.run([runner, *given, *map(str, options), elf], capture_output=True)
        error = done.stderr.decode()
        assert done.returncode in (0, 1), error
        report = files["report"].read_text()
        return Run(
            code=done.returncode,
            error=error,
            report=Report.from_json(report),
            serial=files["serial"].read_bytes(),
            output=files["output"].read_bytes(),
        )

    return run_board


@pytest.fixture
def board(runner):
    """Return `Board` with the runner filled in; the world is the test."""

    def board(elf, **options):
        return Board(elf, runner=runner, **options)

    return board
