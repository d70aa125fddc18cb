"""Records of the robust filters, for every target (``firmware/parity/replay_robust.hpp``)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

import numpy as np

from auvest import (
    Ckf,
    FilterError,
    Hampel,
    Huber,
    Igg,
    LeaderRange,
    Odometry,
    RejectionStreak,
    RobustEkf,
    RobustUkf,
    SpeedHeading,
    Status,
    Unit,
)
from auvest.filters import GaussianFilter
from auvest.kernels import Kernel
from tests.parity.python_leg import bits

KIND = 16
_KERNELS = {Unit: 0, Huber: 1, Hampel: 2, Igg: 3}

STEP = np.dtype(
    [("measured", "<u4"), ("dt", "<f4"), ("motion", "<f4", 3), ("z", "<f4"), ("leader", "<f4", 2)]
)
#: Where measurements are late.
LATE_STEP = np.dtype([*STEP.descr, ("age", "<f4")])


def trace_type(states: int) -> np.dtype:
    """Give the rows of a trace; floats are kept as their bits."""
    return np.dtype(
        [
            ("x", "<u4", states),
            ("P", "<u4", states * (states + 1) // 2),
            ("innovation", "<u4"),
            ("S", "<u4"),
            ("nis", "<u4"),
            ("standardised", "<u4"),
            ("weight", "<u4"),
            ("variance", "<u4"),
            ("recent", "<u4", 6),
            ("decision", "u1"),
            ("iterations", "u1"),
            ("predict", "u1"),
            ("update", "u1"),
            ("recovered", "u1"),
            ("count", "u1"),
            ("spare", "<u2"),
        ]
    )


@dataclass(frozen=True, eq=False)
class RobustRecord:
    """A robust filter and what happens to it."""

    name: str
    steps: np.ndarray
    process: SpeedHeading | Odometry = field(default_factory=SpeedHeading)
    sensor: LeaderRange = field(default_factory=LeaderRange)
    kernel: Kernel = field(default_factory=Igg)
    rejections: int = 6
    residual: str = "innovation"
    filter: type[GaussianFilter] = RobustEkf
    late_s: float = 0.0
    x0: tuple[float, ...] = (0.0, 0.0)
    P0: np.ndarray = field(default_factory=lambda: np.eye(2, dtype=np.float32))

    @property
    def states(self) -> int:
        return len(self.x0)

    def to_bytes(self) -> bytes:
        """The record as the replay programs read it."""
        kind = 2 if isinstance(self.process, Odometry) else 1 if self.process.heading_bias else 0
        kind += 256 * self.filter._linearisation
        kind += 65536 * (self.late_s > 0)
        thresholds = [*asdict(self.kernel).values(), 1.0, 2.0, 3.0][:3]
        parameters = [v for k, v in asdict(self.process).items() if not isinstance(v, bool)]
        sensor = [self.sensor.sigma_range_m, self.sensor.sigma_leader_m]
        lower = self.P0[np.tril_indices(self.states)]
        words = [
            np.array([KIND, kind, len(self.steps), _KERNELS[type(self.kernel)]], "<u4"),
            np.array(thresholds, "<f4"),
            np.array([self.residual == "post-fit", self.rejections], "<u4"),
            np.array([*parameters, *sensor, *self.x0, *lower], "<f4"),
            self.steps,
        ]
        return b"".join(part.tobytes() for part in words)

    def trace_of(self, data: bytes) -> np.ndarray:
        """Rows of a trace; its reset must have gone well."""
        assert data[:4] == bytes(4), "reset was refused"
        return np.frombuffer(data[4:], trace_type(self.states))

    def replay_in_python(self) -> np.ndarray:
        """Run the record through the public class and give its trace."""
        recovery = RejectionStreak(rejections=self.rejections) if self.rejections else None
        f = self.filter(
            self.x0,
            self.P0,
            process=self.process,
            kernel=self.kernel,
            recovery=recovery,
            residual=self.residual,
            late_s=self.late_s,
            longest_step_s=np.inf,
            dtype="float32",
        )
        trace = np.zeros(len(self.steps), trace_type(self.states))
        lower = np.tril_indices(self.states)
        for step, row in zip(self.steps, trace, strict=True):
            row["predict"] = _status(lambda s=step: f.predict(float(s["dt"]), s["motion"]), step)
            if step["measured"]:
                age = {"age_s": float(step["age"])} if self.late_s > 0 else {}
                row["update"] = _status(
                    lambda s=step, a=age: f.update(s["z"], self._sensor(s), **a), step
                )
                if row["update"] == 0:
                    r = f.report
                    for name in ("innovation", "S", "standardised", "weight"):
                        row[name] = bits(getattr(r, name)).ravel()[0]
                    row["nis"] = bits(r.nis)
                    row["decision"], row["iterations"] = int(r.decision), r.iterations
                    row["recovered"] = r.recovered
            row["x"], row["P"] = bits(f.x), bits(f.P[lower])
            count, variance, *recent, _ = f._filter.save()[0]["recovery"]
            row["count"], row["variance"], row["recent"] = count, bits(variance), bits(recent)
        return trace

    def _sensor(self, step: np.void) -> LeaderRange:
        return LeaderRange(
            leader=tuple(float(v) for v in step["leader"]),
            sigma_range_m=self.sensor.sigma_range_m,
            sigma_leader_m=self.sensor.sigma_leader_m,
            smallest_range_m=-float(np.finfo(np.float32).max),  # noise is not cut off at 0
        )


def _status(action, step: np.void) -> int:
    """Do something and give the status of the core; plain ValueErrors are what it would refuse."""
    try:
        action()
    except FilterError as error:
        return int(error.status)
    except ValueError:
        if step["dt"] < 0:
            return int(Status.time_backwards)
        return int(Status.not_finite)
    return int(Status.ok)


def cruise(steps: int, seed: int, *, scale: float = 1.0, odometry: bool = False) -> np.ndarray:
    """A slave on a weaving course, a range every second or third step, one of six an outlier."""
    rng = np.random.default_rng(seed)
    heading = 0.8 * np.sin(0.05 * np.arange(steps)) + 0.02 * np.arange(steps)
    position = np.cumsum(1.5 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    leaders = np.array([[220.0, 30.0], [-150.0, 180.0], [40.0, -260.0]])
    rows = np.zeros(steps, STEP)
    rows["dt"] = 1.0
    rows["motion"] = np.stack([np.full(steps, 1.5), np.full(steps, 0.05), heading], axis=1)
    if odometry:
        rows["motion"][:, 2] = np.diff(heading, prepend=0.0)
    rows["motion"][:, :2] *= scale
    rows["leader"] = scale * leaders[np.arange(steps) % 3]
    z = np.hypot(*(scale * position - rows["leader"]).T) + scale * rng.standard_normal(steps)
    rows["z"] = z + scale * np.where(rng.random(steps) < 1 / 6, rng.normal(0, 25, steps), 0.0)
    rows["measured"] = np.arange(steps) % 5 % 2 == 0
    return rows


def late() -> np.ndarray:
    """The same, but every third range is told two, three or four seconds after it was measured."""
    in_time = cruise(200, 14)
    rows = np.zeros(len(in_time), LATE_STEP)
    for name in STEP.names:
        rows[name] = in_time[name]
    for k in range(6, len(rows), 3):
        age = 2 + k % 3 + k % 2
        rows["measured"][k], rows["age"][k] = 1, age
        rows["z"][k], rows["leader"][k] = in_time["z"][k - age], in_time["leader"][k - age]
    rows["age"][30] = rows["age"][90] = 1000.0
    return rows


def refusals() -> np.ndarray:
    """What is not finite, backwards or too large, among good steps."""
    rows = cruise(60, 8)
    for k, dt in enumerate((np.nan, np.inf, -1.0, -0.0, 1e-45, 3e38)):
        rows["dt"][2 + 3 * k] = dt
    for k, z in enumerate((np.inf, -np.inf, -5.0, 0.0, 3e38, 1e-45)):
        rows["measured"][21 + 3 * k], rows["z"][21 + 3 * k] = 1, z
    rows["motion"][40] = (np.inf, 0, 0)
    rows["motion"][42] = (0, 0, np.nan)
    rows["motion"][44] = (1e30, 1e30, 1e6)
    return rows


def all_records() -> list[RobustRecord]:
    """All records of the robust filters."""
    four = {"x0": (0.0, 0.0, 0.0, 0.0), "P0": np.diag([4, 4, 0.01, 0.01]).astype(np.float32)}
    both = SpeedHeading(heading_bias=True, speed_scale=True)
    lost = {"x0": (150.0, -130.0)}
    turning = {
        "process": Odometry(),
        "x0": (0.0, 0.0, 0.0),
        "P0": np.diag([1, 1, 0.01]).astype(np.float32),
    }
    return [
        RobustRecord("robust-igg", cruise(1200, 1), sensor=LeaderRange(sigma_leader_m=0.5)),
        RobustRecord("robust-unit", cruise(100, 2), kernel=Unit(), rejections=0),
        RobustRecord("robust-huber", cruise(200, 3), kernel=Huber()),
        RobustRecord("robust-hampel", cruise(200, 4), kernel=Hampel()),
        RobustRecord("robust-post-fit", cruise(200, 5), residual="post-fit", kernel=Hampel()),
        RobustRecord("robust-lost", cruise(200, 6), **lost),
        RobustRecord("robust-bias-scale", cruise(300, 7), process=both, **four),
        RobustRecord(
            "robust-odometry",
            cruise(200, 9, odometry=True),
            **turning,
        ),
        *(
            record
            for name, kind in (("robust-ukf", RobustUkf), ("ckf", Ckf))
            for record in (
                RobustRecord(
                    f"{name}-odometry", cruise(200, 12, odometry=True), filter=kind, **turning
                ),
                RobustRecord(
                    f"{name}-bias-scale",
                    cruise(200, 13),
                    filter=kind,
                    process=both,
                    kernel=Hampel(),
                    **four,
                ),
            )
        ),
        RobustRecord("robust-late", late(), late_s=6.0, kernel=Hampel()),
        RobustRecord("robust-refusals", refusals()),
        RobustRecord(
            "robust-far",
            cruise(60, 10, scale=1e6),
            sensor=LeaderRange(sigma_range_m=1e6),
            P0=1e12 * np.eye(2, dtype=np.float32),
        ),
        RobustRecord(
            "robust-near",
            cruise(60, 11, scale=1e-6),
            sensor=LeaderRange(sigma_range_m=1e-6),
            process=SpeedHeading(sigma_forward=1e-7),
            P0=1e-12 * np.eye(2, dtype=np.float32),
        ),
    ]
