"""The columns of a log beside odometry and ranges: what each becomes in a replay, by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from auvest import (
    BodyVelocity,
    Depth,
    Ekf,
    LeaderRange,
    Odometry,
    Position,
    RangeBearing,
    RangeBearingElevation,
    WhiteAcceleration,
)
from auvest.logs import LogError, LogFolder, reader
from auvest.logs.check import survey
from auvest.logs.reading import seconds_of
from auvest.logs.write import write_file
from auvest.replay import Settings, checks, replay, settings_from
from auvest.replay.engine import replay_of
from auvest.replay.instruments import Instruments

SURE: dict[str, Any] = {
    "start": {"sigma_position_m": 1e-6, "sigma_heading_rad": 1e-6},
    "odometry": {"sigma_distance": 0.0, "sigma_drift": 1e-7, "sigma_turn": 1e-7},
}


def tables(
    log: Path, settings: Settings | None = None, filter_name: Any = "ekf"
) -> dict[str, dict[str, np.ndarray]]:
    engine = replay_of(LogFolder(log), settings or Settings(), filter_name)
    batches = list(engine.batches())
    return {
        name: {
            key: np.concatenate([getattr(one, name)[key] for one in batches])
            for key in getattr(batches[-1], name)
        }
        for name in ("estimates", "measurements", "errors")
    }


def ranging(folder: Path, until_s: float = 100.0) -> Path:
    """A beacon at (0, 30), a run that starts at (1, 2) headed along +x, a range at the end."""
    write_file(folder, "beacons.csv", source=[3], x_m=[0.0], y_m=[30.0])
    write_file(folder, "ranges.csv", time_s=[until_s], source=[3], range_m=[28.0])
    write_file(folder, "start.csv", time_s=[0.0], x_m=[1.0], y_m=[2.0], heading_rad=[0.0])
    return folder


def reckoned(found: dict[str, dict[str, np.ndarray]]) -> complex:
    """Where dead reckoning alone ends."""
    rows = found["estimates"]
    return complex(rows["dead_reckoned_x_m"][-1], rows["dead_reckoned_y_m"][-1])


QUARTER = 0.5 * math.pi
#: A quarter of a circle of 10 m radius to the left within 10 s, from (1, 2) along +x.
ARC_END = 11 + 12j
ARC_SPEED, ARC_RATE = QUARTER, QUARTER / 10


def arc_lines(kind: str) -> dict[str, np.ndarray]:
    """The quarter circle as odometry of each layout, a line a second."""
    time = np.arange(0.0, 11.0)
    heading = ARC_RATE * time
    same = np.ones(11)
    chord = 10 * (np.exp(1j * ARC_RATE) - 1) / 1j  # of one second
    slip = 0.25
    made = {
        "yaw rate": {"speed_m_s": ARC_SPEED * same, "yaw_rate_rad_s": ARC_RATE * same},
        "heading": {"speed_m_s": ARC_SPEED * same, "heading_rad": heading},
        "compass": {"speed_m_s": ARC_SPEED * same, "compass_rad": QUARTER - heading},
        "crab": {
            "speed_m_s": ARC_SPEED * math.cos(slip) * same,
            "left_m_s": ARC_SPEED * math.sin(slip) * same,
            "heading_rad": heading - slip,
        },
        "starboard": {
            "forward_m_s": ARC_SPEED * math.cos(slip) * same,
            "starboard_m_s": -ARC_SPEED * math.sin(slip) * same,
            "heading_rad": heading - slip,
        },
        "increments": {
            "forward_m": chord.real * same, "left_m": chord.imag * same, "heading_rad": heading,
        },
    }[kind]  # fmt: skip
    return {"time_s": time, **made}


@pytest.mark.parametrize("lines", [1, 3, 32768])
@pytest.mark.parametrize("kind", ["yaw rate", "heading", "compass", "crab", "starboard"])
def test_every_layout_of_velocities_drives_the_same_arc(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, lines: int
) -> None:
    """A craft that crabs by 0.25 rad is headed that much to the right of where it goes."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    log = ranging(tmp_path, until_s=10.0)
    write_file(log, "odometry.csv", **arc_lines(kind))
    if kind in ("crab", "starboard"):
        write_file(log, "start.csv", time_s=[0.0], x_m=[1.0], y_m=[2.0], heading_rad=[-0.25])
    assert abs(reckoned(tables(log)) - ARC_END) < 1e-9


