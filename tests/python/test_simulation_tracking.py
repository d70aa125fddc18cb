"""The tracking scenario: reproducible from its seed, true to its description, open on failures."""

from __future__ import annotations

import dataclasses
import threading

import numpy as np
import pytest
from filter_support import PAPER, everything, same_bits
from result_support import tracking_result

import auvest
from auvest import _core
from auvest.filters import _many
from auvest.simulation import tracking
from auvest.simulation.tracking import Noise, Scenario, Track, simulate

START = [0.2, 2.0, 0.1, 0.2, 0.01, 0.02]
P0 = np.diag([0.01, 0.01, 0.01, 0.01, 1e-4, 1e-4])
EULER = auvest.ConstantAcceleration(discretisation="euler")
ARRAYS = [f.name for f in dataclasses.fields(tracking.TrackingResult) if f.name != "scenario"]


def aukf(**options):
    return auvest.Aukf(START, P0, **{"process": EULER, **options})


def ukf(**options):
    return auvest.Ukf(START, P0, **{**PAPER, "process": EULER, **options})


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_the_number_of_workers_does_not_change_a_bit(dtype):
    f = aukf(dtype=dtype)
    scenario = Scenario(
        runs=37,
        steps=30,
        seed=3,
        noise=Noise(dropout=0.2),
        probe_period_s=0.1,
    )
    expected = simulate(f, scenario, workers=1)
    for workers in (2, 5, 64, None):
        result = simulate(f, scenario, workers=workers)
        for name in ARRAYS:
            assert same_bits(getattr(result, name), getattr(expected, name)), name
    # The first runs of a longer simulation are the shorter simulation.
    more = simulate(f, dataclasses.replace(scenario, runs=50))
    assert same_bits(more.x[:37], expected.x)
    other = simulate(f, dataclasses.replace(scenario, seed=4))
    assert np.isclose(other.z, expected.z).mean() < 0.01


def test_the_prototype_is_not_changed():
    f = aukf()
    f.predict()
    f.update([0.3, 1.0])
    f.feedback()
    before = everything(f)
    simulate(f, Scenario(runs=3))
    assert everything(f) == before


def test_a_simulated_run_is_the_filter_on_its_record():
    f = aukf(dtype="float32")
    result = simulate(f, Scenario(runs=4, steps=40, noise=Noise(dropout=0.1)))
    for r in range(4):
        sensor = auvest.RangeBearing(smallest_range_m=-1.0)  # the noise is not cut off at 0
        twin = aukf(dtype="float32", sensors=sensor)
        run = twin.run(result.z[r], reference=result.truth[r])
        assert same_bits(run.x.astype(np.float64), result.x[r])
        assert same_bits(run.interval_s.astype(np.float64), result.interval_s[r])
        assert same_bits(run.nis.astype(np.float64), result.nis[r])
        position = run.P[:, :2, :2].astype(np.float64)
        assert same_bits(position, result.position_covariance[r])
        assert result.tau[r, -1] == twin.tau
        assert result.mahalanobis_squared[r, -1] == twin.mahalanobis_squared


def test_time_is_the_sum_of_the_intervals():
    result = simulate(aukf(), Scenario(runs=5))
    steps = np.concatenate([np.full((5, 1), 0.5), result.interval_s[:, :-1]], axis=1)
    assert result.time_s == pytest.approx(np.cumsum(steps, axis=1), rel=1e-12)
    assert result.mean_interval_s == pytest.approx(result.time_s[:, -1].mean() / 60, rel=1e-12)
    assert (result.samples == 60).all()


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_filters_without_a_law_use_the_interval_of_the_scenario(kind):
    result = simulate(kind(START, P0, **PAPER), Scenario(runs=2, steps=10, interval_s=0.25))
    assert result.time_s == pytest.approx(np.tile(0.25 * np.arange(1, 11), (2, 1)), rel=1e-15)
    assert (result.interval_s == 0.25).all()


