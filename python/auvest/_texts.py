"""Lists in words, and texts with places for numbers from TOML files of the package."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def either(names: Iterable[str]) -> str:
    """Return "a", "a or b", "a, b or c"."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last


def read(package: str, name: str) -> dict[str, Any]:
    """Read a file of a package."""
    return tomllib.loads(resources.files(package).joinpath(name).read_text(encoding="utf-8"))


def filled(texts: Mapping[str, str], values: Mapping[str, Any]) -> dict[str, str]:
    """Fill the places ``{name}`` of texts; line breaks and indents become spaces."""
    return {key: " ".join(text.split()).format(**values) for key, text in texts.items()}
