"""From data sets with a layout of their own to logs, ``importer(source, output)``.

A function is named by the set that had the layout first, and reads every folder of that layout.
It writes one or more log folders below ``output``, named by the source's folder, and returns their
paths, all of them or none. A set without truth becomes a log without; that is said.
Nothing is filtered or corrected on the way, except where a function's docstring says so; what no
log could hold is refused, with the file and the line it stands in.
"""

from __future__ import annotations

import functools
import itertools
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._outputs import NewFolder, OutputError, is_plain_file
from auvest._texts import other_cells
from auvest.importers.robots import Robots, within
from auvest.logs.reader import LogError, LogFolder, Rows
from auvest.logs.write import write_file

#: The columns of each file of a log.
Log: TypeAlias = dict[str, dict[str, npt.NDArray[np.generic]]]

#: Columns that hold whole numbers, in every set.
_WHOLE = frozenset({"beacon", "module", "observer", "robot", "subject", "valid"})


class Importer(Protocol):
    """Writes the logs of a set below a folder and returns where."""

    def __call__(
        self,
        source: Path,
        output: Path,
        *,
        force: bool = False,
        note: Callable[[str], None] = lambda _: None,
    ) -> list[Path]:
        """``force`` is :class:`auvest._outputs.NewFolder`'s; ``note`` takes what a user reads."""


def _importer(read: Callable[[Path], dict[str, Log]]) -> Importer:
    """Make an importer of what reads a set: logs by the names of their folders."""

    @functools.wraps(read)
    def write(
        source: Path,
        output: Path,
        *,
        force: bool = False,
        note: Callable[[str], None] = lambda _: None,
    ) -> list[Path]:
        logs = read(source)
        with ExitStack() as stack:
            made = []
            for name, log in logs.items():
                _require_apart(source, output / name)
                new = NewFolder(output / name, f"import {read.__name__}", force=force)
                made.append(stack.enter_context(new))
                for file, columns in log.items():
                    # A robot may have met nobody; without anything else there is no log.
                    if file != "ranges.csv" and not len(next(iter(columns.values()))):
                        raise LogError(source, f"nothing is left for {file} of {name}")
                    try:
                        write_file(new.part, file, **columns)
                    except ValueError as error:
                        raise LogError(source, f"no log can be made of this: {error}") from None
                LogFolder(new.part)
                if "truth.csv" not in log:
                    note(f"{name} has no truth: nothing can be scored against it")
                if not {"start.csv", "truth.csv", "fixes.csv"} & set(log):
                    note(f"{name} has neither start.csv nor truth.csv: a replay cannot start")
            for new in made:
                new.publish()
        return [new.path for new in made]

    return write


def _require_apart(source: Path, target: Path) -> None:
    """Refuse to write into a recording, and to replace a folder that holds it."""
    given, wanted = source.resolve(), target.resolve()
    if given.is_relative_to(wanted) or wanted.is_relative_to(given):
        raise OutputError(
            f"the log would be {target}, in or above its source {source}: name another OUT"
        )


@_importer
def goats14(source: Path) -> dict[str, Log]:
    """AUV with acoustic beacons (GOATS 2002; set 14 is the one that is validated with).

    The odometry's forward axis is +y; here it is turned to forward and left. Truth is the robust
    batch reference; the run starts there, with the heading of the INS.
    """
    odometry = _table(source / "odometry.csv", "t", "dx_body", "dy_body", "dtheta")
    ranges = _table(source / "ranges.csv", "t", "beacon", "range")
    beacons = _table(source / "beacons.csv", "beacon", "x", "y")
    log = {
        "odometry.csv": _steps(odometry[:, 0], odometry[:, 2], -odometry[:, 1], odometry[:, 3]),
        "ranges.csv": _ranges(ranges),
        "beacons.csv": _beacons(beacons),
    }
    if (path := source / "reference_batch.csv").exists():
        reference = _table(path, "t", "x", "y")
        log["truth.csv"] = _truth(reference)
        onboard = _table(source / "groundtruth.csv", "t", "theta")
        log["start.csv"] = _start(reference[0], float(onboard[0, 1]) + math.pi / 2)
    return {_name(source): log}


