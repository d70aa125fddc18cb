"""Time that auvest takes to start: ``import auvest``, the first filter, ``auvest --help``.

    python cpp/benchmarks/startup.py [--write docs/speed_startup.md]

Each line is a new interpreter; the times are the processor's, medians of rounds in which all take
their turn, so that their ratios hold when the machine's speed drifts. Those of the imports are
without what an interpreter takes that imports nothing. Exit code 1 if a bound is missed.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track as progress

BARE = "python -c pass"
NUMPY = "import numpy"
IMPORT = "import auvest"
FILTER = "from auvest import Ukf"
HELP = "auvest --help"

MAX_IMPORT = 1.5  # of NumPy's
MAX_FILTER = 2.0
#: What ``auvest --help`` took while it imported all commands: over ``import numpy``, both with the
#: interpreter.
HELP_BEFORE = 4.46
MAX_HELP = 0.5  # of that

PAGE = """# Time to start

Made by `make bench`. The processor's time of a new interpreter, medians of rounds in which all take
their turn; only the ratios travel to another machine. The imports are without the time of an
interpreter that imports nothing, {bare:.0f} ms; `auvest --help` is the whole program.

| what | ms | ratio |
| --- | ---: | --- |
{rows}
"""


def command(what: str) -> list[str]:
    """Return the command line of a row."""
    if what == HELP:
        return [sys.executable, "-m", "auvest", "--help"]
    return [sys.executable, "-c", "pass" if what == BARE else what]


def seconds(arguments: Sequence[str]) -> float:
    """Return the processor time of a program, s; it must succeed."""
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL) as program:
        _, status, usage = os.wait4(program.pid, 0)
        program.returncode = os.waitstatus_to_exitcode(status)
    if program.returncode != 0:
        raise RuntimeError(f"{' '.join(arguments)}: exit code {program.returncode}")
    return usage.ru_utime + usage.ru_stime


def measure(rounds: int) -> dict[str, float]:
    """Return the median time of each row, s; the first round only fills caches."""
    names = (BARE, NUMPY, IMPORT, FILTER, HELP)
    times: dict[str, list[float]] = {name: [] for name in names}
    for _ in progress(range(rounds + 1), "starting", console=Console(stderr=True)):
        for name, found in times.items():
            found.append(seconds(command(name)))
    return {name: statistics.median(found[1:]) for name, found in times.items()}


def ratios(times: Mapping[str, float]) -> dict[str, float]:
    """Return what the bounds are about: imports over NumPy's, help over that of before."""
    numpy = times[NUMPY] - times[BARE]
    return {
        IMPORT: (times[IMPORT] - times[BARE]) / numpy,
        FILTER: (times[FILTER] - times[BARE]) / numpy,
        HELP: times[HELP] / times[NUMPY] / HELP_BEFORE,
    }


def page(times: Mapping[str, float]) -> str:
    """Return docs/speed_startup.md."""
    found = ratios(times)
    words = {
        NUMPY: "1",
        IMPORT: f"{found[IMPORT]:.2f}",
        FILTER: f"{found[FILTER]:.2f}",
        HELP: f"{found[HELP]:.2f} of what it took when it imported all commands",
    }
    rows = []
    for name, ratio in words.items():
        time_s = times[name] - (0 if name == HELP else times[BARE])
        rows.append(f"| `{name}` | {1e3 * time_s:.0f} | {ratio} |")
    return PAGE.format(bare=1e3 * times[BARE], rows="\n".join(rows))


def main() -> int:
    """Measure, print, and compare with the bounds."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="rounds (default 15)")
    parser.add_argument("--write", type=Path, help="write the page to this file")
    arguments = parser.parse_args()
    times = measure(arguments.rounds)
    text = page(times)
    print(text)
    if arguments.write:
        arguments.write.write_text(text, encoding="utf-8")
    found = ratios(times)
    checks = {
        f"{IMPORT} / {NUMPY} <= {MAX_IMPORT}": found[IMPORT] <= MAX_IMPORT,
        f"{FILTER} / {NUMPY} <= {MAX_FILTER}": found[FILTER] <= MAX_FILTER,
        f"{HELP} / before <= {MAX_HELP}": found[HELP] <= MAX_HELP,
    }
    for name, passed in checks.items():
        print(f"{'ok    ' if passed else 'MISSED'} {name}", file=sys.stderr)
    return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
