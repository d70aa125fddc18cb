"""One replay from a log folder to result files."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auvest._interrupts import HeldInterrupts
from auvest.logs import LogFolder
from auvest.logs.findings import Finding
from auvest.logs.origin import local_origin, shifted
from auvest.replay import checks, tables
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import Localiser, Replay, replay_of
from auvest.replay.health import Health, Residuals, health
from auvest.replay.samples import Samples
from auvest.replay.shown import Shown
from auvest.replay.smoothing import Smoothing
from auvest.replay.tally import Tally
from auvest.replay.thinning import Spacing

#: ``progress(done, total)`` in bytes of the log.
ProgressCallback = Callable[[int, int], None]

#: What a replay can write beside results.json: pages, tables, and tracks as TUM text.
PAGES = ("report", "figure")
TABLES = ("estimates", "measurements", "errors", "masters")
WRITTEN = (*PAGES, *TABLES, "tracks")
#: How tables are written.
FORMATS = ("parquet", "csv")


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
        The figures of the run, see :class:`auvest.replay.tally.Tally`, and ``late``; of a filter
        with several components ``convergence``, at the end, ``settled_s``, when first, and
        ``settled_rmse_m``, from then on; of a ranging log ``constants``, each as
        :class:`auvest.replay.constants.Found` has it, in a list; of one that was smoothed
        ``smoothed``, with ``lag_s``, ``rmse_m``, ``max_error_m`` and ``inside_3_sigma`` of that
        track.
    estimates, measurements, errors, outliers : Samples
        At most some ten thousand rows of each table, for figures; ``outliers`` are measurements
        with less than full weight. Measurements have the columns ``tables.SHOWN``, too.
    sources : ndarray, shape (K, 2)
        Positions of the beacons, m.
    source_numbers : tuple of int
        Their numbers in the log.
    health : Health
        Whether it is to be trusted, and why.
    findings : list of Finding
        What is wrong with the log, as ``auvest check`` says it.
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
    source_numbers: tuple[int, ...]
    health: Health
    findings: list[Finding]
    interrupted: bool

    def document(self) -> dict[str, Any]:
        """Everything a machine wants to know."""
        return {
            "log": self.name,
            "filter": self.filter_name,
            "interrupted": self.interrupted,
            **self.numbers,
            "health": self.health.document(),
            "findings": [one.document() for one in self.findings],
            "settings": asdict(self.settings),
        }


def replay(
    log: LogFolder,
    settings: Settings,
    *,
    filter_name: FilterName | None = None,
    folder: Path | None = None,
    progress: ProgressCallback | None = None,
    causes: bool = True,
    smooth: bool = False,
    lag_s: float | None = None,
    write: Collection[str] = WRITTEN,
    formats: Collection[str] = FORMATS[:1],
    every_s: float = 0.0,
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
        Where tables and tracks go: estimates, measurements, errors and, of masters, masters;
        trajectory.tum and truth.tum. Nothing is written without it.
    progress : callable, optional
        Called with the bytes of the log that are read, and all.
    causes : bool
        Whether to look for the cause of what does not fit, which takes some dozens of replays.
    smooth : bool
        Whether to go back over it from the end: the tables then have columns ``smoothed_*`` and the
        track ``smoothed.tum``.
    lag_s : float, optional
        With ``smooth``: each estimate knows what came within this time after it, s; default: all.
    write : collection of str
        Which of :data:`WRITTEN`; default: all. Without "report" and "figure", which others make of
        the result, it has no rows for them.
    formats : collection of {"parquet", "csv"}
        How tables are written.
    every_s : float
        Of estimates, errors, masters and tracks one row in so many seconds is written; 0: all.

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
    if lag_s is not None and not smooth:
        raise ValueError("lag_s is for smooth=True")
    if lag_s is not None and not 0 <= lag_s < math.inf:
        raise ValueError(f"lag_s must be finite and not negative, not {lag_s}")
    for kind, given, known in (("write", write, WRITTEN), ("formats", formats, FORMATS)):
        for one in given:
            if one not in known:
                raise ValueError(f"{kind}: {one!r} is not one of {', '.join(known)}")
    if not 0 <= every_s < math.inf:
        raise ValueError(f"every_s must be finite and not negative, not {every_s}")
    name = checks.filter_of(log, settings, filter_name)
    origin = local_origin(log)
    local = shifted(log, origin)
    engine = replay_of(local, settings, name)
    tally, residuals = Tally(), Residuals()
    found: list[Finding] = []
    estimates = Samples(tables.ESTIMATES + (tables.SMOOTHED if smooth else ()))
    errors = Samples(tables.ERRORS + (tables.SMOOTHED_ERRORS if smooth else ()))
    columns = tables.MEASUREMENTS + tables.SHOWN
    measurements, outliers, shown = Samples(columns), Samples(columns), Shown()
    drawn = bool({*PAGES} & {*write})
    interrupted = False
    if smooth and log.echoing:
        raise ValueError(f"a replay of echoes cannot be smoothed: filter {name} has no way back")
    with ExitStack() as stack:
        files = _open(folder, stack, smooth, write, formats, every_s)
        if smooth:
            engine.smoothing = stack.enter_context(Smoothing(folder, lag_s))
        held = stack.enter_context(HeldInterrupts())

        def take(batches: Iterator[tables.Batch]) -> None:
            for batch in batches:
                if origin is not None:
                    batch = tables.moved(batch, origin)
                with held:  # so that all tables and figures are of the same rows
                    residuals.add(batch)
                    tally.add(batch)
                    for put in files:
                        put(batch)
                    if drawn:
                        estimates.add(batch.estimates)
                        errors.add(batch.errors)
                        measured = shown.of(batch)
                        measurements.add(measured)
                        outliers.add(_outliers(measured))
                if progress is not None:
                    progress(engine.bytes_read, engine.bytes)

        try:
            found += checks.files(log, settings)
            if engine.smoothing is None:
                take(engine.batches())
            else:
                interrupted = _go_forward(engine, engine.smoothing, held, progress)
                take(engine.smoothing.batches())
            found += engine.findings()
            if folder is not None and "tracks" in write and "truth.csv" in log:
                _write_truth(log, folder, stack)
            if not interrupted:
                found += checks.innovations(local, settings, name, residuals, found, causes=causes)
        except KeyboardInterrupt:
            interrupted = True
    numbers = tally.numbers()
    if smooth:
        numbers["smoothed"] = {"lag_s": lag_s, **tally.smoothed()}
    if log.echoing:
        numbers["masters"] = tally.masters()
    if isinstance(engine, Localiser):
        numbers["constants"] = [one.document() for one in engine.constants]
    numbers["started_from"] = engine.started_from or None
    numbers["origin_m"] = None if origin is None else list(origin)
    earth = log.frame.origin
    numbers["origin_deg"] = None if earth is None else list(earth)
    if residuals.convergence:
        settled_s = residuals.settled_s
        numbers["convergence"] = residuals.convergence
        numbers["settled_s"] = settled_s if math.isfinite(settled_s) else None
        numbers["settled_rmse_m"] = tally.settled_rmse_m()
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
        source_numbers=tuple(log.beacons()),
        health=health(residuals, found),
        findings=found,
        interrupted=interrupted,
    )


def _go_forward(
    engine: Replay, smoothing: Smoothing, held: HeldInterrupts, progress: ProgressCallback | None
) -> bool:
    """Take the filter through the log; say whether Ctrl-C has ended it, with a whole batch."""
    try:
        for batch in engine.batches():
            with held:
                smoothing.add(batch)
            if progress is not None:
                progress(engine.bytes_read, engine.bytes)
    except KeyboardInterrupt:
        smoothing.drop()
        return True
    return False


def _open(
    folder: Path | None,
    stack: ExitStack,
    smooth: bool,
    write: Collection[str],
    formats: Collection[str],
    every_s: float,
) -> list[Callable[[tables.Batch], None]]:
    """Open what is written of each batch."""
    if folder is None:
        return []
    from auvest.replay.sink import TableFiles, TumFile  # here, because pyarrow takes long to import

    made: list[Callable[[tables.Batch], None]] = []

    def table(name: str) -> None:
        file = stack.enter_context(TableFiles(folder, name, formats))
        spacing = Spacing(0.0 if name == "measurements" else every_s)

        def put(batch: tables.Batch) -> None:
            rows = getattr(batch, name)
            if rows is not None:
                file.write(spacing.kept(rows))

        made.append(put)

    def track(name: str, prefix: str) -> None:
        file = stack.enter_context(TumFile(folder / name, prefix))
        spacing = Spacing(every_s)
        made.append(lambda batch: file.write(spacing.kept(batch.estimates)))

    for name in TABLES:
        if name in write:
            table(name)
    if "tracks" in write:
        track("trajectory.tum", "")
        if smooth:
            track("smoothed.tum", "smoothed_")
    return made


def _write_truth(log: LogFolder, folder: Path, stack: ExitStack) -> None:
    """Write the truth beside the track, in the same form."""
    from auvest.replay.sink import TumFile  # here, because pyarrow takes long to import

    tum = stack.enter_context(TumFile(folder / "truth.tum"))
    table = log["truth.csv"]
    for rows, _ in table.chunks():
        columns = {name: table.column(rows, name, 0.0) for name in ("time_s", "x_m", "y_m")}
        tum.write({**columns, "heading_rad": table.column(rows, "heading_rad", 0.0)})


def _outliers(measurements: tables.Columns) -> tables.Columns:
    doubted = np.isin(measurements["outcome"], (tables.DOWNWEIGHTED, tables.REJECTED))
    return {name: values[doubted] for name, values in measurements.items()}
