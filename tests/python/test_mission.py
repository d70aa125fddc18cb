"""The closed loop of a vehicle: reproducible, honest about what failed, strict about arguments."""

import dataclasses
import json
import math

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest import FixedInterval, MahalanobisInterval, RejectionStreak
from auvest.cli import app
from auvest.commands.simulate_mission import means_per_step, measures
from auvest.simulation import mission
from auvest.simulation.mission import Mission, simulate


@pytest.fixture(scope="module")
def flown():
    return simulate(Mission(runs=4, circle_s=60, track="circle"))


def test_runs_do_not_depend_on_workers_nor_on_their_number():
    plan = Mission(runs=6, track="circle", circle_s=30)
    one = simulate(plan, workers=1)
    two = simulate(plan, workers=2)
    few = simulate(dataclasses.replace(plan, runs=3))
    for name in ("settled_rms_m", "all_rms_m", "pose", "command", "nis"):
        assert np.array_equal(getattr(one, name), getattr(two, name), equal_nan=True)
        assert np.array_equal(getattr(one, name)[:3], getattr(few, name), equal_nan=True)


def test_the_numbers_of_a_run_are_those_of_its_steps(flown):
    assert flown.pose.shape == (4, 600, 6)
    assert flown.time_s[-1] == pytest.approx(59.9)
    cross = np.sqrt(np.nanmean(np.square(flown.cross_m), axis=1))
    assert flown.all_rms_m == pytest.approx(cross, rel=1e-12)
    error = np.square(flown.estimate_m - flown.pose[..., :2]).sum(axis=-1)
    assert flown.position_rms_m == pytest.approx(np.sqrt(error.mean(axis=1)), rel=1e-12)
    travel = np.abs(np.diff(flown.command[..., 0], axis=1, prepend=0.0)).sum(axis=1)
    assert flown.rudder_travel_rad_s == pytest.approx(travel / flown.duration_s, rel=1e-12)
    fixes = np.isfinite(flown.nis).sum(axis=1)
    assert np.array_equal(flown.fixes, fixes)
    assert flown.mean_interval_s == pytest.approx(flown.duration_s / fixes)


def test_the_cross_track_error_is_the_distance_from_the_circle(flown):
    x, y, radius = mission.CIRCLE
    distance = np.hypot(flown.pose[..., 0] - x, flown.pose[..., 1] - y)
    assert np.abs(flown.cross_m) == pytest.approx(np.abs(radius - distance), abs=1e-9)


def test_without_noise_the_same_every_time():
    """Settled cross-track RMS of the truth, current to the north: two prototypes' printed value."""
    plan = mission.source("truth", "circle", current_rad=0.0, runs=2)
    result = simulate(plan, record=False)
    assert result.settled_rms_m[0] == result.settled_rms_m[1] == pytest.approx(0.66629, abs=6e-6)


def test_a_projection_flies_the_same_track():
    """Roll stiff, depth held: what the plane keeps is what counts for the track."""
    six, three = (
        simulate(
            mission.source(
                "truth", "circle", current_rad=0.5, circle_s=100, runs=1, degrees_of_freedom=n
            )
        )
        for n in (6, 3)
    )
    assert np.abs(six.pose[0, :, :2] - three.pose[0, :, :2]).max() < 0.5
    assert not np.array_equal(six.pose, three.pose)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize(("path", "arc_m"), [("dubins", 20.0), ("dubins", 16.0), ("spline", 0.0)])
def test_curves_are_flown_where_corners_are_missed(path, arc_m, dtype):
    """State known, still water. Where the curvature jumps by 1/R the heading lags by two seconds of
    U/R, and a look-ahead of 10 m makes 10 m times that.
    """
    plan = mission.source(
        "truth_crab", "lawnmower", runs=2, path=path, arc_m=arc_m, dtype=dtype, current_m_s=0.0
    )
    curved = simulate(plan)
    corners = simulate(dataclasses.replace(plan, path="waypoints", arc_m=0.0), record=False)
    assert not curved.failed.any()
    assert corners.all_rms_m.min() > 2
    assert curved.all_rms_m.max() < 0.3 * corners.all_rms_m.min()
    radius_m = arc_m or 10.8  # the tightest bend of the spline
    assert np.nanmax(np.abs(curved.cross_m)) < 10 * 2 * 1.5 / radius_m
    # What it is judged by is the distance from the curve.
    points = mission.track_points(plan)
    for pose, cross in zip(curved.pose[0, ::50, :2], curved.cross_m[0, ::50], strict=True):
        if np.isfinite(cross):
            nearest = np.hypot(*(points - pose).T).min()
            assert nearest == pytest.approx(abs(cross), abs=0.6)  # points are 1 m apart
    # After 60 s there is no corner to settle from.
    flown = np.isfinite(curved.cross_m[0])
    assert np.array_equal(curved.settled[0, flown] > 0, curved.time_s[flown] > 60 + 1e-9)


