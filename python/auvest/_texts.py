"""Lists in words, and texts with places for numbers from TOML files of the package."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


#: What it means that a mean NIS lies outside of where that of a consistent filter does.
NIS_OFF = "below: innovations smaller than expected, above: larger"


def either(names: Iterable[str]) -> str:
    """Return "a", "a or b", "a, b or c"."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last


def short(number: float, digits: int = 3) -> str:
    """Return a number with so many digits, and no exponent where it is below 1e10."""
    return f"{float(f'{number:.{digits}g}'):.10g}"


def os_reason(error: OSError) -> str:
    """Return why the system refused, without the names and numbers that other packages add."""
    return os.strerror(error.errno) if error.errno else str(error)


def then(said: str, more: str) -> str:
    """Return a message with another behind it; a question ends a sentence."""
    return f"{said} {more[0].upper()}{more[1:]}" if said.endswith("?") else f"{said}; {more}"


def listed(values: Mapping[str, Any]) -> str:
    """Return "a = 1, b = 2"."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def counted(number: int, noun: str) -> str:
    """Return "1 run", "2 runs"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def other_cells(found: int, expected: int) -> str:
    """Say that a row of a table has too few or too many cells."""
    why = "truncated?" if found < expected else "a comma within a cell, or decimal commas?"
    return f"{counted(found, 'cell')}, expected {expected}: {why}"


def beside(value: float, low: float, high: float) -> str:
    """Say where a value lies: "below", "within" or "above" two bounds."""
    return "below" if value < low else "above" if value > high else "within"


def read(package: str, name: str) -> dict[str, Any]:
    """Read a file of a package."""
    return tomllib.loads(resources.files(package).joinpath(name).read_text(encoding="utf-8"))


def filled(texts: Mapping[str, str], values: Mapping[str, Any]) -> dict[str, str]:
    """Fill the places ``{name}`` of texts; line breaks and indents become spaces."""
    return {key: " ".join(text.split()).format(**values) for key, text in texts.items()}
