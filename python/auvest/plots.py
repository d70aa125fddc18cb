"""Figures: one style, colours that colour-blind readers can tell apart, units on every axis.

For runs of your own: :func:`run` shows one, :func:`nees` and :func:`nis` have their bounds.

The functions return :class:`matplotlib.figure.Figure` objects and never touch pyplot or the global
style, so they can be used in any program and thread; :func:`save` writes one as a PNG.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context, rcdefaults
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from auvest import metrics
from auvest._arguments import as_array, as_instance, as_real
from auvest._core import Decision
from auvest._outputs import new_file
from auvest._texts import beside
from auvest.filters.results import RunResult, RunsResult

Floats = npt.NDArray[np.float64]

DPI = 110
# Okabe and Ito (2008).
BLACK = "#000000"
BLUE = "#0072B2"
SKY = "#56B4E9"
GREEN = "#009E73"
ORANGE = "#E69F00"
VERMILION = "#D55E00"
GREY = "#777777"

PURPLE = "#A6488A"  # Okabe and Ito's, darker: thin lines on white
BROWN = "#7A4B12"

#: One colour per filter, the same in every figure and page.
FILTER_COLOURS: Mapping[str, str] = {
    "ekf": GREEN,
    "ukf": VERMILION,
    "ckf": SKY,
    "aukf": BLUE,
    "robust-ekf": PURPLE,
    "robust-ukf": BROWN,
    "slatf1": "#5B6FD6",
    "slatf2": "#B5306B",
    "slatf-joint": "#2E6B1F",
    "ekf-slat": "#8A7000",
}
#: And one line style in pages, which tells them apart in greyscale: lengths of dashes and gaps in
#: points; none for an unbroken line.
FILTER_DASHES: Mapping[str, tuple[float, ...]] = {
    "ekf": (7, 3),
    "ukf": (3, 2),
    "ckf": (9, 3, 2, 3),
    "aukf": (5, 2, 1, 2, 1, 2),
    "robust-ekf": (),
    "robust-ukf": (12, 3),
    "slatf1": (2, 2, 6, 2),
    "slatf2": (14, 3, 2, 3),
    "slatf-joint": (10, 4),
    "ekf-slat": (6, 2, 2, 2, 2, 2),
}
#: The same for the filters of localisation and tracking, which share no figure with the others.
SLAT_COLOURS: Mapping[str, str] = {
    "dr": BLACK,
    "dr_compensated": GREY,
    "slatf1": VERMILION,
    "slatf2": BLUE,
    "slatf_joint": ORANGE,
    "ekf_slat": GREEN,
}
#: And for the robust EKF where its kernels stand beside each other: the paper's has its colour.
KERNEL_COLOURS: Mapping[str, str] = {
    "ekf": FILTER_COLOURS["ekf"],
    "igg": FILTER_COLOURS["robust-ekf"],
    "huber": ORANGE,
    "hampel": BROWN,
}
#: Errors of a filter and of what came back over its record: begin of the names of columns, and how
#: they are drawn.
ERRORS = (
    ("", BLUE, "error", "-", "±3 sigma of the filter"),
    ("smoothed_", ORANGE, "smoothed: error", "--", "smoothed: ±3 sigma"),
)
_CYCLE = (BLUE, VERMILION, GREEN, ORANGE, SKY, GREY)


@dataclass(frozen=True)
class Line:
    """One curve: values per step, with a band around it if given, and its name in the legend."""

    label: str
    y: Floats
    x: Floats | None = None
    low: Floats | None = None
    high: Floats | None = None
    colour: str | None = None
    style: str = "-"


def track_figure(
    truth: Floats,
    estimate: Floats,
    observed: Floats,
    *,
    station: Sequence[float],
    title: str,
    label: str = "estimated",
    colour: str = BLUE,
) -> Figure:
    """Draw a track, and how far observations and estimate lie off it: across and along.

    Parameters
    ----------
    truth, estimate, observed : ndarray, shape (T, 2)
        Positions in m; ``observed`` is range and bearing turned into a position.
    station : (float, float)
        Position of the base station, m.
    title : str
        What the reader sees.
    label, colour : str
        Name and colour of the estimated track.
    """
    figure = new_figure((8.0, 4.4), title)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 2.2))
    plane = figure.add_subplot(grid[:, 0])
    plane.plot(*truth.T, "-", color=BLACK, linewidth=1.6, label="the track: 0 at the right")
    plane.plot(
        *station, "^", color=GREEN, markersize=8, label="station and start", linestyle="none"
    )
    style_plane(plane)
    steps = np.arange(1, len(truth) + 1)
    ways = zip(off_track(truth, observed), off_track(truth, estimate), strict=True)
    first = None
    for row, (name, (seen, estimated)) in enumerate(zip(("across", "along"), ways, strict=True)):
        axes = figure.add_subplot(grid[row, 1], sharex=first, sharey=first)
        axes.plot(
            steps, seen, "-.", color=GREY, linewidth=0.7, marker=".", markersize=3, label="observed"
        )
        axes.plot(steps, estimated, "-", color=colour, linewidth=1.8, label=label)
        axes.axhline(0.0, color=BLACK, linewidth=1.2, zorder=1)
        style(axes, ylabel=f"{name} the track / m")
        if first is None:
            first = axes
            axes.tick_params(labelbottom=False)
    axes.set_xlabel("step")
    handles, labels = plane.get_legend_handles_labels()
    own_handles, own_labels = axes.get_legend_handles_labels()
    figure.legend(
        handles + own_handles,
        labels + own_labels,
        loc="outside lower center",
        ncols=4,
        fontsize=9,
        frameon=False,
    )
    return figure


def off_track(truth: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Give how far places lie off a track, m: across it (to the left) and along it (ahead).

    Parameters
    ----------
    truth, places : ndarray, shape (T, 2)
        Points of the track, and what is compared with each.

    Returns
    -------
    (ndarray, ndarray), shape (T,)

    Examples
    --------
    >>> import numpy as np
    >>> north = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]])
    >>> across, along = off_track(north, north + [0.5, 0.1])  # to the right, and ahead
    >>> across.tolist(), along.round(3).tolist()
    ([-0.5, -0.5, -0.5], [0.1, 0.1, 0.1])
    """
    course = np.gradient(truth, axis=0)
    length = np.hypot(*course.T)
    ahead = course / np.where(length > 0, length, 1.0)[:, None]
    error = places - truth
    across: Floats = ahead[:, 0] * error[:, 1] - ahead[:, 1] * error[:, 0]
    along: Floats = (ahead * error).sum(axis=1)
    return across, along


