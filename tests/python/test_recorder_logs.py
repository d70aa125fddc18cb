"""Made-up files of recorders: the messages in them, the logs of them, what is refused and where."""

from __future__ import annotations

import json
import math
import os
import re
import struct
from datetime import date
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
from auvest.importers.recording import flat, nanoseconds, value_of
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


def ulog(*parts: tuple[str, bytes]) -> bytes:
    """A ULog of these messages, by their letters."""
    head = b"ULog\x01\x12\x35\x01" + bytes(8)
    return head + b"".join(struct.pack("<HB", len(body), ord(kind)) + body for kind, body in parts)


def subscribed(*definitions: bytes, name: bytes = b"p") -> bytes:
    """A ULog of definitions, and a subscription to one of them as number 7."""
    return ulog(*(("F", one) for one in definitions), ("A", b"\2" + struct.pack("<H", 7) + name))


def fmt(kind: int, name: str, letters: str, columns: str, size: int) -> bytes:
    """FMT of DataFlash; 89 bytes."""
    texts = name.encode(), letters.encode(), columns.encode()
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size + 3, *texts)


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


def test_the_listing_counts_what_is_missing(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,x\n1,\n2,5\n3,\n4,\n")
    found = listing(open_recording(path))["topics"]["row"]["fields"]["x"]
    assert (found["missing"], found["min"], found["max"]) == (3, 5, 5)


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


def test_types_lists_and_texts_of_a_ulog(tmp_path: Path) -> None:
    """A list has an index, a text ends at its zero, and what is not finite is missing.

    Of a long list the first 64 are kept; padding within is passed over; a definition that comes
    again as it was is no other.
    """
    inner, outer = (
        b"q:int16_t v;uint8_t[1] _padding0;",
        b"p:uint64_t timestamp;q[2] at;char[4] name;float w;double u;uint8_t[66] many;",
    )
    body = b"\7\0" + struct.pack("<Qh1xh1x4sfd66B", 5, -3, 4, b"ab\0c", math.nan, 1.5, *range(66))
    key = b"char[5] ver_hw"
    other = b"char[3] sys_uuid"
    raw = ulog(
        ("B", bytes(8) + b"\1" + bytes(31)),  # data were appended, which is read on the way
        ("I", bytes([len(key)]) + key + b"V6C00"),
        ("I", bytes([len(other)]) + other + b"abc"),
        ("I", b""),
        *(("F", one) for one in (inner, outer, outer)),
        ("A", b"\2\7\0p"), ("O", b"\5\0"), ("D", body), ("O", b"\6\0"),
    )  # fmt: skip
    recording = open_recording(written(tmp_path, "dive.ulg", raw))
    (message,) = recording.messages()
    assert message.values == {
        "timestamp": 5, "at[0].v": -3, "at[1].v": 4, "name": "ab", "w": None, "u": 1.5,
        **{f"many[{k}]": k for k in range(64)},
    }  # fmt: skip
    assert (message.topic, message.time_ns) == ("p_2", 5000)
    assert recording.facts == {"start_us": 0, "ver_hw": "V6C00", "dropouts": 2}
    assert list(recording.messages(("p_1",))) == []


@pytest.mark.parametrize("rest", [b"\xfd\1\0\0", b"\xfe\1\0\1", b""])
def test_a_packet_that_is_cut_in_its_head_is_counted(tmp_path: Path, rest: bytes) -> None:
    whole = packet(5, 173, 83, struct.pack("<ff", 2.5, math.inf))
    recording = open_recording(written(tmp_path, "a.tlog", whole + bytes(8) + rest))
    (message,) = recording.messages()
    assert message.values == {"distance": 2.5, "voltage": None}
    assert recording.skipped == {"packet cut by the end of the file": 1}
    assert recording.facts == {"packets": 1}


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
    assert times("2022-08-08T12:00:00+0200") == [1659952800 * 10**9]
    assert times("12:00:60.5") == [43260 * 10**9 + 500_000_000]  # a leap second
    # What is no time is none, and a day without a date stays one: no Unix time in between.
    assert times("24:00:00", "12:60:00", "12:00:61", "2022-13-08 12:00:00") == [None] * 4
    assert times("00:00:01", "1659952800", "00:00:03") == [10**9, None, 3 * 10**9]
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


def test_nmea_dates(tmp_path: Path) -> None:
    """Of RMC, or ZDA's numbers; the latest stays where a sentence has none, or one that is none."""
    lines = [
        sentence(line)
        for line in (
            "GPGGA,000010,4830.6,N,00433.5,W,1", "GPZDA,000020,07,08,2022,00,00",
            "GPZDA,000030,31,02,2022,00,00", "GPRMC,000040,A,,,,,,,080822,,",
            "GPRMC,000050,A,,,,,,,320822,,",
        )
    ]  # fmt: skip
    path = written(tmp_path, "nmea.txt", "\n".join(lines) + "\n")
    assert [message.stamp_ns for message in messages(path)] == [
        None, *((1659916800 + s) * 10**9 for s in (20 - 86400, 30 - 86400, 40, 50)),
    ]  # fmt: skip


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
        ({"hypot": ["a"], "scale": 2}, {"a": None}, None),
        ({"field": "a", "topic": "u"}, {"a": 3}, None),  # nothing came from there
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


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (math.nan, "here: nan is not a number"),
        (True, "here: a truth value is no number"),
        ([1], "here: expected a field, a number or a table, not [1]"),
        ({}, "here: needs one of field, hypot, atan2, sum, along, across, yaw"),
        (
            {"field": "a", "sum": ["a"]},
            "here: needs one of field, hypot, atan2, sum, along, across, yaw",
        ),
        ({"field": 1}, "here: field and topic are names"),
        ({"field": "a", "topic": 1}, "here: field and topic are names"),
        ({"field": "a", "missing": True}, "here: missing is True, not a number"),
        ({"field": "a", "scale": "2"}, "here: scale is '2', not a number"),
        ({"field": "a", "offset": math.inf}, "here: offset is inf, not a number"),
        ({"field": "a", "wrap": 1}, "here: wrap is true or false"),
        ({"sum": ["a"], "topic": "u"}, "here: topic means nothing beside sum"),
        ({"yaw": ["a"]}, "here: yaw takes a list of 4"),
        ({"hypot": []}, "here: hypot takes a list of 1 to 4"),
        ({"sum": [{"atan2": ["a", "b", "c"]}]}, "here.sum: atan2 takes a list of 2"),
    ],
)
def test_what_is_no_expression(given: Any, message: str) -> None:
    with pytest.raises(MappingError) as refused:
        expression(given, "here")
    assert str(refused.value) == message


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


