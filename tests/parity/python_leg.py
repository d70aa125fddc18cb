"""The records in Python: through the public classes, as a user would."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from auvest import Aukf, Ekf, FilterError, Status, Ukf
from tests.parity.records import GIVEN_INTERVAL, LOWER, MEASURED, REFERENCED, TRACE, Record


def replay_in_python(record: Record) -> np.ndarray:
    """Run a record through the public classes and give its trace."""
    models = {"process": record.process, "sensors": record.lifted_sensor, "dtype": "float32"}
    models["longest_step_s"] = np.inf
    if record.kind == "ekf":
        estimator = Ekf(record.x0, record.P0, **models)
    elif record.kind == "ukf":
        estimator = Ukf(record.x0, record.P0, **models, **record.points)
    else:
        models["policy"] = record.policy
        estimator = Aukf(record.x0, record.P0, **models, **record.points)
    trace = np.zeros(len(record.steps), TRACE)
    for step, row in zip(record.steps, trace, strict=True):
        _take(estimator, step, row)
        chosen = estimator.interval if record.kind == "aukf" else record.policy.interval_s
        row["interval"] = bits(chosen)
    return trace


def _take(estimator: Ekf | Ukf | Aukf, step: np.void, row: np.void) -> None:
    """Do one step and fill its row but for the interval."""
    dt = float(step["dt"])
    if step["flags"] & GIVEN_INTERVAL:
        row["predict"] = _status(lambda: estimator.predict(dt), dt)
    else:
        row["predict"] = _status(lambda: estimator.predict(), dt)

    z = step["z"] if step["flags"] & MEASURED else None
    row["update"] = _status(lambda: estimator.update(z), step["z"])
    # A refused update leaves the numbers of the last one in Python; the core reports zeros.
    if row["update"] == int(Status.ok):
        row["innovation"] = bits(estimator.innovation)
        row["S"] = bits(estimator.S[np.tril_indices(2)])
        row["nis"] = bits(estimator.nis)
        row["near_field"] = estimator.near_field

    if step["flags"] & REFERENCED:
        row["feedback"] = _status(lambda: estimator.feedback(step["reference"]), step["reference"])
    row["x"] = bits(estimator.x)
    row["P"] = bits(estimator.P[LOWER])


def _status(action: Callable[[], object], argument: object) -> int:
    """Do something with an argument and give the status that the core has or would have reported.

    Wrong arguments never reach the core: the package refuses them with a plain ValueError.
    """
    try:
        action()
    except FilterError as error:
        return int(error.status)
    except ValueError:
        if not np.isfinite(argument).all():
            return int(Status.not_finite)
        if np.ndim(argument) == 0 and argument < 0:
            return int(Status.time_backwards)
        raise
    return int(Status.ok)


def bits(value: object) -> np.ndarray:
    """The bit patterns of float32 values; a Python float must be one exactly."""
    array = np.asarray(value, np.float32)
    assert np.array_equal(array, value, equal_nan=True), f"{value} is not a float32"
    return array.view(np.uint32)
