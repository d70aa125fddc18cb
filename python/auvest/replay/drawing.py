"""What the page of a replay draws, as compact columns: tracks, measurements, sources, and looks."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import plots
from auvest._arguments import Floats
from auvest.metrics import chi2_bounds
from auvest.registry import filter_named
from auvest.replay import tables
from auvest.replay.health import numbers_of
from auvest.replay.run import Result
from auvest.replay.tables import Columns

#: Columns whose numbers are large beside their differences: a float counts from the first.
_POSITIONS = ("x_m", "y_m", "place_x_m", "place_y_m")
_ESTIMATES = ("x_m", "y_m", "var_x_m2", "cov_xy_m2", "var_y_m2")
_ERRORS = ("error_x_m", "error_y_m", "sigma_x_m", "sigma_y_m")
#: The numbers that each sensor measures, and their units.
_MEASURED = {
    "range": (("range", "m"),),
    "fix": (("range", "m"), ("bearing", "rad"), ("elevation", "rad")),
    "position": (("x", "m"), ("y", "m"), ("depth", "m")),
    "velocity": (("speed", "m/s"), ("sideways speed", "m/s")),
    "depth": (("depth", "m"),),
    "echo": (("range", "m"), ("bearing", "rad")),
}


def document(results: Sequence[Result]) -> dict[str, Any]:
    """Give all that the page draws of replays of one log."""
    first = results[0]
    limit = _common_limit(results)
    times = [one.numbers[name] for one in results for name in ("first_s", "last_s")]
    known = [time for time in times if np.isfinite(time)] or [0.0]
    return {
        "from_s": min(known),
        "to_s": max(*known, min(known) + 1e-3),  # a window of some width even of one estimate
        "outcomes": list(tables.OUTCOMES),
        "sensors": [
            {
                "name": name,
                "measured": [{"what": what, "unit": unit} for what, unit in _MEASURED[name]],
                "sources": name not in ("velocity", "depth"),
            }
            for name in tables.SENSORS
        ],
        "nis_95": limit,
        "looks": {
            "beacon": {"colour": plots.BLACK},
            "leader": {"colour": plots.GREY, "dashes": [8, 4], "width": 1},
        },
        "tracks": [track for one in results for track in _tracks(one, shares=limit is None)],
        "lines": _lines(first),
        "beacons": [
            {"source": number, "x_m": float(x), "y_m": float(y)}
            for number, (x, y) in zip(first.source_numbers, first.sources, strict=True)
        ],
        "leaders": _leaders(first),
    }


def _tracks(result: Result, *, shares: bool) -> list[dict[str, Any]]:
    """Give the filter's track, and behind it the smoothed one if there is one."""
    name = result.filter_name
    estimates, errors = result.estimates.columns(), result.errors.columns()
    title = filter_named(name).title
    made: list[dict[str, Any]] = [
        {
            "key": name,
            "label": title,
            "colour": plots.FILTER_COLOURS[name],
            "dashes": list(plots.FILTER_DASHES[name]),
            "estimates": _part(estimates, _ESTIMATES),
            "errors": _part(errors, _ERRORS) if len(errors["time_s"]) else None,
            "measurements": _measurements(result.measurements.columns(), shares=shares),
            "untrusted": [list(seconds) for seconds in result.health.untrusted_s],
            "doubted": _measurements(result.outliers.columns(), shares=shares),
        }
    ]
    if "smoothed_x_m" in estimates:
        made.append(
            {
                "key": f"{name}-smoothed",
                "label": f"{title}, smoothed",
                "colour": plots.ORANGE,
                "dashes": [10, 2, 2, 2],
                "estimates": _part(estimates, _ESTIMATES, "smoothed_"),
                "errors": _part(errors, _ERRORS, "smoothed_") if len(errors["time_s"]) else None,
            }
        )
    return made


def _lines(result: Result) -> list[dict[str, Any]]:
    """Give truth and dead reckoning, which no filter has made."""
    made = []
    truth, estimates = result.errors.columns(), result.estimates.columns()
    if len(truth["time_s"]):
        points = {"time_s": truth["time_s"], "x_m": truth["true_x_m"], "y_m": truth["true_y_m"]}
        made.append(
            {"key": "truth", "label": "truth", "colour": plots.BLACK, "width": 2.4, "dashes": [],
             "points": _encoded(points)}
        )  # fmt: skip
    if np.isfinite(estimates["dead_reckoned_x_m"]).any():
        points = {
            "time_s": estimates["time_s"],
            "x_m": estimates["dead_reckoned_x_m"],
            "y_m": estimates["dead_reckoned_y_m"],
        }
        made.append(
            {"key": "dead-reckoning", "label": "dead reckoning", "colour": plots.GREY,
             "width": 1.2, "dashes": [2, 2], "points": _encoded(points)}
        )  # fmt: skip
    return made


