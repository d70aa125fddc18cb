"""Figures of a replay: tracks, errors, innovations, NIS, weights and held-out measurements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvest import plots
from auvest.metrics import chi2_bounds
from auvest.replay import tables
from auvest.replay.run import Result

Floats = npt.NDArray[np.float64]

_WIDE = (8.6, 3.4)


def figures(result: Result) -> dict[str, Figure]:
    """Draw all figures for which the replay has something to show, by their titles."""
    draw: dict[str, Callable[[Result], Figure]] = {"Tracks": tracks}
    if len(result.errors.columns()["time_s"]):
        draw["Error and three sigma"] = errors
    draw |= {"Innovations and three sigma": innovations, "NIS": nis, "Weights": weights}
    if result.numbers["held_out_rmse_m"] is not None:
        draw["Held-out measurements"] = held_out
    return {title: function(result) for title, function in draw.items()}


def overview(result: Result) -> Figure:
    """Draw tracks, and beside them the error or, without a truth, the innovations."""
    figure = plots.new_figure((11.0, 5.0), f"{result.name}, {result.filter_name}")
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


def tracks(result: Result) -> Figure:
    """Draw estimate, dead reckoning, truth and sources in the plane."""
    figure, axes = plots.new_axes((6.6, 5.6), "Tracks")
    _tracks(axes, result)
    return figure


def errors(result: Result) -> Figure:
    """Draw the error along x and y with the filter's own three sigma."""
    figure = plots.new_figure((8.6, 4.6), "Error and three sigma")
    _errors((figure.add_subplot(2, 1, 1), figure.add_subplot(2, 1, 2)), result)
    return figure


def innovations(result: Result) -> Figure:
    """Draw the innovations with three of their standard deviations."""
    rows = result.measurements.columns()
    numbers = 2 if (~np.isnan(rows["innovation_1"])).any() else 1
    figure = plots.new_figure((8.6, 2.4 * numbers + 1.0), "Innovations and three sigma")
    for m in range(numbers):
        axes = figure.add_subplot(numbers, 1, m + 1)
        _innovation(axes, result, m)
    axes.set_xlabel("time / s")
    return figure


def nis(result: Result) -> Figure:
    """Draw the normalised innovation squared and its 95 % bound."""
    figure, axes = plots.new_axes(_WIDE, "Normalised innovation squared, before any weight")
    _nis(axes, result)
    axes.set_xlabel("time / s")
    return figure


def weights(result: Result) -> Figure:
    """Draw the weights that the kernel gave, and what it rejected."""
    figure, axes = plots.new_axes(_WIDE, "Weights")
    full, doubted = result.measurements.columns(), result.outliers.columns()
    axes.plot(full["time_s"], full["weight_0"], ".", color=plots.BLUE, markersize=3, label="weight")
    down = doubted["outcome"] == tables.DOWNWEIGHTED
    axes.plot(
        doubted["time_s"][down], _least(doubted)[down], ".", color=plots.ORANGE, markersize=5,
        label=tables.DOWNWEIGHTED,
    )  # fmt: skip
    away = doubted["outcome"] == tables.REJECTED
    axes.plot(
        doubted["time_s"][away], np.zeros(int(away.sum())), "x", color=plots.VERMILION,
        markersize=6, label=tables.REJECTED,
    )  # fmt: skip
    plots.style(axes, xlabel="time / s", ylabel="weight", ylim=(-0.05, 1.08))
    _legend(axes)
    return figure


def held_out(result: Result) -> Figure:
    """Draw how far the predictions of measurements that the filter did not get were off."""
    figure, axes = plots.new_axes(_WIDE, "Error of predicting held-out measurements")
    rows = result.measurements.columns()
    axes.plot(rows["time_s"], rows["held_out_error_m"], ".", color=plots.BLUE, markersize=3)
    plots.style(axes, xlabel="time / s", ylabel="error / m")
    return figure


