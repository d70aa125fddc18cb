"""The simulated board: found, or built from the sources that come with the package."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from auvest._headers import firmware_folder
from auvest.models._compile import cache_folder, find_compiler

_FLAGS = ("-std=c++17", "-O2")
_HEADERS = ("/usr/include/simavr", "/usr/local/include/simavr")
_LIBRARIES = ("-lsimavr", "-lelf")


class SimulatorError(RuntimeError):
    """The simulated board could not be built; the message says what to install."""


def find_or_build() -> Path:
    """Give the program ``auvest-board``.

    That which the environment variable AUVEST_BOARD names, or the PATH has; else it is compiled
    once and kept beside the compiled models (``auvest.load_models``).

    Raises
    ------
    SimulatorError
        If a compiler or simavr is missing.
    FileNotFoundError
        If AUVEST_BOARD names no program.
    """
    from auvest.board import find_runner

    if "AUVEST_BOARD" in os.environ or shutil.which("auvest-board"):
        return find_runner()
    sources = sorted((firmware_folder() / "board" / "runner").glob("*.[ch]pp"))
    compiler, version = find_compiler()
    parts = [version, *_FLAGS, *(path.read_text(encoding="utf-8") for path in sources)]
    key = hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]
    program = cache_folder() / f"auvest-board-{key}"
    if program.is_file():
        return program
    program.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=program.parent) as folder:
        made = Path(folder) / "auvest-board"
        units = [str(path) for path in sources if path.suffix == ".cpp"]
        includes = [f"-isystem{path}" for path in _HEADERS]
        command = [*compiler, *_FLAGS, *includes, *units, "-o", str(made), *_LIBRARIES]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise SimulatorError(
                "the simulated board does not compile; it needs libsimavr and libelf (Debian, "
                f"Ubuntu: apt install libsimavr-dev libelf-dev):\n{_first_lines(done.stderr)}"
            )
        made.replace(program)  # whole or not at all, whoever else does the same
    return program


def _first_lines(text: str) -> str:
    return "\n".join(text.splitlines()[:5])