_BEACON = "source = 0, x_m = 0, y_m = 0"


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ("period_s = 0\n[truth]\n", "period_s is 0, not seconds above 0"),
        ("period_s = 'x'\n[truth]\n", "period_s is 'x', not seconds above 0"),
        ("truth = 5\n", "truth: expected a table"),
        ("[truth]\ntopic = 5\n", "truth: topic is not what it must be"),
        (f"[beacons]\nrows = [{{{_BEACON}}}]\nfresh = true\n", "beacons: rows stand alone"),
        (f"[beacons]\nrows = [{{{_BEACON}}}]\nx_m = 1\n", "beacons: rows stand alone"),
        ('[truth]\ntopic = "a"\nbeside = "fixes"\n', "truth: beside and unless are for rows"),
        ('[truth]\ntopic = "a"\nunless = "fixes"\n', "truth: beside and unless are for rows"),
        (
            f'[beacons]\nrows = [{{{_BEACON}}}]\nunless = "wishes"\n',
            "beacons: wishes is no file of a log",
        ),
        (
            f"[beacons]\nrows = [{{{_BEACON}}}, {{source = 1, x_m = 0}}]\n",
            "beacons: rows have the same columns",
        ),
        ('[truth]\ntopic = "a"\ntype = "b"\n', "truth: needs a topic, or a type"),
    ],
)
def test_mappings_are_refused_before_a_recording_is_read(
    tmp_path: Path, mapping: str, message: str
) -> None:
    path = written(tmp_path, "mapping.toml", mapping)
    with pytest.raises(MappingError) as refused:
        read_mapping(path)
    assert str(refused.value) == f"{path}: {message}"


