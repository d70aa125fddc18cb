"""The few pieces of Markdown that reproduction pages are made of."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Make a table; a cell may hold anything that prints, bars and line breaks are escaped."""
    lines = [_row(header), "|" + "|".join(" --- " for _ in header) + "|"]
    lines += [_row(row) for row in rows]
    return "\n".join(lines) + "\n"


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
