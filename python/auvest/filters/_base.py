"""The frame of the filters: arguments, steps, records, state. The estimation is all C++.

Single steps call the core at once; it reads arguments in their usual forms. What it does not
understand comes back here, to be converted or refused in words.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import (
    DType,
    Floats,
    InUse,
    as_array,
    as_covariance,
    as_dtype,
    as_flag,
    as_instance,
    as_integer,
    as_kind,
    as_number,
    as_real,
    as_step,
    as_steps,
    as_workers,
    far_from_origin,
    impossible_range,
    require_range,
    step_too_long,
    type_name,
    warn_of_degrees,
)
from auvest._core import Convergence, Decision, Status
from auvest._interrupts import first_slice, in_slices
from auvest._state import describe, pack, require, unpack
from auvest._texts import counted
from auvest.errors import FilterError, Interrupted
from auvest.filters._many import is_stack, run_many
from auvest.filters.results import Mixture, Report, RunResult, SmoothResult
from auvest.intervals import FixedInterval, IntervalPolicy, MahalanobisInterval, core_interval
from auvest.kernels import Kernel, KernelName, RejectionStreak, Unit, as_kernel, core_kernel
from auvest.models import SENSORS, LeaderRange, MeasurementModel, ProcessModel, from_description
from auvest.models._base import UNSAVED
from auvest.models.functions import FunctionProcess, FunctionSensor, require_none_raised

if TYPE_CHECKING:
    from typing_extensions import Self

    from auvest._core import _Filter, _Sensor

Residual: TypeAlias = Literal["innovation", "post-fit"]
Sensors: TypeAlias = MeasurementModel | Sequence[MeasurementModel] | Mapping[str, MeasurementModel]

_UPDATE = _core.robust_update_defaults()
_FIXED = FixedInterval()
_UNIT = Unit()
_POSITION = ("x_m", "y_m", "z_m")
_REPORT = ("innovation", "S", "standardised", "weight")
_LARGEST_REPORT = 6  # numbers of a measurement
_RING = 8  # components, at least
#: Rows that are smoothed at once: of any filter of the core, and of one that calls Python.
_BLOCK, _SLOW_BLOCK = 8192, 64
_STATUSES = {int(status) for status in Status.__members__.values()}
_DECISIONS = {int(decision) for decision in Decision.__members__.values()}


class GaussianFilter:
    """What :class:`Ekf`, :class:`Ukf` and their presets have in common; not for direct use.

    One filter belongs to one thread at a time: a call while another thread is inside raises
    ``RuntimeError``. Use a copy (``copy.deepcopy``) per thread.
    """

    #: How the core linearises: its number in ``AnyLinearisation``.
    _linearisation: ClassVar[int]
    #: Whether it asks models for their Jacobians.
    _jacobians: ClassVar[bool] = False
    #: Of the thread that is in :meth:`run`.
    _run: object

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel,
        sensors: Sensors = (),
        kernel: Kernel | KernelName | None = None,
        recovery: RejectionStreak | None = None,
        policy: IntervalPolicy | None = None,
        late_s: float = 0.0,
        longest_step_s: float = 3600.0,
        components: int = 1,
        headings: int = 1,
        residual: Residual = "innovation",
        max_iterations: int = _UPDATE["max_iterations"],
        tolerance: float = _UPDATE["tolerance"],
        reference: npt.ArrayLike | None = None,
        dtype: npt.DTypeLike = "float64",
        parameters: dict[str, float] | None = None,
    ) -> None:
        self._dtype = as_dtype(dtype)
        self._process: ProcessModel = as_instance("process", process, ProcessModel)
        self._require_jacobian(self._process)
        self._sensors = _as_sensors(sensors, self._process)
        for model in self._sensors.values():
            self._require_jacobian(model)
        self._kernel = None if kernel is None else as_kernel(kernel)
        if recovery is not None:
            as_instance("recovery", recovery, RejectionStreak)
            if kernel is None:
                raise ValueError(
                    "recovery is for filters with a kernel: without one nothing is ever rejected"
                )
        self._recovery = recovery
        if policy is not None:
            as_instance("policy", policy, IntervalPolicy.__args__)
        self._policy = policy
        self._options: dict[str, Any] = {
            "late_s": as_number("late_s", late_s, "not negative"),
            "longest_step_s": as_number(
                "longest_step_s", longest_step_s, "positive", infinite=True
            ),
            "residual": as_kind("residual", residual, ("innovation", "post-fit")),
            "max_iterations": as_integer("max_iterations", max_iterations, 2, 255),
            "tolerance": as_number("tolerance", tolerance, "not negative"),
        }
        self._components = as_integer("components", components, 1, _core.MAX_COMPONENTS)
        self._headings = as_integer("headings", headings, 1, _core.MAX_COMPONENTS // _RING)
        self._require_place_for_components()
        self._parameters = {} if parameters is None else parameters
        states = len(self._process.state)
        state = as_array("x0", x0, (states,), self._dtype)
        covariance = as_covariance("P0", P0, states, self._dtype)
        start = state[[0, min(1, states - 1)]]
        if reference is not None:
            start = as_array("reference", reference, (2,), self._dtype)
        self._require_local(state, covariance)
        self._build()
        try:
            self._filter.reset(state, covariance, start)
        except _core.StatusError as error:
            if error.status == Status.far_from_origin:
                raise ValueError(far_from_origin("x0", state[:2], self._dtype)) from None
            if error.status != Status.not_positive_definite:
                raise ValueError(f"x0 and P0 are refused: {error}") from None
            smallest = np.linalg.eigvalsh(covariance.astype(np.float64))[0]
            raise ValueError(
                f"P0 must be positive definite in {self._dtype.name}, "
                f"but its smallest eigenvalue is {smallest:.3g}"
            ) from None

    def _require_local(self, state: Floats, covariance: Floats) -> None:
        """Refuse a start where motion is rounded away, however little is known of the position.

        What counts is how far the process lets the position go in a second. (Functions of Python
        are not asked: they are in float64, and may raise.)
        """
        if isinstance(self._process, FunctionProcess) or self._process.lacks:
            return
        before = np.asarray(covariance, np.float64)
        phi = self._process.Phi(1.0, state)
        growth = np.diagonal(phi @ before @ phi.T + self._process.Q(1.0) - before)
        is_coarse = getattr(_core, f"is_coarse_{self._dtype.name}")
        largest = float(np.finfo(self._dtype).max)
        place = [i for i, name in enumerate(self._process.state) if name in _POSITION]
        for i in place:
            if growth[i] > 0 and is_coarse(float(state[i]), min(float(growth[i]), largest)):
                raise ValueError(far_from_origin("x0", state[place], self._dtype))

    def _require_place_for_components(self) -> None:
        """Refuse several components where no range could make a ring of them."""
        if self._headings > 1:
            if self._process.state[2:3] not in (("theta_rad",), ("heading_rad",)):
                raise ValueError(
                    "headings is for a process whose third state is theta_rad, its heading, not "
                    f"{type(self._process).__name__}"
                )
            if self._components < _RING * self._headings:
                raise ValueError(
                    f"{self._headings} headings need at least {_RING * self._headings} components, "
                    f"not {self._components}"
                )
        if self._components == 1:
            return
        if self._components < _RING:
            raise ValueError(
                f"components must be 1, or at least {_RING}: a ring of {self._components} has gaps"
            )
        if self._process.state[:2] != _POSITION[:2]:
            raise ValueError(
                "components is for a process whose first states are x_m and y_m, not "
                f"{type(self._process).__name__}"
            )
        if self._sensors and all(_makes_no_ring(model) for model in self._sensors.values()):
            raise ValueError("components is for ranges: none of sensors is a LeaderRange")

    def _build(self) -> None:
        self._filter = self._core_filter(self._policy)
        self._handles = {
            name: model.core(len(self._process.state), self._dtype)
            for name, model in self._sensors.items()
        }
        self._only = next(iter(self._handles.values())) if len(self._handles) == 1 else None

    def _core_filter(self, policy: IntervalPolicy | None) -> _Filter[Any]:
        """Make a filter of the core like this one, with the policy given."""
        name = self._dtype.name
        numbers = {**self._parameters, "late_s": self._options["late_s"]}
        if self.longest_step_s < np.inf:
            numbers["longest_step_s"] = self.longest_step_s
        require_range(numbers, name)
        options = {
            "linearisation": self._linearisation,
            "points": self._parameters,
            "rejections": 0 if self._recovery is None else self._recovery.rejections,
            "post_fit": self._options["residual"] == "post-fit",
            "max_iterations": self._options["max_iterations"],
            "tolerance": self._options["tolerance"],
            "late_s": self._options["late_s"],
            "longest_step_s": self._options["longest_step_s"],
            "components": self._components,
            "headings": self._headings,
        }
        try:
            return getattr(_core, f"Filter_{name}")(
                self._process.core(self._dtype),
                core_kernel(_UNIT if self._kernel is None else self._kernel, name),
                core_interval(_FIXED if policy is None else policy, name),
                options,
            )
        except _core.StatusError as error:
            given = {**self._parameters, "tolerance": self._options["tolerance"]}
            text = ", ".join(f"{key}={value}" for key, value in given.items())
            raise ValueError(f"{text} do not suit {name}: {error}") from None

    # ---- What can be read -----------------------------------------------------------------------

    @property
    def x(self) -> Floats:
        """The estimate, shape (n,), a copy; its components are named by ``process.state``."""
        return self._filter.x

    @property
    def P(self) -> Floats:
        """The covariance of the estimate, shape (n, n), a copy."""
        return self._filter.P

    @property
    def report(self) -> Report | None:
        """What the last update reported; None before one and if z was missing."""
        given = self._filter.report
        return None if given is None else Report(**given)

    @property
    def innovation(self) -> Floats:
        """Innovation of the last update, shape (m,); NaN before one and if z was missing.

        A position error (m) if ``near_field``.
        """
        return self._last("innovation", 1)

    @property
    def S(self) -> Floats:
        """Covariance of the innovation before any weight, shape (m, m); NaN as ``innovation``."""
        return self._last("S", 2)

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the last update; NaN as ``innovation``."""
        return float(self._filter.nis)

    @property
    def near_field(self) -> bool:
        """True if the last update took the measurement as a position (near the station)."""
        given = self._filter.report
        return given is not None and bool(given["near_field"])

    @property
    def status(self) -> Status:
        """What the core reported last: ``Status.ok`` unless a FilterError was raised.

        ``Status.recoveries_repeat`` while the recovery has widened the covariance so often that it
        does not any more: then a model is wrong, and not the estimate.
        """
        return self._filter.status

    @property
    def dtype(self) -> DType:
        """float32 or float64."""
        return self._dtype

    @property
    def process(self) -> ProcessModel:
        """The process model."""
        return self._process

    @property
    def sensors(self) -> dict[str, MeasurementModel]:
        """The sensors by name; the name of one given without is that of its class."""
        return dict(self._sensors)

    @property
    def kernel(self) -> Kernel | None:
        """The robust kernel; None: every measurement counts fully."""
        return self._kernel

    @property
    def recovery(self) -> RejectionStreak | None:
        """The recovery from lock-out."""
        return self._recovery

    @property
    def residual(self) -> Residual:
        """Which residual the kernel judges."""
        return self._options["residual"]

    @property
    def late_s(self) -> float:
        """How long ago a measurement may have been taken, s."""
        return float(self._options["late_s"])

    @property
    def longest_step_s(self) -> float:
        """A longer prediction is refused, s; infinity: none is."""
        return float(self._options["longest_step_s"])

    @property
    def components(self) -> int:
        """How many Gaussians the belief may be made of; 1: no more than one."""
        return self._components

    @property
    def headings(self) -> int:
        """How many headings the start was made of; 1: the heading was known."""
        return self._headings

    @property
    def convergence(self) -> Convergence:
        """What the ranges say about where the craft is; only with ``components``."""
        if self._components == 1:
            raise AttributeError("convergence needs components; this filter has one")
        return self._filter.convergence

    @property
    def mixture(self) -> Mixture:
        """The Gaussians of the belief, whose moments are ``x`` and ``P``; copies."""
        return Mixture(*self._filter.mixture)

    @property
    def policy(self) -> IntervalPolicy | None:
        """The interval policy."""
        return self._policy

    @property
    def interval(self) -> float:
        """T(k): time to the next sample, s; only with a policy."""
        self._require_policy("interval")
        return float(self._filter.interval)

    @property
    def tau(self) -> float:
        """tau(k+1) of [AUKF 12]; only with :class:`MahalanobisInterval`."""
        return self._law("tau")

    @property
    def ratio(self) -> float:
        """M(k) of [AUKF 7]; only with :class:`MahalanobisInterval`."""
        return self._law("ratio")

    @property
    def mahalanobis_squared(self) -> float:
        """d(k)^2 of [AUKF 11]; only with :class:`MahalanobisInterval`."""
        return self._law("mahalanobis_squared")

    def _law(self, name: str) -> float:
        law = self._filter.law
        if law is None or not isinstance(self._policy, MahalanobisInterval):
            kind = type(self._policy).__name__
            raise AttributeError(f"{name} belongs to MahalanobisInterval; this filter has {kind}")
        return float(law[name])

    def _last(self, name: str, axes: int) -> Floats:
        given = self._filter.report
        if given is not None:
            return given[name]
        size = self._only.size if self._only is not None else 0
        return np.full((size,) * axes, np.nan, self._dtype)

    def _require_policy(self, what: str) -> None:
        if self._policy is None:
            raise AttributeError(f"{what} needs an interval policy; this filter has none")

    # ---- Steps ----------------------------------------------------------------------------------

    def predict(self, dt: float | None = None, input: npt.ArrayLike | None = None) -> None:
        """Carry the estimate ``dt >= 0`` seconds forward.

        Parameters
        ----------
        dt : float, optional
            Seconds, at most ``longest_step_s``; default: the ``interval`` that the policy chose.
        input : array_like, shape (k,)
            What drove the process in that time, named by ``process.input``; not given for a process
            without input.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the prediction cannot be done. In all cases the filter is unchanged.
        """
        if dt is None and self._policy is None:
            raise TypeError("dt must be a number, not None: this filter has no interval policy")
        code = self._filter.predict(dt, input)
        if code == 0:
            return
        if code == _core.UNCLEAR:
            step = None if dt is None else as_step(dt, self._dtype)
            code = self._filter.predict(step, self._as_input(input))
        self._require_done(f"predict(dt={dt})", code, dt=dt)

    def update(
        self,
        z: npt.ArrayLike | None,
        sensor: str | MeasurementModel | None = None,
        *,
        place: npt.ArrayLike | None = None,
        age_s: float | None = None,
    ) -> None:
        """Correct the estimate by one measurement; ``report`` says what it did.

        Parameters
        ----------
        z : float or array_like, shape (m,), or None
            The numbers that ``sensor.measures`` names. None or NaN throughout: missing, the
            estimate stays.
        sensor : str or MeasurementModel, optional
            What measured: one of ``sensors`` by name, or any other model; needed where the filter
            has several.
        place : array_like, optional
            What ``sensor.place`` names, then: where the station or the leader stood, m, how the
            instrument was headed, rad; default: as the model has it, if it does.
        age_s : float, optional
            How long ago it was measured, s, at most ``late_s``; default: now.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the update cannot be done. In all cases the filter is unchanged.
        """
        handle = self._only if sensor is None else self._handle(sensor)
        if handle is None:
            handle = self._handle(None)
        code = self._filter.update(z, handle, place, age_s)
        if code == 0:
            return
        if code == _core.UNCLEAR:
            given = np.atleast_1d(z) if handle.size == 1 and np.ndim(z) == 0 else z  # type: ignore[arg-type]
            row = as_array("z", given, (handle.size,), self._dtype, missing=True)
            if place is None and not np.isnan(row).any():
                self._require_place("place", sensor)
            there = None if place is None else self._as_place(place, handle)
            age = 0.0 if age_s is None else as_number("age_s", age_s, "not negative")
            code = self._filter.update(row, handle, there, age)
        if code == int(Status.time_backwards):
            age = as_number("age_s", age_s)
            why = "reaches back before the start: the filter has run for less than that"
            if age > self.late_s:
                more = "make the filter with a larger late_s"
                why = f"is more than late_s = {self.late_s:g}: {more}"
            raise FilterError("update", Status.time_backwards, hint=f"age_s = {age:g} {why}")
        self._require_done("update", code, z=z, sensor=sensor, place=place)

    def feedback(self, reference: npt.ArrayLike | None = None) -> float:
        """Choose the interval to the next sample, after the update; only with a policy.

        Parameters
        ----------
        reference : array_like, shape (2,), optional
            Desired position now, m; default: the estimate itself.

        Returns
        -------
        float
            ``interval``, s.

        Raises
        ------
        ValueError, TypeError
            If ``reference`` is wrong; the filter is unchanged.
        """
        self._require_policy("feedback()")
        before = self._before_functions()
        code = self._filter.feedback(reference)
        if code == _core.UNCLEAR:
            code = self._filter.feedback(as_array("reference", reference, (2,), self._dtype))
        self._require_done("feedback", code)
        self._require_functions_done(before)
        return float(self._filter.interval)

    def run(
        self,
        z: npt.ArrayLike,
        *,
        dt: npt.ArrayLike | None = None,
        input: npt.ArrayLike | None = None,
        sensor: str | MeasurementModel | Sequence[str | MeasurementModel] | None = None,
        place: npt.ArrayLike | None = None,
        age_s: npt.ArrayLike | None = None,
        reference: npt.ArrayLike | None = None,
        covariance: bool = True,
        workers: int | None = None,
    ) -> RunResult:
        """Predict and update over a record, in C++ and without the GIL; or over many records.

        Of an array of three axes each ``z[r]`` is a record, and a run of its own: it begins where
        the filter is, and the filter stays there. ``dt``, ``input``, ``place``, ``age_s`` and
        ``reference`` are those of all runs, or have an axis for the runs in front. The runs are
        done on all processors and, where the models are among those that stand in vector lanes,
        several at a time in each; the bits are those of each record by itself. No run is refused
        for another's sake: see :class:`RunsResult`.

        Parameters
        ----------
        z : array_like, shape (T, m) or (runs, T, m); (T,) where all measurements are one number
            A measurement per row, those of smaller sensors filled up with NaN. NaN throughout: the
            measurement is missing and that row only predicts.
        dt : float or array_like, shape (T,)
            Time from the row before (or the filter's present) to each row, s, not negative and at
            most ``longest_step_s``: a longer one ends the run with a FilterError at its row. With a
            policy the default is the intervals that it chooses; the record must then have been
            sampled at them.
        input : array_like, shape (T, k)
            What drove the process in each of these times, as for :meth:`predict`.
        sensor : str or MeasurementModel, or sequence of these, length T
            What measured: one for all rows, or one per row, a name in ``sensors`` or a model;
            needed where the filter has several.
        place : array_like, shape (T, p), optional
            What ``sensor.place`` names, at each row: where the station or the leader stood, m, how
            the instrument was headed, rad; a NaN row, and default: as the model has it, if it does.
        age_s : float or array_like, shape (T,), optional
            How long before each row its measurement was taken, s. One older than ``late_s`` is left
            out and marked in the column ``too_late``.
        reference : array_like, shape (T, 2), optional
            Desired positions, m, for the policy; default: the estimates themselves.
        covariance : bool
            Whether ``P`` and ``S`` are recorded.
        workers : int, optional
            Threads for many records, 1 to 256; default: one per processor. Nothing depends on it.

        Returns
        -------
        RunResult
            Of many records a :class:`RunsResult`.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; the filter is unchanged.
        FilterError
            If a row of a single record cannot be done: ``dt`` beyond ``longest_step_s``, a range
            that the sensor cannot measure, a place far from the origin, numbers that overflow.
            ``step`` names it, ``partial`` holds the results before it, and the filter stays at the
            row before; a further ``run`` may go on behind the row.
        Interrupted
            After Ctrl-C, a ``KeyboardInterrupt`` within half a second: ``partial`` holds the
            results so far, and the filter stays at their last row; of many records the runs done.

        Warns
        -----
        UserWarning
            If an angle of ``input`` or ``z`` jumps from row to row as only degrees do.
        """
        as_flag("covariance", covariance)
        threads = as_workers(workers)
        if is_stack(z):
            arguments = (dt, input, sensor, place, age_s, reference)
            return run_many(self, z, *arguments, covariance=covariance, workers=threads)
        record, handles = self._as_record(z, dt, input, sensor, place, age_s, reference)
        count = len(record["z"])
        before = self._before_functions()
        with self._taken() as core:
            done, status, columns, interrupted = in_slices(
                count,
                8 if self._slow else first_slice(),
                lambda first, end: core.run(rows_of(record, first, end), handles, covariance),
                Status.ok,
            )
        if status == Status.ok:
            self._require_functions_done(before)
        result = RunResult(**self._asked_for(columns, done, covariance=covariance))
        if status != Status.ok:
            self._raise_at("run", status, done, result, record, sensor, given_dt=dt is not None)
        if interrupted:
            raise Interrupted(result)
        return result

    def smooth(
        self,
        z: npt.ArrayLike,
        *,
        dt: npt.ArrayLike | None = None,
        input: npt.ArrayLike | None = None,
        sensor: str | MeasurementModel | Sequence[str | MeasurementModel] | None = None,
        place: npt.ArrayLike | None = None,
        age_s: npt.ArrayLike | None = None,
        reference: npt.ArrayLike | None = None,
        covariance: bool = True,
        lag_s: float | None = None,
    ) -> SmoothResult:
        """Run a record and go back over it: each row with what the later ones know.

        The filter ends where :meth:`run` would leave it, and takes each row twice. Measurements
        have the weights that the filter gave them; each counts at its own time, a late one too.
        Beside its result the memory of a few thousand rows is used, however many there are.

        Parameters
        ----------
        z, dt, input, sensor, place, age_s, reference
            As for :meth:`run`.
        covariance : bool
            Whether ``P``, ``S`` and ``smoothed_P`` are recorded.
        lag_s : float, optional
            Each row knows what came within this time after it, s, as if it were estimated so much
            later on the way; default: everything.

        Returns
        -------
        SmoothResult

        Raises
        ------
        ValueError, TypeError, FilterError, Interrupted
            As :meth:`run` does; ``partial`` holds what the filter did, not smoothed.
        """
        as_flag("covariance", covariance)
        lag = None if lag_s is None else as_number("lag_s", lag_s, "not negative")
        record, handles = self._as_record(z, dt, input, sensor, place, age_s, reference)
        count = len(record["z"])
        size = _SLOW_BLOCK if self._slow else _BLOCK
        starts = range(0, count, size)
        whole: dict[str, Any] = {}
        marks: list[_Filter[Any]] = []
        first_interval = self._filter.interval
        before = self._before_functions()
        with self._taken() as core:
            status, done, interrupted = Status.ok, 0, False
            for first in starts:
                end = min(count, first + size)
                marks.append(core.copy())
                some, status, columns, interrupted = in_slices(
                    end - first,
                    8 if self._slow else first_slice(),
                    lambda a, b, first=first: core.run(  # type: ignore[misc]
                        rows_of(record, first + a, first + b), handles, covariance
                    ),
                    Status.ok,
                )
                for name, column in columns.items():
                    if name not in whole:
                        there = count if len(column) >= end - first else 0
                        whole[name] = np.empty((there, *column.shape[1:]), column.dtype)
                    if len(whole[name]):
                        whole[name][first : first + some] = column[:some]
                done = first + some
                if status != Status.ok or interrupted:
                    break
        kept = self._asked_for(whole, done, covariance=covariance)
        if status != Status.ok:
            result = RunResult(**kept)
            self._raise_at("smooth", status, done, result, record, sensor, given_dt=dt is not None)
        self._require_functions_done(before)
        if interrupted:
            raise Interrupted(RunResult(**kept))
        if dt is None:
            record["dt"] = np.concatenate([[first_interval], whole["interval_s"][:-1]]).astype(
                self._dtype
            )
        x = np.empty((count, len(self._process.state)), self._dtype)
        P = np.empty((count if covariance else 0, *x.shape[1:], x.shape[1]), self._dtype)
        reach = lookahead(record, self.late_s, lag)
        known: Any = None  # of the end of a block
        for k, first in reversed(list(enumerate(starts))):
            end = min(count, first + size)
            rows = rows_of(record, first, reach(end))
            smoothed, spreads, known = self._back(marks[k], rows, handles, end - first, known, lag)
            x[first:end] = smoothed
            if covariance:
                P[first:end] = spreads
        return SmoothResult(**{**kept, "smoothed_x": x, "smoothed_P": P if covariance else None})

    def _back(
        self,
        core: _Filter[Any],
        rows: dict[str, Any],
        handles: list[Any],
        count: int,
        known: Any,
        lag_s: float | None,
    ) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
        """Smooth the first rows: x, P and the belief before them.

        ``core`` is the filter as it was there, ``known`` the belief behind them, or None.
        """
        status, x, P, before = core.smooth(
            rows, handles, count, known, np.nan if lag_s is None else lag_s
        )
        require_none_raised()
        if status != Status.ok:
            raise FilterError("smooth", status)
        return x, P, before

    def _asked_for(self, columns: dict[str, Any], done: int, *, covariance: bool) -> dict[str, Any]:
        """Give the rows that were done of the columns of a result; None: not asked for."""
        missing = [] if covariance else ["P", "S"]
        if self._policy is None:
            missing.append("interval_s")
        if self.late_s == 0:
            missing.append("too_late")
        if self._components == 1:
            missing += ["convergence", "mixture_size"]
        return {
            name: None if column is None or name in missing else column[:done]
            for name, column in columns.items()
        }

    def _raise_at(
        self,
        action: str,
        status: Status,
        row: int,
        partial: RunResult,
        record: dict[str, Any],
        sensor: str | MeasurementModel | Sequence[str | MeasurementModel] | None,
        *,
        given_dt: bool,
    ) -> NoReturn:
        """Say why a row of a record cannot be done."""
        which, place = record["sensor"], record["place"]
        hint = self._why(
            status,
            dt=record["dt"][row] if given_dt else None,
            z=record["z"][row],
            sensor=sensor if which is None else list(sensor)[row],  # type: ignore[arg-type]
            place=None if place is None else place[row],
        )
        error = FilterError(action, status, step=row, partial=partial, hint=hint)
        try:
            require_none_raised()
        except Exception as cause:
            raise error from cause
        raise error

    def _as_record(
        self,
        z: npt.ArrayLike,
        dt: npt.ArrayLike | None,
        input: npt.ArrayLike | None,
        sensor: str | MeasurementModel | Sequence[str | MeasurementModel] | None,
        place: npt.ArrayLike | None,
        age_s: npt.ArrayLike | None,
        reference: npt.ArrayLike | None,
    ) -> tuple[dict[str, Any], list[Any]]:
        """Take the arguments of :meth:`run`: columns for the core, and its sensors."""
        used, which = self._sensors_used(sensor)
        handles = [self._handle(one) for one in used]
        record = self._as_columns(z, dt, input, used, handles, which, place, age_s, reference)
        self._look_for_degrees(record["z"], record["input"], used, which)
        return record, handles

    def _look_for_degrees(
        self,
        z: Floats,
        input: Floats | None,
        used: list[Any],
        which: npt.NDArray[np.int32] | None,
    ) -> None:
        """Warn of what no record in radians holds; for methods that the user calls by one other."""
        if input is not None:
            warn_of_degrees("input", self._process.input, input, stacklevel=4)
        for k, one in enumerate(used):
            rows = z if which is None else z[which == k]
            warn_of_degrees("z", self._named_sensor(one)[1].measures, rows, stacklevel=4)

    def _as_columns(
        self,
        z: npt.ArrayLike,
        dt: npt.ArrayLike | None,
        input: npt.ArrayLike | None,
        used: list[Any],
        handles: list[Any],
        which: npt.NDArray[np.int32] | None,
        place: npt.ArrayLike | None,
        age_s: npt.ArrayLike | None,
        reference: npt.ArrayLike | None,
    ) -> dict[str, Any]:
        """Take those of them that have a row per measurement of these sensors."""
        rows = self._as_measurements(z, handles, which)
        count = len(rows)
        if which is not None and len(which) != count:
            _refuse_rows("sensor", len(which), count)
        if dt is None and self._policy is None:
            raise TypeError("dt must be a number or an array of shape (T,), not None")
        track = None
        if self._policy is not None:
            track = np.full((count, 2), np.nan, self._dtype)
            if reference is not None:
                track = as_array("reference", reference, (None, 2), self._dtype)
                _require_rows("reference", track, count)
        elif reference is not None:
            raise TypeError("reference must be None: this filter has no interval policy")
        places = self._as_places(place, handles, which, count)
        self._require_standing(rows, places, used, which)
        return {
            "z": rows,
            "dt": np.full(count, np.nan, self._dtype)
            if dt is None
            else as_steps(dt, count, self._dtype),
            "input": self._as_inputs(input, count),
            "place": places,
            "age_s": self._as_ages(age_s, count),
            "reference": track,
            "sensor": which,
        }

    @property
    def _slow(self) -> bool:
        """Whether every step calls functions of Python."""
        models = (self._process, *self._sensors.values())
        return any(isinstance(model, (FunctionProcess, FunctionSensor)) for model in models)

    @contextmanager
    def _taken(self) -> Iterator[_Filter[Any]]:
        """Keep other threads out between the slices of a record too."""
        if vars(self).setdefault("_run", token := object()) is not token:  # atomic
            self._filter.x  # noqa: B018  (says that the filter is in use)
        core, self._filter = self._filter, InUse()  # type: ignore[assignment]
        try:
            yield core
        finally:
            self._filter = core
            del self._run

    # ---- State ----------------------------------------------------------------------------------

    def save(self) -> bytes:
        """Give the state, for :meth:`restore`: all that the filter carries from step to step.

        The models, the parameters and the precision are named in it; pickle the filter to keep
        those too.

        Raises
        ------
        ValueError
            If the filter remembers updates by a model that cannot be named.
        """
        arrays, events = self._filter.save()
        known = sorted(set(events) - {""})
        for description in known:
            if description.startswith(UNSAVED):
                raise ValueError(description.removeprefix(UNSAVED))
        index = {description: k for k, description in enumerate(known)}
        arrays["event_sensor"] = np.array([index.get(name, -1) for name in events], np.int64)
        models = f"[{','.join(known)}]".encode()
        arrays["event_models"] = np.frombuffer(models, np.uint8)
        arrays["status"] = np.array(int(self.status), np.int64)
        report = self._filter.report
        if report is not None:
            for name in _REPORT:
                arrays[f"report_{name}"] = report[name]
            arrays["report_nis"] = np.array(report["nis"], self._dtype)
            flags = [report["near_field"], report["decision"], report["iterations"]]
            arrays["report_flags"] = np.array(
                [int(flag) for flag in (*flags, report["recovered"])], np.int64
            )
        return pack(type(self).__name__, self._description(), arrays)

    def restore(self, state: bytes) -> None:
        """Take back what :meth:`save` gave; the filter goes on with the same bits.

        Raises
        ------
        ValueError, TypeError
            If the state is damaged or not that of a filter of this class, with these models,
            parameters and precision. The filter is then unchanged.
        """
        arrays = unpack(state, type(self).__name__, self._description())
        require(arrays, self._saved_dtypes(), optional="report_", single=("status", "report_nis"))
        if int(arrays["status"]) not in _STATUSES:
            raise ValueError("state is damaged: there is no such status")
        status = Status(int(arrays.pop("status")))
        self._require_interval(arrays["policy"])
        states = len(self._process.state)
        _require_correlations(arrays["P"], states)
        _require_correlations(arrays["base"][states : states + states * states], states)
        if self._components > 1:
            self._require_mixture(arrays["mixture"])
        events = self._remembered(arrays.pop("event_models"), arrays.pop("event_sensor"))
        report = _saved_report(arrays)
        twin = self._filter.copy()
        try:
            twin.restore(arrays, events)
        except _core.StatusError as error:
            raise ValueError(f"state is refused: {error}") from None
        twin.set_report(report, status)
        self._filter = twin

    def _saved_dtypes(self) -> dict[str, npt.DTypeLike]:
        """Give the arrays of a saved state."""
        numbers = ["x", "P", "input", "policy", "recovery", "base", "events"]
        numbers += ["mixture"] * (self._components > 1)
        report = (*(f"report_{name}" for name in _REPORT), "report_nis")
        whole = ("status", "event_sensor", "report_flags")
        return {
            **dict.fromkeys((*numbers, *report), self._dtype),
            **dict.fromkeys(whole, np.dtype(np.int64)),
            "event_models": np.dtype(np.uint8),
        }

    def _require_interval(self, saved: Floats) -> None:
        """Refuse an interval, and a memory of the interval law, that the policy cannot have."""
        if self._policy is None or len(saved) != 9:  # how many there are is the core's to say
            return
        number = self._dtype.type
        law: dict[str, tuple[float, float]] = {}
        if isinstance(self._policy, FixedInterval):
            law["interval"] = (self._policy.interval_s, self._policy.interval_s)
        else:
            law["interval"] = (self._policy.min_s, self._policy.max_s)
        if isinstance(self._policy, MahalanobisInterval):
            law["tau"] = (self._policy.tau_min, self._policy.tau_max)
            law["interval of the law"] = law["interval"]
            law["ratio"] = (0.0, self._policy.ratio_max)
            law["mahalanobis_squared"] = (0.0, np.inf)
        places = ("interval", "tau", "interval of the law", "ratio", "mahalanobis_squared")
        for name, value in zip(places, saved, strict=False):
            low, high = law.get(name, (-np.inf, np.inf))
            if not number(low) <= value <= number(high):
                raise ValueError(f"state is damaged: {name} is {value}, limits {low} and {high}")

    def _require_mixture(self, saved: Floats) -> None:
        """Refuse components with correlations beyond 1; the rest is the core's to say."""
        states = len(self._process.state)
        parts = saved[4:]
        if parts.size % (1 + states + states * states) == 0:
            for part in parts.reshape(-1, 1 + states + states * states):
                _require_correlations(part[1 + states :], states)

    def _remembered(
        self, models: npt.NDArray[np.uint8], sensor: npt.NDArray[np.int64]
    ) -> list[_Sensor[Any] | None]:
        """Give the core's sensor of each event; None where it is a prediction."""
        try:
            described = json.loads(models.tobytes())
            own = {handle.description: handle for handle in self._handles.values()}
            handles = [own.get(json.dumps(model)) or self._rebuilt(model) for model in described]
        except (ValueError, TypeError, RecursionError) as error:
            raise ValueError(f"state is damaged: its models cannot be made: {error}") from None
        if sensor.ndim != 1 or ((sensor < -1) | (sensor >= len(handles))).any():
            raise ValueError("state is damaged: an event names a sensor that is not there")
        return [None if k < 0 else handles[k] for k in sensor]

    def _rebuilt(self, description: dict[str, Any]) -> _Sensor[Any]:
        model: MeasurementModel = as_instance(
            "state", from_description(description), MeasurementModel
        )
        model.check_process(self._process)
        return model.core(len(self._process.state), self._dtype)

    def _description(self) -> dict[str, Any]:
        several = {"components": self._components, "headings": self._headings}
        return {
            "dtype": self._dtype.name,
            "process": describe(self._process),
            "sensors": {name: describe(model) for name, model in self._sensors.items()},
            "kernel": describe(self._kernel),
            "recovery": describe(self._recovery),
            "policy": describe(self._policy),
            **self._options,
            **self._parameters,
            **({} if self._components == 1 else several),
        }

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in vars(self).items() if k not in ("_filter", "_handles", "_only")}
        return {"members": kept, "state": self.save()}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        vars(self).update(pickled["members"])
        self._build()
        self.restore(pickled["state"])

    def __copy__(self) -> Self:
        twin = type(self).__new__(type(self))
        vars(twin).update(vars(self))
        twin._filter = self._filter.copy()
        return twin

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.__copy__()  # models are frozen: they may be shared

    def __repr__(self) -> str:
        x = np.array2string(self.x, precision=4, separator=", ")
        kernel = "" if self._kernel is None else f"kernel={self._kernel}, "
        return (
            f"{type(self).__name__}(process={type(self._process).__name__}, {kernel}"
            f"dtype={self._dtype.name}, x={x})"
        )

    # ---- Arguments ------------------------------------------------------------------------------

    def _handle(self, sensor: str | MeasurementModel | None) -> _Sensor[Any]:
        """Find the core's sensor of an argument ``sensor``."""
        if isinstance(sensor, str):
            if sensor not in self._handles:
                raise ValueError(f"sensor must be {_named(self._sensors)}, not {sensor!r}")
            return self._handles[sensor]
        if sensor is None:
            if self._only is not None:
                return self._only
            if not self._sensors:
                raise TypeError("sensor must be a model: this filter has none")
            several = ", ".join(map(repr, self._sensors))
            raise TypeError(f"sensor must be given: the filter has several ({several})")
        model: MeasurementModel = as_instance("sensor", sensor, MeasurementModel)
        model.check_process(self._process)
        self._require_jacobian(model)
        return model.core(len(self._process.state), self._dtype)

    def _require_jacobian(self, model: ProcessModel | MeasurementModel) -> None:
        if model.lacks and self._jacobians:
            raise ValueError(
                f"{type(model).__name__} has no {model.lacks}: an Ekf needs it; use Ukf or Ckf"
            )

    def _sensors_used(
        self, sensor: str | MeasurementModel | Sequence[str | MeasurementModel] | None
    ) -> tuple[list[Any], npt.NDArray[np.int32] | None]:
        """Give each name or model once and, where each row has one, which of them that is."""
        if sensor is None or isinstance(sensor, (str, MeasurementModel)):
            return [sensor], None
        given = sensor if isinstance(sensor, (list, tuple)) else np.asarray(sensor).tolist()
        if not (
            given
            and isinstance(given, (list, tuple))
            and all(isinstance(one, (str, MeasurementModel)) for one in given)
        ):
            raise TypeError("sensor must be a name, a model or a sequence of these, one per row")
        keys = [one if isinstance(one, str) else id(one) for one in given]
        used = dict(zip(keys, given, strict=True))
        index = {key: k for k, key in enumerate(used)}
        return list(used.values()), np.array([index[key] for key in keys], np.int32)

    def _as_measurements(
        self, z: npt.ArrayLike, handles: list[Any], which: npt.NDArray[np.int32] | None
    ) -> Floats:
        sizes = np.array([handle.size for handle in handles])
        if sizes.max() == 1 and np.ndim(z) == 1:
            z = np.asarray(z)[:, np.newaxis]
        return self._as_filled("z", z, sizes, which, "measures")

    def _as_filled(
        self,
        name: str,
        value: npt.ArrayLike,
        sizes: npt.NDArray[np.int_],
        which: npt.NDArray[np.int32] | None,
        what: str,
    ) -> Floats:
        """Take rows that are NaN throughout, or behind the numbers of a sensor that has fewer."""
        width = int(sizes.max())
        if which is None or (sizes == width).all():
            return as_array(name, value, (None, width), self._dtype, missing=True)
        raw = as_real(name, value, (None, width))
        if raw.ndim != 2 or raw.shape[1] != width:
            return as_array(name, value, (None, width), self._dtype)  # says what is wrong
        if len(raw) != len(which):
            _refuse_rows("sensor", len(which), len(raw), name)
        raw = raw.astype(np.float64)
        beyond = np.arange(width) >= sizes[which][:, np.newaxis]
        if not np.isnan(raw[beyond]).all():
            k, m = (int(i) for i in np.argwhere(beyond & ~np.isnan(raw))[0])
            raise ValueError(
                f"{name}[{k}, {m}] is {raw[k, m]}, but the sensor of row {k} {what} "
                f"{sizes[which[k]]} numbers; the rest must be NaN"
            )
        raw[beyond & ~np.isnan(raw[:, :1])] = 0.0
        rows = as_array(name, raw, (None, width), self._dtype, missing=True)
        rows[beyond] = np.nan
        return rows

    def _as_input(self, input: npt.ArrayLike | None, *rows: None) -> Floats | None:
        """Take the numbers of one prediction or, with a None, rows of them."""
        size = len(self._process.input)
        if size:
            return as_array("input", input, (*rows, size), self._dtype)
        if input is not None:
            raise TypeError(f"input must be None: {type(self._process).__name__} has no input")
        return None

    def _as_inputs(self, input: npt.ArrayLike | None, count: int) -> Floats | None:
        inputs = self._as_input(input, None)
        if inputs is not None:
            _require_rows("input", inputs, count)
        return inputs

    def _as_place(self, place: npt.ArrayLike, handle: _Sensor[Any]) -> Floats:
        if handle.place == 0:
            raise TypeError("place must be None: the place of this sensor is no part of its model")
        given = np.atleast_1d(place) if handle.place == 1 else place
        return as_array("place", given, (handle.place,), self._dtype)

    def _as_places(
        self,
        place: npt.ArrayLike | None,
        handles: list[Any],
        which: npt.NDArray[np.int32] | None,
        count: int,
    ) -> Floats | None:
        if place is None:
            return None
        sizes = np.array([handle.place for handle in handles])
        if sizes.max() == 0:
            raise TypeError("place must be None: the place of this sensor is no part of its model")
        if sizes.max() == 1 and np.ndim(place) == 1:
            place = np.asarray(place)[:, np.newaxis]
        given = self._as_filled("place", place, sizes, which, "stands at")
        _require_rows("place", given, count)
        places = np.full((count, _core.MAX_PLACE), np.nan, self._dtype)
        places[:, : given.shape[1]] = given
        return places

    def _require_standing(
        self,
        z: Floats,
        places: Floats | None,
        used: list[Any],
        which: npt.NDArray[np.int_ | np.int32] | None,
    ) -> None:
        """Refuse measurements of which neither the record nor the model says from where."""
        for k, one in enumerate(used):
            if not self._named_sensor(one)[1].stands:
                lost = ~np.isnan(z[:, 0])
                if which is not None:
                    lost &= which == k
                if places is not None:
                    lost &= np.isnan(places[:, 0])
                if lost.any():
                    self._require_place(f"place[{int(np.argmax(lost))}]", one)

    def _require_place(self, argument: str, sensor: str | MeasurementModel | None) -> None:
        """Refuse a measurement that comes without a place from a sensor that has none, either."""
        name, model = self._named_sensor(sensor)
        if not model.stands:
            kind = type(model).__name__
            which = kind if name == kind else f"{name} ({kind})"
            raise ValueError(f"{argument} must be given: {which} was made without {model.place}")

    def _as_ages(self, age_s: npt.ArrayLike | None, count: int) -> Floats | None:
        if age_s is None:
            return None
        ages = as_steps(age_s, count, self._dtype, "age_s")
        if self.late_s == 0 and ages.any():
            k = int(np.argmax(ages > 0))
            where = f"age_s[{k}]" if np.ndim(age_s) else "age_s"
            raise ValueError(f"{where} is {ages[k]}, but late_s of this filter is 0")
        return ages

    def _before_functions(self) -> _Filter[Any] | None:
        """Keep the filter as it is where a policy may ask a function of the process that fails."""
        asks = self._policy is not None and isinstance(self._process, FunctionProcess)
        return self._filter.copy() if asks else None

    def _require_functions_done(self, before: _Filter[Any] | None) -> None:
        if before is None:
            return
        try:
            require_none_raised()
        except BaseException:
            self._filter = before
            raise

    def _require_done(self, action: str, code: int, **given: Any) -> None:
        if code == 0:
            return
        require_none_raised()
        raise FilterError(action, Status(code), hint=self._why(Status(code), **given)) from None

    def _why(
        self,
        status: Status,
        *,
        dt: Any = None,
        z: Any = None,
        sensor: Any = None,
        place: Any = None,
    ) -> str:
        """Explain a status that says less than is known here; empty for the others."""
        if status == Status.step_too_long:
            step = "the interval of the policy" if dt is None else f"dt = {float(dt):.6g} s"
            return step_too_long(step, self.longest_step_s)
        if status == Status.impossible_range:
            name, model = self._named_sensor(sensor)
            return impossible_range(name, float(np.ravel(np.asarray(z))[0]), model)
        if status == Status.far_from_origin:
            if place is None:
                return far_from_origin("x", self.x[:2], self._dtype)
            return far_from_origin("place", np.asarray(place), self._dtype)
        return ""

    def _named_sensor(self, sensor: str | MeasurementModel | None) -> tuple[str, MeasurementModel]:
        if isinstance(sensor, MeasurementModel):
            return type(sensor).__name__, sensor
        name = next(iter(self._sensors)) if sensor is None else sensor
        return name, self._sensors[name]


