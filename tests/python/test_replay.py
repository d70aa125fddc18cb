"""Replay: the same as the filters step by step, whatever the chunks; what is scored and counted."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
import pytest
from conftest import ROOT
from processes import PATIENCE_S, start_program, wait_until
from typer.testing import CliRunner

from auvest import (
    Aukf,
    CovarianceBudget,
    FixedInterval,
    LeaderRange,
    MahalanobisInterval,
    Odometry,
    RangeBearing,
    RobustEkf,
    RobustUkf,
)
from auvest.cli import app
from auvest.logs import FILES, LogError, LogFolder, reader
from auvest.logs.layout import SPELLINGS
from auvest.logs.write import write_file
from auvest.models import ConstantAcceleration
from auvest.replay import (
    Settings,
    engine,
    find_settings,
    read_settings,
    replay,
    report,
    settings_from,
)
from auvest.replay.config import packaged_settings
from auvest.replay.engine import Localiser, Tracker
from auvest.replay.tables import ERRORS, ESTIMATES, MEASUREMENTS, Batch

BEACONS = {3: (40.0, 0.0), 5: (0.0, 30.0)}


def together(batches: list[Batch]) -> dict[str, dict[str, np.ndarray]]:
    """Join the batches of a replay to whole tables."""
    names = {"estimates": ESTIMATES, "measurements": MEASUREMENTS, "errors": ERRORS}
    return {
        table: {name: np.concatenate([getattr(b, table)[name] for b in batches]) for name in names}
        for table, names in names.items()
    }


def run(log: Path, settings: Settings, filter_name: Any = "robust-ekf") -> dict[str, Any]:
    folder = LogFolder(log)
    replayed = (Tracker if folder.tracking else Localiser)(folder, settings, filter_name)
    tables: dict[str, Any] = together(list(replayed.batches()))
    tables["late"] = {name: stream.late for name, stream in replayed.streams.items()}
    return tables


def beacons(folder: Path) -> None:
    x, y = zip(*BEACONS.values(), strict=True)
    write_file(folder, "beacons.csv", source=list(BEACONS), x_m=x, y_m=y)


def start(folder: Path, time_s: float = 0.0, heading_rad: float = 0.0) -> None:
    write_file(
        folder, "start.csv", time_s=[time_s], x_m=[1.0], y_m=[2.0], heading_rad=[heading_rad]
    )


def increments_log(folder: Path, steps: int = 40) -> dict[str, np.ndarray]:
    """A log of increments every 0.5 s and ranges at every other of their ends, with outliers."""
    random = np.random.default_rng(1)
    k = np.arange(1, steps + 1)
    motion = {
        "time_s": 0.5 * k,
        "forward_m": 0.6 + 0.05 * random.standard_normal(steps),
        "left_m": 0.02 * random.standard_normal(steps),
        "turn_rad": 0.05 + 0.01 * random.standard_normal(steps),
    }
    heading = np.concatenate([[0.3], 0.3 + np.cumsum(motion["turn_rad"])])
    path = np.cumsum((motion["forward_m"] + 1j * motion["left_m"]) * np.exp(1j * heading[:-1])) + (
        1 + 2j
    )
    source = np.where(k % 4 == 0, 3, 5)
    at = np.array([complex(*BEACONS[s]) for s in source])
    ranges = np.abs(path - at) + 0.3 * random.standard_normal(steps)
    ranges[9] += 25.0
    write_file(folder, "odometry.csv", **motion)
    used = k % 2 == 0
    write_file(
        folder, "ranges.csv", time_s=motion["time_s"][used], source=source[used],
        range_m=ranges[used],
    )  # fmt: skip
    write_file(folder, "truth.csv", time_s=motion["time_s"], x_m=path.real, y_m=path.imag)
    beacons(folder)
    start(folder, heading_rad=0.3)
    return {**motion, "source": source, "range_m": ranges, "used": used, "path": path}


SETTINGS = settings_from(
    {
        "start": {"sigma_position_m": 0.5, "sigma_heading_rad": 0.1},
        "odometry": {"sigma_distance": 0.1, "sigma_drift": 0.05, "sigma_turn": 0.02},
        "ranges": {"sigma_m": 0.3},
    }
)


def test_increments_and_ranges_are_those_of_the_filter_step_by_step(tmp_path: Path) -> None:
    log = increments_log(tmp_path)
    tables = run(tmp_path, SETTINGS)
    ekf = RobustEkf(
        [1.0, 2.0, 0.3],
        np.diag([0.5, 0.5, 0.1]) ** 2,
        process=Odometry(sigma_distance=0.1, sigma_drift=0.05, sigma_turn=0.02),
        kernel="hampel",
    )
    x, covariance, nis, weight = [], [], [], []
    for k in range(len(log["time_s"])):
        ekf.predict(0.5, [log[name][k] for name in ("forward_m", "left_m", "turn_rad")])
        if log["used"][k]:
            leader = BEACONS[int(log["source"][k])]
            ekf.update(log["range_m"][k], LeaderRange(leader=leader, sigma_range_m=0.3))
            assert ekf.report is not None
            nis.append(ekf.report.nis)
            weight.append(ekf.report.weight[0])
        x.append(ekf.x)
        covariance.append(ekf.P)
    estimates, measured = tables["estimates"], tables["measurements"]
    np.testing.assert_array_equal(estimates["time_s"], log["time_s"])
    # Increments go through velocities and back: a rounding or two each.
    for m, name in enumerate(("x_m", "y_m", "heading_rad")):
        np.testing.assert_allclose(estimates[name], np.array(x)[:, m], rtol=1e-11)
    np.testing.assert_allclose(estimates["var_x_m2"], np.array(covariance)[:, 0, 0], rtol=1e-10)
    np.testing.assert_allclose(estimates["cov_xy_m2"], np.array(covariance)[:, 0, 1], rtol=1e-9)
    np.testing.assert_allclose(measured["nis"], nis, rtol=1e-9)
    np.testing.assert_allclose(measured["weight_0"], weight, rtol=1e-9)
    assert measured["outcome"].tolist().count("rejected") == 1
    # Errors and dead reckoning against the path that the log was made from.
    errors = tables["errors"]
    np.testing.assert_allclose(
        errors["error_x_m"], estimates["x_m"] - log["path"].real, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(errors["dead_reckoned_error_m"], 0.0, atol=1e-12)


@pytest.mark.parametrize("lines", [1, 2, 5, 33])
@pytest.mark.parametrize("kind", ["increments", "velocities", "fixes"])
def test_no_result_depends_on_the_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, lines: int
) -> None:
    settings = settings_from({"log": {"reorder_s": 0.7, "leader_gap_s": 3.0}})
    {"increments": increments_log, "velocities": velocity_log, "fixes": fixes_log}[kind](tmp_path)
    name = "ukf" if kind == "fixes" else "robust-ekf"
    whole = run(tmp_path, settings, name)
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    parts = run(tmp_path, settings, name)
    for table in ("estimates", "measurements", "errors"):
        assert len(whole[table]["time_s"]) >= 20
        for column, values in whole[table].items():
            order = [np.argsort(t[table]["time_s"], kind="stable") for t in (whole, parts)]
            np.testing.assert_array_equal(
                values[order[0]], parts[table][column][order[1]], err_msg=column
            )


def velocity_log(folder: Path) -> None:
    """Straight, then a circle, then standing; ranges to a leader that moves, and to a beacon."""
    write_file(
        folder, "odometry.csv", time_s=[0.0, 5.0, 15.0], speed_m_s=[1.0, 1.0, 0.0],
        yaw_rate_rad_s=[0.0, 0.2, 0.0],
    )  # fmt: skip
    time_s = 0.37 * np.arange(1, 50)
    path = circle(time_s)
    leader = 20 - 1j * time_s  # where the leader is
    to_leader = np.arange(len(time_s)) % 2 == 0
    source = np.where(to_leader, 9, 3)
    at = np.where(to_leader, leader, complex(*BEACONS[3]))
    write_file(folder, "ranges.csv", time_s=time_s, source=source, range_m=np.abs(path - at))
    known = np.arange(0.0, 21.0, 2.0)
    write_file(
        folder, "leaders.csv", time_s=known, source=np.full(len(known), 9), x_m=0 * known + 20,
        y_m=-known,
    )  # fmt: skip
    asked = np.arange(0.05, 18.0, 0.31)
    true = circle(asked)
    write_file(folder, "truth.csv", time_s=asked, x_m=true.real, y_m=true.imag)
    beacons(folder)
    start(folder)


def circle(time_s: np.ndarray) -> np.ndarray:
    """Position of velocity_log's craft in closed form."""
    line = 1 + 2j + np.minimum(time_s, 5.0)
    turned = 0.2 * np.clip(time_s - 5.0, 0.0, 10.0)
    return line + (np.exp(1j * turned) - 1) / (0.2j)