def step_figure(
    lines: Sequence[Line], *, title: str, ylabel: str, xlabel: str = "step", zero: bool = False
) -> Figure:
    """Draw curves over the step number, or over ``Line.x`` where a line has one."""
    figure, axes = new_axes((6.6, 4.4), title)
    _draw_lines(axes, lines)
    if zero:
        axes.axhline(0.0, color=BLACK, linewidth=0.6, zorder=1)
    style(axes, xlabel=xlabel, ylabel=ylabel)
    legend_below(figure, axes, columns=2)
    return figure


def error_figure(
    runs: Sequence[Line], spread: Sequence[Line], *, title: str, axis: str = "x"
) -> Figure:
    """Draw the error per step of one run, and below it the root mean square over all runs."""
    figure = new_figure((6.6, 5.6), title)
    top = figure.add_subplot(2, 1, 1)
    bottom = figure.add_subplot(2, 1, 2, sharex=top)
    _draw_lines(top, runs)
    top.axhline(0.0, color=BLACK, linewidth=0.6, zorder=1)
    top.tick_params(labelbottom=False)
    _draw_lines(bottom, spread)
    style(top, ylabel=f"{axis} error, one run / m")
    style(bottom, xlabel="step", ylabel=f"{axis} error, rms / m", ylim=(0.0, None))
    legend_below(figure, bottom, columns=3)
    return figure


