"""What the SLAT filters and :class:`~auvest.Outage` share: steps, records, saved states.

All of the estimation is C++ (``cpp/include/auvest/slat``). The core takes arguments as they are
where they are plain; what it does not take is converted here, or refused with what is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal, TypeVar, get_args

import numpy as np
import numpy.typing as npt

from auvest import _core, _state
from auvest._arguments import (
    Bound,
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
    as_step,
    far_from_origin,
    impossible_range,
    require_range,
    step_too_long,
)
from auvest._core import Status
from auvest._interrupts import first_slice, in_slices
from auvest._texts import counted
from auvest.errors import FilterError, Interrupted
from auvest.slat.models import (
    CompassMotion,
    Master,
    Motion,
    PiecewiseAcceleration,
    Sonar,
    UnicycleMotion,
    core_params,
    core_sonar,
)
from auvest.slat.results import SlatRun

#: Masters that a filter can track.
MAX_MASTERS = _core.slat_max_masters
#: The master of an echo of which nobody knows whose it is.
UNKNOWN_MASTER = _core.slat_unknown_master

#: Ranges and bearings that the filters take at most.
_LARGEST = 1e9

COMPASS = CompassMotion()
MASTER = PiecewiseAcceleration()
SONAR = Sonar()

_NEEDS_KNOWN = (
    "master is UNKNOWN_MASTER, but particles that differ in whose echo it was cannot share one "
    "covariance: take SlatfJoint(covariance='particle')"
)

#: Parameters that must not be 0.
_POSITIVE = (
    "fastest_m_s",
    "rebirth_velocity_m_s",
    "rebirth_acceleration_m_s2",
    "longest_step_s",
)

Resampling = Literal["systematic", "stratified", "residual", "multinomial"]

_Self = TypeVar("_Self", bound="Steps")


class Steps:
    """Prediction, update, record and saved state of the filters and of :class:`Outage`."""

    _core_steps: Any
    _dtype: DType
    _motion: Motion
    _sonar: Sonar
    _device: _core._Sonar  # the sonar in the core
    _random: _core.Random
    _status: Status
    _exclusive: Exclusive
    _settings: dict[str, Any]  # beside motion, sonar and dtype: all that makes the filter
    _deaf: bool = False  # hears no echo, so that it does not matter whose it is
    _births: bool = False  # an echo of which nothing is said is of nobody knows whom
    _shared: bool = False  # one covariance for all particles: every echo must be somebody's

    @property
    def x(self) -> Floats:
        """The slave's estimated pose (m, rad), shape (n,), a copy."""
        with self._exclusive:
            return self._slave()[0]

    @property
    def P(self) -> Floats:
        """Its covariance, shape (n, n), a copy."""
        with self._exclusive:
            return self._slave()[1]

    def master(self, n: int) -> tuple[Floats, Floats]:
        """Give mean (6,) and covariance (6, 6) of master n, ``[x, y, vx, vy, ax, ay]``.

        Raises
        ------
        ValueError, TypeError
            If there is no such master.
        """
        with self._exclusive:
            return self._core_steps.master(self._as_master(n))

    @property
    def status(self) -> Status:
        """What the core reported last: ``Status.ok`` unless a FilterError was raised."""
        return self._status

    @property
    def refused(self) -> int:
        """Echoes since the start that particles with more than half of the weight refused."""
        return int(self._reading("refused"))

    @property
    def rebirths(self) -> int:
        """Masters born again since the start: lost behind the gate, or silent for too long."""
        return int(self._reading("rebirths"))

    @property
    def since_rebirth_s(self) -> float:
        """Seconds since the last rebirth; infinite if there was none."""
        seconds = float(self._reading("since_rebirth_s"))
        return seconds if seconds >= 0 else math.inf

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
        move = (dt, u, changes)
        self._do("predict", move, lambda: self._as_move(*move), self._random)

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
        heard = (z, None if self._deaf else master)
        device = self._as_device(sonar)
        self._do(
            "update",
            heard,
            lambda: self._as_echoes(*heard),
            self._unknown,
            device,
            self._random,
            heard=(z, sonar),
        )

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
            Echoes: range (m) and bearing (rad). NaN rows: missing, as if they were not there.
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
        Interrupted
            After Ctrl-C, a ``KeyboardInterrupt`` within half a second: ``partial`` holds the
            results so far, and the filter stays at their last row.
        """
        device = self._as_device(sonar)
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
            plan: Floats = np.empty((0, 0, 2), self._dtype)
            if changes is not None:
                masters = max(1, self._core_steps.masters)
                plan = as_array("changes", changes, (rows, masters, 2), self._dtype)
            echoes: Floats = np.empty((0, 2), self._dtype)
            numbers: npt.NDArray[np.int64] = np.empty(0, np.int64)
            heard_at: Floats = np.empty(0)
            if z is not None:
                echoes = as_array("z", z, (None, 2), self._dtype, missing=True)
                _require_moderate(echoes)
                heard_at = as_array("z_time_s", z_time_s, (len(echoes),), double)
                _require_ascending("z_time_s", heard_at)
                if heard_at[0] < times[0] or heard_at[-1] > times[-1]:
                    raise ValueError(
                        f"z_time_s must lie within time_s, {times[0]} to {times[-1]}; "
                        f"it reaches from {heard_at[0]} to {heard_at[-1]}"
                    )
                numbers = self._as_numbers(None if self._deaf else master, len(echoes))
                there = ~np.isnan(echoes[:, 0])
                echoes, numbers, heard_at = echoes[there], numbers[there], heard_at[there]
            done, status, out, interrupted = in_slices(
                rows,
                first_slice(getattr(self, "particles", 1)),
                lambda first, end: self._run_slice(
                    slice(first, end), (times, readings, plan), (heard_at, echoes, numbers), device
                ),
                Status.ok,
            )
            width = int(out["masters"][:done].max(initial=0))
            result = SlatRun(
                time_s=times[1 : done + 1],
                x=out["x"][:done],
                P=out["P"][:done],
                masters_x=out["masters_x"][:done, :width],
                masters_P=out["masters_P"][:done, :width],
                effective_size=out["effective_size"][:done],
                resamplings=out["resamplings"][:done],
                log_likelihood=out["log_likelihood"][:done],
                nis=out["nis"][:done],
                refused=out["refused"][:done],
                rebirths=out["rebirths"][:done],
            )
            self._status = status
            step_s = times[done + 1] - times[done] if status == Status.step_too_long else 0.0
            hint = self._why(status, step_s, echoes, sonar)
        if status != Status.ok:
            raise FilterError("run", status, step=done, partial=result, hint=hint)
        if interrupted:
            raise Interrupted(result)
        return result

    def _run_slice(
        self,
        rows: slice,
        moves: tuple[Floats, Floats, Floats],
        heard: tuple[Floats, Floats, npt.NDArray[np.int64]],
        device: _core._Sonar,
    ) -> tuple[int, Status, dict[str, Any]]:
        """Run some readings of a record, with the echoes up to the end of the last."""
        times, readings, plan = moves
        times = times[rows.start : rows.stop + 1]
        # An echo at the very beginning belongs to the first reading of the record.
        low = np.searchsorted(heard[0], times[0], "right") if rows.start else 0
        high = np.searchsorted(heard[0], times[-1], "right")
        out = self._core_steps.run(
            times,
            readings[rows],
            plan[rows] if len(plan) else plan,
            *(column[low:high] for column in heard),
            device,
            self._random,
        )
        return out.pop("done"), out.pop("status"), out

    def save(self) -> bytes:
        """Give the whole state, with that of the random numbers, for :meth:`restore`.

        Models and parameters are named in it but are not part of it; pickle the filter to keep
        those too.
        """
        with self._exclusive:
            arrays = {**self._core_steps.save(), "random": self._random.save()}
        return _state.pack(type(self).__name__, self._description(), arrays)

    def restore(self, state: bytes) -> None:
        """Take back what :meth:`save` gave; the filter goes on with the same bits.

        Raises
        ------
        ValueError, TypeError
            If the state is damaged, or not that of a filter of this class with these models,
            parameters and precision; the message names what differs. The filter is then unchanged.
        """
        arrays = _state.unpack(state, type(self).__name__, self._description())
        dtypes = {"numbers": self._dtype, "counts": np.int64, "random": np.uint32}
        _state.require(arrays, dtypes)
        with self._exclusive:
            twin, random = self._core_steps.copy(), self._random.copy()
            random.restore(arrays["random"])
            twin.restore(arrays["numbers"], arrays["counts"])
            self._require_started(twin, arrays["counts"])
            self._require_legal(twin)
            self._core_steps, self._random, self._status = twin, random, Status.ok

    def _require_local(self, name: str, pose: Floats) -> None:
        """Refuse a start where motion is rounded away, however little is known of the position.

        What counts is how far the noise of the speed lets the slave go in a second.
        """
        is_coarse = getattr(_core, f"is_coarse_{self._dtype.name}")
        sigma = self._motion.sigma_speed_m_s
        way = min(sigma * sigma, float(np.finfo(self._dtype).max))
        if any(is_coarse(float(place), way) for place in pose[:2]):
            raise ValueError(far_from_origin(name, pose[:2], self._dtype))

    def _require_started(self, core: Any, counts: npt.NDArray[np.int64]) -> None:  # noqa: ARG002
        """Refuse the state of a filter that was never started: there is none such in Python."""
        if counts[0] != 1:
            raise ValueError("state is damaged: it is that of a filter that was not started")

    def _require_legal(self, core: Any) -> None:
        """Refuse a restored filter of the core whose beliefs are none."""
        # Rounding may leave a covariance that filters go on with not quite positive.
        slack = 1e-3 if self._dtype == np.dtype(np.float32) else 1e-9
        beliefs = {"slave": core.slave()} if self._has_slave(core) else {}
        beliefs |= {f"master {n}": core.master(n) for n in range(core.masters)}
        for name, (x, covariance) in beliefs.items():
            variances = np.diagonal(covariance).astype(np.float64)
            legal = np.isfinite(x).all() and np.isfinite(covariance).all()
            legal = legal and bool((variances >= 0).all())
            if legal:
                sigma = np.sqrt(np.where(variances > 0, variances, 1.0))
                correlation = covariance / np.outer(sigma, sigma)
                legal = np.linalg.eigvalsh(correlation.astype(np.float64))[0] >= -slack
            if not legal:
                raise ValueError(f"state is damaged: the belief of the {name} is none")

    def _has_slave(self, core: Any) -> bool:  # noqa: ARG002
        return True

    def __getstate__(self) -> dict[str, Any]:
        in_the_core = ("_core_steps", "_device", "_random", "_exclusive")
        kept = {name: value for name, value in self.__dict__.items() if name not in in_the_core}
        return {**kept, "state": self.save()}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        kept = dict(pickled)
        state, status = kept.pop("state"), kept["_status"]
        self.__dict__.update(kept)
        self._prepare()
        self._random = _core.Random(0)
        self.restore(state)
        self._status = status

    def __deepcopy__(self: _Self, memo: dict[int, Any]) -> _Self:
        twin = type(self).__new__(type(self))
        with self._exclusive:
            twin.__dict__.update(self.__dict__)
            twin._core_steps = self._core_steps.copy()
            twin._random = self._random.copy()
        twin._exclusive = Exclusive()
        memo[id(self)] = twin
        return twin

    def __copy__(self: _Self) -> _Self:
        return self.__deepcopy__({})

    @property
    def _unknown(self) -> bool:
        return self._deaf or self._births

    def _prepare(self) -> None:
        """Build the filter in the core, and what goes with it."""
        raise NotImplementedError

    def _description(self) -> dict[str, Any]:
        """Say what a filter must have in common with this one to take its state."""
        raise NotImplementedError

    def _slave(self) -> tuple[Floats, Floats]:
        return self._core_steps.slave()

    def _reading(self, name: str) -> Any:
        with self._exclusive:
            return getattr(self._core_steps, name)

    def _do(
        self,
        name: str,
        plain: tuple[Any, ...],
        convert: Callable[[], tuple[Any, ...]],
        *rest: Any,
        heard: tuple[Any, Sonar | None] = (None, None),
    ) -> None:
        """Have the core do it with arguments as they are, or converted where they are not plain."""
        with self._exclusive:
            method = getattr(self._core_steps, name)
            try:
                if not method(*plain, *rest) and not method(*convert(), *rest):
                    raise AssertionError(f"{name}: converted arguments are plain")
            except _core.StatusError as error:
                self._status = error.status
                if self._shared and error.status == Status.bad_parameter:
                    raise ValueError(_NEEDS_KNOWN) from None
                action = name if name == "update" else f"{name}(dt={plain[0]})"
                hint = self._why(error.status, plain[0], *heard)
                raise FilterError(action, error.status, hint=hint) from None
            self._status = Status.ok

    def _why(self, status: Status, dt: Any, z: Any, sonar: Sonar | None) -> str:
        """Explain a status that says less than is known here; empty for the others."""
        if status == Status.step_too_long:
            return step_too_long(f"dt = {float(dt):.6g} s", self._settings["longest_step_s"])
        if status == Status.impossible_range:
            device = sonar or self._sonar
            ranges = np.asarray(z, np.float64).reshape(-1, 2)[:, 0]
            inside = (ranges >= device.smallest_range_m) & (ranges <= device.largest_range_m)
            return impossible_range("Sonar", ranges[~np.isnan(ranges) & ~inside][0], device)
        if status == Status.far_from_origin:
            return far_from_origin("x", self._slave()[0][:2], self._dtype)
        return ""

    def _as_master(self, n: int) -> int:
        count = self._core_steps.masters
        if count == 0:
            raise ValueError(f"there is no master {n}: none was added")
        return as_integer("n", n, 0, count - 1)

    def _as_device(self, sonar: Sonar | None) -> _core._Sonar:
        if sonar is None:
            return self._device
        as_instance("sonar", sonar, Sonar)
        require_heading(sonar, self._motion)
        return core_sonar(sonar, self._dtype.name)

    def _as_move(
        self, dt: float, u: npt.ArrayLike, changes: npt.ArrayLike | None
    ) -> tuple[float, Floats, Floats | None]:
        plan = None
        if changes is not None:
            masters = max(1, self._core_steps.masters)
            plan = as_array("changes", changes, (masters, 2), self._dtype)
        return as_step(dt, self._dtype), as_array("u", u, (2,), self._dtype), plan

    def _as_echoes(
        self, z: npt.ArrayLike | None, master: npt.ArrayLike | None
    ) -> tuple[Floats | None, npt.NDArray[np.int64] | None]:
        if z is None:
            return None, None
        shape = (2,) if np.ndim(z) == 1 else (None, 2)
        echoes = as_array("z", z, shape, self._dtype, missing=True).reshape(-1, 2)
        _require_moderate(echoes)
        numbers = self._as_numbers(master, len(echoes))
        there = ~np.isnan(echoes[:, 0])
        echoes, numbers = echoes[there], numbers[there]
        known = numbers[numbers != UNKNOWN_MASTER]
        if len(np.unique(known)) < len(known):
            raise ValueError(f"master names a master twice: {numbers.tolist()}")
        if len(echoes) > MAX_MASTERS:
            raise ValueError(f"z has {len(echoes)} echoes; at most {MAX_MASTERS} are taken at once")
        return (echoes if len(echoes) else None), numbers

    def _as_numbers(self, master: npt.ArrayLike | None, count: int) -> npt.NDArray[np.int64]:
        masters = self._core_steps.masters
        if master is None:
            if masters > 1 and not self._unknown:
                raise TypeError(f"master must be given: the filter has {masters} masters")
            nobody = self._unknown or masters == 0  # then the core has the word
            return np.full(count, UNKNOWN_MASTER if nobody else 0, np.int64)
        raw = np.asarray(master)
        if raw.dtype.kind not in "iu":
            raise TypeError(f"master must be an int or an array of int, not of {raw.dtype.name}")
        if raw.shape not in ((), (count,)):
            raise ValueError(f"master has shape {raw.shape}, expected ({count},) as z has rows")
        numbers = np.ascontiguousarray(np.broadcast_to(raw, (count,)), dtype=np.int64)
        for number in np.unique(numbers):
            if not UNKNOWN_MASTER <= number < masters:
                raise ValueError(
                    f"master is {number}, but the filter has {counted(masters, 'master')}"
                )
            if self._shared and number == UNKNOWN_MASTER:
                raise ValueError(_NEEDS_KNOWN)
        return numbers


class SlatFilter(Steps):
    """What the filters of this package share; not for direct use.

    One filter belongs to one thread at a time: a call while another thread is inside raises
    ``RuntimeError``. Use a copy (``copy.deepcopy``) per thread; it goes on with the same random
    numbers.
    """

    #: The parameters in the core, with their defaults.
    _defaults: Mapping[str, Any] = {}

    _max_masters: int = MAX_MASTERS
    _start: tuple[Floats, Floats, int, int]  # x0, P0, seed and stream: with all else, what it was

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        motion: Motion = COMPASS,
        sonar: Sonar = SONAR,
        dtype: npt.DTypeLike = "float64",
        seed: int = 0,
        stream: int = 0,
        settings: Mapping[str, Any] | None = None,
        **parameters: Any,
    ) -> None:
        for name in parameters:
            if name not in self._defaults:
                raise TypeError(
                    f"{type(self).__name__}.__init__() got an unexpected keyword argument {name!r}"
                )
        self._dtype = as_dtype(dtype)
        self._motion = as_instance("motion", motion, (CompassMotion, UnicycleMotion))
        self._sonar = as_instance("sonar", sonar, Sonar)
        require_heading(self._sonar, self._motion)
        self._settings = {**(settings or {}), **self._as_params(parameters)}
        seed = as_integer("seed", seed, 0, 2**64 - 1)
        stream = as_integer("stream", stream, 0, 2**64 - 1)
        n = self._motion.pose_states
        state = as_array("x0", x0, (n,), self._dtype)
        covariance = as_covariance("P0", P0, n, self._dtype, definite=False)
        self._require_local("x0", state)
        self._start = state, covariance, seed, stream
        self._prepare()
        self._random = _core.Random(seed, stream)
        self._status = Status.ok
        try:
            self._core_steps.reset(state, covariance, self._random)
        except _core.StatusError as error:
            if error.status == Status.far_from_origin:
                raise ValueError(far_from_origin("x0", state[:2], self._dtype)) from None
            raise ValueError(f"x0, P0 or the parameters are refused: {error}") from None

    def _prepare(self) -> None:
        name = self._dtype.name
        self._exclusive = Exclusive()
        self._device = core_sonar(self._sonar, name)
        params = {key: self._settings[key] for key in self._defaults}
        finite = {key: value for key, value in params.items() if value != math.inf}
        require_range(finite, name)
        core = getattr(_core, f"Slat_{self._motion.name}_{name}")
        self._core_steps = self._build(core, core_params(self._motion, name), params)

    def _build(self, core: Any, motion: dict[str, Any], params: dict[str, Any]) -> Any:
        """Make this filter in the core, of whose class ``core`` it is."""
        raise NotImplementedError

    def _description(self) -> dict[str, Any]:
        models = {"motion": self._motion, "sonar": self._sonar, **self._settings}
        described = {name: _state.describe(value) for name, value in models.items()}
        return {"dtype": self._dtype.name, **described}

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
            number = self._as_master(n)
            modes: Floats = np.array(self._core_steps.mode_probabilities(number), self._dtype)
        if modes.size == 0:
            raise ValueError("mode probabilities need an auvest.Imm as master")
        return modes

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
            ``[x, y, vx, vy, ax, ay]``, m from the slave's origin, m/s, m/s^2.
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
        covariance = as_covariance("P", P, 6, self._dtype, definite=True)
        with self._exclusive:
            number: int = self._core_steps.masters
            if number == self._max_masters:
                raise ValueError(f"the filter has {counted(number, 'master')} already, that is all")
            try:
                self._core_steps.add_master(state, covariance)
            except _core.StatusError as error:
                if error.status == Status.far_from_origin:
                    raise ValueError(far_from_origin("x", state[:2], self._dtype)) from None
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
        move, heard = (dt, u, changes), (z, None if self._deaf else master)
        device = self._as_device(sonar)
        self._do(
            "step",
            (*move, *heard),
            lambda: (*self._as_move(*move), *self._as_echoes(*heard)),
            self._unknown,
            device,
            self._random,
            heard=(z, sonar),
        )

    def _as_params(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Take values for ``_defaults``: flags, shares in 0..1, else numbers of at least 0."""
        params: dict[str, Any] = {}
        for name, value in {**self._defaults, **given}.items():
            if isinstance(self._defaults[name], bool):
                params[name] = as_flag(name, value)
                continue
            if isinstance(self._defaults[name], int):
                params[name] = as_integer(name, value, 0, 16)
                continue
            bound: Bound = "positive" if name in _POSITIVE else "not negative"
            params[name] = as_number(name, value, bound, infinite=name == "longest_step_s")
            if "birth_" in name and params[name] > _LARGEST:
                raise ValueError(f"{name} must be at most {_LARGEST:g}, not {params[name]:g}")
            if name in ("resample_below", "kept") and params[name] > 1:
                raise ValueError(f"{name} must lie in 0..1, not {params[name]:g}")
        if params.get("recover_after", 0) > params.get("recover_of", 0):
            raise ValueError(
                f"recover_after = {params['recover_after']} of the last "
                f"recover_of = {params['recover_of']} echoes cannot be"
            )
        return params


