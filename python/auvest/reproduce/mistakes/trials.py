"""Clean simulated trials of three kinds, as the files of a log.

``leaders``: increments of a DVL with a compass, ranges to two vessels that move. ``beacons``:
velocities of a log with a gyro, ranges to three beacons. ``tracking``: fixes of a craft by two
stations. All have lost and grossly wrong measurements, as real ones do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest.replay import Settings, settings_from

Rows: TypeAlias = npt.NDArray[np.floating[Any]]
#: Columns of each file of a log, by name.
Files: TypeAlias = dict[str, dict[str, Rows]]

DURATION_S = 900.0
STEP_S = 0.5
#: Share of measurements that are lost, and that come by a detour.
LOST, DETOURS = 0.1, 0.06
SIGMA_RANGE_M = 0.8
SIGMA_BEARING_RAD = 0.02


@dataclass(frozen=True)
class Kind:
    """A kind of trial: how it is made, and the settings that fit it."""

    make: Callable[[np.random.Generator], Files]
    settings: Settings


@dataclass(frozen=True)
class Track:
    """The true track: times, position, heading, speed and turn rate from each time on."""

    time_s: Rows
    place: npt.NDArray[np.complex128]
    heading: Rows
    speed: Rows
    turn_rate: Rows

    def at(self, time_s: Rows) -> npt.NDArray[np.complex128]:
        """Give the positions at these times."""
        return np.interp(time_s, self.time_s, self.place.real) + 1j * np.interp(
            time_s, self.time_s, self.place.imag
        )


def survey(random: np.random.Generator) -> Track:
    """Make a survey of legs that are joined by half circles, from a place off any axis."""
    time = np.arange(0.0, DURATION_S + STEP_S / 2, STEP_S)
    rate = np.zeros(len(time))
    leg, turn = random.uniform(80, 120), random.uniform(25, 40)
    side = random.choice([-1.0, 1.0])
    for k in range(1, 1 + int(DURATION_S // (leg + turn))):
        begin = k * leg + (k - 1) * turn
        rate[(time >= begin) & (time < begin + turn)] = side * np.pi / turn
        side = -side
    speed = 1.4 + 0.1 * np.sin(time / random.uniform(30, 60))
    start = random.uniform(-np.pi, np.pi)
    heading = start + np.concatenate([[0.0], np.cumsum(rate[:-1] * STEP_S)])
    chord = (
        speed
        * STEP_S
        * np.sinc(rate * STEP_S / 2 / np.pi)
        * np.exp(1j * (heading + rate * STEP_S / 2))
    )
    begin_at = complex(random.uniform(20, 60), random.uniform(-90, -40))
    place = begin_at + np.concatenate([[0.0], np.cumsum(chord[:-1])])
    return Track(time, place, heading, speed, rate)


def _start(track: Track) -> dict[str, Rows]:
    return {
        "time_s": track.time_s[:1],
        "x_m": track.place.real[:1],
        "y_m": track.place.imag[:1],
        "heading_rad": np.angle(np.exp(1j * track.heading[:1])),
    }


def _truth(track: Track) -> dict[str, Rows]:
    return {
        "time_s": track.time_s[::2],
        "x_m": track.place.real[::2],
        "y_m": track.place.imag[::2],
    }


def _around(track: Track, random: np.random.Generator, count: int) -> npt.NDArray[np.complex128]:
    """Places around the track, on all sides of it."""
    middle = 0.5 * complex(
        track.place.real.min() + track.place.real.max(),
        track.place.imag.min() + track.place.imag.max(),
    )
    angle = random.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(count) / count
    angle += random.uniform(-0.3, 0.3, count)
    return middle + random.uniform(120, 220, count) * np.exp(1j * angle)


def _ranges(
    random: np.random.Generator, track: Track, time: Rows, source: Rows,
    places: npt.NDArray[np.complex128],
) -> dict[str, Rows]:  # fmt: skip
    true = np.abs(track.at(time) - places)
    measured = true + random.normal(0, SIGMA_RANGE_M, len(time))
    detour = random.random(len(time)) < DETOURS
    measured[detour] += random.uniform(5, 40, int(detour.sum()))
    heard = random.random(len(time)) >= LOST
    return {
        "time_s": time[heard],
        "source": source[heard],
        "range_m": np.round(np.maximum(measured[heard], 0.1), 2),
    }


def leaders(random: np.random.Generator) -> Files:
    """Make a trial with a DVL and a compass, and two leaders that move."""
    track = survey(random)
    compass = (
        track.heading
        + random.normal(0, np.radians(0.5))
        + random.normal(0, np.radians(0.3), len(track.time_s))
    )
    forward = track.speed * STEP_S * (1 + random.normal(0, 0.003)) + random.normal(
        0, 0.02 * STEP_S, len(track.time_s)
    )
    at = np.arange(0.0, DURATION_S + 1)
    begin = _around(track, random, 2)
    drift = random.uniform(0.05, 0.25, 2) * np.exp(1j * random.uniform(0, 2 * np.pi, 2))
    way = begin + drift * at[:, None] + 8j * np.sin(at[:, None] / np.array([90.0, 70.0]))
    time = np.arange(3.0, DURATION_S - 3, 3.0)
    source = 1.0 + np.arange(len(time)) % 2
    place = np.where(source == 1, *(
        np.interp(time, at, one.real) + 1j * np.interp(time, at, one.imag) for one in way.T
    ))  # fmt: skip
    start = _start(track)
    start["heading_rad"] = np.angle(np.exp(1j * compass[:1]))
    return {
        "odometry.csv": {
            "time_s": track.time_s[1:],
            "forward_m": forward[:-1],
            "left_m": np.zeros(len(forward) - 1),
            "turn_rad": np.diff(compass),
        },
        "ranges.csv": _ranges(random, track, time, source, place),
        "leaders.csv": {
            "time_s": np.repeat(at, 2),
            "source": np.tile([1.0, 2.0], len(at)),
            "x_m": way.real.ravel(),
            "y_m": way.imag.ravel(),
        },
        "start.csv": start,
        "truth.csv": _truth(track),
    }


def beacons(random: np.random.Generator) -> Files:
    """Make a trial with a log and a gyro, and three beacons."""
    track = survey(random)
    count = len(track.time_s)
    places = _around(track, random, 3)
    time = np.arange(2.0, DURATION_S - 3, 2.0)
    source = 1.0 + np.arange(len(time)) % 3
    return {
        "odometry.csv": {
            "time_s": track.time_s,
            "speed_m_s": track.speed * (1 + random.normal(0, 0.005))
            + random.normal(0, 0.03, count),
            "yaw_rate_rad_s": track.turn_rate
            + random.normal(0, 0.0002)
            + random.normal(0, 0.005, count),
        },
        "ranges.csv": _ranges(random, track, time, source, places[source.astype(int) - 1]),
        "beacons.csv": {
            "source": np.array([1.0, 2.0, 3.0]),
            "x_m": places.real,
            "y_m": places.imag,
        },
        "start.csv": _start(track),
        "truth.csv": _truth(track),
    }


def tracking(random: np.random.Generator) -> Files:
    """Make a trial in which two stations track a craft in turn."""
    track = survey(random)
    places = _around(track, random, 2)
    time = np.arange(1.0, DURATION_S - 3, 1.0)
    source = 1.0 + np.arange(len(time)) % 2
    place = places[source.astype(int) - 1]
    bearing = np.angle(track.at(time) - place) + random.normal(0, SIGMA_BEARING_RAD, len(time))
    fixes = _ranges(random, track, time, source, place)
    heard = np.isin(time, fixes["time_s"])
    return {
        "fixes.csv": {**fixes, "bearing_rad": np.angle(np.exp(1j * bearing[heard]))},
        "beacons.csv": {"source": np.array([1.0, 2.0]), "x_m": places.real, "y_m": places.imag},
        "start.csv": _start(track),
        "truth.csv": _truth(track),
    }


KINDS: Mapping[str, Kind] = {
    "leaders": Kind(
        leaders,
        settings_from(
            {
                "start": {"sigma_position_m": 1.0, "sigma_heading_rad": 0.05},
                "odometry": {"sigma_distance": 0.02, "sigma_drift": 0.05, "sigma_turn": 0.002},
                "ranges": {"sigma_m": SIGMA_RANGE_M},
            }
        ),
    ),
    "beacons": Kind(
        beacons,
        settings_from(
            {
                "start": {"sigma_position_m": 1.0, "sigma_heading_rad": 0.05},
                "odometry": {
                    "sigma_distance": 0.02,
                    "sigma_drift": 0.05,
                    "sigma_turn": 0.003,
                    "max_step_s": 0.5,
                },
                "ranges": {"sigma_m": SIGMA_RANGE_M},
            }
        ),
    ),
    "tracking": Kind(
        tracking,
        settings_from(
            {
                "filter": {"kind": "robust-ukf"},
                "start": {"sigma_position_m": 1.0, "sigma_speed_m_s": 1.5},
                "fixes": {"sigma_range_m": SIGMA_RANGE_M, "sigma_bearing_rad": SIGMA_BEARING_RAD},
                "process": {"velocity_psd": 1e-3, "acceleration_psd": 1e-5},
            }
        ),
    ),
}


def write(folder: Path, files: Files) -> None:
    """Write the files of a log, with whatever was done to them: no writer of logs would."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, columns in files.items():
        header = ",".join(columns)
        form = ["%d" if column == "source" else "%.17g" for column in columns]
        rows = np.column_stack(list(columns.values()))
        np.savetxt(folder / name, rows, form, ",", header=header, comments="")