def simulation_figure(
    truth: Floats,
    estimate: Floats,
    observed: Floats,
    *,
    station: Sequence[float],
    time_s: Floats,
    error_m: Floats,
    sigma_m: Floats,
    intervals: Sequence[Line],
    title: str,
    label: str,
    colour: str,
) -> Figure:
    """Draw one run of ``auvest simulate``: tracks, interval and error with its three-sigma bounds.

    Parameters
    ----------
    truth, estimate, observed : ndarray, shape (T, 2)
        Positions, m.
    station : (float, float)
        Position of the base station, m.
    time_s : ndarray, shape (T,)
        Time of the samples.
    error_m, sigma_m : ndarray, shape (T, 2)
        Error of the estimate and the filter's own standard deviation of it, along x and y.
    intervals : sequence of Line
        Sampling intervals over the step number, s.
    title, label, colour : str
        Title of the whole, name and colour of the estimate.
    """
    figure = new_figure((10.0, 6.0), title)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.25))
    plane = figure.add_subplot(grid[:, 0])
    _draw_tracks(plane, truth, estimate, observed, station, label, colour)
    style(plane)
    plane.set_title("tracks, one run", loc="left")
    legend_inside(plane)

    pace = figure.add_subplot(grid[0, 1])
    _draw_lines(pace, intervals)
    style(pace, xlabel="step", ylabel="T / s", ylim=(0.0, None))
    pace.set_title("sampling interval", loc="left")
    _legend_above(pace)

    for row, name in enumerate("xy"):
        axes = figure.add_subplot(grid[row + 1, 1])
        bound = 3.0 * sigma_m[:, row]
        band = Line(
            "error", error_m[:, row], x=time_s, low=-bound, high=bound, colour=colour, style=".-"
        )
        _draw_lines(axes, [band], band_label="±3 sigma of the filter")
        axes.axhline(0.0, color=BLACK, linewidth=0.6, zorder=1)
        style(axes, ylabel=f"{name} error / m")
        if row == 0:
            axes.set_title("error, one run", loc="left")
            _legend_above(axes)
            axes.tick_params(labelbottom=False)
        else:
            axes.set_xlabel("time / s")
    return figure


def capture_figure(
    estimate: Floats,
    desired: Floats,
    observed: Floats,
    truth: Floats,
    *,
    station: Sequence[float],
    time_s: Floats,
    interval_s: Floats,
    sigma_m: Floats,
    nis: Floats,
    title: str,
) -> Figure:
    """Draw one recording of ``auvest capture``: tracks, interval, uncertainty and consistency.

    Parameters
    ----------
    estimate, desired, observed, truth : ndarray, shape (T, 2)
        Positions, m; NaN where unknown.
    station : (float, float)
        Position of the base station, m.
    time_s, interval_s, sigma_m, nis : ndarray, shape (T,)
        Time of the samples, interval to the next (s), standard deviation of the position (m) and
        normalised innovation squared; NaN where the measurement is missing.
    title : str
        Title of the whole.
    """
    figure = new_figure((10.0, 6.0), title)
    grid = figure.add_gridspec(3, 2, width_ratios=(1.0, 1.25))
    plane = figure.add_subplot(grid[:, 0])
    plane.plot(*observed.T, ".", color=GREY, markersize=4, alpha=0.8, label="observed")
    plane.plot(*desired.T, "-", color=SKY, linewidth=1.6, label="desired")
    if np.isfinite(truth).any():
        plane.plot(*truth.T, "-", color=BLACK, linewidth=1.2, label="truth")
    plane.plot(*estimate.T, "--", color=BLUE, linewidth=1.8, label="estimate")
    plane.plot(*station, "^", color=GREEN, markersize=8, label="station", linestyle="none")
    style_plane(plane)
    plane.set_title("tracks", loc="left")
    legend_inside(plane)

    rows = (
        ("interval to the next sample", "T / s", interval_s),
        ("standard deviation of the position", "sigma / m", sigma_m),
        ("normalised innovation squared, 95 % below 5.99", "NIS", nis),
    )
    missing = time_s[~np.isfinite(nis)]
    for row, (name, label, values) in enumerate(rows):
        axes = figure.add_subplot(grid[row, 1])
        axes.plot(time_s, values, ".-", color=BLUE, linewidth=1.2, markersize=3.5)
        style(axes, ylabel=label, ylim=(0.0, None))
        axes.set_title(name, loc="left")
        axes.title.set_fontsize(10.5)
        if row == 2:
            axes.axhline(5.99, color=BLACK, linewidth=0.8, linestyle="--")
            axes.plot(missing, np.zeros_like(missing), "|", color=VERMILION, label="missed")
            if missing.size:
                legend_inside(axes)
            axes.set_xlabel("time / s")
        else:
            axes.tick_params(labelbottom=False)
    return figure


