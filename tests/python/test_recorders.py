"""Files of real recorders: what `auvest import --list --json` says of them, against the facts that
other readers found in them (rosbags, pymavlink, pyulog, pynmea2, json, csv).

The files are not part of the project; AUVEST_DATA names the folder that has them.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from auvest.cli import app
from auvest.logs import LogFolder

_FOLDER = Path(os.environ.get("AUVEST_DATA", "")) / "recorders"
pytestmark = pytest.mark.skipif(
    "AUVEST_DATA" not in os.environ or not (_FOLDER / "facts.json").is_file(),
    reason="AUVEST_DATA does not name a folder with files of recorders",
)


@cache
def facts() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((_FOLDER / "facts.json").read_text())
    return found


@cache
def listed(name: str) -> dict[str, Any]:
    """What the command says, and that the file is the one of the facts and stays it."""
    result = CliRunner().invoke(app, ["import", "--list", "--json", str(_FOLDER / name)])
    assert result.exit_code == 0, result.output
    for file, digest in facts()[name]["sha256"].items():
        path = _FOLDER / name / file if (_FOLDER / name).is_dir() else _FOLDER / name
        assert hashlib.sha256(path.read_bytes()).hexdigest() == digest
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def shown(found: Mapping[str, Any], topic: str, number: str) -> dict[str, Any]:
    """The n-th message of a topic, which the listing shows for 1, 10, 100 and the last."""
    part = found["topics"][topic]
    message = part["shown"].get(number)
    if message is None:
        assert int(number) == part["messages"]
        message = part["shown"]["last"]
    read: dict[str, Any] = message
    return read


#: The readers of the facts shortened the names of ROS; where a name means several, the first that
#: a message has.
_ROS = {
    "x": ("pose.pose.position.x", "x"),
    "y": ("pose.pose.position.y", "y"),
    "z": ("pose.pose.position.z",),
    "qx": ("orientation.x",),
    "qy": ("orientation.y",),
    "qz": ("orientation.z", "pose.pose.orientation.z"),
    "qw": ("orientation.w", "pose.pose.orientation.w"),
    "vx": ("twist.twist.linear.x", "velocity.x", "linear.x"),
    "vy": ("velocity.y",),
    "vz": ("velocity.z",),
    "wz": ("twist.twist.angular.z", "angular_velocity.z", "angular.z"),
    "ax": ("linear_acceleration.x",),
    "v": ("linear_velocity",),
}


@pytest.mark.parametrize(
    "name",
    [
        "ros/cougars_cleaned_bag",
        "ros/dvl_a50_circle.bag",
        "ros/jackal_test2.bag",
        "ros/nav2_turtlebot.mcap",
        "ros/turtlesim_bz2.bag",
    ],
)
def test_ros(name: str) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'auvest[ros]'")
    known, found = facts()[name], listed(name)
    assert found["format"] == "ros"
    assert found["messages"] == known["messages"]
    assert (found["first_ns"], found["last_ns"]) == (known["first_ns"], known["last_ns"])
    assert {
        topic: [part["type"], part["messages"]] for topic, part in found["topics"].items()
    } == known["topics"]
    for topic, span in known["per_topic_first_last_ns"].items():
        part = found["topics"][topic]
        assert [part["first_ns"], part["last_ns"]] == span
    for label, values in known["values"].items():
        topic, _, number = label.partition("#")
        message = shown(found, topic, number)
        for field, value in values.items():
            if field == "stamp":
                seconds, _, rest = value.partition(".")
                assert message["stamp_ns"] == int(seconds) * 10**9 + int(rest)
            elif field == "beams":
                assert f"beams[{value - 1}].id" in message
                assert f"beams[{value}].id" not in message
            elif topic == "/dvl/json_data":  # the maker's JSON in a string
                report = json.loads(message["data"])
                assert report[field.removeprefix("json_")] == value
            else:
                place = next(key for key in _ROS.get(field, (field,)) if key in message)
                assert message[place] == (None if value == "nan" else value)
    if known["dvl_velocity_invalid"]:
        valid = found["topics"]["/dvl/data"]["fields"]["velocity_valid"]["true"]
        assert found["topics"]["/dvl/data"]["messages"] - valid == known["dvl_velocity_invalid"]


@pytest.mark.parametrize(
    "name",
    [
        "ardupilot/ardusub_small.BIN",
        "ardupilot/arduplane_test.BIN",
        "ardupilot/ardusub_dive_5m.BIN",
        "ardupilot/ardusub_dive_12m.tlog",
        "ardupilot/ardusub_gps_input.tlog",
    ],
)
def test_ardupilot(name: str) -> None:
    known, found = facts()[name], listed(name)
    if name.endswith(".tlog"):
        # A packet that pymavlink calls bad is of a kind unknown here, or has a wrong checksum.
        assert found["facts"]["packets"] == known["messages"] + known["bad_data"]
        left_out = sum(found["skipped"].values())
        assert found["messages"] + left_out == known["messages"] + known["bad_data"]
        assert left_out <= known["bad_data"]
    else:
        assert found["messages"] == known["messages"]
        assert found["facts"]["firmware"] == known["text"][0]
    for topic, count in known["counts"].items():
        assert found["topics"][topic]["messages"] == count
    for topic, (first, last) in known["first_last_timestamp"].items():
        part = found["topics"][topic]
        # pymavlink's times are floats of seconds: of Unix time they have 0.24 us.
        assert part["first_s"] == pytest.approx(first, abs=3e-7, rel=0)
        assert part["last_s"] == pytest.approx(last, abs=3e-7, rel=0)
    for label, values in known["values"].items():
        topic, _, number = label.partition("#")
        message = shown(found, topic, number)
        for field, value in values.items():
            assert message[field] == pytest.approx(value, rel=1e-15, abs=0)  # pymavlink's v * 0.01


@pytest.mark.parametrize("name", ["dvl/a50_tcp_still.txt", "dvl/a50_tcp_straight_v1.txt"])
def test_dvl_without_times(name: str) -> None:
    known, found = facts()[name], listed(name)
    assert found["format"] == "json"
    part = found["topics"]["velocity"]
    assert [found["facts"]["format"]] == list(known["formats"])
    assert part["messages"] == known["lines"]
    assert part["fields"]["velocity_valid"]["true"] == known["valid"]
    assert part["repeated"] == known["lines_equal_to_the_one_before"]
    assert part["fields"]["altitude"].get("minus_one", 0) == known["no_bottom_altitude_minus1"]
    periods = part["fields"]["time"]["mean"] * part["messages"]
    assert periods == pytest.approx(known["sum_time_ms"], rel=1e-12)
    for number, values in known["values"].items():
        message = shown(found, "velocity", number)
        assert {field: message[field] for field in values} == values
    # A repeated report is no new time: with no repeats the clock would be the sum of the periods.
    lines = (_FOLDER / name).read_text().splitlines()
    fresh = [line for before, line in zip(["", *lines], lines, strict=False) if line != before]
    clock = sum(json.loads(line)["time"] for line in fresh)
    assert part["last_s"] == pytest.approx(clock / 1000, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "topic", "flag", "count"),
    [
        ("dvl/a50_logged.csv", "velocity", "velocity_valid", "valid"),
        ("ugps/ugps_g2_filtered_2.csv", "position", "position_valid", "position_valid"),
    ],
)
def test_water_linked_tables(name: str, topic: str, flag: str, count: str) -> None:
    known, found = facts()[name], listed(name)
    assert found["format"] == "csv"
    part = found["topics"][topic]
    assert part["messages"] == known["rows"]
    assert part["fields"][flag]["true"] == known[count]
    first, last = known["first_last_timestamp"]
    assert [part["first_s"], part["last_s"]] == [float(first), float(last)]
    for number, values in known["values"].items():
        message = shown(found, topic, number)
        for field, text in values.items():
            value = {"True": True, "False": False}.get(text, text)
            assert message[field] == (value if isinstance(value, bool) else float(value))


def test_usbl_table() -> None:
    known, found = facts()["usbl/pool_usbl_ranges.csv"], listed("usbl/pool_usbl_ranges.csv")
    part = found["topics"]["usbl"]
    assert part["messages"] == known["rows"]
    assert list(part["fields"]) == known["columns"]
    first, last = known["first_last_timestamp"]
    assert [part["first_s"], part["last_s"]] == [float(first), float(last)]
    for label, number in (("row_1", "1"), ("row_43", "43")):
        message = shown(found, "usbl", number)
        for field, text in known[label].items():
            if field in ("mode", "use_range_only"):
                assert str(message[field]) == text
            else:
                assert message[field] == float(text)


_NMEA = {
    "latitude": "latitude_deg",
    "longitude": "longitude_deg",
    "kts": "speed_kn",
    "heading": "heading_deg",
    "true_track": "course_deg",
}


def nmea_values(found: Mapping[str, Any], values: Mapping[str, Mapping[str, Any]]) -> None:
    for label, wanted in values.items():
        topic, _, number = label.partition("#")
        message = shown(found, topic, number)
        for field, value in wanted.items():
            if field == "raw":
                continue  # what latitude and longitude were made of
            if field == "datetime":
                stamp = datetime.fromisoformat(value).timestamp()
                assert message["stamp_ns"] == round(stamp * 1000) * 10**6
            elif field == "time":
                hours, minutes, seconds = map(int, value.removesuffix("+00:00").split(":"))
                assert message["utc_s"] == hours * 3600 + minutes * 60 + seconds
            elif value == "None":
                assert message[_NMEA[field]] is None
            elif field in ("status", "quality"):
                assert message[field] == value
            else:
                assert message[_NMEA[field]] == pytest.approx(float(value), rel=1e-15)


def test_nmea_with_receive_times() -> None:
    known, found = facts()["nmea/nmea_udp_pier.txt"], listed("nmea/nmea_udp_pier.txt")
    assert found["messages"] == known["sentences"]
    assert {name: part["messages"] for name, part in found["topics"].items()} == known["counts"]
    first, last = (
        datetime.fromisoformat(f"{text}+00:00") for text in known["first_last_receive_time"]
    )
    assert found["first_s"] == first.timestamp()
    assert found["last_s"] == last.timestamp()
    nmea_values(found, known["values"])


def test_nmea_without_receive_times() -> None:
    """A sentence that tells no time has that of the latest which does."""
    known, found = facts()["nmea/saab_r4.log"], listed("nmea/saab_r4.log")
    assert found["messages"] == known["sentences"]
    assert {name: part["messages"] for name, part in found["topics"].items()} == known["counts"]
    assert found["facts"]["receive_times"] is None
    nmea_values(found, known["values"])
    assert shown(found, "HEHDT", "1")["time_ns"] == shown(found, "GPRMC", "1")["stamp_ns"]


def test_rth_of_cerulean() -> None:
    known, found = facts()["usbl/cerulean_rovl_rth.txt"], listed("usbl/cerulean_rovl_rth.txt")
    part = found["topics"]["USRTH"]
    assert part["messages"] == known["lines"] == known["checksum_ok"]
    assert part["different"] == known["distinct_lines"]
    names = {
        "ab": "bearing_mathematical_deg", "ac": "bearing_compass_deg", "ae": "elevation_deg",
        "sr": "slant_range_m", "tb": "true_bearing_mathematical_deg",
        "cb": "true_bearing_compass_deg", "te": "true_elevation_deg", "er": "roll_deg",
        "ep": "pitch_deg", "ey": "yaw_deg", "ch": "heading_deg", "db": "signal_db",
    }  # fmt: skip
    message = shown(found, "USRTH", "1")
    for field, text in known["values"]["1"].items():
        assert message[names[field]] == float(text)
    slant = [shown(found, "USRTH", number)["slant_range_m"] for number in ("1", "90")]
    assert slant == list(map(float, known["slant_range_first_last"]))


def test_azimuth_suite() -> None:
    known, found = facts()["usbl/azimuth_suite_2.log"], listed("usbl/azimuth_suite_2.log")
    assert found["messages"] + found["skipped"]["other line"] == known["lines"] - 1  # one is blank
    assert found["messages"] == known["nmea"]["sentences"]
    counts = {topic: part["messages"] for topic, part in found["topics"].items()}
    counts["(rejected)"] = counts.pop("PAZM3") + counts.pop("GPHEV")  # pynmea2 knows neither
    assert counts == known["nmea"]["counts"]
    part = found["topics"]["PAZM3"]
    assert part["messages"] == known["pazm3"]
    status = part["fields"]["status"]
    assert (status["min"], status["max"], status["missing"]) == (1, 1, 0)
    fields = (
        "status", "address", "request", "response", "signal_db", "propagation_s", "slant_range_m",
        "horizontal_range_m", "remote_depth_m", "horizontal_angle_deg", "vertical_angle_deg",
        "pressure_mbar", "temperature_c", "heading_deg", "pitch_deg", "roll_deg",
    )  # fmt: skip
    for label, number in (("first_pazm3", "1"), ("pazm3_no_100", "100"), ("last_pazm3", "141")):
        line = known[label]
        message = shown(found, "PAZM3", number)
        for field, cell in zip(fields, line.split("$PAZM3,")[1].split(","), strict=True):
            assert message[field] == (float(cell) if cell else None)
        hours, minutes, seconds = line[:12].split(":")
        since = int(hours) * 3600_000 + int(minutes) * 60_000 + round(float(seconds) * 1000)
        assert message["time_ns"] == since * 10**6
    nmea_values(found, known["nmea"]["values"])


@pytest.mark.parametrize("name", ["alog/bluefin_unicorn.alog", "alog/moos_2008.alog"])
def test_alog(name: str) -> None:
    known, found = facts()[name], listed(name)
    assert found["messages"] == known["data_lines"]
    assert {topic: part["messages"] for topic, part in found["topics"].items()} == known["counts"]
    assert found["facts"]["logstart_s"] == float(known["logstart"])
    assert [found["first_s"], found["last_s"]] == known["first_last_time"]
    assert found["goes_back"] == known["time_goes_back"]
    for number, row in known["NAV_X"].items():
        if row is None:
            continue
        message = shown(found, "NAV_X", number)
        assert message["time_ns"] == round(float(row[0]) * 1000) * 10**6
        assert (message["source"], message["value"]) == (row[2], float(row[3]))


def test_ulog() -> None:
    known, found = facts()["ulog/px4_v6c.ulg"], listed("ulog/px4_v6c.ulg")
    assert len(found["topics"]) == known["topics"]
    assert found["facts"] == {
        "start_us": known["start_timestamp"],
        "dropouts": known["dropouts"],
        "sys_name": known["sys_name"],
        "ver_hw": known["ver_hw"],
    }
    assert found["last_ns"] == known["last_timestamp"] * 1000
    for topic, count in known["counts"].items():
        assert found["topics"][topic]["messages"] == count
    for label, values in known["values"].items():
        topic, _, number = label.partition("#")
        message = shown(found, topic, number)
        assert {field: message[field] for field in values} == values


# ---- Logs of them --------------------------------------------------------------------------------


def log_of(
    name: str, folder: Path, mapping: str | None = None
) -> tuple[dict[str, list[dict[str, float]]], list[str]]:
    """The rows of each file of the log as they stand there, and what the import noted."""
    words = ["import", "--json", str(_FOLDER / name), str(folder / "log")]
    if mapping is not None:
        (folder / "mapping.toml").write_text(mapping)
        words += ["--mapping", str(folder / "mapping.toml")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    log = {}
    for path in (folder / "log").glob("*.csv"):
        header, *lines = path.read_text().splitlines()
        names = header.split(",")
        log[path.stem] = [
            dict(zip(names, map(float, line.split(",")), strict=True)) for line in lines
        ]
    document = json.loads(result.stdout)
    assert document["rows"] == {f"{stem}.csv": len(rows) for stem, rows in log.items()}
    return log, document["notes"]


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("dvl/a50_tcp_still.txt", 250 - 16 - 1),  # without repeats, and one not valid
        ("dvl/a50_tcp_straight_v1.txt", 3),  # 11 different reports, 8 without the ground
        ("dvl/a50_logged.csv", 269),
    ],
)
def test_a_dvl_alone_is_odometry(name: str, rows: int, tmp_path: Path) -> None:
    """Its own x and y, forward and starboard; the notes say what a log needs besides."""
    log, notes = log_of(name, tmp_path)
    assert list(log) == ["odometry"]
    assert len(log["odometry"]) == rows
    first = log["odometry"][0]
    known = facts()[name]["values"]["1"]
    assert first["speed_m_s"] == float(known["vx"])
    assert first["starboard_m_s"] == float(known["vy"])
    assert any("not yet a log that can be replayed" in note for note in notes)


def test_the_bag_of_a_dvl_is_odometry_at_its_stamps(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'auvest[ros]'")
    log, _ = log_of("ros/dvl_a50_circle.bag", tmp_path)
    assert len(log["odometry"]) == 378 - 75
    known = facts()["ros/dvl_a50_circle.bag"]["values"]["/dvl/data#1"]
    assert log["odometry"][0] == {
        "time_s": float(known["stamp"]),
        "speed_m_s": known["vx"],
        "starboard_m_s": known["vy"],
    }


def test_an_auv_with_dvl_depth_and_gps(tmp_path: Path) -> None:
    """A mapping of its own: what is odometry here, a bag's types alone do not say."""
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'auvest[ros]'")
    mapping = """
        clock = "stamp"
        [odometry]
        topic = "/dvl_dead_reckoning"
        [odometry.increments]
        x_m = "pose.pose.position.x"
        y_m = "pose.pose.position.y"
        heading_rad = {yaw = [
          "pose.pose.orientation.w", "pose.pose.orientation.x", "pose.pose.orientation.y",
          "pose.pose.orientation.z"]}
        [compass]
        topic = "/modem_imu"
        heading_rad = {yaw = ["orientation.w", "orientation.x", "orientation.y", "orientation.z"]}
        [depth]
        topic = "/depth_data"
        depth_m = {field = "pose.pose.position.z", scale = -1}
        [positions]
        topic = "/gps_odom"
        x_m = "pose.pose.position.x"
        y_m = "pose.pose.position.y"
    """
    log, notes = log_of("ros/cougars_cleaned_bag", tmp_path, mapping)
    known = facts()["ros/cougars_cleaned_bag"]["values"]
    assert len(log["odometry"]) == 638 - 1
    assert len(log["compass"]) == 1532
    assert log["depth"][99] == {
        "time_s": float(known["/depth_data#100"]["stamp"]),
        "depth_m": -known["/depth_data#100"]["z"],
    }
    # Increments, put together again, are where dead reckoning went.
    east = north = 0.0
    heading = 0.0
    for row in log["odometry"]:
        east += row["forward_m"] * math.cos(heading) - row["left_m"] * math.sin(heading)
        north += row["forward_m"] * math.sin(heading) + row["left_m"] * math.cos(heading)
        heading += row["turn_rad"]
        if row["time_s"] >= float(known["/dvl_dead_reckoning#100"]["stamp"]) - 1e-6:
            break
    first, last = known["/dvl_dead_reckoning#1"], known["/dvl_dead_reckoning#100"]
    distance = math.hypot(last["x"] - first["x"], last["y"] - first["y"])
    assert math.hypot(east, north) == pytest.approx(distance, rel=1e-9)
    # There was no fix at first, and NaN in its place.
    without = int(next(note for note in notes if "/gps_odom" in note).split()[2])
    assert len(log["positions"]) == 204 - without
    fix = known["/gps_odom#100"]
    assert {"time_s": float(fix["stamp"]), "x_m": fix["x"], "y_m": fix["y"]} in log["positions"]
    LogFolder(tmp_path / "log")


