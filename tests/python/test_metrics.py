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
    with pytest.raises(ValueError, match=r"error has shape \(3, 2\) and P \(2, 2\)"):
        metrics.nees(error, p[0])


def test_chi2_bounds():
    # 95 % of one chi-square value with 2 degrees of freedom: -2 ln(0.975), -2 ln(0.025).
    assert metrics.chi2_bounds(2) == pytest.approx((-2 * np.log(0.975), -2 * np.log(0.025)))
    low, high = metrics.chi2_bounds(2, count=1000)
    # The mean of 1000 has a standard deviation of 2 / sqrt(1000).
    assert (low, high) == pytest.approx((2 - 1.96 * 0.0632, 2 + 1.96 * 0.0632), abs=0.004)
    for bad in ({"dof": 0}, {"dof": 2, "count": 0}, {"dof": 2, "level": 1.0}):
        with pytest.raises(ValueError, match="must lie"):
            metrics.chi2_bounds(**bad)
