"""The page where the firmware runs, in a real browser: bits, sliders, speed, network, phone."""

from __future__ import annotations

import gzip
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from firmware.browser import trace
from firmware.browser.build import PACKAGES, ROOT, build
from tests.devtools import Tab
from tests.slow import SLOW

#: Numbers of a sample of tracking_loop that are compared, its status too.
NUMBERS = 12


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """Return the page; what has been made for it before is kept in build/page."""
    for command, packages in PACKAGES.items():
        if shutil.which(command) is None:
            pytest.skip(f"{command} is missing: apt-get install {packages}")
    return build(tmp_path_factory.mktemp("page") / "page.html", ROOT / "build" / "page")


@pytest.fixture
def opened(page, tmp_path):
    """Return a function that opens the page with what stands behind its #; it must go well."""
    with Tab(tmp_path) as tab:

        def opened(chosen: str) -> Tab:
            tab.open(f"{page.as_uri()}#{chosen}")
            return tab

        yield opened
        assert tab.evaluate("auvest.errors") == []
        assert tab.trouble == []
        assert all(re.match("file:|blob:|data:", address) for address in tab.requests)


def slide(tab: Tab, name: str, value: float) -> None:
    """Move a slider, as a hand does."""
    tab.evaluate(
        f"{{ const input = document.querySelector('input[name={name}]');"
        f"input.value = {value}; input.dispatchEvent(new Event('input')); }}"
    )


def press(tab: Tab, label: str) -> None:
    """Press the button with this text."""
    found = "[...document.querySelectorAll('button')].find((b) => b.textContent === LABEL)"
    tab.evaluate(f"{found.replace('LABEL', json.dumps(label))}.click()")


def run_to(tab: Tab, time_s: float) -> dict[str, Any]:
    """State of the run that is under way, as soon as it has come so far."""
    state: dict[str, Any] = tab.wait_for(f"auvest.state?.time > {time_s} && auvest.state")
    return state


def test_it_is_small(page):
    assert len(gzip.compress(page.read_bytes(), 9)) < 500_000


def test_the_stored_record_is_what_the_desk_computes():
    assert trace.TRACE.read_text(encoding="utf-8") == trace.text(), (
        "if the arithmetic was meant to change: python -m firmware.browser.trace"
    )


def test_chip_webassembly_and_desk_agree_in_every_bit(opened):
    tab = opened("speed=0")
    checked = tab.wait_for("auvest.checked")
    assert checked["samples"] == checked["wanted"] == trace.SAMPLES
    assert checked["numbers"] == trace.SAMPLES * (NUMBERS - 1)
    assert (checked["onChip"], checked["inWasm"], checked["selfTest"]) == (0, 0, 0)
    assert tab.evaluate("document.querySelectorAll('#checked li:not([class=\"\"])').length") == 0
    run = tab.wait_for("auvest.runs[0]")
    assert run["time"] > 60
    assert run["rows"] > 60
    assert run["numbers"] == NUMBERS * run["rows"]
    assert run["differing"] == 0
    assert tab.evaluate("document.querySelector('#differing').textContent") == "0"


def test_a_bit_that_differs_is_shown(page, tmp_path):
    word = json.loads(trace.TRACE.read_text(encoding="utf-8"))["words"][30][4]
    # The worker's script stands in the page's as text, the record in it.
    text, found = re.subn(rf"\b{word}\b", str(word ^ 1), page.read_text(encoding="utf-8"), count=1)
    assert found == 1
    other = tmp_path / "other.html"
    other.write_text(text, encoding="utf-8")
    with Tab(tmp_path) as tab:
        tab.open(other.as_uri())
        checked = tab.wait_for("auvest.checked")
        assert (checked["onChip"], checked["inWasm"]) == (1, 1)
        assert tab.evaluate("document.querySelectorAll('#checked li.failed').length") == 2


def test_the_tracking_loop_reacts(opened):
    tab = opened("speed=4")
    slide(tab, "outliers", 30)
    slide(tab, "wander", 3)
    # While the first run goes on: the next begins with what is set.
    late = "auvest.rows().filter(({ outlier }) => outlier).length > 5"
    assert tab.wait_for(f"{late} && auvest.runs.length === 0")
    # Late by 5 m on average, where the gate allows some 0.2 m: of six, one at least is refused.
    assert tab.evaluate("auvest.rows().some(({ outlier, status }) => outlier && status === 14)")
    off = "Math.hypot(...[auvest.rows().at(-1)].map(({ x, wantedX }) => x - wantedX))"
    assert tab.wait_for(f"{off} > 0.3 && auvest.runs.length === 0")
    press(tab, "0.5 s")
    assert tab.wait_for("auvest.state?.policy === 2 && auvest.rows().length > 20")
    assert tab.evaluate("auvest.rows().every(({ interval_s }) => interval_s === 0.5)")
    assert run_to(tab, 10)["differing"] == 0


def test_the_mission_reacts(opened):
    tab = opened("show=mission&speed=0")
    slide(tab, "current", 0.6)
    slide(tab, "towards", 90)
    state = run_to(tab, 16)
    assert state["kind"] == "mission"
    assert state["differing"] == 0
    assert state["numbers"] > 500
    # It grows by 0.05 m/s in a second.
    now = tab.evaluate("auvest.rows().at(-1)")
    assert now["east"] == pytest.approx(0.6, abs=1e-9)
    assert now["north"] == pytest.approx(0, abs=1e-9)
    # The vehicle steers into it: ahead it goes north, and its bow is turned to port.
    assert now["x"] > 25
    assert now["yaw"] < -0.1


def test_on_a_phone_nothing_is_wider_than_the_screen(opened):
    tab = opened("")
    tab.resize(390, 844, phone=True)
    tab.wait_for("auvest.checked && auvest.rows().length > 3")
    for kind in ("tracking", "mission"):
        tab.evaluate(f"document.querySelector('[data-kind={kind}]').click()")
        tab.wait_for(f"auvest.state?.kind === '{kind}' && auvest.rows().length > 1")
        assert tab.evaluate("document.documentElement.scrollWidth") == 390
        assert tab.evaluate("[...document.querySelectorAll('canvas')].every((c) => c.width > 390)")
        # A thumb's size.
        heights = "[...document.querySelectorAll('button')].map((b) => b.offsetHeight)"
        assert min(tab.evaluate(heights)) >= 32


@SLOW
@pytest.mark.parametrize(("show", "time_s"), [("tracking", 60), ("mission", 120)])
def test_it_runs_at_ten_times_real_time(opened, show, time_s):
    """Of processor time: other programs may run beside it. What the page draws is counted, too."""
    tab = opened(f"show={show}&speed=0")
    tab.wait_for("auvest.checked")
    press(tab, "Again")
    before_s = tab.processor_s()
    state = run_to(tab, time_s)
    spent_s = tab.processor_s() - before_s
    print(f"{show}: {state['time']:.0f} s in {spent_s:.1f} s, {state['time'] / spent_s:.0f} times")
    assert state["differing"] == 0
    assert state["time"] / spent_s >= 10
