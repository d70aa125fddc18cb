"""The records that every target must turn into the same bits, and the form of records and traces.

A record holds a filter and what happens to it, step by step; a trace is what the filter then shows.
Both are little-endian 32-bit words (see ``firmware/parity/replay.hpp``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import Literal

import numpy as np

from auvest import (
    Aukf,
    ConstantAcceleration,
    CovarianceBudget,
    FixedInterval,
    MahalanobisInterval,
    RangeBearing,
    _core,
)
from auvest.intervals import IntervalPolicy
from auvest.simulation.paper_aukf import NOISE_KINDS, paper_filter, paper_noise
from auvest.simulation.tracking import Scenario, Track, simulate

STATES = 6
LOWER = np.tril_indices(STATES)

# Flags of a step.
GIVEN_INTERVAL, MEASURED, REFERENCED = 1, 2, 4

STEP = np.dtype([("flags", "<u4"), ("dt", "<f4"), ("z", "<f4", 2), ("reference", "<f4", 2)])

#: Floats are kept as their bits, so that a NaN equals itself and -0 differs from 0.
TRACE = np.dtype(
    [
        ("x", "<u4", STATES),
        ("P", "<u4", STATES * (STATES + 1) // 2),
        ("interval", "<u4"),
        ("innovation", "<u4", 2),
        ("S", "<u4", 3),
        ("nis", "<u4"),
        ("near_field", "u1"),
        ("predict", "u1"),
        ("update", "u1"),
        ("feedback", "u1"),
    ]
)

#: What a trace begins with: the status of reset.
PREFIX_BYTES = 4

#: A record that asks for auvest::self_test(); its trace is the failed part and its index.
SELF_TEST = np.array([4], "<u4").tobytes()

_KINDS = {("ekf", "euler"): 0, ("ekf", "exact"): 1, ("ukf", "euler"): 2, ("ukf", "exact"): 3}
_POLICIES = {FixedInterval: 0, MahalanobisInterval: 1, CovarianceBudget: 2}


@dataclass(frozen=True, eq=False)
class Record:
    """A filter and what happens to it.

    A UKF is the AUKF with a fixed interval and without feedback.
    """

    name: str
    steps: np.ndarray
    kind: Literal["ekf", "ukf", "aukf"] = "aukf"
    x0: tuple[float, ...] = (0.2, 2.0, 0.1, 0.2, 0.01, 0.02)
    P0: np.ndarray = field(
        default_factory=lambda: np.diag([0.01, 0.01, 0.01, 0.01, 0.001, 0.001]).astype(np.float32)
    )
    process: ConstantAcceleration = field(default_factory=ConstantAcceleration)
    sensor: RangeBearing = field(default_factory=RangeBearing)
    policy: IntervalPolicy = field(default_factory=MahalanobisInterval)
    alpha: float = 1e-6
    beta: float = 2.0
    kappa: float = -3.0

    @property
    def lifted_sensor(self) -> RangeBearing:
        """The sensor for ranges below 0: simulated noise is not cut off there."""
        return replace(self.sensor, smallest_range_m=-float(np.finfo(np.float32).max))

    @property
    def points(self) -> dict[str, float]:
        """Parameters of the sigma points, as the filters of the package take them."""
        return {"alpha": self.alpha, "beta": self.beta, "kappa": self.kappa}

    def to_bytes(self) -> bytes:
        """The record as the replay programs read it."""
        policy = asdict(self.policy)
        policy.pop("preset", None)
        kind = _KINDS["ekf" if self.kind == "ekf" else "ukf", self.process.discretisation]
        # Parameters travel in the order in which the core names them.
        defaults = {
            FixedInterval: _core.fixed_interval_defaults(),
            MahalanobisInterval: _core.mahalanobis_interval_defaults("figure3"),
            CovarianceBudget: _core.covariance_budget_defaults(),
        }[type(self.policy)]
        parts = [
            np.array([kind, len(self.steps)], "<u4"),
            _in_order(self.points, _core.sigma_points_defaults()),
            self.process.values("float32"),
            self.sensor.values("float32")[:-2],  # the limits of the range are lifted
            np.array([_POLICIES[type(self.policy)]], "<u4"),
            _in_order(policy, defaults),
            np.array(self.x0, "<f4"),
            np.asarray(self.P0, "<f4")[LOWER],
            np.array(self.x0[:2], "<f4"),
            np.ascontiguousarray(self.steps, STEP),
        ]
        return b"".join(part.tobytes() for part in parts)


def _in_order(values: dict[str, float], names: dict[str, float]) -> np.ndarray:
    return np.array([values.pop(name) for name in names], "<f4")


def trace_of(data: bytes, record: Record) -> np.ndarray:
    """Take a trace apart."""
    expected = PREFIX_BYTES + len(record.steps) * TRACE.itemsize
    if len(data) != expected:
        raise ValueError(f"{record.name}: the trace has {len(data)} bytes, expected {expected}")
    if any(data[:PREFIX_BYTES]):
        raise ValueError(f"{record.name}: reset was refused, status {data[0]}")
    return np.frombuffer(data, TRACE, offset=PREFIX_BYTES)


def bytes_of(trace: np.ndarray) -> bytes:
    """Put a trace together, with a reset that went well."""
    return bytes(PREFIX_BYTES) + trace.tobytes()


def make_steps(z, reference=None, dt=None, missing=None) -> np.ndarray:
    """Steps that measure ``z`` (T, 2) unless ``missing`` (T,), after ``dt`` or the own interval."""
    z = np.asarray(z, np.float32).reshape(-1, 2)
    steps = np.zeros(len(z), STEP)
    steps["z"] = z
    steps["flags"] = MEASURED
    if missing is not None:
        steps["flags"][np.asarray(missing)] &= ~np.uint32(MEASURED)
    if dt is not None:
        steps["dt"] = dt
        steps["flags"] |= GIVEN_INTERVAL
    if reference is not None:
        steps["reference"] = reference
        steps["flags"] |= REFERENCED
    return steps


# ---- What the project simulates ------------------------------------------------------------------


def paper_record(noise: str) -> Record:
    """The 60 steps of the paper's simulation, closed loop."""
    prototype = paper_filter("aukf", noise=paper_noise(noise), dtype="float32")
    return simulated(f"paper-{noise}", prototype, Scenario(noise=paper_noise(noise), runs=1))


