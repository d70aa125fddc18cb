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
from auvest.registry import FILTERS, replayable
from auvest.replay import Settings, replay, settings_from
from tests.attacks.damage import damaged, steps
from tests.attacks.frame import Case, Failed, main


def table(header: str, rows: Any) -> bytes:
    lines = [",".join(f"{value:.6g}" for value in row) for row in rows]
    return "\n".join([header, *lines, ""]).encode()


@cache
def logs() -> dict[str, dict[str, bytes]]:
    """Short logs: beacons, leaders that move, a target seen from a station; and with all columns.

    "sensors" has a DVL, a compass, depth, fixes and positions, "space" a USBL with what the craft
    tells, "own" a user's files with a mapping, times in ISO 8601 and places on Earth, "echoes" and
    "headings" a slave and masters.
    """
    time = range(1, 25)
    odometry = table("time_s,forward_m,left_m,turn_rad", [(t, 1.0, 0.0, 0.02) for t in time])
    speed = table("time_s,speed_m_s,yaw_rate_rad_s", [(t, 1.0, 0.01) for t in time])
    start = table("time_s,x_m,y_m,heading_rad", [(0, 0, 0, 0.1)])
    truth = table("time_s,x_m,y_m", [(t, t, 0.1 * t) for t in time])
    ranges = [(t + 0.25, 1 + t % 2, math.hypot(20 - t, 30 - 40 * (t % 2))) for t in time]
    leaders = [(t, 1 + t % 2, 20 + 0.2 * t, 30 - 40 * (t % 2), 0.5) for t in time]
    fixes = [(t, 0, 10 + 0.5 * t, 0.3 + 0.01 * t) for t in time]
    common = {"start.csv": start, "truth.csv": truth}
    depth = table("time_s,depth_m", [(t, 3 + 0.1 * t) for t in time])
    compass = table("time_s,compass_rad", [(0.7 * t, 1.5 - 0.01 * t) for t in range(36)])
    positions = table("time_s,x_m,y_m,sigma_m", [(5 * t, 5 * t, 0.5 * t, t % 2) for t in range(5)])
    own = {
        "nav.txt": "\n".join(
            ["utc\tvx\tvy\thdg\tdepth\tnote"]
            + [f"2026-05-04T06:30:{t:02d}Z\t1000\t-20\t{89 - t}\t3.5\tok" for t in time]
        ),
        "modem.csv": "\n".join(
            ["t;id;r"]
            + [f"{1777876200000 + 1000 * t};1;{math.hypot(20 - t, 30):.2f}".replace(".", ",")
               for t in time]
        ),
        "ships.csv": "\n".join(
            ["time,source,latitude_deg,longitude_deg,depth_m"]
            + [f"2026-05-04T06:30:{t:02d}+00:00,1,43.00027,{5.9 + 2.46e-4:.6f},2" for t in time]
        ),
        "start.csv": "time,latitude_deg,longitude_deg\n2026-05-04T06:30:01Z,43,5.9",
    }  # fmt: skip
    return {
        "sensors": {
            "odometry.csv": table("time_s,speed_m_s,left_m_s", [(t, 1.0, 0.1) for t in time]),
            "compass.csv": compass,
            "ranges.csv": table("time_s,source,range_m", ranges),
            "fixes.csv": table(
                "time_s,source,range_m,azimuth_rad,elevation_rad",
                [(t + 0.5, 2, math.hypot(20 - t, 10), 0.5 + 0.02 * t, -0.1) for t in time],
            ),
            "positions.csv": positions,
            "depth.csv": depth,
            "beacons.csv": table("source,x_m,y_m,depth_m", [(1, 20, 30, 5), (2, 20, -10, 1)]),
            **common,
        },
        "space": {
            "fixes.csv": table(
                "time_s,source,range_m,bearing_rad,depression_rad", [(*row, 0.4) for row in fixes]
            ),
            "velocities.csv": table(
                "time_s,forward_m_s,starboard_m_s,down_m_s,heading_rad",
                [(t + 0.5, 0.5, 0.0, 0.1, 0.3) for t in time],
            ),
            "depth.csv": depth,
            "positions.csv": positions,
            "beacons.csv": table("source,x_m,y_m,depth_m", [(0, 0, 0, 2)]),
            "truth.csv": truth,
        },
        "own": {name: f"{text}\n".encode() for name, text in own.items()},
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
        "echoes": {
            "odometry.csv": speed,
            "echoes.csv": table(
                "time_s,source,range_m,bearing_rad",
                [(t + 0.5, 4 + t % 2, 30 + 0.2 * t, 0.5 - 0.1 * t) for t in time],
            ),
            "masters.csv": table(
                "time_s,source,x_m,y_m,vx_m_s,sigma_m", [(0, 4, 25, 20, 0.1, 2), (8, 6, 9, 9, 0, 1)]
            ),
            "master_truth.csv": table("time_s,source,x_m,y_m", [(t, 4, 25, 20) for t in time]),
            **common,
        },
        "headings": {
            "odometry.csv": table("time_s,speed_m_s,heading_rad", [(t, 1.0, 0.1) for t in time]),
            "echoes.csv": table(
                "time_s,range_m,azimuth_rad", [(t, 30 + 0.2 * t, 0.5 - 0.1 * t) for t in time]
            ),
            "plans.csv": table("time_s,source,ax_m_s2,ay_m_s2", [(5, 0, 0.1, 0), (9, 0, 0, 0)]),
            **common,
        },
        "tracking": {
            "fixes.csv": table("time_s,source,range_m,bearing_rad", fixes),
            "beacons.csv": table("source,x_m,y_m", [(0, 0, 0)]),
            "truth.csv": truth,
        },
    }


