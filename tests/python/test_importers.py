"""Importers: made-up recordings in the format of each set, and the log by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest.cli import app
from auvest.importers.sets import IMPORTERS, layout_of
from auvest.logs import LogError, LogFolder


def recording(folder: Path, files: dict[str, str]) -> Path:
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def imported(folder: Path, name: str, files: dict[str, str]) -> dict[str, LogFolder]:
    folders = IMPORTERS[name](recording(folder / name, files), folder / "logs")
    return {path.name: LogFolder(path) for path in folders}


def whole(log: LogFolder, name: str) -> list[list[float]]:
    rows: list[list[float]] = log[name].whole().tolist()
    return rows


def goats(heading: float) -> dict[str, str]:
    """Half a metre along the vehicle's +y, its forward axis, and a quarter to its +x, starboard."""
    return {
        "odometry.csv": "t,dx_body,dy_body,dtheta\n1.0,0.25,0.5,0.125\n2.0,-0.75,1.5,-0.5\n",
        "ranges.csv": "t,beacon,range\n1.5,3,40.5\n",
        "beacons.csv": "beacon,x,y\n3,10.0,-20.0\n",
        "reference_batch.csv": "t,x,y\n0.5,7.0,8.0\n1.5,7.5,9.0\n",
        "groundtruth.csv": f"t,theta\n0.5,{heading}\n1.5,9.0\n",
    }


HAT = {
    "odometry.csv": "t,dx_body,dy_body,dtheta\n1.0,0.5,-0.25,0.125\n",
    "leader_ranges.csv": (
        "t,leader_x,leader_y,leader_pos_var,range\n"
        "1.0,10.0,20.0,4.0,30.0\n"
        "2.0,10.0,20.0,9.0,30.0\n"  # stale, whatever its variance
        "3.0,10.0,20.0,2.25,31.0\n"
        "4.0,10.0,21.0,0.0,31.0\n"
        "5.0,11.0,21.0,0.25,31.0\n"
    ),
    "groundtruth.csv": "t,x,y,theta\n0.0,1.0,2.0,0.5\n",
}

LABYRINTH = {
    "ranges.csv": (
        "t,module,range,module_x,module_y\n"
        "1.0,2,5.0,10.0,0.0\n1.5,1,6.0,0.0,10.0\n2.0,2,5.5,10.0,0.0\n"
    ),
    "odometry.csv": "t,v,w\n0.5,0.25,-0.125\n",
    "groundtruth.csv": "t,x,y\n0.75,3.0,4.0\n1.75,3.5,4.5\n",
    "initial_heading.txt": "0.5\n",
}


def test_goats14_turns_the_body_to_forward_and_left(tmp_path: Path) -> None:
    log = imported(tmp_path, "goats14", goats(0.25))["goats14"]
    # time, forward = dy_body, left = -dx_body, turn
    assert whole(log, "odometry.csv") == [[1.0, 0.5, -0.25, 0.125], [2.0, 1.5, 0.75, -0.5]]
    assert whole(log, "ranges.csv") == [[1.5, 3, 40.5]]
    assert log.beacons() == {3: (10.0, -20.0)}
    assert whole(log, "truth.csv") == [[0.5, 7.0, 8.0], [1.5, 7.5, 9.0]]


@pytest.mark.parametrize(
    ("of_x_axis", "forward"),
    [
        (0.25, 0.25 + math.pi / 2),
        (2.0, 2.0 + math.pi / 2 - 2 * math.pi),  # wrapped
        (-math.pi, -math.pi / 2),
    ],
)
def test_goats14_starts_with_the_heading_of_the_forward_axis(
    tmp_path: Path, of_x_axis: float, forward: float
) -> None:
    """The INS tells the direction of the body's +x; +y, forward, stands a quarter turn left."""
    log = imported(tmp_path, "goats14", goats(of_x_axis))["goats14"]
    (start,) = whole(log, "start.csv")
    assert start[:3] == [0.5, 7.0, 8.0]  # the first of the reference
    assert start[3] == pytest.approx(forward, abs=1e-12)