def simulated(name: str, prototype: Aukf, scenario: Scenario) -> Record:
    """What a filter saw in a simulated world that sampled when the filter asked for it."""
    result = simulate(prototype, scenario, workers=1)
    z, truth = result.z[0], result.truth[0]
    assert result.samples[0] == scenario.steps, "the simulation ended early"
    return Record(
        name,
        make_steps(np.nan_to_num(z), reference=truth, missing=np.isnan(z[:, 0])),
        x0=tuple(float(v) for v in prototype.x),
        P0=prototype.P,
        process=prototype.process,
        sensor=prototype.sensors["RangeBearing"],
        policy=prototype.policy,
        **{name: getattr(prototype, name) for name in ("alpha", "beta", "kappa")},
    )


def long_record() -> Record:
    """10,000 steps of a vehicle that circles through the station, one in ten missing."""
    noise = paper_noise("normal", dropout=0.1)
    prototype = paper_filter("aukf", noise=noise, track="turn", dtype="float32")
    track = Track(kind="turn", turn_rate=0.05, wander_m=0.2)
    return simulated("long", prototype, Scenario(track=track, noise=noise, steps=10_000, runs=1))


def option_records() -> Iterator[Record]:
    """Every policy, both processes, three alphas, and the filters without a policy."""
    world = replace(paper_record("normal"), alpha=1.0)
    steps = world.steps[:15]
    policies = {
        "figure3": MahalanobisInterval("figure3"),
        "table1": MahalanobisInterval("table1"),
        "budget": CovarianceBudget(position_sigma_m=0.06),
        "fixed": FixedInterval(interval_s=0.3),
    }
    for process in ("euler", "exact"):
        model = ConstantAcceleration(discretisation=process)
        for name, policy in policies.items():
            for alpha in (1e-6, 1e-3, 1.0):
                yield replace(
                    world,
                    name=f"{name}-{process}-alpha{alpha:g}",
                    steps=steps,
                    process=model,
                    policy=policy,
                    alpha=alpha,
                )
        timed = make_steps(world.steps["z"], dt=0.4)
        for kind in ("ekf", "ukf"):
            yield replace(
                world,
                name=f"{kind}-{process}",
                kind=kind,
                steps=timed,
                process=model,
                policy=FixedInterval(),
            )


