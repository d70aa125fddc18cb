"""The tables that ``auvest replay`` has written, row by row in the order of time."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

Table: TypeAlias = Literal["estimates", "measurements"]
#: Rows read at once.
_ROWS = 8192


@dataclass(frozen=True)
class Row:
    """One row: its time in ns, which table it is of, and its numbers; None where there is none."""

    time_ns: int
    table: Table
    values: dict[str, Any]


class ReplayResults:
    """Results of one log.

    Parameters
    ----------
    folder : Path
        That of the log, below the ``--output`` of a replay.
    epoch_s : float
        Added to the times, if those of the log do not count from 1970.
    origin : tuple of float, optional
        Latitude and longitude (deg) of the log's (0, 0); x is then east and y north.

    Raises
    ------
    ValueError
        If the folder does not hold the tables of a replay.
    """

    def __init__(
        self, folder: Path, *, epoch_s: float = 0.0, origin: tuple[float, float] | None = None
    ) -> None:
        self.folder = folder
        self.origin = origin
        self._epoch_ns = round(epoch_s * 1e9)
        for name in ("estimates", "measurements"):
            if not (folder / f"{name}.parquet").is_file():
                raise ValueError(f"{folder} has no {name}.parquet: is it the result of a replay?")

    def rows(self) -> Iterator[Row]:
        """Give the rows of both tables in the order of time; estimates first.

        Raises
        ------
        ValueError
            If a time cannot be exported, or a table cannot be read.
        """
        estimates, measurements = (self._rows(name) for name in ("estimates", "measurements"))
        return heapq.merge(estimates, measurements, key=lambda row: row.time_ns)

    def _rows(self, name: Table) -> Iterator[Row]:
        import pyarrow as pa  # here, because it takes long to import
        import pyarrow.parquet as parquet

        path = self.folder / f"{name}.parquet"
        try:
            with parquet.ParquetFile(path) as file:
                for batch in file.iter_batches(batch_size=_ROWS):
                    for values in batch.to_pylist():
                        time_ns = round(values["time_s"] * 1e9) + self._epoch_ns
                        if not 0 <= time_ns < 2**31 * 10**9:
                            raise ValueError(
                                f"{path}: a time of {values['time_s']} s is none that can be "
                                "exported; --epoch adds seconds to all"
                            )
                        yield Row(time_ns, name, {key: _none(one) for key, one in values.items()})
        except (pa.ArrowException, OSError, KeyError) as error:
            raise ValueError(f"{path} cannot be read: {error}") from None


def _none(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
