"""A slave vehicle dead-reckons and ranges to two leaders in turn: the M-estimation EKF's setting.

Li, Du, Fan, Chen, Mao, Luo 2020. The paper gives neither tracks nor noise; the tracks are those of
this project's own reference case. The loop is C++
(``cpp/simulation/cooperative.hpp``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core, metrics, montecarlo
from auvest._arguments import as_instance, as_integer, as_kind, as_number
from auvest._fields import (
    Checked,
    choice,
    flag,
    fraction,
    instance,
    integer,
    not_negative,
    pair,
    positive,
)
from auvest.filters import Ekf, RobustEkf, RobustUkf, Ukf
from auvest.kernels import Kernel, KernelName, RejectionStreak
from auvest.models import LeaderRange, SpeedHeading
from auvest.simulation._runs import (
    Runs,
    collect,
    mean_of_rows,
    nees_of_plane,
    only_sensor,
    standard_error,
)

_DEFAULTS = _core.cooperative_defaults()
_STREAK = RejectionStreak()

#: Rows (runs times steps) of one simulation at most: 64 bytes each.
MAX_SAMPLES = 20_000_000

#: Messages that can be on their way to the slave at once; more are counted as overflowed.
MESSAGES_IN_FLIGHT: int = _DEFAULTS["messages_in_flight"]

#: 2.3 h of the paper's experiment, in steps of 1 s.
PAPER_STEPS = 8280

NoiseKind: TypeAlias = Literal["contaminated", "multipath", "student"]
Timing: TypeAlias = Literal["at-once", "own-time", "as-if-fresh"]
NOISE_KINDS: tuple[NoiseKind, ...] = ("contaminated", "multipath", "student")
TIMINGS: tuple[Timing, ...] = ("at-once", "own-time", "as-if-fresh")


@dataclass(frozen=True, kw_only=True)
class RangeNoise(Checked):
    """Errors of the ranges.

    Parameters
    ----------
    kind : {"contaminated", "multipath", "student"}
        "contaminated": normal, and with a probability of another, larger size. "multipath": normal,
        and with that probability too long by the size of a second normal deviate. "student":
        Student's t times ``sigma_m``.
    sigma_m : float
        Standard deviation (scale for "student"), m, positive.
    outlier_fraction : float
        Probability of an outlier, in 0..1; not for "student".
    outlier_sigma_m : float
        Size of an outlier, m, positive; not for "student".
    degrees_of_freedom : int
        Of Student's t, 1..100.
    """

    kind: NoiseKind = choice(*NOISE_KINDS)
    sigma_m: float = positive(_DEFAULTS["sigma_m"])
    outlier_fraction: float = fraction(_DEFAULTS["outlier_fraction"])
    outlier_sigma_m: float = positive(_DEFAULTS["outlier_sigma_m"])
    degrees_of_freedom: int = integer(_DEFAULTS["degrees_of_freedom"], 1, 100)


@dataclass(frozen=True, kw_only=True)
class Scenario(Checked):
    """What is simulated beside the filter.

    Parameters
    ----------
    noise : RangeNoise
        Errors of the ranges.
    timing : {"at-once", "own-time", "as-if-fresh"}
        "at-once": a range is there when it is measured. The other two: it comes with the leader's
        next message, one cycle later; it is then taken at its own time with the leader's position
        of that time, or as if it were fresh, with the position in the message.
    dropout, late : float
        Probabilities, in 0..1, that a message is lost or late.
    late_steps : int
        A late message is late by at most so many steps. Of many late messages and frequent ranges
        some overflow: at most :data:`MESSAGES_IN_FLIGHT` are on their way at once.
    sigma_speed, sigma_heading : float
        True noise of the slave's instruments, m/s/sqrt(Hz) and rad/sqrt(Hz), not negative.
    range_every : int
        Steps between ranges; the leaders take turns. Up to 10, so that a range is within the
        filter's memory.
    steps : int
        Steps of 1 s of each run; 8280 is the paper's 2.3 h.
    runs : int
        Monte Carlo runs.
    seed : int
        Run r draws from stream r of this seed, whatever the number of workers.
    random_start : bool
        Draw the start from the filter's belief; else start at its mean.
    offset_m : (float, float)
        Error of the start that the filter does not know of, m.
    """

    noise: RangeNoise = instance(RangeNoise)
    timing: Timing = choice(*TIMINGS)
    dropout: float = fraction(0.0)
    late: float = fraction(0.0)
    late_steps: int = integer(_DEFAULTS["late_steps"], 1, _DEFAULTS["most_late_steps"])
    sigma_speed: float = not_negative(_DEFAULTS["sigma_speed"])
    sigma_heading: float = not_negative(_DEFAULTS["sigma_heading"])
    range_every: int = integer(_DEFAULTS["range_every"], 1, 10)
    steps: int = integer(PAPER_STEPS, 1, MAX_SAMPLES)
    runs: int = integer(50, 1, MAX_SAMPLES)
    seed: int = integer(1, 0, 2**64 - 1)
    random_start: bool = flag(False)
    offset_m: tuple[float, float] = pair((0.0, 0.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.runs * self.steps > MAX_SAMPLES:
            raise ValueError(
                f"runs * steps must be at most {MAX_SAMPLES}, not {self.runs} * {self.steps}"
            )


@dataclass(frozen=True)
class Result(Runs):
    """What :func:`simulate` returns. Rows after the end of a run are NaN.

    Attributes
    ----------
    error : ndarray, shape (runs, steps, 2)
        Position errors, m.
    covariance : ndarray, shape (runs, steps, 2, 2)
        What the filter thinks of them, m^2.
    nis : ndarray, shape (runs, steps)
        Normalised innovation squared of the (last) range that was taken at this step, else NaN.
    weight : ndarray, shape (runs, steps)
        The weight it got, else NaN.
    samples : ndarray of int, shape (runs,)
        Steps done.
    recoveries : ndarray of int, shape (runs,)
        Times that the recovery widened the covariance.
    taken : ndarray of int, shape (runs,)
        Ranges that corrected the filter.
    too_late : ndarray of int, shape (runs,)
        Ranges that were older than the filter's memory when they came.
    lost : ndarray of int, shape (runs,)
        Messages that never came, by ``dropout``.
    overflowed : ndarray of int, shape (runs,)
        Messages that were given up because :data:`MESSAGES_IN_FLIGHT` others were on their way.
    status : ndarray of uint8, shape (runs,)
        How each run ended: values of :class:`auvest.Status`, 0 is ok.
    scenario : Scenario
        What was simulated.
    """

    error: npt.NDArray[np.float64]
    covariance: npt.NDArray[np.float64]
    nis: npt.NDArray[np.float64]
    weight: npt.NDArray[np.float64]
    samples: npt.NDArray[np.int64]
    recoveries: npt.NDArray[np.int64]
    taken: npt.NDArray[np.int64]
    too_late: npt.NDArray[np.int64]
    lost: npt.NDArray[np.int64]
    overflowed: npt.NDArray[np.int64]
    status: npt.NDArray[np.uint8]
    scenario: Scenario

    @property
    def rmse_per_run_m(self) -> npt.NDArray[np.float64]:
        """Root mean square position error of each run, m, shape (runs,)."""
        square = np.square(self.error).sum(axis=-1)
        return np.array([np.sqrt(row[~np.isnan(row)].mean()) for row in square])

    def per_run(self) -> dict[str, npt.NDArray[Any]]:
        """Collect one row per run: error, consistency and what became of the ranges."""
        return {
            "rmse_m": np.sqrt(mean_of_rows(np.square(self.error).sum(axis=-1))),
            "nis": mean_of_rows(self.nis),
            "nees": mean_of_rows(nees_of_plane(self.error, self.covariance)),
            "weight": mean_of_rows(self.weight),
            "taken": self.taken,
            "recoveries": self.recoveries,
            "too_late": self.too_late,
            "lost": self.lost,
            "status": self.status,
        }

    @property
    def rmse_standard_error_m(self) -> float:
        """Standard error of ``rmse_m``, m; NaN for one run."""
        return standard_error(np.square(self.rmse_per_run_m)) / (2 * self.rmse_m)

    @property
    def nees(self) -> npt.NDArray[np.float64]:
        """Normalised position error squared, shape (runs, steps); 2 degrees of freedom."""
        return metrics.nees(self.error, self.covariance)


def tracks(steps: int = PAPER_STEPS) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Give the true positions (m) at 1, 2, ... s: slave (steps, 2), leaders (steps, 2, 2)."""
    slave, leaders = _core.cooperative_fleet(
        _DEFAULTS["dt_s"], as_integer("steps", steps, 1, MAX_SAMPLES)
    )
    return slave, leaders


