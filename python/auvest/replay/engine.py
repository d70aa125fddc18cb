"""The replay itself: lines of a log in, tables out, a stretch of the log at a time.

:class:`Localiser` is the craft that dead-reckons and ranges to sources, :class:`Tracker` the
station that tracks a craft by range and bearing. Both turn the lines into rows for the C++ loop
(``run`` of the filters); no filter looks at the truth, and no result depends on how the log was
cut into chunks.

A measurement with a latency comes in at the time of its line and goes in at that when it was taken
(``late_s`` of the filters), at which a step ends. So that it is known, the replay stays behind what
is read by the longest latency.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

import auvest
from auvest import registry
from auvest._arguments import Floats
from auvest.filters import Aukf, GaussianFilter, RobustEkf, RobustUkf, RunResult, Ukf
from auvest.intervals import CovarianceBudget, FixedInterval, IntervalPolicy, MahalanobisInterval
from auvest.logs import LogError, LogFolder, Stream, merge
from auvest.logs.changed import ChangedLog, columns_changed
from auvest.logs.findings import Finding
from auvest.logs.reader import Rows
from auvest.models import (
    ConstantAcceleration,
    Depth,
    MeasurementModel,
    ProcessModel,
    RangeBearing,
    WhiteAcceleration,
)
from auvest.replay import tables
from auvest.replay.config import FilterName, IntervalSettings, Settings
from auvest.replay.constants import Constants, Found
from auvest.replay.instruments import Instruments, Measured
from auvest.replay.motion import Motion, Segments, carry, dead_reckon, wrapped
from auvest.replay.smoothing import Heading, Smoothing, Track
from auvest.replay.sources import Sources
from auvest.replay.tables import Batch, Columns
from auvest.replay.thinning import SAME_S, Thinning
from auvest.replay.water import range_changes

#: Velocity odometry is gone through in small steps: so many at once, so that memory stays bounded.
_STEPS = 32768
#: The columns that sources need, in the order in which they take them.
_LEADERS = ("time_s", "source", "x_m", "y_m")
#: Files of which a line that is too late makes all after it wrong.
_REQUIRED = ("odometry.csv", "compass.csv", "leaders.csv", "plans.csv")
#: So many steps without a line in any file are no log any more.
_STEPS_WITHOUT_LINE = 5_000_000


class Replay(ABC):
    """What both kinds have in common; not for direct use.

    Parameters
    ----------
    log : LogFolder
        The log.
    settings : Settings
        Filter, noise and the rest.
    filter_name : str
        One of :func:`auvest.registry.replayable`.
        The filter.

    Attributes
    ----------
    start : tuple of float
        Time (s), x, y (m) and heading (rad) of the start.
    streams : dict of str to Stream
        The files that are read line by line.
    listener : callable, optional
        Gets each stretch of rows before the filter does: the filter, z, and the other arguments of
        its ``run``.
    smoothing : Smoothing, optional
        Gets them too; each batch then has its ``track``.
    """

    listener: Callable[[GaussianFilter, Rows, Mapping[str, Any]], None] | None = None
    #: Whether the state has a depth.
    spatial = False
    #: Files with times beside those that every replay reads.
    _own_files: tuple[str, ...] = ()
    #: Gets the same, to go back over it.
    smoothing: Smoothing | None = None
    _filter: GaussianFilter
    #: The present and its state; and states before it that a late measurement may belong to.
    _now: float
    _x: Floats
    _P: Floats
    _past_s: Floats
    _past_x: Floats

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        log = _early(log, settings)
        self.log = log
        self.settings = settings
        self.filter_name = filter_name
        self._sources = Sources(log.beacons(), settings.log.leader_gap_s)
        self.instruments = Instruments(log, settings, self._sources, spatial=self.spatial)
        self._late_s = self.instruments.late_s
        self._thinning = {
            sensor: Thinning(every_s) for sensor, every_s in self.instruments.every_s.items()
        }
        reorder_s = settings.log.reorder_s
        names = [
            *self.instruments.names, *self._own_files, *_REQUIRED, "depth.csv", "truth.csv",
        ]  # fmt: skip
        self.streams = {
            name: Stream(log[name], reorder_s=reorder_s, required=name in _REQUIRED)
            for name in dict.fromkeys(names)
            if name in log
        }
        #: The file whose first line the run starts at; empty: at the first place that is measured.
        self.started_from = ""
        self.start = self._start()
        self._waiting = {
            name: np.empty((0, len(stream.table.columns))) for name, stream in self.streams.items()
        }

    def batches(self) -> Iterator[Batch]:
        """Replay the log, stretch by stretch.

        Raises
        ------
        LogError
            If the log is not what it should be.
        FilterError
            If the filter cannot do a step.
        """
        for chunk, horizon in merge(self.streams):
            last = horizon == math.inf
            for name, rows in chunk.items():
                if name == "odometry.csv":
                    self._add_odometry(rows, chunk.get("compass.csv"), last=last)
                elif name == "leaders.csv":
                    self._add_leaders(rows)
                elif name == "depth.csv" and name not in self.instruments.names:
                    self.instruments.depths.add(rows)
                elif name != "compass.csv":
                    self._waiting[name] = np.concatenate([self._waiting[name], rows])
            limit = self._limit(horizon if last else horizon - self._late_s)
            if limit >= self.start[0] or last:
                *inner, end = self._stretches(limit)
                for stop in inner:
                    yield self._with_places(self._advance(stop, last=False))
                yield self._with_places(self._advance(end, last=last))
                self._sources.forget(limit - self._late_s)
                self.instruments.depths.forget(limit - self._late_s)
                self.instruments.source_depths.forget(limit - self._late_s)

    def findings(self) -> list[Finding]:
        """Say what the filter itself is to be blamed for, at the end."""
        return []

    def _with_places(self, batch: Batch) -> Batch:
        """Say where the sources of the measurements were, while that is known."""
        measured = batch.measurements
        places = self._sources.locate(measured["time_s"], measured["source"].astype(float))
        places[~np.isin(measured["sensor"], ("range", "fix"))] = np.nan
        return replace(batch, places=places[:, :2])

    @property
    def bytes_read(self) -> int:
        """How much of the log was read so far."""
        return sum(stream.table.bytes_read for stream in self.streams.values())

    @property
    def bytes(self) -> int:
        """Size of the log."""
        return sum(stream.table.bytes for stream in self.streams.values())

    @abstractmethod
    def _start(self) -> tuple[float, float, float, float]: ...

    @abstractmethod
    def _add_odometry(self, rows: Rows, headings: Rows | None, *, last: bool) -> None: ...

    def _add_leaders(self, rows: Rows) -> None:
        table = self.log["leaders.csv"]
        if table.names == _LEADERS:
            self._sources.add(rows)
        else:
            sigma = table.column(rows, "sigma_m", 0.0)
            self._sources.add(np.column_stack([rows[:, :4], sigma]))
        if not self.instruments.needs_depths:
            return
        depth = table.column(rows, "depth_m", 0.0)
        self.instruments.source_depths.add(np.column_stack([rows[:, :2], depth, 0 * depth]))

    @abstractmethod
    def _limit(self, horizon: float) -> float:
        """Say up to which time a filter can go if all lines before ``horizon`` are known."""

    def _stretches(self, limit: float) -> list[float]:
        """Cut the way to ``limit`` where it is too long to be gone at once; ends with ``limit``."""
        return [limit]

    @abstractmethod
    def _advance(self, limit: float, *, last: bool) -> Batch: ...

    def _tell(self, filter_: GaussianFilter, z: Rows, rows: Mapping[str, Any]) -> None:
        """Give rows to who listens, before the filter gets them."""
        if self.listener is not None:
            self.listener(filter_, z, rows)
        if self.smoothing is not None:
            self.smoothing.rows(filter_, z, rows)

    def _run_rows(self, filter_: GaussianFilter, z: Rows, **rows: Any) -> RunResult:
        """Take the filter through these rows."""
        self._tell(filter_, z, rows)
        return filter_.run(z, **rows)

    def _take(self, name: str, limit: float) -> Rows:
        """Take the waiting rows of a file up to and with a time."""
        if name not in self._waiting:
            return np.empty((0, 4))
        waiting = self._waiting[name]
        count = int(np.searchsorted(waiting[:, 0], limit, side="right"))
        self._waiting[name] = waiting[count:]
        return waiting[:count]

    def _from_file(self, name: str) -> tuple[float, float, float, float] | None:
        """Start pose from the first line of start.csv or of a truth with headings."""
        if name not in self.log or "heading_rad" not in self.log[name].names:
            return None
        time, x, y = self._first_place(name)
        table = self.log[name]
        rows, _ = next(table.chunks())
        return time, x, y, float(table.column(rows, "heading_rad")[0])

    def _first_place(self, name: str) -> tuple[float, float, float]:
        """Give time, x and y of the first line of a file."""
        table = self.log[name]
        rows, _ = next(table.chunks(), (np.empty((0, 4)), 0))
        if len(rows) == 0:
            raise LogError(table.path, "has no line below the header")
        self.started_from = name
        time, x, y = rows[0, :3].tolist()
        return time, x, y

    def _usable_position(self, horizon: float) -> float:
        """Time up to which positions of leaders and depths can be had."""
        if "leaders.csv" in self.streams:
            horizon -= self._sources.gap_s
        depth = self.streams.get("depth.csv")
        if "depth.csv" not in self.instruments.names and depth is not None:
            known = math.inf if depth.horizon == math.inf else self.instruments.depths.known_until
            horizon = min(horizon, known)
        return float(np.nextafter(horizon, -math.inf))

    def _measurements(
        self, limit: float, end: float
    ) -> tuple[Measured, dict[str, npt.NDArray[Any]], npt.NDArray[np.bool_]]:
        """Take what came in up to a time: measurements, their columns and which are used."""
        read = [self.instruments.read(name, self._take(name, limit)) for name in self._files]
        measured = Measured.joined(read)
        columns = tables.blank_measurements(len(measured))
        columns["time_s"] = measured.time_s
        columns["source"] = measured.source
        columns["sensor"] = np.array(tables.SENSORS)[measured.sensor]
        outcome = columns["outcome"]
        outcome[measured.too_short] = tables.TOO_SHORT
        outcome[~measured.located] = tables.NO_POSITION
        outcome[measured.time_s > end] = tables.AFTER_END
        outcome[measured.taken_s < self.start[0]] = tables.BEFORE_START
        usable = outcome == ""
        for sensor, thinning in self._thinning.items():
            mine = np.flatnonzero(usable & (measured.sensor == sensor))
            passed = thinning.passed(measured.time_s[mine], measured.source[mine].astype(float))
            outcome[mine[~passed]] = tables.HELD_OUT
        return measured, columns, outcome == ""

    @property
    def _files(self) -> list[str]:
        return self.instruments.names

    def _taken_late(self, limit: float) -> Rows:
        """Give the times up to a limit at which something was taken that comes in later."""
        if self._late_s == 0:
            return np.empty(0)
        parts = [
            self._waiting[name][:, 0] - self.instruments.latency_s(name, self._waiting[name])
            for name in self._files
        ]
        taken = np.concatenate(parts)
        return taken[taken <= limit]

    def _fused(
        self, fused: Measured, bare: Rows, after: npt.NDArray[np.intp], **rows: Rows
    ) -> tuple[dict[str, npt.NDArray[Any]], RunResult]:
        """Take rows through the filter: what updates reported, and the result.

        ``bare`` are the times of rows without measurement, ``after`` says behind how many of them
        each measurement has its row; ``rows`` are columns of all.
        """
        nothing = np.full((len(bare), 3), np.nan)
        z = np.insert(nothing, after, fused.z, axis=0)
        place = np.insert(nothing, after, fused.place, axis=0)
        if self._late_s > 0:
            rows["age_s"] = np.insert(np.zeros(len(bare)), after, fused.time_s - fused.taken_s)
        kinds, kind_of = _distinct(np.column_stack([fused.sensor, fused.noise]))
        models = [self.instruments.model(int(kind[0]), kind[1:]) for kind in kinds]
        models = models or [next(iter(self._filter.sensors.values()))]
        which = np.insert(np.zeros(len(bare), np.intp), after, kind_of)
        size = max(map(_places, models))
        if size:
            rows["place"] = place[:, :size]
        numbers = z[:, : max(len(model.measures) for model in models)]
        sensor = models[0] if len(models) == 1 else [models[k] for k in which.tolist()]
        result = self._run_rows(self._filter, numbers, sensor=sensor, **rows)
        return updates_of(result), result

    def _move_on(self, at: Rows, states: Floats, spreads: Floats) -> None:
        """Make the last of these states the present; remember what a latency may still ask for."""
        self._now, self._x, self._P = float(at[-1]), states[-1:], spreads[-1:]
        if self._late_s > 0:
            past_s = np.concatenate([self._past_s, at[:-1]])
            past_x = np.concatenate([self._past_x, states[:-1]])
            k = int(np.searchsorted(past_s, self._now - self._late_s, side="right")) - 1
            self._past_s, self._past_x = past_s[max(k, 0) :], past_x[max(k, 0) :]

    def _errors(
        self, truth: Rows, position: Floats, covariance: Floats, reckoned: Floats
    ) -> Columns:
        error = position - truth[:, 1:3]
        return {
            "time_s": truth[:, 0],
            "true_x_m": truth[:, 1],
            "true_y_m": truth[:, 2],
            "error_x_m": error[:, 0],
            "error_y_m": error[:, 1],
            "sigma_x_m": np.sqrt(covariance[:, 0, 0]),
            "sigma_y_m": np.sqrt(covariance[:, 1, 1]),
            "dead_reckoned_error_m": np.hypot(*(reckoned - truth[:, 1:3]).T),
        }


class Localiser(Replay):
    """A craft that dead-reckons and ranges to beacons and leaders.

    The state is a pose, and the constants that the settings ask for. The run starts at the pose in
    start.csv or at the first line of a truth that has headings.
    """

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        if filter_name == "aukf":
            raise ValueError("filter aukf chooses when to take a fix; this log has ranges: use ukf")
        super().__init__(log, settings, filter_name)
        time, x, y, heading = self.start
        self._now = time
        compass = "compass.csv" in log
        self._motion = Motion(log["odometry.csv"], time, settings.odometry, compass=compass)
        self._constants = Constants(settings)
        self._constants.require(log, steered=self._motion.steered)
        models: dict[str, Any] = {"process": self._constants.process}
        models["sensors"] = self._own_sensors()
        own = settings.start
        sigmas = [own.sigma_position_m, own.sigma_position_m, own.sigma_heading_rad]
        mean, spread = self._constants.begin([x, y, heading], sigmas)
        x0, P0 = np.array(mean), np.diag(spread) ** 2
        self._filter = _build(filter_name, settings, x0, P0, models, self._late_s)
        self._x, self._P = x0[None], P0[None]
        self._reckoned = x0[None, :3]  # the pose by dead reckoning alone
        self._past_s, self._past_x = np.empty(0), np.empty((0, len(x0)))
        self._carry = partial(carry, speed_state=self._constants.place("speed_factor"))

    @property
    def constants(self) -> list[Found]:
        """What the instruments are off by, as is known now."""
        deviation = float(self._x[0, 2] - self._reckoned[0, 2])
        return self._constants.found(self._x[0], self._P[0], deviation)

    def _start(self) -> tuple[float, float, float, float]:
        steered = "compass.csv" in self.log or "heading_rad" in self.log["odometry.csv"].names
        start = self._from_file("start.csv")
        if start is None and steered and "start.csv" in self.log:
            start = self._headed("start.csv")
        start = start or self._from_file("truth.csv")
        if start is None and steered:
            names = [name for name in ("truth.csv", "positions.csv") if name in self.log]
            start = self._headed(names[0]) if names else None
        if start is None:
            raise LogError(
                self.log.path,
                "has no start.csv (time_s,x_m,y_m,heading_rad; without heading_rad where a compass "
                "says it) nor such a line in truth.csv: where does the run start?",
            )
        return start

    def _headed(self, name: str) -> tuple[float, float, float, float]:
        """Give the start at the first place of a file, headed as the compass says then."""
        time, x, y = self._first_place(name)
        table = self.log["compass.csv" if "compass.csv" in self.log else "odometry.csv"]
        before: list[tuple[float, float]] = []
        for rows, _ in table.chunks():
            heading = table.column(rows, "heading_rad")
            k = int(np.searchsorted(rows[:, 0], time, side="left"))
            if k < len(rows):
                before.append((float(rows[k, 0]), float(heading[k])))
            if k > 0:
                before.insert(0, (float(rows[k - 1, 0]), float(heading[k - 1])))
            if k < len(rows):
                break
            before = before[:1]
        if not before:
            raise LogError(table.path, "has no line below the header")
        (low_s, low), (high_s, high) = before[0], before[-1]
        share = min(max((time - low_s) / (high_s - low_s), 0.0), 1.0) if high_s > low_s else 0.0
        turn = float(wrapped(np.array([high - low]))[0])
        return time, x, y, low + share * turn + self.settings.compass.offset_rad

    def _own_sensors(self) -> Any:
        """Give the sensors of the log's files, with the noise of the settings."""
        s = self.settings
        noise = {
            tables.RANGE: [s.ranges.sigma_m, 0.0, math.nan],
            tables.FIX: [s.fixes.sigma_range_m, s.fixes.sigma_bearing_rad, math.nan],
            tables.POSITION: [s.positions.sigma_m, s.positions.sigma_m, math.nan],
        }
        models = [
            self.instruments.model(one, np.array(noise[one])) for one in self.instruments.sensors
        ]
        return models[0] if len(models) == 1 else models

    def _add_odometry(self, rows: Rows, headings: Rows | None, *, last: bool) -> None:
        self._motion.add(rows, headings, last=last)

    def _limit(self, horizon: float) -> float:
        limit = self._usable_position(horizon)
        if self._motion.increments or (self._motion.steered and horizon < math.inf):
            limit = min(limit, self._motion.known_until)
        elif horizon == math.inf:
            ends = [rows[-1, 0] for rows in self._waiting.values() if len(rows)]
            limit = max([self._motion.known_until, *ends])
        return limit

    def _stretches(self, limit: float) -> list[float]:
        if self._motion.increments:
            return [limit]
        step = self.settings.odometry.max_step_s
        lines = [rows[:, 0] for rows in self._waiting.values()]
        known = np.concatenate([[self._now, limit], self._motion.edges, *lines])
        known = np.unique(known[(known >= self._now) & (known <= limit)])
        gap = float(np.diff(known).max(initial=0.0))
        if gap > _STEPS_WITHOUT_LINE * step:
            raise LogError(
                self.log["odometry.csv"].path,
                f"no file has a line for {gap:.3g} s; do all have the same clock?",
                column="time_s",
            )
        return [*np.arange(self._now + _STEPS * step, limit, _STEPS * step).tolist(), limit]

    def _advance(self, limit: float, *, last: bool) -> Batch:
        came, columns, used = self._measurements(math.inf if last else limit, limit)
        fused = came[used]
        segments = self._motion.until(limit)
        taken = fused.taken_s[fused.taken_s < fused.time_s] if self._late_s else np.empty(0)
        ends = np.concatenate([fused.time_s, taken, self._taken_late(limit)])
        times = self._events(limit, ends)
        bounds = np.concatenate([[self._now], times])
        chord, turn = segments.steps(bounds[:-1], np.diff(bounds))

        # A row per step, and after it one per measurement that came in at its end, with no time
        # between.
        after = np.searchsorted(times, fused.time_s, side="right")
        time = np.insert(times, after, fused.time_s)
        n = self._x.shape[1]
        x: Floats = np.empty((0, n))
        covariance: Floats = np.empty((0, n, n))
        mixture = {name: np.empty(0, np.uint8) for name in tables.MIXTURE}
        located = np.empty(0, bool)
        if len(time):
            motion = np.insert(np.column_stack([chord.real, chord.imag, turn]), after, 0.0, axis=0)
            steps = np.insert(np.diff(bounds), after, 0.0)
            updates, result = self._fused(fused, times, after, dt=steps, input=motion)
            x, covariance = result.x, result.P
            if self._filter.components > 1:
                mixture = {name: getattr(result, name) for name in tables.MIXTURE}
            _fill(columns, np.flatnonzero(used), updates)
            measured = np.insert(np.zeros(len(times), bool), after, True)
            ranged = fused.sensor == tables.RANGE
            sigma = np.hypot(fused.noise[ranged, 0], fused.noise[ranged, 1])
            located = _located(covariance[measured][ranged], fused.z[ranged, 0], sigma)

        # The state after the last row of each time, behind that before this stretch.
        final = np.flatnonzero(np.diff(time, append=math.inf) > 0)
        at = np.concatenate([[self._now], time[final]])
        states = np.concatenate([self._x, x[final]])
        spreads = np.concatenate([self._P, covariance[final]])
        poses = dead_reckon(self._reckoned, chord, turn)
        reckoned = poses[np.searchsorted(bounds, at, side="right") - 1]

        self._predict_held_out(
            came, columns, segments,
            np.concatenate([self._past_x, states]), np.concatenate([self._past_s, at]),
        )  # fmt: skip
        truth = self._take("truth.csv", limit)
        truth = truth[truth[:, 0] >= self.start[0]]
        errors = self._errors(
            truth,
            self._carry(segments, states, at, truth[:, 0]),
            spreads[np.searchsorted(at, truth[:, 0], side="right") - 1],
            carry(segments, reckoned, at, truth[:, 0]),
        )

        track = None
        if self.smoothing is not None:
            before = (self._x, self._P)
            track = Track(
                final, at, before, truth[:, :3], partial(self._carry, segments), heading_of
            )
        self._move_on(at, states, spreads)
        self._reckoned = reckoned[-1:]
        self._motion.forget(self._past_s[0] if len(self._past_s) else self._now)
        estimates = _estimates(at[1:], states[1:], heading_of, spreads[1:], reckoned[1:])
        if self._filter.components > 1:
            said, size = (mixture[name][final] for name in tables.MIXTURE)
            named = {"convergence": tables.CONVERGENCES[said], "mixture_size": size}
            estimates = {**estimates, **named}
        return Batch(
            estimates=estimates,
            measurements=columns,
            errors=errors,
            ranges_m=came.range_m,
            located=located,
            track=track,
        )

    def _predict_held_out(
        self,
        came: Measured,
        columns: dict[str, npt.NDArray[Any]],
        segments: Segments,
        states: Floats,
        at: Rows,
    ) -> None:
        """Write how far the predictions of what the filter did not get were off."""
        held = np.flatnonzero(columns["outcome"] == tables.HELD_OUT)
        predicted = self._carry(segments, states, at, came.taken_s[held])
        error = columns["held_out_error_m"]
        error[held] = np.hypot(*(predicted - came.place[held, :2]).T) - came.z[held, 0]
        for sensor, seen in ((tables.FIX, _pointed), (tables.POSITION, _placed)):
            mine = came.sensor[held] == sensor
            if mine.any():
                error[held[mine]] = np.hypot(*(predicted[mine] - seen(came[held[mine]])).T)

    def _events(self, limit: float, measured: Rows) -> Rows:
        """Give the times in (now, limit] at which a step ends.

        Those are the lines of the odometry, the ranges, and for velocities a grid that is fixed at
        the start.
        """
        edges = self._motion.edges
        parts: list[Floats] = [edges[(edges > self._now) & (edges <= limit)]]
        parts.append(measured[measured > self._now])
        if not self._motion.increments:
            step = self.settings.odometry.max_step_s
            first, end = (math.floor((t - self.start[0]) / step) for t in (self._now, limit))
            grid = self.start[0] + step * np.arange(first + 1, end + 1)
            parts.append(grid[(grid > self._now) & (grid <= limit)])
        return np.unique(np.concatenate(parts))


