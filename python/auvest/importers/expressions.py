"""How a number of a log is made from the fields of messages, as a mapping says it.

======================================  ===========================================================
``"velocity.x"``                        a field of the message
``1``, ``0.5``                          a constant
``{field = "Yaw", unit = "deg"}``       a field in another unit; with ``topic = "ATT"`` that of the
                                        message of this topic nearest in time, at most 1 s away
``{hypot = [a, b, ...]}``               the length of a vector
``{atan2 = [y, x]}``                    the angle from x towards y
``{sum = [a, b, ...]}``                 a sum
``{along = [x, y, heading]}``           the part of a vector along a heading
``{across = [x, y, heading]}``          the part a quarter turn from it, towards y
``{yaw = [w, x, y, z]}``                the heading of a quaternion
======================================  ===========================================================

Every table may have ``unit``, then ``scale`` and ``offset`` (value * scale + offset), ``missing``,
the value of a field that stands for "none", and ``wrap = true`` for an angle within half a turn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from auvest.importers.recording import Message

#: Factors to SI units, and degrees for latitude and longitude (``1e-7 deg`` is MAVLink's).
UNITS: Mapping[str, float] = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9,
    "m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048, "nmi": 1852.0,
    "m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "kn": 1852.0 / 3600.0, "km/h": 1 / 3.6,
    "rad": 1.0, "deg": math.pi / 180, "cdeg": math.pi / 18000,
    "rad/s": 1.0, "deg/s": math.pi / 180, "deg/min": math.pi / 10800,
    "1e-7 deg": 1e-7,
}  # fmt: skip
#: A message of another topic is beside one if it is not further from it in time.
WITHIN_S = 1.0


class NotANumber(ValueError):
    """A field is there, but holds no number."""


class MappingError(ValueError):
    """A mapping says what cannot be done."""


class NoSuchField(MappingError):
    """It names a field that messages of a topic do not have."""


#: Of other topics the message that is nearest in time.
Beside: TypeAlias = Mapping[str, Message]
Evaluate: TypeAlias = Callable[[Message, Beside], float | None]


@dataclass(frozen=True)
class Expression:
    """A number from messages; None if one that it needs is missing.

    Attributes
    ----------
    evaluate : callable
        ``evaluate(message, beside)``.
    topics : frozenset of str
        Topics it looks at beside the message's own.
    """

    evaluate: Evaluate
    topics: frozenset[str] = frozenset()


def expression(given: Any, where: str) -> Expression:
    """Read an expression; ``where`` is its place in the mapping.

    Raises
    ------
    MappingError
        If it is none.
    """
    if isinstance(given, bool):
        raise MappingError(f"{where}: a truth value is no number")
    if isinstance(given, (int, float)):
        if not math.isfinite(given):
            raise MappingError(f"{where}: {given} is not a number")
        return Expression(lambda _message, _beside: given)
    if isinstance(given, str):
        return Expression(_field(given, None))
    if isinstance(given, Mapping):
        return _table(given, where)
    raise MappingError(f"{where}: expected a field, a number or a table, not {given!r}")


def _table(given: Mapping[str, Any], where: str) -> Expression:
    kinds = [name for name in ("field", *_FUNCTIONS) if name in given]
    if len(kinds) != 1:
        raise MappingError(f"{where}: needs one of field, {', '.join(_FUNCTIONS)}")
    (kind,) = kinds
    finish = {"unit", "scale", "offset", "wrap"}
    known = {kind, *finish, *(("topic", "missing") if kind == "field" else ())}
    for name in given:
        if name not in known:
            raise MappingError(f"{where}: {name} means nothing beside {kind}")
    inner = _of_field(given, where) if kind == "field" else _of_function(kind, given[kind], where)
    if not finish & set(given):
        return inner
    unit = given.get("unit", "m")
    if unit not in UNITS:
        raise MappingError(f"{where}: unit {unit!r} is not known; one of {', '.join(UNITS)}")
    scale = UNITS[unit] * _number(given, "scale", 1.0, where)
    offset = _number(given, "offset", 0.0, where)
    wrap = given.get("wrap", False)
    if not isinstance(wrap, bool):
        raise MappingError(f"{where}: wrap is true or false")

    def evaluate(message: Message, beside: Beside) -> float | None:
        value = inner.evaluate(message, beside)
        if value is None:
            return None
        value = value * scale + offset
        return math.remainder(value, math.tau) if wrap else value

    return Expression(evaluate, inner.topics)


def _of_field(given: Mapping[str, Any], where: str) -> Expression:
    name, topic = given["field"], given.get("topic")
    if not isinstance(name, str) or not isinstance(topic, (str, type(None))):
        raise MappingError(f"{where}: field and topic are names")
    missing = None
    if "missing" in given:
        missing = _number(given, "missing", 0.0, where)
    if topic is None:
        return Expression(_field(name, missing))
    within_ns = round(WITHIN_S * 1e9)
    read = _field(name, missing)

    def evaluate(message: Message, beside: Beside) -> float | None:
        other = beside.get(topic)
        if other is None or message.time_ns is None or other.time_ns is None:
            return None
        return read(other, beside) if abs(message.time_ns - other.time_ns) <= within_ns else None

    return Expression(evaluate, frozenset({topic}))


def _field(name: str, missing: float | None) -> Evaluate:
    def evaluate(message: Message, _beside: Beside) -> float | None:
        try:
            value = message.values[name]
        except KeyError:
            raise NoSuchField(
                f"{message.topic} has no field {name}; it has {', '.join(message.values)[:300]}"
            ) from None
        if value is None or value == missing:
            return None
        if isinstance(value, (bool, str)):
            raise NotANumber(f"{name} is {str(value)[:40]!r}, not a number")
        return value

    return evaluate


def _of_function(kind: str, given: Any, where: str) -> Expression:
    function, least, most = _FUNCTIONS[kind]
    if not isinstance(given, list) or not least <= len(given) <= most:
        count = f"{least}" if least == most else f"{least} to {most}"
        raise MappingError(f"{where}: {kind} takes a list of {count}")
    parts = [expression(part, f"{where}.{kind}") for part in given]

    def evaluate(message: Message, beside: Beside) -> float | None:
        values = [part.evaluate(message, beside) for part in parts]
        return None if None in values else function(*values)

    return Expression(evaluate, frozenset().union(*(part.topics for part in parts)))


def _yaw(w: float, x: float, y: float, z: float) -> float:
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _along(x: float, y: float, heading: float) -> float:
    return x * math.cos(heading) + y * math.sin(heading)


def _across(x: float, y: float, heading: float) -> float:
    return y * math.cos(heading) - x * math.sin(heading)


def _sum(*values: float) -> float:
    return math.fsum(values)


#: Each with how many numbers it takes.
_FUNCTIONS: Mapping[str, tuple[Callable[..., float], int, int]] = {
    "hypot": (math.hypot, 1, 4),
    "atan2": (math.atan2, 2, 2),
    "sum": (_sum, 1, 8),
    "along": (_along, 3, 3),
    "across": (_across, 3, 3),
    "yaw": (_yaw, 4, 4),
}


def _number(given: Mapping[str, Any], name: str, default: float, where: str) -> float:
    value = given.get(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise MappingError(f"{where}: {name} is {value!r}, not a number")
    return float(value)


def step(before: tuple[float, float, float], after: tuple[float, float, float]) -> Iterator[float]:
    """Forward, left and turn from one pose (x, y, heading) to the next."""
    dx, dy = after[0] - before[0], after[1] - before[1]
    yield _along(dx, dy, before[2])
    yield _across(dx, dy, before[2])
    yield math.remainder(after[2] - before[2], math.tau)
