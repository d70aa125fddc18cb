"""The figures of a replay, by hand from batches of a few rows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from auvest.replay import tables
from auvest.replay.tables import Batch
from auvest.replay.tally import Tally

NAN = math.nan


def measured(**columns: list[Any]) -> dict[str, Any]:
    """Measurements of which nothing else is known."""
    rows = max((len(values) for values in columns.values()), default=0)
    table: dict[str, Any] = tables.blank_measurements(rows)
    table["outcome"][:] = tables.ACCEPTED
    for name, values in columns.items():
        table[name] = np.array(values, dtype=table[name].dtype)
    return table


def errors(*rows: tuple[float, float], sigma: tuple[float, float] = (1.0, 1.0)) -> dict[str, Any]:
    """Errors along x and y, and what the filter takes for their standard deviations."""
    table: dict[str, Any] = {name: np.full(len(rows), NAN) for name in tables.ERRORS}
    table["error_x_m"], table["error_y_m"] = np.array(rows).reshape(-1, 2).T
    table["sigma_x_m"][:], table["sigma_y_m"][:] = sigma
    return table


def batch(
    *,
    times: list[float] | None = None,
    measurements: dict[str, Any] | None = None,
    truth: dict[str, Any] | None = None,
) -> Batch:
    estimates = {name: np.full(len(times or []), NAN) for name in tables.ESTIMATES}
    estimates["time_s"] = np.array(times or [])
    return Batch(
        estimates=estimates,
        measurements=measured() if measurements is None else measurements,
        errors=errors() if truth is None else truth,
    )


def figures(*batches: Batch) -> dict[str, Any]:
    tally = Tally()
    for one in batches:
        tally.add(one)
    return tally.numbers()


def test_the_bounds_of_the_nis_are_those_of_the_numbers_measured() -> None:
    """Ranges are one number, fixes two; of one fix 95 % lie between -2 ln 0.975 and -2 ln 0.025."""
    one = figures(batch(measurements=measured(nis=[1.5], innovation_0=[2.0])))
    # The square of the quantiles of a normal deviate, 0.5 -+ 0.475: 0.031338 and 2.241403.
    assert one["nis_bounds_95"] == pytest.approx([0.031338**2, 2.241403**2], rel=1e-4)
    fix = measured(nis=[1.5], innovation_0=[2.0], innovation_1=[0.1])
    two = [-2 * math.log(0.975), -2 * math.log(0.025)]
    assert figures(batch(measurements=fix))["nis_bounds_95"] == pytest.approx(two, rel=1e-12)
    # A stretch without a fix changes nothing.
    later = figures(batch(measurements=fix), batch(measurements=measured(nis=[NAN])))
    assert later["nis_bounds_95"] == pytest.approx(two, rel=1e-12)
    # Of two ranges it is the mean: half of a chi-square value with two degrees of freedom.
    both = figures(batch(measurements=measured(nis=[1.0, NAN, 2.0])))
    assert both["nis_bounds_95"] == pytest.approx([two[0] / 2, two[1] / 2], rel=1e-12)
    assert both["nis_mean"] == 1.5


def test_times_are_the_first_and_the_last_of_all_batches() -> None:
    numbers = figures(batch(), batch(times=[1.0, 2.0]), batch(times=[3.0, 5.0]), batch())
    assert (numbers["first_s"], numbers["last_s"], numbers["estimates"]) == (1.0, 5.0, 4)


def test_errors_of_all_batches_count() -> None:
    """Lengths 5, 0 and 1: the mean square is 26 / 3."""
    numbers = figures(batch(truth=errors((3.0, -4.0), (0.0, 0.0))), batch(truth=errors((0.0, 1.0))))
    assert numbers["rmse_m"] == pytest.approx(math.sqrt(26 / 3), rel=1e-15)
    assert numbers["max_error_m"] == 5.0
    assert numbers["truth"] == 3


def test_within_three_sigma_is_along_x_and_along_y() -> None:
    """With sigmas of 1 and 2 m: up to 3 along x and up to 6 along y."""
    inside = [(3.0, 6.0), (-3.0, -6.0), (0.0, 5.9), (0.5, -5.9)]
    outside = [(3.1, 0.0), (-3.1, 0.0), (0.0, 6.1), (0.0, -6.1)]
    wide = (1.0, 2.0)
    first = batch(truth=errors(*inside, outside[0], sigma=wide))
    numbers = figures(first, batch(truth=errors(*outside[1:], sigma=wide)))
    assert numbers["inside_3_sigma"] == 4 / 8


def test_dead_reckoning_is_scored_where_the_truth_is_known() -> None:
    """Two rows of truth among five estimates: errors of 6 and 8 m have a mean square of 50."""
    truth = errors((0.0, 0.0), (0.0, 0.0))
    truth["dead_reckoned_error_m"] = np.array([6.0, 8.0])
    numbers = figures(batch(times=[1.0, 2.0, 3.0, 4.0, 5.0], truth=truth))
    assert numbers["dead_reckoned_rmse_m"] == pytest.approx(math.sqrt(50), rel=1e-15)
    # A tracked craft has none.
    assert figures(batch(truth=errors((1.0, 0.0))))["dead_reckoned_rmse_m"] is None


def test_what_became_of_the_measurements() -> None:
    one = measured(
        outcome=[tables.ACCEPTED, tables.HELD_OUT, tables.REJECTED, tables.HELD_OUT],
        held_out_error_m=[NAN, 3.0, NAN, -4.0],
        recovered=[False, False, True, False],
        near_field=[True, False, False, False],
    )
    two = measured(outcome=[tables.HELD_OUT, tables.BEFORE_START], held_out_error_m=[5.0, NAN])
    numbers = figures(batch(measurements=one), batch(measurements=two))
    counts = {name: numbers[name.replace(" ", "_")] for name in tables.OUTCOMES}
    assert counts == {
        "accepted": 1, "downweighted": 0, "rejected": 1, "held out": 3,
        "before start": 1, "after end": 0, "no position": 0, "too short": 0,
    }  # fmt: skip
    assert numbers["measurements"] == 6
    assert (numbers["recovered"], numbers["near_field"]) == (1, 1)
    # Too long or too short: 9, 16 and 25 m^2.
    assert numbers["held_out_rmse_m"] == pytest.approx(math.sqrt(50 / 3), rel=1e-15)


def test_where_there_is_nothing_there_is_no_figure() -> None:
    numbers = figures(batch())
    for name in ("rmse_m", "max_error_m", "inside_3_sigma", "held_out_rmse_m", "nis_mean"):
        assert numbers[name] is None, name
    assert numbers["nis_bounds_95"] == [None, None]
    assert math.isnan(numbers["first_s"])
