"""What the filter tests share: tracks seen from a station, and comparisons to the last bit."""

from __future__ import annotations

import numpy as np

import auvest

STATION = (0.2, 2.0)
FILTERS = (auvest.Ekf, auvest.Ukf, auvest.Aukf)
#: The models of the AUKF's paper, which is all that the AUKF has as a default.
PAPER = {"process": auvest.ConstantAcceleration(), "sensors": auvest.RangeBearing()}
DTYPES = ("float32", "float64")


def measure(truth, station=STATION, sigma=(0.05, 0.01), seed=1):
    """Noisy ranges (m) and bearings (rad) of the positions ``truth`` (T, 2)."""
    rng = np.random.default_rng(seed)
    d = np.asarray(truth) - station
    z = np.stack([np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0])], axis=1)
    z += rng.standard_normal(z.shape) * sigma
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    return z


def straight(steps, start=(3.0, -1.0), velocity=(0.1, 0.2), dt=0.5):
    """Positions (T, 2) at dt, 2 dt, ... of a straight course."""
    return np.asarray(start) + dt * np.arange(1, steps + 1)[:, None] * np.asarray(velocity)


def make(kind, dtype="float64", **options):
    """A filter that starts 4 m from the station."""
    x0 = [3.0, -1.0, 0.1, 0.2, 0.0, 0.0]
    p0 = np.diag([0.04, 0.04, 0.01, 0.01, 1e-4, 1e-4])
    p0[0, 2] = p0[2, 0] = 0.005
    return kind(x0, p0, dtype=dtype, **{**PAPER, **options})


def same_bits(a, b):
    """True if two arrays have the same type, shape and bits (so NaN equals NaN)."""
    a, b = np.asarray(a), np.asarray(b)
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def everything(f):
    """All that can be read from a filter, as bytes."""
    names = ["x", "P", "innovation", "S", "nis", "near_field"]
    if isinstance(f, auvest.Aukf):
        names.append("interval")
        if isinstance(f.policy, auvest.MahalanobisInterval):
            names += ["tau", "ratio", "mahalanobis_squared"]
    return {name: np.asarray(getattr(f, name)).tobytes() for name in names}


def require_sound(result):
    """No NaN in the estimates; every P symmetric to the bit and positive definite."""
    assert np.isfinite(result.x).all()
    p = result.P
    assert (p == np.swapaxes(p, 1, 2)).all()
    # float64 eigenvalues of float32 matrices are right to 1e-16 of the largest.
    assert np.linalg.eigvalsh(p.astype(np.float64)).min() > 0
