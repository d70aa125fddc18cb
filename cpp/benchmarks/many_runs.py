"""Speed of many runs side by side beside one by one: one thread, the time of the processor.

    python cpp/benchmarks/many_runs.py [--write docs/speed_runs.md]

Both ways take their turn, round by round, and must agree to the bit. Exit code 1 if a bound is
missed, or a bit differs.
"""

from __future__ import annotations

import argparse
import copy
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from checks import MARGIN, Check, judge, table

import auvest
from auvest.filters import _many
from auvest.simulation import paper_aukf, tracking

RUNS = 1000
ROUNDS = 5
#: Rows of a run: those of the AUKF's paper, and so many that what a call costs is nothing.
ROWS = (60, 600)
TARGETS = {"float32": 4.0, "float64": 2.0}

PAGE = """# Speed of many runs

Made by `make bench`: {runs:,} runs in one call of `run`, in lanes of {lanes}, beside a call each.
The times are the processor's, of one thread, medians of rounds in which both take their turn; only
the ratios travel to another machine. Both give the same bits. 60 rows are a run of the AUKF's
paper; with 600, what a call costs by itself is small beside its rows. "Not in lanes": the share of
the rows that their run took by itself.

| filter | rows | one call / us per step | a call each / us per step | not in lanes |
| --- | ---: | ---: | ---: | ---: |
{times}

The targets are for the machine that these numbers are from; `make bench` fails {margin} beyond.

{ratios}

`simulation.tracking.simulate`, which draws a world for each run and keeps more of it, with its
filters in the same lanes and one by one; its loop is C++ either way.

| scenario | in lanes / us per step | one by one / us per step | ratio |
| --- | ---: | ---: | ---: |
{scenarios}
"""


def six_states(dtype: str, rows: int) -> tuple[Any, np.ndarray, dict[str, Any]]:
    """Make the UKF of the AUKF's paper, and records from its scenario at a fixed interval."""
    ukf = auvest.Ukf(
        [0.2, 2.0, 0.1, 0.2, 0.01, 0.02],
        np.diag([0.05, 0.05, 0.02, 0.02, 0.005, 0.005]) ** 2,
        process=auvest.ConstantAcceleration(discretisation="euler"),
        sensors=auvest.RangeBearing(station=(0.2, 2.0), smallest_range_m=-10.0),
        alpha=1e-6,
        dtype=dtype,
    )
    t = 0.5 * np.arange(1, rows + 1)
    dx, dy = 0.1 * t + 0.005 * t**2, 0.2 * t + 0.01 * t**2
    z = np.stack([np.hypot(dx, dy), np.arctan2(dy, dx)], axis=1)
    noise = np.random.default_rng(1).standard_normal((RUNS, rows, 2)) * [0.05, 0.01]
    return ukf, (z + noise).astype(dtype), {"dt": 0.5}


def two_states(dtype: str, rows: int) -> tuple[Any, np.ndarray, dict[str, Any]]:
    """Make the robust EKF of two states, and ranges to three leaders in turn, some of them wild."""
    leaders = np.array([[0.0, 0.0], [120.0, 0.0], [60.0, 90.0]])
    names = [f"leader {k}" for k in range(3)]
    ekf = auvest.RobustEkf(
        [52.0, 39.0],
        np.eye(2),
        process=auvest.SpeedHeading(),
        sensors={
            name: auvest.LeaderRange(leader=(float(x), float(y)))
            for name, (x, y) in zip(names, leaders, strict=True)
        },
        dtype=dtype,
    )
    heading = 0.05 * np.arange(rows)
    course = np.stack([np.full(rows, 0.3), np.zeros(rows), heading], axis=1)
    steps = 0.3 * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    track = np.array([52.0, 39.0]) + np.cumsum(steps, axis=0)
    gap = track - leaders[np.arange(rows) % 3]
    rng = np.random.default_rng(2)
    wild = np.where(rng.random((RUNS, rows)) < 0.1, 8.0, 1.0)
    z = np.hypot(*gap.T) + rng.standard_normal((RUNS, rows)) * wild
    sensor = [names[k % 3] for k in range(rows)]
    given = {"dt": 1.0, "input": course, "sensor": sensor}
    return ekf, np.abs(z)[..., np.newaxis].astype(dtype), given