def test_hat_charles_tells_sigma_and_leaves_out_what_is_stale(tmp_path: Path) -> None:
    """A variance of 4 m^2 is 2 m. A message is stale if range and both coordinates repeat."""
    log = imported(tmp_path, "hat_charles", HAT)["hat_charles"]
    assert whole(log, "odometry.csv") == [[1.0, 0.5, -0.25, 0.125]]
    assert whole(log, "ranges.csv") == [[1, 1, 30], [3, 1, 31], [4, 1, 31], [5, 1, 31]]
    assert whole(log, "leaders.csv") == [
        [1, 1, 10, 20, 2.0],
        [3, 1, 10, 20, 1.5],
        [4, 1, 10, 21, 0.0],
        [5, 1, 11, 21, 0.5],
    ]
    np.testing.assert_allclose(whole(log, "truth.csv"), [[0.0, 1.0, 2.0, 0.5]], rtol=1e-15)


def test_labyrinth_uwb_starts_at_the_truth_and_names_each_module_once(tmp_path: Path) -> None:
    log = imported(tmp_path, "labyrinth_uwb", LABYRINTH)["labyrinth_uwb"]
    assert whole(log, "odometry.csv") == [[0.5, 0.25, -0.125]]
    assert whole(log, "ranges.csv") == [[1.0, 2, 5.0], [1.5, 1, 6.0], [2.0, 2, 5.5]]
    assert whole(log, "beacons.csv") == [[1, 0.0, 10.0], [2, 10.0, 0.0]]
    np.testing.assert_allclose(whole(log, "start.csv"), [[0.75, 3.0, 4.0, 0.5]], rtol=1e-15)


def test_mrclam6_makes_each_robot_the_slave_of_the_others(tmp_path: Path) -> None:
    """Who sees is as good as who is seen; what sees itself, or is no robot, is left out."""
    files = {
        "sightings.csv": (
            "t,observer,subject,range\n"
            "3.0,1,2,5.0\n1.0,2,1,6.0\n2.0,1,7,9.0\n2.5,3,1,7.0\n2.75,1,1,0.5\n"
        ),
        "odometry.csv": "robot,t,v,w\n1,0.5,0.25,0.125\n2,0.5,0.75,0.0\n3,0.5,0.0,0.0\n",
        "groundtruth.csv": (
            "robot,t,x,y,theta\n1,0.0,1.0,1.5,0.25\n2,0.0,2.0,2.5,0.5\n2,1.0,2.0,3.5,0.5\n"
            "3,0.5,3.0,3.5,0.0\n"
        ),
    }
    logs = imported(tmp_path, "mrclam6", files)
    assert list(logs) == ["robot1", "robot2", "robot3"]
    # In the order of time: robot 2 sees robot 1, robot 3 sees robot 1, robot 1 sees robot 2.
    assert whole(logs["robot1"], "ranges.csv") == [[1.0, 2, 6.0], [2.5, 3, 7.0], [3.0, 2, 5.0]]
    assert whole(logs["robot2"], "ranges.csv") == [[1.0, 1, 6.0], [3.0, 1, 5.0]]
    assert whole(logs["robot3"], "ranges.csv") == [[2.5, 1, 7.0]]
    assert whole(logs["robot1"], "leaders.csv") == [
        [0.0, 2, 2.0, 2.5],
        [0.5, 3, 3.0, 3.5],
        [1.0, 2, 2.0, 3.5],
    ]
    assert whole(logs["robot1"], "odometry.csv") == [[0.5, 0.25, 0.125]]
    np.testing.assert_allclose(whole(logs["robot1"], "truth.csv"), [[0, 1, 1.5, 0.25]], rtol=1e-15)


def test_mrclam6_with_one_robot_is_refused_by_its_file(tmp_path: Path) -> None:
    files = {
        "sightings.csv": "t,observer,subject,range\n3.0,1,2,5.0\n",
        "odometry.csv": "robot,t,v,w\n1,0.5,0.25,0.125\n",
        "groundtruth.csv": "robot,t,x,y,theta\n1,0.0,1.0,1.5,0.25\n",
    }
    with pytest.raises(LogError, match=r"groundtruth\.csv: one robot alone"):
        imported(tmp_path, "mrclam6", files)


