"""How long the report of a long log takes to open in a browser, and how large it is.

    python tests/python/report_speed.py [--hours 1 24]

The log is made up: a craft at 1 m/s goes to and fro past four beacons, with odometry ten times a
second, a range a second with an outlier in each twenty, and the truth once a second.
"""

from __future__ import annotations

import argparse
import re
import tempfile
import time
from pathlib import Path

import numpy as np
from browser import dom_of

from auvest.logs import LogFolder
from auvest.logs.write import write_file
from auvest.replay import Settings, replay, report

LANE_M = 400.0


def long_log(folder: Path, hours: float) -> LogFolder:
    """Write the log that the module's docstring describes."""
    random = np.random.default_rng(5)
    step_s = 0.1
    times = step_s * np.arange(1, round(3600 * hours / step_s) + 1)
    # To and fro: half a circle of 10 m radius after each lane.
    turning = (times % (LANE_M + 10 * np.pi)) > LANE_M
    sides = np.where((times // (LANE_M + 10 * np.pi)) % 2 == 0, 1.0, -1.0)
    rates = np.where(turning, 0.1 * sides, 0.0)
    headings = np.concatenate([[0.0], np.cumsum(rates) * step_s])
    middle = 0.5 * (headings[1:] + headings[:-1])
    x, y = np.cumsum(np.cos(middle)) * step_s, np.cumsum(np.sin(middle)) * step_s
    write_file(
        folder, "odometry.csv", time_s=times, left_m=0 * times, turn_rad=rates * step_s,
        forward_m=step_s + random.normal(0, 0.002, len(times)),
    )  # fmt: skip
    each = np.arange(9, len(times), 10)
    beacons = np.array(
        [[-50.0, -50.0], [450.0, -50.0], [450.0, y.max() + 50], [-50.0, y.max() + 50]]
    )
    source = np.arange(len(each)) % 4
    ranges = np.hypot(x[each] - beacons[source, 0], y[each] - beacons[source, 1])
    ranges += random.normal(0, 0.5, len(each))
    ranges += np.where(random.random(len(each)) < 0.05, random.uniform(5, 50, len(each)), 0.0)
    write_file(folder, "ranges.csv", time_s=times[each], source=source, range_m=ranges)
    write_file(folder, "beacons.csv", source=range(4), x_m=beacons[:, 0], y_m=beacons[:, 1])
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    write_file(folder, "truth.csv", time_s=times[each], x_m=x[each], y_m=y[each])
    return LogFolder(folder)


def opened(page: Path, folder: Path) -> tuple[float, float]:
    """Open a page: when it was drawn, by its own clock, and how long the browser ran in all, s."""
    begun = time.perf_counter()
    shown, _ = dom_of(page.as_uri(), folder, wait=False)
    drawn = re.search(r'data-drawn-ms="(\d+)"', shown)
    assert drawn is not None
    return int(drawn[1]) / 1000, time.perf_counter() - begun


def main() -> None:
    """Print a row for each length; of opening the page the quickest of three."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, nargs="+", default=[1.0, 24.0])
    hours = parser.parse_args().hours
    print("| log | estimates | page | made in | drawn after | the browser in all |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for length in hours:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            result = replay(long_log(folder / "log", length), Settings(), causes=False)
            begun = time.process_time()
            page = folder / "report.html"
            page.write_text(report.html(result), encoding="utf-8")
            made = time.process_time() - begun
            drawn_s, whole_s = min(opened(page, folder) for _ in range(3))
            print(
                f"| {length:g} h | {result.numbers['estimates']:,} | "
                f"{page.stat().st_size / 1e6:.1f} MB | {made:.2f} s | "
                f"{drawn_s:.2f} s | {whole_s:.1f} s |"
            )


if __name__ == "__main__":
    main()
