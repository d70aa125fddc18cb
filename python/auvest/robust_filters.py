"""Robust filters: :class:`RobustEkf` and :class:`RobustUkf`, thin layers over ``auvest._core``.

The M-estimation EKF (Li, Du, Fan, Chen, Mao, Luo 2020) with any kernel, process and sensor, and the
recovery from lock-out that the paper lacks. All of the estimation is C++
(``cpp/include/auvest/robust``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NoReturn, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core
from auvest._arguments import (
    DType,
    Exclusive,
    Floats,
    as_array,
    as_covariance,
    as_dtype,
    as_flag,
    as_instance,
    as_integer,
    as_kind,
    as_number,
    as_points,
    as_step,
    as_steps,
    require_range,
)
from auvest._core import Decision, Status
from auvest.errors import FilterError
from auvest.kernels import Kernel, KernelName, RejectionStreak, as_kernel, core_kernel
from auvest.models import (
    ConstantAcceleration,
    LeaderRange,
    MeasurementModel,
    Odometry,
    ProcessModel,
    RangeBearing,
    SpeedHeading,
    core_process,
    core_sensor,
    input_count,
    process_name,
    state_count,
)

if TYPE_CHECKING:
    from auvest._core import _RobustFilter

Residual: TypeAlias = Literal["innovation", "post-fit"]

_POINTS = _core.sigma_points_defaults()
_UPDATE = _core.robust_update_defaults()
_LEADER = LeaderRange()
_STREAK = RejectionStreak()
_FORMAT = 2  # of save()


@dataclass(frozen=True)
class RobustRunResult:
    """What :meth:`run` returns; row k of each array is the state of affairs after row k of z.

    T rows, n states, m numbers in a measurement (1: range; 2: range and bearing). Where a
    measurement is missing, floats of the update are NaN and ``iterations`` is 0.

    Attributes
    ----------
    x : ndarray, shape (T, n)
        Estimates.
    P : ndarray, shape (T, n, n)
        Covariances; (0, n, n) if they were not asked for.
    innovation : ndarray, shape (T, m)
        Innovations.
    S : ndarray, shape (T, m, m)
        Covariances of the innovations before any weight; (0, m, m) if they were not asked for.
    nis : ndarray, shape (T,)
        Normalised innovation squared before any weight, chi-square with m degrees of freedom.
    near_field : ndarray of bool, shape (T,)
        True where the measurement was taken as a position (see :class:`auvest.RangeBearing`).
    standardised : ndarray, shape (T, m)
        The residuals that the kernel judged, in sigma.
    weight : ndarray, shape (T, m)
        The weights it gave, 0..1.
    decision : ndarray of uint8, shape (T,)
        What became of the measurement, an :class:`auvest.Decision`; 0 where it is missing.
    iterations : ndarray of uint8, shape (T,)
        Until the weights were final; innovations take 1.
    recovered : ndarray of bool, shape (T,)
        True where the recovery widened the covariance.
    """

    x: Floats
    P: Floats
    innovation: Floats
    S: Floats
    nis: Floats
    near_field: npt.NDArray[np.bool_]
    standardised: Floats
    weight: Floats
    decision: npt.NDArray[np.uint8]
    iterations: npt.NDArray[np.uint8]
    recovered: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.x)


@dataclass(frozen=True)
class RobustReport:
    """What a robust update reports; m numbers in a measurement.

    Attributes
    ----------
    innovation : ndarray, shape (m,)
    S : ndarray, shape (m, m)
        Covariance of the innovation before any weight.
    nis : float
        Normalised innovation squared before any weight.
    near_field : bool
        True if the measurement was taken as a position (see :class:`auvest.RangeBearing`).
    standardised, weight : ndarray, shape (m,)
        The residuals that the kernel judged, in sigma, and the weights it gave, 0..1.
    decision : Decision
        accepted, downweighted or rejected.
    iterations : int
        Until the weights were final; innovations take 1.
    recovered : bool
        True if the recovery widened the covariance after this update.
    """

    innovation: Floats
    S: Floats
    nis: float
    near_field: bool
    standardised: Floats
    weight: Floats
    decision: Decision
    iterations: int
    recovered: bool


class RobustFilter:
    """What :class:`RobustEkf` and :class:`RobustUkf` have in common; not for direct use.

    One filter belongs to one thread at a time: a call while another thread is inside raises
    ``RuntimeError``. Use a copy (``copy.deepcopy``) per thread.
    """

    _core_name: ClassVar[str]

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel,
        measurement: MeasurementModel,
        kernel: Kernel | KernelName,
        recovery: RejectionStreak | None,
        residual: Residual,
        max_iterations: int,
        tolerance: float,
        dtype: npt.DTypeLike,
        parameters: dict[str, float],
    ) -> None:
        self._dtype = as_dtype(dtype)
        self._process = _as_process(process)
        self._measurement = _as_sensor(measurement)
        self._kernel = as_kernel(kernel)
        if recovery is not None:
            as_instance("recovery", recovery, RejectionStreak)
        self._recovery = recovery
        self._rule = {
            "post_fit": as_kind("residual", residual, ("innovation", "post-fit")) == "post-fit",
            "max_iterations": as_integer("max_iterations", max_iterations, 2, 255),
            "tolerance": as_number("tolerance", tolerance, "not negative"),
            "rejections": 0 if recovery is None else recovery.rejections,
        }
        self._parameters = parameters
        states = state_count(self._process)
        state = as_array("x0", x0, (states,), self._dtype)
        covariance = as_covariance("P0", P0, states, self._dtype)
        self._build()
        try:
            self._filter.reset(state, covariance)
        except _core.StatusError as error:
            if error.status != Status.not_positive_definite:
                raise ValueError(f"x0 and P0 are refused: {error}") from None
            smallest = np.linalg.eigvalsh(covariance.astype(np.float64))[0]
            raise ValueError(
                f"P0 must be positive definite in {self._dtype.name}, "
                f"but its smallest eigenvalue is {smallest:.3g}"
            ) from None

    def _build(self) -> None:
        self._exclusive = Exclusive()
        self._status = Status.ok
        self._report: RobustReport | None = None
        name = self._dtype.name
        require_range(self._parameters, name)
        core = getattr(_core, f"{self._core_name}_{process_name(self._process)}_{name}")
        try:
            self._filter: _RobustFilter[Any] = core(
                core_process(self._process, name),
                core_kernel(self._kernel, name),
                self._rule,
                self._parameters,
            )
        except _core.StatusError as error:
            given = {**self._parameters, "tolerance": self._rule["tolerance"]}
            text = ", ".join(f"{key}={value}" for key, value in given.items())
            raise ValueError(f"{text} do not suit {name}: {error}") from None

    @property
    def x(self) -> Floats:
        """The estimate, shape (n,), a copy; its components are those of ``process``."""
        with self._exclusive:
            x: Floats = self._filter.x
        return x

    @property
    def P(self) -> Floats:
        """The covariance of the estimate, shape (n, n), a copy."""
        with self._exclusive:
            p: Floats = self._filter.P
        return p

    @property
    def report(self) -> RobustReport | None:
        """What the last update reported; None before one and if z was missing."""
        return self._report

    @property
    def status(self) -> Status:
        """What the core reported last: ``Status.ok`` unless a FilterError was raised."""
        return self._status

    @property
    def dtype(self) -> DType:
        """float32 or float64."""
        return self._dtype

    @property
    def process(self) -> ProcessModel:
        """The process model."""
        return self._process

    @property
    def measurement(self) -> MeasurementModel:
        """The measurement model that ``update`` and ``run`` use unless told otherwise."""
        return self._measurement

    @property
    def kernel(self) -> Kernel:
        """The robust kernel."""
        return self._kernel

    @property
    def recovery(self) -> RejectionStreak | None:
        """The recovery policy."""
        return self._recovery

    @property
    def residual(self) -> Residual:
        """Which residual the kernel judges."""
        return "post-fit" if self._rule["post_fit"] else "innovation"

    def predict(self, dt: float, motion: npt.ArrayLike | None = None) -> None:
        """Carry the estimate ``dt >= 0`` seconds forward.

        Parameters
        ----------
        dt : float
            Seconds.
        motion : array_like, shape (3,)
            What drove the process in that time: for :class:`auvest.SpeedHeading`
            ``[forward speed, starboard speed, heading]``, for :class:`auvest.Odometry`
            ``[forward, sideways, turn]``; not given for a process without input.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the prediction cannot be done. In all cases the filter is unchanged.
        """
        step = as_step(dt, self._dtype)
        size = input_count(self._process)
        if size == 0 and motion is not None:
            raise TypeError(f"motion must be None: {type(self._process).__name__} has no input")
        values: Floats = np.zeros(0, self._dtype)
        if size > 0:
            values = as_array("motion", motion, (size,), self._dtype)
        with self._exclusive:
            try:
                self._filter.predict(step, values)
            except _core.StatusError as error:
                self._fail(f"predict(dt={dt})", error.status)
            self._status = Status.ok

    def update(
        self, z: npt.ArrayLike | None, measurement: MeasurementModel | None = None
    ) -> RobustReport | None:
        """Correct the estimate by one measurement, as far as the kernel believes it.

        Parameters
        ----------
        z : float or array_like, shape (m,), or None
            For :class:`auvest.LeaderRange` a range (m), for :class:`auvest.RangeBearing` a range
            (m) and a bearing (rad). None or NaN throughout: missing, the estimate stays.
        measurement : MeasurementModel, optional
            What was measured; default: the filter's own.

        Returns
        -------
        RobustReport or None
            ``report``; None if z was missing.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the update cannot be done. In all cases the filter is unchanged.
        """
        model = self._measurement if measurement is None else _as_sensor(measurement)
        sensor = core_sensor(model, self._dtype.name)
        row = None
        if z is not None:
            given = np.atleast_1d(z) if _size(model) == 1 and np.ndim(z) == 0 else z
            row = as_array("z", given, (_size(model),), self._dtype, missing=True)
        with self._exclusive:
            self._status = Status.ok
            if row is None or np.isnan(row[0]):
                self._report = None
                return None
            try:
                self._report = RobustReport(*self._filter.update(row, sensor))
            except _core.StatusError as error:
                self._fail("update", error.status)
        return self._report

    def run(
        self,
        z: npt.ArrayLike,
        *,
        dt: npt.ArrayLike,
        motion: npt.ArrayLike | None = None,
        position: npt.ArrayLike | None = None,
        measurement: MeasurementModel | None = None,
        covariance: bool = True,
    ) -> RobustRunResult:
        """Predict and update over a record, in C++ and without the GIL.

        Parameters
        ----------
        z : array_like, shape (T,) for ranges, (T, 2) for range and bearing
            NaN (throughout a row) is a missing measurement: that row only predicts.
        dt : float or array_like, shape (T,)
            Time from the row before (or the filter's present) to each row, s, not negative.
        motion : array_like, shape (T, 3)
            What drove the process in each of these times, as for :meth:`predict`.
        position : array_like, shape (T, 2), optional
            Where the leader (or the station) was at each row, m; a NaN row, and default: where
            ``measurement`` has it.
        measurement : MeasurementModel, optional
            What was measured; default: the filter's own.
        covariance : bool
            Whether ``P`` and ``S`` are recorded.

        Returns
        -------
        RobustRunResult

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; the filter is unchanged.
        FilterError
            If a row cannot be done. ``step`` names it, ``partial`` holds the results before it, and
            the filter stays at the row before.
        """
        as_flag("covariance", covariance)
        model = self._measurement if measurement is None else _as_sensor(measurement)
        sensor = core_sensor(model, self._dtype.name)
        size = _size(model)
        rows = as_array("z", _as_rows(z, size), (None, size), self._dtype, missing=True)
        steps = as_steps(dt, len(rows), self._dtype)
        motions = self._as_motions(motion, len(rows))
        places: Floats = np.full((len(rows), 2), np.nan, self._dtype)
        if position is not None:
            places = as_array("position", position, (None, 2), self._dtype, missing=True)
            _require_rows("position", places, len(rows))
        with self._exclusive:
            out = self._filter.run(rows, steps, motions, places, sensor, covariance)
            done = out["done"]
            result = RobustRunResult(
                **{name: out[name][:done] for name in RobustRunResult.__dataclass_fields__}
            )
            if done > 0:
                self._report = _last_report(result, out["last_S"])
            self._status = out["status"]
        if self._status != Status.ok:
            raise FilterError("run", self._status, step=done, partial=result)
        return result

    def _as_motions(self, motion: npt.ArrayLike | None, rows: int) -> Floats:
        size = input_count(self._process)
        if size == 0:
            if motion is not None:
                raise TypeError(f"motion must be None: {type(self._process).__name__} has no input")
            return np.zeros((rows, 0), self._dtype)
        motions = as_array("motion", motion, (None, size), self._dtype)
        _require_rows("motion", motions, rows)
        return motions

    def save(self) -> dict[str, Any]:
        """Give the state as a dict of numbers and arrays, for :meth:`restore`.

        Parameters of the models are not in it; pickle the filter to keep those too.
        """
        with self._exclusive:
            state = dict(self._filter.save())
        state["format"] = _FORMAT
        state["filter"] = type(self).__name__
        state["dtype"] = self._dtype.name
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Take back what :meth:`save` gave; the filter goes on with the same bits.

        Raises
        ------
        ValueError, TypeError
            If the state is not that of a filter of this class, process and precision. The filter is
            then unchanged.
        """
        if not isinstance(state, dict):
            raise TypeError(f"state must be a dict from save(), not {type(state).__name__}")
        name = type(self).__name__
        expected = {"format": _FORMAT, "filter": name, "dtype": self._dtype.name}
        for key, value in expected.items():
            if state.get(key) != value:
                raise ValueError(
                    f"state[{key!r}] is {state.get(key)!r}, expected {value!r}: the state must be "
                    f"that of a {name} in {self._dtype.name}"
                )
        states = state_count(self._process)
        try:
            if len(state["recovery"]) != 3:
                raise ValueError("state['recovery'] must be the three that save() gave")
            count, variance, recent = state["recovery"]
            core = {
                "x": as_array("state['x']", state["x"], (states,), self._dtype),
                "P": as_array("state['P']", state["P"], (states, states), self._dtype),
                "recovery": (
                    as_integer("state['recovery'][0]", count, 0, 240),
                    as_number("state['recovery'][1]", variance, "not negative"),
                    as_array("state['recovery'][2]", recent, (2, 3), self._dtype),
                ),
            }
        except KeyError as error:
            raise ValueError(f"state has no {error}: it is not from save()") from None
        with self._exclusive:
            try:
                self._filter.restore(core)
            except _core.StatusError as error:
                raise ValueError(f"state is refused: {error}") from None
            self._report = None
            self._status = Status.ok

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in vars(self).items() if k not in ("_filter", "_exclusive")}
        return {"members": kept, "state": self.save()}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        vars(self).update(pickled["members"])
        report, status = self._report, self._status
        self._build()
        self.restore(pickled["state"])
        self._report, self._status = report, status

    def __repr__(self) -> str:
        x = np.array2string(self.x, precision=4, separator=", ")
        process = type(self._process).__name__
        return (
            f"{type(self).__name__}(process={process}, kernel={self._kernel}, "
            f"dtype={self._dtype.name}, x={x})"
        )

    def _prototype(self) -> _RobustFilter[Any]:
        """Give a simulation the core filter, which it does not change."""
        return self._filter

    def _fail(self, action: str, status: Status) -> NoReturn:
        self._status = status
        raise FilterError(action, status) from None


