"""A paper's claim, what we measure about it, and the verdict."""

from __future__ import annotations

from dataclasses import asdict, dataclass

YES = "reproduced"
PARTLY = "partly reproduced"
NO = "not reproduced"


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


def tally(judged: list[Claim]) -> str:
    """Count the verdicts, in words."""
    counts: dict[str, int] = {}
    for claim in judged:
        counts[claim.verdict] = counts.get(claim.verdict, 0) + 1
    return "; ".join(f"{count} {verdict}" for verdict, count in counts.items())
