"""Compile an Arduino sketch with the library, as the Arduino IDE does.

    python -m auvest.firmware.sketch SKETCH_DIR --library ZIP --output DIR

The work is done by arduino-builder, the program that the Arduino IDE 1.x itself runs: it turns the
.ino file into C++, finds the libraries that the sketch includes, takes the compiler's options from
the core's platform.txt and boards.txt, and reports the size. The library is unpacked into an empty
sketchbook, so nothing but the zip and the core is seen.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

MEGA2560 = "arduino:avr:mega:cpu=atmega2560"
UNO = "arduino:avr:uno"

# Debian's core is made for a newer avr-gcc than Debian's: its <float.h> has no DECIMAL_DIG in C++.
_CORE_NEEDS = "-DDECIMAL_DIG=__DECIMAL_DIG__"

# Where arduino-builder finds how to run arduino-ctags.
_BUILDER_HARDWARE = Path("/usr/share/arduino-builder")


class SketchError(RuntimeError):
    """The sketch did not compile, or a tool is missing; the message says which."""


@dataclass(frozen=True)
class Compiled:
    """What came out of the compiler.

    Attributes
    ----------
    elf, hex
        The program, with and without its symbols.
    flash
        Bytes of program storage used, of `flash_size`.
    ram
        Bytes of global variables, of `ram_size`.
    report
        What the IDE shows: sizes, warnings.
    """

    elf: Path
    hex: Path
    flash: int
    flash_size: int
    ram: int
    ram_size: int
    report: str


def find_hardware() -> Path:
    """Return the folder of Arduino cores: the first ``arduino/hardware`` among the data folders."""
    folders = os.environ.get("XDG_DATA_DIRS") or "/usr/local/share:/usr/share"
    for folder in folders.split(":"):
        hardware = Path(folder) / "arduino" / "hardware"
        if hardware.is_dir():
            return hardware
    raise SketchError(
        f"no Arduino core in {folders}: install arduino-core-avr, or pass its folder 'hardware'"
    )


def compile_sketch(
    sketch: Path,
    library: Path,
    output: Path,
    *,
    hardware: Path | None = None,
    board: str = MEGA2560,
    define: Mapping[str, str] | None = None,
    warnings: str = "default",
) -> Compiled:
    """Compile a sketch.

    Parameters
    ----------
    sketch
        Folder with the .ino file of the same name.
    library
        The zip of the Arduino library.
    output
        Folder for everything that is made; the program goes to ``output/<sketch>``. The compiled
        core is kept there too and serves the next sketch.
    hardware
        Folder of Arduino cores, as ``.../arduino/hardware``; found if not given.
    board
        Fully qualified board name.
    define
        Macros to define in the sketch's C++ files, the library and the core.
    warnings
        ``none``, ``default``, ``more`` or ``all``, as in the IDE's preferences.

    Raises
    ------
    SketchError
        If it does not compile, or a tool is missing.
    """
    sketch = sketch.resolve()
    if not (sketch / f"{sketch.name}.ino").is_file():
        raise SketchError(f"{sketch}: a sketch is a folder with a file {sketch.name}.ino")
    if not library.is_file():
        raise SketchError(f"{library}: no such library; make it with auvest library")
    builder = shutil.which("arduino-builder")
    if builder is None:
        raise SketchError("arduino-builder is not installed: install arduino-builder")
    if shutil.which("avr-g++") is None:
        raise SketchError("avr-g++ is not installed: install gcc-avr avr-libc")

    output = output.resolve()
    sketchbook = output / "sketchbook"
    _unpack(library, sketchbook / "libraries")
    flags = " ".join(
        [_CORE_NEEDS, *(f"-D{name}={value}" for name, value in sorted((define or {}).items()))]
    )
    # A core depends on the macros too, which the builder's cache overlooks.
    cache = output / "core" / hashlib.sha256(f"{board} {flags}".encode()).hexdigest()[:16]
    build = output / sketch.name
    for folder in (cache, build):
        folder.mkdir(parents=True, exist_ok=True)
    command = [
        builder,
        "-compile",
        *("-hardware", hardware or find_hardware()),
        *("-hardware", _BUILDER_HARDWARE),
        *("-tools", Path(builder).parent),
        *("-libraries", sketchbook / "libraries"),
        *("-fqbn", board),
        *("-build-path", build),
        *("-build-cache", cache),
        *("-warnings", warnings),
        *("-prefs", f"compiler.cpp.extra_flags={flags}"),
        sketch,
    ]
    done = subprocess.run(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
    )
    if done.returncode != 0:
        raise SketchError(f"{sketch.name} does not compile:\n{done.stdout}")
    sizes = re.findall(r"uses? (\d+) bytes .*Maximum is (\d+) bytes", done.stdout)
    if len(sizes) != 2:
        raise SketchError(f"{sketch.name}: arduino-builder reported no sizes:\n{done.stdout}")
    (flash, flash_size), (ram, ram_size) = ((int(used), int(size)) for used, size in sizes)
    return Compiled(
        elf=build / f"{sketch.name}.ino.elf",
        hex=build / f"{sketch.name}.ino.hex",
        flash=flash,
        flash_size=flash_size,
        ram=ram,
        ram_size=ram_size,
        report=done.stdout,
    )


def _unpack(library: Path, libraries: Path) -> None:
    """Make `libraries` a folder with the content of the zip and nothing else."""
    stamp = libraries.parent / "unpacked"
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    if stamp.is_file() and stamp.read_text() == digest:
        return
    if libraries.exists():
        shutil.rmtree(libraries)
    libraries.mkdir(parents=True)
    with zipfile.ZipFile(library) as archive:
        archive.extractall(libraries)
    stamp.write_text(digest)


def _definition(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.isidentifier():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, value


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="auvest.firmware.sketch", description=__doc__.split("\n")[0]
    )
    parser.add_argument("sketch", type=Path, metavar="SKETCH_DIR", help="folder of the .ino file")
    parser.add_argument(
        "--library", type=Path, required=True, metavar="ZIP", help="made by auvest library"
    )
    parser.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="where the program goes"
    )
    parser.add_argument(
        "--hardware",
        type=Path,
        metavar="DIR",
        help="folder of Arduino cores (default: arduino/hardware in the system's data folders)",
    )
    parser.add_argument(
        "--board", default=MEGA2560, metavar="FQBN", help="board (default: %(default)s)"
    )
    parser.add_argument(
        "--define",
        type=_definition,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="define a macro; may be repeated",
    )
    parser.add_argument(
        "--warnings",
        choices=["none", "default", "more", "all"],
        default="default",
        help="the compiler's warnings (default: %(default)s)",
    )
    arguments = parser.parse_args()
    try:
        compiled = compile_sketch(
            arguments.sketch,
            arguments.library,
            arguments.output,
            hardware=arguments.hardware,
            board=arguments.board,
            define=dict(arguments.define),
            warnings=arguments.warnings,
        )
    except SketchError as error:
        print(f"auvest.firmware.sketch: {error}", file=sys.stderr)
        return 1
    print(compiled.report, end="", file=sys.stderr)
    print(compiled.elf)
    print(compiled.hex)
    return 0


if __name__ == "__main__":
    sys.exit(main())