@pytest.mark.parametrize("kind", ["heading", "compass"])
def test_without_a_heading_in_start_csv_the_compass_tells_it(tmp_path: Path, kind: str) -> None:
    """The start lies between two lines, the headings of which differ by a turn and a bit."""
    log = ranging(tmp_path, until_s=10.0)
    write_file(log, "odometry.csv", **arc_lines(kind))
    write_file(log, "start.csv", time_s=[0.5], x_m=[1.0], y_m=[2.0])
    engine = replay_of(LogFolder(log), Settings(), "ekf")
    assert engine.start == pytest.approx((0.5, 1.0, 2.0, 0.5 * ARC_RATE))
    settings = settings_from({"compass": {"offset_rad": 0.125}})
    engine = replay_of(LogFolder(log), settings, "ekf")
    assert engine.start[3] == pytest.approx(0.5 * ARC_RATE + 0.125)


def test_increments_with_a_heading_at_their_end(tmp_path: Path) -> None:
    """The first ends at the start and is left out; its heading counts."""
    log = ranging(tmp_path, until_s=10.0)
    write_file(log, "odometry.csv", **arc_lines("increments"))
    assert abs(reckoned(tables(log)) - ARC_END) < 1e-9


def test_distance_and_turn(tmp_path: Path) -> None:
    """A square: a metre, then a quarter turn to the left, four times, ends where it began."""
    log = ranging(tmp_path, until_s=4.0)
    write_file(log, "odometry.csv", time_s=[1.0, 2.0, 3.0, 4.0], distance_m=[1.0] * 4,
               turn_rad=[QUARTER] * 4)  # fmt: skip
    assert abs(reckoned(tables(log)) - (1 + 2j)) < 1e-9