@pytest.mark.parametrize("name", ["ardupilot/ardusub_small.BIN", "ardupilot/ardusub_dive_5m.BIN"])
def test_dataflash_of_an_rov(name: str, tmp_path: Path) -> None:
    log, _ = log_of(name, tmp_path)
    known, found = facts()[name], listed(name)
    counts = {"odometry": "XKF1", "compass": "ATT", "depth": "CTUN"}
    assert {file: len(rows) for file, rows in log.items()} == {
        file: known["counts"][topic] for file, topic in counts.items()
    }
    attitude = known["values"]["ATT#100"]
    assert log["compass"][99]["time_s"] == attitude["TimeUS"] / 1e6
    assert log["compass"][99]["compass_rad"] == pytest.approx(math.radians(attitude["Yaw"]))
    assert log["depth"][99]["depth_m"] == -known["values"]["CTUN#100"]["Alt"]
    ekf = shown(found, "XKF1", "100")
    speed = math.hypot(log["odometry"][99]["speed_m_s"], log["odometry"][99]["starboard_m_s"])
    assert speed == pytest.approx(math.hypot(ekf["VN"], ekf["VE"]), rel=1e-12)


def test_tlog_of_a_dive(tmp_path: Path) -> None:
    """Latitude and longitude stay 0, which is no place; from 12 m to the surface."""
    log, _ = log_of("ardupilot/ardusub_dive_12m.tlog", tmp_path)
    known = facts()["ardupilot/ardusub_dive_12m.tlog"]
    assert {file: len(rows) for file, rows in log.items()} == {"compass": 1236, "depth": 186}
    assert log["depth"][0]["depth_m"] == pytest.approx(12.179)
    assert log["depth"][99]["depth_m"] == pytest.approx(0.103)
    assert log["compass"][99]["compass_rad"] == known["values"]["ATTITUDE#100"]["yaw"]
    first = known["first_last_timestamp"]["ATTITUDE"][0]
    assert log["compass"][0]["time_s"] == pytest.approx(first, abs=3e-7, rel=0)


