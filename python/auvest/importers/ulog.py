"""PX4's ULog (.ulg): definitions, then data, each message with its length.

The format is read as PX4's documentation describes version 1
(https://docs.px4.io/main/en/dev_log/ulog_file_format). Topics are named ``name_0``, ``name_1``, by
their instance.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Container, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from auvest.importers.binary import Bytes, Cut
from auvest.importers.recording import LONGEST_LIST, Message, Recording, Value, plausible

_MAGIC = b"ULog\x01\x12\x35"
_LETTERS = {
    "int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i",
    "uint32_t": "I", "int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d",
    "bool": "?", "char": "c",
}  # fmt: skip
_FIELD = re.compile(r"([a-zA-Z0-9_\-/]+)(?:\[(\d{1,5})\])? ([a-zA-Z0-9_]+)", re.ASCII)
_MOST_BYTES = 1 << 16  # the length of a message is told in 16 bits
_DEEPEST = 8


@dataclass(frozen=True)
class _Layout:
    """Struct of a message without the padding at its end, and a name for each of its values."""

    body: struct.Struct
    names: tuple[str | None, ...]


class ULog(Recording):
    """A log of PX4."""

    name: ClassVar[str] = "ulog"
    title: ClassVar[str] = "PX4 ULog .ulg"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003
        """See :class:`Recording`."""
        return head.startswith(_MAGIC)

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        self.skipped.clear()
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        subscribed: dict[int, tuple[str, _Layout]] = {}
        dropouts = 0
        with Bytes(self.path) as file:
            self._header(file)
            while file.peek(1):
                where = file.where
                try:
                    size, kind = struct.unpack("<HB", file.take(3))
                    body = file.take(size)
                except Cut:
                    self.skipped["message cut by the end of the file"] += 1
                    break
                letter = chr(kind)
                if letter == "F":
                    self._define(body, where)
                elif letter == "A":
                    number, topic, layout = self._subscription(body, where)
                    subscribed[number] = topic, layout
                elif letter == "D":
                    message = self._data(body, subscribed, where, topics)
                    if message is not None:
                        yield message
                elif letter == "O":
                    dropouts += 1
                elif letter == "B":
                    self._flags(body, where)
                elif letter == "I":
                    self._information(body)
                elif letter not in "RLCSPQM":
                    raise self.error(where, f"{letter!r} is no kind of message")
        self.facts["dropouts"] = dropouts

    def _header(self, file: Bytes) -> None:
        try:
            head = file.take(16)
        except Cut:
            raise self.error("byte 0", "is too short for a ULog") from None
        if not head.startswith(_MAGIC):
            raise self.error("byte 0", "is not a ULog")
        if head[7] > 1:
            raise self.error("byte 7", f"version {head[7]} is not known here")
        self.facts["start_us"] = struct.unpack("<Q", head[8:])[0]

    def _flags(self, body: bytes, where: str) -> None:
        """Refuse what a reader must know and this one does not; appended data is no such thing."""
        if len(body) < 40:
            raise self.error(where, f"flags of {len(body)} bytes, expected 40")
        if body[8] & ~1 or any(body[9:16]):
            raise self.error(where, "has features that are not known here")

    def _information(self, body: bytes) -> None:
        key = body[1 : 1 + body[0]].decode("latin-1") if body else ""
        kind, _, name = key.partition(" ")
        if kind.startswith("char[") and name in ("sys_name", "ver_hw"):
            self.facts[name] = body[1 + body[0] :].decode("latin-1")

    def _define(self, body: bytes, where: str) -> None:
        name, colon, fields = body.decode("latin-1").partition(":")
        if not colon or not re.fullmatch(r"[a-zA-Z0-9_\-/]+", name, re.ASCII):
            raise self.error(where, "is no definition")
        parts = []
        for field in filter(None, fields.split(";")):
            found = _FIELD.fullmatch(field)
            if not found:
                raise self.error(where, f"definition of {name}: {field[:40]!r} is no field")
            parts.append((found[1], int(found[2] or 0), found[3]))
        if self._formats.setdefault(name, parts) != parts:
            raise self.error(where, f"{name} is defined twice")

    def _subscription(self, body: bytes, where: str) -> tuple[int, str, _Layout]:
        if len(body) < 4:
            raise self.error(where, "is too short for a subscription")
        instance, number = struct.unpack("<BH", body[:3])
        name = body[3:].decode("latin-1")
        if name not in self._formats:
            raise self.error(where, f"{name[:60]!r} is not defined before it is logged")
        letters: list[str] = []
        names: list[str | None] = []
        self._lay_out(name, "", letters, names, where, 0)
        while names and names[-1] is None:  # padding at the end is not logged
            names.pop()
            letters.pop()
        layout = _Layout(struct.Struct("<" + "".join(letters)), tuple(names))
        if "timestamp" not in names:
            raise self.error(where, f"{name} has no timestamp")
        return number, f"{name}_{instance}", layout

    def _lay_out(
        self,
        kind: str,
        prefix: str,
        letters: list[str],
        names: list[str | None],
        where: str,
        deep: int,
    ) -> None:
        """Append the letters and names of a type, part by part."""
        if deep > _DEEPEST or len(letters) > _MOST_BYTES:
            raise self.error(where, f"{kind} is defined by itself, or too long")
        for part, count, name in self._formats[kind]:
            padding = name.startswith("_padding")
            if part == "char" and count:
                letters.append(f"{count}s")
                names.append(None if padding else prefix + name)
                continue
            for k in range(count or 1):
                place = prefix + (f"{name}[{k}]" if count else name)
                if part in _LETTERS:
                    letters.append(_LETTERS[part])
                    names.append(None if padding or k >= LONGEST_LIST else place)
                elif part in self._formats:
                    self._lay_out(part, place + ".", letters, names, where, deep + 1)
                else:
                    raise self.error(where, f"{kind}: {part[:40]!r} is no type")
                if len(letters) > _MOST_BYTES:
                    raise self.error(where, f"{kind} is longer than a message")

    def _data(
        self,
        body: bytes,
        subscribed: dict[int, tuple[str, _Layout]],
        where: str,
        topics: Container[str] | None,
    ) -> Message | None:
        if len(body) < 2:
            raise self.error(where, "is too short for data")
        number = struct.unpack("<H", body[:2])[0]
        if number not in subscribed:
            raise self.error(where, f"data of {number}, which nothing has named")
        topic, layout = subscribed[number]
        if topics is not None and topic not in topics:
            return None
        if len(body) - 2 < layout.body.size:
            raise self.error(where, f"{topic}: {len(body) - 2} bytes, expected {layout.body.size}")
        fields = layout.body.unpack_from(body, 2)
        values = {
            name: _value(raw)
            for name, raw in zip(layout.names, fields, strict=True)
            if name is not None
        }
        since = values["timestamp"]
        time_ns = plausible(since * 1000) if isinstance(since, int) else None
        if time_ns is None:
            raise self.error(where, f"{topic}: its timestamp is {since}, which is no time")
        return Message(topic, time_ns, values, where)


def _value(raw: float | bytes) -> Value:
    if isinstance(raw, bytes):
        return raw.partition(b"\0")[0].decode("latin-1")
    if isinstance(raw, float) and not math.isfinite(raw):
        return None
    return raw
