"""Made-up files of recorders: the messages in them, the logs of them, what is refused and where."""

from __future__ import annotations

import json
import math
import os
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from auvest.cli import app
from auvest.importers import (
    MappingError,
    Message,
    import_recording,
    listing,
    open_recording,
    read_mapping,
    recipe,
)
from auvest.importers.expressions import expression
from auvest.logs import LogError
from tests.attacks.recordings import (
    COUNT,
    KINDS,
    ODOM,
    ROS_KINDS,
    TIMES,
    packet,
    recordings,
    ros2,
    sentence,
    x_of,
)

#: The clock of each: whole seconds that TIMES count from.
_EPOCH = 1.7e9


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def written(folder: Path, name: str, raw: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(raw if isinstance(raw, bytes) else raw.encode())
    return path


def made(folder: Path, kind: str) -> Path:
    if kind not in recordings():
        pytest.skip("rosbags is not installed: pip install 'auvest[ros]'")
    name, raw, mapping = recordings()[kind]
    if mapping:
        written(folder, "mapping.toml", mapping)
    return written(folder, name, raw)


def log_of(folder: Path, path: Path, mapping: str | None = None) -> dict[str, list[list[float]]]:
    """The rows of each file of the log that an import makes, as they stand there."""
    recording = open_recording(path)
    if mapping is not None:
        written(folder, "mapping.toml", mapping)
    settings = folder / "mapping.toml"
    wanted = read_mapping(settings) if settings.exists() else recipe(recording.name)
    log = import_recording(recording, wanted, folder / "log")
    return {
        file.name: np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2).tolist()
        for file in log.path.glob("*.csv")
    }


def messages(path: Path) -> list[Message]:
    return list(open_recording(path).messages())


# ---- What is in a file ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [*KINDS, *ROS_KINDS])
def test_every_format_is_recognised_and_listed(tmp_path: Path, kind: str) -> None:
    """By its beginning, whatever its name; the times are those that were written."""
    path = made(tmp_path, kind)
    result = call("import", "--list", "--json", path)
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    part = max(found["topics"].values(), key=lambda part: part["messages"])
    assert part["messages"] == COUNT
    epoch = {
        "alog": 0,
        "dataflash": 0,
        "ulog": 0,
        "nmea": 1659960000,  # 12:00:00 of 8 August 2022, as `date -u` has it
    }.get(kind, _EPOCH)
    assert part["first_ns"] == round((epoch + TIMES[0]) * 1e9)
    assert part["last_ns"] == round((epoch + TIMES[-1]) * 1e9)
    assert part["rate_hz"] == pytest.approx(2)
    assert found["goes_back"] == 0


@pytest.mark.parametrize("kind", ["dataflash", "tlog", "ulog", "alog"])
def test_positions_become_the_truth_of_a_log(tmp_path: Path, kind: str) -> None:
    log = log_of(tmp_path, made(tmp_path, kind))
    epoch = _EPOCH if kind == "tlog" else 0
    assert log == {"truth.csv": [[epoch + t, x_of(t), 2.0] for t in TIMES]}


@pytest.mark.parametrize("kind", ROS_KINDS)
def test_poses_of_ros_become_increments(tmp_path: Path, kind: str) -> None:
    """Half a metre per second along the heading; the first pose moves nothing."""
    log = log_of(tmp_path, made(tmp_path, kind))
    assert log == {"odometry.csv": [[t, 0.25, 0.0, 0.0] for t in TIMES[1:]]}


@pytest.mark.parametrize("kind", ["ugps", "csv"])
def test_underwater_gps_becomes_fixes(tmp_path: Path, kind: str) -> None:
    """x forward, y starboard; the fourth poll had no position."""
    log = log_of(tmp_path, made(tmp_path, kind))
    assert log["beacons.csv"] == [[0, 0, 0]]
    expected = [
        [_EPOCH + t, 0, math.hypot(x_of(t), 2), math.atan2(2, x_of(t))]
        for k, t in enumerate(TIMES)
        if k != 3
    ]
    np.testing.assert_allclose(log["fixes.csv"], expected, rtol=1e-15)