@pytest.mark.parametrize("lines", [1, 2, 5, 32768])
@pytest.mark.parametrize("increments", [False, True])
def test_a_compass_of_its_own_rate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, increments: bool, lines: int
) -> None:
    """A DVL at 1 Hz, a compass at 2.5 Hz that begins before it; at 3 s it is about to pass pi."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    log = ranging(tmp_path, until_s=10.0)
    found = arc_lines("increments" if increments else "heading")
    del found["heading_rad"]
    write_file(log, "odometry.csv", **found)
    time = 0.4 * np.arange(-1, 26)
    heading = np.pi - 0.5 + ARC_RATE * time  # of a compass that is off by pi - 0.5
    write_file(log, "compass.csv", time_s=time, heading_rad=np.angle(np.exp(1j * heading)))
    assert abs(reckoned(tables(log)) - ARC_END) < 1e-9


def test_a_compass_that_ends_early_keeps_its_last_heading(tmp_path: Path) -> None:
    """2 m/s: 2 s along +x, then a turn to +y from 2 to 3 s; 1 m a second along that to 5 s."""
    log = ranging(tmp_path, until_s=5.0)
    time = np.arange(6.0)
    write_file(log, "odometry.csv", time_s=time, speed_m_s=np.array([2.0, 2, 0, 1, 1, 1]))
    write_file(log, "compass.csv", time_s=[0.0, 2.0, 3.0], heading_rad=[0.0, 0.0, QUARTER])
    assert abs(reckoned(tables(log)) - (1 + 2j + 4 + 2j)) < 1e-9


def test_a_velocity_holds_no_longer_than_a_gap_though_the_compass_goes_on(tmp_path: Path) -> None:
    log = ranging(tmp_path, until_s=20.0)
    write_file(log, "odometry.csv", time_s=[0.0, 20.0], speed_m_s=[1.0, 1.0])
    time = np.arange(21.0)
    write_file(log, "compass.csv", time_s=time, heading_rad=0 * time)
    settings = settings_from({"odometry": {"gap_s": 6.0}})
    # The line of the compass at 7 s is the first at which the velocity does not hold any more.
    assert abs(reckoned(tables(log, settings)) - (1 + 2j + 7)) < 1e-9


def test_a_slant_range_is_levelled_by_the_depths_then(tmp_path: Path) -> None:
    """The beacon stands 5 m deep; the craft sinks from 5 to 25 m in 10 s, and is 15 m away."""
    log = ranging(tmp_path)
    write_file(log, "odometry.csv", time_s=[0.0, 10.0], speed_m_s=[0.0, 0.0],
               yaw_rate_rad_s=[0.0, 0.0])  # fmt: skip
    write_file(log, "beacons.csv", source=[3], x_m=[1.0], y_m=[17.0], depth_m=[5.0])
    write_file(log, "depth.csv", time_s=[0.0, 10.0], depth_m=[5.0, 25.0])
    slant = [15.0, math.hypot(15, 10), math.hypot(15, 20)]
    write_file(log, "ranges.csv", time_s=[0.0, 5.0, 10.0], source=[3] * 3, range_m=slant)
    settings = settings_from({**SURE, "ranges": {"sigma_m": 0.5}})
    measured = tables(log, settings)["measurements"]
    np.testing.assert_allclose(measured["innovation_0"], 0.0, atol=1e-9)
    # An error of the slant range is larger by r / h in the plane.
    expected = [0.5 * r / math.sqrt(15**2 + 0.5 * r) for r in slant]
    np.testing.assert_allclose(measured["sigma_0"][1:], expected[1:], rtol=1e-6)
    assert measured["sigma_0"][0] == pytest.approx(0.5)


def test_a_range_shorter_than_the_depth_is_not_used(tmp_path: Path) -> None:
    log = ranging(tmp_path)
    write_file(log, "odometry.csv", time_s=[0.0, 10.0], speed_m_s=[0.0, 0.0],
               yaw_rate_rad_s=[0.0, 0.0])  # fmt: skip
    write_file(log, "depth.csv", time_s=[0.0], depth_m=[20.0])
    write_file(log, "ranges.csv", time_s=[1.0, 2.0], source=[3] * 2, range_m=[14.9, 15.1])
    measured = tables(log)["measurements"]
    assert measured["outcome"].tolist()[0] == "too short"
    assert measured["outcome"].tolist()[1] != "too short"
    assert replay(LogFolder(log), Settings(), causes=False).numbers["too_short"] == 1


def test_several_sensors_in_one_log_are_those_of_the_filter_step_by_step(tmp_path: Path) -> None:
    log = ranging(tmp_path)
    time = np.arange(0.0, 9.0)
    write_file(log, "odometry.csv", time_s=time, speed_m_s=1 + 0 * time,
               yaw_rate_rad_s=0.1 + 0 * time)  # fmt: skip
    write_file(log, "beacons.csv", source=[3, 4], x_m=[0.0, 20.0], y_m=[30.0, -10.0])
    write_file(log, "ranges.csv", time_s=[2.0, 6.0], source=[3, 4], range_m=[27.0, 16.0])
    write_file(log, "fixes.csv", time_s=[4.0], source=[4], range_m=[20.0], azimuth_rad=[-1.0])
    write_file(log, "positions.csv", time_s=[4.0, 8.0], x_m=[5.0, 8.0], y_m=[2.5, 5.0],
               sigma_m=[0.0, 3.0])  # fmt: skip
    settings = settings_from(
        {
            "odometry": {"max_step_s": 1.0},
            "ranges": {"sigma_m": 0.5, "sources": {"4": {"sigma_m": 2.0}}},
            "positions": {"sigma_m": 1.5},
        }
    )
    found = tables(log, settings)
    ekf = Ekf([1.0, 2.0, 0.0], np.diag([1.0, 1.0, 0.1]) ** 2, process=Odometry())
    chord = (np.exp(0.1j) - 1) / 0.1j
    nis = []

    def update(z: Any, sensor: Any) -> None:
        ekf.update(z, sensor)
        nis.append(ekf.nis)

    for k in range(1, 9):
        ekf.predict(1.0, [chord.real, chord.imag, 0.1])
        if k == 2:
            update(27.0, LeaderRange(leader=(0.0, 30.0), sigma_range_m=0.5))
        if k == 4:
            station = RangeBearing(
                station=(20.0, -10.0), sigma_range_m=0.1, sigma_bearing_rad=0.02, near_field=5.0
            )
            update([20.0, QUARTER + 1.0], station)  # -1 rad clockwise from north
            update([5.0, 2.5], Position(covariance_m2=np.eye(2) * 1.5**2))
        if k == 6:
            update(16.0, LeaderRange(leader=(20.0, -10.0), sigma_range_m=2.0))
        if k == 8:
            update([8.0, 5.0], Position(covariance_m2=np.eye(2) * 9.0))
    measured = found["measurements"]
    assert measured["sensor"].tolist() == ["range", "fix", "position", "range", "position"]
    assert measured["source"].tolist() == [3, 4, -1, 4, -1]
    np.testing.assert_allclose(measured["nis"], nis, rtol=1e-9)
    end = [found["estimates"][name][-1] for name in ("x_m", "y_m", "heading_rad")]
    np.testing.assert_allclose(end, ekf.x, rtol=1e-9)


def late_log(folder: Path, *, latency_s: float) -> Path:
    """Ranges and positions every second on an arc, lines of which stand so much later."""
    folder.mkdir()
    log = ranging(folder)
    time = np.arange(0.0, 41.0)
    heading = 0.05 * time
    path = 1 + 2j + 20 * (np.exp(1j * heading) - 1) / 1j
    write_file(log, "odometry.csv", time_s=time, speed_m_s=1 + 0 * time,
               yaw_rate_rad_s=0.05 + 0 * time)  # fmt: skip
    random = np.random.default_rng(4)
    taken = np.arange(1.25, 36.0)
    at = 1 + 2j + 20 * (np.exp(0.05j * taken) - 1) / 1j
    write_file(log, "ranges.csv", time_s=taken + latency_s, source=[3] * len(taken),
               range_m=np.abs(at - 30j) + random.normal(0, 0.5, len(taken)))  # fmt: skip
    fixed = np.arange(2.75, 36.0, 4.0)
    seen = 1 + 2j + 20 * (np.exp(0.05j * fixed) - 1) / 1j + random.normal(0, 0.5, len(fixed))
    write_file(log, "positions.csv", time_s=fixed + 0.5 * latency_s, x_m=seen.real,
               y_m=seen.imag)  # fmt: skip
    write_file(log, "truth.csv", time_s=time, x_m=path.real, y_m=path.imag)
    return log


@pytest.mark.parametrize("lines", [1, 7, 32768])
def test_a_latency_is_made_good(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    """When all came in, the filter is where it would be had all come in time."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    # What of the noise depends on where steps end is left out.
    drift = {"odometry": {"sigma_distance": 0.0, "sigma_turn": 0.0}}
    timely = tables(late_log(tmp_path / "timely", latency_s=0.0), settings_from(drift))
    late = late_log(tmp_path / "late", latency_s=2.5)
    told = settings_from({**drift, "ranges": {"latency_s": 2.5}, "positions": {"latency_s": 1.25}})
    found = tables(late, told)
    for name in ("x_m", "y_m", "heading_rad", "var_x_m2"):
        assert found["estimates"][name][-1] == pytest.approx(
            timely["estimates"][name][-1], rel=1e-9
        )
    ranges = found["measurements"]["sensor"] == "range"
    assert (found["measurements"]["time_s"][ranges] == np.arange(3.75, 38.5)).all()
    # Without the settings every range is 2.5 m of way off, or less where the way goes across.
    untold = tables(late)
    off = [
        rows["estimates"]["x_m"][-1] - timely["estimates"]["x_m"][-1] for rows in (found, untold)
    ]
    assert abs(off[0]) < 1e-8 < 0.05 < abs(off[1])


