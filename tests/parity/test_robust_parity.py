"""The robust EKF gives the same bits on every target; the reference is Python."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from auvest import Decision, Status
from firmware.parity.targets import CHIP_TARGETS, TARGETS
from tests.parity.comparison import differing_bits, first_difference, target_params
from tests.parity.robust_records import all_records

RECORDS = all_records()
BY_NAME = {record.name: record for record in RECORDS}


@pytest.fixture(scope="module")
def robust_expected():
    return {record.name: record.replay_in_python() for record in RECORDS}


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record.name)
@pytest.mark.parametrize("target", target_params([*TARGETS, *CHIP_TARGETS]))
def test_every_target_gives_the_bits_of_python(record, target, replay, robust_expected):
    found = record.trace_of(replay(target, record.to_bytes()))
    wanted = robust_expected[record.name]
    difference = first_difference(wanted, found)
    assert difference is None, (
        f"{record.name} on {target.name}: {differing_bits(wanted, found)} bits differ; {difference}"
    )


def test_the_records_reach_what_they_are_for(robust_expected):
    """Every decision, statuses, recovery and iterations occur."""
    igg = robust_expected["robust-igg"]
    assert {int(d) for d in igg["decision"]} == {int(d) for d in Decision.__members__.values()}
    assert robust_expected["robust-lost"]["recovered"].any()
    assert robust_expected["robust-post-fit"]["iterations"].max() > 2
    refused = robust_expected["robust-refusals"]
    wanted = {int(s) for s in (Status.ok, Status.not_finite, Status.time_backwards)}
    assert wanted <= {int(s) for s in refused["predict"]}
    assert {int(Status.ok), int(Status.not_finite)} <= {int(s) for s in refused["update"]}
    late = robust_expected["robust-late"]
    assert np.flatnonzero(late["update"] == int(Status.time_backwards)).tolist() == [30, 90]
    weights = igg["weight"].view(np.float32)
    assert ((weights > 0) & (weights < 1)).any()
    for before, after in pairwise(refused):
        if after["predict"] and after["iterations"] == 0:
            assert np.array_equal(before["x"], after["x"])
            assert np.array_equal(before["P"], after["P"])
