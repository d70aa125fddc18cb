"""Records of a vehicle in Python: through the public classes, as a user would.

Python has no class of its own for guidance and control, but flies the missions that the records
come from: estimate, current, commands and NIS of every step. The filter's mean and covariance come
from its own class, and the hulls' states from theirs.
"""

from __future__ import annotations

import numpy as np

from auvest import RangeBearing, RejectionStreak, RobustEkf, SpeedHeadingCurrent, vehicle
from auvest._core import Status
from auvest.simulation import mission
from auvest.simulation.vehicle_in_the_loop import chip_mission, new_pilot
from firmware.parity.vehicle import (
    PERIOD_S,
    HullRecord,
    MissionRecord,
    PilotRecord,
    RovRecord,
)
from tests.parity.python_leg import bits

#: What `fly` gives of a trace's row.
FLOWN = np.dtype([("x", "<u4", 4), ("nis", "<u4"), ("command", "<u4", 3)])
#: What `filter_beside` gives.
FILTERED = np.dtype([("x", "<u4", 4), ("P", "<u4", 10), ("nis", "<u4")])


def fly(record: MissionRecord) -> np.ndarray:
    """Fly the mission of a record, dtype FLOWN."""
    result = mission.simulate(
        mission.Mission(
            track=record.track,
            guidance=record.law,
            kernel=record.kernel,
            recovery=_recovery(record),
            arc_m=record.arc_m,
            speed_m_s=record.speed_m_s,
            circle_s=record.seconds,
            most_s=record.seconds,
            usbl_outliers=record.outliers,
            seed=record.seed,
            dtype="float32",
            runs=1,
        )
    )
    steps = len(record.rows)
    assert np.isfinite(result.cross_m[0, :steps]).all()
    rows = np.zeros(steps, FLOWN)
    rows["x"][:, :2] = bits(result.estimate_m[0, :steps].astype(np.float32))
    rows["x"][:, 2:] = bits(result.estimate_current_m_s[0, :steps].astype(np.float32))
    rows["nis"] = bits(result.nis[0, :steps].astype(np.float32))
    rows["command"] = bits(result.command[0, :steps].astype(np.float32))
    return rows


def filter_beside(record: MissionRecord, headings: np.ndarray) -> np.ndarray:
    """Run the filter alone over the readings of a mission with these headings, dtype FILTERED."""
    sensor = RangeBearing(station=(0.0, 0.0), sigma_range_m=0.3, sigma_bearing_rad=np.radians(1))
    filter_ = RobustEkf(
        [*record.start_m, 0.0, 0.0],
        np.diag([1, 1, 0.09, 0.09]).astype(np.float32),
        process=SpeedHeadingCurrent(),
        kernel=record.kernel,
        recovery=_recovery(record),
        dtype="float32",
    )
    rows = np.zeros(len(record.rows), FILTERED)
    for k, (told, heading, row) in enumerate(zip(record.rows, headings, rows, strict=True)):
        if k > 0:
            filter_.predict(PERIOD_S, [*told["log"], heading])
        row["nis"] = bits(np.float32(np.nan))
        if not np.isnan(told["fix"][0]):
            filter_.update(told["fix"], sensor)
            row["nis"] = bits(filter_.report.nis)
        row["x"], row["P"] = bits(filter_.x), bits(filter_.P[np.tril_indices(4)])
    return rows


def _recovery(record: MissionRecord) -> RejectionStreak | None:
    return RejectionStreak(rejections=record.rejections) if record.rejections else None


#: Fields of a trace that `pilot_through` gives.
PILOTED = ("x", "P", "nis", "heading", "cross", "command", "predicted", "corrected", "steered")
PILOTED += ("mode", "leg", "asks", "implausible")


def pilot_through(record: PilotRecord) -> np.ndarray:
    """Let the pilot hear a record, dtype of its trace."""
    pilot = new_pilot(chip_mission(), mission.LAWNMOWER[:4])
    pilot.start(*record.mission.start_m, 0.0)
    rows = np.zeros(len(record.rows), record.trace)
    for told, row in zip(record.rows, rows, strict=True):
        row["predicted"] = int(pilot.predict(told["values"], int(told["heard"]), PERIOD_S))
        row["asks"] = pilot.wants_fix()
        if row["asks"]:
            pilot.asked()
        row["nis"] = bits(np.float32(np.nan))
        if not np.isnan(told["age"]):
            status, nis = pilot.update(*told["fix"], told["age"])
            row["corrected"] = int(status)
            if status == Status.ok:
                row["nis"] = bits(np.float32(nis))
        status, *command = pilot.steer()
        row["steered"], row["mode"] = int(status), int(pilot.mode)
        row["x"], row["P"] = bits(pilot.x), bits(pilot.P[np.tril_indices(4)])
        row["command"] = bits(np.array(command, np.float32))
        row["heading"] = bits(np.float32(pilot.heading_rad))
        row["cross"] = bits(np.float32(pilot.cross_track_m))
        row["leg"], row["implausible"] = pilot.leg, pilot.implausible
    return rows


def move(record: HullRecord) -> np.ndarray:
    """Give the bits of the states of a hull after each command."""
    hull = vehicle.Hull("remus100", degrees_of_freedom=record.freedom, dtype="float32")
    axes = list(range(6)) if record.freedom == 6 else [0, 1, 5]
    n = len(axes)
    pose, velocity = np.zeros(6, np.float32), np.zeros(6, np.float32)
    pose[axes], velocity[axes] = record.start[:n], record.start[n : 2 * n]
    run = hull.run(
        record.rows,
        record.h,
        pose=pose,
        velocity=velocity,
        actuators=record.start[2 * n :],
        current=record.current_m_s,
        method=record.method,
    )
    return _states(run, axes)


def move_rov(record: RovRecord, commands: np.ndarray) -> np.ndarray:
    """Give the bits of the states of the ROV after each of these commands."""
    start = np.zeros(6, np.float32)
    start[:3] = [-v for v in record.current_m_s]  # at rest over ground, heading north
    run = vehicle.Hull("bluerov2_heavy", dtype="float32").run(
        commands, PERIOD_S, velocity=start, current=record.current_m_s
    )
    return _states(run, list(range(6)))


def _states(run: vehicle.HullRun, axes: list[int]) -> np.ndarray:
    parts = run.pose[1:, axes], run.velocity[1:, axes], run.actuators[1:]
    assert all(part.dtype == np.float32 for part in parts)
    return bits(np.hstack(parts))
