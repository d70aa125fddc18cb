"""The replay itself: lines of a log in, tables out, a stretch of the log at a time.

:class:`Localiser` is the craft that dead-reckons and ranges to sources, :class:`Tracker` the
station that tracks a craft by range and bearing. Both turn the lines into rows for the C++ loop
(``run`` of the filters); no filter looks at the truth, and no result depends on how the log was
cut into chunks.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

import auvest
from auvest import registry
from auvest._arguments import Floats
from auvest.filters import Aukf, GaussianFilter, RobustEkf, RobustUkf, RunResult, Ukf
from auvest.intervals import CovarianceBudget, FixedInterval, IntervalPolicy, MahalanobisInterval
from auvest.logs import LogError, LogFolder, Stream, merge
from auvest.logs.reader import Rows
from auvest.models import ConstantAcceleration, LeaderRange, Odometry, RangeBearing
from auvest.replay import tables
from auvest.replay.config import FilterName, IntervalSettings, Settings
from auvest.replay.motion import Motion, carry, dead_reckon
from auvest.replay.sources import Sources
from auvest.replay.tables import Batch, Columns
from auvest.replay.thinning import SAME_S, Thinning

#: Velocity odometry is gone through in small steps: so many at once, so that memory stays bounded.
_STEPS = 32768
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
    """

    listener: Callable[[GaussianFilter, Rows, Mapping[str, Any]], None] | None = None
    _measured: str

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        self.log = log
        self.settings = settings
        self.filter_name = filter_name
        reorder_s = settings.log.reorder_s
        names = [self._measured, "odometry.csv", "leaders.csv", "truth.csv"]
        self.streams = {
            name: Stream(
                log[name], reorder_s=reorder_s, required=name in ("odometry.csv", "leaders.csv")
            )
            for name in names
            if name in log
        }
        self.start = self._start()
        self._sources = Sources(log.beacons(), settings.log.leader_gap_s)
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
            for name, rows in chunk.items():
                if name == "odometry.csv":
                    self._add_odometry(rows)
                elif name == "leaders.csv":
                    self._sources.add(rows)
                else:
                    self._waiting[name] = np.concatenate([self._waiting[name], rows])
            limit = self._limit(horizon)
            last = horizon == math.inf
            if limit >= self.start[0] or last:
                *inner, end = self._stretches(limit)
                for stop in inner:
                    yield self._placed(self._advance(stop, last=False))
                yield self._placed(self._advance(end, last=last))
                self._sources.forget(limit)

    def _placed(self, batch: Batch) -> Batch:
        """Say where the sources of the measurements were, while that is known."""
        measured = batch.measurements
        places = self._sources.locate(measured["time_s"], measured["source"].astype(float))
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
    def _add_odometry(self, rows: Rows) -> None: ...

    @abstractmethod
    def _limit(self, horizon: float) -> float:
        """Say up to which time a filter can go if all lines before ``horizon`` are known."""

    def _stretches(self, limit: float) -> list[float]:
        """Cut the way to ``limit`` where it is too long to be gone at once; ends with ``limit``."""
        return [limit]

    @abstractmethod
    def _advance(self, limit: float, *, last: bool) -> Batch: ...

    def _run_rows(self, filter_: GaussianFilter, z: Rows, **rows: Any) -> RunResult:
        """Take the filter through these rows; who listens gets them first."""
        if self.listener is not None:
            self.listener(filter_, z, rows)
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
        table = self.log[name]
        rows, _ = next(table.chunks(), (np.empty((0, 4)), 0))
        if len(rows) == 0:
            raise LogError(table.path, "has no line below the header")
        time, x, y, heading = rows[0].tolist()
        return time, x, y, heading

    def _usable_position(self, horizon: float) -> float:
        """Time up to which positions of leaders can be had."""
        if "leaders.csv" in self.streams:
            horizon -= self._sources.gap_s
        return float(np.nextafter(horizon, -math.inf))

    def _measurements(
        self, rows: Rows, end: float, thinning: Thinning
    ) -> tuple[dict[str, npt.NDArray[Any]], Rows, npt.NDArray[np.bool_]]:
        """Columns for these rows, places of their sources and which of them are used."""
        columns = tables.blank_measurements(len(rows))
        columns["time_s"] = rows[:, 0].copy()
        columns["source"] = rows[:, 1].astype(np.int64)
        places = self._sources.locate(rows[:, 0], rows[:, 1])
        outcome = columns["outcome"]
        outcome[np.isnan(places[:, 0])] = tables.NO_POSITION
        outcome[rows[:, 0] > end] = tables.AFTER_END
        outcome[rows[:, 0] < self.start[0]] = tables.BEFORE_START
        usable = outcome == ""
        passed = thinning.passed(rows[usable, 0], rows[usable, 1])
        held = np.flatnonzero(usable)[~passed]
        outcome[held] = tables.HELD_OUT
        return columns, places, outcome == ""

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

    The state is a pose. The run starts at the pose in start.csv or at the first line of a truth
    that has headings.
    """

    _measured = "ranges.csv"

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        if filter_name == "aukf":
            raise ValueError("filter aukf chooses when to take a fix; this log has ranges: use ukf")
        super().__init__(log, settings, filter_name)
        time, x, y, heading = self.start
        self._now = time
        self._motion = Motion(log["odometry.csv"], time, settings.odometry)
        self._thinning = Thinning(settings.ranges.every_s)
        start, noise = settings.start, settings.odometry
        self._sensor = LeaderRange(sigma_range_m=settings.ranges.sigma_m)
        models: dict[str, Any] = {
            "process": Odometry(
                sigma_distance=noise.sigma_distance,
                sigma_drift=noise.sigma_drift,
                sigma_turn=noise.sigma_turn,
            ),
            "sensors": self._sensor,
        }
        sigmas = [start.sigma_position_m, start.sigma_position_m, start.sigma_heading_rad]
        x0, P0 = np.array([x, y, heading]), np.diag(sigmas) ** 2
        self._filter = _build(filter_name, settings, x0, P0, models)
        # The state at `now`, and the pose by dead reckoning alone.
        self._x: Floats = x0[None]
        self._P: Floats = P0[None]
        self._reckoned = x0[None]

    def _start(self) -> tuple[float, float, float, float]:
        start = self._from_file("start.csv") or self._from_file("truth.csv")
        if start is None:
            raise LogError(
                self.log.path, "has neither start.csv nor a truth.csv with heading_rad: "
                "where does the run start?",
            )  # fmt: skip
        return start

    def _add_odometry(self, rows: Rows) -> None:
        self._motion.add(rows)

    def _limit(self, horizon: float) -> float:
        limit = self._usable_position(horizon)
        if self._motion.increments:
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
        ranges = self._take("ranges.csv", math.inf if last else limit)
        columns, places, used = self._measurements(ranges, limit, self._thinning)
        fused, where = ranges[used], places[used]
        segments = self._motion.until(limit)
        times = self._events(limit, fused[:, 0])
        bounds = np.concatenate([[self._now], times])
        chord, turn = segments.steps(bounds[:-1], np.diff(bounds))

        # A row per step, and after it one per range taken at its end, with no time between.
        after = np.searchsorted(times, fused[:, 0], side="right")
        time = np.insert(times, after, fused[:, 0])
        x: Floats = np.empty((0, 3))
        covariance: Floats = np.empty((0, 3, 3))
        mixture = {name: np.empty(0, np.uint8) for name in tables.MIXTURE}
        located = np.empty(0, bool)
        if len(time):
            motion = np.insert(np.column_stack([chord.real, chord.imag, turn]), after, 0.0, axis=0)
            z = np.insert(np.full(len(times), np.nan), after, fused[:, 2])
            place = np.insert(np.full((len(times), 3), np.nan), after, where, axis=0)
            dt = np.insert(np.diff(bounds), after, 0.0)
            updates, x, covariance, mixture = self._run(z, dt, motion, place)
            _fill(columns, np.flatnonzero(used), updates)
            measured = ~np.isnan(z)
            located = _located(covariance[measured], z[measured], updates["sigma"])

        # The state after the last row of each time, behind that before this stretch.
        final = np.flatnonzero(np.diff(time, append=math.inf) > 0)
        at = np.concatenate([[self._now], time[final]])
        states = np.concatenate([self._x, x[final]])
        spreads = np.concatenate([self._P, covariance[final]])
        poses = dead_reckon(self._reckoned, chord, turn)
        reckoned = poses[np.searchsorted(bounds, at, side="right") - 1]

        held = np.flatnonzero(columns["outcome"] == tables.HELD_OUT)
        predicted = carry(segments, states, at, ranges[held, 0])
        distance = np.hypot(*(predicted - places[held, :2]).T)
        columns["held_out_error_m"][held] = distance - ranges[held, 2]
        truth = self._take("truth.csv", limit)
        truth = truth[truth[:, 0] >= self.start[0]]
        errors = self._errors(
            truth,
            carry(segments, states, at, truth[:, 0]),
            spreads[np.searchsorted(at, truth[:, 0], side="right") - 1],
            carry(segments, reckoned, at, truth[:, 0]),
        )

        self._now, self._x, self._P = float(at[-1]), states[-1:], spreads[-1:]
        self._reckoned = reckoned[-1:]
        self._motion.forget(self._now)
        estimates = _estimates(at[1:], states[1:], states[1:, 2], spreads[1:], reckoned[1:])
        if self._filter.components > 1:
            said, size = (mixture[name][final] for name in tables.MIXTURE)
            named = {"convergence": tables.CONVERGENCES[said], "mixture_size": size}
            estimates = {**estimates, **named}
        return Batch(
            estimates=estimates,
            measurements=columns,
            errors=errors,
            ranges_m=ranges[:, 2],
            located=located,
        )

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

    def _run(
        self, z: Rows, dt: Rows, motion: Rows, place: Rows
    ) -> tuple[dict[str, npt.NDArray[Any]], Floats, Floats, dict[str, npt.NDArray[Any]]]:
        """Rows through the filter: updates, states, covariances, and what it says of its mixture.

        One call per stretch in which the leaders' positions are known equally well.
        """
        spread = np.where(np.isnan(z), -1.0, place[:, 2])
        spread = spread[np.maximum.accumulate(np.where(spread >= 0, np.arange(len(z)), 0))]
        cuts = np.flatnonzero(np.diff(spread)) + 1
        results, sigmas = [], []
        for part in np.split(np.arange(len(z)), cuts):
            sensor = replace(self._sensor, sigma_leader_m=max(float(spread[part[-1]]), 0.0))
            result = self._run_rows(
                self._filter,
                z[part],
                dt=dt[part],
                input=motion[part],
                place=place[part, :2],
                sensor=sensor,
            )
            results.append(result)
            sigma = math.hypot(sensor.sigma_range_m, sensor.sigma_leader_m)
            sigmas.append(np.full(int((~np.isnan(z[part])).sum()), sigma))
        mixture = {}
        if self._filter.components > 1:
            for name in tables.MIXTURE:
                mixture[name] = np.concatenate([getattr(result, name) for result in results])
        return (
            {**updates_of(results), "sigma": np.concatenate(sigmas)},
            np.concatenate([result.x for result in results]),
            np.concatenate([result.P for result in results]),
            mixture,
        )


class Tracker(Replay):
    """A station, or several, that track a craft by range and bearing.

    The state is position, velocity and acceleration. The run starts at the position in start.csv,
    else at the first fix, at rest.
    """

    _measured = "fixes.csv"

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        if settings.filter.components > 1 or settings.filter.headings > 1:
            raise ValueError("[filter] components and headings are for logs of ranges")
        super().__init__(log, settings, filter_name)
        fixes = settings.fixes
        self._process = ConstantAcceleration(**vars(settings.process))
        self._sensor = RangeBearing(
            sigma_range_m=fixes.sigma_range_m,
            sigma_bearing_rad=fixes.sigma_bearing_rad,
            near_field=fixes.near_field,
        )
        self._thinning = Thinning(fixes.every_s)
        self._now = self.start[0]
        self._started = False

    def _start(self) -> tuple[float, float, float, float]:
        start = self._from_file("start.csv")
        return start if start is not None else (-math.inf, math.nan, math.nan, 0.0)

    def _add_odometry(self, rows: Rows) -> None:
        raise AssertionError(f"a tracked craft has no odometry, but {len(rows)} lines came")

    def _limit(self, horizon: float) -> float:
        return self._usable_position(horizon)

    def _begin(self, time: float, position: Rows) -> None:
        self.start = (time, float(position[0]), float(position[1]), 0.0)
        s = self.settings.start
        sigmas = [s.sigma_position_m, s.sigma_speed_m_s, s.sigma_acceleration_m_s2]
        x0 = np.array([*position, 0.0, 0.0, 0.0, 0.0])
        P0 = np.diag(np.repeat(sigmas, 2)) ** 2
        models: dict[str, Any] = {"process": self._process, "sensors": self._sensor}
        if self.filter_name == "aukf":
            policy = interval_policy(self.settings.interval)
            alpha = self.settings.filter.alpha
            self._filter: GaussianFilter = Aukf(x0, P0, policy=policy, alpha=alpha, **models)
        else:
            self._filter = _build(self.filter_name, self.settings, x0, P0, models)
        self._now, self._started = time, True
        self._x: Floats = x0[None]
        self._P: Floats = P0[None]

    def _advance(self, limit: float, *, last: bool) -> Batch:  # noqa: ARG002
        fixes = self._take("fixes.csv", limit)
        columns, places, used = self._measurements(fixes, math.inf, self._thinning)
        seen = places[:, :2] + fixes[:, 2:3] * np.column_stack(
            [np.cos(fixes[:, 3]), np.sin(fixes[:, 3])]
        )
        if not self._started and math.isfinite(self.start[0]):
            self._begin(self.start[0], np.array(self.start[1:3]))
        if not self._started and used.any():
            first = int(np.argmax(used))
            self._begin(float(fixes[first, 0]), seen[first])
            columns["outcome"][first] = tables.ACCEPTED
            used[first] = False
        if not self._started:
            return _nothing(columns, fixes[:, 2])

        if isinstance(self._filter, Aukf):
            x, covariance, used = self._sample(self._filter, fixes, places, used, columns)
        else:
            x, covariance = self._fuse(self._filter, fixes[used], places[used], used, columns)
        at = np.concatenate([[self._now], fixes[used, 0]])
        states = np.concatenate([self._x, x])
        spreads = np.concatenate([self._P, covariance])
        held = np.flatnonzero(columns["outcome"] == tables.HELD_OUT)
        predicted = self._carry(states, at, fixes[held, 0])
        columns["held_out_error_m"][held] = np.hypot(*(predicted - seen[held]).T)

        truth = self._take("truth.csv", limit)
        truth = truth[truth[:, 0] >= self.start[0]]
        last_row = np.searchsorted(at, truth[:, 0], side="right") - 1
        nowhere = np.full((len(truth), 2), np.nan)
        position = self._carry(states, at, truth[:, 0])
        self._now, self._x, self._P = float(at[-1]), states[-1:], spreads[-1:]
        course = np.arctan2(states[1:, 3], states[1:, 2])
        return Batch(
            estimates=_estimates(at[1:], states[1:], course, spreads[1:], None),
            measurements=columns,
            errors=self._errors(truth, position, spreads[last_row], nowhere),
            ranges_m=fixes[:, 2],
        )

    def _fuse(
        self,
        tracker: GaussianFilter,
        fixes: Rows,
        places: Rows,
        used: npt.NDArray[np.bool_],
        columns: dict[str, npt.NDArray[Any]],
    ) -> tuple[Floats, Floats]:
        """Update with these fixes: states and covariances after each."""
        if len(fixes) == 0:
            return np.empty((0, 6)), np.empty((0, 6, 6))
        dt = np.diff(fixes[:, 0], prepend=self._now)
        result = self._run_rows(tracker, fixes[:, 2:4], dt=dt, place=places[:, :2])
        _fill(columns, np.flatnonzero(used), updates_of([result]))
        return result.x, result.P

    def _sample(
        self,
        tracker: Aukf,
        fixes: Rows,
        places: Rows,
        offered: npt.NDArray[np.bool_],
        columns: dict[str, npt.NDArray[Any]],
    ) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        """Update with the fixes that the filter's interval asks for; hold out the others."""
        used = np.zeros_like(offered)
        states: list[Floats] = [np.empty((0, 6))]
        spreads: list[Floats] = [np.empty((0, 6, 6))]
        now = self._now
        for k in np.flatnonzero(offered).tolist():
            if fixes[k, 0] - now < tracker.interval - SAME_S:
                columns["outcome"][k] = tables.HELD_OUT
                continue
            station = (float(places[k, 0]), float(places[k, 1]))
            if self.listener is not None:
                row = {"dt": fixes[k : k + 1, 0] - now, "place": places[k : k + 1, :2]}
                self.listener(tracker, fixes[k : k + 1, 2:4], row)
            tracker.predict(fixes[k, 0] - now)
            tracker.update(fixes[k, 2:4], place=station)
            tracker.feedback()
            now, used[k] = float(fixes[k, 0]), True
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

    def _carry(self, states: Rows, at: Rows, time_s: Rows) -> Rows:
        """Predicted positions at these times, each from the last state before it."""
        k = np.searchsorted(at, time_s, side="right") - 1
        dt = (time_s - at[k])[:, None]
        half_square = 0.5 * dt * dt
        return states[k, 0:2] + dt * states[k, 2:4] + half_square * states[k, 4:6]