@_importer
def hat_charles(source: Path) -> dict[str, Log]:
    """Dead-reckoning slave and one moving leader (Charles River, 2022).

    A message whose range and leader position both repeat those of the message before it is stale
    and left out (3 of 56).
    """
    odometry = _table(source / "odometry.csv", "t", "dx_body", "dy_body", "dtheta")
    path = source / "leader_ranges.csv"
    messages = _table(path, "t", "leader_x", "leader_y", "leader_pos_var", "range")
    negative = np.flatnonzero(messages[:, 3] < 0)
    if negative.size:
        k = int(negative[0])
        raise LogError(
            path, f"a variance of {messages[k, 3]:g}", line=k + 2, column="leader_pos_var"
        )
    fresh = np.append(True, (np.diff(messages[:, [1, 2, 4]], axis=0) != 0).any(axis=1))
    messages = messages[fresh]
    leader = np.ones(len(messages))
    log = {
        "odometry.csv": _steps(*odometry.T),
        "ranges.csv": _ranges(np.column_stack([messages[:, 0], leader, messages[:, 4]])),
        "leaders.csv": {
            "time_s": messages[:, 0],
            "source": leader.astype(int),
            "x_m": messages[:, 1],
            "y_m": messages[:, 2],
            "sigma_m": np.sqrt(messages[:, 3]),
        },
    }
    if (path := source / "groundtruth.csv").exists():
        log["truth.csv"] = _truth(_table(path, "t", "x", "y", "theta"))
    return {_name(source): log}


@_importer
def labyrinth_uwb(source: Path) -> dict[str, Log]:
    """Small robot and four UWB modules (TU Chemnitz)."""
    ranges = _table(source / "ranges.csv", "t", "module", "range", "module_x", "module_y")
    odometry = _table(source / "odometry.csv", "t", "v", "w")
    log = {
        "odometry.csv": _velocity(odometry),
        "ranges.csv": _ranges(ranges),
        "beacons.csv": _beacons(np.unique(ranges[:, [1, 3, 4]], axis=0)),
    }
    if (path := source / "groundtruth.csv").exists():
        truth = _table(path, "t", "x", "y")
        heading = _table(source / "initial_heading.txt")
        log["truth.csv"] = _truth(truth)
        log["start.csv"] = _start(truth[0], float(heading[0, 0]))
    return {_name(source): log}


@_importer
def mrclam6(source: Path) -> dict[str, Log]:
    """Five ground robots; each in turn is the slave that ranges to the four others.

    Sightings in both directions are ranges of the slave, their bearings are left out. The others'
    positions, and the truth, are those of the motion capture.
    """
    return _slaves(robots_of_mrclam6(source, "range"))


@_importer
def mrclam6_tracks(source: Path) -> dict[str, Log]:
    """Read the same as logs of echoes: one for each track of a robot as another sees it.

    A track has at least 15 s of sightings without a gap above 6 s, while the truth of both is
    known; it starts at the slave's true pose, with the first of them.
    """
    return _tracks(source / "sightings.csv", robots_of_mrclam6(source))


@_importer
def mrclam(source: Path) -> dict[str, Log]:
    """Read the original text files of any UTIAS MR.CLAM set: Barcodes.dat, Robot1_Odometry.dat ...

    As :func:`mrclam6`, with all of the motion capture. Time is counted from the first second of it.
    """
    return _slaves(_robots_of_mrclam(source))


@_importer
def mrclam_tracks(source: Path) -> dict[str, Log]:
    """Read these text files as :func:`mrclam6_tracks` does."""
    return _tracks(source / "Robot1_Measurement.dat", _robots_of_mrclam(source))


@_importer
def two_vehicles(source: Path) -> dict[str, Log]:
    """Slave and master: odometry.csv (t, v, w) and sonar.csv (t, range, bearing) of the slave.

    Bearings are from its heading. truth of both: groundtruth.csv (t, x, y, theta), at the first
    line of which the run starts, and master.csv (t, x, y).
    """
    truth = _table(source / "groundtruth.csv", "t", "x", "y", "theta")
    log = {
        "odometry.csv": _velocity(_table(source / "odometry.csv", "t", "v", "w")),
        "echoes.csv": _echoes(_table(source / "sonar.csv", "t", "range", "bearing"), 1),
        "truth.csv": _truth(truth),
    }
    if (path := source / "master.csv").exists():
        log["master_truth.csv"] = _of_source(_table(path, "t", "x", "y"), 1)
    return {_name(source): log}


