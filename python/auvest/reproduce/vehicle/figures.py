"""Pictures of ``auvest reproduce vehicle``."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from matplotlib.figure import Figure

from auvest import plots
from auvest.reproduce.vehicle.measure import Reproduction
from auvest.simulation import mission

_SHOWN = {
    "truth_crab": plots.BLACK,
    "ukf": plots.VERMILION,
    "model_aided_crab": plots.BLUE,
}


def closed_loop(result: Reproduction) -> Figure:
    """Draw the settled cross-track error of every row, with the prototype's as marks."""
    figure = plots.new_figure((8.4, 5.2), "Settled cross-track error, mean over the runs")
    panels = figure.subplots(1, 2, sharey=True)
    for panel, track in zip(panels, mission.TRACKS, strict=True):
        rows = [row for row in result.rows if row.track == track]
        places = np.arange(len(rows))[::-1]
        panel.barh(
            places,
            [row.settled.value for row in rows],
            xerr=[row.settled.standard_error for row in rows],
            color=plots.SKY,
            height=0.6,
            label="ours, with its standard error",
        )
        for place, row in zip(places, rows, strict=True):
            if row.reference is not None:
                value, error = row.reference["settled"]
                panel.errorbar(value, place, xerr=error, fmt="|", color=plots.BLACK, markersize=12)
        panel.set_xlabel("m")
        panel.set_title(track, loc="left")
        labels = [
            row.source.replace("_", " ")
            + ("" if row.interval_s == 0.5 else f", {row.interval_s:g} s")
            for row in rows
        ]
        panel.set_yticks(places, labels, fontsize=8)
        plots.style(panel)
    panels[0].plot([], [], "|", color=plots.BLACK, markersize=12, label="prototype")
    plots.legend_below(figure, panels[0], columns=2)
    return figure


def tracks(result: Reproduction) -> Figure:
    """Draw one run of three sources: the track, and the error across it."""
    figure = plots.new_figure((8.4, 4.4), "One run, and its error across the track")
    plane, cross = figure.subplots(1, 2, width_ratios=(1.0, 1.4))
    corners = mission.LAWNMOWER
    plane.plot(
        corners[:, 1], corners[:, 0], color=plots.GREY, linewidth=4, alpha=0.4, label="track"
    )
    for source, colour in _SHOWN.items():
        flown = mission.simulate(mission.source(source, "lawnmower", runs=1, seed=result.seed))
        label = source.replace("_", " ")
        pose = flown.pose[0]
        plane.plot(pose[:, 1], pose[:, 0], color=colour, linewidth=0.9, label=label)
        cross.plot(flown.time_s, flown.cross_m[0], color=colour, linewidth=0.9)
    plane.set(xlabel="east / m", ylabel="north / m")
    plane.set_aspect("equal", adjustable="datalim")
    cross.set(xlabel="time / s", ylabel="error across the active leg / m", ylim=(-4, 4))
    for panel in (plane, cross):
        plots.style(panel)
    plots.legend_below(figure, plane, columns=4)
    return figure


FIGURES: Mapping[str, Callable[[Reproduction], Figure]] = {
    "closed_loop": closed_loop,
    "tracks": tracks,
}