def test_a_source_has_a_latency_of_its_own(tmp_path: Path) -> None:
    late = late_log(tmp_path / "late", latency_s=2.5)
    own = settings_from(
        {"ranges": {"sources": {"3": {"latency_s": 2.5}}}, "positions": {"latency_s": 1.25}}
    )
    all_ = settings_from({"ranges": {"latency_s": 2.5}, "positions": {"latency_s": 1.25}})
    for name, values in tables(late, all_)["estimates"].items():
        np.testing.assert_array_equal(tables(late, own)["estimates"][name], values, err_msg=name)


def test_late_measurements_that_are_held_out_are_predicted_then(tmp_path: Path) -> None:
    """A craft of known motion: what it would have measured, at the time it was taken."""
    late = late_log(tmp_path / "late", latency_s=2.5)
    (late / "positions.csv").unlink()
    settings = settings_from({**SURE, "ranges": {"latency_s": 2.5, "every_s": 3.0, "sigma_m": 9.0}})
    measured = tables(late, settings)["measurements"]
    held = measured["held_out_error_m"][measured["outcome"] == "held out"]
    assert len(held) > 20
    # What is left is the noise of the ranges, 0.5 m: half of them would be off by a metre and more.
    assert 0.35 < np.sqrt(np.mean(held**2)) < 0.65