class RobustEkf(RobustFilter):
    """M-estimation EKF: an EKF that believes a measurement as far as its kernel does.

    With ``kernel="unit"`` it is the EKF, bit for bit.

    Parameters
    ----------
    x0 : array_like, shape (n,)
        First estimate; n and the meaning of its components are those of ``process``.
    P0 : array_like, shape (n, n)
        Its covariance, symmetric positive definite.
    process : SpeedHeading, Odometry or ConstantAcceleration
    measurement : LeaderRange or RangeBearing
        What ``update`` and ``run`` take unless told otherwise.
    kernel : Igg, Huber, Hampel or Unit, or {"igg", "huber", "hampel", "unit"}
        A name stands for the kernel's default thresholds.
    recovery : RejectionStreak or None
        Recovery from lock-out; None: there is none.
    residual : {"innovation", "post-fit"}
        What the kernel judges: the innovation by its own standard deviation, or what is left of it
        after the update by that of the sensor.
    max_iterations : int
        Solutions of one update for "post-fit", 2..255; "innovation" takes one.
    tolerance : float
        For "post-fit": the end is where no weight changes by more than this, not negative.
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _core_name = "RobustEkf"

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel,
        measurement: MeasurementModel = _LEADER,
        kernel: Kernel | KernelName = "igg",
        recovery: RejectionStreak | None = _STREAK,
        residual: Residual = "innovation",
        max_iterations: int = _UPDATE["max_iterations"],
        tolerance: float = _UPDATE["tolerance"],
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        super().__init__(
            x0,
            P0,
            process=process,
            measurement=measurement,
            kernel=kernel,
            recovery=recovery,
            residual=residual,
            max_iterations=max_iterations,
            tolerance=tolerance,
            dtype=dtype,
            parameters={},
        )


class RobustUkf(RobustFilter):
    """The same update in a UKF; see :class:`RobustEkf`.

    Parameters
    ----------
    x0, P0, process, measurement, kernel, recovery, residual, max_iterations, tolerance, dtype
        As for :class:`RobustEkf`.
    alpha : float
        Spread of the sigma points, in 1e-8..1. Where the process is not linear it must not be
        small.
    beta : float
        At least ``alpha**2``; 2 suits a Gaussian.
    kappa : float, optional
        Secondary scaling, above -n; default: 3 - n, which matches the fourth moments of a Gaussian.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _core_name = "RobustUkf"

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ProcessModel,
        measurement: MeasurementModel = _LEADER,
        kernel: Kernel | KernelName = "igg",
        recovery: RejectionStreak | None = _STREAK,
        residual: Residual = "innovation",
        max_iterations: int = _UPDATE["max_iterations"],
        tolerance: float = _UPDATE["tolerance"],
        dtype: npt.DTypeLike = "float64",
        alpha: float = _POINTS["alpha"],
        beta: float = _POINTS["beta"],
        kappa: float | None = None,
    ) -> None:
        states = state_count(_as_process(process))
        super().__init__(
            x0,
            P0,
            process=process,
            measurement=measurement,
            kernel=kernel,
            recovery=recovery,
            residual=residual,
            max_iterations=max_iterations,
            tolerance=tolerance,
            dtype=dtype,
            parameters=as_points(alpha, beta, 3 - states if kappa is None else kappa, states),
        )


