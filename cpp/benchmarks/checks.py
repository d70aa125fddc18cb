"""What a benchmark has measured against what was asked for: targets, and bounds that fail.

A target is for the reference machine. The bound below which `make bench` fails lies a margin away,
because a ratio of times does not change with a machine that is faster as a whole, but with one that
is faster at something else: the width of its vector units, its caches, the linear algebra behind
NumPy, the compiler of a newer Numba. On the second machine that was tried such ratios were up to
17 % worse; code that has lost its point is worse by more than the margin.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

MARGIN = 0.3


@dataclass(frozen=True)
class Check:
    """A number that was measured.

    Parameters
    ----------
    name : str
        Of what, as the table shows it.
    value : float
    sign : {">=", "<="}
        Where the target lies.
    target : float, optional
        What the reference machine reaches; None: the number is shown and not judged.
    margin : float
        How far the bound lies beyond the target, as a share of it; 0 for what does not depend on
        the machine.
    """

    name: str
    value: float
    sign: Literal[">=", "<="] = ">="
    target: float | None = None
    margin: float = MARGIN

    @property
    def bound(self) -> float | None:
        """Return the value that just passes."""
        if self.target is None:
            return None
        return self.target * (1 - self.margin if self.sign == ">=" else 1 + self.margin)

    @property
    def reached(self) -> bool:
        """Say whether the target is reached."""
        return self._within(self.target)

    @property
    def passed(self) -> bool:
        """Say whether the bound is kept."""
        return self._within(self.bound)

    def _within(self, limit: float | None) -> bool:
        if limit is None:
            return True
        return self.value >= limit if self.sign == ">=" else self.value <= limit

    @property
    def verdict(self) -> str:
        """Say in a word how it went; empty if all is well."""
        return "" if self.reached else "short of the target" if self.passed else "MISSED"


def table(checks: Sequence[Check]) -> str:
    """Return the checks as Markdown."""
    lines = [
        "| ratio | measured | target | fails beyond |  |",
        "| --- | ---: | ---: | ---: | --- |",
    ]
    for one in checks:
        limits = ["" if x is None else f"{one.sign} {x:.4g}" for x in (one.target, one.bound)]
        cells = [one.name, f"{one.value:.3g}", *limits, one.verdict]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def judge(checks: Sequence[Check]) -> int:
    """Print every check to stderr; return the exit code, 1 if a bound is missed."""
    for one in checks:
        limits = "" if one.target is None else f" (target {one.sign} {one.target:g})"
        print(f"{one.verdict or 'ok':20} {one.name}: {one.value:.3g}{limits}", file=sys.stderr)
    return 0 if all(one.passed for one in checks) else 1