def test_latency_of_what_drives_is_taken_off(tmp_path: Path) -> None:
    log = ranging(tmp_path, until_s=10.0)
    rows = arc_lines("heading")
    write_file(log, "odometry.csv", **{**rows, "time_s": rows["time_s"] + 3.0})
    settings = settings_from({"odometry": {"latency_s": 3.0}})
    assert abs(reckoned(tables(log, settings)) - ARC_END) < 1e-9


def spatial_log(folder: Path, *, latency_s: float = 0.0) -> Path:
    """A USBL 2 m deep at (3, 4) tracks a craft that tells its depth, its velocity and heading."""
    write_file(folder, "beacons.csv", source=[1], x_m=[3.0], y_m=[4.0], depth_m=[2.0])
    time = np.arange(0.0, 20.0)
    at = np.column_stack([10 + 1.2 * time, 20 - 0.5 * time, 12 + 0.1 * time])
    away = at - [3.0, 4.0, 2.0]
    level = np.hypot(away[:, 0], away[:, 1])
    write_file(
        folder, "fixes.csv", time_s=time + latency_s, source=np.ones(20),
        range_m=np.hypot(level, away[:, 2]), bearing_rad=np.arctan2(away[:, 1], away[:, 0]),
        depression_rad=np.arctan2(away[:, 2], level),
    )  # fmt: skip
    write_file(folder, "depth.csv", time_s=time + 0.25, depth_m=at[:, 2] + 0.025)
    course = math.atan2(-0.5, 1.2)
    write_file(folder, "velocities.csv", time_s=time + 0.5, forward_m_s=0 * time,
               starboard_m_s=0 * time + math.hypot(1.2, 0.5), down_m_s=0 * time + 0.1,
               heading_rad=0 * time + course + QUARTER)  # fmt: skip
    write_file(folder, "truth.csv", time_s=time, x_m=at[:, 0], y_m=at[:, 1])
    return folder