def columns_figure(time_s: Floats, columns: Mapping[str, Floats], *, title: str) -> Figure:
    """Draw columns over time, each in a panel of its own, those with nothing in them left out.

    Parameters
    ----------
    time_s : ndarray, shape (T,)
        Times, s; without any, the samples are counted.
    columns : mapping of str to ndarray, shape (T,)
        By their names; NaN where unknown.
    title : str
        Title of the whole.
    """
    drawn = {name: values for name, values in columns.items() if np.isfinite(values).any()}
    timed = bool(np.isfinite(time_s).all())
    across = time_s if timed else np.arange(len(time_s))
    rows = max(1, -(-len(drawn) // 3))
    figure = new_figure((10.0, 1.0 + 1.5 * rows), title)
    axes = figure.subplots(rows, 3, sharex=True, squeeze=False)
    for panel, (name, values) in zip(axes.flat, drawn.items(), strict=False):
        panel.plot(across, values, ".-", color=BLUE, linewidth=1.0, markersize=3)
        style(panel)
        panel.set_title(name, loc="left")
        panel.title.set_fontsize(10.5)
    for panel in axes.flat[len(drawn) :]:
        panel.set_visible(False)
    for panel in axes[-1]:
        panel.set_xlabel("time / s" if timed else "sample")
    return figure


def slave_figure(
    truth: Floats,
    estimate: Floats,
    masters: Floats,
    *,
    time_s: Floats,
    error_m: Floats,
    sigma_m: Floats,
    rms_m: Floats,
    title: str,
) -> Figure:
    """Draw the tracks of a slave and its masters, and the slave's error over time.

    Parameters
    ----------
    truth, estimate : ndarray, shape (T, 2)
        Positions of the slave in one run, m.
    masters : ndarray, shape (T, M, 2)
        True positions of the masters, m.
    time_s : ndarray, shape (T,)
        Times, s.
    error_m, sigma_m : ndarray, shape (T,)
        Length of the error in that run, and the standard deviation that the filter claims, m.
    rms_m : ndarray, shape (T,)
        Root mean square of the error over all runs, m.
    title : str
        What the reader sees.
    """
    figure = new_figure((8.0, 4.0), title)
    plane, axes = figure.subplots(1, 2)
    for n in range(masters.shape[1]):
        label = "masters" if n == 0 else None
        plane.plot(masters[:, n, 0], masters[:, n, 1], color=VERMILION, label=label)
    plane.plot(truth[:, 0], truth[:, 1], color=BLACK, linewidth=1.6, label="slave, truth")
    plane.plot(estimate[:, 0], estimate[:, 1], "--", color=BLUE, label="slave, one run")
    axes.plot(time_s, rms_m, color=BLACK, linewidth=1.6, label="rms, all runs")
    axes.plot(time_s, error_m, "--", color=BLUE, label="one run")
    axes.plot(time_s, sigma_m, ":", color=BLUE, label="claimed sigma, that run")
    style(plane, legend=8, xlabel="x / m", ylabel="y / m")
    style(axes, legend=8, xlabel="time / s", ylabel="position error / m", ylim=(0, None))
    return figure


def run(
    result: RunResult,
    *,
    truth: npt.ArrayLike | None = None,
    places: npt.ArrayLike | None = None,
    time_s: npt.ArrayLike | None = None,
    title: str = "",
) -> Figure:
    """Draw what a filter's ``run`` or ``smooth`` gave: the track, and how far it is to be believed.

    Parameters
    ----------
    result : RunResult or SmoothResult, T rows
        Of a filter whose state begins with x and y, m.
    truth : array_like, shape (T, 2), optional
        Where the craft was, m; NaN where nobody knows. With it, beside the track stand the errors
        along x and y in the +-3 sigma that are claimed of them, of the smoothed track too; without,
        the first number of each innovation in its own, and the NIS.
    places : array_like, shape (K, 2), optional
        Beacons and stations, m.
    time_s : array_like, shape (T,), optional
        Time of each row, s; default: the rows are counted.
    title : str
        Above the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Crosses on the track are rows whose measurement was rejected. Bands need covariances
        (``covariance=True``).

    Raises
    ------
    ValueError, TypeError
        If the shapes do not fit, or it is no result of one run.

    Examples
    --------
    >>> import auvest, numpy as np
    >>> from auvest import plots
    >>> beacon = auvest.LeaderRange(leader=(20.0, 0.0))
    >>> ekf = auvest.Ekf([0, 0], np.eye(2), process=auvest.SpeedHeading(), sensors=beacon)
    >>> result = ekf.run([19.2, 18.1], dt=1.0, input=[[1.0, 0.0, 0.0]] * 2)
    >>> figure = plots.run(result, truth=[[1, 0], [2, 0]], places=[beacon.leader])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y / m', 'x error / m', 'y error / m']
    """
    as_instance("result", result, RunResult)
    if isinstance(result, RunsResult):
        raise TypeError("result is that of many runs: draw one of them, result.run(0)")
    rows, states = result.x.shape
    if states < 2:
        raise ValueError(f"result has {states} state, but a track has x and y")
    float64 = np.dtype(np.float64)
    time = (
        np.arange(1.0, rows + 1) if time_s is None else as_array("time_s", time_s, (rows,), float64)
    )
    figure = new_figure((11.0, 5.0), title)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.25))
    plane = figure.add_subplot(grid[:, 0])
    upper = figure.add_subplot(grid[0, 1])
    lower = figure.add_subplot(grid[1, 1], sharex=upper)
    upper.tick_params(labelbottom=False)
    if truth is not None:
        given = as_real("truth", truth, (rows, 2))
        unknown = np.isnan(given).any(axis=-1, keepdims=True)
        known = as_array(
            "truth", np.where(unknown, np.nan, given), (rows, 2), float64, missing=True
        )
        plane.plot(*known.T, "-", color=BLACK, label="truth")
    plane.plot(*result.x[:, :2].T, "-", color=BLUE, linewidth=1.2, label="estimate")
    if "smoothed_x" in result.columns:
        smoothed = result["smoothed_x"][:, :2]
        plane.plot(*smoothed.T, "--", color=ORANGE, linewidth=1.2, label="smoothed")
    draw_rejected(plane, result.x[result.decision == int(Decision.rejected), :2])
    if places is not None and np.size(places) > 0:
        there = as_array("places", places, (None, 2), float64)
        plane.plot(*there.T, "^", color=BLACK, linestyle="none", label="places")
    style_plane(plane)
    plane.legend(fontsize=8.5, framealpha=0.85, edgecolor="none")
    if truth is None:
        S = result["S"] if "S" in result.columns else None
        sigma = None if S is None else np.sqrt(S[:, 0, 0])
        innovation = result.innovation[:, 0]
        draw_band(upper, time, innovation, sigma, BLUE, "innovation", ".")
        compress(upper, innovation, 4 * usual(innovation if sigma is None else 3 * sigma))
        style(upper, legend=8.5, ylabel="innovation, first number")
        lower.plot(time, result.nis, ".", color=BLUE, markersize=3)
        compress(lower, result.nis, 2 * metrics.chi2_bounds(result.innovation.shape[1])[1])
        style(lower, ylabel="NIS", ylim=(0.0, None))
    else:
        for k, axes in enumerate((upper, lower)):
            claimed: list[npt.NDArray[Any]] = [np.zeros(0)]
            errors: list[npt.NDArray[Any]] = []
            for prefix, *looks in ERRORS:
                if f"{prefix}x" in result.columns:
                    P = result[f"{prefix}P"] if f"{prefix}P" in result.columns else None
                    sigma = None if P is None else np.sqrt(P[:, k, k])
                    error = result[f"{prefix}x"][:, k] - known[:, k]
                    draw_band(axes, time, error, sigma, *looks)
                    claimed += [] if sigma is None else [3 * sigma]
                    errors.append(error)
            focus(axes, np.concatenate(claimed), np.concatenate(errors))
            style(axes, ylabel=f"{'xy'[k]} error / m")
        upper.legend(fontsize=8.5, framealpha=0.85, edgecolor="none")
    lower.set_xlabel("row" if time_s is None else "time / s")
    return figure