class Tracker(Replay):
    """A station, or several, that track a craft by range and bearing; or fixes of a craft.

    The state is position, velocity and acceleration, or with elevations position and velocity in
    space, depth downwards. The run starts at the position in start.csv, else at the first fix, at
    rest.
    """

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        if settings.filter.components > 1 or settings.filter.headings > 1:
            raise ValueError("[filter] components and headings are for logs of ranges")
        if "fixes.csv" in log:
            self.spatial = "elevation_rad" in log["fixes.csv"].names
        else:
            self.spatial = "depth_m" in log["positions.csv"].names
        super().__init__(log, settings, filter_name)
        if filter_name == "aukf" and (self._files != ["fixes.csv"] or self._late_s > 0):
            raise ValueError(
                "filter aukf chooses when to take the next fix, and so takes no other sensor and "
                "none that is late: use ukf"
            )
        process = settings.process
        self._process: ProcessModel = ConstantAcceleration(
            position_psd=process.position_psd,
            velocity_psd=process.velocity_psd,
            acceleration_psd=process.acceleration_psd,
            discretisation=process.discretisation,
        )
        if self.spatial:
            self._process = WhiteAcceleration(
                axes=3,
                velocity_psd=process.velocity_psd,
                vertical_velocity_psd=process.vertical_velocity_psd,
            )
        self._now = self.start[0]
        self._started = False
        self._past_s, self._past_x = np.empty(0), np.empty((0, 6))

    def _start(self) -> tuple[float, float, float, float]:
        start = self._from_file("start.csv")
        if start is None and "start.csv" in self.log:
            start = (*self._first_place("start.csv"), 0.0)
        return start if start is not None else (-math.inf, math.nan, math.nan, 0.0)

    def _add_odometry(self, rows: Rows, headings: Rows | None, *, last: bool) -> None:  # noqa: ARG002
        raise AssertionError(f"a tracked craft has no odometry, but {len(rows)} lines came")

    def _limit(self, horizon: float) -> float:
        return self._usable_position(horizon)

    def _begin(self, time: float, position: Rows) -> None:
        self.start = (time, float(position[0]), float(position[1]), 0.0)
        s = self.settings.start
        sigmas = [s.sigma_position_m, s.sigma_speed_m_s, s.sigma_acceleration_m_s2]
        fixes = self.settings.fixes
        models: dict[str, Any] = {"process": self._process}
        if self.spatial:
            x0 = np.array([*position[:3], 0.0, 0.0, 0.0])
            P0 = np.diag(np.repeat(sigmas[:2], 3)) ** 2
            models["sensors"] = Depth(sigma_m=self.settings.depth.sigma_m)
        else:
            x0 = np.array([*position[:2], 0.0, 0.0, 0.0, 0.0])
            P0 = np.diag(np.repeat(sigmas, 2)) ** 2
            models["sensors"] = RangeBearing(
                sigma_range_m=fixes.sigma_range_m,
                sigma_bearing_rad=fixes.sigma_bearing_rad,
                near_field=fixes.near_field,
            )
        if self.filter_name == "aukf":
            policy = interval_policy(self.settings.interval)
            models |= {**_points(self.settings), "dtype": self.settings.filter.dtype}
            models["longest_step_s"] = self.settings.filter.longest_step_s
            self._filter = Aukf(x0, P0, policy=policy, **models)
        else:
            self._filter = _build(self.filter_name, self.settings, x0, P0, models, self._late_s)
        self._now, self._started = time, True
        self._x, self._P = x0[None], P0[None]

    def _advance(self, limit: float, *, last: bool) -> Batch:
        came, columns, used = self._measurements(math.inf if last else limit, math.inf)
        if not self._started and math.isfinite(self.start[0]):
            self._begin(self.start[0], np.array([*self.start[1:3], self._first_depth(came)]))
        if not self._started:
            self._begin_at_first(came, columns, used)
        if not self._started:
            return _nothing(columns, came.range_m)

        times: Rows = came.time_s[used]
        if isinstance(self._filter, Aukf):
            x, covariance, used = self._sample(self._filter, came, used, columns)
            times = came.time_s[used]
        else:
            if self._late_s > 0:
                waiting = self._taken_late(limit)
                edges = np.concatenate([came.taken_s[used], waiting])
                times = np.concatenate([times, edges[edges > self._now]])
            times, x, covariance = self._fuse(came[used], np.flatnonzero(used), times, columns)
        at = np.concatenate([[self._now], times])
        states = np.concatenate([self._x, x])
        spreads = np.concatenate([self._P, covariance])
        self._predict_held_out(
            came, columns, np.concatenate([self._past_x, states]),
            np.concatenate([self._past_s, at]),
        )  # fmt: skip

        truth = self._take("truth.csv", limit)
        truth = truth[truth[:, 0] >= self.start[0]]
        last_row = np.searchsorted(at, truth[:, 0], side="right") - 1
        nowhere = np.full((len(truth), 2), np.nan)
        carried = partial(coast, spatial=self.spatial)
        course = partial(course_of, velocity=3 if self.spatial else 2)
        position = carried(states, at, truth[:, 0])
        track = None
        if self.smoothing is not None:
            before = (self._x, self._P)
            track = Track(np.arange(len(x)), at, before, truth[:, :3], carried, course)
        self._move_on(at, states, spreads)
        estimates = _estimates(at[1:], states[1:], course, spreads[1:], None)
        if self.spatial:
            depth = (states[1:, 2], spreads[1:, 2, 2])
            estimates = {**estimates, **dict(zip(tables.SPATIAL, depth, strict=True))}
        return Batch(
            estimates=estimates,
            measurements=columns,
            errors=self._errors(truth, position, spreads[last_row], nowhere),
            ranges_m=came.range_m,
            track=track,
        )

    def _begin_at_first(
        self,
        came: Measured,
        columns: dict[str, npt.NDArray[Any]],
        used: npt.NDArray[np.bool_],
    ) -> None:
        """Start at the first place that is told; what came before that is before the start."""
        places = used & np.isin(came.sensor, (tables.FIX, tables.POSITION))
        if not places.any():
            columns["outcome"][used] = tables.BEFORE_START
            used[:] = False
            return
        first = int(np.argmax(places))
        seen = (_pointed if came.sensor[first] == tables.FIX else _placed)(came[first : first + 1])
        depth = [self._first_depth(came[first:])]
        self._begin(float(came.taken_s[first]), np.concatenate([seen[0], depth]))
        columns["outcome"][first] = tables.ACCEPTED
        early = used & (came.taken_s < self.start[0])
        columns["outcome"][early] = tables.BEFORE_START
        used[early] = False
        used[first] = False

    def _first_depth(self, came: Measured) -> float:
        """Give the depth that the first measurement tells which tells one; 0 where none does."""
        for k in range(len(came)) if self.spatial else ():
            if came.sensor[k] == tables.DEPTH:
                return float(came.z[k, 0])
            if came.sensor[k] == tables.FIX and not np.isnan(came.place[k, 2]):
                return float(came.place[k, 2] + came.z[k, 0] * np.sin(came.z[k, 2]))
            if came.sensor[k] == tables.POSITION and not np.isnan(came.z[k, 2]):
                return float(came.z[k, 2])
        return 0.0

    def _predict_held_out(
        self, came: Measured, columns: dict[str, npt.NDArray[Any]], states: Rows, at: Rows
    ) -> None:
        """Write how far the predictions of what the filter did not get were off."""
        held = np.flatnonzero(columns["outcome"] == tables.HELD_OUT)
        predicted = coast(states, at, came.taken_s[held], spatial=self.spatial)
        seen = np.where(
            (came.sensor[held] == tables.FIX)[:, None], _pointed(came[held]), _placed(came[held])
        )
        columns["held_out_error_m"][held] = np.hypot(*(predicted - seen).T)

    def _fuse(
        self,
        fused: Measured,
        of_table: npt.NDArray[np.intp],
        times: Rows,
        columns: dict[str, npt.NDArray[Any]],
    ) -> tuple[Rows, Floats, Floats]:
        """Update with these measurements: times, states and covariances after each."""
        empty = np.empty(0), np.empty((0, 6)), np.empty((0, 6, 6))
        if len(times) == 0:
            return empty
        # Steps that end where something was taken that came in later are rows without measurement.
        bare = np.setdiff1d(times, fused.time_s)
        after = np.searchsorted(bare, fused.time_s, side="right")
        time = np.insert(bare, after, fused.time_s)
        steps = np.diff(time, prepend=self._now)
        updates, result = self._fused(fused, bare, after, dt=steps)
        _fill(columns, of_table, updates)
        return time, result.x, result.P

    def _sample(
        self,
        tracker: Aukf,
        came: Measured,
        offered: npt.NDArray[np.bool_],
        columns: dict[str, npt.NDArray[Any]],
    ) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        """Update with the fixes that the filter's interval asks for; hold out the others."""
        used = np.zeros_like(offered)
        states: list[Floats] = [np.empty((0, 6))]
        spreads: list[Floats] = [np.empty((0, 6, 6))]
        now = self._now
        for k in np.flatnonzero(offered).tolist():
            time = float(came.time_s[k])
            if time - now < tracker.interval - SAME_S:
                columns["outcome"][k] = tables.HELD_OUT
                continue
            sensor = self.instruments.model(tables.FIX, came.noise[k])
            z, place = came.z[k : k + 1, :2], came.place[k : k + 1, :2]
            self._tell(tracker, z, {"dt": np.array([time - now]), "place": place, "sensor": sensor})
            tracker.predict(time - now)
            tracker.update(z[0], sensor, place=place[0])
            tracker.feedback()
            now, used[k] = time, True
            states.append(tracker.x[None])
            spreads.append(tracker.P[None])
            columns["outcome"][k] = tables.ACCEPTED
            for m in range(2):
                columns[f"innovation_{m}"][k] = tracker.innovation[m]
                columns[f"sigma_{m}"][k] = math.sqrt(tracker.S[m, m])
                columns[f"weight_{m}"][k] = 1.0
            columns["nis"][k] = tracker.nis
            columns["near_field"][k] = tracker.near_field
        return np.concatenate(states), np.concatenate(spreads), used