def test_a_mapping_is_a_file(tmp_path: Path) -> None:
    missing = tmp_path / "none.toml"
    for path, message in (
        (tmp_path, f"{tmp_path} is not a file"),
        (
            missing,
            f"{missing} cannot be read: [Errno 2] No such file or directory: {str(missing)!r}",
        ),
    ):
        with pytest.raises(MappingError) as refused:
            read_mapping(path)
        assert str(refused.value) == message


def test_one_of_several_values_of_a_field(tmp_path: Path) -> None:
    """A number is no truth value: 1 is not true."""
    path = written(tmp_path, "a.csv", "t,x,y\n1,2,3\n2,4,3\n3,5,6\n4,true,6\n5,1,6\n")
    mapping = '[truth]\ntopic = "row"\nwhen = {x = [2, 5, true]}\nx_m = "t"\ny_m = "y"\n'
    assert log_of(tmp_path, path, mapping) == {"truth.csv": [[1, 1, 3], [3, 3, 6], [4, 4, 6]]}


def test_two_tables_of_one_file_have_the_same_columns(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,x,y\n1,2,3\n")
    mapping = (
        '[[positions]]\ntopic = "row"\nx_m = "x"\ny_m = "y"\n'
        '[[positions]]\ntopic = "row"\nlatitude_deg = "x"\nlongitude_deg = "y"\n'
    )
    with pytest.raises(MappingError) as refused:
        log_of(tmp_path, path, mapping)
    assert str(refused.value) == "positions.csv is given different columns by two tables"


def test_a_recording_without_stamps_has_none(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,x,y\n1,2,3\n")
    with pytest.raises(LogError) as refused:
        log_of(tmp_path, path, 'clock = "stamp"\n[truth]\ntopic = "row"\nx_m = "x"\ny_m = "y"\n')
    assert str(refused.value) == (
        f'{path}, line 2: row has no stamp; in a mapping, clock = "recorded" takes the time of '
        "the recording"
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", None), (" NaN ", None), ("true", True), ("True", True), ("False", False),
        ("false", False), ("+7", 7), ("-.5", -0.5), ("1_0", "1_0"), ("1e400", "1e400"),
        ("123456789012345678", 123456789012345678), ("1234567890123456789", 1234567890123456800.0),
    ],
)  # fmt: skip
def test_a_cell_is_taken_for_what_it_is(text: str, expected: Any) -> None:
    found = value_of(text)
    assert found == expected
    assert type(found) is type(expected)


@pytest.mark.parametrize(
    ("seconds", "expected"),
    [
        ("1.5", 1_500_000_000), ("-1e-9", -1), ("0.0000000019", 1), ("1e9999", None), ("x", None),
        ("100000000000", 10**20), ("100000000000.000000001", None), ("1" * 41, None),
    ],
)  # fmt: skip
def test_nanoseconds_of_what_is_written(seconds: str, expected: int | None) -> None:
    assert nanoseconds(seconds) == expected


def test_parts_and_lists_have_names() -> None:
    """A list of more than 64 is a length; what JSON has not is its text."""
    tree = {
        "at": {"x": 1.5, "of": [1, None, {"k": "a"}]}, "on": date(2022, 8, 9),
        "beams": list(range(65)), "few": list(range(64)),
    }  # fmt: skip
    assert flat(tree) == {
        "at.x": 1.5, "at.of[0]": 1, "at.of[1]": None, "at.of[2].k": "a", "on": "2022-08-09",
        "beams.length": 65, **{f"few[{k}]": k for k in range(64)},
    }  # fmt: skip


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


_V1 = b"\xfe\x01\0\1\1\x45\0\0\0"  # a packet of message 69


@pytest.mark.parametrize(
    ("name", "raw", "message"),
    [
        ("a.csv", "t,x\n1,2\n1,2", "line 3: does not end with a line end: truncated"),
        ("a.csv", "t,x\n1,2,3\n",
         "line 2: 3 cells, expected 2: a comma within a cell, or decimal commas?"),
        ("a.csv", "t,x\n1\n", "line 2: 1 cell, expected 2: truncated?"),
        ("a.csv", 't,x\n"1"\r,2\n',
         "line 2: has a carriage return within it: lines must end with LF or CRLF"),
        ("a.csv", "t,x\n\n1,2\n", "line 2: is blank, and rows follow"),
        ("a.csv", "t,x\n1e400,2\n", "line 2: t is '1e400', which is no time in s"),
        ("a.csv", "t,t\n1,2\n", "line 1: has the column t twice"),
        ("a.csv", "1,2\n3,4\n", "line 1: '1' is not the name of a column"),
        ("a.csv", "t, ,x\n1,2,3\n", "line 1: '' is not the name of a column"),
        ("a.csv", 't,"x\n', "line 1: is no row of cells: unexpected end of data"),
        ("a.csv", b"t,x\n1,\xff\n", "line 2: is not UTF-8 text"),
        ("a.csv", "t,x\n1," + "2" * (1 << 20) + "\n", "line 2: is longer than 1048576 bytes"),
        ("a.json", '{"vx": 1', "line 1: is not JSON: Expecting ',' delimiter: line 1 column 9 "
         "(char 8)"),
        ("a.json", '{"vx": 1e999}\n', "line 1: is not JSON: 1e999 is too large a number"),
        ("a.json", '{"vx": ' + "9" * 400 + "}\n",
         "line 1: is not JSON: 9999…9999 is too large a number"),
        ("a.json", '{"vx": 1}\n\n[5]\n', "line 3: is not a JSON object"),
        ("a.json", '{"vx": 1, "time": -5}\n', "line 1: time is -5, which are no milliseconds"),
        ("a.json", '{"vx": 1, "time": true}\n', "line 1: time is True, which are no milliseconds"),
        ("a.alog", "%% LOGSTART 1\n1 X\n",
         "line 2: 2 words; expected time, variable, source, value"),
        ("a.alog", "%% LOGSTART 1\nnan X p 1\n", "line 2: 'nan' is no time in s"),
        ("a.alog", "%% LOGSTART 1e30\n1 X p 1\n",
         "line 1: LOGSTART is '1e30', which is no time"),
        ("a.alog", "%% LOGSTART 1\n\n1 X p 1", "line 3: does not end with a line end: truncated"),
        ("a.txt", sentence("GPGGA,100140,9830.6,N,1,E,1") + "\n",
         "line 1: '9830.6,N' is no latitude"),
        ("a.txt", sentence("GPGGA,100140,4830.6,N,18000.6,E,1") + "\n",
         "line 1: '18000.6,E' is no longitude"),
        ("a.txt", sentence("GPGGA,106140,,,,,1") + "\n", "line 1: '106140' is no time of the day"),
        ("a.txt", "$PAZM3,1,0", "line 1: PAZM3 has no checksum, and the line no end: truncated"),
        ("a.txt", sentence("HEHDT,1.5,T") + " more\n", "line 1: 'more' after the sentence HEHDT"),
        ("a.bin", b"\xa3\x95\x81abc", "byte 0: message 129 is not described by any FMT"),
        ("a.bin", fmt(129, "A", "B", "N", 1) + b"\xa3\x96\x81\1",
         "byte 89: no message begins here"),
        ("a.bin", fmt(129, "A", "B", "N", 1) + fmt(129, "A", "B", "M", 1),
         "byte 89: message 129 is described twice"),
        ("a.bin", fmt(129, "", "B", "N", 1), "byte 0: FMT gives message 129 no name"),
        ("a.bin", fmt(129, "A", "B", "N\n", 1), "byte 0: FMT gives message 129 no name"),
        ("a.bin", fmt(129, "A", "BB", "N", 2),
         "byte 0: FMT of A: 'BB' does not describe 1 columns"),
        ("a.bin", fmt(129, "A", "?", "N", 1), "byte 0: FMT of A: '?' does not describe 1 columns"),
        ("a.bin", fmt(129, "A", "BB", "N,N", 2),
         "byte 0: FMT of A: columns without a name of their own"),
        ("a.bin", fmt(129, "A", "BB", "N,", 2),
         "byte 0: FMT of A: columns without a name of their own"),
        ("a.bin", fmt(129, "A", "BH", "N,M", 4),
         "byte 0: FMT of A: its columns take 6 bytes, not 7"),
        ("a.bin", fmt(128, "A", "B", "N", 1), "byte 0: FMT describes itself as something else"),
        ("a.bin", fmt(129, "A", "Q", "TimeUS", 8) + b"\xa3\x95\x81" + b"\xff" * 8,
         "byte 89: TimeUS is 18446744073709551615, which is no time"),
        ("a.tlog", b"\0" * 8 + b"\x55" * 20, "byte 0: no packet begins here"),
        ("a.tlog", b"\xff" * 8 + _V1, "byte 0: 18446744073709551615 us is no time"),
        ("a.tlog", packet(5, 69, 0, b"\1") + b"\0" * 8 + b"\xfd\1\2" + b"\0" * 20,
         "byte 21: a packet with flags 0x2, not known here"),
        ("a.tlog", packet(5, 173, 83, bytes(9), version=1),
         "byte 0: RANGEFINDER of 9 bytes, at most 8"),
        ("a.ulg", b"ULog\x01\x12\x35\x09" + bytes(8), "byte 7: version 9 is not known here"),
        ("a.ulg", b"ULog\x01\x12\x35\x01", "byte 0: is too short for a ULog"),
        ("a.ulg", ulog(("x", b"")), "byte 16: 'x' is no kind of message"),
        ("a.ulg", ulog(("B", bytes(39))), "byte 16: flags of 39 bytes, expected 40"),
        ("a.ulg", ulog(("B", bytes(8) + b"\2" + bytes(31))),
         "byte 16: has features that are not known here"),
        ("a.ulg", ulog(("B", bytes(15) + b"\1" + bytes(24))),
         "byte 16: has features that are not known here"),
        ("a.ulg", ulog(("F", b"p float x;")), "byte 16: is no definition"),
        ("a.ulg", ulog(("F", b"p!:float x;")), "byte 16: is no definition"),
        ("a.ulg", ulog(("F", b"p:float x;"), ("F", b"p:float y;")), "byte 29: p is defined twice"),
        ("a.ulg", ulog(("A", b"\0\1\0")), "byte 16: is too short for a subscription"),
        ("a.ulg", ulog(("A", b"\0\1\0p")), "byte 16: 'p' is not defined before it is logged"),
        ("a.ulg", subscribed(b"p:float x;"), "byte 29: p has no timestamp"),
        ("a.ulg", subscribed(b"p:p x;"), "byte 25: p is defined by itself, or too long"),
        ("a.ulg", subscribed(b"p:real x;"), "byte 28: p: 'real' is no type"),
        ("a.ulg", subscribed(b"p:float[65537] x;"), "byte 36: p is longer than a message"),
        ("a.ulg", ulog(("D", b"\7")), "byte 16: is too short for data"),
        ("a.ulg", ulog(("D", b"\7\0")), "byte 16: data of 7, which nothing has named"),
        ("a.ulg", subscribed(b"p:uint64_t timestamp;") + ulog(("D", b"\7\0" + bytes(7)))[16:],
         "byte 47: p_2: 7 bytes, expected 8"),
        ("a.ulg", subscribed(b"p:uint64_t timestamp;") + ulog(("D", b"\7\0" + b"\xff" * 8))[16:],
         "byte 47: p_2: its timestamp is 18446744073709551615, which is no time"),
    ],
)  # fmt: skip
def test_what_does_not_follow_its_format_is_refused_by_its_place(
    tmp_path: Path, name: str, raw: bytes | str, message: str
) -> None:
    path = written(tmp_path, name, raw)
    with pytest.raises(LogError) as refused:
        listing(open_recording(path))
    assert str(refused.value) == f"{path}, {message}"


def test_what_is_of_no_format_is_refused(tmp_path: Path) -> None:
    """A CSV file that is named as one but has only blank lines has no header."""
    path = written(tmp_path, "a.xyz", "\n\n")
    with pytest.raises(LogError) as refused:
        open_recording(path)
    assert str(refused.value) == (
        f"{path}: is of no format known here (ros, ulog, dataflash, tlog, alog, csv, json, nmea); "
        "name one before it"
    )
    with pytest.raises(LogError) as refused:
        listing(open_recording(path, "csv"))
    assert str(refused.value) == f"{path}, line 1: has no header"


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


def test_a_recording_that_is_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "none.csv"
    with pytest.raises(LogError) as refused:
        open_recording(path)
    assert str(refused.value) == f"{path}: cannot be read: No such file or directory"


def test_mapping_errors_are_no_log_errors() -> None:
    """What is wrong in a mapping is the user's, not the recording's."""
    assert not issubclass(MappingError, LogError)