# ---- What no simulation shows --------------------------------------------------------------------

FLOAT_MAX = np.finfo(np.float32).max
LEAST_NORMAL = np.finfo(np.float32).tiny
LEAST = np.finfo(np.float32).smallest_subnormal


def course(start, velocity, count, dt=0.5, station=(0.2, 2.0)):
    """Noiseless range and bearing of a straight course, and its positions."""
    positions = np.asarray(start) + dt * np.arange(1, count + 1)[:, None] * np.asarray(velocity)
    d = positions - np.asarray(station)
    return np.stack([np.hypot(d[:, 0], d[:, 1]), np.arctan2(d[:, 1], d[:, 0])], axis=1), positions


def gaps() -> Record:
    """Measurements come and go; then none for long."""
    z, positions = course((3.0, -1.0), (0.1, 0.2), 60)
    missing = (np.arange(60) % 3 != 0) | (np.arange(60) >= 40)
    return Record(
        "gaps",
        make_steps(z, reference=positions, missing=missing),
        x0=(3.0, -1.0, 0.1, 0.2, 0.0, 0.0),
    )


def behind_the_station(kind, sign) -> Record:
    """The bearing jumps between pi and -pi, measured on both sides of it and on it."""
    z, positions = course((-4.0, 2.0 - 0.8 * sign), (0.0, 0.1 * sign), 32)
    z[::3, 1] += 0.03 * sign
    z[5, 1], z[6, 1], z[7, 1], z[8, 1] = np.pi, -np.pi, 3 * np.pi, 40.0
    steps = make_steps(z, reference=positions if kind == "aukf" else None, dt=0.5)
    policy = MahalanobisInterval() if kind == "aukf" else FixedInterval()
    return Record(
        f"wrap-{kind}{'+' if sign > 0 else '-'}",
        steps,
        kind=kind,
        x0=(-4.0, 2.0 - 0.8 * sign, 0.0, 0.1 * sign, 0.0, 0.0),
        policy=policy,
    )


def past_the_station(kind, process, miss_m) -> Record:
    """A straight course that passes the station at some distance, or through it."""
    z, positions = course((-1.5, 2.0 + miss_m), (0.2, 0.0), 36)
    return Record(
        f"near-{kind}-{process}-{miss_m:g}",
        make_steps(z, reference=positions if kind == "aukf" else None, dt=0.5),
        kind=kind,
        process=ConstantAcceleration(discretisation=process),
        x0=(-1.5, 2.0 + miss_m, 0.2, 0.0, 0.0, 0.0),
        policy=CovarianceBudget() if kind == "aukf" else FixedInterval(),
        alpha=1e-3,
    )


def on_the_station(kind) -> Record:
    """Start on the station, and measure range 0 there; no near field but on the very station."""
    z = np.array([[0.0, 0.0], [0.0, 2.0], [0.05, -3.0], [0.1, 1.5], [0.2, 1.4], [0.3, 1.2]])
    return Record(
        f"station-{kind}",
        make_steps(z, reference=np.full((6, 2), 0.3) if kind == "aukf" else None, dt=0.1),
        kind=kind,
        x0=(0.2, 2.0, 0.0, 0.0, 0.0, 0.0),
        sensor=RangeBearing(near_field=0.0),
        policy=MahalanobisInterval() if kind == "aukf" else FixedInterval(),
    )