def test_mrclam_counts_time_from_the_first_whole_second(tmp_path: Path) -> None:
    """All of a robot's files have one clock; a barcode that no robot wears is left out."""
    files = {"Barcodes.dat": "# subject barcode\n1 5\n2 14\n3 41\n4 32\n5 23\n6 72\n"}
    for robot in range(1, 6):
        files[f"Robot{robot}_Groundtruth.dat"] = f"100.{robot} {robot}.0 1.0 0.5\n"
        files[f"Robot{robot}_Odometry.dat"] = f"101.5 0.25 0.0{robot}\n"
        files[f"Robot{robot}_Measurement.dat"] = "101.0 99 7.0 0.0\n102.0 72 8.0 0.0\n"
    files["Robot1_Measurement.dat"] += "# time barcode range bearing\n103.25 14 5.0 0.1\n"
    logs = imported(tmp_path, "mrclam", files)
    assert list(logs) == [f"robot{robot}" for robot in range(1, 6)]
    for robot, log in enumerate(logs.values(), start=1):
        np.testing.assert_allclose(whole(log, "odometry.csv"), [[1.5, 0.25, robot / 100]])
        truth = [[robot / 10, robot, 1.0, 0.5]]
        np.testing.assert_allclose(whole(log, "truth.csv"), truth, atol=1e-12)
    assert whole(logs["robot1"], "ranges.csv") == [[3.25, 2, 5.0]]
    assert whole(logs["robot2"], "ranges.csv") == [[3.25, 1, 5.0]]
    assert whole(logs["robot3"], "ranges.csv") == []


def test_ugps_pier59_leaves_out_polls_without_a_fix(tmp_path: Path) -> None:
    """Forward is +x and starboard +y: a fix 3 m ahead and 4 m to port is 5 m off."""
    text = "t,valid,x_fwd,y_stbd\n0.0,1,3.0,-4.0\n0.5,0,3.0,4.0\n1.0,1,0.0,2.0\n"
    logs = imported(tmp_path, "ugps_pier59", {"fixes_1.csv": text, "fixes_2.csv": text})
    assert list(logs) == ["ugps_pier59_1", "ugps_pier59_2"]
    for log in logs.values():
        np.testing.assert_allclose(
            whole(log, "fixes.csv"),
            [[0.0, 0, 5.0, -math.acos(0.6)], [1.0, 0, 2.0, math.pi / 2]],
            rtol=1e-15,
        )
        assert log.beacons() == {0: (0.0, 0.0)}
    (tmp_path / "ugps_pier59" / "fixes_3.csv").write_text(text)
    folders = IMPORTERS["ugps_pier59"](tmp_path / "ugps_pier59", tmp_path / "more")
    assert [folder.name for folder in folders] == [f"ugps_pier59_{k}" for k in (1, 2, 3)]


@pytest.mark.parametrize(
    ("layout", "files", "without"),
    [
        ("goats14", goats(0.25), ["reference_batch.csv", "groundtruth.csv"]),
        ("hat_charles", HAT, ["groundtruth.csv"]),
        ("labyrinth_uwb", LABYRINTH, ["groundtruth.csv"]),
    ],
)
def test_a_log_is_named_by_its_folder_and_a_missing_truth_is_said(
    tmp_path: Path, layout: str, files: dict[str, str], without: list[str]
) -> None:
    source = recording(tmp_path / "set_15", {k: v for k, v in files.items() if k not in without})
    assert layout_of(source) == layout
    notes: list[str] = []
    (folder,) = IMPORTERS[layout](source, tmp_path / "logs", note=notes.append)
    assert folder.name == "set_15"
    assert not (folder / "truth.csv").exists()
    assert notes == [
        "set_15 has no truth: nothing can be scored against it",
        "set_15 has neither start.csv nor truth.csv: a replay cannot start",
    ]
    (source / "odometry.csv").unlink()
    with pytest.raises(
        LogError, match=r"odometry\.csv: cannot be read: .*; without odometry no log"
    ):
        IMPORTERS[layout](source, tmp_path / "more")


