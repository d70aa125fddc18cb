"""NMEA 0183 and the sentences of USBL systems, as loggers leave them.

There is one in a line, whatever else stands before it.

The time of a sentence is that at the beginning of its line, if there is one. It has no zone, or the
logger's: it is taken as it stands. A time without a date counts from midnight, and goes on over the
next. Without times of reception it is the time of the latest sentence that tells one.

A sentence whose checksum is wrong is left out and counted; lines without one are passed over.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterator
from datetime import datetime, timezone
from pathlib import Path
from typing import ClassVar

from auvest.importers.recording import (
    Message,
    Recording,
    Value,
    nanoseconds,
    plausible,
    text_lines,
    value_of,
)
from auvest.importers.sentences import PROPRIETARY, fields_of

_SENTENCE = re.compile(
    r"(?:\$(?P<name>[A-Z][A-Z0-9]{2,9})|(?P<bare>USBLLONG|USBLANGLES)),(?P<body>[^*]*)"
    r"(?:\*(?P<sum>[0-9A-Fa-f]{2}))?\s*",
    re.ASCII,
)
_ENCAPSULATED = re.compile(r"![A-Z]{5},", re.ASCII)
_RECEIVED = re.compile(
    r"\W*(?:(?P<date>\d{4}-\d\d-\d\d)[ T])?(?P<clock>\d\d:\d\d:\d\d(?:[.,]\d{1,9})?)"
    r"(?P<zone>Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
_UNIX = re.compile(r"\W*(\d{9,10}(?:\.\d{1,9})?)\b", re.ASCII)
_NUMBER = re.compile(r"\d+(\.\d*)?", re.ASCII)
_DAY_NS = 86400 * 10**9


class Nmea(Recording):
    """Sentences in lines; each kind of sentence is a topic."""

    name: ClassVar[str] = "nmea"
    title: ClassVar[str] = "NMEA 0183 and USBL sentences"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:  # noqa: ARG003
        """See :class:`Recording`."""
        lines = head.decode("utf-8", "replace").splitlines()
        return any(_SENTENCE.search(line) for line in lines)

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        self.skipped.clear()
        clock, date_ns, told_ns = _Received(), None, None
        for number, line, ended in text_lines(self.path, errors="replace"):
            where = f"line {number}"
            found = _SENTENCE.search(line)
            if not found:
                other = "encapsulated sentence" if _ENCAPSULATED.search(line) else "other line"
                self.skipped[other] += bool(line.strip())
                continue
            name = found["name"] or found["bare"]
            if found.end() != len(line):
                raise self.error(where, f"{line[found.end() :][:40]!r} after the sentence {name}")
            if found["sum"] is None:
                if not ended:
                    raise self.error(
                        where, f"{name} has no checksum, and the line no end: truncated"
                    )
                if name not in PROPRIETARY:
                    self.skipped["sentence without a checksum"] += 1
                    continue
            elif _checksum(line[found.start("name") : found.end("body")]) != int(found["sum"], 16):
                self.skipped["sentence with a wrong checksum"] += 1
                continue
            values = self._values(name, found["body"].split(","), where)
            date_ns = _date_of(values, date_ns)
            stamp_ns = _stamp(name, values, date_ns)
            told_ns = stamp_ns if stamp_ns is not None else told_ns
            received_ns = clock.of(line[: found.start()])
            self.facts["receive_times"] = clock.kind
            if topics is None or name in topics:
                time_ns = received_ns if clock.kind else told_ns
                yield Message(name, time_ns, values, where, stamp_ns)

    def _values(self, name: str, cells: list[str], where: str) -> dict[str, Value]:
        """Fields by name; what has none is ``f1``, ``f2`` ..."""
        known = fields_of(name)
        values: dict[str, Value] = {}
        for k, cell in enumerate(cells):
            field = known[k] if k < len(known) else f"f{k + 1}"
            if field in ("@latitude", "@longitude"):
                degrees = self._degrees(field[1:], cell, cells[k + 1 : k + 2], where)
                values[field[1:] + "_deg"] = degrees
            elif field == "@time":
                values["utc_s"] = self._seconds(cell, where)
            elif field == "@date":
                values["date"] = cell.strip() or None
            elif field not in ("", "@"):
                values[field.lstrip("@")] = value_of(cell)
        return values

    def _degrees(self, what: str, cell: str, hemisphere: list[str], where: str) -> float | None:
        """Degrees from ddmm.mmm and a letter."""
        if not cell.strip():
            return None
        sign = {"N": 1, "E": 1, "S": -1, "W": -1}.get("".join(hemisphere).strip())
        whole = len(cell.strip().partition(".")[0]) - 2
        if _NUMBER.fullmatch(cell.strip()) and 1 <= whole <= 3 and sign is not None:
            degrees = int(cell.strip()[:whole]) + float(cell.strip()[whole:]) / 60
            most = 90 if what == "latitude" else 180
            if float(cell.strip()[whole:]) < 60 and degrees <= most:
                return sign * degrees
        shown = ",".join([cell, *hemisphere])[:40]
        raise self.error(where, f"{shown!r} is no {what}")

    def _seconds(self, cell: str, where: str) -> float | None:
        """Seconds of the day from hhmmss.sss."""
        bare = cell.strip()
        if not bare:
            return None
        if re.fullmatch(r"\d{6}(\.\d{0,9})?", bare, re.ASCII):
            hours, minutes, seconds = int(bare[:2]), int(bare[2:4]), float(bare[4:])
            if hours < 24 and minutes < 60 and seconds < 61:
                return hours * 3600 + minutes * 60 + seconds
        raise self.error(where, f"{bare[:40]!r} is no time of the day")


class _Received:
    """The times at the beginning of lines, in ns; ``kind`` says what they are."""

    def __init__(self) -> None:
        self.kind: str | None = None
        self._before: int | None = None
        self._midnight = 0

    def of(self, prefix: str) -> int | None:
        found = _RECEIVED.match(prefix)
        if not found:
            unix = _UNIX.match(prefix)
            if unix and self.kind in (None, "Unix time"):
                self.kind = "Unix time"
                return nanoseconds(unix[1])
            return None
        hours, minutes, seconds = re.split(":", found["clock"].replace(",", "."))
        rest = nanoseconds(seconds)
        if rest is None or int(hours) > 23 or int(minutes) > 59 or rest >= 61 * 10**9:
            return None
        of_day = (int(hours) * 3600 + int(minutes) * 60) * 10**9 + rest
        if found["date"]:
            try:
                day = datetime.strptime(found["date"], "%Y-%m-%d").replace(tzinfo=timezone.utc)
            except ValueError:
                return None
            zone = found["zone"] or ""
            self.kind = "UTC" if zone else "date and local time"
            digits = zone.replace(":", "")
            offset = int(digits[1:3]) * 3600 + int(digits[3:5]) * 60 if len(digits) == 5 else 0
            return (
                int(day.timestamp()) * 10**9 + of_day - (-1 if "-" in zone else 1) * offset * 10**9
            )
        self.kind = "time of the day"
        if self._before is not None and of_day < self._before - _DAY_NS // 2:
            self._midnight += _DAY_NS
        self._before = of_day
        return self._midnight + of_day


def _checksum(text: str) -> int:
    total = 0
    for letter in text.encode("utf-8"):
        total ^= letter
    return total


def _date_of(values: dict[str, Value], before: int | None) -> int | None:
    """Midnight of the date that a sentence tells, in ns of Unix time."""
    try:
        if isinstance(date := values.get("date"), str):
            day = datetime.strptime(date, "%d%m%y")
        elif {"day", "month", "year"} <= set(values):
            year, month, date = (int(str(values[part])) for part in ("year", "month", "day"))
            day = datetime(year, month, date)
        else:
            return before
    except ValueError:
        return before
    return plausible(int(day.replace(tzinfo=timezone.utc).timestamp()) * 10**9)


def _stamp(name: str, values: dict[str, Value], date_ns: int | None) -> int | None:
    if name in ("USBLLONG", "USBLANGLES"):
        measured = values.get("measured_s")
        return nanoseconds(repr(measured)) if isinstance(measured, (int, float)) else None
    seconds = values.get("utc_s")
    if not isinstance(seconds, (int, float)) or date_ns is None:
        return None
    return date_ns + round(seconds * 1e9)