def test_tlog_with_acoustic_positions(tmp_path: Path) -> None:
    """All that a replay needs."""
    log, _ = log_of("ardupilot/ardusub_gps_input.tlog", tmp_path)
    known = facts()["ardupilot/ardusub_gps_input.tlog"]
    assert {file: len(rows) for file, rows in log.items()} == {
        "compass": 5245, "depth": 792, "odometry": 792, "positions": 1011,
    }  # fmt: skip
    fix = known["values"]["GPS_INPUT#100"]
    assert log["positions"][99]["latitude_deg"] == pytest.approx(fix["lat"] / 1e7, abs=1e-12)
    assert log["positions"][99]["longitude_deg"] == pytest.approx(fix["lon"] / 1e7, abs=1e-12)
    LogFolder(tmp_path / "log")


def test_acoustic_fixes(tmp_path: Path) -> None:
    log, notes = log_of("ugps/ugps_g2_filtered_2.csv", tmp_path)
    assert len(log["fixes"]) == 457
    known = facts()["ugps/ugps_g2_filtered_2.csv"]["values"]["1"]
    x, y = float(known["x"]), float(known["y"])
    assert log["fixes"][0] == {
        "time_s": float(known["timestamp"]),
        "source": 0,
        "range_m": pytest.approx(math.hypot(x, y)),
        "bearing_rad": pytest.approx(math.atan2(y, x)),
    }
    assert "left out: 43 messages of position that are not position_valid = true" in notes
    assert log["beacons"] == [{"source": 0, "x_m": 0, "y_m": 0}]
    LogFolder(tmp_path / "log")


