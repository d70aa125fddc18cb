"""Fields of dataclasses that say what they take: of models, policies, scenarios and settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields
from functools import partial
from typing import Any

from auvest._arguments import as_flag, as_instance, as_integer, as_kind, as_number, as_pair

#: Takes the name of a field and what was given; returns what is kept, or refuses it.
Take = Callable[[str, Any], Any]


class Checked:
    """Base of frozen dataclasses: what was given is taken by the fields, in their order."""

    def __post_init__(self) -> None:
        for entry in fields(self):  # type: ignore[arg-type]
            if "take" in entry.metadata:
                value = entry.metadata["take"](entry.name, getattr(self, entry.name))
                object.__setattr__(self, entry.name, value)


def taken(default: Any, take: Take, **schema: Any) -> Any:
    """Describe a field; ``schema`` says in JSON Schema what it takes."""
    return field(default=default, metadata={"take": take, "schema": schema})


def number(default: float | None) -> Any:
    """Take a finite number; None as a default stands for nothing."""
    return taken(default, as_number, type="number")


def positive(default: float | None, *, infinite: bool = False) -> Any:
    """Take a number above 0; None as a default stands for nothing."""
    take = partial(as_number, bound="positive", infinite=infinite)
    return taken(default, take, type="number", exclusiveMinimum=0)


def not_negative(default: float | None) -> Any:
    """Take a finite number of at least 0; None as a default stands for nothing."""
    return taken(default, partial(as_number, bound="not negative"), type="number", minimum=0)


def fraction(default: float) -> Any:
    """Take a number from 0 to 1."""

    def take(name: str, given: object) -> float:
        value = as_number(name, given, "not negative")
        if value > 1:
            raise ValueError(f"{name} must lie in 0..1, not {value}")
        return value

    return taken(default, take, type="number", minimum=0, maximum=1)


def integer(default: int, low: int, high: int) -> Any:
    """Take an integer from ``low`` to ``high``."""
    take = partial(as_integer, low=low, high=high)
    return taken(default, take, type="integer", minimum=low, maximum=high)


def flag(default: bool) -> Any:
    """Take True or False."""
    return taken(default, as_flag, type="boolean")


def choice(default: str, *others: str) -> Any:
    """Take one of a few names."""
    kinds = (default, *others)
    return taken(default, partial(as_kind, kinds=kinds), enum=list(kinds))


def pair(default: Any) -> Any:
    """Take two finite numbers, for example a position."""
    return taken(as_pair("default", default), as_pair)


def unstated(entry: Any) -> Any:
    """Take what another field takes, or None, which is the default: not stated."""
    take, schema = entry.metadata["take"], entry.metadata["schema"]

    def take_or_none(name: str, given: object) -> Any:
        return None if given is None else take(name, given)

    return taken(None, take_or_none, **schema)


def instance(of: type) -> Any:
    """Take an instance of a class; default: one with its defaults."""
    return field(default_factory=of, metadata={"take": partial(as_instance, expected=of)})