def slave_filter(
    kernel: Kernel | KernelName = "igg",
    *,
    kind: Literal["ekf", "ukf"] = "ekf",
    q_factor: float = 1.0,
    r_factor: float = 1.0,
    sigma_range_m: float = _DEFAULTS["sigma_m"],
    recovery: RejectionStreak | None = _STREAK,
    residual: Literal["innovation", "post-fit"] = "innovation",
    dtype: npt.DTypeLike = "float64",
) -> RobustEkf | RobustUkf:
    """Make the slave's filter: it starts at the true position with P0 = 1 m^2.

    Parameters
    ----------
    kernel : Kernel or its name
        "unit" makes it the plain EKF or UKF.
    kind : {"ekf", "ukf"}
    q_factor, r_factor : float
        What the filter takes the noise of process and range for, in variance, relative to the
        default scenario's; positive.
    sigma_range_m : float
        Standard deviation of the range that is multiplied, m.
    recovery, residual, dtype
        As for :class:`auvest.RobustEkf`.
    """
    q = as_number("q_factor", q_factor, "positive") ** 0.5
    r = as_number("r_factor", r_factor, "positive") ** 0.5
    as_kind("kind", kind, ("ekf", "ukf"))
    make: type[RobustEkf] | type[RobustUkf] = RobustEkf if kind == "ekf" else RobustUkf
    return make(
        np.zeros(2),
        np.eye(2),
        process=SpeedHeading(
            sigma_forward=q * _DEFAULTS["sigma_speed"], sigma_heading=q * _DEFAULTS["sigma_heading"]
        ),
        sensors=LeaderRange(sigma_range_m=r * sigma_range_m),
        kernel=kernel,
        recovery=recovery,
        residual=residual,
        dtype=dtype,
    )


