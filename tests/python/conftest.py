"""What several test files share."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from kept import FOLDER, difference, same, short
from messages import Messages, neutral, read, watch, write

ROOT = Path(__file__).resolve().parents[2]


def pytest_addoption(parser):
    """Add what renews the texts that are kept."""
    parser.addoption("--renew", action="store_true", help="write messages.txt and kept/ anew")


@pytest.fixture(scope="session")
def places(tmp_path_factory):
    """Return the folders that stand in texts, and what stands for them."""
    return {str(tmp_path_factory.getbasetemp()): "TMP", str(ROOT): "ROOT"}


@pytest.fixture(scope="session")
def known():
    """Return the messages of messages.txt."""
    return read()


@pytest.fixture(autouse=True)
def known_messages(request, monkeypatch, places, known):
    """Have every message that the test provokes be one of messages.txt."""
    messages = Messages(places)
    watch(monkeypatch, messages)
    yield
    new = [message for message in messages.said if message not in known]
    if new and request.config.getoption("--renew"):
        known.update(new, read())  # of another process, too
        write(known)
    elif new:
        pytest.fail("not in messages.txt (--renew adds it):\n" + "\n\n".join(new), pytrace=False)


@pytest.fixture
def kept(request, places):
    """Return a function that compares a text with the one that is kept under a name.

    ``exact``: to the last digit, where no number is computed.
    """

    def kept(name, text, *, exact=False):
        path, now = FOLDER / name, text if exact else short(neutral(text, places))
        if request.config.getoption("--renew"):
            path.write_text(now, encoding="utf-8")
        before = path.read_text(encoding="utf-8")
        if not (now == before if exact else same(now, before)):
            pytest.fail(f"{name}:\n{difference(now, before)}", pytrace=False)

    return kept


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top of the source tree."""
    return ROOT


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    """Return the path of a fresh wheel; compiled objects of earlier builds are reused."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", ROOT]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="session")
def sdist(tmp_path_factory):
    """Return the path of a fresh source distribution, of a checkout with a stray file."""
    stray = ROOT / "python" / "auvest" / "left [over] by someone.txt"
    code = "import backend, sys; print(backend.build_sdist(sys.argv[1]))"
    folder = tmp_path_factory.mktemp("sdist")
    stray.write_text("not tracked, not ignored")
    try:
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "python")}
        command = [sys.executable, "-c", code, folder]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    finally:
        stray.unlink()
    assert done.returncode == 0, done.stdout + done.stderr
    (sdist,) = folder.glob("*.tar.gz")
    return sdist


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
