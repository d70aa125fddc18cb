"""Real recordings through the filters: ``auvest reproduce logs``.

Each set is imported and replayed with the settings of its file in ``auvest/replay/configs``; the
robust filter has the same kernel with the same thresholds in all of them. The targets are those of
the project, the reference figures those measured once with plain independent filters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import Settings, find_settings, replay
from auvest.replay.config import FilterName, KernelName
from auvest.replay.engine import Localiser
from auvest.reproduce.ticks import Ticks

KERNELS: tuple[KernelName, ...] = ("hampel", "huber", "igg")
#: The kernel of every set's settings.
KERNEL: KernelName = "hampel"


@dataclass(frozen=True)
class Target:
    """What the robust filter is to reach on a set, and what an independent plain EKF reached."""

    rmse_m: float
    reference_ekf_m: float


TARGETS: Mapping[str, Target] = {
    "goats14": Target(1.10, 13.75),
    "hat_charles": Target(4.0, 3.79),
    "mrclam6": Target(0.43, 0.575),
    "labyrinth_uwb": Target(0.15, 0.15),
}
#: Fixes every so many seconds, and the largest RMSE of the predictions between them on log 1, m.
TRACKING_TARGETS: Mapping[float, float] = {2.0: 0.36, 5.0: 0.66, 10.0: 1.3}
TRACKING_SET = "ugps_pier59"
#: Heading walk (rad/sqrt(s)) that the set's own baseline takes for mrclam6.
BASELINE_WALK = 0.06
#: Start heading (rad) and wander (rad/sqrt(s)) of hat_charles around the chosen ones.
COMPASS_RAD = (0.2, 0.3, 0.5)
COMPASS_WALK = (0.005, 0.01, 0.02)


@dataclass(frozen=True)
class Row:
    """One filter on one set: means over its logs.

    Attributes
    ----------
    set_name, filter_name, kernel : str
        ``kernel`` is "" for filters that have none.
    rmse_m, dead_reckoned_rmse_m : float
        Position, against the set's truth.
    rejected, downweighted : int
        Ranges, of all logs.
    logs : int
        How many logs the means are over.
    """

    set_name: str
    filter_name: FilterName
    kernel: str
    rmse_m: float
    dead_reckoned_rmse_m: float
    rejected: int
    downweighted: int
    logs: int


@dataclass(frozen=True)
class TrackingRow:
    """One tracker on one log of ugps_pier59: RMSE of predicting the fixes it did not get."""

    log: str
    every_s: float
    filter_name: FilterName
    near_field: float
    held_out_rmse_m: float


@dataclass(frozen=True)
class CompassRow:
    """hat_charles with another belief about its compass; the likelihood is that of the EKF."""

    sigma_heading_rad: float
    sigma_turn: float
    log_likelihood: float
    rmse_m: float


@dataclass(frozen=True)
class Reproduction:
    """All that ``auvest reproduce logs`` measures.

    ``heading_walk`` is in rad/sqrt(s), by seconds; ``baseline_walk_rmse_m`` that of mrclam6 with
    :data:`BASELINE_WALK`, by filter.
    """

    rows: list[Row]
    tracking: list[TrackingRow]
    compass: list[CompassRow]
    heading_walk: dict[float, float]
    baseline_walk_rmse_m: dict[str, float]

    def row(self, set_name: str, filter_name: str, kernel: str = "") -> Row:
        """Find one row."""
        for row in self.rows:
            if (row.set_name, row.filter_name, row.kernel) == (set_name, filter_name, kernel):
                return row
        raise KeyError((set_name, filter_name, kernel))

    def held(self) -> dict[str, bool]:
        """Whether each target is reached, by its name."""
        reached = {
            name: self.row(name, "robust-ekf", KERNEL).rmse_m <= target.rmse_m
            for name, target in TARGETS.items()
        }
        for row in self.tracking:
            if row.log.endswith("_1") and row.near_field > 0:
                name = f"{row.log}, {row.filter_name}, every {row.every_s:g} s"
                reached[name] = row.held_out_rmse_m <= TRACKING_TARGETS[row.every_s]
        return reached


def measure(*, data: Path, progress: Callable[[int, int], None] | None = None) -> Reproduction:
    """Import and replay every set below ``data``.

    Raises
    ------
    ValueError
        If a set is not there or not what it should be; the message names the file.
    """
    names = [*TARGETS, TRACKING_SET]
    tick = Ticks(len(names) + 1, progress)
    with TemporaryDirectory() as temporary:
        logs = {}
        for name in names:
            folders = IMPORTERS[name](data / name, Path(temporary) / name)
            logs[name] = [LogFolder(folder) for folder in folders]
        rows: list[Row] = []
        for name in TARGETS:
            rows += _rows(name, logs[name])
            tick()
        tracking = _tracking(logs[TRACKING_SET])
        tick()
        return Reproduction(
            rows=rows,
            tracking=tracking,
            compass=_compass(logs["hat_charles"][0]),
            heading_walk=heading_walk(logs["mrclam6"], find_settings("mrclam6")),
            baseline_walk_rmse_m=_baseline_walk(logs["mrclam6"]),
        )


def heading_walk(logs: list[LogFolder], settings: Settings) -> dict[float, float]:
    """How far the calibrated odometry's heading walks off the truth, in rad/sqrt(s).

    Robust standard deviation (1.4826 x median absolute deviation) of the difference over windows
    of so many seconds, over the root of the time; median over the logs.
    """
    walks: dict[float, float] = {}
    for window in (5.0, 10.0, 30.0, 60.0):
        found = []
        for log in logs:
            truth = np.concatenate([rows for rows, _ in log["truth.csv"].chunks()])
            odometry = np.concatenate([rows for rows, _ in log["odometry.csv"].chunks()])
            s = settings.odometry
            rate = s.turn_factor * odometry[:, 2] + s.turn_offset_rad_s
            turned = np.concatenate([[0.0], np.cumsum(rate[:-1] * np.diff(odometry[:, 0]))])
            edges = np.arange(odometry[0, 0], odometry[-1, 0], window)
            true = np.interp(edges, truth[:, 0], np.unwrap(truth[:, 3]))
            off = np.diff(true) - np.diff(np.interp(edges, odometry[:, 0], turned))
            spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
            found.append(spread / window**0.5)
        walks[window] = float(np.median(found))
    return walks


def _rows(name: str, logs: list[LogFolder]) -> list[Row]:
    settings = find_settings(name)
    runs: list[tuple[FilterName, KernelName | None]] = [("ekf", None)]
    runs += [("robust-ekf", kernel) for kernel in KERNELS]
    runs += [("robust-ukf", KERNEL)]
    rows = []
    for filter_name, kernel in runs:
        chosen = settings
        if kernel is not None:
            chosen = replace(settings, filter=replace(settings.filter, kernel=kernel))
        found = [replay(log, chosen, filter_name=filter_name, causes=False).numbers for log in logs]
        rows.append(
            Row(
                set_name=name,
                filter_name=filter_name,
                kernel=kernel or "",
                rmse_m=_mean(found, "rmse_m"),
                dead_reckoned_rmse_m=_mean(found, "dead_reckoned_rmse_m"),
                rejected=sum(numbers["rejected"] for numbers in found),
                downweighted=sum(numbers["downweighted"] for numbers in found),
                logs=len(logs),
            )
        )
    return rows


def _tracking(logs: list[LogFolder]) -> list[TrackingRow]:
    settings = find_settings(TRACKING_SET)
    rows = []
    runs: list[tuple[FilterName, float]] = [
        ("ukf", settings.fixes.near_field),
        ("aukf", settings.fixes.near_field),
        ("ukf", 0.0),
    ]
    for log in logs:
        for every_s in TRACKING_TARGETS:
            for filter_name, near_field in runs:
                chosen = _every(settings, every_s, near_field, adaptive=filter_name == "aukf")
                numbers = replay(log, chosen, filter_name=filter_name, causes=False).numbers
                rows.append(
                    TrackingRow(
                        log.path.name, every_s, filter_name, near_field, numbers["held_out_rmse_m"]
                    )
                )
    return rows


def _every(settings: Settings, every_s: float, near_field: float, *, adaptive: bool) -> Settings:
    """Let the filter have a fix every so often: thinned beforehand, or by its own choice."""
    return replace(
        settings,
        fixes=replace(settings.fixes, every_s=0.0 if adaptive else every_s, near_field=near_field),
        interval=replace(settings.interval, policy="fixed", interval_s=every_s),
    )


def _baseline_walk(logs: list[LogFolder]) -> dict[str, float]:
    settings = find_settings("mrclam6")
    chosen = replace(settings, odometry=replace(settings.odometry, sigma_turn=BASELINE_WALK))
    names: tuple[FilterName, ...] = ("ekf", "robust-ekf")
    return {
        name: _mean(
            [replay(log, chosen, filter_name=name, causes=False).numbers for log in logs], "rmse_m"
        )
        for name in names
    }


def _compass(log: LogFolder) -> list[CompassRow]:
    settings = find_settings("hat_charles")
    rows = []
    for heading in COMPASS_RAD:
        for walk in COMPASS_WALK:
            chosen = replace(
                settings,
                start=replace(settings.start, sigma_heading_rad=heading),
                odometry=replace(settings.odometry, sigma_turn=walk),
            )
            numbers = replay(log, chosen, filter_name="robust-ekf", causes=False).numbers
            rows.append(CompassRow(heading, walk, log_likelihood(log, chosen), numbers["rmse_m"]))
    return rows


def log_likelihood(log: LogFolder, settings: Settings) -> float:
    """Logarithm of the density of all ranges that the EKF used, given those before each.

    It needs no truth: of two settings the one with the larger value describes the record better.
    """
    total = 0.0
    for batch in Localiser(log, settings, "ekf").batches():
        measured = batch.measurements
        used = ~np.isnan(measured["nis"])
        spread = np.log(2 * np.pi * measured["sigma_0"][used] ** 2)
        total -= 0.5 * float((measured["nis"][used] + spread).sum())
    return total


def _mean(found: list[dict[str, Any]], name: str) -> float:
    return float(np.mean([numbers[name] for numbers in found]))


def summary(result: Reproduction) -> dict[str, Any]:
    """Everything as plain values, for results.json."""
    return {
        "kernel": KERNEL,
        "targets": {name: asdict(target) for name, target in TARGETS.items()},
        "tracking_targets": {f"{every:g}": value for every, value in TRACKING_TARGETS.items()},
        "rows": [asdict(row) for row in result.rows],
        "tracking": [asdict(row) for row in result.tracking],
        "compass": [asdict(row) for row in result.compass],
        "baseline_walk_rmse_m": result.baseline_walk_rmse_m,
        "heading_walk": {f"{window:g}": walk for window, walk in result.heading_walk.items()},
        "held": result.held(),
    }


def set_table(result: Reproduction) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the main table."""
    header = ["set", "odometry", "EKF", *KERNELS, f"UKF, {KERNEL}", "target", "holds", "EKF ref."]
    rows = []
    for name, target in TARGETS.items():
        ours = [result.row(name, "ekf")]
        ours += [result.row(name, "robust-ekf", kernel) for kernel in KERNELS]
        ours += [result.row(name, "robust-ukf", KERNEL)]
        rows.append(
            [
                name,
                f"{ours[0].dead_reckoned_rmse_m:.2f}",
                *(f"{row.rmse_m:.3f}" for row in ours),
                f"{target.rmse_m:g}",
                "yes" if result.held()[name] else "no",
                f"{target.reference_ekf_m:g}",
            ]
        )
    return header, rows


def tracking_table(result: Reproduction) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of ugps_pier59."""
    header = ["log", "every / s", "UKF", "AUKF", "UKF, no near field", "target"]
    rows = []
    for log in dict.fromkeys(row.log for row in result.tracking):
        for every_s, target in TRACKING_TARGETS.items():
            cells = [
                f"{row.held_out_rmse_m:.3f}"
                for row in result.tracking
                if (row.log, row.every_s) == (log, every_s)
            ]
            rows.append([log, f"{every_s:g}", *cells, f"{target:g}" if log.endswith("_1") else ""])
    return header, rows
