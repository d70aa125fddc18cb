"""Imm: a master whose manoeuvres nobody announces, under Python."""

import copy
import math

import numpy as np
import pytest

import auvest

SONAR = auvest.Sonar(sigma_range_m=0.3, sigma_bearing_rad=0.003, bearing="from_heading")
MOTION = auvest.UnicycleMotion(sigma_speed_m_s=0.01, sigma_yaw_rate_rad_s=1e-4)
MASTER = auvest.Imm(
    straight=auvest.ConstantVelocity(velocity_psd=1e-4, sigma_acceleration_m_s2=0.3),
    accelerated=auvest.ConstantAcceleration(position_psd=0, velocity_psd=0, acceleration_psd=1e-4),
    turning=auvest.CoordinatedTurn(
        position_psd=0, velocity_psd=0, acceleration_psd=1e-4, slow_m_s=0.1
    ),
    share=(0.6, 0.2, 0.2),
    switch_rate_hz=0.02,
)
START = np.array([1.0, 2.0, 3.0])


def filters(dtype="float64"):
    common = {"motion": MOTION, "master": MASTER, "sonar": SONAR, "dtype": dtype}
    return (
        auvest.EkfSlat(START, 1e-4 * np.eye(3), **common),
        auvest.Slatf(START, 1e-4 * np.eye(3), particles=50, version=2, **common),
    )


def turning_master(seconds):
    """Positions each second: 5 m/s, straight for 100 s, then turning at 0.1 rad/s."""
    heading, position, result = 0.0, np.array([40.0, 60.0]), []
    for t in range(seconds):
        for _ in range(100):
            heading += 0.001 if t >= 100 else 0.0
            position += 0.05 * np.array([math.cos(heading), math.sin(heading)])
        result.append(position.copy())
    return np.array(result)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_turn_is_recognised(dtype):
    rng = np.random.default_rng(1)
    gap = turning_master(150) - START[:2]
    z = np.column_stack([np.hypot(*gap.T), np.arctan2(gap[:, 1], gap[:, 0]) - START[2]])
    z += rng.normal(size=z.shape) * [0.3, 0.003]
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    for filter_ in filters(dtype):
        filter_.add_master([40, 60, 0, 0, 0, 0], np.diag([4, 4, 25, 25, 0.01, 0.01]))
        chances = []
        for row in z:
            filter_.step(1, [0, 0], row)
            chances.append(filter_.mode_probabilities(0))
        chances = np.array(chances)
        assert chances.dtype == dtype
        np.testing.assert_allclose(chances.sum(axis=1), 1, atol=1e-5)
        straight = chances[:, 0]
        assert straight[70:100].mean() > 0.9
        assert straight[120:150].mean() < 0.2


def test_run_is_step_by_step_and_a_copy_goes_on_alone():
    time_s = np.arange(0, 11.0)
    u = np.tile([0.1, 0.01], (10, 1))
    z = np.tile([70.0, -1.5], (10, 1))
    for filter_ in filters():
        filter_.add_master([40, 60, 0, 0, 0, 0], np.diag([4, 4, 1, 1, 0.01, 0.01]))
        alone = copy.deepcopy(filter_)
        run = filter_.run(time_s, u, z=z, z_time_s=time_s[1:])
        for k in range(10):
            alone.predict(1, u[k])
            alone.update(z[k])
        assert (run.x[-1] == alone.x).all()
        assert (filter_.mode_probabilities(0) == alone.mode_probabilities(0)).all()


def test_modes_need_an_imm_and_a_master():
    for filter_ in filters():
        with pytest.raises(ValueError, match="there is no master 0"):
            filter_.mode_probabilities(0)
    plain = auvest.EkfSlat([0, 0], np.eye(2))
    plain.add_master([40, 60, 0, 0, 0, 0], np.eye(6))
    with pytest.raises(ValueError, match=r"need an auvest\.Imm"):
        plain.mode_probabilities(0)


def test_ekf_slat_takes_two_masters():
    ekf = filters()[0]
    for expected in range(2):
        assert ekf.add_master([40, 60, 0, 0, 0, 0], np.eye(6)) == expected
    with pytest.raises(ValueError, match="2 masters already"):
        ekf.add_master([40, 60, 0, 0, 0, 0], np.eye(6))


@pytest.mark.parametrize(
    ("arguments", "error", "names"),
    [
        ({"share": (0.5, 0.5)}, ValueError, "share"),
        ({"share": (0.5, 0.5, 0.5)}, ValueError, "share"),
        ({"share": (-0.5, 1.0, 0.5)}, ValueError, "share"),
        ({"switch_rate_hz": -1}, ValueError, "switch_rate_hz"),
        ({"switch_rate_hz": math.nan}, ValueError, "switch_rate_hz"),
        ({"straight": auvest.CoordinatedTurn()}, TypeError, "straight"),
        ({"accelerated": auvest.ConstantAcceleration(discretisation="euler")}, ValueError, "exact"),
        ({"turning": None}, TypeError, "turning"),
    ],
)
def test_bad_input_names_the_argument(arguments, error, names):
    with pytest.raises(error, match=names):
        auvest.Imm(**arguments)


def test_bad_models():
    with pytest.raises(ValueError, match="slow_m_s"):
        auvest.CoordinatedTurn(slow_m_s=0)
    with pytest.raises(ValueError, match="velocity_psd"):
        auvest.ConstantVelocity(velocity_psd=-1)
    with pytest.raises(ValueError, match="lanes"):
        auvest.Slatf([0, 0], np.eye(2), master=MASTER, dtype="float32", lanes="sse2")
