"""Build the page where the firmware runs: one HTML file that needs no network.

    python -m firmware.browser.build [--output dist/page.html] [--work build/page]

The sketches are compiled as the Arduino IDE does, the world and the sketches' filters as
WebAssembly, and esbuild puts them and the page's scripts into one file. What is in the work folder
already is made anew only where its sources have changed.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from auvest.firmware import package, sketch

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
EXAMPLES = ROOT / "firmware" / "library" / "examples"
#: Simulation headers, and those of a chip's line, are sources of the WebAssembly too.
HEADERS = (ROOT / "cpp" / "include", ROOT / "cpp" / "simulation")

_CLANG = (
    *("clang++", "--target=wasm32-wasi", "-mexec-model=reactor", "-O2", "-std=c++11"),
    *("-ffp-contract=off", "-fno-exceptions", "-fno-rtti", "-DNDEBUG"),
    *("-DEIGEN_NO_IO", "-DEIGEN_NO_MALLOC", "-DEIGEN_DONT_VECTORIZE", "-DEIGEN_NO_DEBUG"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-Wl,--strip-all"),
)

#: The Debian package of each command.
PACKAGES = {
    "clang++": "clang libc++-14-dev-wasm32 libclang-rt-14-dev-wasm32 wasi-libc",
    "wasm-ld": "lld",
    "node": "nodejs",
    "npm": "npm",
}


class BuildError(RuntimeError):
    """The page cannot be built; the message says what is missing or went wrong."""


@dataclass(frozen=True)
class Program:
    """A sketch as the page runs it: an example, with settings as a user would edit them.

    Attributes
    ----------
    name : str
        Of the program in the page.
    example : str
        Of the library's examples.
    edits : tuple of (str, str, str)
        A file, a text in it, and what takes its place.
    """

    name: str
    example: str
    edits: tuple[tuple[str, str, str], ...] = ()


def _policy(default: str, chosen: str) -> tuple[str, str, str]:
    before = f"using IntervalPolicy = auvest::{default}<float>;"
    return ("config.h", before, f"using IntervalPolicy = auvest::{chosen}<float>;")


_BUDGET = "p.initial_s = kFixInterval; p.min_s = 0.1f; p.max_s = 10; p.position_sigma_m = 1;"

#: The interval policies are chosen when a sketch is compiled: a program for each.
PROGRAMS = (
    Program("tracking_law", "tracking_loop"),
    Program(
        "tracking_budget",
        "tracking_loop",
        (_policy("MahalanobisInterval", "CovarianceBudget"),),
    ),
    Program(
        "tracking_fixed",
        "tracking_loop",
        (_policy("MahalanobisInterval", "FixedInterval"),),
    ),
    Program("mission_fixed", "mission"),
    Program(
        "mission_budget",
        "mission",
        (
            _policy("FixedInterval", "CovarianceBudget"),
            ("mission.ino", "p.interval_s = kFixInterval;", _BUDGET),
        ),
    ),
)


def build(output: Path, work: Path) -> Path:
    """Build the page.

    Parameters
    ----------
    output : Path
        The HTML file.
    work : Path
        Folder for everything else that is made.

    Returns
    -------
    Path
        `output`.

    Raises
    ------
    BuildError, auvest.firmware.sketch.SketchError
        If a tool is missing or fails.
    """
    for command, names in PACKAGES.items():
        if shutil.which(command) is None:
            raise BuildError(f"{command} is missing: apt-get install {names}")
    work.mkdir(parents=True, exist_ok=True)
    library = package.package(work)
    for program in PROGRAMS:
        compile_program(program, library, work)
    compile_world(work)
    install_packages(work)
    output.parent.mkdir(parents=True, exist_ok=True)
    _run(["node", str(HERE / "bundle.mjs"), str(work.resolve()), str(output.resolve())], "bundling")
    return output


def compile_program(program: Program, library: Path, work: Path) -> Path:
    """Compile a sketch; its machine code is a file of Intel's hexadecimal records."""
    folder = work / "sketches" / program.name / program.example
    made = work / f"{program.name}.hex"
    if folder.exists():
        shutil.rmtree(folder)
    shutil.copytree(EXAMPLES / program.example, folder)
    for name, old, new in program.edits:
        text = (folder / name).read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise BuildError(f"{program.example}/{name} does not have once: {old}")
        (folder / name).write_text(text.replace(old, new), encoding="utf-8")
    stamp = _digest(library, *sorted(folder.iterdir()))
    if _fresh(made, stamp):
        return made
    compiled = sketch.compile_sketch(folder, library, work / "compiled")
    shutil.copyfile(compiled.hex, made)
    _remember(made, stamp)
    return made


def compile_world(work: Path) -> Path:
    """Compile the world, the sensors and the sketches' filters to WebAssembly."""
    made = work / "world.wasm"
    headers = [path for folder in HEADERS for path in sorted(folder.rglob("*.hpp"))]
    settings = [
        EXAMPLES / name for name in ("tracking_loop/config.h", "mission/config.h", "mission/plan.h")
    ]
    source = HERE / "world.cpp"
    stamp = _digest(Path(__file__), source, *settings, *headers)
    if _fresh(made, stamp):
        return made
    includes = [f"-I{ROOT / 'cpp' / 'include'}", f"-I{ROOT / 'cpp'}", f"-I{EXAMPLES}"]
    includes += [f"-I{ROOT / 'firmware' / 'library' / 'src'}", "-I/usr/include/eigen3"]
    _run([*_CLANG, *includes, str(source), "-o", str(made)], "compiling to WebAssembly")
    _remember(made, stamp)
    return made


def install_packages(work: Path) -> None:
    """Install what package-lock.json names, to the byte, where it is not yet there."""
    lock = HERE / "package-lock.json"
    stamp = _digest(lock)
    modules = HERE / "node_modules"
    marker = work / "npm"
    if modules.is_dir() and _fresh(marker, stamp):
        return
    _run(["npm", "ci", "--no-audit", "--no-fund", "--prefix", str(HERE)], "npm ci")
    marker.touch()
    _remember(marker, stamp)


def _digest(*files: Path) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _stamp_of(made: Path) -> Path:
    return made.with_name(f"{made.name}.made-of")


def _fresh(made: Path, stamp: str) -> bool:
    kept = _stamp_of(made)
    return made.is_file() and kept.is_file() and kept.read_text(encoding="utf-8") == stamp


def _remember(made: Path, stamp: str) -> None:
    _stamp_of(made).write_text(stamp, encoding="utf-8")


def _run(command: list[str], what: str) -> None:
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, env=os.environ
    )
    if done.returncode != 0:
        raise BuildError(f"{what} failed:\n{' '.join(command)}\n{done.stdout}{done.stderr}")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="firmware.browser.build", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument(
        "--output", type=Path, default=ROOT / "dist" / "page.html", help="(default: %(default)s)"
    )
    parser.add_argument(
        "--work", type=Path, default=ROOT / "build" / "page", help="(default: %(default)s)"
    )
    arguments = parser.parse_args()
    try:
        print(build(arguments.output, arguments.work))
    except (BuildError, sketch.SketchError) as error:
        print(f"firmware.browser.build: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
