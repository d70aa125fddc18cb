r"""Speed of SLATF in float32: time per particle and sonar step beside NumPy and Numba, one thread.

    OPENBLAS_NUM_THREADS=1 python cpp/benchmarks/slat_speed.py build/measure/cpp/benchmarks \
        [--write docs/speed_slat.md]

All filters do the same work: poses of three states drawn from noisy speed and yaw rate, one master
of six states (Euler, Q = dt diag(q)), range and bearing from the heading, systematic resampling
below N_eff = N / 2, the four mean positions recorded at every step; 200 steps of 0.5 s. They draw
their own random numbers and must agree in accuracy. Numba runs in float32 and in double, which is
what it is written in where nobody asks for less; the targets are for double. The times are the
processor's, taken in turn, round by round, so that their ratios hold when the machine's speed
drifts; only the ratios travel to another machine, and not exactly (checks.py). Exit code 1 if a
bound is missed.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from checks import MARGIN, Check, judge
from checks import table as ratio_table
from rich.console import Console
from rich.progress import track as progress

STEPS = 200
RUNS = 20
DT = 0.5
SIGMA_SPEED, SIGMA_TURN = 0.1, 0.005
VARIANCES = np.array([1.0**2, 0.05**2], np.float32)
Q = (DT * np.repeat([0.02, 0.002, 0.0002], 2)).astype(np.float32)
X0 = np.array([105.0, 30.0, 0.0, 30 * 2 * np.pi / 100, 0.0, 0.0], np.float32)
P0 = np.array([25.0, 25.0, 4.0, 4.0, 0.1, 0.1], np.float32)

PROGRAMS = ("slat_step", "slat_step_sse2", "slat_step_avx2", "slat_step_avx512f")
NOT_ON_THIS_PROCESSOR = 77
#: Versions of the program that are no SLATF 1.0 or 2.0.
JOINT = {3: "auvest SlatfJoint, a covariance per particle", 4: "auvest SlatfJoint, one covariance"}

PASSES = 3  # at least, of which the fastest counts

#: In double, by the widest lanes that a processor has, for each number of particles: what one with
#: all of them measured with each.
TARGET_NUMBA = {
    "slat_step_avx512f": {100: 10.0, 10_000: 14.0},
    "slat_step_avx2": {100: 7.0, 10_000: 7.5},
    "slat_step_sse2": {100: 4.2, 10_000: 4.4},
    "slat_step": {100: 1.0, 10_000: 1.0},
}
TARGET_NUMPY = 60.0  # at 100 particles
TARGET_VERSION_2 = 2.0
TARGET_SHARED = 3.0  # times as fast as SlatfJoint with a covariance per particle
TARGET_SHARED_PER_PARTICLE = 1.0  # of SLATF 2.0 in the same lanes
TARGET_GROWTH = 1.3  # per particle, from 1,000 to 100,000 particles

PAGE = """# Speed of SLATF

Made by `make bench`. One sonar step: predict, update and the mean positions; one thread, float32
but for the row "Numba, double". Poses of three states drawn from noisy speed and yaw rate, one
master of six states, range and bearing, systematic resampling below N_eff = N / 2. The times are
the processor's, medians of rounds in which all take their turn over the same records; only the
ratios travel to another machine. The rows of auvest are one program per instruction set
(cpp/benchmarks/slat_step.cpp, chosen when it is compiled), built with the library's flags; NumPy
and Numba take the best that the processor has. The targets on Numba are for double, what it
computes in where nobody asks for less.

Nanoseconds per particle and sonar step:

{times}

Ratios, of the times of the same round. The targets are for the machine that these numbers are
from; `make bench` fails {margin} beyond them, because other processors, BLAS libraries and
compilers of Numba shift a ratio by up to 17 % (seen).

{ratios}

