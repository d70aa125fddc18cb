"""Small made-up files of every format that `auvest import` knows, and what to take from them.

They are written here from the formats' descriptions, by no code of the readers. In each a vehicle
goes straight along +x with 0.5 m/s, sampled every 0.5 s from t = 100 s on, when it is at (1, 2).
"""

from __future__ import annotations

import json
import struct
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

COUNT = 12
TIMES = [100 + 0.5 * k for k in range(COUNT)]


def x_of(time_s: float) -> float:
    return 1 + 0.5 * (time_s - 100)


# ---- ArduPilot -----------------------------------------------------------------------------------


def dataflash() -> bytes:
    def fmt(kind: int, name: str, letters: str, columns: str, size: int) -> bytes:
        texts = name.encode(), letters.encode(), columns.encode()
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size + 3, *texts)

    parts = [
        fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 86),
        fmt(129, "POS", "Qffce", "TimeUS,X,Y,Turn,Depth", 22),
        fmt(130, "MSG", "QZ", "TimeUS,Message", 72),
        fmt(131, "GPS", "QBIHLL", "TimeUS,Status,GMS,GWk,Lat,Lng", 23),
        b"\xa3\x95\x82" + struct.pack("<Q64s", 99_000_000, b"ArduSub V4.1.0"),
    ]
    for time_s in TIMES:
        us = round(time_s * 1e6)
        parts.append(b"\xa3\x95\x81" + struct.pack("<Qffhi", us, x_of(time_s), 2, -150, 325))
    parts.append(b"\xa3\x95\x83" + struct.pack("<QBIHii", 105_500_000, 1, 5, 1999, 0, 0))
    return b"".join(parts)


def mavlink_crc(body: bytes) -> int:
    crc = 0xFFFF
    for byte in body:
        t = byte ^ (crc & 0xFF)
        t ^= (t << 4) & 0xFF
        crc = (crc >> 8) ^ (t << 8) ^ (t << 3) ^ (t >> 4)
        crc &= 0xFFFF
    return crc


def packet(time_us: int, number: int, extra: int, payload: bytes, *, version: int = 2) -> bytes:
    """One packet of a tlog; version 2 leaves out the zeros at the end of a payload."""
    if version == 2:
        payload = payload.rstrip(b"\0") or b"\0"
        head = struct.pack("<BBBBBB", len(payload), 0, 0, 7, 1, 1) + number.to_bytes(3, "little")
        mark = b"\xfd"
    else:
        head, mark = struct.pack("<BBBBB", len(payload), 7, 1, 1, number), b"\xfe"
    crc = mavlink_crc(head + payload + bytes([extra]))
    return struct.pack(">Q", time_us) + mark + head + payload + struct.pack("<H", crc)


def tlog() -> bytes:
    parts = []
    for k, time_s in enumerate(TIMES):
        us = 1_700_000_000_000_000 + round(time_s * 1e6)
        local = struct.pack("<Iffffff", round(time_s * 1000), x_of(time_s), 2, 3.25, 0.5, 0, 0)
        parts.append(packet(us, 32, 185, local, version=1 + k % 2))  # LOCAL_POSITION_NED
        parts.append(packet(us, 69, 0, b"\1\2\3"))  # one whose fields are not known here
    return b"".join(parts)


# ---- PX4, MOOS -----------------------------------------------------------------------------------


def ulog() -> bytes:
    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    key = b"char[3] sys_name"
    parts = [
        b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 99_000_000),
        message("B", bytes(40)),
        message("I", bytes([len(key)]) + key + b"PX4"),
        message("F", b"point:float x;float y;"),
        message("F", b"position:uint64_t timestamp;point at;bool valid;uint8_t[3] _padding0;"),
        message("A", b"\1" + struct.pack("<H", 4) + b"position"),
    ]
    for time_s in TIMES:
        body = struct.pack("<HQff?", 4, round(time_s * 1e6), x_of(time_s), 2, True)
        parts.append(message("D", body))
        parts.append(message("S", b"\0\0"))
    return b"".join(parts)


