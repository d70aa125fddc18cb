"""The replay of a slave that hears echoes: it localises itself and tracks the masters.

Lines of the log become the record that ``run`` of the SLAT filters takes. A master that
masters.csv does not tell of is known from its first echo on, which says where it is.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import auvest
from auvest import registry
from auvest._arguments import Floats
from auvest.logs import LogError, LogFolder
from auvest.logs.findings import Finding, finding
from auvest.logs.reader import Rows
from auvest.models import ConstantAcceleration
from auvest.replay import tables
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import Replay
from auvest.replay.motion import lengths_of, wrapped
from auvest.replay.readings import Held
from auvest.replay.sources import Sources
from auvest.replay.tables import Batch, Columns
from auvest.slat import (
    UNKNOWN_MASTER,
    DeadReckoning,
    EkfSlat,
    OverconfidenceWarning,
    ParticleSlatFilter,
    Slatf,
    SlatFilter,
    SlatfJoint,
    SlatRun,
)
from auvest.slat.models import (
    CompassMotion,
    ConstantVelocity,
    CoordinatedTurn,
    Imm,
    Master,
    Motion,
    PiecewiseAcceleration,
    Sonar,
    UnicycleMotion,
)

#: Steps that are gone through at once: a step has some kilobytes of results.
_STEPS = 4096
#: The slave among the sources of truths.
_SLAVE = -1


class Companion(Replay):
    """A slave that dead-reckons and hears the echoes of masters.

    The state is a pose, without a heading where the odometry tells it. The run starts as that of a
    craft that ranges does.
    """

    _own_files = ("echoes.csv", "plans.csv", "master_truth.csv")

    def __init__(self, log: LogFolder, settings: Settings, filter_name: FilterName) -> None:
        names = set(log["odometry.csv"].names)
        self._compass = not {"turn_rad", "yaw_rate_rad_s"} & names
        self._increments = "forward_m" in names
        super().__init__(log, settings, filter_name)
        time, x, y, heading = self.start
        self._now = time
        motion = _motion(settings, compass=self._compass)
        start = settings.start
        sigmas = [start.sigma_position_m, start.sigma_position_m, start.sigma_heading_rad]
        pose = motion.pose_states
        x0, P0 = np.array([x, y, heading])[:pose], np.diag(sigmas[:pose]) ** 2
        self._sonar = _sonar(settings, motion)
        self._slat = _build(filter_name, settings, x0, P0, motion, self._sonar)
        self._reckoning = DeadReckoning(
            x0, np.zeros_like(P0), motion=motion, dtype=self._slat.dtype,
            longest_step_s=settings.filter.longest_step_s,
        )  # fmt: skip
        gap_s = math.inf if self._increments else settings.odometry.gap_s
        self._readings = Held(2, gap_s, (True, not self._compass))
        self._line_s = time  # where the last line of increments ends
        self._headed = math.nan
        self._plans: dict[int, Held] = {}
        self._truths = Sources({}, settings.log.leader_gap_s)
        self._numbers: dict[int, int] = {}  # of the masters in the filter, by source
        self._told = self._told_masters()
        self._nameless = "source" not in log["echoes.csv"].names
        births = settings.slat.birth_velocity_m_s > 0 and isinstance(self._slat, Slatf)
        self._alone = self._nameless and not self._told and not births
        self._counts = (0, 0)  # echoes refused and masters born again so far

    @property
    def filter(self) -> SlatFilter:
        """What localises the slave and tracks the masters."""
        return self._slat

    def _start(self) -> tuple[float, float, float, float]:
        for name in ("start.csv", "truth.csv"):
            if name not in self.log:
                continue
            if self._compass:
                return (*self._first_place(name), 0.0)
            start = self._from_file(name)
            if start is not None:
                return start
        pose = "" if self._compass else " with heading_rad"
        raise LogError(
            self.log.path,
            f"has neither start.csv nor truth.csv{pose}: where does the run start?",
        )

    def _told_masters(self) -> list[tuple[float, int, Floats, Floats]]:
        """Give when which master is told of, and what: mean and covariance."""
        if "masters.csv" not in self.log:
            return []
        table, s = self.log["masters.csv"], self.settings.masters
        rows = table.whole()
        names = ("x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2")
        means = np.column_stack([table.column(rows, name, 0.0) for name in names])
        sigmas = np.column_stack(
            [table.column(rows, name, default) for name, default in (
                ("sigma_m", s.sigma_m), ("sigma_velocity_m_s", s.sigma_velocity_m_s),
                ("sigma_acceleration_m_s2", s.sigma_acceleration_m_s2),
            )]
        )  # fmt: skip
        told: list[tuple[float, int, Floats, Floats]] = []
        for k, source in enumerate(table.sources(rows)):
            covariance = np.diag(np.repeat(sigmas[k], 2) ** 2)
            told.append((max(float(rows[k, 0]), self.start[0]), source, means[k], covariance))
        return sorted(told, key=lambda one: one[0])

    def _add_odometry(self, rows: Rows, headings: Rows | None, *, last: bool) -> None:  # noqa: ARG002
        table, s = self.log["odometry.csv"], self.settings
        time = rows[:, 0]
        if self._increments:
            kept = time > self._line_s
            time, moved = time[kept], rows[kept]
            edges = np.concatenate([[self._line_s], time])
            lengths = lengths_of(table, edges)
            steps = np.column_stack([moved[:, 1], table.column(moved, "turn_rad")])
            self._readings.add(edges[:-1], steps / lengths[:, None])
            self._line_s = float(time[-1]) if len(time) else self._line_s
            return
        if self._compass:
            turning = table.column(rows, "heading_rad") + s.compass.offset_rad
            if s.slave.mean_s > 0 and len(turning):  # else a mean of headings says nothing
                first = turning[0] if math.isnan(self._headed) else self._headed
                turning = np.unwrap(np.concatenate([[first], turning]))[1:]
                self._headed = float(turning[-1])
        else:
            turning = table.column(rows, "yaw_rate_rad_s")
        self._readings.add(time, np.column_stack([rows[:, 1], turning]))
        self._line_s = float(time[-1]) if len(time) else self._line_s

    def _limit(self, horizon: float) -> float:
        self._hold_plans()
        self._keep_truths()
        if horizon == math.inf:
            heard = self._waiting["echoes.csv"]
            if self._increments or not len(heard):
                return self._line_s
            return max(self._line_s, float(heard[-1, 0]))
        if {"truth.csv", "master_truth.csv"} & set(self.streams):
            horizon -= self._truths.gap_s
        limit = float(np.nextafter(horizon, -math.inf))
        if self._increments:
            limit = min(limit, self._line_s)
        if self.settings.slave.mean_s > 0:  # steps are parts of the time from echo to echo
            heard_s = self._waiting["echoes.csv"][:, 0]
            k = int(np.searchsorted(heard_s, limit, side="right"))
            limit = float(heard_s[k - 1]) if k else -math.inf
        return limit

    def _hold_plans(self) -> None:
        """Take the masters' plans as far as they are known."""
        rows = self._take("plans.csv", math.inf)
        for source in np.unique(rows[:, 1]).astype(int).tolist():
            mine = rows[rows[:, 1] == source]
            self._plans.setdefault(source, Held(2)).add(mine[:, 0], mine[:, 2:4])

    def _keep_truths(self) -> None:
        """Take the truth as far as it is known."""
        if "truth.csv" in self.streams:
            own = self._take("truth.csv", math.inf)
            self._truths.add(np.insert(own[:, :3], 1, _SLAVE, axis=1))
        if "master_truth.csv" in self.streams:
            self._truths.add(self._take("master_truth.csv", math.inf))

    def _stretches(self, limit: float) -> list[float]:
        edges = self._edges(limit)
        return [*edges[_STEPS:-1:_STEPS].tolist(), limit]

    def _edges(self, limit: float) -> Rows:
        """Give the times at which steps end, from now on and up to a limit."""
        heard = np.unique(self._waiting["echoes.csv"][:, 0])
        told = [time for time, _, _, _ in self._told]
        heard = np.unique(np.concatenate([heard, told]))
        heard = heard[(heard > self._now) & (heard <= limit)]
        mean_s = self.settings.slave.mean_s
        if mean_s == 0:
            parts = [
                self._readings.until(limit),
                *(one.until(limit) for one in self._plans.values()),
            ]
            lines = np.concatenate([*parts, [self._line_s] * self._increments])
            return np.unique(np.concatenate([heard, lines[(lines > self._now) & (lines <= limit)]]))
        ends = np.append(heard, limit) if limit > max([self._now, *heard[-1:]]) else heard
        parts = [np.empty(0)]
        for begin, end in zip([self._now, *ends[:-1]], ends, strict=False):
            steps = max(1, round((end - begin) / mean_s))
            parts.append(np.linspace(begin, end, steps + 1)[1:])
        return np.concatenate(parts)

    def _advance(self, limit: float, *, last: bool) -> Batch:
        edges = np.concatenate([[self._now], self._edges(limit)])
        rows = self._take("echoes.csv", math.inf if last else limit)
        columns, used, heard = self._heard(rows, float(edges[-1]))
        u = self._read(edges)
        way = self._go(edges, u, heard)
        self._judge(way, heard, used, columns)
        at = edges[1:]
        reckoned = self._reckoning.run(edges, u).x[:, :2] if len(u) else np.empty((0, 2))
        truth = self._truths.locate(at, np.full(len(at), float(_SLAVE)))[:, :2]
        known = ~np.isnan(truth[:, 0])
        compared = np.column_stack([at, truth])[known]
        errors = self._errors(compared, way.x[known, :2], way.P[known], reckoned[known])
        self._now = float(edges[-1])
        self._readings.forget(self._now)
        for plan in self._plans.values():
            plan.forget(self._now)
        masters = self._table(way, at, truth)
        self._truths.forget(self._now)
        places = np.full((len(rows), 2), np.nan)
        places[used] = heard.place
        return Batch(
            estimates={
                "time_s": at,
                **tables.pose(way.x, way.P, *self._heading(way, u)),
                "dead_reckoned_x_m": reckoned[:, 0],
                "dead_reckoned_y_m": reckoned[:, 1],
            },
            measurements=columns,
            errors=errors,
            ranges_m=columns.pop("range_m"),
            places=places,
            masters=masters,
        )

    def findings(self) -> list[Finding]:
        """Say that particles were resampled too often."""
        if not isinstance(self._slat, Slatf) or not self._slat.overconfident:
            return []
        message = (
            f"{self._slat.resamplings} resamplings of {self._slat.particles} particles: the "
            "covariance is too small; take slatf-joint, or more particles"
        )
        return [finding("overconfident", message)]

    def _with_places(self, batch: Batch) -> Batch:
        return batch  # they are where the filter believes the masters to be

    def _heard(
        self, rows: Rows, end: float
    ) -> tuple[dict[str, npt.NDArray[Any]], npt.NDArray[np.intp], _Heard]:
        """Give the columns of echoes, which of them are used, and these."""
        table = self.log["echoes.csv"]
        columns = tables.blank_measurements(len(rows))
        columns["time_s"] = rows[:, 0]
        columns["sensor"][:] = tables.SENSORS[tables.ECHO]
        columns["range_m"] = table.column(rows, "range_m")
        unnamed = 0 if self._alone else UNKNOWN_MASTER
        columns["source"] = table.column(rows, "source", unnamed).astype(np.int64)
        outcome = columns["outcome"]
        for time, source, _, _ in self._told:  # of which nothing is known before
            early = rows[:, 0] <= time if time > self.start[0] else rows[:, 0] < time
            outcome[early & (columns["source"] == source)] = tables.NO_POSITION
        outcome[rows[:, 0] > end] = tables.AFTER_END
        outcome[rows[:, 0] < self.start[0]] = tables.BEFORE_START
        used = np.flatnonzero(outcome == "")
        z = np.column_stack([columns["range_m"], table.column(rows, "bearing_rad")])
        return columns, used, _Heard.of(rows[used, 0], z[used], columns["source"][used])

    def _read(self, edges: Rows) -> Rows:
        """Give the calibrated readings of the steps between these times."""
        if len(edges) < 2:
            return np.empty((0, 2))
        s, turns = self.settings.odometry, not self._compass
        factors = (s.speed_factor, s.turn_factor if turns else 1.0)
        offset = (0.0, s.turn_offset_rad_s if turns else 0.0)
        if self.settings.slave.mean_s > 0:
            return self._readings.means(edges, factors) + offset
        read: Rows = np.array(factors) * self._readings.at(edges[:-1]) + offset
        return read

    def _go(self, edges: Rows, u: Rows, heard: _Heard) -> _Way:
        """Take the filter along; masters come in where they are told of, or heard first."""
        parts: list[tuple[Floats, Floats, SlatRun]] = []
        k = 0
        for j in self._meetings(edges, heard):
            if j > k:
                parts.append(self._run(edges[k : j + 1], u[k:j], heard))
                k = j
            self._meet(float(edges[j]), heard)
        if k < len(u):
            parts.append(self._run(edges[k:], u[k:], heard))
        way = _Way.joined(parts, edges, u, self._slat, self._counts)
        self._counts = (self._slat.refused, self._slat.rebirths)
        return way

    def _meetings(self, edges: Rows, heard: _Heard) -> list[int]:
        """Give the numbers of the edges at which masters come in, or echoes of the very start."""
        known = [*self._numbers, *(source for _, source, _, _ in self._told), UNKNOWN_MASTER]
        new = ~np.isin(heard.source, known)
        _, first = np.unique(heard.source[new], return_index=True)
        times = heard.time_s[new][first].tolist()
        times += [time for time, _, _, _ in self._told if time <= edges[-1]]
        times += heard.time_s[heard.time_s == edges[0]].tolist()
        return np.unique(np.searchsorted(edges, times)).tolist()

    def _meet(self, time: float, heard: _Heard) -> None:
        """Add the masters that come in at a time; at the very start take in the other echoes."""
        while self._told and self._told[0][0] <= time:
            _, source, mean, covariance = self._told.pop(0)
            self._add(source, mean, covariance)
        now = heard.time_s == time
        for k in np.flatnonzero(now).tolist():
            source = int(heard.source[k])
            if source == UNKNOWN_MASTER or source in self._numbers:
                continue
            s = self.settings.masters
            pose = self._slat.x.astype(np.float64), self._slat.P.astype(np.float64)
            mean, covariance = first_seen(
                *pose, heard.z[k], self._sonar, velocity_m_s=s.sigma_velocity_m_s,
                acceleration_m_s2=s.sigma_acceleration_m_s2,
            )  # fmt: skip
            self._add(source, mean, covariance)
            heard.first[k], heard.place[k] = True, mean[:2]
        now &= ~heard.first
        if time == self.start[0] and now.any():
            self._slat.update(heard.z[now], self._numbered(heard.source[now]))

    def _add(self, source: int, mean: Floats, covariance: Floats) -> None:
        most = self.settings.slat.max_masters
        if isinstance(self._slat, SlatfJoint) and len(self._numbers) == most:
            raise ValueError(f"[slat] max_masters is {most}, and source {source} is one more")
        self._numbers[source] = self._slat.add_master(mean, covariance)

    def _numbered(self, sources: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Give the numbers of sources in the filter."""
        known = {**self._numbers, UNKNOWN_MASTER: UNKNOWN_MASTER}
        return np.array([known[source] for source in sources.tolist()], np.int64)

    def _run(self, edges: Rows, u: Rows, heard: _Heard) -> tuple[Floats, Floats, SlatRun]:
        """Go through some steps; the slave and the masters that there are before, and results."""
        x = self._slat.x
        masters = [self._slat.master(n)[0] for n in range(self._slat.masters)]
        options: dict[str, Any] = {}
        mine = (heard.time_s > edges[0]) & (heard.time_s <= edges[-1])
        mine &= np.isin(heard.source, [*self._numbers, UNKNOWN_MASTER])  # not heard first just then
        if mine.any():
            numbers = self._numbered(heard.source[mine])
            options = {"z": heard.z[mine], "z_time_s": heard.time_s[mine], "master": numbers}
        if self._plans and masters:
            options["changes"] = self._changes(edges)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OverconfidenceWarning)  # said by findings
            run = self._slat.run(edges, u, **options)
        return x, np.array(masters).reshape(-1, 6), run

    def _changes(self, edges: Rows) -> Floats:
        """Give the velocity changes that masters plan for each step."""
        steps = np.diff(edges)[:, None]
        changes = np.zeros((len(steps), self._slat.masters, 2))
        mean = self.settings.slave.mean_s > 0
        for source, plan in self._plans.items():
            if source in self._numbers:
                planned = plan.means(edges) if mean else plan.at(edges[:-1])
                changes[:, self._numbers[source]] = planned * steps
        return changes

    def _judge(
        self,
        way: _Way,
        heard: _Heard,
        used: npt.NDArray[np.intp],
        columns: dict[str, npt.NDArray[Any]],
    ) -> None:
        """Say what became of echoes.

        The core counts those of each time that were refused: they are taken for those that lie
        farthest from where the master was expected.
        """
        row = np.searchsorted(way.time_s, heard.time_s, side="left")
        later = (heard.time_s > self._now) & ~heard.first
        named = np.flatnonzero(later & (heard.source != UNKNOWN_MASTER))
        innovation = np.full((len(used), 2), np.nan)
        if len(named):
            number = self._numbered(heard.source[named])
            expected = way.expected(row[named], number, self._slat.motion, self._sonar)
            innovation[named] = heard.z[named] - expected
            innovation[named, 1] = wrapped(innovation[named, 1])
            heard.place[named] = way.masters_x[row[named], number, :2]
        off = innovation / [self._sonar.sigma_range_m, self._sonar.sigma_bearing_rad]
        square = np.nan_to_num((off * off).sum(axis=1), nan=-1.0)
        refused, reborn = np.zeros(len(used), bool), np.zeros(len(used), bool)
        for r in np.unique(row[later]).tolist():
            mine = np.flatnonzero(later & (row == r))
            farthest = mine[np.argsort(-square[mine], kind="stable")]
            refused[farthest[: way.refused[r]]] = True
            reborn[farthest[: way.reborn[r]]] = True
            # Of several echoes the core tells one NIS, not how much is whose; of a rebirth none.
            shared = len(mine) == 1 or way.refused[r] == 0
            if isinstance(self._slat, EkfSlat) and shared and way.reborn[r] == 0:
                heard.nis[mine] = way.nis[r] / len(mine)
        columns["outcome"][used] = np.where(refused, tables.REJECTED, tables.ACCEPTED)
        columns["recovered"][used] = reborn
        columns["nis"][used] = heard.nis
        for m in range(2):
            columns[f"innovation_{m}"][used] = innovation[:, m]
            columns[f"weight_{m}"][used] = np.where(refused, 0.0, 1.0)

    def _heading(self, way: _Way, u: Rows) -> tuple[Floats, Floats]:
        """Give headings and their standard deviations; those of the odometry, where it has them."""
        if self._compass:
            return u[:, 1], np.full(len(u), self.settings.slave.sigma_heading_rad)
        return way.x[:, 2], np.sqrt(way.P[:, 2, 2])

    def _table(self, way: _Way, at: Rows, truth: Rows) -> Columns:
        """Give the rows of masters, step by step."""
        sources = {number: source for source, number in self._numbers.items()}
        free = max(self._numbers, default=-1) + 1  # masters that are born have no number in the log
        parts: list[dict[str, npt.NDArray[Any]]] = []
        for n in range(way.masters_x.shape[1]):
            there = np.flatnonzero(~np.isnan(way.masters_x[:, n, 0]))
            source = sources.get(n, free + n)
            x, P = way.masters_x[there, n], way.masters_P[there, n]
            where = np.full(len(there), float(source))
            error = x[:, :2] - self._truths.locate(at[there], where)[:, :2]
            relative = error - (way.x[there, :2] - truth[there])
            numbers = (
                at[there], np.full(len(there), source), *x[:, :4].T, P[:, 0, 0], P[:, 0, 1],
                P[:, 1, 1], *error.T, np.hypot(*relative.T),
            )  # fmt: skip
            parts.append({**dict(zip(tables.MASTERS, numbers, strict=True)), "row": there})
        if not parts:
            return {name: np.empty(0, np.int64 if name == "source" else float)
                    for name in tables.MASTERS}  # fmt: skip
        order = np.argsort(np.concatenate([part["row"] for part in parts]), kind="stable")
        return {
            name: np.concatenate([part[name] for part in parts])[order] for name in tables.MASTERS
        }


@dataclass(frozen=True)
class _Heard:
    """Echoes of a stretch of the log that are used, in the order of time."""

    time_s: Rows
    z: Rows
    source: npt.NDArray[np.int64]
    first: npt.NDArray[np.bool_]  # by which its master is known
    place: Rows  # where the filter believes its master to be
    nis: Rows

    @staticmethod
    def of(time_s: Rows, z: Rows, source: npt.NDArray[np.int64]) -> _Heard:
        count = len(time_s)
        place, nis = np.full((count, 2), np.nan), np.full(count, np.nan)
        return _Heard(time_s, z, source, np.zeros(count, bool), place, nis)


@dataclass(frozen=True)
class _Way:
    """What the filter says after each step, and what it said before."""

    time_s: Rows
    x: Floats
    P: Floats
    masters_x: Floats
    masters_P: Floats
    before_x: Floats
    before_masters: Floats
    u: Rows
    dt: Rows
    nis: Floats
    refused: npt.NDArray[np.int64]  # in each step
    reborn: npt.NDArray[np.int64]

    @staticmethod
    def joined(
        parts: list[tuple[Floats, Floats, SlatRun]],
        edges: Rows,
        u: Rows,
        filter_: SlatFilter,
        counts: tuple[int, int],
    ) -> _Way:
        """Join runs, each with the slave and the masters that there were before it."""
        pose, most = filter_.motion.pose_states, filter_.masters

        def whole(rows: list[Floats], *shape: int) -> Floats:
            return np.concatenate([np.empty((0, *shape)), *rows])

        def padded(masters: Floats) -> Floats:
            missing = [(0, 0)] * masters.ndim
            missing[1] = (0, most - masters.shape[1])
            return np.pad(masters, missing, constant_values=np.nan)

        runs = [run for _, _, run in parts]
        before = [padded(masters[None]) for _, masters, _ in parts]
        after = [padded(run.masters_x) for run in runs]
        counted = [
            np.diff(np.concatenate([[count], *(getattr(run, name) for run in runs)]))
            for count, name in zip(counts, ("refused", "rebirths"), strict=True)
        ]
        return _Way(
            time_s=edges[1:],
            x=whole([run.x for run in runs], pose),
            P=whole([run.P for run in runs], pose, pose),
            masters_x=whole(after, most, 6),
            masters_P=whole([padded(run.masters_P) for run in runs], most, 6, 6),
            before_x=whole([np.concatenate([x[None], run.x[:-1]]) for x, _, run in parts], pose),
            before_masters=whole(
                [np.concatenate([first, x[:-1]]) for first, x in zip(before, after, strict=True)],
                most,
                6,
            ),
            u=u,
            dt=np.diff(edges),
            nis=whole([run.nis for run in runs]),
            refused=counted[0].astype(np.int64),
            reborn=counted[1].astype(np.int64),
        )

    def expected(
        self, row: npt.NDArray[np.intp], number: npt.NDArray[np.int64], motion: Motion, sonar: Sonar
    ) -> Floats:
        """Give range and bearing at the end of steps, as the means before them have it."""
        x, u, dt = self.before_x[row], self.u[row], self.dt[row]
        way: Floats = dt * u[:, 0]
        course: Floats = u[:, 1] if isinstance(motion, CompassMotion) else x[:, 2]
        heading: Floats = x[:, -1] + dt * u[:, 1]  # of a pose that has one
        if isinstance(motion, CompassMotion) and motion.compensate_bias:
            way = way * math.exp(0.5 * motion.sigma_heading_rad**2)
        slave = x[:, :2] + way[:, None] * np.column_stack([np.cos(course), np.sin(course)])
        master = self.before_masters[row, number]
        step = dt[:, None]
        place = master[:, :2] + step * master[:, 2:4] + 0.5 * step * step * master[:, 4:6]
        dx, dy = (place - slave).T
        bearing = np.arctan2(dy, dx)
        if sonar.bearing == "from_heading":
            bearing = bearing - heading
        elif sonar.bearing == "master_to_slave":
            bearing = bearing + math.pi
        return np.column_stack([np.hypot(dx, dy), bearing])


def first_seen(
    pose: Floats,
    covariance: Floats,
    z: Floats,
    sonar: Sonar,
    *,
    velocity_m_s: float,
    acceleration_m_s2: float,
) -> tuple[Floats, Floats]:
    """Give the belief (6,), (6, 6) of a master by its first echo.

    Parameters
    ----------
    pose, covariance : ndarray
        The slave then.
    z : ndarray, shape (2,)
        Range (m) and bearing (rad).
    sonar : Sonar
        What they are, and their noise.
    velocity_m_s, acceleration_m_s2 : float
        Standard deviations of the master's, about zero.
    """
    turned = {"from_heading": pose[-1], "slave_to_master": 0.0, "master_to_slave": math.pi}
    direction = turned[sonar.bearing] + z[1]
    ahead = np.array([np.cos(direction), np.sin(direction)])
    aside = np.array([-ahead[1], ahead[0]])
    state = np.zeros(6)
    state[:2] = pose[:2] + z[0] * ahead
    spread = np.diag(np.repeat([0, velocity_m_s, acceleration_m_s2], 2).astype(float) ** 2)
    spread[:2, :2] = sonar.sigma_range_m**2 * np.outer(ahead, ahead)
    spread[:2, :2] += (z[0] * sonar.sigma_bearing_rad) ** 2 * np.outer(aside, aside)
    carried = np.eye(2, len(pose))
    if sonar.bearing == "from_heading":
        carried[:, 2] = z[0] * aside
    spread[:2, :2] += carried @ covariance @ carried.T
    return state, spread


def _motion(settings: Settings, *, compass: bool) -> Motion:
    s = settings.slave
    speed = {} if s.sigma_speed_m_s is None else {"sigma_speed_m_s": s.sigma_speed_m_s}
    if compass:
        return CompassMotion(
            sigma_heading_rad=s.sigma_heading_rad, compensate_bias=s.compensate_bias, **speed
        )
    return UnicycleMotion(sigma_yaw_rate_rad_s=s.sigma_yaw_rate_rad_s, **speed)


def _sonar(settings: Settings, motion: Motion) -> Sonar:
    s = settings.sonar
    heading = isinstance(motion, UnicycleMotion)
    if s.bearing == "from_heading" and not heading:
        raise ValueError(
            "[sonar] bearing = 'from_heading' needs a heading in the pose, and odometry.csv has "
            "headings, not turns: take slave_to_master"
        )
    return Sonar(
        sigma_range_m=s.sigma_range_m,
        sigma_bearing_rad=s.sigma_bearing_rad,
        bearing=s.bearing or ("from_heading" if heading else "slave_to_master"),
        smallest_range_m=s.smallest_m,
        largest_range_m=s.largest_m,
    )


def _master(settings: Settings) -> Master:
    s = settings.masters
    if s.model == "piecewise":
        return PiecewiseAcceleration(
            acceleration_m_s2=s.acceleration_m_s2, position_psd=s.position_psd
        )
    return Imm(
        straight=ConstantVelocity(
            velocity_psd=s.straight_velocity_psd,
            sigma_acceleration_m_s2=s.straight_sigma_acceleration_m_s2,
        ),
        accelerated=ConstantAcceleration(
            position_psd=s.accelerated_position_psd,
            velocity_psd=s.accelerated_velocity_psd,
            acceleration_psd=s.accelerated_acceleration_psd,
        ),
        turning=CoordinatedTurn(
            position_psd=s.turning_position_psd,
            velocity_psd=s.turning_velocity_psd,
            acceleration_psd=s.turning_acceleration_psd,
            slow_m_s=s.turning_slow_m_s,
        ),
        share=(s.share_straight, s.share_accelerated, s.share_turning),
        switch_rate_hz=s.switch_rate_hz,
    )


def _build(
    name: FilterName, settings: Settings, x0: Rows, P0: Rows, motion: Motion, sonar: Sonar
) -> SlatFilter:
    """Make the filter of this name, with what the settings say of its kind."""
    kind: type[SlatFilter] = getattr(auvest, registry.FILTERS[name].cls)
    s, master = settings.slat, _master(settings)
    if issubclass(kind, SlatfJoint) and isinstance(master, Imm):
        raise ValueError("filter slatf-joint takes [masters] model = 'piecewise', not 'imm'")
    common = (
        "gate", "recover_after", "recover_of", "fastest_m_s", "forget_after_s",
        "rebirth_velocity_m_s", "rebirth_acceleration_m_s2",
    )  # fmt: skip
    own: tuple[str, ...] = ()
    if issubclass(kind, ParticleSlatFilter):
        own = ("particles", "seed", "stream", "resampling", "resample_below")
    if issubclass(kind, Slatf):
        own += ("monte_carlo", "carry_covariance", "birth_velocity_m_s", "birth_acceleration_m_s2")
    elif issubclass(kind, SlatfJoint):
        own += ("covariance", "max_masters", *(["kept"] if s.kept is not None else []))
    else:
        own += ("consider",)
    options: dict[str, Any] = {key: getattr(s, key) for key in (*common, *own)}
    if issubclass(kind, Slatf):
        options["version"] = 1 if name == "slatf1" else 2
    return kind(
        x0, P0, motion=motion, sonar=sonar, master=master, dtype=settings.filter.dtype,
        longest_step_s=settings.filter.longest_step_s, **options,
    )  # fmt: skip