#: A filter that is sure of its start and of its odometry: it follows dead reckoning.
SURE = {
    "start": {"sigma_position_m": 1e-6, "sigma_heading_rad": 1e-6},
    "odometry": {"sigma_distance": 0.0, "sigma_drift": 1e-7, "sigma_turn": 1e-7},
}


def test_velocities_are_driven_along_arcs_and_leaders_along_lines(tmp_path: Path) -> None:
    velocity_log(tmp_path)
    settings = settings_from({**SURE, "log": {"leader_gap_s": 2.0}})
    tables = run(tmp_path, settings, "ekf")
    # Nothing was disturbed: dead reckoning, ranges and truth agree.
    assert len(tables["errors"]["time_s"]) == len(np.arange(0.05, 18.0, 0.31))
    for name in ("error_x_m", "error_y_m", "dead_reckoned_error_m"):
        np.testing.assert_allclose(tables["errors"][name], 0.0, atol=1e-9)
    np.testing.assert_array_equal(tables["measurements"]["outcome"], "accepted")
    np.testing.assert_allclose(tables["measurements"]["innovation_0"], 0.0, atol=1e-9)


def test_an_increment_is_parted_along_its_arc(tmp_path: Path) -> None:
    """A range in the middle of a long turn: the craft is then half way round the arc."""
    radius, turn = 10.0, 1.2
    chord = radius * (np.exp(1j * turn) - 1) / 1j
    write_file(
        tmp_path, "odometry.csv", time_s=[10.0], forward_m=[chord.real], left_m=[chord.imag],
        turn_rad=[turn],
    )  # fmt: skip
    half = 1 + 2j + radius * (np.exp(0.5j * turn) - 1) / 1j
    ranged = abs(half - complex(*BEACONS[3]))
    write_file(tmp_path, "ranges.csv", time_s=[5.0], source=[3], range_m=[ranged])
    write_file(tmp_path, "truth.csv", time_s=[2.5, 5, 10], x_m=[0.0, half.real, 0],
               y_m=[0.0, half.imag, 0])  # fmt: skip
    beacons(tmp_path)
    start(tmp_path)
    tables = run(tmp_path, settings_from(SURE), "ekf")
    assert tables["measurements"]["innovation_0"][0] == pytest.approx(0.0, abs=1e-9)
    assert math.hypot(tables["errors"]["error_x_m"][1], tables["errors"]["error_y_m"][1]) < 1e-9
    end = complex(tables["estimates"]["x_m"][-1], tables["estimates"]["y_m"][-1])
    assert abs(end - (1 + 2j + chord)) < 1e-9


def test_calibration(tmp_path: Path) -> None:
    """Speed, turn and offset of a straight run that was in truth a circle."""
    write_file(tmp_path, "odometry.csv", time_s=[0.0], speed_m_s=[2.0], yaw_rate_rad_s=[0.4])
    write_file(tmp_path, "ranges.csv", time_s=[10.0], source=[3], range_m=[1.0])
    beacons(tmp_path)
    start(tmp_path)
    settings = settings_from(
        {"odometry": {"speed_factor": 0.5, "turn_factor": 0.25, "turn_offset_rad_s": 0.1}}
    )
    estimates = run(tmp_path, settings)["estimates"]
    expected = 1 + 2j + (np.exp(2j) - 1) / 0.2j  # 1 m/s and 0.2 rad/s for 10 s
    reckoned = complex(estimates["dead_reckoned_x_m"][-1], estimates["dead_reckoned_y_m"][-1])
    assert abs(reckoned - expected) < 1e-12


def test_calibration_of_increments(tmp_path: Path) -> None:
    """As above, told in increments over 2 s: the offset goes with the time."""
    chord = 2.0 * np.exp(0.1j) * np.sinc(0.1 / np.pi)  # of 1 m/s and 0.1 rad/s for 2 s
    write_file(
        tmp_path,
        "odometry.csv",
        time_s=[2.0, 4.0, 6.0, 8.0, 10.0],
        forward_m=[2 * chord.real] * 5,
        left_m=[2 * chord.imag] * 5,
        turn_rad=[0.0] * 5,
    )
    write_file(tmp_path, "ranges.csv", time_s=[10.0], source=[3], range_m=[1.0])
    beacons(tmp_path)
    start(tmp_path)
    settings = settings_from({"odometry": {"speed_factor": 0.5, "turn_offset_rad_s": 0.1}})
    estimates = run(tmp_path, settings)["estimates"]
    expected = 1 + 2j + (np.exp(1j) - 1) / 0.1j
    reckoned = complex(estimates["dead_reckoned_x_m"][-1], estimates["dead_reckoned_y_m"][-1])
    assert abs(reckoned - expected) < 1e-12


def outcomes(tables: dict[str, Any]) -> list[str]:
    measured: list[str] = tables["measurements"]["outcome"].tolist()
    return measured


def test_every_range_is_accounted_for(tmp_path: Path) -> None:
    k = np.arange(1, 11)
    write_file(tmp_path, "odometry.csv", time_s=1.0 * k, forward_m=0 * k, left_m=0 * k,
               turn_rad=0 * k)  # fmt: skip
    start(tmp_path, time_s=1.5)
    write_file(tmp_path, "beacons.csv", source=[3], x_m=[11.0], y_m=[2.0])
    write_file(tmp_path, "leaders.csv", time_s=[3.0, 4.0, 7.0], source=[4, 4, 4],
               x_m=[11.0, 11.0, 11.0], y_m=[2.0, 2.0, 2.0])  # fmt: skip
    cases = [
        (1.0, 3, "before start"), (2.0, 3, "accepted"), (2.5, 8, "no position"),
        (2.9, 4, "no position"), (3.0, 4, "accepted"), (3.5, 4, "accepted"),
        (5.0, 4, "no position"), (7.0, 4, "accepted"), (7.1, 4, "no position"),
        (7.5, 3, "accepted"), (8.0, 3, "held out"), (10.0, 3, "accepted"), (10.1, 3, "after end"),
    ]  # fmt: skip
    time_s, source, _ = zip(*cases, strict=True)
    write_file(tmp_path, "ranges.csv", time_s=time_s, source=source, range_m=[10.0] * len(cases))
    settings = settings_from({**SURE, "ranges": {"every_s": 0.501}, "log": {"leader_gap_s": 2.0}})
    tables = run(tmp_path, settings, "ekf")
    # 3.5 is 0.5 s after 3.0 from the same leader: held out by 0.501 s.
    expected = [case[2] for case in cases]
    expected[5] = "held out"
    assert outcomes(tables) == expected
    counts = replay(LogFolder(tmp_path), settings, filter_name="ekf").numbers
    for name in set(expected):
        assert counts[name.replace(" ", "_")] == expected.count(name)
    assert counts["measurements"] == len(cases)
    # What is held out is predicted: the craft stands at (1, 2), 10 m from the beacon.
    held = tables["measurements"]["held_out_error_m"]
    assert np.flatnonzero(~np.isnan(held)).tolist() == [5, 10]
    np.testing.assert_allclose(held[[5, 10]], 0.0, atol=1e-9)


