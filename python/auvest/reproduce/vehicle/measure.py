"""The experiments behind ``auvest reproduce vehicle``.

The AUKF paper (Deng, Yin, Duan 2019) describes a vehicle that steers and prints no coefficient of
its hull. Flown here is a torpedo of public coefficients (``remus100``); what is compared are the
figures that an independent prototype of hull, guidance and control gave.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from math import hypot, isnan, nan, radians, sqrt
from typing import Any

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation

from auvest.reproduce.estimate import Estimate, Floats
from auvest.reproduce.ticks import Ticks
from auvest.simulation import mission
from auvest.simulation.mission import MissionResult, TrackKind
from auvest.vehicle import Hull

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DEFAULT_RUNS = 50
DEFAULT_SEED = 1

#: Power of the model-aided filter's noise on the position, m^2/s: that of the prototype, which its
#: own NEES calls too large; ours is the default of :class:`auvest.SpeedHeadingCurrent`.
PROTOTYPE_POSITION = 0.02
OUR_POSITION = mission.Mission().model_position

#: Rows of the closed-loop table: source, interval where it is fixed (s), noise on the position.
ROWS: tuple[tuple[str, float, float], ...] = (
    ("truth", 0.5, OUR_POSITION),
    ("truth_crab", 0.5, OUR_POSITION),
    ("fixes", 0.5, OUR_POSITION),
    ("ukf", 0.5, OUR_POSITION),
    ("aukf_law", 0.5, OUR_POSITION),
    ("aukf_budget", 0.5, OUR_POSITION),
    ("model_aided", 0.5, OUR_POSITION),
    ("model_aided_crab", 0.5, OUR_POSITION),
    ("robust_model_aided", 0.5, OUR_POSITION),
    ("ukf", 2.0, OUR_POSITION),
    ("model_aided_crab", 2.0, OUR_POSITION),
    ("ukf_default_psd", 0.5, OUR_POSITION),
    ("ukf_outliers", 0.5, OUR_POSITION),
    ("model_aided_outliers", 0.5, OUR_POSITION),
    ("model_aided_outliers", 0.5, PROTOTYPE_POSITION),
    ("robust_model_aided_outliers", 0.5, OUR_POSITION),
)

#: What the prototype gave with 50 other seeds, m: settled cross-track RMS and its standard error on
#: lawnmower and circle, RMS with corners and its error on the lawnmower, error of the position.
#: With outliers it depends on the noise on the position, else not beyond the standard errors.
REFERENCE: Mapping[tuple[str, float], Mapping[str, Mapping[str, tuple[float, float]]]] = {
    key: {
        "lawnmower": {"settled": values[0], "all": values[1], "position": (values[2], nan)},
        "circle": {"settled": values[3], "all": (nan, nan), "position": (values[4], nan)},
    }
    for key, values in {
        ("truth", 0.5): ((0.174, 0.018), (3.24, 0.05), nan, (0.637, 0.003), nan),
        ("truth_crab", 0.5): ((0.034, 0.001), (3.16, 0.05), nan, (0.250, 0.004), nan),
        ("fixes", 0.5): ((0.677, 0.026), (3.71, 0.05), 2.32, (0.894, 0.014), 2.14),
        ("ukf", 0.5): ((0.580, 0.015), (3.38, 0.06), 1.20, (0.853, 0.014), 1.01),
        ("aukf_law", 0.5): ((0.599, 0.016), (3.43, 0.06), 1.21, (0.855, 0.015), 1.01),
        ("aukf_budget", 0.5): ((0.634, 0.015), (3.42, 0.06), 1.18, (0.873, 0.014), 1.01),
        ("model_aided", 0.5): ((0.336, 0.013), (3.26, 0.05), 0.42, (0.735, 0.011), 0.46),
        ("model_aided_crab", 0.5): ((0.265, 0.010), (3.18, 0.05), 0.42, (0.410, 0.015), 0.46),
        ("ukf", 2.0): ((1.350, 0.036), (3.79, 0.07), 2.26, (1.638, 0.048), 1.92),
        ("model_aided_crab", 2.0): ((0.469, 0.018), (3.21, 0.05), 0.66, (0.579, 0.021), 0.76),
        ("ukf_default_psd", 0.5): ((1.384, 0.053), (3.64, 0.06), 2.27, (0.947, 0.018), 1.19),
        ("ukf_outliers", 0.5): ((1.191, 0.056), (5.08, 0.21), 4.18, (nan, nan), nan),
        ("model_aided_outliers", 0.5): ((0.684, 0.031), (4.12, 0.15), 2.82, (nan, nan), nan),
    }.items()
}

#: Settled cross-track RMS (m) without any random number, current towards 0, 90, 180 and 270
#: degrees: two prototypes with hulls of their own, all digits equal.
NOISE_FREE: Mapping[tuple[str, TrackKind], tuple[float, float, float, float]] = {
    ("truth", "lawnmower"): (0.21276, 0.03461, 0.28760, 0.08400),
    ("truth_crab", "lawnmower"): (0.02433, 0.03916, 0.03366, 0.03461),
    ("truth", "circle"): (0.66629, 0.61628, 0.62046, 0.65019),
    ("truth_crab", "circle"): (0.28200, 0.23366, 0.21574, 0.28037),
}
#: To which the prototypes' values are printed, with a rounding of ours on top.
NOISE_FREE_TOLERANCE_M = 1e-4

#: Compass bias (deg), noise on the position (m^2/s) and walk of the current in the world (m^2/s^3)
#: with which consistency is judged: where the model holds (the log's 0.05 m/s at 10 Hz are 2.5e-4
#: m^2/s, the heading adds 2e-5; the current walks as the filter thinks), and as the table has it.
CONSISTENCY = ((0.0, 2.7e-4, 1e-5), (0.0, OUR_POSITION, 0.0), (1.0, OUR_POSITION, 0.0))
#: Seeds over which it is averaged: errors of the current last for minutes, one set is one draw.
CONSISTENCY_SEEDS = 4

#: Fixed intervals (s) from which one is read that is as accurate as an adaptive policy.
FIXED_S = (0.3, 0.4, 0.5, 0.7, 1.0)
POLICIES = ("aukf_law", "aukf_budget")

#: What an hour of sampling costs: assumptions, not measurements of a vehicle.
ASSUMPTIONS: tuple[tuple[str, str, float], ...] = (
    ("ping_mc", "charge of one ping and its answer at 12 V, mC (10 W for 20 ms)", 17.0),
    ("awake_ma", "ATmega2560 awake at 16 MHz and 5 V, mA", 20.0),
    ("asleep_ma", "the same asleep (power-save), mA", 0.1),
    ("step_s", "awake per fix: AUKF step of 5.3 ms and the text of the line, s", 0.0126),
    ("loop_s", "awake per period of 0.1 s: prediction, guidance and control, s", 0.0015),
    ("rudder_mc_rad", "charge per radian of rudder travel, mC (1 W for 50 ms at 12 V)", 4.2),
)


@dataclass(frozen=True)
class Row:
    """One row of the closed-loop table."""

    source: str
    track: TrackKind
    interval_s: float
    model_position: float
    mean_interval_s: float
    settled: Estimate
    all: Estimate
    position: Estimate
    rudder_deg_s: float
    runs: int
    failed_runs: int
    refused: int

    @property
    def reference(self) -> Mapping[str, tuple[float, float]] | None:
        """What the prototype gave; None: nothing that compares."""
        known = REFERENCE.get((self.source, self.interval_s))
        if known is None or (
            self.source == "model_aided_outliers" and self.model_position != PROTOTYPE_POSITION
        ):
            return None
        return known[self.track]

    def distance(self, name: str) -> float:
        """Give the distance from the prototype in standard errors of the difference; NaN: none."""
        row = self.reference
        if row is None:
            return nan
        value, error = row[name]
        ours: Estimate = getattr(self, name)
        both = hypot(ours.standard_error, ours.standard_error if isnan(error) else error)
        return abs(ours.value - value) / both if both > 0 else nan


@dataclass(frozen=True)
class Check:
    """A number with the value that it must have."""

    name: str
    value: float
    expected: float
    ok: bool


@dataclass(frozen=True)
class Consistency:
    """Share of the times at which the mean over the runs is inside its 95 % bounds."""

    bias_deg: float
    model_position: float
    current_walk: float
    nees_position: float
    nees: float
    nees_position_inside: float
    nees_inside: float
    nis: float
    nis_inside: float


@dataclass(frozen=True)
class Energy:
    """What sampling costs at equal accuracy."""

    policy: str
    track: TrackKind
    position_m: float
    mean_interval_s: float
    fixed_s: float
    charge_mah_h: float
    fixed_charge_mah_h: float
    quiet_interval_s: float
    busy_interval_s: float


@dataclass(frozen=True)
class Reproduction:
    """All that was measured."""

    runs: int
    seed: int
    rows: list[Row]
    checks: list[Check]
    consistency: list[Consistency]
    energy: list[Energy]

    @property
    def failed_runs(self) -> int:
        """Runs that did not reach the end of their track."""
        return sum(row.failed_runs for row in self.rows)


def measure(
    *,
    runs: int = DEFAULT_RUNS,
    seed: int = DEFAULT_SEED,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduction:
    """Fly everything.

    Parameters
    ----------
    runs, seed, workers
        Monte Carlo runs of every row; seed; threads.
    progress : callable, optional
        Called as ``progress(done, total)``.
    """
    tracks = mission.TRACKS
    tick = Ticks(
        2 * len(ROWS) + len(NOISE_FREE) + len(CONSISTENCY) + 2 * (len(FIXED_S) + len(POLICIES)),
        progress,
    )
    options: dict[str, Any] = {"runs": runs, "seed": seed}
    rows = []
    for track in tracks:
        for source, interval_s, model_position in ROWS:
            plan = mission.source(
                source, track, interval_s=interval_s, model_position=model_position, **options
            )
            result = mission.simulate(plan, record=False, workers=workers)
            rows.append(_row(source, track, interval_s, result))
            tick()
    return Reproduction(
        runs=runs,
        seed=seed,
        rows=rows,
        checks=[*_noise_free(tick), *_reference_runs()],
        consistency=[_consistency(case, options, workers, tick) for case in CONSISTENCY],
        energy=[energy for track in tracks for energy in _energy(track, options, workers, tick)],
    )


def _row(source: str, track: TrackKind, interval_s: float, result: MissionResult) -> Row:
    good = ~result.failed
    return Row(
        source=source,
        track=track,
        interval_s=interval_s,
        model_position=result.mission.model_position,
        mean_interval_s=float(result.mean_interval_s[good].mean()),
        settled=_estimate(result.settled_rms_m[good]),
        all=_estimate(result.all_rms_m[good]),
        position=_estimate(result.position_rms_m[good]),
        rudder_deg_s=float(np.degrees(result.rudder_travel_rad_s[good]).mean()),
        runs=len(good),
        failed_runs=int(result.failed.sum()),
        refused=int(result.refused.sum()),
    )


def _estimate(values: Floats) -> Estimate:
    error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else nan
    return Estimate(float(values.mean()), float(error))


def _noise_free(tick: Ticks) -> list[Check]:
    checks = []
    for (source, track), wanted in NOISE_FREE.items():
        for direction, expected in zip((0, 90, 180, 270), wanted, strict=True):
            plan = mission.source(source, track, current_rad=radians(direction), runs=1)
            value = float(mission.simulate(plan, record=False).settled_rms_m[0])
            checks.append(
                Check(
                    f"settled cross-track RMS, {track}, {source}, current towards {direction} deg",
                    value,
                    expected,
                    abs(value - expected) <= NOISE_FREE_TOLERANCE_M,
                )
            )
        tick()
    return checks


#: Commands of the reference runs (rad, rev/s) by the time from which each holds; current, m/s.
_EAST, _NORTH_EAST = (0.0, 0.5, 0.0), (0.5 * sqrt(0.5), 0.5 * sqrt(0.5), 0.1)
_COMMANDS: Mapping[str, tuple[Mapping[float, Sequence[float]], Sequence[float]]] = {
    "P1": ({0.0: (0.0, 0.0, 20.0)}, (0.0, 0.0, 0.0)),
    "P2": ({0.0: (radians(10), 0.0, 20.0)}, (0.0, 0.0, 0.0)),
    "P3": ({0.0: (0.0, radians(2), 20.0), 20.0: (0.0, 0.0, 20.0)}, (0.0, 0.0, 0.0)),
    "P4": ({0.0: (radians(5), 0.0, 1525 / 60)}, _EAST),
    "P5": ({0.0: (0.0, 0.0, 0.0)}, _NORTH_EAST),
    "V4": ({0.0: (0.0,) * 8}, (0.3, -0.2, 0.1)),
}
_STEP_S = 0.02
_QUANTITIES = ("x", "y", "z", "roll", "pitch", "yaw", "u", "v", "w", "p", "q", "r")


def reference_runs() -> dict[str, Any]:
    """Give the reference runs of both hulls, numbers as they are printed."""
    file = resources.files(__name__.rpartition(".")[0]).joinpath("reference_runs.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _reference_runs() -> list[Check]:
    """Compare with every printed digit."""
    checks = []
    for name, run in reference_runs().items():
        schedule, current = _COMMANDS[name]
        times = [float(row[0]) for row in run["rows"]]
        steps = round(times[-1] / _STEP_S)
        commands = np.array(
            [schedule[max(t for t in schedule if t <= k * _STEP_S + 1e-9)] for k in range(steps)]
        )
        still = [*(-np.array(current)), 0.0, 0.0, 0.0]  # over ground: level and heading north
        hull = Hull(run["vehicle"])
        flown = hull.run(commands, _STEP_S, velocity=still, current=current)
        rates = 1.0 if run["vehicle"] == "bluerov2_heavy" else np.degrees(1.0)
        for time, row in zip(times, run["rows"], strict=True):
            k = round(time / _STEP_S)
            pose, water = flown.pose[k], flown.velocity[k]
            ground = water[:3] + _rotation(pose[3:]).T @ current
            found = [*pose[:3], *np.degrees(pose[3:]), *ground, *(rates * water[3:])]
            for quantity, value, printed in zip(_QUANTITIES, found, row[1:], strict=True):
                digits = len(printed.partition(".")[2]) or 4
                ok = abs(value - float(printed)) <= 0.51 * 10.0**-digits
                checks.append(
                    Check(f"{name}, {quantity} at {time:g} s", float(value), float(printed), ok)
                )
    return checks


def _rotation(angles: Floats) -> Floats:
    """R of the Euler angles zyx: from the body's frame to north, east, down."""
    turn: Floats = Rotation.from_euler("ZYX", angles[::-1]).as_matrix()
    return turn


