"""What a figure keeps of a long table: one of every k rows, however they came."""

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


def test_one_of_each_two_rows_is_dropped_where_there_are_too_many(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(samples, "LIMIT", 4)
    table = Samples(("time_s", "x_m"))
    assert kept(table) == []
    table.add(rows(0, 8))
    assert kept(table) == list(range(8))  # up to twice the limit
    assert table.stride == 1
    table.add(rows(8, 10))
    assert table.stride == 2
    first = kept(table)
    assert [time // 2 for time in first] == [0, 1, 2, 3, 4]
    table.add(rows(10, 16))
    assert kept(table)[:5] == first
    assert [time // 2 for time in kept(table)] == list(range(8))
    table.add(rows(16, 16))
    table.add(rows(16, 20))
    assert table.stride == 4
    assert [time // 4 for time in kept(table)] == [0, 1, 2, 3, 4]
    assert set(kept(table)[:4]) < {*first, *range(10, 16)}


@pytest.mark.parametrize("size", [1, 3, 50, 1000])
def test_what_is_kept_does_not_depend_on_the_chunks(
    monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    """Of 1024 rows with a limit of 10 no more than 20 are kept: one of each 64, 16 rows."""
    monkeypatch.setattr(samples, "LIMIT", 10)
    table, whole = Samples(("time_s", "x_m")), Samples(("time_s", "x_m"))
    for first in range(0, 1024, size):
        table.add(rows(first, min(first + size, 1024)))
    whole.add(rows(0, 1024))
    assert kept(table) == kept(whole)
    assert [time // 64 for time in kept(table)] == list(range(16))


@pytest.mark.parametrize("turns", [2, 3, 4, 8])
def test_sources_that_take_turns_are_all_kept(turns: int) -> None:
    """Each has its share within five standard deviations of drawing by lot."""
    table = Samples(("time_s", "source"), limit=1000)
    number = np.arange(40_000)
    table.add({"time_s": number.astype(float), "source": number % turns})
    source = table.columns()["source"]
    counts = np.bincount(source, minlength=turns)
    expected = len(source) / turns
    assert np.abs(counts - expected).max() < 5 * np.sqrt(expected * (1 - 1 / turns))
