"""What a replay produces, as columns: estimates, measurements and, with a truth, errors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Columns: TypeAlias = Mapping[str, npt.NDArray[Any]]

ACCEPTED, DOWNWEIGHTED, REJECTED = "accepted", "downweighted", "rejected"
HELD_OUT = "held out"
BEFORE_START, AFTER_END, NO_POSITION, TOO_SHORT = UNUSED = (
    "before start",
    "after end",
    "no position",
    "too short",
)
#: By the number of auvest.Decision.
DECISIONS = np.array([ACCEPTED, DOWNWEIGHTED, REJECTED])
#: What can become of a measurement, in the order of reports.
OUTCOMES = (ACCEPTED, DOWNWEIGHTED, REJECTED, HELD_OUT, *UNUSED)
#: What measured: a range, range and bearing (and elevation), a position, a velocity, a depth, range
#: and bearing of a master.
SENSORS = ("range", "fix", "position", "velocity", "depth", "echo")
RANGE, FIX, POSITION, VELOCITY, DEPTH, ECHO = range(len(SENSORS))

#: What is known of a pose. The heading of a craft that is tracked is its course.
POSE = (
    "x_m", "y_m", "heading_rad", "var_x_m2", "cov_xy_m2", "var_y_m2", "sigma_heading_rad",
)  # fmt: skip
ESTIMATES = ("time_s", *POSE, "dead_reckoned_x_m", "dead_reckoned_y_m")
#: Innovation and weight per number measured; near_field: the innovation is a position error.
MEASUREMENTS = (
    "time_s", "source", "outcome", "innovation_0", "innovation_1", "sigma_0", "sigma_1",
    "near_field", "nis", "weight_0", "weight_1", "recovered", "held_out_error_m", "sensor",
    "innovation_2", "sigma_2", "weight_2",
)  # fmt: skip
#: What pages show of a measurement beside its table: the estimate at its time, where its source
#: was, the range, and the time since the one before that was compared with a prediction.
SHOWN = ("x_m", "y_m", "place_x_m", "place_y_m", "range_m", "interval_s")
#: A row per step and master, of filters that track some; the errors are NaN without a truth. The
#: relative one is that of the master's place as seen from the slave's.
MASTERS = (
    "time_s", "source", "x_m", "y_m", "vx_m_s", "vy_m_s", "var_x_m2", "cov_xy_m2", "var_y_m2",
    "error_x_m", "error_y_m", "relative_error_m",
)  # fmt: skip
#: What is beside the estimates of a filter in space.
SPATIAL = ("depth_m", "var_depth_m2")
#: What is beside the estimates of a filter with several components, and by the number of
#: auvest.Convergence.
MIXTURE = ("convergence", "mixture_size")
NOT_CONVERGED, AMBIGUOUS, SETTLING, SETTLED = "not converged", "ambiguous", "settling", "settled"
CONVERGENCES = np.array([NOT_CONVERGED, AMBIGUOUS, SETTLING, SETTLED])
ERRORS = (
    "time_s", "true_x_m", "true_y_m", "error_x_m", "error_y_m", "sigma_x_m", "sigma_y_m",
    "dead_reckoned_error_m",
)  # fmt: skip
#: What is beside these of a replay that is smoothed.
SMOOTHED = tuple(f"smoothed_{name}" for name in POSE)
SMOOTHED_ERRORS = tuple(
    f"smoothed_{name}" for name in ("error_x_m", "error_y_m", "sigma_x_m", "sigma_y_m")
)


@dataclass(frozen=True)
class Batch:
    """What a stretch of the log gave; each a mapping of the names above to columns.

    ``ranges_m`` are the ranges of the measurements as the log has them, ``located`` says of those
    that were used as ranges whether the belief behind each told where on its circle the craft is.
    ``places`` are x and y of the sources of the measurements, NaN where not known.
    ``track`` is what :mod:`auvest.replay.smoothing` needs of it; ``masters`` has ``MASTERS`` where
    the filter tracks some.
    """

    estimates: Columns
    measurements: Columns
    errors: Columns
    ranges_m: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    located: npt.NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, bool))
    places: npt.NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    track: Any = None
    masters: Columns | None = None


def moved(batch: Batch, origin: tuple[float, float]) -> Batch:
    """Give a batch in coordinates that do not count from a local origin (m)."""
    columns = {"x_m": 0, "y_m": 1, "dead_reckoned_x_m": 0, "dead_reckoned_y_m": 1,
               "smoothed_x_m": 0, "smoothed_y_m": 1, "true_x_m": 0, "true_y_m": 1}  # fmt: skip

    def shift(table: Columns) -> Columns:
        return {
            name: values + origin[columns[name]] if name in columns else values
            for name, values in table.items()
        }

    return replace(
        batch,
        estimates=shift(batch.estimates),
        errors=shift(batch.errors),
        masters=None if batch.masters is None else shift(batch.masters),
        places=batch.places + origin,
    )


def pose(
    states: npt.NDArray[Any],
    covariance: npt.NDArray[Any],
    heading: npt.NDArray[Any],
    sigma_heading: npt.NDArray[Any],
) -> dict[str, npt.NDArray[Any]]:
    """Give the columns of poses whose first two states are the position."""
    return {
        "x_m": states[:, 0],
        "y_m": states[:, 1],
        "heading_rad": heading,
        "var_x_m2": covariance[:, 0, 0],
        "cov_xy_m2": covariance[:, 0, 1],
        "var_y_m2": covariance[:, 1, 1],
        "sigma_heading_rad": sigma_heading,
    }


def settled_s(estimates: Columns) -> float:
    """Time of the first estimate that is settled; infinity if none is."""
    if "convergence" not in estimates:
        return math.inf
    settled = np.flatnonzero(estimates["convergence"] == SETTLED)
    return float(estimates["time_s"][settled[0]]) if len(settled) else math.inf


def blank_measurements(rows: int) -> dict[str, npt.NDArray[Any]]:
    """Make columns for so many measurements, nothing known of them yet."""
    columns: dict[str, npt.NDArray[Any]] = {name: np.full(rows, np.nan) for name in MEASUREMENTS}
    columns["source"] = np.zeros(rows, np.int64)
    columns["outcome"] = np.full(rows, "", dtype="U12")
    columns["sensor"] = np.full(rows, SENSORS[RANGE], dtype="U8")
    columns["near_field"] = np.zeros(rows, bool)
    columns["recovered"] = np.zeros(rows, bool)
    return columns
