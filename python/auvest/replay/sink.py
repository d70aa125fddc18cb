"""Writing the tables of a replay as they come: CSV and Parquet, and the track as TUM text."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from auvest.replay.tables import Columns


class TableFiles:
    """``<stem>.csv`` and ``<stem>.parquet`` in a folder, written a batch at a time.

    The Parquet file is readable after a clean end or an interruption, once it is closed.
    """

    def __init__(self, folder: Path, stem: str) -> None:
        self.paths = (folder / f"{stem}.csv", folder / f"{stem}.parquet")
        self._csv: Any = None
        self._parquet: Any = None

    def write(self, columns: Columns) -> None:
        """Append rows; the first batch fixes names and types."""
        table = pa.table(dict(columns))
        if self._csv is None:
            self._csv = pa_csv.CSVWriter(self.paths[0], table.schema)
            self._parquet = pa_parquet.ParquetWriter(self.paths[1], table.schema)
        if len(table):
            self._csv.write_table(table)
            self._parquet.write_table(table)

    def __enter__(self) -> TableFiles:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._csv is not None:
            self._csv.close()
            self._parquet.close()


class TumFile:
    """A trajectory as TUM text, ``time x y z qx qy qz qw`` per line, for tools such as evo."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._writer: Any = None

    def write(self, estimates: Columns) -> None:
        """Append the poses of a table of estimates."""
        heading = estimates["heading_rad"]
        zero = np.zeros(len(heading))
        table = pa.table(
            {
                "time": estimates["time_s"],
                "x": estimates["x_m"],
                "y": estimates["y_m"],
                "z": zero,
                "qx": zero,
                "qy": zero,
                "qz": np.sin(0.5 * heading),
                "qw": np.cos(0.5 * heading),
            }
        )
        if self._writer is None:
            options = pa_csv.WriteOptions(include_header=False, delimiter=" ")
            self._writer = pa_csv.CSVWriter(self.path, table.schema, write_options=options)
        if len(table):
            self._writer.write_table(table)

    def __enter__(self) -> TumFile:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._writer is not None:
            self._writer.close()
