"""A first guess at what a folder of tables holds: by the names of files and columns, and numbers.

:func:`guess` gives what ``auvest init`` writes. It is a guess: it says what it took for what.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from statistics import median

from auvest._outputs import is_plain_file
from auvest.logs.layout import COLUMNS, FILES, TIME_UNITS, TURN, match
from auvest.logs.reading import SEPARATORS, UNITS, FileReading, columns_of, parted, seconds_of

#: No craft dives faster than this, m/s.
DIVE_M_S = 3.0
#: Lines of a table that are looked at, and the largest header that is one.
LINES, LONGEST = 200, 10_000
#: Names of columns as instruments write them, and the column of a log that each is.
NAMES: Mapping[str, str] = {
    r"(utc_?)?(date_?)?time(_?stamp)?|stamp|utc|epoch|t|ts|date|received|zeit": "time_s",
    r"secs?|seconds?": "time_s",
    r"source|beacon|transponder|remote(_id)?|node|leader|ship|station|id|src": "source",
    r"(slant_?)?(range|distance|dist)|slant": "range_m",
    r"lat(itude)?": "latitude_deg",
    r"lon(gitude)?|lng|long": "longitude_deg",
    r"x|east(ing)?": "x_m",
    r"y|north(ing)?": "y_m",
    r"(true_?)?(heading|hdg|hdt|compass)|yaw": "compass_rad",
    r"bearing|azimuth|az": "azimuth_rad",
    r"elevation|elev|el": "elevation_rad",
    r"v_?x|u|surge|forward|fwd|speed|vel(ocity)?_?x": "speed_m_s",
    r"v_?y|v|sway|starboard|stbd|vel(ocity)?_?y": "starboard_m_s",
    r"gyro_?z|yaw_?rate|r|w_?z": "yaw_rate_rad_s",
    r"depth|keller|pole": "depth_m",
}
#: Words in the name of a file of places that say what they are.
_PLACES = ("truth", "start", "leaders", "beacons", "positions")


@dataclass(frozen=True)
class Table:
    """A table of a folder, as far as it was looked at."""

    path: Path
    separator: str
    decimal: str
    header: list[str]
    rows: list[list[str]]


@dataclass
class Guess:
    """What a folder seems to hold.

    Attributes
    ----------
    files : dict of str to FileReading
        The files of a log that are not as docs/logs.md says, by their names there.
    unknown : list of str
        Tables of which nothing is known.
    """

    files: dict[str, FileReading] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)


def guess(folder: Path) -> Guess:
    """Look at the tables of a folder and say which file of a log each may be."""
    found = Guess()
    seen_as: dict[str, Table] = {}
    taken = {name for name in FILES if _is_log_file(folder / name, name)}
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in (".csv", ".tsv", ".txt", ".dat", ".log"):
            continue
        if path.name in taken or path.name.startswith(".") or not is_plain_file(path):
            continue
        seen = table_of(path)
        named = {} if seen is None else _columns(seen)
        kinds = [] if seen is None else list(_kinds(path.stem.lower(), set(named), taken))
        for name in kinds:
            assert seen is not None
            found.files[name] = _reading(name, seen, named)
            seen_as[name] = seen
            taken.add(name)
        if not kinds:
            found.unknown.append(path.name)
    for name in taken - set(seen_as):
        if (plain := table_of(folder / name)) is not None:
            seen_as[name] = plain
    _see_centimetres(found, seen_as)
    return found


def _see_centimetres(found: Guess, tables: Mapping[str, Table]) -> None:
    """Say so of a depth that no name gives a unit, if as metres it cannot be.

    It then lies deeper than any range is long, or is in whole numbers that change faster than a
    craft dives.
    """
    reading = found.files.get("depth.csv")
    if reading is None or "depth_m" in reading.units or "depth_m" not in reading.columns:
        return
    depth = _values(found, tables, "depth.csv", "depth_m")
    time = _values(found, tables, "depth.csv", "time_s") or _values(
        found, tables, "depth.csv", "time"
    )
    ranges = [one for name in ("ranges.csv", "fixes.csv") if name in tables
              for one in _values(found, tables, name, "range_m")]  # fmt: skip
    changes = [
        abs(after - before) / (later - sooner)
        for sooner, later, before, after in zip(time, time[1:], depth, depth[1:], strict=False)
        if later > sooner and after != before
    ]
    whole = all(one == math.floor(one) for one in depth)
    fast = whole and len(changes) > 2 and median(changes) > DIVE_M_S
    if depth and (fast or (ranges and min(depth) > max(ranges))):
        found.files["depth.csv"] = replace(reading, units={**reading.units, "depth_m": "cm"})


def _values(found: Guess, tables: Mapping[str, Table], name: str, column: str) -> list[float]:
    """Give the numbers of a column of a log, in the units of the log, as far as they were read."""
    seen, reading = tables[name], found.files.get(name, FileReading())
    own = reading.columns.get(column, column)
    if own not in seen.header:
        return []
    cells = [row[seen.header.index(own)] for row in seen.rows]
    if column == "time":
        return [seconds_of(cell) for cell in cells] if _all_times(cells) else []
    factor = reading.factor(column)
    return [factor * one for one in _numbers(cells, seen.decimal)]


def table_of(path: Path) -> Table | None:
    """Read the first lines of a table; None if it is none."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            lines = [line.rstrip("\r\n") for line in islice(file, LINES + 1)]
    except (OSError, UnicodeDecodeError):
        return None
    if len(lines) < 2 or not lines[0].strip() or max(map(len, lines)) > LONGEST:
        return None
    for separator in (";", "\t", "|", ",", " "):
        rows = [_cells(line, separator) for line in lines if line.strip()]
        width = len(rows[0])
        if width < 2 or sum(len(row) == width for row in rows) < 0.9 * len(rows):
            continue
        body = [row for row in rows[1:] if len(row) == width]
        header = [cell.strip() for cell in rows[0]]
        if separator in SEPARATORS and len(set(header)) == width and not any(map(_number, header)):
            commas = sum(bool(re.fullmatch(r"\s*-?\d+,\d+\s*", c)) for row in body for c in row)
            decimal = "," if separator != "," and commas else "."
            return Table(path, separator, decimal, header, body)
    return None


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    with suppress(csv.Error):
        return next(csv.reader([line], delimiter=separator), [])
    return []


