"""The page of ``auvest reproduce slatf``: the paper's table, figures and claims beside ours.

Every number on the page comes from one :class:`auvest.reproduce.slatf.Reproduction`; the verdicts
follow from the numbers by the rules written here.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import isnan

from auvest.reproduce.claims import NO, PARTLY, YES, Claim, tally
from auvest.reproduce.markdown import fill, table
from auvest.reproduce.slatf import (
    BEST_LEVEL,
    DEAF,
    FIG6_LEVELS,
    MANY,
    Estimate,
    Reproduction,
    difference,
    error_variance,
    mean_error,
    rms_per_ping,
    rmse,
)
from auvest.scenarios.paper_slatf import ASSUMPTIONS, FILTERS, LEVELS, FilterName, Level

#: Levels of Table 1, from loud to precise.
_TABLE1 = LEVELS[:4]


def claims(result: Reproduction) -> list[Claim]:
    """Every claim that the paper's text makes about the simulation, judged."""
    return [
        _dead_reckoning(result),
        _beaten(result, "slatf1"),
        _beaten(result, "slatf2"),
        _two_beats_one(result),
        _one_degrades(result),
        _two_does_not(result),
        _diverges(result),
        *_values(result),
        _best(result),
    ]


def _dead_reckoning(result: Reproduction) -> Claim:
    rows = [(_at(result, level, "dr"), level.paper["dr"]) for level in _TABLE1 if level.paper]
    near = [_near(ours, printed) for ours, printed in rows]
    return Claim(
        "Table 1",
        "RMSE of dead reckoning: " + ", ".join(f"{printed:.1f} m" for _, printed in rows),
        ", ".join(f"{_pm(ours)} m" for ours, _ in rows)
        + ", with the bias of the heading's noise left in; without it "
        + ", ".join(f"{_pm(_at(result, level, 'dr_compensated'))} m" for level in _TABLE1),
        YES if all(near) else PARTLY if any(near) else NO,
    )


def _beaten(result: Reproduction, name: FilterName) -> Claim:
    plain, fair = (
        [_apart(result, level, name, rival) for level in _TABLE1]
        for rival in ("dr", "dr_compensated")
    )
    return Claim(
        "Abstract; 7",
        f"{FILTERS[name]} is more precise than dead reckoning",
        f"RMSE below the paper's dead reckoning by {_span(-one.value for one in plain)} m (levels "
        f"1 to 4); below dead reckoning without the bias at {_where(fair)}",
        YES if all(_below(one) for one in fair) else PARTLY if all(map(_below, plain)) else NO,
    )


def _two_beats_one(result: Reproduction) -> Claim:
    apart = [_apart(result, level, "slatf2", "slatf1") for level in _TABLE1]
    return Claim(
        "Table 1; Figs 3 to 5",
        "SLATF 2.0 is more precise than 1.0, slightly at large noise, clearly at small noise",
        "RMSE of 2.0 less that of 1.0, levels 1 to 4: " + ", ".join(f"{_pm(a)} m" for a in apart),
        YES if all(map(_below, apart)) else PARTLY if all(map(_below, apart[2:])) else NO,
    )


def _one_degrades(result: Reproduction) -> Claim:
    first, last = _at(result, LEVELS[0], "slatf1"), _at(result, BEST_LEVEL, "slatf1")
    return Claim(
        "7, Figs 3 and 6",
        "1.0 becomes worse when the sonar becomes more precise: particles are depleted",
        f"RMSE {_pm(first)} m at level 1, {_pm(last)} m at level 4, "
        f"{_pm(_at(result, LEVELS[6], 'slatf1'))} m at level 7",
        YES if last.value - first.value > 2 * _joint(first, last) else NO,
    )


def _two_does_not(result: Reproduction) -> Claim:
    row = [_at(result, LEVELS[n - 1], "slatf2") for n in FIG6_LEVELS]
    gap = row[-1].value - row[0].value
    margin = 2 * _joint(row[0], row[-1])
    verdict = YES if gap < -margin else PARTLY if gap < 0.2 * row[0].value else NO
    return Claim(
        "7, Fig. 6",
        "the RMSE of 2.0 falls with the noise",
        f"levels {', '.join(map(str, FIG6_LEVELS))}: {', '.join(_pm(one) for one in row)} m; "
        "it does not fall: slave and master share a drift that no echo sees, and resampling "
        "depletes it. It rises far less than that of 1.0",
        verdict,
    )


def _diverges(result: Reproduction) -> Claim:
    end = {
        name: float(rms_per_ping(result.levels[BEST_LEVEL.number][name])[-1])
        for name in ("slatf1", "slatf2", "dr_compensated")
    }
    others = [
        float(rms_per_ping(result.levels[level.number][name])[-1])
        for level in _TABLE1
        for name in ("slatf1", "slatf2")
        if not (level is BEST_LEVEL and name == "slatf1")
    ]
    worst = end["slatf1"] > max(others)
    return Claim(
        "7, Figs 4 and 5",
        "1.0 at small noise is the worst of all and tends to diverge",
        f"level 4, rms error at the end of the outage: 1.0 {end['slatf1']:.0f} m, 2.0 "
        f"{end['slatf2']:.0f} m, dead reckoning without the bias {end['dr_compensated']:.0f} m; "
        "it stays finite, as any dead reckoning does",
        YES if worst and end["slatf1"] > end["dr_compensated"] else PARTLY if worst else NO,
    )