def rows_of(record: Mapping[str, Any], first: int, end: int) -> dict[str, Any]:
    """Give these rows of a record."""
    return {name: None if rows is None else rows[first:end] for name, rows in record.items()}


def lookahead(
    record: Mapping[str, Any], late_s: float, lag_s: float | None
) -> Callable[[int], int]:
    """Say how far a record must be known to smooth its rows up to an end."""
    count = len(record["dt"])
    times = np.cumsum(record["dt"], dtype=np.float64)

    def reach(end: int) -> int:
        if end == count or (late_s == 0 and lag_s is None):
            return end
        # A measurement belongs to the prediction that ended nearest to it.
        late = 0.0 if late_s == 0 else 1.001 * late_s + float(record["dt"][end])
        ahead = late + (0.0 if lag_s is None else 1.001 * lag_s)
        since = times[end - 1] if end > 0 else 0.0
        return int(np.searchsorted(times, since + ahead, side="right"))

    return reach


def _require_correlations(saved: Floats, states: int) -> None:
    """Refuse a covariance with a correlation beyond 1, whose elimination may leave the range."""
    if saved.size != states * states:  # how many there are is the core's to say
        return
    covariance = saved.reshape(states, states).astype(np.float64)
    sigma = np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
    if (np.abs(covariance) > 1.001 * np.outer(sigma, sigma)).any():
        raise ValueError("state is damaged: its covariance has a correlation beyond 1")