def _number(cell: str) -> bool:
    with suppress(ValueError):
        return math.isfinite(float(cell))
    return False


def _is_log_file(path: Path, name: str) -> bool:
    """Whether a file is one of a log as it is."""
    if not path.exists():
        return False
    seen = table_of(path)
    if seen is None or seen.separator != "," or match(name, seen.header) is None:
        return False
    if "time" not in seen.header:
        return True
    k = seen.header.index("time")  # seconds have another name in a log
    return not _numbers([row[k] for row in seen.rows], seen.decimal)


def _columns(seen: Table) -> dict[str, tuple[str, str]]:
    """Give the columns of a log that a table seems to have: each one's own name and unit."""
    found: dict[str, tuple[str, str]] = {}
    named_source = None
    for k, own in enumerate(seen.header):
        name, unit = parted(own)
        column = name if name in COLUMNS else next(
            (one for words, one in NAMES.items() if re.fullmatch(words, name)), None
        )  # fmt: skip
        if column is None or column in found:
            continue
        cells = [row[k] for row in seen.rows]
        if column in ("time", "time_s") and _all_times(cells):
            column, unit = "time", ""
        elif not _numbers(cells, seen.decimal):
            if column == "source":
                named_source = own
            continue
        elif column == "time":
            column = "time_s"
        kinds = UNITS.get(COLUMNS[column].unit, {})
        if unit not in kinds:
            unit = _by_size(column, _numbers(cells, seen.decimal))
        found[column] = (own, unit)
    places = any(word in seen.path.stem.lower() for word in ("beacon", "leader"))
    if named_source is not None and "source" not in found and ("range_m" in found or places):
        found["source"] = named_source, ""  # the reader says that it must be a number
    speeds = [one for one in found if COLUMNS[one].unit == "m/s"]
    if any(found[one][1] == "mm/s" for one in speeds):  # of one instrument
        found |= {one: (found[one][0], found[one][1] or "mm/s") for one in speeds}
    return found


def _all_times(cells: list[str]) -> bool:
    try:
        return [seconds_of(cell) for cell in cells] != []
    except ValueError:
        return False


def _numbers(cells: list[str], decimal: str) -> list[float]:
    """Give the numbers of a column; none if one cell is none."""
    try:
        return [float(cell.replace(",", ".") if decimal == "," else cell) for cell in cells]
    except ValueError:
        return []


def _by_size(column: str, numbers: list[float]) -> str:
    """Say what unit numbers are in of which no name says it; "" for that of the log."""
    largest = max(map(abs, numbers), default=0.0)
    unit = COLUMNS[column].unit
    if unit == "s":
        return next((name for name, low in TIME_UNITS.items() if largest > low), "")
    if unit == "rad" and largest > TURN:
        return "deg"
    if unit == "deg" and largest > 360:
        return "1e-7 deg"
    if unit == "m/s" and largest > 50:
        return "mm/s"
    return ""


def _kinds(stem: str, columns: set[str], taken: set[str]) -> Iterator[str]:
    """Say which files of a log a table may be, by what it has; each only once."""
    timed = bool({"time", "time_s"} & columns)
    placed = {"latitude_deg", "longitude_deg"} <= columns or {"x_m", "y_m"} <= columns
    said = next((f"{word}.csv" for word in _PLACES if word.rstrip("s") in stem), None)
    wanted = []
    if placed:
        if said is None:
            of_sources = "leaders.csv" if timed else "beacons.csv"
            said = of_sources if "source" in columns else "positions.csv"
        wanted.append(said)
    elif "range_m" in columns and "source" in columns:
        bearing = {"azimuth_rad", "bearing_rad"} & columns
        wanted.append("fixes.csv" if bearing else "ranges.csv")
    else:
        if {"speed_m_s", "forward_m", "distance_m"} & columns:
            wanted.append("odometry.csv")
        headed = {"compass_rad", "heading_rad"} & columns
        if headed and "speed_m_s" not in columns:
            wanted.append("compass.csv")
        if "depth_m" in columns:
            wanted.append("depth.csv")
    yield from (name for name in wanted if name not in taken and match(name, columns) is not None)


def _reading(name: str, seen: Table, named: Mapping[str, tuple[str, str]]) -> FileReading:
    known = [column for column in columns_of(name) if column in named]
    return FileReading(
        file="" if seen.path.name == name else seen.path.name,
        separator=seen.separator,
        decimal=seen.decimal,
        columns={column: named[column][0] for column in known if named[column][0] != column},
        units={column: named[column][1] for column in known if named[column][1]},
    )
