"""ROS bags: ROS 2 in SQLite or MCAP, with or without metadata.yaml, and ROS 1, by ``rosbags``.

A message's time is that of its recording, its stamp that of its header. Message types that the bag
defines itself, as ROS 1 and MCAP do, are read as defined there.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any, ClassVar

from auvest.importers.recording import (
    LONGEST_LIST,
    Message,
    MissingPackage,
    Recording,
    Value,
    plausible,
)
from auvest.logs.reader import LogError

_MAGICS = (b"#ROSBAG V2", b"\x89MCAP0\r\n", b"SQLite format 3\x00")


class RosBag(Recording):
    """A bag; its topics are ROS's."""

    name: ClassVar[str] = "ros"
    title: ClassVar[str] = "ROS 1 and ROS 2 bags"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        """See :class:`Recording`."""
        return (path.is_dir() and (path / "metadata.yaml").exists()) or head.startswith(_MAGICS)

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        try:
            yield from self._messages(topics)
        except (LogError, MissingPackage):
            raise
        except Exception as error:
            # What a damaged bag raises in the package, or in the storage below it, is not listed
            # anywhere: zlib's, lz4's, SQLite's, struct's errors and others.
            raise LogError(
                self.path,
                f"is not a bag that can be read: {str(error) or type(error).__name__}"[:400],
            ) from None

    def _messages(self, topics: Container[str] | None) -> Iterator[Message]:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise MissingPackage("ROS bags are read", "rosbags", "ros") from None
        store = get_typestore(Stores.ROS2_HUMBLE)
        with AnyReader([self.path], default_typestore=store) as reader:
            wanted = []
            for connection in reader.connections:
                self.types[connection.topic] = connection.msgtype
                if topics is None or connection.topic in topics:
                    wanted.append(connection)
            read = reader.messages(connections=wanted) if wanted else ()
            for number, (connection, time_ns, raw) in enumerate(read, start=1):
                where = f"message {number} of {connection.topic}"
                try:
                    values = _leaves(reader.deserialize(raw, connection.msgtype))
                except Exception as error:
                    raise self.error(where, f"is no {connection.msgtype}: {error}"[:400]) from None
                if plausible(time_ns) is None:
                    raise self.error(where, f"{time_ns} ns is no time")
                yield Message(connection.topic, time_ns, values, where, _stamp(values))


def _leaves(message: Any) -> dict[str, Value]:
    leaves: dict[str, Value] = {}
    _collect(message, "", leaves)
    return leaves


def _collect(part: Any, name: str, leaves: dict[str, Value]) -> None:
    fields = getattr(part, "__dataclass_fields__", None)
    if fields is not None:
        for field in fields:
            if field != "__msgtype__":
                _collect(getattr(part, field), f"{name}.{field}" if name else field, leaves)
    elif hasattr(part, "tolist") or isinstance(part, (list, tuple)):
        items = part.tolist() if hasattr(part, "tolist") else part
        if len(items) > LONGEST_LIST:
            leaves[f"{name}.length"] = len(items)
            return
        for k, item in enumerate(items):
            _collect(item, f"{name}[{k}]", leaves)
    elif isinstance(part, float):
        leaves[name] = part if math.isfinite(part) else None
    elif isinstance(part, (bool, int, str)):
        leaves[name] = part


def _stamp(values: dict[str, Value]) -> int | None:
    seconds = values.get("header.stamp.sec")
    nanoseconds = values.get("header.stamp.nanosec")
    if not (isinstance(seconds, int) and isinstance(nanoseconds, int)):
        return None
    return plausible(seconds * 10**9 + nanoseconds) if seconds or nanoseconds else None
