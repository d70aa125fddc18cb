"""Mappings: which topics of a recording become which files of a log, and how; a TOML file.

A table per file of the log, or an array of tables if several topics make it::

    clock = "stamp"                    # or "recorded", the default: whose time a message has
    period_s = 0.5                     # only where a recording has no times: between two messages

    [fixes]
    topic = "position"                 # or type = "nav_msgs/msg/Odometry"
    when = {position_valid = true}     # other messages are left out
    fresh = true                       # so are those that repeat the one before
    source = 0
    range_m = {hypot = ["x", "y"]}
    bearing_rad = {atan2 = ["y", "x"]}

    [beacons]
    rows = [{source = 0, x_m = 0.0, y_m = 0.0}]
    beside = "fixes"                   # only if this file gets rows
    unless = "leaders"                 # and not if this one does

Columns are made by expressions (:mod:`auvest.importers.expressions`); ``time_s`` is the message's
unless it is said. ``increments = {x_m, y_m, heading_rad}`` makes odometry of poses. A table with
``recording = "other.csv"`` takes its topic from another file, beside the first. What came without a
number that a row needs is left out and counted.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from auvest._outputs import is_plain_file
from auvest.importers.expressions import Expression, MappingError, expression
from auvest.importers.recording import Message
from auvest.logs.layout import COLUMNS, FILES, Column, match

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_RECIPES = Path(__file__).parent / "recipes"
#: What ``increments`` make of poses.
INCREMENTS = ("forward_m", "left_m", "turn_rad")
_POSE = ("x_m", "y_m", "heading_rad")
_OPTIONS = ("topic", "type", "recording", "when", "fresh", "increments", "rows", "beside", "unless")


@dataclass(frozen=True)
class Table:
    """Where the rows of one file come from.

    Attributes
    ----------
    file : str
        The file of the log.
    columns : tuple of Column
        Its columns in their order.
    topic, type : str or None
        Which messages make a row each.
    recording : str or None
        Another file than the one that is imported.
    when : mapping
        What a field must be.
    fresh : bool
        Whether repeated messages are left out.
    values : mapping
        An expression for each column but the time, if that is the message's.
    pose : tuple of Expression
        x, y and heading, of which increments are made; empty if none are.
    rows : tuple of mapping
        Rows that do not come from messages.
    beside, unless : str or None
        A file without whose rows, and one with whose rows, these are needless.
    """

    file: str
    columns: tuple[Column, ...]
    topic: str | None = None
    type: str | None = None
    recording: str | None = None
    when: Mapping[str, Any] = field(default_factory=dict)
    fresh: bool = False
    values: Mapping[str, Expression] = field(default_factory=dict)
    pose: tuple[Expression, ...] = ()
    rows: tuple[Mapping[str, float], ...] = ()
    beside: str | None = None
    unless: str | None = None

    @property
    def topics(self) -> set[str]:
        """Topics that are needed beside the table's own."""
        return set().union(*(part.topics for part in (*self.values.values(), *self.pose)))

    def takes(self, message: Message) -> bool:
        """Say whether a message of the topic is wanted."""
        return all(_is(message.values.get(name), wanted) for name, wanted in self.when.items())


@dataclass(frozen=True)
class LogMapping:
    """A whole mapping.

    ``lenient``: a field that messages do not have is a number that is missing; one that a user has
    named is a mistake.
    """

    name: str
    clock: str
    period_s: float | None
    tables: tuple[Table, ...]
    lenient: bool = False


def read_mapping(path: Path) -> LogMapping:
    """Read a mapping.

    Raises
    ------
    MappingError
        If it cannot be read, or says what cannot be done.
    """
    if path.exists() and not is_plain_file(path):
        raise MappingError(f"{path} is not a file")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise MappingError(f"{path} cannot be read: {error}") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise MappingError(f"{path} is not TOML: {error}") from None
    try:
        return _mapping(str(path), document)
    except MappingError as error:
        raise MappingError(f"{path}: {error}") from None


def recipe(format_name: str) -> LogMapping:
    """Give the mapping that comes with the package for a format."""
    found = read_mapping(_RECIPES / f"{format_name}.toml")
    return replace(found, name=f"what auvest takes from {format_name}", lenient=True)