def alog() -> bytes:
    lines = ["%% LOG FILE: made up", "%% LOGSTART        1700000000.5"]
    for time_s in TIMES:
        lines.append(f"{time_s:.3f}  NAV_Y  pNav  2.0")
        lines.append(f"{time_s:.3f}  NAV_X  pNav  {x_of(time_s)}")
        lines.append(f"{time_s:.3f}  MODE   pHelm  all is well ")
    return "".join(f"{line}\n" for line in lines).encode()


# ---- Text ----------------------------------------------------------------------------------------


def sentence(body: str) -> str:
    total = 0
    for letter in body:
        total ^= ord(letter)
    return f"${body}*{total:02X}"


def nmea() -> bytes:
    lines = []
    for time_s in TIMES:
        clock = f"12:01:{time_s - 60:06.3f}"
        minutes = 30 + 0.001 * (time_s - 100)
        rmc = f"GPRMC,100140.00,A,48{minutes:07.4f},N,00433.5,W,1.0,90.0,080822,,"
        lines += [f"2022-08-08 {clock} >> {sentence(rmc)}", f"2022-08-08 {clock} nothing"]
        lines.append(f"2022-08-08 {clock} >> {sentence('HEHDT,350.0,T')}")
        lines.append(f"2022-08-08 {clock} >> $PAZM3,1,0,0,0,27,0.02,30,,4,100.0,60.0,,,,,")
    return "".join(f"{line}\r\n" for line in lines).encode()


def evologics() -> bytes:
    return "".join(
        f"{time_s + 1.7e9:.3f} USBLLONG,{time_s:.2f},{time_s - 0.25:.2f},2,1,1,1,"
        f"{x_of(time_s)},2.0,-5.0,0.1,0.0,1.5,25000,-30,120,0.05\n"
        for time_s in TIMES
    ).encode()


def dvl_json() -> bytes:
    report = {"vx": 0.5, "vy": -0.25, "vz": 0.0, "altitude": 3.5, "velocity_valid": True}
    lines = []
    for k, time_s in enumerate(TIMES):
        us = round((1.7e9 + time_s) * 1e6)
        beams = [{"id": n, "distance": 4.0, "beam_valid": True} for n in range(4)]
        more = {"time": 500, "transducers": beams, "time_of_validity": us, "type": "velocity"}
        lines.append(json.dumps({**report, **more, "velocity_valid": k != 3, "format": "json_v3"}))
    return "".join(f"{line}\n" for line in lines).encode()


def ugps_json() -> bytes:
    return "".join(
        json.dumps(
            {
                "timestamp": 1.7e9 + time_s,
                "position_valid": k != 3,
                "std": 0.5,
                "x": x_of(time_s),
                "y": 2.0,
                "z": 3.0,
                "receiver_valid": [1, 1, 0, 1],
                "receiver_distance": [3.5, 3.25, -1, 4],
            }
        )
        + "\n"
        for k, time_s in enumerate(TIMES)
    ).encode()


def ugps_csv() -> bytes:
    rows = [
        f"{k != 3},0.5,{x_of(time_s)},2.0,3.0,3.5,-1,{1.7e9 + time_s}"
        for k, time_s in enumerate(TIMES)
    ]
    head = "position_valid,std,x,y,z,distance_r0,distance_r1,timestamp"
    return "".join(f"{line}\n" for line in [head, *rows]).encode()


# ---- ROS -----------------------------------------------------------------------------------------