def standing_log(folder: Path, *, start_s: float, ranges: list[tuple[float, float]]) -> None:
    """A craft that stands at (1, 2), 10 m from its only beacon, and takes these ranges."""
    time_s = np.arange(-2.0, 11.0)
    write_file(folder, "odometry.csv", time_s=time_s, forward_m=0 * time_s, left_m=0 * time_s,
               turn_rad=0 * time_s)  # fmt: skip
    start(folder, time_s=start_s)
    write_file(folder, "beacons.csv", source=[3], x_m=[11.0], y_m=[2.0])
    times, sizes = zip(*ranges, strict=True)
    write_file(folder, "ranges.csv", time_s=times, source=[3] * len(times), range_m=sizes)


def test_a_range_at_the_start_and_one_at_the_end_are_used(tmp_path: Path) -> None:
    cases = [(1.499, 10.0), (1.5, 10.5), (10.0, 9.0), (10.001, 10.0)]
    standing_log(tmp_path, start_s=1.5, ranges=cases)
    tables = run(tmp_path, settings_from(SURE), "ekf")
    assert outcomes(tables) == ["before start", "accepted", "accepted", "after end"]
    # Measured less expected.
    np.testing.assert_allclose(
        tables["measurements"]["innovation_0"][1:3], [0.5, -1.0], rtol=0, atol=1e-9
    )


def test_when_it_was_taken_goes_before_from_where(tmp_path: Path) -> None:
    """Nobody knows where source 8 is; before the start and after the end it does not matter."""
    standing_log(tmp_path, start_s=1.5, ranges=[(2.0, 10.0)])
    time_s = [1.0, 2.0, 10.0, 10.5]
    write_file(tmp_path, "ranges.csv", time_s=time_s, source=[8] * 4, range_m=[10.0] * 4)
    assert outcomes(run(tmp_path, settings_from(SURE), "ekf")) == [
        "before start", "no position", "no position", "after end",
    ]  # fmt: skip


def test_a_held_out_range_says_how_much_too_long_the_prediction_was(tmp_path: Path) -> None:
    cases = [(1.0, 10.0), (2.0, 8.0), (3.0, 11.5), (6.0, 10.0)]
    standing_log(tmp_path, start_s=0.0, ranges=cases)
    settings = settings_from({**SURE, "ranges": {"every_s": 5.0}})
    tables = run(tmp_path, settings, "ekf")
    assert outcomes(tables) == ["accepted", "held out", "held out", "accepted"]
    held = tables["measurements"]["held_out_error_m"]
    np.testing.assert_allclose(held[1:3], [2.0, -1.5], rtol=0, atol=1e-9)
    numbers = replay(LogFolder(tmp_path), settings, filter_name="ekf").numbers
    assert numbers["held_out_rmse_m"] == pytest.approx(math.sqrt((4 + 2.25) / 2))


def test_an_increment_that_ends_at_the_start_is_left_out(tmp_path: Path) -> None:
    """The craft starts at (1, 2) towards +x when its second increment ends."""
    standing_log(tmp_path, start_s=1.0, ranges=[(3.0, 8.0)])
    write_file(tmp_path, "odometry.csv", time_s=[0.5, 1.0, 2.0, 3.0],
               forward_m=[100.0, 50.0, 1.5, 0.5], left_m=[0.0] * 4, turn_rad=[0.0] * 4)  # fmt: skip
    estimates = run(tmp_path, settings_from(SURE), "ekf")["estimates"]
    np.testing.assert_array_equal(estimates["time_s"], [2.0, 3.0])
    np.testing.assert_allclose(estimates["dead_reckoned_x_m"], [2.5, 3.0], rtol=1e-12)
    np.testing.assert_array_equal(estimates["dead_reckoned_y_m"], 2.0)


@pytest.mark.parametrize("lines", [1, 100])
def test_velocities_before_the_start_count_as_the_last_of_them_at_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    tables = []
    for name, time_s, speed in (
        ("before", [-3.0, -1.0, 2.0], [7.0, 1.0, 0.5]),
        ("at", [0.0, 2.0], [1.0, 0.5]),
    ):
        folder = tmp_path / name
        standing_log(folder, start_s=0.0, ranges=[(1.0, 9.0), (4.0, 7.0)])
        write_file(folder, "odometry.csv", time_s=time_s, speed_m_s=speed,
                   yaw_rate_rad_s=[0.0] * len(speed))  # fmt: skip
        tables.append(run(folder, settings_from(SURE), "ekf"))
    before, at = tables
    # 1 m/s for 2 s, then 0.5 m/s for 2 s, from x = 1 on.
    assert before["estimates"]["dead_reckoned_x_m"][-1] == pytest.approx(4.0)
    np.testing.assert_allclose(before["measurements"]["innovation_0"], 0.0, atol=1e-9)
    for name in ESTIMATES:
        np.testing.assert_array_equal(before["estimates"][name], at["estimates"][name], name)


@pytest.mark.parametrize(("sigma_m", "expected"), [(None, 1.5), (0.0, 1.5), (2.0, 2.5)])
def test_a_leaders_sigma_adds_to_that_of_the_range(
    tmp_path: Path, sigma_m: float | None, expected: float
) -> None:
    """Where the craft knows its place, S is R: 1.5^2, and 1.5^2 + 2^2 = 2.5^2."""
    standing_log(tmp_path, start_s=0.0, ranges=[(2.0, 10.0)])
    (tmp_path / "beacons.csv").unlink()
    known = {} if sigma_m is None else {"sigma_m": [sigma_m] * 3}
    write_file(tmp_path, "leaders.csv", time_s=[1.0, 2.0, 3.0], source=[3] * 3, x_m=[11.0] * 3,
               y_m=[2.0] * 3, **known)  # fmt: skip
    settings = settings_from({**SURE, "ranges": {"sigma_m": 1.5}})
    measured = run(tmp_path, settings, "ekf")["measurements"]
    assert measured["outcome"].tolist() == ["accepted"]
    assert measured["sigma_0"][0] == pytest.approx(expected, rel=1e-9)


#: Far enough for a range to be a measurement along x and nothing else.
FAR_M = 5e4


def far_log(folder: Path, ranges: list[tuple[float, float]]) -> None:
    """A craft that stands at (1, 2) and ranges along x: errors of what it measures, m."""
    standing_log(folder, start_s=0.0, ranges=[(t, FAR_M + error) for t, error in ranges])
    write_file(folder, "beacons.csv", source=[3], x_m=[1.0 + FAR_M], y_m=[2.0])