def test_the_place_of_a_boat(tmp_path: Path) -> None:
    for name, count in (("nmea/nmea_udp_pier.txt", 129), ("nmea/saab_r4.log", 41)):
        folder = tmp_path / Path(name).stem
        folder.mkdir()
        log, _ = log_of(name, folder)
        assert list(log) == ["leaders"]
        assert len(log["leaders"]) == count
        known = facts()[name]["values"]["GPRMC#1"]
        assert log["leaders"][0]["latitude_deg"] == pytest.approx(known["latitude"], rel=1e-15)
        assert log["leaders"][0]["longitude_deg"] == pytest.approx(known["longitude"], rel=1e-15)


def test_usbl_beside_a_gnss_compass(tmp_path: Path) -> None:
    """A fix is the slant range made level, and the angle from the boat's bow at that time."""
    log, _ = log_of("usbl/azimuth_suite_2.log", tmp_path)
    assert {file: len(rows) for file, rows in log.items()} == {"fixes": 141, "leaders": 120}
    first = log["fixes"][0]  # 33.9 m at 4.5 degrees, 1.3 up; heading 289.77 38 ms before
    assert first["range_m"] == pytest.approx(33.9 * math.cos(math.radians(1.3)))
    assert first["azimuth_rad"] == pytest.approx(math.radians(289.77 + 4.5 - 360))
    LogFolder(tmp_path / "log")


