"""Speed of single steps under Python, beside filterpy: one call of predict, one of update.

speed.py times them and writes the table. Both do the same work on the same measurements, given as
arrays, and must agree on the estimates. What filterpy leaves to its user is written as cheaply as
it can be: noise and Jacobians that do not change are computed once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter

import auvest

Floats = np.ndarray
#: Takes measurements (T, m), returns the estimate after the last of them. Nothing reads the
#: estimates in between: a step is one predict and one update.
Run = Callable[[Floats], Floats]

STEPS = 400

# Two states: dead reckoning by speed and heading, ranges to three leaders in turn.
DT = 0.01
COURSE = np.array([1.0, 0.0, 0.3])  # speed ahead and to starboard [m/s], heading [rad]
VELOCITY = np.array([math.cos(COURSE[2]), math.sin(COURSE[2])])
SIGMA_SPEED, SIGMA_HEADING, SIGMA_RANGE = 0.1, 0.02, 0.5
LEADERS = np.array([[0.0, 0.0], [120.0, 0.0], [60.0, 90.0]])
START = np.array([52.0, 39.0])
START_P = np.eye(2)

# Six states: constant acceleration, range and bearing.
UKF_DT = 0.5
STATION = np.array([0.2, 2.0])
UKF_START = np.array([30.2, 22.0, 0.1, 0.2, 0.01, 0.02])
UKF_START_P = np.diag([0.05, 0.05, 0.02, 0.02, 0.005, 0.005]) ** 2
PSD = (1e-4, 1e-4, 1e-4)
SIGMA_UKF = (0.05, 0.01)
ALPHA, BETA, KAPPA = 0.1, 2.0, -3.0


def auvest_range_filter() -> tuple[Any, list[str]]:
    """Make auvest's filter of two states, and the names of its sensors, one of each leader."""
    process = auvest.SpeedHeading(sigma_forward=SIGMA_SPEED, sigma_heading=SIGMA_HEADING)
    sensors = {
        f"leader {k}": auvest.LeaderRange(leader=(float(x), float(y)), sigma_range_m=SIGMA_RANGE)
        for k, (x, y) in enumerate(LEADERS)
    }
    return auvest.Ekf(START, START_P, process=process, sensors=sensors), list(sensors)


def auvest_six_states() -> Any:
    """Make auvest's UKF of six states."""
    return auvest.Ukf(
        UKF_START,
        UKF_START_P,
        process=auvest.ConstantAcceleration(
            discretisation="euler",
            position_psd=PSD[0],
            velocity_psd=PSD[1],
            acceleration_psd=PSD[2],
        ),
        sensors=auvest.RangeBearing(
            station=(float(STATION[0]), float(STATION[1])),
            sigma_range_m=SIGMA_UKF[0],
            sigma_bearing_rad=SIGMA_UKF[1],
        ),
        alpha=ALPHA,
        beta=BETA,
        kappa=KAPPA,
    )


def ranges() -> Floats:
    """Return STEPS ranges, to one leader after the other."""
    track = START + DT * np.outer(np.arange(1, STEPS + 1), VELOCITY)
    gap = track - LEADERS[np.arange(STEPS) % len(LEADERS)]
    noise = np.random.default_rng(1).normal(0, SIGMA_RANGE, STEPS)
    return (np.hypot(gap[:, 0], gap[:, 1]) + noise)[:, None]


def echoes() -> Floats:
    """Return STEPS ranges and bearings from the station."""
    track = UKF_START[:2] + UKF_DT * np.outer(np.arange(1, STEPS + 1), UKF_START[2:4])
    gap = track - STATION
    z = np.stack([np.hypot(gap[:, 0], gap[:, 1]), np.arctan2(gap[:, 1], gap[:, 0])], axis=1)
    return z + np.random.default_rng(2).normal(size=z.shape) * SIGMA_UKF