def test_the_points_of_curves_lie_on_lanes_and_half_circles():
    plan = Mission(path="dubins", arc_m=20.0)
    points = mission.track_points(plan)
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    assert length == pytest.approx(4 * 120 + 3 * np.pi * 20, abs=1)
    on_lane = np.abs(points[:, 1:] - [20, 60, 100, 140]).min(axis=1) < 1e-6
    beyond = (points[:, 0] > 140) | (points[:, 0] < 20)
    x, y = points[~on_lane].T
    centre_x = np.where(x > 80, 140, 20)
    centre_y = 20 + 40 * np.round((y - 40) / 40) + 20
    assert np.hypot(x - centre_x, y - centre_y) == pytest.approx(20, abs=1e-6)
    assert beyond.sum() > 150
    spline = mission.track_points(Mission(path="spline"))
    inside = (spline[:, 0] > 40) & (spline[:, 0] < 120)
    assert np.abs(spline[inside, 1:] - [20, 60, 100, 140]).min(axis=1).max() < 0.5
    assert np.array_equal(mission.track_points(Mission()), mission.LAWNMOWER)
    x, y, radius = mission.CIRCLE
    circle = mission.track_points(Mission(track="circle"))
    assert np.hypot(circle[:, 0] - x, circle[:, 1] - y) == pytest.approx(radius)


def test_the_command_flies_curves(tmp_path):
    base = ["simulate", "mission", "--runs", "2", "--no-figure", "--json", "--output"]
    found = {}
    for name, options in {
        "corners": [],
        "dubins": ["--path", "dubins"],
        "wide": ["--path", "dubins", "--arc", "25"],
        "spline": ["--path", "spline"],
    }.items():
        result = CliRunner().invoke(app, [*base, str(tmp_path / name), *options])
        assert result.exit_code == 0, result.stderr
        found[name] = json.loads(result.stdout)
    assert found["dubins"]["settings"]["arc_m"] == 20
    assert found["wide"]["settings"]["arc_m"] == 25
    assert found["spline"]["settings"]["path"] == "spline"
    corners = found.pop("corners")["results"]["all_rms_m"]
    assert all(one["results"]["all_rms_m"] < corners / 3 for one in found.values())


def test_float32_flies_close_to_float64():
    plans = [Mission(runs=1, track="circle", circle_s=60, dtype=d) for d in ("float64", "float32")]
    one, other = (simulate(plan) for plan in plans)
    assert np.abs(one.pose[..., :2] - other.pose[..., :2]).max() < 0.01
    assert not np.array_equal(one.command, other.command)


def test_a_track_that_is_not_finished_is_a_failure():
    result = simulate(Mission(runs=2, most_s=50))
    assert result.failed.all()
    assert np.isfinite(result.all_rms_m).all()
    numbers = measures(result)
    assert numbers["failed_runs"] == 2
    assert math.isnan(numbers["settled_rms_m"])


def test_outliers_need_a_kernel():
    dirty = mission.source("model_aided_outliers", "circle", circle_s=120, runs=20)
    clean = mission.source("model_aided_crab", "circle", circle_s=120, runs=20)
    robust = mission.source("robust_model_aided_outliers", "circle", circle_s=120, runs=20)
    errors = [simulate(p, record=False).position_rms_m.mean() for p in (clean, robust, dirty)]
    assert errors[1] < 1.2 * errors[0]
    assert errors[2] > 2 * errors[0]


def test_a_policy_chooses_the_interval():
    plan = mission.source("aukf_law", "circle", circle_s=60, runs=2)
    result = simulate(plan)
    assert isinstance(plan.interval, MahalanobisInterval)
    assert np.nanmin(result.interval_s) >= 0.1 - 1e-9
    assert np.nanmax(result.interval_s) <= 1.105 + 1e-9
    assert len(np.unique(result.interval_s[np.isfinite(result.interval_s)])) > 10


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"track": "zigzag"}, "track must be 'lawnmower' or 'circle'"),
        ({"path": "bezier"}, "path must be 'waypoints', 'dubins' or 'spline'"),
        ({"path": "dubins"}, "path 'dubins' needs arc_m"),
        ({"arc_m": 20.1}, r"arc_m = 20\.1 leaves no room: .* 20 m is the largest"),
        ({"switch_m": 40.0}, "switch_m = 40 must be below 40"),
        ({"path": "spline", "arc_m": 20.0}, "arc_m does nothing with path 'spline'"),
        ({"path": "spline", "track": "circle"}, "path 'spline' is for the lawnmower"),
        ({"estimate": "ukf"}, "guidance 'crab' needs an estimate of the current"),
        ({"current_m_s": -0.1}, "current_m_s must not be negative"),
        ({"current_m_s": math.nan}, "current_m_s must be"),
        ({"usbl_outliers": 1.5}, "usbl_outliers must lie in 0..1"),
        ({"period_s": 0.0}, "period_s must be"),
        ({"degrees_of_freedom": 7}, "degrees_of_freedom must lie in 3..6"),
        ({"runs": 0}, "runs must lie in 1"),
        ({"recovery": RejectionStreak()}, "recovery is for filters with a kernel"),
        ({"kernel": "tukey"}, "kernel must be"),
        ({"dtype": "float16"}, "dtype must be"),
    ],
)
def test_wrong_arguments_are_refused_by_name(options, message):
    with pytest.raises(ValueError, match=message):
        Mission(**options)


