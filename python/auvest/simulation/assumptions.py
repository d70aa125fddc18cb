"""What a paper leaves open, from the TOML file beside the module that simulates it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from auvest import _texts


@dataclass(frozen=True)
class Assumption:
    """One thing the paper leaves open: what we chose, and why."""

    quantity: str
    paper: str
    ours: str
    reason: str


def read_assumptions(module: str, **values: Any) -> tuple[Assumption, ...]:
    """Read those of a module, and fill the places of their texts."""
    package, _, name = module.rpartition(".")
    found = _texts.read(package, f"{name}.toml")["assumption"]
    return tuple(Assumption(**_texts.filled(texts, values)) for texts in found)