def _leaders(result: Result) -> list[dict[str, Any]]:
    """Give the sources that move, where they were when they were measured."""
    rows = result.measurements.columns()
    order = np.argsort(rows["time_s"], kind="stable")
    made = []
    for number in np.unique(rows["source"]).astype(int).tolist():
        mine = order[(rows["source"][order] == number) & np.isfinite(rows["place_x_m"][order])]
        if number in result.source_numbers or not len(mine):
            continue
        points = {
            "time_s": rows["time_s"][mine],
            "x_m": rows["place_x_m"][mine],
            "y_m": rows["place_y_m"][mine],
        }
        made.append({"source": number, "points": _encoded(points)})
    return made


def _limits(rows: Columns) -> Floats:
    """Give what 95 % of the NIS of a consistent filter lie below, of each measurement."""
    numbers = numbers_of(rows)
    limits = np.zeros(len(numbers))
    for number in np.unique(numbers).tolist():
        limits[numbers == number] = chi2_bounds(number, level=0.9)[1]  # one-sided
    return limits


def _common_limit(results: Sequence[Result]) -> float | None:
    """Give that limit if all measurements have the same."""
    seen = set()
    for one in results:
        rows = one.measurements.columns()
        seen |= set(_limits(rows)[~np.isnan(rows["nis"])].tolist())
    return seen.pop() if len(seen) == 1 else None


def _measurements(rows: Columns, *, shares: bool) -> dict[str, Any]:
    """Give measurements in their order; ``shares``: the NIS that is drawn is that over its limit.

    Sensors and outcomes are numbers there.
    """
    order = np.argsort(rows["time_s"], kind="stable")
    sorted_ = {name: values[order] for name, values in rows.items()}
    names = (
        "time_s", "x_m", "y_m", "place_x_m", "place_y_m", "range_m", "interval_s", "nis",
        "innovation_0", "innovation_1", "innovation_2", "sigma_0", "sigma_1", "sigma_2",
        "held_out_error_m",
    )  # fmt: skip
    weights = np.fmin(np.fmin(sorted_["weight_0"], sorted_["weight_1"]), sorted_["weight_2"])
    return _encoded(
        {
            **{name: sorted_[name] for name in names},
            "weight": weights,
            "nis_drawn": sorted_["nis"] / _limits(sorted_) if shares else sorted_["nis"],
            "source": sorted_["source"].astype(np.int32),
            "sensor": _numbered(sorted_["sensor"], tables.SENSORS),
            "outcome": _numbered(sorted_["outcome"], tables.OUTCOMES),
            "near_field": (sorted_["near_field"] != 0).astype(np.uint8),
        }
    )


def _numbered(values: npt.NDArray[Any], names: Sequence[str]) -> npt.NDArray[np.uint8]:
    numbers = np.zeros(len(values), np.uint8)
    for number, name in enumerate(names):
        numbers[values == name] = number
    return numbers


def _part(rows: Columns, names: Sequence[str], prefix: str = "") -> dict[str, Any]:
    return _encoded({"time_s": rows["time_s"], **{name: rows[f"{prefix}{name}"] for name in names}})


def _encoded(columns: Columns) -> dict[str, Any]:
    return {name: encoded(name, values) for name, values in columns.items()}


def encoded(name: str, values: npt.NDArray[Any]) -> dict[str, Any]:
    """Write a column as base64 of its little-endian numbers: times as doubles, others as floats."""
    offset = 0.0
    if name == "time_s":
        kind = "f8"
    elif values.dtype.kind == "f":
        known = values[np.isfinite(values)] if name in _POSITIONS else values[:0]
        offset = float(known[0]) if len(known) else 0.0
        kind, values = "f4", values - offset
    else:
        kind = values.dtype.str[1:]
    raw = np.ascontiguousarray(values, f"<{kind}").tobytes()
    return {"kind": kind, "offset": offset, "bytes": base64.b64encode(raw).decode("ascii")}