RMSE over {runs} runs with N = 100, of the master's and the slave's position (m): {errors}.
"""

Run = Callable[[np.ndarray, int, int], np.ndarray]


def truth() -> tuple[np.ndarray, np.ndarray]:
    """Return the readings without noise (STEPS, 2) and the positions (STEPS, 4)."""
    t = DT * np.arange(1, STEPS + 1)
    readings = np.stack([1 + 0.3 * np.sin(0.1 * t), 0.15 * np.cos(0.07 * t)], axis=1)
    heading = np.concatenate([[0.0], DT * np.cumsum(readings[:, 1])])
    slave = DT * np.cumsum(
        readings[:, :1] * np.stack([np.cos(heading[:-1]), np.sin(heading[:-1])], axis=1), axis=0
    )
    master = np.stack(
        [80 + 25 * np.cos(2 * np.pi * t / 80), 30 + 30 * np.sin(2 * np.pi * t / 100)], axis=1
    )
    return readings, np.hstack([master, slave])


def records() -> tuple[np.ndarray, np.ndarray]:
    """Return RUNS noisy records (RUNS, STEPS, 4), float32, and the true positions (STEPS, 4)."""
    readings, positions = truth()
    rng = np.random.default_rng(7)
    d = positions[:, :2] - positions[:, 2:]
    heading = DT * np.cumsum(readings[:, 1])
    exact = np.column_stack(
        [readings, np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0]) - heading]
    )
    sigma = [SIGMA_SPEED, SIGMA_TURN, *np.sqrt(VARIANCES)]
    rows = exact + rng.standard_normal((RUNS, STEPS, 4)) * sigma
    rows[..., 3] = (rows[..., 3] + np.pi) % (2 * np.pi) - np.pi
    return rows.astype(np.float32), positions


def run_numpy(record: np.ndarray, particles: int, seed: int) -> np.ndarray:
    """Return the estimates (STEPS, 4) of SLATF 1.0 in NumPy, one array per field.

    Mean and covariance of the master lie in one array (6, 7, N), so that each step of the filter
    is one operation on both.
    """
    n = particles
    rng = np.random.default_rng(seed)
    dt = np.float32(DT)
    sigma = np.array([[SIGMA_SPEED], [SIGMA_TURN]], np.float32)
    two_pi = np.float32(2 * np.pi)
    state = np.zeros((3 + 6 * 7, n), np.float32)
    pose = state[:3]
    belief = state[3:].reshape(6, 7, n)
    mean, covariance = belief[:, 0], belief[:, 1:]
    diagonal = belief.reshape(42, n)[1::8]
    mean[:] = X0[:, None]
    diagonal[:] = P0[:, None]
    noise = Q[:, None].copy()
    scratch = np.empty_like(belief)
    seen = np.empty((2, 7, n), np.float32)  # minus the innovation, and H P
    log_weight = np.zeros(n, np.float32)
    positions = np.arange(n, dtype=np.float32)
    out = np.empty((STEPS, 4))
    for k in range(STEPS):
        reading = rng.standard_normal((2, n), dtype=np.float32) * sigma + record[k, :2, None]
        reading *= dt
        heading = pose[2]
        pose[0] += reading[0] * np.cos(heading)
        pose[1] += reading[0] * np.sin(heading)
        heading += reading[1]
        belief[:4] += np.multiply(belief[2:], dt, out=scratch[:4])
        covariance[:, :4] += np.multiply(covariance[:, 2:], dt, out=scratch[:, :4])
        diagonal += noise

        d = mean[:2] - pose[:2]
        square = d[0] * d[0] + d[1] * d[1]
        distance = np.sqrt(square)
        unit = d / distance
        across = d / square
        turn = np.arctan2(d[1], d[0]) - heading - record[k, 3]
        seen[0, 0] = distance - record[k, 2]
        seen[1, 0] = turn - two_pi * np.rint(turn / two_pi)
        seen[0, 1:] = unit[0] * covariance[0] + unit[1] * covariance[1]
        seen[1, 1:] = across[0] * covariance[1] - across[1] * covariance[0]
        s00 = unit[0] * seen[0, 1] + unit[1] * seen[0, 2] + VARIANCES[0]
        s01 = unit[0] * seen[1, 1] + unit[1] * seen[1, 2]
        s11 = across[0] * seen[1, 2] - across[1] * seen[1, 1] + VARIANCES[1]
        determinant = s00 * s11 - s01 * s01
        whitened = np.stack([s11 * seen[0] - s01 * seen[1], s00 * seen[1] - s01 * seen[0]])
        whitened /= determinant
        belief -= np.multiply(whitened[0, 1:, None], seen[0], out=scratch)
        belief -= np.multiply(whitened[1, 1:, None], seen[1], out=scratch)

        nis = whitened[0, 0] * seen[0, 0] + whitened[1, 0] * seen[1, 0]
        log_weight -= np.float32(0.5) * (nis + np.log(determinant))
        log_weight -= log_weight.max()
        w = np.exp(log_weight)
        w /= w.sum()
        out[k, :2] = mean[:2] @ w
        out[k, 2:] = pose[:2] @ w
        if w @ w * n > 2:
            ends = np.cumsum(w)
            ends[-1] = 1
            chosen = np.searchsorted(ends, (positions + np.float32(rng.random())) / np.float32(n))
            state[:] = state.take(np.minimum(chosen, n - 1), axis=1)
            log_weight[:] = 0
    return out


@numba.njit(error_model="numpy")
def _run_numba(kind, record, n, seed, x0, p0, q, variances, constants, out):  # type: ignore[no-untyped-def]
    """Run SLATF 1.0 with explicit loops, 46 numbers per particle; write the estimates."""
    np.random.seed(seed)  # noqa: NPY002 (Numba's generator)
    dt, sigma_speed, sigma_turn, pi, two_pi, one, half = constants
    # x, y, heading, mean, covariance, log weight
    state = np.zeros((n, 46), kind)
    spare = np.zeros((n, 46), kind)
    w = np.empty(n, kind)
    c0 = np.empty(6, kind)
    c1 = np.empty(6, kind)
    for i in range(n):
        for a in range(6):
            state[i, 3 + a] = x0[a]
            state[i, 9 + 7 * a] = p0[a]
    for k in range(record.shape[0]):
        largest = kind(-1e30)
        for i in range(n):
            s = state[i]
            speed = record[k, 0] + sigma_speed * kind(np.random.standard_normal())  # noqa: NPY002
            rate = record[k, 1] + sigma_turn * kind(np.random.standard_normal())  # noqa: NPY002
            s[0] += dt * speed * math.cos(s[2])
            s[1] += dt * speed * math.sin(s[2])
            s[2] += dt * rate
            for a in range(4):
                s[3 + a] += dt * s[5 + a]
            for a in range(24):
                s[9 + a] += dt * s[21 + a]
            for a in range(6):
                for b in range(4):
                    s[9 + 6 * a + b] += dt * s[11 + 6 * a + b]
            for a in range(6):
                s[9 + 7 * a] += q[a]

            dx = s[3] - s[0]
            dy = s[4] - s[1]
            square = dx * dx + dy * dy
            distance = math.sqrt(square)
            y0 = record[k, 2] - distance
            y1 = record[k, 3] - (math.atan2(dy, dx) - s[2])
            while y1 > pi:
                y1 -= two_pi
            while y1 <= -pi:
                y1 += two_pi
            g0 = dx / distance
            g1 = dy / distance
            h0 = -dy / square
            h1 = dx / square
            for a in range(6):
                c0[a] = g0 * s[9 + a] + g1 * s[15 + a]
                c1[a] = h0 * s[9 + a] + h1 * s[15 + a]
            s00 = g0 * c0[0] + g1 * c0[1] + variances[0]
            s01 = g0 * c1[0] + g1 * c1[1]
            s11 = h0 * c1[0] + h1 * c1[1] + variances[1]
            determinant = s00 * s11 - s01 * s01
            inverse = one / determinant
            for a in range(6):
                k0 = (c0[a] * s11 - c1[a] * s01) * inverse
                k1 = (c1[a] * s00 - c0[a] * s01) * inverse
                s[3 + a] += k0 * y0 + k1 * y1
                for b in range(6):
                    s[9 + 6 * a + b] -= k0 * c0[b] + k1 * c1[b]
            nis = (s11 * y0 * y0 - (s01 + s01) * y0 * y1 + s00 * y1 * y1) * inverse
            s[45] -= half * (nis + math.log(determinant))
            if s[45] > largest:
                largest = s[45]

        total = 0.0
        for i in range(n):
            state[i, 45] -= largest
            w[i] = math.exp(state[i, 45])
            total += w[i]
        squares = 0.0
        e0 = 0.0
        e1 = 0.0
        e2 = 0.0
        e3 = 0.0
        for i in range(n):
            w[i] = w[i] / total
            squares += w[i] * w[i]
            e0 += w[i] * state[i, 3]
            e1 += w[i] * state[i, 4]
            e2 += w[i] * state[i, 0]
            e3 += w[i] * state[i, 1]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = e0, e1, e2, e3
        if squares * n > 2.0:
            offset = np.random.random()  # noqa: NPY002
            reached = w[0]
            j = 0
            for i in range(n):
                while reached < (i + offset) / n and j < n - 1:
                    j += 1
                    reached += w[j]
                spare[i, :45] = state[j, :45]
                spare[i, 45] = 0.0
            state, spare = spare, state


def run_numba(record: np.ndarray, particles: int, seed: int, kind: type = np.float32) -> np.ndarray:
    """Return the estimates (STEPS, 4) of SLATF 1.0 compiled by Numba for float32 or float64."""
    out = np.empty((STEPS, 4))
    constants = tuple(kind(c) for c in (DT, SIGMA_SPEED, SIGMA_TURN, np.pi, 2 * np.pi, 1, 0.5))
    arrays = [array.astype(kind) for array in (X0, P0, Q, VARIANCES)]
    _run_numba(kind, record.astype(kind), particles, seed, *arrays, constants, out)  # type: ignore[call-arg]
    return out


def run_numba_double(record: np.ndarray, particles: int, seed: int) -> np.ndarray:
    """Return the same in double."""
    return run_numba(record, particles, seed, np.float64)


def nanoseconds(function: Run, rows: np.ndarray, particles: int, passes: int) -> float:
    """Return the processor's time per particle and step of the fastest of some passes."""
    times = []
    for _ in range(passes):
        start = time.process_time()
        for seed, record in enumerate(rows):
            function(record, particles, seed)
        times.append(time.process_time() - start)
    return min(times) * 1e9 / (len(rows) * STEPS * particles)


