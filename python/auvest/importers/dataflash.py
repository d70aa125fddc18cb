"""ArduPilot's DataFlash logs (.bin): FMT messages say what the others hold.

Times are microseconds since the autopilot was switched on; with the time of a GPS in the log they
become UTC.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Container, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from auvest.importers.binary import Bytes, Cut
from auvest.importers.recording import Message, Recording, Value, plausible

_HEAD = b"\xa3\x95"
_FMT = 128
_FMT_BODY = struct.Struct("<BB4s16s64s")

#: What ArduPilot's letters stand for (libraries/AP_Logger/LogStructure.h): struct's letter, and the
#: factor of what is logged as a whole number.
_LETTERS: dict[str, tuple[str, float | None]] = {
    "a": ("64s", None),  # 32 int16
    "b": ("b", None),
    "B": ("B", None),
    "h": ("h", None),
    "H": ("H", None),
    "i": ("i", None),
    "I": ("I", None),
    "f": ("f", None),
    "d": ("d", None),
    "g": ("e", None),
    "n": ("4s", None),
    "N": ("16s", None),
    "Z": ("64s", None),
    "c": ("h", 0.01),
    "C": ("H", 0.01),
    "e": ("i", 0.01),
    "E": ("I", 0.01),
    "L": ("i", 1e-7),  # degrees
    "M": ("B", None),
    "q": ("q", None),
    "Q": ("Q", None),
}
#: GPS time began on 6 January 1980 and knows no leap seconds; 18 of them since 2017.
_GPS_EPOCH_S, _WEEK_S, _LEAP_S = 315964800, 604800, 18


@dataclass(frozen=True)
class _Format:
    name: str
    body: struct.Struct
    columns: tuple[str, ...]
    letters: str


class DataFlash(Recording):
    """A log of ArduPilot; each type of message is a topic."""

    name: ClassVar[str] = "dataflash"
    title: ClassVar[str] = "ArduPilot DataFlash .bin"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003
        """See :class:`Recording`."""
        return head.startswith(_HEAD)

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        base_ns = self._utc_of_start()
        self.facts["clock"] = "since boot" if base_ns is None else "UTC"
        for message in self._read(topics):
            since = message.values.get("TimeUS")
            if isinstance(since, int):
                time_ns = plausible((base_ns or 0) + since * 1000)
                if time_ns is None:
                    raise self.error(message.where, f"TimeUS is {since}, which is no time")
                message = Message(message.topic, time_ns, message.values, message.where)
            if message.topic == "MSG" and "firmware" not in self.facts:
                self.facts["firmware"] = message.values.get("Message")
            yield message

    def _utc_of_start(self) -> int | None:
        """When the autopilot's clock began, by the first GPS message that knows the time."""
        for message in self._read(("GPS",)):
            values = message.values
            week, ms, since = values.get("GWk"), values.get("GMS"), values.get("TimeUS")
            fixed = values.get("Status")
            if not (isinstance(fixed, int) and fixed >= 3):
                continue
            if isinstance(week, int) and isinstance(ms, int) and isinstance(since, int) and week:
                utc_s = _GPS_EPOCH_S + _WEEK_S * week - _LEAP_S
                return plausible(utc_s * 10**9 + ms * 10**6 - since * 1000)
        return None

    def _read(self, topics: Container[str] | None) -> Iterator[Message]:
        formats = {
            _FMT: _Format(
                "FMT", _FMT_BODY, ("Type", "Length", "Name", "Format", "Columns"), "BBnNZ"
            )
        }
        self.skipped.clear()
        with Bytes(self.path) as file:
            while head := file.peek(3):
                where = file.where
                try:
                    head = file.take(3)
                    if head[:2] != _HEAD:
                        raise self.error(where, "no message begins here")
                    kind = formats.get(head[2])
                    if kind is None:
                        raise self.error(where, f"message {head[2]} is not described by any FMT")
                    fields = kind.body.unpack(file.take(kind.body.size))
                except Cut:
                    self.skipped["message cut by the end of the file"] += 1
                    return
                if kind.name == "FMT":
                    described = self._described(fields, where)
                    known = formats.setdefault(fields[0], described)
                    if (known.name, known.columns, known.letters) != (
                        described.name,
                        described.columns,
                        described.letters,
                    ):
                        raise self.error(where, f"message {fields[0]} is described twice")
                if topics is None or kind.name in topics:
                    values = dict(zip(kind.columns, map(_value, kind.letters, fields), strict=True))
                    yield Message(kind.name, None, values, where)

    def _described(self, fields: tuple[int, int, bytes, bytes, bytes], where: str) -> _Format:
        number, length, *texts = fields
        name, letters, listed = (_text(text) for text in texts)
        columns = tuple(listed.split(",")) if listed else ()
        if not name or not all(map(str.isprintable, (name, letters, listed))):
            raise self.error(where, f"FMT gives message {number} no name")
        if not set(letters) <= set(_LETTERS) or len(letters) != len(columns):
            raise self.error(
                where, f"FMT of {name}: {letters!r} does not describe {len(columns)} columns"
            )
        if len(set(columns)) < len(columns) or "" in columns:
            raise self.error(where, f"FMT of {name}: columns without a name of their own")
        body = struct.Struct("<" + "".join(_LETTERS[letter][0] for letter in letters))
        if body.size + 3 != length:
            raise self.error(
                where, f"FMT of {name}: its columns take {body.size + 3} bytes, not {length}"
            )
        if number == _FMT and (name != "FMT" or body.size != _FMT_BODY.size):
            raise self.error(where, "FMT describes itself as something else")
        return _Format(name, body, columns, letters)


def _text(raw: bytes) -> str:
    return raw.partition(b"\0")[0].decode("latin-1")


def _value(letter: str, raw: float | bytes) -> Value:
    if isinstance(raw, bytes):
        return raw.hex() if letter == "a" else _text(raw)
    if isinstance(raw, float):
        return raw if math.isfinite(raw) else None
    factor = _LETTERS[letter][1]
    return raw if factor is None else raw * factor
