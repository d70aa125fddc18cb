"""SLATF and EKF-SLAT with an IMM master on real robots: ``auvest reproduce mrclam6``.

The recording is the sixth of the UTIAS multi-robot data set (Leung, Halpern, Barfoot, Liu 2011):
five robots with odometry see each other by range and bearing; a motion-capture system has the
truth. The slave is the robot that sees, the master the one that is seen. The recording is not part
of this package.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auvest import (
    ConstantAcceleration,
    ConstantVelocity,
    CoordinatedTurn,
    DeadReckoning,
    EkfSlat,
    Imm,
    Slatf,
    Sonar,
    UnicycleMotion,
)
from auvest._arguments import Floats
from auvest.importers.robots import DURATION_S, GAP_S, TRUTH_GAP_S  # noqa: F401 (the page names it)
from auvest.importers.sets import robots_of_mrclam6
from auvest.replay.readings import Held
from auvest.replay.slat import first_seen
from auvest.reproduce.ticks import Ticks
from auvest.slat import OverconfidenceWarning

DEFAULT_RUNS = 24
DEFAULT_SEED = 1
PARTICLES = 100

FILES = ("groundtruth.csv", "odometry.csv", "sightings.csv")

#: Between sightings the readings are taken in equal steps of about this length.
STEP_S = 0.1

#: Calibration of the odometry: speed and yaw rate (m/s, rad/s) are factor * reading + offset.
CALIBRATION = ((0.93, 0.0), (0.92, -0.002))
#: Odometry noise densities, m/s and rad/s per sqrt(Hz).
SPEED_DENSITY = 0.02
YAW_RATE_DENSITY = 0.033
#: Windows in which the drift of dead reckoning is measured.
DRIFT_S = 10.0

MOTION = UnicycleMotion(
    sigma_speed_m_s=SPEED_DENSITY / STEP_S**0.5,
    sigma_yaw_rate_rad_s=YAW_RATE_DENSITY / STEP_S**0.5,
)
SONAR = Sonar(sigma_range_m=0.12, sigma_bearing_rad=0.02, bearing="from_heading")
GATE = 16.0
STRAIGHT = ConstantVelocity(velocity_psd=1e-3, sigma_acceleration_m_s2=0.03)
MASTER = Imm(
    straight=STRAIGHT,
    accelerated=ConstantAcceleration(position_psd=0, velocity_psd=0, acceleration_psd=1e-4),
    turning=CoordinatedTurn(position_psd=0, velocity_psd=0, acceleration_psd=1e-5, slow_m_s=0.02),
    share=(0.6, 0.2, 0.2),
    switch_rate_hz=0.1,
)
ONE_MODEL = Imm(straight=STRAIGHT, share=(1, 0, 0), switch_rate_hz=0)
#: Standard deviations of what is not known of a master when it is first seen.
BIRTH_VELOCITY_M_S = 0.05
BIRTH_ACCELERATION_M_S2 = 0.03

NAMES = {
    "dead_reckoning": "dead reckoning",
    "ekf_slat_one_model": "EKF-SLAT, constant velocity alone",
    "ekf_slat": "EKF-SLAT with IMM",
    "slatf2": "SLATF 2.0 with IMM",
}
#: What is asked of the filters with an IMM.
TARGET_RATIO = 1.05
TARGET_RELATIVE_M = 0.36


@dataclass(frozen=True)
class Track:
    """One robot seen by another; T steps.

    Attributes
    ----------
    slave, master : int
        Numbers of the robots.
    time_s : ndarray, shape (T + 1,)
    u : ndarray, shape (T, 2)
        Calibrated speed (m/s) and yaw rate (rad/s) of the slave, means over each step.
    z_time_s, z : ndarray, shapes (K,) and (K, 2)
        Sightings after the first: range (m) and bearing from the slave's heading (rad).
    first : ndarray, shape (2,)
        The first sighting, at ``time_s[0]``.
    slave_truth : ndarray, shape (T + 1, 3)
        Position (m) and heading (rad).
    master_truth : ndarray, shape (T + 1, 2)
    """

    slave: int
    master: int
    time_s: Floats
    u: Floats
    z_time_s: Floats
    z: Floats
    first: Floats
    slave_truth: Floats
    master_truth: Floats


@dataclass(frozen=True)
class Path2D:
    """What a filter made of a track: positions after each step, m, shape (T, 2)."""

    slave: Floats
    master: Floats


def check(*, data: Path, **_: object) -> None:
    """Refuse a folder without the recording."""
    for name in FILES:
        file = data / "mrclam6" / name
        if not file.is_file():
            raise ValueError(f"--data {data}: {file} is missing")


class Recording:
    """The files of the recording.

    Parameters
    ----------
    folder : path
        Holds ``mrclam6/groundtruth.csv`` and so on.

    Raises
    ------
    ValueError
        If a file is missing; the message names it.
    """

    def __init__(self, folder: Path) -> None:
        check(data=folder)
        self._robots = robots_of_mrclam6(folder / "mrclam6")

    def tracks(self, gap_s: float = GAP_S, duration_s: float = DURATION_S) -> list[Track]:
        """Cut the sightings into tracks, where both robots' truth is known."""
        cut = self._robots.tracks(gap_s, duration_s)
        return [self._track(slave, master, echoes) for slave, master, echoes in cut]

    def drift(self) -> tuple[float, float]:
        """Measure the drift of calibrated dead reckoning over all robots.

        Returns
        -------
        (float, float)
            Standard deviation along the first heading (m) and of the heading (rad) after
            ``DRIFT_S``, both over the square root of that time.
        """
        errors = []
        for robot, truth in self._robots.truth.items():
            begin_s = self._robots.odometry[robot][0, 0]
            starts = np.arange(begin_s, truth[-1, 0] - DRIFT_S, DRIFT_S)
            for start in starts:
                time_s = start + STEP_S * np.arange(round(DRIFT_S / STEP_S) + 1)
                if not self._robots.has_truth(robot, time_s).all():
                    continue
                poses = self._robots.pose(robot, time_s[[0, -1]])
                end = DeadReckoning(poses[0], np.zeros((3, 3)), motion=MOTION)
                end.run(time_s, self._readings(robot, time_s))
                gap = end.x - poses[1]
                along = gap[0] * np.cos(poses[0, 2]) + gap[1] * np.sin(poses[0, 2])
                errors.append((along, _wrap(gap[2])))
        along, heading = np.std(errors, axis=0) / DRIFT_S**0.5
        return float(along), float(heading)

    def _track(self, slave: int, master: int, echoes: Floats) -> Track:
        edges = [echoes[:1, 0]]
        for begin, end in zip(echoes[:-1, 0], echoes[1:, 0], strict=True):
            steps = max(1, round((end - begin) / STEP_S))
            edges.append(np.linspace(begin, end, steps + 1)[1:])
        time_s = np.concatenate(edges)
        return Track(
            slave=slave,
            master=master,
            time_s=time_s,
            u=self._readings(slave, time_s),
            z_time_s=echoes[1:, 0],
            z=echoes[1:, 1:],
            first=echoes[0, 1:],
            slave_truth=self._robots.pose(slave, time_s),
            master_truth=self._robots.pose(master, time_s)[:, :2],
        )

    def _readings(self, robot: int, time_s: Floats) -> Floats:
        """Means over each interval of commands that hold until the next."""
        rows = self._robots.odometry[robot]
        commands = Held(2)
        commands.add(rows[:, 0], rows[:, 1:])
        factors, offsets = zip(*CALIBRATION, strict=True)
        return commands.means(time_s, factors) + offsets