def _values(result: Reproduction) -> list[Claim]:
    found = []
    for name in ("slatf1", "slatf2"):
        pairs = [
            (level.number, _at(result, level, name), level.paper[name])
            for level in _TABLE1
            if level.paper and not (level is BEST_LEVEL and name == "slatf2")
        ]
        near = [_near(ours, paper) for _, ours, paper in pairs]
        found.append(
            Claim(
                "Table 1",
                f"RMSE of {FILTERS[name]}: "
                + ", ".join(f"{paper:.1f} m (level {n})" for n, _, paper in pairs),
                ", ".join(f"{_pm(ours)} m ({n})" for n, ours, _ in pairs)
                + f"; within 3 standard errors and 5 % at {sum(near)} of {len(near)} levels",
                YES if all(near) else PARTLY if any(near) else NO,
            )
        )
    return found


def _best(result: Reproduction) -> Claim:
    ours = _at(result, BEST_LEVEL, "slatf2")
    joint = _at(result, BEST_LEVEL, "ekf_slat")
    paper = _paper_best()
    return Claim(
        "Table 1",
        f"RMSE of SLATF 2.0 at level 4: {paper:.1f} m",
        f"{_pm(ours)} m with N = {result.particles}; the joint filter, which both versions "
        f"approximate, reaches {_pm(joint)} m",
        YES if _near(ours, paper) else NO,
    )


# The page.


def page(result: Reproduction) -> str:
    """README.md: table, figures, claims, sensitivity and assumptions."""
    judged = claims(result)
    parts = [
        _head(result, judged),
        "## Table 1\n",
        "RMSE of the slave's position in m, ± one standard error; in italics the paper's.\n",
        _table1(result),
        _best_text(result),
        "## Figures\n",
        _figure_text(result),
        _gallery(),
        "## Claims\n",
        table(
            ("where", "the paper says", "we measure", "verdict"),
            [(c.where, c.paper, c.measured, f"**{c.verdict}**") for c in judged],
        ),
        "## Sensitivity\n",
        f"RMSE in m at level {BEST_LEVEL.number} with one assumption changed.\n",
        _sensitivity(result),
        "## Assumptions\n",
        "What the paper leaves open, or says in two ways.\n",
        table(
            ("quantity", "the paper", "here", "why"),
            [(a.quantity, a.paper, a.ours, a.reason) for a in ASSUMPTIONS],
        ),
    ]
    return fill("\n".join(parts).rstrip("\n")) + "\n"


def _head(result: Reproduction, judged: list[Claim]) -> str:
    one = [_at(result, level, "slatf1") for level in (LEVELS[0], LEVELS[6])]
    two = [_at(result, level, "slatf2") for level in LEVELS]
    fair = [_apart(result, level, "slatf1", "dr_compensated") for level in _TABLE1]
    dr, compensated = ([_at(result, level, name).value for level in LEVELS] for name in DEAF)
    best = sum(
        all(
            _at(result, level, "ekf_slat").value <= _at(result, level, name).value
            for name in FILTERS
        )
        for level in LEVELS
    )
    ratio, plain = (
        max(
            _at(result, level, name).value / _at(result, level, "ekf_slat").value
            for level in LEVELS
        )
        for name in ("slatf_joint", "slatf2")
    )
    return f"""# Reproduction: SLATF of Lu, Chen, Liu, Ma and He (2020)

Lu J., Chen X., Liu Y., Ma X., He B.: *Simultaneous localization and tracking algorithm utilizing
FastSLAM framework for autonomous underwater vehicles*, Control Theory & Applications 37(1), 2020
(in Chinese). Section, equation and figure numbers are the paper's.

Made by `auvest reproduce slatf --runs {result.runs} --particles {result.particles} --seed
{result.seed} --dtype {result.dtype}`; do not edit. The numbers of each figure are in the CSV file
of its name, all others in `results.json`.

In short:

- **Dead reckoning** gives {_span(dr)} m; the paper has {_paper_dr()} m.
- **Both claims**: as the sonar becomes more precise, 1.0 goes from {one[0].value:.1f} m at level 1
  to {one[1].value:.1f} m at level 7; 2.0 stays within {min(e.value for e in two):.1f} to
  {max(e.value for e in two):.1f} m at all levels.
- **The paper's best value**, {_paper_best():.1f} m for 2.0 at level 4, is
  {_pm(_at(result, BEST_LEVEL, "slatf2"))} m here: its {_paper_best():.1f} m lies below what the
  joint filter reaches, {_pm(_at(result, BEST_LEVEL, "ekf_slat"))} m, and depends on what the
  paper does not state.
- **The fair baseline** is dead reckoning without the heading's bias, {_span(compensated)} m. Of
  levels 1 to 4, 1.0 beats it at {_where(fair)}.
- **Ours**, SLATF whose particles are joint Gaussians, stays within {ratio:.2f} times the joint
  filter's RMSE at every level, with as many particles; 2.0 within {plain:.2f} times.
- **EKF-SLAT**, one Gaussian for slave and master, has the lowest RMSE at {best} of {len(LEVELS)}
  levels.

Of {len(judged)} claims: {tally(judged)}.
"""