def _consistency(
    case: tuple[float, float, float],
    options: dict[str, Any],
    workers: int | None,
    tick: Ticks,
) -> Consistency:
    bias_deg, position, walk = case
    shares = []
    for seed in range(options["seed"], options["seed"] + CONSISTENCY_SEEDS):
        plan = mission.source(
            "model_aided_crab",
            "circle",
            compass_bias_rad=radians(bias_deg),
            model_position=position,
            current_walk=walk,
            **{**options, "seed": seed},
        )
        result = mission.simulate(plan, workers=workers)
        place, all_ = _inside(result.nees_position, 2), _inside(result.nees, 4)
        shares.append((place[0], all_[0], place[1], all_[1], *_inside(result.nis, 2)))
    tick()
    return Consistency(*case, *(float(mean) for mean in np.mean(shares, axis=0)))


def _inside(values: Floats, freedom: int) -> tuple[float, float]:
    """Mean, and share of the times at which at least half of the runs have a value: in bounds."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    full = count >= max(2, len(values) // 2)
    mean = np.where(known, values, 0.0).sum(axis=0)[full] / count[full]
    total = freedom * count[full]
    low, high = (stats.chi2.ppf(p, total) / count[full] for p in (0.025, 0.975))
    return float(mean.mean()), float(((mean >= low) & (mean <= high)).mean())


def _energy(
    track: TrackKind, options: dict[str, Any], workers: int | None, tick: Ticks
) -> list[Energy]:
    assumed = {name: value for name, _, value in ASSUMPTIONS}

    def charge(result: MissionResult) -> float:
        """MAh in an hour."""
        seconds = 3600.0
        fixes = seconds / float(result.mean_interval_s.mean())
        awake = fixes * assumed["step_s"] + seconds / 0.1 * assumed["loop_s"]
        travel = float(result.rudder_travel_rad_s.mean()) * seconds
        coulombs = fixes * assumed["ping_mc"] + travel * assumed["rudder_mc_rad"]
        coulombs += awake * assumed["awake_ma"] + (seconds - awake) * assumed["asleep_ma"]
        return coulombs / 3600

    fixed = []
    for interval_s in FIXED_S:
        plan = mission.source("ukf", track, interval_s=interval_s, **options)
        result = mission.simulate(plan, record=False, workers=workers)
        fixed.append((float(result.position_rms_m.mean()), interval_s, charge(result)))
        tick()
    errors, intervals, charges = np.array(fixed).T
    order = np.argsort(errors)
    rows = []
    for policy in POLICIES:
        result = mission.simulate(mission.source(policy, track, **options), workers=workers)
        tick()
        error = float(result.position_rms_m.mean())
        quiet = np.where(result.settled == 1, result.interval_s, nan)
        busy = np.where(result.settled == 0, result.interval_s, nan)
        rows.append(
            Energy(
                policy,
                track,
                error,
                float(result.mean_interval_s.mean()),
                float(np.interp(error, errors[order], intervals[order])),
                charge(result),
                float(np.interp(error, errors[order], charges[order])),
                float(np.nanmean(quiet)),
                float(np.nanmean(busy)),
            )
        )
    return rows


def summary(result: Reproduction) -> dict[str, Any]:
    """Give everything as JSON."""
    return {
        "runs": result.runs,
        "seed": result.seed,
        "checks": [vars(check) for check in result.checks],
        "closed_loop": [
            {
                "source": row.source,
                "track": row.track,
                "interval_s": row.interval_s,
                "model_position_m2_s": row.model_position,
                "mean_interval_s": row.mean_interval_s,
                "settled_rms_m": row.settled.value,
                "settled_se_m": row.settled.standard_error,
                "all_rms_m": row.all.value,
                "all_se_m": row.all.standard_error,
                "position_rms_m": row.position.value,
                "position_se_m": row.position.standard_error,
                "rudder_deg_s": row.rudder_deg_s,
                "runs": row.runs,
                "failed_runs": row.failed_runs,
                "distance_in_standard_errors": row.distance("settled"),
            }
            for row in result.rows
        ],
        "consistency": [vars(one) for one in result.consistency],
        "energy": [vars(one) for one in result.energy],
        "assumptions": [
            {"name": name, "what": what, "value": value} for name, what, value in ASSUMPTIONS
        ],
    }