def test_usbl_sentences_become_fixes(tmp_path: Path) -> None:
    """100 degrees from a bow at 350 is east, and 30 m of slant at 60 degrees are 15 m of range.

    The boat's own place is where they count from.
    """
    log = log_of(tmp_path, made(tmp_path, "nmea"))
    expected = [[1659960000 + t, 0, 15, math.pi / 2] for t in TIMES]
    np.testing.assert_allclose(log["fixes.csv"], expected, rtol=1e-14)
    assert "beacons.csv" not in log
    place = [48.5, -(4 + 33.5 / 60)]
    first = log["leaders.csv"][0]
    assert first == [1659960000 + TIMES[0], 0, *place]
    lines = [(tmp_path / "log" / f"{name}.csv").read_text() for name in ("leaders", "fixes")]
    assert [text.splitlines()[0] for text in lines] == [
        "time_s,source,latitude_deg,longitude_deg",
        "time_s,source,range_m,azimuth_rad",
    ]


def test_evologics(tmp_path: Path) -> None:
    """USBLLONG in the order of Evologics' documentation: east, north, up after x, y, z."""
    path = made(tmp_path, "evologics")
    log = log_of(tmp_path, path)
    expected = [[_EPOCH + t, 0, math.hypot(2, x_of(t)), math.atan2(x_of(t), 2)] for t in TIMES]
    np.testing.assert_allclose(log["fixes.csv"], expected, rtol=1e-15)
    first = messages(path)[0]
    assert first.stamp_ns == 99_750_000_000  # of the measurement, on the modem's clock
    assert (first.values["east_m"], first.values["north_m"], first.values["up_m"]) == (1, 2, -5)
    assert (first.values["propagation_us"], first.values["accuracy_m"]) == (25000, 0.05)


def test_usblangles_of_evologics(tmp_path: Path) -> None:
    line = "USBLANGLES,20.5,20.25,2,0.1,0.2,0.3,0.4,0.01,0.02,0.03,-30,120,0.005\n"
    (message,) = messages(written(tmp_path, "usbl.txt", line))
    assert message.values["true_bearing_rad"] == 0.3
    assert message.values["accuracy_rad"] == 0.005
    assert message.stamp_ns == 20_250_000_000
    (message,) = messages(written(tmp_path, "usbl.txt", line.replace("20.25", "1e308")))
    assert message.stamp_ns is None  # which is no time


def test_dvl_of_json_v3_has_the_time_of_validity(tmp_path: Path) -> None:
    path = made(tmp_path, "dvl")
    assert [message.stamp_ns for message in messages(path)] == [
        round((_EPOCH + t) * 1e6) * 1000 for t in TIMES
    ]
    log = log_of(tmp_path, path)  # without the report that is not valid
    assert log["odometry.csv"] == [[_EPOCH + t, 0.5, 0] for t in TIMES[:3] + TIMES[4:]]


def test_dvl_without_times_counts_its_periods(tmp_path: Path) -> None:
    """Milliseconds since the report before; what is the same line again is no new report."""
    a = '{"time": 250.5, "vx": 0.5, "vy": 0, "vz": 0, "velocity_valid": true, "format": "json_v1"}'
    b = a.replace("250.5", "100.25")
    path = written(tmp_path, "dvl.txt", f"{a}\r\n{a}\r\n{b}\r\n{a}\r\n")
    assert [message.time_ns for message in messages(path)] == [
        250_500_000, 250_500_000, 350_750_000, 601_250_000,
    ]  # fmt: skip
    found = listing(open_recording(path))
    assert found["topics"]["velocity"]["repeated"] == 1
    assert found["topics"]["velocity"]["different"] == 2
    mapping = '[odometry]\ntopic = "velocity"\nfresh = true\nspeed_m_s = "vx"\nyaw_rate_rad_s = 0\n'
    log = log_of(tmp_path, path, mapping)
    assert log["odometry.csv"] == [[0.2505, 0.5, 0], [0.35075, 0.5, 0], [0.60125, 0.5, 0]]


def test_dataflash_scales_what_it_stores_as_whole_numbers(tmp_path: Path) -> None:
    """Hundredths for c, C, e, E; degrees times 1e7 for L."""
    first = next(one for one in messages(made(tmp_path, "dataflash")) if one.topic == "POS")
    assert first.values["Turn"] == -1.5
    assert first.values["Depth"] == 3.25


