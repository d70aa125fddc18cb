"""Runs that are done in several calls are those of one call, in every simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from auvest import montecarlo
from auvest.simulation import cooperative, mission, paper_aukf, paper_slatf, slat, tracking

NOISE = paper_aukf.paper_noise(dropout=0.1)
SLAT = paper_slatf.paper_scenario(paper_slatf.LEVELS[2])


def of_tracking(first: int, runs: int) -> Any:
    scenario = tracking.Scenario(noise=NOISE, steps=40, runs=runs, random_start=True)
    return tracking.simulate(paper_aukf.paper_filter(noise=NOISE), scenario, first=first)


def of_slat(first: int, runs: int) -> Any:
    scenario = replace(SLAT, duration_s=100.0, runs=runs)
    filter_ = paper_slatf.paper_filter("slatf2", scenario, particles=20)
    return slat.simulate(filter_, scenario, first=first)


def of_cooperative(first: int, runs: int) -> Any:
    scenario = cooperative.Scenario(steps=300, runs=runs, timing="own-time", late=0.1)
    return cooperative.simulate(cooperative.slave_filter(), scenario, first=first)


def of_mission(first: int, runs: int) -> Any:
    plan = mission.Mission(track="circle", circle_s=30.0, runs=runs)
    return mission.simulate(plan, record=False, first=first)


@pytest.mark.parametrize("simulate", [of_tracking, of_slat, of_cooperative, of_mission])
def test_runs_in_parts_are_those_of_one_call(simulate: Callable[[int, int], Any]) -> None:
    whole = simulate(0, 23).per_run()
    # A single run, as many as fit into lanes and one more, and the rest.
    for first, runs in ((0, 1), (1, 9), (10, 13)):
        part = simulate(first, runs).per_run()
        assert list(part) == list(whole)
        for name, values in part.items():
            assert values.tobytes() == whole[name][first : first + runs].tobytes(), name
    assert max(len(np.unique(values)) for values in whole.values()) == 23  # each draws its own


def test_the_runner_numbers_from_first() -> None:
    seen = montecarlo.run(
        lambda first, count: {"run": np.arange(first, first + count)}, 10, first=7, chunk=4
    )
    assert seen["run"].tolist() == list(range(7, 17))


@pytest.mark.parametrize("first", [-1, 2**53])
def test_a_first_run_that_no_stream_has_is_refused(first: int) -> None:
    with pytest.raises(ValueError, match="first must lie in 0"):
        of_mission(first, 1)
