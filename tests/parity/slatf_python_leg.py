"""A record of a filter that localises and tracks, in Python: through its class, as a user would."""

from __future__ import annotations

from typing import Any

import numpy as np

from auvest.slat import SlatFilter
from firmware.parity.slatf import Record, symmetric
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
    slat = record.filter(lanes)
    for master in record.world.masters[: record.told]:
        slat.add_master(master["x"], symmetric(master["P"], 6))
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