def _build(
    name: FilterName, settings: Settings, x0: Rows, P0: Rows, models: dict[str, Any]
) -> GaussianFilter:
    """Make the filter of this name, with what the settings say of its kind."""
    entry = registry.filter_named(name, registry.replayable())
    kind: type[GaussianFilter] = getattr(auvest, entry.cls)
    models["longest_step_s"] = settings.filter.longest_step_s
    models["components"] = settings.filter.components
    models["headings"] = settings.filter.headings
    if issubclass(kind, (RobustEkf, RobustUkf)):
        models["kernel"] = settings.filter.kernel
    if issubclass(kind, Ukf):
        models["alpha"] = settings.filter.alpha
    return kind(x0, P0, **models)


def interval_policy(settings: IntervalSettings) -> IntervalPolicy:
    """Build the interval policy that the settings describe."""
    if settings.policy == "fixed":
        return FixedInterval(interval_s=settings.interval_s)
    low, high = settings.min_s, settings.max_s
    if settings.policy == "mahalanobis":
        return MahalanobisInterval(initial_s=low, min_s=low, max_s=high)
    sigma = settings.position_sigma_m
    return CovarianceBudget(initial_s=low, min_s=low, max_s=high, position_sigma_m=sigma)


def updates_of(results: list[RunResult]) -> dict[str, npt.NDArray[Any]]:
    """Gather what the updates in these results reported, a row per measurement."""
    columns: dict[str, npt.NDArray[Any]] = {}
    there = np.concatenate([~np.isnan(result.nis) for result in results])
    for name in ("innovation", "S", "weight", "nis", "near_field", "decision", "recovered"):
        columns[name] = np.concatenate([getattr(result, name) for result in results])[there]
    return columns


