"""Replays of logs of echoes: SLATF 1.0 and 2.0, SlatfJoint and EKF-SLAT."""

from __future__ import annotations

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.csv as pa_csv
import pyarrow.parquet as parquet
import pytest
from test_replay_report import opened
from typer.testing import CliRunner

from auvest.cli import app
from auvest.importers.sets import IMPORTERS
from auvest.logs import LogError, LogFolder, reader
from auvest.logs.write import write_file
from auvest.replay import Settings, checks, drawing, read_settings, replay, report, settings_from
from auvest.replay.readings import Held
from auvest.replay.thinning import Spacing
from auvest.simulation.paper_slatf import paper_filter
from auvest.simulation.slat import SlatScenario, paper_masters, simulate
from auvest.simulation.slat_log import write_log

FILTERS = ("slatf1", "slatf2", "slatf-joint", "ekf-slat")
#: Echoes as :func:`sea` has them.
EXACT: dict[str, Any] = {
    "start": {"sigma_position_m": 0.0, "sigma_heading_rad": 0.0},
    "slave": {"sigma_speed_m_s": 0.05, "sigma_yaw_rate_rad_s": 0.001},
    "sonar": {"sigma_range_m": 0.5, "sigma_bearing_rad": 0.01},
    "masters": {"sigma_velocity_m_s": 1.0},
    "slat": {"particles": 200},
}


def columns_of(path: Path) -> dict[str, Any]:
    table = parquet.read_table(path)
    return {name: table[name].to_numpy() for name in table.column_names}


@pytest.mark.parametrize(
    ("name", "scenario", "options"),
    [
        ("slatf1", {}, {}),
        ("slatf2", {}, {}),
        ("slatf_joint", {}, {}),
        ("slatf_joint", {}, {"covariance": "shared"}),
        ("ekf_slat", {}, {}),
        ("slatf2", {"masters": paper_masters(3), "dropout": 0.2}, {"gate": 16.0}),
        ("slatf2", {"plan_known": False, "identified": False}, {"dtype": "float32"}),
        ("ekf_slat", {"masters": paper_masters(2), "identified": False}, {"gate": 16.0}),
    ],
)
def test_a_simulated_log_has_the_bits_of_the_simulation(
    tmp_path: Path, name: Any, scenario: dict[str, Any], options: dict[str, Any]
) -> None:
    """With the masters' turn at 240 s, and the second run's own random numbers."""
    sea = SlatScenario(runs=2, duration_s=300, **scenario)
    filter_ = paper_filter(name, sea, **options)
    expected = simulate(filter_, sea)
    write_log(tmp_path / "log", filter_, sea, run=1)
    settings = read_settings(tmp_path / "log/auvest.toml")
    out = tmp_path / "out"
    out.mkdir()
    result = replay(LogFolder(tmp_path / "log"), settings, folder=out)
    told = columns_of(out / "estimates.parquet")
    at = np.searchsorted(told["time_s"], expected.time_s)
    np.testing.assert_array_equal(told["time_s"][at], expected.time_s)
    error = np.column_stack([told["x_m"], told["y_m"]])[at] - expected.truth
    np.testing.assert_array_equal(error, expected.error[1])
    np.testing.assert_array_equal(told["var_x_m2"][at], expected.covariance[1, :, 0, 0])
    np.testing.assert_array_equal(told["cov_xy_m2"][at], expected.covariance[1, :, 0, 1])
    masters = columns_of(out / "masters.parquet")
    for n in range(len(sea.masters)):
        own = {name: values[masters["source"] == n] for name, values in masters.items()}
        at = np.searchsorted(own["time_s"], expected.time_s)
        where = np.column_stack([own["x_m"], own["y_m"]])[at]
        np.testing.assert_array_equal(
            where - expected.masters[:, n], expected.master_error[1, :, n]
        )
    assert result.numbers["rejected"] == expected.refused[1]


