"""Texts that commands give, whole, as they were when they were last read: the files in kept/.

A test that looks at a part of a table or a page says what matters in it; that no other column,
title or number has changed is seen here.  Words, whole numbers and the form of every number must
be the same; a decimal may differ by one in its last digit, which the sines of another processor
can do.  ``pytest tests/python --renew`` writes the files anew: read what has changed in them.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Protocol


class Kept(Protocol):
    """The fixture of conftest.py: compares a text with the one that is kept under a name."""

    def __call__(self, name: str, text: str, *, exact: bool = False) -> None: ...


FOLDER = Path(__file__).with_name("kept")

_NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\.?\w)")

#: Digits that are kept of a number: single precision holds hardly more.
_DIGITS = 6

#: Lines of a table: its head and its end tell a column that is another.
_HEAD, _END = 3, 2

#: What is only rounding is 0.
_NOTHING = 1e-12


def short(text: str) -> str:
    """Return the text with at most ``_DIGITS`` digits in each of its decimals."""

    def rounded(number: re.Match[str]) -> str:
        told = number[0]
        digits = re.sub(r"e.*|\D", "", told).lstrip("0")
        return told if len(digits) <= _DIGITS or "." not in told else f"{float(told):.{_DIGITS}g}"

    return _NUMBER.sub(rounded, text)


def written(folder: Path) -> str:
    """Return the texts in a folder, of each table its head and its end."""
    parts = []
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".json", ".md", ".csv", ".toml") and path.is_file():
            lines = path.read_text(encoding="utf-8").splitlines()
            if path.suffix == ".csv" and len(lines) > _HEAD + _END:
                lines[_HEAD:-_END] = [f"... {len(lines)} lines"]
            parts += [f"\n--- {path.relative_to(folder)}", *lines]
    return "\n".join(parts) + "\n"


def _last_digit(number: str) -> float:
    """Return what one in the last digit of a number is worth, 0 for a whole one."""
    mantissa, _, exponent = number.partition("e")
    if "." not in mantissa and not exponent:
        return 0.0
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def _near(now: str, before: str) -> bool:
    if now == before:
        return True
    a, b = (float(number.replace("−", "-")) for number in (now, before))
    return abs(a - b) <= max(_NOTHING, 1.001 * max(_last_digit(now), _last_digit(before)))


def same(now: str, before: str) -> bool:
    """Return whether two texts are the same but for the last digits of their decimals."""
    numbers, others = _NUMBER.findall(now), _NUMBER.findall(before)
    return _NUMBER.sub("#", now) == _NUMBER.sub("#", before) and all(map(_near, numbers, others))


def difference(now: str, before: str) -> str:
    """Return the lines in which two texts are not the same."""
    lines = difflib.unified_diff(before.split("\n"), now.split("\n"), "kept", "now", "", "", 0, "")
    return "\n".join(lines)
