"""Simultaneous localisation and tracking: :class:`Slatf`, :class:`SlatfJoint`, :class:`EkfSlat`.

A slave vehicle that can only dead-reckon pings masters with its own sonar (Lu, Chen, Liu, Ma, He
2020). All of the estimation is C++ (``cpp/include/auvest/slat``); this module checks arguments,
converts them to the filter's precision and explains what went wrong.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, get_args

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import (
    DType,
    Exclusive,
    Floats,
    as_array,
    as_dtype,
    as_flag,
    as_instance,
    as_integer,
    as_kind,
    as_number,
    require_range,
)
from auvest._core import Status
from auvest.errors import FilterError
from auvest.slat_models import (
    CompassMotion,
    Imm,
    Master,
    Motion,
    PiecewiseAcceleration,
    Sonar,
    UnicycleMotion,
    core_master,
    core_params,
    core_sonar,
)

#: Masters that a filter can track.
MAX_MASTERS = _core.slat_max_masters
#: Masters that :class:`EkfSlat` can track with an :class:`~auvest.Imm`.
MAX_IMM_MASTERS = _core.slat_max_imm_masters
#: The master of an echo of which nobody knows whose it is.
UNKNOWN_MASTER = _core.slat_unknown_master

#: Particles that a filter takes at most: 0.5 kB each in float32.
MAX_PARTICLES = 10_000_000
#: Ranges and bearings that the filters take at most.
_LARGEST_Z = 1e9

_SLATF = _core.slatf_defaults()
_JOINT = _core.slatf_joint_defaults()
_EKF = _core.ekf_slat_defaults()
_COMPASS = CompassMotion()
_MASTER = PiecewiseAcceleration()
_SONAR = Sonar()

Lanes = Literal["scalar", "sse2", "avx2", "avx512"]
Resampling = Literal["systematic", "stratified", "residual", "multinomial"]


def available_lanes(dtype: npt.DTypeLike = "float32") -> tuple[str, ...]:
    """Give the instruction sets in whose lanes particles can run here, the widest last.

    The bits do not depend on the choice. In float64 particles run one by one.
    """
    return tuple(_core.slat_lanes(as_dtype(dtype) == np.dtype(np.float32)))


@dataclass(frozen=True)
class SlatRun:
    """What ``run`` returns; row k is the state of affairs at ``time_s[k + 1]`` of the record.

    Attributes
    ----------
    x : ndarray, shape (T, n)
        Estimated poses of the slave: n = 2 or 3, as the motion says.
    P : ndarray, shape (T, n, n)
        Their covariances.
    masters_x : ndarray, shape (T, M, 6)
        Estimated masters ``[x, y, vx, vy, ax, ay]``; NaN before a master is born.
    masters_P : ndarray, shape (T, M, 6, 6)
        Their covariances.
    effective_size : ndarray, shape (T,)
        N_eff of the last update, Eq. (33), before any resampling; 0 without particles.
    resamplings : ndarray of int, shape (T,)
        Resamplings since the start of the filter.
    log_likelihood : ndarray, shape (T,)
        Logarithm of the density of all echoes since the start of the filter.
    nis : ndarray, shape (T,)
        Of the last update of :class:`EkfSlat`, 2 degrees of freedom per echo; 0 for the others.
    """

    x: Floats
    P: Floats
    masters_x: Floats
    masters_P: Floats
    effective_size: Floats
    resamplings: npt.NDArray[np.int64]
    log_likelihood: Floats
    nis: Floats

    def __len__(self) -> int:
        return len(self.x)


class _Steps:
    """Prediction, update and record: what the filters and :class:`Outage` have in common."""

    _core_steps: Any
    _dtype: DType
    _motion: Motion
    _sonar: Sonar
    _random: _core.Random
    _status: Status
    _exclusive: Exclusive

    @property
    def x(self) -> Floats:
        """The slave's estimated pose (m, rad), shape (n,), a copy."""
        with self._exclusive:
            x: Floats = self._slave()[0]
        return x

    @property
    def P(self) -> Floats:
        """Its covariance, shape (n, n), a copy."""
        with self._exclusive:
            p: Floats = self._slave()[1]
        return p

    def master(self, n: int) -> tuple[Floats, Floats]:
        """Give mean (6,) and covariance (6, 6) of master n, ``[x, y, vx, vy, ax, ay]``.

        Raises
        ------
        ValueError, TypeError
            If there is no such master.
        """
        with self._exclusive:
            count = self._masters()
            if count == 0:
                raise ValueError(f"there is no master {n}: none was added")
            number = as_integer("n", n, 0, count - 1)
            x, p = self._core_steps.master(number)
        return x, p

    @property
    def status(self) -> Status:
        """What the core reported last: ``Status.ok`` unless a FilterError was raised."""
        return self._status

    @property
    def dtype(self) -> DType:
        """float32 or float64."""
        return self._dtype

    @property
    def motion(self) -> Motion:
        """How the slave moves."""
        return self._motion

    @property
    def sonar(self) -> Sonar:
        """The sonar that ``update`` and ``run`` use unless told otherwise."""
        return self._sonar

    def predict(self, dt: float, u: npt.ArrayLike, *, changes: npt.ArrayLike | None = None) -> None:
        """Carry slave and masters ``dt >= 0`` seconds forward.

        Parameters
        ----------
        dt : float
            Seconds.
        u : array_like, shape (2,)
            The slave's reading during that time, see its motion.
        changes : array_like, shape (masters, 2), optional
            Velocity changes that the masters planned for that time, m/s; default: none known.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the prediction cannot be done. In all cases the filter is unchanged.
        """
        step = as_number("dt", dt, "not negative")
        reading = as_array("u", u, (2,), self._dtype)
        with self._exclusive:
            plan = self._as_plan(changes)
            try:
                self._core_steps.predict(step, reading, plan, self._random)
            except _core.StatusError as error:
                self._fail(f"predict(dt={dt})", error.status)
            self._status = Status.ok

    def update(
        self,
        z: npt.ArrayLike | None,
        master: npt.ArrayLike | None = None,
        *,
        sonar: Sonar | None = None,
    ) -> None:
        """Take in what the sonar heard at one time.

        Parameters
        ----------
        z : array_like, shape (2,) or (K, 2), or None
            Range (m) and bearing (rad) of each echo. None or NaN rows: missing.
        master : int or array_like of int, shape (K,), optional
            The master of each echo, each at most once; ``UNKNOWN_MASTER``: nobody knows. May be
            left out where there is only one; where masters can be born it is then unknown.
        sonar : Sonar, optional
            Default: the filter's own.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the update cannot be done; the filter is then unchanged.
        """
        device = self._sonar_of(sonar)
        with self._exclusive:
            echoes, numbers = self._as_echoes(z, master)
            try:
                self._core_steps.update(echoes, numbers, device, self._random)
            except _core.StatusError as error:
                self._fail("update", error.status)
            self._status = Status.ok

    def run(
        self,
        time_s: npt.ArrayLike,
        u: npt.ArrayLike,
        *,
        z: npt.ArrayLike | None = None,
        z_time_s: npt.ArrayLike | None = None,
        master: npt.ArrayLike | None = None,
        changes: npt.ArrayLike | None = None,
        sonar: Sonar | None = None,
    ) -> SlatRun:
        """Predict and update over a record, in C++ and without the GIL.

        Parameters
        ----------
        time_s : array_like, shape (T + 1,)
            Ascending times, s, kept in float64: reading k holds from ``time_s[k]`` to
            ``time_s[k + 1]``.
        u : array_like, shape (T, 2)
            The slave's readings.
        z : array_like, shape (K, 2), optional
            Echoes: range (m) and bearing (rad).
        z_time_s : array_like, shape (K,), optional
            Their times, ascending, from ``time_s[0]`` to ``time_s[T]``. Echoes of one time are one
            update. Must be given with ``z``.
        master : int or array_like of int, shape (K,), optional
            As for :meth:`update`.
        changes : array_like, shape (T, masters, 2), optional
            Planned velocity changes of the masters during each interval, m/s, spread evenly over
            it.
        sonar : Sonar, optional
            Default: the filter's own.

        Returns
        -------
        SlatRun

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; the filter is unchanged.
        FilterError
            If a row cannot be done. ``step`` names it, ``partial`` holds the results before it, and
            the filter stays where the step that was refused met it.
        """
        device = self._sonar_of(sonar)
        double = np.dtype(np.float64)
        times = as_array("time_s", time_s, (None,), double)
        if len(times) < 2:
            raise ValueError(f"time_s must have at least 2 elements, not {len(times)}")
        _require_ascending("time_s", times)
        rows = len(times) - 1
        readings = as_array("u", u, (rows, 2), self._dtype)
        if (z is None) != (z_time_s is None):
            raise ValueError("z and z_time_s belong together: give both or none")
        with self._exclusive:
            plan = self._as_plans(changes, rows)
            if z is None:
                echoes = np.empty((0, 2), self._dtype)
                heard_at: Floats = np.empty(0)
                numbers = np.empty(0, np.int64)
            else:
                echoes = as_array("z", z, (None, 2), self._dtype)
                _require_moderate(echoes)
                heard_at = as_array("z_time_s", z_time_s, (len(echoes),), double)
                _require_ascending("z_time_s", heard_at)
                if heard_at[0] < times[0] or heard_at[-1] > times[-1]:
                    raise ValueError(
                        f"z_time_s must lie within time_s, {times[0]} to {times[-1]}; "
                        f"it reaches from {heard_at[0]} to {heard_at[-1]}"
                    )
                numbers = self._as_numbers(master, len(echoes))
            out = self._core_steps.run(
                times, readings, plan, heard_at, echoes, numbers, device, self._random
            )
            done = out["done"]
            width = int(out["masters"][:done].max(initial=0))
            result = SlatRun(
                x=out["x"][:done],
                P=out["P"][:done],
                masters_x=out["masters_x"][:done, :width],
                masters_P=out["masters_P"][:done, :width],
                effective_size=out["effective_size"][:done],
                resamplings=out["resamplings"][:done],
                log_likelihood=out["log_likelihood"][:done],
                nis=out["nis"][:done],
            )
            self._status = out["status"]
        if self._status != Status.ok:
            raise FilterError("run", self._status, step=done, partial=result)
        return result

    def _slave(self) -> tuple[Floats, Floats]:
        x, p = self._core_steps.slave()
        return x, p

    def _masters(self) -> int:
        raise NotImplementedError

    def _fail(self, action: str, status: Status) -> NoReturn:
        self._status = status
        raise FilterError(action, status) from None

    def _sonar_of(self, sonar: Sonar | None) -> _core._Sonar:
        device = self._sonar if sonar is None else as_instance("sonar", sonar, Sonar)
        _require_heading(device, self._motion)
        return core_sonar(device, self._dtype.name)

    def _as_plan(self, changes: npt.ArrayLike | None) -> Floats:
        if changes is None:
            return np.empty((0, 2), self._dtype)
        return as_array("changes", changes, (max(1, self._masters()), 2), self._dtype)

    def _as_plans(self, changes: npt.ArrayLike | None, rows: int) -> Floats:
        if changes is None:
            return np.empty((0, 0, 2), self._dtype)
        return as_array("changes", changes, (rows, max(1, self._masters()), 2), self._dtype)

    def _as_echoes(
        self, z: npt.ArrayLike | None, master: npt.ArrayLike | None
    ) -> tuple[Floats, npt.NDArray[np.int64]]:
        if z is None:
            return np.empty((0, 2), self._dtype), np.empty(0, np.int64)
        if np.ndim(z) == 1:
            echoes = as_array("z", z, (2,), self._dtype, missing=True).reshape(1, 2)
        else:
            echoes = as_array("z", z, (None, 2), self._dtype, missing=True)
        _require_moderate(echoes)
        numbers = self._as_numbers(master, len(echoes))
        there = ~np.isnan(echoes[:, 0])
        echoes, numbers = echoes[there], numbers[there]
        known = numbers[numbers != UNKNOWN_MASTER]
        if len(np.unique(known)) < len(known):
            raise ValueError(f"master names a master twice: {numbers.tolist()}")
        if len(echoes) > MAX_MASTERS:
            raise ValueError(f"z has {len(echoes)} echoes; at most {MAX_MASTERS} are taken at once")
        return np.ascontiguousarray(echoes), numbers

    def _as_numbers(self, master: npt.ArrayLike | None, count: int) -> npt.NDArray[np.int64]:
        masters = self._masters()
        if master is None:
            if masters > 1:
                raise TypeError(f"master must be given: the filter has {masters} masters")
            return np.zeros(count, np.int64)
        raw = np.asarray(master)
        if raw.dtype.kind not in "iu":
            raise TypeError(f"master must be an int or an array of int, not of {raw.dtype.name}")
        if raw.shape not in ((), (count,)):
            raise ValueError(f"master has shape {raw.shape}, expected ({count},) as z has rows")
        numbers = np.ascontiguousarray(np.broadcast_to(raw, (count,)), dtype=np.int64)
        for number in np.unique(numbers):
            if not UNKNOWN_MASTER <= number < max(masters, 0):
                raise ValueError(f"master is {number}, but the filter has {masters} masters")
        return numbers


