"""The Monte Carlo runner: reproducible, resumable, and honest about what it was given."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from processes import PATIENCE_S, start_program, wait_until

from auvest import montecarlo
from auvest._core import Random

Columns = dict[str, npt.NDArray[Any]]


def task(first: int, count: int) -> Columns:
    """Runs that know their number; the draws come from the stream of that number."""
    time.sleep(0.002 * (first % 3))  # chunks finish in another order than they start
    draws = np.array([Random(7, first + k).normal_float64(4) for k in range(count)])
    return {"run": np.arange(first, first + count), "value": draws[:, 0], "series": draws}


@pytest.mark.parametrize("name", ["table.csv", "table.parquet"])
def test_any_number_of_workers_gives_the_same_bytes(tmp_path: Path, name: str) -> None:
    files = []
    for workers in (1, 3):
        folder = tmp_path / str(workers)
        folder.mkdir()
        columns = montecarlo.run(task, 47, chunk=4, workers=workers)
        assert np.array_equal(columns["run"], np.arange(47))
        files.append(montecarlo.write_table(folder / name, columns).read_bytes())
    assert files[0] == files[1]
    assert len(files[0]) > 47 * 10


def test_the_chunk_does_not_matter_either() -> None:
    whole = montecarlo.run(task, 20, chunk=20)
    assert montecarlo.run(task, 20, chunk=3)["series"].tobytes() == whole["series"].tobytes()


@pytest.mark.parametrize(
    ("runs", "rows", "workers", "chunk"),
    [
        (100, 60, 5, 5),  # four chunks for each worker
        (101, 60, 5, 6),
        (3, 60, 5, 1),
        (10_000, 250_000, 5, 2),  # at most half a million rows in one
        (10_000, 500_001, 5, 1),  # but a run is never parted
    ],
)
def test_chunks_are_small_and_even(runs: int, rows: int, workers: int, chunk: int) -> None:
    assert montecarlo.chunk_for(runs, rows, workers) == chunk
    whole = 1 if chunk == 1 else montecarlo.LANES
    assert montecarlo.chunk_for(runs, rows, workers, side_by_side=True) == whole


def test_csv_keeps_all_digits(tmp_path: Path) -> None:
    columns = montecarlo.run(task, 9)
    columns["value"][4] = np.nan
    path = montecarlo.write_table(tmp_path / "t.csv", columns)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "run,value"  # a series is no column of a tidy table
    assert lines[5] == "4,"
    values = [float(line.split(",")[1] or "nan") for line in lines[1:]]
    assert np.array_equal(values, columns["value"], equal_nan=True)
    assert list(tmp_path.iterdir()) == [path]


def test_parquet_reads_back(tmp_path: Path) -> None:
    from pyarrow import parquet

    columns = montecarlo.run(task, 9)
    table = parquet.read_table(montecarlo.write_table(tmp_path / "t.parquet", columns))
    assert table.column_names == ["run", "value"]
    assert np.array_equal(table["value"].to_numpy(), columns["value"])


PROGRAM = """
import sys, time
from pathlib import Path
sys.path.insert(0, {tests!r})
import test_montecarlo as t
from auvest import montecarlo

def slow(first, count):
    if first >= {stop}:
        time.sleep(3600)  # until it is killed
    with open({log!r}, "a") as file:
        file.write(f"{{first}}\\n")
    return t.task(first, count)

