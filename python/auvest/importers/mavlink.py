"""Telemetry logs (.tlog): MAVLink packets, each after the time of its reception.

Of the messages named here the fields are read, of others only that they came; they are called by
their numbers. A packet is known to be whole by its checksum, which covers the definition, too: a
message whose definition is another has the wrong one.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from auvest.importers.binary import Bytes, Cut
from auvest.importers.recording import Message, Recording, Value, plausible

_LETTERS = {
    "int8_t": "b", "uint8_t": "B", "char": "c", "int16_t": "h", "uint16_t": "H", "int32_t": "i",
    "uint32_t": "I", "float": "f", "int64_t": "q", "uint64_t": "Q", "double": "d",
}  # fmt: skip
_V1, _V2, _SIGNED = 0xFE, 0xFD, 13

#: Number, name, fields, and the fields that version 2 appended (MAVLink's common.xml and
#: ardupilotmega.xml). Units are MAVLink's: degrees times 1e7, mm, cm/s, ms, hPa, hundredths of a
#: degree.
_DEFINITIONS = """
0 HEARTBEAT: uint8_t type, uint8_t autopilot, uint8_t base_mode, uint32_t custom_mode, uint8_t system_status, uint8_t mavlink_version
2 SYSTEM_TIME: uint64_t time_unix_usec, uint32_t time_boot_ms
24 GPS_RAW_INT: uint64_t time_usec, uint8_t fix_type, int32_t lat, int32_t lon, int32_t alt, uint16_t eph, uint16_t epv, uint16_t vel, uint16_t cog, uint8_t satellites_visible | int32_t alt_ellipsoid, uint32_t h_acc, uint32_t v_acc, uint32_t vel_acc, uint32_t hdg_acc, uint16_t yaw
27 RAW_IMU: uint64_t time_usec, int16_t xacc, int16_t yacc, int16_t zacc, int16_t xgyro, int16_t ygyro, int16_t zgyro, int16_t xmag, int16_t ymag, int16_t zmag | uint8_t id, int16_t temperature
30 ATTITUDE: uint32_t time_boot_ms, float roll, float pitch, float yaw, float rollspeed, float pitchspeed, float yawspeed
32 LOCAL_POSITION_NED: uint32_t time_boot_ms, float x, float y, float z, float vx, float vy, float vz
33 GLOBAL_POSITION_INT: uint32_t time_boot_ms, int32_t lat, int32_t lon, int32_t alt, int32_t relative_alt, int16_t vx, int16_t vy, int16_t vz, uint16_t hdg
74 VFR_HUD: float airspeed, float groundspeed, int16_t heading, uint16_t throttle, float alt, float climb
132 DISTANCE_SENSOR: uint32_t time_boot_ms, uint16_t min_distance, uint16_t max_distance, uint16_t current_distance, uint8_t type, uint8_t id, uint8_t orientation, uint8_t covariance | float horizontal_fov, float vertical_fov, float quaternion[4], uint8_t signal_quality
137 SCALED_PRESSURE2: uint32_t time_boot_ms, float press_abs, float press_diff, int16_t temperature | int16_t temperature_press_diff
173 RANGEFINDER: float distance, float voltage
232 GPS_INPUT: uint64_t time_usec, uint8_t gps_id, uint16_t ignore_flags, uint32_t time_week_ms, uint16_t time_week, uint8_t fix_type, int32_t lat, int32_t lon, float alt, float hdop, float vdop, float vn, float ve, float vd, float speed_accuracy, float horiz_accuracy, float vert_accuracy, uint8_t satellites_visible | uint16_t yaw
253 STATUSTEXT: uint8_t severity, char text[50] | uint16_t id, uint8_t chunk_seq
"""  # noqa: E501


@dataclass(frozen=True)
class _Definition:
    name: str
    body: struct.Struct
    fields: tuple[str, ...]
    shortest: int
    extra: int


class Tlog(Recording):
    """A telemetry log of a ground station; each message is a topic."""

    name: ClassVar[str] = "tlog"
    title: ClassVar[str] = "MAVLink .tlog"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        """See :class:`Recording`."""
        return path.suffix.lower() == ".tlog" or (
            len(head) > 8 and head[8] in (_V1, _V2) and head[0] == 0
        )

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        self.skipped.clear()
        packets = 0
        with Bytes(self.path) as file:
            while file.peek(1):
                where = file.where
                try:
                    time_us, number, payload, covered, checksum = self._packet(file, where)
                except Cut:
                    self.skipped["packet cut by the end of the file"] += 1
                    break
                packets += 1
                self.facts["packets"] = packets
                time_ns = plausible(time_us * 1000)
                if time_ns is None:
                    raise self.error(where, f"{time_us} us is no time")
                known = _KNOWN.get(number)
                topic = known.name if known else f"message {number}"
                if topics is not None and topic not in topics:
                    continue
                if known is None:
                    yield Message(topic, time_ns, {}, where)
                elif _checksum(covered + bytes([known.extra])) != checksum:
                    self.skipped[f"{topic} with a wrong checksum"] += 1
                else:
                    yield Message(topic, time_ns, self._values(known, payload, where), where)

    def _packet(self, file: Bytes, where: str) -> tuple[int, int, bytes, bytes, int]:
        """Time, number, payload, what the checksum covers but for the definition, and it."""
        start = file.peek(18)
        if len(start) < 9:
            raise Cut
        if start[8] == _V2 and len(start) >= 18:
            head, number = 10, int.from_bytes(start[15:18], "little")
            if start[10] & ~1:
                raise self.error(where, f"a packet with flags {start[10]:#x}, not known here")
            tail = 2 + (_SIGNED if start[10] & 1 else 0)
        elif start[8] == _V1 and len(start) >= 14:
            head, number, tail = 6, start[13], 2
        elif start[8] in (_V1, _V2):
            raise Cut
        else:
            raise self.error(where, "no packet begins here")
        packet = file.take(8 + head + start[9] + tail)
        end = 8 + head + start[9]
        checksum = int.from_bytes(packet[end : end + 2], "little")
        return (
            int.from_bytes(packet[:8], "big"),
            number,
            packet[8 + head : end],
            packet[9:end],
            checksum,
        )

    def _values(self, known: _Definition, payload: bytes, where: str) -> dict[str, Value]:
        """Fields of a message; zeros at its end may be left out in version 2."""
        if len(payload) > known.body.size:
            raise self.error(
                where, f"{known.name} of {len(payload)} bytes, at most {known.body.size}"
            )
        fields = known.body.unpack(payload.ljust(known.body.size, b"\0"))
        return dict(zip(known.fields, map(_value, fields), strict=True))


def _value(raw: float | bytes) -> Value:
    if isinstance(raw, bytes):
        return raw.partition(b"\0")[0].decode("latin-1")
    return raw if math.isfinite(raw) else None


def _checksum(covered: bytes, start: int = 0xFFFF) -> int:
    """CRC-16/MCRF4XX, as MAVLink wants it."""
    crc = start
    for byte in covered:
        crc = _CRC[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x8408 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)


_CRC = _crc_table()


def _known() -> Mapping[int, _Definition]:
    return dict(map(_definition, _DEFINITIONS.strip().splitlines()))


def _definition(line: str) -> tuple[int, _Definition]:
    """Read a definition: on the wire the widest fields come first, appended ones at the end."""
    head, _, fields = line.partition(": ")
    number, name = head.split()
    first, _, appended = fields.partition(" | ")
    listed = [
        sorted(map(_field, part.split(", ")), key=lambda field: -field[1])
        if k == 0
        else list(map(_field, part.split(", ")))
        for k, part in enumerate((first, appended))
        if part
    ]
    signature = f"{name} ".encode()
    for kind, _, field, count in listed[0]:
        signature += f"{kind} {field} ".encode() + (bytes([count]) if count else b"")
    crc = _checksum(signature)
    letters, names = "<", []
    for kind, _, field, count in (field for part in listed for field in part):
        if kind == "char" and count:
            letters += f"{count}s"
            names.append(field)
        else:
            letters += _LETTERS[kind] * (count or 1)
            names += [f"{field}[{k}]" for k in range(count)] if count else [field]
    body = struct.Struct(letters)
    shortest = sum(size * (count or 1) for _, size, _, count in listed[0])
    return int(number), _Definition(name, body, tuple(names), shortest, (crc & 0xFF) ^ (crc >> 8))


def _field(text: str) -> tuple[str, int, str, int]:
    """Type, size of one, name, and how many if it is a list."""
    kind, name = text.split()
    name, _, count = name.partition("[")
    return kind, struct.calcsize(_LETTERS[kind]), name, int(count.rstrip("]") or 0)


_KNOWN = _known()
