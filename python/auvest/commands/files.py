"""Writing result files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt


def write_csv(path: Path, columns: Mapping[str, npt.NDArray[Any]]) -> Path:
    """Write columns of one length under their names, six significant digits, NaN as nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*columns.values(), strict=True):
            file.write(",".join(_cell(value) for value in row) + "\n")
    return path


def _cell(value: Any) -> str:
    return "" if value != value else f"{value:.6g}"
