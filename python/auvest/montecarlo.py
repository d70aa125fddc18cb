"""Monte Carlo on all cores: reproducible, resumable, with tidy results.

:func:`run` shares the runs of a task out to threads in chunks of fixed size. The result depends on
the task alone: not on the number of workers, nor on whether it was made at one go. With a ``store``
every finished chunk is a file; after a crash or an interruption the same call goes on where it
stood.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
import stat
import zipfile
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest._arguments import as_integer, as_workers, type_name
from auvest._outputs import UNFINISHED, new_file
from auvest.errors import Interrupted as Interrupted

Columns: TypeAlias = dict[str, npt.NDArray[Any]]
#: ``task(first, count)`` does the runs ``first .. first + count - 1``, without the GIL if it can.
#: All arrays have one row per run, or all the same number of rows.
Task: TypeAlias = Callable[[int, int], Mapping[str, npt.NDArray[Any]]]


#: Runs that the core takes side by side.
LANES = 16


def chunk_for(
    runs: int, rows: int, workers: int | None = None, *, side_by_side: bool = False
) -> int:
    """Choose the runs per chunk, where each run has so many rows.

    Small enough that progress is seen and that the last worker does not keep the others waiting;
    of runs that the core takes side by side, whole groups.
    """
    chunk = max(1, min(-(-runs // (4 * as_workers(workers))), 500_000 // rows))
    return -(-chunk // LANES) * LANES if side_by_side and chunk > 1 else chunk


def run(
    task: Task,
    runs: int,
    *,
    first: int = 0,
    chunk: int = 10,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    store: Path | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Columns:
    """Do all runs of a task.

    Parameters
    ----------
    task : callable
        ``task(first, count)`` returns a dict of arrays with the same number of rows. Run r must
        depend on r alone; its random numbers come from stream r of a seed.
    runs : int
        Number of runs, positive.
    first : int
        Number of the first of them: runs that are done in several calls are those of one call.
    chunk : int
        Runs per call of the task, positive.
    workers : int, optional
        Threads, 1 to 256; default: one per processor.
    progress : callable, optional
        Called as ``progress(runs_done, runs)`` in the calling thread.
    store : Path, optional
        Folder for the finished chunks; made if missing. What is there from a call with the same
        ``settings`` and ``chunk`` is taken over; the chunks of another experiment are removed. A
        folder that holds anything else is refused. Delete it with :func:`discard` when the results
        are safe.
    settings : mapping, optional
        What the results depend on, for JSON. Must be given with ``store``.

    Returns
    -------
    dict of ndarray
        The task's arrays, joined in the order of the runs.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or ``store`` holds what no call has written there.
    Interrupted
        After Ctrl-C; ``partial`` holds the columns of the chunks that are done, in the order of the
        runs. Functions that simulate by :func:`run` put what they return in its place.

    Examples
    --------
    >>> import numpy as np
    >>> def dice(first, count):
    ...     numbers = range(first, first + count)
    ...     eyes = [np.random.default_rng([1, number]).integers(1, 7) for number in numbers]
    ...     return {"run": np.array(numbers), "eyes": np.array(eyes)}
    >>> whole = run(dice, 20)
    >>> part = run(dice, 5, first=10)
    >>> bool((part["eyes"] == whole["eyes"][10:15]).all())
    True
    """
    total = as_integer("runs", runs, 1, 2**53)
    start = as_integer("first", first, 0, 2**53 - total)
    size = as_integer("chunk", chunk, 1, 2**53)
    threads = as_workers(workers)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, not {type_name(progress)}")
    if store is not None and settings is None:
        raise TypeError("settings must be given with a store: they say whose results it holds")

    kept = None if store is None else Store(store, {"chunk": size, "settings": settings})
    parts: dict[int, Columns] = {}
    done = 0

    def size_of(begin: int) -> int:
        return min(size, start + total - begin)

    def finish(begin: int, columns: Columns) -> None:
        nonlocal done
        parts[begin] = columns
        done += size_of(begin)
        if progress is not None:
            progress(done, total)

    def work(begin: int) -> Columns:
        columns = _checked(task(begin, size_of(begin)))
        if kept is not None:
            kept.write(begin, size_of(begin), columns)
        return columns

    with ThreadPoolExecutor(threads) as pool:
        try:
            todo = []
            for begin in range(start, start + total, size):
                old = None if kept is None else kept.read(begin, size_of(begin))
                if old is None:
                    todo.append(begin)
                else:
                    finish(begin, old)
            futures = {pool.submit(work, begin): begin for begin in todo}
            for future in as_completed(futures):
                finish(futures[future], future.result())
        except BaseException as stop:
            pool.shutdown(cancel_futures=True)
            if isinstance(stop, KeyboardInterrupt):
                raise Interrupted(join(parts) if parts else None) from None
            raise
    return join(parts)


def discard(store: Path) -> None:
    """Remove the chunks that :func:`run` keeps in this folder, and the folder if nothing is left.

    What :func:`run` has not written stays.
    """
    if store.is_symlink() or not _is_label(store / _LABEL):
        return
    there = [entry.name for entry in store.iterdir()]
    own = [name for name in there if _CHUNK.fullmatch(name) or _NEW_LABEL.fullmatch(name)]
    with contextlib.suppress(OSError):
        for name in own:
            (store / name).unlink()
        (store / _LABEL).unlink()  # last: until then the folder is known for what it is
        store.rmdir()


def write_table(path: Path, columns: Mapping[str, npt.NDArray[Any]]) -> Path:
    """Write the one-dimensional columns as a tidy table, one row per run.

    Parameters
    ----------
    path : Path
        Ends in ``.csv`` (all digits, NaN as nothing) or ``.parquet``. It is replaced as a whole, so
        it is never half written.
    columns : mapping of str to ndarray
        Those of more than one dimension are left out.

    Raises
    ------
    ValueError
        If the path ends otherwise.
    """
    tidy = {name: values for name, values in columns.items() if values.ndim == 1}
    if path.suffix == ".csv":
        with new_file(path, "w", encoding="utf-8", newline="") as file:
            file.write(",".join(tidy) + "\n")
            for row in zip(*(values.tolist() for values in tidy.values()), strict=True):
                file.write(",".join("" if cell != cell else str(cell) for cell in row) + "\n")
    elif path.suffix == ".parquet":
        import pyarrow  # here, because it is slow to import
        from pyarrow import parquet

        with new_file(path) as file:
            parquet.write_table(pyarrow.table(tidy), file)
    else:
        raise ValueError(f"the table must end in .csv or .parquet, not {path.name!r}")
    return path


def _checked(columns: Mapping[str, npt.NDArray[Any]]) -> Columns:
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    rows = {len(values) if values.ndim else -1 for values in arrays.values()}
    if len(rows) != 1 or -1 in rows:
        shapes = ", ".join(f"{name} {values.shape}" for name, values in arrays.items())
        raise ValueError(f"the task must return arrays with the same number of rows, not {shapes}")
    return arrays


def join(parts: Mapping[int, Mapping[str, npt.NDArray[Any]]]) -> Columns:
    """Join chunks in the order of the runs; ``parts`` has each by its first run."""
    ordered = [parts[first] for first in sorted(parts)]
    return {name: np.concatenate([part[name] for part in ordered]) for name in ordered[0]}


#: What a store holds: which experiment it is of, and chunks, some of them unfinished.
_LABEL = "experiment"
_CHUNK = re.compile(rf"\d+-\d+\.npz(\.\w+{re.escape(UNFINISHED)})?")
_NEW_LABEL = re.compile(rf"{_LABEL}\.\w+{re.escape(UNFINISHED)}")
_HASH = re.compile(r"[0-9a-f]{64}")


def _is_label(path: Path) -> bool:
    """Whether this is the file by which a store is known."""
    try:
        plain = stat.S_ISREG(path.lstat().st_mode)
        return plain and _HASH.fullmatch(path.read_text(encoding="utf-8")) is not None
    except (OSError, ValueError):
        return False


class Store:
    """Finished chunks of one experiment, a file each that is there as a whole or not at all.

    For runs that :func:`run` cannot do, because they talk to something; :func:`discard` removes it.

    Parameters
    ----------
    folder : Path
        As ``store`` of :func:`run`.
    identity : mapping
        What the results depend on, for JSON: the chunks of another experiment are removed.

    Raises
    ------
    ValueError
        If the folder holds what no run has written there.

    Attributes
    ----------
    folder : Path
        As given.
    """

    def __init__(self, folder: Path, identity: Mapping[str, Any]) -> None:
        text = json.dumps(identity, sort_keys=True, default=str)
        self.folder = folder
        name = hashlib.sha256(text.encode()).hexdigest()
        if folder.is_symlink():
            raise ValueError(f"store: {folder} is a link: name the folder itself")
        label = folder / _LABEL
        if _is_label(label) and label.read_text(encoding="utf-8") == name:
            return
        discard(folder)
        folder.mkdir(parents=True, exist_ok=True)
        foreign = sorted(
            entry.name for entry in folder.iterdir() if not _NEW_LABEL.fullmatch(entry.name)
        )
        if foreign:
            raise ValueError(
                f"store: {folder} holds what no run has written ({foreign[0]!r}): name another"
            )
        with new_file(label, "w", encoding="utf-8") as file:
            file.write(name)

    def _path(self, first: int, count: int) -> Path:
        return self.folder / f"{first}-{first + count - 1}.npz"

    def write(self, first: int, count: int, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Keep a chunk: the runs ``first .. first + count - 1``."""
        with new_file(self._path(first, count)) as file:
            np.savez(file, **columns)  # type: ignore[arg-type]

    def read(self, first: int, count: int) -> Columns | None:
        """Give a chunk; None if it is not there or damaged."""
        path = self._path(first, count)
        if path.is_symlink() or not path.is_file():
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                return {name: arrays[name] for name in arrays.files}
        except (ValueError, OSError, EOFError, zipfile.BadZipFile):
            return None  # damaged by what stopped the program: done again
