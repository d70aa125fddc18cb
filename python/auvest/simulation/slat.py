"""The scenario of the SLATF paper, section 7: communication fails, a slave pings its master.

The loop is C++ (``cpp/simulation/slat.hpp``). The defaults are configuration R1 of
docs/algorithms/slatf.md, which fixes what the paper leaves open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import _core, metrics
from auvest._arguments import as_instance, as_integer
from auvest._fields import (
    Checked,
    flag,
    fraction,
    instance,
    integer,
    not_negative,
    number,
    positive,
)
from auvest._texts import counted
from auvest.simulation._runs import Runs, collect, nees_of_plane, standard_error
from auvest.slat import MAX_MASTERS, DeadReckoning, EkfSlat, Slatf, SlatFilter, SlatfJoint
from auvest.slat.models import CompassMotion, Sonar, core_sonar

_DEFAULTS = _core.slat_scenario_defaults()
_PARAMS = _DEFAULTS["params"]
_SLAVE = _DEFAULTS["slave"]

#: Pings (runs times pings per run) of one simulation at most: 120 bytes each.
MAX_PINGS = 20_000_000

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Vehicle(Checked):
    """A vehicle that goes straight at constant speed and, from a time on, turns at a constant rate.

    Parameters
    ----------
    x_m, y_m : float
        Position at time 0, m.
    heading_rad : float
        From the x axis towards the y axis.
    speed_m_s : float
        10 kn in the paper.
    turn_start_s : float
        When it starts to turn.
    turn_rate_rad_s : float
        Positive towards +y; 0: it never turns.
    """

    x_m: float = number(_SLAVE["x_m"])
    y_m: float = number(_SLAVE["y_m"])
    heading_rad: float = number(_SLAVE["heading_rad"])
    speed_m_s: float = number(_SLAVE["speed_m_s"])
    turn_start_s: float = number(_SLAVE["turn_start_s"])
    turn_rate_rad_s: float = number(_SLAVE["turn_rate_rad_s"])


def paper_masters(count: int = 1) -> tuple[Vehicle, ...]:
    """Make the paper's master, and up to three more at other distances on the same course."""
    as_integer("count", count, 1, MAX_MASTERS)
    return tuple(Vehicle(**vehicle) for vehicle in _DEFAULTS["masters"][:count])