FILTERS = {
    "UKF, six states, range and bearing": six_states,
    "robust EKF, two states, ranges": two_states,
}


def not_in_lanes(filter_: Any, z: np.ndarray, given: dict[str, Any]) -> float:
    """Return the share of the rows that are not done in lanes."""
    counts = []
    real = auvest._core.run_each

    def counting(*arguments: Any) -> Any:
        ends = real(*arguments)
        counts.append((int(ends[1].sum()), int(ends[0].sum())))
        return ends

    auvest._core.run_each = counting
    try:
        filter_.run(z, **given, workers=1)
    finally:
        auvest._core.run_each = real
    alone, rows = np.sum(counts, axis=0)
    return float(alone / rows)


def measure(filter_: Any, z: np.ndarray, given: dict[str, Any]) -> tuple[float, float]:
    """Return the seconds of one call, and of a call each."""
    times = []
    for _ in range(ROUNDS):
        began = time.process_time()
        stack = filter_.run(z, **given, covariance=False, workers=1)
        between = time.process_time()
        single = [copy.copy(filter_).run(one, **given, covariance=False) for one in z]
        times.append((between - began, time.process_time() - between))
        for name in single[0].columns:
            whole = np.stack([result[name] for result in single])
            if whole.tobytes() != stack[name].tobytes():
                raise SystemExit(f"{name} differs")
    one, each = np.median(times, axis=0)
    return float(one), float(each)


def measure_scenario(dtype: str) -> str:
    """Return a line on the AUKF paper's scenario."""
    noise = tracking.Noise(range_m=0.1)
    aukf = paper_aukf.paper_filter("aukf", noise=noise, dtype=dtype)
    scenario = tracking.Scenario(noise=noise, runs=RUNS, steps=60)
    real = _many.lanes
    times = []
    for _ in range(ROUNDS):
        took, estimates = [], []
        for lanes in (real(), "scalar"):
            _many.lanes = lambda lanes=lanes: lanes
            began = time.process_time()
            estimates.append(tracking.simulate(aukf, scenario, workers=1).x.tobytes())
            took.append(time.process_time() - began)
        _many.lanes = real
        if estimates[0] != estimates[1]:
            raise SystemExit("x differs")
        times.append(took)
    beside, alone = 1e6 * np.median(times, axis=0) / (RUNS * 60)
    return f"| AUKF, {dtype} | {beside:.3f} | {alone:.3f} | {alone / beside:.2f} |"


def main() -> int:
    """Measure, write the page, say whether the bounds are kept."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--write", type=Path, help="write the page to this file")
    options = parser.parse_args()
    checks, lines = [], []
    for what, make in FILTERS.items():
        for dtype, target in TARGETS.items():
            for rows in ROWS:
                filter_, z, given = make(dtype, rows)
                one, each = (1e6 * t / (RUNS * rows) for t in measure(filter_, z, given))
                name = f"{what}, {dtype}"
                alone = not_in_lanes(filter_, z, given)
                lines.append(f"| {name} | {rows} | {one:.3f} | {each:.3f} | {100 * alone:.2g} % |")
                checks.append(
                    Check(f"{name}, {rows} rows: a call each / one call", each / one, ">=", target)
                )
    scenarios = "\n".join(measure_scenario(dtype) for dtype in TARGETS)
    if options.write is not None:
        options.write.write_text(
            PAGE.format(
                runs=RUNS,
                lanes=_many.lanes(),
                times="\n".join(lines),
                margin=f"{100 * MARGIN:.0f} %",
                ratios=table(checks),
                scenarios=scenarios,
            ),
            encoding="utf-8",
        )
    print("\n".join(lines), scenarios, sep="\n")
    return judge(checks)


if __name__ == "__main__":
    sys.exit(main())
