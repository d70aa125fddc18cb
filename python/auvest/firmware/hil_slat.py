"""What `auvest hil` plays to a filter that localises and tracks: its start, and rows for it.

A row is a prediction, if time has passed, and what the sonar heard at its end.
:meth:`SlatRecord.of_run` makes the rows of the arrays that :meth:`auvest.slat.SlatFilter.run`
takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._core import Status
from auvest.errors import FilterError
from auvest.firmware.cost import literal
from auvest.firmware.hil_record import Words, bits
from auvest.slat import UNKNOWN_MASTER, EkfSlat, ParticleSlatFilter, Slatf, SlatFilter, SlatfJoint
from auvest.slat.models import Imm, PiecewiseAcceleration

_Numbers = npt.NDArray[np.float32]

_BEARINGS = {
    "master_to_slave": "kMasterToSlave",
    "slave_to_master": "kSlaveToMaster",
    "from_heading": "kFromHeading",
}
_ONE_MODEL = "auvest::PiecewiseAcceleration<float>"
_IMM = (
    "auvest::Imm<auvest::ConstantVelocity<float>, auvest::ExactAcceleration<float>, "
    "auvest::CoordinatedTurn<float>>"
)
_MODES = 3


@dataclass(frozen=True, eq=False)
class SlatRecord:
    """A filter at its start, and T rows for it, with at most E echoes at one time.

    Attributes
    ----------
    filter : Slatf, SlatfJoint or EkfSlat
        In float32: its models and parameters; its state does not count.
    x0, P0 : ndarray
        Of the slave, as the filter took them.
    seed : int
        Of its random numbers.
    masters : sequence of (ndarray, ndarray)
        Mean and covariance of each master that it is told at the start.
    room : int
        Masters that the chip has room for.
    dt : ndarray, shape (T,)
        Time that the row predicts over, s.
    moves : ndarray of bool, shape (T,)
        Whether it predicts; echoes at the very start come without.
    u : ndarray, shape (T, 2)
        The slave's readings.
    changes : ndarray, shape (T, room, 2), or None
        Velocity changes that the masters planned for that time, m/s; None: nobody knows.
    z : ndarray, shape (T, E, 2)
        Range and bearing of each echo; NaN: there is none.
    master : ndarray of int, shape (T, E)
        Whose it is; ``UNKNOWN_MASTER``: nobody knows.
    """

    filter: SlatFilter
    x0: npt.NDArray[Any]
    P0: npt.NDArray[Any]
    seed: int
    masters: Sequence[tuple[npt.NDArray[Any], npt.NDArray[Any]]]
    room: int
    dt: _Numbers
    moves: npt.NDArray[np.bool_]
    u: _Numbers
    changes: _Numbers | None
    z: _Numbers
    master: npt.NDArray[np.int_]

    def __post_init__(self) -> None:
        if not isinstance(self.filter, (Slatf, SlatfJoint, EkfSlat)):
            raise ValueError(f"{type(self.filter).__name__} is for the desk only")
        if self.filter.dtype != np.float32:
            raise ValueError(f"the filter must be in float32, not in {self.filter.dtype}")
        if not 1 <= len(self.masters) <= self.room <= self.filter._max_masters:
            raise ValueError(
                f"room is {self.room}: it must be from the {len(self.masters)} masters told to the "
                f"{self.filter._max_masters} that the filter takes"
            )
        columns = [self.dt, self.moves, self.u, self.z, self.master]
        if self.changes is not None:
            columns.append(self.changes)
        if len({len(column) for column in columns}) != 1:
            raise ValueError(
                "dt, moves, u, changes, z and master must have the same number of rows"
            )

    @classmethod
    def of_run(
        cls,
        filter_: SlatFilter,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        masters: Sequence[tuple[npt.ArrayLike, npt.ArrayLike]],
        time_s: npt.ArrayLike,
        u: npt.ArrayLike,
        *,
        z: npt.ArrayLike,
        z_time_s: npt.ArrayLike,
        master: npt.ArrayLike = 0,
        changes: npt.ArrayLike | None = None,
        seed: int = 1,
        room: int | None = None,
    ) -> SlatRecord:
        """Make the rows of what ``filter_.run`` takes: a prediction from echo to echo.

        Parameters
        ----------
        filter_, x0, P0, masters, seed
            See the class; ``masters`` as :meth:`auvest.slat.SlatFilter.add_master` takes them.
        time_s, u, z, z_time_s, master, changes
            See :meth:`auvest.slat.SlatFilter.run`.
        room : int, optional
            See the class; default: the masters told.
        """
        times, heard_at = (np.asarray(column, float) for column in (time_s, z_time_s))
        readings, echoes = np.asarray(u, float), np.asarray(z, float)
        whose = np.broadcast_to(np.asarray(master), len(echoes))
        there = ~np.isnan(echoes[:, 0])
        echoes, heard_at, whose = echoes[there], heard_at[there], whose[there]
        most = len(masters) if room is None else room
        plan = np.zeros((len(readings), most, 2))
        if changes is not None:
            given = np.asarray(changes, float)
            plan[:, : given.shape[1]] = given[:, :most]
        moments, first, counts = np.unique(heard_at, return_index=True, return_counts=True)
        rows: list[tuple[float, bool, int, float, slice]] = []
        now = times[0]
        if len(moments) and moments[0] == now:
            rows.append((0.0, False, 0, 0.0, slice(0, int(counts[0]))))
        for k in range(len(readings)):
            begin, end = times[k], times[k + 1]
            inside = np.flatnonzero((moments > begin) & (moments <= end))
            stops = [(moments[i], slice(int(first[i]), int(first[i] + counts[i]))) for i in inside]
            if (not stops or stops[-1][0] < end) and end > begin:
                stops.append((end, slice(0, 0)))
            for stop, group in stops:
                rows.append((stop - now, True, k, (stop - now) / (end - begin), group))
                now = stop
        dt, moves, of, share, groups = zip(*rows, strict=True)
        width = max(1, *(group.stop - group.start for group in groups))
        heard = np.full((len(rows), width, 2), np.nan, np.float32)
        numbers = np.full((len(rows), width), UNKNOWN_MASTER)
        for k, group in enumerate(groups):
            size = group.stop - group.start
            heard[k, :size], numbers[k, :size] = echoes[group], whose[group]
        planned = (np.array(share)[:, None, None] * plan[list(of)]).astype(np.float32)
        return cls(
            filter=filter_,
            x0=np.asarray(x0, np.float32),
            P0=np.asarray(P0, np.float32),
            seed=seed,
            masters=[(np.asarray(x, np.float32), np.asarray(P, np.float32)) for x, P in masters],
            room=most,
            dt=np.array(dt, np.float32),
            moves=np.array(moves),
            u=readings[list(of)].astype(np.float32),
            changes=None if changes is None else planned,
            z=heard,
            master=numbers,
        )

    def __len__(self) -> int:
        return len(self.dt)

    @property
    def particles(self) -> int:
        """N; 0 where the filter has none."""
        return self.filter.particles if isinstance(self.filter, ParticleSlatFilter) else 0

    @property
    def fields(self) -> list[str]:
        """Names of the numbers after each row; the first is no float."""
        pose = ("x", "y", "heading")[: self.filter.motion.pose_states]
        state = ("x", "y", "vx", "vy", "ax", "ay")
        names = ["status", *_belief("slave", pose)]
        for n in range(self.room):
            names += _belief(f"master {n}", state)
            if self._modes:
                names += [f"master {n} mode[{k}]" for k in range(_MODES)]
        names.append("log_likelihood")
        names += ["effective_size", "resamplings"] if self.particles else ["nis"]
        names += ["refused", "rebirths"]
        for i in range(self.particles):
            names += [f"weight[{i}]", *(f"pose[{i}, {axis}]" for axis in pose)]
        return names

    @property
    def _modes(self) -> int:
        return _MODES if isinstance(self.filter._settings["master"], Imm) else 0

    def start(self) -> SlatFilter:
        """Make the filter, at its start."""
        models = {"motion": self.filter.motion, "sonar": self.filter.sonar, "dtype": "float32"}
        settings = {**models, **self.filter._settings, "seed": self.seed}
        filter_ = type(self.filter)(self.x0, self.P0, **settings)
        for x, P in self.masters:
            filter_.add_master(x, P)
        return filter_

    def on_desk(self) -> Words:
        """Give the bits after the start and after each row, shape (T + 1, fields): the right ones.

        Raises
        ------
        ValueError
            If more masters are born than there is room for.
        """
        filter_ = self.start()
        lines = [self._line(filter_, Status.ok)]
        for k in range(len(self)):
            status = Status.ok
            there = ~np.isnan(self.z[k, :, 0])
            try:
                if self.moves[k]:
                    changes = None if self.changes is None else self.changes[k, : filter_.masters]
                    filter_.predict(float(self.dt[k]), self.u[k], changes=changes)
                if there.any():
                    filter_.update(self.z[k, there], self.master[k, there])
            except FilterError as error:
                status = error.status
            if filter_.masters > self.room:
                raise ValueError(f"row {k}: {filter_.masters} masters, but room is {self.room}")
            lines.append(self._line(filter_, status))
        return np.array(lines)

    def _line(self, filter_: SlatFilter, status: Status) -> Words:
        numbers = [filter_.x, filter_.P[np.tril_indices(len(filter_.x))]]
        for n in range(self.room):
            there = n < filter_.masters
            x, P = filter_.master(n) if there else (np.zeros(6), np.zeros((6, 6)))
            numbers += [x, P[np.tril_indices(6)]]
            if self._modes:
                numbers.append(filter_.mode_probabilities(n) if there else np.zeros(_MODES))
        said = [filter_.log_likelihood]
        if isinstance(filter_, ParticleSlatFilter):
            said += [filter_.effective_size, filter_.resamplings]
        elif isinstance(filter_, EkfSlat):
            said.append(filter_.nis)
        numbers.append(np.array([*said, filter_.refused, filter_.rebirths]))
        if isinstance(filter_, ParticleSlatFilter):
            numbers.append(np.column_stack([filter_.weights, filter_.poses]).ravel())
        floats = bits(np.concatenate(numbers).astype(np.float32))
        return np.concatenate([np.array([int(status)], np.uint32), floats])


def _belief(whose: str, state: Sequence[str]) -> list[str]:
    names = [f"{whose} x[{name}]" for name in state]
    return names + [f"{whose} P[{a}, {b}]" for i, a in enumerate(state) for b in state[: i + 1]]


# ---- The program ---------------------------------------------------------------------------------


def rows(record: SlatRecord) -> list[list[int]]:
    """Give the words of the start and of all rows, without their numbers."""
    beliefs = [(record.x0, record.P0), *record.masters]
    start = [np.concatenate([x, P[np.tril_indices(len(x))]]) for x, P in beliefs]
    words: list[list[int]] = [bits(np.concatenate(start)).tolist()]
    planned = record.changes is not None
    for k in range(len(record)):
        count = int((~np.isnan(record.z[k, :, 0])).sum())
        flags = int(record.moves[k]) | planned << 1 | count << 8
        changes = np.zeros((record.room, 2)) if record.changes is None else record.changes[k]
        moved = np.concatenate([[record.dt[k]], record.u[k], changes.ravel()])
        heard = bits(np.nan_to_num(record.z[k]))
        whose = record.master[k].astype(np.int32).view(np.uint32)
        echoes = np.column_stack([heard, whose]).ravel()
        words.append([flags, *bits(moved).tolist(), *echoes.tolist()])
    return words


def places(record: SlatRecord) -> dict[str, str]:
    """Give what stands in the places of slat.hpp.in."""
    filter_ = record.filter
    settings = filter_._settings
    make = _made(record)
    arguments = "make_motion(), make_master(), make_params()"
    show = ["  put(out, filter.nis());"]
    if record.particles:
        make.append(f"Filter::Storage<{record.particles}> storage;")
        arguments += ", storage"
        show = ["  put(out, filter.effective_size());"]
        show.append("  put(out, static_cast<float>(filter.resamplings()));")
    for name in ("refused", "rebirths"):
        show.append(f"  put(out, static_cast<float>(filter.safeguards().report().{name}));")
    if record.particles:
        show += [
            "  const Filter::Set& set = filter.set();",
            "  for (int i = 0; i < set.size(); ++i) {",
            "    put(out, auvest::weight_of(set.log_weights()[i]));",
            "    for (int k = 0; k < kPose; ++k) put(out, *set.at(i, Filter::kPoseField + k));",
            "  }",
        ]
    modes = []
    if record._modes:
        modes.append(f"  for (int k = 0; k < {_MODES}; ++k) {{")
        modes.append("    put(out, there ? filter.mode_probability(n, k) : 0.0f);")
        modes.append("  }")
    make += [
        f"Filter filter({arguments});",
        "const auvest::Sonar<float> sonar = make_sonar();",
        f"constexpr uint64_t kSeed = {record.seed}ull;",
        "auvest::math::Random random(kSeed);",
    ]
    return {
        "MOTION": type(filter_.motion).__name__,
        "MASTER": _IMM if record._modes else _ONE_MODEL,
        "ROOM": str(record.room),
        "FILTER": _type(filter_, settings),
        "TOLD": str(len(record.masters)),
        "ECHOES": str(record.z.shape[1]),
        "MAKE": _lines(make),
        "MODES": _lines(modes),
        "SHOW": _lines(show),
    }


def _lines(lines: Sequence[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _type(filter_: SlatFilter, settings: Mapping[str, Any]) -> str:
    if isinstance(filter_, EkfSlat):
        return "EkfSlat<Motion, Master, kRoom>"
    name = f"Slatf{settings['version']}" if isinstance(filter_, Slatf) else "SlatfJoint"
    if isinstance(filter_, SlatfJoint) and filter_.covariance == "shared":
        name = "SlatfShared"
    return f"{name}<Motion, Master, kRoom, auvest::{settings['resampling'].title()}Resampling>"


def _made(record: SlatRecord) -> list[str]:
    """Write the functions that make the models and parameters as they are on the desk."""
    filter_ = record.filter
    params = {name: filter_._settings[name] for name in filter_._defaults}
    sonar = asdict(filter_.sonar)
    bearing = f"auvest::Bearing::{_BEARINGS[sonar.pop('bearing')]}"
    master = filter_._settings["master"]
    if isinstance(master, PiecewiseAcceleration):
        of_master = _assigned("params", asdict(master))
    else:
        of_master = _of_imm(master)
    parts = (
        ("Motion", "make_motion", _assigned("params", asdict(filter_.motion))),
        ("Master", "make_master", of_master),
        ("Filter::Params", "make_params", _assigned("", params)),
        (
            "auvest::Sonar<float>",
            "make_sonar",
            [*_assigned("params", sonar), f"  made.params.bearing = {bearing};"],
        ),
    )
    lines = []
    for type_, name, assignments in parts:
        lines += [f"{type_} {name}() {{", f"  {type_} made;", *assignments, "  return made;", "}"]
        lines.append("")
    return lines


def _of_imm(master: Imm) -> list[str]:
    noise = ("position", "velocity", "acceleration")
    turning = {f"noise.{name}": getattr(master.turning, f"{name}_psd") for name in noise}
    straight = {
        "velocity": master.straight.velocity_psd,
        "sigma_acceleration_m_s2": master.straight.sigma_acceleration_m_s2,
    }
    accelerated = {name: getattr(master.accelerated, f"{name}_psd") for name in noise}
    lines = _assigned("models.first.params", straight)
    lines += _assigned("models.rest.first.params", accelerated)
    turns = {**turning, "slow_m_s": master.turning.slow_m_s}
    lines += _assigned("models.rest.rest.first.params", turns)
    shares = {f"share({k})": value for k, value in enumerate(master.share)}
    return lines + _assigned("params", {"switch_rate_hz": master.switch_rate_hz, **shares})


def _assigned(params: str, values: Mapping[str, Any]) -> list[str]:
    place = f"made.{params}." if params else "made."
    return [f"  {place}{name} = {_value(value)};" for name, value in values.items()]


def _value(value: float | bool) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int) else literal(value)
