"""Pictures of a sweep: a heat map over two parameters, and a profile over each."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from auvest import plots
from auvest.sweeps.result import SweepResult, level

#: Panels of one heat map at most; of more the mean is shown.
_MOST_PANELS = 12
#: Cells of a panel whose numbers are written into them, at most.
_MOST_NUMBERS = 100
_MOST_LINES = 60
#: Width of a panel among so many in a row, inches: letters are as large as the text of a page.
_WIDTHS = {1: 4.6, 2: 3.6, 3: 2.5}


def axes_of(result: SweepResult) -> dict[str, list[str]]:
    """Give the parameters with several values, and those as they are written."""
    found = {}
    for axis in result.plan.axes:
        levels = list(dict.fromkeys(level(point, axis) for point in result.plan.points))
        if len(levels) > 1:
            found[axis] = levels
    return found


def heat_map(result: SweepResult) -> Figure:
    """Draw the mean of the measure over the first two parameters, a panel for each of the others.

    Raises
    ------
    ValueError
        If fewer than two parameters have several values.
    """
    axes = axes_of(result)
    if len(axes) < 2:
        raise ValueError("a heat map needs two parameters with several values")
    (down, rows), (across, columns), *others = axes.items()
    names = [name for name, _ in others]
    panels: dict[tuple[str, ...], list[list[list[float]]]] = {}
    mean, _ = result.values(result.measure)
    keys = [tuple(level(point, name) for name in names) for point in result.plan.points]
    if len(set(keys)) > _MOST_PANELS:
        keys, names = [()] * len(keys), []
    for point, key, value in zip(result.plan.points, keys, mean, strict=True):
        cells = panels.setdefault(key, [[[] for _ in columns] for _ in rows])
        cells[rows.index(level(point, down))][columns.index(level(point, across))].append(value)
    count = len(panels)
    wide = min(count, 2 if count <= 4 else 3)
    tall = -(-count // wide)
    figure = plots.new_figure(
        (
            1.6 + _WIDTHS[wide] * wide,
            1.2 + max(1.8, 0.42 * len(rows) + 0.9 + 0.2 * len(names)) * tall,
        ),
        f"{result.measure}, mean over the runs" + ("" if names or not others else " and the rest"),
    )
    grid = figure.subplots(tall, wide, squeeze=False, sharex=True, sharey=True)
    shown = {key: _means(cells) for key, cells in panels.items()}
    low = min((np.nanmin(v) for v in shown.values() if np.isfinite(v).any()), default=0.0)
    high = max((np.nanmax(v) for v in shown.values() if np.isfinite(v).any()), default=1.0)
    for panel, (key, values) in zip(grid.flat, shown.items(), strict=False):
        image = panel.imshow(values, cmap="cividis", vmin=low, vmax=high, aspect="auto")
        panel.set_xticks(range(len(columns)), columns)
        panel.set_yticks(range(len(rows)), rows)
        if values.size <= _MOST_NUMBERS:
            _write_numbers(panel, values, low, high)
        said = "\n".join(f"{name} = {value}" for name, value in zip(names, key, strict=True))
        panel.set_title(said, fontsize=9.5, loc="left")
        panel.tick_params(labelsize=9)
    for panel in grid.flat[count:]:
        panel.set_visible(False)
    for panel in grid[:, 0]:
        panel.set_ylabel(down, fontsize=9.5)
    for panel in grid[-1]:
        panel.set_xlabel(across, fontsize=9.5)
    figure.colorbar(image, ax=grid, label=result.measure)
    return figure


def profiles(result: SweepResult) -> Figure:
    """Draw the measure over each parameter: its mean over the others, and each of them thin."""
    axes = axes_of(result)
    mean, error = result.values(result.measure)
    count = max(1, len(axes))
    wide = min(count, 2 if count == 4 else 3)
    tall = -(-count // wide)
    figure = plots.new_figure(
        (1.0 + _WIDTHS[wide] * wide, 0.9 + 2.7 * tall), f"{result.measure}: profiles"
    )
    grid = figure.subplots(tall, wide, squeeze=False, sharey=True)
    for panel, (axis, levels) in zip(grid.flat, axes.items(), strict=False):
        lines: dict[tuple[str, ...], npt.NDArray[np.float64]] = {}
        bars: dict[tuple[str, ...], npt.NDArray[np.float64]] = {}
        for number, point in enumerate(result.plan.points):
            key = tuple(level(point, name) for name in axes if name != axis)
            at = levels.index(level(point, axis))
            lines.setdefault(key, np.full(len(levels), np.nan))[at] = mean[number]
            bars.setdefault(key, np.full(len(levels), np.nan))[at] = error[number]
        places = range(len(levels))
        if len(lines) == 1:
            ((key, line),) = lines.items()
            panel.errorbar(places, line, bars[key], fmt="o-", color=plots.BLUE, capsize=3)
        else:
            for line in list(lines.values())[:_MOST_LINES]:
                panel.plot(places, line, "-", color=plots.GREY, linewidth=0.6, alpha=0.6)
            whole = _means([[list(column)] for column in np.array(list(lines.values())).T])
            panel.plot(places, whole[:, 0], "o-", color=plots.BLUE, linewidth=2)
        panel.set_xticks(places, levels)
        plots.style(panel, xlabel=axis)
    for panel in grid.flat[len(axes) :]:
        panel.set_visible(False)
    for panel in grid[:, 0]:
        panel.set_ylabel(result.measure, fontsize=9.5)
    return figure


def _means(cells: list[list[list[float]]]) -> npt.NDArray[np.float64]:
    """Average what is known in each cell."""
    known = [[[v for v in cell if np.isfinite(v)] for cell in row] for row in cells]
    return np.array([[np.mean(cell) if cell else np.nan for cell in row] for row in known])


def _write_numbers(panel: Axes, values: npt.NDArray[np.float64], low: float, high: float) -> None:
    middle = (low + high) / 2
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = plots.BLACK if value > middle else "white"
            panel.text(
                column, row, f"{value:.3g}", ha="center", va="center", color=colour, fontsize=8.5
            )