def test_dataflash_is_in_utc_once_a_gps_knows_the_time(tmp_path: Path) -> None:
    """Week 2000 began on 6 May 2018; GPS was 18 s ahead of UTC; before the fix, too."""
    raw = recordings()["dataflash"][1]
    fixed = struct.pack("<QBIHii", 105_500_000, 3, 61_500, 2000, 0, 0)
    raw = raw[: -len(fixed)] + fixed
    path = written(tmp_path, "dive.bin", raw)
    (gps,) = (one for one in messages(path) if one.topic == "GPS")
    assert gps.time_ns == (1525564800 + 61 - 18) * 10**9 + 500_000_000
    first = next(one for one in messages(path) if one.topic == "POS")
    assert gps.time_ns - first.time_ns == 5_500_000_000


def test_packets_with_a_wrong_checksum_are_left_out_and_counted(tmp_path: Path) -> None:
    raw = bytearray(recordings()["tlog"][1])
    raw[8 + 6 + 4] ^= 1  # in x of the first packet
    found = listing(open_recording(written(tmp_path, "dive.tlog", bytes(raw))))
    assert found["skipped"] == {"LOCAL_POSITION_NED with a wrong checksum": 1}
    assert found["topics"]["LOCAL_POSITION_NED"]["messages"] == COUNT - 1
    assert found["topics"]["message 69"]["messages"] == COUNT
    assert found["facts"]["packets"] == 2 * COUNT


def test_packets_that_are_signed(tmp_path: Path) -> None:
    """A signature of 13 bytes follows the checksum, and a flag says so, which it covers."""
    one = packet(1_700_000_000_000_000, 173, 83, struct.pack("<ff", 2.5, 1.0))  # RANGEFINDER
    body = bytearray(one[8:-2])
    body[2] = 1
    from tests.attacks.recordings import mavlink_crc

    crc = mavlink_crc(bytes(body[1:]) + bytes([83]))
    signed = one[:8] + bytes(body) + struct.pack("<H", crc) + bytes(13)
    found = messages(written(tmp_path, "dive.tlog", signed + one))
    assert [message.values["distance"] for message in found] == [2.5, 2.5]


@pytest.mark.parametrize("kind", ["dataflash", "tlog", "ulog"])
def test_a_recording_that_was_cut_off_keeps_what_is_whole(tmp_path: Path, kind: str) -> None:
    """As when the battery is empty; a wrong byte within is no cut."""
    name, raw, _ = recordings()[kind]
    whole = messages(written(tmp_path, name, raw))
    path = written(tmp_path, name, raw[:-1])
    recording = open_recording(path)
    assert list(recording.messages()) == whole[: len(whole) - (kind != "ulog")]
    assert sum(recording.skipped.values()) == 1


def test_padding_at_the_end_of_ulog_data_is_not_there(tmp_path: Path) -> None:
    first = messages(made(tmp_path, "ulog"))[0]
    assert first.topic == "position_1"
    assert first.values == {"timestamp": 100_000_000, "at.x": 1.0, "at.y": 2.0, "valid": True}


