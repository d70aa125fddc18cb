"""Writing result files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from auvest.commands import console


def write_csv(path: Path, columns: Mapping[str, npt.NDArray[Any]]) -> Path:
    """Write columns of one length under their names, six significant digits, NaN as nothing."""
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*columns.values(), strict=True):
            file.write(",".join(_cell(value) for value in row) + "\n")
    return path


def _cell(value: Any) -> str:
    return "" if value != value else f"{value:.6g}"


def write_results(folder: Path, document: dict[str, Any], files: dict[str, Path]) -> None:
    """Write results.json; ``files`` gets its path, and ``document`` the paths of all files."""
    files["results"] = folder / "results.json"
    document["files"] = {name: str(path) for name, path in files.items()}
    _write(files["results"], console.to_json(document) + "\n")


def write_page(
    folder: Path,
    document: Mapping[str, Any],
    tables: Mapping[str, Mapping[str, npt.NDArray[Any]]],
    page: str,
    done: list[Path],
) -> None:
    """Write results.json, the CSV files and the page; ``done`` gets each path when it is there."""
    done.append(_write(folder / "results.json", console.to_json(document) + "\n"))
    for stem, table in tables.items():
        done.append(write_csv(folder / f"{stem}.csv", table))
    done.append(_write(folder / "README.md", page))


def _write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def save_figures(
    folder: Path,
    figures: Mapping[str, Callable[[Any], Any]],
    result: Any,
    progress: console.ProgressCallback,
    done: list[Path],
) -> None:
    """Draw each figure of a result and write it as PNG under its name."""
    from auvest import plots  # here, because matplotlib takes long to import

    for number, (stem, draw) in enumerate(figures.items(), start=1):
        done.append(plots.save(draw(result), folder / f"{stem}.png"))
        progress(number, len(figures))