def test_a_craft_is_tracked_in_space(tmp_path: Path) -> None:
    found = tables(spatial_log(tmp_path))
    x0 = np.array([10.0, 20.0, 12.0, 0.0, 0.0, 0.0])
    P0 = np.diag([1.0, 1.0, 1.0, 0.5, 0.5, 0.5]) ** 2
    process = WhiteAcceleration(axes=3, velocity_psd=1e-2, vertical_velocity_psd=1e-3)
    ekf = Ekf(x0, P0, process=process)
    ekf.predict(0.25)
    ekf.update(12.025, Depth(sigma_m=0.1))
    ekf.predict(0.25)
    told = BodyVelocity(axes=3, heading_rad=math.atan2(-0.5, 1.2) + QUARTER,
                        sigma_forward_m_s=0.05, sigma_sideways_m_s=0.05,
                        sigma_vertical_m_s=0.05)  # fmt: skip
    ekf.update([0.0, -1.3, 0.1], told)
    ekf.predict(0.5)
    away = np.array([11.2, 19.5, 12.1]) - [3.0, 4.0, 2.0]
    level = math.hypot(away[0], away[1])
    usbl = RangeBearingElevation(station=(3.0, 4.0, 2.0), sigma_range_m=0.1,
                                 sigma_bearing_rad=0.02, sigma_elevation_rad=0.02,
                                 near_field=5.0)  # fmt: skip
    z = [math.hypot(level, away[2]), math.atan2(away[1], away[0]), math.atan2(away[2], level)]
    ekf.update(z, usbl)
    estimates = found["estimates"]
    k = int(np.argmax(estimates["time_s"] == 1.0))
    names = ("x_m", "y_m", "depth_m", "var_x_m2", "var_depth_m2")
    expected = [*ekf.x[:3], ekf.P[0, 0], ekf.P[2, 2]]
    np.testing.assert_allclose([estimates[name][k] for name in names], expected, rtol=1e-9)
    # The log has no noise: at the end the craft is where it is, 13.9 m deep.
    assert estimates["depth_m"][-1] == pytest.approx(12 + 0.1 * 19.5, abs=0.01)
    assert abs(found["errors"]["error_x_m"][-1]) < 0.02
    assert found["measurements"]["sensor"].tolist()[:4] == ["fix", "depth", "velocity", "fix"]


def test_late_fixes_of_a_tracked_craft(tmp_path: Path) -> None:
    """Had they come in time, the same estimate, when all are in; here they are the last."""
    (tmp_path / "timely").mkdir()
    (tmp_path / "late").mkdir()
    timely = tables(spatial_log(tmp_path / "timely"))["estimates"]
    late = spatial_log(tmp_path / "late", latency_s=2.0)
    found = tables(late, settings_from({"fixes": {"latency_s": 2.0}}))["estimates"]
    assert found["time_s"][-1] == 21.0
    # Carried on by a second and a half.
    assert found["depth_m"][-1] == pytest.approx(timely["depth_m"][-1] + 0.15, abs=0.02)
    assert found["x_m"][-1] == pytest.approx(timely["x_m"][-1] + 1.8, abs=0.05)


def test_a_craft_in_space_of_which_nothing_is_known_but_its_start(tmp_path: Path) -> None:
    log = spatial_log(tmp_path, latency_s=2.0)
    (log / "beacons.csv").write_text("source,x_m,y_m,depth_m\n")  # nobody knows where it stood
    for name in ("depth.csv", "velocities.csv"):
        (log / name).unlink()
    write_file(log, "start.csv", time_s=[0.0], x_m=[10.0], y_m=[20.0])
    found = tables(log, settings_from({"fixes": {"latency_s": 2.0}}))
    assert set(found["measurements"]["outcome"]) == {"no position"}
    assert set(found["estimates"]["x_m"]) == {10.0}  # at rest, for all that is known


def test_fixes_with_depth_and_no_elevation_are_levelled(tmp_path: Path) -> None:
    write_file(tmp_path, "beacons.csv", source=[1], x_m=[0.0], y_m=[0.0])
    time = np.arange(0.0, 20.0)
    write_file(tmp_path, "fixes.csv", time_s=time, source=np.ones(20),
               range_m=0 * time + 50.0, bearing_rad=0 * time)  # fmt: skip
    write_file(tmp_path, "depth.csv", time_s=[0.0], depth_m=[30.0])
    assert tables(tmp_path)["estimates"]["x_m"][-1] == pytest.approx(40.0, abs=1e-6)


