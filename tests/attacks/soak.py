"""Long runs in single precision: every Gaussian filter of the registry, and Slatf.

    python -m tests.attacks.soak --steps 1e7

A vehicle goes round a circle of 60 m for as many seconds and measures, with gaps and outliers.
Beside each filter goes its twin in double precision. The table has rows that are not finite, the
smallest eigenvalue of the correlations, the error of both, how far they were apart, how many of
the measurements they judged otherwise, and how the memory grew. Exit code 1 where a number is not
finite, a covariance indefinite, or the memory grows.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import auvest
from auvest.registry import FILTERS

#: Rows of one call of run().
CHUNK = 50_000
RADIUS_M, RATE_RAD_S, SPEED_M_S = 60.0, 0.01, 0.6
SIGMA_RANGE_M, SIGMA_BEARING_RAD = 0.1, 0.01
#: Growth of the memory counts from this chunk on, from this size on, MB: allocators keep some.
_WARM_UP, _MEMORY_MB = 8, 4.0

Floats = np.ndarray[Any, np.dtype[np.float64]]


@dataclass
class Found:
    """What the run has shown so far."""

    steps: int = 0
    not_finite: int = 0
    smallest: float = np.inf
    squares: Floats = field(default_factory=lambda: np.zeros(2))
    apart_m: float = 0.0
    otherwise: int = 0
    memory_mb: tuple[float, float] = (0.0, 0.0)
    worst: str = ""


def memory_mb() -> float:
    """Resident memory, without what the allocator keeps: that grows by how results lie in it."""
    gc.collect()
    if sys.platform == "linux":
        with contextlib.suppress(AttributeError):  # of musl, which keeps less
            ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def track(k: Floats) -> Floats:
    angle = RATE_RAD_S * k
    return np.column_stack([100 + RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle)])


def heading(k: Floats) -> Floats:
    return np.remainder(RATE_RAD_S * (k - 0.5) + np.pi / 2, 2 * np.pi)


def seen(truth: Floats, rng: np.random.Generator) -> Floats:
    """Range and bearing from the origin; 5 % are missing, 2 % are off by up to 50 m."""
    z = np.column_stack([np.hypot(*truth.T), np.arctan2(truth[:, 1], truth[:, 0])])
    z += rng.normal(size=z.shape) * [SIGMA_RANGE_M, SIGMA_BEARING_RAD]
    off = rng.random(len(z)) < 0.02
    z[off, 0] = np.abs(z[off, 0] + rng.uniform(-50, 50, off.sum()))
    z[rng.random(len(z)) < 0.05] = np.nan
    return z


def gaussian(cls: str) -> Callable[[str], Any]:
    """Robust filters reckon by speed and heading; the others follow a moving target."""
    sensor = auvest.RangeBearing(
        sigma_range_m=SIGMA_RANGE_M, sigma_bearing_rad=SIGMA_BEARING_RAD, station=(0, 0)
    )
    if cls.startswith("Robust"):
        process: auvest.ProcessModel = auvest.SpeedHeading(sigma_forward=0.1, sigma_heading=0.05)
        return lambda dtype: getattr(auvest, cls)(
            [160, 0], np.eye(2), process=process, sensors=sensor, dtype=dtype
        )
    process = auvest.ConstantAcceleration(velocity_psd=1e-3, acceleration_psd=1e-5)
    start = [160, 0, 0, SPEED_M_S, 0, 0]
    spread = np.diag([1, 1, 0.1, 0.1, 0.01, 0.01])
    return lambda dtype: getattr(auvest, cls)(
        start, spread, process=process, sensors=sensor, kernel="huber", dtype=dtype
    )


def igg(dtype: str) -> Any:
    """Ranges to two leaders, and a kernel whose weight jumps: see docs/algorithms/mekf.md."""
    return auvest.RobustEkf(
        [160, 0],
        np.eye(2),
        process=auvest.SpeedHeading(),
        sensors=auvest.LeaderRange(),
        kernel="igg",
        dtype=dtype,
    )


def slatf(dtype: str) -> Any:
    made = auvest.Slatf(
        [160, 0],
        np.eye(2),
        particles=32,
        gate=16,
        motion=auvest.CompassMotion(sigma_speed_m_s=0.1, sigma_heading_rad=0.05),
        sonar=auvest.Sonar(sigma_range_m=1, sigma_bearing_rad=0.03, bearing="slave_to_master"),
        dtype=dtype,
        seed=3,
    )
    made.add_master(np.zeros(6), np.diag([0.01, 0.01, 1e-4, 1e-4, 1e-6, 1e-6]))
    return made


def chunk(filters: list[Any], first: int) -> tuple[list[Any], Floats]:
    """Run each filter over the same rows."""
    rng = np.random.default_rng(first)
    k = np.arange(first + 1.0, first + CHUNK + 1.0)
    truth = track(k)
    if isinstance(filters[0], auvest.Slatf):
        times = np.arange(first, first + CHUNK + 1.0)
        u = np.column_stack([np.full(CHUNK, SPEED_M_S), heading(k)])
        u += rng.normal(size=u.shape) * [0.1, 0.05]
        z = np.column_stack([np.hypot(*truth.T), np.arctan2(-truth[:, 1], -truth[:, 0])])
        z += rng.normal(size=z.shape) * [1.0, 0.03]
        even = slice(1, None, 2)
        return [f.run(times, u, z=z[even], z_time_s=times[1:][even]) for f in filters], truth
    speed = SPEED_M_S + rng.normal(0, 0.1, CHUNK)
    driven = np.column_stack([speed, np.zeros(CHUNK), heading(k)])
    if "LeaderRange" in filters[0].sensors:
        place = np.where((k % 2 == 0)[:, None], [0.0, 0.0], [100.0, 200.0])
        ranges = np.hypot(*(truth - place).T) + rng.normal(size=CHUNK)
        off = rng.random(CHUNK) < 0.05
        ranges[off] = np.abs(ranges[off] + rng.uniform(-100, 100, off.sum()))
        return [f.run(ranges, dt=1.0, input=driven, place=place) for f in filters], truth
    z = seen(truth, rng)
    results = []
    for f in filters:
        inputs = driven if f.process.input else None
        step = {} if f.policy is None else {"reference": truth}
        results.append(f.run(z, dt=1.0, input=inputs, **step))
    return results, truth


def smallest_correlation(p: Floats) -> float:
    variances = np.diagonal(p, axis1=1, axis2=2).astype(float)
    if not np.isfinite(p).all() or (variances <= 0).any():
        return -np.inf
    sigma = np.sqrt(variances)
    correlations = p.astype(float) / sigma[:, :, None] / sigma[:, None, :]
    return float(np.linalg.eigvalsh(correlations).min())


def compare(single: Any, double: Any, truth: Floats, found: Found) -> None:
    """Count what one chunk of the filter and of its twin shows."""
    found.not_finite += int((~np.isfinite(single.x)).any(axis=1).sum())
    found.smallest = min(found.smallest, smallest_correlation(single.P[::10]))
    apart = np.hypot(*(single.x[:, :2].astype(float) - double.x[:, :2]).T)
    worst = int(np.argmax(apart))
    if apart[worst] > found.apart_m:
        found.apart_m = float(apart[worst])
        found.worst = f"step {found.steps + worst + 1}"
    if hasattr(single, "weight"):
        a, b = single.weight, double.weight
        found.otherwise += int(((a == 0) != (b == 0)).any(axis=1).sum())
    for k, result in enumerate((single, double)):
        found.squares[k] += float(((result.x[:, :2] - truth) ** 2).sum())


def soak(make: Callable[[str], Any], steps: int, limit_s: float) -> Found:
    """Run a filter and its twin for so many steps, or for so long."""
    filters = [make("float32"), make("float64")]
    found, began = Found(), time.monotonic()
    while found.steps < steps and time.monotonic() - began < limit_s:
        results, truth = chunk(filters, found.steps)
        compare(*results, truth, found)
        found.steps += CHUNK
        del results, truth  # what is measured is what the filters keep
        now = memory_mb()
        begun = now if found.steps <= _WARM_UP * CHUNK else found.memory_mb[0]
        found.memory_mb = (begun, now)
    return found


def holds(found: Found) -> bool:
    grown = found.memory_mb[1] - found.memory_mb[0]
    return found.not_finite == 0 and found.smallest > 0 and grown < _MEMORY_MB


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--steps", type=float, default=1e6)
    parser.add_argument("--seconds", type=float, default=np.inf, help="at most, for each filter")
    parser.add_argument("--filter", help="only this one")
    given = parser.parse_args()
    makers = {
        entry.cls: gaussian(entry.cls) for entry in FILTERS.values() if entry.family == "gaussian"
    }
    makers |= {"RobustEkf-igg": igg, "Slatf": slatf}
    right = True
    print(
        "filter      steps  not finite  smallest  RMSE float32, float64  apart  otherwise  memory"
    )
    for name, make in makers.items():
        if given.filter in (None, name):
            found = soak(make, int(given.steps), given.seconds)
            right = right and holds(found)
            rmse = np.sqrt(found.squares / max(1, found.steps))
            print(
                f"{name:13} {found.steps:9} {found.not_finite:6} {found.smallest:12.2e} "
                f"{rmse[0]:9.4f} m {rmse[1]:8.4f} m {found.apart_m:9.3g} m ({found.worst}) "
                f"{found.otherwise:6} {found.memory_mb[0]:6.0f} -> {found.memory_mb[1]:.0f} MB",
                flush=True,
            )
    sys.exit(0 if right else 1)


if __name__ == "__main__":
    main()