def draw_band(
    axes: Axes,
    time_s: npt.NDArray[Any],
    value: npt.NDArray[Any],
    sigma: npt.NDArray[Any] | None,
    colour: str,
    label: str,
    marks: str = "-",
    band: str = "±3 sigma of the filter",
) -> None:
    """Draw what ought to be 0, and the +-3 sigma that are claimed of it."""
    if sigma is not None:
        known = np.isfinite(sigma)
        axes.fill_between(
            time_s[known], -3 * sigma[known], 3 * sigma[known], color=colour, alpha=0.18,
            linewidth=0, label=band,
        )  # fmt: skip
    axes.plot(time_s, value, marks, color=colour, linewidth=1.0, markersize=3, label=label)


def focus(axes: Axes, bounds: npt.NDArray[Any], values: npt.NDArray[Any]) -> None:
    """Let the axis end a little beyond the values where bounds, at a start, are far wider."""
    known = bounds[np.isfinite(bounds)]
    if len(known):
        reach = float(np.nanmax(np.abs(values), initial=np.quantile(known, 0.9)))
        if known.max() > 2 * reach > 0:
            axes.set_ylim(-1.2 * reach, 1.2 * reach)


def compress(axes: Axes, values: npt.NDArray[Any], reach: float) -> None:
    """Make the axis logarithmic beyond ``reach``, so that gross errors do not flatten the rest."""
    if reach > 0 and (np.abs(values) > 2 * reach).any():
        axes.set_yscale("symlog", linthresh=reach)