def _mapping(name: str, document: dict[str, Any]) -> LogMapping:
    clock = document.pop("clock", "recorded")
    if clock not in ("recorded", "stamp"):
        raise MappingError(f'clock is "recorded" or "stamp", not {clock!r}')
    period = document.pop("period_s", None)
    if period is not None and not (isinstance(period, (int, float)) and 0 < period < 1e6):
        raise MappingError(f"period_s is {period!r}, not seconds above 0")
    tables = []
    for stem, given in document.items():
        for one in given if isinstance(given, list) else [given]:
            if not isinstance(one, dict):
                raise MappingError(f"{stem}: expected a table")
            tables.append(_table(stem, dict(one)))
    if not tables:
        raise MappingError("names no file of a log")
    return LogMapping(name, clock, period, tuple(tables))


def _table(stem: str, given: dict[str, Any]) -> Table:
    file = f"{stem}.csv"
    if file not in FILES:
        known = ", ".join(sorted(name.removesuffix(".csv") for name in FILES))
        raise MappingError(f"{stem} is no file of a log; those are {known}")
    options = {name: given.pop(name) for name in _OPTIONS if name in given}
    for name, kind in (
        ("topic", str), ("type", str), ("recording", str), ("when", dict), ("fresh", bool),
        ("increments", dict), ("rows", list), ("beside", str),
        ("unless", str),
    ):  # fmt: skip
        if name in options and not isinstance(options[name], kind):
            raise MappingError(f"{stem}: {name} is not what it must be")
    if "rows" in options:
        if given or not set(options) <= {"rows", "beside", "unless"}:
            raise MappingError(f"{stem}: rows stand alone")
        beside, unless = (_file(stem, options.get(name)) for name in ("beside", "unless"))
        constant = _constant(stem, file, options["rows"])
        return replace(constant, beside=beside, unless=unless)
    if "unless" in options or "beside" in options:
        raise MappingError(f"{stem}: beside and unless are for rows")
    if ("topic" in options) == ("type" in options):
        raise MappingError(f"{stem}: needs a topic, or a type")
    pose: tuple[Expression, ...] = ()
    if (parts := options.pop("increments", None)) is not None:
        if sorted(parts) != sorted(_POSE):
            raise MappingError(f"{stem}: increments are made of {', '.join(_POSE)}")
        pose = tuple(expression(parts[name], f"{stem}.{name}") for name in _POSE)
    values = {name: expression(part, f"{stem}.{name}") for name, part in given.items()}
    names = {*values, "time_s", *(INCREMENTS if pose else ())}
    return Table(file, columns_of(file, names), values=values, pose=pose, **options)


def _file(stem: str, name: str | None) -> str | None:
    if name is not None and f"{name}.csv" not in FILES:
        raise MappingError(f"{stem}: {name} is no file of a log")
    return None if name is None else f"{name}.csv"


def _constant(stem: str, file: str, rows: list[Any]) -> Table:
    if not rows or not all(isinstance(row, dict) for row in rows):
        raise MappingError(f"{stem}: rows are tables of numbers")
    columns = columns_of(file, set(rows[0]))
    for row in rows:
        if set(row) != set(rows[0]):
            raise MappingError(f"{stem}: rows have the same columns")
        for column in columns:
            value = row[column.name]
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or (column.integer and value % 1):
                raise MappingError(f"{stem}: {column.name} is {value!r}, not {column.expected}")
            if not column.low <= value <= column.high:
                raise MappingError(f"{stem}: {column.name} is {value!r}, outside {column.span}")
    return Table(file, columns, rows=tuple(rows))


def columns_of(file: str, names: set[str]) -> tuple[Column, ...]:
    """Columns of a file by their names, of either spelling, in the order of its layout.

    Raises
    ------
    MappingError
        If no layout of the file has just these.
    """
    found = match(file, names)
    if found is None or len(found.given) < len(names):
        expected = " or ".join(map(str, FILES[file]))
        raise MappingError(f"{file} has the columns {expected}, not {','.join(sorted(names))}")
    return tuple(COLUMNS[name] for name in found.given)


def _is(value: Any, wanted: Any) -> bool:
    if isinstance(wanted, list):
        return any(_is(value, one) for one in wanted)
    return (type(value) is type(wanted) and value == wanted) or (
        not isinstance(value, bool) and not isinstance(wanted, bool) and value == wanted
    )