def test_numbers_whose_sum_is_none_have_no_mean(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,x\n1,1e308\n2,1e308\n")
    found = listing(open_recording(path))["topics"]["row"]["fields"]["x"]
    assert found == {"min": 1e308, "max": 1e308, "mean": None, "missing": 0}


# ---- NMEA ----------------------------------------------------------------------------------------


def test_nmea_times(tmp_path: Path) -> None:
    """Midnight is passed; a zone is heeded; Unix time is read; a comma is a decimal mark."""
    hdt = sentence("HEHDT,1.5,T")

    def times(*prefixes: str) -> list[int | None]:
        text = "".join(f"{prefix} {hdt}\n" for prefix in prefixes)
        return [message.time_ns for message in messages(written(tmp_path, "nmea.txt", text))]

    day = 86400 * 10**9
    assert times("[23:59:59.5]", "[00:00:01]") == [day - 500_000_000, day + 10**9]
    assert times("2022-08-08T12:00:00+02:00") == [1659952800 * 10**9]
    assert times("2022-08-08T08:30:00-01:30") == [1659952800 * 10**9]
    assert times("2022-08-08 10:00:00,25Z") == [1659952800 * 10**9 + 250_000_000]
    assert times("1659952800.125:") == [1659952800 * 10**9 + 125_000_000]


def test_nmea_says_how_it_is_read(tmp_path: Path) -> None:
    lines = [
        "# header", sentence("GPRMC,100140.00,A,4830.6,S,00433.5,W,1.0,90.0,080822,,"),
        "$HEHDT,291.04,T*00", "$HEHDT,291.04,T", "!AIVDM,1,1,,B,13,0*24",
        sentence("HEHDT,,"), sentence("XXYYY,abc,1"),
    ]  # fmt: skip
    recording = open_recording(written(tmp_path, "nmea.txt", "\n".join(lines) + "\n"))
    rmc, hdt, other = recording.messages()
    assert rmc.values["latitude_deg"] == -(48 + 30.6 / 60)
    assert rmc.values["longitude_deg"] == -(4 + 33.5 / 60)
    assert rmc.stamp_ns == (1659916800 + 36100) * 10**9
    assert hdt.values == {"heading_deg": None}
    assert hdt.time_ns == rmc.stamp_ns  # the latest that was told
    assert other.values == {"f1": "abc", "f2": 1}
    assert recording.skipped == {
        "other line": 1,
        "sentence with a wrong checksum": 1,
        "sentence without a checksum": 1,
        "encapsulated sentence": 1,
    }


def quaternion(yaw: float, pitch: float, roll: float) -> tuple[float, float, float, float]:
    """About z, then the new y, then the new x: the product of three turns."""
    c, s = (
        [function(angle / 2) for angle in (yaw, pitch, roll)] for function in (math.cos, math.sin)
    )
    return (
        c[0] * c[1] * c[2] + s[0] * s[1] * s[2],
        c[0] * c[1] * s[2] - s[0] * s[1] * c[2],
        c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
        s[0] * c[1] * c[2] - c[0] * s[1] * s[2],
    )


# ---- Mappings ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "values", "expected"),
    [
        ("a", {"a": 2.5}, 2.5),
        (3, {}, 3),
        ({"field": "a", "unit": "deg"}, {"a": 180}, math.pi),
        ({"field": "a", "unit": "kn"}, {"a": 3600}, 1852),
        ({"field": "a", "scale": -2, "offset": 1}, {"a": 3}, -5),
        ({"field": "a", "missing": -1}, {"a": -1}, None),
        ({"field": "a", "unit": "deg", "wrap": True}, {"a": 270}, -math.pi / 2),
        ("a", {"a": None}, None),
        ({"hypot": ["a", "b"]}, {"a": 3, "b": -4}, 5),
        ({"hypot": ["a", "b"]}, {"a": 3, "b": None}, None),
        ({"atan2": ["b", "a"]}, {"a": 1, "b": 1}, math.pi / 4),
        ({"sum": ["a", {"field": "b", "scale": 10}]}, {"a": 1, "b": 2}, 21),
        # North 1, east 2, heading east: ahead is east, and to starboard is south.
        ({"along": ["n", "e", "h"]}, {"n": 1, "e": 2, "h": math.pi / 2}, 2),
        ({"across": ["n", "e", "h"]}, {"n": 1, "e": 2, "h": math.pi / 2}, -1),
        # Heading 0.6 of a vehicle with pitch 0.4 and roll 0.2: products of half angles.
        (
            {"yaw": ["w", "x", "y", "z"]},
            dict(zip("wxyz", quaternion(0.6, 0.4, 0.2), strict=True)),
            0.6,
        ),
    ],
)
def test_expressions(given: Any, values: dict[str, Any], expected: float | None) -> None:
    found = expression(given, "here").evaluate(Message("t", 0, values, "line 1"), {})
    assert found == (None if expected is None else pytest.approx(expected, rel=1e-14))


def test_numbers_of_another_topic_are_those_nearest_in_time(tmp_path: Path) -> None:
    """Whichever comes first in the file; none that is further away than a second."""
    lines = [
        "1.0 B p 10", "1.0 A p 1", "2.0 A p 2", "2.0 B p 20", "3.0 A p 3", "3.4 B p 34",
        "3.9 B p 39", "4.0 A p 4", "7.0 A p 7", "9.0 B p 90",
    ]  # fmt: skip
    text = "%% LOGSTART 0\n" + "".join(f"{line}\n" for line in lines)
    mapping = '[truth]\ntopic = "A"\nx_m = "value"\ny_m = {topic = "B", field = "value"}\n'
    log = log_of(tmp_path, written(tmp_path, "dive.alog", text), mapping)
    assert log["truth.csv"] == [[1, 1, 10], [2, 2, 20], [3, 3, 34], [4, 4, 39]]