def robots_of_mrclam6(source: Path, *seen: str) -> Robots:
    """Read groundtruth.csv, odometry.csv and what was seen in sightings.csv, of several robots."""
    seen = seen or ("range", "bearing")
    sightings = _table(source / "sightings.csv", "t", "observer", "subject", *seen)
    odometry = _table(source / "odometry.csv", "robot", "t", "v", "w")
    truth = _table(source / "groundtruth.csv", "robot", "t", "x", "y", "theta")
    robots = np.unique(truth[:, 0]).astype(int).tolist()
    if len(robots) < 2:
        raise LogError(source / "groundtruth.csv", "one robot alone has nobody to range to")
    return Robots(
        {robot: odometry[odometry[:, 0] == robot, 1:] for robot in robots},
        {robot: truth[truth[:, 0] == robot, 1:] for robot in robots},
        sightings,
    )


def _robots_of_mrclam(source: Path) -> Robots:
    barcodes = {code: int(subject) for subject, code in _text(source / "Barcodes.dat", 2)}
    robots = range(1, 6)
    truth = {robot: _text(source / f"Robot{robot}_Groundtruth.dat", 4) for robot in robots}
    start = math.floor(min(track[0, 0] for track in truth.values()))
    odometry = {robot: _text(source / f"Robot{robot}_Odometry.dat", 3) for robot in robots}
    sightings = []
    for robot in robots:
        truth[robot][:, 0] -= start
        odometry[robot][:, 0] -= start
        seen = _text(source / f"Robot{robot}_Measurement.dat", 4)
        subject = np.array([barcodes.get(code, -1) for code in seen[:, 1]], float)
        observer = np.full(len(seen), float(robot))
        sightings.append(np.column_stack([seen[:, 0] - start, observer, subject, seen[:, 2:4]]))
    return Robots(odometry, truth, np.concatenate(sightings))


@_importer
def ugps_pier59(source: Path) -> dict[str, Log]:
    """ROV tracked by a fixed antenna: recordings fixes_1.csv on; polls without a fix left out."""
    logs: dict[str, Log] = {}
    for number in itertools.count(1):
        path = source / f"fixes_{number}.csv"
        if number > 1 and not path.exists():
            break
        fixes = _table(path, "t", "valid", "x_fwd", "y_stbd", missing=("x_fwd", "y_stbd"))
        valid = fixes[:, 1] == 1
        unknown = np.flatnonzero(valid & np.isnan(fixes).any(axis=1))
        if unknown.size:
            raise LogError(path, "a valid fix without a position", line=int(unknown[0]) + 2)
        fixes = fixes[valid]
        logs[f"{_name(source)}_{number}"] = {
            "fixes.csv": {
                "time_s": fixes[:, 0],
                "source": np.zeros(len(fixes), int),
                "range_m": np.hypot(fixes[:, 2], fixes[:, 3]),
                "bearing_rad": np.arctan2(fixes[:, 3], fixes[:, 2]),
            },
            "beacons.csv": _beacons(np.zeros((1, 3))),
        }
    return logs


#: What ``auvest import`` knows.
IMPORTERS: Mapping[str, Importer] = {
    "goats14": goats14,
    "hat_charles": hat_charles,
    "labyrinth_uwb": labyrinth_uwb,
    "mrclam6": mrclam6,
    "mrclam": mrclam,
    "mrclam6_tracks": mrclam6_tracks,
    "mrclam_tracks": mrclam_tracks,
    "two_vehicles": two_vehicles,
    "ugps_pier59": ugps_pier59,
}

#: A file that tells the layout.
_TELLS: Mapping[str, str] = {
    "goats14": "beacons.csv",
    "hat_charles": "leader_ranges.csv",
    "labyrinth_uwb": "initial_heading.txt",
    "mrclam6": "sightings.csv",
    "mrclam": "Barcodes.dat",
    "two_vehicles": "sonar.csv",
    "ugps_pier59": "fixes_1.csv",
}