def _table1(result: Reproduction) -> str:
    rows = []
    for level in LEVELS:
        cells = [f"{level.number}", f"{level.sigma_range_m:g} m, {level.sigma_bearing_rad:g} rad"]
        for name in FILTERS:
            paper = level.paper.get(name) if level.paper else None
            printed = "" if paper is None else f", *{paper:.1f}*"
            cells.append(_pm(_at(result, level, name)) + printed)
        rows.append(cells)
    return table(("level", "noise", *FILTERS.values()), rows)


def _best_text(result: Reproduction) -> str:
    told = [one for one in result.variants if "velocity told" in one.what]
    many = next(one for one in result.variants if one.what == f"N = {MANY}")
    spans = "; ".join(
        f"{one.what}: {_pm(one.rmse['ekf_slat'])} m (EKF-SLAT), {_pm(one.rmse['slatf2'])} m (2.0)"
        for one in told
    )
    return f"""
At level {BEST_LEVEL.number} the paper has {_paper_best():.1f} m for 2.0: its 17.6 m lies below what
the joint filter reaches, {_pm(_at(result, BEST_LEVEL, "ekf_slat"))} m under the same assumptions.
2.0 approximates what the joint filter computes; with {many.what} it has
{_pm(many.rmse["slatf2"])} m. How good any filter can be is decided by what the slave was told of
the master's velocity, which the paper does not state ({spans}).
"""


def _figure_text(result: Reproduction) -> str:
    def cell(level: Level, name: FilterName) -> str:
        one = result.levels[level.number][name]
        return f"{mean_error(one):.1f}; {error_variance(one):.0f}"

    return "Mean (m) and variance (m^2) of the error:\n\n" + table(
        ("level", *FILTERS.values()),
        [[level.number, *(cell(level, name) for name in FILTERS)] for level in LEVELS],
    )


def _gallery() -> str:
    titles = {
        "fig02": "true tracks",
        "fig03": "mean and variance of the error",
        "fig04": "error over time, levels 1 and 3",
        "fig05": "error over time, levels 2 and 4",
        "fig06": "precise sonar",
    }
    shown = (f"![Fig. {int(stem[3:])}: {title}]({stem}.png)" for stem, title in titles.items())
    return "\n\n".join(shown) + "\n"


def _sensitivity(result: Reproduction) -> str:
    names: tuple[FilterName, ...] = ("slatf1", "slatf2", "ekf_slat")
    return table(
        ("changed", *(FILTERS[name] for name in names)),
        [
            [one.what, *(_pm(one.rmse[name]) if name in one.rmse else "" for name in names)]
            for one in result.variants
        ],
    )


# Words and comparisons.


def _at(result: Reproduction, level: Level, name: FilterName) -> Estimate:
    return rmse(result.levels[level.number][name])


def _apart(result: Reproduction, level: Level, name: FilterName, rival: FilterName) -> Estimate:
    row = result.levels[level.number]
    return difference(row[name], row[rival])


def _paper_dr() -> str:
    printed = [level.paper["dr"] for level in _TABLE1 if level.paper]
    return _span(printed)


def _paper_best() -> float:
    assert BEST_LEVEL.paper is not None
    return BEST_LEVEL.paper["slatf2"]


def _joint(a: Estimate, b: Estimate) -> float:
    return float((a.standard_error**2 + b.standard_error**2) ** 0.5)


def _below(apart: Estimate) -> bool:
    return apart.value + 2 * apart.standard_error < 0


def _near(ours: Estimate, paper: float) -> bool:
    """Tell whether they agree within 3 standard errors and 5 %."""
    return abs(ours.value - paper) <= 3 * ours.standard_error + 0.05 * paper


def _where(apart: list[Estimate]) -> str:
    numbers = [str(level.number) for level, one in zip(_TABLE1, apart, strict=True) if _below(one)]
    return (
        f"levels {', '.join(numbers)} only"
        if 0 < len(numbers) < 4
        else ("all four levels" if numbers else "no level")
    )


def _span(values: Iterable[float]) -> str:
    listed = list(values)
    return f"{min(listed):.0f} to {max(listed):.0f}"


def _pm(estimate: Estimate) -> str:
    if isnan(estimate.standard_error):  # of one run
        return f"{estimate.value:.1f}"
    return f"{estimate.value:.1f} ± {estimate.standard_error:.1f}"
