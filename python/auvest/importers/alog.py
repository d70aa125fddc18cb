"""MOOS .alog: one variable per line, with its time, its source and its value.

Times are seconds since LOGSTART, which the header gives as Unix time.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterator
from pathlib import Path
from typing import ClassVar

from auvest.importers.recording import Message, Recording, nanoseconds, text_lines, value_of

_START = re.compile(r"%%\s*LOGSTART\s+(\S+)\s*")


class Alog(Recording):
    """A log of pLogger; each variable is a topic with ``value`` and ``source``."""

    name: ClassVar[str] = "alog"
    title: ClassVar[str] = "MOOS .alog"

    @classmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        """See :class:`Recording`."""
        return path.suffix.lower() == ".alog" or b"%% LOGSTART" in head

    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """See :class:`Recording`."""
        start_ns = None
        for number, line, ended in text_lines(self.path):
            where = f"line {number}"
            if line.startswith("%"):
                if found := _START.fullmatch(line):
                    start_ns = nanoseconds(found[1])
                    if start_ns is None:
                        raise self.error(where, f"LOGSTART is {found[1][:40]!r}, which is no time")
                    self.facts["logstart_s"] = value_of(found[1])
                continue
            if not line.strip():
                continue
            if not ended:
                raise self.error(where, "does not end with a line end: truncated")
            cells = line.split(None, 3)
            if len(cells) < 3:
                raise self.error(
                    where, f"{len(cells)} words; expected time, variable, source, value"
                )
            time_ns = nanoseconds(cells[0])
            if time_ns is None:
                raise self.error(where, f"{cells[0][:40]!r} is no time in s")
            if topics is not None and cells[1] not in topics:
                continue
            values = {
                "value": value_of(cells[3]) if len(cells) == 4 else None,
                "source": cells[2],
            }
            stamp_ns = None if start_ns is None else start_ns + time_ns
            yield Message(cells[1], time_ns, values, where, stamp_ns)