def test_increments_turn_with_the_vehicle(tmp_path: Path) -> None:
    """One metre north with the bow east is one metre to port, which is to the left of +x to +y."""
    text = "t,x,y,h\n0,0,0,0\n1,2,0,1.5\n2,2,1,-1.5\n3,,1,0\n4,2,1,-1.5\n"
    mapping = '[odometry]\ntopic = "row"\nincrements = {x_m = "x", y_m = "y", heading_rad = "h"}\n'
    log = log_of(tmp_path, written(tmp_path, "poses.csv", text), mapping)
    np.testing.assert_allclose(
        log["odometry.csv"],
        [
            [1, 2, 0, 1.5],
            [2, math.sin(1.5), math.cos(1.5), -3],
            [4, 0, 0, 0],  # since the last pose that was there
        ],
        atol=1e-15,
    )


def test_one_log_of_two_recordings(tmp_path: Path) -> None:
    source = tmp_path / "dive"
    source.mkdir()
    written(source, "other.csv", "t,speed,turn\n1,0.5,0.1\n")
    path = written(source, "ranges.csv", "t,range\n1.5,30\n")
    mapping = (
        '[ranges]\ntopic = "row"\nsource = 1\nrange_m = "range"\n'
        '[odometry]\nrecording = "other.csv"\ntopic = "row"\nspeed_m_s = "speed"\n'
        'yaw_rate_rad_s = "turn"\n'
        "[beacons]\nrows = [{source = 1, x_m = 5, y_m = 6}]\n"
        "[start]\nrows = [{time_s = 0, x_m = 0, y_m = 0, heading_rad = 0}]\n"
    )
    assert log_of(tmp_path, path, mapping) == {
        "ranges.csv": [[1.5, 1, 30]],
        "odometry.csv": [[1, 0.5, 0.1]],
        "beacons.csv": [[1, 5, 6]],
        "start.csv": [[0, 0, 0, 0]],
    }


def test_messages_without_times_need_a_period(tmp_path: Path) -> None:
    line = sentence("USRTH,20.0,-20.0,30.0,14.8,49.3,40.7,28.3,-0.3,1.7,29.5,60.5,72")
    path = written(tmp_path, "rovl.txt", f"{line}\n{line}\n")
    with pytest.raises(LogError, match=r"rovl.txt, line 1: USRTH has no time; .* period_s"):
        log_of(tmp_path, path)
    mapping = (
        'period_s = 0.5\n[fixes]\ntopic = "USRTH"\nsource = 0\nrange_m = "slant_range_m"\n'
        'bearing_rad = {field = "true_bearing_compass_deg", unit = "deg"}\n'
    )
    log = log_of(tmp_path, path, mapping)
    bearing = 40.7 * math.pi / 180
    assert log["fixes.csv"] == [[0, 0, 14.8, bearing], [0.5, 0, 14.8, bearing]]


