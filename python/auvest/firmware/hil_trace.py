"""The bits that a target has answered, as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pa_parquet

from auvest.firmware.hil import AnyRecord
from auvest.firmware.hil_record import Record, Words


def write_trace(
    path: Path,
    record: AnyRecord,
    words: Words,
    microseconds: npt.NDArray[np.uint32] | None,
) -> None:
    """Write a row for the start and for each row: time, what the status holds, and all floats.

    Parameters
    ----------
    path : Path
        The Parquet file.
    record : Record or SlatRecord
        What was played.
    words : ndarray of uint32, shape (T + 1, fields)
        What came back.
    microseconds : ndarray, shape (T + 1,), or None
        Time of each step on the target.
    """
    dt = np.concatenate([[0.0], record.dt.astype(float)])
    said = words[:, 0]
    columns: dict[str, npt.NDArray[np.generic]] = {
        "row": np.arange(len(words)),
        "time_s": np.cumsum(dt),
        "dt_s": dt,
        "status": (said & 0xFF).astype(np.uint8),
    }
    if isinstance(record, Record):
        columns["decision"] = (said >> 8 & 0xFF).astype(np.uint8)
        columns["near_field"] = (said >> 16 & 0xFF).astype(bool)
        columns["recovered"] = (said >> 24 & 0xFF).astype(bool)
    for name, column in zip(record.fields[1:], words.T[1:], strict=True):
        columns[name] = np.ascontiguousarray(column).view(np.float32)
    if microseconds is not None:
        columns["microseconds"] = microseconds
    with path.open("wb") as file:  # Arrow takes no name that is not UTF-8, but any file
        pa_parquet.write_table(pa.table(columns), file)
