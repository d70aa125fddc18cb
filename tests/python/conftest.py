"""What several test files share."""

import signal
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top of the source tree."""
    return ROOT


@pytest.fixture
def ctrl_c():
    """Have Ctrl-C act as in a terminal: a parent may have had it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def run(tmp_path):
    """Return a function that runs a command outside the source tree and returns its stdout.

    A command that fails fails the test, with all that it printed.
    """

    def run(*command, cwd=tmp_path, env=None):
        done = subprocess.run(
            [str(part) for part in command],
            cwd=cwd,
            env=env,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            pytest.fail(
                f"{' '.join(map(str, command))}: exit code {done.returncode}\n"
                f"{done.stdout}\n{done.stderr}",
                pytrace=False,
            )
        return done.stdout

    return run


@pytest.fixture
def run_cpp(tmp_path, run):
    """Return a function that builds one C++ source against auvest as a user would, and runs it.

    `get_auvest` is the CMake code that defines auvest::auvest; `definitions` go to cmake as -D.
    """

    def run_cpp(source, get_auvest=f"add_subdirectory({ROOT} auvest)", definitions=()):
        (tmp_path / "main.cpp").write_text(source)
        (tmp_path / "CMakeLists.txt").write_text(
            f"""cmake_minimum_required(VERSION 3.16)
project(consumer LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 11)
set(CMAKE_CXX_EXTENSIONS OFF)
{get_auvest}
add_executable(consumer main.cpp)
target_compile_options(consumer PRIVATE -Wall -Wextra -Werror)
target_link_libraries(consumer PRIVATE auvest::auvest)
"""
        )
        build = tmp_path / "build"
        run("cmake", "-S", tmp_path, "-B", build, *(f"-D{d}" for d in definitions))
        run("cmake", "--build", build)
        return run(build / "consumer")

    return run_cpp
