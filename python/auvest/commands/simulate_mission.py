"""``auvest simulate mission``: a torpedo steers itself along a track, by its own estimate.

Compass, gyro, depth, log and USBL fixes, the filter, guidance, control, fins and propeller, and the
hull in up to six degrees of freedom, ten times a second, in a current that nobody told it.

Examples
--------
  auvest simulate mission

  auvest simulate mission --path dubins

  auvest simulate mission --track circle --filter ukf --guidance adaptive

  auvest simulate mission --outliers 0.05 --kernel igg --current 0.5

  auvest simulate mission --filter ukf --guidance adaptive --policy mahalanobis --json
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from rich.table import Table

from auvest import CovarianceBudget, FixedInterval, MahalanobisInterval, RejectionStreak
from auvest._texts import counted
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.options import FILTER, WORLD, option, positive
from auvest.commands.session import Session, failure, mean_over_runs
from auvest.intervals import IntervalPolicy
from auvest.kernels import KernelName
from auvest.simulation import mission
from auvest.simulation.mission import (
    Estimate,
    Law,
    Mission,
    MissionResult,
    PathKind,
    TrackKind,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_VEHICLE = "Vehicle"
_MISSION = Mission()
#: Default of --arc with --path dubins: half the distance of the lanes.
DUBINS_ARC_M = 20.0
#: Default of --compass-bias, degrees.
COMPASS_BIAS_DEG = math.degrees(_MISSION.compass_bias_rad)


def command(
    track: Annotated[TrackKind, option(WORLD, "lawnmower: four lanes; circle.")] = "lawnmower",
    path: Annotated[
        PathKind,
        option(
            WORLD,
            "From lane to lane. waypoints: corners, which no hull can fly; dubins: the shortest "
            "curves that turn on --arc; spline: a smooth curve through points.",
        ),
    ] = "waypoints",
    arc: Annotated[
        float | None,
        option(
            WORLD,
            "Radius of the turns, m. With waypoints arcs cut the corners, 0: corners. This hull "
            "turns on 14.3 m.",
            check=options.not_negative,
            show_default="20 with dubins, else 0",
        ),
    ] = None,
    current: options.Current = _MISSION.current_m_s,
    current_direction: options.CurrentDirection = None,
    outliers: options.FixOutliers = 0.0,
    latency: options.FixLatency = 0.0,
    dropout: options.FixDropout = 0.0,
    compass_bias: options.CompassBias = COMPASS_BIAS_DEG,
    degrees_of_freedom: Annotated[
        int, option(_VEHICLE, "Of the hull: 6, 5, 4 or 3.", min=3, max=6)
    ] = 6,
    speed: Annotated[
        float, option(_VEHICLE, "Through the water, m/s.", check=positive)
    ] = _MISSION.speed_m_s,
    guidance: Annotated[
        Law,
        option(
            _VEHICLE,
            "Law; crab feeds the estimated current forward, so it needs --filter truth or "
            "model-aided.",
        ),
    ] = "crab",
    kind: Annotated[
        Estimate,
        option(
            FILTER,
            "truth; fixes: the last one; ukf: constant acceleration; model-aided: dead reckoning "
            "with the current in the state.",
            "--filter",
        ),
    ] = "model-aided",
    kernel: Annotated[KernelName, option(FILTER, "Robust kernel; unit: none.")] = "unit",
    policy: Annotated[
        Literal["fixed", "mahalanobis", "covariance-budget"],
        option(FILTER, "When the next fix is asked for."),
    ] = "fixed",
    interval: Annotated[
        float, option(FILTER, "Of fixes; with a policy the first, s.", check=positive)
    ] = 0.5,
    most: Annotated[
        float, option(FILTER, "Largest interval of a policy, s.", "--max-interval", check=positive)
    ] = 2.0,
    budget: Annotated[
        float,
        option(FILTER, "sqrt(P_xx + P_yy) of covariance-budget, m.", check=positive),
    ] = 1.0,
    dtype: options.Precision = "float64",
    runs: options.Runs = 50,
    seed: options.Seed = 1,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/simulate-mission"),
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    with terminal.usage_errors():
        paces: IntervalPolicy = FixedInterval(interval_s=interval)
        least = min(0.1, interval)
        if policy == "mahalanobis":
            paces = MahalanobisInterval(initial_s=interval, min_s=least, max_s=most)
        elif policy == "covariance-budget":
            paces = CovarianceBudget(
                position_sigma_m=budget, initial_s=interval, min_s=least, max_s=most
            )
        plan = Mission(
            track=track,
            path=path,
            estimate=kind,
            guidance=guidance,
            interval=paces,
            kernel=None if kernel == "unit" else kernel,
            recovery=None if kernel == "unit" else RejectionStreak(),
            degrees_of_freedom=degrees_of_freedom,
            dtype=dtype,
            speed_m_s=speed,
            **options.sea(current, current_direction, compass_bias, outliers, latency, dropout),
            arc_m=(DUBINS_ARC_M if path == "dubins" else 0.0) if arc is None else arc,
            runs=runs,
            seed=seed,
        )
    session = Session(terminal, output, "simulate mission", mission.settings(plan), force=force)
    result = session.run(mission.simulate, plan, workers=workers)
    values = measures(result)
    session.write_csv("per_step", means_per_step(result))
    if not no_figure:
        session.draw(_figure, result)
    session.report(values, _table(values, plan))
    session.end("what was done is kept", failure(result))


def measures(result: MissionResult) -> dict[str, Any]:
    """Compute the numbers of the table: means over the runs, with standard errors."""
    good = ~result.failed
    numbers: dict[str, Any] = {
        "runs": len(result.status),
        "failed_runs": int(result.failed.sum()),
        "fixes": int(result.fixes.sum()),
        "refused_fixes": int(result.refused.sum()),
    }
    for name in ("settled_rms_m", "all_rms_m", "position_rms_m", "duration_s", "mean_interval_s"):
        numbers[name], numbers[f"{name}_se"] = mean_and_error(getattr(result, name)[good])
    travel = np.degrees(result.rudder_travel_rad_s[good])
    numbers["rudder_travel_deg_s"], _ = mean_and_error(travel)
    for name in ("nis", "nees_position", "nees"):
        values = getattr(result, name)
        known = np.isfinite(values)
        numbers[f"{name}_mean"] = float(values[known].mean()) if known.any() else math.nan
    return numbers


def mean_and_error(values: mission.Floats) -> tuple[float, float]:
    """Mean and its standard error; NaN where there are too few."""
    if not len(values):
        return math.nan, math.nan
    error = float(values.std(ddof=1) / math.sqrt(len(values))) if len(values) > 1 else math.nan
    return float(values.mean()), error


def means_per_step(result: MissionResult) -> dict[str, mission.Floats]:
    """Root mean squares over the runs, per step."""
    error = np.square(result.estimate_m - result.pose[..., :2]).sum(axis=-1)
    return {
        "time_s": result.time_s,
        "cross_rms_m": np.sqrt(mean_over_runs(np.square(result.cross_m))),
        "position_rms_m": np.sqrt(mean_over_runs(error)),
        "interval_s": mean_over_runs(result.interval_s),
        "nees_position": mean_over_runs(result.nees_position),
        "nees": mean_over_runs(result.nees),
    }


def _figure(result: MissionResult) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    plan = result.mission
    title = f"{plan.estimate}, {plan.guidance}: one run of {len(result.status)}"
    figure = plots.new_figure((10.0, 7.0), title)
    grid = figure.add_gridspec(4, 2, width_ratios=(1.0, 1.25))
    plane = figure.add_subplot(grid[:, 0])
    pose, estimate = result.pose[0], result.estimate_m[0]
    wanted = mission.track_points(plan)
    plane.plot(wanted[:, 1], wanted[:, 0], color=plots.GREY, linewidth=3, alpha=0.4, label="track")
    plane.plot(pose[:, 1], pose[:, 0], color=plots.BLACK, linewidth=1.2, label="vehicle")
    plane.plot(estimate[:, 1], estimate[:, 0], color=plots.BLUE, linewidth=0.7, label="estimate")
    plane.plot(0, 0, "^", color=plots.GREEN, markersize=8, linestyle="none", label="USBL")
    plane.set(xlabel="east / m", ylabel="north / m")
    plane.set_aspect("equal", adjustable="datalim")
    plane.legend(fontsize=8)
    time = result.time_s
    rows = (
        ("cross-track / m", [(result.cross_m[0], plots.BLACK)]),
        ("rudder / deg", [(np.degrees(result.command[0, :, 0]), plots.VERMILION)]),
        ("interval / s", [(result.interval_s[0], plots.BLUE)]),
    )
    panels = [plane]
    for row, (name, lines) in enumerate(rows):
        panel = figure.add_subplot(grid[row, 1], sharex=panels[1] if row else None)
        for values, colour in lines:
            panel.plot(time, values, color=colour, linewidth=0.8)
        panel.set_ylabel(name)
        panel.tick_params(labelbottom=False)
        panels.append(panel)
    panel = figure.add_subplot(grid[3, 1], sharex=panels[1])
    steps = means_per_step(result)
    panel.plot(time, steps["nees_position"], color=plots.BLUE, linewidth=0.8)
    panel.axhline(2.0, color=plots.BLACK, linewidth=0.6)
    panel.set(ylabel="NEES, position,\nmean of runs", xlabel="time / s")
    for axes in (*panels, panel):
        plots.style(axes)
    return figure


def _track(plan: Mission) -> str:
    if plan.track == "circle":
        return plan.track
    how = {"waypoints": "corners", "dubins": "Dubins curves", "spline": "a spline"}[plan.path]
    if plan.arc_m > 0:
        how = f"{'arcs' if plan.path == 'waypoints' else how} of {plan.arc_m:g} m"
    return f"{plan.track} with {how}"


def _table(values: dict[str, Any], plan: Mission) -> Table:
    def with_error(name: str, unit: str) -> tuple[str, str]:
        error = values[f"{name}_se"]
        text = f"{values[name]:.3f}" + ("" if math.isnan(error) else f" ± {error:.3f}")
        return text, unit

    smooth = plan.track == "circle" or plan.path != "waypoints"
    since = "after 60 s" if smooth else "from 50 m into a leg"
    everything = "from the start" if smooth else "corners too"
    nis, outliers, kernel = "NIS, mean (2 expected)", "", ""
    if plan.kernel is not None:
        nis = "NIS, mean, rejected ones too (2 expected)"
        kernel = f", kernel {type(plan.kernel).__name__.lower()}"
    if plan.usbl_outliers > 0:
        nis = nis.replace("expected", "expected without outliers")
        outliers = f", {100 * plan.usbl_outliers:g} % outliers"
    rows = [
        (f"cross-track RMS, settled ({since})", *with_error("settled_rms_m", "m")),
        (f"cross-track RMS, {everything}", *with_error("all_rms_m", "m")),
        ("position error of the estimate, RMS", *with_error("position_rms_m", "m")),
        ("mean interval of fixes", *with_error("mean_interval_s", "s")),
        ("rudder travel", f"{values['rudder_travel_deg_s']:.1f}", "deg/s"),
        (nis, f"{values['nis_mean']:.2f}", ""),
        ("NEES of the position, mean (2 expected)", f"{values['nees_position_mean']:.2f}", ""),
        ("NEES of four states, mean (4 expected)", f"{values['nees_mean']:.2f}", ""),
    ]
    title = (
        f"{_track(plan)}, {plan.estimate}, {plan.guidance}: {counted(values['runs'], 'run')}, "
        f"{plan.degrees_of_freedom} degrees of freedom, current {plan.current_m_s:g} m/s"
        f"{outliers}{kernel}, "
        f"seed {plan.seed}, {plan.dtype}"
    )
    return table(title, ("quantity", "value", "unit"), rows, right={1})
