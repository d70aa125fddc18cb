"""Rows of a log per second of processor time that a replay takes, and its peak memory.

    python tests/python/replay_speed.py [--rows 1000000] [--rounds 3] [TREE...]

TREE is the folder ``python`` of another checkout, with its module built; it is measured in turns
with the package that is installed. The log is that of ``test_replay.long_log``: half odometry, half
ranges. Tables and tracks are written, no report.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from test_replay import long_log

#: Earlier packages have no ``write``, and never wrote a report from here.
_RUN = """
import sys, tempfile, time
from inspect import signature
from pathlib import Path
if len(sys.argv) > 2:  # an editable install would be found before what is on the path
    sys.meta_path[:] = [f for f in sys.meta_path if "_editable_" not in type(f).__module__]
    sys.path.insert(0, sys.argv[2])
from auvest.logs import LogFolder
from auvest.replay import Settings, replay
chosen = "write" in signature(replay).parameters
more = {"write": ("estimates", "measurements", "errors", "tracks")} if chosen else {}
begun = time.process_time()
with tempfile.TemporaryDirectory() as folder:
    replay(LogFolder(Path(sys.argv[1])), Settings(), folder=Path(folder), **more)
seconds = time.process_time() - begun
status = Path("/proc/self/status").read_text()
print(seconds, int(status.split("VmHWM:")[1].split()[0]) / 1024)
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("trees", nargs="*", metavar="TREE")
    given = parser.parse_args()
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in ("", *given.trees)}
    with tempfile.TemporaryDirectory() as folder:
        log = long_log(Path(folder) / "log", given.rows)
        for _ in range(given.rounds):
            for tree, runs in found.items():
                program = [sys.executable, "-c", _RUN, str(log), *([tree] if tree else [])]
                done = subprocess.run(program, capture_output=True, text=True, check=True)
                seconds, peak_mb = map(float, done.stdout.split())
                runs.append((seconds, peak_mb))
    for tree, runs in found.items():
        rate = given.rows / min(seconds for seconds, _ in runs)
        peak_mb = max(peak for _, peak in runs)
        print(f"{tree or 'installed'}: {rate:,.0f} rows/s, {peak_mb:.0f} MB")


if __name__ == "__main__":
    main()
