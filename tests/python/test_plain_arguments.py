"""Rows that lie otherwise in memory are the same numbers, in every filter."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import auvest


def scattered(row):
    """Return the numbers with others between them."""
    return np.column_stack([row, np.full(len(row), 7.0)])[:, 0]


def backwards(row):
    return np.array(row)[::-1].copy()[::-1]


def unaligned(row):
    view = np.zeros(8 * len(row) + 1, np.uint8)[1:].view(np.float64)
    view[:] = row
    assert not view.flags.aligned
    return view


FILTERS = {
    "Ukf": lambda: auvest.Ukf(
        [30.0, 22, 0.1, 0.2, 0, 0],
        np.eye(6),
        process=auvest.ConstantAcceleration(),
        sensors=auvest.RangeBearing(),
    ),
    "EkfSlat": lambda: auvest.EkfSlat([0.0, 0], np.eye(2)),
}


@pytest.mark.parametrize("layout", [scattered, backwards, unaligned])
@pytest.mark.parametrize("name", FILTERS)
def test_a_row_is_its_numbers(name, layout):
    a = FILTERS[name]()
    if name == "EkfSlat":
        a.add_master([300.0, 0, 0, 0, 0, 0], np.eye(6))
    b = copy.deepcopy(a)
    row = [36.0, 0.6] if name == "Ukf" else [299.0, -3.1]
    a.update(row)
    b.update(layout(row))
    assert a.x.tobytes() == b.x.tobytes()
    assert not np.array_equal(a.x, FILTERS[name]().x)