columns = montecarlo.run(
    slow, 60, chunk=2, workers=2, store=Path({store!r}), settings={{"who": "slow"}}
)
montecarlo.write_table(Path({table!r}), columns)
"""


def test_a_killed_program_goes_on_where_it_stood(tmp_path: Path) -> None:
    log, store, table = (tmp_path / name for name in ("log", "store", "table.csv"))

    def command(stop: int) -> list[str]:
        program = PROGRAM.format(
            tests=str(Path(__file__).parent), log=str(log), store=str(store), table=str(table),
            stop=stop,
        )  # fmt: skip
        return [sys.executable, "-c", program]

    with start_program(command(stop=40)) as first:
        wait_until(lambda: len(list(store.glob("*.npz"))) >= 6, "six chunks are kept", first)
        first.kill()
    assert first.returncode == -signal.SIGKILL
    kept = len(list(store.glob("*.npz")))
    assert 6 <= kept <= 20  # it could not go on beyond
    assert not table.exists()
    before = len(log.read_text().splitlines())
    subprocess.run(command(stop=60), check=True, timeout=PATIENCE_S)
    again = len(log.read_text().splitlines()) - before
    assert again == 30 - kept
    unbroken = montecarlo.write_table(tmp_path / "unbroken.csv", montecarlo.run(task, 60))
    assert table.read_bytes() == unbroken.read_bytes()


def test_a_damaged_chunk_is_done_again(tmp_path: Path) -> None:
    store = tmp_path / "store"
    calls: list[int] = []

    def counted(first: int, count: int) -> Columns:
        calls.append(first)
        return task(first, count)

    options: dict[str, Any] = {"chunk": 5, "store": store, "settings": {"a": 1}}
    whole = montecarlo.run(counted, 20, **options)
    assert sorted(calls) == [0, 5, 10, 15]
    calls.clear()
    part = store / "5-9.npz"
    part.write_bytes(part.read_bytes()[:100])
    again = montecarlo.run(counted, 20, **options)
    assert calls == [5]
    assert again["series"].tobytes() == whole["series"].tobytes()
    calls.clear()
    montecarlo.run(counted, 30, **options)  # more of the same
    assert sorted(calls) == [20, 25]
    calls.clear()
    montecarlo.run(counted, 20, chunk=5, store=store, settings={"a": 2})  # another experiment
    assert sorted(calls) == [0, 5, 10, 15]
    montecarlo.discard(store)
    assert not store.exists()


def test_a_store_is_of_one_experiment_in_one_division(tmp_path: Path) -> None:
    store = tmp_path / "store"
    calls: list[int] = []

    def counted(first: int, count: int) -> Columns:
        calls.append(first)
        return task(first, count)

    def again(chunk: int, settings: dict[str, Any]) -> list[tuple[int, int]]:
        calls.clear()
        progress: list[tuple[int, int]] = []
        montecarlo.run(
            counted, 20, chunk=chunk, store=store, settings=settings,
            progress=lambda *both: progress.append(both),
        )  # fmt: skip
        return progress

    again(5, {"a": 1, "b": 2})
    assert sorted(calls) == [0, 5, 10, 15]
    # The order in which settings are named does not matter; what is kept counts as done.
    assert again(5, {"b": 2, "a": 1}) == [(5, 20), (10, 20), (15, 20), (20, 20)]
    assert calls == []
    # Other chunks are another division: nothing of the first is left to be mistaken for it.
    again(10, {"a": 1, "b": 2})
    assert sorted(calls) == [0, 10]
    assert sorted(path.name for path in store.iterdir()) == ["0-9.npz", "10-19.npz", "experiment"]


def test_a_table_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    path = montecarlo.write_table(tmp_path / "t.csv", {"a": np.arange(2)})
    before = path.read_bytes()
    with pytest.raises(ValueError, match="shorter"):
        montecarlo.write_table(path, {"a": np.arange(3), "b": np.arange(2)})
    assert path.read_bytes() == before == b"a\n0\n1\n"


def test_interrupt_keeps_what_is_done(tmp_path: Path) -> None:
    store = tmp_path / "store"

    def interrupt(done: int, total: int) -> None:
        assert total == 40
        if done >= 10:
            raise KeyboardInterrupt

    options: dict[str, Any] = {"chunk": 2, "workers": 2, "store": store, "settings": {}}
    with pytest.raises(montecarlo.Interrupted) as caught:
        montecarlo.run(task, 40, progress=interrupt, **options)
    partial = caught.value.partial
    assert 10 <= len(partial["run"]) < 40
    assert len(list(store.glob("*.npz"))) >= len(partial["run"]) // 2
    assert isinstance(caught.value, KeyboardInterrupt)
    whole = montecarlo.run(task, 40, **options)
    assert np.array_equal(whole["run"], np.arange(40))


def test_interrupt_before_the_first_result() -> None:
    def interrupted(*_: int) -> Columns:
        raise KeyboardInterrupt

    with pytest.raises(montecarlo.Interrupted) as caught:
        montecarlo.run(interrupted, 4)
    assert caught.value.partial is None


def test_progress_counts_runs() -> None:
    calls: list[tuple[int, int]] = []
    montecarlo.run(task, 11, chunk=4, progress=lambda *both: calls.append(both))
    assert calls[-1] == (11, 11)
    assert [total for _, total in calls] == [11, 11, 11]


def test_what_a_task_raises_comes_through() -> None:
    def broken(*_: int) -> Columns:
        raise OSError("disk on fire")

    with pytest.raises(OSError, match="disk on fire"):
        montecarlo.run(broken, 4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"runs": 0}, "runs must lie in 1"),
        ({"chunk": 0}, "chunk must lie in 1"),
        ({"workers": 0}, r"workers must lie in 1\.\.256"),
        ({"progress": 3}, "progress must be callable"),
        ({"store": Path("x")}, "settings must be given with a store"),
        ({"task": lambda _, c: {"a": np.zeros(c), "b": np.zeros(c + 1)}}, "same number of rows"),
        ({"task": lambda *_: {"a": np.float64(1)}}, r"same number of rows, not a \(\)"),
    ],
)
def test_bad_input(options: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        montecarlo.run(**{"task": task, "runs": 5, **options})


def test_bad_table(tmp_path: Path) -> None:
    columns = {"a": np.zeros(3)}
    with pytest.raises(ValueError, match=r"must end in \.csv or \.parquet, not 't\.xlsx'"):
        montecarlo.write_table(tmp_path / "t.xlsx", columns)


def test_a_store_removes_only_what_is_its_own(tmp_path: Path) -> None:
    store = tmp_path / "store"
    options: dict[str, Any] = {"chunk": 5, "store": store}
    montecarlo.run(task, 20, settings={"a": 1}, **options)
    (store / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"holds what no run has written \('notes.txt'\)"):
        montecarlo.run(task, 20, settings={"a": 2}, **options)
    montecarlo.discard(store)
    assert [path.name for path in store.iterdir()] == ["notes.txt"]
    with pytest.raises(ValueError, match=r"notes\.txt"):
        montecarlo.run(task, 20, settings={"a": 1}, **options)


def test_a_folder_that_is_no_store_is_refused(tmp_path: Path) -> None:
    """Whatever it is called, and chunks whose experiment nobody knows are no store either."""
    for name in ("experiment", "0-4.npz"):
        store = tmp_path / name.partition(".")[0]
        store.mkdir()
        (store / name).write_text("mine")
        with pytest.raises(ValueError, match="holds what no run has written"):
            montecarlo.run(task, 5, chunk=5, store=store, settings={})
        montecarlo.discard(store)
        assert (store / name).read_text() == "mine"


def test_no_link_in_a_store_is_followed(tmp_path: Path) -> None:
    victim = tmp_path / "victim.npz"
    options: dict[str, Any] = {"chunk": 5, "store": tmp_path / "store", "settings": {}}
    whole = montecarlo.run(task, 10, **options)
    (tmp_path / "store" / "0-4.npz").unlink()
    np.savez(victim, **{name: 0 * column[:5] for name, column in whole.items()})  # type: ignore[arg-type]
    precious = victim.read_bytes()
    (tmp_path / "store" / "0-4.npz").symlink_to(victim)
    again = montecarlo.run(task, 10, **options)
    assert again["value"].tobytes() == whole["value"].tobytes()
    assert victim.read_bytes() == precious
    (tmp_path / "link").symlink_to(tmp_path / "store")
    with pytest.raises(ValueError, match="is a link"):
        montecarlo.run(task, 10, **{**options, "store": tmp_path / "link"})
