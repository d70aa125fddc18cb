"""A base station tracks an AUV by range and bearing: the simulation of the AUKF paper, section 3.

The loop is C++ (``cpp/simulation/tracking.hpp``): the filter's own interval decides
when the next sample is taken, and the desired track is the true one, as in the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from auvest import _core, metrics, montecarlo
from auvest._arguments import (
    as_flag,
    as_instance,
    as_integer,
    as_kind,
    as_number,
    as_pair,
)
from auvest._core import Status
from auvest.filters import Ekf, Ukf
from auvest.intervals import FixedInterval
from auvest.models import ConstantAcceleration, RangeBearing

if TYPE_CHECKING:
    from auvest._core import _ScenarioDict

_TRACK = _core.track_defaults()
_NOISE = _core.noise_defaults()
_INTERVAL = _core.fixed_interval_defaults()

#: Rows (runs times steps) of one simulation at most: 150 bytes each.
MAX_SAMPLES = 10_000_000


@dataclass(frozen=True, kw_only=True)
class Track:
    """The true track, and the desired one.

    Parameters
    ----------
    kind : {"euler", "straight", "turn"}
        "euler": Eq. (4) with each sampling interval as its step, the paper's own simulation (the
        truth then depends a little on the interval). "straight": constant acceleration along x and
        y, exact. "turn": constant speed and turn rate; ``acceleration`` is not used.
    position, velocity, acceleration : (float, float)
        At time 0, in m, m/s and m/s^2. The paper gives the sizes 0.224 m/s and 0.0224 m/s^2 only.
    turn_rate : float
        rad/s, positive from +x towards +y; only for "turn".
    wander_m, wander_period_s : float
        The vehicle circles around its desired track with this radius and period, as a real one that
        is steered onto it. 0 m: the desired track is the true one, as in the paper.
    """

    kind: Literal["euler", "straight", "turn"] = "euler"
    position: tuple[float, float] = as_pair("position", _TRACK["position"])
    velocity: tuple[float, float] = as_pair("velocity", _TRACK["velocity"])
    acceleration: tuple[float, float] = as_pair("acceleration", _TRACK["acceleration"])
    turn_rate: float = _TRACK["turn_rate"]
    wander_m: float = _TRACK["wander_m"]
    wander_period_s: float = _TRACK["wander_period_s"]

    def __post_init__(self) -> None:
        as_kind("kind", self.kind, ("euler", "straight", "turn"))
        for name in ("position", "velocity", "acceleration"):
            object.__setattr__(self, name, as_pair(name, getattr(self, name)))
        object.__setattr__(self, "turn_rate", as_number("turn_rate", self.turn_rate))
        object.__setattr__(self, "wander_m", as_number("wander_m", self.wander_m, "not negative"))
        period = as_number("wander_period_s", self.wander_period_s, "positive")
        object.__setattr__(self, "wander_period_s", period)

    @property
    def start(self) -> tuple[float, ...]:
        """The true state at time 0: position (m), velocity (m/s), acceleration (m/s^2)."""
        acceleration = self.acceleration
        if self.kind == "turn":  # towards the centre of the turn, speed times turn rate
            vx, vy = self.velocity
            acceleration = (-self.turn_rate * vy, self.turn_rate * vx)
        return (*self.position, *self.velocity, *acceleration)

    def position_at(self, time_s: float) -> tuple[float, float]:
        """Give the true position (m) after one step of this many seconds."""
        core = self._as_core()
        core.advance(as_number("time_s", time_s, "not negative"))
        x, y = core.position
        return x, y

    def _as_core(self) -> _core.Track:
        return _core.Track(
            self.kind,
            self.position,
            self.velocity,
            self.acceleration,
            self.turn_rate,
            self.wander_m,
            self.wander_period_s,
        )


@dataclass(frozen=True, kw_only=True)
class Noise:
    """The paper's three sensor noises, (0, 1) each, times a scale per sensor.

    Uniform noise lies in 0..1 and lognormal noise is ``exp(normal)``: their means are 0.5 and 1.65,
    so both are biased. The bias stays in, as in the paper, unless ``centred``. A filter knows only
    zero-mean noise: give its :class:`auvest.RangeBearing` the ``standard_deviation`` of the noise;
    a bias that stays in then shows up as an error of the estimate.

    Parameters
    ----------
    kind : {"normal", "uniform", "lognormal"}
    range_m, bearing_rad : float
        Scales of the two noises, not negative.
    centred : bool
        Subtract the mean.
    dropout : float
        Probability, in 0..1, that a measurement is missing.
    """

    kind: Literal["normal", "uniform", "lognormal"] = "normal"
    range_m: float = _NOISE["range_m"]
    bearing_rad: float = _NOISE["bearing_rad"]
    centred: bool = _NOISE["centred"]
    dropout: float = _NOISE["dropout"]

    def __post_init__(self) -> None:
        as_kind("kind", self.kind, ("normal", "uniform", "lognormal"))
        as_flag("centred", self.centred)
        for name in ("range_m", "bearing_rad", "dropout"):
            object.__setattr__(self, name, as_number(name, getattr(self, name), "not negative"))
        if self.dropout > 1:
            raise ValueError(f"dropout must lie in 0..1, not {self.dropout}")

    @property
    def mean(self) -> tuple[float, float]:
        """Bias of range (m) and bearing (rad)."""
        unit = 0.0 if self.centred else _core.noise_mean(self.kind)
        return self.range_m * unit, self.bearing_rad * unit

    @property
    def standard_deviation(self) -> tuple[float, float]:
        """Standard deviation of range (m) and bearing (rad), about the mean."""
        unit = _core.noise_standard_deviation(self.kind)
        return self.range_m * unit, self.bearing_rad * unit


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """What is simulated.

    Parameters
    ----------
    track : Track
    noise : Noise
    steps : int
        Samples per run at most; 60 in Table 1.
    duration_s : float
        A run ends before the first sample after this time, s; positive, may be infinite.
    runs : int
        Number of runs; ``runs * steps`` at most 10 million.
    seed : int
        0 to 2^64 - 1. Run r draws from stream r of it, whatever the number of workers.
    random_start : bool
        Start each run of the filter at a draw from N(x, P) of its belief instead of at x, so that
        its P is right at the start.
    interval_s : float
        Sampling interval of filters that choose none (:class:`Ekf`, :class:`Ukf`), s.
    probe_period_s : float
        The error is also taken at multiples of this time, between samples, s; 0: not.
    budget_m : float
        Position error that probes are compared with, m.
    """

    track: Track = field(default_factory=Track)
    noise: Noise = field(default_factory=Noise)
    steps: int = 60
    duration_s: float = inf
    runs: int = 200
    seed: int = 1
    random_start: bool = False
    interval_s: float = _INTERVAL["interval_s"]
    probe_period_s: float = 0.0
    budget_m: float = 0.1

    def __post_init__(self) -> None:
        as_instance("track", self.track, Track)
        as_instance("noise", self.noise, Noise)
        as_flag("random_start", self.random_start)
        set_field = object.__setattr__
        set_field(self, "steps", as_integer("steps", self.steps, 1, MAX_SAMPLES))
        set_field(self, "runs", as_integer("runs", self.runs, 1, MAX_SAMPLES))
        set_field(self, "seed", as_integer("seed", self.seed, 0, 2**64 - 1))
        if self.runs * self.steps > MAX_SAMPLES:
            raise ValueError(
                f"runs * steps must be at most {MAX_SAMPLES}, not {self.runs} * {self.steps}"
            )
        duration = as_number("duration_s", self.duration_s, "positive", infinite=True)
        set_field(self, "duration_s", duration)
        set_field(self, "interval_s", as_number("interval_s", self.interval_s, "positive"))
        period = as_number("probe_period_s", self.probe_period_s, "not negative")
        if 0 < period < 1e-4:
            raise ValueError(f"probe_period_s must be 0 or at least 1e-4, not {period}")
        set_field(self, "probe_period_s", period)
        set_field(self, "budget_m", as_number("budget_m", self.budget_m, "positive"))


_SCENARIO = Scenario()


@dataclass(frozen=True)
class TrackingResult:
    """What :func:`simulate` returns. Rows after the end of a run are NaN.

    Attributes
    ----------
    time_s : ndarray, shape (runs, steps)
        Time of each sample, s.
    interval_s : ndarray, shape (runs, steps)
        Interval to the next sample, chosen after each, s.
    truth : ndarray, shape (runs, steps, 2)
        True (and desired) positions, m.
    z : ndarray, shape (runs, steps, 2)
        Measured range (m) and bearing (rad); NaN if missing.
    x : ndarray, shape (runs, steps, 6)
        Estimates.
    position_covariance : ndarray, shape (runs, steps, 2, 2)
        Their covariances, position part, m^2.
    nis : ndarray, shape (runs, steps)
        Normalised innovation squared; NaN if the measurement is missing.
    tau, mahalanobis_squared : ndarray, shape (runs, steps)
        Of the paper's law, after each step; without meaning for other policies.
    samples : ndarray of int, shape (runs,)
        Samples taken.
    status : ndarray of uint8, shape (runs,)
        How each run ended: values of :class:`auvest.Status`, 0 is ok. A run that failed keeps the
        rows it has.
    probe_square_sum, probe_above, probe_count : ndarray, shape (runs,)
        Sum of squared position errors (m^2), number of errors above the budget and number of
        errors, at the probes.
    scenario : Scenario
        What was simulated.
    """

    time_s: npt.NDArray[np.float64]
    interval_s: npt.NDArray[np.float64]
    truth: npt.NDArray[np.float64]
    z: npt.NDArray[np.float64]
    x: npt.NDArray[np.float64]
    position_covariance: npt.NDArray[np.float64]
    nis: npt.NDArray[np.float64]
    tau: npt.NDArray[np.float64]
    mahalanobis_squared: npt.NDArray[np.float64]
    samples: npt.NDArray[np.int64]
    status: npt.NDArray[np.uint8]
    probe_square_sum: npt.NDArray[np.float64]
    probe_above: npt.NDArray[np.float64]
    probe_count: npt.NDArray[np.float64]
    scenario: Scenario

    @property
    def failed(self) -> npt.NDArray[np.bool_]:
        """Runs whose status is not ok, shape (runs,)."""
        failed: npt.NDArray[np.bool_] = self.status != int(Status.ok)
        return failed

    @property
    def error(self) -> npt.NDArray[np.float64]:
        """Position errors at the samples, m, shape (runs, steps, 2)."""
        return self.x[..., :2] - self.truth

    @property
    def rmse_m(self) -> float:
        """Root mean square position error over all samples of all runs, m."""
        return metrics.rmse(self.error)

    @property
    def nees(self) -> npt.NDArray[np.float64]:
        """Normalised position error squared, shape (runs, steps); 2 degrees of freedom."""
        return metrics.nees(self.error, self.position_covariance)

    @property
    def mean_interval_s(self) -> float:
        """Time simulated per sample taken, s."""
        count = int(self.samples.sum())
        ends = np.where(np.isnan(self.time_s), 0.0, self.time_s).max(axis=1)
        return float(ends.sum() / count) if count else float("nan")

    @property
    def rmse_over_time_m(self) -> float:
        """Root mean square position error over the probes, m; NaN without probes."""
        return float(np.sqrt(self._per_probe(self.probe_square_sum)))

    @property
    def time_above_budget(self) -> float:
        """Share of the time with an error above the budget; NaN without probes."""
        return self._per_probe(self.probe_above)

    def _per_probe(self, total: npt.NDArray[np.float64]) -> float:
        count = float(self.probe_count.sum())
        return float(total.sum()) / count if count else float("nan")


def simulate(
    filter: Ekf | Ukf,  # noqa: A002 (its name in this package)
    scenario: Scenario = _SCENARIO,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TrackingResult:
    """Run a filter through a scenario, many times.

    Parameters
    ----------
    filter : Ekf or Ukf
        The prototype, with any kernel and interval policy: its models, parameters and belief
        (``x``, ``P``) are the start of every run. It is not changed. Its station is the true
        station; its noise need not be the true noise.
    scenario : Scenario
        Track, noise, number of runs and so on.
    workers : int, optional
        Threads, 1 to 256; default: one per processor. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(runs_done, runs)`` in the calling thread. What it raises ends the
        simulation; a ``KeyboardInterrupt`` carries the runs done so far as ``partial``.

    Returns
    -------
    TrackingResult
        A run that fails keeps the rows it has; see ``status`` and ``failed``.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    """
    as_instance("filter", filter, (Ekf, Ukf))
    as_instance("scenario", scenario, Scenario)
    policy = filter.policy or FixedInterval(interval_s=scenario.interval_s)
    core, x0, p0 = filter._core_filter(policy), filter.x, filter.P
    sensor = sensor_of(filter).core(6, filter.dtype)

    def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
        return _core.simulate_tracking(core, x0, p0, sensor, _as_core(scenario, first, count))

    try:
        columns = montecarlo.run(
            part,
            runs=scenario.runs,
            chunk=montecarlo.chunk_for(scenario.runs, scenario.steps, workers),
            workers=workers,
            progress=progress,
        )
    except montecarlo.Interrupted as stop:
        if stop.partial is not None:
            stop.partial = TrackingResult(**stop.partial, scenario=scenario)
        raise
    return TrackingResult(**columns, scenario=scenario)


def sensor_of(filter: Ekf | Ukf) -> RangeBearing:  # noqa: A002 (its name in this package)
    """Give the range and bearing that is a filter's only sensor.

    Raises
    ------
    ValueError
        If it has another process or other sensors.
    """
    sensors = list(filter.sensors.values())
    if not isinstance(filter.process, ConstantAcceleration):
        raise ValueError(f"filter must have a ConstantAcceleration, not {filter.process}")
    if len(sensors) != 1 or not isinstance(sensors[0], RangeBearing):
        raise ValueError(f"filter must have one RangeBearing as its sensor, not {sensors}")
    return sensors[0]


def _as_core(scenario: Scenario, first: int, count: int) -> _ScenarioDict:
    track, noise = scenario.track, scenario.noise
    return {
        "track": track._as_core(),
        "noise": _core.SensorNoise(
            noise.kind, noise.range_m, noise.bearing_rad, noise.centred, noise.dropout
        ),
        "seed": scenario.seed,
        "first_run": first,
        "runs": count,
        "steps": scenario.steps,
        "duration_s": scenario.duration_s,
        "random_start": scenario.random_start,
        "probe_period_s": scenario.probe_period_s,
        "budget_m": scenario.budget_m,
    }