def _as_process(process: object) -> ProcessModel:
    kinds = (SpeedHeading, Odometry, ConstantAcceleration)
    model: ProcessModel = as_instance("process", process, kinds)
    return model


def _as_sensor(measurement: object) -> MeasurementModel:
    model: MeasurementModel = as_instance("measurement", measurement, (LeaderRange, RangeBearing))
    return model


def _size(model: MeasurementModel) -> int:
    """Count the numbers of a measurement."""
    return 2 if isinstance(model, RangeBearing) else 1


def _as_rows(z: npt.ArrayLike, size: int) -> npt.ArrayLike:
    """Take ranges (T,) as rows of one number."""
    return np.asarray(z)[:, np.newaxis] if size == 1 and np.ndim(z) == 1 else z


def _require_rows(name: str, array: Floats, rows: int) -> None:
    if len(array) != rows:
        raise ValueError(f"{name} has {len(array)} rows and z has {rows}; they must have the same")


def _last_report(result: RobustRunResult, s: Floats) -> RobustReport | None:
    """Make the report of the last row."""
    if np.isnan(result.nis[-1]):
        return None
    return RobustReport(
        innovation=result.innovation[-1].copy(),
        S=s,
        nis=float(result.nis[-1]),
        near_field=bool(result.near_field[-1]),
        standardised=result.standardised[-1].copy(),
        weight=result.weight[-1].copy(),
        decision=Decision(int(result.decision[-1])),
        iterations=int(result.iterations[-1]),
        recovered=bool(result.recovered[-1]),
    )