def usual(values: npt.NDArray[Any]) -> float:
    """Give what nine of ten values do not exceed, without their signs."""
    known = np.abs(values[np.isfinite(values)])
    return float(np.quantile(known, 0.9)) if len(known) else 0.0


def draw_rejected(axes: Axes, positions: npt.NDArray[Any]) -> None:
    """Mark the positions at which measurements were rejected, if there are some."""
    if len(positions):
        axes.plot(*positions.T, "x", color=VERMILION, markersize=5, label="measurement rejected")


def nees(
    error: npt.ArrayLike,
    P: npt.ArrayLike,
    *,
    time_s: npt.ArrayLike | None = None,
    level: float = 0.95,
    title: str = "NEES",
) -> Figure:
    """Draw the normalised estimation error squared of your own runs, with its bounds.

    Parameters
    ----------
    error : array_like, shape (T, k) or (runs, T, k)
        Errors of the estimate; components that are angles must be wrapped.
    P : array_like, shape (T, k, k) or (runs, T, k, k)
        Covariances that the filter claims of them.
    time_s : array_like, shape (T,), optional
        Time of each row, s; default: the steps are counted.
    level : float
        Probability of lying between the bounds, in (0, 1).
    title : str
        Above the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The mean over the runs; a filter that is consistent stays between the bounds at ``level`` of
        the steps, one that is too sure of itself lies above them. Errors of one run are correlated
        over time: with few runs it stays on one side for long.

    Raises
    ------
    ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> from auvest import plots
    >>> rng = np.random.default_rng(1)
    >>> error = rng.normal(size=(20, 100, 2))
    >>> figure = plots.nees(error, np.broadcast_to(np.eye(2), (20, 100, 2, 2)))
    >>> figure.axes[0].get_ylabel()
    'NEES, mean of 20 runs'
    """
    e = np.asarray(error, np.float64)
    return _consistency_figure("NEES", metrics.nees(e, P), e.shape[-1], time_s, level, title)


