"""Figs 2 to 6 of the SLATF paper, drawn from our measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from matplotlib.figure import Figure

from auvest import plots
from auvest.reproduce.slatf.measure import (
    DEAF,
    FIG3_LEVELS,
    FIG4_LEVELS,
    FIG5_LEVELS,
    FIG6_LEVELS,
    Reproduction,
    tables,
)
from auvest.simulation.paper_slatf import FILTERS, LEVELS, FilterName

#: One colour per filter, the same in every figure.
COLOURS: Mapping[FilterName, str] = {
    "dr": plots.BLACK,
    "dr_compensated": plots.GREY,
    "slatf1": plots.VERMILION,
    "slatf2": plots.BLUE,
    "slatf_joint": plots.ORANGE,
    "ekf_slat": plots.GREEN,
}
_MARKERS: Mapping[FilterName, str] = dict(zip(COLOURS, "os^DPv", strict=True))


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
    for axes, (column, label) in ((top, upper), (bottom, lower)):
        for name, text in FILTERS.items():
            axes.plot(
                places,
                columns[f"{name}_{column}"],
                marker=_MARKERS[name],
                color=COLOURS[name],
                label=text,
            )
        plots.style(axes, ylabel=label, ylim=(0, None))
    levels = [LEVELS[n - 1] for n in numbers]
    bottom.set_xticks(
        list(places),
        [f"{one.number}\n{one.sigma_range_m:g} m, {one.sigma_bearing_rad:g}" for one in levels],
    )
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
            axes.plot(time_s, error, line, color=COLOURS[name], linewidth=1.5, label=label)
    ylabel = "position error, rms over the runs / m"
    plots.style(axes, xlabel="time / s", ylabel=ylabel, ylim=(0, None))
    plots.legend_below(figure, axes, columns=2)
    return figure


#: What is drawn, by the stem of the file.
FIGURES: Mapping[str, Callable[[Reproduction], Figure]] = {
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
        title="Fig. 6: precise sonar, noise falling to the right",
    ),
}
