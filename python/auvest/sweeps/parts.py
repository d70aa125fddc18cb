"""The folder of a sweep: finished tasks, each a Parquet file that is there as a whole or not."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from auvest._outputs import new_file
from auvest.montecarlo import Columns
from auvest.sweeps.plan import Task

#: Where a part says what it holds.
_LABEL = b"auvest"


class Parts:
    """Finished tasks of any number of sweeps.

    Any number of processes, on any number of machines, may write to one folder; the files of
    several folders may be put into one. Its files are a Parquet data set, one row per run, with
    the parameters beside what was measured.

    Parameters
    ----------
    folder : Path
        Made if missing.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def write(self, task: Task, columns: Columns) -> None:
        """Keep the rows of a task."""
        import pyarrow as pa  # here, because it is slow to import, and workers do without
        from pyarrow import parquet

        rows = next(iter(columns.values())).shape[0]
        said = {name: _cell(value) for name, value in task.parameters.items()}
        table = pa.table(
            {
                **{name: pa.array([value] * rows) for name, value in said.items()},
                "run": pa.array(np.arange(task.first, task.first + rows)),
                **{name: pa.array(values) for name, values in columns.items()},
            }
        )
        label = {"key": task.key, "scenario": task.scenario, "parameters": task.parameters,
                 "seed": task.seed, "first": task.first, "columns": list(columns)}  # fmt: skip
        table = table.replace_schema_metadata({_LABEL: json.dumps(label, default=str)})
        # Hidden while it is written: what reads data sets passes over names with a dot.
        with new_file(self._path(task), hidden=True) as file:
            parquet.write_table(table, file)

    def read(self, task: Task) -> Columns | None:
        """Give the rows of a task; None if they are not there, or damaged."""
        path = self._path(task)
        if not path.is_file():
            return None
        import pyarrow as pa  # as in write
        from pyarrow import parquet

        try:
            table = parquet.read_table(path, partitioning=None)
            label = json.loads((table.schema.metadata or {}).get(_LABEL, b"{}"))
        except (OSError, ValueError, pa.ArrowException):
            return None  # a power cut: done again
        if label.get("key") != task.key or table.num_rows != task.count:
            return None
        return {name: table[name].to_numpy() for name in label["columns"]}

    def _path(self, task: Task) -> Path:
        return self.folder / f"{task.key}.parquet"


def _cell(value: Any) -> bool | float | str:
    """Give a parameter as a cell whose type is the same in all parts."""
    if isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, float)):
        return float(value)
    return json.dumps(value if isinstance(value, (list, Mapping)) else list(value))
