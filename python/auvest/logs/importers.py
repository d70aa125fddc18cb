"""From published recordings to logs: one function per set, ``importer(source, output)``.

Each writes one or more log folders below ``output`` and returns their paths. Nothing is filtered
or corrected on the way, except where a function's docstring says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from auvest.logs.reader import LogError, Rows
from auvest.logs.write import write_file

Importer = Callable[[Path, Path], list[Path]]


def goats14(source: Path, output: Path) -> list[Path]:
    """AUV with acoustic beacons (GOATS 2002, set 14).

    The odometry's forward axis is +y; here it is turned to forward and left. Truth is the robust
    batch reference; the run starts there, with the heading of the INS.
    """
    odometry = _table(source / "odometry.csv", "t", "dx_body", "dy_body", "dtheta")
    ranges = _table(source / "ranges.csv", "t", "beacon", "range")
    beacons = _table(source / "beacons.csv", "beacon", "x", "y")
    reference = _table(source / "reference_batch.csv", "t", "x", "y")
    onboard = _table(source / "groundtruth.csv", "t", "theta")
    folder = output / "goats14"
    write_file(
        folder,
        "odometry.csv",
        time_s=odometry[:, 0],
        forward_m=odometry[:, 2],
        left_m=-odometry[:, 1],
        turn_rad=odometry[:, 3],
    )
    _write_ranges(folder, ranges)
    _write_beacons(folder, beacons)
    _write_truth(folder, reference)
    _write_start(folder, reference[0], float(onboard[0, 1]) + math.pi / 2)
    return [folder]


def hat_charles(source: Path, output: Path) -> list[Path]:
    """Dead-reckoning slave and one moving leader (Charles River, 2022).

    A message whose range and leader position both repeat those of the message before it is stale
    and left out (3 of 56).
    """
    odometry = _table(source / "odometry.csv", "t", "dx_body", "dy_body", "dtheta")
    messages = _table(
        source / "leader_ranges.csv", "t", "leader_x", "leader_y", "leader_pos_var", "range"
    )
    truth = _table(source / "groundtruth.csv", "t", "x", "y", "theta")
    fresh = np.append(True, (np.diff(messages[:, [1, 2, 4]], axis=0) != 0).any(axis=1))
    messages = messages[fresh]
    leader = np.ones(len(messages), int)
    folder = output / "hat_charles"
    write_file(
        folder,
        "odometry.csv",
        time_s=odometry[:, 0],
        forward_m=odometry[:, 1],
        left_m=odometry[:, 2],
        turn_rad=odometry[:, 3],
    )
    write_file(folder, "ranges.csv", time_s=messages[:, 0], source=leader, range_m=messages[:, 4])
    write_file(
        folder,
        "leaders.csv",
        time_s=messages[:, 0],
        source=leader,
        x_m=messages[:, 1],
        y_m=messages[:, 2],
        sigma_m=np.sqrt(messages[:, 3]),
    )
    _write_truth(folder, truth)
    return [folder]


def labyrinth_uwb(source: Path, output: Path) -> list[Path]:
    """Small robot and four UWB modules (TU Chemnitz)."""
    ranges = _table(source / "ranges.csv", "t", "module", "range", "module_x", "module_y")
    odometry = _table(source / "odometry.csv", "t", "v", "w")
    truth = _table(source / "groundtruth.csv", "t", "x", "y")
    heading = _table(source / "initial_heading.txt")
    folder = output / "labyrinth_uwb"
    _write_velocity(folder, odometry)
    _write_ranges(folder, ranges)
    _write_beacons(folder, np.unique(ranges[:, [1, 3, 4]], axis=0))
    _write_truth(folder, truth)
    _write_start(folder, truth[0], float(heading[0, 0]))
    return [folder]


def mrclam6(source: Path, output: Path) -> list[Path]:
    """Five ground robots; each in turn is the slave that ranges to the four others.

    Sightings in both directions are ranges of the slave, their bearings are left out. The others'
    positions, and the truth, are those of the motion capture.
    """
    sightings = _table(source / "sightings.csv", "t", "observer", "subject", "range")
    odometry = _table(source / "odometry.csv", "robot", "t", "v", "w")
    truth = _table(source / "groundtruth.csv", "robot", "t", "x", "y", "theta")
    robots = np.unique(truth[:, 0]).astype(int).tolist()
    return _write_robots(
        output,
        sightings,
        {robot: odometry[odometry[:, 0] == robot, 1:] for robot in robots},
        {robot: truth[truth[:, 0] == robot, 1:] for robot in robots},
    )


def mrclam(source: Path, output: Path) -> list[Path]:
    """Read the original text files of any UTIAS MR.CLAM set: Barcodes.dat, Robot1_Odometry.dat ...

    As :func:`mrclam6`, with all of the motion capture. Time is counted from the first second of it.
    """
    barcodes = {int(code): int(subject) for subject, code in _text(source / "Barcodes.dat", 2)}
    robots = range(1, 6)
    truth = {robot: _text(source / f"Robot{robot}_Groundtruth.dat", 4) for robot in robots}
    start = math.floor(min(track[0, 0] for track in truth.values()))
    odometry = {robot: _text(source / f"Robot{robot}_Odometry.dat", 3) for robot in robots}
    sightings = []
    for robot in robots:
        truth[robot][:, 0] -= start
        odometry[robot][:, 0] -= start
        seen = _text(source / f"Robot{robot}_Measurement.dat", 4)
        subject = np.array([barcodes.get(int(code), -1) for code in seen[:, 1]], float)
        observer = np.full(len(seen), float(robot))
        sightings.append(np.column_stack([seen[:, 0] - start, observer, subject, seen[:, 2]]))
    return _write_robots(output, np.concatenate(sightings), odometry, truth)


def ugps_pier59(source: Path, output: Path) -> list[Path]:
    """ROV tracked by a fixed antenna; the two recordings, polls without a fix left out."""
    folders = []
    for number in (1, 2):
        fixes = _table(source / f"fixes_{number}.csv", "t", "valid", "x_fwd", "y_stbd")
        fixes = fixes[fixes[:, 1] == 1]
        folder = output / f"ugps_pier59_{number}"
        write_file(
            folder,
            "fixes.csv",
            time_s=fixes[:, 0],
            source=np.zeros(len(fixes), int),
            range_m=np.hypot(fixes[:, 2], fixes[:, 3]),
            bearing_rad=np.arctan2(fixes[:, 3], fixes[:, 2]),
        )
        _write_beacons(folder, np.zeros((1, 3)))
        folders.append(folder)
    return folders


#: What ``auvest import`` knows.
IMPORTERS: Mapping[str, Importer] = {
    "goats14": goats14,
    "hat_charles": hat_charles,
    "labyrinth_uwb": labyrinth_uwb,
    "mrclam6": mrclam6,
    "mrclam": mrclam,
    "ugps_pier59": ugps_pier59,
}


def _write_robots(
    output: Path, sightings: Rows, odometry: Mapping[int, Rows], truth: Mapping[int, Rows]
) -> list[Path]:
    sightings = sightings[np.argsort(sightings[:, 0], kind="stable")]
    folders = []
    for robot in truth:
        others = [other for other in truth if other != robot]
        observer, subject = sightings[:, 1], sightings[:, 2]
        mine = (observer == robot) & np.isin(subject, others)
        mine |= (subject == robot) & np.isin(observer, others)
        other = np.where(observer == robot, subject, observer)
        folder = output / f"robot{robot}"
        _write_velocity(folder, odometry[robot])
        _write_ranges(folder, np.column_stack([sightings[:, 0], other, sightings[:, 3]])[mine])
        tracks = [np.insert(truth[leader], 1, leader, axis=1) for leader in others]
        leaders = np.concatenate(tracks)
        leaders = leaders[np.argsort(leaders[:, 0], kind="stable")]
        write_file(
            folder,
            "leaders.csv",
            time_s=leaders[:, 0],
            source=leaders[:, 1].astype(int),
            x_m=leaders[:, 2],
            y_m=leaders[:, 3],
        )
        _write_truth(folder, truth[robot])
        folders.append(folder)
    return folders


def _write_velocity(folder: Path, rows: Rows) -> None:
    write_file(
        folder, "odometry.csv", time_s=rows[:, 0], speed_m_s=rows[:, 1], yaw_rate_rad_s=rows[:, 2]
    )


def _write_ranges(folder: Path, rows: Rows) -> None:
    source = rows[:, 1].astype(int)
    write_file(folder, "ranges.csv", time_s=rows[:, 0], source=source, range_m=rows[:, 2])


def _write_beacons(folder: Path, rows: Rows) -> None:
    source = rows[:, 0].astype(int)
    write_file(folder, "beacons.csv", source=source, x_m=rows[:, 1], y_m=rows[:, 2])


def _write_truth(folder: Path, rows: Rows) -> None:
    heading = {"heading_rad": _wrapped(rows[:, 3])} if rows.shape[1] == 4 else {}
    write_file(folder, "truth.csv", time_s=rows[:, 0], x_m=rows[:, 1], y_m=rows[:, 2], **heading)


def _write_start(folder: Path, row: Rows, heading: float) -> None:
    write_file(
        folder,
        "start.csv",
        time_s=row[:1],
        x_m=row[1:2],
        y_m=row[2:3],
        heading_rad=_wrapped(np.array([heading])),
    )


def _wrapped(angle: Rows) -> Rows:
    return np.angle(np.exp(1j * angle))


def _table(path: Path, *names: str) -> Rows:
    """Columns of a CSV file by name; without names all of a file that has no header."""
    try:
        with path.open(encoding="utf-8") as file:
            header = file.readline().strip().split(",") if names else []
            missing = [name for name in names if name not in header]
            if missing:
                raise LogError(path, f"has no column {missing[0]}: is this the set named?", line=1)
            rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        if isinstance(error, LogError):
            raise
        raise LogError(path, f"is not a table of numbers: {error}") from None
    return rows[:, [header.index(name) for name in names]] if names else rows


def _text(path: Path, columns: int) -> Rows:
    """Columns of one of the UTIAS files: white space between numbers, comments after ``#``."""
    try:
        rows: Rows = np.loadtxt(path, comments="#", ndmin=2)
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        raise LogError(path, f"is not a table of numbers: {error}") from None
    if rows.shape[1] != columns or len(rows) == 0:
        raise LogError(path, f"must have rows of {columns} numbers, not {rows.shape}")
    return rows
