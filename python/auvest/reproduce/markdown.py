"""The few pieces of Markdown that reproduction pages are made of."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from importlib import resources
from typing import Any


def page(module: str, **values: Any) -> str:
    """Fill the template page.md beside a module: ``{name}``, with a format or an attribute."""
    folder = resources.files(module.rpartition(".")[0])
    template = folder.joinpath("page.md").read_text(encoding="utf-8")
    placed = {name: v.strip("\n") if isinstance(v, str) else v for name, v in values.items()}
    return fill(template.format(**placed)).rstrip("\n") + "\n"


def table(header: Sequence[str], cells: Iterable[Sequence[object]]) -> str:
    """Make a table; a cell may hold anything that prints, bars and line breaks are escaped."""
    head = _row(header) + "\n|" + "|".join(" --- " for _ in header) + "|\n"
    return head + rows(cells) + "\n"


def rows(cells: Iterable[Sequence[object]]) -> str:
    """Make the rows of a table whose head stands in the template."""
    return "\n".join(map(_row, cells))


def number(value: float, digits: int = 3) -> str:
    """Print a number with so many significant digits, without an exponent where that is short."""
    if value == 0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa}e{int(exponent)}"


def series(values: Iterable[float], decimals: int = 3) -> str:
    """Print numbers one after the other."""
    return ", ".join(f"{value:.{decimals}f}" for value in values)


def fill(text: str, width: int = 100) -> str:
    """Fill the paragraphs and lists of a page; headings, tables and pictures stay as they are."""
    return "\n\n".join(_fill_block(block, width) for block in text.split("\n\n"))


def _fill_block(block: str, width: int) -> str:
    bare = block.strip("\n")
    if bare.startswith(("|", "#", "!")):
        return block
    items = ("\n" + bare).split("\n- ") if bare.startswith("- ") else [bare]
    filled = []
    for item in items:
        words = " ".join(item.split())
        if words:
            mark = "- " if len(items) > 1 else ""
            filled.append(
                textwrap.fill(
                    words,
                    width,
                    initial_indent=mark,
                    subsequent_indent=" " * len(mark),
                    break_long_words=False,
                    break_on_hyphens=False,
                )
            )
    return "\n".join(filled)


def _row(cells: Sequence[object]) -> str:
    texts = [str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells]
    return "| " + " | ".join(texts) + " |"
