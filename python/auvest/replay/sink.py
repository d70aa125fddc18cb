"""Writing the tables of a replay as they come: Parquet and CSV, and the track as TUM text."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from auvest.replay.tables import Columns

if TYPE_CHECKING:
    from typing_extensions import Self


def _table(columns: Columns) -> pa.Table:
    """Make a table of the columns' own memory; ``pa.array`` would import pandas, for seconds."""
    return pa.table({name: _array(np.ascontiguousarray(one)) for name, one in columns.items()})


def _array(values: npt.NDArray[Any]) -> pa.Array:
    if values.dtype.kind == "U":  # words in ASCII, padded with zeros
        letters = values.view(np.uint32).reshape(len(values), values.itemsize // 4)
        letters = letters.astype(np.uint8)
        there = letters != 0
        ends = np.cumsum(there.sum(axis=1), dtype=np.int32)
        offsets = np.concatenate([np.zeros(1, np.int32), ends])
        buffers = [pa.py_buffer(offsets), pa.py_buffer(letters[there])]
        return pa.StringArray.from_buffers(len(values), *buffers)
    kind = pa.from_numpy_dtype(values.dtype)
    packed = np.packbits(values, bitorder="little") if values.dtype.kind == "b" else values
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(packed)])


class _Sink:
    """Closes its writers at the end of a ``with``; they are opened by the first batch."""

    def __init__(self) -> None:
        self._writers: list[Any] = []
        self._files: list[BinaryIO] = []

    def _open(self, path: Path) -> BinaryIO:
        # Arrow takes no name that is not UTF-8, but any file.
        self._files.append(path.open("wb"))
        return self._files[-1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for writer in (*self._writers, *self._files):
            writer.close()


def _parquet(file: BinaryIO, schema: pa.Schema) -> Any:
    """Look for repeated values among words alone: among numbers that takes half of the time."""
    words = [one.name for one in schema if pa.types.is_string(one.type)]
    return pa_parquet.ParquetWriter(file, schema, use_dictionary=words)


_WRITERS: dict[str, Any] = {"csv": pa_csv.CSVWriter, "parquet": _parquet}


class TableFiles(_Sink):
    """``<stem>.parquet`` or ``<stem>.csv`` in a folder, or both, written a batch at a time.

    The Parquet file is readable after a clean end or an interruption, once it is closed.

    Parameters
    ----------
    folder : Path
        The folder.
    stem : str
        Name of the files.
    formats : iterable of {"parquet", "csv"}
        Which of them.
    """

    def __init__(self, folder: Path, stem: str, formats: Iterable[str]) -> None:
        super().__init__()
        self.paths = {one: folder / f"{stem}.{one}" for one in formats}

    def write(self, columns: Columns) -> None:
        """Append rows; the first batch fixes names and types."""
        table = _table(columns)
        if not self._writers:
            self._writers = [
                _WRITERS[one](self._open(path), table.schema) for one, path in self.paths.items()
            ]
        for writer in self._writers if len(table) else ():
            writer.write_table(table)


class TumFile(_Sink):
    """A trajectory as TUM text, ``time x y z qx qy qz qw`` per line, for tools such as evo.

    ``prefix``: before the names of the columns that it is of.
    """

    def __init__(self, path: Path, prefix: str = "") -> None:
        super().__init__()
        self.path = path
        self._prefix = prefix

    def write(self, estimates: Columns) -> None:
        """Append the poses of a table of estimates."""
        heading = estimates[f"{self._prefix}heading_rad"]
        zero = np.zeros(len(heading))
        table = _table(
            {
                "time": estimates["time_s"],
                "x": estimates[f"{self._prefix}x_m"],
                "y": estimates[f"{self._prefix}y_m"],
                "z": zero,
                "qx": zero,
                "qy": zero,
                "qz": np.sin(0.5 * heading),
                "qw": np.cos(0.5 * heading),
            }
        )
        if not self._writers:
            options = pa_csv.WriteOptions(include_header=False, delimiter=" ")
            file = self._open(self.path)
            self._writers = [pa_csv.CSVWriter(file, table.schema, write_options=options)]
        if len(table):
            self._writers[0].write_table(table)