_SCENARIO = Scenario()


def simulate(
    filter: Ekf | Ukf,  # noqa: A002 (its name in this package)
    scenario: Scenario = _SCENARIO,
    *,
    first: int = 0,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Run a filter through a scenario, many times.

    Parameters
    ----------
    filter : Ekf or Ukf
        The prototype, with :class:`auvest.SpeedHeading` of two states and a
        :class:`auvest.LeaderRange`: its models, kernel and belief are the start of every run. It is
        not changed. Its noise need not be the true noise.
    scenario : Scenario
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
    Result

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    """
    as_instance("filter", filter, (Ekf, Ukf))
    as_instance("scenario", scenario, Scenario)
    if not isinstance(filter.process, SpeedHeading) or len(filter.x) != 2:
        raise ValueError(f"filter must have a SpeedHeading of two states, not {filter.process}")
    sensor = only_sensor(filter, LeaderRange).core(2, filter.dtype)
    core = filter._core_filter(None)
    core.reset(filter.x, filter.P, filter.x)

    def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
        return _core.cooperate(core, sensor, _as_core(scenario, first, count))

    return collect(
        partial(Result, scenario=scenario),
        part,
        scenario.runs,
        first=first,
        chunk=montecarlo.chunk_for(scenario.runs, scenario.steps, workers),
        workers=workers,
        progress=progress,
    )


def _as_core(scenario: Scenario, first: int, count: int) -> dict[str, Any]:
    values = asdict(scenario)
    values.update(values.pop("noise"))
    x, y = values.pop("offset_m")
    values.update(dt_s=_DEFAULTS["dt_s"], offset_x_m=x, offset_y_m=y, first_run=first, runs=count)
    return values