def test_the_tracks_by_hand():
    def truth(**track):
        scenario = Scenario(runs=1, steps=8, interval_s=0.5, track=Track(**track))
        return simulate(auvest.Ukf(START, P0, **PAPER), scenario).truth[0]

    t = 0.5 * np.arange(1, 9)[:, None]
    p, v, a = np.array([0.2, 2.0]), np.array([0.1, 0.2]), np.array([0.01, 0.02])
    assert truth(kind="straight") == pytest.approx(p + v * t + a * t**2 / 2, rel=1e-13)
    # Eq. (4): the position moves by the old velocity, so a t^2 / 2 loses a t dt / 2.
    assert truth(kind="euler") == pytest.approx(p + v * t + a * t * (t - 0.5) / 2, rel=1e-13)
    # A circle of radius speed / rate to the left of the velocity.
    rate = 0.3
    radius = np.hypot(0.1, 0.2) / rate
    heading = np.arctan2(0.2, 0.1)
    centre = p + radius * np.array([-np.sin(heading), np.cos(heading)])
    turned = (heading + rate * t - np.pi / 2)[:, 0]
    circle = centre + radius * np.stack([np.cos(turned), np.sin(turned)], axis=1)
    assert truth(kind="turn", turn_rate=rate) == pytest.approx(circle, rel=1e-12)


KINDS = {"normal": (0.0, 1.0), "uniform": (0.5, 12**-0.5), "lognormal": (1.6487, 2.1612)}