def _saved_report(arrays: dict[str, npt.NDArray[Any]]) -> dict[str, Any] | None:
    """Take the report out of the arrays of a saved state."""
    if "report_nis" not in arrays:
        return None
    found: dict[str, Any] = {name: arrays.pop(f"report_{name}") for name in _REPORT}
    nis, flags = arrays.pop("report_nis"), arrays.pop("report_flags")
    size = found["innovation"].size
    right = nis.shape == () and flags.shape == (4,) and found["S"].shape == (size, size)
    right = right and all(found[name].shape == (size,) for name in _REPORT if name != "S")
    if not right or not 1 <= size <= _LARGEST_REPORT or ((flags < 0) | (flags > 255)).any():
        raise ValueError("state is damaged: its report is none")
    if int(flags[1]) not in _DECISIONS:
        raise ValueError("state is damaged: there is no such decision")
    report = {name: array.ravel() for name, array in found.items()}
    return {
        **report,
        "nis": float(nis),
        "near_field": bool(flags[0]),
        "decision": Decision(int(flags[1])),
        "iterations": int(flags[2]),
        "recovered": bool(flags[3]),
    }


def _as_sensors(sensors: Sensors, process: ProcessModel) -> dict[str, MeasurementModel]:
    """Take one model, several, or several by name."""
    if isinstance(sensors, MeasurementModel):
        sensors = (sensors,)
    if isinstance(sensors, Mapping):
        named = dict(sensors)
        for name in named:
            if not isinstance(name, str):
                raise TypeError(f"the names of sensors must be str, not {type_name(name)}")
    elif isinstance(sensors, Sequence) and not isinstance(sensors, str):
        named = {}
        for model in sensors:
            name = type(model).__name__
            if name in named:
                raise ValueError(
                    f"sensors has two {name}; name them: sensors={{'first': ..., 'second': ...}}"
                )
            named[name] = model
    else:
        raise TypeError(
            "sensors must be a measurement model, a sequence of them or a dict of them by name, "
            f"not {type_name(sensors)}"
        )
    for name, model in named.items():
        as_instance(f"sensors[{name!r}]", model, MeasurementModel)
        model.check_process(process)
    return named


def _makes_no_ring(model: MeasurementModel) -> bool:
    """Whether a model is known not to be a range in the plane (one of the user's own may be)."""
    known = isinstance(model, FunctionSensor) or type(model) in SENSORS.values()
    return known and not isinstance(model, LeaderRange)


def _named(sensors: Mapping[str, MeasurementModel]) -> str:
    return " or ".join(repr(name) for name in sensors)


def _require_rows(name: str, array: Floats, rows: int) -> None:
    if len(array) != rows:
        _refuse_rows(name, len(array), rows)


def _refuse_rows(name: str, have: int, rows: int, other: str = "z") -> NoReturn:
    raise ValueError(
        f"{name} has {counted(have, 'row')} and {other} has {rows}; they must have the same"
    )
