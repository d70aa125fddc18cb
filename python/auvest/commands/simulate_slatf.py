"""``auvest simulate slatf``: the SLATF paper's scenario with any filter and noise.

Communication fails for 400 s; a slave that can only dead-reckon pings its master (Lu, Chen, Liu,
Ma, He 2020, section 7). Finished runs are kept: the same command goes on where it was stopped.

Examples
--------
  auvest simulate slatf

  auvest simulate slatf --filter slatf1 --level 4 --particles 1000

  auvest simulate slatf --masters 3 --association unknown --gate 16

  auvest simulate slatf --filter ekf-slat --runs 1000 --table parquet --json > ekf.json

  auvest simulate slatf --runs 1 --log --output sea

  auvest replay sea/log --config sea/log/auvest.toml
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
import typer
from rich.table import Table

from auvest import metrics, montecarlo
from auvest._texts import counted
from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.options import (
    FILTER,
    WORLD,
    fraction,
    not_negative,
    option,
    positive,
    refuse_given,
)
from auvest.commands.session import Floats, Session, failure, mean_over_runs
from auvest.commands.version import version
from auvest.simulation.paper_slatf import LEVELS, PARTICLES, RUNS, FilterName, paper_filter
from auvest.simulation.slat import SlatResult, SlatScenario, paper_masters, simulate
from auvest.simulation.slat_log import write_log
from auvest.slat import MAX_MASTERS, Lanes, ParticleSlatFilter, Resampling, Slatf

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FilterOption = Literal["slatf1", "slatf2", "slatf-joint", "ekf-slat", "dead-reckoning"]
_PARTICLE_FILTERS: tuple[FilterOption, ...] = ("slatf1", "slatf2", "slatf-joint")
#: Names in the paper's scenario, and titles.
_FILTERS: dict[FilterOption, tuple[FilterName, str]] = {
    "slatf1": ("slatf1", "SLATF 1.0"),
    "slatf2": ("slatf2", "SLATF 2.0"),
    "slatf-joint": ("slatf_joint", "SLATF, joint"),
    "ekf-slat": ("ekf_slat", "EKF-SLAT"),
    "dead-reckoning": ("dr_compensated", "dead reckoning"),
}


def command(
    ctx: typer.Context,
    filter_name: Annotated[FilterOption, option(FILTER, "The filter.", "--filter")] = "slatf2",
    particles: Annotated[
        int, option(FILTER, "N (slatf1, slatf2, slatf-joint).", min=1, max=1_000_000)
    ] = PARTICLES,
    resampling: Annotated[
        Resampling, option(FILTER, "Resampling policy (slatf1, slatf2, slatf-joint).")
    ] = "systematic",
    gate: Annotated[
        float,
        option(FILTER, "NIS beyond which an echo says nothing; 0: no gate.", check=not_negative),
    ] = 0.0,
    heading_bias: Annotated[
        Literal["compensate", "keep"],
        option(FILTER, "Bias of the heading's noise: make up for it, or keep it, as in the paper."),
    ] = "compensate",
    dtype: options.Precision = "float64",
    lanes: Annotated[
        Lanes | None,
        option(
            FILTER,
            "Instruction set of the particles; the bits are the same.",
            show_default="the widest here",
        ),
    ] = None,
    level: Annotated[int, option(WORLD, "Noise level of section 7.", min=1, max=len(LEVELS))] = 3,
    range_noise: Annotated[
        float | None,
        option(WORLD, "Noise of the range, m.", check=positive, show_default="of the level"),
    ] = None,
    bearing_noise: Annotated[
        float | None,
        option(WORLD, "Noise of the bearing, rad.", check=positive, show_default="of the level"),
    ] = None,
    masters: Annotated[int, option(WORLD, "Masters.", min=1, max=MAX_MASTERS)] = 1,
    association: Annotated[
        Literal["known", "unknown"], option(WORLD, "Whether the slave knows whose echo it hears.")
    ] = "known",
    plan: Annotated[
        Literal["known", "unknown"],
        option(WORLD, "Whether the slave knows how the masters turn, u of Eq. (4)."),
    ] = "known",
    dropout: Annotated[
        float, option(WORLD, "Probability that an echo is lost.", check=fraction)
    ] = 0.0,
    outlier: Annotated[
        float,
        option(
            WORLD, "Probability that an echo is wrong by 100 standard deviations.", check=fraction
        ),
    ] = 0.0,
    duration: Annotated[
        float, option(WORLD, "Length of the outage, s.", check=positive)
    ] = SlatScenario().duration_s,
    runs: options.Runs = RUNS,
    seed: options.Seed = 1,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/simulate-slatf"),
    table: Annotated[
        Literal["csv", "parquet"], option("Output", "Format of the table of runs.")
    ] = "csv",
    log: Annotated[
        bool,
        option("Output", "Also write the first run as a log, with its settings.", "--log"),
    ] = False,
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if filter_name not in _PARTICLE_FILTERS:
        refuse_given(ctx, ("particles", "resampling"), "belongs to slatf1, slatf2 and slatf-joint.")
    if filter_name not in ("slatf1", "slatf2"):
        refuse_given(ctx, ("lanes",), "belongs to slatf1 and slatf2.")
    if filter_name == "dead-reckoning":
        refuse_given(ctx, ("gate", "log"), "does nothing: dead reckoning hears no echo.")
    name, title = _FILTERS[filter_name]
    noise = LEVELS[level - 1]
    with terminal.usage_errors():
        scenario = SlatScenario(
            masters=paper_masters(masters),
            duration_s=duration,
            sigma_range_m=noise.sigma_range_m if range_noise is None else range_noise,
            sigma_bearing_rad=noise.sigma_bearing_rad if bearing_noise is None else bearing_noise,
            identified=association == "known",
            plan_known=plan == "known",
            dropout=dropout,
            outlier=outlier,
            runs=runs,
            seed=seed,
        )
        hearing: dict[str, Any] = {"gate": gate}
        if filter_name in _PARTICLE_FILTERS:
            hearing["resampling"] = resampling
        if filter_name in ("slatf1", "slatf2"):
            hearing["lanes"] = lanes
        filter_ = paper_filter(
            name,
            scenario,
            particles=particles,
            compensate_bias=heading_bias == "compensate",
            dtype=dtype,
            **hearing,
        )
    settings = {
        "filter": filter_name,
        **(
            {"particles": particles, "resampling": resampling}
            if isinstance(filter_, ParticleSlatFilter)
            else {}
        ),
        **({"lanes": filter_.lanes} if isinstance(filter_, Slatf) else {}),
        "gate": gate,
        "heading_bias": heading_bias,
        "dtype": dtype,
        "scenario": asdict(scenario),
    }
    session = Session(terminal, output, "simulate slatf", settings, force=force)
    store = output.with_name(f"{output.name}.runs")
    identity = _identity(settings)
    with terminal.writing(output):
        result = session.run(
            simulate, filter_, scenario, workers=workers, store=store, settings=identity
        )
    values = measures(result)
    per_ping = means_per_ping(result)
    session.write_csv("per_ping", per_ping)
    with terminal.writing(output):
        session.add("runs", montecarlo.write_table(session.part / f"runs.{table}", per_run(result)))
    if log:
        with terminal.writing(output), terminal.usage_errors():
            write_log(session.part / "log", filter_, scenario)
            session.add("log", session.part / "log")
    if not no_figure:
        session.draw(_figure, result, title)
    session.report(values, _table(values, scenario, title), per_ping=per_ping)
    kept = f"{values['runs']} of {runs} runs are done and kept; the same command goes on from there"
    if not session.interrupted:
        montecarlo.discard(store)
    session.end(kept, failure(result))


def _identity(settings: dict[str, Any]) -> dict[str, Any]:
    """Say what a run depends on: neither their number nor the lanes."""
    scenario = {name: value for name, value in settings["scenario"].items() if name != "runs"}
    kept = {name: value for name, value in settings.items() if name != "lanes"}
    return {**kept, "scenario": scenario, "version": version()}


def measures(result: SlatResult) -> dict[str, Any]:
    """Compute the numbers of the table."""
    return {
        "runs": len(result.status),
        "failed_runs": int(result.failed.sum()),
        "rmse_m": result.rmse_m,
        "rmse_standard_error_m": result.rmse_standard_error_m,
        "mean_error_m": float(np.nanmean(result.distance_m)),
        "end_error_m": float(np.sqrt(mean_over_runs(np.square(result.distance_m[:, -1:]))[0])),
        "master_rmse_m": metrics.rmse(result.master_error),
        "nees_mean": float(np.nanmean(result.nees)),
        "covered_95": result.covered,
        "resamplings_per_run": float(result.resamplings.mean()),
        "echoes_per_run": float(result.heard.mean()),
    }


def means_per_ping(result: SlatResult) -> dict[str, Floats]:
    """Average over the runs, per ping."""
    master = np.square(result.master_error).sum(axis=-1).mean(axis=-1)
    return {
        "time_s": result.time_s,
        "rms_error_m": np.sqrt(mean_over_runs(np.square(result.distance_m))),
        "mean_error_m": mean_over_runs(result.distance_m),
        "master_rms_error_m": np.sqrt(mean_over_runs(master)),
        "nees": mean_over_runs(result.nees),
        "effective_size": mean_over_runs(result.effective_size),
    }


def per_run(result: SlatResult) -> dict[str, npt.NDArray[Any]]:
    """Collect one row per run, with its number."""
    return {"run": np.arange(len(result.status)), **result.per_run()}


def _figure(result: SlatResult, title: str) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    scenario = result.scenario
    name = f"{title}: RMSE {result.rmse_m:.3g} m, {scenario.sigma_range_m:g} m"
    return plots.slave_figure(
        result.truth,
        result.truth + result.error[0],
        result.masters,
        time_s=result.time_s,
        error_m=result.distance_m[0],
        sigma_m=np.sqrt(np.trace(result.covariance[0], axis1=-2, axis2=-1)),
        rms_m=means_per_ping(result)["rms_error_m"],
        title=f"{name}, {scenario.sigma_bearing_rad:g} rad",
    )


def _table(values: dict[str, Any], scenario: SlatScenario, title: str) -> Table:
    rows = {
        "position RMSE / m": f"{values['rmse_m']:.2f} ± {values['rmse_standard_error_m']:.2f}",
        "mean error / m": f"{values['mean_error_m']:.2f}",
        "rms error at the end / m": f"{values['end_error_m']:.2f}",
        "RMSE of the masters / m": f"{values['master_rmse_m']:.2f}",
        "mean NEES (2 expected)": f"{values['nees_mean']:.2f}",
        "truth in the 95 % ellipse": f"{100 * values['covered_95']:.0f} %",
        "resamplings per run": f"{values['resamplings_per_run']:.1f}",
        "echoes per run": f"{values['echoes_per_run']:.1f}",
        "failed runs": f"{values['failed_runs']}",
    }
    text = (
        f"{title}: {counted(values['runs'], 'run')} of {scenario.duration_s:g} s, sonar "
        f"{scenario.sigma_range_m:g} m, {scenario.sigma_bearing_rad:g} rad, "
        f"{counted(len(scenario.masters), 'master')}, seed {scenario.seed}"
    )
    return console.table(text, ("measure", "value"), rows.items(), right={1})