@pytest.mark.parametrize("centred", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_the_noise_has_the_mean_and_standard_deviation_it_says(kind, centred):
    noise = Noise(kind=kind, range_m=0.05, bearing_rad=0.01, centred=centred)
    mean, deviation = KINDS[kind]
    mean = 0.0 if centred else mean
    assert noise.mean == pytest.approx((0.05 * mean, 0.01 * mean), rel=1e-4)
    assert noise.standard_deviation == pytest.approx((0.05 * deviation, 0.01 * deviation), rel=1e-4)

    # Seen in the measurements of a track far from the station.
    track = Track(kind="straight", position=(30.0, 20.0))
    f = auvest.Ukf([30, 20, 0.1, 0.2, 0.01, 0.02], P0, **PAPER)
    result = simulate(f, Scenario(track=track, noise=noise, runs=500, steps=100))
    d = result.truth - PAPER["sensors"].station
    error = (
        np.stack(
            [
                result.z[..., 0] - np.hypot(d[..., 0], d[..., 1]),
                result.z[..., 1] - np.arctan2(d[..., 1], d[..., 0]),
            ]
        )
        / np.array([0.05, 0.01])[:, None, None]
    )
    # 5e4 draws of each: five standard deviations of the mean, wider for the lognormal's tail.
    assert error.mean(axis=(1, 2)) == pytest.approx([mean, mean], abs=5 * deviation / 5e4**0.5)
    tolerance = 0.15 if kind == "lognormal" else 0.02
    assert error.std(axis=(1, 2)) == pytest.approx([deviation] * 2, rel=tolerance)
    assert abs(np.corrcoef(error.reshape(2, -1))[0, 1]) < 5 / 5e4**0.5


def test_dropouts_are_missing_measurements():
    result = simulate(ukf(), Scenario(runs=200, steps=50, noise=Noise(dropout=0.3)))
    missing = np.isnan(result.z[..., 0])
    # 1e4 draws: 0.3 with a standard deviation of 0.0046, five of them.
    assert missing.mean() == pytest.approx(0.3, abs=0.023)
    assert (missing == np.isnan(result.z[..., 1])).all()
    assert (missing == np.isnan(result.nis)).all()
    assert np.isfinite(result.x).all()


def test_a_filter_that_knows_the_noise_is_consistent():
    track = Track(kind="straight", position=(3.0, 4.0), acceleration=(0.0, 0.0))
    process = auvest.ConstantAcceleration(position_psd=0.0, velocity_psd=0.0, acceleration_psd=1e-9)
    # Each run starts at the true state, so the NEES grows from 0 to its 2 as noise comes in
    # only if P0 is small; the NIS is white from the first step.
    f = auvest.Ukf(
        [3.0, 4.0, 0.1, 0.2, 0, 0],
        np.diag([1e-6] * 2 + [1e-8] * 2 + [1e-10] * 2),
        process=process,
        sensors=PAPER["sensors"],
    )
    result = simulate(f, Scenario(track=track, runs=200, steps=60))
    low, high = auvest.metrics.chi2_bounds(2, 200 * 60, level=0.999)
    assert low < result.nis.mean() < high
    assert result.error.shape == (200, 60, 2)
    assert result.nees.shape == (200, 60)
    assert result.rmse_m == pytest.approx(np.sqrt((result.error**2).sum(-1).mean()), rel=1e-12)


def test_a_random_start_is_a_draw_from_the_belief():
    # With every measurement missing the error is that of the start, carried forward.
    scenario = Scenario(
        track=Track(kind="straight"),
        noise=Noise(dropout=1.0),
        runs=2000,
        steps=5,
        random_start=True,
    )
    p0 = P0.copy()
    p0[0, 1] = p0[1, 0] = 0.008
    p0[0, 2] = p0[2, 0] = -0.005
    quiet = auvest.ConstantAcceleration(position_psd=0, velocity_psd=0, acceleration_psd=0)
    f = auvest.Ukf(START, p0, process=quiet, sensors=PAPER["sensors"])
    result = simulate(f, scenario)
    for step in range(5):
        low, high = auvest.metrics.chi2_bounds(2, 2000, level=0.9999)
        assert low < result.nees[:, step].mean() < high
        # Five standard deviations of a mean of 2000.
        deviation = np.sqrt(np.diagonal(result.position_covariance[0, step]) / 2000)
        assert (np.abs(result.error[:, step].mean(axis=0)) < 5 * deviation).all()
    fixed = simulate(f, dataclasses.replace(scenario, random_start=False, runs=2))
    assert np.abs(fixed.error).max() < 1e-12


def test_a_vehicle_that_wanders_leaves_the_truth_and_moves_the_reference():
    noise = Noise(range_m=1e-6, bearing_rad=1e-6)
    sensor = auvest.RangeBearing(sigma_range_m=1e-6, sigma_bearing_rad=1e-6)
    policy = auvest.MahalanobisInterval(scale=0.0, ratio_max=1.0, gamma1_m2=1e-12, max_s=10.0)
    # A small P0: the transform shifts the range by sigma^2 / (2 r).
    f = auvest.Aukf([3.0, 4.0, 0.1, -0.2, 0, 0], 1e-4 * P0, sensors=sensor, policy=policy)
    track = Track(
        kind="straight",
        position=(3.0, 4.0),
        velocity=(0.1, -0.2),
        acceleration=(0.0, 0.0),
        wander_m=0.5,
        wander_period_s=40.0,
    )
    result = simulate(f, Scenario(track=track, noise=noise, runs=1, steps=1))
    assert result.truth[0, 0] == pytest.approx([3.05, 3.9], rel=1e-14)
    # The desired position after 0.5 s is the true one plus 0.5 m (cos - 1, sin) of a turn / 80, and
    # the estimate is the truth: M of Eq. (7) is the ratio of the two displacements.
    angle = 2 * np.pi * 0.5 / 40
    desired = [0.05 + 0.5 * (np.cos(angle) - 1), -0.1 + 0.5 * np.sin(angle)]
    ratio = (desired[0] ** 2 + desired[1] ** 2) / (0.05**2 + 0.1**2)
    assert ratio < 0.6  # not clamped
    assert result.interval_s[0, 0] == pytest.approx(0.5 * ratio * 10.0, rel=1e-3)
    straight = dataclasses.replace(track, wander_m=0.0)
    other = simulate(f, Scenario(track=straight, noise=noise, runs=1, steps=1))
    assert same_bits(other.truth, result.truth)
    assert other.mahalanobis_squared[0, 0] != result.mahalanobis_squared[0, 0]


def test_the_preset_of_figure_3_does_what_figure_3_shows():
    interval = simulate(aukf(), Scenario(runs=200)).interval_s.mean(axis=0)
    assert interval[:5].min() < 0.45
    assert interval[14] > 0.5
    assert 0.55 < interval[-20:].min() <= interval[-20:].max() < 0.65


def test_the_preset_of_table_1_collapses():
    law = auvest.MahalanobisInterval("table1")
    interval = simulate(aukf(policy=law), Scenario(runs=50)).interval_s
    assert interval[:, 3:].max() <= max(0.018, law.min_s)


def test_duration_ends_a_run_and_leaves_nan_behind():
    result = simulate(ukf(), Scenario(runs=3, steps=100, duration_s=10.0, interval_s=0.3))
    assert (result.samples == 33).all()  # 9.9 s
    assert (result.status == 0).all()
    assert np.isfinite(result.x[:, :33]).all()
    for name in ("time_s", "interval_s", "truth", "z", "x", "position_covariance", "nis"):
        assert np.isnan(getattr(result, name)[:, 33:]).all()
    assert result.mean_interval_s == pytest.approx(0.3)
    assert np.isfinite(result.rmse_m)


def test_probes_measure_the_error_between_samples():
    # With a sample every 0.5 s and a probe every 0.01 s the error over time is that at the samples
    # plus what grows in between; without probes both are NaN.
    scenario = Scenario(runs=100, steps=60, probe_period_s=0.01, budget_m=0.05)
    result = simulate(ukf(), scenario)
    assert (result.probe_count == 2999).all() | (result.probe_count == 3000).all()
    assert result.rmse_m < result.rmse_over_time_m < 1.5 * result.rmse_m
    above = np.hypot(*np.moveaxis(result.error, -1, 0)) > 0.05
    assert result.time_above_budget == pytest.approx(above.mean(), abs=0.15)
    wide = simulate(ukf(), dataclasses.replace(scenario, budget_m=100.0))
    assert wide.time_above_budget == 0
    silent = simulate(ukf(), dataclasses.replace(scenario, probe_period_s=0.0))
    assert np.isnan(silent.rmse_over_time_m)
    assert np.isnan(silent.time_above_budget)
    assert same_bits(silent.x, result.x)  # looking does not disturb


def test_a_run_that_fails_is_reported_and_keeps_its_rows():
    # float32 cannot square a range of 1e20 m: lognormal noise of that size comes now and then.
    noise = Noise(kind="lognormal", range_m=1e18, bearing_rad=0.01)
    sensor = auvest.RangeBearing(sigma_range_m=1e18)
    f = ukf(dtype="float32", sensors=sensor)
    result = simulate(f, Scenario(runs=60, steps=200, noise=noise))
    assert 0 < result.failed.sum() < 60
    assert result.failed.tolist() == (result.samples < 200).tolist()
    assert set(result.status[result.failed]) == {int(auvest.Status.overflow)}
    r = int(np.argmax(result.failed))
    count = result.samples[r]
    assert np.isfinite(result.x[r, :count]).all()
    assert np.isnan(result.x[r, count:]).all()


def test_progress_counts_up_in_the_calling_thread():
    seen = []
    caller = threading.get_ident()

    def progress(done, total):
        assert threading.get_ident() == caller
        seen.append((done, total))

    simulate(ukf(), Scenario(runs=100), workers=3, progress=progress)
    assert [total for _, total in seen] == [100] * len(seen)
    assert len(seen) > 5
    done = [d for d, _ in seen]
    assert done == sorted(done)
    assert done[-1] == 100


def test_an_error_in_progress_ends_the_simulation():
    def progress(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(ukf(), Scenario(runs=100), progress=progress)


BAD = [
    (lambda: Track(kind="circle"), ValueError, "kind must be 'euler', 'straight' or 'turn'"),
    (lambda: Track(position=(1, 2, 3)), ValueError, r"position has shape \(3,\), expected \(2,\)"),
    (lambda: Track(velocity=(np.nan, 0)), ValueError, r"velocity\[0\] is nan"),
    (lambda: Track(turn_rate=np.inf), ValueError, "turn_rate must be finite"),
    (lambda: Track(wander_m=-1), ValueError, "wander_m must not be negative"),
    (lambda: Track(wander_period_s=0), ValueError, "wander_period_s must be positive"),
    (lambda: Scenario(random_start=1), TypeError, "random_start must be True or False"),
    (lambda: Noise(kind="cauchy"), ValueError, "kind must be 'normal', .* not 'cauchy'"),
    (lambda: Noise(range_m=-1), ValueError, "range_m must not be negative"),
    (lambda: Noise(dropout=1.1), ValueError, r"dropout must lie in 0\.\.1, not 1\.1"),
    (lambda: Noise(centred=1), TypeError, "centred must be True or False, not 1"),
    (lambda: Scenario(track="straight"), TypeError, r"track must be an auvest\.Track, not str"),
    (lambda: Scenario(noise=0.05), TypeError, r"noise must be an auvest\.Noise, not float"),
    (lambda: Scenario(steps=0), ValueError, r"steps must lie in 1\.\.10000000, not 0"),
    (lambda: Scenario(steps=1.5), TypeError, "steps must be an integer, not float"),
    (lambda: Scenario(runs=True), TypeError, "runs must be an integer, not bool"),
    (lambda: Scenario(runs=10**6, steps=11), ValueError, r"runs \* steps must be at most"),
    (lambda: Scenario(seed=-1), ValueError, "seed must lie in"),
    (lambda: Scenario(seed=2**64), ValueError, "seed must lie in"),
    (lambda: Scenario(duration_s=0), ValueError, "duration_s must be positive"),
    (lambda: Scenario(duration_s=np.nan), ValueError, "duration_s must be finite"),
    (lambda: Scenario(interval_s=0), ValueError, "interval_s must be positive"),
    (lambda: Scenario(probe_period_s=1e-9), ValueError, "probe_period_s must be 0 or at least"),
    (lambda: Scenario(budget_m=0), ValueError, "budget_m must be positive"),
    (lambda: simulate("ukf"), TypeError, r"filter must be an auvest\.Ekf or .*, not str"),
    (lambda: simulate(ukf(), 5), TypeError, r"scenario must be an auvest\.Scenario, not int"),
    (lambda: simulate(ukf(), workers=0), ValueError, r"workers must lie in 1\.\.256, not 0"),
    (lambda: simulate(ukf(), progress=1), TypeError, "progress must be callable, not int"),
]


@pytest.mark.parametrize(("call", "error", "message"), BAD)
def test_bad_input(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_as_many_samples_as_there_is_room_for():
    runs = tracking.MAX_SAMPLES // 1000
    assert Scenario(runs=runs, steps=1000).runs == runs
    with pytest.raises(ValueError, match=r"runs \* steps must be at most 10000000"):
        Scenario(runs=runs + 1, steps=1000)


def test_probes_are_off_or_a_tenth_of_a_millisecond_apart():
    assert Scenario(probe_period_s=0.0).probe_period_s == 0.0
    assert Scenario(probe_period_s=1e-4).probe_period_s == 1e-4
    with pytest.raises(ValueError, match="probe_period_s must be 0 or at least 1e-4"):
        Scenario(probe_period_s=0.99e-4)


def test_the_figures_of_a_result_by_hand():
    """Runs that end after 3 and after 2 samples, at 3 and at 5 s; squares of 25, 0, 0 and 1, 4."""
    nan = np.nan
    result = tracking_result(
        [[[3, -4], [0, 0], [0, 0]], [[0, 1], [2, 0], [nan, nan]]],
        time_s=np.array([[1.0, 2.0, 3.0], [1.0, 5.0, nan]]),
        samples=np.array([3, 2]),
        status=np.array([0, 4]),
        position_covariance=np.broadcast_to(np.diag([4.0, 16.0]), (2, 3, 2, 2)),
        probe_square_sum=np.array([8.0, 10.0]),
        probe_above=np.array([1.0, 3.0]),
        probe_count=np.array([2.0, 6.0]),
    )
    assert result.failed.tolist() == [False, True]
    assert result.rmse_m == pytest.approx(np.sqrt(30 / 5))
    assert result.mean_interval_s == pytest.approx(8 / 5)
    assert result.nees[:, 0] == pytest.approx([9 / 4 + 16 / 16, 1 / 16])
    assert result.rmse_over_time_m == pytest.approx(np.sqrt(18 / 8))
    assert result.time_above_budget == pytest.approx(4 / 8)
    unprobed = tracking_result(np.zeros((2, 3, 2)), samples=np.zeros(2, int))
    for figure in ("rmse_over_time_m", "time_above_budget", "mean_interval_s"):
        assert np.isnan(getattr(unprobed, figure))


def test_start_is_the_state_that_the_track_leaves_with():
    straight = tracking.Track(
        kind="straight", position=(1, 2), velocity=(3, 4), acceleration=(5, 6)
    )
    assert straight.start == (1, 2, 3, 4, 5, 6)
    turn = tracking.Track(kind="turn", position=(1, 2), velocity=(3, 4), turn_rate=0.5)
    # The centripetal acceleration is the second difference of the track.
    h = 1e-3
    p = np.array([turn.position_at(t) for t in (0, h, 2 * h)])
    assert turn.start[4:] == pytest.approx((p[0] - 2 * p[1] + p[2]) / h**2, rel=2e-3)


def test_position_at():
    turn = tracking.Track(kind="turn", position=(1.0, 2.0), velocity=(0.5, 0.0), turn_rate=0.1)
    # Half a turn later the vehicle is one diameter, 2 v / rate, to the left of its course.
    assert turn.position_at(np.pi / 0.1) == pytest.approx((1.0, 12.0), abs=1e-12)
    with pytest.raises(ValueError, match="time_s must not be negative"):
        turn.position_at(-1.0)


# ---- Side by side in vector lanes.


def require_bits_of_each_alone(f, scenario, lanes, monkeypatch):
    results = []
    for width in ("scalar", lanes):
        monkeypatch.setattr(_many, "lanes", lambda width=width: width)
        results.append(simulate(f, scenario, workers=1))
    for name in ARRAYS:
        assert same_bits(*(getattr(result, name) for result in results)), name
    return results[0]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(
    "make",
    [
        aukf,
        lambda **options: aukf(policy=auvest.CovarianceBudget(position_sigma_m=0.05), **options),
        ukf,
        lambda **options: auvest.Ekf(START, P0, process=EULER, **options),
    ],
    ids=["aukf", "budget", "ukf", "ekf"],
)
@pytest.mark.parametrize("lanes", ["sse2", "avx2", "avx512"])
def test_every_width_gives_the_bits_of_each_run_alone(lanes, make, dtype, monkeypatch):
    """Of a whole block of lanes and the beginning of one, to an end by steps or by the time."""
    if lanes not in _core.slat_lanes(True):
        pytest.skip(f"this processor has no {lanes}")
    noise = Noise(range_m=0.2, dropout=0.2)
    f = make(dtype=dtype, sensors=auvest.RangeBearing(station=(0.0, 0.5)))
    for end in ({"steps": 40}, {"steps": 1000, "duration_s": 20.0}):
        scenario = Scenario(noise=noise, runs=21, random_start=True, **end)
        result = require_bits_of_each_alone(f, scenario, lanes, monkeypatch)
        assert not result.failed.any()
        assert np.isnan(result.nis[~np.isnan(result.time_s)]).any()  # a dropout


def test_a_run_that_fails_ends_by_itself(monkeypatch):
    """As in the test of failures above; its neighbours in the block go on."""
    noise = Noise(kind="lognormal", range_m=1e18, bearing_rad=0.01)
    f = ukf(dtype="float32", sensors=auvest.RangeBearing(sigma_range_m=1e18))
    scenario = Scenario(runs=60, steps=200, noise=noise)
    lanes = _core.slat_lanes(True)[-1]
    result = require_bits_of_each_alone(f, scenario, lanes, monkeypatch)
    assert 0 < result.failed.sum() < 60
