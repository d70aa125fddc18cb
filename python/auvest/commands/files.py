"""Writing result files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from auvest._outputs import new_file
from auvest.commands import console


def write_csv(path: Path, columns: Mapping[str, npt.NDArray[Any]]) -> Path:
    """Write columns of one length under their names, six significant digits, NaN as nothing."""
    with new_file(path, "w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*columns.values(), strict=True):
            file.write(",".join(_cell(value) for value in row) + "\n")
    return path


def _cell(value: Any) -> str:
    return "" if value != value else f"{value:.6g}"


def write_results(folder: Path, document: Mapping[str, Any]) -> Path:
    """Write results.json."""
    return write_text(folder / "results.json", console.to_json(document) + "\n")


def write_page(
    folder: Path,
    document: Mapping[str, Any],
    tables: Mapping[str, Mapping[str, npt.NDArray[Any]]],
    page: str,
    done: list[Path],
) -> None:
    """Write results.json, the CSV files and the page; ``done`` gets each path when it is there."""
    done.append(write_results(folder, document))
    for stem, table in tables.items():
        done.append(write_csv(folder / f"{stem}.csv", table))
    done.append(write_text(folder / "README.md", page))


def write_text(path: Path, text: str) -> Path:
    """Write a text; what of a name is no text is written as Python writes it."""
    with new_file(path, "w", encoding="utf-8", errors="backslashreplace") as file:
        file.write(text)
    return path


def save_figures(
    folder: Path,
    figures: Mapping[str, Callable[[Any], Any]],
    result: Any,
    progress: console.ProgressCallback,
    done: list[Path],
) -> None:
    """Draw each figure of a result and write it as PNG and SVG under its name."""
    from auvest import plots  # here, because matplotlib takes long to import

    with plots.own_style():
        for number, (stem, draw) in enumerate(figures.items(), start=1):
            figure = draw(result)
            for kind in ("png", "svg"):
                done.append(plots.save(figure, folder / f"{stem}.{kind}"))
            progress(number, len(figures))
