"""A record of SLATF in Python: through the public class, as a user would."""

from __future__ import annotations

import numpy as np

from auvest import CompassMotion, PiecewiseAcceleration, Slatf, Sonar
from firmware.parity.slatf import Record
from tests.parity.python_leg import bits

#: What the public class shows of a trace's row, floats as their bits.
FIELDS = (
    "slave_x",
    "slave_P",
    "master_x",
    "master_P",
    "effective_size",
    "log_likelihood",
    "resamplings",
)


def replay_in_python(record: Record, lanes: str) -> tuple[np.ndarray, np.ndarray]:
    """Run a record through `Slatf`.

    Parameters
    ----------
    record : Record
    lanes : str
        The instruction set in whose lanes the particles run.

    Returns
    -------
    trace : ndarray, dtype record.trace, shape (echoes,)
        With the fields of `FIELDS` filled in.
    poses : ndarray of uint32, shape (echoes, particles, 2)
        Bits of the particles' poses.
    """
    world = record.world
    slatf = Slatf(
        world.slave["x"],
        _symmetric(world.slave["P"], 2),
        version=1 if record.kind == "slatf1" else 2,
        particles=record.particles,
        motion=CompassMotion(
            sigma_speed_m_s=record.sigma_speed_m_s,
            sigma_heading_rad=record.sigma_heading_rad,
            compensate_bias=record.compensate_bias,
        ),
        master=PiecewiseAcceleration(acceleration_m_s2=record.acceleration_m_s2),
        sonar=Sonar(sigma_range_m=record.sigma_range_m, sigma_bearing_rad=record.sigma_bearing_rad),
        resample_below=record.resample_below,
        gate=record.gate,
        lanes=lanes,
        dtype="float32",
        seed=record.seed,
    )
    slatf.add_master(world.master["x"], _symmetric(world.master["P"], 6))
    rows, poses = [], []
    for reading in world.readings:
        slatf.predict(float(reading["dt"]), reading["u"], changes=reading["change"][None])
        if not reading["heard"]:
            continue
        slatf.update(reading["z"][None])
        row = np.zeros((), record.trace)
        master_x, master_P = slatf.master(0)
        row["slave_x"], row["slave_P"] = bits(slatf.x), bits(slatf.P[np.tril_indices(2)])
        row["master_x"], row["master_P"] = bits(master_x), bits(master_P[np.tril_indices(6)])
        row["effective_size"] = bits(slatf.effective_size)
        row["log_likelihood"] = bits(slatf.log_likelihood)
        row["resamplings"] = slatf.resamplings
        rows.append(row)
        poses.append(bits(slatf.poses))
    return np.array(rows), np.array(poses)


def _symmetric(lower: np.ndarray, n: int) -> np.ndarray:
    matrix = np.zeros((n, n), np.float32)
    matrix[np.tril_indices(n)] = lower
    return matrix + np.tril(matrix, -1).T