class SlatFilter(_Steps):
    """What the filters of this module share; not for direct use.

    One filter belongs to one thread at a time: a call while another thread is inside raises
    ``RuntimeError``. Use a copy (``copy.deepcopy``) per thread; it goes on with the same random
    numbers.
    """

    _max_masters: int = MAX_MASTERS

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion,
        sonar: Sonar,
        dtype: npt.DTypeLike,
        seed: int,
    ) -> None:
        self._dtype = as_dtype(dtype)
        self._motion = as_instance("motion", motion, (CompassMotion, UnicycleMotion))
        self._sonar = as_instance("sonar", sonar, Sonar)
        _require_heading(self._sonar, self._motion)
        core_sonar(self._sonar, self._dtype.name)
        self._random = _core.Random(as_integer("seed", seed, 0, 2**64 - 1))
        self._exclusive = Exclusive()
        self._status = Status.ok
        n = self._motion.pose_states
        state = as_array("x0", x0, (n,), self._dtype)
        covariance = _as_covariance("P0", P0, n, self._dtype, definite=False)
        self._core_steps = self._build()
        try:
            self._core_steps.reset(state, covariance, self._random)
        except _core.StatusError as error:
            raise ValueError(f"x0, P0 or the parameters are refused: {error}") from None

    def _build(self) -> Any:
        raise NotImplementedError

    def _core_class(self) -> Any:
        return getattr(_core, f"Slat_{self._motion.name}_{self._dtype.name}")

    def __deepcopy__(self, memo: dict[int, Any]) -> SlatFilter:
        with self._exclusive:
            twin = copy.copy(self)
            twin._core_steps = self._core_steps.copy()
            twin._random = self._random.copy()
            twin._exclusive = Exclusive()
        memo[id(self)] = twin
        return twin

    def __repr__(self) -> str:
        x = np.array2string(self.x, precision=4, separator=", ")
        return f"{type(self).__name__}(dtype={self._dtype.name}, masters={self.masters}, x={x})"

    def mode_probabilities(self, n: int) -> Floats:
        """Give the probabilities that master n goes straight, accelerates and turns, shape (3,).

        Raises
        ------
        ValueError, TypeError
            If there is no such master, or the master is not an :class:`~auvest.Imm`.
        """
        with self._exclusive:
            count = self._masters()
            if count == 0:
                raise ValueError(f"there is no master {n}: none was added")
            number = as_integer("n", n, 0, count - 1)
            modes: Floats = np.array(self._core_steps.mode_probabilities(number), self._dtype)
        if modes.size == 0:
            raise ValueError("mode probabilities need an auvest.Imm as master")
        return modes

    def _masters(self) -> int:
        return int(self._core_steps.readings["masters"])

    def _reading(self, name: str) -> Any:
        with self._exclusive:
            return self._core_steps.readings[name]

    @property
    def masters(self) -> int:
        """Masters that the filter tracks."""
        return int(self._reading("masters"))

    @property
    def log_likelihood(self) -> float:
        """Logarithm of the density of all echoes since the start."""
        return float(self._reading("log_likelihood"))

    def add_master(self, x: npt.ArrayLike, P: npt.ArrayLike) -> int:
        """Add a master that the filter knows.

        Parameters
        ----------
        x : array_like, shape (6,)
            ``[x, y, vx, vy, ax, ay]``, m, m/s, m/s^2.
        P : array_like, shape (6, 6)
            Covariance, symmetric positive definite.

        Returns
        -------
        int
            Its number, from 0.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong, or there are as many already as the filter takes.
        """
        state = as_array("x", x, (6,), self._dtype)
        covariance = _as_covariance("P", P, 6, self._dtype, definite=True)
        with self._exclusive:
            number = self._masters()
            if number == self._max_masters:
                raise ValueError(f"the filter has {number} masters already, that is all")
            try:
                self._core_steps.add_master(state, covariance)
            except _core.StatusError as error:
                if error.status != Status.not_positive_definite:
                    raise ValueError(f"x and P are refused: {error}") from None
                raise ValueError(f"P must be positive definite in {self._dtype.name}") from None
        return number

    def step(
        self,
        dt: float,
        u: npt.ArrayLike,
        z: npt.ArrayLike | None = None,
        master: npt.ArrayLike | None = None,
        *,
        changes: npt.ArrayLike | None = None,
        sonar: Sonar | None = None,
    ) -> None:
        """Predict and update at once: the same bits, faster, and both or neither is done.

        Parameters and errors are those of :meth:`predict` and :meth:`update`.
        """
        device = self._sonar_of(sonar)
        seconds = as_number("dt", dt, "not negative")
        reading = as_array("u", u, (2,), self._dtype)
        with self._exclusive:
            plan = self._as_plan(changes)
            echoes, numbers = self._as_echoes(z, master)
            try:
                self._core_steps.step(seconds, reading, plan, echoes, numbers, device, self._random)
            except _core.StatusError as error:
                self._fail(f"step(dt={dt})", error.status)
            self._status = Status.ok