def follow(track: Track, name: str, *, seed: int = DEFAULT_SEED) -> Path2D:
    """Run the filter of that name (``NAMES``) over a track, from the slave's true first pose."""
    start, none = track.slave_truth[0], np.zeros((3, 3))
    if name == "dead_reckoning":
        run = DeadReckoning(start, none, motion=MOTION).run(track.time_s, track.u)
        return Path2D(slave=run.x[:, :2], master=np.full((len(run), 2), np.nan))
    # Without recovery: what these models do by themselves.
    common: dict[str, Any] = {"motion": MOTION, "sonar": SONAR, "gate": GATE, "recover_after": 0}
    filter_: EkfSlat | Slatf
    if name == "slatf2":
        filter_ = Slatf(
            start, none, version=2, particles=PARTICLES, master=MASTER, seed=seed, **common
        )
    else:
        filter_ = EkfSlat(start, none, master=MASTER if name == "ekf_slat" else ONE_MODEL, **common)
    filter_.add_master(*first_master(track))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverconfidenceWarning)  # only means are compared
        run = filter_.run(track.time_s, track.u, z=track.z, z_time_s=track.z_time_s)
    return Path2D(slave=run.x[:, :2], master=run.masters_x[:, 0, :2])


def first_master(track: Track) -> tuple[Floats, Floats]:
    """Give the belief (6,), (6, 6) of the master when it is first seen."""
    return first_seen(
        track.slave_truth[0],
        np.zeros((3, 3)),
        track.first,
        SONAR,
        velocity_m_s=BIRTH_VELOCITY_M_S,
        acceleration_m_s2=BIRTH_ACCELERATION_M_S2,
    )