def test_usbl_without_times(tmp_path: Path) -> None:
    mapping = """
        period_s = 1
        [fixes]
        topic = "USRTH"
        source = 0
        range_m = {along = ["slant_range_m", 0, {field = "true_elevation_deg", unit = "deg"}]}
        azimuth_rad = {field = "true_bearing_compass_deg", unit = "deg"}
        [beacons]
        rows = [{source = 0, x_m = 0, y_m = 0}]
    """
    log, _ = log_of("usbl/cerulean_rovl_rth.txt", tmp_path, mapping)
    assert [row["time_s"] for row in log["fixes"]] == list(range(90))
    assert log["fixes"][0]["range_m"] == pytest.approx(14.8 * math.cos(math.radians(28.3)))
    assert log["fixes"][0]["azimuth_rad"] == pytest.approx(math.radians(40.7))
    LogFolder(tmp_path / "log")


def test_usbl_table_as_fixes(tmp_path: Path) -> None:
    """It is north of the transponder, which is +y."""
    log, _ = log_of("usbl/pool_usbl_ranges.csv", tmp_path)
    known = facts()["usbl/pool_usbl_ranges.csv"]
    assert len(log["fixes"]) == known["rows"]
    for row, label in ((log["fixes"][0], "row_1"), (log["fixes"][42], "row_43")):
        assert row["range_m"] == float(known[label]["range"])
        assert row["bearing_rad"] == math.pi / 2
    LogFolder(tmp_path / "log")


def test_alog_of_an_auv(tmp_path: Path) -> None:
    """NAV_Y comes before NAV_X of the same time."""
    log, _ = log_of("alog/bluefin_unicorn.alog", tmp_path)
    assert {file: len(rows) for file, rows in log.items()} == {"truth": 1000, "depth": 1000}
    assert log["truth"][0] == {"time_s": 3870.24, "x_m": 4399.514508, "y_m": 2456.458545}
    assert log["truth"][999] == {"time_s": 4122.24, "x_m": 4614.641954, "y_m": 2139.872277}
    assert log["depth"][0] == {"time_s": 3870.24, "depth_m": 34.554}