STANDING = {
    "start": {"sigma_position_m": 2.0},
    "odometry": {"sigma_distance": 0.0, "sigma_drift": 0.0, "sigma_turn": 0.0},
    "ranges": {"sigma_m": 1.5},
}


def test_one_range_by_hand(tmp_path: Path) -> None:
    """2 m and a range of 1.5 m make 1.2 m along it; across it 2 m stay.

    It is 2.5 m too long: the craft seems to stand 4 / (4 + 2.25) of that further away, at -0.6 m.
    All to 0.1 mm: the circle around the beacon bends by 4 / (2 FAR_M).
    """

    far_log(tmp_path, [(2.0, 2.5)])
    write_file(tmp_path, "truth.csv", time_s=[-1.0, 0.0, 1.0, 2.0, 3.0], x_m=[1.0] * 5,
               y_m=[2.0] * 5)  # fmt: skip
    tables = run(tmp_path, settings_from(STANDING), "ekf")
    measured = {name: values[0] for name, values in tables["measurements"].items()}
    assert measured["innovation_0"] == pytest.approx(2.5, abs=1e-4)
    assert measured["sigma_0"] == pytest.approx(2.5, abs=1e-4)
    assert measured["nis"] == pytest.approx(1.0, abs=1e-4)
    assert measured["weight_0"] == 1.0
    assert math.isnan(measured["weight_1"])
    last = {name: values[-1] for name, values in tables["estimates"].items()}
    assert (last["x_m"], last["y_m"]) == pytest.approx((-0.6, 2.0), abs=1e-4)
    assert (last["var_x_m2"], last["var_y_m2"]) == pytest.approx((1.44, 4.0), abs=1e-4)
    assert last["cov_xy_m2"] == pytest.approx(0.0, abs=1e-4)
    errors = tables["errors"]
    # What the truth was at the start counts, what it was before does not.
    assert errors["time_s"].tolist() == [0.0, 1.0, 2.0, 3.0]
    np.testing.assert_allclose(errors["error_x_m"], [0.0, 0.0, -1.6, -1.6], atol=1e-4)
    np.testing.assert_allclose(errors["error_y_m"], 0.0, atol=1e-4)
    np.testing.assert_allclose(errors["sigma_x_m"], [2.0, 2.0, 1.2, 1.2], atol=1e-4)
    np.testing.assert_allclose(errors["sigma_y_m"], 2.0, atol=1e-4)
    numbers = replay(LogFolder(tmp_path), settings_from(STANDING), filter_name="ekf").numbers
    assert numbers["rmse_m"] == pytest.approx(1.6 / math.sqrt(2), abs=1e-4)
    assert numbers["max_error_m"] == pytest.approx(1.6, abs=1e-4)
    assert numbers["inside_3_sigma"] == 1.0


def test_dead_reckoning_is_off_along_both_axes(tmp_path: Path) -> None:
    far_log(tmp_path, [(2.0, 0.0)])
    write_file(tmp_path, "truth.csv", time_s=[5.0], x_m=[1.0 - 3.0], y_m=[2.0 + 4.0])
    errors = run(tmp_path, settings_from(STANDING), "ekf")["errors"]
    assert errors["dead_reckoned_error_m"][0] == pytest.approx(5.0)


@pytest.mark.parametrize(("filter_name", "recovered"), [("robust-ekf", 1), ("ekf", 0)])
def test_only_the_robust_filter_recovers(tmp_path: Path, filter_name: Any, recovered: int) -> None:
    """Four ranges 60 m too long: 4, 11, 18, 25 are more than the 24 of six rejections."""
    far_log(tmp_path, [(1.0, 60.0), (2.0, 60.0), (3.0, 60.0), (4.0, 60.0)])
    result = replay(LogFolder(tmp_path), settings_from(STANDING), filter_name=filter_name)
    assert result.numbers["recovered"] == recovered
    assert result.numbers["rejected"] == 4 * recovered
    np.testing.assert_array_equal(
        result.measurements.columns()["recovered"], [False, False, False, bool(recovered)]
    )
    # What was doubted is kept apart for the figures.
    assert len(result.outliers.columns()["time_s"]) == 4 * recovered


def test_outliers_are_what_was_doubted(tmp_path: Path) -> None:
    """Sigma 2.5 m; Hampel's kernel doubts three sigma and rejects twenty."""
    far_log(tmp_path, [(1.0, 0.0), (2.0, 7.5), (3.0, 50.0)])
    result = replay(LogFolder(tmp_path), settings_from(STANDING))
    assert result.filter_name == "robust-ekf"
    outliers = result.outliers.columns()
    assert outliers["time_s"].tolist() == [2.0, 3.0]
    assert outliers["outcome"].tolist() == ["downweighted", "rejected"]


def test_alpha_is_that_of_the_settings(tmp_path: Path) -> None:
    """Where the range is short its bend counts, and so does where the sigma points stand."""
    standing_log(tmp_path, start_s=0.0, ranges=[(2.0, 9.0)])
    found = []
    for alpha in (1e-3, 1.0):
        settings = settings_from({**STANDING, "filter": {"alpha": alpha}})
        estimates = run(tmp_path, settings, "ukf")["estimates"]
        ukf = RobustUkf(
            [1.0, 2.0, 0.0],
            np.diag([2.0, 2.0, 0.1]) ** 2,
            process=Odometry(sigma_distance=0.0, sigma_drift=0.0, sigma_turn=0.0),
            kernel="unit",
            alpha=alpha,
        )
        for _ in range(2):
            ukf.predict(1.0, [0, 0, 0])
        ukf.update(9.0, LeaderRange(leader=(11.0, 2.0), sigma_range_m=1.5))
        found.append(estimates["x_m"][-1])
        assert found[-1] == pytest.approx(ukf.x[0], rel=1e-9)
    assert abs(found[0] - found[1]) > 1e-5


def test_leaders_know_their_places_unequally_well(tmp_path: Path) -> None:
    """Sigmas of 0, 2 and 3.6 m beside 1.5 m: 1.5, 2.5 and 3.9 m."""
    standing_log(tmp_path, start_s=0.0, ranges=[(1.0, 10.0)])
    time_s = np.arange(1.0, 10.0)
    write_file(tmp_path, "ranges.csv", time_s=time_s, source=[4, 3, 5] * 3, range_m=[10.0] * 9)
    write_file(tmp_path, "leaders.csv", time_s=np.repeat([0.0, 10.0], 2), source=[4, 5] * 2,
               x_m=[11.0] * 4, y_m=[2.0] * 4, sigma_m=[2.0, 3.6] * 2)  # fmt: skip
    settings = settings_from({**SURE, "ranges": {"sigma_m": 1.5}, "log": {"leader_gap_s": 10.0}})
    measured = run(tmp_path, settings, "ekf")["measurements"]
    np.testing.assert_allclose(measured["sigma_0"], [2.5, 1.5, 3.9] * 3, rtol=1e-9)


def test_start_csv_goes_before_the_truth(tmp_path: Path) -> None:
    standing_log(tmp_path, start_s=2.0, ranges=[(3.0, 10.0)])
    write_file(tmp_path, "truth.csv", time_s=[1.0], x_m=[5.0], y_m=[6.0], heading_rad=[0.5])
    assert Localiser(LogFolder(tmp_path), Settings(), "ekf").start == (2.0, 1.0, 2.0, 0.0)