def widest_program(folder: Path, record: Path) -> list[str]:
    """Return the programs that run on this processor, the one with the widest lanes last."""
    usable = []
    for name in PROGRAMS:
        if not (folder / name).exists():
            continue
        arguments = [str(folder / name), str(record), "1", "16", "1"]
        code = subprocess.run(arguments, stdout=subprocess.DEVNULL, check=False).returncode
        if code not in (0, NOT_ON_THIS_PROCESSOR):
            raise RuntimeError(f"{name} ended with code {code}")
        if code == 0:
            usable.append(name)
    if not usable:
        raise FileNotFoundError(f"{folder} holds no program slat_step: build the benchmarks")
    return usable


def program_time(
    program: Path, record: Path, version: int, particles: int, passes: int, output: Path | None
) -> float:
    """Return the time per particle and step of a program; `output` takes the estimates."""
    arguments = [program, record, version, particles, passes, *([output] if output else [])]
    run = subprocess.run(
        [str(argument) for argument in arguments], capture_output=True, text=True, check=True
    )
    return float(run.stdout)


def rmse(estimates: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the RMSE of master and slave [m] of estimates (runs, STEPS, 4)."""
    square = np.square(estimates - positions).mean(axis=(0, 1))
    return np.sqrt([square[:2].sum(), square[2:].sum()])


def table(times: dict[tuple[str, int], list[float]]) -> str:
    """Return the times as Markdown: a row per filter, a column per number of particles."""
    names = list(dict.fromkeys(name for name, _ in times))
    sizes = sorted({particles for _, particles in times})
    lines = ["| filter | " + " | ".join(f"N = {n:,}" for n in sizes) + " |"]
    lines.append("| --- |" + " ---: |" * len(sizes))
    for name in names:
        cells = [f"{np.median(times[name, n]):.3g}" if (name, n) in times else "" for n in sizes]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    """Measure, print, and compare with the bounds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=Path, help="the folder of the compiled slat_step")
    parser.add_argument("--rounds", type=int, default=7, help="rounds of timing (default 7)")
    parser.add_argument("--write", type=Path, help="write the page to this file")
    arguments = parser.parse_args()

    rows, positions = records()
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record"
        output = Path(folder) / "estimates"
        rows.tofile(record)
        names = widest_program(arguments.programs, record)
        widest = arguments.programs / names[-1]

        errors = {}
        for version in (1, 2):
            program_time(widest, record, version, 100, 1, output)
            estimates = np.fromfile(output, np.float32).reshape(RUNS, STEPS, 4)
            errors[f"SLATF {version}.0"] = rmse(estimates, positions)
        peers: dict[str, Run] = {
            "NumPy": run_numpy,
            "Numba, double": run_numba_double,
            "Numba, float32": run_numba,
        }
        for name, run in peers.items():
            estimates = np.stack([run(row, 100, seed) for seed, row in enumerate(rows)])
            errors[name] = rmse(estimates, positions)
        for name in peers:  # the same filter, other random numbers
            if not np.allclose(errors[name], errors["SLATF 1.0"], rtol=0.15):
                print(f"{name} is not as accurate as SLATF 1.0: {errors}", file=sys.stderr)
                return 1

        few = Path(folder) / "few"
        rows[:2].tofile(few)
        times: dict[tuple[str, int], list[float]] = {}
        for _ in progress(range(arguments.rounds), "timing", console=Console(stderr=True)):
            for version in (1, 2):
                for particles in (100, 1000, 10_000, 100_000):
                    passes = max(PASSES, 2000 // particles)
                    key = (f"auvest SLATF {version}.0, {names[-1]}", particles)
                    source = few if particles > 1000 else record
                    time_ns = program_time(widest, source, version, particles, passes, None)
                    times.setdefault(key, []).append(time_ns)
            for version, name in JOINT.items():
                time_ns = program_time(widest, few, version, 100, PASSES, None)
                times.setdefault((f"{name}, {names[-1]}", 100), []).append(time_ns)
            for particles in (100, 10_000):
                for name in names[:-1]:
                    time_ns = program_time(
                        arguments.programs / name, few, 1, particles, PASSES, None
                    )
                    times.setdefault((f"auvest SLATF 1.0, {name}", particles), []).append(time_ns)
                for name, run in peers.items():
                    subset = rows[:5] if particles == 100 else rows[:1]
                    time_ns = nanoseconds(run, subset, particles, PASSES)
                    times.setdefault((name, particles), []).append(time_ns)

    def ratio(above: tuple[str, int], below: tuple[str, int]) -> float:
        return float(np.median(np.array(times[above]) / np.array(times[below])))

    first, second = (f"auvest SLATF {version}.0, {names[-1]}" for version in (1, 2))
    checks = [
        Check(
            f"Numba, {kind} / SLATF 1.0, N = {n:,}",
            ratio((f"Numba, {kind}", n), (first, n)),
            target=target if kind == "double" else None,
        )
        for kind in ("double", "float32")
        for n, target in TARGET_NUMBA[names[-1]].items()
    ]
    checks.append(
        Check(
            "NumPy / SLATF 1.0, N = 100",
            ratio(("NumPy", 100), (first, 100)),
            target=TARGET_NUMPY,
        )
    )
    checks += [
        Check(
            f"SLATF 2.0 / 1.0, N = {n:,}",
            ratio((second, n), (first, n)),
            "<=",
            target=TARGET_VERSION_2,
        )
        for n in (100, 1000)
    ]
    joint, shared = ((f"{name}, {names[-1]}", 100) for name in JOINT.values())
    checks += [
        Check(
            "a covariance per particle / one for all, N = 100",
            ratio(joint, shared),
            target=TARGET_SHARED,
        ),
        Check(
            "one covariance for all / SLATF 2.0, N = 100",
            ratio(shared, (second, 100)),
            "<=",
            target=TARGET_SHARED_PER_PARTICLE,
        ),
    ]
    checks.append(
        Check(
            "SLATF 1.0 per particle, N = 100,000 / 1,000",
            ratio((first, 100_000), (first, 1000)),
            "<=",
            target=TARGET_GROWTH,
        )
    )
    text = PAGE.format(
        times=table(times),
        ratios=ratio_table(checks),
        margin=f"{MARGIN:.0%}".replace("%", " %"),
        runs=RUNS,
        errors="; ".join(f"{name} {m:.2f}, {s:.2f}" for name, (m, s) in errors.items()),
    )
    print(text)
    if arguments.write:
        arguments.write.write_text(text)
    return judge(checks)


if __name__ == "__main__":
    sys.exit(main())
