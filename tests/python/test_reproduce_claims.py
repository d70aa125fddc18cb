"""Claims of a paper and the count of their verdicts."""

from __future__ import annotations

from auvest.reproduce.claims import NO, PARTLY, YES, Claim, tally


def claim(verdict: str) -> Claim:
    return Claim("Fig. 1", "it is good", "it is", verdict)


def test_verdicts_are_counted_in_the_order_of_the_claims() -> None:
    judged = [claim(verdict) for verdict in (PARTLY, YES, YES, NO, YES)]
    assert tally(judged) == "1 partly reproduced; 3 reproduced; 1 not reproduced"
    assert tally([claim(NO), claim(NO)]) == "2 not reproduced"


def test_a_claim_is_written_as_json() -> None:
    assert claim(YES).as_dict() == {
        "where": "Fig. 1",
        "paper": "it is good",
        "measured": "it is",
        "verdict": "reproduced",
    }
