"""Results of scenarios that nobody simulated: their figures can be computed by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from auvest.simulation import cooperative, slat, tracking


def tracking_result(error: Any, **columns: Any) -> tracking.TrackingResult:
    """A result with these errors (runs, steps, 2) about a truth of zeros, a sample every 0.5 s."""
    e = np.asarray(error, dtype=float)
    runs, steps, _ = e.shape
    blank, none = np.full((runs, steps), np.nan), np.zeros(runs)
    x = np.zeros((runs, steps, 6))
    x[..., :2] = e
    values: dict[str, Any] = {
        "time_s": np.tile(0.5 * np.arange(1, steps + 1), (runs, 1)),
        "interval_s": blank,
        "truth": np.zeros((runs, steps, 2)),
        "z": np.full((runs, steps, 2), np.nan),
        "x": x,
        "position_covariance": np.zeros((runs, steps, 2, 2)),
        "nis": blank,
        "tau": blank,
        "mahalanobis_squared": blank,
        "samples": np.full(runs, steps),
        "status": np.zeros(runs, np.uint8),
        "probe_square_sum": none,
        "probe_above": none,
        "probe_count": none,
    }
    return tracking.TrackingResult(
        **{**values, **columns}, scenario=tracking.Scenario(runs=runs, steps=steps)
    )


def cooperative_result(error: Any, **columns: Any) -> cooperative.Result:
    """A result with these errors (runs, steps, 2) and a claimed sigma of 1 m along each axis."""
    e = np.asarray(error, dtype=float)
    runs, steps, _ = e.shape
    none = np.zeros(runs, int)
    values: dict[str, Any] = {
        "error": e,
        "covariance": np.broadcast_to(np.eye(2), (runs, steps, 2, 2)),
        "nis": np.full((runs, steps), np.nan),
        "weight": np.full((runs, steps), np.nan),
        "samples": np.full(runs, steps),
        "recoveries": none,
        "taken": none,
        "too_late": none,
        "lost": none,
        "overflowed": none,
        "status": np.zeros(runs, np.uint8),
    }
    return cooperative.Result(
        **{**values, **columns}, scenario=cooperative.Scenario(runs=runs, steps=steps)
    )


def slat_result(error: Any, **columns: Any) -> slat.SlatResult:
    """A result with these errors (runs, pings, 2) and a claimed sigma of 1 m along each axis."""
    e = np.asarray(error, dtype=float)
    runs, pings, _ = e.shape
    blank, none = np.zeros((runs, pings)), np.zeros(runs, int)
    values: dict[str, Any] = {
        "time_s": 2.0 * np.arange(1, pings + 1),
        "truth": np.zeros((pings, 2)),
        "masters": np.zeros((pings, 1, 2)),
        "error": e,
        "covariance": np.broadcast_to(np.eye(2), (runs, pings, 2, 2)),
        "master_error": np.zeros((runs, pings, 1, 2)),
        "effective_size": blank,
        "nis": blank,
        "resamplings": none,
        "heard": none,
        "refused": none,
        "rebirths": none,
        "log_likelihood": np.zeros(runs),
        "status": np.zeros(runs, np.uint8),
    }
    scenario = slat.SlatScenario(runs=runs, duration_s=2.0 * pings)
    return slat.SlatResult(**{**values, **columns}, scenario=scenario)
