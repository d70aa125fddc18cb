"""The figure of a replay: tracks, and the error or innovations and NIS; the page has it all."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvest import plots
from auvest.metrics import chi2_bounds
from auvest.replay import tables
from auvest.replay.run import Result

Floats = npt.NDArray[np.float64]


def overview(result: Result) -> Figure:
    """Draw tracks, and beside them the error or, without a truth, the innovations."""
    figure = plots.new_figure((11.0, 5.0), _title(result))
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.25))
    _tracks(figure.add_subplot(grid[:, 0]), result)
    upper, lower = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    if len(result.errors.columns()["time_s"]):
        _errors((upper, lower), result)
    else:
        _innovation(upper, result, 0)
        _nis(lower, result)
        lower.set_xlabel("time / s")
    return figure


def _title(result: Result) -> str:
    parts = [f"{result.name}, {result.filter_name}: {result.health.verdict.replace('_', ' ')}"]
    error, reckoned = (result.numbers[name] for name in ("rmse_m", "dead_reckoned_rmse_m"))
    if error is not None:
        parts.append(f"RMSE {error:.3g} m")
    if reckoned is not None:
        parts.append(f"of dead reckoning {reckoned:.3g} m")
    return ", ".join(parts)


def _tracks(axes: Axes, result: Result) -> None:
    estimate, truth = result.estimates.columns(), result.errors.columns()
    if np.isfinite(estimate["dead_reckoned_x_m"]).any():
        reckoned = estimate["dead_reckoned_x_m"], estimate["dead_reckoned_y_m"]
        axes.plot(*reckoned, "-", color=plots.GREY, linewidth=0.9, label="dead reckoning")
    if len(truth["time_s"]):
        axes.plot(truth["true_x_m"], truth["true_y_m"], "-", color=plots.BLACK, label="truth")
    estimated = estimate["x_m"], estimate["y_m"]
    colour = plots.FILTER_COLOURS[result.filter_name]
    axes.plot(*estimated, "-", color=colour, linewidth=1.2, label="estimate")
    if "smoothed_x_m" in estimate:
        smoothed = estimate["smoothed_x_m"], estimate["smoothed_y_m"]
        axes.plot(*smoothed, "--", color=plots.ORANGE, linewidth=1.2, label="smoothed")
    doubted = result.outliers.columns()
    away = doubted["outcome"] == tables.REJECTED
    plots.draw_rejected(axes, np.column_stack([doubted["x_m"], doubted["y_m"]])[away])
    if len(result.sources):
        axes.plot(*result.sources.T, "^", color=plots.BLACK, linestyle="none", label="beacons")
    plots.style_plane(axes)
    _legend(axes)


def _errors(pair: tuple[Axes, Axes], result: Result) -> None:
    rows, colour = result.errors.columns(), plots.FILTER_COLOURS[result.filter_name]
    for axes, name in zip(pair, "xy", strict=True):
        claimed, errors = [], []
        for prefix, own, *looks in plots.ERRORS:
            if f"{prefix}error_{name}_m" in rows:
                error, sigma = rows[f"{prefix}error_{name}_m"], rows[f"{prefix}sigma_{name}_m"]
                plots.draw_band(
                    axes, rows["time_s"], error, sigma, own if prefix else colour, *looks
                )
                claimed.append(3 * sigma)
                errors.append(error)
        plots.focus(axes, np.concatenate(claimed), np.concatenate(errors))
        plots.style(axes, ylabel=f"{name} error / m")
    _legend(pair[0])
    pair[1].set_xlabel("time / s")


def _innovation(axes: Axes, result: Result, m: int) -> None:
    colour = plots.FILTER_COLOURS[result.filter_name]
    rows, doubted = result.measurements.columns(), result.outliers.columns()
    # Near the station the innovation is a position error and has no place among these.
    known = ~np.isnan(rows[f"innovation_{m}"]) & (rows["near_field"] == 0)
    ranged = ~np.isin(rows["sensor"], ("position", "velocity", "depth"))
    known &= ranged if ranged.any() else rows["sensor"] == "position"
    at = np.flatnonzero(known)
    at = at[np.argsort(rows["time_s"][at], kind="stable")]
    value, sigma = rows[f"innovation_{m}"][at], rows[f"sigma_{m}"][at]
    plots.draw_band(axes, rows["time_s"][at], value, sigma, colour, "innovation", ".")
    away = doubted["outcome"] == tables.REJECTED
    if away.any():
        rejected = doubted["time_s"][away], doubted[f"innovation_{m}"][away]
        axes.plot(*rejected, "x", color=colour, markersize=5, label=tables.REJECTED)
    plots.compress(axes, value, 4 * plots.usual(3 * sigma))
    names = ("range / m", "bearing / rad") if ranged.any() else ("x / m", "y / m")
    plots.style(axes, ylabel=names[m])
    _legend(axes)


def _nis(axes: Axes, result: Result) -> None:
    colour = plots.FILTER_COLOURS[result.filter_name]
    rows = result.measurements.columns()
    numbers = 2 if (~np.isnan(rows["innovation_1"])).any() else 1
    high = chi2_bounds(numbers, level=0.9)[1]  # one-sided 95 %
    axes.plot(rows["time_s"], rows["nis"], ".", color=colour, markersize=3, label="NIS")
    axes.axhline(high, color=plots.BLACK, linewidth=0.9, linestyle="--",
                 label=f"95 % below {high:.2f}")  # fmt: skip
    plots.compress(axes, rows["nis"], 2 * high)
    axes.margins(y=0.1)
    plots.style(axes, ylabel="NIS", ylim=(0.0, None))
    _legend(axes)


def _legend(axes: Axes) -> None:
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none", loc="best")
