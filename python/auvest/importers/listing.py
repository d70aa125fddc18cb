"""What a recording holds: its topics, how often and when, their fields, and some messages."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from auvest.importers.recording import Message, Recording, Value

#: Which messages of each topic are shown, beside the last.
SHOWN = (1, 10, 100, 1000)
#: So many different messages of a topic are told apart.
_DIFFERENT = 100


@dataclass
class _Field:
    """What a field held, over all messages."""

    missing: int = 0
    true: int | None = None
    numbers: int = 0
    total: float = 0.0
    low: float = math.inf
    high: float = -math.inf
    minus_one: int = 0

    def add(self, value: Value) -> None:
        if value is None:
            self.missing += 1
        elif isinstance(value, bool):
            self.true = (self.true or 0) + value
        elif isinstance(value, (int, float)):
            self.numbers += 1
            self.total += value
            self.low, self.high = min(self.low, value), max(self.high, value)
            self.minus_one += value == -1

    def document(self) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if self.numbers:
            mean = self.total / self.numbers  # the sum may be beyond any float
            found |= {"min": self.low, "max": self.high}
            found["mean"] = mean if math.isfinite(mean) else None
        if self.minus_one:
            found["minus_one"] = self.minus_one  # by which many sensors say that they have nothing
        if self.true is not None:
            found["true"] = self.true
        return {**found, "missing": self.missing}


@dataclass
class _Topic:
    """What came of one topic."""

    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None
    goes_back: int = 0
    repeated: int = 0
    fields: dict[str, _Field] = field(default_factory=dict)
    shown: dict[str, Mapping[str, Value]] = field(default_factory=dict)
    latest: Message | None = None
    different: set[int] = field(default_factory=set)

    def add(self, message: Message, shown: Collection[int]) -> None:
        self.messages += 1
        if message.time_ns is not None:
            if self.first_ns is None:
                self.first_ns = message.time_ns
            if self.last_ns is not None and message.time_ns < self.last_ns:
                self.goes_back += 1
            self.last_ns = message.time_ns
        if self.latest is not None and self.latest.values == message.values:
            self.repeated += 1
        self.latest = message
        if len(self.different) <= _DIFFERENT:
            self.different.add(hash(tuple(message.values.items())))
        for name, value in message.values.items():
            self.fields.setdefault(name, _Field()).add(value)
        if self.messages in shown:
            self.shown[str(self.messages)] = _shown(message)

    def document(self, kind: str | None) -> dict[str, Any]:
        times = _times(self.first_ns, self.last_ns)
        spans = self.messages > 1 and times["duration_s"]
        different = len(self.different) if len(self.different) <= _DIFFERENT else None
        return {
            **({"type": kind} if kind else {}),
            "messages": self.messages,
            **times,
            "rate_hz": (self.messages - 1) / times["duration_s"] if spans else None,
            "goes_back": self.goes_back,
            "repeated": self.repeated,
            "different": different,
            "fields": {name: found.document() for name, found in self.fields.items()},
            "shown": {**self.shown, "last": _shown(self.latest)} if self.latest else {},
        }


def listing(recording: Recording, also: Collection[int] = ()) -> dict[str, Any]:
    """Read a recording from its beginning to its end and say what it holds.

    Parameters
    ----------
    recording : Recording
        As :func:`auvest.importers.open_recording` finds it.
    also : collection of int
        Numbers of messages, counted from 1 in each topic, to be shown beside :data:`SHOWN`.

    Raises
    ------
    LogError
        At the first place that does not follow the format.
    """
    topics: dict[str, _Topic] = {}
    shown = {*SHOWN, *also}
    first_ns: int | None = None
    last_ns: int | None = None
    before_ns: int | None = None
    goes_back = 0
    for message in recording.messages():
        topics.setdefault(message.topic, _Topic()).add(message, shown)
        if message.time_ns is not None:
            first_ns = message.time_ns if first_ns is None else min(first_ns, message.time_ns)
            goes_back += before_ns is not None and message.time_ns < before_ns
            before_ns = message.time_ns
            last_ns = message.time_ns if last_ns is None else max(last_ns, message.time_ns)
    return {
        "recording": str(recording.path),
        "format": recording.name,
        "messages": sum(topic.messages for topic in topics.values()),
        **_times(first_ns, last_ns),
        "goes_back": goes_back,
        "facts": recording.facts,
        "skipped": dict(recording.skipped),
        "topics": {
            name: topic.document(recording.types.get(name))
            for name, topic in sorted(topics.items())
        },
    }


def _times(first_ns: int | None, last_ns: int | None) -> dict[str, Any]:
    if first_ns is None or last_ns is None:
        return {
            "first_ns": None,
            "last_ns": None,
            "first_s": None,
            "last_s": None,
            "duration_s": None,
        }
    return {
        "first_ns": first_ns,
        "last_ns": last_ns,
        "first_s": first_ns / 1e9,
        "last_s": last_ns / 1e9,
        "duration_s": (last_ns - first_ns) / 1e9,
    }


def _shown(message: Message) -> dict[str, Value]:
    times = {"time_ns": message.time_ns, "stamp_ns": message.stamp_ns}
    return {**{name: time for name, time in times.items() if time is not None}, **message.values}
