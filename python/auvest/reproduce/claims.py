"""A paper's claim, what we measure about it, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any, Generic, TypeVar

from auvest import _texts
from auvest.reproduce import markdown

T = TypeVar("T")

YES = "reproduced"
PARTLY = "partly reproduced"
NO = "not reproduced"

#: A verdict rests on so many runs at least: of fewer the standard error itself is known to no
#: better than 1 / sqrt(2 (n - 1)), a sixth.
LEAST_RUNS = 20
TOO_FEW = "not judged: too few runs"


@dataclass(frozen=True)
class Claim:
    """One statement of the paper, what we measure about it, and the verdict."""

    where: str
    paper: str
    measured: str
    verdict: str

    def as_dict(self) -> dict[str, str]:
        """For JSON."""
        return asdict(self)


class Claims(Generic[T]):
    """The texts of claims.toml beside a module; called, it makes a claim of one.

    Parameters
    ----------
    module : str
        Name of the module.
    make : callable
        Takes the three texts (where, what is claimed, what is measured) and the verdict.
    """

    def __init__(self, module: str, make: Callable[..., T]) -> None:
        self._texts = _texts.read(module.rpartition(".")[0], "claims.toml")
        self._make = make

    def __call__(self, name: str, verdict: object, /, **values: Any) -> T:
        """Fill the places of the texts of that name."""
        return self._make(*_texts.filled(self._texts[name], values).values(), verdict)


def graded(yes: bool = False, *, partly: bool = False) -> str:
    """Make a verdict."""
    return YES if yes else PARTLY if partly else NO


def settled(judged: Iterable[Claim], runs: int) -> list[Claim]:
    """Withhold verdicts that would rest on too few runs."""
    if runs >= LEAST_RUNS:
        return list(judged)
    return [replace(claim, verdict=TOO_FEW) for claim in judged]


def tally(judged: list[Claim]) -> str:
    """Count the verdicts, in words."""
    counts: dict[str, int] = {}
    for claim in judged:
        counts[claim.verdict] = counts.get(claim.verdict, 0) + 1
    return "; ".join(f"{count} {verdict}" for verdict, count in counts.items())


def claim_rows(judged: Iterable[Claim]) -> str:
    """Lay out claims and verdicts for a page: where, the paper, measured, verdict."""
    return markdown.rows((c.where, c.paper, c.measured, f"**{c.verdict}**") for c in judged)


def assumption_rows(assumptions: Iterable[Any]) -> str:
    """Lay out what a paper leaves open: quantity, paper, ours and reason of each."""
    return markdown.rows((a.quantity, a.paper, a.ours, a.reason) for a in assumptions)