def test_the_command_finds_a_layout_by_its_files(tmp_path: Path) -> None:
    source = recording(tmp_path / "trial", goats(0.25))
    result = CliRunner().invoke(app, ["import", str(source), str(tmp_path / "logs")])
    assert result.exit_code == 0, result.output
    assert LogFolder(tmp_path / "logs" / "trial").beacons() == {3: (10.0, -20.0)}


# ---- What is refused -----------------------------------------------------------------------------


def test_a_recording_is_never_written_into(tmp_path: Path) -> None:
    """Where the log would take the place of its source, or stand in it, or hold it."""
    source = tmp_path / "data" / "goats14"
    source.mkdir(parents=True)
    for name, text in goats(0.25).items():
        (source / name).write_text(text)
    before = {path.name: path.read_bytes() for path in source.iterdir()}
    for output in (tmp_path / "data", source, source / "logs"):
        with pytest.raises(ValueError, match="in or above its source"):
            IMPORTERS["goats14"](source, output, force=True)
    assert {path.name: path.read_bytes() for path in source.iterdir()} == before
    assert [path.name for path in (tmp_path / "data").iterdir()] == ["goats14"]


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("odometry.csv", "-0.5", "nan", r"odometry.csv, line 3, column dtheta: nan is not a n"),
        ("ranges.csv", "3,40.5", "3.5,40.5", r"ranges.csv, line 2, column beacon: 3.5 is not an i"),
        ("ranges.csv", "3,40.5", "1e30,40.5", r"ranges.csv, line 2, column beacon: 1e\+30 is not "),
        (
            "ranges.csv",
            "3,40.5",
            "3,-1",
            r"ranges.csv, row 0, column range_m: -1 lies outside 0\.\.1",
        ),
        ("ranges.csv", "3,40.5", "3,4_0", r"ranges.csv, line 2: '4_0' is not a number"),
        ("ranges.csv", "3,40.5", "3,40.5#", r"ranges.csv, line 2: '40.5#' is not a number"),
        ("ranges.csv", "1.5,3,40.5\n", "", r"ranges.csv: has no rows"),
        ("ranges.csv", "3,40.5\n", "3,40.5", r"ranges.csv, line 2: does not end with a line end"),
        ("ranges.csv", "3,40.5", "3", r"ranges.csv, line 2: 2 cells, expected 3: truncated\?$"),
    ],
)
def test_what_no_log_can_hold_is_refused_and_leaves_nothing(
    tmp_path: Path, file: str, old: str, new: str, message: str
) -> None:
    files = goats(0.25)
    assert old in files[file]
    files[file] = files[file].replace(old, new, 1)
    with pytest.raises(LogError, match=message):
        imported(tmp_path, "goats14", files)
    assert [path.name for path in tmp_path.iterdir()] == ["goats14"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("20.0,9.0,", "20.0,-9.0,", ", line 3, column leader_pos_var: a variance of -9"),
        ("20.0,9.0,", "20.0,,", ", line 3: a cell is empty"),
    ],
)
def test_a_variance_is_a_number_and_not_below_0(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    files = {**HAT, "leader_ranges.csv": HAT["leader_ranges.csv"].replace(old, new)}
    with pytest.raises(LogError) as refused:
        imported(tmp_path, "hat_charles", files)
    assert str(refused.value) == f"{tmp_path / 'hat_charles' / 'leader_ranges.csv'}{message}"
    assert [path.name for path in tmp_path.iterdir()] == ["hat_charles"]


def test_tables_may_begin_with_a_mark(tmp_path: Path) -> None:
    files = {name: "\ufeff" + text for name, text in goats(0.25).items()}
    log = imported(tmp_path, "goats14", files)["goats14"]
    assert log.beacons() == {3: (10.0, -20.0)}
