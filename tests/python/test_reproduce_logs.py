"""Real recordings: the targets, and what the page and the command say."""

from __future__ import annotations

import functools
import io
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kept import Kept
from rich.console import Console
from typer.testing import CliRunner

from auvest.cli import app
from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import find_settings, replay, settings_from
from auvest.reproduce.logs import command, page
from auvest.reproduce.logs import measure as logs

DATA = os.environ.get("AUVEST_DATA")
needs_data = pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)


@pytest.fixture(scope="module")
def result() -> logs.Reproduction:
    assert DATA is not None
    return logs.measure(data=Path(DATA))


@needs_data
@pytest.mark.parametrize(
    ("name", "rmse_m"),
    [("goats14", 1.10), ("hat_charles", 4.0), ("mrclam6", 0.43), ("labyrinth_uwb", 0.15)],
)
def test_one_kernel_for_all_sets(result: logs.Reproduction, name: str, rmse_m: float) -> None:
    assert logs.TARGETS[name].rmse_m == rmse_m
    assert result.row(name, "robust-ekf", "hampel").rmse_m <= rmse_m
    assert result.held()[name]


@needs_data
def test_the_plain_ekf_is_that_of_an_independent_one(result: logs.Reproduction) -> None:
    """Its readings of start, stale messages and steps differ a little: within 4 %."""
    ours = {name: result.row(name, "ekf").rmse_m for name in logs.TARGETS}
    ours["mrclam6"] = result.baseline_walk_rmse_m["ekf"]  # with its noise of the heading
    for name, target in logs.TARGETS.items():
        assert ours[name] == pytest.approx(target.reference_ekf_m, rel=0.04), name


@needs_data
@pytest.mark.parametrize("filter_name", ["ukf", "aukf"])
@pytest.mark.parametrize(("every_s", "rmse_m"), [(2.0, 0.36), (5.0, 0.66), (10.0, 1.3)])
def test_tracking_past_the_antenna(
    result: logs.Reproduction, filter_name: str, every_s: float, rmse_m: float
) -> None:
    (row,) = [
        row
        for row in result.tracking
        if (row.log, row.filter_name, row.every_s) == ("ugps_pier59_1", filter_name, every_s)
        and row.near_field > 0
    ]
    assert row.held_out_rmse_m <= rmse_m


@needs_data
def test_without_the_near_field_the_tracker_fails(result: logs.Reproduction) -> None:
    worst = max(row.held_out_rmse_m for row in result.tracking if row.near_field == 0)
    assert worst > 10


@needs_data
def test_hold_last_fix_is_as_measured_elsewhere(tmp_path: Path) -> None:
    """The scoring: a tracker that believes in standing still is 'hold last fix', 1.07 m at 5 s."""
    assert DATA is not None
    log = IMPORTERS["ugps_pier59"](Path(DATA) / "ugps_pier59", tmp_path)[0]
    settings = find_settings("ugps_pier59")
    still = replace(
        settings,
        start=replace(settings.start, sigma_speed_m_s=1e-6, sigma_acceleration_m_s2=1e-6),
        process=replace(settings.process, position_psd=1e6, velocity_psd=0.0, acceleration_psd=0.0),
    )
    for every_s, rmse_m in ((5.0, 1.07), (10.0, 2.08)):
        chosen = replace(still, fixes=replace(still.fixes, every_s=every_s))
        numbers = replay(LogFolder(log), chosen, filter_name="ukf").numbers
        assert numbers["held_out_rmse_m"] == pytest.approx(rmse_m, abs=0.006)


@needs_data
def test_settings_from_the_record_alone(result: logs.Reproduction) -> None:
    best = max(result.compass, key=lambda row: row.log_likelihood)
    chosen = find_settings("hat_charles")
    assert best.sigma_heading_rad == chosen.start.sigma_heading_rad
    assert best.sigma_turn == chosen.odometry.sigma_turn
    walk = find_settings("mrclam6").odometry.sigma_turn
    assert min(result.heading_walk.values()) * 1.5 > walk > max(result.heading_walk.values()) / 1.5