def test_the_command_writes_a_log_that_replay_takes(tmp_path: Path) -> None:
    out = str(tmp_path / "sea")
    arguments = ["simulate", "slatf", "--runs", "1", "--log", "--output", out, "--no-figure"]
    done = CliRunner().invoke(app, [*arguments, "--json", "--quiet"])
    assert done.exit_code == 0, done.output
    simulated = json.loads(done.stdout)
    assert simulated["files"]["log"] == f"{out}/log"
    arguments = ["replay", f"{out}/log", "--config", f"{out}/log/auvest.toml", "--output"]
    done = CliRunner().invoke(app, [*arguments, str(tmp_path / "out"), "--json", "--quiet"])
    assert done.exit_code == 0, done.output
    (told,) = json.loads(done.stdout)["logs"]
    assert told["filter"] == "slatf2"
    assert [one["cause"] for one in told["findings"]] == ["overconfident"]
    errors = columns_of(tmp_path / "out/log/errors.parquet")
    square = errors["error_x_m"] ** 2 + errors["error_y_m"] ** 2
    rmse_m = math.sqrt(square[errors["time_s"] % 2 == 0].mean())
    assert rmse_m == pytest.approx(simulated["results"]["rmse_m"], rel=1e-12)
    refused = ["simulate", "slatf", "--filter", "dead-reckoning", "--log", "--output", out]
    assert "hears no echo" in CliRunner().invoke(app, refused).output


def sea(folder: Path, *, increments: bool = False, sources: tuple[int, ...] = (7,)) -> None:
    """Write an exact log: a slave on a circle, masters that go straight, 60 s."""
    t = np.arange(0, 60.05, 0.1)
    heading = 0.05 * t
    x, y = 20 * np.sin(heading), 20 * (1 - np.cos(heading))
    if increments:
        # An increment of the reading that holds from the line before.
        write_file(
            folder, "odometry.csv", time_s=t[1:], forward_m=np.diff(t), turn_rad=0.05 * np.diff(t)
        )
    else:
        ones = np.ones(len(t))
        write_file(folder, "odometry.csv", time_s=t, speed_m_s=ones, yaw_rate_rad_s=0.05 * ones)
    heard = np.arange(10, len(t), 20)
    rows, truth = [], []
    for n, source in enumerate(sources):
        mx, my = 30 + 0.5 * t, 40 - 15 * n - 0.2 * t
        truth += [(t[k], source, mx[k], my[k]) for k in range(len(t))]
        bearing = np.arctan2(my - y, mx - x) - heading
        rows += [
            (
                t[k],
                source,
                math.hypot(mx[k] - x[k], my[k] - y[k]),
                math.remainder(bearing[k], math.tau),
            )
            for k in heard
        ]
    names = ("time_s", "source", "range_m", "bearing_rad")
    columns = dict(zip(names, zip(*sorted(rows), strict=True), strict=True))
    write_file(folder, "echoes.csv", **columns)
    names = ("time_s", "source", "x_m", "y_m")
    write_file(
        folder,
        "master_truth.csv",
        **dict(zip(names, zip(*sorted(truth), strict=True), strict=True)),
    )
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    write_file(folder, "truth.csv", time_s=t, x_m=x, y_m=y)


