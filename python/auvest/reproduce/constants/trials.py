"""Simulated trials in which one instrument is off by a constant, as the files of a log.

A craft surveys among four beacons for a quarter of an hour: velocities of a log, a gyro or a
compass, a range every two seconds. One range in twenty comes by a detour.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from auvest.logs import LogFolder
from auvest.logs.write import write_file
from auvest.replay import Settings, settings_from
from auvest.reproduce.mistakes.trials import survey

SIGMA_RANGE_M, DETOURS = 0.5, 0.05
#: White noise of each reading of the log (m/s), the gyro (rad/s) and the compass (rad).
SIGMA_SPEED_M_S, SIGMA_TURN_RAD_S, SIGMA_COMPASS_RAD = 0.1, 0.005, 0.01
BEACONS = np.array([-40 + 130j, 180 + 90j, 150 - 130j, -120 - 60j])


@dataclass(frozen=True)
class Error:
    """What is off, and by how much.

    Attributes
    ----------
    name : str
        The constant, as [constants] has it.
    size : float
        What is to be found.
    prior : float
        What the settings say of it.
    """

    name: str
    size: float
    prior: float


#: Ranges 7 % too long, a speed that reads a tenth too little, a gyro 0.01 rad/s off, a compass 5°.
ERRORS = (
    Error("range_scale", 0.07, 0.05),
    Error("speed_factor", 0.1, 0.1),
    Error("turn_offset_rad_s", 0.01, 0.01),
    Error("compass_offset_rad", float(np.radians(5.0)), 0.1),
)


def write(folder: Path, name: str, size: float, seed: int) -> LogFolder:
    """Write the log of a trial in which the constant has this size."""
    random = np.random.default_rng(seed)
    track = survey(random)
    time = track.time_s
    noise = random.normal(size=(3, len(time)))
    speed = track.speed + SIGMA_SPEED_M_S * noise[0]
    turn_rate = track.turn_rate + SIGMA_TURN_RAD_S * noise[1]
    at = np.arange(2.0, time[-1], 2.0)
    source = random.integers(0, len(BEACONS), len(at))
    middle = 0.5 * (track.place.real.min() + track.place.real.max()) + 0.5j * (
        track.place.imag.min() + track.place.imag.max()
    )
    beacons = middle + BEACONS
    ranges = np.abs(track.at(at) - beacons[source])
    if name == "range_scale":
        ranges *= 1 + size
    if name == "speed_factor":
        speed /= 1 + size
    if name == "turn_offset_rad_s":
        turn_rate -= size
    ranges += random.normal(0, SIGMA_RANGE_M, len(at))
    ranges += random.uniform(5, 40, len(at)) * (random.random(len(at)) < DETOURS)
    start = {"time_s": time[:1], "x_m": track.place.real[:1], "y_m": track.place.imag[:1]}
    if name == "compass_offset_rad":
        heading = track.heading - size + SIGMA_COMPASS_RAD * noise[2]
        write_file(folder, "odometry.csv", time_s=time, speed_m_s=speed)
        write_file(folder, "compass.csv", time_s=time, heading_rad=_wrapped(heading))
    else:
        write_file(folder, "odometry.csv", time_s=time, speed_m_s=speed, yaw_rate_rad_s=turn_rate)
        start["heading_rad"] = _wrapped(track.heading[:1])
    write_file(folder, "start.csv", **start)
    write_file(folder, "ranges.csv", time_s=at, source=source, range_m=np.maximum(ranges, 0.1))
    write_file(folder, "beacons.csv", source=np.arange(len(beacons)), x_m=beacons.real,
               y_m=beacons.imag)  # fmt: skip
    write_file(folder, "truth.csv", time_s=time, x_m=track.place.real, y_m=track.place.imag)
    return LogFolder(folder)


def settings(constants: dict[str, float]) -> Settings:
    """Give the settings that fit the trials, with these constants."""
    return settings_from(
        {
            "start": {"sigma_position_m": 0.5, "sigma_heading_rad": 0.02},
            "odometry": {"sigma_distance": 0.0, "sigma_drift": 0.07, "sigma_turn": 0.004},
            "ranges": {"sigma_m": SIGMA_RANGE_M},
            "constants": constants,
        }
    )


def _wrapped(angle: np.ndarray) -> np.ndarray:
    return np.angle(np.exp(1j * angle))
