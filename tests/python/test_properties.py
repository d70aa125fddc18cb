"""Properties that hold for every geometry, found by search instead of by example."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import auvest

PROCESS = auvest.ConstantAcceleration()
SONAR = auvest.RangeBearing()

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


@settings(max_examples=200, deadline=None, derandomize=True)
@given(beliefs(), st.floats(0.1, 600), st.floats(-3.14, 3.14), ALPHAS)
def test_an_update_never_widens_the_belief(belief, range_m, bearing, alpha):
    """P of before minus P of after is positive semidefinite, whatever the measurement says."""
    ukf = auvest.Ukf(*belief, process=PROCESS, sensors=SONAR, alpha=alpha)
    before = ukf.P
    ukf.update([range_m, bearing])
    assert ukf.nis >= 0
    assert np.linalg.eigvalsh(ukf.P)[0] > 0
    gain = np.linalg.eigvalsh(before - ukf.P)
    assert gain[0] > -1e-12 * np.trace(before)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(beliefs(), st.floats(0.01, 50), st.sampled_from(["euler", "exact"]))
def test_two_filters_predict_alike(belief, dt, discretisation):
    """EKF and UKF share a linear process: their predictions have the same bits."""
    process = auvest.ConstantAcceleration(discretisation=discretisation)
    ekf, ukf = (kind(*belief, process=process) for kind in (auvest.Ekf, auvest.Ukf))
    ekf.predict(dt)
    ukf.predict(dt)
    assert np.array_equal(ekf.x, ukf.x)
    assert np.array_equal(ekf.P, ukf.P)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(beliefs(), st.floats(0.1, 600), st.floats(-3.14, 3.14), st.floats(-3.1, 3.1))
def test_turning_the_world_turns_the_estimate(belief, range_m, bearing, turn):
    """Rotate start and measurement about the station: the EKF's posterior is rotated with them.

    Not the UKF's: its points stand along the columns of a triangular root, which does not turn.
    """
    x0, P0 = belief
    off = bearing - np.arctan2(x0[1], x0[0])
    assume(np.hypot(*x0[:2]) > 1e-3)
    assume(abs(np.arctan2(np.sin(off), np.cos(off))) < 3)  # away from the cut of the residual
    sonar = auvest.RangeBearing(station=(0.0, 0.0))
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.kron(np.eye(3), [[c, -s], [s, c]])
    turned = rotation @ P0 @ rotation.T
    a = auvest.Ekf(x0, P0, process=PROCESS, sensors=sonar)
    b = auvest.Ekf(rotation @ x0, (turned + turned.T) / 2, process=PROCESS, sensors=sonar)
    a.update([range_m, bearing])
    b.update([range_m, bearing + turn])
    assume(a.near_field == b.near_field)
    # Rounding of the rotation, magnified by how much sharper the sensor is than the belief.
    moved = np.abs(a.x - x0).max() + np.abs(x0).max()
    assert np.abs(rotation @ a.x - b.x).max() < 1e-7 * moved