@needs_data
def test_command_and_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, result: logs.Reproduction
) -> None:
    monkeypatch.setattr(logs, "measure", functools.wraps(logs.measure)(lambda **_: result))
    done = CliRunner().invoke(
        app, ["reproduce", "logs", "--data", str(DATA), "--output", str(tmp_path), "--json"]
    )
    assert done.exit_code == 0, done.output
    document: dict[str, Any] = json.loads(done.stdout)
    assert document == json.loads((tmp_path / "results.json").read_text())
    assert all(document["held"].values())
    assert len(document["held"]) == 10
    page = (tmp_path / "README.md").read_text()
    for row in document["rows"]:
        assert f"{row['rmse_m']:.3f}" in page
    # The page in the repository is this one.
    kept = Path(__file__).parents[2] / "docs" / "reproduction" / "logs" / "README.md"
    assert kept.read_text() == page


def test_without_the_data_the_command_says_which_file_is_missing(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["reproduce", "logs", "--data", str(tmp_path), "--output", str(tmp_path / "out")]
    )
    assert done.exit_code == 2
    words = "".join(done.stderr.split())
    assert "goats14" in words
    assert "cannotberead" in words


def test_heading_walk_of_a_known_walk(tmp_path: Path) -> None:
    from auvest.logs.write import write_file

    random = np.random.default_rng(2)
    time_s = 0.1 * np.arange(40_001)
    heading = np.cumsum(np.append(0.0, 0.05 * np.sqrt(0.1) * random.standard_normal(40_000)))
    write_file(tmp_path, "odometry.csv", time_s=time_s[::10], speed_m_s=0 * time_s[::10],
               yaw_rate_rad_s=0 * time_s[::10])  # fmt: skip
    wrapped = np.angle(np.exp(1j * heading))
    write_file(tmp_path, "truth.csv", time_s=time_s, x_m=0 * time_s, y_m=0 * time_s,
               heading_rad=wrapped)  # fmt: skip
    write_file(tmp_path, "ranges.csv", time_s=[1.0], source=[0], range_m=[1.0])
    write_file(tmp_path, "beacons.csv", source=[0], x_m=[0.0], y_m=[0.0])
    found = logs.heading_walk([LogFolder(tmp_path)], find_settings("goats14"))
    assert found[5.0] == pytest.approx(0.05, rel=0.1)  # 800 windows: 1.2 / sqrt(800) = 4 %


# ---- Without the recordings ----------------------------------------------------------------------


