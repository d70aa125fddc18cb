"""A torpedo flies a track: estimate, guidance, control, actuators, hull and sensors in one loop.

The loop is C++ (``cpp/simulation/mission.hpp``), ten steps a second; the vehicle is ``remus100`` in
6, 5, 4 or 3 degrees of freedom. Axes are north, east, down; angles count from north towards east.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import _core, montecarlo
from auvest._arguments import as_instance, as_kind, as_number
from auvest._core import Status
from auvest._fields import (
    Checked,
    choice,
    fraction,
    integer,
    not_negative,
    number,
    positive,
)
from auvest._texts import counted
from auvest.guidance import DubinsPath, SplinePath
from auvest.intervals import (
    FixedInterval,
    IntervalPolicy,
    core_interval,
)
from auvest.kernels import Kernel, KernelName, RejectionStreak, Unit, as_kernel, core_kernel

_DEFAULTS = _core.mission_defaults()
_FIXED = FixedInterval(interval_s=0.5)
Floats: TypeAlias = npt.NDArray[np.float64]

TrackKind: TypeAlias = Literal["lawnmower", "circle"]
Estimate: TypeAlias = Literal["truth", "fixes", "ukf", "model-aided"]
Law: TypeAlias = Literal["adaptive", "crab", "line-of-sight", "integral", "vector-field"]
PathKind: TypeAlias = Literal["waypoints", "dubins", "spline"]
DType: TypeAlias = Literal["float64", "float32"]
TRACKS: tuple[TrackKind, ...] = ("lawnmower", "circle")
ESTIMATES: tuple[Estimate, ...] = ("truth", "fixes", "ukf", "model-aided")
LAWS: tuple[Law, ...] = ("adaptive", "crab", "line-of-sight", "integral", "vector-field")

PATHS: tuple[PathKind, ...] = ("waypoints", "dubins", "spline")

#: Corners of the lawnmower, m; centre and radius of the circle, m.
LAWNMOWER = np.array(
    [[20, 20], [140, 20], [140, 60], [20, 60], [20, 100], [140, 100], [140, 140], [20, 140]], float
)
CIRCLE = (80.0, 80.0, 40.0)
_LANES_M = 40.0

#: Steps of all runs together that are kept at most: 200 bytes each.
MAX_STEPS = 5_000_000
_ROWS = 8000
_MOST_POINTS = 20_000


@dataclass(frozen=True, kw_only=True)
class Mission(Checked):
    """What is flown, with what, and what the vehicle does not know.

    Parameters
    ----------
    track : {"lawnmower", "circle"}
        Four lanes of 120 m, 40 m apart; or a circle of radius 40 m for ``circle_s``.
    path : {"waypoints", "dubins", "spline"}
        How the lawnmower goes from lane to lane: corners (or arcs of ``arc_m``, which cut them);
        the shortest curves that turn on ``arc_m``; a spline through points of the lanes and of half
        circles. The hull turns on 14.3 m at 900 rpm, so it misses a corner by 10 m.
    estimate : {"truth", "fixes", "ukf", "model-aided"}
        What guidance takes for the position: the truth (no sensor has noise), the last USBL fix, a
        UKF of constant acceleration, or an EKF of dead reckoning with the current in its state
        (:class:`auvest.SpeedHeadingCurrent`).
    guidance : {"adaptive", "crab", "line-of-sight", "integral", "vector-field"}
        Guidance law; "crab" feeds the estimated current forward and needs an estimate that has one.
    interval : FixedInterval, MahalanobisInterval or CovarianceBudget
        When the next fix is asked for, rounded to the period.
    kernel : Kernel or its name, optional
        Robust kernel of the filter.
    recovery : RejectionStreak, optional
        Recovery from lock-out; needs a kernel.
    degrees_of_freedom : {6, 5, 4, 3}
        Of the hull.
    dtype : {"float64", "float32"}
        Precision of the vehicle's own part; float32 gives the bits of the chip.
    period_s, speed_m_s, depth_m
        Period of the loop; speed through the water and depth that are held.
    current_m_s, current_rad
        Current, and where it flows to; NaN: drawn for each run.
    current_walk, current_sigma_m_s
        Random walk of the current, m^2/s^3; where it is not 0 the current begins with a draw of
        this deviation per axis.
    initial_error_m
        Standard deviation of the first estimate's error, per axis.
    compass_bias_rad, compass_noise_rad, gyro_noise_rad_s, gyro_walk_rad_s, depth_noise_m
        Standard deviations; the compass bias is drawn per run, the gyro's bias walks.
    log_noise_m_s, log_scale
        Of the water speeds, forward and sideways; relative error.
    usbl_noise_m, usbl_noise_rad, usbl_outliers, usbl_outlier_m
        Range and bearing from the station at (0, 0): noise; share of late ranges, and their mean.
    usbl_latency_s, usbl_sound_m_s, usbl_dropout
        Delay of a fix; speed of sound (0: none), by which a fix is late too; share that is lost.
    acceleration_psd
        Of the UKF, m^2/s^5.
    model_position, model_current
        Of the model-aided filter: power of the noise on the position, m^2/s, and the walk of the
        current, m^2/s^3.
    lookahead_m, switch_m, end_m, arc_m
        Look-ahead distance; lead before a corner; end before the last waypoint; radius of arcs
        instead of corners (0: corners), and of the turns of "dubins", which needs one.
    circle_s, most_s
        Length of the circle; longest lawnmower.
    runs, seed : int
        Monte Carlo runs; run r draws from its own streams of the seed.

    Raises
    ------
    ValueError, TypeError
        If an argument lies outside its range.
    """

    track: TrackKind = choice("lawnmower", "circle")
    path: PathKind = choice("waypoints", "dubins", "spline")
    estimate: Estimate = choice("model-aided", "truth", "fixes", "ukf")
    guidance: Law = choice("crab", "adaptive", "line-of-sight", "integral", "vector-field")
    interval: IntervalPolicy = _FIXED
    kernel: Kernel | KernelName | None = None
    recovery: RejectionStreak | None = None
    degrees_of_freedom: int = integer(6, 3, 6)
    dtype: DType = choice("float64", "float32")
    period_s: float = positive(_DEFAULTS["period_s"])
    speed_m_s: float = positive(_DEFAULTS["speed_m_s"])
    depth_m: float = not_negative(_DEFAULTS["depth_m"])
    current_m_s: float = not_negative(_DEFAULTS["current_m_s"])
    current_rad: float = _DEFAULTS["current_rad"]
    current_walk: float = not_negative(_DEFAULTS["current_walk"])
    current_sigma_m_s: float = not_negative(_DEFAULTS["current_sigma_m_s"])
    initial_error_m: float = not_negative(_DEFAULTS["initial_error_m"])
    compass_bias_rad: float = not_negative(_DEFAULTS["compass_bias_rad"])
    compass_noise_rad: float = not_negative(_DEFAULTS["compass_noise_rad"])
    gyro_noise_rad_s: float = not_negative(_DEFAULTS["gyro_noise_rad_s"])
    gyro_walk_rad_s: float = not_negative(_DEFAULTS["gyro_walk_rad_s"])
    depth_noise_m: float = not_negative(_DEFAULTS["depth_noise_m"])
    log_noise_m_s: float = not_negative(_DEFAULTS["log_noise_m_s"])
    log_scale: float = number(_DEFAULTS["log_scale"])
    usbl_noise_m: float = positive(_DEFAULTS["usbl_noise_m"])
    usbl_noise_rad: float = positive(_DEFAULTS["usbl_noise_rad"])
    usbl_outliers: float = fraction(_DEFAULTS["usbl_outliers"])
    usbl_outlier_m: float = not_negative(_DEFAULTS["usbl_outlier_m"])
    usbl_sound_m_s: float = not_negative(_DEFAULTS["usbl_sound_m_s"])
    usbl_latency_s: float = not_negative(_DEFAULTS["usbl_latency_s"])
    usbl_dropout: float = fraction(_DEFAULTS["usbl_dropout"])
    acceleration_psd: float = positive(_DEFAULTS["acceleration_psd"])
    model_position: float = not_negative(_DEFAULTS["model_position"])
    model_current: float = not_negative(_DEFAULTS["model_current"])
    lookahead_m: float = positive(_DEFAULTS["lookahead_m"])
    switch_m: float = positive(_DEFAULTS["switch_m"])
    end_m: float = not_negative(_DEFAULTS["end_m"])
    arc_m: float = not_negative(_DEFAULTS["arc_m"])
    circle_s: float = positive(_DEFAULTS["circle_s"])
    most_s: float = positive(_DEFAULTS["most_s"])
    runs: int = integer(50, 1, 100_000)
    seed: int = integer(1, 0, 2**64 - 1)

    def __post_init__(self) -> None:
        super().__post_init__()
        as_instance("interval", self.interval, IntervalPolicy.__args__)
        if self.guidance == "crab" and self.estimate in ("fixes", "ukf"):
            raise ValueError(
                f"guidance 'crab' needs an estimate of the current: 'truth' or 'model-aided', not "
                f"{self.estimate!r}; guidance 'adaptive' finds the crab angle itself"
            )
        if self.path != "waypoints" and self.track == "circle":
            raise ValueError(f"path {self.path!r} is for the lawnmower: a circle has no corner")
        if self.path == "dubins" and self.arc_m == 0:
            raise ValueError(
                "path 'dubins' needs arc_m, the radius of its turns: 20 fits lanes 40 m apart"
            )
        if self.path == "waypoints" and self.track == "lawnmower":
            if 2 * self.arc_m > _LANES_M:
                raise ValueError(
                    f"arc_m = {self.arc_m:g} leaves no room: the legs between the lanes have "
                    f"{_LANES_M:g} m for two arcs, {_LANES_M / 2:g} m is the largest; path "
                    "'dubins' turns on any radius"
                )
            if self.arc_m == 0 and self.switch_m >= _LANES_M:
                raise ValueError(
                    f"switch_m = {self.switch_m:g} must be below {_LANES_M:g}, the legs between "
                    "the lanes"
                )
        if self.path == "spline" and self.arc_m > 0:
            raise ValueError("arc_m does nothing with path 'spline', which bends as its points lie")
        if self.kernel is not None:
            object.__setattr__(self, "kernel", as_kernel(self.kernel))
        if self.recovery is not None:
            as_instance("recovery", self.recovery, RejectionStreak)
            if self.kernel is None:
                raise ValueError("recovery is for filters with a kernel")
        if self.current_rad == self.current_rad:
            object.__setattr__(self, "current_rad", as_number("current_rad", self.current_rad))


@dataclass(frozen=True)
class MissionResult:
    """What :func:`simulate` returns; a row per run, NaN behind the end of a run.

    Attributes
    ----------
    settled_rms_m, all_rms_m : ndarray, shape (runs,)
        Cross-track error beside the active leg: from 50 m into a leg (60 s into the circle, and
        into a lawnmower of curves), and all of it, corners too.
    position_rms_m, duration_s, mean_interval_s, rudder_travel_rad_s : ndarray, shape (runs,)
        Error of the estimate; length of the run; mean time between fixes; mean rate of the rudder.
    fixes, refused : ndarray, shape (runs,)
        Fixes taken, and those that the filter refused.
    status, finished : ndarray, shape (runs,)
        The core's status of each run; whether the track was flown to its end.
    pose, water : ndarray, shape (runs, T, 6)
        North, east, down (m), roll, pitch, yaw (rad); velocities through the water, body axes.
    cross_m, interval_s, nis, nees_position, nees, settled : ndarray, shape (runs, T)
        Of each step; NEES of the position, and of all states that the truth has.
    estimate_m, estimate_current_m_s : ndarray, shape (runs, T, 2)
    command : ndarray, shape (runs, T, 3)
        Rudder, stern planes (rad), propeller (rev/s).
    mission : Mission
        What was simulated.
    """

    settled_rms_m: Floats
    all_rms_m: Floats
    position_rms_m: Floats
    duration_s: Floats
    mean_interval_s: Floats
    rudder_travel_rad_s: Floats
    fixes: npt.NDArray[np.int64]
    refused: npt.NDArray[np.int64]
    status: npt.NDArray[np.uint8]
    finished: npt.NDArray[np.bool_]
    pose: Floats
    water: Floats
    cross_m: Floats
    interval_s: Floats
    nis: Floats
    nees_position: Floats
    nees: Floats
    settled: Floats
    estimate_m: Floats
    estimate_current_m_s: Floats
    command: Floats
    mission: Mission

    @property
    def failed(self) -> npt.NDArray[np.bool_]:
        """Runs that ended with a status or did not reach the end of the track."""
        failed: npt.NDArray[np.bool_] = (self.status != int(Status.ok)) | ~self.finished
        return failed

    def per_run(self) -> dict[str, npt.NDArray[Any]]:
        """Collect one row per run: what has one number for each."""
        return {
            entry.name: getattr(self, entry.name)
            for entry in fields(self)
            if entry.name != "mission" and getattr(self, entry.name).ndim == 1
        }

    @property
    def time_s(self) -> Floats:
        """Time of the kept steps, s, shape (T,)."""
        return np.asarray(np.arange(self.cross_m.shape[1]) * self.mission.period_s)


def simulate(
    mission: Mission,
    *,
    record: bool = True,
    first: int = 0,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> MissionResult:
    """Fly all runs of a mission, on all cores.

    Parameters
    ----------
    mission : Mission
        What is flown.
    record : bool
        Whether every step is kept, not the numbers of each run alone.
    first : int
        Number of the first run, whose stream of the seed it draws from: runs done in several calls
        are those of one call, bit for bit.
    workers : int, optional
        Threads; default: one per processor. The result does not depend on it.
    progress : callable, optional
        Called as ``progress(runs_done, runs)``.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    montecarlo.Interrupted
        After Ctrl-C; ``partial`` has the runs that are done.
    """
    as_instance("mission", mission, Mission)
    longest = mission.circle_s if mission.track == "circle" else mission.most_s
    rows = min(int(longest / mission.period_s) + 2, _ROWS) if record else 0
    if mission.runs * rows > MAX_STEPS:
        raise ValueError(
            f"{counted(mission.runs, 'run')} of {rows} steps are more than {MAX_STEPS:,}: "
            "record=False keeps the numbers of each run alone"
        )
    values = {
        **core_scenario(mission),
        "freedom": mission.degrees_of_freedom,
        "dtype": mission.dtype,
        "seed": mission.seed,
        "rows": rows,
    }

    def part(first: int, count: int) -> dict[str, npt.NDArray[Any]]:
        return _core.fly_missions({**values, "first_run": first, "runs": count})

    def finished(columns: dict[str, npt.NDArray[Any]]) -> MissionResult:
        kept = {name: column for name, column in columns.items() if column.ndim == 1}
        known = np.isfinite(columns["cross_m"]).any(axis=0)
        last = int(np.flatnonzero(known)[-1]) + 1 if known.any() else 0
        kept.update({n: column[:, :last] for n, column in columns.items() if column.ndim > 1})
        return MissionResult(**kept, mission=mission)

    try:
        columns = montecarlo.run(
            part,
            runs=mission.runs,
            first=first,
            chunk=montecarlo.chunk_for(mission.runs, max(rows, 1000), workers),
            workers=workers,
            progress=progress,
        )
    except montecarlo.Interrupted as stop:
        if stop.partial is not None:
            stop.partial = finished(stop.partial)
        raise
    return finished(columns)


def track_points(mission: Mission) -> Floats:
    """Give points of the track that a mission is to fly, for a figure.

    Parameters
    ----------
    mission : Mission
        Arcs of a lawnmower of waypoints are drawn as corners.

    Returns
    -------
    ndarray, shape (n, 2)
        North and east, m; about 1 m apart where the track bends.
    """
    as_instance("mission", mission, Mission)
    if mission.track == "circle":
        x, y, radius = CIRCLE
        turn = np.linspace(0, 2 * np.pi, 250)
        return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)])
    if mission.path == "waypoints":
        return LAWNMOWER.copy()
    plan = _core.mission_curve_plan(mission.path)
    path: DubinsPath | SplinePath
    if mission.path == "dubins":
        path = DubinsPath(plan, radius_m=mission.arc_m)
    else:
        path = SplinePath(plan)
    x, y = plan[0, :2]
    points = [(x, y)]
    for _ in range(_MOST_POINTS):
        if path.finished:
            break
        at = path.locate(x, y)
        sine, cosine = np.sin(at.direction_rad), np.cos(at.direction_rad)
        x, y = x + at.cross_m * sine, y - at.cross_m * cosine  # on the path
        points.append((x, y))
        x, y = x + cosine, y + sine
    return np.array(points)


def core_scenario(mission: Mission) -> dict[str, Any]:
    """Give a mission as the core takes it."""
    kernel = Unit() if mission.kernel is None else as_kernel(mission.kernel)
    return {
        **{name: getattr(mission, name) for name in _DEFAULTS},
        "track": mission.track,
        "path": mission.path,
        "estimate": mission.estimate,
        "guidance": mission.guidance,
        "interval": core_interval(mission.interval, "float64"),
        "kernel": core_kernel(kernel, "float64"),
        "rejections": 0 if mission.recovery is None else mission.recovery.rejections,
    }


def settings(mission: Mission) -> dict[str, Any]:
    """Give a mission as plain values, for files and JSON."""
    values = {field.name: getattr(mission, field.name) for field in fields(mission)}
    for name in ("interval", "kernel", "recovery"):
        value = values[name]
        if value is not None:
            values[name] = {"class": type(value).__name__, **asdict(value)}
    return values


# ---- The rows of the closed-loop table -----------------------------------------------------------

#: What guidance runs on, by the name of the row (``cpp/simulation/mission_scenario.hpp``).
SOURCES: tuple[str, ...] = tuple(_core.mission_sources())
_INTERVALS = {kind.__name__: kind for kind in IntervalPolicy.__args__}


def source(name: str, track: TrackKind, *, interval_s: float = 0.5, **options: Any) -> Mission:
    """Give the mission of a row of the closed-loop table.

    Parameters
    ----------
    name : str
        One of :data:`SOURCES`.
    track : {"lawnmower", "circle"}
        Where it is flown.
    interval_s : float
        Time between fixes, where it is fixed.
    **options
        Anything else of :class:`Mission`.

    Raises
    ------
    ValueError
        If there is no such row.
    """
    as_kind("name", name, SOURCES)
    as_kind("track", track, TRACKS)
    values = _core.mission_source(name, track, interval_s)
    kind, params = values["interval"]
    values["interval"] = _INTERVALS[kind](**params)
    robust = values.pop("kernel")
    values.update(kernel="igg" if robust else None, recovery=RejectionStreak() if robust else None)
    return Mission(**{**values, **options})