class ParticleSlatFilter(SlatFilter):
    """What :class:`Slatf` and :class:`SlatfJoint` share; not for direct use."""

    _particles: int

    @property
    def particles(self) -> int:
        """N."""
        return self._particles

    @property
    def effective_size(self) -> float:
        """N_eff of the last update, Eq. (33), before any resampling; N before one."""
        return float(self._reading("effective_size"))

    @property
    def resamplings(self) -> int:
        """Resamplings since the start."""
        return int(self._reading("resamplings"))

    @property
    def weights(self) -> Floats:
        """Normalised weights of the particles, shape (N,), a copy."""
        with self._exclusive:
            weights: Floats = self._core_steps.particles()[0]
        return weights

    @property
    def poses(self) -> Floats:
        """Poses of the particles (:class:`SlatfJoint`: their means), shape (N, n), a copy."""
        with self._exclusive:
            poses: Floats = self._core_steps.particles()[1]
        return poses


class Slatf(ParticleSlatFilter):
    """SLATF 1.0 and 2.0: a particle filter over the slave's pose with an EKF per master in each.

    Parameters
    ----------
    x0 : array_like, shape (n,)
        The slave's pose when communication breaks: ``[x, y]`` or ``[x, y, heading]``, m, rad.
    P0 : array_like, shape (n, n)
        Its covariance, from which particles are drawn; may be singular or zero.
    version : {2, 1}
        1: poses are drawn from the motion. 2: from motion and measurement.
    particles : int
        N, 1 to 10 million.
    motion : CompassMotion or UnicycleMotion
    master : PiecewiseAcceleration or Imm
    sonar : Sonar
    resampling : {"systematic", "stratified", "residual", "multinomial"}
    resample_below : float
        Resample where N_eff falls below this share of N, in 0..1, Eq. (33).
    carry_covariance : bool
        2.0 only: Eq. (50) to the letter, see docs/algorithms/slatf.md.
    gate : float
        An echo whose NIS (2 degrees of freedom) exceeds this in a particle says nothing to it;
        0: no gate, as in the paper. 16 loses one good echo in 3,000.
    birth_velocity_m_s, birth_acceleration_m_s2 : float
        Standard deviations of a master that is born from an unknown echo, see the algorithm's
        page; velocity 0: no births. Needs a gate.
    lanes : {"scalar", "sse2", "avx2", "avx512"}, optional
        Instruction set; default: the widest of :func:`available_lanes`. The bits are the same.
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.
    seed : int
        Of the filter's random numbers, 0 to 2^64 - 1.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        version: Literal[1, 2] = 2,
        particles: int = 100,
        motion: Motion = _COMPASS,
        master: Master = _MASTER,
        sonar: Sonar = _SONAR,
        resampling: Resampling = "systematic",
        resample_below: float = _SLATF["resample_below"],
        carry_covariance: bool = _SLATF["carry_covariance"],
        gate: float = _SLATF["gate"],
        birth_velocity_m_s: float = _SLATF["birth_velocity_m_s"],
        birth_acceleration_m_s2: float = _SLATF["birth_acceleration_m_s2"],
        lanes: Lanes | None = None,
        dtype: npt.DTypeLike = "float64",
        seed: int = 1,
    ) -> None:
        self._version = as_integer("version", version, 1, 2)
        self._particles = as_integer("particles", particles, 1, MAX_PARTICLES)
        self._master: Master = as_instance("master", master, (PiecewiseAcceleration, Imm))
        self._resampling = as_kind("resampling", resampling, get_args(Resampling))
        self._params = {
            "resample_below": as_number("resample_below", resample_below, "not negative"),
            "carry_covariance": as_flag("carry_covariance", carry_covariance),
            "gate": as_number("gate", gate, "not negative"),
            "birth_velocity_m_s": as_number(
                "birth_velocity_m_s", birth_velocity_m_s, "not negative"
            ),
            "birth_acceleration_m_s2": as_number(
                "birth_acceleration_m_s2", birth_acceleration_m_s2, "positive"
            ),
        }
        if self._params["resample_below"] > 1:
            raise ValueError(f"resample_below must lie in 0..1, not {resample_below}")
        if self._params["birth_velocity_m_s"] > 0 and self._params["gate"] == 0:
            raise ValueError("birth_velocity_m_s needs a gate above 0: births are decided by it")
        if isinstance(self._master, Imm):
            as_kind("lanes", lanes or "scalar", ("scalar",))  # with an Imm particles run one by one
            lanes = "scalar"
        self._lanes = _as_lanes(lanes, as_dtype(dtype))
        super().__init__(x0, P0, motion=motion, sonar=sonar, dtype=dtype, seed=seed)

    def _build(self) -> Any:
        name = self._dtype.name
        require_range(self._params, name)
        return self._core_class().slatf(
            core_params(self._motion, name),
            core_master(self._master, name),
            self._params,
            self._resampling,
            self._version,
            self._particles,
            self._lanes,
        )

    def _as_numbers(self, master: npt.ArrayLike | None, count: int) -> npt.NDArray[np.int64]:
        if master is None and self._params["birth_velocity_m_s"] > 0:
            return np.full(count, UNKNOWN_MASTER, np.int64)
        return super()._as_numbers(master, count)

    @property
    def version(self) -> int:
        """1 or 2."""
        return self._version

    @property
    def lanes(self) -> str:
        """The instruction set in whose lanes the particles run."""
        return self._lanes


class SlatfJoint(ParticleSlatFilter):
    """SLATF whose particles are joint Gaussians of slave and masters.

    They draw only what the sonar sees, range and bearing of one master, and keep the drift that
    slave and masters share as a Gaussian: as precise as :class:`EkfSlat` with 100 particles where
    that is enough, with more than one answer where it is not. See docs/algorithms/slatf.md.

    Parameters
    ----------
    x0, P0, motion, master, sonar, resampling, resample_below, gate, dtype, seed
        As for :class:`Slatf`.
    particles : int
        N, 1 to 1 million.
    kept : float
        Share of the covariance of range and bearing that is not drawn, in 0..1. 0: they become a
        point, as in SLATF 2.0. 1: nothing is drawn, every particle is an :class:`EkfSlat`.
    max_masters : int
        Masters that it can hold, 1 to ``MAX_MASTERS``. With room for one only it is some ten times
        smaller and faster.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        particles: int = 100,
        motion: Motion = _COMPASS,
        master: PiecewiseAcceleration = _MASTER,
        sonar: Sonar = _SONAR,
        resampling: Resampling = "systematic",
        resample_below: float = _JOINT["resample_below"],
        kept: float = _JOINT["kept"],
        gate: float = _JOINT["gate"],
        max_masters: int = 1,
        dtype: npt.DTypeLike = "float64",
        seed: int = 1,
    ) -> None:
        self._particles = as_integer("particles", particles, 1, 1_000_000)
        self._max_masters = as_integer("max_masters", max_masters, 1, MAX_MASTERS)
        self._master: PiecewiseAcceleration = as_instance("master", master, PiecewiseAcceleration)
        self._resampling = as_kind("resampling", resampling, get_args(Resampling))
        self._params = {
            "resample_below": as_number("resample_below", resample_below, "not negative"),
            "kept": as_number("kept", kept, "not negative"),
            "gate": as_number("gate", gate, "not negative"),
        }
        for name in ("resample_below", "kept"):
            if self._params[name] > 1:
                raise ValueError(f"{name} must lie in 0..1, not {self._params[name]:g}")
        super().__init__(x0, P0, motion=motion, sonar=sonar, dtype=dtype, seed=seed)

    def _build(self) -> Any:
        name = self._dtype.name
        require_range(self._params, name)
        return self._core_class().slatf_joint(
            core_params(self._motion, name),
            core_params(self._master, name),
            self._params,
            self._resampling,
            self._particles,
            self._max_masters,
        )

    @property
    def kept(self) -> float:
        """Share of the covariance of range and bearing that is not drawn."""
        return self._params["kept"]


