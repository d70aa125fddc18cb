"""Two cases for the filters that cost more than EKF-SLAT: SLATF with joint Gaussians, and an IMM.

:func:`measure` runs them, :func:`page` writes the numbers up, :func:`write` makes the folder. All
is simulated; all filters of a case meet the same noise, so they are compared run by run.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from auvest import (
    ConstantAcceleration,
    ConstantVelocity,
    CoordinatedTurn,
    EkfSlat,
    Imm,
    PiecewiseAcceleration,
    Slatf,
    SlatfJoint,
)
from auvest._arguments import Floats
from auvest.reproduce import markdown
from auvest.scenarios.paper_slatf import LEVELS, PARTICLES, paper_scenario
from auvest.scenarios.slat import SlatResult, SlatScenario, Vehicle, simulate
from auvest.slat import SlatFilter
from auvest.slat.models import Master

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEFAULT_RUNS = 40
DEFAULT_SEED = 1

#: Course and speed of all masters, and the turn, are its.
PAPER_MASTER = SlatScenario().masters[0]

# ---- Two masters that cross ----------------------------------------------------------------------

#: They start so far apart, abeam of each other, meet after this time, and go on.
GAP_M = 50.0
MEET_S = 100.0
#: Where the middle between them starts; the slave starts at (0, 0) m.
AHEAD_M = (0.0, 100.0)
#: Sonars of the paper that cannot tell the two apart when they meet.
CROSSING_LEVELS = (LEVELS[0], LEVELS[1])
#: A run has swapped its masters at the end if it has in most of the last pings.
LAST_PINGS = 10

CROSSING_FILTERS: Mapping[str, str] = {
    "told": "EKF-SLAT, told whose echo it is",
    "ekf_slat": "EKF-SLAT",
    "slatf2": "SLATF 2.0",
    "slatf_joint": "SLATF, joint",
}

# ---- A master that turns -------------------------------------------------------------------------

#: What each single model is tried with; the best is compared: process noise of the paper's model of
#: constant acceleration (m/s^2), and of constant velocity (m^2/s^3).
ACCELERATIONS_M_S2 = (1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
VELOCITY_PSDS = (1e-2, 1e-1, 3e-1, 1.0, 3.0, 10.0)

#: The IMM, the same for both: masters hold what they do (hardly any noise in any model) and change
#: it once in 200 s; a manoeuvre begins with 0.1 m/s^2, 1 degree per second at 10 kn.
VELOCITY_PSD, ACCELERATION_PSD, SWITCH_RATE_HZ = 1e-5, 1e-6, 0.005
SHARE = (0.6, 0.2, 0.2)
#: The same with one number changed, to see what hangs on it.
IMM_CHANGES: Mapping[str, tuple[float, float, float]] = {
    "switching 4 times as often": (VELOCITY_PSD, ACCELERATION_PSD, 4 * SWITCH_RATE_HZ),
    "10 times the noise in the straight model": (
        10 * VELOCITY_PSD,
        ACCELERATION_PSD,
        SWITCH_RATE_HZ,
    ),
    "10 times the noise in the other two": (VELOCITY_PSD, 10 * ACCELERATION_PSD, SWITCH_RATE_HZ),
}

#: The paper's scenario at level 3, the master's plan unknown; and with better dead reckoning.
TURNING_LEVEL = LEVELS[2]
PRECISE_SPEED_M_S, PRECISE_HEADING_RAD = 0.2, 0.03


def crossing_scenario(level: int, *, runs: int, seed: int) -> SlatScenario:
    """Make the scenario of two masters that cross, heard by the sonar of ``CROSSING_LEVELS``."""
    course, speed = PAPER_MASTER.heading_rad, PAPER_MASTER.speed_m_s
    inwards = math.asin(GAP_M / 2 / (speed * MEET_S))
    masters = tuple(
        Vehicle(
            x_m=AHEAD_M[0] - side * GAP_M / 2 * math.sin(course),
            y_m=AHEAD_M[1] + side * GAP_M / 2 * math.cos(course),
            heading_rad=course - side * inwards,
            speed_m_s=speed,
            turn_rate_rad_s=0.0,
        )
        for side in (1, -1)
    )
    paper = paper_scenario(CROSSING_LEVELS[level], runs=runs, seed=seed)
    return replace(paper, masters=masters, duration_s=2 * MEET_S, identified=False)


def turning_scenario(*, precise: bool, runs: int, seed: int) -> SlatScenario:
    """Make the scenario of one master that turns, and nobody has said so."""
    paper = replace(paper_scenario(TURNING_LEVEL, runs=runs, seed=seed), plan_known=False)
    if not precise:
        return paper
    return replace(paper, sigma_speed_m_s=PRECISE_SPEED_M_S, sigma_heading_rad=PRECISE_HEADING_RAD)


def imm(
    velocity_psd: float = VELOCITY_PSD,
    acceleration_psd: float = ACCELERATION_PSD,
    switch_rate_hz: float = SWITCH_RATE_HZ,
    share: tuple[float, float, float] = SHARE,
) -> Imm:
    """Make the master's three models."""
    return Imm(
        straight=ConstantVelocity(velocity_psd=velocity_psd, sigma_acceleration_m_s2=0.1),
        accelerated=ConstantAcceleration(
            position_psd=0.0, velocity_psd=0.0, acceleration_psd=acceleration_psd
        ),
        turning=CoordinatedTurn(
            position_psd=0.0, velocity_psd=0.0, acceleration_psd=acceleration_psd, slow_m_s=0.1
        ),
        share=share,
        switch_rate_hz=switch_rate_hz,
    )