def test_times_in_another_unit_are_the_mappings_to_tell(tmp_path: Path) -> None:
    """Milliseconds since 1970 are no seconds; a single one among seconds is an error."""
    path = written(tmp_path, "a.csv", "timestamp,x\n1700000000500,1\n1700000001000,2\n")
    mapping = '[truth]\ntopic = "row"\nx_m = "x"\ny_m = 0\n'
    with pytest.raises(LogError, match=r"line 2: row has no time; .* time_s = {field = "):
        log_of(tmp_path, path, mapping)
    log = log_of(tmp_path, path, mapping + 'time_s = {field = "timestamp", unit = "ms"}\n')
    assert log["truth.csv"] == [[1700000000.5, 1, 0], [1700000001, 2, 0]]
    path = written(tmp_path, "a.csv", "timestamp,x\n1700000000,1\n1700000001000,2\n")
    with pytest.raises(LogError, match="line 3: timestamp is '1700000001000', which is no time"):
        listing(open_recording(path))


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ("", "names no file of a log"),
        ("[fixes", "is not TOML"),
        ('clock = "wall"\n', 'clock is "recorded" or "stamp"'),
        ("[wishes]\n", "wishes is no file of a log"),
        ('[truth]\ntopic = "row"\nx_m = "x"\n', r"truth.csv has the columns .*, not time_s,x_m"),
        ('[truth]\nx_m = "x"\ny_m = "y"\n', "truth: needs a topic, or a type"),
        (
            '[odometry]\ntopic = "a"\nincrements = {x_m = "x", y_m = "y"}\n',
            "odometry: increments are made of x_m, y_m, heading_rad",
        ),
        ('[truth]\ntopic = "row"\nx_m = true\ny_m = "y"\n', "truth.x_m: a truth value"),
        ('[truth]\ntopic = "row"\nx_m = {hypot = 1}\ny_m = 0\n', "truth.x_m: hypot takes a list"),
        ('[truth]\ntopic = "row"\nx_m = {field = "x", unit = "in"}\ny_m = 0\n', "unit 'in' is not"),
        ('[truth]\ntopic = "row"\nx_m = {field = "x", per = 1}\ny_m = 0\n', "per means nothing"),
        ('[truth]\ntopic = "row"\nx_m = "z"\ny_m = "y"\n', "row has no field z; it has t, x, y"),
        ("[beacons]\nrows = [{source = 0.5, x_m = 0, y_m = 0}]\n", "source is 0.5, not an integer"),
        ("[beacons]\nrows = []\n", "rows are tables of numbers"),
    ],
)
def test_mappings_that_are_wrong(tmp_path: Path, mapping: str, message: str) -> None:
    path = written(tmp_path, "a.csv", "t,x,y\n1,2,3\n")
    settings = written(tmp_path, "mapping.toml", mapping)
    result = call("import", path, tmp_path / "log", "--mapping", settings)
    assert result.exit_code == 2
    assert re.search(message, result.stderr), result.stderr
    assert not (tmp_path / "log").exists()


@pytest.mark.parametrize("field", ["float y!", "float y z", "float[2 y", "float"])
def test_a_field_of_a_ulog_definition_is_a_type_and_a_name(tmp_path: Path, field: str) -> None:
    name, raw, _ = recordings()["ulog"]
    body, made = b"point:float x;float y;", f"point:float x;{field};".encode()
    whole = struct.pack("<HB", len(body), ord("F")) + body
    assert raw.count(whole) == 1
    raw = raw.replace(whole, struct.pack("<HB", len(made), ord("F")) + made)
    with pytest.raises(LogError, match=re.escape(f"definition of point: {field!r} is no field")):
        listing(open_recording(written(tmp_path, name, raw)))


def test_messages_that_auvest_does_not_know_need_a_mapping(tmp_path: Path) -> None:
    name, raw, _ = recordings()["ulog"]
    path = written(tmp_path, name, raw)
    with pytest.raises(LogError, match=r"dive.ulg: holds nothing .*vehicle_gps_position_0"):
        log_of(tmp_path, path)
    assert [one.name for one in tmp_path.iterdir()] == [name]


