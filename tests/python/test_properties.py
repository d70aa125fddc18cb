"""Properties that hold for every geometry, found by search instead of by example."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import auvest

METRES = st.floats(-500, 500)
SIGMAS = st.floats(0.01, 10)
ALPHAS = st.sampled_from([1.0, 1e-3, 1e-6])


@st.composite
def beliefs(draw):
    """A start x0 and a P0 with standard deviations of 1 cm to 10 m and mild correlations."""
    x0 = np.array([draw(METRES), draw(METRES), *np.zeros(4)])
    sigma = np.array([draw(SIGMAS) for _ in range(6)])
    root = np.eye(6)
    root[np.tril_indices(6, -1)] = [draw(st.floats(-0.5, 0.5)) for _ in range(15)]
    root *= (sigma / np.linalg.norm(root, axis=1))[:, None]
    return x0, root @ root.T


@settings(max_examples=150, deadline=None)
@given(beliefs(), st.floats(0.1, 600), st.floats(-3.14, 3.14), ALPHAS)
def test_an_update_never_widens_the_belief(belief, range_m, bearing, alpha):
    """P of before minus P of after is positive semidefinite, whatever the measurement says."""
    ukf = auvest.Ukf(*belief, alpha=alpha)
    before = ukf.P
    ukf.update([range_m, bearing])
    assert ukf.nis >= 0
    assert np.linalg.eigvalsh(ukf.P)[0] > 0
    gain = np.linalg.eigvalsh(before - ukf.P)
    assert gain[0] > -1e-12 * np.trace(before)


@settings(max_examples=100, deadline=None)
@given(beliefs(), st.floats(0.01, 50), st.sampled_from(["euler", "exact"]))
def test_two_filters_predict_alike(belief, dt, discretisation):
    """EKF and UKF share a linear process: their predictions have the same bits."""
    process = auvest.ConstantAcceleration(discretisation=discretisation)
    ekf, ukf = (kind(*belief, process=process) for kind in (auvest.Ekf, auvest.Ukf))
    ekf.predict(dt)
    ukf.predict(dt)
    assert np.array_equal(ekf.x, ukf.x)
    assert np.array_equal(ekf.P, ukf.P)


@settings(max_examples=100, deadline=None)
@given(beliefs(), st.floats(5, 600), st.floats(-3.14, 3.14), st.floats(-3.1, 3.1), ALPHAS)
def test_turning_the_world_turns_the_estimate(belief, range_m, bearing, turn, alpha):
    """Rotate start and measurement about the station: the posterior is the rotated posterior."""
    x0, P0 = belief
    sonar = auvest.RangeBearing(station=(0.0, 0.0))
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.kron(np.eye(3), [[c, -s], [s, c]])
    a = auvest.Ukf(x0, P0, measurement=sonar, alpha=alpha)
    turned = rotation @ P0 @ rotation.T
    b = auvest.Ukf(rotation @ x0, (turned + turned.T) / 2, measurement=sonar, alpha=alpha)
    # The sigma points stand along the columns of a triangular root, which does not turn with the
    # world: only to second order is the transform the same. Small spread against range, then.
    if np.hypot(*x0[:2]) < 30 * np.sqrt(np.trace(P0[:2, :2])):
        return
    a.update([range_m, bearing])
    b.update([range_m, bearing + turn])
    spread = np.sqrt(np.diag(a.P))
    # Third-order terms: (spread / range)^2, 1e-3, of the correction.
    moved = np.abs(a.x - x0).max() + spread.max()
    assert np.abs(rotation @ a.x - b.x).max() < 5e-3 * moved