def nis(
    values: npt.ArrayLike,
    dof: int,
    *,
    time_s: npt.ArrayLike | None = None,
    level: float = 0.95,
    title: str = "NIS",
) -> Figure:
    """Draw the normalised innovation squared of your own runs, with its bounds.

    Parameters
    ----------
    values : array_like, shape (T,) or (runs, T)
        As ``nis`` of a filter's results; NaN where there is no measurement.
    dof : int
        Numbers in a measurement: 1 for a range, 2 for range and bearing.
    time_s, level, title
        As for :func:`nees`.

    Returns
    -------
    matplotlib.figure.Figure
        The mean over the runs. Innovations of a consistent filter are independent: the mean over
        all of them, which is in the title of the axes, has bounds that one run already makes tight.

    Raises
    ------
    ValueError
        If the shapes do not fit, or nothing is finite.

    Examples
    --------
    >>> import numpy as np
    >>> from auvest import plots
    >>> values = np.random.default_rng(1).chisquare(2, size=200)
    >>> plots.nis(values, 2).axes[0].get_title(loc="left")
    'mean of all: 2.10, within the consistent 1.73 to 2.29 (95 %)'
    """
    return _consistency_figure("NIS", np.asarray(values, np.float64), dof, time_s, level, title)


def _consistency_figure(
    name: str,
    values: Floats,
    dof: int,
    time_s: npt.ArrayLike | None,
    level: float,
    title: str,
) -> Figure:
    runs = values[np.newaxis] if values.ndim == 1 else values
    if runs.ndim != 2:
        raise ValueError(f"{name} has shape {values.shape}, expected (T,) or (runs, T)")
    judge = metrics.nis_consistency if name == "NIS" else metrics.nees_consistency
    judged = judge(runs, dof, level)
    x = np.arange(1, runs.shape[1] + 1) if time_s is None else np.asarray(time_s, np.float64)
    if x.shape != runs.shape[1:]:
        raise ValueError(f"time_s has shape {x.shape}, expected {runs.shape[1:]}")
    known = np.isfinite(runs)
    counts = known.sum(axis=0)
    mean = np.full(len(x), np.nan)
    np.divide(np.where(known, runs, 0.0).sum(axis=0), counts, out=mean, where=counts > 0)
    bounds = {n: metrics.chi2_bounds(dof, n, level) for n in set(counts.tolist()) - {0}}
    low, high = np.array([bounds.get(n, (np.nan, np.nan)) for n in counts.tolist()]).T
    figure, axes = new_axes((6.6, 3.8), title)
    axes.fill_between(
        x, low, high, step="mid", color=GREY, alpha=0.25, linewidth=0, label=f"{level:.0%} bounds"
    )
    axes.axhline(dof, color=BLACK, linewidth=0.8, linestyle="--", label=f"expected: {dof}")
    axes.plot(x, mean, ".-", color=BLUE, linewidth=1.2, markersize=3.5, label=name)
    what = "all" if name == "NIS" else "the runs at the last step"
    where = beside(judged.mean, judged.low, judged.high)
    style(
        axes,
        title=f"mean of {what}: {judged.mean:.2f}, {where} the consistent {judged.low:.2f} to "
        f"{judged.high:.2f} ({100 * level:g} %)",
        xlabel="step" if time_s is None else "time / s",
        ylabel=name if len(runs) == 1 else f"{name}, mean of {len(runs)} runs",
        ylim=(0.0, None),
    )
    legend_below(figure, axes, columns=3)
    return figure


@contextmanager
def own_style() -> Iterator[None]:
    """Draw as matplotlib comes, whatever the user's own matplotlibrc asks for.

    With it a figure has the same bytes for everybody, and needs no LaTeX. It changes what is global
    in matplotlib for its time: it is for commands.
    """
    with rc_context(), warnings.catch_warnings():
        rcdefaults()
        # A name in letters that the font has not is drawn with boxes.
        warnings.filterwarnings("ignore", message=r"Glyph \d+", category=UserWarning)
        yield