def refusals(kind) -> Record:
    """Arguments that are not finite, backwards or absurd, among good ones."""
    good, positions = course((3.0, -1.0), (0.1, 0.2), 80)
    steps = make_steps(good, reference=positions if kind == "aukf" else None, dt=0.5)
    nan, inf = np.nan, np.inf
    for k, dt in enumerate((nan, inf, -inf, -0.5, -LEAST, -0.0, FLOAT_MAX)):
        steps["dt"][3 * k + 1] = dt
    # With nothing measured, or that refused too, a refused prediction leaves the whole belief.
    steps["flags"][1:21:6] &= ~np.uint32(MEASURED)
    steps["z"][4:21:6] = inf
    odd = [
        *((inf, 0.5), (-inf, 0.5), (nan, 0.5), (2.0, nan), (2.0, inf), (2.0, -inf)),
        *((-1.0, 0.5), (0.0, 0.5), (-0.0, -0.0), (1e30, 0.5), (FLOAT_MAX, 0.5), (2.0, FLOAT_MAX)),
        *((2.0, 1e10), (LEAST, LEAST), (1e-30, 0.5), (-1e38, -1e38)),
    ]
    for k, z in enumerate(odd):
        steps["z"][3 * k + 24] = z
    if kind == "aukf":
        for k, r in enumerate(((nan, 0), (0, inf), (-inf, 0), (1e38, -1e38), (LEAST, -LEAST))):
            steps["reference"][2 * k + 70] = r
    return Record(
        f"refusals-{kind}",
        steps,
        kind=kind,
        x0=(3.0, -1.0, 0.1, 0.2, 0.0, 0.0),
        policy=MahalanobisInterval() if kind == "aukf" else FixedInterval(),
    )


def scaled(kind, scale) -> Record:
    """A world of another size: positions, noise and spread times ``scale``."""
    z, positions = course((3.0, -1.0), (0.1, 0.2), 12, station=(0, 0))
    z[:, 0] *= scale
    square = max(scale * scale, 1e-37)
    sigma_range_m = np.clip(0.05 * scale, 2e-19, 1e19)  # its square must be a float
    rates = scale * scale * np.array([1e-6, 1e-4, 1e-5])
    process = ConstantAcceleration(
        position_psd=_normal(rates[0]),
        velocity_psd=_normal(rates[1]),
        acceleration_psd=_normal(rates[2]),
    )
    variances = np.clip(np.array([1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-4]) * square, 1e-37, 3e38)
    return Record(
        f"scale-{kind}-{scale:g}",
        make_steps(z, reference=positions * scale if kind == "aukf" else None, dt=0.5),
        kind=kind,
        x0=tuple(scale * v for v in (3.0, -1.0, 0.1, 0.2, 0.0, 0.0)),
        P0=np.diag(variances).astype(np.float32),
        process=process,
        sensor=RangeBearing(station=(0.0, 0.0), sigma_range_m=sigma_range_m),
        policy=MahalanobisInterval() if kind == "aukf" else FixedInterval(),
        alpha=1e-3,
    )


def _normal(value: float) -> float:
    return value if LEAST_NORMAL <= value <= FLOAT_MAX else 0.0


def intervals(kind, process) -> Record:
    """Intervals from nothing to ages."""
    z, positions = course((3.0, -1.0), (0.1, 0.2), 24)
    dt = np.tile([0.0, LEAST, LEAST_NORMAL, 1e-30, 1e-10, 1e-3, 1.0, 30.0], 3).astype(np.float32)
    dt[16:] = [100.0, 1e3, 1e6, 1e10, 1e20, 1e30, 1e38, FLOAT_MAX]
    return Record(
        f"intervals-{kind}-{process}",
        make_steps(z, reference=positions if kind == "aukf" else None, dt=dt),
        kind=kind,
        process=ConstantAcceleration(discretisation=process),
        x0=(3.0, -1.0, 0.1, 0.2, 0.0, 0.0),
        policy=CovarianceBudget() if kind == "aukf" else FixedInterval(),
    )


