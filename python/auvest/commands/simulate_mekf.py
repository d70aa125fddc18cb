"""``auvest simulate mekf``: range-only localisation with any kernel, timing and noise.

A slave dead-reckons and ranges to two leaders in turn, every 5 s; some ranges are outliers (Li, Du,
Fan, Chen, Mao, Luo 2020). Every filter sees the same ranges as the EKF beside it.

Examples
--------
  auvest simulate mekf

  auvest simulate mekf --kernel huber --outliers 0.2 --timing own-time

  auvest simulate mekf --noise multipath --outlier-sigma 30 --dropout 0.3 --late 0.3

  auvest simulate mekf --displaced 200 --steps 600 --json
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from rich.table import Table

from auvest import RejectionStreak, metrics
from auvest._texts import counted
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.options import FILTER, MONTE_CARLO, WORLD, finite, fraction, option, positive
from auvest.commands.session import Floats, Session, failure, mean_over_runs
from auvest.kernels import KernelName, as_kernel
from auvest.simulation import cooperative
from auvest.simulation.cooperative import NoiseKind, RangeNoise, Result, Scenario, Timing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NOISE = RangeNoise()


def command(
    kernel: Annotated[KernelName, option(FILTER, "Robust kernel; unit: the plain filter.")] = "igg",
    kind: Annotated[
        Literal["ekf", "ukf"], option(FILTER, "What the kernel is put into.", "--filter")
    ] = "ekf",
    residual: Annotated[
        Literal["innovation", "post-fit"], option(FILTER, "What the kernel judges.")
    ] = "innovation",
    rejections: Annotated[
        int,
        option(
            FILTER,
            "Rejections, none like another, after which the covariance is widened; 0: never.",
            min=0,
            max=60,
        ),
    ] = RejectionStreak().rejections,
    dtype: options.Precision = "float64",
    noise: Annotated[
        NoiseKind,
        option(
            WORLD,
            "contaminated: outliers of another size; multipath: outliers too long; "
            "student: Student's t.",
        ),
    ] = "contaminated",
    range_noise: Annotated[
        float, option(WORLD, "Scale of the range noise, m.", check=positive)
    ] = _NOISE.sigma_m,
    outliers: Annotated[float, option(WORLD, "Share of the outliers.", check=fraction)] = 0.05,
    outlier_sigma: Annotated[
        float, option(WORLD, "Size of the outliers, m.", check=positive)
    ] = _NOISE.outlier_sigma_m,
    degrees_of_freedom: Annotated[
        int, option(WORLD, "Of Student's t.", min=1, max=100)
    ] = _NOISE.degrees_of_freedom,
    timing: Annotated[
        Timing,
        option(
            WORLD,
            "at-once: a range is there when it is measured; own-time: it comes with the next "
            "message and is taken at its own time; as-if-fresh: the same, the delay ignored.",
        ),
    ] = "own-time",
    dropout: Annotated[float, option(WORLD, "Share of messages lost.", check=fraction)] = 0.0,
    late: Annotated[
        float, option(WORLD, "Share of messages that are up to 10 s late.", check=fraction)
    ] = 0.0,
    displaced: Annotated[
        float,
        option(
            WORLD, "Error of the start along x that the filter does not know of, m.", check=finite
        ),
    ] = 0.0,
    steps: Annotated[
        int, option(MONTE_CARLO, "Seconds of each run; 8280: 2.3 h.", min=2, max=100_000)
    ] = cooperative.PAPER_STEPS,
    runs: options.Runs = 50,
    seed: options.Seed = 1,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/simulate-mekf"),
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    with terminal.usage_errors():
        scenario = Scenario(
            noise=RangeNoise(
                kind=noise,
                sigma_m=range_noise,
                outlier_fraction=outliers,
                outlier_sigma_m=outlier_sigma,
                degrees_of_freedom=degrees_of_freedom,
            ),
            timing=timing,
            dropout=dropout,
            late=late,
            steps=steps,
            runs=runs,
            seed=seed,
            offset_m=(displaced, 0.0),
        )
        recovery = RejectionStreak(rejections=rejections) if rejections else None
        make = partial(cooperative.slave_filter, kind=kind, sigma_range_m=range_noise, dtype=dtype)
        robust = make(kernel, recovery=recovery, residual=residual)
        plain = make("unit", recovery=None)
    settings = {
        "filter": kind,
        "kernel": {"name": kernel, **asdict(as_kernel(kernel))},
        "residual": residual,
        "rejections": rejections,
        "dtype": dtype,
        "scenario": asdict(scenario),
    }
    session = Session(terminal, output, "simulate mekf", settings, force=force)
    results: dict[str, Result] = {}
    for name, filter_ in (("plain", plain), ("robust", robust)):
        result = session.run_some(
            cooperative.simulate,
            filter_,
            scenario,
            workers=workers,
            what=f"runs, {name}",
        )
        if result is not None:
            results[name] = result
        if session.interrupted:
            break
    if not results:
        session.nothing_done()

    values: dict[str, Any] = {name: measures(result) for name, result in results.items()}
    if len(values) == 2:
        values["improvement"] = 1 - values["robust"]["rmse_m"] / values["plain"]["rmse_m"]
    session.write_csv("per_step", means_per_step(results))
    if not no_figure:
        session.draw(_figure, results, kernel, kind)
    session.report(values, _table(values, settings))
    failures = (failure(result, f" of the {name} filter") for name, result in results.items())
    session.end("what was done is kept", *failures)


def measures(result: Result) -> dict[str, Any]:
    """Compute the numbers of the table."""
    taken = result.weight[~np.isnan(result.weight)]
    numbers: dict[str, Any] = {
        "runs": len(result.status),
        "failed_runs": int(result.failed.sum()),
        "rmse_m": result.rmse_m,
        "rmse_standard_error_m": result.rmse_standard_error_m,
        "ranges_taken": int(result.taken.sum()),
        "too_late": int(result.too_late.sum()),
        "lost": int(result.lost.sum()),
        "overflowed": int(result.overflowed.sum()),
        "full_weight": float((taken == 1).mean()) if taken.size else np.nan,
        "rejected": float((taken == 0).mean()) if taken.size else np.nan,
        "recoveries": int(result.recoveries.sum()),
        "nees_mean": float(np.nanmean(result.nees)),
    }
    if taken.size:
        nis = metrics.nis_consistency(result.nis, 1)
        numbers["nis_mean"] = nis.mean
        numbers["nis_bounds_95"] = [nis.low, nis.high]
    return numbers


def means_per_step(results: dict[str, Result]) -> dict[str, Floats]:
    """Average over the runs, per step: errors and what the filter thinks of them."""
    steps = next(iter(results.values())).error.shape[1]
    table = {"time_s": np.arange(1.0, steps + 1)}
    for name, result in results.items():
        square = np.square(result.error).sum(axis=-1)
        variance = np.trace(result.covariance, axis1=-2, axis2=-1)
        table[f"{name}_rms_error_m"] = np.sqrt(mean_over_runs(square))
        table[f"{name}_sigma_m"] = np.sqrt(mean_over_runs(variance))
        table[f"{name}_nees"] = mean_over_runs(result.nees)
    return table


def _figure(results: dict[str, Result], kernel: str, kind: str) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    per_step = means_per_step(results)
    figure = plots.new_figure((9.0, 6.5), "Position error and weights")
    error, weights = figure.subplots(2, 1, sharex=True)
    names = {
        "plain": (kind.upper(), plots.FILTER_COLOURS[kind]),
        "robust": (kernel, plots.FILTER_COLOURS[f"robust-{kind}"]),
    }
    for name, result in results.items():
        label, colour = names[name]
        hours = per_step["time_s"] / 3600
        error.plot(hours, per_step[f"{name}_rms_error_m"], color=colour, label=label, linewidth=0.9)
        sigma = per_step[f"{name}_sigma_m"]
        error.plot(hours, sigma, "--", color=colour, label=f"{label}, its own sigma", linewidth=0.8)
        if name == "robust":
            taken = ~np.isnan(result.weight[0])
            weights.plot(hours[taken], result.weight[0][taken], ".", color=colour, markersize=3)
    plots.style(error, legend=8, ylabel="RMS error / m", ylim=(0, None))
    plots.style(weights, ylabel="weight, run 0", xlabel="time / h")
    return figure


def _table(values: dict[str, Any], settings: dict[str, Any]) -> Table:
    scenario = settings["scenario"]
    noise = scenario["noise"]
    shown = {name: values[name] for name in ("plain", "robust") if name in values}
    nis = "NIS, mean, rejected ones too (1 expected without outliers)"
    cells: dict[str, Callable[[dict[str, Any]], str]] = {
        "position RMSE / m": lambda v: f"{v['rmse_m']:.3f} ± {v['rmse_standard_error_m']:.1g}",
        "ranges taken": lambda v: f"{v['ranges_taken']}",
        "full weight": lambda v: f"{100 * v['full_weight']:.1f} %",
        "rejected": lambda v: f"{100 * v['rejected']:.1f} %",
        "recoveries": lambda v: f"{v['recoveries']}",
        "older than the memory": lambda v: f"{v['too_late']}",
        "lost in the water": lambda v: f"{v['lost']}",
        "too many in flight": lambda v: f"{v['overflowed']}",
        nis: lambda v: f"{v.get('nis_mean', np.nan):.3f}",
        "NEES, mean (2 expected)": lambda v: f"{v['nees_mean']:.3f}",
    }
    rows = [(name, *(cell(v) for v in shown.values())) for name, cell in cells.items()]
    if "improvement" in values:
        rows.append(("improvement", "", f"{100 * values['improvement']:.1f} %"))
    title = (
        f"{settings['filter'].upper()} and {settings['kernel']['name']}: "
        f"{counted(scenario['runs'], 'run')} of {scenario['steps']} s, "
        f"{noise['kind']} noise, timing {scenario['timing']}, seed {scenario['seed']}, "
        f"{settings['dtype']}"
    )
    return table(title, ("quantity", *shown), rows, right={1, 2})