def test_a_gap_is_as_long_as_the_steps_that_fill_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "_STEPS_WITHOUT_LINE", 10)
    settings = settings_from({"odometry": {"max_step_s": 0.5}})
    standing_log(tmp_path, start_s=0.0, ranges=[(5.0, 10.0), (10.0, 10.0)])
    write_file(tmp_path, "odometry.csv", time_s=[0.0], speed_m_s=[0.0], yaw_rate_rad_s=[0.0])
    assert outcomes(run(tmp_path, settings)) == ["accepted", "accepted"]
    write_file(tmp_path, "ranges.csv", time_s=[5.0, 10.1], source=[3, 3], range_m=[10.0, 10.0])
    with pytest.raises(LogError, match=r"no file has a line for 5\.1 s"):
        run(tmp_path, settings)


def test_late_ranges_give_the_same_as_ranges_in_time(tmp_path: Path) -> None:
    log = increments_log(tmp_path / "in_time")
    increments_log(tmp_path / "late")
    rows = np.column_stack([log["time_s"], log["source"], log["range_m"]])[log["used"]]
    shuffled = rows[[1, 0, 2, 5, 3, 4, *range(6, len(rows))]]
    write_file(tmp_path / "late", "ranges.csv", time_s=shuffled[:, 0],
               source=shuffled[:, 1].astype(int), range_m=shuffled[:, 2])  # fmt: skip
    window = replace(SETTINGS, log=replace(SETTINGS.log, reorder_s=2.0))
    in_time, late = run(tmp_path / "in_time", SETTINGS), run(tmp_path / "late", window)
    np.testing.assert_array_equal(in_time["estimates"]["x_m"], late["estimates"]["x_m"])
    assert late["late"]["ranges.csv"].reordered == 3
    # Without the window they are counted, by line, and nothing else changes its place.
    numbers = replay(LogFolder(tmp_path / "late"), SETTINGS).numbers
    assert numbers["late"]["ranges.csv"] == {"reordered": 0, "dropped": 3, "lines": [3, 6, 7]}
    assert numbers["measurements"] == len(rows) - 3


def test_late_odometry_is_an_error(tmp_path: Path) -> None:
    log = increments_log(tmp_path)
    order = [1, 0, *range(2, len(log["time_s"]))]
    columns = {n: log[n][order] for n in ("time_s", "forward_m", "left_m", "turn_rad")}
    write_file(tmp_path, "odometry.csv", **columns)
    with pytest.raises(LogError, match=r"odometry.csv, line 3, column time_s.*shuffled"):
        replay(LogFolder(tmp_path), SETTINGS)
    columns["time_s"][0] = columns["time_s"][1]
    write_file(tmp_path, "odometry.csv", **columns)
    with pytest.raises(LogError, match=r"two increments end at 0\.5 s"):
        replay(LogFolder(tmp_path), SETTINGS)


def test_clocks_that_do_not_fit_are_an_error(tmp_path: Path) -> None:
    velocity_log(tmp_path)
    write_file(tmp_path, "ranges.csv", time_s=[1.0, 1.6e9], source=[3, 3], range_m=[5.0, 5.0])
    with pytest.raises(
        LogError, match=r"6 lines over 1600000000 s: more than 1000 steps of 0\.1 s for each l"
    ):
        replay(LogFolder(tmp_path), Settings())


def test_long_stretches_of_velocity_are_cut_and_nothing_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    velocity_log(tmp_path)
    settings = settings_from({"log": {"leader_gap_s": 2.0}})
    whole = run(tmp_path, settings)
    monkeypatch.setattr(engine, "_STEPS", 7)
    cut = Localiser(LogFolder(tmp_path), settings, "robust-ekf")
    batches = list(cut.batches())
    assert max(len(batch.estimates["time_s"]) for batch in batches) < 14
    parts = together(batches)
    for table, columns in parts.items():
        for name, values in columns.items():
            np.testing.assert_array_equal(values, whole[table][name], err_msg=name)


def test_a_run_must_start_somewhere(tmp_path: Path) -> None:
    velocity_log(tmp_path)
    (tmp_path / "start.csv").unlink()
    with pytest.raises(LogError, match="where does the run start"):
        replay(LogFolder(tmp_path), Settings())
    write_file(tmp_path, "truth.csv", time_s=[2.0], x_m=[3.0], y_m=[4.0], heading_rad=[0.5])
    begun = Localiser(LogFolder(tmp_path), Settings(), "ekf")
    assert begun.start == (2.0, 3.0, 4.0, 0.5)
    assert replay(LogFolder(tmp_path), Settings()).document()["started_from"] == "truth.csv"
    (tmp_path / "start.csv").write_text("time_s,x_m,y_m,heading_rad\n")
    with pytest.raises(LogError, match="no line below the header"):
        Localiser(LogFolder(tmp_path), Settings(), "ekf")


STATION = {0: (2.0, -1.0)}


