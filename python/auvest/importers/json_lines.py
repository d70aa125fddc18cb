"""One JSON object per line: Water Linked's DVL on its TCP port, and Underwater GPS as polled.

The DVL's reports of json_v1 and json_v2 have no time, only ``time``: the milliseconds since the
report before. Times are then counted from the first report; a line that repeats the one before adds
nothing. From json_v3 on ``time_of_validity`` is the time of the measurement.
"""

from __future__ import annotations

import json
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any, ClassVar

from auvest.importers.recording import (
    Message,
    Recording,
    Value,
    flat,
    nanoseconds,
    plausible,
    text_lines,
)


class JsonLines(Recording):
    """Reports by their ``type``; those without one by what they hold."""

    name: ClassVar[str] = "json"
    title: ClassVar[str] = "JSON lines (Water Linked DVL, Underwater GPS)"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003
        """See :class:`Recording`."""
        return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        before, clock_ns = "", 0
        for number, line, _ in text_lines(self.path):
            where = f"line {number}"
            if not line.strip():
                continue
            report = self._report(line, where)
            topic = _topic(report)
            values = flat(report)
            self._count(values)
            stamp_ns = _stamp(report)
            time_ns = stamp_ns
            if stamp_ns is None and topic == "velocity" and "time" in report:
                if line != before:
                    clock_ns += self._period(report["time"], where)
                time_ns = clock_ns
            elif stamp_ns is None and "timestamp" in report:
                time_ns = nanoseconds(str(report["timestamp"]))
            before = line
            if topics is None or topic in topics:
                yield Message(topic, time_ns, values, where, stamp_ns)

    def _report(self, line: str, where: str) -> dict[str, Any]:
        try:
            report = json.loads(
                line, parse_constant=_no_number, parse_float=_finite, parse_int=_whole
            )
        except (ValueError, RecursionError) as error:
            why = "nested too deeply" if isinstance(error, RecursionError) else error
            raise self.error(where, f"is not JSON: {why}") from None
        if not isinstance(report, dict):
            raise self.error(where, "is not a JSON object")
        return report

    def _count(self, values: dict[str, Value]) -> None:
        version = values.get("format")
        if isinstance(version, str):
            self.facts["format"] = version

    def _period(self, period: Any, where: str) -> int:
        """Milliseconds since the report before, in ns."""
        number = isinstance(period, (int, float)) and not isinstance(period, bool)
        if not number or not 0 <= period <= 1e9:
            raise self.error(where, f"time is {str(period)[:40]}, which are no milliseconds")
        return round(period * 1e6)


def _no_number(name: str) -> None:
    """NaN, which JSON does not know but Python writes: a value that is missing."""


def _finite(text: str) -> float:
    number = float(text)
    if abs(number) == float("inf"):
        shown = text if len(text) <= 12 else f"{text[:4]}…{text[-4:]}"
        raise ValueError(f"{shown} is too large a number")
    return number


def _whole(text: str) -> int | float:
    return int(text) if len(text) <= 18 else _finite(text)


def _topic(report: dict[str, Any]) -> str:
    kind = report.get("type")
    if isinstance(kind, str) and kind:
        return kind[:100]
    if "vx" in report:
        return "velocity"
    return "position" if "position_valid" in report else "report"


def _stamp(report: dict[str, Any]) -> int | None:
    validity = report.get("time_of_validity")  # microseconds
    if isinstance(validity, int) and not isinstance(validity, bool) and validity > 0:
        return plausible(validity * 1000)
    return None
