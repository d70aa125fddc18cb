"""What a log's files measure, as the filters' sensors take it: numbers, place, model.

A range is levelled by the depths of craft and source where the log has depths, a fix by its
elevation or by these; in space fixes and positions stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest.logs import LogFolder
from auvest.logs.reader import CsvTable, Rows
from auvest.models import (
    BodyVelocity,
    Depth,
    LeaderRange,
    MeasurementModel,
    Position,
    RangeBearing,
    RangeBearingElevation,
    ScaledRange,
)
from auvest.replay import tables
from auvest.replay.config import Settings
from auvest.replay.constants import Constants
from auvest.replay.sources import Sources

#: A range shorter than the difference in depth by more than this many sigma is impossible.
_TOO_SHORT = 5.0
#: Standard deviation (m/s) of a vertical velocity that is not measured: none is known.
_UNMEASURED_M_S = 1e3
#: Models that are kept: making one in the core costs more than a hundred steps with it.
_REMEMBERED = 256


@dataclass(frozen=True)
class Measured:
    """Measurements of a stretch of the log, in the order of the times at which they came in.

    Attributes
    ----------
    time_s, taken_s : ndarray, shape (n,)
        When they came in, and when they were taken.
    source : ndarray of int, shape (n,)
        Whose they are; -1 where there is no source.
    sensor : ndarray of int, shape (n,)
        Index into :data:`auvest.replay.tables.SENSORS`.
    z, place : ndarray, shape (n, 3)
        Numbers and place, as the models take them; NaN behind those there are.
    noise : ndarray, shape (n, 3)
        Standard deviations of the numbers, or of what else a model's noise is made of.
    range_m : ndarray, shape (n,)
        Ranges as the log has them; NaN for others.
    too_short : ndarray of bool, shape (n,)
        Ranges shorter than the difference in depth.
    """

    time_s: Rows
    taken_s: Rows
    source: npt.NDArray[np.int64]
    sensor: npt.NDArray[np.int64]
    z: Rows
    place: Rows
    noise: Rows
    range_m: Rows
    too_short: npt.NDArray[np.bool_]

    def __getitem__(self, rows: Any) -> Measured:
        return Measured(**{name: values[rows] for name, values in vars(self).items()})

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def located(self) -> npt.NDArray[np.bool_]:
        """Whether the place that each needs is known."""
        needs = np.isin(self.sensor, (tables.RANGE, tables.FIX))
        known: npt.NDArray[np.bool_] = ~needs | ~np.isnan(self.place[:, 0])
        return known

    @staticmethod
    def joined(parts: list[Measured]) -> Measured:
        """Join those of several files, in the order of time."""
        if len(parts) == 1:
            return parts[0]
        whole = Measured(
            **{
                name: np.concatenate([vars(part)[name] for part in parts])
                for name in vars(parts[0])
            }
        )
        return whole[np.argsort(whole.time_s, kind="stable")]


class Depths:
    """The craft's depth, as depth.csv has it, fed chunk by chunk; none without the file."""

    def __init__(self) -> None:
        self._track: Rows = np.empty((0, 2))

    def add(self, rows: Rows) -> None:
        """Take new lines, in the order of time."""
        self._track = np.concatenate([self._track, rows])

    @property
    def known_until(self) -> float:
        """Where the last line stands, s."""
        return float(self._track[-1, 0]) if len(self._track) else -math.inf

    def at(self, time_s: Rows) -> Rows:
        """Give the depth (m) at these times, along lines between those of the file."""
        if len(self._track) == 0:
            return np.zeros(len(time_s))
        return np.interp(time_s, *self._track.T)

    def forget(self, before: float) -> None:
        """Drop what no time from ``before`` on can ask for."""
        k = int(np.searchsorted(self._track[:, 0], before, side="right")) - 1
        self._track = self._track[max(k, 0) :]


