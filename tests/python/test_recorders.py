"""Files of real recorders: what `auvest import --list --json` says of them, against the facts that
other readers found in them (rosbags, pymavlink, pyulog, pynmea2, json, csv).

The files are not part of the project; AUVEST_DATA names the folder that has them.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from auvest.cli import app

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
