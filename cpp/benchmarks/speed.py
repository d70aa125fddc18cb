"""Speed of filters: instructions of a UKF step, times beside filterpy and Numba, single steps.

    python cpp/benchmarks/speed.py build/measure/cpp/benchmarks/ukf_step [--write docs/speed.md]

The instructions are callgrind's, hence exact. The times are the processor's, taken in turn, round
by round, so that their ratios hold when the machine's speed drifts; only the ratios travel to
another machine, and not exactly (checks.py). All filters of a record do the same work: six states,
range and bearing, alpha = 1e-3, 10,000 steps of 0.5 s on a figure of eight 300 to 700 m from the
station; they record the estimates and must agree on them. Single steps under Python are those of
python_steps.py. Exit code 1 if a bound is missed.
"""

from __future__ import annotations

import argparse
import math
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np
import python_steps
from checks import MARGIN, Check, judge, table
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from rich.console import Console
from rich.progress import track as progress

import auvest

STEPS = 10_000
DT = 0.5
STATION = (10.0, -20.0)
SIGMA = (1.0, 0.05)
ALPHA, BETA, KAPPA = 1e-3, 2.0, -3.0
PSD = (0.02, 0.002, 0.0002)
X0 = np.array([690.0, 5.0, 0.0, 3.0, 0.0, 0.0])
P0 = np.diag([100.0, 100.0, 10.0, 10.0, 1.0, 1.0])
PHI = np.eye(6) + DT * np.eye(6, k=2)
Q = DT * np.diag(np.repeat(PSD, 2))
R = np.diag(np.square(SIGMA))

MAX_INSTRUCTIONS = 1478  # what TinyEKF's six-state EKF takes
OURS = "auvest.Ukf, float64"
COMPILED = "the same UKF compiled by Numba"
TARGET_FILTERPY = 500.0
TARGET_NUMBA = 1.5  # which does not ask after each step whether P is positive definite

PAGE = """# Speed

Made by `make bench`. The times are the processor's, medians of rounds in which all take their turn
over the same record, one thread; only the ratios travel to another machine.

## A record in one call

One UKF step: predict and update, six states, range and bearing, alpha = 1e-3. auvest alone asks
after each of the two whether P is positive definite, and can take the row back.

| filter | us per step | times the time of auvest, float64 |
| --- | ---: | ---: |
{times}

## Single steps under Python

One call of predict and one of update per step, measurements as arrays, float64. filterpy's user
writes the models in Python, here with all that does not change computed once.

| filter | auvest / us per step | filterpy / us per step |
| --- | ---: | ---: |
{steps}

## Instructions

Exact (callgrind, g++ -O3 -march=x86-64-v3).

| C++ step in | instructions |
| --- | ---: |
{instructions}

TinyEKF's six-state *EKF*, without any unscented transform, takes 1,478 instructions in double.

## Ratios

Of the times of the same round. The targets are for the machine that these numbers are from; `make
bench` fails {margin} beyond them, because other processors, BLAS libraries and compilers of Numba
shift a ratio by up to 17 % (seen). Instructions have no such margin.

{ratios}
"""


def record() -> np.ndarray:
    """Return measurements (STEPS, 2); clear of bearing +-pi: filterpy cannot wrap means."""
    t = DT * np.arange(1, STEPS + 1)
    rate = 2 * np.pi / 600
    d = np.stack([500 + 200 * np.cos(rate * t), 200 * np.sin(2 * rate * t)], axis=1) - STATION
    z = np.stack([np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0])], axis=1)
    return z + np.random.default_rng(1).standard_normal(z.shape) * SIGMA


def run_auvest(z: np.ndarray, dtype: str) -> np.ndarray:
    """Return the estimates (T, 6) of auvest.Ukf over the record, in one call."""
    ukf = auvest.Ukf(
        X0,
        P0,
        process=auvest.ConstantAcceleration(
            discretisation="euler",
            position_psd=PSD[0],
            velocity_psd=PSD[1],
            acceleration_psd=PSD[2],
        ),
        sensors=auvest.RangeBearing(
            station=STATION, sigma_range_m=SIGMA[0], sigma_bearing_rad=SIGMA[1]
        ),
        alpha=ALPHA,
        beta=BETA,
        kappa=KAPPA,
        dtype=dtype,
    )
    return ukf.run(z, dt=DT, covariance=False).x