def slat_filter(name: str, scenario: SlatScenario, particles: int = PARTICLES) -> SlatFilter:
    """Set up a filter of the crossing: it knows the noise of all sensors."""
    x0, P0 = _start(scenario)
    master, motion, sonar = PiecewiseAcceleration(), scenario.motion, scenario.sonar
    if name == "slatf2":
        return Slatf(
            x0, P0, version=2, particles=particles, motion=motion, master=master, sonar=sonar
        )
    if name == "slatf_joint":
        room = len(scenario.masters)
        return SlatfJoint(
            x0, P0, particles=particles, max_masters=room, motion=motion, master=master, sonar=sonar
        )
    return ekf_slat(scenario, master)


def ekf_slat(scenario: SlatScenario, master: Master) -> EkfSlat:
    """Set up EKF-SLAT with a model of the master."""
    x0, P0 = _start(scenario)
    return EkfSlat(x0, P0, motion=scenario.motion, master=master, sonar=scenario.sonar)


def _start(scenario: SlatScenario) -> tuple[Floats, Floats]:
    """Return where the slave starts, which it knows."""
    return np.array([scenario.slave.x_m, scenario.slave.y_m]), np.zeros((2, 2))


@dataclass(frozen=True)
class Cases:
    """Everything measured: numbers for JSON and the page, curves for the figures."""

    results: dict[str, Any]
    curves: dict[str, Floats]


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    particles: int = PARTICLES,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Cases:
    """Run both cases.

    Parameters
    ----------
    runs : int
        Monte Carlo runs of each filter, at least 2.
    seed : int
        Of the noise.
    particles : int
        Of SLATF 2.0 and joint.
    workers : int, optional
        Threads.
    progress : callable, optional
        ``progress(done, total)`` in runs.
    """
    jobs = len(CROSSING_LEVELS) * len(CROSSING_FILTERS)
    jobs += 2 * (len(ACCELERATIONS_M_S2) + len(VELOCITY_PSDS) + 1 + len(IMM_CHANGES))
    done = 0

    def fly(prototype: SlatFilter, scenario: SlatScenario) -> SlatResult:
        nonlocal done
        report = None
        if progress is not None:
            report = lambda part, _: progress(done + part, jobs * runs)  # noqa: E731
        result = simulate(prototype, scenario, workers=workers, progress=report)
        done += runs
        return result

    curves: dict[str, Floats] = {}
    crossing = [
        _crossing(k, fly, crossing_scenario(k, runs=runs, seed=seed), particles, curves)
        for k in range(len(CROSSING_LEVELS))
    ]
    turning = [
        _turning(fly, turning_scenario(precise=precise, runs=runs, seed=seed), curves, str(precise))
        for precise in (False, True)
    ]
    results = {
        "runs": runs,
        "seed": seed,
        "particles": particles,
        "crossing": crossing,
        "turning": turning,
    }
    return Cases(results, curves)


