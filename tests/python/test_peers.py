"""The float64 UKF with alpha = 1 against filterpy's."""

from __future__ import annotations

import numpy as np
import pytest
from filter_support import measure
from filterpy import kalman

import auvest

SENSOR = auvest.RangeBearing(station=(10.0, -20.0), sigma_range_m=1.0, sigma_bearing_rad=0.05)


def h(x):
    dx, dy = x[0] - SENSOR.station[0], x[1] - SENSOR.station[1]
    return np.array([np.hypot(dx, dy), np.arctan2(dy, dx)])


def residual(a, b):
    d = a - b
    d[1] = (d[1] + np.pi) % (2 * np.pi) - np.pi
    return d


def mean_about_centre(sigmas, weights):
    return sigmas[0] + sum(
        w * residual(s.copy(), sigmas[0]) for w, s in zip(weights, sigmas, strict=True)
    )


@pytest.mark.parametrize("discretisation", ["euler", "exact"])
@pytest.mark.parametrize("kappa", [-3.0, 1.0])
def test_agrees_with_filterpy(discretisation, kappa):
    steps, dt = 300, 0.5
    process = auvest.ConstantAcceleration(
        discretisation=discretisation,
        position_psd=2e-2,
        velocity_psd=2e-3,
        acceleration_psd=2e-4,
    )
    # A circle of 60 m radius round the station, twice: all bearings.
    angle = 0.04 * np.arange(1, steps + 1)
    truth = SENSOR.station + 60.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = measure(truth, SENSOR.station, (1.0, 0.05), seed=2)
    x0 = np.array([70.0, -20.0, 0.0, 4.8, 0.0, 0.0])
    p0 = np.diag([9.0, 9.0, 1.0, 1.0, 0.1, 0.1])

    phi = process.Phi(dt)
    points = kalman.MerweScaledSigmaPoints(6, alpha=1.0, beta=2.0, kappa=kappa)
    peer = kalman.UnscentedKalmanFilter(
        6,
        2,
        dt,
        h,
        lambda x, _: phi @ x,
        points,
        z_mean_fn=mean_about_centre,
        residual_z=residual,
    )
    peer.x, peer.P = x0.copy(), p0.copy()
    peer.Q, peer.R = process.Q(dt), np.diag([1.0, 0.05**2])
    ours = auvest.Ukf(x0, p0, process=process, sensors=SENSOR, alpha=1.0, beta=2.0, kappa=kappa)

    for row in z:
        peer.predict()
        peer.sigmas_f = points.sigma_points(peer.x, peer.P)  # redrawn, if this version does not
        peer.update(row)
        ours.predict(dt)
        ours.update(row)
        assert not ours.near_field
        assert np.abs(ours.x - peer.x).max() < 1e-9
        assert np.abs(ours.P - peer.P).max() < 1e-9
        assert np.abs(ours.innovation - peer.y).max() < 1e-9
        assert np.abs(ours.S - peer.S).max() < 1e-9
    assert np.hypot(*(ours.x[:2] - truth[-1])) < 10  # both followed the circle