def test_wrong_types_are_refused_by_name():
    with pytest.raises(TypeError, match="interval must be"):
        Mission(interval=0.5)
    with pytest.raises(TypeError, match="speed_m_s must be a number"):
        Mission(speed_m_s="fast")
    with pytest.raises(TypeError, match=r"mission must be an auvest\.Mission"):
        simulate({})
    with pytest.raises(ValueError, match="name must be"):
        mission.source("kalman", "circle")
    with pytest.raises(ValueError, match="record=False keeps"):
        simulate(Mission(runs=5000))


def test_settings_are_plain():
    plan = Mission(kernel="igg", recovery=RejectionStreak(), interval=FixedInterval(interval_s=2))
    values = json.loads(json.dumps(mission.settings(plan)))
    assert values["interval"] == {"class": "FixedInterval", "interval_s": 2}
    assert values["kernel"]["class"] == "Igg"


def test_the_command_writes_what_it_shows(tmp_path):
    arguments = ["simulate", "mission", "--runs", "2", "--track", "circle", "--json"]
    arguments += ["--output", str(tmp_path), "--outliers", "0.05", "--kernel", "igg"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert document["settings"]["usbl_outliers"] == 0.05
    assert document["results"]["failed_runs"] == 0
    assert 0.2 < document["results"]["settled_rms_m"] < 0.8
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    header, *rows = (tmp_path / "per_step.csv").read_text().splitlines()
    assert header.startswith("time_s,cross_rms_m")
    assert len(rows) == 3400


def test_the_table_says_what_was_flown(tmp_path):
    arguments = ["simulate", "mission", "--runs", "2", "--track", "circle", "--seed", "7"]
    done = CliRunner().invoke(app, [*arguments, "--output", str(tmp_path), "--no-figure"])
    assert done.exit_code == 0, done.output
    plan = Mission(track="circle", runs=2, seed=7)
    title = (
        f"circle, {plan.estimate}, {plan.guidance}: 2 runs, {plan.degrees_of_freedom} degrees of "
        f"freedom, current {plan.current_m_s:g} m/s, seed 7, {plan.dtype}"
    )
    assert title in " ".join(done.stdout.split())


def test_means_per_step_are_root_mean_squares(flown):
    table = means_per_step(flown)
    wanted = np.sqrt(np.square(flown.cross_m).mean(axis=0))
    assert table["cross_rms_m"] == pytest.approx(wanted, rel=1e-12)


def test_the_command_refuses_what_cannot_fly():
    done = CliRunner().invoke(app, ["simulate", "mission", "--filter", "ukf"])
    assert done.exit_code == 2
    assert "guidance 'crab' needs" in done.stderr


def test_the_rows_of_the_table_are_those_of_the_core():
    """Filter, noise, law and policy of each; the prototype's own filter has its noise, 0.02."""
    rows = {name: mission.source(name, "circle", interval_s=0.7) for name in mission.SOURCES}
    assert len(rows) == 13
    assert {row.estimate for row in rows.values()} == set(mission.ESTIMATES)
    fixed = FixedInterval(interval_s=0.7)
    assert sum(row.interval == fixed for row in rows.values()) == 11
    assert rows["aukf_law"].interval == MahalanobisInterval(initial_s=0.5, min_s=0.1, max_s=1.105)
    assert mission.source("aukf_law", "lawnmower").interval.max_s == 1.18
    assert rows["ukf_default_psd"].acceleration_psd == 1e-5
    for name, row in rows.items():
        assert row.usbl_outliers == (0.05 if name.endswith("outliers") else 0)
        assert row.guidance == ("adaptive" if name in ADAPTIVE else "crab")
        assert (row.recovery is None, row.kernel is None) == 2 * (not name.startswith("robust"),)
        prototype = name.startswith("model_aided")
        assert row.model_position == (0.02 if prototype else Mission().model_position)
    assert mission.source("ukf", "circle", runs=3, acceleration_psd=2e-4).acceleration_psd == 2e-4


ADAPTIVE = ("truth", "fixes", "ukf", "ukf_outliers", "ukf_default_psd", "aukf_law", "aukf_budget")
ADAPTIVE += ("model_aided",)
