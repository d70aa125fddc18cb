"""``auvest simulate aukf``: the paper's scenario with any filter, interval policy and noise.

A station at (0.2, 2) m tracks a vehicle by range and bearing (Deng, Yin, Duan 2019, section 3).
The AUKF chooses its own sampling interval; ekf and ukf sample at a fixed one.

Examples
--------
  auvest simulate aukf

  auvest simulate aukf --filter ukf --fixed-interval 0.6 --noise lognormal

  auvest simulate aukf --interval covariance-budget --budget 0.08 --track turn

  auvest simulate aukf --preset table1 --json > table1.json
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer
from rich.table import Table

from auvest import CovarianceBudget, FixedInterval, MahalanobisInterval, RangeBearing, metrics
from auvest._texts import NIS_OFF, counted
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.options import (
    FILTER,
    MONTE_CARLO,
    WORLD,
    finite,
    fraction,
    open_unit,
    option,
    positive,
    refuse_given,
)
from auvest.commands.session import Floats, Session, failure
from auvest.intervals import IntervalPolicy
from auvest.simulation import paper_aukf
from auvest.simulation._runs import standard_error
from auvest.simulation.paper_aukf import FilterName, TrackName, observed_positions
from auvest.simulation.tracking import Scenario, TrackingResult, sensor_of, simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INTERVAL = "Sampling interval"

_NOISE = paper_aukf.paper_noise()
_LAW = MahalanobisInterval()

#: The interval policies, and which parameter of each an option is.
_POLICIES: dict[str, tuple[Callable[..., IntervalPolicy], dict[str, str]]] = {
    "fixed": (FixedInterval, {"fixed_interval": "interval_s"}),
    "covariance-budget": (CovarianceBudget, {"budget": "position_sigma_m"}),
    "mahalanobis": (MahalanobisInterval, {"preset": "preset", "tau0": "tau0"}),
}


def command(
    ctx: typer.Context,
    filter_name: Annotated[FilterName, option(FILTER, "The filter.", "--filter")] = "aukf",
    alpha: Annotated[
        float, option(FILTER, "Spread of the sigma points.", check=positive)
    ] = paper_aukf.ALPHA,
    beta: Annotated[
        float, option(FILTER, "Weight of prior knowledge.", check=finite)
    ] = paper_aukf.BETA,
    kappa: Annotated[
        float, option(FILTER, "Second scale of the sigma points, above -6.", check=finite)
    ] = paper_aukf.KAPPA,
    dtype: options.Precision = "float64",
    interval: Annotated[
        Literal["fixed", "mahalanobis", "covariance-budget"] | None,
        option(
            _INTERVAL,
            "Interval policy.",
            show_default="mahalanobis for aukf, fixed for ekf and ukf",
        ),
    ] = None,
    preset: Annotated[
        Literal["figure3", "table1"] | None,
        option(_INTERVAL, "Values of the paper's law (mahalanobis).", show_default=_LAW.preset),
    ] = None,
    tau0: Annotated[
        float | None,
        option(
            _INTERVAL,
            "First tau of the law, in (0, 1) (mahalanobis).",
            check=open_unit,
            show_default=f"{_LAW.tau0:g}",
        ),
    ] = None,
    fixed_interval: Annotated[
        float | None,
        option(
            _INTERVAL,
            "The fixed interval, s (fixed).",
            check=positive,
            show_default=f"{paper_aukf.FIXED_INTERVAL_S:g}",
        ),
    ] = None,
    budget: Annotated[
        float | None,
        option(
            _INTERVAL,
            "Position standard deviation allowed before an update, m (covariance-budget).",
            check=positive,
            show_default=f"{CovarianceBudget().position_sigma_m:g}",
        ),
    ] = None,
    track: Annotated[
        TrackName,
        option(
            WORLD,
            "paper: Eq. (4) as it is printed; straight: the same, exact in time; "
            f"turn: {paper_aukf.TURN_RATE_RAD_S:g} rad/s.",
        ),
    ] = "paper",
    noise: options.Noise = "normal",
    range_noise: options.RangeNoise = _NOISE.range_m,
    bearing_noise: options.BearingNoise = _NOISE.bearing_rad,
    noise_bias: Annotated[
        Literal["keep", "remove"],
        option(
            WORLD,
            "Uniform and lognormal noise have a mean: keep it, as in the paper, or remove it.",
        ),
    ] = "keep",
    dropout: Annotated[
        float, option(WORLD, "Probability that a measurement is missing.", check=fraction)
    ] = 0.0,
    steps: Annotated[
        int, option(MONTE_CARLO, "Samples of each run.", min=2, max=100_000)
    ] = paper_aukf.STEPS,
    runs: options.Runs = 200,
    seed: options.Seed = 1,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/simulate-aukf"),
    force: options.Force = False,
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if filter_name == "ekf":
        refuse_given(
            ctx, ("alpha", "beta", "kappa"), "belongs to --filter ukf or aukf, not to ekf."
        )
    given = {"preset": preset, "tau0": tau0, "fixed_interval": fixed_interval, "budget": budget}
    policy = _interval_policy(ctx, filter_name, interval, given)
    world = paper_aukf.paper_noise(
        noise,
        range_m=range_noise,
        bearing_rad=bearing_noise,
        centred=noise_bias == "remove",
        dropout=dropout,
    )
    with terminal.usage_errors():
        filter_ = paper_aukf.paper_filter(
            filter_name,
            noise=world,
            track=track,
            policy=policy,
            alpha=alpha,
            beta=beta,
            kappa=kappa,
            dtype=dtype,
        )
        scenario = Scenario(
            track=paper_aukf.paper_track(track),
            noise=world,
            steps=steps,
            runs=runs,
            seed=seed,
            interval_s=getattr(policy, "interval_s", paper_aukf.FIXED_INTERVAL_S),
        )
    settings = {
        "filter": filter_name,
        "interval": {"policy": type(policy).__name__, **asdict(policy)},
        **({} if filter_name == "ekf" else {"alpha": alpha, "beta": beta, "kappa": kappa}),
        "dtype": dtype,
        "track": track,
        "noise": asdict(world),
        "steps": steps,
        "runs": runs,
        "seed": seed,
    }
    session = Session(terminal, output, "simulate aukf", settings, force=force)
    result = session.run(simulate, filter_, scenario, workers=workers)
    values = measures(result)
    per_step = means_per_step(result)
    session.write_csv("per_step", per_step)
    session.write_csv("one_run", one_run(result, sensor_of(filter_)))
    if not no_figure:
        session.draw(_figure, result, sensor_of(filter_), filter_name, policy)
    session.report(values, _table(values, settings), per_step=per_step)
    kept = f"{values['runs']} of {runs} runs are done and kept"
    session.end(kept, failure(result))


def _interval_policy(
    ctx: typer.Context, filter_name: str, interval: str | None, given: Mapping[str, object]
) -> IntervalPolicy:
    """Build the policy that the options ask for; options of another policy are refused."""
    kind = interval or ("mahalanobis" if filter_name == "aukf" else "fixed")
    if filter_name != "aukf" and kind != "fixed":
        raise typer.BadParameter(
            f"'{kind}' needs --filter aukf; {filter_name} samples at a fixed interval.",
            param_hint="'--interval'",
        )
    for owner, (_, owned) in _POLICIES.items():
        if owner != kind:
            refuse_given(ctx, tuple(owned), f"belongs to --interval {owner}, not to {kind}.")
    make, names = _POLICIES[kind]
    try:
        return make(**{names[name]: given[name] for name in names if given[name] is not None})
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"'--interval {kind}'") from None


def measures(result: TrackingResult) -> dict[str, Any]:
    """Compute the numbers of the table."""
    runs = len(result.samples)
    square = np.square(result.error).sum(axis=-1)
    seen = np.isfinite(square).any(axis=1)
    per_run = np.nanmean(square[seen], axis=1)
    rmse = result.rmse_m
    nis = result.nis[np.isfinite(result.nis)]
    nis_bounds = metrics.chi2_bounds(2, nis.size) if nis.size else (np.nan, np.nan)
    nees = result.nees
    nees_per_step = _mean_per_step(nees)
    nees_bounds = metrics.chi2_bounds(2, int(seen.sum())) if seen.any() else (np.nan, np.nan)
    inside = (nees_per_step >= nees_bounds[0]) & (nees_per_step <= nees_bounds[1])
    interval = result.mean_interval_s
    return {
        "runs": runs,
        "failed_runs": int(result.failed.sum()),
        "samples": int(result.samples.sum()),
        "rmse_m": rmse,
        "rmse_standard_error_m": standard_error(per_run) / (2 * rmse) if rmse > 0 else np.nan,
        "rmse_x_m": metrics.rmse(result.error[..., :1]),
        "rmse_y_m": metrics.rmse(result.error[..., 1:]),
        "mean_interval_s": interval,
        "samples_per_second": 1 / interval if interval > 0 else np.nan,
        "nis_mean": _mean(result.nis),
        "nis_bounds_95": list(nis_bounds),
        "nees_mean": _mean(nees),
        "nees_bounds_95_per_step": list(nees_bounds),
        "nees_steps_inside": float(inside.mean()),
    }


def means_per_step(result: TrackingResult) -> dict[str, Floats]:
    """Average over the runs, per step: time, interval, errors, consistency."""
    led = np.diff(result.time_s, axis=1, prepend=0.0)
    error = result.error
    columns = {
        "time_s": result.time_s,
        "interval_s": led,
        "rms_error_x_m": np.square(error[..., 0]),
        "rms_error_y_m": np.square(error[..., 1]),
        "rmse_m": np.square(error).sum(axis=-1),
        "nis": result.nis,
        "nees": result.nees,
    }
    table = {"step": np.arange(1.0, led.shape[1] + 1)}
    for name, values in columns.items():
        mean = _mean_per_step(values)
        table[name] = np.sqrt(mean) if name.startswith("rms") else mean
    return table


def one_run(result: TrackingResult, sensor: RangeBearing, run: int = 0) -> dict[str, Floats]:
    """Collect everything about one run, per step."""
    truth, x, z = result.truth[run], result.x[run], result.z[run]
    seen = observed_positions(z, sensor.station)
    sigma = np.sqrt(np.diagonal(result.position_covariance[run], axis1=-2, axis2=-1))
    columns = {
        "step": np.arange(1.0, len(x) + 1),
        "time_s": result.time_s[run],
        "interval_s": np.diff(result.time_s[run], prepend=0.0),
        "true_x_m": truth[:, 0],
        "true_y_m": truth[:, 1],
        "range_m": z[:, 0],
        "bearing_rad": z[:, 1],
        "observed_x_m": seen[:, 0],
        "observed_y_m": seen[:, 1],
    }
    units = ("x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2")
    columns.update({f"estimated_{name}": x[:, i] for i, name in enumerate(units)})
    columns["sigma_x_m"], columns["sigma_y_m"] = sigma[:, 0], sigma[:, 1]
    columns["nis"] = result.nis[run]
    return columns


def _mean_per_step(values: Floats) -> Floats:
    return np.array([_mean(values[:, k]) for k in range(values.shape[1])])


def _mean(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else float("nan")


def _figure(
    result: TrackingResult, sensor: RangeBearing, name: str, policy: IntervalPolicy
) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    colour = plots.FILTER_COLOURS[name]
    led = np.diff(result.time_s, axis=1, prepend=0.0)
    known = np.where(np.isfinite(led), led, np.nan)
    mean = _mean_per_step(led)
    complete = known[np.isfinite(known).all(axis=1)]
    low, high = (np.quantile(complete, q, axis=0) if len(complete) else None for q in (0.05, 0.95))
    pace = [plots.Line("mean, 5 to 95 %", mean, low=low, high=high, colour=colour)]
    if not isinstance(policy, FixedInterval):
        fixed = np.full(len(mean), paper_aukf.FIXED_INTERVAL_S)
        pace.append(plots.Line("fixed, Table 1", fixed, colour=plots.BLACK, style="--"))
    sigma = np.sqrt(np.diagonal(result.position_covariance[0], axis1=-2, axis2=-1))
    noise = result.scenario.noise
    return plots.simulation_figure(
        result.truth[0],
        result.x[0, :, :2],
        observed_positions(result.z[0], sensor.station),
        station=sensor.station,
        time_s=result.time_s[0],
        error_m=result.error[0],
        sigma_m=sigma,
        intervals=pace,
        title=f"{name.upper()}, {noise.kind} noise {noise.range_m:g} m, {noise.bearing_rad:g} rad: "
        f"RMSE {result.rmse_m:.3g} m, mean interval {result.mean_interval_s:.3g} s",
        label=f"{name.upper()} estimate",
        colour=colour,
    )


def _table(values: dict[str, Any], settings: dict[str, Any]) -> Table:
    noise = settings["noise"]
    bias = ", bias removed" if noise["centred"] else ""
    low, high = values["nis_bounds_95"]
    nees_low, nees_high = values["nees_bounds_95_per_step"]
    rows = (
        ("position RMSE / m", f"{values['rmse_m']:.4f}",
         f"standard error {values['rmse_standard_error_m']:.1g}"),
        ("RMSE x, y / m", f"{values['rmse_x_m']:.4f}, {values['rmse_y_m']:.4f}", ""),
        ("mean interval / s", f"{values['mean_interval_s']:.4f}",
         f"{values['samples_per_second']:.3g} samples per second"),
        ("samples", f"{values['samples']}", "of all runs"),
        ("NIS, mean", f"{values['nis_mean']:.3f}",
         f"consistent: {low:.3f} to {high:.3f} (95 %, chi-square); {NIS_OFF}"),
        ("NEES of position, mean", f"{values['nees_mean']:.3f}",
         f"expected 2; {100 * values['nees_steps_inside']:.0f} % of steps within "
         f"{nees_low:.2f} to {nees_high:.2f}"),
        ("failed runs", f"{values['failed_runs']}", ""),
    )  # fmt: skip
    title = (
        f"{settings['filter'].upper()}, {settings['interval']['policy']}: "
        f"{counted(values['runs'], 'run')} of {settings['steps']} steps, {noise['kind']} noise "
        f"({noise['range_m']:g} m, {noise['bearing_rad']:g} rad{bias}), "
        f"track {settings['track']}, seed {settings['seed']}, {settings['dtype']}"
    )
    return table(title, ("quantity", "value", "note"), rows, right={1})
