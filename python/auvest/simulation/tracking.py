"""A base station tracks an AUV by range and bearing: the simulation of the AUKF paper, section 3.

The loop is C++ (``cpp/simulation/tracking.hpp``): the filter's own interval decides
when the next sample is taken, and the desired track is the true one, as in the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass
from functools import cached_property, partial
from math import inf
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from auvest import _core, metrics, montecarlo
from auvest._arguments import as_instance, as_number
from auvest._fields import (
    Checked,
    choice,
    flag,
    fraction,
    instance,
    integer,
    not_negative,
    number,
    pair,
    positive,
)
from auvest.filters import Ekf, Ukf, _many
from auvest.intervals import FixedInterval
from auvest.models import ConstantAcceleration, RangeBearing
from auvest.simulation._runs import Runs, collect, mean_of_rows, nees_of_plane, only_sensor

_TRACK = _core.track_defaults()
_NOISE = _core.noise_defaults()
_INTERVAL = _core.fixed_interval_defaults()

#: Rows (runs times steps) of one simulation at most: 150 bytes each.
MAX_SAMPLES = 10_000_000


@dataclass(frozen=True, kw_only=True)
class Track(Checked):
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

    kind: Literal["euler", "straight", "turn"] = choice("euler", "straight", "turn")
    position: tuple[float, float] = pair(_TRACK["position"])
    velocity: tuple[float, float] = pair(_TRACK["velocity"])
    acceleration: tuple[float, float] = pair(_TRACK["acceleration"])
    turn_rate: float = number(_TRACK["turn_rate"])
    wander_m: float = not_negative(_TRACK["wander_m"])
    wander_period_s: float = positive(_TRACK["wander_period_s"])

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
        core = _core.Track(*astuple(self))
        core.advance(as_number("time_s", time_s, "not negative"))
        x, y = core.position
        return x, y


@dataclass(frozen=True, kw_only=True)
class Noise(Checked):
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

    kind: Literal["normal", "uniform", "lognormal"] = choice("normal", "uniform", "lognormal")
    range_m: float = not_negative(_NOISE["range_m"])
    bearing_rad: float = not_negative(_NOISE["bearing_rad"])
    centred: bool = flag(_NOISE["centred"])
    dropout: float = fraction(_NOISE["dropout"])

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
class Scenario(Checked):
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

    track: Track = instance(Track)
    noise: Noise = instance(Noise)
    steps: int = integer(60, 1, MAX_SAMPLES)
    duration_s: float = positive(inf, infinite=True)
    runs: int = integer(200, 1, MAX_SAMPLES)
    seed: int = integer(1, 0, 2**64 - 1)
    random_start: bool = flag(False)
    interval_s: float = positive(_INTERVAL["interval_s"])
    probe_period_s: float = not_negative(0.0)
    budget_m: float = positive(0.1)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.runs * self.steps > MAX_SAMPLES:
            raise ValueError(
                f"runs * steps must be at most {MAX_SAMPLES}, not {self.runs} * {self.steps}"
            )
        if 0 < self.probe_period_s < 1e-4:
            raise ValueError(
                f"probe_period_s must be 0 or at least 1e-4, not {self.probe_period_s}"
            )


_SCENARIO = Scenario()


@dataclass(frozen=True)
class TrackingResult(Runs):
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
    def error(self) -> npt.NDArray[np.float64]:  # type: ignore[override]
        """Position errors at the samples, m, shape (runs, steps, 2)."""
        return self.x[..., :2] - self.truth

    @cached_property
    def nees(self) -> npt.NDArray[np.float64]:
        """Normalised position error squared, shape (runs, steps); 2 degrees of freedom."""
        return metrics.nees(self.error, self.position_covariance)

    def per_run(self) -> dict[str, npt.NDArray[Any]]:
        """Collect one row per run: error, consistency and interval, means over its samples."""
        error = self.error
        return {
            "rmse_m": np.sqrt(mean_of_rows(np.square(error).sum(axis=-1))),
            "nis": mean_of_rows(self.nis),
            "nees": mean_of_rows(nees_of_plane(error, self.position_covariance)),
            "interval_s": mean_of_rows(self.interval_s),
            "samples": self.samples,
            "status": self.status,
        }

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
    first: int = 0,
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
    first : int
        Number of the first run, whose stream of the seed it draws from: runs done in several calls
        are those of one call, bit for bit.
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

    Examples
    --------
    >>> from auvest.simulation import paper_aukf, tracking
    >>> noise = tracking.Noise(range_m=0.1)
    >>> scenario = tracking.Scenario(noise=noise, runs=30)
    >>> result = tracking.simulate(paper_aukf.paper_filter("ukf", noise=noise), scenario)
    >>> result.x.shape, int(result.failed.sum())
    ((30, 60, 6), 0)
    >>> sorted(result.per_run())
    ['interval_s', 'nees', 'nis', 'rmse_m', 'samples', 'status']
    """
    as_instance("filter", filter, (Ekf, Ukf))
    as_instance("scenario", scenario, Scenario)
    policy = filter.policy or FixedInterval(interval_s=scenario.interval_s)
    core, x0, p0 = filter._core_filter(policy), filter.x, filter.P
    sensor = sensor_of(filter).core(6, filter.dtype)

    def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
        values = _as_core(scenario, first, count)
        return _core.simulate_tracking(core, x0, p0, sensor, values, _many.lanes())

    return collect(
        partial(TrackingResult, scenario=scenario),
        part,
        scenario.runs,
        first=first,
        chunk=montecarlo.chunk_for(scenario.runs, scenario.steps, workers, side_by_side=True),
        workers=workers,
        progress=progress,
    )


def sensor_of(filter: Ekf | Ukf) -> RangeBearing:  # noqa: A002 (its name in this package)
    """Give the range and bearing that is a filter's only sensor.

    Raises
    ------
    ValueError
        If it has another process or other sensors.
    """
    if not isinstance(filter.process, ConstantAcceleration):
        raise ValueError(f"filter must have a ConstantAcceleration, not {filter.process}")
    return only_sensor(filter, RangeBearing)


def _as_core(scenario: Scenario, first: int, count: int) -> dict[str, Any]:
    values = {**vars(scenario), "first_run": first, "runs": count}
    values.pop("interval_s")  # is the filter's
    values["track"] = _core.Track(*astuple(scenario.track))
    values["noise"] = _core.SensorNoise(*astuple(scenario.noise))
    return values