@pytest.mark.parametrize("name", FILTERS)
def test_exact_echoes_leave_an_exact_track(tmp_path: Path, name: Any) -> None:
    """A master whose place and velocity the echoes tell; it is known from the first of them."""
    sea(tmp_path)
    result = replay(LogFolder(tmp_path), settings_from(EXACT), filter_name=name)
    numbers = result.numbers
    assert numbers["accepted"] == numbers["measurements"] == 30
    assert numbers["dead_reckoned_rmse_m"] < 0.1  # of steps that are no arcs
    assert numbers["rmse_m"] < 0.5
    assert list(numbers["masters"]) == ["7"]
    assert numbers["masters"]["7"]["estimates"] == 590  # after 1 s
    assert numbers["masters"]["7"]["relative_rmse_m"] < 1.0
    assert numbers["truth"] == numbers["estimates"] == 600
    said = dict(report.rows(result))
    assert said["master 7: position RMSE"].endswith(" m")
    # Innovations are those of the means: the first echo has none, all others are small.
    rows = result.measurements.columns()
    assert np.isnan(rows["innovation_0"][0])
    assert np.abs(rows["innovation_0"][5:]).max() < 1.5
    assert np.abs(rows["innovation_1"][5:]).max() < 0.05
    # The page draws the ray to where the master is believed to be.
    assert np.hypot(rows["place_x_m"][-1] - 59.5, rows["place_y_m"][-1] - 28.2) < 2.0


@pytest.mark.parametrize("name", ["slatf2", "ekf-slat"])
def test_the_page_draws_masters_where_they_are_believed_to_be(tmp_path: Path, name: Any) -> None:
    """As leaders are; innovations have no sigma, and particles no NIS."""
    sea(tmp_path / "log", sources=(7, 9))
    result = replay(LogFolder(tmp_path / "log"), settings_from(EXACT), filter_name=name)
    found = opened(report.html(result), tmp_path, 'await step("opened", () => slide(59));')
    assert found["trouble"] == []
    drawn = drawing.document([result])["leaders"]
    assert [one["source"] for one in drawn] == [7, 9]
    for one in drawn:
        kind, raw = one["points"]["x_m"]["kind"], one["points"]["x_m"]["bytes"]
        x = np.frombuffer(base64.b64decode(raw), kind) + one["points"]["x_m"]["offset"]
        np.testing.assert_allclose(x, 30 + 0.5 * np.arange(1, 60, 2), atol=3)


@pytest.mark.parametrize("name", ["slatf2", "ekf-slat"])
def test_the_track_does_not_depend_on_where_the_clock_starts(tmp_path: Path, name: Any) -> None:
    """Intervals are those of times that are rounded 2^12 s later, by up to 2^-41 s."""
    sea(tmp_path / "log")
    before = replay(LogFolder(tmp_path / "log"), settings_from(EXACT), filter_name=name)
    for path in (tmp_path / "log").glob("*.csv"):
        header, *lines = path.read_text().splitlines()
        cells = (line.split(",", 1) for line in lines)
        later = [f"{float(time) + 4096!r},{rest}" for time, rest in cells]
        path.write_text("\n".join([header, *later]) + "\n")
    after = replay(LogFolder(tmp_path / "log"), settings_from(EXACT), filter_name=name)
    a, b = before.estimates.columns(), after.estimates.columns()
    np.testing.assert_allclose(b["time_s"], a["time_s"] + 4096, rtol=0, atol=1e-9)
    for column in ("x_m", "y_m", "heading_rad"):
        np.testing.assert_allclose(b[column], a[column], rtol=0, atol=1e-6)


def test_increments_are_the_velocities_that_they_come_from(tmp_path: Path) -> None:
    sea(tmp_path / "speeds")
    sea(tmp_path / "steps", increments=True)
    both = [
        replay(LogFolder(tmp_path / name), settings_from(EXACT), filter_name="ekf-slat").estimates
        for name in ("speeds", "steps")
    ]
    a, b = (one.columns() for one in both)
    np.testing.assert_allclose(a["x_m"], b["x_m"], atol=1e-9)
    np.testing.assert_allclose(a["heading_rad"], b["heading_rad"], atol=1e-11)