def save(figure: Figure, path: Path) -> Path:
    """Write a figure, the same bytes for the same figure, and return the path.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in ``.png`` or ``.svg``.
    """
    kind = path.suffix.removeprefix(".")
    # What would differ from time to time: the program, the hour, the names of parts of the drawing.
    unsaid = {"Software": None} if kind == "png" else {"Creator": None, "Date": None}
    with new_file(path) as file, rc_context({"svg.hashsalt": "auvest"}):
        figure.savefig(file, format=kind, dpi=DPI, metadata=unsaid)
    return path


def new_figure(size: tuple[float, float], title: str) -> Figure:
    """Make an empty figure of that size in inches."""
    figure = Figure(figsize=size, dpi=DPI, layout="constrained")
    # Names stand in titles: a dollar sign begins no formula, and bytes may be no text.
    drawn = title.encode("utf-8", "backslashreplace").decode("utf-8")
    figure.suptitle(drawn, fontsize=12, parse_math=False)
    return figure


def new_axes(size: tuple[float, float], title: str) -> tuple[Figure, Axes]:
    """Make a figure of that size in inches with axes in it."""
    figure = new_figure(size, title)
    return figure, figure.add_subplot()


def style(axes: Axes, *, title: str = "", legend: float | None = None, **labels: Any) -> None:
    """Give axes the grid and the sizes that all our figures have, and finish them.

    Parameters
    ----------
    axes : Axes
        What to draw is in them already.
    title : str
        Above them, to the left.
    legend : float, optional
        Size of the letters of a legend; default: none.
    **labels
        What ``axes.set`` takes: labels, limits, aspect.
    """
    axes.set(**labels)
    if title:
        axes.set_title(title, fontsize=9.5, loc="left")
    if legend is not None:
        axes.legend(fontsize=legend)
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_fontsize(9.5)
    axes.tick_params(labelsize=9)


def style_plane(axes: Axes) -> None:
    """Style axes in which one metre is as long along x as along y."""
    axes.set_aspect("equal", adjustable="datalim")
    style(axes, xlabel="x / m", ylabel="y / m")


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """Put the legend of these axes below the whole figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, fontsize=9, frameon=False
    )


def _legend_above(axes: Axes) -> None:
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.98),
        ncols=2,
        fontsize=9,
        frameon=False,
        borderpad=0.2,
        handlelength=1.6,
        columnspacing=1.2,
    )
    axes.title.set_fontsize(10.5)


def legend_inside(axes: Axes) -> None:
    """Put the legend of axes where least is drawn."""
    axes.legend(fontsize=9, framealpha=0.85, edgecolor="none", loc="best")


def _draw_lines(axes: Axes, lines: Sequence[Line], band_label: str | None = None) -> None:
    for i, line in enumerate(lines):
        x = np.arange(len(line.y)) if line.x is None else line.x
        colour = line.colour or _CYCLE[i % len(_CYCLE)]
        if line.low is not None and line.high is not None:
            axes.fill_between(
                x, line.low, line.high, color=colour, alpha=0.18, linewidth=0, label=band_label
            )
        axes.plot(
            x, line.y, line.style, color=colour, linewidth=1.5, markersize=3.5, label=line.label
        )
    axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True))


def _draw_tracks(
    axes: Axes,
    truth: Floats,
    estimate: Floats,
    observed: Floats,
    station: Sequence[float],
    label: str,
    colour: str,
) -> None:
    axes.plot(
        observed[:, 0], observed[:, 1], "-.", color=GREY, linewidth=0.7, marker=".",
        markersize=3, alpha=0.8, label="observed",
    )  # fmt: skip
    axes.plot(truth[:, 0], truth[:, 1], "-", color=BLACK, linewidth=1.6, label="reference = truth")
    axes.plot(estimate[:, 0], estimate[:, 1], "--", color=colour, linewidth=1.8, label=label)
    axes.plot(*station, "^", color=GREEN, markersize=8, label="station and start", linestyle="none")
    style_plane(axes)


def pair(x: Floats, y: Floats) -> Floats:
    """Join two columns to points (T, 2)."""
    return np.stack([x, y], axis=-1)
