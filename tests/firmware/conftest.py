"""What several firmware tests share: the library as a user gets it, and compiled sketches."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from auvest.firmware import package, sketch

ROOT = Path(__file__).resolve().parents[2]

#: The Debian package of each compiler.
COMPILERS = {
    "avr-g++": "gcc-avr avr-libc",
    "arm-none-eabi-g++": "gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib",
    "g++": "g++",
    "clang++": "clang",
}


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top of the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def library(tmp_path_factory) -> Path:
    """Return the zip of the Arduino library; the unpacked folder ``auvest`` lies beside it."""
    return package.package(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="session")
def build_sketch(library, tmp_path_factory):
    """Return a function that compiles a sketch: a folder, or the source of one.

    All share one output folder, so Arduino's core is compiled once. The options are those of
    `auvest.firmware.sketch.compile_sketch`.
    """
    outputs = tmp_path_factory.mktemp("sketches")

    def build_sketch(folder_or_source, *, define=None, **options):
        folder = folder_or_source
        if not isinstance(folder, Path):
            folder = tmp_path_factory.mktemp("sketch")
            (folder / f"{folder.name}.ino").write_text(folder_or_source)
        # What was compiled with other macros or for another board is kept: a test may compare them.
        define = define or {}
        board = options.get("board", sketch.MEGA2560).split(":")[2]
        output = outputs / "_".join([board, *(f"{k}={v}" for k, v in sorted(define.items()))])
        return sketch.compile_sketch(folder, library, output, define=define, **options)

    return build_sketch


@pytest.fixture(scope="session")
def example(build_sketch, root, tmp_path_factory):
    """Return a function that compiles an example as it comes, with all warnings, each once."""
    folder = tmp_path_factory.mktemp("examples")
    results = {}

    def example(name):
        if name not in results:
            compiled = build_sketch(root / "firmware/library/examples" / name, warnings="all")
            # One that is edited takes its place.
            results[name] = replace(compiled, elf=shutil.copy(compiled.elf, folder / f"{name}.elf"))
        return results[name]

    return example


@pytest.fixture(scope="session")
def build_edited(build_sketch, example, root, tmp_path_factory):
    """Return a function that compiles an example, edited as a user would.

    ``settings`` are those of its config.h; ``edits`` are files, a text in each and its replacement.
    """

    def build_edited(name, edits=(), **settings):
        if not edits and not settings:
            return example(name)
        folder = tmp_path_factory.mktemp("edited") / name
        shutil.copytree(root / "firmware/library/examples" / name, folder)
        config = (folder / "config.h").read_text()
        for old, new in settings.items():
            assert config.count(f" {old} = ") == 1, f"config.h has one setting {old}"
            before, _, rest = config.partition(f" {old} = ")
            config = f"{before} {old} = {new};{rest.partition(';')[2]}"
        (folder / "config.h").write_text(config)
        for file, old, new in edits:
            source = (folder / file).read_text()
            assert source.count(old) == 1, f"{file} has {old!r} once"
            (folder / file).write_text(source.replace(old, new))
        compiled = build_sketch(folder)
        # The next sketch of this name takes its place.
        return replace(compiled, elf=shutil.copy(compiled.elf, folder / f"{name}.elf"))

    return build_edited


@pytest.fixture
def compile_cpp(tmp_path):
    """Return a function that compiles C++ and returns what the compiler prints.

    A compiler that fails fails the test, unless `fails`.
    """

    def compile_cpp(compiler, source, *options, fails=False):
        if shutil.which(compiler) is None:
            pytest.fail(f"{compiler} is not installed: install {COMPILERS[compiler]}")
        path = tmp_path / "source.cpp"
        path.write_text(source)
        command = [compiler, *options, path, "-o", tmp_path / "object"]
        done = subprocess.run(
            [str(part) for part in command], capture_output=True, text=True, cwd=tmp_path
        )
        if fails != (done.returncode != 0):
            pytest.fail(f"{source}\nexit code {done.returncode}\n{done.stderr}", pytrace=False)
        return done.stderr

    return compile_cpp
