"""Figs 2 to 6 of the SLATF paper, drawn from our measurements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvest import plots
from auvest.plots import SLAT_COLOURS
from auvest.reproduce.estimate import Floats
from auvest.reproduce.slatf.measure import (
    DEAF,
    FIG3_LEVELS,
    FIG4_LEVELS,
    FIG5_LEVELS,
    FIG6_LEVELS,
    Reproduction,
    tables,
)
from auvest.simulation.paper_slatf import FILTERS, LEVELS, FilterName, Level

_MARKERS: Mapping[FilterName, str] = dict(zip(FILTERS, "os^DPv", strict=True))


def _tracks(result: Reproduction) -> Figure:
    columns = tables(result)["fig02"]
    figure, axes = plots.new_axes((6.6, 4.4), "Fig. 2: true tracks")
    for name, colour in (("slave", plots.BLUE), ("master", plots.VERMILION)):
        x, y = columns[f"{name}_x_m"], columns[f"{name}_y_m"]
        axes.plot(x, y, color=colour, linewidth=1.8, label=name)
        axes.plot(x[0], y[0], "o", color=colour, markersize=5)
    plots.style(axes, xlabel="x / m", ylabel="y / m", aspect="equal")
    plots.legend_below(figure, axes, columns=2)
    return figure


def _table1(result: Reproduction) -> Figure:
    """Draw our RMSE at the levels of Table 1 with two standard errors, and what it prints."""
    columns = tables(result)["table1"]
    figure, axes = plots.new_axes(
        (6.6, 4.6), f"Table 1: RMSE, {result.runs} runs, and the paper's values"
    )
    for i, (name, text) in enumerate(FILTERS.items()):
        place = columns["level"] + 0.11 * (i - (len(FILTERS) - 1) / 2)
        axes.errorbar(
            place,
            columns[f"{name}_rmse_m"],
            2 * columns[f"{name}_rmse_se_m"],
            fmt=_MARKERS[name],
            color=SLAT_COLOURS[name],
            markersize=5,
            capsize=2,
            label=text,
        )
        printed = columns.get(f"{name}_paper_rmse_m")
        if printed is not None:
            _mark_paper(axes, place, printed, name)
    axes.plot([], [], "_", color=plots.BLACK, markersize=14, markeredgewidth=2, label="the paper's")
    levels = [LEVELS[int(n) - 1] for n in columns["level"]]
    axes.set_xticks(columns["level"], _named(levels))
    plots.style(
        axes,
        xlabel="noise level; range, bearing in rad",
        ylabel="RMSE, ± 2 standard errors / m",
        ylim=(0, None),
    )
    plots.legend_below(figure, axes, columns=3)
    return figure


def _mark_paper(axes: Axes, places: Floats, values: Floats, name: FilterName) -> None:
    """Mark what the paper prints of a filter."""
    axes.plot(
        places, values, "_", color=SLAT_COLOURS[name], markersize=14, markeredgewidth=2, zorder=4
    )


def _named(levels: Iterable[Level]) -> list[str]:
    return [f"{one.number}\n{one.sigma_range_m:g} m, {one.sigma_bearing_rad:g}" for one in levels]


def _over_levels(
    result: Reproduction,
    *,
    stem: str,
    numbers: tuple[int, ...],
    upper: tuple[str, str],
    lower: tuple[str, str],
    title: str,
) -> Figure:
    """Draw two quantities, (column, label) each, over the noise levels."""
    columns = tables(result)[stem]
    figure = plots.new_figure((6.6, 5.6), title)
    top, bottom = figure.subplots(2, 1, sharex=True)
    places = range(len(numbers))
    levels = [LEVELS[n - 1] for n in numbers]
    for axes, (column, label) in ((top, upper), (bottom, lower)):
        for name, text in FILTERS.items():
            axes.plot(
                places,
                columns[f"{name}_{column}"],
                marker=_MARKERS[name],
                color=SLAT_COLOURS[name],
                label=text,
            )
            if column == "rmse_m":
                printed = [(one.paper or {}).get(name, np.nan) for one in levels]
                _mark_paper(axes, np.arange(float(len(numbers))), np.array(printed), name)
        plots.style(axes, ylabel=label, ylim=(0, None))
    bottom.set_xticks(list(places), _named(levels))
    bottom.set_xlabel("noise level; range, bearing in rad")
    plots.legend_below(figure, top, columns=3)
    return figure


def _over_time(result: Reproduction, *, stem: str, numbers: tuple[int, ...], title: str) -> Figure:
    columns = tables(result)[stem]
    time_s = columns["time_s"]
    figure, axes = plots.new_axes((6.6, 4.8), title)
    for name, text in FILTERS.items():
        curves = [("", ":", text)]
        if name not in DEAF:
            lines = zip(numbers, ("--", "-"), strict=True)
            curves = [(f"level{n}_", line, f"{text}, level {n}") for n, line in lines]
        for level, line, label in curves:
            error = columns[f"{name}_{level}rms_error_m"]
            axes.plot(time_s, error, line, color=SLAT_COLOURS[name], linewidth=1.5, label=label)
    ylabel = "position error, rms over the runs / m"
    plots.style(axes, xlabel="time / s", ylabel=ylabel, ylim=(0, None))
    plots.legend_below(figure, axes, columns=2)
    return figure


#: What is drawn, by the stem of the file.
FIGURES: Mapping[str, Callable[[Reproduction], Figure]] = {
    "table1": _table1,
    "fig02": _tracks,
    "fig03": partial(
        _over_levels,
        stem="fig03",
        numbers=FIG3_LEVELS,
        upper=("mean_error_m", "mean error / m"),
        lower=("error_variance_m2", "variance of the error / m²"),
        title="Fig. 3: mean and variance of the error",
    ),
    "fig04": partial(
        _over_time, stem="fig04", numbers=FIG4_LEVELS, title="Fig. 4: error, levels 1 and 3"
    ),
    "fig05": partial(
        _over_time, stem="fig05", numbers=FIG5_LEVELS, title="Fig. 5: error, levels 2 and 4"
    ),
    "fig06": partial(
        _over_levels,
        stem="fig06",
        numbers=FIG6_LEVELS,
        upper=("rmse_m", "RMSE / m"),
        lower=("mean_error_m", "mean error / m"),
        title="Fig. 6: precise sonar, noise falling to the right; dashes: Table 1 of the paper",
    ),
}