def _fill(
    columns: dict[str, npt.NDArray[Any]],
    rows: npt.NDArray[np.intp],
    updates: dict[str, npt.NDArray[Any]],
) -> None:
    """Write what the updates reported into the rows of the measurement table."""
    for m in range(updates["innovation"].shape[1]):
        columns[f"innovation_{m}"][rows] = updates["innovation"][:, m]
        columns[f"sigma_{m}"][rows] = np.sqrt(updates["S"][:, m, m])
        columns[f"weight_{m}"][rows] = updates["weight"][:, m]
    columns["nis"][rows] = updates["nis"]
    columns["near_field"][rows] = updates["near_field"]
    columns["recovered"][rows] = updates["recovered"]
    columns["outcome"][rows] = tables.DECISIONS[updates["decision"]]


def replay_of(log: LogFolder, settings: Settings, filter_name: FilterName) -> Replay:
    """Make the replay that a log is for."""
    return (Tracker if log.tracking else Localiser)(log, settings, filter_name)


def _estimates(
    time_s: Floats, states: Floats, heading: Floats, covariance: Floats, reckoned: Floats | None
) -> Columns:
    unknown = np.full(len(time_s), np.nan)
    return {
        "time_s": time_s,
        "x_m": states[:, 0],
        "y_m": states[:, 1],
        "heading_rad": heading,
        "var_x_m2": covariance[:, 0, 0],
        "cov_xy_m2": covariance[:, 0, 1],
        "var_y_m2": covariance[:, 1, 1],
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