@dataclass(frozen=True, kw_only=True)
class SlatScenario(Checked):
    """What is simulated.

    Parameters
    ----------
    slave : Vehicle
    masters : tuple of Vehicle
        1 to 4.
    duration_s : float
        Length of the outage, s.
    odometry_s : float
        Period of the slave's readings, s.
    odometry_per_ping : int
        Readings per ping of the sonar.
    sigma_speed_m_s, sigma_heading_rad : float
        Noise of the readings, standard deviations.
    sigma_range_m, sigma_bearing_rad : float
        Noise of the sonar, standard deviations.
    dropout : float
        Probability that an echo is lost.
    outlier, outlier_sigmas : float
        Probability that an echo is wrong, and by how many standard deviations.
    doubled : float
        Probability that echoes have twice the range: a multipath.
    doubled_in_a_row : int
        So many in a row then.
    silent_from_s, silent_to_s : float
        No echo in between.
    identified : bool
        The filter is told whose echo it hears.
    plan_known : bool
        The filter knows the masters' velocity changes, u of Eq. (4).
    prior_position_m, prior_velocity_m_s, prior_acceleration_m_s2 : float
        Standard deviations of what the slave was told of each master.
    runs : int
        Number of runs.
    seed : int
        0 to 2^64 - 1. Run r takes its streams 2 r (world) and 2 r + 1 (filter): every filter meets
        the same noise.
    """

    slave: Vehicle = instance(Vehicle)
    masters: tuple[Vehicle, ...] = paper_masters()
    duration_s: float = positive(_PARAMS["duration_s"])
    odometry_s: float = positive(_PARAMS["odometry_s"])
    odometry_per_ping: int = integer(_PARAMS["odometry_per_ping"], 1, 10**6)
    sigma_speed_m_s: float = not_negative(_PARAMS["sigma_speed_m_s"])
    sigma_heading_rad: float = not_negative(_PARAMS["sigma_heading_rad"])
    sigma_range_m: float = positive(_PARAMS["sigma_range_m"])
    sigma_bearing_rad: float = positive(_PARAMS["sigma_bearing_rad"])
    dropout: float = fraction(_PARAMS["dropout"])
    outlier: float = fraction(_PARAMS["outlier"])
    outlier_sigmas: float = not_negative(_PARAMS["outlier_sigmas"])
    doubled: float = fraction(_PARAMS["doubled"])
    doubled_in_a_row: int = integer(_PARAMS["doubled_in_a_row"], 1, 10**6)
    silent_from_s: float = not_negative(_PARAMS["silent_from_s"])
    silent_to_s: float = not_negative(_PARAMS["silent_to_s"])
    identified: bool = flag(_PARAMS["identified"])
    plan_known: bool = flag(_PARAMS["plan_known"])
    prior_position_m: float = positive(_PARAMS["prior_position_m"])
    prior_velocity_m_s: float = positive(_PARAMS["prior_velocity_m_s"])
    prior_acceleration_m_s2: float = positive(_PARAMS["prior_acceleration_m_s2"])
    runs: int = integer(50, 1, MAX_PINGS)
    seed: int = integer(1, 0, 2**64 - 1)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.masters, tuple) or not 1 <= len(self.masters) <= MAX_MASTERS:
            raise ValueError(f"masters must be a tuple of 1 to {MAX_MASTERS} Vehicle")
        for n, master in enumerate(self.masters):
            as_instance(f"masters[{n}]", master, Vehicle)
        if self.pings < 1:
            every_s = self.odometry_s * self.odometry_per_ping
            raise ValueError(
                f"duration_s = {self.duration_s:g} is too short for one ping: a ping comes every "
                f"{every_s:g} s"
            )
        if self.pings > MAX_PINGS // self.runs:
            raise ValueError(
                f"{counted(self.runs, 'run')} of {counted(self.pings, 'ping')} are more than "
                f"{MAX_PINGS} pings: fewer runs, or a shorter duration_s"
            )

    @property
    def pings(self) -> int:
        """Pings of one run."""
        if self.duration_s / self.odometry_s > MAX_PINGS:
            return MAX_PINGS + 1
        return math.floor(self.duration_s / self.odometry_s + 0.5) // self.odometry_per_ping

    @property
    def motion(self) -> CompassMotion:
        """The slave's motion as a filter should know it, with the bias compensated."""
        return CompassMotion(
            sigma_speed_m_s=self.sigma_speed_m_s, sigma_heading_rad=self.sigma_heading_rad
        )

    @property
    def sonar(self) -> Sonar:
        """The sonar as a filter should know it."""
        return Sonar(sigma_range_m=self.sigma_range_m, sigma_bearing_rad=self.sigma_bearing_rad)

    def _as_core(self) -> _core.SlatScenario:
        params = {name: getattr(self, name) for name in _PARAMS}
        return _core.SlatScenario(params, asdict(self.slave), [asdict(m) for m in self.masters])


_SCENARIO = SlatScenario()


