"""A record of a filter that localises and tracks, in Python: through its class, as a user would."""

from __future__ import annotations

from typing import Any

import numpy as np

from auvest import EkfSlat, Slatf, SlatfJoint
from auvest.slat import SlatFilter
from firmware.parity.slatf import Record
from tests.parity.python_leg import bits


def replay_in_python(record: Record, lanes: str) -> tuple[np.ndarray, np.ndarray]:
    """Run a record through its filter, reading by reading.

    Parameters
    ----------
    record : Record
    lanes : str
        The instruction set in whose lanes the particles of a `Slatf` run.

    Returns
    -------
    trace : ndarray, dtype record.trace
        What the class shows of it: all but the particles.
    poses : ndarray of uint32, shape (rows, particles, pose)
        Bits of the particles' poses.
    """
    slat = _filter(record, lanes)
    for master in record.world.masters[: record.told]:
        slat.add_master(master["x"], _symmetric(master["P"], 6))
    rows, poses = [], []
    for step in record.world.steps:
        changes = step.changes[None] if record.planned else None
        heard: dict[str, Any] = {}
        if len(step.echoes):
            heard = {"z": step.echoes["z"], "z_time_s": step.echoes["after_s"]}
            heard["master"] = step.echoes["master"]
        slat.run([0.0, float(step.dt)], step.u[None], changes=changes, **heard)
        if len(step.echoes):
            rows.append(_row(slat, record))
            poses.append(bits(slat.poses) if record.particles else ())
    return np.array(rows), np.array(poses)


def _filter(record: Record, lanes: str) -> SlatFilter:
    slave = record.world.slave
    start = slave["x"], _symmetric(slave["P"], record.motion.pose_states)
    models: dict[str, Any] = {"motion": record.motion, "sonar": record.sonar, "gate": record.gate}
    models |= {"master": record.master, "dtype": "float32", "recover_after": 0}
    if record.kind.startswith("ekf"):
        return EkfSlat(*start, **models)
    particles = {"particles": record.particles, "seed": record.seed}
    particles |= {"resample_below": record.resample_below}
    if record.kind == "slatf-shared":
        del models["recover_after"]
        shared = {"covariance": "shared", "kept": record.kept, "max_masters": record.room}
        return SlatfJoint(*start, **models, **particles, **shared)
    if record.kind.startswith("slatf-joint"):
        return SlatfJoint(*start, **models, **particles, kept=record.kept, max_masters=record.room)
    return Slatf(
        *start,
        **models,
        **particles,
        version=1 if record.kind.startswith("slatf1") else 2,
        carry_covariance=record.carry_covariance,
        birth_velocity_m_s=record.birth_velocity_m_s,
        birth_acceleration_m_s2=record.birth_acceleration_m_s2,
        monte_carlo=False,
        lanes=lanes,
    )


def _row(slat: SlatFilter, record: Record) -> np.ndarray:
    row = np.zeros((), record.trace)
    pose = record.motion.pose_states
    row["slave_x"], row["slave_P"] = bits(slat.x), bits(slat.P[np.tril_indices(pose)])
    for n in range(slat.masters):
        x, P = slat.master(n)
        master = row["masters"][n]
        master["x"], master["P"] = bits(x), bits(P[np.tril_indices(6)])
        if "modes" in master.dtype.names:
            master["modes"] = bits(slat.mode_probabilities(n))
    for name in ("effective_size", "log_likelihood", "nis"):
        if name in row.dtype.names:
            row[name] = bits(getattr(slat, name))
    if record.particles:
        row["resamplings"] = slat.resamplings
    return row


def _symmetric(lower: np.ndarray, n: int) -> np.ndarray:
    matrix = np.zeros((n, n), np.float32)
    matrix[np.tril_indices(n)] = lower
    return matrix + np.tril(matrix, -1).T
