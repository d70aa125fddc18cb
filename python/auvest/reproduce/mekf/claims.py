"""The M-estimation EKF paper's claim and the targets of this project, judged by what we measure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

from auvest.reproduce.claims import LEAST_RUNS, TOO_FEW, Claims
from auvest.reproduce.mekf.measure import CONTAMINATION, Reproduction


@dataclass(frozen=True)
class Claim:
    """A claim or a target, what was measured, and whether it holds; None: of too few runs."""

    where: str
    claim: str
    measured: str
    holds: bool | None

    def as_dict(self) -> dict[str, object]:
        """As JSON takes it."""
        return asdict(self)

    @property
    def verdict(self) -> str:
        """In words."""
        if self.holds is None:
            return TOO_FEW
        return "holds" if self.holds else "does not hold"

    @property
    def own(self) -> bool:
        """Whether it is a target of this project, and no claim of the paper."""
        return self.where == "target"


_claim = Claims(__name__, Claim)


def claims(result: Reproduction) -> list[Claim]:
    """Judge the paper's claims and the targets of this project."""
    judged = list(_judged(result))
    if result.runs >= LEAST_RUNS:
        return judged
    return [replace(claim, holds=None) for claim in judged]


def _judged(result: Reproduction) -> Iterator[Claim]:
    better, worse = result.improvement, result.loss
    yield _claim("improvement", better >= 0.3, percent=100 * better)
    yield _claim("loss", worse <= 0.03, percent=100 * worse)
    off = max(
        abs(row[name].rmse_m / wanted - 1)
        for key, row in result.contamination.items()
        for name, wanted in CONTAMINATION[key].items()
    )
    yield _claim("reference", off <= 0.1, percent=100 * off)
    own, fresh = (result.timing[kind]["igg"].rmse_m for kind in ("own-time", "as-if-fresh"))
    yield _claim("pairing", own < fresh, own=own, fresh=fresh)
    right: list[bool] = []
    wrong: list[bool] = []
    for j in result.consistency:
        matched = (j.q_factor, j.r_factor) == (1, 1)
        (right if matched else wrong).extend((j.nees.consistent, j.nis.consistent))
    outside = wrong.count(False)
    yield _claim("consistent", all(right), inside=sum(right), all=len(right))
    yield _claim("inconsistent", not any(wrong), outside=outside, all=len(wrong))
    with_, without = (result.displaced[f"igg, {n}"] for n in ("recovery", "no recovery"))
    yield _claim(
        "lock_out",
        with_.back == result.displaced_runs,
        back=with_.back,
        runs=result.displaced_runs,
        slowest="not all" if with_.slowest is None else f"all after {with_.slowest}",
        without=without.back,
    )