class Instruments:
    """The files of a log that measure.

    Parameters
    ----------
    log : LogFolder
        The log.
    settings : Settings
        Noises and latencies.
    sources : Sources
        Where the sources are.
    spatial : bool
        Whether the state has a depth.

    Attributes
    ----------
    names : list of str
        The files.
    late_s : float
        The longest latency of them.
    """

    def __init__(
        self, log: LogFolder, settings: Settings, sources: Sources, *, spatial: bool
    ) -> None:
        known: dict[str, Callable[[CsvTable, Rows], Measured]] = {
            "ranges.csv": self._ranges,
            "fixes.csv": self._spatial_fixes if spatial else self._fixes,
            "positions.csv": self._positions,
            "velocities.csv": self._velocities,
        }
        if spatial:
            known["depth.csv"] = self._depths
        self.names = [name for name in known if name in log]
        self.every_s = {
            tables.RANGE: settings.ranges.every_s,
            tables.FIX: settings.fixes.every_s,
            tables.POSITION: settings.positions.every_s,
        }
        self._read = {name: known[name] for name in self.names}
        self._tables = {name: log[name] for name in self.names}
        self._settings = settings
        self._spatial = spatial
        self._sources = sources
        self._constants = Constants(settings)
        self._levelled = not spatial and "depth.csv" in log
        self._models: dict[tuple[int, bytes], MeasurementModel] = {}
        self.depths = Depths()
        self.source_depths = Sources(
            {source: (depth, 0.0) for source, (_, _, depth) in log.stations().items()},
            settings.log.leader_gap_s,
        )
        latencies = [self._of(name).latency_s for name in self.names]
        for section in (settings.ranges, settings.fixes):
            own = [one.latency_s for one in section.sources.values() if one.latency_s is not None]
            latencies += own
        self.late_s = max(latencies, default=0.0)

    @property
    def needs_depths(self) -> bool:
        """Whether the depths of the sources are asked for."""
        return self._levelled or self._spatial

    @property
    def sensors(self) -> list[int]:
        """Which sensors the log has."""
        of_file = {
            "ranges.csv": tables.RANGE, "fixes.csv": tables.FIX, "positions.csv": tables.POSITION,
            "velocities.csv": tables.VELOCITY, "depth.csv": tables.DEPTH,
        }  # fmt: skip
        return [of_file[name] for name in self.names]

    def read(self, name: str, rows: Rows) -> Measured:
        """Give the measurements in rows of one file."""
        return self._read[name](self._tables[name], rows)

    def latency_s(self, name: str, rows: Rows) -> Rows | float:
        """Give the latency (s) of rows of one file."""
        section = self._of(name)
        if name not in ("ranges.csv", "fixes.csv"):
            return float(section.latency_s)
        return self._per_source(rows, section, "latency_s")

    def model(self, sensor: int, noise: Rows) -> MeasurementModel:
        """Give the model of a sensor with this noise; the same one as long as it is remembered."""
        key = (sensor, noise.tobytes())
        if key not in self._models:
            if len(self._models) == _REMEMBERED:
                self._models.clear()
            self._models[key] = self._made(sensor, noise)
        return self._models[key]

    def _made(self, sensor: int, noise: Rows) -> MeasurementModel:
        a, b, c = noise.tolist()
        fixes = self._settings.fixes
        if sensor == tables.RANGE:
            # What a range leaves in the plane may be shorter than the smallest range.
            ranges, levelled = self._settings.ranges, self._levelled
            model: dict[str, Any] = {
                "sigma_range_m": a,
                "sigma_leader_m": b,
                "smallest_range_m": min(ranges.smallest_m, 0.0) if levelled else ranges.smallest_m,
                "largest_range_m": ranges.largest_m,
            }
            if not self._constants:
                return LeaderRange(**model)
            scale = self._constants.place("range_scale")
            return ScaledRange(scale_state=scale, offset_state=int(np.nan_to_num(c)), **model)
        if sensor == tables.FIX and self._spatial:
            return RangeBearingElevation(
                sigma_range_m=a,
                sigma_bearing_rad=b,
                sigma_elevation_rad=c,
                near_field=fixes.near_field,
            )
        if sensor == tables.FIX:
            return RangeBearing(sigma_range_m=a, sigma_bearing_rad=b, near_field=fixes.near_field)
        if sensor == tables.POSITION:
            axes = 3 if np.isfinite(c) else 2
            return Position(covariance_m2=np.diag(noise[:axes] ** 2))
        if sensor == tables.DEPTH:
            return Depth(sigma_m=a)
        return BodyVelocity(
            axes=3 if self._spatial else 2,
            sigma_forward_m_s=a,
            sigma_sideways_m_s=b,
            sigma_vertical_m_s=c if np.isfinite(c) else 1.0,
        )

    def _of(self, name: str) -> Any:
        return getattr(self._settings, name.removesuffix(".csv"))

    def _per_source(self, rows: Rows, section: Any, key: str) -> Rows:
        """Give what the settings say of the source of each row."""
        values = np.full(len(rows), float(getattr(section, key)))
        for source, own in section.sources.items():
            said = getattr(own, key)
            if said is not None:
                values[rows[:, 1] == source] = said
        return values

    def _ranges(self, _: CsvTable, rows: Rows) -> Measured:
        section = self._settings.ranges
        taken = rows[:, 0] - self._per_source(rows, section, "latency_s")
        places = self._sources.locate(taken, rows[:, 1])
        level, sigma, short = self._levelled_range(
            taken, rows, self._per_source(rows, section, "sigma_m")
        )
        return _measured(
            rows[:, 0], taken, tables.RANGE, [level], places[:, :2],
            [sigma, places[:, 2], *self._offsets(rows[:, 1])],
            source=rows[:, 1], range_m=rows[:, 2], too_short=short,
        )  # fmt: skip

    def _offsets(self, sources: Rows) -> list[Rows]:
        """Give the place of the offset of each range in the state, if there are constants."""
        if not self._constants:
            return []
        places = {source: self._constants.offset_of(int(source)) for source in np.unique(sources)}
        return [np.array([places[source] for source in sources], dtype=np.float64)]

    def _fixes(self, table: CsvTable, rows: Rows) -> Measured:
        section = self._settings.fixes
        taken = rows[:, 0] - self._per_source(rows, section, "latency_s")
        places = self._sources.locate(taken, rows[:, 1])
        sigma = self._per_source(rows, section, "sigma_range_m")
        short = np.zeros(len(rows), bool)
        if "elevation_rad" in table.names:
            elevation = table.column(rows, "elevation_rad")
            spread = self._per_source(rows, section, "sigma_elevation_rad")
            level = rows[:, 2] * np.cos(elevation)
            across = rows[:, 2] * np.sin(elevation) * spread
            sigma = np.hypot(sigma * np.cos(elevation), across)
        else:
            level, sigma, short = self._levelled_range(taken, rows, sigma)
        return _measured(
            rows[:, 0], taken, tables.FIX, [level, rows[:, 3]], places[:, :2],
            [sigma, self._per_source(rows, section, "sigma_bearing_rad")],
            source=rows[:, 1], range_m=rows[:, 2], too_short=short,
        )  # fmt: skip

    def _spatial_fixes(self, table: CsvTable, rows: Rows) -> Measured:
        section = self._settings.fixes
        taken = rows[:, 0] - self._per_source(rows, section, "latency_s")
        places = self._sources.locate(taken, rows[:, 1])
        places[:, 2] = self.source_depths.locate(taken, rows[:, 1])[:, 0]
        noise = [
            self._per_source(rows, section, key)
            for key in ("sigma_range_m", "sigma_bearing_rad", "sigma_elevation_rad")
        ]
        numbers = [rows[:, 2], rows[:, 3], -table.column(rows, "elevation_rad")]  # z points down
        return _measured(
            rows[:, 0], taken, tables.FIX, numbers, places, noise, source=rows[:, 1],
            range_m=rows[:, 2],
        )  # fmt: skip

    def _positions(self, table: CsvTable, rows: Rows) -> Measured:
        section = self._settings.positions
        sigma = table.column(rows, "sigma_m", 0.0)
        sigma = np.where(sigma > 0, sigma, section.sigma_m)
        numbers, noise = [rows[:, 1], rows[:, 2]], [sigma, sigma]
        if self._spatial and "depth_m" in table.names:
            numbers.append(table.column(rows, "depth_m"))
            noise.append(np.full(len(rows), section.sigma_depth_m))
        time = rows[:, 0]
        return _measured(time, time - section.latency_s, tables.POSITION, numbers, None, noise)

    def _velocities(self, table: CsvTable, rows: Rows) -> Measured:
        section = self._settings.velocities
        numbers = [rows[:, 1], rows[:, 2]]
        noise = [section.sigma_forward_m_s, section.sigma_left_m_s]
        if self._spatial:
            measured = "down_m_s" in table.names
            numbers.append(table.column(rows, "down_m_s", 0.0))
            noise.append(section.sigma_down_m_s if measured else _UNMEASURED_M_S)
        time = rows[:, 0]
        return _measured(
            time, time - section.latency_s, tables.VELOCITY, numbers, rows[:, 3:4],
            [np.full(len(rows), sigma) for sigma in noise],
        )  # fmt: skip

    def _depths(self, _: CsvTable, rows: Rows) -> Measured:
        section = self._settings.depth
        time, sigma = rows[:, 0], np.full(len(rows), section.sigma_m)
        return _measured(time, time - section.latency_s, tables.DEPTH, [rows[:, 1]], None, [sigma])

    def _levelled_range(
        self, taken_s: Rows, rows: Rows, sigma: Rows
    ) -> tuple[Rows, Rows, npt.NDArray[np.bool_]]:
        """Give what is left of ranges in the plane, its sigma, and which are too short for that.

        With the difference in depth d a range r leaves h = sqrt(r^2 - d^2), and its sigma becomes
        sigma r / h; where h is no larger than its own error, sqrt(sigma r): both at once.
        """
        slant = rows[:, 2]
        if not self._levelled:
            return slant, sigma, np.zeros(len(rows), bool)
        depth = self.depths.at(taken_s) - self.source_depths.locate(taken_s, rows[:, 1])[:, 0]
        depth = np.where(np.isnan(depth), 0.0, depth)
        square = slant**2 - depth**2
        level = np.sqrt(np.maximum(square, 0.0))
        spread = sigma * slant / np.sqrt(np.maximum(level**2 + sigma * slant, 1e-12))
        spread = np.where(depth == 0, sigma, np.maximum(spread, sigma))
        return level, spread, slant < np.abs(depth) - _TOO_SHORT * sigma


def _measured(
    time_s: Rows,
    taken_s: Rows,
    sensor: int,
    numbers: list[Rows],
    place: Rows | None,
    noise: list[Rows],
    *,
    source: Rows | None = None,
    range_m: Rows | None = None,
    too_short: npt.NDArray[np.bool_] | None = None,
) -> Measured:
    count = len(time_s)

    def filled(columns: list[Rows]) -> Rows:
        rows = np.full((count, 3), np.nan)
        for k, column in enumerate(columns):
            rows[:, k] = column
        return rows

    return Measured(
        time_s=time_s.copy(),
        taken_s=taken_s,
        source=np.full(count, -1) if source is None else source.astype(np.int64),
        sensor=np.full(count, sensor),
        z=filled(numbers),
        place=filled([] if place is None else list(place.T)),
        noise=filled(noise),
        range_m=np.full(count, np.nan) if range_m is None else range_m,
        too_short=np.zeros(count, bool) if too_short is None else too_short,
    )
