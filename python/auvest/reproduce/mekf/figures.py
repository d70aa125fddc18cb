"""Figs 5 and 6 of the M-estimation EKF paper, and what it does not show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from auvest import plots
from auvest.plots import FILTER_COLOURS, KERNEL_COLOURS
from auvest.reproduce.mekf.measure import KERNELS, LABELS, Reproduction

#: Steps of the track that Fig 5 shows: there and back twice.
_SHOWN = 2400
#: Ticks of a ratio to what is expected.
_RATIOS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0)


def tracks(result: Reproduction) -> Figure:
    """Draw Fig 5: tracks of slave and leaders, and the errors of one run."""
    over = result.over_time
    shown = slice(0, _SHOWN)
    figure = plots.new_figure((8.4, 5.0), "Fig. 5: tracks, 5 % of the ranges at 10 sigma")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.5))
    fleet = figure.add_subplot(grid[:, 0])
    fleet.plot(*over.slave[shown].T, color=plots.BLACK, label="slave", linewidth=1.2)
    for i, style in enumerate(("--", ":")):
        fleet.plot(*over.leaders[shown, i].T, style, color=plots.GREY, label=f"leader {i + 1}")
    plots.style_plane(fleet)
    hours = np.arange(1, 1 + len(over.slave[shown])) / 3600.0  # steps of 1 s
    panels = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    for panel, axis, which in zip(panels, range(2), "xy", strict=True):
        for name, error in over.errors.items():
            panel.plot(
                hours,
                error[shown, axis],
                color=KERNEL_COLOURS[name],
                label=LABELS[name],
                linewidth=0.9,
            )
        panel.axhline(0.0, color=plots.BLACK, linewidth=0.8, zorder=1)
        plots.style(panel, ylabel=f"{which} error, one run / m")
    panels[0].tick_params(labelbottom=False)
    panels[1].set_xlabel("time / h")
    plots.legend_below(figure, panels[0], columns=4)
    plots.legend_inside(fleet)
    return figure


def error_over_time(result: Reproduction) -> Figure:
    """Draw Fig 6: error over time of both filters, and the improvement."""
    over = result.over_time
    figure = plots.new_figure(
        (8.4, 5.6), f"Fig. 6: position error over time, RMS of {result.runs} runs"
    )
    error, gain = figure.subplots(2, 1, sharex=True)
    for name, rms in over.rms_m.items():
        error.plot(over.time_h, rms, color=KERNEL_COLOURS[name], label=LABELS[name])
    gain.plot(over.time_h, 100 * over.improvement, color=KERNEL_COLOURS["igg"])
    gain.axhline(
        30, color=plots.BLACK, linestyle="--", linewidth=0.9, label="the paper: about 30 %"
    )
    plots.style(error, legend=8, ylabel="RMS error / m", ylim=(0, None))
    plots.style(gain, legend=8, ylabel="improvement / %", xlabel="time / h")
    return figure


def kernels(result: Reproduction) -> Figure:
    """Draw the RMSE of every kernel over the share of outliers, and by timing and world."""
    figure = plots.new_figure((8.4, 4.6), "RMSE of the kernels")
    over, bars = figure.subplots(1, 2, width_ratios=(2, 3))
    for name in KERNELS:
        points = [
            (100 * fraction, row[name].rmse_m, row[name].standard_error_m)
            for (fraction, sigma), row in result.contamination.items()
            if sigma == 10.0
        ]
        x, y, spread = (np.array(values) for values in zip(*points, strict=True))
        over.errorbar(
            x,
            y,
            1.96 * spread,
            color=KERNEL_COLOURS[name],
            label=LABELS[name],
            marker="o",
            markersize=4,
        )
    plots.style(over, xlabel="outliers at 10 sigma / %", ylabel="RMSE / m", ylim=(0, None))
    cases = {**{f"timing {k}": row for k, row in result.timing.items()}, **result.worlds}
    place = np.arange(len(cases))
    for i, name in enumerate(KERNELS):
        heights = [row[name].rmse_m for row in cases.values()]
        bars.barh(
            place + 0.2 * (i - 1.5), heights, 0.18, color=KERNEL_COLOURS[name], label=LABELS[name]
        )
    bars.set_yticks(place, list(cases), fontsize=8)
    bars.invert_yaxis()
    plots.style(bars, xlabel="RMSE / m")
    plots.legend_below(figure, over, columns=len(KERNELS))
    return figure


def consistency(result: Reproduction) -> Figure:
    """Draw means of NEES and NIS over their expectation, with the 95 % bounds."""
    figure = plots.new_figure((8.4, 4.6), "Consistency: right and wrong Q and R")
    factors = list(dict.fromkeys((j.q_factor, j.r_factor) for j in result.consistency))
    filters = list(dict.fromkeys(j.filter for j in result.consistency))
    panels = figure.subplots(1, 2, sharey=True)
    for panel, which in zip(panels, ("nees", "nis"), strict=True):
        for i, name in enumerate(filters):
            rows = [j for j in result.consistency if j.filter == name]
            judged = [getattr(j, which) for j in rows]
            middle = np.array([(c.low + c.high) / 2 for c in judged])
            x = np.arange(len(rows)) + 0.16 * (i - 1.5)
            bound = [(c.high - c.low) / 2 / m for c, m in zip(judged, middle, strict=True)]
            panel.errorbar(x, np.ones(len(rows)), bound, fmt="none", color=plots.GREY, capsize=3)
            panel.plot(
                x,
                [c.mean for c in judged] / middle,
                "o",
                color={**FILTER_COLOURS, **KERNEL_COLOURS}[name],
                markersize=4,
                label=LABELS[name],
            )
        names = [f"Q x {q:g}, R x {r:g}" for q, r in factors]
        panel.set_xticks(np.arange(len(factors)), names, rotation=20, fontsize=8)
        panel.set_yscale("log")
        panel.yaxis.set_major_locator(FixedLocator(_RATIOS))
        panel.yaxis.set_minor_locator(NullLocator())
        panel.yaxis.set_major_formatter("{x:g}")
        panel.set_title(which.upper(), fontsize=10, loc="left")
        plots.style(panel)
    panels[0].set_ylabel("mean / expectation, 95 % bounds in grey")
    plots.legend_below(figure, panels[0], columns=len(filters))
    return figure


#: How each figure is drawn, by file stem.
FIGURES: dict[str, Callable[[Reproduction], Figure]] = {
    "fig05": tracks,
    "fig06": error_over_time,
    "kernels": kernels,
    "consistency": consistency,
}
