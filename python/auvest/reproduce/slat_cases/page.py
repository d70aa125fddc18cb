"""The page on them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from auvest.reproduce import markdown
from auvest.reproduce.slat_cases.measure import (
    ACCELERATION_PSD,
    AHEAD_M,
    CLEAR,
    CROSSING_FILTERS,
    GAP_M,
    LAST_PINGS,
    MEET_S,
    PAPER_MASTER,
    SHARE,
    SWITCH_RATE_HZ,
    TURNING_LEVEL,
    VELOCITY_PSD,
    Cases,
    lower,
)


def page(cases: Cases) -> str:
    """Write the numbers up."""
    return page_of(cases.results)


def page_of(results: Mapping[str, Any]) -> str:
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
        f"with odometry of {case['sigma_speed_m_s']:g} m/s and {case['sigma_heading_rad']:g} rad "
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
    worse = [
        sum(lower({**one[key], "mean": -one[key]["mean"]}) for one in against)
        for key in ("slave_rmse_m", "master_rmse_m")
    ]
    return (
        "Against SLATF 2.0, whose particles are cheaper, SlatfJoint is clearly better for the "
        f"slave with {slave} of {len(against)} sonars, for the masters with {masters}, and clearly "
        f"worse for the slave with {worse[0]}, for the masters with {worse[1]}. Any "
        "particles keep both answers; those of SlatfJoint also keep the drift that slave and "
        "masters share, which shows in what they claim (covered)."
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