def test_positions_alone_are_a_log(tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0)
    write_file(tmp_path, "positions.csv", time_s=time, x_m=3 + 0.5 * time, y_m=0 * time)
    found = tables(tmp_path, filter_name="ukf")["estimates"]
    assert found["x_m"][-1] == pytest.approx(3 + 0.5 * 59, abs=0.05)
    assert checks.check(tmp_path, Settings()).verdict == "sound"


def test_aukf_takes_nothing_beside_fixes(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="takes no other sensor"):
        tables(spatial_log(tmp_path), filter_name="aukf")


def test_columns_that_are_not_read_are_a_note(tmp_path: Path) -> None:
    log = ranging(tmp_path)
    time = np.arange(3.0)
    write_file(log, "compass.csv", time_s=time, heading_rad=0 * time)
    (log / "odometry.csv").write_text("time_s,speed_m_s,yaw_rate_rad_s\n0,1,0\n1,1,0\n2,1,0\n")
    (log / "ranges.csv").write_text('note,time_s,source,quality,range_m\n"a,b",1,3,x,28\n')
    folder = LogFolder(log)
    np.testing.assert_array_equal(folder["ranges.csv"].whole(), [[1, 3, 28]])
    notes = survey(folder, checks.limits(Settings())).findings
    said = {(one.cause, one.file, one.verdict): one.message for one in notes}
    assert said["ignored_column", "ranges.csv", "sound"] == "not read: note, quality"
    assert "yaw_rate_rad_s; compass.csv says" in said["ignored_column", "odometry.csv", "sound"]


@pytest.mark.parametrize(
    ("name", "header", "column", "meant", "unit"),
    [
        ("odometry.csv", "time_s,forward_m,left_m,turn_deg", "turn_deg", "turn_rad", "deg"),
        ("odometry.csv", "time_s,speed_m_s,heading_deg", "heading_deg", "heading_rad", "deg"),
        ("odometry.csv", "time_s,speed_knots,heading_rad", "speed_knots", "speed_m_s", "kn"),
        ("leaders.csv", "time_s,source,x_m,y_m,sigma_mm", "sigma_mm", "sigma_m", "mm"),
        ("depth.csv", "time_s,depth_ft", "depth_ft", "depth_m", "ft"),
        ("water.csv", "time_s,temperature_deg", "temperature_deg", "temperature_c", ""),
    ],
)
def test_a_column_in_another_unit_is_not_left_out_in_silence(
    tmp_path: Path, name: str, header: str, column: str, meant: str, unit: str
) -> None:
    (tmp_path / name).write_text(header + "\n")
    with pytest.raises(LogError) as caught:
        reader.CsvTable(tmp_path / name)
    assert caught.value.column == column
    said = f"{tmp_path / name}, line 1, column {column}: a log has {meant}"
    if unit:
        stem = name.removesuffix(".csv")
        said += (
            "; auvest init LOG writes the settings that convert it ([columns."
            f'{stem}] {meant} = "{column}", [units.{stem}] {meant} = "{unit}")'
        )
    assert str(caught.value) == said


def test_a_craft_must_turn_by_something(tmp_path: Path) -> None:
    log = ranging(tmp_path)
    write_file(log, "odometry.csv", time_s=[0.0], speed_m_s=[1.0])
    with pytest.raises(LogError, match="how does the craft turn"):
        LogFolder(log)