def auvest_ekf(z: Floats) -> Floats:
    """Run auvest's EKF of two states step by step."""
    ekf, sensors = auvest_range_filter()
    for k, row in enumerate(z):
        ekf.predict(DT, COURSE)
        ekf.update(row, sensors[k % 3])
    return ekf.x


class _DeadReckoning(ExtendedKalmanFilter):  # type: ignore[misc]
    """filterpy's EKF with a motion of its own, which it asks its users to write so."""

    def predict_x(self, u: Any = 0) -> None:  # noqa: ARG002
        self.x = self.x + DT * VELOCITY


def filterpy_ekf(z: Floats) -> Floats:
    """Run filterpy's EKF of two states step by step."""

    def distance(x: Floats, leader: Floats) -> Floats:
        return np.array([math.hypot(x[0] - leader[0], x[1] - leader[1])])

    def jacobian(x: Floats, leader: Floats) -> Floats:
        dx, dy = x[0] - leader[0], x[1] - leader[1]
        r = math.hypot(dx, dy)
        return np.array([[dx / r, dy / r]])

    ekf = _DeadReckoning(2, 1)
    ekf.x, ekf.P = START.copy(), START_P.copy()
    across = np.array([-VELOCITY[1], VELOCITY[0]])  # the speed is 1 m/s
    ekf.Q = DT * (
        SIGMA_SPEED**2 * np.outer(VELOCITY, VELOCITY) + SIGMA_HEADING**2 * np.outer(across, across)
    )
    ekf.R = np.eye(1) * SIGMA_RANGE**2
    for k, row in enumerate(z):
        leader = (LEADERS[k % 3],)
        ekf.predict()
        ekf.update(row, jacobian, distance, args=leader, hx_args=leader)
    return ekf.x


def auvest_ukf(z: Floats) -> Floats:
    """Run auvest's UKF of six states step by step."""
    ukf = auvest_six_states()
    for row in z:
        ukf.predict(UKF_DT)
        ukf.update(row)
    return ukf.x


def filterpy_ukf(z: Floats) -> Floats:
    """Run filterpy's UKF of six states step by step."""
    phi = np.eye(6) + UKF_DT * np.eye(6, k=2)

    def move(x: Floats, _: float) -> Floats:
        return phi.dot(x)

    def look(x: Floats) -> Floats:
        dx, dy = x[0] - STATION[0], x[1] - STATION[1]
        return np.array([math.hypot(dx, dy), math.atan2(dy, dx)])

    points = MerweScaledSigmaPoints(6, ALPHA, BETA, KAPPA)
    ukf = UnscentedKalmanFilter(6, 2, UKF_DT, look, move, points)
    ukf.x, ukf.P = UKF_START.copy(), UKF_START_P.copy()
    ukf.Q = UKF_DT * np.diag(np.repeat(PSD, 2))
    ukf.R = np.diag(np.square(SIGMA_UKF))
    for row in z:
        ukf.predict()
        ukf.update(row)
    return ukf.x


@dataclass(frozen=True)
class Pair:
    """A filter of auvest and filterpy's, on the same measurements."""

    what: str
    ours: Run
    theirs: Run
    measurements: Callable[[], Floats]
    agree_m: float  #: positions of the two lie no further apart
    target: float  #: times that filterpy takes as long


PAIRS = (
    # auvest adds the second-order terms of the range: some mm.
    Pair("EKF, two states, range", auvest_ekf, filterpy_ekf, ranges, 0.01, 8.0),
    Pair("UKF, six states, range and bearing", auvest_ukf, filterpy_ukf, echoes, 1e-6, 50.0),
)


def disagreement_m(pair: Pair) -> float:
    """Return how far the two positions lie apart at most, after some numbers of steps."""
    z = pair.measurements()
    ends = (1, 2, 3, 10, 50, 200, len(z))
    return max(float(np.hypot(*(pair.ours(z[:n]) - pair.theirs(z[:n]))[:2])) for n in ends)