Fly = Callable[[SlatFilter, SlatScenario], SlatResult]


def _crossing(
    number: int, fly: Fly, scenario: SlatScenario, particles: int, curves: dict[str, Floats]
) -> dict[str, Any]:
    found: dict[str, SlatResult] = {}
    for name in CROSSING_FILTERS:
        world = replace(scenario, identified=name == "told")
        found[name] = fly(slat_filter(name, world, particles), world)
    ends = {
        name: swapped(result)[:, -LAST_PINGS:].mean(axis=1) > 0.5 for name, result in found.items()
    }
    if number == 0:
        curves["crossing_time_s"] = found["ekf_slat"].time_s
        for name in CROSSING_FILTERS:
            curves[f"crossing_swapped_{name}"] = swapped(found[name]).mean(axis=0)
        wrong = np.flatnonzero(ends["ekf_slat"] & ~ends["slatf_joint"])
        shown = int(wrong[0]) if wrong.size else 0
        curves["crossing_masters"] = found["ekf_slat"].masters
        for name in ("ekf_slat", "slatf_joint"):
            curves[f"crossing_{name}"] = found[name].masters + found[name].master_error[shown]
    masters = {name: _rmse(result.master_error) for name, result in found.items()}
    slaves = {name: result.run_rmse_m for name, result in found.items()}
    return {
        "sigma_range_m": scenario.sigma_range_m,
        "sigma_bearing_rad": scenario.sigma_bearing_rad,
        "filters": {
            name: {
                "slave_rmse_m": _mean(slaves[name]),
                "master_rmse_m": _mean(masters[name]),
                "swapped": float(ends[name].mean()),
                "covered": result.covered,
                "failed_runs": int(result.failed.sum()),
            }
            for name, result in found.items()
        },
        "joint_less_ekf_slat": {
            "slave_rmse_m": _mean(slaves["slatf_joint"] - slaves["ekf_slat"]),
            "master_rmse_m": _mean(masters["slatf_joint"] - masters["ekf_slat"]),
        },
        "joint_less_slatf2": {
            "slave_rmse_m": _mean(slaves["slatf_joint"] - slaves["slatf2"]),
            "master_rmse_m": _mean(masters["slatf_joint"] - masters["slatf2"]),
        },
    }


def _turning(
    fly: Fly, scenario: SlatScenario, curves: dict[str, Floats], label: str
) -> dict[str, Any]:
    models: dict[str, list[tuple[str, Master]]] = {
        "constant acceleration": [
            (f"{q:g} m/s^2", PiecewiseAcceleration(acceleration_m_s2=q)) for q in ACCELERATIONS_M_S2
        ],
        "constant velocity": [
            (f"{psd:g} m^2/s^3", imm(velocity_psd=psd, share=(1.0, 0.0, 0.0)))
            for psd in VELOCITY_PSDS
        ],
        "IMM": [
            ("as set", imm()),
            *((what, imm(*changes)) for what, changes in IMM_CHANGES.items()),
        ],
    }
    rows: list[dict[str, Any]] = []
    relative: dict[str, Floats] = {}
    slave: dict[str, Floats] = {}
    for model, variants in models.items():
        found = [(what, fly(ekf_slat(scenario, master), scenario)) for what, master in variants]
        apart = [_rmse(result.master_error - result.error[:, :, None]) for _, result in found]
        # The IMM is taken as it is set, the others with the noise that suits them best.
        best = 0 if model == "IMM" else int(np.argmin([one.mean() for one in apart]))
        relative[model], slave[model] = apart[best], found[best][1].run_rmse_m
        square = np.square(found[best][1].master_error[:, :, 0] - found[best][1].error).sum(axis=-1)
        curves[f"turning_{label}_{model}"] = np.sqrt(square.mean(axis=0))
        curves["turning_time_s"] = found[best][1].time_s
        for k, (what, result) in enumerate(found):
            rows.append(
                {
                    "model": model,
                    "noise": what,
                    "compared": k == best,
                    "relative_rmse_m": _mean(apart[k]),
                    "slave_rmse_m": _mean(result.run_rmse_m),
                    "covered": result.covered,
                    "failed_runs": int(result.failed.sum()),
                }
            )
    return {
        "sigma_speed_m_s": scenario.sigma_speed_m_s,
        "sigma_heading_rad": scenario.sigma_heading_rad,
        "models": rows,
        "imm_less": {
            model: {
                "relative_rmse_m": _mean(relative["IMM"] - relative[model]),
                "slave_rmse_m": _mean(slave["IMM"] - slave[model]),
            }
            for model in ("constant acceleration", "constant velocity")
        },
    }