class EkfSlat(SlatFilter):
    """Slave and masters in one extended Kalman filter: the yardstick for the particle filters.

    Parameters
    ----------
    x0, P0, motion, master, sonar, dtype
        As for :class:`Slatf`.
    gate : float
        An echo whose NIS (2 degrees of freedom) exceeds this says nothing; 0: no gate.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = _COMPASS,
        master: Master = _MASTER,
        sonar: Sonar = _SONAR,
        gate: float = _EKF["gate"],
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        self._master: Master = as_instance("master", master, (PiecewiseAcceleration, Imm))
        self._max_masters = MAX_IMM_MASTERS if isinstance(master, Imm) else MAX_MASTERS
        self._params = {"gate": as_number("gate", gate, "not negative")}
        super().__init__(x0, P0, motion=motion, sonar=sonar, dtype=dtype, seed=0)

    def _build(self) -> Any:
        name = self._dtype.name
        require_range(self._params, name)
        return self._core_class().ekf_slat(
            core_params(self._motion, name), core_master(self._master, name), self._params
        )

    @property
    def nis(self) -> float:
        """NIS of the last update: chi-square, 2 degrees of freedom per echo."""
        return float(self._reading("nis"))


class DeadReckoning(SlatFilter):
    """Dead reckoning with the interface of the other filters. It hears no echo and has no masters.

    Parameters
    ----------
    x0, P0, motion, dtype
        As for :class:`Slatf`. ``CompassMotion(compensate_bias=False)`` is the paper's.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = _COMPASS,
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        super().__init__(x0, P0, motion=motion, sonar=_SONAR, dtype=dtype, seed=0)

    def _build(self) -> Any:
        return self._core_class().dead_reckoning(core_params(self._motion, self._dtype.name))

    def _as_numbers(self, master: npt.ArrayLike | None, count: int) -> npt.NDArray[np.int64]:
        del master
        return np.full(count, UNKNOWN_MASTER, np.int64)


