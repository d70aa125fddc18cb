"""Real recordings: the targets, and what the page and the command say."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest.cli import app
from auvest.logs import LogFolder
from auvest.logs.importers import IMPORTERS
from auvest.replay import find_settings, replay
from auvest.reproduce import logs

DATA = os.environ.get("AUVEST_DATA")
needs_data = pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)


@pytest.fixture(scope="module")
def result() -> logs.Reproduction:
    assert DATA is not None
    return logs.measure(Path(DATA))


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
    monkeypatch.setattr(logs, "measure", lambda *_: result)
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
