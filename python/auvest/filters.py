"""The filters: :class:`Ekf`, :class:`Ukf` and :class:`Aukf`, thin layers over ``auvest._core``.

All of the estimation is C++ (``cpp/include/auvest/filters``); this module checks arguments,
converts them to the filter's precision and explains what went wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

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
    as_number,
    as_points,
    as_step,
    as_steps,
    require_range,
)
from auvest._core import Status
from auvest.errors import FilterError
from auvest.intervals import (
    CovarianceBudget,
    FixedInterval,
    IntervalPolicy,
    MahalanobisInterval,
    core_interval,
)
from auvest.models import ConstantAcceleration, RangeBearing, core_process, core_sensor

if TYPE_CHECKING:
    from auvest._core import _Filter

_POINTS = _core.sigma_points_defaults()
_PROCESS = ConstantAcceleration()
_MEASUREMENT = RangeBearing()
_PAPERS_LAW = MahalanobisInterval()
_FIXED = FixedInterval()
_FORMAT = 1  # of save()


@dataclass(frozen=True)
class RunResult:
    """What :meth:`run` returns; row k of each array is the state of affairs after row k of z.

    Attributes
    ----------
    x : ndarray, shape (T, 6)
        Estimates.
    P : ndarray, shape (T, 6, 6)
        Covariances; (0, 6, 6) if they were not asked for.
    innovation : ndarray, shape (T, 2)
        Innovations; NaN where the measurement is missing. Range (m) and bearing (rad), or a
        position error (m) where ``near_field``.
    S : ndarray, shape (T, 2, 2)
        Covariances of the innovations; (0, 2, 2) if they were not asked for.
    nis : ndarray, shape (T,)
        Normalised innovation squared, chi-square with 2 degrees of freedom.
    near_field : ndarray of bool, shape (T,)
        True where the measurement was taken as a position (see :class:`auvest.RangeBearing`).
    interval_s : ndarray, shape (T,)
        Interval that the filter chose for the next sample, s; NaN for filters that choose none.
    """

    x: Floats
    P: Floats
    innovation: Floats
    S: Floats
    nis: Floats
    near_field: npt.NDArray[np.bool_]
    interval_s: Floats

    def __len__(self) -> int:
        return len(self.x)


class GaussianFilter:
    """What :class:`Ekf`, :class:`Ukf` and :class:`Aukf` have in common; not for direct use.

    One filter belongs to one thread at a time: a call while another thread is inside raises
    ``RuntimeError``. Use a copy (``copy.deepcopy``) per thread.
    """

    _core_name: ClassVar[str]

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ConstantAcceleration,
        measurement: RangeBearing,
        dtype: npt.DTypeLike,
        policy: IntervalPolicy,
        parameters: dict[str, float],
        reference: npt.ArrayLike | None = None,
    ) -> None:
        self._dtype = as_dtype(dtype)
        state = as_array("x0", x0, (6,), self._dtype)
        covariance = as_covariance("P0", P0, 6, self._dtype)
        start = (
            state[:2].copy()
            if reference is None
            else as_array("reference", reference, (2,), self._dtype)
        )
        self._process: ConstantAcceleration = as_instance("process", process, ConstantAcceleration)
        self._measurement: RangeBearing = as_instance("measurement", measurement, RangeBearing)
        self._policy = policy
        self._parameters = parameters
        self._prepare()
        try:
            self._filter.reset(state, covariance, start)
        except _core.StatusError as error:
            if error.status != Status.not_positive_definite:
                raise ValueError(f"x0 and P0 are refused: {error}") from None
            smallest = np.linalg.eigvalsh(covariance.astype(np.float64))[0]
            raise ValueError(
                f"P0 must be positive definite in {self._dtype.name}, "
                f"but its smallest eigenvalue is {smallest:.3g}"
            ) from None

    def _prepare(self) -> None:
        self._exclusive = Exclusive()
        self._sensor = core_sensor(self._measurement, self._dtype.name)
        self._filter = self._build(self._policy)
        self._status = Status.ok
        self._forget()

    def _build(self, policy: IntervalPolicy) -> _Filter[Any]:
        """Make a filter of the core with this one's models and parameters and the policy given."""
        name = f"{self._core_name}_{self._process.discretisation}_{self._dtype.name}"
        core = getattr(_core, name)
        process = core_process(self._process, self._dtype.name)
        core_policy = core_interval(policy, self._dtype.name)
        require_range(self._parameters, self._dtype.name)
        try:
            built: _Filter[Any] = core(process, core_policy, self._parameters)
        except _core.StatusError as error:
            given = ", ".join(f"{name}={value}" for name, value in self._parameters.items())
            raise ValueError(f"{given} do not suit {self._dtype.name}: {error}") from None
        return built

    def _forget(self) -> None:
        self._innovation: Floats = np.full(2, np.nan, self._dtype)
        self._S: Floats = np.full((2, 2), np.nan, self._dtype)
        self._nis = float("nan")
        self._near_field = False

    @property
    def x(self) -> Floats:
        """The estimate ``[x, y, vx, vy, ax, ay]`` (m, m/s, m/s^2), shape (6,), a copy."""
        with self._exclusive:
            x: Floats = self._filter.x
        return x

    @property
    def P(self) -> Floats:
        """The covariance of the estimate, shape (6, 6), a copy."""
        with self._exclusive:
            p: Floats = self._filter.P
        return p

    @property
    def innovation(self) -> Floats:
        """Innovation of the last update, shape (2,); NaN before one and if z was missing.

        Range (m) and bearing (rad), or a position error (m) if ``near_field``.
        """
        return self._innovation.copy()

    @property
    def S(self) -> Floats:
        """Covariance of the innovation, shape (2, 2); NaN as ``innovation``."""
        return self._S.copy()

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the last update; NaN as ``innovation``."""
        return self._nis

    @property
    def near_field(self) -> bool:
        """True if the last update took the measurement as a position (near the station)."""
        return self._near_field

    @property
    def status(self) -> Status:
        """What the core reported last: ``Status.ok`` unless a FilterError was raised."""
        return self._status

    @property
    def dtype(self) -> DType:
        """float32 or float64."""
        return self._dtype

    @property
    def process(self) -> ConstantAcceleration:
        """The process model."""
        return self._process

    @property
    def measurement(self) -> RangeBearing:
        """The measurement model that ``update`` and ``run`` use unless told otherwise."""
        return self._measurement

    def update(self, z: npt.ArrayLike | None, measurement: RangeBearing | None = None) -> None:
        """Correct the estimate by one measurement.

        Parameters
        ----------
        z : array_like, shape (2,), or None
            Range (m) and bearing (rad). None or NaN in both: missing, the estimate stays.
        measurement : RangeBearing, optional
            Which station measured; default: the filter's own.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        FilterError
            If the update cannot be done. In all cases the filter is unchanged.
        """
        sensor = self._sensor_of(measurement)
        row = None if z is None else as_array("z", z, (2,), self._dtype, missing=True)
        with self._exclusive:
            if row is None or np.isnan(row[0]):
                self._forget()
                self._status = Status.ok
                return
            try:
                correction = self._filter.update(row, sensor)
            except _core.StatusError as error:
                self._fail("update", error.status)
            self._innovation, self._S, self._nis, self._near_field = correction
            self._status = Status.ok

    def save(self) -> dict[str, Any]:
        """Give the state as a dict of numbers and arrays, for :meth:`restore`.

        Parameters of the models are not in it; pickle the filter to keep those too.
        """
        with self._exclusive:
            state = dict(self._filter.save())
        state["format"] = _FORMAT
        state["filter"] = type(self).__name__
        state["dtype"] = self._dtype.name
        state["innovation"] = self.innovation
        state["S"] = self.S
        state["nis"] = self._nis
        state["near_field"] = self._near_field
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Take back what :meth:`save` gave; the filter goes on with the same bits.

        Raises
        ------
        ValueError, TypeError
            If the state is not that of a filter of this class and precision. The filter is then
            unchanged.
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
        try:
            core = {
                "x": as_array("state['x']", state["x"], (6,), self._dtype),
                "P": as_array("state['P']", state["P"], (6, 6), self._dtype),
                "interval": as_number("state['interval']", state["interval"], "positive"),
                "law": _as_law(state["law"], self._dtype),
            }
            innovation = _as_last("innovation", state, (2,), self._dtype)
            s = _as_last("S", state, (2, 2), self._dtype)
            nis, near_field = float(state["nis"]), as_flag("near_field", state["near_field"])
        except KeyError as error:
            raise ValueError(f"state has no {error}: it is not from save()") from None
        with self._exclusive:
            try:
                self._filter.restore(core)
            except _core.StatusError as error:
                raise ValueError(f"state is refused: {error}") from None
            self._innovation, self._S = innovation, s
            self._nis, self._near_field = nis, near_field
            self._status = Status.ok

    def __getstate__(self) -> dict[str, Any]:
        return {
            "dtype": self._dtype.name,
            "process": self._process,
            "measurement": self._measurement,
            "policy": self._policy,
            "parameters": dict(self._parameters),
            "status": self._status,
            "state": self.save(),
        }

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        self._dtype = as_dtype(pickled["dtype"])
        self._process = pickled["process"]
        self._measurement = pickled["measurement"]
        self._policy = pickled["policy"]
        self._parameters = pickled["parameters"]
        self._prepare()
        self.restore(pickled["state"])
        self._status = pickled["status"]

    def __repr__(self) -> str:
        x = np.array2string(self.x, precision=4, separator=", ")
        return f"{type(self).__name__}(dtype={self._dtype.name}, x={x})"

    def _prototype(self, policy: IntervalPolicy) -> tuple[_Filter[Any], Floats, Floats, Any]:
        """Give a simulation the core filter, the x and P to start from and the sensor."""
        return self._build(policy), self.x, self.P, self._sensor

    def _sensor_of(self, measurement: RangeBearing | None) -> Any:
        if measurement is None:
            return self._sensor
        as_instance("measurement", measurement, RangeBearing)
        return core_sensor(measurement, self._dtype.name)

    def _fail(self, action: str, status: Status) -> NoReturn:
        self._status = status
        raise FilterError(action, status) from None

    def _predict(self, dt: float) -> None:
        try:
            self._filter.predict(dt)
        except _core.StatusError as error:
            self._fail(f"predict(dt={dt})", error.status)
        self._status = Status.ok

    def _run(
        self,
        z: npt.ArrayLike,
        dt: npt.ArrayLike | None,
        reference: npt.ArrayLike | None,
        measurement: RangeBearing | None,
        *,
        covariance: bool,
        adaptive: bool,
    ) -> RunResult:
        as_flag("covariance", covariance)
        sensor = self._sensor_of(measurement)
        rows = as_array("z", z, (None, 2), self._dtype, missing=True)
        steps = _as_steps(dt, len(rows), self._dtype)
        track = _as_track(reference, len(rows), self._dtype)
        with self._exclusive:
            out = self._filter.run(rows, steps, track, sensor, covariance)
            done = out["done"]
            interval = out["interval"] if adaptive else np.full_like(out["nis"], np.nan)
            result = RunResult(
                x=out["x"][:done],
                P=out["P"][:done],
                innovation=out["innovation"][:done],
                S=out["S"][:done],
                nis=out["nis"][:done],
                near_field=out["near_field"][:done],
                interval_s=interval[:done],
            )
            if done > 0:
                self._innovation = result.innovation[-1].copy()
                self._S = out["last_S"]
                self._nis = float(result.nis[-1])
                self._near_field = bool(result.near_field[-1])
            self._status = out["status"]
        if self._status != Status.ok:
            raise FilterError("run", self._status, step=done, partial=result)
        return result


class _TimedFilter(GaussianFilter):
    """A filter whose caller says when samples are taken."""

    def predict(self, dt: float) -> None:
        """Carry the estimate ``dt >= 0`` seconds forward.

        Raises
        ------
        ValueError, TypeError
            If ``dt`` is wrong.
        FilterError
            If the prediction cannot be done. In all cases the filter is unchanged.
        """
        step = as_step(dt, self._dtype)
        with self._exclusive:
            self._predict(step)

    def run(
        self,
        z: npt.ArrayLike,
        *,
        dt: npt.ArrayLike,
        measurement: RangeBearing | None = None,
        covariance: bool = True,
    ) -> RunResult:
        """Predict and update over a record, in C++ and without the GIL.

        Parameters
        ----------
        z : array_like, shape (T, 2)
            Range (m) and bearing (rad); a row of NaN is a missing measurement.
        dt : float or array_like, shape (T,)
            Time from the row before (or the filter's present) to each row, s, not negative.
        measurement : RangeBearing, optional
            Which station measured; default: the filter's own.
        covariance : bool
            Whether ``P`` and ``S`` are recorded: 320 of the 400 bytes of a row in float64.

        Returns
        -------
        RunResult

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; the filter is unchanged.
        FilterError
            If a row cannot be done. ``step`` names it, ``partial`` holds the results before it, and
            the filter stays at the row before.
        """
        if dt is None:
            raise TypeError("dt must be a number or an array of shape (T,), not None")
        return self._run(z, dt, None, measurement, covariance=covariance, adaptive=False)


class Ekf(_TimedFilter):
    """Extended Kalman filter, the baseline.

    Parameters
    ----------
    x0 : array_like, shape (6,)
        First estimate ``[x, y, vx, vy, ax, ay]``, m, m/s, m/s^2.
    P0 : array_like, shape (6, 6)
        Its covariance, symmetric positive definite.
    process : ConstantAcceleration
    measurement : RangeBearing
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _core_name = "Ekf"

    def __init__(
        self,
        x0: npt.ArrayLike,
        P0: npt.ArrayLike,
        *,
        process: ConstantAcceleration = _PROCESS,
        measurement: RangeBearing = _MEASUREMENT,
        dtype: npt.DTypeLike = "float64",
    ) -> None:
        super().__init__(
            x0,
            P0,
            process=process,
            measurement=measurement,
            dtype=dtype,
            policy=_FIXED,
            parameters={},
        )


class _UnscentedFilter(GaussianFilter):
    _core_name = "Ukf"

    @property
    def alpha(self) -> float:
        """Spread of the sigma points."""
        return self._parameters["alpha"]

    @property
    def beta(self) -> float:
        """Weight of prior knowledge."""
        return self._parameters["beta"]

    @property
    def kappa(self) -> float:
        """Secondary scaling."""
        return self._parameters["kappa"]


class Ukf(_UnscentedFilter, _TimedFilter):
    """Unscented Kalman filter in deviation form, sigma points redrawn after the prediction.

    Parameters
    ----------
    x0 : array_like, shape (6,)
        First estimate ``[x, y, vx, vy, ax, ay]``, m, m/s, m/s^2.
    P0 : array_like, shape (6, 6)
        Its covariance, symmetric positive definite.
    process : ConstantAcceleration
    measurement : RangeBearing
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.
    alpha : float
        Spread of the sigma points, in 1e-8..1. The paper's 1e-6 works in float32 too.
    beta : float
        At least ``alpha**2``; 2 suits a Gaussian.
    kappa : float
        Secondary scaling, above -6 (``n + kappa > 0`` with n = 6).

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
        process: ConstantAcceleration = _PROCESS,
        measurement: RangeBearing = _MEASUREMENT,
        dtype: npt.DTypeLike = "float64",
        alpha: float = _POINTS["alpha"],
        beta: float = _POINTS["beta"],
        kappa: float = _POINTS["kappa"],
    ) -> None:
        super().__init__(
            x0,
            P0,
            process=process,
            measurement=measurement,
            dtype=dtype,
            policy=_FIXED,
            parameters=as_points(alpha, beta, kappa),
        )


class Aukf(_UnscentedFilter):
    """Adaptive UKF (Deng, Yin, Duan 2019): a UKF that chooses its own sampling interval.

    A step is ``predict()``, ``update(z)``, ``feedback(reference)``; the sensor is read
    ``interval`` seconds after the step before.

    Parameters
    ----------
    x0, P0, process, measurement, dtype, alpha, beta, kappa
        As for :class:`Ukf`.
    policy : MahalanobisInterval, CovarianceBudget or FixedInterval
        The interval policy; default: the paper's law, Eqs. (7) to (12).
    reference : array_like, shape (2,), optional
        Desired position (m) at the start; default: that of ``x0``.

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
        process: ConstantAcceleration = _PROCESS,
        measurement: RangeBearing = _MEASUREMENT,
        dtype: npt.DTypeLike = "float64",
        alpha: float = _POINTS["alpha"],
        beta: float = _POINTS["beta"],
        kappa: float = _POINTS["kappa"],
        policy: IntervalPolicy = _PAPERS_LAW,
        reference: npt.ArrayLike | None = None,
    ) -> None:
        policies = (MahalanobisInterval, CovarianceBudget, FixedInterval)
        super().__init__(
            x0,
            P0,
            process=process,
            measurement=measurement,
            dtype=dtype,
            policy=as_instance("policy", policy, policies),
            parameters=as_points(alpha, beta, kappa),
            reference=reference,
        )

    @property
    def policy(self) -> IntervalPolicy:
        """The interval policy."""
        return self._policy

    @property
    def interval(self) -> float:
        """T(k): time to the next sample, s."""
        with self._exclusive:
            return float(self._filter.interval)

    @property
    def tau(self) -> float:
        """tau(k+1) of Eq. (12); only with :class:`MahalanobisInterval`."""
        return self._law("tau")

    @property
    def ratio(self) -> float:
        """M(k) of Eq. (7); only with :class:`MahalanobisInterval`."""
        return self._law("ratio")

    @property
    def mahalanobis_squared(self) -> float:
        """d(k)^2 of Eq. (11); only with :class:`MahalanobisInterval`."""
        return self._law("mahalanobis_squared")

    def _law(self, name: str) -> float:
        if not isinstance(self._policy, MahalanobisInterval):
            kind = type(self._policy).__name__
            raise AttributeError(f"{name} belongs to MahalanobisInterval; this filter has {kind}")
        with self._exclusive:
            return float(self._filter.law[name])

    def predict(self, dt: float | None = None) -> None:
        """Carry the estimate ``dt >= 0`` seconds forward; default: the filter's ``interval``.

        Raises
        ------
        ValueError, TypeError
            If ``dt`` is wrong.
        FilterError
            If the prediction cannot be done. In all cases the filter is unchanged.
        """
        step = None if dt is None else as_step(dt, self._dtype)
        with self._exclusive:
            self._predict(self._filter.interval if step is None else step)

    def feedback(self, reference: npt.ArrayLike | None = None) -> float:
        """Choose the interval to the next sample, after the update.

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
        given = None if reference is None else as_array("reference", reference, (2,), self._dtype)
        with self._exclusive:
            desired = np.ascontiguousarray(self._filter.x[:2]) if given is None else given
            try:
                self._filter.feedback(desired)
            except _core.StatusError as error:
                self._fail("feedback", error.status)
            self._status = Status.ok
            return float(self._filter.interval)

    def run(
        self,
        z: npt.ArrayLike,
        *,
        reference: npt.ArrayLike | None = None,
        dt: npt.ArrayLike | None = None,
        measurement: RangeBearing | None = None,
        covariance: bool = True,
    ) -> RunResult:
        """Predict, update and feed back over a record, in C++ and without the GIL.

        Parameters
        ----------
        z : array_like, shape (T, 2)
            Range (m) and bearing (rad); a row of NaN is a missing measurement.
        reference : array_like, shape (T, 2), optional
            Desired positions, m; default: the estimates themselves.
        dt : float or array_like, shape (T,), optional
            Time from the row before (or the filter's present) to each row, s, not negative.
            Default: the intervals that the filter chooses; the record must then have been sampled
            at them.
        measurement : RangeBearing, optional
            Which station measured; default: the filter's own.
        covariance : bool
            Whether ``P`` and ``S`` are recorded: 320 of the 400 bytes of a row in float64.

        Returns
        -------
        RunResult

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; the filter is unchanged.
        FilterError
            If a row cannot be done. ``step`` names it, ``partial`` holds the results before it, and
            the filter stays at the row before.
        """
        return self._run(z, dt, reference, measurement, covariance=covariance, adaptive=True)


def _as_steps(dt: npt.ArrayLike | None, rows: int, dtype: DType) -> Floats:
    """Take times between rows; None stands for the intervals that the filter chooses."""
    return np.full(rows, np.nan, dtype) if dt is None else as_steps(dt, rows, dtype)


def _as_track(reference: npt.ArrayLike | None, rows: int, dtype: DType) -> Floats:
    """Take desired positions; NaN stands for the estimate."""
    if reference is None:
        return np.full((rows, 2), np.nan, dtype)
    track = as_array("reference", reference, (None, 2), dtype)
    if len(track) != rows:
        raise ValueError(
            f"reference has {len(track)} rows and z has {rows}; they must have the same"
        )
    return track


def _as_law(law: Any, dtype: DType) -> tuple[Any, ...]:
    """Take the memory of the interval law: four numbers and two positions."""
    if not isinstance(law, (tuple, list)) or len(law) != 6:
        raise ValueError("state['law'] must hold four numbers and two positions")
    numbers = [as_number(f"state['law'][{i}]", value) for i, value in enumerate(law[:4])]
    positions = [as_array(f"state['law'][{4 + i}]", law[4 + i], (2,), dtype) for i in range(2)]
    return (*numbers, *positions)


def _as_last(name: str, state: dict[str, Any], shape: tuple[int, ...], dtype: DType) -> Floats:
    """Take the innovation or its covariance: all NaN if there was no update."""
    array: Floats = np.array(state[name], dtype=dtype)
    if array.shape != shape:
        raise ValueError(f"state[{name!r}] has shape {array.shape}, expected {shape}")
    return array