class Outage(_Steps):
    """Section 6 of the paper: a filter takes over while communication is down.

    ``share`` when word comes: the state that all agree on. ``predict`` and ``update`` when none
    comes: the first prediction starts the filter from the last shared state. ``x``, ``P`` and
    ``master`` are the shared state, or the filter's.

    Parameters
    ----------
    filter : Slatf, SlatfJoint, EkfSlat or DeadReckoning
        The prototype; it is copied. Its own state does not matter.

    Raises
    ------
    TypeError
        If it is none of these.
    """

    def __init__(self, filter: SlatFilter) -> None:  # noqa: A002 (its name in this package)
        as_instance("filter", filter, (Slatf, SlatfJoint, EkfSlat, DeadReckoning))
        twin = copy.deepcopy(filter)
        self._dtype, self._motion, self._sonar = twin.dtype, twin.motion, twin.sonar
        self._random = twin._random
        self._exclusive = Exclusive()
        self._status = Status.ok
        self._deaf = isinstance(filter, DeadReckoning)
        self._shared = 0
        name = f"SlatOutage_{self._motion.name}_{self._dtype.name}"
        self._core_steps = getattr(_core, name)(twin._core_steps)

    @property
    def communication(self) -> str:
        """What the last word was: "never" heard, communication "up", or "down"."""
        with self._exclusive:
            return str(self._core_steps.communication)

    def share(
        self,
        x: npt.ArrayLike,
        P: npt.ArrayLike,
        masters: Sequence[tuple[npt.ArrayLike, npt.ArrayLike]] = (),
    ) -> None:
        """Take over what communication brings, and end an outage.

        Parameters
        ----------
        x, P : array_like, shapes (n,) and (n, n)
            The slave's pose and its covariance, which may be singular or zero.
        masters : sequence of (x, P)
            State (6,) and covariance (6, 6) of each master; at most ``MAX_MASTERS``.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; nothing has changed then.
        """
        n = self._motion.pose_states
        state = as_array("x", x, (n,), self._dtype)
        covariance = _as_covariance("P", P, n, self._dtype, definite=False)
        if len(masters) > MAX_MASTERS:
            raise ValueError(
                f"masters has {len(masters)} elements, at most {MAX_MASTERS} are taken"
            )
        states = np.empty((len(masters), 6), self._dtype)
        covariances = np.empty((len(masters), 6, 6), self._dtype)
        for k, (one_x, one_p) in enumerate(masters):
            states[k] = as_array(f"masters[{k}][0]", one_x, (6,), self._dtype)
            covariances[k] = _as_covariance(
                f"masters[{k}][1]", one_p, 6, self._dtype, definite=True
            )
        with self._exclusive:
            try:
                self._core_steps.share(state, covariance, states, covariances)
            except _core.StatusError as error:
                raise ValueError(f"the shared state is refused: {error}") from None
            self._shared = len(masters)

    def _slave(self) -> tuple[Floats, Floats]:
        if self._core_steps.communication == "never":
            self._fail("reading the state", Status.not_initialised)
        return super()._slave()

    def _masters(self) -> int:
        if self._core_steps.communication == "down":
            return int(self._core_steps.filter.readings["masters"])
        return 0 if self._deaf else self._shared

    def _as_numbers(self, master: npt.ArrayLike | None, count: int) -> npt.NDArray[np.int64]:
        if self._deaf:
            return np.full(count, UNKNOWN_MASTER, np.int64)
        return super()._as_numbers(master, count)


