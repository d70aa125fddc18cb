"""The float64 UKF against the textbook form with 60 digits, and all points where nothing is linear.

The textbook form (Julier and Uhlmann's scaled transform: weights lambda/c, 1/(2c), beta; 13 sigma
points, also through the linear process) is written here from the formulas, with nothing in common
with the deviation form of the core: agreement shows that the two are the same filter.
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from filter_support import PAPER, measure
from mpmath import mp, mpf

import auvest

N = 6
ALPHAS = (1.0, 1e-3, 1e-6)


def matrix(array):
    """An mpmath matrix with exactly the numbers of the array."""
    return mpmath.matrix(np.asarray(array, dtype=np.float64).tolist())


def transition(dt, order):
    phi = mpmath.eye(N)
    for i in range(N):
        if i + 2 < N:
            phi[i, i + 2] = dt
        if order == 2 and i + 4 < N:
            phi[i, i + 4] = dt * dt / 2
    return phi


def process_noise(model, dt):
    """Euler: dt diag(q). Exact: integral of Phi(s) diag(q) Phi(s)' over 0..dt."""
    q = [model.position_psd, model.velocity_psd, model.acceleration_psd]
    density = mpmath.diag([mpf(value) for value in q for _ in range(2)])
    if model.discretisation == "euler":
        return dt * density
    total = mpmath.zeros(N)
    # Gauss-Legendre with 3 nodes: exact for the polynomials of degree 4 in Phi diag(q) Phi'.
    root = mpmath.sqrt(mpf(3) / 5)
    for node, weight in ((-root, mpf(5) / 9), (mpf(0), mpf(8) / 9), (root, mpf(5) / 9)):
        phi = transition(dt * (1 + node) / 2, 2)
        total += (weight * dt / 2) * (phi * density * phi.T)
    return total


def wrapped(angle):
    return angle - 2 * mp.pi * mpmath.floor((angle + mp.pi) / (2 * mp.pi))


class Textbook:
    def __init__(self, x0, p0, process, sensor, alpha, beta, kappa):
        self.x, self.P = matrix(np.reshape(x0, (N, 1))), matrix(p0)
        self.process, self.sensor = process, sensor
        self.c = mpf(alpha) ** 2 * (N + mpf(kappa))
        lam = self.c - N
        self.mean_weights = [lam / self.c] + [1 / (2 * self.c)] * (2 * N)
        self.covariance_weights = list(self.mean_weights)
        self.covariance_weights[0] += 1 - mpf(alpha) ** 2 + mpf(beta)

    def points(self):
        factor = mpmath.sqrt(self.c) * mpmath.cholesky(self.P)
        columns = [factor[:, i] for i in range(N)]
        return [self.x, *(self.x + s for s in columns), *(self.x - s for s in columns)]

    def moments(self, values, residual):
        """Mean about the centre point, and the deviations from it."""
        shift = sum(
            (w * residual(v, values[0]) for w, v in zip(self.mean_weights, values, strict=True)),
            mpmath.zeros(values[0].rows, 1),
        )
        return values[0] + shift, [residual(v, values[0]) - shift for v in values]

    def covariance(self, a, b):
        total = mpmath.zeros(a[0].rows, b[0].rows)
        for w, u, v in zip(self.covariance_weights, a, b, strict=True):
            total += w * (u * v.T)
        return total

    def predict(self, dt):
        dt = mpf(dt)
        phi = transition(dt, 1 if self.process.discretisation == "euler" else 2)
        moved = [phi * point for point in self.points()]
        self.x, deviations = self.moments(moved, lambda a, b: a - b)
        self.P = self.covariance(deviations, deviations) + process_noise(self.process, dt)

    def update(self, z):
        bx, by = (mpf(b) for b in self.sensor.station)

        def h(point):
            dx, dy = point[0] - bx, point[1] - by
            return mpmath.matrix([mpmath.sqrt(dx * dx + dy * dy), mpmath.atan2(dy, dx)])

        def residual(a, b):
            return mpmath.matrix([a[0] - b[0], wrapped(a[1] - b[1])])

        points = self.points()
        mean, deviations = self.moments([h(point) for point in points], residual)
        noise = mpmath.diag(
            [mpf(self.sensor.sigma_range_m) ** 2, mpf(self.sensor.sigma_bearing_rad) ** 2]
        )
        s = self.covariance(deviations, deviations) + noise
        cross = self.covariance([point - points[0] for point in points], deviations)
        gain = cross * s**-1
        innovation = residual(matrix(np.reshape(z, (2, 1))), mean)
        self.x = self.x + gain * innovation
        self.P = self.P - gain * s * gain.T
        self.nis = (innovation.T * s**-1 * innovation)[0]


def as_array(m):
    return np.array(m.tolist(), dtype=np.float64)