def swapped(result: SlatResult) -> npt.NDArray[np.bool_]:
    """Say where the two masters are taken for each other, shape (runs, pings).

    There the two estimates lie, in sum, nearer to the true position of the other master.
    """
    estimate = result.master_error + result.masters
    apart = estimate[:, :, :, None, :] - result.masters[None, :, None, :, :]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    right = distance[..., 0, 0] + distance[..., 1, 1]
    wrong: npt.NDArray[np.bool_] = distance[..., 0, 1] + distance[..., 1, 0] < right
    return wrong


def _rmse(error: Floats) -> Floats:
    """Root mean square of each run over pings and masters of errors (runs, pings, M, 2)."""
    per_run: Floats = np.sqrt(np.square(error).sum(axis=-1).mean(axis=(1, 2)))
    return per_run


def _mean(per_run: Floats) -> dict[str, float]:
    error = per_run.std(ddof=1) / math.sqrt(len(per_run))
    return {"mean": float(per_run.mean()), "standard_error": float(error)}


# ---- The page ------------------------------------------------------------------------------------

#: A difference counts from so many standard errors on.
CLEAR = 2.0


def lower(difference: Mapping[str, float]) -> bool:
    """Say whether a mean difference lies clearly below zero."""
    return difference["mean"] < -CLEAR * difference["standard_error"]


def page(results: Mapping[str, Any]) -> str:
    """Return the Markdown page of :attr:`Cases.results`."""
    text = f"""# Where the larger SLAT filters earn their place

Made by `auvest reproduce slat-cases --runs {results["runs"]} --seed {results["seed"]} --particles
{results["particles"]}`; do not edit. The numbers are also in results.json. All is simulated: the
vehicles, speeds and sensors of the SLATF paper's section 7 (docs/reproduction/slatf), where one
Gaussian (EKF-SLAT) was all that was needed, in two situations that it does not have. Means over
{results["runs"]} runs ± one standard error; differences are taken run by run, on the same noise,
and are called clear from {CLEAR:g} standard errors on.

In short:

- **Two masters that cross**, and echoes that do not say whose they are:
  {_crossing_in_short(results)}
- **A master that turns**, and nobody has said so: {_turning_in_short(results)}

"""
    parts = (markdown.fill(text).rstrip() + "\n", _crossing_page(results), _turning_page(results))
    return "\n".join(parts)


def _pm(value: Mapping[str, float], decimals: int = 1) -> str:
    return f"{value['mean']:.{decimals}f} ± {value['standard_error']:.{decimals}f}"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _crossing_in_short(results: Mapping[str, Any]) -> str:
    won = [row for row in results["crossing"] if lower(row["joint_less_ekf_slat"]["master_rmse_m"])]
    first = (won or results["crossing"])[0]
    ekf, joint = (first["filters"][name] for name in ("ekf_slat", "slatf_joint"))
    numbers = (
        f"EKF-SLAT ends with the two masters swapped in {_percent(ekf['swapped'])} of the runs, "
        f"SlatfJoint in {_percent(joint['swapped'])}; RMSE of the masters "
        f"{_pm(ekf['master_rmse_m'])} m and {_pm(joint['master_rmse_m'])} m."
    )
    if not won:
        return f"no case for SlatfJoint was found here. {numbers}"
    sonars = f"{len(won)} of {len(results['crossing'])} sonars"
    return f"SlatfJoint follows the masters clearly better with {sonars}. {numbers}"