class ParticleSlatFilter(SlatFilter):
    """What :class:`Slatf` and :class:`SlatfJoint` share; not for direct use."""

    _max_particles: ClassVar[int]
    _masters: ClassVar[tuple[type, ...]] = (PiecewiseAcceleration,)

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        particles: int = 100,
        master: Master = MASTER,
        resampling: Resampling = "systematic",
        seed: int = 1,
        settings: Mapping[str, Any],
        **options: Any,
    ) -> None:
        own = {
            "particles": as_integer("particles", particles, 1, self._max_particles),
            "master": as_instance("master", master, self._masters),
            "resampling": as_kind("resampling", resampling, get_args(Resampling)),
        }
        super().__init__(x0, P0, seed=seed, settings={**own, **settings}, **options)

    def _require_legal(self, core: Any) -> None:
        super()._require_legal(core)
        weights = core.particles()[0].astype(np.float64)
        if len(weights) != self.particles or not abs(weights.sum() - 1) < 1e-3:
            raise ValueError("state is damaged: its weights have no sum of 1")
        if not 0 <= core.effective_size <= 1.001 * self.particles:
            raise ValueError(f"state is damaged: its effective size is {core.effective_size}")

    @property
    def particles(self) -> int:
        """N."""
        return int(self._settings["particles"])

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
            return self._core_steps.particles()[0]

    @property
    def poses(self) -> Floats:
        """Poses of the particles (:class:`SlatfJoint`: their means), shape (N, n), a copy."""
        with self._exclusive:
            return self._core_steps.particles()[1]


def as_covariance(name: str, value: object, n: int, dtype: DType, *, definite: bool) -> Floats:
    """Take a symmetric (n, n) array without negative eigenvalues, or with positive ones only."""
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


def require_heading(sonar: Sonar, motion: Motion) -> None:
    """Refuse a sonar that needs a heading where the pose has none."""
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
    far = np.argwhere(np.abs(np.nan_to_num(z)) > _LARGEST)
    if far.size:
        row, column = (int(i) for i in far[0])
        raise ValueError(f"z[{row}, {column}] is {z[row, column]}, beyond 1e9")