@pytest.mark.parametrize("mean_s", [0.0, 0.5])
def test_the_result_does_not_depend_on_the_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mean_s: float
) -> None:
    sea(tmp_path, sources=(3, 9))
    settings = settings_from({**EXACT, "slave": {**EXACT["slave"], "mean_s": mean_s}})
    made = []
    for lines in (reader.CHUNK_LINES, 17):
        monkeypatch.setattr(reader, "CHUNK_LINES", lines)
        result = replay(LogFolder(tmp_path), settings, filter_name="slatf2")
        made.append(
            (result.estimates.columns(), result.numbers["masters"], result.errors.columns())
        )
    for name in made[0][0]:
        np.testing.assert_array_equal(made[0][0][name], made[1][0][name])
    for source, own in made[0][1].items():
        assert own == pytest.approx(made[1][1][source], rel=1e-12)
    np.testing.assert_array_equal(made[0][2]["error_x_m"], made[1][2]["error_x_m"])


def test_behind_the_last_echo_means_of_readings_carry_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sea(tmp_path)
    lines = (tmp_path / "echoes.csv").read_text().splitlines(keepends=True)
    (tmp_path / "echoes.csv").write_text("".join(lines[:11]))  # 1 s to 19 s
    monkeypatch.setattr(reader, "CHUNK_LINES", 17)
    settings = settings_from({**EXACT, "slave": {**EXACT["slave"], "mean_s": 0.5}})
    result = replay(LogFolder(tmp_path), settings, filter_name="slatf2")
    time_s = result.estimates.columns()["time_s"]
    assert time_s[-1] == 60
    assert np.diff(time_s).max() < 0.75  # half a second, in whole steps
    assert result.numbers["rmse_m"] < 0.5


def test_a_wrong_echo_is_refused_and_named(tmp_path: Path) -> None:
    sea(tmp_path)
    path = tmp_path / "echoes.csv"
    lines = path.read_text().splitlines()
    time, source, range_m, bearing = lines[16].split(",")
    lines[16] = f"{time},{source},{float(range_m) + 30},{bearing}"
    path.write_text("\n".join(lines) + "\n")
    for name in FILTERS:
        result = replay(LogFolder(tmp_path), settings_from(EXACT), filter_name=name)  # type: ignore[arg-type]
        rows = result.measurements.columns()
        assert np.flatnonzero(rows["outcome"] == "rejected").tolist() == [15]
        assert rows["weight_0"][15] == 0.0
        assert rows["innovation_0"][15] == pytest.approx(30, abs=1)
        assert np.isfinite(rows["nis"]).any() == (name == "ekf-slat")
        if name == "ekf-slat":  # it shows though it was refused; the first echo has none
            assert rows["nis"][15] > 13.8
            assert np.isnan(rows["nis"]).sum() == 1
            assert np.delete(rows["nis"], [0, 15]).max() < 13.8


def test_a_gate_that_refuses_nearly_all_is_said(tmp_path: Path) -> None:
    sea(tmp_path)
    tight = settings_from({**EXACT, "slat": {"gate": 1e-9, "recover_after": 0}})
    result = replay(LogFolder(tmp_path), tight, filter_name="slatf2")
    assert result.health.verdict == "not_trusted"
    assert "the gate refused" in result.health.reason


def test_masters_that_are_told_of_later_are_not_known_before(tmp_path: Path) -> None:
    sea(tmp_path)
    write_file(tmp_path, "masters.csv", time_s=[20.0], source=[7], x_m=[40.0], y_m=[36.0],
               vx_m_s=[0.5], vy_m_s=[-0.2], sigma_m=[0.1], sigma_velocity_m_s=[0.1])  # fmt: skip
    result = replay(LogFolder(tmp_path), settings_from(EXACT), filter_name="ekf-slat")
    assert result.numbers["no_position"] == 10  # 1, 3, ... 19 s
    assert result.numbers["masters"]["7"]["estimates"] == 400
    assert result.numbers["masters"]["7"]["rmse_m"] < 0.5
    again = {"time_s": [20.0, 30.0], "source": [7, 7], "x_m": [40.0, 40.0], "y_m": [36.0, 36.0]}
    write_file(tmp_path, "masters.csv", **again)
    with pytest.raises(
        LogError, match=r"masters\.csv, line 3, column source: source 7 is there tw"
    ):
        replay(LogFolder(tmp_path), settings_from(EXACT), filter_name="ekf-slat")