def test_two_topics_of_one_type_are_not_mixed(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'auvest[ros]'")
    path = written(tmp_path, "dive.mcap", ros2("mcap", topics=("/a", "/b")))
    mapping = ODOM.replace('topic = "/odom"', 'type = "nav_msgs/msg/Odometry"')
    with pytest.raises(MappingError, match="nav_msgs/msg/Odometry as /a and /b"):
        log_of(tmp_path, path, mapping)
    log = log_of(tmp_path, path, ODOM.replace("/odom", "/b"))
    assert log == {"odometry.csv": [[t, 0.25, 0.0, 0.0] for t in TIMES[1:]]}


def test_rows_that_depend_on_other_files(tmp_path: Path) -> None:
    text = "t,r,b\n1,30,0.5\n"
    rows = "rows = [{source = 0, x_m = 0, y_m = 0}]\n"
    fixes = '[fixes]\ntopic = "row"\nsource = 0\nrange_m = "r"\nbearing_rad = "b"\n'
    truth = '[truth]\ntopic = "row"\nx_m = "r"\ny_m = "b"\n'
    path = written(tmp_path, "a.csv", text)
    for others, conditions, there in (
        (fixes, 'beside = "fixes"\n', True),
        (truth, 'beside = "fixes"\n', False),
        (fixes, 'unless = "fixes"\n', False),
        (truth, 'unless = "fixes"\n', True),
    ):
        log = log_of(tmp_path, path, f"{others}[beacons]\n{rows}{conditions}")
        assert ("beacons.csv" in log) == there


# ---- What is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "raw", "message"),
    [
        ("a.csv", "t,x\n1,2\n1,2", r"a.csv, line 3: does not end with a line end: truncated"),
        ("a.csv", "t,x\n1,2,3\n", r"a.csv, line 2: 3 cells, expected 2: a comma within a"),
        ("a.csv", "t,x\n1\n", r"a.csv, line 2: 1 cell, expected 2: truncated\?$"),
        ("a.csv", 't,x\n"1"\r,2\n', r"a.csv, line 2: has a carriage return within it: lines must"),
        ("a.csv", "t,x\n\n1,2\n", r"a.csv, line 2: is blank, and rows follow"),
        ("a.csv", "t,x\n1e400,2\n", r"a.csv, line 2: t is '1e400', which is no time in s"),
        ("a.csv", "t,t\n1,2\n", r"a.csv, line 1: has the column t twice"),
        ("a.csv", "1,2\n3,4\n", r"a.csv, line 1: '1' is not the name of a column"),
        ("a.json", '{"vx": 1', r"a.json, line 1: is not JSON"),
        ("a.json", '{"vx": 1e999}\n', r"a.json, line 1: is not JSON: 1e999 is too large a nu"),
        ("a.json", '{"vx": ' + "9" * 400 + "}\n", r"JSON: 9999…9999 is too large a number$"),
        ("a.json", '{"vx": 1, "time": -5}\n', r"a.json, line 1: time is -5, which are no mill"),
        ("a.alog", "%% LOGSTART 1\n1 X\n", r"a.alog, line 2: 2 words; expected time"),
        ("a.alog", "%% LOGSTART 1\nnan X p 1\n", r"a.alog, line 2: 'nan' is no time in s"),
        ("a.txt", sentence("GPGGA,100140,9830.6,N,1,E,1") + "\n", r"a.txt, line 1: '9830.6,N' is"),
        ("a.txt", sentence("GPGGA,106140,,,,,1") + "\n", r"a.txt, line 1: '106140' is no time"),
        ("a.txt", "$PAZM3,1,0", r"a.txt, line 1: PAZM3 has no checksum, and the line no end"),
        ("a.bin", b"\xa3\x95\x81abc", r"a.bin, byte 0: message 129 is not described by any FMT"),
        ("a.tlog", b"\0" * 8 + b"\x55" * 20, r"a.tlog, byte 0: no packet begins here"),
        ("a.ulg", b"ULog\x01\x12\x35\x09" + bytes(8), r"a.ulg, byte 7: version 9 is not known"),
        ("a.xyz", b"\x00\x01", r"a.xyz: is of no format known here"),
    ],
)
def test_what_does_not_follow_its_format_is_refused_by_its_place(
    tmp_path: Path, name: str, raw: bytes | str, message: str
) -> None:
    with pytest.raises(LogError, match=message):
        listing(open_recording(written(tmp_path, name, raw)))


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        ("inf", r"a.csv, line 3: x is 'inf', not a number"),
        ("1_000", r"a.csv, line 3: x is '1_000', not a number"),
        ("true", r"a.csv, line 3: x is 'True', not a number"),
        ("3e7", r"a.csv, line 3: x_m: 30000000 lies outside -10000000\.\.10000000 m \(mill"),
    ],
)
def test_what_no_log_can_hold_is_refused_and_leaves_nothing(
    tmp_path: Path, cell: str, message: str
) -> None:
    path = written(tmp_path, "a.csv", f"t,x,y\n1,2,3\n2,{cell},3\n")
    mapping = '[truth]\ntopic = "row"\nx_m = "x"\ny_m = "y"\n'
    with pytest.raises(LogError, match=message):
        log_of(tmp_path, path, mapping)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["a.csv", "mapping.toml"]


def test_times_that_go_back_are_said(tmp_path: Path) -> None:
    """The rows stay in the order of recording, in which a replay takes them."""
    path = written(tmp_path, "a.csv", "t,x\n1,1\n3,2\n2,3\n4,4\n")
    settings = written(tmp_path, "m.toml", '[truth]\ntopic = "row"\nx_m = "x"\ny_m = 0\n')
    result = call("import", path, tmp_path / "log", "--mapping", settings, "--json")
    assert "truth.csv: times go back 1 time" in json.loads(result.stdout)["notes"]
    rows = np.loadtxt(tmp_path / "log" / "truth.csv", delimiter=",", skiprows=1)
    assert rows[:, 0].tolist() == [1, 3, 2, 4]