def _turning_in_short(results: Mapping[str, Any]) -> str:
    verdicts = [
        all(lower(difference["relative_rmse_m"]) for difference in case["imm_less"].values())
        for case in results["turning"]
    ]
    numbers = "; ".join(
        f"with odometry of {case['sigma_speed_mps']:g} m/s and {case['sigma_heading_rad']:g} rad "
        + ", ".join(
            f"{_pm(row['relative_rmse_m'], 2)} m ({row['model']})"
            for row in reversed(case["models"])
            if row["compared"]
        )
        for case in results["turning"]
    )
    numbers = f"RMSE of the master's position relative to the slave's, {numbers}."
    if not all(verdicts):
        return f"the IMM is clearly better in {sum(verdicts)} of {len(verdicts)} cases. {numbers}"
    return f"the IMM is clearly better than either model alone with its best noise. {numbers}"


def _crossing_page(results: Mapping[str, Any]) -> str:
    text = f"""## Two masters that cross

The masters start {GAP_M:g} m apart, abeam of each other, the middle of the two at ({AHEAD_M[0]:g},
{AHEAD_M[1]:g}) m, on courses that meet after {MEET_S:g} s, at {PAPER_MASTER.speed_m_s:g} m/s; the
slave starts at (0, 0) m. It hears both every 2 s for {2 * MEET_S:g} s, and the echoes do not say
whose they are. EKF-SLAT gives the echoes of a ping to the masters in the way that is likeliest at
that moment, and cannot take it back. SLATF does so in each of {results["particles"]} particles,
which need not agree, and later echoes weigh them.

Swapped: runs in which, in most of the last {LAST_PINGS} pings, the two estimates lie nearer to the
other master. Covered: share of the pings at which the slave lies in its 95 % ellipse.
"""
    parts = [markdown.fill(text)]
    for row in results["crossing"]:
        parts.append(
            f"Sonar: {row['sigma_range_m']:g} m, {row['sigma_bearing_rad']:g} rad.\n\n"
            + markdown.table(
                ["filter", "masters / m", "swapped", "slave / m", "covered"],
                [
                    [
                        CROSSING_FILTERS[name],
                        _pm(numbers["master_rmse_m"]),
                        _percent(numbers["swapped"]),
                        _pm(numbers["slave_rmse_m"]),
                        _percent(numbers["covered"]),
                    ]
                    for name, numbers in row["filters"].items()
                ],
            ).rstrip()
        )
        parts.append(
            markdown.fill(
                " ".join(
                    f"SlatfJoint less {rival}, run by run: masters "
                    f"{_pm(row[key]['master_rmse_m'])} m, slave {_pm(row[key]['slave_rmse_m'])} m."
                    for key, rival in (
                        ("joint_less_ekf_slat", "EKF-SLAT"),
                        ("joint_less_slatf2", "SLATF 2.0"),
                    )
                )
            )
        )
    parts.append("![Two masters that cross](crossing.png)")
    parts.append(markdown.fill(_crossing_moral(results)))
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _crossing_moral(results: Mapping[str, Any]) -> str:
    against = [row["joint_less_slatf2"] for row in results["crossing"]]
    slave = sum(lower(one["slave_rmse_m"]) for one in against)
    masters = sum(lower(one["master_rmse_m"]) for one in against)
    worse = sum(
        lower({**one["master_rmse_m"], "mean": -one["master_rmse_m"]["mean"]}) for one in against
    )
    return (
        "Against SLATF 2.0, whose particles are cheaper, SlatfJoint is clearly better for the "
        f"slave with {slave} of {len(against)} sonars, for the masters with {masters}, and clearly "
        f"worse for the masters with {worse}. Any particles keep both answers; those of SlatfJoint "
        "also keep the drift that slave and masters share, which shows in what they claim "
        "(covered)."
    )


