"""What a figure keeps of a long table: every k-th row of all, however they came."""

from __future__ import annotations

import numpy as np
import pytest

from auvest.replay import samples
from auvest.replay.samples import Samples


def rows(first: int, last: int) -> dict[str, np.ndarray]:
    time_s = np.arange(first, last, dtype=float)
    return {"time_s": time_s, "x_m": -time_s, "y_m": 0 * time_s}


def kept(table: Samples) -> list[float]:
    columns = table.columns()
    assert set(columns) == {"time_s", "x_m"}
    assert np.array_equal(columns["x_m"], -columns["time_s"])
    times: list[float] = columns["time_s"].tolist()
    return times


def test_every_second_row_is_dropped_where_there_are_too_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(samples, "LIMIT", 4)
    table = Samples(("time_s", "x_m"))
    assert kept(table) == []
    table.add(rows(0, 8))
    assert kept(table) == list(range(8))  # up to twice the limit
    table.add(rows(8, 9))
    assert kept(table) == [0, 2, 4, 6, 8]
    table.add(rows(9, 16))
    assert kept(table) == list(range(0, 16, 2))
    table.add(rows(16, 16))
    table.add(rows(16, 18))
    assert kept(table) == [0, 4, 8, 12, 16]


@pytest.mark.parametrize("size", [1, 3, 50, 1000])
def test_what_is_kept_does_not_depend_on_the_chunks(
    monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    """Of 1000 rows with a limit of 10 no more than 20 are kept: every 64th, 16 rows."""
    monkeypatch.setattr(samples, "LIMIT", 10)
    table = Samples(("time_s", "x_m"))
    for first in range(0, 1000, size):
        table.add(rows(first, min(first + size, 1000)))
    assert kept(table) == list(range(0, 1000, 64))
