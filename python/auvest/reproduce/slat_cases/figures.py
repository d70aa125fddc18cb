"""The pictures of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from auvest import plots
from auvest.reproduce.slat_cases.measure import CROSSING_FILTERS, MEET_S, PAPER_MASTER, Cases


def _crossing_figure(cases: Cases) -> Figure:
    curves = cases.curves
    colours = {"told": plots.GREY, **plots.SLAT_COLOURS}
    sonar = cases.results["crossing"][0]
    figure = plots.new_figure(
        (8.4, 4.6),
        f"Two masters that cross, {sonar['sigma_range_m']:g} m and "
        f"{sonar['sigma_bearing_rad']:g} rad",
    )
    one_run, share = figure.subplots(1, 2)
    time_s = curves["crossing_time_s"]
    course = PAPER_MASTER.heading_rad
    abeam = np.array([-math.sin(course), math.cos(course)])
    middle = curves["crossing_masters"].mean(axis=1)
    for master, style in enumerate(("-", "--")):
        truth = (curves["crossing_masters"][:, master] - middle) @ abeam
        one_run.plot(time_s, truth, style, color=plots.BLACK, label=f"master {master}, truth")
        for name in ("ekf_slat", "slatf_joint"):
            across = (curves[f"crossing_{name}"][:, master] - middle) @ abeam
            label = f"master {master}, {CROSSING_FILTERS[name]}"
            one_run.plot(time_s, across, style, color=colours[name], linewidth=1.1, label=label)
    one_run.axvline(MEET_S, color=plots.BLACK, linewidth=0.6)
    plots.style(one_run, legend=7, xlabel="time / s", ylabel="one run: place across the course / m")
    for name, title in CROSSING_FILTERS.items():
        percent = 100 * curves[f"crossing_swapped_{name}"]
        share.plot(time_s, percent, color=colours[name], label=title)
    share.axvline(MEET_S, color=plots.BLACK, linewidth=0.6)
    ylabel = "runs with the masters swapped / %"
    plots.style(share, legend=7, xlabel="time / s", ylabel=ylabel, ylim=(0, 100))
    return figure


def _turning_figure(cases: Cases) -> Figure:
    colours = {
        "constant acceleration": plots.BLUE,
        "constant velocity": plots.GREEN,
        "IMM": plots.VERMILION,
    }
    figure = plots.new_figure((8.4, 4.6), "A master that turns, EKF-SLAT: relative error")
    panels = figure.subplots(1, 2)
    for axes, case, label in zip(panels, cases.results["turning"], ("False", "True"), strict=True):
        for row in case["models"]:
            if row["compared"]:
                error = cases.curves[f"turning_{label}_{row['model']}"]
                title = f"{row['model']}, {row['noise']}"
                axes.plot(
                    cases.curves["turning_time_s"], error, color=colours[row["model"]], label=title
                )
        axes.axvline(PAPER_MASTER.turn_start_s, color=plots.BLACK, linewidth=0.6)
        plots.style(
            axes,
            title=f"odometry {case['sigma_speed_m_s']:g} m/s, {case['sigma_heading_rad']:g} rad",
            legend=8,
            xlabel="time / s",
            ylabel="rms error over the runs / m",
            ylim=(0, None),
        )
    return figure


FIGURES: Mapping[str, Callable[[Cases], Figure]] = {
    "crossing": _crossing_figure,
    "turning": _turning_figure,
}