def _odometry(store: Any, time_s: float, **header: Any) -> Any:
    types = store.types

    def make(name: str, **values: Any) -> Any:
        return types[name](**values)

    import numpy as np

    stamp = make("builtin_interfaces/msg/Time", sec=int(time_s), nanosec=int(time_s % 1 * 1e9))
    zero = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    forward = make("geometry_msgs/msg/Vector3", x=0.5, y=0.0, z=0.0)
    pose = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x_of(time_s), y=2.0, z=-3.0),
        orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    none = np.zeros(36)
    return make(
        "nav_msgs/msg/Odometry",
        header=make("std_msgs/msg/Header", stamp=stamp, frame_id="odom", **header),
        child_frame_id="base_link",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=none),
        twist=make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=make("geometry_msgs/msg/Twist", linear=forward, angular=zero),
            covariance=none,
        ),
    )


def ros2(storage: str, topics: tuple[str, ...] = ("/odom",)) -> bytes:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "nav_msgs/msg/Odometry"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
        with Writer(path, version=9, storage_plugin=plugin) as writer:
            for topic in topics:
                odometry = writer.add_connection(topic, kind, typestore=store)
                for time_s in TIMES:
                    raw = store.serialize_cdr(_odometry(store, time_s), kind)
                    writer.write(odometry, round((1.7e9 + time_s) * 1e9), raw)
        (file,) = (one for one in path.iterdir() if one.suffix in (".mcap", ".db3"))
        return file.read_bytes()


def ros1() -> bytes:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "nav_msgs/msg/Odometry"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag.bag"
        writer = Writer(path)
        writer.set_compression(Writer.CompressionFormat.BZ2)
        with writer:
            odometry = writer.add_connection("/odom", kind, typestore=store)
            for time_s in TIMES:
                raw = store.serialize_ros1(_odometry(store, time_s, seq=1), kind)
                writer.write(odometry, round((1.7e9 + time_s) * 1e9), raw)
        return path.read_bytes()


# ---- All -----------------------------------------------------------------------------------------

ODOM = """
clock = "stamp"
[odometry]
topic = "/odom"
increments = {x_m = "pose.pose.position.x", y_m = "pose.pose.position.y", heading_rad = {yaw = [
  "pose.pose.orientation.w", "pose.pose.orientation.x", "pose.pose.orientation.y",
  "pose.pose.orientation.z"]}}
"""


def _truth(topic: str, x: str, y: str) -> str:
    return f'[truth]\ntopic = "{topic}"\nx_m = "{x}"\ny_m = "{y}"\n'


#: Kind: the file's name, what makes it, and its mapping ("": the one that comes with auvest).
KINDS: Mapping[str, tuple[str, Any, str]] = {
    "dataflash": ("dive.bin", dataflash, _truth("POS", "X", "Y")),
    "tlog": ("dive.tlog", tlog, _truth("LOCAL_POSITION_NED", "x", "y")),
    "ulog": ("dive.ulg", ulog, _truth("position_1", "at.x", "at.y")),
    "alog": ("dive.alog", alog, ""),
    "nmea": ("dive.txt", nmea, ""),
    "evologics": ("dive.log", evologics, ""),
    "dvl": (
        "dvl.json",
        dvl_json,
        '[odometry]\ntopic = "velocity"\nwhen = {velocity_valid = true}\nspeed_m_s = "vx"\n'
        "yaw_rate_rad_s = 0\n",
    ),
    "ugps": ("ugps.json", ugps_json, ""),
    "csv": ("ugps.csv", ugps_csv, ""),
}
ROS_KINDS: Mapping[str, tuple[str, Any, str]] = {
    "sqlite": ("dive.db3", lambda: ros2("sqlite"), ODOM),
    "mcap": ("dive.mcap", lambda: ros2("mcap"), ODOM),
    "ros1": ("dive.bag", ros1, ODOM),
}


@cache
def recordings() -> dict[str, tuple[str, bytes, str]]:
    """By kind: the file's name, its bytes, its mapping; ROS's if rosbags is installed."""
    kinds = dict(KINDS)
    try:
        import rosbags  # noqa: F401
    except ImportError:
        pass
    else:
        kinds |= ROS_KINDS
    return {kind: (name, make(), mapping) for kind, (name, make, mapping) in kinds.items()}