def run_filterpy(z: np.ndarray) -> np.ndarray:
    """Return the estimates of filterpy, set up to redraw the sigma points after the prediction."""

    def h(x: np.ndarray) -> np.ndarray:
        dx, dy = x[0] - STATION[0], x[1] - STATION[1]
        return np.array([math.sqrt(dx * dx + dy * dy), math.atan2(dy, dx)])

    def residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        y = a - b
        y[1] = (y[1] + math.pi) % (2 * math.pi) - math.pi
        return y

    points = MerweScaledSigmaPoints(6, ALPHA, BETA, KAPPA)
    ukf = UnscentedKalmanFilter(6, 2, DT, h, lambda x, _: PHI.dot(x), points, residual_z=residual)
    ukf.x, ukf.P, ukf.Q, ukf.R = X0.copy(), P0.copy(), Q, R
    out = np.empty((len(z), 6))
    for k, row in enumerate(z):
        ukf.predict()
        ukf.sigmas_f = points.sigma_points(ukf.x, ukf.P)
        ukf.update(row)
        out[k] = ukf.x
    return out


@numba.njit
def _sigma_points(x, p, scale, low, out):  # type: ignore[no-untyped-def]
    """Write the 13 points of N(x, p) to the rows of out."""
    for j in range(6):
        pivot = p[j, j]
        for k in range(j):
            pivot -= low[j, k] * low[j, k]
        root = math.sqrt(pivot)
        low[j, j] = root
        for i in range(j + 1, 6):
            total = p[i, j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            low[i, j] = total / root
    for i in range(6):
        for k in range(13):
            out[k, i] = x[i]
        for k in range(i + 1):
            out[1 + k, i] += scale * low[i, k]
            out[7 + k, i] -= scale * low[i, k]


@numba.njit
def run_numba(z, x, p, dt, station, q, r, alpha, beta, kappa, out):  # type: ignore[no-untyped-def]
    """Run the textbook UKF, explicit loops, over z; write the estimates to out."""
    c = alpha * alpha * (6 + kappa)
    scale = math.sqrt(c)
    w = 0.5 / c
    w_mean = (c - 6) / c
    w_cov = w_mean + 1 - alpha * alpha + beta
    low = np.zeros((6, 6))
    points = np.empty((13, 6))
    images = np.empty((13, 2))
    cross = np.empty((6, 2))
    for step in range(z.shape[0]):
        _sigma_points(x, p, scale, low, points)
        for k in range(13):
            for i in range(4):
                points[k, i] += dt * points[k, i + 2]
        for i in range(6):
            total = 0.0
            for k in range(1, 13):
                total += points[k, i] - points[0, i]
            x[i] = points[0, i] + w * total
        for k in range(13):
            for i in range(6):
                points[k, i] -= x[i]
        for i in range(6):
            for j in range(i + 1):
                total = w_cov * points[0, i] * points[0, j]
                for k in range(1, 13):
                    total += w * points[k, i] * points[k, j]
                p[i, j] = total
                p[j, i] = total
            p[i, i] += q[i]

        _sigma_points(x, p, scale, low, points)
        for k in range(13):
            dx = points[k, 0] - station[0]
            dy = points[k, 1] - station[1]
            images[k, 0] = math.sqrt(dx * dx + dy * dy)
            images[k, 1] = math.atan2(dy, dx)
        centre0, centre1 = images[0, 0], images[0, 1]
        shift0 = 0.0
        shift1 = 0.0
        for k in range(13):
            images[k, 0] -= centre0
            angle = images[k, 1] - centre1
            if angle > math.pi:
                angle -= 2 * math.pi
            elif angle <= -math.pi:
                angle += 2 * math.pi
            images[k, 1] = angle
            shift0 += w * images[k, 0]
            shift1 += w * angle
        s00, s01, s11 = r[0], 0.0, r[1]
        cross[:] = 0.0
        for k in range(13):
            weight = w_cov if k == 0 else w
            u = images[k, 0] - shift0
            v = images[k, 1] - shift1
            s00 += weight * u * u
            s01 += weight * u * v
            s11 += weight * v * v
            for i in range(6):
                d = weight * (points[k, i] - x[i])
                cross[i, 0] += d * u
                cross[i, 1] += d * v
        y0 = z[step, 0] - centre0 - shift0
        y1 = z[step, 1] - centre1 - shift1
        if y1 > math.pi:
            y1 -= 2 * math.pi
        elif y1 <= -math.pi:
            y1 += 2 * math.pi
        inverse = 1.0 / (s00 * s11 - s01 * s01)
        for i in range(6):
            k0 = (cross[i, 0] * s11 - cross[i, 1] * s01) * inverse
            k1 = (cross[i, 1] * s00 - cross[i, 0] * s01) * inverse
            x[i] += k0 * y0 + k1 * y1
            for j in range(i + 1):
                p[i, j] -= k0 * cross[j, 0] + k1 * cross[j, 1]
                p[j, i] = p[i, j]
            out[step, i] = x[i]


def numba_estimates(z: np.ndarray) -> np.ndarray:
    """Return the estimates of the compiled textbook UKF."""
    out = np.empty((len(z), 6))
    q, r = np.diag(Q).copy(), np.diag(R).copy()
    run_numba(z, X0.copy(), P0.copy(), DT, STATION, q, r, ALPHA, BETA, KAPPA, out)
    return out


def instructions(program: Path, scalar: str, steps: int = 1000) -> float:
    """Return the instructions of one step, counted by callgrind."""
    return collected(f"--toggle-collect=ukf_step_{scalar}", program, steps) / steps


def collected(*command: object) -> int:
    """Return the instructions that callgrind counts of a program, after options of its own."""
    with tempfile.TemporaryDirectory() as folder:  # for callgrind's own file
        valgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/out"]
        arguments = [*valgrind, *map(str, command)]
        run = subprocess.run(arguments, capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", run.stderr)
    if not found or int(found[1]) == 0:
        raise RuntimeError(f"callgrind collected nothing:\n{run.stderr}")
    return int(found[1])


def seconds(function: Callable[..., object], *arguments: object) -> float:
    """Return the processor's time of one call: the mean of as many as fill 50 ms."""
    calls = 0
    start = time.process_time()
    while True:
        function(*arguments)
        calls += 1
        elapsed = time.process_time() - start
        if elapsed > 0.05:
            return elapsed / calls


def rows_of(table: Sequence[Sequence[str]]) -> str:
    """Return the rows of a Markdown table."""
    return "\n".join("| " + " | ".join(row) + " |" for row in table)


def disagreements(z: np.ndarray, few: np.ndarray) -> list[str]:
    """Name the filters whose estimates are not those of auvest."""
    reference = run_auvest(z, "float64")
    wrong = []
    for name, other in (("filterpy", run_filterpy(few)), ("Numba", numba_estimates(z))):
        # alpha = 1e-3 costs the textbook weights six digits: agreement to 1e-3 m of 700 m.
        difference = np.abs(other[:, :2] - reference[: len(other), :2]).max()
        if not difference < 1e-3:
            wrong.append(f"{name} is {difference} m away from auvest")
    for pair in python_steps.PAIRS:
        difference = python_steps.disagreement_m(pair)
        if not difference < pair.agree_m:
            wrong.append(f"{pair.what}: filterpy is {difference} m away from auvest")
    return wrong


def main() -> int:
    """Measure, print, and compare with the bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path, help="the compiled ukf_step")
    parser.add_argument("--rounds", type=int, default=7, help="rounds of timing (default 7)")
    parser.add_argument("--write", type=Path, help="write the page to this file")
    arguments = parser.parse_args()
    console = Console(stderr=True)

    z = record()
    few = z[: STEPS // 10]  # filterpy is slow
    wrong = disagreements(z, few)
    if wrong:
        print("\n".join(wrong), file=sys.stderr)
        return 1

    records: dict[str, tuple[Any, ...]] = {
        OURS: (run_auvest, z, "float64"),
        "auvest.Ukf, float32": (run_auvest, z, "float32"),
        COMPILED: (numba_estimates, z),
        "filterpy": (run_filterpy, few),
    }
    runs = dict(records)
    for pair in python_steps.PAIRS:
        runs[f"{pair.what}: auvest"] = (pair.ours, pair.measurements())
        runs[f"{pair.what}: filterpy"] = (pair.theirs, pair.measurements())
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in progress(range(arguments.rounds), "timing", console=console):
        for name, (function, rows, *rest) in runs.items():
            times[name].append(seconds(function, rows, *rest) / len(rows) * 1e6)
    counts = {scalar: instructions(arguments.program, scalar) for scalar in ("double", "float")}

    def ratio(above: str, below: str) -> float:
        return float(np.median(np.array(times[above]) / np.array(times[below])))

    def median(name: str) -> str:
        return f"{np.median(times[name]):.3g}"

    steps = [
        Check(
            f"single steps, {pair.what}: filterpy / auvest",
            ratio(f"{pair.what}: filterpy", f"{pair.what}: auvest"),
            target=pair.target,
        )
        for pair in python_steps.PAIRS
    ]
    checks = [
        Check("a record: filterpy / auvest", ratio("filterpy", OURS), target=TARGET_FILTERPY),
        Check("a record: Numba / auvest", ratio(COMPILED, OURS), target=TARGET_NUMBA),
        *steps,
        Check(
            "instructions of a double step / those of TinyEKF's EKF",
            counts["double"] / MAX_INSTRUCTIONS,
            "<=",
            target=1.0,
            margin=0.0,
        ),
    ]
    text = PAGE.format(
        times=rows_of([(name, median(name), f"{ratio(name, OURS):.3g}") for name in records]),
        steps=rows_of(
            [
                (pair.what, median(f"{pair.what}: auvest"), median(f"{pair.what}: filterpy"))
                for pair in python_steps.PAIRS
            ]
        ),
        instructions=rows_of([(scalar, f"{count:,.0f}") for scalar, count in counts.items()]),
        ratios=table(checks),
        margin=f"{MARGIN:.0%}".replace("%", " %"),
    )
    print(text)
    if arguments.write:
        arguments.write.write_text(text)
    return judge(checks)


if __name__ == "__main__":
    sys.exit(main())