def layout_of(source: Path) -> str | None:
    """Name the layout that a folder has, one of :data:`IMPORTERS`; None if it has none of them."""
    return next((name for name, file in _TELLS.items() if (source / file).is_file()), None)


def _name(source: Path) -> str:
    return source.resolve().name


def _slaves(robots: Robots) -> dict[str, Log]:
    """Make a log of each robot that ranges to the others, whose places it knows."""
    odometry, truth = robots.odometry, robots.truth
    sightings = robots.sightings[np.argsort(robots.sightings[:, 0], kind="stable")]
    logs: dict[str, Log] = {}
    for robot in truth:
        others = [other for other in truth if other != robot]
        observer, subject = sightings[:, 1], sightings[:, 2]
        mine = (observer == robot) & np.isin(subject, others)
        mine |= (subject == robot) & np.isin(observer, others)
        other = np.where(observer == robot, subject, observer)
        tracks = [np.insert(truth[leader], 1, leader, axis=1) for leader in others]
        leaders = np.concatenate(tracks)
        leaders = leaders[np.argsort(leaders[:, 0], kind="stable")]
        logs[f"robot{robot}"] = {
            "odometry.csv": _velocity(odometry[robot]),
            "ranges.csv": _ranges(np.column_stack([sightings[:, 0], other, sightings[:, 3]])[mine]),
            "leaders.csv": {
                "time_s": leaders[:, 0],
                "source": leaders[:, 1].astype(int),
                "x_m": leaders[:, 2],
                "y_m": leaders[:, 3],
            },
            "truth.csv": _truth(truth[robot]),
        }
    return logs


def _tracks(path: Path, robots: Robots) -> dict[str, Log]:
    """Make a log of each track; ``path`` is named where there is none."""
    logs: dict[str, Log] = {}
    for slave, master, echoes in robots.tracks():
        begin, end = float(echoes[0, 0]), float(echoes[-1, 0])
        pose = robots.pose(slave, echoes[:1, 0])[0]
        pair = f"robot{slave}_sees_robot{master}"
        number = 1 + sum(name.startswith(pair) for name in logs)
        truth = within(robots.truth[slave], begin, end, beyond=1)
        of_master = within(robots.truth[master], begin, end, beyond=1)
        logs[f"{pair}_{number}"] = {
            "odometry.csv": _velocity(within(robots.odometry[slave], begin, end, beyond=0)),
            "echoes.csv": _echoes(echoes, master),
            "start.csv": _start(np.array([begin, *pose[:2]]), float(pose[2])),
            "truth.csv": _truth(truth),
            "master_truth.csv": _of_source(of_master, master),
        }
    if not logs:
        raise LogError(path, "no robot sees another for long enough while both have a truth")
    return logs


_Columns: TypeAlias = dict[str, npt.NDArray[np.generic]]


def _steps(time_s: Rows, forward_m: Rows, left_m: Rows, turn_rad: Rows) -> _Columns:
    return {"time_s": time_s, "forward_m": forward_m, "left_m": left_m, "turn_rad": turn_rad}


def _velocity(rows: Rows) -> _Columns:
    return {"time_s": rows[:, 0], "speed_m_s": rows[:, 1], "yaw_rate_rad_s": rows[:, 2]}


def _ranges(rows: Rows) -> _Columns:
    return {"time_s": rows[:, 0], "source": rows[:, 1].astype(int), "range_m": rows[:, 2]}


def _echoes(rows: Rows, master: int) -> _Columns:
    source = np.full(len(rows), master)
    bearing = _wrapped(rows[:, 2])
    return {"time_s": rows[:, 0], "source": source, "range_m": rows[:, 1], "bearing_rad": bearing}


def _of_source(rows: Rows, source: int) -> _Columns:
    number = np.full(len(rows), source)
    return {"time_s": rows[:, 0], "source": number, "x_m": rows[:, 1], "y_m": rows[:, 2]}


def _beacons(rows: Rows) -> _Columns:
    return {"source": rows[:, 0].astype(int), "x_m": rows[:, 1], "y_m": rows[:, 2]}


