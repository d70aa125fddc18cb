"""Hulls under Python: closed forms, projections, refusals."""

import numpy as np
import pytest

from auvest.vehicle import NAMES, Hull, parameters

STRAIGHT = np.array([[0.0, 0.0, 20.0]])


def test_the_mass_matrix_is_that_of_a_rigid_body_with_added_mass():
    p = parameters("remus100")
    m, zg = p["body"]["mass_kg"], p["body"]["zg_m"]
    matrix = Hull("remus100").mass_matrix
    added = p["added_mass"]
    wanted = [m + added["surge_kg"], m + added["sway_kg"], m + added["heave_kg"]]
    assert np.diag(matrix)[:3] == pytest.approx(wanted, rel=1e-12)
    # The centre of gravity below the origin couples surge with pitch and sway with roll.
    assert matrix[0, 4] == pytest.approx(m * zg, rel=1e-12)
    assert matrix[1, 3] == pytest.approx(-m * zg, rel=1e-12)
    assert np.array_equal(matrix, matrix.T)


def test_terminal_speed_is_where_thrust_meets_drag():
    """0.0999430 m per revolution without the linear damping, which fades with the speed."""
    hull = Hull("remus100")
    for rpm in (900, 1525):
        end = hull.run(np.tile([0, 0, rpm / 60], (6000, 1)), 0.05).velocity[-1, 0]
        assert end == pytest.approx(0.0999430 * rpm / 60, rel=2e-3)
    assert end / (1525 / 60) == pytest.approx(0.0999430, rel=1e-3)


def test_a_steady_current_only_carries_the_hull():
    """Seen from the water, the run is the one without a current."""
    commands = np.tile([0.1, 0.02, 20.0], (1000, 1))
    still = Hull("remus100").run(commands, 0.02, velocity=[1.5, 0, 0, 0, 0, 0])
    current = np.array([0.3, -0.2, 0.1])
    carried = Hull("remus100").run(commands, 0.02, velocity=[1.5, 0, 0, 0, 0, 0], current=current)
    drift = still.pose[:, :3] + carried.time_s[:, None] * current
    assert np.abs(carried.pose[:, :3] - drift).max() < 1e-10
    assert np.array_equal(carried.velocity, still.velocity)


def test_without_roll_moments_six_degrees_of_freedom_stay_in_the_plane():
    level = {"body": {"zg_m": 0.0}, "propeller": {"roll_torque": 0.0}}
    commands = np.tile([0.17, 0.0, 20.0], (500, 1))
    flat = Hull("remus100", degrees_of_freedom=3, changes=level).run(commands, 0.02)
    whole = Hull("remus100", changes=level).run(commands, 0.02)
    plane = [0, 1, 5]
    assert np.abs(whole.pose[:, plane] - flat.pose[:, plane]).max() < 1e-12
    assert not whole.pose[:, 2:5].any()


def test_axes_and_actuators_have_names():
    assert Hull("remus100", degrees_of_freedom=4).axes == ("u_m_s", "v_m_s", "p_rad_s", "r_rad_s")
    assert Hull("remus100").actuators == ("rudder_rad", "stern_planes_rad", "propeller_rev_s")
    assert len(Hull("bluerov2_heavy").actuators) == 8
    for name in NAMES:
        assert Hull(name).parameters == parameters(name)


def test_float32_is_close_to_float64_and_keeps_its_type():
    commands = np.tile([0.1, 0.0, 20.0], (500, 1))
    single = Hull("remus100", dtype="float32").run(commands, 0.02)
    double = Hull("remus100").run(commands, 0.02)
    assert single.pose.dtype == np.float32
    # 500 steps of RK4 whose sums round to 6e-8 of some 10 m.
    assert np.abs(single.pose - double.pose).max() < 500 * 4 * 6e-8 * 20


def test_what_is_not_free_stays_where_it_was():
    run = Hull("remus100", degrees_of_freedom=3).run(
        np.tile(STRAIGHT, (10, 1)), 0.1, pose=[1, 2, 5, 0.1, 0, 0.5]
    )
    assert (run.pose[:, 2:5] == [5, 0.1, 0]).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body": {"mass_kg": 0.0}}, "out of its range"),
        ({"body": {"mass_kg": -3.0}}, "out of its range"),
        ({"added_mass": {"surge_kg": -40.0}}, "mass matrix is not positive definite|out of its"),
        ({"body": {"mass": 3.0}}, "changes.body has no parameter 'mass', but mass_kg"),
        ({"hull": {}}, "changes has no parameter 'hull', but body"),
    ],
)
def test_parameters_that_no_hull_has_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Hull("remus100", changes=changes)


def test_a_step_that_is_too_long_is_refused_with_the_longest():
    hull = Hull("remus100")
    most = hull.largest_stable_step([0, 0, 20])
    with pytest.raises(ValueError, match=r"dt must be at most 0\.\d+ s for rk4"):
        hull.run(np.tile(STRAIGHT, (10, 1)), 5.0)
    assert 0.1 < most < 5.0
    # Rates whose modes overflow: no step is stable, and that is said at once.
    with pytest.raises(ValueError, match="dt must be at most"):
        hull.run(STRAIGHT, 0.1, velocity=[1.0, 0.0, 0.0, 0.0, 1e39, 0.0])


def test_wrong_arguments_are_refused_by_name():
    hull = Hull("remus100")
    with pytest.raises(ValueError, match="name must be"):
        Hull("titanic")
    with pytest.raises(ValueError, match=r"degrees_of_freedom must lie in 3\.\.6"):
        Hull("remus100", degrees_of_freedom=2)
    with pytest.raises(ValueError, match="commands has shape"):
        hull.run([[0, 0]], 0.1)
    with pytest.raises(ValueError, match="commands"):
        hull.run([[np.nan, 0, 0]], 0.1)
    with pytest.raises(ValueError, match="dt must be"):
        hull.run(STRAIGHT, 0.0)
    with pytest.raises(ValueError, match="current"):
        hull.run(STRAIGHT, 0.1, current=[0, np.inf, 0])
    with pytest.raises(RuntimeError, match="pitch is beyond 80 degrees"):
        hull.run(STRAIGHT, 0.1, pose=[0, 0, 0, 0, 1.5, 0])