def _tracks(axes: Axes, result: Result) -> None:
    estimate, truth = result.estimates.columns(), result.errors.columns()
    if np.isfinite(estimate["dead_reckoned_x_m"]).any():
        reckoned = estimate["dead_reckoned_x_m"], estimate["dead_reckoned_y_m"]
        axes.plot(*reckoned, "-", color=plots.GREY, linewidth=0.9, label="dead reckoning")
    if len(truth["time_s"]):
        axes.plot(truth["true_x_m"], truth["true_y_m"], "-", color=plots.BLACK, label="truth")
    estimated = estimate["x_m"], estimate["y_m"]
    axes.plot(*estimated, "-", color=plots.BLUE, linewidth=1.2, label="estimate")
    if len(result.sources):
        axes.plot(*result.sources.T, "^", color=plots.GREEN, linestyle="none", label="beacons")
    plots.style_plane(axes)
    _legend(axes)


def _errors(pair: tuple[Axes, Axes], result: Result) -> None:
    rows = result.errors.columns()
    for axes, name in zip(pair, "xy", strict=True):
        bound = 3 * rows[f"sigma_{name}_m"]
        axes.fill_between(
            rows["time_s"], -bound, bound, color=plots.BLUE, alpha=0.18, linewidth=0,
            label="±3 sigma of the filter",
        )  # fmt: skip
        axes.plot(rows["time_s"], rows[f"error_{name}_m"], color=plots.BLUE, linewidth=1.0,
                  label="error")  # fmt: skip
        plots.style(axes, ylabel=f"{name} error / m")
    _legend(pair[0])
    pair[1].set_xlabel("time / s")


def _innovation(axes: Axes, result: Result, m: int) -> None:
    rows, doubted = result.measurements.columns(), result.outliers.columns()
    # Near the station the innovation is a position error and has no place among these.
    known = ~np.isnan(rows[f"innovation_{m}"]) & (rows["near_field"] == 0)
    ranged = ~np.isin(rows["sensor"], ("position", "velocity", "depth"))
    known &= ranged if ranged.any() else rows["sensor"] == "position"
    time, bound = rows["time_s"][known], 3 * rows[f"sigma_{m}"][known]
    value = rows[f"innovation_{m}"][known]
    order = np.argsort(time, kind="stable")
    axes.fill_between(
        time[order], -bound[order], bound[order], color=plots.BLUE, alpha=0.18, linewidth=0,
        label="±3 sigma",
    )  # fmt: skip
    axes.plot(time, value, ".", color=plots.BLUE, markersize=3, label="innovation")
    away = doubted["outcome"] == tables.REJECTED
    if away.any():
        rejected = doubted["time_s"][away], doubted[f"innovation_{m}"][away]
        axes.plot(*rejected, "x", color=plots.VERMILION, markersize=5, label=tables.REJECTED)
    _compress(axes, value, 4 * float(np.quantile(bound, 0.9)) if len(bound) else 1.0)
    names = ("range / m", "bearing / rad") if ranged.any() else ("x / m", "y / m")
    plots.style(axes, ylabel=names[m])
    _legend(axes)


def _nis(axes: Axes, result: Result) -> None:
    rows = result.measurements.columns()
    numbers = 2 if (~np.isnan(rows["innovation_1"])).any() else 1
    high = chi2_bounds(numbers, level=0.9)[1]  # one-sided 95 %
    axes.plot(rows["time_s"], rows["nis"], ".", color=plots.BLUE, markersize=3, label="NIS")
    axes.axhline(high, color=plots.BLACK, linewidth=0.9, linestyle="--",
                 label=f"95 % below {high:.2f}")  # fmt: skip
    _compress(axes, rows["nis"], 2 * high)
    axes.margins(y=0.1)
    plots.style(axes, ylabel="NIS", ylim=(0.0, None))
    _legend(axes)


def _compress(axes: Axes, value: Floats, reach: float) -> None:
    """Make the axis logarithmic beyond ``reach``, so that gross errors do not flatten the rest."""
    if (np.abs(value) > 2 * reach).any():
        axes.set_yscale("symlog", linthresh=reach)


def _least(rows: tables.Columns) -> Floats:
    return np.fmin(rows["weight_0"], rows["weight_1"])


def _legend(axes: Axes) -> None:
    axes.legend(fontsize=8.5, framealpha=0.85, edgecolor="none", loc="best")
