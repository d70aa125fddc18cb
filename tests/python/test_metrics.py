"""Measures of error and consistency."""

from __future__ import annotations

import numpy as np
import pytest

from auvest import metrics


def test_rmse_of_known_vectors():
    # Lengths 5, 0 and 13; the row with a NaN is left out.
    error = [[3.0, 4.0], [0.0, 0.0], [np.nan, 1.0], [5.0, 12.0]]
    assert metrics.rmse(error) == pytest.approx(np.sqrt((25 + 0 + 169) / 3), rel=1e-15)
    assert np.isnan(metrics.rmse(np.full((3, 2), np.nan)))


def test_nees_of_known_vectors():
    error = np.array([[1.0, 2.0], [np.nan, 0.0], [3.0, 0.0]])
    p = np.array([[[1.0, 0.0], [0.0, 4.0]], np.eye(2), [[2.0, 1.0], [1.0, 2.0]]])
    value = metrics.nees(error, p)
    # The inverse of [[2, 1], [1, 2]] has 2/3 on its diagonal.
    assert value[[0, 2]] == pytest.approx([2.0, 6.0], rel=1e-14)
    assert np.isnan(value[1])
    assert metrics.nees([1.0, 2.0], p[0]) == pytest.approx(2.0)
    # What is no covariance, but can be solved, shows that it is none.
    assert metrics.nees([1.0, 2.0], np.diag([1.0, -4.0])) == pytest.approx(0.0)
    with pytest.raises(ValueError, match=r"error has shape \(3, 2\) and P \(2, 2\)"):
        metrics.nees(error, p[0])


def test_nees_is_nan_where_the_covariance_is_singular():
    """The start of a craft that is known exactly; the rows behind it have their values."""
    p = np.stack([np.zeros((2, 2)), np.eye(2), [[1.0, 1.0], [1.0, 1.0]], 4e-200 * np.eye(2)])
    error = np.array([[1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [1e-100, 1e-100]])
    np.testing.assert_allclose(metrics.nees(error, p), [np.nan, 2.0, np.nan, 0.5])
    assert np.isnan(metrics.nees([1.0, 2.0], np.zeros((2, 2))))


def test_nees_is_nan_where_an_input_is_not_finite():
    p = np.array([np.eye(2), np.diag([np.inf, 1.0]), np.diag([np.nan, 1.0]), np.eye(2)])
    value = metrics.nees([[1.0, 2.0], [1.0, 2.0], [1.0, 2.0], [np.inf, 2.0]], p)
    assert value[0] == pytest.approx(5)
    assert np.isnan(value[1:]).all()


def test_chi2_bounds():
    # 95 % of one chi-square value with 2 degrees of freedom: -2 ln(0.975), -2 ln(0.025).
    assert metrics.chi2_bounds(2) == pytest.approx((-2 * np.log(0.975), -2 * np.log(0.025)))
    low, high = metrics.chi2_bounds(2, count=1000)
    # The mean of 1000 has a standard deviation of 2 / sqrt(1000).
    assert (low, high) == pytest.approx((2 - 1.96 * 0.0632, 2 + 1.96 * 0.0632), abs=0.004)
    for bad in ({"dof": 0}, {"dof": 2, "count": 0}, {"dof": 2, "level": 1.0}):
        with pytest.raises(ValueError, match="must lie"):
            metrics.chi2_bounds(**bad)


#: Quartiles of a chi-square value with two degrees of freedom: -2 ln(1 - share).
QUARTILES = (-2 * np.log(0.75), -2 * np.log(0.25))


def test_consistent_is_neither_too_small_nor_too_large():
    # The mean of 1000 lies within 2 +- 0.124, see above.
    for value, inside in ((0.5, False), (1.8, False), (1.9, True), (2.1, True), (2.2, False)):
        judged = metrics.nis_consistency(np.full((10, 100), value), 2)
        assert judged.mean == pytest.approx(value)
        assert judged.consistent is inside
    # The bounds themselves are inside.
    assert metrics.Consistency(mean=1.0, low=1.0, high=3.0, steps_inside=1.0).consistent
    assert metrics.Consistency(mean=3.0, low=1.0, high=3.0, steps_inside=1.0).consistent
    assert not metrics.Consistency(mean=np.nan, low=1.0, high=3.0, steps_inside=1.0).consistent


def test_the_nees_is_judged_at_the_last_step_and_the_nis_at_all():
    # Two runs of three steps; errors of one run hang together, innovations do not.
    values = np.array([[9.0, 5.0, 1.0], [7.0, np.nan, 2.0]])
    assert metrics.nees_consistency(values, 2).mean == 1.5
    assert metrics.nis_consistency(values, 2).mean == (9 + 5 + 1 + 7 + 2) / 5
    # The bounds are those of a mean over 2 and over 5.
    low_high = metrics.nees_consistency(values, 2)
    assert (low_high.low, low_high.high) == metrics.chi2_bounds(2, 2)
    low_high = metrics.nis_consistency(values, 2)
    assert (low_high.low, low_high.high) == metrics.chi2_bounds(2, 5)


@pytest.mark.parametrize("judge", [metrics.nis_consistency, metrics.nees_consistency])
def test_the_level_is_that_of_all_bounds(judge):
    # One run: the bounds of the mean and of each step are those of one value.
    steps = np.array([[0.5, 0.6, 2.7, 2.8, 1.0]])
    half = judge(steps[:, :1], 2, level=0.5)
    assert (half.low, half.high) == pytest.approx(QUARTILES)  # 0.575 and 2.773
    assert judge(steps, 2, level=0.5).steps_inside == 3 / 5
    most = judge(steps[:, :1], 2)
    assert (most.low, most.high) == pytest.approx((-2 * np.log(0.975), -2 * np.log(0.025)))
    assert judge(steps, 2).steps_inside == 1.0


def test_a_step_is_judged_by_the_runs_that_have_it():
    # Mean of two: 95 % between 0.242 and 5.57; of one: between 0.0506 and 7.38.
    values = np.array([[0.1, 6.0, 0.1, np.nan, np.nan], [0.1, 6.0, np.nan, 6.0, np.nan]])
    # 0.1 and 6 are too much for two runs, not for one; a step without a run does not count.
    assert metrics.nis_consistency(values, 2).steps_inside == 2 / 4


def test_consistency_refuses_what_is_no_table_of_runs():
    for judge, name in ((metrics.nis_consistency, "nis"), (metrics.nees_consistency, "nees")):
        with pytest.raises(ValueError, match=rf"{name} has shape \(3,\), expected \(runs, steps\)"):
            judge([1.0, 2.0, 3.0], 2)
        with pytest.raises(ValueError, match=f"{name} has no finite element"):
            judge([[np.nan, np.nan]], 2)
