"""The HTML report in a real browser: it loads, shows its figures and needs no network."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import dom_of

from auvest.logs import LogFolder
from auvest.logs.write import write_file
from auvest.replay import Settings, replay, report

#: Runs before the page's own policy is known, and says at the end what the browser saw.
PROBE = """<script>
const trouble = [];
addEventListener("error", (e) => trouble.push(String(e.message || e.target.src)), true);
addEventListener("securitypolicyviolation", (e) => trouble.push(e.violatedDirective));
addEventListener("load", () => {
  const pictures = [...document.images].map((i) => [i.alt, i.complete && i.naturalWidth > 0]);
  const loaded = performance.getEntriesByType("resource").map((e) => e.name.slice(0, 30));
  document.documentElement.dataset.seen = JSON.stringify({pictures, loaded, trouble});
});
</script>"""


def opened(page: str, folder: Path) -> dict[str, Any]:
    """What the browser says about a page, without a network."""
    path = folder / "page.html"
    assert page.count("<head>") == 1
    path.write_text(page.replace("<head>", f"<head>{PROBE}"), encoding="utf-8")
    shown, said = dom_of(path.as_uri(), folder)
    seen = re.search(r'data-seen="([^"]*)"', shown)
    assert seen is not None, said[-2000:]
    value: dict[str, Any] = json.loads(unescape(seen[1]))
    return value


def log(folder: Path, *, truth: bool) -> LogFolder:
    time_s = 1.0 * np.arange(1, 41)
    write_file(folder, "odometry.csv", time_s=time_s, forward_m=0 * time_s + 1, left_m=0 * time_s,
               turn_rad=0 * time_s)  # fmt: skip
    ranges = np.hypot(time_s - 20, 15.0)
    ranges[30] += 50.0
    write_file(folder, "ranges.csv", time_s=time_s, source=[0] * 40, range_m=ranges)
    write_file(folder, "beacons.csv", source=[0], x_m=[20.0], y_m=[15.0])
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    if truth:
        write_file(folder, "truth.csv", time_s=time_s, x_m=time_s, y_m=0 * time_s)
    return LogFolder(folder)


FIGURES = ["Tracks", "Innovations and three sigma", "NIS", "Weights"]


@pytest.mark.parametrize("truth", [True, False])
def test_report_loads_and_shows_its_figures_without_a_network(tmp_path: Path, truth: bool) -> None:
    result = replay(log(tmp_path / "log <1>", truth=truth), Settings())
    page = report.html(result)
    seen = opened(page, tmp_path)
    expected = [*FIGURES[:1], "Error and three sigma", *FIGURES[1:]] if truth else FIGURES
    assert seen["pictures"] == [[title, True] for title in expected]
    assert seen["trouble"] == []
    assert all(name.startswith("data:") for name in seen["loaded"])
    # Nothing in the file even asks for another one.
    bare = re.sub(r'src="data:[^"]*"', "", page)
    assert not re.search(r"(\bsrc=|href|url\(|@import|https?:)", bare)
    assert "log &lt;1&gt;: replay with robust-ekf" in bare
    assert '<th>rejected</th><td class="number">1</td>' in bare


def test_the_probe_sees_what_is_wrong(tmp_path: Path) -> None:
    page = report.html(replay(log(tmp_path / "log", truth=False), Settings()))
    broken = page.replace("image/svg+xml;base64,P", "image/svg+xml;base64,Q", 1)
    assert sorted({ok for _, ok in opened(broken, tmp_path)["pictures"]})[::-1] == [True, False]
    foreign = page.replace("<h1>", '<img alt="far" src="http://example.org/a.png"><h1>')
    seen = opened(foreign, tmp_path)
    assert ["far", False] in seen["pictures"]
    assert "img-src" in seen["trouble"]
