"""The page docs/firmware.md: its sketches are compiled, and run on the simulated board."""

import math
import re

import numpy as np
import pytest

from auvest.board import SerialLine
from auvest.firmware import sketch

pytest_plugins = ["board_support"]

BEACONS = [(0.0, 0.0), (120.0, 0.0), (60.0, 90.0)]


@pytest.fixture(scope="module")
def page(root):
    """Return the page."""
    return (root / "docs" / "firmware.md").read_text()


@pytest.fixture(scope="module")
def sketches(page):
    """Return its sketches: own protocol, any filter, SLATF, the self-test."""
    return re.findall(r"^```cpp\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


@pytest.fixture
def compiles(library, compile_cpp):
    """Return a function that compiles the source of a sketch, warnings as errors."""

    def compiles(source):
        core = sketch.find_hardware() / "arduino" / "avr"
        compile_cpp(
            "avr-g++", source, "-fsyntax-only", "-mmcu=atmega2560", "-std=gnu++11", "-Os", "-Wall",
            "-Wextra", "-Werror", "-DARDUINO=10819", "-DF_CPU=16000000L",
            f"-I{core / 'cores' / 'arduino'}", f"-I{core / 'variants' / 'mega'}",
            f"-I{library.parent / 'auvest' / 'src'}",
        )  # fmt: skip

    return compiles


def test_own_protocol_on_the_board(build_sketch, board, sketches, page):
    """The page's words: late ranges, an outlier, a clock that wraps; and it knows where it is."""
    random = np.random.default_rng(3)
    x, y, heading = 12.0, 9.0, 0.3
    lines, places = [], []
    for k in range(60):
        heading += 0.02
        x, y = x + math.cos(heading), y + math.sin(heading)
        places.append((x, y))
        compass = math.degrees(heading + random.normal(0, 0.03))
        ms = (1000 * k + 2**32 - 20_000) % 2**32
        lines.append(f"V,{1000 * (1 + random.normal(0, 0.05)):.0f},{100 * compass:.0f},{ms}")
        if k >= 2:  # measured two seconds ago
            range_m = math.dist(places[k - 2], BEACONS[k % 3]) + random.normal(0, 0.5)
            lines.append(f"R,{k % 3},{1000 * (range_m + 40 * (k % 10 == 7)):.0f},2000")
    reports, answers = [], {}
    with board(build_sketch(sketches[0]).elf, limit_s=30.0) as running:
        for k, line in enumerate(lines):
            running.send(line, delay_s=0.1 + 0.02 * k if k < 4 else 0.02 + 0.02 * (line[0] == "R"))
            if line.startswith("R"):
                text = next(event.text for event in running if isinstance(event, SerialLine))
                assert text.startswith("P,")
                answers[line] = text
                reports.append([int(cell) for cell in text.split(",")[1:]])
    found = np.array(reports)
    error_m = np.hypot(*(found[:, :2] / 100 - np.array(places)[2:]).T)
    assert not found[:, 4].any(), "every range was taken at its time"
    outliers = np.arange(2, 60) % 10 == 7
    assert not found[outliers, 3].any(), "40 m too long: weight 0"
    assert found[~outliers, 3].mean() > 90
    assert error_m[20:].max() < 1.5  # 3 sigma of one range
    assert (found[20:, 2] < 60).all()
    # Ranges and what the sketch answers are those that the page shows.
    shown = dict(re.findall(r"^(R,\S+) +-> +(P,\S+)", page, re.MULTILINE))
    assert len(shown) == 6
    assert shown.items() <= answers.items(), answers


def test_each_filter_of_the_table_takes_one_line(compiles, sketches, page):
    line = "auvest::Ekf<Process> filter;"
    source = sketches[1]
    assert source.count(line) == 1
    rows = re.findall(r"^\| .* \| `(auvest::.*;)` \|$", page, re.MULTILINE)
    assert rows[0] == line
    assert len(rows) == 7
    # One file, each in a namespace of its own: the library's headers are read once.
    head, _, body = source.partition("#include <auvest.h>\n")
    parts = [f"namespace n{k} {{ {body.replace(line, row)} }}\n" for k, row in enumerate(rows)]
    compiles(head + "#include <auvest.h>\n" + "".join(parts))


def test_a_hundred_particles_fit(build_sketch, board, sketches):
    compiled = build_sketch(sketches[2])
    with board(compiled.elf, for_s=4.0) as running:
        lines = [event.text for event in running if isinstance(event, SerialLine)]
    print(f"static {compiled.ram} B, stack {running.report.stack_bytes} B")
    assert running.report.free_bytes >= 500
    assert len(lines) >= 2
    assert abs(float(lines[0]) - 5 * math.cos(0.5)) < 1, "a second at 5 m/s and 0.5 rad"


def test_the_self_test_in_a_sketch(sketches, compiles, page):
    """It compiles; that it notices a flag that was forgotten is in tests/parity."""
    compiles(sketches[3])
    assert "auvest::self_test()" in sketches[3]
    told = page.partition("## The same bits")[2]
    for place in (
        "platform.local.txt",
        "boards.local.txt",
        "build_flags",
        "target_compile_options",
    ):
        assert re.search(rf"{place}.*-ffp-contract=off|-ffp-contract=off.*{place}", told), place
