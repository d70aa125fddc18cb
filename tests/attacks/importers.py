"""Mutated recordings through the importers, in this process.

    python -m tests.attacks.importers --imports 20000 --seed 1

An import is refused by an error that names a file, and leaves nothing; or what it wrote is a log
that the reader takes, without a number that is none. The source stays as it was.
"""

from __future__ import annotations

import math
import random
import re
import shutil
import tempfile
import warnings
from collections import Counter
from functools import cache
from pathlib import Path
from typing import ClassVar

from auvest.importers.sets import IMPORTERS
from auvest.logs import LogError, LogFolder
from tests.attacks.damage import damaged, steps
from tests.attacks.frame import Case, Failed, main
from tests.attacks.logs import table


@cache
def recordings() -> dict[str, dict[str, bytes]]:
    """A short recording in the format of each set."""
    time = range(1, 13)
    increments = table("t,dx_body,dy_body,dtheta", [(t, 0.2, 0.5, 0.1) for t in time])
    velocity = [(t, 0.4, 0.1) for t in time]
    pose = [(t, 1.5 * t, -0.5 * t, 0.1 * t) for t in time]
    robots = range(1, 6)
    seen = [(t, 1 + t % 5, 1 + (t + 2) % 5, 2.5 + 0.1 * t) for t in time]
    spaced = {
        "Barcodes.dat": [(robot, 10 + robot) for robot in robots],
        **{f"Robot{r}_Groundtruth.dat": [(t, t, r, 0.1) for t in time] for r in robots},
        **{f"Robot{r}_Odometry.dat": velocity for r in robots},
        **{
            f"Robot{r}_Measurement.dat": [(t, 11 + (r + t) % 5, 2.0, 0.1) for t in time]
            for r in robots
        },
    }
    return {
        "goats14": {
            "odometry.csv": increments,
            "ranges.csv": table("t,beacon,range", [(t + 0.5, 3 + t % 2, 40.5) for t in time]),
            "beacons.csv": table("beacon,x,y", [(3, 10, -20), (4, 30, 5)]),
            "reference_batch.csv": table("t,x,y", [row[:3] for row in pose]),
            "groundtruth.csv": table("t,theta", [(t, 0.1 * t) for t in time]),
        },
        "hat_charles": {
            "odometry.csv": increments,
            "leader_ranges.csv": table(
                "t,leader_x,leader_y,leader_pos_var,range", [(t, 10 + t, 20, 4, 30) for t in time]
            ),
            "groundtruth.csv": table("t,x,y,theta", pose),
        },
        "labyrinth_uwb": {
            "ranges.csv": table(
                "t,module,range,module_x,module_y",
                [(t, 1 + t % 2, 3, 5 * (t % 2), 1) for t in time],
            ),
            "odometry.csv": table("t,v,w", velocity),
            "groundtruth.csv": table("t,x,y", [row[:3] for row in pose]),
            "initial_heading.txt": b"0.5\n",
        },
        "mrclam6": {
            "sightings.csv": table("t,observer,subject,range", seen),
            "odometry.csv": table("robot,t,v,w", [(r, *row) for r in robots for row in velocity]),
            "groundtruth.csv": table(
                "robot,t,x,y,theta", [(r, *row) for r in robots for row in pose]
            ),
        },
        "mrclam6_tracks": {
            "sightings.csv": table(
                "t,observer,subject,range,bearing", [(0.5 * t, 1, 2, 3, 0.1) for t in range(2, 60)]
            ),
            "odometry.csv": table("robot,t,v,w", [(r, *row) for r in robots for row in velocity]),
            "groundtruth.csv": table(
                "robot,t,x,y,theta",
                [(r, 0.25 * t, t, r, 0.1) for r in robots for t in range(130)],
            ),
        },
        "two_vehicles": {
            "odometry.csv": table("t,v,w", velocity),
            "sonar.csv": table("t,range,bearing", [(t, 30, 0.1 * t) for t in time]),
            "groundtruth.csv": table("t,x,y,theta", pose),
            "master.csv": table("t,x,y", [row[:3] for row in pose]),
        },
        "mrclam": {
            name: b"# comment\n" + table("", rows).lstrip().replace(b",", b" ")
            for name, rows in spaced.items()
        },
        "ugps_pier59": {
            f"fixes_{k}.csv": table(
                "t,valid,x_fwd,y_stbd", [(t, int(t % 4 > 0), 5 + t, math.sin(t)) for t in time]
            )
            for k in (1, 2)
        },
    }


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


class Importers:
    """The attack."""

    unit: ClassVar[str] = "imports"

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="auvest-attack-"))

    def case(self, rng: random.Random) -> Case:
        name = rng.choice(list(recordings()))
        return Case(name, steps(rng, list(recordings()[name])))

    def text(self, case: Case) -> str:
        return (
            "from tests.attacks import damage, importers\n"
            f"files = damage.damaged(importers.recordings()[{case.subject!r}], {case.steps!r})\n"
            "for name, text in files.items(): Path('set', name).write_bytes(text)\n"
            f"IMPORTERS[{case.subject!r}](Path('set'), Path('logs'))"
        )

    def run(self, case: Case, counts: Counter[str]) -> None:
        name = case.subject
        counts["imports"] += 1
        source, output = self._folder / "set", self._folder / "logs"
        for folder in (source, output):
            shutil.rmtree(folder, ignore_errors=True)
        source.mkdir(parents=True)
        files = damaged(recordings()[name], case.steps)
        for file, text in files.items():
            (source / file).write_bytes(text)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                folders = IMPORTERS[name](source, output)
        except LogError as refused:
            counts["refused"] += 1
            if not re.search(r"\.(csv|txt|dat)", str(refused)):
                raise Failed(f"{name}: a refusal names no file", str(refused)) from None
            if output.exists() and contents(output):
                left = sorted(contents(output))
                raise Failed(f"{name}: a refused import leaves files", f"{left}") from None
            return
        except BaseException as wrong:
            raise Failed(f"{name}: {type(wrong).__name__}", repr(wrong)) from None
        counts["imported"] += 1
        if contents(source) != files:
            raise Failed(f"{name}: the source was changed", "")
        for folder in folders:
            self._require_log(name, folder)

    def _require_log(self, name: str, folder: Path) -> None:
        for path in folder.iterdir():
            if re.search(r"(?m)(^|,)-?(nan|inf|9223372036854775808)(,|$)", path.read_text()):
                raise Failed(f"{name}: writes a number that is none", path.name)
        try:
            log = LogFolder(folder)
            for path in folder.glob("*.csv"):
                log[path.name].whole()
        except LogError as refused:
            raise Failed(f"{name}: writes what the reader refuses", str(refused)) from None


ATTACK = Importers()

if __name__ == "__main__":
    main(ATTACK, __doc__, 2_000)
