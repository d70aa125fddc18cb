"""What `auvest hil` plays to a filter that localises and tracks: its start, and rows for it.

A row is a prediction, if time has passed, and what the sonar heard at its end; or a master comes
in. :func:`steps_of_run` makes rows of the arrays that ``run`` of these filters takes.
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
from auvest.replay.slat import Companion
from auvest.slat import EkfSlat, ParticleSlatFilter, Slatf, SlatFilter, SlatfJoint, SlatRun
from auvest.slat.models import Imm, PiecewiseAcceleration

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
#: Flags of a row.
_MOVES, _PLANNED, _NEWCOMER = 1, 2, 4


@dataclass(frozen=True, eq=False)
class Newcomer:
    """A row in which the filter is told of one master more: mean and covariance."""

    x: npt.NDArray[np.float32]
    P: npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Step:
    """A row of dead reckoning, and what the sonar heard at its end.

    Attributes
    ----------
    dt : float or None
        Time that the row predicts over, s; None: no time has passed since the row before.
    u : ndarray, shape (2,)
        The slave's reading.
    changes : ndarray, shape (M, 2), or None
        Velocity changes that the masters planned for that time, m/s; None: nobody knows.
    z : ndarray, shape (K, 2)
        Range and bearing of each echo.
    master : ndarray of int, shape (K,)
        Whose it is; ``UNKNOWN_MASTER``: nobody knows.
    """

    dt: float | None
    u: npt.NDArray[np.float32]
    changes: npt.NDArray[np.float32] | None
    z: npt.NDArray[np.float32]
    master: npt.NDArray[np.int_]


def steps_of_run(
    time_s: npt.ArrayLike,
    u: npt.ArrayLike,
    *,
    z: npt.ArrayLike | None = None,
    z_time_s: npt.ArrayLike | None = None,
    master: npt.ArrayLike | None = None,
    changes: npt.ArrayLike | None = None,
) -> list[Step]:
    """Make the rows of what ``run`` takes, from echo to echo; see :meth:`auvest.SlatFilter.run`."""
    times, readings = np.asarray(time_s, float), np.asarray(u, np.float32)
    echoes = np.empty((0, 2)) if z is None else np.asarray(z, float)
    heard_at = np.empty(0) if z_time_s is None else np.asarray(z_time_s, float)
    whose = np.broadcast_to(0 if master is None else np.asarray(master), len(echoes))
    there = ~np.isnan(echoes[:, 0])
    echoes, heard_at, whose = echoes[there].astype(np.float32), heard_at[there], whose[there]
    plan = None if changes is None else np.asarray(changes, float)

    def heard(moment: float) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        now = heard_at == moment
        return echoes[now], whose[now]

    rows = []
    now = times[0]
    if (heard_at == now).any():
        rows.append(Step(None, np.zeros(2, np.float32), None, *heard(now)))
    for k, reading in enumerate(readings):
        begin, end = times[k], times[k + 1]
        for stop in np.unique([*heard_at[(heard_at > begin) & (heard_at <= end)], end]):
            if stop > now:
                share = (stop - now) / (end - begin)
                planned = None if plan is None else (share * plan[k]).astype(np.float32)
                rows.append(Step(float(np.float32(stop - now)), reading, planned, *heard(stop)))
                now = stop
    return rows


@dataclass(frozen=True, eq=False)
class SlatRecord:
    """A filter at its start, and T rows for it.

    Attributes
    ----------
    filter : Slatf, SlatfJoint or EkfSlat
        In float32; played is one as it was at its start.
    rows : sequence of Step or Newcomer
    room : int
        Masters that the chip has room for.
    """

    filter: SlatFilter
    rows: Sequence[Step | Newcomer]
    room: int

    def __post_init__(self) -> None:
        if not isinstance(self.filter, (Slatf, SlatfJoint, EkfSlat)):
            raise ValueError(f"{type(self.filter).__name__} is for the desk only")
        if self.filter.dtype != np.float32:
            raise ValueError(f"the filter must be in float32, not in {self.filter.dtype}")
        told = sum(isinstance(row, Newcomer) for row in self.rows)
        if not max(1, told) <= self.room <= self.filter._max_masters:
            raise ValueError(
                f"room is {self.room}: it must be from the {told} masters told to the "
                f"{self.filter._max_masters} that the filter takes"
            )

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def dt(self) -> npt.NDArray[np.float32]:
        """Time that each row predicts over, s."""
        steps = [row.dt or 0.0 if isinstance(row, Step) else 0.0 for row in self.rows]
        return np.array(steps, np.float32)

    @property
    def echoes(self) -> int:
        """Most echoes at one time, at least 1."""
        return max([1, *(len(row.z) for row in self.rows if isinstance(row, Step))])

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

    def on_desk(self) -> Words:
        """Give the bits after the start and after each row, shape (T + 1, fields).

        Raises
        ------
        ValueError
            If more masters are born than there is room for.
        """
        filter_ = in_float32(self.filter)
        lines = [self._line(filter_, Status.ok)]
        for k, row in enumerate(self.rows):
            status = Status.ok
            try:
                if isinstance(row, Newcomer):
                    filter_.add_master(row.x, row.P)
                else:
                    if row.dt is not None:
                        filter_.predict(row.dt, row.u, changes=_known(row, filter_.masters))
                    if len(row.z):
                        filter_.update(row.z, row.master)
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


def in_float32(filter_: SlatFilter) -> SlatFilter:
    """Give a filter as this one was at its start, in the precision of the chip."""
    x0, P0, seed, stream = filter_._start
    return type(filter_)(
        x0,
        P0,
        motion=filter_.motion,
        sonar=filter_.sonar,
        dtype="float32",
        seed=seed,
        stream=stream,
        **filter_._settings,
    )


def record_of_replay(replay: Companion, most: int | None) -> SlatRecord:
    """Take the rows that a replay gives to its filter, so many at most.

    Raises
    ------
    ValueError
        If there are none.
    """
    filter_ = replay.filter
    run, update, add_master = filter_.run, filter_.update, filter_.add_master
    rows: list[Step | Newcomer] = []

    def heard_run(time_s: npt.ArrayLike, u: npt.ArrayLike, **options: Any) -> SlatRun:
        rows.extend(steps_of_run(time_s, u, **options))
        return run(time_s, u, **options)

    def heard_update(z: npt.ArrayLike, master: npt.ArrayLike) -> None:
        still = np.zeros(2, np.float32)
        rows.append(Step(None, still, None, np.asarray(z, np.float32), np.asarray(master)))
        update(z, master)

    def heard_master(x: npt.ArrayLike, P: npt.ArrayLike) -> int:
        rows.append(Newcomer(np.asarray(x, np.float32), np.asarray(P, np.float32)))
        return add_master(x, P)

    vars(filter_).update(run=heard_run, update=heard_update, add_master=heard_master)
    for _ in replay.batches():
        if most is not None and len(rows) >= most:
            break
    if not rows:
        raise ValueError("the log has no row for a filter")
    return SlatRecord(in_float32(filter_), rows[:most], max(1, filter_.masters))


def _known(row: Step, masters: int) -> npt.NDArray[np.float32] | None:
    """Give the changes for as many masters as there are."""
    if row.changes is None:
        return None
    known = np.zeros((max(1, masters), 2), np.float32)
    size = min(len(known), len(row.changes))
    known[:size] = row.changes[:size]
    return known


def _belief(whose: str, state: Sequence[str]) -> list[str]:
    names = [f"{whose} x[{name}]" for name in state]
    return names + [f"{whose} P[{a}, {b}]" for i, a in enumerate(state) for b in state[: i + 1]]


# ---- The program ---------------------------------------------------------------------------------


def rows(record: SlatRecord) -> list[list[int]]:
    """Give the words of the start and of all rows, without their numbers."""
    x0, P0, _, _ = record.filter._start
    words = [_words_of(x0, P0)]
    for row in record.rows:
        if isinstance(row, Newcomer):
            words.append([_NEWCOMER, *_words_of(row.x, row.P)])
            continue
        planned, count = row.changes is not None, len(row.z)
        flags = (row.dt is not None) * _MOVES | planned * _PLANNED | count << 8
        changes = _known(row, record.room)
        if changes is None:
            changes = np.zeros((record.room, 2), np.float32)
        moved = np.concatenate([[row.dt or 0.0], row.u, changes.ravel()])
        echoes = np.zeros((record.echoes, 3), np.uint32)
        echoes[:count, :2] = bits(row.z)
        echoes[:count, 2] = row.master.astype(np.int32).view(np.uint32)
        words.append([flags, *bits(moved).tolist(), *echoes.ravel().tolist()])
    return words


def _words_of(x: npt.NDArray[Any], P: npt.NDArray[Any]) -> list[int]:
    words: list[int] = bits(np.concatenate([x, P[np.tril_indices(len(x))]])).tolist()
    return words


def places(record: SlatRecord) -> dict[str, str]:
    """Give what stands in the places of slat.hpp.in."""
    filter_ = record.filter
    settings = filter_._settings
    _, _, seed, stream = filter_._start
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
        f"auvest::math::Random fresh() {{ return auvest::math::Random({seed}ull, {stream}ull); }}",
        "auvest::math::Random random = fresh();",
    ]
    return {
        "MOTION": type(filter_.motion).__name__,
        "MASTER": _IMM if record._modes else _ONE_MODEL,
        "ROOM": str(record.room),
        "FILTER": _type(filter_, settings),
        "ECHOES": str(record.echoes),
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
