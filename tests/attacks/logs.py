"""Mutated logs through the reader and the replay, in this process.

    python -m tests.attacks.logs --logs 50000 --seed 1

A log is replayed, or refused by an error that is documented and names what is wrong. What is
replayed has finite estimates, in the order of time.
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
from typing import Any, ClassVar

import numpy as np

from auvest.errors import FilterError
from auvest.logs import LogError, LogFolder
from auvest.registry import replayable
from auvest.replay import Settings, replay
from tests.attacks.damage import damaged, steps
from tests.attacks.frame import Case, Failed, main


def table(header: str, rows: Any) -> bytes:
    lines = [",".join(f"{value:.6g}" for value in row) for row in rows]
    return "\n".join([header, *lines, ""]).encode()


@cache
def logs() -> dict[str, dict[str, bytes]]:
    """Three short logs: beacons, leaders that move, a target seen from a station."""
    time = range(1, 25)
    odometry = table("time_s,forward_m,left_m,turn_rad", [(t, 1.0, 0.0, 0.02) for t in time])
    speed = table("time_s,speed_m_s,yaw_rate_rad_s", [(t, 1.0, 0.01) for t in time])
    start = table("time_s,x_m,y_m,heading_rad", [(0, 0, 0, 0.1)])
    truth = table("time_s,x_m,y_m", [(t, t, 0.1 * t) for t in time])
    ranges = [(t + 0.25, 1 + t % 2, math.hypot(20 - t, 30 - 40 * (t % 2))) for t in time]
    leaders = [(t, 1 + t % 2, 20 + 0.2 * t, 30 - 40 * (t % 2), 0.5) for t in time]
    fixes = [(t, 0, 10 + 0.5 * t, 0.3 + 0.01 * t) for t in time]
    common = {"start.csv": start, "truth.csv": truth}
    return {
        "beacons": {
            "odometry.csv": odometry,
            "ranges.csv": table("time_s,source,range_m", ranges),
            "beacons.csv": table("source,x_m,y_m", [(1, 20, 30), (2, 20, -10)]),
            **common,
        },
        "leaders": {
            "odometry.csv": speed,
            "ranges.csv": table("time_s,source,range_m", ranges),
            "leaders.csv": table("time_s,source,x_m,y_m,sigma_m", leaders),
            **common,
        },
        "tracking": {
            "fixes.csv": table("time_s,source,range_m,bearing_rad", fixes),
            "truth.csv": truth,
        },
    }


class Logs:
    """The attack."""

    unit: ClassVar[str] = "logs"

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="auvest-attack-"))

    def case(self, rng: random.Random) -> Case:
        kind = rng.choice(list(logs()))
        return Case((kind, rng.choice(replayable())), steps(rng, list(logs()[kind])))

    def text(self, case: Case) -> str:
        kind, name = case.subject
        return (
            "from tests.attacks import damage, logs\n"
            f"files = damage.damaged(logs.logs()[{kind!r}], {case.steps!r})\n"
            "for name, text in files.items(): Path('log', name).write_bytes(text)\n"
            f"replay(LogFolder('log'), Settings(), filter_name={name!r})"
        )

    def run(self, case: Case, counts: Counter[str]) -> None:
        kind, name = case.subject
        counts["logs"] += 1
        folder = self._folder / "log"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for file, text in damaged(logs()[kind], case.steps).items():
            (folder / file).write_bytes(text)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                estimates = replay(LogFolder(folder), Settings(), filter_name=name).estimates
        except LogError as refused:
            counts["LogError"] += 1
            if not re.search(r"\.csv|log", str(refused)):
                raise Failed("a LogError names no file", str(refused)) from None
            return
        except FilterError:
            counts["FilterError"] += 1
            return
        except ValueError as refused:
            counts["ValueError"] += 1
            if not re.search(r"[a-z]{3}", str(refused)):
                raise Failed("a message says nothing", repr(refused)) from None
            return
        except BaseException as wrong:
            raise Failed(f"replay of {kind}: {type(wrong).__name__}", repr(wrong)) from None
        counts["replayed"] += 1
        columns = estimates.columns()
        for column, values in columns.items():
            told = not column.startswith("dead_reckoned")  # which a target has not
            if told and values.dtype.kind == "f" and not np.isfinite(values).all():
                raise Failed(f"replay of {kind}: {column} is not finite", f"{values}")
        if (np.diff(columns["time_s"]) < 0).any():
            raise Failed(f"replay of {kind}: time goes back", f"{columns['time_s']}")


ATTACK = Logs()

if __name__ == "__main__":
    main(ATTACK, __doc__, 2_000)