def heading_of(states: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Headings and their standard deviations, rad, of poses."""
    return states[:, 2], np.sqrt(covariance[:, 2, 2])


def course_of(states: Floats, covariance: Floats, velocity: int) -> tuple[Floats, Floats]:
    """Courses and their standard deviations, rad: at most that of a course that may be any.

    ``velocity`` is the place of the first of its components in a state.
    """
    x, y = velocity, velocity + 1
    vx, vy = states[:, x], states[:, y]
    square = vx * vx + vy * vy
    across = vy * vy * covariance[:, x, x] - 2 * vx * vy * covariance[:, x, y]
    across = np.maximum(across + vx * vx * covariance[:, y, y], 0.0)
    any_course = math.pi / math.sqrt(3)
    sigma = np.full(len(square), any_course)
    np.divide(np.sqrt(across), square, out=sigma, where=square > 0)
    return np.arctan2(vy, vx), np.minimum(sigma, any_course)


def coast(states: Floats, at: Floats, time_s: Rows, *, spatial: bool) -> Floats:
    """Predicted positions at these times, each from the last state before it."""
    k = np.searchsorted(at, time_s, side="right") - 1
    dt = (time_s - at[k])[:, None]
    if spatial:
        return states[k, 0:2] + dt * states[k, 3:5]
    half_square = 0.5 * dt * dt
    position: Floats = states[k, 0:2] + dt * states[k, 2:4] + half_square * states[k, 4:6]
    return position


def _pointed(fixes: Measured) -> Rows:
    """Where fixes by range and bearing point to in the plane."""
    level = fixes.z[:, 0] * np.cos(np.nan_to_num(fixes.z[:, 2]))
    bearing = fixes.z[:, 1]
    return fixes.place[:, :2] + level[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])


def _placed(positions: Measured) -> Rows:
    return positions.z[:, :2]


def _early(log: LogFolder, settings: Settings) -> LogFolder:
    """Give the log with lines at the times that they are about, and ranges by the sound's speed.

    Of the lines those are meant that drive, or level.
    """
    latencies = {
        "odometry.csv": settings.odometry.latency_s,
        "compass.csv": settings.compass.latency_s,
        "depth.csv": settings.depth.latency_s,
    }
    if log.tracking:  # there a depth is a measurement
        latencies = {}
    changes = {
        name: columns_changed({0: partial(_before, late)})
        for name, late in latencies.items()
        if late > 0 and name in log
    }
    log = ChangedLog(log, changes) if changes else log
    sounded = range_changes(log, settings)
    return ChangedLog(log, sounded) if sounded else log


def _before(late_s: float, rows: Rows) -> Rows:
    return rows[:, 0] - late_s


def _distinct(kinds: Rows) -> tuple[Rows, npt.NDArray[np.intp]]:
    """Give the distinct rows, in the order in which they come, and which of them each row is."""
    if len(kinds) == 0:
        return kinds, np.empty(0, np.intp)
    plain = np.where(np.isnan(kinds), -1.0, kinds)
    if (plain == plain[0]).all():
        return kinds[:1], np.zeros(len(kinds), np.intp)
    _, first, inverse = np.unique(plain, axis=0, return_index=True, return_inverse=True)
    return kinds[first], inverse.reshape(-1)


def _places(sensor: MeasurementModel) -> int:
    """Say how many numbers the place of a sensor has."""
    if sensor.place is None:
        return 0
    place = getattr(sensor.standing(), sensor.place)
    return len(place) if isinstance(place, tuple) else 1


def _build(
    name: FilterName,
    settings: Settings,
    x0: Rows,
    P0: Rows,
    models: dict[str, Any],
    late_s: float,
) -> GaussianFilter:
    """Make the filter of this name, with what the settings say of its kind."""
    entry = registry.filter_named(name, registry.replayable())
    kind: type[GaussianFilter] = getattr(auvest, entry.cls)
    models["longest_step_s"] = settings.filter.longest_step_s
    models["late_s"] = late_s
    models["components"] = settings.filter.components
    models["headings"] = settings.filter.headings
    models["dtype"] = settings.filter.dtype
    if issubclass(kind, (RobustEkf, RobustUkf)):
        models["kernel"], models["recovery"] = settings.robust
        for key in ("residual", "max_iterations", "tolerance"):
            models[key] = getattr(settings.filter, key)
    if issubclass(kind, Ukf):
        models |= _points(settings)
    return kind(x0, P0, **models)


def _points(settings: Settings) -> dict[str, float | None]:
    """Give the parameters of the sigma points."""
    return {key: getattr(settings.filter, key) for key in ("alpha", "beta", "kappa")}


def interval_policy(settings: IntervalSettings) -> IntervalPolicy:
    """Build the interval policy that the settings describe."""
    if settings.policy == "fixed":
        return FixedInterval(interval_s=settings.interval_s)
    low, high = settings.min_s, settings.max_s
    limits: dict[str, Any] = {"initial_s": settings.initial_s or low, "min_s": low, "max_s": high}
    if settings.policy == "mahalanobis":
        names = ("tau0", "scale", "epsilon", "gamma1_m2", "gamma2", "ratio_max", "tau_min",
                 "tau_max")  # fmt: skip
        given = {name: getattr(settings, name) for name in names}
        said = {name: value for name, value in given.items() if value is not None}
        return MahalanobisInterval(**limits, **said)
    return CovarianceBudget(position_sigma_m=settings.position_sigma_m, **limits)


def updates_of(result: RunResult) -> dict[str, npt.NDArray[Any]]:
    """Gather what the updates in a result reported, a row per measurement.

    Behind the numbers of smaller measurements there is NaN.
    """
    there = ~np.isnan(result.nis)
    columns = {name: getattr(result, name)[there] for name in _REPORTED}
    assert result.S is not None
    columns["sigma"] = np.sqrt(np.diagonal(result.S[there], axis1=1, axis2=2))
    return columns


#: What updates report, beside the sigmas of their innovations.
_REPORTED = ("innovation", "weight", "nis", "near_field", "decision", "recovered")


def _fill(
    columns: dict[str, npt.NDArray[Any]],
    rows: npt.NDArray[np.intp],
    updates: dict[str, npt.NDArray[Any]],
) -> None:
    """Write what the updates reported into the rows of the measurement table."""
    for m in range(updates["innovation"].shape[1]):
        columns[f"innovation_{m}"][rows] = updates["innovation"][:, m]
        columns[f"sigma_{m}"][rows] = updates["sigma"][:, m]
        columns[f"weight_{m}"][rows] = updates["weight"][:, m]
    columns["nis"][rows] = updates["nis"]
    columns["near_field"][rows] = updates["near_field"]
    columns["recovered"][rows] = updates["recovered"]
    columns["outcome"][rows] = tables.DECISIONS[updates["decision"]]


def replay_of(log: LogFolder, settings: Settings, filter_name: FilterName) -> Replay:
    """Make the replay that a log is for."""
    from auvest.replay.slat import Companion  # here, because it is made of what stands above

    family = registry.filter_named(filter_name).family
    if log.echoing != (family == "slat"):
        fitting = [
            name for name in registry.replayable()
            if (registry.FILTERS[name].family == "slat") == log.echoing
        ]  # fmt: skip
        has = "echoes of masters" if log.echoing else "no echoes of masters"
        raise ValueError(f"filter {filter_name}: this log has {has}; take {', '.join(fitting)}")
    if log.echoing:
        return Companion(log, settings, filter_name)
    for key in ("sigma_position_m", "sigma_heading_rad"):
        if getattr(settings.start, key) == 0:
            raise ValueError(f"[start] {key} must be positive for filter {filter_name}")
    return (Tracker if log.tracking else Localiser)(log, settings, filter_name)


def _estimates(
    time_s: Floats, states: Floats, heading: Heading, covariance: Floats, reckoned: Floats | None
) -> Columns:
    unknown = np.full(len(time_s), np.nan)
    return {
        "time_s": time_s,
        **tables.pose(states, covariance, *heading(states, covariance)),
        "dead_reckoned_x_m": unknown if reckoned is None else reckoned[:, 0],
        "dead_reckoned_y_m": unknown if reckoned is None else reckoned[:, 1],
    }


def _located(covariance: Floats, ranges_m: Floats, sigmas_m: Floats) -> npt.NDArray[np.bool_]:
    """Whether each belief is one for which the circle of its range is a line.

    The larger variance of the position is below 3 sqrt(2) sigma z, as the filters with components
    have it (docs/algorithms/unknown_start.md).
    """
    half = 0.5 * (covariance[:, 0, 0] - covariance[:, 1, 1])
    larger = 0.5 * (covariance[:, 0, 0] + covariance[:, 1, 1]) + np.hypot(half, covariance[:, 0, 1])
    bend = 3 * math.sqrt(2) * sigmas_m * np.maximum(ranges_m, sigmas_m)
    located: npt.NDArray[np.bool_] = larger <= bend
    return located


def _nothing(columns: dict[str, npt.NDArray[Any]], ranges_m: Rows) -> Batch:
    """Make the batch of a stretch in which the filter did not run yet."""
    empty = np.empty(0)
    return Batch(
        estimates=dict.fromkeys(tables.ESTIMATES, empty),
        measurements=columns,
        errors=dict.fromkeys(tables.ERRORS, empty),
        ranges_m=ranges_m,
    )