def test_echoes_and_filters_that_do_not_go_together_are_refused(tmp_path: Path) -> None:
    sea(tmp_path / "log", sources=(1, 2))
    log = LogFolder(tmp_path / "log")
    assert checks.filter_of(log, Settings(), None) == "slatf-joint"
    with pytest.raises(ValueError, match="filter ekf: this log has echoes of masters; take slatf1"):
        replay(log, Settings(), filter_name="ekf")
    with pytest.raises(ValueError, match=r"\[slat\] max_masters is 1, and source 2 is one more"):
        replay(log, Settings(), filter_name="slatf-joint")
    with pytest.raises(ValueError, match="cannot be smoothed"):
        replay(log, Settings(), filter_name="slatf2", smooth=True)
    imm = settings_from({"masters": {"model": "imm"}})
    with pytest.raises(ValueError, match=r"slatf-joint takes .*'piecewise', not 'imm'"):
        replay(log, imm, filter_name="slatf-joint")
    write_file(tmp_path / "log", "ranges.csv", time_s=[1.0], source=[1], range_m=[1.0])
    with pytest.raises(LogError, match=r"has echoes\.csv and ranges\.csv"):
        LogFolder(tmp_path / "log")
    (tmp_path / "log/ranges.csv").unlink()
    (tmp_path / "log/odometry.csv").unlink()
    with pytest.raises(LogError, match=r"has echoes\.csv but no odometry\.csv"):
        LogFolder(tmp_path / "log")
    write_file(tmp_path / "log", "odometry.csv", time_s=[1.0], speed_m_s=[1.0])
    with pytest.raises(LogError, match="how does the slave turn"):
        LogFolder(tmp_path / "log")
    write_file(tmp_path / "log", "odometry.csv", time_s=[1.0], forward_m=[1.0], left_m=[0.0],
               turn_rad=[0.0])  # fmt: skip
    with pytest.raises(LogError, match="sideways"):
        LogFolder(tmp_path / "log")


def test_settings_of_the_other_kind_are_named(tmp_path: Path) -> None:
    sea(tmp_path)
    idle = settings_from({**EXACT, "ranges": {"sigma_m": 2.0}})
    found = checks.check(tmp_path, idle, "ekf-slat").findings
    assert [one.message for one in found if one.cause == "ignored_settings"] == [
        "[ranges] of the settings is of no use here: it is for logs of ranging"
    ]


def test_held_numbers_by_hand() -> None:
    """A line that holds on; no longer than a gap; means over steps across lines."""
    held = Held(2, gap_s=2.0, stops=(True, False))
    held.add(np.array([1.0, 2.0]), np.array([[1.0, 10.0], [3.0, 30.0]]))
    held.add(np.array([6.0]), np.array([[5.0, 50.0]]))
    assert held.until(100.0).tolist() == [1.0, 2.0, 4.0, 6.0, 8.0]  # 4 and 8: where it stops
    at = held.at(np.array([0.0, 1.0, 3.9, 4.0, 6.5, 9.0]))
    assert at.tolist() == [[0, 0], [1, 10], [3, 30], [0, 30], [5, 50], [0, 50]]
    means = held.means(np.array([0.0, 1.5, 3.0, 5.0, 9.0]))
    expected = [0.5 / 1.5, 3.5 / 1.5, 3.0 / 2.0, 10.0 / 4.0]
    np.testing.assert_allclose(means[:, 0], expected, rtol=1e-14)
    held.forget(5.0)
    np.testing.assert_allclose(held.means(np.array([5.0, 9.0]))[0, 0], 2.5, rtol=1e-14)