def test_a_source_may_have_none_of_what_all_others_have() -> None:
    """A latency of 0 is one; what a source does not say is as for all."""
    settings = settings_from(
        {"ranges": {"latency_s": 0.5, "sources": {"2": {"latency_s": 0.0}, "3": {"sigma_m": 9.0}}}}
    )
    rows = np.array([[0.0, source] for source in (1, 2, 3, 2)])
    found = Instruments._per_source(None, rows, settings.ranges, "latency_s")  # type: ignore[arg-type]
    assert found.tolist() == [0.5, 0.0, 0.5, 0.0]


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1970-01-01T00:00:00Z", 0.0),
        ("2025-11-28T08:00:00.25Z", 1764316800.25),
        ("2025-11-28 09:00:00,250 +01:00", 1764316800.25),
        ("2025-11-28T03:30-0430", 1764316800.0),
        ("2025-11-28T08:00:00.123456789+00", 1764316800.123456789),
        ("2016-12-31T23:59:60Z", 1483228800.0),  # a leap second is the next one's
    ],
)
def test_times_in_iso_8601(text: str, seconds: float) -> None:
    assert seconds_of(text) == seconds


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2025-11-28T08:00:00", "has no zone"),
        ("28.11.2025 08:00", "is not a time in ISO 8601"),
        ("2025-13-28T08:00:00Z", "month must be in 1..12"),
        ("2025-11-28T08:00:61Z", "second must be in 0..60"),
    ],
)
def test_what_is_no_time_is_refused_by_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "ranges.csv"
    path.write_text(f"time,source,range_m\n2025-11-28T08:00:00Z,1,5\n{text},1,5\n")
    with pytest.raises(LogError, match=words) as caught:
        reader.CsvTable(path).whole()
    assert (caught.value.line, caught.value.column) == (3, "time")


def test_latitudes_and_longitudes(tmp_path: Path) -> None:
    """On the ellipsoid of WGS 84 a degree at 45 N is 111,131.745 m north, 78,846.806 m east."""
    log = ranging(tmp_path)
    write_file(log, "odometry.csv", time_s=[0.0], speed_m_s=[1.0], yaw_rate_rad_s=[0.0])
    step = 1e-3
    write_file(log, "beacons.csv", source=[3, 4], latitude_deg=[45.0 + step, 45.0],
               longitude_deg=[7.0, 7.0 + step])  # fmt: skip
    write_file(log, "start.csv", time_s=[0.0], latitude_deg=[45.0], longitude_deg=[7.0],
               heading_rad=[0.0])  # fmt: skip
    folder = LogFolder(log)
    assert folder.frame.origin == (45.0, 7.0)
    assert replay(folder, Settings(), causes=False).numbers["origin_deg"] == [45.0, 7.0]
    places = folder.beacons()
    assert places[3] == pytest.approx((0.0, 111.131745), abs=1e-3)
    assert places[4] == pytest.approx((78.846806, 0.0), abs=1e-3)
    (note,) = survey(folder, checks.limits(Settings())).findings
    assert (note.cause, note.verdict) == ("earth_origin", "sound")
    write_file(log, "origin.csv", latitude_deg=[45.0 + step], longitude_deg=[7.0])
    assert LogFolder(log).beacons()[3] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_metres_and_degrees_need_an_origin(tmp_path: Path) -> None:
    log = ranging(tmp_path)
    write_file(log, "odometry.csv", time_s=[0.0], speed_m_s=[1.0], yaw_rate_rad_s=[0.0])
    write_file(log, "start.csv", time_s=[0.0], latitude_deg=[45.0], longitude_deg=[7.0],
               heading_rad=[0.0])  # fmt: skip
    with pytest.raises(LogError, match=r"Say so in origin\.csv"):
        LogFolder(log)


def test_the_heading_goes_on_in_a_gap_of_the_velocity(tmp_path: Path) -> None:
    """A quarter turn in 20 s, of which the first 4 are driven at 1 m/s; then 4 m along +y."""
    log = ranging(tmp_path, until_s=30.0)
    write_file(log, "odometry.csv", time_s=[0.0, 20.0], speed_m_s=[1.0, 1.0],
               heading_rad=[0.0, QUARTER])  # fmt: skip
    settings = settings_from({"odometry": {"gap_s": 4.0}})
    rate = QUARTER / 20
    driven = (np.exp(4j * rate) - 1) / (1j * rate)
    assert abs(reckoned(tables(log, settings)) - (1 + 2j + driven + 4j)) < 1e-9