def fixes_log(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Fixes of a craft in uniform motion, every 0.5 s, without noise, from two stations."""
    time_s = 3.0 + 0.5 * np.arange(60)
    path = (10 + 0.4 * time_s) + 1j * (8 - 0.2 * time_s)
    source = np.arange(len(time_s)) % 2
    at = np.array([2 - 1j, 1 + 5j])[source]
    write_file(folder, "fixes.csv", time_s=time_s, source=source, range_m=np.abs(path - at),
               bearing_rad=np.angle(path - at))  # fmt: skip
    write_file(folder, "beacons.csv", source=[0, 1], x_m=[2.0, 1.0], y_m=[-1.0, 5.0])
    write_file(folder, "truth.csv", time_s=time_s + 0.1, x_m=path.real + 0.04,
               y_m=path.imag - 0.02)  # fmt: skip
    return time_s, path


def test_a_tracker_starts_at_the_first_fix_and_learns_the_velocity(tmp_path: Path) -> None:
    time_s, path = fixes_log(tmp_path)
    tables = run(tmp_path, Settings(), "ukf")
    estimates = tables["estimates"]
    np.testing.assert_array_equal(estimates["time_s"], time_s[1:])
    assert outcomes(tables) == ["accepted"] * len(time_s)
    assert math.isnan(tables["measurements"]["nis"][0])  # it made the start
    off = np.hypot(estimates["x_m"] - path.real[1:], estimates["y_m"] - path.imag[1:])
    assert off[-1] < 0.01  # a tenth of the noise that the filter expects
    assert estimates["heading_rad"][-1] == pytest.approx(math.atan2(-0.2, 0.4), abs=0.01)
    # The truth is asked for 0.1 s after each fix: the prediction goes on with the velocity.
    errors = tables["errors"]
    assert abs(errors["error_x_m"][-1]) < 0.01


@pytest.mark.parametrize(
    ("start_s", "file", "said"),
    [(0.0, "start.csv", "start.csv, first line"), (None, None, "the first place that is measured")],
)
def test_a_result_says_where_its_start_is_from(
    tmp_path: Path, start_s: float | None, file: str | None, said: str
) -> None:
    far_fixes(tmp_path, [0j, 1j], [4.0, 5.0], start_s=start_s)
    result = replay(LogFolder(tmp_path), Settings())
    assert result.document()["started_from"] == file
    assert dict(report.rows(result))["start"] == said


def far_fixes(
    folder: Path, path: list[complex], time_s: list[float], *, start_s: float | None = None
) -> None:
    """Fixes of a craft on this path from a station far away along -x."""
    seen = np.array(path) + FAR_M
    write_file(folder, "fixes.csv", time_s=time_s, source=[0] * len(path), range_m=np.abs(seen),
               bearing_rad=np.angle(seen))  # fmt: skip
    write_file(folder, "beacons.csv", source=[0], x_m=[-FAR_M], y_m=[0.0])
    if start_s is not None:
        write_file(folder, "start.csv", time_s=[start_s], x_m=[path[0].real], y_m=[path[0].imag],
                   heading_rad=[0.0])  # fmt: skip


#: A filter that believes its fixes and is told nothing about the motion.
BELIEVING = {
    "start": {"sigma_position_m": 1.0, "sigma_speed_m_s": 10.0, "sigma_acceleration_m_s2": 10.0},
    "fixes": {"sigma_range_m": 1e-4, "sigma_bearing_rad": 1e-4 / FAR_M, "near_field": 0.0},
    "process": {"velocity_psd": 0.0, "acceleration_psd": 0.0},
}


@pytest.mark.parametrize("filter_name", ["ekf", "ukf", "aukf"])
def test_a_trackers_first_fix_by_hand(tmp_path: Path, filter_name: Any) -> None:
    """3 m, 1 m/s for 4 s and 0.5 m/s^2 for 4 s: 9 + 16 + 16 m^2; with 8 of the range 49."""
    far_fixes(tmp_path, [0j], [4.0], start_s=0.0)
    settings = settings_from(
        {
            "start": {
                "sigma_position_m": 3.0,
                "sigma_speed_m_s": 1.0,
                "sigma_acceleration_m_s2": 0.5,
            },
            "fixes": {
                "sigma_range_m": math.sqrt(8.0),
                "sigma_bearing_rad": math.sqrt(23.0) / FAR_M,
                "near_field": 0.0,
            },
            "process": {"velocity_psd": 0.0, "acceleration_psd": 0.0},
        }
    )
    measured = run(tmp_path, settings, filter_name)["measurements"]
    assert measured["outcome"].tolist() == ["accepted"]
    assert measured["sigma_0"][0] == pytest.approx(7.0, rel=1e-6)
    assert measured["sigma_1"][0] == pytest.approx(8.0 / FAR_M, rel=1e-6)
    assert (measured["weight_0"][0], measured["weight_1"][0]) == (1.0, 1.0)


def test_between_fixes_the_acceleration_goes_on(tmp_path: Path) -> None:
    """2 m/s^2 along x: after fixes at 1, 2, 3 s it is known, and 3.5 s finds the craft there."""
    time_s = [0.0, 1.0, 2.0, 3.0]
    far_fixes(tmp_path, [complex(t * t, 0) for t in time_s], time_s, start_s=0.0)
    write_file(tmp_path, "truth.csv", time_s=[3.5], x_m=[3.5**2], y_m=[0.0])
    tables = run(tmp_path, settings_from(BELIEVING), "ekf")
    assert tables["errors"]["error_x_m"][0] == pytest.approx(0.0, abs=0.01)
    assert tables["errors"]["error_y_m"][0] == pytest.approx(0.0, abs=0.01)


def test_a_tracker_is_scored_from_its_start_on(tmp_path: Path) -> None:
    far_fixes(tmp_path, [0j, 0j], [1.0, 2.0])
    write_file(tmp_path, "truth.csv", time_s=[0.5, 1.0, 1.5], x_m=[0.0] * 3, y_m=[0.0] * 3)
    errors = run(tmp_path, settings_from(BELIEVING), "ukf")["errors"]
    assert errors["time_s"].tolist() == [1.0, 1.5]


def test_a_fix_that_is_due_is_taken_whatever_its_rounding(tmp_path: Path) -> None:
    """0.4 - (0.1 + 0.2) is below 0.1 by a rounding."""
    time_s = [0.1, 0.2, 0.1 + 0.2, 0.4, 0.5]
    far_fixes(tmp_path, [0j] * 5, time_s)
    settings = settings_from({**BELIEVING, "interval": {"policy": "fixed", "interval_s": 0.1}})
    assert outcomes(run(tmp_path, settings, "aukf")) == ["accepted"] * 5
    settings = settings_from({**BELIEVING, "interval": {"policy": "fixed", "interval_s": 0.101}})
    assert outcomes(run(tmp_path, settings, "aukf"))[:3] == ["accepted", "held out", "accepted"]


@pytest.mark.parametrize("filter_name", ["ukf", "robust-ukf", "ekf", "aukf"])
def test_fixes_near_the_station_are_counted(tmp_path: Path, filter_name: Any) -> None:
    """A craft at rest 2 m from the station, known to 1 m: within five of its sigmas."""
    write_file(tmp_path, "fixes.csv", time_s=[1.0], source=[0], range_m=[2.0], bearing_rad=[0.0])
    write_file(tmp_path, "beacons.csv", source=[0], x_m=[0.0], y_m=[0.0])
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[2.0], y_m=[0.0], heading_rad=[0.0])
    result = replay(LogFolder(tmp_path), Settings(), filter_name=filter_name)
    assert result.numbers["near_field"] == 1
    far = settings_from({"fixes": {"near_field": 0.5}})
    assert replay(LogFolder(tmp_path), far, filter_name=filter_name).numbers["near_field"] == 0


def test_each_log_has_its_own_filter(tmp_path: Path) -> None:
    far_fixes(tmp_path / "fixes", [0j], [1.0])
    assert replay(LogFolder(tmp_path / "fixes"), Settings()).filter_name == "ukf"
    far_log(tmp_path / "ranges", [(1.0, 0.0)])
    assert replay(LogFolder(tmp_path / "ranges"), Settings()).filter_name == "robust-ekf"
    chosen = settings_from({"filter": {"kind": "robust-ukf"}})
    assert replay(LogFolder(tmp_path / "ranges"), chosen).filter_name == "robust-ukf"
    result = replay(LogFolder(tmp_path / "ranges"), chosen, filter_name="ekf")
    assert result.filter_name == "ekf"


@pytest.mark.parametrize(
    ("policy", "expected"),
    [
        ("fixed", FixedInterval(interval_s=4.0)),
        (
            "covariance-budget",
            CovarianceBudget(initial_s=0.25, min_s=0.25, max_s=8.0, position_sigma_m=0.75),
        ),
        ("mahalanobis", MahalanobisInterval(initial_s=0.25, min_s=0.25, max_s=8.0)),
    ],
)
def test_interval_policies_of_the_settings(policy: str, expected: object) -> None:
    given = {"policy": policy, "interval_s": 4.0, "min_s": 0.25, "max_s": 8.0}
    settings = settings_from({"interval": {**given, "position_sigma_m": 0.75}})
    assert engine.interval_policy(settings.interval) == expected


@pytest.mark.parametrize("filter_name", ["ukf", "aukf"])
def test_held_out_fixes_are_predicted(tmp_path: Path, filter_name: Any) -> None:
    time_s, path = fixes_log(tmp_path)
    write_file(tmp_path, "beacons.csv", source=[0, 1], x_m=[2.0, 2.0], y_m=[-1.0, -1.0])
    source = np.zeros(len(time_s), int)
    at = complex(*STATION[0])
    write_file(tmp_path, "fixes.csv", time_s=time_s, source=source, range_m=np.abs(path - at),
               bearing_rad=np.angle(path - at))  # fmt: skip
    thinned = {"fixes": {"every_s": 2.0}} if filter_name == "ukf" else {}
    settings = settings_from({**thinned, "interval": {"policy": "fixed", "interval_s": 2.0}})
    measured = run(tmp_path, settings, filter_name)["measurements"]
    held = measured["outcome"] == "held out"
    np.testing.assert_array_equal(held, np.arange(len(time_s)) % 4 != 0)
    # At rest from the first fix: the first predictions miss what the craft did since.
    moved = np.abs(path[1:4] - path[0])
    np.testing.assert_allclose(measured["held_out_error_m"][1:4], moved, rtol=1e-12)
    assert np.abs(measured["held_out_error_m"][held][-6:]).max() < 0.02
    assert np.isnan(measured["held_out_error_m"][~held]).all()


def test_aukf_is_the_filter_step_by_step(tmp_path: Path) -> None:
    """It takes the first fix that is not before its due time, and the others are predicted."""
    time_s, path = fixes_log(tmp_path)
    write_file(tmp_path, "beacons.csv", source=[0, 1], x_m=[2.0, 2.0], y_m=[-1.0, -1.0])
    seen = path - (2 - 1j)
    write_file(
        tmp_path,
        "fixes.csv",
        time_s=time_s,
        source=np.arange(len(time_s)) % 2,
        range_m=np.abs(seen),
        bearing_rad=np.angle(seen),
    )
    settings = settings_from(
        {"interval": {"policy": "covariance-budget", "position_sigma_m": 0.4, "max_s": 3.0}}
    )
    tables = run(tmp_path, settings, "aukf")
    start, process = settings.start, settings.process
    sigmas = [start.sigma_position_m, start.sigma_speed_m_s, start.sigma_acceleration_m_s2]
    aukf = Aukf(
        [path[0].real, path[0].imag, 0, 0, 0, 0],
        np.diag(np.repeat(sigmas, 2)) ** 2,
        process=ConstantAcceleration(
            position_psd=process.position_psd,
            velocity_psd=process.velocity_psd,
            acceleration_psd=process.acceleration_psd,
        ),
        sensors=RangeBearing(station=(2.0, -1.0), sigma_range_m=0.1, sigma_bearing_rad=0.02),
        policy=CovarianceBudget(initial_s=0.5, min_s=0.5, max_s=3.0, position_sigma_m=0.4),
        alpha=settings.filter.alpha,
    )
    x, used, held, last = [], [], [], 0
    for k in range(1, len(time_s)):
        dt = time_s[k] - time_s[last]
        if dt < aukf.interval - 1e-9:
            predicted = aukf.process.Phi(dt) @ aukf.x
            held.append(abs(complex(predicted[0], predicted[1]) - path[k]))
            continue
        aukf.predict(dt)
        aukf.update([abs(seen[k]), np.angle(seen[k])])
        aukf.feedback()
        x.append(aukf.x)
        used.append(time_s[k])
        last = k
    assert len(set(np.diff(used).round(3))) > 1  # the interval did adapt
    assert len(held) > 5
    estimates, measured = tables["estimates"], tables["measurements"]
    np.testing.assert_array_equal(estimates["time_s"], used)
    np.testing.assert_allclose(estimates["x_m"], np.array(x)[:, 0], rtol=1e-12)
    np.testing.assert_allclose(estimates["y_m"], np.array(x)[:, 1], rtol=1e-12)
    errors = measured["held_out_error_m"][measured["outcome"] == "held out"]
    np.testing.assert_allclose(errors, held, rtol=1e-7, atol=1e-12)
    numbers = replay(LogFolder(tmp_path), settings, filter_name="aukf").numbers
    assert numbers["held_out_rmse_m"] == pytest.approx(math.sqrt(np.square(held).mean()))


def test_aukf_is_for_fixes(tmp_path: Path) -> None:
    velocity_log(tmp_path)
    with pytest.raises(ValueError, match="filter aukf chooses when to take a fix"):
        replay(LogFolder(tmp_path), Settings(), filter_name="aukf")


@pytest.mark.parametrize("filter_name", ["ekf", "robust-ekf", "ukf", "robust-ukf"])
@pytest.mark.parametrize("log", [velocity_log, fixes_log])
def test_every_filter_runs(tmp_path: Path, log: Callable[[Path], Any], filter_name: Any) -> None:
    log(tmp_path)
    numbers = replay(LogFolder(tmp_path), Settings(), filter_name=filter_name).numbers
    assert numbers["rmse_m"] < 0.5
    assert numbers["accepted"] > 20


# ---- Settings ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", packaged_settings())
def test_packaged_settings_have_one_kernel(name: str) -> None:
    assert replace(find_settings(name).filter, kind=None) == Settings().filter


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[ranges]\nsigma = 1.0", r"\[ranges\] has no 'sigma'; known are sigma_m, every_s"),
        ("[range]\nsigma_m = 1.0", r"has no 'range'; known are filter, kernel, start"),
        ("[ranges]\nsigma_m = 0.0", r"\[ranges\] sigma_m must be positive"),
        ("[ranges]\nsigma_m = '1'", r"\[ranges\] sigma_m must be a number, not str"),
        ("[log]\nreorder_s = -1", r"\[log\] reorder_s must not be negative"),
        ("[log]\nreorder_s = inf", r"\[log\] reorder_s must be finite"),
        ("[filter]\nkind = 'kf'", r"\[filter\] kind must be one of 'ekf', 'ukf'"),
        ("[filter]\nkernel = 'cauchy'", r"\[filter\] kernel must be one of 'huber'"),
        ("ranges = 3", r"\[ranges\] must be a section"),
        ("[ranges", "is not TOML"),
    ],
)
def test_settings_refuse_by_name(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "run.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=words) as caught:
        read_settings(path)
    assert str(caught.value).startswith(str(path))


def test_settings_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no such file; the package's settings are goats14, hat_"):
        find_settings(str(tmp_path / "none.toml"))


def test_a_file_goes_before_packaged_settings_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_settings("goats14").ranges.sigma_m == 1.5
    Path("goats14").write_text("[ranges]\nsigma_m = 7.0\n")
    assert find_settings("goats14").ranges.sigma_m == 7.0


def test_the_documented_settings_are_the_defaults(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "logs.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    block = next(one for one in blocks if one.startswith("[filter]"))
    (tmp_path / "all.toml").write_text(block)
    default = Settings()
    kind = replace(default.filter, kind="robust-ekf")
    assert read_settings(tmp_path / "all.toml") == replace(default, filter=kind)
    for section in fields(default):
        for entry in fields(getattr(default, section.name)) if section.name != "files" else ():
            optional = "(# )?" if entry.default is None else ""
            assert re.search(rf"^{optional}{entry.name} = ", block, re.MULTILINE), entry.name


def test_the_documented_layout_is_the_layout() -> None:
    page = (ROOT / "docs" / "logs.md").read_text(encoding="utf-8")
    for name, layouts in FILES.items():
        assert f"`{name}`" in page
        for layout in layouts:
            also = ", ".join(f"`{column.name}`" for column in layout.optional)
            optionally = f" and optionally {also}" if also else ""
            required = ",".join(column.name for column in layout.required)
            assert f"`{required}`{optionally} |" in page, (name, layout)
    for names, spellings in SPELLINGS.items():
        for other in spellings:
            pair = [", ".join(f"`{name}`" for name in one) for one in (names, other)]
            assert f"| {pair[0]} | {pair[1]} |" in page


# ---- The command ---------------------------------------------------------------------------------


def call(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_command_writes_tables_track_figure_and_report(tmp_path: Path) -> None:
    log = increments_log(tmp_path / "log")
    result = call(
        "replay", tmp_path / "log", "--output", tmp_path / "out", "--format", "both", "--json",
        "--quiet",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["command"] == "replay"
    (run_,) = document["logs"]
    folder = tmp_path / "out" / "log"
    assert json.loads((folder / "results.json").read_text()) == run_
    assert (run_["log"], run_["filter"], run_["measurements"]) == ("log", "robust-ekf", 20)
    for name in ("estimates", "measurements", "errors"):
        table = pa_parquet.read_table(folder / f"{name}.parquet")
        assert pa_csv.read_csv(folder / f"{name}.csv").column_names == table.column_names
        assert len(table) == {"estimates": 40, "measurements": 20, "errors": 40}[name]
    errors = pa_parquet.read_table(folder / "errors.parquet")
    square = errors["error_x_m"].to_numpy() ** 2 + errors["error_y_m"].to_numpy() ** 2
    assert run_["rmse_m"] == pytest.approx(math.sqrt(square.mean()))
    track = np.loadtxt(folder / "trajectory.tum")  # time x y z qx qy qz qw
    estimates = pa_parquet.read_table(folder / "estimates.parquet")
    np.testing.assert_allclose(track[:, 0], log["time_s"])
    np.testing.assert_allclose(track[:, 1], estimates["x_m"].to_numpy())
    np.testing.assert_allclose(
        2 * np.arctan2(track[:, 6], track[:, 7]), estimates["heading_rad"].to_numpy()
    )
    np.testing.assert_array_equal(track[:, 3:6], 0.0)
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "report.html").stat().st_size > 50_000


def test_command_says_what_was_not_used(tmp_path: Path) -> None:
    log = increments_log(tmp_path / "log")
    time_s = log["time_s"].copy()
    time_s[[4, 5]] = time_s[[5, 4]]
    time_s[-1] = 99.0
    write_file(tmp_path / "log", "ranges.csv", time_s=time_s, source=log["source"],
               range_m=log["range_m"])  # fmt: skip
    result = call("replay", tmp_path / "log", "--output", tmp_path / "out")
    assert result.exit_code == 0
    words = " ".join(result.stderr.split())
    assert "ranges.csv: 1 not used, later than the window of 0 s allows (line 7)." in words
    assert "Measurements: 1 not used, taken after the last line of the odometry." in words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "nowhere: there is no such folder"),
        (["log/ranges.csv"], "ranges.csv: is a file; a log is a folder of CSV files (auvest check"),
        (["log", "--write", "none"], "'none' is not one of report, "),
        (["log", "./log"], "two logs have the name log"),
        (["log", "--config", "none.toml"], "none.toml: there is no such file"),
        (["log", "--filter", "aukf"], "filter aukf chooses"),
    ],
)
def test_command_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    increments_log(tmp_path / "log")
    result = call("replay", *arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.split())
    assert result.stdout == ""


def test_import_command(tmp_path: Path) -> None:
    source = tmp_path / "ugps"
    source.mkdir()
    for number in (1, 2):
        (source / f"fixes_{number}.csv").write_text(
            "t,valid,x_fwd,y_stbd\n0.0,1,3.0,4.0\n0.5,0,3.0,4.0\n1.0,1,0.0,2.0\n"
        )
    result = call("import", "ugps_pier59", source, tmp_path / "logs", "--json")
    assert result.exit_code == 0, result.output
    folders = [Path(path) for path in json.loads(result.stdout)["logs"]]
    assert [folder.name for folder in folders] == ["ugps_1", "ugps_2"]
    np.testing.assert_allclose(
        LogFolder(folders[0])["fixes.csv"].whole(),
        [[0.0, 0, 5.0, math.atan2(4, 3)], [1.0, 0, 2.0, math.pi / 2]],
    )
    assert call("import", "ugps_pier59", tmp_path, tmp_path / "logs").exit_code == 2


# ---- Long logs -----------------------------------------------------------------------------------


def long_log(folder: Path, rows: int) -> Path:
    """Half of the rows odometry at 10 Hz around a circle, half ranges."""
    folder.mkdir()
    count = rows // 2
    time_s = 0.1 * np.arange(1, count + 1)
    path = 1 + 2j + 100j * (1 - np.exp(1j * 0.001 * np.arange(1, count + 1)))
    turn = np.full(count, 0.001)
    chord = 100 * (np.exp(0.001j) - 1) / 1j
    source = np.arange(count) % 2
    ranges = np.abs(path - np.array([40.0, 30.0j])[source])
    tables: dict[str, dict[str, Any]] = {
        "odometry.csv": {
            "time_s": time_s,
            "forward_m": np.full(count, chord.real),
            "left_m": np.full(count, chord.imag),
            "turn_rad": turn,
        },
        "ranges.csv": {"time_s": time_s, "source": 3 + 2 * source, "range_m": ranges},
    }
    for name, columns in tables.items():
        options = pa_csv.WriteOptions(quoting_style="none")
        pa_csv.write_csv(pa.table(columns), folder / name, options)
        text = (folder / name).read_bytes()
        (folder / name).write_bytes(text.replace(b'"', b"", 2 * len(columns)))
    beacons(folder)
    start(folder)
    return folder


_PEAK = """
import sys
from pathlib import Path
from auvest.logs import LogFolder
from auvest.replay import Settings, replay
tables = ["estimates", "measurements", "errors", "tracks"]
result = replay(LogFolder(Path(sys.argv[1])), Settings(), folder=Path(sys.argv[2]), write=tables)
status = Path("/proc/self/status").read_text()  # ru_maxrss would count the parent's memory too
peak = int(status.split("VmHWM:")[1].split()[0])
print(peak, result.numbers["estimates"], result.numbers["measurements"])
"""


def peak_kb(log: Path, output: Path) -> tuple[int, int, int]:
    output.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", _PEAK, log, output], capture_output=True, text=True, check=True
    )
    peak, estimates, measurements = map(int, done.stdout.split())
    return peak, estimates, measurements


@pytest.fixture(scope="module")
def million(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return long_log(tmp_path_factory.mktemp("log") / "million", 1_000_000)


def test_a_million_rows_take_no_more_memory_than_fewer(tmp_path: Path, million: Path) -> None:
    short, *_ = peak_kb(long_log(tmp_path / "short", 250_000), tmp_path / "short_out")
    long, estimates, measurements = peak_kb(million, tmp_path / "long_out")
    assert (estimates, measurements) == (500_000, 500_000)
    # As arrays the tables alone would be 500,000 x (9 + 13) x 8 bytes = 88 MB.
    assert long - short < 20_000
    assert long < 200_000


def test_ctrl_c_keeps_what_was_done(tmp_path: Path, million: Path) -> None:
    output = tmp_path / "out"
    program = start_program(
        [
            sys.executable,
            "-m",
            "auvest",
            "replay",
            million,
            "--output",
            output,
            "--format",
            "both",
            "--json",
        ],
        env={**os.environ, "COLUMNS": "200"},
    )
    track = output / "million.unfinished" / "trajectory.tum"
    wait_until(
        lambda: track.exists() and track.stat().st_size > 100_000, "nothing was written", program
    )
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 130, err
    assert "interrupted in million: what was done is written" in " ".join(err.split())
    (result,) = json.loads(out)["logs"]
    assert result["interrupted"]
    table = pa_parquet.read_table(output / "million" / "estimates.parquet")
    assert 0 < len(table) < 500_000
    for name in ("estimates", "errors", "measurements"):  # all of the same moment
        rows = len(pa_parquet.read_table(output / "million" / f"{name}.parquet"))
        assert len(pa_csv.read_csv(output / "million" / f"{name}.csv")) == rows
        if name in result:
            assert result[name] == rows
    with track.parent.with_name("million").joinpath("trajectory.tum").open() as file:
        assert sum(1 for _ in file) == len(table)
    assert "interrupted" in (output / "million" / "report.html").read_text()