def _truth(rows: Rows) -> _Columns:
    heading = {"heading_rad": _wrapped(rows[:, 3])} if rows.shape[1] == 4 else {}
    return {"time_s": rows[:, 0], "x_m": rows[:, 1], "y_m": rows[:, 2], **heading}


def _start(row: Rows, heading: float) -> _Columns:
    wrapped = _wrapped(np.array([heading]))
    return {"time_s": row[:1], "x_m": row[1:2], "y_m": row[2:3], "heading_rad": wrapped}


def _wrapped(angle: Rows) -> Rows:
    return np.angle(np.exp(1j * angle))


def _table(path: Path, *names: str, missing: tuple[str, ...] = ()) -> Rows:
    """Columns of a CSV file by name; without names all of a file that has no header.

    NaN is let pass in the columns ``missing`` alone.
    """
    lines = _lines(path)
    header = lines.pop(0).strip().split(",") if names and lines else []
    for name in names:
        if header.count(name) != 1:
            raise LogError(path, f"has no column {name}: is this the set named?", line=1)
    numbers = range(2 if names else 1, len(lines) + 2)
    rows = _numbers(path, lines, numbers, ",", len(header))
    if names:
        rows = rows[:, [header.index(name) for name in names]]
    for k in range(rows.shape[1]):
        name = names[k] if names else ""
        good = np.isfinite(rows[:, k])
        if name in missing:
            good |= np.isnan(rows[:, k])
        if name in _WHOLE:
            good &= (np.abs(rows[:, k]) <= 1e9) & (rows[:, k] == np.floor(rows[:, k]))
        _require(path, rows[:, k], good, numbers, name or None)
    return rows


def _text(path: Path, columns: int) -> Rows:
    """Columns of one of the UTIAS files: white space between numbers, comments after ``#``."""
    lines = [line.partition("#")[0] for line in _lines(path)]
    numbers = [k for k, line in enumerate(lines, start=1) if line.strip()]
    rows = _numbers(path, [lines[k - 1] for k in numbers], numbers, None, columns)
    for k in range(columns):
        _require(path, rows[:, k], np.isfinite(rows[:, k]), numbers, None)
    return rows


def _lines(path: Path) -> list[str]:
    try:
        if path.exists() and not is_plain_file(path):
            raise LogError(path, "is not a file")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = "is not UTF-8 text" if isinstance(error, ValueError) else error.strerror or error
        alone = path.name == "odometry.csv" and isinstance(error, FileNotFoundError)
        why = "; without odometry no log can be made of ranges" if alone else ""
        raise LogError(path, f"cannot be read: {reason}{why}") from None
    if text and not text.endswith("\n"):
        raise LogError(path, "does not end with a line end: truncated", line=text.count("\n") + 1)
    return text.splitlines()


def _numbers(
    path: Path, lines: list[str], numbers: Sequence[int], between: str | None, columns: int
) -> Rows:
    """Read rows of so many numbers (0: of as many as the first has) from lines of these numbers."""
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise LogError(path, "has no rows")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file of blank lines, which is refused below
            rows: Rows = np.loadtxt(lines, delimiter=between, comments=None, ndmin=2)
    except ValueError:
        rows = np.empty((0, 0))
    columns = columns or rows.shape[1] or 1
    if rows.shape == (len(lines), columns):
        return rows
    for number, line in zip(numbers, lines, strict=False):
        cells = line.split(between)
        if len(cells) != columns:
            raise LogError(path, other_cells(len(cells), columns), line=number)
        for cell in cells:
            try:
                float(cell.replace("_", "?"))  # 1_000 is Python's, not a number
            except ValueError:
                what = (
                    f"{cell.strip()[:40]!r} is not a number" if cell.strip() else "a cell is empty"
                )
                raise LogError(path, what, line=number) from None
    raise LogError(path, "is not a table of numbers")


def _require(
    path: Path,
    values: Rows,
    good: npt.NDArray[np.bool_],
    numbers: Sequence[int],
    column: str | None,
) -> None:
    if good.all():
        return
    k = int(np.argmin(good))
    kind = "an integer" if column in _WHOLE else "a number"
    raise LogError(path, f"{values[k]:.10g} is not {kind}", line=numbers[k], column=column)