def _turning_page(results: Mapping[str, Any]) -> str:
    text = f"""## A master that turns

One master, {PAPER_MASTER.y_m:g} m to the side, goes straight for {PAPER_MASTER.turn_start_s:g} s
and then turns at {math.degrees(PAPER_MASTER.turn_rate_rad_s):.1f} degrees per second (the paper's
track), heard to
{TURNING_LEVEL.sigma_range_m:g} m and {TURNING_LEVEL.sigma_bearing_rad:g} rad; the filter does not
know the plan. EKF-SLAT with each model of the master: the paper's constant acceleration and
constant velocity, each with the noise that gives the lowest relative error of those tried; and the
IMM of straight, accelerated and turning motion, with one setting for both cases (velocity noise
{VELOCITY_PSD:g} m^2/s^3, acceleration noise {ACCELERATION_PSD:g} m^2/s^5, {SWITCH_RATE_HZ:g}
switches per second, shares {markdown.series(SHARE, 1)}), and with one number of it changed.

Relative: RMSE of the master's position relative to the slave's, what the sonar sees of the pair and
what keeps the two together.
"""
    parts = [markdown.fill(text)]
    for case in results["turning"]:
        parts.append(
            f"Odometry: {case['sigma_speed_m_s']:g} m/s, {case['sigma_heading_rad']:g} rad.\n\n"
            + markdown.table(
                ["model", "noise", "relative / m", "slave / m", "covered"],
                [
                    [
                        f"**{row['model']}**" if row["compared"] else row["model"],
                        row["noise"],
                        _pm(row["relative_rmse_m"], 2),
                        _pm(row["slave_rmse_m"], 2),
                        _percent(row["covered"]),
                    ]
                    for row in case["models"]
                ],
            ).rstrip()
        )
        parts.append(
            markdown.fill(
                "In bold: compared. "
                + " ".join(
                    f"IMM less {model}, run by run: relative "
                    f"{_pm(difference['relative_rmse_m'], 2)} m, slave "
                    f"{_pm(difference['slave_rmse_m'], 2)} m."
                    for model, difference in case["imm_less"].items()
                )
            )
        )
    parts.append("![A master that turns](turning.png)")
    parts.append(
        markdown.fill(
            "A single model with little noise cannot follow the turn, and one with enough for it "
            "learns nothing on the straight, where the slave could learn from the master. "
            "The IMM has both, and says which holds (`mode_probabilities`). On real robots, which "
            "stop and turn within seconds, it buys little (docs/reproduction/mrclam6)."
        )
    )
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


# ---- Figures and files ---------------------------------------------------------------------------


def write(
    folder: Path, cases: Cases, *, header: Mapping[str, Any] | None = None
) -> dict[str, Path]:
    """Write README.md, results.json and the figures to an existing folder; return their paths.

    ``header`` goes before the results in results.json: command and version.
    """
    from auvest import plots  # here, because matplotlib takes long to import

    files = {name: folder / name for name in ("README.md", "results.json")}
    document = {**(header or {}), **cases.results}
    files["results.json"].write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    files["README.md"].write_text(page(cases.results), encoding="utf-8")
    for name, figure in (
        ("crossing.png", _crossing_figure(cases)),
        ("turning.png", _turning_figure(cases)),
    ):
        files[name] = plots.save(figure, folder / name)
    return files


def _crossing_figure(cases: Cases) -> Figure:
    from auvest import plots

    curves = cases.curves
    colours = {
        "told": plots.GREY,
        "ekf_slat": plots.GREEN,
        "slatf2": plots.BLUE,
        "slatf_joint": plots.ORANGE,
    }
    sonar = cases.results["crossing"][0]
    figure = plots.new_figure(
        (11.0, 4.6),
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
    one_run.set(xlabel="time / s", ylabel="one run: place across the course / m")
    one_run.legend(fontsize=7)
    for name, title in CROSSING_FILTERS.items():
        percent = 100 * curves[f"crossing_swapped_{name}"]
        share.plot(time_s, percent, color=colours[name], label=title)
    share.axvline(MEET_S, color=plots.BLACK, linewidth=0.6)
    share.set(xlabel="time / s", ylabel="runs with the masters swapped / %", ylim=(0, 100))
    share.legend(fontsize=7)
    for axes in (one_run, share):
        plots.style(axes)
    return figure


def _turning_figure(cases: Cases) -> Figure:
    from auvest import plots

    colours = {
        "constant acceleration": plots.BLUE,
        "constant velocity": plots.GREEN,
        "IMM": plots.VERMILION,
    }
    figure = plots.new_figure((11.0, 4.6), "A master that turns, EKF-SLAT: relative error")
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
        axes.set(xlabel="time / s", ylabel="rms error over the runs / m")
        axes.set_title(
            f"odometry {case['sigma_speed_m_s']:g} m/s, {case['sigma_heading_rad']:g} rad",
            fontsize=9.5,
            loc="left",
        )
        axes.set_ylim(bottom=0)
        axes.legend(fontsize=8)
        plots.style(axes)
    return figure
