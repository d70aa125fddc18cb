"""How a user's own files are read as those of a log: names, units, separator, axes.

Settings say it in ``[columns]``, ``[units]`` and ``frame`` of ``[log]``; without them files are
what docs/logs.md says.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Literal, TypeAlias

from auvest.logs.layout import COLUMNS, FILES, SPELLINGS, Unit

Axes: TypeAlias = Literal["enu", "ned"]

_DEGREE = math.pi / 180
#: What one of a unit is in that of the column.
UNITS: Mapping[Unit, Mapping[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "m": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "km": 1e3, "ft": 0.3048},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1 / 3.6, "kn": 1852 / 3600,
            "ft/s": 0.3048},
    "rad": {"rad": 1.0, "deg": _DEGREE, "mrad": 1e-3},
    "rad/s": {"rad/s": 1.0, "deg/s": _DEGREE, "mrad/s": 1e-3, "rpm": math.pi / 30},
    "deg": {"deg": 1.0, "rad": 1 / _DEGREE, "1e-7 deg": 1e-7},
}  # fmt: skip
#: Units as headers write them.
_WRITTEN = {
    "mm_s": "mm/s", "cm_s": "cm/s", "m_s": "m/s", "km_h": "km/h", "knots": "kn", "kt": "kn",
    "kts": "kn", "deg_s": "deg/s", "rad_s": "rad/s", "degrees": "deg", "°": "deg", "sec": "s",
    "msec": "ms", "usec": "us", "µs": "us",
}  # fmt: skip
#: What can part cells, by its name.
SEPARATORS = (",", ";", "\t", "|", " ")


@dataclass(frozen=True)
class FileReading:
    """How one file is read.

    Attributes
    ----------
    file : str
        Its name in the folder; "": that of the log's file.
    separator, decimal : str
        What parts cells, and the decimal mark.
    columns : mapping of str to str
        The name in the file's header of a column; a minus before it turns the sign.
    units : mapping of str to str
        The unit of a column.
    where, units_where : str
        The settings that say so, and those that say the units, for messages.
    """

    file: str = ""
    separator: str = ","
    decimal: str = "."
    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    where: str = ""
    units_where: str = ""

    def factor(self, column: str) -> float:
        """Say what a number of the file is to be multiplied with."""
        unit = COLUMNS[column].unit
        size = UNITS[unit][self.units[column]] if column in self.units else 1.0
        return -size if self.columns.get(column, "").startswith("-") else size


@dataclass(frozen=True)
class Reading:
    """How a log is read.

    Attributes
    ----------
    frame : {"enu", "ned"}
        x east, y north, or x north, y east; angles count from +x towards +y either way.
    files : mapping of str to FileReading
        Files that are not as docs/logs.md says, by the name of the log's file.
    """

    frame: Axes = "enu"
    files: Mapping[str, FileReading] = field(default_factory=dict)

    def of(self, name: str) -> FileReading:
        """Give what is said of a file."""
        return self.files.get(name, FileReading())


def columns_of(name: str) -> list[str]:
    """Give every column that a file can have, in any spelling."""
    own = dict.fromkeys(column.name for layout in FILES[name] for column in layout.columns)
    other = [
        column
        for names, spellings in SPELLINGS.items()
        if set(names) <= set(own)
        for spelling in spellings
        for column in spelling
    ]
    return list(dict.fromkeys([*own, *other]))


def parted(own: str) -> tuple[str, str]:
    """Part the name of a column and its unit: ``Speed [mm/s]``, ``depth_cm``, ``heading (deg)``."""
    text = own.strip().lower()
    if text in COLUMNS:
        return text, ""
    inside = re.fullmatch(r"(.+?)[\s_]*[\[(]\s*(.+?)\s*[\])]", text)
    name, unit = inside.groups() if inside else (text, "")
    name = re.sub(r"[\s\-.]+", "_", name.strip())
    units = {unit for kinds in UNITS.values() for unit in kinds} | set(_WRITTEN)
    if not unit:
        for end in sorted(units, key=len, reverse=True):
            if name.endswith(f"_{end}"):
                name, unit = name.removesuffix(f"_{end}"), end
                break
    return name, _WRITTEN.get(unit, unit)


def unit_of(name: str, column: str) -> str:
    """Give the unit that a name ends with, if it is one of a column; else ""."""
    unit = parted(name)[1]
    return unit if unit in UNITS.get(COLUMNS[column].unit, {}) else ""


_ISO = re.compile(
    r"\s*(\d{4})-(\d\d)-(\d\d)[T ](\d\d):(\d\d)(?::(\d\d)(?:[.,](\d{1,9}))?)?"
    r"\s*(Z|z|[+-]\d\d(?::?\d\d)?)?\s*"
)


def seconds_of(text: str) -> float:
    """Give the seconds since 1970 of a time in ISO 8601 with a zone.

    Raises
    ------
    ValueError
        If it is none; the message says why.
    """
    found = _ISO.fullmatch(text.strip().strip('"'))
    if found is None:
        raise ValueError(
            f"{text.strip()!r} is not a time in ISO 8601, as 2025-11-28T08:00:00.5Z; "
            "a column of seconds is time_s"
        )
    *numbers, second, fraction, zone = found.groups()
    if zone is None:
        raise ValueError(f"{text.strip()!r} has no zone: Z for UTC, or an offset as +02:00")
    try:
        year, month, day, hour, minute = map(int, numbers)
        whole = datetime(year, month, day, hour, minute, tzinfo=timezone.utc).timestamp()
    except ValueError as error:
        raise ValueError(f"{text.strip()!r} is no time: {error}") from None
    if int(second or 0) > 60:
        raise ValueError(f"{text.strip()!r} is no time: second must be in 0..60")
    offset = 0
    if zone not in ("Z", "z"):
        digits = zone[1:].replace(":", "")
        offset = 3600 * int(digits[:2]) + 60 * int(digits[2:] or 0)
        offset = -offset if zone[0] == "-" else offset
    part = int(fraction) / 10 ** len(fraction) if fraction else 0.0
    return whole - offset + int(second or 0) + part