@dataclass(frozen=True)
class Figures:
    """RMSE of one run of a filter over all tracks, m.

    ``slave_m``: of the slave's position; ``relative_m``: of the master's position relative to the
    slave's; over all steps of all tracks. ``*_tracks_m``: the mean of the RMSE of each track.
    """

    slave_m: float
    relative_m: float
    slave_tracks_m: float
    relative_tracks_m: float


def compare(tracks: list[Track], paths: list[Path2D]) -> Figures:
    """Compare paths with the truth."""
    slave, relative = [], []
    for track, path in zip(tracks, paths, strict=True):
        true_slave, true_master = track.slave_truth[1:, :2], track.master_truth[1:]
        slave.append(((path.slave - true_slave) ** 2).sum(axis=1))
        gap = (path.master - path.slave) - (true_master - true_slave)
        relative.append((gap**2).sum(axis=1))
    pooled = [float(np.sqrt(np.concatenate(squares).mean())) for squares in (slave, relative)]
    each = [float(np.mean([np.sqrt(s.mean()) for s in squares])) for squares in (slave, relative)]
    return Figures(pooled[0], pooled[1], each[0], each[1])


@dataclass(frozen=True)
class Reproduction:
    """Everything measured: all runs' figures and, for the picture, the paths of the first."""

    seed: int
    tracks: list[Track]
    figures: dict[str, list[Figures]]
    paths: dict[str, list[Path2D]]
    drift: tuple[float, float]


def measure(
    *,
    data: Path,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Follow all tracks with all filters.

    Parameters
    ----------
    data : Path
        Where the recording is.
    runs : int
        Runs of SLATF 2.0 over all tracks; the other filters draw no random numbers.
    seed : int
        Seed of the first run; the next ones have the next numbers.
    progress : callable, optional
        ``progress(done, total)`` in tracks.
    """
    recording = Recording(data)
    tracks = recording.tracks()
    work = [(name, run) for name in NAMES for run in range(runs if name == "slatf2" else 1)]
    tick = Ticks(len(work) * len(tracks), progress)
    figures: dict[str, list[Figures]] = {}
    paths: dict[str, list[Path2D]] = {}
    for name, run in work:
        found = []
        for track in tracks:
            found.append(follow(track, name, seed=seed + run))
            tick()
        figures.setdefault(name, []).append(compare(tracks, found))
        paths.setdefault(name, found)
    return Reproduction(seed, tracks, figures, paths, recording.drift())


def summary(result: Reproduction) -> dict[str, Any]:
    """Return the results as one JSON object."""
    tracks, figures = result.tracks, result.figures
    reckoning = figures["dead_reckoning"][0]
    rows: list[dict[str, Any]] = []
    for name, runs in figures.items():
        ratios = [run.slave_m / reckoning.slave_m for run in runs]
        relative = [run.relative_m for run in runs]
        rows.append(
            {
                "filter": name,
                "runs": len(runs),
                "slave_rmse_m": float(np.mean([run.slave_m for run in runs])),
                "ratio": float(np.mean(ratios)),
                "ratio_worst": float(np.max(ratios)),
                "relative_rmse_m": float(np.mean(relative)),
                "relative_rmse_worst_m": float(np.max(relative)),
                "runs_within_targets": sum(
                    a <= TARGET_RATIO and b <= TARGET_RELATIVE_M
                    for a, b in zip(ratios, relative, strict=True)
                ),
                "ratio_of_track_means": float(
                    np.mean([run.slave_tracks_m for run in runs]) / reckoning.slave_tracks_m
                ),
                "relative_track_mean_m": float(np.mean([run.relative_tracks_m for run in runs])),
            }
        )
    judged = [row for row in rows if row["filter"] in ("ekf_slat", "slatf2")]
    return {
        "tracks": len(tracks),
        "seconds": float(sum(track.time_s[-1] - track.time_s[0] for track in tracks)),
        "sightings": sum(len(track.z) + 1 for track in tracks),
        "seed": result.seed,
        "particles": PARTICLES,
        "target_ratio": TARGET_RATIO,
        "target_relative_m": TARGET_RELATIVE_M,
        "met": all(
            row["ratio"] <= TARGET_RATIO and row["relative_rmse_m"] <= TARGET_RELATIVE_M
            for row in judged
        ),
        "drift_speed_density": result.drift[0],
        "drift_yaw_rate_density": result.drift[1],
        "filters": rows,
    }


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
