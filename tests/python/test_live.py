"""What is drawn of a recording while it grows: the page, in a real browser, and the terminal."""

from __future__ import annotations

import io
import json
import math
import re
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from browser import dom_of
from processes import PATIENCE_S, start_program, wait_until
from rich.console import Console
from test_capture import HEADER, PortWithBoard, port, sample_line  # noqa: F401 (a fixture)

from auvest.commands.live import LivePage, course, terminal_view
from auvest.telemetry import Row


@dataclass
class Growing:
    """A recording that a test makes grow."""

    rows: list[Row] = field(default_factory=list)
    damaged: int = 0

    def add(self, *, section: int = 1, **numbers: float) -> None:
        self.rows.append({"section": section, **numbers})


def asked(url: str, **headers: str) -> Any:
    with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=60) as answer:
        return json.loads(answer.read())


@pytest.fixture
def growing() -> Growing:
    recording = Growing(damaged=2)
    recording.add(x_m=1.0, y_m=-2.0, nis=math.nan)
    recording.add(x_m=1.5, y_m=-2.5, nis=3.25)
    recording.add(section=2, x_m=2.0, y_m=-1.0, nis=0.5)
    return recording


@pytest.fixture
def page(growing: Growing) -> Iterator[LivePage]:
    with LivePage(growing, "dive <7>") as page:
        yield page


def test_the_page_gets_what_it_does_not_have(growing: Growing, page: LivePage) -> None:
    first = asked(f"{page.url}rows?since=0")
    assert first["columns"] == ["section", "x_m", "y_m", "nis"]
    assert first["rows"] == [[1, 1.0, -2.0, None], [1, 1.5, -2.5, 3.25], [2, 2.0, -1.0, 0.5]]
    assert (first["title"], first["sections"], first["damaged"]) == ("dive <7>", 2, 2)
    assert asked(f"{page.url}rows?since=3")["rows"] == []
    growing.add(section=2, x_m=4.0, y_m=5.0, nis=1.0)
    assert asked(f"{page.url}rows?since=3")["rows"] == [[2, 4.0, 5.0, 1.0]]


@pytest.mark.parametrize(
    ("path", "host", "code"),
    [
        ("rows?since=0", "elsewhere.example", 403),
        ("rows?since=-1", "", 404),
        ("rows?since=x", "", 404),
        ("rows?since=" + "9" * 400, "", 404),
        ("../../etc/passwd", "", 404),
    ],
)
def test_nothing_else_is_served(page: LivePage, path: str, host: str, code: int) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        asked(page.url + path, **({"Host": host} if host else {}))
    assert refused.value.code == code


def test_a_browser_draws_it(page: LivePage, tmp_path: Path) -> None:
    shown, _ = dom_of(page.url, tmp_path)
    captions = [unescape(text) for text in re.findall(r"<figcaption>(.*?)</figcaption>", shown)]
    assert captions == [
        "track, m: (2, -1)",
        "x_m: 2  (1 to 2)",
        "y_m: -1  (-2.5 to -1)",
        "nis: 0.5  (0.5 to 3.25)",
    ]
    assert '<h1 id="title">dive &lt;7&gt;</h1>' in shown
    assert "3 samples; sections 2; damaged lines 2" in shown
    track, *strips = re.findall(r"<svg.*?</svg>", shown)
    assert re.findall(r'points="(.*?)"', track) == ["1,2 1.5,2.5 2,1"]  # up is up
    assert all(strip.count("<line") == 1 for strip in strips)  # where the second section begins
    assert re.findall(r'points="(.*?)"', strips[2]) == [
        "200,5 400,95"
    ]  # not through what is missing


def test_the_terminal_has_the_last_number_and_the_course_of_each_column(growing: Growing) -> None:
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(terminal_view(growing, bars=True))
    lines = [line.split(None, 2) for line in console.export_text().splitlines()]
    assert [line[:2] for line in lines] == [["x_m", "2"], ["y_m", "-1"], ["nis", "0.5"]]
    assert [line[2].strip() for line in lines] == ["▁▅█", "▃▁█", "█▁"]


def test_the_course_of_numbers() -> None:
    assert course([0.0, 3.5, 7.0]) == "▁▅█"
    assert course([2.0, 2.0]) == "▁▁"
    assert course([math.nan, 1.0, math.inf]) == " ▁ "
    assert course([math.nan]) == " "


def test_a_recording_says_where_its_page_is(port: PortWithBoard, tmp_path: Path) -> None:  # noqa: F811
    command = [sys.executable, "-m", "auvest", "capture", "--port", port.name, "--live"]
    command += ["--steps", "3", "--no-figure", "--output", str(tmp_path / "dive")]
    with start_program(command) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        url = said.split()[-1]
        assert said == f"Note: the recording is drawn at {url}\n"
        port.wait_until_open(process)
        port.say(HEADER)
        port.say(sample_line(1))
        port.say(sample_line(2))
        wait_until(lambda: len(asked(f"{url}rows?since=0")["rows"]) == 2, "two samples", process)
        assert asked(f"{url}rows?since=1")["rows"][0][1] == 2
        port.say(sample_line(3))
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    with pytest.raises(urllib.error.URLError):
        asked(f"{url}rows?since=0")
