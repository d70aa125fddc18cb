"""The page on them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from auvest.reproduce import markdown
from auvest.reproduce.slat_robust.measure import (
    LOST_M,
    NAMES,
    REAL_NAMES,
    SILENCE_S,
    WRONG,
    Robust,
)

#: The share of good echoes beyond the gate, and what is still as good as that.
GATED, TWICE = 1e-3, 2e-3


def page(robust: Robust) -> str:
    """Write the numbers up."""
    return page_of(robust.results)


def page_of(results: Mapping[str, Any]) -> str:
    """Return the Markdown page of :attr:`Robust.results`."""
    parts = [_head(results), _levels(results), _wrong_echoes(results), _lock_out(results)]
    if "mrclam6" in results:
        parts.append(_recording(results))
    return "\n".join(parts)


def _section(text: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return f"{markdown.fill(text).rstrip()}\n\n{markdown.table(header, rows).rstrip()}\n"


def _head(results: Mapping[str, Any]) -> str:
    data = " --data FOLDER" if "mrclam6" in results else ""
    text = f"""# SLAT filters that know how far off they are, and come back

Made by `auvest reproduce slat-robust --runs {results["runs"]} --seed {results["seed"]}{data}`; do
not edit. The numbers are also in results.json. `SlatfJoint(covariance="shared")` with
N = {results["particles"]} beside EKF-SLAT, both as they come: a gate at a NIS of 13.8, and a master
of whose last 8 echoes 6 were refused is born again. RMSE of the slave's position, means over the
runs ± one standard error; NEES of that position, 2 expected; covered: share of the pings within
the 95 % ellipse; refused: share of the echoes heard.
"""
    return markdown.fill(text).rstrip() + "\n"


def _numbers(one: Mapping[str, Any]) -> str:
    return (
        f"{one['rmse_m']:.1f} ± {one['standard_error_m']:.1f} m, NEES {one['nees']:.2f}, "
        f"{100 * one['covered']:.0f} %"
    )


def _levels(results: Mapping[str, Any]) -> str:
    hours = results["six_hours"]
    rows = [
        [
            f"{row['number']} ({row['sigma_range_m']:g} m, {row['sigma_bearing_rad']:g} rad)",
            *(_numbers(row["filters"][name]) for name in NAMES),
            f"{row['ratio']:.3f}",
            f"{row['filters']['slatf_joint']['refused']:.1e}",
        ]
        for row in results["levels"]
    ]
    rows.append(
        [
            f"6 h ({hours['runs']} runs)",
            *(_numbers(hours["filters"][name]) for name in NAMES),
            f"{hours['ratio']:.3f}",
            f"{hours['filters']['slatf_joint']['refused']:.1e}",
        ]
    )
    echoes = results["levels"][0]["filters"]["slatf_joint"]["echoes"]
    text = f"""## As good as one Gaussian, and as honest

The scenario of the SLATF paper's section 7 in configuration R1; and six hours of a slave on a
circle round nothing, with a master that stands and an echo every other second, in which nothing
tells where the pair is. There the worst run is {hours["worst_ratio"]:.2f} times as far off as
EKF-SLAT. Points in place of Gaussians (SLATF 2.0) lie in their ellipse in two of three pings at
levels 3 to 7, and in a third after six hours. The gate would refuse {GATED:.0e} of the echoes if
all were Gaussian; a share of {TWICE:.0e} of {echoes:,} has a standard error of
{math.sqrt(TWICE * (1 - TWICE) / echoes):.1e}.
"""
    header = ["level", *NAMES.values(), "ratio of RMSE", "refused, SlatfJoint"]
    return _section(text, header, rows)


def _wrong_echoes(results: Mapping[str, Any]) -> str:
    rows = [
        [
            case,
            NAMES[name],
            f"{one['rmse_m']:.1f} ± {one['standard_error_m']:.1f}",
            f"{one['relative_rmse_m']:.1f}",
            f"{one['refused']:.1e}",
            f"{one['rebirths']} in {one['echoes']:,}",
        ]
        for case, both in results["wrong_echoes"].items()
        for name, one in both.items()
    ]
    share = WRONG["10 %"][0]
    echoes = results["wrong_echoes"]["10 %"]["ekf_slat"]["echoes"]
    # Five wrong ones among the seven before, and now the sixth.
    by_chance = echoes * math.comb(7, 5) * share**6 * (1 - share) ** 2
    text = f"""## Echoes at twice the range

Level 3. Each echo has twice the range with the probability given, or one ping in a hundred begins a
burst of five. Relative: the master's position less the slave's. Echoes at twice the range agree
with each other, so that six of eight cannot be told from a master that moved: of {echoes:,} echoes
with every tenth one wrong, chance alone brings that {by_chance:.1f} times. Each such rebirth costs
a second one, back.
"""
    header = ["wrong", "filter", "slave / m", "relative / m", "refused", "born again"]
    return _section(text, header, rows)


def _lock_out(results: Mapping[str, Any]) -> str:
    rows = [
        [
            case,
            NAMES[name],
            f"{one['found_again']} of {one['runs']}",
            f"{one['last_minute_m']:.0f}",
            f"{one['rebirths_per_run']:.1f}",
            f"{one['slave_rmse_m']:.1f}",
        ]
        for case, both in results["lock_out"].items()
        for name, one in both.items()
    ]
    text = f"""## A master that is lost

Level 3, but nobody hears the master from {SILENCE_S[0]:g} to {SILENCE_S[1]:g} s while it turns, and
the slave does not know that it will. Afterwards every echo lies beyond the gate. Found again: at
the end the master is known relative to the slave to {LOST_M:g} m. Last minute: RMSE of that.
"""
    header = ["", "filter", "found again", "last minute / m", "born again, per run", "slave / m"]
    return _section(text, header, rows)


def _recording(results: Mapping[str, Any]) -> str:
    rows = [
        [
            f"{row['gap_s']:g} s ({row['tracks']} tracks)",
            REAL_NAMES[name],
            f"{one['ratio']:.3f} ({one['worst_ratio']:.3f})",
            f"{one['relative_m']:.3f}",
        ]
        for row in results["mrclam6"]
        for name, one in row["filters"].items()
    ]
    text = """## Real robots whose plans nobody knows

The recording and the calibration of docs/reproduction/mrclam6, at three longest gaps between two
sightings of a track. The options are those of `auvest.slat.no_harm()`: a master is a random walk
without a velocity, and is born again after a silence of 2 s. What harms the slave is the
correlation that outlives a gap: what the master did in the silence is charged to the slave. Slave:
RMSE over that of dead reckoning, mean (worst) of the runs. Relative: the master's position less the
slave's. Chosen and judged on one recording.
"""
    return _section(text, ["longest gap", "filter", "slave", "relative / m"], rows)
