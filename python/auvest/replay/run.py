"""One replay from a log folder to result files."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auvest._interrupts import HeldInterrupts
from auvest.logs import LogFolder
from auvest.replay import tables
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import Localiser, Replay, Tracker
from auvest.replay.samples import Samples
from auvest.replay.tally import Tally

#: ``progress(done, total)`` in bytes of the log.
ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True)
class Result:
    """What a replay gave.

    Attributes
    ----------
    name : str
        Name of the log's folder.
    filter_name : str
        The filter.
    numbers : dict
        The figures of the run, see :class:`auvest.replay.tally.Tally`, and ``late``.
    estimates, measurements, errors, outliers : Samples
        At most a few thousand rows of each table, for figures; ``outliers`` are measurements with
        less than full weight.
    sources : ndarray, shape (K, 2)
        Positions of the beacons, m.
    interrupted : bool
        True if the run was stopped; all else is then what was done until then.
    """

    name: str
    filter_name: FilterName
    settings: Settings
    numbers: dict[str, Any]
    estimates: Samples
    measurements: Samples
    errors: Samples
    outliers: Samples
    sources: np.ndarray[Any, np.dtype[np.float64]]
    interrupted: bool

    def document(self) -> dict[str, Any]:
        """Everything a machine wants to know."""
        return {
            "log": self.name,
            "filter": self.filter_name,
            "interrupted": self.interrupted,
            **self.numbers,
            "settings": asdict(self.settings),
        }


def replay(
    log: LogFolder,
    settings: Settings,
    *,
    filter_name: FilterName | None = None,
    folder: Path | None = None,
    progress: ProgressCallback | None = None,
) -> Result:
    """Replay a log.

    Parameters
    ----------
    log : LogFolder
        The log.
    settings : Settings
        Filter, noise and the rest.
    filter_name : str, optional
        The filter; default: that of the settings, else robust-ekf for ranges and ukf for fixes.
    folder : Path, optional
        Where the tables go: estimates, measurements and errors as CSV and Parquet, trajectory.tum.
        Nothing is written without it.
    progress : callable, optional
        Called with the bytes of the log that are read, and all.

    Returns
    -------
    Result
        With ``interrupted`` true if the user pressed Ctrl-C: the files then hold what was done.

    Raises
    ------
    ValueError
        If the log, the settings or the filter do not fit (:class:`auvest.logs.LogError` with file
        and line), or :class:`auvest.FilterError` if the filter cannot do a step.
    OSError
        If a file cannot be written.
    """
    name: FilterName = filter_name or settings.filter.kind or (
        "ukf" if log.tracking else "robust-ekf"
    )  # fmt: skip
    engine: Replay = (Tracker if log.tracking else Localiser)(log, settings, name)
    tally = Tally()
    estimates, errors = Samples(tables.ESTIMATES), Samples(tables.ERRORS)
    measurements, outliers = Samples(tables.MEASUREMENTS), Samples(tables.MEASUREMENTS)
    interrupted = False
    with ExitStack() as stack:
        files = _open(folder, stack)
        try:
            held = stack.enter_context(HeldInterrupts())
            for batch in engine.batches():
                with held:  # so that all tables and figures are of the same rows
                    tally.add(batch)
                    for write in files:
                        write(batch)
                    estimates.add(batch.estimates)
                    errors.add(batch.errors)
                    measurements.add(batch.measurements)
                    outliers.add(_outliers(batch.measurements))
                if progress is not None:
                    progress(engine.bytes_read, engine.bytes)
        except KeyboardInterrupt:
            interrupted = True
    numbers = tally.numbers()
    numbers["late"] = {name: asdict(stream.late) for name, stream in engine.streams.items()}
    return Result(
        name=log.path.resolve().name,
        filter_name=name,
        settings=settings,
        numbers=numbers,
        estimates=estimates,
        measurements=measurements,
        errors=errors,
        outliers=outliers,
        sources=np.array(list(log.beacons().values())).reshape(-1, 2),
        interrupted=interrupted,
    )


def _open(folder: Path | None, stack: ExitStack) -> list[Callable[[tables.Batch], None]]:
    if folder is None:
        return []
    from auvest.replay.sink import TableFiles, TumFile  # here, because pyarrow takes long to import

    tum = stack.enter_context(TumFile(folder / "trajectory.tum"))
    parts = {
        name: stack.enter_context(TableFiles(folder, name))
        for name in ("estimates", "measurements", "errors")
    }

    def write(batch: tables.Batch) -> None:
        for name, part in parts.items():
            part.write(getattr(batch, name))
        tum.write(batch.estimates)

    return [write]


def _outliers(measurements: tables.Columns) -> tables.Columns:
    doubted = np.isin(measurements["outcome"], (tables.DOWNWEIGHTED, tables.REJECTED))
    return {name: values[doubted] for name, values in measurements.items()}
