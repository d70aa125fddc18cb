"""Real robots: the cutting of tracks and the judgement on a made-up recording, and the page."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from typer.testing import CliRunner

from auvest.cli import app
from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import find_settings, replay
from auvest.replay.slat import first_seen
from auvest.reproduce.mrclam6 import measure as mrclam6
from auvest.reproduce.mrclam6.page import page_of

PAGE = ROOT / "docs" / "reproduction" / "mrclam6"
DATA = os.environ.get("AUVEST_DATA")
needs_data = pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)


@pytest.fixture
def folder(tmp_path):
    """Robot 1 drives along x at 0.1 m/s and sees robot 2, which stands at (5, 3)."""
    files = tmp_path / "mrclam6"
    files.mkdir()
    times = np.arange(0, 100.05, 0.1)
    with (files / "groundtruth.csv").open("w") as file:
        file.write("t,robot,x,y,theta\n")
        for t in times:
            file.write(f"{t:.4f},1,{0.1 * t:.6f},0,0\n")
            if not 60 < t < 61:  # no truth for a second
                file.write(f"{t:.4f},2,5,3,0\n")
            for robot in (3, 4, 5):  # they stand, too
                file.write(f"{t:.4f},{robot},9,9,0\n")
    speed = 0.1 / mrclam6.CALIBRATION[0][0]
    turn = -mrclam6.CALIBRATION[1][1] / mrclam6.CALIBRATION[1][0]
    with (files / "odometry.csv").open("w") as file:
        file.write("t,robot,v,w\n")
        for robot in range(1, 6):
            file.write(f"0,{robot},{speed if robot == 1 else 0:.9f},{turn:.9f}\n")
    with (files / "sightings.csv").open("w") as file:
        file.write("t,observer,subject,range,bearing\n")
        # 20 s, a gap of 7 s, 10 s (too short), a gap, 40 s of which the truth leaves out a second.
        for begin, end in ((1, 21), (28, 38), (45, 85)):
            for t in np.arange(begin, end + 0.1, 0.5):
                dx = 5 - 0.1 * t
                file.write(f"{t:.4f},1,2,{math.hypot(dx, 3):.6f},{math.atan2(3, dx):.6f}\n")
                file.write(f"{t:.4f},1,-1,9,1\n")  # an unknown barcode
    return tmp_path


def test_tracks_are_cut_at_gaps(folder):
    tracks = mrclam6.Recording(folder).tracks()
    assert [(t.slave, t.master, t.time_s[0], t.time_s[-1]) for t in tracks] == [
        (1, 2, 1, 21),
        (1, 2, 45, 85),
    ]
    track = tracks[0]
    assert len(track.time_s) == 201  # steps of 0.1 s
    assert len(track.z) == 40
    np.testing.assert_allclose(track.u, [[0.1, 0]] * 200, atol=1e-8)
    np.testing.assert_allclose(track.slave_truth[:, 0], 0.1 * track.time_s, atol=1e-6)
    np.testing.assert_allclose(track.master_truth, [[5, 3]] * 201)
    # Sightings while there is no truth of the master are left out.
    assert not ((tracks[1].z_time_s > 60.05) & (tracks[1].z_time_s < 60.95)).any()


def test_filters_follow_without_noise(folder):
    track = mrclam6.Recording(folder).tracks()[0]
    # With readings and sightings that are exact, errors lie below what their noise would give.
    drift_m = mrclam6.SPEED_DENSITY * math.sqrt(track.time_s[-1] - track.time_s[0])
    for name in mrclam6.NAMES:
        figures = mrclam6.compare([track], [mrclam6.follow(track, name)])
        if name == "dead_reckoning":
            assert figures.slave_m < 1e-5
        else:
            assert figures.slave_m < drift_m
            assert figures.relative_m < mrclam6.SONAR.sigma_range_m


def test_first_sighting_is_a_place_with_the_covariance_of_range_and_bearing():
    sonar = mrclam6.SONAR
    seen = np.array([4.0, math.pi / 2])
    speeds = {"velocity_m_s": 0.5, "acceleration_m_s2": 0.1}
    x, p = first_seen(np.array([1.0, 2.0, math.pi / 2]), np.zeros((3, 3)), seen, sonar, **speeds)
    np.testing.assert_allclose(x, [-3, 2, 0, 0, 0, 0], atol=1e-12)
    expected = np.diag([sonar.sigma_range_m, 4 * sonar.sigma_bearing_rad, 0.5, 0.5, 0.1, 0.1]) ** 2
    np.testing.assert_allclose(p, expected, atol=1e-15)
    # What is not known of the slave is not known of the master: the heading's is across the ray.
    of_slave = np.diag([0.3, 0.4, 0.05]) ** 2
    _, p = first_seen(np.array([1.0, 2.0, math.pi / 2]), of_slave, seen, sonar, **speeds)
    more = np.diag([0.3, 0.4]) ** 2 + np.diag([0, 0.2]) ** 2
    np.testing.assert_allclose(p[:2, :2], expected[:2, :2] + more, atol=1e-15)
    # With a compass the bearing counts from the x axis, in the paper from the master.
    for bearing, turned in (("slave_to_master", 0.0), ("master_to_slave", math.pi)):
        compass = replace(sonar, bearing=bearing)
        aim = np.array([4.0, math.pi / 2 - turned])
        x, _ = first_seen(np.array([1.0, 2.0]), np.zeros((2, 2)), aim, compass, **speeds)
        np.testing.assert_allclose(x[:2], [1, 6], atol=1e-12)


def replayed(logs, name):
    """Give the figures of the replays of all tracks, as compare has them."""
    settings = find_settings("mrclam6_tracks")
    runs = [replay(LogFolder(log), settings, filter_name=name).numbers for log in logs]
    steps = sum(run["truth"] for run in runs)
    masters = [master for run in runs for master in run["masters"].values()]
    slave = sum(run["truth"] * run["rmse_m"] ** 2 for run in runs)
    relative = sum(one["estimates"] * one["relative_rmse_m"] ** 2 for one in masters)
    return math.sqrt(slave / steps), math.sqrt(relative / steps)


@pytest.mark.parametrize("name", ["ekf_slat", "slatf2"])
def test_logs_of_the_tracks_are_replayed_to_the_same_figures(folder, tmp_path, name):
    tracks = mrclam6.Recording(folder).tracks()
    logs = IMPORTERS["mrclam6_tracks"](folder / "mrclam6", tmp_path / "logs")
    assert [log.name for log in logs] == ["robot1_sees_robot2_1", "robot1_sees_robot2_2"]
    found = mrclam6.compare(tracks, [mrclam6.follow(track, name) for track in tracks])
    slave, relative = replayed(logs, name.replace("_", "-"))
    # Readings are added up from another line on: the last digits differ.
    assert slave == pytest.approx(found.slave_m, rel=1e-7)
    assert relative == pytest.approx(found.relative_m, rel=1e-7)


def test_rmse_by_hand():
    time_s = np.array([0.0, 1.0, 2.0])
    none = np.zeros((0, 2))
    tracks = [
        mrclam6.Track(
            1, 2, time_s, np.zeros((2, 2)), none[:, 0], none, np.zeros(2),
            np.zeros((3, 3)), np.zeros((3, 2)),
        )
    ] * 2  # fmt: skip
    off = mrclam6.Path2D(slave=np.full((2, 2), 3.0), master=np.full((2, 2), 4.0))
    on = mrclam6.Path2D(slave=np.zeros((2, 2)), master=np.zeros((2, 2)))
    figures = mrclam6.compare(tracks, [off, on])
    assert figures.slave_m == pytest.approx(3)  # sqrt((18 + 0) / 2)
    assert figures.relative_m == pytest.approx(1)
    assert figures.slave_tracks_m == pytest.approx(math.sqrt(18) / 2)
    assert figures.relative_tracks_m == pytest.approx(math.sqrt(2) / 2)


def figures(slave_m, relative_m):
    """RMSE of a run; those of the tracks are half of it."""
    return mrclam6.Figures(slave_m, relative_m, slave_m / 2, relative_m / 2)


def track(seconds, sightings):
    none = np.zeros((sightings - 1, 2))
    return mrclam6.Track(
        1, 2, np.array([5.0, 5.0 + seconds]), np.zeros((1, 2)), none[:, 0], none, np.zeros(2),
        np.zeros((2, 3)), np.zeros((2, 2)),
    )  # fmt: skip


def judged(ekf_slat, slatf2):
    """Dead reckoning has 2 m; the filter of one model is not asked anything."""
    runs = {
        "dead_reckoning": [figures(2.0, math.nan)],
        "ekf_slat_one_model": [figures(9.0, 9.0)],
        "ekf_slat": [figures(*one) for one in ekf_slat],
        "slatf2": [figures(*one) for one in slatf2],
    }
    tracks = [track(10.0, 4), track(2.5, 3)]
    return mrclam6.summary(mrclam6.Reproduction(3, tracks, runs, {}, (0.25, 0.5)))


def test_summary_by_hand():
    result = judged([(2.1, 0.36)], [(1.0, 0.3), (2.2, 0.2), (1.6, 0.4), (2.0, 0.3)])
    assert (result["tracks"], result["seconds"], result["sightings"]) == (2, 12.5, 7)
    assert (result["drift_speed_density"], result["drift_yaw_rate_density"]) == (0.25, 0.5)
    *_, ekf, row = result["filters"]
    # Limits: 1.05 times 2 m and 0.36 m; what is just as good is within them.
    assert ekf["runs_within_targets"] == 1
    assert row["runs"] == 4
    assert row["slave_rmse_m"] == pytest.approx(1.7)
    assert (row["ratio"], row["ratio_worst"]) == pytest.approx((0.85, 1.1))
    assert (row["relative_rmse_m"], row["relative_rmse_worst_m"]) == pytest.approx((0.3, 0.4))
    assert row["runs_within_targets"] == 2  # the second is off in the slave, the third in the pair
    assert row["ratio_of_track_means"] == pytest.approx(0.85)
    assert row["relative_track_mean_m"] == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("ekf_slat", "slatf2", "met"),
    [
        ([(2.1, 0.36)], [(2.0, 0.3)], True),
        ([(2.2, 0.3)], [(2.0, 0.3)], False),
        ([(2.0, 0.37)], [(2.0, 0.3)], False),
        ([(2.0, 0.3)], [(2.2, 0.3)], False),
        ([(2.0, 0.3)], [(2.0, 0.37)], False),
        ([(2.0, 0.3)], [(1.9, 0.3), (2.2, 0.4)], True),  # their means are 2.05 and 0.35
    ],
)
def test_both_filters_must_meet_both_targets(ekf_slat, slatf2, met):
    assert judged(ekf_slat, slatf2)["met"] is met


def test_command_on_a_made_up_recording(folder, tmp_path):
    arguments = ["reproduce", "mrclam6", "--data", str(folder), "--runs", "1", "--json", "--quiet"]
    output = tmp_path / "out"
    done = CliRunner().invoke(app, [*arguments, "--output", str(output)])
    assert done.exit_code == 0, done.output
    results = json.loads(done.stdout)
    assert results["tracks"] == 2
    assert [row["filter"] for row in results["filters"]] == list(mrclam6.NAMES)
    assert (output / "tracks.png").stat().st_size > 10_000
    assert (output / "README.md").read_text() == page_of(results)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [([], "Missing option '--data'"), (["--data", "nowhere"], "groundtruth.csv is missing")],
)
def test_missing_data_is_said(arguments, says, tmp_path, monkeypatch):
    monkeypatch.delenv("AUVEST_DATA", raising=False)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["reproduce", "mrclam6", *arguments])
    assert done.exit_code == 2
    assert says in " ".join(done.stderr.split())
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def committed():
    return json.loads((PAGE / "results.json").read_text())


def test_committed_page_is_that_of_the_committed_results(committed):
    assert page_of(committed) == (PAGE / "README.md").read_text()


def test_committed_results_meet_the_targets(committed):
    assert committed["tracks"] == 47
    assert committed["met"] is True


@needs_data
def test_committed_results_are_what_the_code_gives(committed):
    recording = mrclam6.Recording(Path(DATA))
    tracks = recording.tracks()
    assert len(tracks) == committed["tracks"]
    rows = {row["filter"]: row for row in committed["filters"]}
    for name in ("dead_reckoning", "ekf_slat"):
        found = mrclam6.compare(tracks, [mrclam6.follow(track, name) for track in tracks])
        assert found.slave_m == pytest.approx(rows[name]["slave_rmse_m"], rel=1e-6)
        if name == "ekf_slat":
            assert found.relative_m == pytest.approx(rows[name]["relative_rmse_m"], rel=1e-6)


@needs_data
@pytest.mark.parametrize("name", ["ekf_slat", "slatf2"])
def test_replay_of_the_real_tracks_gives_the_same_figures(tmp_path, name):
    logs = IMPORTERS["mrclam6_tracks"](Path(DATA) / "mrclam6", tmp_path)
    tracks = mrclam6.Recording(Path(DATA)).tracks()
    assert len(logs) == len(tracks) == 47
    found = mrclam6.compare(tracks, [mrclam6.follow(track, name) for track in tracks])
    slave, relative = replayed(logs, name.replace("_", "-"))
    assert slave == pytest.approx(found.slave_m, rel=1e-7)
    assert relative == pytest.approx(found.relative_m, rel=1e-7)