@pytest.mark.parametrize("alpha", ALPHAS)
@pytest.mark.parametrize("discretisation", ["euler", "exact"])
def test_agrees_with_the_textbook_form(discretisation, alpha):
    # 4 m west of the station and on, across the bearing +-pi; sigma 0.5 m, so that the second
    # order of the transform moves the range by 0.5^2 / (2 * 4) = 3 cm: far above the 1e-9.
    process = auvest.ConstantAcceleration(
        discretisation=discretisation,
        position_psd=1e-3,
        velocity_psd=1e-2,
        acceleration_psd=1e-3,
    )
    sensor = auvest.RangeBearing(station=(0.2, 2.0), sigma_range_m=0.05, sigma_bearing_rad=0.1)
    steps = np.arange(1, 21)
    truth = np.stack([-4.0 - 0.1 * steps, 2.0 + 0.3 * np.sin(steps)], axis=1)
    z = measure(truth, sensor.station, (0.05, 0.1), seed=5)
    x0 = [-4.0, 2.2, -0.2, 0.1, 0.01, 0.02]
    root = np.diag([0.5, 0.5, 0.2, 0.2, 0.02, 0.02])
    root[1, 0], root[2, 0], root[4, 3] = 0.2, 0.1, 0.05
    p0 = root @ root.T

    ukf = auvest.Ukf(x0, p0, process=process, sensors=sensor, alpha=alpha, beta=2.0, kappa=-3.0)
    with mp.workdps(60):
        book = Textbook(x0, p0, process, sensor, alpha, 2.0, -3.0)
        for row in z:
            book.predict(0.5)
            book.update(row)
            ukf.predict(0.5)
            ukf.update(row)
            assert not ukf.near_field  # or it would not be this filter
            assert np.abs(ukf.x - as_array(book.x)[:, 0]).max() < 1e-9  # m, m/s, m/s^2
            assert np.abs(ukf.P - as_array(book.P)).max() < 1e-9
            # P ranges over four decades: relative to the standard deviations as well.
            sigma = np.sqrt(np.diag(ukf.P))
            assert (np.abs(ukf.P - as_array(book.P)) / np.outer(sigma, sigma)).max() < 1e-9
            assert ukf.nis == pytest.approx(float(book.nis), rel=1e-8)
    assert np.sign(z[:, 1]).min() < 0 < np.sign(z[:, 1]).max()


def test_the_textbook_form_in_double_would_fail_at_the_alpha_of_the_paper():
    # Why the comparison needs mpmath: with alpha = 1e-6 the weights of the textbook form cancel.
    with mp.workdps(16):
        book = Textbook(
            [-4.0, 2.2, 0, 0, 0, 0],
            np.diag([0.25, 0.25, 0.04, 0.04, 1e-4, 1e-4]),
            auvest.ConstantAcceleration(),
            auvest.RangeBearing(),
            1e-6,
            2.0,
            -3.0,
        )
        ukf = auvest.Ukf(
            as_array(book.x)[:, 0], as_array(book.P), **PAPER, alpha=1e-6, beta=2.0, kappa=-3.0
        )
        book.update([4.2, 3.1])
        ukf.update([4.2, 3.1])
        assert np.abs(ukf.x - as_array(book.x)[:, 0]).max() > 1e-6


def spherical_points(x, p):
    """The mean and, at a distance of sqrt n, 2 n points of equal weight."""
    offsets = np.sqrt(len(x)) * np.linalg.cholesky(p).T
    return np.concatenate([x[np.newaxis], x + offsets, x - offsets])


@pytest.mark.parametrize(("kind", "centre_weight"), [(auvest.Ckf, 0.0), (auvest.Ukf, 2.0)])
def test_points_agree_with_their_textbook_form_where_nothing_is_linear(kind, centre_weight):
    """A pose by odometry and its bearings: Arasaratnam and Haykin's points of 2009; those of a UKF
    with alpha = 1 and kappa = 0, n = 3, are the same, and the centre counts beta = 2 times in P.
    """
    process = auvest.Odometry(sigma_distance=0.05, sigma_drift=0.3, sigma_turn=0.02)
    sensor = auvest.RangeBearing(station=(0.2, 2.0), sigma_range_m=0.05, sigma_bearing_rad=0.1)
    x, p = np.array([-4.0, 1.0, 0.4]), np.array([[0.2, 0.05, 0.01], [0.05, 0.3, 0], [0.01, 0, 0.1]])
    r = np.diag([0.05**2, 0.1**2])
    f = kind(x, p, process=process, sensors=sensor)
    ekf = auvest.Ekf(x, p, process=process, sensors=sensor)
    weights = np.array([centre_weight, *[1 / 6] * 6])
    rng = np.random.default_rng(3)
    for k in range(20):
        motion = np.array([0.2, 0.05, 0.3 * np.sin(k)])
        moved = np.array([process.f(point, 0.5, motion) for point in spherical_points(x, p)])
        x = moved[1:].mean(axis=0)
        p = (weights * (moved - x).T) @ (moved - x) + process.Q(0.5, motion)
        for g in (f, ekf):
            g.predict(0.5, motion)
        np.testing.assert_allclose(f.x, x, rtol=0, atol=1e-12)
        np.testing.assert_allclose(f.P, p, rtol=0, atol=1e-12)

        points = spherical_points(x, p)
        seen = np.array([sensor.h(point) for point in points])
        seen[:, 1] = np.unwrap(seen[:, 1])  # across +-pi
        mean = seen[1:].mean(axis=0)
        z = mean + [0.05, 0.1] * rng.standard_normal(2)
        s = (weights * (seen - mean).T) @ (seen - mean) + r
        gain = (weights * (points - x).T) @ (seen - mean) @ np.linalg.inv(s)
        x = x + gain @ (z - mean)
        p = p - gain @ s @ gain.T
        for g in (f, ekf):
            g.update([z[0], np.angle(np.exp(1j * z[1]))])
        assert not f.near_field
        np.testing.assert_allclose(f.S, s, rtol=0, atol=1e-12)
        np.testing.assert_allclose(f.x, x, rtol=0, atol=1e-12)
        np.testing.assert_allclose(f.P, p, rtol=0, atol=1e-12)
    assert np.abs(ekf.x - x).max() > 1e-3