def _as_covariance(name: str, value: object, n: int, dtype: DType, *, definite: bool) -> Floats:
    covariance = as_array(name, value, (n, n), dtype)
    scale = float(np.abs(covariance).max())
    if np.abs(covariance - covariance.T).max() > 1e-6 * scale:
        raise ValueError(f"{name} must be symmetric")
    smallest = float(np.linalg.eigvalsh(covariance.astype(np.float64))[0])
    if definite and smallest <= 0:
        raise ValueError(
            f"{name} must be positive definite, but its smallest eigenvalue is {smallest:.3g}"
        )
    if smallest < -1e-6 * scale:
        raise ValueError(f"{name} must not have negative eigenvalues, it has {smallest:.3g}")
    return covariance


def _as_lanes(lanes: str | None, dtype: DType) -> str:
    available = available_lanes(dtype)
    if lanes is None:
        return available[-1]
    as_kind("lanes", lanes, ("scalar", "sse2", "avx2", "avx512"))
    if lanes not in available:
        raise ValueError(
            f"lanes {lanes!r} do not run here in {dtype.name}; {', '.join(available)} do"
        )
    return lanes


def _require_heading(sonar: Sonar, motion: Motion) -> None:
    if sonar.bearing == "from_heading" and motion.pose_states < 3:
        raise ValueError(
            "sonar has the bearing 'from_heading', which needs a heading in the pose: "
            "motion must be an auvest.UnicycleMotion"
        )


def _require_ascending(name: str, times: Floats) -> None:
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        k = int(back[0]) + 1
        raise ValueError(f"{name}[{k}] = {times[k]} lies before {name}[{k - 1}] = {times[k - 1]}")


def _require_moderate(z: Floats) -> None:
    far = np.argwhere(np.abs(np.nan_to_num(z)) > _LARGEST_Z)
    if far.size:
        row, column = (int(i) for i in far[0])
        raise ValueError(f"z[{row}, {column}] is {z[row, column]}, beyond 1e9")