@dataclass(frozen=True)
class SlatResult(Runs):
    """What :func:`simulate` returns. Pings after a failure are NaN.

    Attributes
    ----------
    time_s : ndarray, shape (pings,)
        Time of each ping, s.
    truth : ndarray, shape (pings, 2)
        True positions of the slave, m.
    masters : ndarray, shape (pings, M, 2)
        True positions of the masters, m.
    error : ndarray, shape (runs, pings, 2)
        Errors of the slave's position, m.
    covariance : ndarray, shape (runs, pings, 2, 2)
        What the filter claims about them, m^2.
    master_error : ndarray, shape (runs, pings, M, 2)
        Errors of the masters' positions, m; NaN for a filter without masters.
    effective_size : ndarray, shape (runs, pings)
        N_eff; 0 without particles.
    nis : ndarray, shape (runs, pings)
        Of :class:`auvest.EkfSlat`; 0 for the others.
    resamplings, heard : ndarray of int, shape (runs,)
        Resamplings, and echoes taken in.
    refused, rebirths : ndarray of int, shape (runs,)
        Echoes refused by the gate, and masters born again.
    log_likelihood : ndarray, shape (runs,)
        Of all echoes of the run.
    status : ndarray of uint8, shape (runs,)
        How each run ended: values of :class:`auvest.Status`, 0 is ok.
    scenario : SlatScenario
        What was simulated.
    """

    time_s: Floats
    truth: Floats
    masters: Floats
    error: Floats
    covariance: Floats
    master_error: Floats
    effective_size: Floats
    nis: Floats
    resamplings: npt.NDArray[np.int64]
    heard: npt.NDArray[np.int64]
    refused: npt.NDArray[np.int64]
    rebirths: npt.NDArray[np.int64]
    log_likelihood: Floats
    status: npt.NDArray[np.uint8]
    scenario: SlatScenario

    @property
    def distance_m(self) -> Floats:
        """Length of the error of the slave's position, m, shape (runs, pings)."""
        return np.sqrt(np.square(self.error).sum(axis=-1))

    @property
    def run_rmse_m(self) -> Floats:
        """Root mean square over time of each run, m, shape (runs,)."""
        return np.sqrt(np.nanmean(np.square(self.distance_m), axis=1))

    @property
    def rmse_m(self) -> float:
        """The paper's RMSE: :attr:`run_rmse_m` averaged over the runs, m."""
        return float(self.run_rmse_m.mean())

    @property
    def rmse_standard_error_m(self) -> float:
        """Standard error of :attr:`rmse_m`; NaN for one run."""
        return standard_error(self.run_rmse_m)

    @property
    def nees(self) -> Floats:
        """Normalised error of the slave's position squared, (runs, pings); 2 degrees of freedom.

        Infinite where all particles stand in one place: they claim a covariance of zero.
        """
        return nees_of_plane(self.error, self.covariance)

    def per_run(self) -> dict[str, npt.NDArray[Any]]:
        """Collect one row per run."""
        return {
            "rmse_m": self.run_rmse_m,
            "mean_error_m": np.nanmean(self.distance_m, axis=1),
            "end_error_m": self.distance_m[:, -1],
            "resamplings": self.resamplings,
            "echoes": self.heard,
            "log_likelihood": self.log_likelihood,
            "status": self.status,
        }

    @property
    def covered(self) -> float:
        """Share of the pings at which the truth lies in the 95 % ellipse of the estimate."""
        nees = self.nees
        inside = nees <= metrics.chi2_bounds(2, level=0.90)[1]
        return float(inside.sum() / np.isfinite(self.distance_m).sum())


def simulate(
    filter: SlatFilter,  # noqa: A002 (its name in this package)
    scenario: SlatScenario = _SCENARIO,
    *,
    first: int = 0,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    store: Path | None = None,
    settings: Mapping[str, Any] | None = None,
) -> SlatResult:
    """Run a filter through the scenario, many times.

    Parameters
    ----------
    filter : Slatf, SlatfJoint, EkfSlat or DeadReckoning
        The prototype: its models and parameters are those of every run; its state is not used and
        not changed. Its motion must be a :class:`auvest.CompassMotion`, whose noise need not be the
        true one (:attr:`SlatScenario.motion` is), nor that of its sonar.
    scenario : SlatScenario
    first : int
        Number of the first run, whose stream of the seed it draws from: runs done in several calls
        are those of one call, bit for bit.
    workers : int, optional
        Threads, 1 to 256; default: one per processor. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(runs_done, runs)`` in the calling thread.
    store, settings : optional
        Keep finished runs in a folder and go on from them, see :func:`auvest.montecarlo.run`. The
        settings must name everything that the filter is made of.

    Returns
    -------
    SlatResult
        A run that fails keeps the pings it has; see ``status`` and ``failed``.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    auvest.montecarlo.Interrupted
        After Ctrl-C; ``partial`` holds the runs that are done as a SlatResult, or None.
    """
    as_instance("filter", filter, (Slatf, SlatfJoint, EkfSlat, DeadReckoning))
    as_instance("scenario", scenario, SlatScenario)
    as_instance("filter.motion", filter.motion, CompassMotion)
    if filter.sonar.bearing != "master_to_slave":
        raise ValueError("filter.sonar must have the scenario's bearing, 'master_to_slave'")
    world = scenario._as_core()
    core = filter._core_steps.copy()
    sonar = core_sonar(filter.sonar, filter.dtype.name)
    still = _core.Slat_compass_float64.dead_reckoning({}, math.inf).simulate(
        core_sonar(Sonar(), "float64"), world, 0, 0, 1
    )
    true = {name: still[name] for name in ("time_s", "truth", "masters")}

    def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
        columns = core.simulate(sonar, world, scenario.seed, first, count)
        return {name: values for name, values in columns.items() if name not in true}

    return collect(
        partial(SlatResult, **true, scenario=scenario),
        part,
        scenario.runs,
        first=first,
        chunk=max(1, min(5, 500_000 // scenario.pings)),
        workers=workers,
        progress=progress,
        store=store,
        settings=settings,
    )