def test_rows_without_a_number_are_left_out_and_counted(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,x,y\n1,2,3\n2,nan,3\n3,,3\n4,5,6\n")
    settings = written(tmp_path, "m.toml", '[truth]\ntopic = "row"\nx_m = "x"\ny_m = "y"\n')
    result = call("import", path, tmp_path / "log", "--mapping", settings, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["rows"] == {"truth.csv": 2}
    assert "left out: 2 messages of row without x_m" in found["notes"]
    assert any("not yet a log that can be replayed" in note for note in found["notes"])


def test_a_file_of_which_nothing_is_left_is_refused(tmp_path: Path) -> None:
    mapping = '[truth]\ntopic = "NAV_X"\nx_m = "value"\ny_m = 0\n'
    path = written(tmp_path, "a.alog", "%% LOGSTART 1\n1 NAV_X p none\n")
    with pytest.raises(LogError, match="value is 'none', not a number"):
        log_of(tmp_path, path, mapping)
    path = written(tmp_path, "a.alog", "%% LOGSTART 1\n1 OTHER p 5\n")
    with pytest.raises(LogError, match=r"holds nothing for a log; .* is of NAV_X"):
        log_of(tmp_path, path, mapping)


def test_a_recording_is_never_written_into(tmp_path: Path) -> None:
    path = made(tmp_path, "csv")
    for output in (tmp_path, path):
        result = call("import", path, output, "--force")
        assert result.exit_code == 2
        assert "in or above its source" in result.stderr
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_pipes_are_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "dive.tlog")
    with pytest.raises(LogError, match="is not a file"):
        open_recording(tmp_path / "dive.tlog")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--list"], "Missing argument"),
        (["--list", "a", "b", "c"], r"expected \[FORMAT\] SOURCE"),
        (["a"], r"expected \[FORMAT\] SOURCE OUT"),
        (["a", "b", "--at", "5"], "is for --list"),
        (["--list", "a", "--mapping", "m.toml"], "is for logs of recordings"),
        (["goats14", "a", "b", "--mapping", "m.toml"], "is for logs of recordings"),
        (["gif", "a", "b"], "'gif' is none of the formats"),
    ],
)
def test_words_that_say_nothing(words: list[str], message: str) -> None:
    result = CliRunner().invoke(app, ["import", *words], env={"COLUMNS": "1000"})
    assert result.exit_code == 2
    assert re.search(message, result.output), result.output


def test_the_table_for_people_has_every_topic(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        app, ["import", "--list", str(made(tmp_path, "tlog"))], env={"COLUMNS": "200"}
    )
    assert result.exit_code == 0
    assert re.search(rf"LOCAL_POSITION_NED .* {COUNT} .* 1700000100.000 ", result.output)
    assert re.search(rf"message 69 .* {COUNT} ", result.output)


def test_a_missing_package_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import builtins

    kept = builtins.__import__

    def refuse(name: str, *more: Any, **options: Any) -> Any:
        if name.startswith("rosbags"):
            raise ImportError(name)
        return kept(name, *more, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    path = written(tmp_path, "dive.bag", b"#ROSBAG V2.0\n")
    result = call("import", "--list", path)
    assert result.exit_code == 2
    needed = "ROS bags are read with the package rosbags: pip install 'auvest[ros]'"
    assert result.stderr == f"Error: {needed}\n"


def test_a_damaged_bag_is_refused_in_the_words_of_its_reader(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'auvest[ros]'")
    path = written(tmp_path, "dive.bag", b"#ROSBAG V2.0\n")
    with pytest.raises(LogError) as caught:
        listing(open_recording(path))
    said = re.escape(f"{path}: is not a bag that can be read: ")
    assert re.match(rf"{said}(?!\w*(Error|Exception):)\S", str(caught.value))


def test_mapping_errors_are_no_log_errors() -> None:
    """What is wrong in a mapping is the user's, not the recording's."""
    assert not issubclass(MappingError, LogError)