#: How each is read and replayed; the others with the defaults.
SETTINGS = {
    "echoes": settings_from(
        {"slat": {"particles": 20, "max_masters": 3}, "slave": {"mean_s": 0.3}}
    ),
    "headings": settings_from({"slat": {"particles": 20}}),
    "sensors": settings_from({"ranges": {"latency_s": 1.5, "sources": {"2": {"latency_s": 0.25}}}}),
    "space": settings_from({"fixes": {"latency_s": 2.0}, "log": {"frame": "ned"}}),
    "own": settings_from(
        {
            "columns": {
                "odometry": {"file": "nav.txt", "separator": "\t", "time": "utc", "speed_m_s": "vx",
                             "starboard_m_s": "vy"},
                "compass": {"file": "nav.txt", "separator": "\t", "time": "utc",
                            "compass_rad": "hdg"},
                "depth": {"file": "nav.txt", "separator": "\t", "time": "utc", "depth_m": "depth"},
                "ranges": {"file": "modem.csv", "separator": ";", "decimal": ",", "time_s": "t",
                           "source": "id", "range_m": "r"},
                "leaders": {"file": "ships.csv"},
            },
            "units": {
                "odometry": {"speed_m_s": "mm/s", "starboard_m_s": "mm/s"},
                "compass": {"compass_rad": "deg"},
                "ranges": {"time_s": "ms"},
            },
        },
        "auvest.toml",
    ),
}  # fmt: skip


class Logs:
    """The attack."""

    unit: ClassVar[str] = "logs"

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="auvest-attack-"))

    def case(self, rng: random.Random) -> Case:
        kind = rng.choice(list(logs()))
        family = "slat" if "echoes.csv" in logs()[kind] else "gaussian"
        fitting = [name for name in replayable() if FILTERS[name].family == family]
        return Case((kind, rng.choice(fitting)), steps(rng, list(logs()[kind])))

    def text(self, case: Case) -> str:
        kind, name = case.subject
        return (
            "from tests.attacks import damage, logs\n"
            f"files = damage.damaged(logs.logs()[{kind!r}], {case.steps!r})\n"
            "for name, text in files.items(): Path('log', name).write_bytes(text)\n"
            f"settings = logs.SETTINGS.get({kind!r}, Settings())\n"
            f"log = LogFolder('log', reading=settings.reading)\n"
            f"replay(log, settings, filter_name={name!r})"
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
                settings = SETTINGS.get(kind, Settings())
                log = LogFolder(folder, reading=settings.reading)
                estimates = replay(log, settings, filter_name=name).estimates
        except LogError as refused:
            counts["LogError"] += 1
            if not re.search(r"\.csv|\.txt|log", str(refused)):
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