def table(path: Path, header: str, rows: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = (",".join(f"{cell:.12g}" for cell in row) for row in rows)
    path.write_text("\n".join([header, *lines]) + "\n")


def made_up_recordings(data: Path) -> Path:
    """All sets, without noise: craft that go along +x, and what they measure on the way."""
    t = np.arange(1.0, 41.0)
    places = {3: (20.0, 30.0), 4: (40.0, -30.0)}
    sources = [3 + k % 2 for k in range(40)]
    ranges = [
        float(np.hypot(k - places[s][0], places[s][1])) for k, s in zip(t, sources, strict=True)
    ]
    goats, hat, uwb = data / "goats14", data / "hat_charles", data / "labyrinth_uwb"
    table(goats / "odometry.csv", "t,dx_body,dy_body,dtheta", [(k, 0, 1, 0) for k in t])
    table(goats / "ranges.csv", "t,beacon,range", zip(t, sources, ranges, strict=True))
    table(goats / "beacons.csv", "beacon,x,y", [(s, *xy) for s, xy in places.items()])
    track = [(k, k, 0) for k in range(41)]
    table(goats / "reference_batch.csv", "t,x,y", track)
    table(goats / "groundtruth.csv", "t,theta", [(0, -np.pi / 2)])
    table(hat / "odometry.csv", "t,dx_body,dy_body,dtheta", [(k, 1, 0, 0) for k in t])
    table(hat / "leader_ranges.csv", "t,leader_x,leader_y,leader_pos_var,range",
          [(k, k + 3, 40, 0.25, np.hypot(3, 40) + 1e-6 * k) for k in t])  # fmt: skip
    table(hat / "groundtruth.csv", "t,x,y,theta", [(*row, 0) for row in track])
    table(uwb / "odometry.csv", "t,v,w", [(k, 1, 0) for k in range(0, 41, 10)])
    table(uwb / "ranges.csv", "t,module,range,module_x,module_y",
          [(k, s, r, *places[s]) for k, s, r in zip(t, sources, ranges, strict=True)])  # fmt: skip
    table(uwb / "groundtruth.csv", "t,x,y", track)
    (uwb / "initial_heading.txt").write_text("0\n")

    robots, mrclam = range(1, 6), data / "mrclam6"
    fine, coarse = np.arange(0, 150.1, 0.25), np.arange(0.0, 151.0)
    s = find_settings("mrclam6").odometry
    speed, rate = 0.1 / s.speed_factor, -s.turn_offset_rad_s / s.turn_factor
    table(mrclam / "groundtruth.csv", "robot,t,x,y,theta",
          [(r, k, 0.1 * k, 3 * r, 0) for r in robots for k in fine])  # fmt: skip
    table(mrclam / "odometry.csv", "robot,t,v,w", [(r, k, speed, rate) for r in robots
          for k in coarse])  # fmt: skip
    table(mrclam / "sightings.csv", "t,observer,subject,range",
          [(k, 1 + k % 5, 1 + (k + 1 + k // 5 % 3) % 5, 3 * abs(k % 5 - (k + 1 + k // 5 % 3) % 5))
           for k in range(1, 150)])  # fmt: skip
    fixes = [(k, 1, 5 + 0.05 * k, 3) for k in np.arange(0, 40, 0.5)]
    for number in (1, 2):
        table(data / "ugps_pier59" / f"fixes_{number}.csv", "t,valid,x_fwd,y_stbd", fixes)
    return data


@pytest.fixture(scope="module")
def perfect(tmp_path_factory: pytest.TempPathFactory) -> logs.Reproduction:
    return logs.measure(data=made_up_recordings(tmp_path_factory.mktemp("recordings")))


def test_recordings_without_noise_are_followed(perfect: logs.Reproduction, kept: Kept) -> None:
    """Odometry and ranges agree with the truth, whatever the filter, its kernel and its noise."""
    filters = [("ekf", ""), *(("robust-ekf", k) for k in logs.KERNELS), ("robust-ukf", "hampel")]
    expected = [(name, *one) for name in logs.TARGETS for one in filters]
    assert [(r.set_name, r.filter_name, r.kernel) for r in perfect.rows] == expected
    for row in perfect.rows:
        assert row.dead_reckoned_rmse_m == pytest.approx(0.0, abs=1e-6)
        # What is left is the bend of a range and, where the heading is known to 0.3 rad only, the
        # mean of its cosine: 4 % of the way between two ranges, again and again.
        assert row.rmse_m < (0.5 if row.set_name == "hat_charles" else 0.15), row
        assert (row.rejected, row.downweighted) == (0, 0)
        assert row.logs == (5 if row.set_name == "mrclam6" else 1)
    assert list(perfect.heading_walk) == [5.0, 10.0, 30.0, 60.0]
    assert list(perfect.heading_walk.values()) == pytest.approx([0.0] * 4, abs=1e-9)
    assert set(perfect.baseline_walk_rmse_m) == {"ekf", "robust-ekf"}
    settings = [(row.sigma_heading_rad, row.sigma_turn) for row in perfect.compass]
    assert settings == [(h, w) for h in logs.COMPASS_RAD for w in logs.COMPASS_WALK]
    assert len(perfect.held()) == 10
    console = Console(width=80, record=True, file=io.StringIO())
    for one in command._shown(perfect):
        console.print(one)
    kept("reproduce_logs.txt", console.export_text() + page.page(perfect))


def test_the_tracker_gets_a_fix_every_so_often_by_either_way(perfect: logs.Reproduction) -> None:
    """Thinned beforehand or by its own fixed interval, the same fixes make the same filter."""
    found = {
        (row.log, row.every_s, row.filter_name, row.near_field > 0): row.held_out_rmse_m
        for row in perfect.tracking
    }
    assert len(found) == len(perfect.tracking) == 2 * 3 * 3
    for log in ("ugps_pier59_1", "ugps_pier59_2"):
        for every_s in (2.0, 5.0, 10.0):
            ukf = found[log, every_s, "ukf", True]
            assert ukf == pytest.approx(found[log, every_s, "aukf", True], rel=1e-6)
        # It starts at rest: the longer it waits, the further 0.05 m/s have gone.
        errors = [found[log, every_s, "ukf", True] for every_s in (2.0, 5.0, 10.0)]
        assert 0 < errors[0] < errors[1] < errors[2] < 0.5


def test_the_likelihood_of_two_ranges_by_hand(tmp_path: Path) -> None:
    """A craft that knows where it stands: S is R = 1.5^2, innovations of 0.5 and -1 m."""
    from auvest.logs.write import write_file

    write_file(tmp_path, "odometry.csv", time_s=[0.0], speed_m_s=[0.0], yaw_rate_rad_s=[0.0])
    write_file(tmp_path, "ranges.csv", time_s=[1.0, 2.0, 3.0], source=[0, 0, 7],
               range_m=[10.5, 9.0, 1.0])  # fmt: skip
    write_file(tmp_path, "beacons.csv", source=[0], x_m=[10.0], y_m=[0.0])
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    settings = settings_from(
        {
            "start": {"sigma_position_m": 1e-6, "sigma_heading_rad": 1e-6},
            "odometry": {"sigma_distance": 0.0, "sigma_drift": 1e-7, "sigma_turn": 1e-7},
            "ranges": {"sigma_m": 1.5},
        }
    )
    # The third range is to nobody: it says nothing.
    expected = -0.5 * ((0.25 + 1.0) / 2.25 + 2 * np.log(2 * np.pi * 2.25))
    assert logs.log_likelihood(LogFolder(tmp_path), settings) == pytest.approx(expected, rel=1e-6)


def judged(
    rmse_m: dict[str, float] | None = None,
    tracked: dict[tuple[str, float, float], float] | None = None,
) -> logs.Reproduction:
    """The robust EKF with these errors; a tracker with these, by log, seconds and near field."""
    rows = [
        logs.Row(name, filter_name, kernel, error, 9.0, 0, 0, 1)
        for name, error in {name: t.rmse_m for name, t in logs.TARGETS.items()}.items()
        for filter_name, kernel, error in (
            ("ekf", "", 8.0),
            *(("robust-ekf", k, 7.0) for k in logs.KERNELS if k != logs.KERNEL),
            ("robust-ekf", logs.KERNEL, (rmse_m or {}).get(name, error)),
            ("robust-ukf", logs.KERNEL, 6.0),
        )
    ]
    tracking = [
        logs.TrackingRow(log, every_s, "ukf", near_field, error)
        for (log, every_s, near_field), error in (tracked or {}).items()
    ]
    return logs.Reproduction(rows, tracking, [], {}, {})


def test_a_target_holds_where_the_chosen_kernel_reaches_it() -> None:
    held = judged(rmse_m={"goats14": 1.1001}).held()
    assert held == {
        "goats14": False, "hat_charles": True, "mrclam6": True, "labyrinth_uwb": True,
    }  # fmt: skip
    header, cells = logs.set_table(judged(rmse_m={"goats14": 1.1001}))
    goats = dict(zip(header, cells[0], strict=True))
    assert (goats["EKF"], goats["hampel"], goats["huber"]) == ("8.000", "1.100", "7.000")
    assert (goats["odometry"], goats["UKF, hampel"]) == ("9.00", "6.000")
    assert (goats["target"], goats["holds"], goats["EKF ref."]) == ("1.1", "no", "13.75")
    assert [dict(zip(header, row, strict=True))["holds"] for row in cells[1:]] == ["yes"] * 3
    with pytest.raises(KeyError):
        judged().row("goats14", "aukf")


def test_targets_of_the_tracker_are_for_log_1_with_the_near_field() -> None:
    one, two = "ugps_pier59_1", "ugps_pier59_2"
    errors = {(one, 2.0, 5.0): 0.36, (one, 5.0, 5.0): 0.67, (one, 10.0, 5.0): 1.2,
              (one, 10.0, 0.0): 99.0, (two, 10.0, 5.0): 99.0}  # fmt: skip
    result = judged(tracked=errors)
    held = {name: held for name, held in result.held().items() if name not in logs.TARGETS}
    assert held == {
        f"{one}, ukf, every 2 s": True,
        f"{one}, ukf, every 5 s": False,
        f"{one}, ukf, every 10 s": True,
    }
    _, rows = logs.tracking_table(result)
    assert rows[0] == [one, "2", "0.360", "0.36"]
    assert rows[2] == [one, "10", "1.200", "99.000", "1.3"]
    assert rows[5] == [two, "10", "99.000", ""]
