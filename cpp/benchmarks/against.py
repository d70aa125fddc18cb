"""Speed of the core beside that of another revision: one run, both in turn.

    python cpp/benchmarks/against.py REVISION [--rounds 9]

Builds ukf_step and slat_step of the working tree in build/measure and of the revision in
build/against. Instructions are callgrind's, hence exact. Times are the processor's:
each program takes its turn in every round, and a ratio is the median of those of one round, so that
it holds when the machine's speed drifts.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track as progress
from slat_speed import STEPS, program_time, records, widest_program
from speed import collected, instructions, rows_of

ROOT = Path(__file__).parents[2]
UKF = ("double", "float")
RECORDS = 2
SLATF = tuple((version, particles) for version in (1, 2) for particles in (100, 10_000))
PASSES = {100: 20, 10_000: 3}


def call(*command: str | Path) -> str:
    """Run a command that must succeed; give what it says."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def built(tree: Path, build: Path) -> Path:
    """Build the benchmarks of a tree; give the folder of the programs."""
    options = ("-G", "Ninja", "-D", "AUVEST_BUILD_BENCHMARKS=ON")
    call("cmake", "-S", tree, "-B", build, *options)
    targets = call("cmake", "--build", build, "--target", "help")
    wanted = sorted(set(re.findall(r"\b(?:ukf|slat)_step(?:_sse2|_avx2|_avx512f)?\b", targets)))
    call("cmake", "--build", build, "--target", *wanted)
    return build / "cpp" / "benchmarks"


def checked_out(revision: str) -> tuple[Path, Path]:
    """Give the tree of a revision, and where it is built."""
    commit = call("git", "-C", ROOT, "rev-parse", "--verify", f"{revision}^{{commit}}")
    place = ROOT / "build" / "against" / commit[:12]
    tree = place / "tree"
    if not tree.is_dir():
        tree.mkdir(parents=True)
        archive = place / "tree.tar"
        call("git", "-C", ROOT, "archive", f"--output={archive}", commit)
        call("tar", "-xf", archive, "-C", tree)
        archive.unlink()
    return tree, place / "build"


def ukf_times(programs: Path) -> dict[str, float]:
    """Give the nanoseconds per step of the UKF in both precisions."""
    found = re.findall(r"(float|double)\D*([0-9.]+)", call(programs / "ukf_step", "200000"))
    return {scalar: float(value) for scalar, value in found}


def slatf_instructions(program: Path, record: Path, version: int, particles: int) -> float:
    """Give the instructions per particle and step: of two passes more, which only step."""
    one, three = (collected(program, record, version, particles, passes) for passes in (1, 3))
    return (three - one) / (2 * RECORDS * STEPS * particles)


def main(argv: Sequence[str] | None = None) -> int:
    """Build, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("revision", help="a commit, branch or tag")
    parser.add_argument("--rounds", type=int, default=9, help="rounds of timing (default 9)")
    arguments = parser.parse_args(argv)
    console = Console(stderr=True)
    try:
        with console.status("building"):
            tree, build = checked_out(arguments.revision)
            places = {"here": built(ROOT, ROOT / "build" / "measure"), "there": built(tree, build)}
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    times: dict[tuple[str, str], list[float]] = {}

    def add(what: str, where: str, value: float) -> None:
        times.setdefault((what, where), []).append(value)

    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "record"
        records()[0][:RECORDS].tofile(record)
        widest = {
            where: place / widest_program(place, record)[-1] for where, place in places.items()
        }
        for _ in progress(range(arguments.rounds), "timing", console=console):
            for where, place in places.items():
                for scalar, value in ukf_times(place).items():
                    add(f"UKF, {scalar}: ns per step", where, value)
            for version, particles in SLATF:
                for where, program in widest.items():
                    passes = PASSES[particles]
                    value = program_time(program, record, version, particles, passes, None)
                    what = f"SLATF {version}.0, {program.name.removeprefix('slat_step_')}"
                    add(f"{what}, N = {particles:,}: ns per particle and step", where, value)
        for version in (1, 2):
            for where, program in widest.items():
                count = slatf_instructions(program, record, version, 100)
                add(f"SLATF {version}.0, N = 100: instructions per particle and step", where, count)
    for scalar in UKF:
        for where, place in places.items():
            count = instructions(place / "ukf_step", scalar)
            add(f"UKF, {scalar}: instructions per step", where, count)
    rows = [("", "here", arguments.revision, "ratio"), ("---", "---:", "---:", "---:")]
    for what in dict.fromkeys(what for what, _ in times):
        here, there = (np.array(times[what, where]) for where in ("here", "there"))
        ratio = np.median(here / there)
        rows.append((what, f"{np.median(here):,.4g}", f"{np.median(there):,.4g}", f"{ratio:.3f}"))
    print(rows_of(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