def dying(kind) -> Record:
    """No process noise and hardly any covariance: products of small numbers become subnormal."""
    z, positions = course((3.0, -1.0), (1e-12, 2e-13), 30)
    p0 = np.diag([1e-30, 1e-32, 1e-34, 1e-35, 1e-36, 1e-37]).astype(np.float32)
    return Record(
        f"dying-{kind}",
        make_steps(z, reference=positions if kind == "aukf" else None, dt=0.01),
        kind=kind,
        x0=(3.0, -1.0, 1e-12, 2e-13, 1e-38, 1e-42),
        P0=p0,
        process=ConstantAcceleration(position_psd=0.0, velocity_psd=0.0, acceleration_psd=0.0),
        policy=MahalanobisInterval() if kind == "aukf" else FixedInterval(),
        alpha=1e-3,
    )


def random_bits(kind, seed) -> Record:
    """Arguments of all sizes, most of them wrong, between good ones."""
    rng = np.random.default_rng(seed)
    good, positions = course((3.0, -1.0), (0.05, 0.1), 100)
    steps = make_steps(good, reference=positions if kind == "aukf" else None, dt=0.5)
    for name in ("z", "reference", "dt"):
        values = steps[name].reshape(len(steps), -1)
        wild = rng.integers(0, 2**32, values.shape, np.uint32).view(np.float32)
        values[...] = np.where(rng.random(values.shape) < 0.2, wild, values)
    # In Python NaN throughout means that the measurement is missing.
    steps["z"][np.isnan(steps["z"]).all(axis=1), 0] = 1.0
    return Record(
        f"random-{kind}-{seed}",
        steps,
        kind=kind,
        x0=(3.0, -1.0, 0.1, 0.2, 0.0, 0.0),
        policy=MahalanobisInterval() if kind == "aukf" else FixedInterval(),
        alpha=1e-3,
    )


def subnormal_quotients() -> Record:
    """A process noise whose third is subnormal, and a covariance small enough to feel it."""
    z, positions = course((3.0, -1.0), (0.1, 0.2), 6)
    return Record(
        "subnormal-quotients",
        make_steps(z, reference=positions, dt=1.0),
        x0=(3.0, -1.0, 0.1, 0.2, 0.0, 0.0),
        P0=np.diag([4e-39] * 6).astype(np.float32),
        process=ConstantAcceleration(
            position_psd=0.0, velocity_psd=2.2539129e-38, acceleration_psd=0.0
        ),
    )


def correlated() -> Record:
    """A full, nearly singular P0, far from the station."""
    rng = np.random.default_rng(5)
    a = rng.standard_normal((STATES, STATES)) * [1, 1, 0.1, 0.1, 0.01, 0.01]
    a[:, 1] = a[:, 0] + 1e-3 * a[:, 1]
    p0 = (a.T @ a).astype(np.float32)
    z, positions = course((3000.0, -1000.0), (1.0, 2.0), 20)
    return Record(
        "correlated",
        make_steps(z, reference=positions),
        x0=(3000.0, -1000.0, 1.0, 2.0, 0.0, 0.0),
        P0=(p0 + p0.T) / 2,
    )


def all_records() -> list[Record]:
    """All records, the long one last."""
    records = [paper_record(noise) for noise in NOISE_KINDS]
    records += option_records()
    records += [gaps(), correlated(), subnormal_quotients()]
    for kind in ("ekf", "ukf", "aukf"):
        records += [behind_the_station(kind, sign) for sign in (1, -1)]
        for process in ("euler", "exact"):
            records += [past_the_station(kind, process, miss) for miss in (0.0, 0.3)]
            records.append(intervals(kind, process))
        records += [on_the_station(kind), refusals(kind), dying(kind)]
        records += [scaled(kind, scale) for scale in (1e-30, 1e-17, 1e-9, 1e9, 1e15, 1e18)]
        # Of others a covariance is lost in the format: Python keeps one, see desk/models.hpp. The
        # first is the one that shows what a build without NaN does.
        seeds = (1, 2, 4) if kind == "ekf" else (2, 4)
        records += [random_bits(kind, seed) for seed in seeds]
    return [*records, long_record()]