def test_two_vehicles_become_a_log(tmp_path: Path) -> None:
    source = tmp_path / "pair"
    source.mkdir()
    (source / "odometry.csv").write_text("t,v,w\n0,1,0.1\n10,1,0.1\n")
    (source / "sonar.csv").write_text("t,range,bearing\n2,30,0.5\n4,31,7.0\n")
    (source / "groundtruth.csv").write_text("t,x,y,theta\n0,1,2,0.25\n10,9,4,1.25\n")
    (source / "master.csv").write_text("t,x,y\n0,30,3\n10,31,4\n")
    (made,) = IMPORTERS["two_vehicles"](source, tmp_path / "logs")
    log = LogFolder(made)
    assert log["echoes.csv"].whole().tolist() == [
        [2.0, 1.0, 30.0, 0.5], [4.0, 1.0, 31.0, pytest.approx(7.0 - 2 * math.pi)]
    ]  # fmt: skip
    assert log["master_truth.csv"].whole().tolist() == [[0, 1, 30, 3], [10, 1, 31, 4]]
    assert replay(log, settings_from(EXACT), filter_name="slatf2").numbers["measurements"] == 2


def test_what_is_written_is_chosen(tmp_path: Path) -> None:
    sea(tmp_path / "log")
    settings = tmp_path / "sea.toml"
    settings.write_text("[masters]\nsigma_velocity_m_s = 1.0\n")
    arguments = ["replay", str(tmp_path / "log"), "--config", str(settings), "--quiet"]

    def run(*more: str) -> set[str]:
        done = CliRunner().invoke(app, [*arguments, "--output", str(tmp_path / "out"), *more])
        assert done.exit_code == 0, done.output
        return {path.name for path in (tmp_path / "out/log").iterdir()} - {".auvest.json"}

    assert run() == {
        "estimates.parquet", "measurements.parquet", "errors.parquet", "masters.parquet",
        "trajectory.tum", "truth.tum", "figure.png", "report.html", "results.json",
    }  # fmt: skip
    whole = parquet.read_table(tmp_path / "out/log/masters.parquet").to_pydict()
    assert run("--write", "errors, masters", "--format", "csv", "--every", "2.5") == {
        "errors.csv", "masters.csv", "results.json",
    }  # fmt: skip
    errors = pa_csv.read_csv(tmp_path / "out/log/errors.csv").to_pydict()
    np.testing.assert_allclose(errors["time_s"], np.arange(0.1, 60, 2.5), atol=1e-9)
    thin = pa_csv.read_csv(tmp_path / "out/log/masters.csv").to_pydict()
    at = [whole["time_s"].index(time) for time in thin["time_s"]]
    assert thin["x_m"] == [whole["x_m"][k] for k in at]
    assert run("--write", "tracks") == {"trajectory.tum", "truth.tum", "results.json"}
    wrong = CliRunner().invoke(app, [*arguments, "--write", "errors,tables"])
    assert wrong.exit_code == 2
    said = " ".join(wrong.output.replace("│", " ").split())
    assert "'tables' is not one of report, figure, estimates" in said


def test_thinning_does_not_depend_on_the_parts() -> None:
    """Rows of one time stay together: several masters have one."""
    time = np.repeat(np.array([0.0, 0.4, 0.8, 1.0, 1.3, 3.2, 3.4]), 2)
    rows = {"time_s": time, "row": np.arange(len(time))}
    whole = Spacing(1.0).kept(rows)
    assert whole["row"].tolist() == [0, 1, 6, 7, 10, 11]
    for size in (1, 3, 7):  # the last cuts through a time that is kept
        parts = Spacing(1.0)
        cut = [{name: one[i : i + size] for name, one in rows.items()} for i in range(0, 14, size)]
        kept = np.concatenate([parts.kept(part)["row"] for part in cut])
        assert kept.tolist() == whole["row"].tolist()
    assert Spacing(0.0).kept(rows) is rows
