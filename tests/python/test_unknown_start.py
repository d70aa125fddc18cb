"""Filters with several components: a start that nobody knows, found by ranges."""

from __future__ import annotations

import copy
import json
import pickle
from dataclasses import replace

import numpy as np
import pyarrow.parquet as parquet
import pytest
from filter_support import DTYPES, same_bits

import auvest
from auvest import Convergence, FilterError, _state
from auvest.logs import LogFolder
from auvest.logs.findings import finding
from auvest.logs.write import write_file
from auvest.replay import checks, read_settings, tables
from auvest.replay.config import settings_from
from auvest.replay.health import Residuals, start_findings
from auvest.replay.report import html, rows, warnings
from auvest.replay.run import replay
from auvest.replay.tables import Batch
from auvest.simulation import cooperative

STATIONS = np.array([[0.0, 0.0], [120.0, 0.0], [60.0, 90.0]])
KINDS = (auvest.RobustEkf, auvest.RobustUkf)


def lost(kind=auvest.RobustEkf, x0=(12.0, 9.0), dtype="float64", **options):
    """A filter that starts within 10 km of `x0`."""
    given = {
        "process": auvest.SpeedHeading(),
        "sensors": auvest.LeaderRange(),
        "kernel": "igg",
        "components": 16,
        **options,
    }
    return kind(x0, np.eye(len(x0)) * 1e8, dtype=dtype, **given)


def told(f):
    """All that a filter shows of its belief, as bytes."""
    parts = [f.x, f.P, f.mixture.weight, f.mixture.x, f.mixture.P, int(f.convergence)]
    return [np.asarray(part).tobytes() for part in parts]


def voyage(steps=60, stations=STATIONS, start=(46.0, 53.0), turn=24):
    """Rows of a craft that goes along +x, and along +y from row `turn` on, a range every 5 s."""
    heading = np.where(np.arange(steps) < turn, 0.0, np.pi / 2)
    way = 5.0 * np.column_stack([np.cos(heading), np.sin(heading)])
    truth = np.asarray(start) + np.cumsum(way, axis=0)
    place = stations[np.arange(steps) % len(stations)]
    z = np.hypot(*(truth - place).T)
    inputs = np.column_stack([np.ones(steps), np.zeros(steps), heading])
    return truth, {"z": z, "dt": 5.0, "input": inputs, "place": place}


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", KINDS)
def test_three_circles_meet_in_one_point(kind, dtype):
    """A craft at rest and exact ranges: after two rounds one component, at the place itself.

    Three lines of sight at angles alpha give P = R (sum u u')^-1 of one round, k-fold after k.
    """
    f = lost(kind, dtype=dtype)
    truth = np.array([46.0, 53.0])
    for k in range(12):
        station = STATIONS[k % 3]
        f.update(np.hypot(*(truth - station)), place=station)
        if k == 0:
            assert len(f.mixture) == 16
            assert f.convergence == Convergence.not_converged
            # A ring about the station, in all directions alike: the mean is in its middle.
            assert np.hypot(*(f.mixture.x - station).T) == pytest.approx(70.2, rel=0.05)
            assert np.hypot(*f.x) < 1.0
        if k >= 5:
            assert len(f.mixture) == 1
            assert np.hypot(*(f.x - truth)) < 0.02
    u = (truth - STATIONS) / np.hypot(*(truth - STATIONS).T)[:, None]
    wanted = np.linalg.inv(4 * u.T @ u)
    assert wanted == pytest.approx(f.P, abs=0.05)
    assert f.convergence == Convergence.settled


@pytest.mark.parametrize("dtype", DTYPES)
def test_two_mirror_places_are_told_until_a_turn(dtype):
    """On a course along the line of two stations both sides of it are as likely."""
    stations = np.array([[-100.0, 0.0], [100.0, 0.0]])
    truth, rows_ = voyage(80, stations, (-60.0, 80.0))
    f = lost(x0=(0.0, 0.0), dtype=dtype)
    result = f.run(**rows_)
    exact = 1e-6 if dtype == "float64" else 1e-3
    g = lost(x0=(0.0, 0.0), dtype=dtype)
    for k in range(24):
        g.predict(5.0, rows_["input"][k])
        g.update(rows_["z"][k], place=rows_["place"][k])
    heavy = np.argsort(g.mixture.weight)[-2:]
    assert g.mixture.weight[heavy] == pytest.approx([0.5, 0.5], abs=exact)
    assert np.sort(g.mixture.x[heavy, 1]) == pytest.approx([-80.0, 80.0], abs=0.1)
    assert np.sqrt(g.P[1, 1]) == pytest.approx(80.0, abs=0.2)
    assert g.x[1] == pytest.approx(0.0, abs=0.01)
    assert g.convergence == Convergence.ambiguous
    assert (result.convergence[10:24] == int(Convergence.ambiguous)).all()
    assert (result.convergence[40:] == int(Convergence.settled)).all()
    assert (result.mixture_size[30:] == 1).all()
    assert np.hypot(*(result.x[-1] - truth[-1])) < 0.02


def test_moments_of_the_mixture_are_the_belief():
    f = lost()
    _, rows_ = voyage(2)
    f.run(**rows_)
    m = f.mixture
    assert len(m) > 4
    assert m.weight.sum() == pytest.approx(1.0, rel=1e-12)
    mean = m.weight @ m.x
    d = m.x - mean
    assert f.x == pytest.approx(mean, rel=1e-12)
    cov = np.einsum("k,kij->ij", m.weight, m.P + d[:, :, None] * d[:, None, :])
    assert cov == pytest.approx(f.P, rel=1e-12)
    m.x[:] = 0.0  # a copy
    assert f.mixture.x.any()


def test_dead_reckoning_moves_all_components_alike():
    """To the bit: one addition of the displacement and of Q, to each and to the moments."""
    f = lost()
    _, rows_ = voyage(4)
    f.run(**rows_)
    before, x, P = f.mixture, f.x, f.P
    assert len(before) > 1
    given = [1.0, 0.2, 0.7]
    moved = f.process.f([0.0, 0.0], 5.0, given)
    noise = f.process.Q(5.0, given)
    f.predict(5.0, given)
    assert same_bits(f.mixture.weight, before.weight)
    assert same_bits(f.mixture.x, before.x + moved)
    assert same_bits(f.mixture.P, before.P + noise)
    assert same_bits(f.x, x + moved)
    assert same_bits(f.P, P + noise)


@pytest.mark.parametrize("late_s", [0.0, 12.0])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("kind", KINDS)
def test_run_is_its_single_steps(kind, dtype, late_s):
    _, rows_ = voyage(40)
    rows_["z"][::7] += 30.0
    rows_["age_s"] = np.where(np.arange(40) % 5 == 4, 5.0, 0.0) if late_s else None
    a, b = (lost(kind, dtype=dtype, late_s=late_s) for _ in range(2))
    result = a.run(**rows_)
    assert set(result.decision) >= {0, 2}
    for k in range(40):
        b.predict(5.0, rows_["input"][k])
        age = rows_["age_s"][k] if late_s else None
        b.update(rows_["z"][k], place=rows_["place"][k], age_s=age)
        assert same_bits(result.x[k], b.x)
        assert same_bits(result.P[k], b.P)
        assert result.convergence[k] == int(b.convergence)
        assert result.mixture_size[k] == len(b.mixture)
    assert told(a) == told(b)
    assert a.save() == b.save()


@pytest.mark.parametrize("late_s", [0.0, 12.0])
@pytest.mark.parametrize("dtype", DTYPES)
def test_goes_on_with_the_same_bits(dtype, late_s):
    """From before the first range to the last, whatever the belief is made of."""
    _, rows_ = voyage(30)
    f = lost(dtype=dtype, late_s=late_s)
    sizes = set()
    for k in range(30):
        sizes.add(len(f.mixture))
        other = lost(x0=(1.0, 2.0), dtype=dtype, late_s=late_s)
        other.run(**{name: v if np.ndim(v) == 0 else v[:3] for name, v in rows_.items()})
        other.restore(f.save())
        twins = [other, pickle.loads(pickle.dumps(f)), copy.deepcopy(f)]
        assert [told(twin) for twin in twins] == [told(f)] * 3
        for g in (f, *twins):
            g.predict(5.0, rows_["input"][k])
            age = 5.0 if late_s and k % 3 == 2 else 0.0
            g.update(rows_["z"][k], place=rows_["place"][k], age_s=age)
        for twin in twins:
            assert told(twin) == told(f)
            assert twin.save() == f.save()
            assert (twin.components, twin.headings) == (16, 1)
    assert len(sizes) > 3


@pytest.mark.parametrize("steps", [0, 1, 2, 20])
def test_a_refused_call_changes_nothing(steps):
    f = lost(dtype="float32", late_s=10.0)
    _, rows_ = voyage(30)
    if steps:
        f.run(**{name: v if np.ndim(v) == 0 else v[:steps] for name, v in rows_.items()})
    before = told(f), f.save()
    big = float(np.finfo("float32").max)
    for call in (
        lambda: f.predict(4000.0, [1.0, 0.0, 0.0]),
        lambda: f.predict(5.0, [big, 0.0, 0.0]),
        lambda: f.update(-1.0, place=(0.0, 0.0)),
        lambda: f.update(big, place=(0.0, 0.0)),
        lambda: f.update(50.0, place=(1e9, 0.0)),
        lambda: (
            f.update(50.0, place=(0.0, 0.0), age_s=9.9)
            if steps == 0
            else f.update(-1.0, place=(0.0, 0.0), age_s=5.0)
        ),
    ):
        with pytest.raises(FilterError):
            call()
        assert (told(f), f.save()) == before or f.status != auvest.Status.ok
        assert told(f) == before[0]


def test_a_fix_picks_one_of_two_places():
    """A measurement that is no range corrects every component, and with them their weights."""
    stations = np.array([[-100.0, 0.0], [100.0, 0.0]])
    truth, rows_ = voyage(20, stations, (-60.0, 80.0))
    f = lost(x0=(0.0, 0.0))
    f.run(**rows_)
    assert f.convergence == Convergence.ambiguous
    f.update(truth[-1] + [10.0, -10.0], auvest.Position(covariance_m2=np.eye(2) * 400.0))
    m = f.mixture
    right = int(np.argmax(m.weight))
    assert m.weight[right] > 0.99
    assert np.hypot(*(m.x[right] - truth[-1])) < 0.1
    # The other is no less likely than that the fix is an outlier, in x and in y.
    assert m.weight.min() > 1e-4


def test_a_heading_that_nobody_knows():
    """Four headings all round, a ring for each; a course with a turn leaves the right one."""
    f = auvest.RobustEkf(
        [0.0, 0.0, 0.3],
        np.diag([1e8, 1e8, 1.0]),
        process=auvest.Odometry(),
        sensors=auvest.LeaderRange(),
        kernel="igg",
        components=32,
        headings=4,
    )
    assert f.mixture.weight.tolist() == [0.25] * 4
    assert f.mixture.x[:, 2] == pytest.approx([0.0, np.pi / 2, np.pi, 1.5 * np.pi])
    assert f.mixture.P[:, 2, 2] == pytest.approx([(np.pi / 4) ** 2] * 4)
    position, heading = np.array([30.0, 20.0]), 2.0
    for k in range(80):
        heading += 0.15 if k % 20 < 10 else 0.0
        position += 5.0 * np.array([np.cos(heading), np.sin(heading)])
        f.predict(5.0, [5.0 * np.cos(0.15), 5.0 * np.sin(0.15), 0.15] if k % 20 < 10 else [5, 0, 0])
        f.update(np.hypot(*(position - STATIONS[k % 3])), place=STATIONS[k % 3])
        if k == 0:
            assert len(f.mixture) == 32
    assert np.hypot(*(f.x[:2] - position)) < 3.0
    assert np.cos(f.x[2] - heading) > 0.9
    assert f.convergence == Convergence.settled


def test_monte_carlo_from_an_unknown_start():
    """The runs of a simulation are those of a filter with components; one Gaussian stays lost."""
    scenario = cooperative.Scenario(steps=600, runs=4, range_every=5, seed=3)
    found, stuck = (
        cooperative.simulate(lost(x0=(0.0, 0.0), components=n), scenario, workers=1)
        for n in (16, 1)
    )
    assert np.hypot(*found.error[:, -1].T).max() < 10.0
    assert np.hypot(*stuck.error[:, -1].T).min() > 10.0


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf, auvest.Ckf])
def test_components_of_a_start_that_is_nearly_singular_have_covariances(kind):
    # All states hang on the first, known to 1 km: in single precision nothing is left of the others
    # where components are split off.
    for seed in range(5):
        rng = np.random.default_rng(seed)
        root = np.tril(rng.uniform(-1, 1, (4, 4))) * np.array([[1], [0.27], [0.004], [0.004]])
        np.fill_diagonal(root, [1000, 0.01, 0.02, 0.01])
        f = kind(
            [56.1, -48.2, 0.0, -2.0],
            root @ root.T,
            process=auvest.SpeedHeadingCurrent(),
            sensors=auvest.LeaderRange(sigma_range_m=0.1),
            components=8,
            dtype="float32",
        )
        for _ in range(6):
            f.predict(1.0, [1.0, 0.0, 0.3])
            f.update(rng.uniform(1, 90), place=rng.uniform(-70, 70, 2))
            for P in f.mixture.P:
                np.linalg.cholesky(P.astype(float))
        f.restore(f.save())


def test_moments_of_components_that_are_nearly_singular_are_a_covariance():
    # After most of an hour position, velocity and acceleration are one number in single precision:
    # the sum over a ring of such was refused when restored, or a prediction was as not finite.
    singular = 0
    for seed in range(2690, 2790):
        rng = np.random.default_rng(seed)
        root = rng.standard_normal((6, 6)) * np.array(
            [[0.5], [0.3], [0.03], [0.02], [0.01], [0.02]]
        )
        f = auvest.Ukf(
            rng.normal(0, 30, 6) * [1, 1, 0.05, 0.05, 0.1, 0.1],
            root @ root.T + 1e-7 * np.eye(6),
            process=auvest.ConstantAcceleration(
                position_psd=0, velocity_psd=0, acceleration_psd=10 ** rng.uniform(-8, 0)
            ),
            sensors=auvest.LeaderRange(leader=(0.0, 0.0)),
            components=8,
            alpha=(1e-3, 0.5, 1.0)[seed % 3],
            dtype="float32",
        )
        f.predict(rng.uniform(300, 3600))
        f.update(rng.uniform(1, 90))
        for _ in range(4):
            f.predict(rng.uniform(0.1, 2))
            f.restore(f.save())
        sigma = np.sqrt(np.diagonal(f.P).astype(float))
        singular += np.linalg.eigvalsh(f.P / np.outer(sigma, sigma))[0] < 1e-5
    assert singular > 10


def test_wrong_arguments_are_refused_by_name():
    for message, options in {
        r"components must be 1, or at least 8: a ring of 5 has gaps": {"components": 5},
        r"components must lie in 1\.\.255, not 256": {"components": 256},
        r"headings is for a process whose third state is theta_rad, its heading, not Speed": {
            "headings": 2
        },
        r"components is for ranges: none of sensors is a LeaderRange": {
            "sensors": [auvest.Position(), auvest.RangeBearing()]
        },
    }.items():
        with pytest.raises(ValueError, match=message):
            lost(**options)
    with pytest.raises(TypeError, match="components must be an integer"):
        lost(components=16.0)
    odometry = {"process": auvest.Odometry(), "x0": (0.0, 0.0, 0.0)}
    with pytest.raises(ValueError, match="4 headings need at least 32 components, not 16"):
        lost(headings=4, **odometry)
    drone = auvest.FunctionProcess(lambda x, dt: x + 0.0 * dt, np.eye(2), state=("u_m", "v_m"))
    with pytest.raises(ValueError, match="first states are x_m and y_m, not FunctionProcess"):
        lost(process=drone, sensors=())
    with pytest.raises(AttributeError, match="convergence needs components"):
        _ = lost(components=1).convergence
    assert len(lost(components=1).mixture) == 1


def test_a_state_that_is_damaged_or_of_another_sum_is_refused():
    f = lost()
    _, rows_ = voyage(2)
    f.run(**rows_)
    before = told(f), f.save()
    with pytest.raises(ValueError, match="components is 32, expected 16"):
        f.restore(lost(components=32).save())
    with pytest.raises(ValueError, match="components is missing, expected 16"):
        f.restore(lost(components=1).save())
    description = f._description()
    size = len(f.mixture)
    assert size > 2

    def damaged(change):
        arrays = _state.unpack(f.save(), "RobustEkf", description)
        arrays["mixture"] = change(arrays["mixture"].copy())
        return _state.pack("RobustEkf", description, arrays)

    def put(at, value):
        def change(numbers):
            numbers[at] = value
            return numbers

        return change

    f.restore(damaged(lambda numbers: numbers))
    assert told(f) == before[0]
    for change in (
        lambda numbers: numbers[:-1],
        lambda numbers: numbers[:3],
        lambda numbers: numbers[:0],
        lambda numbers: np.append(numbers, 0.0),
        put(0, 7.0),  # ranges accepted: 0..6
        put(0, -1.0),
        put(1, 0.0),  # headings
        put(1, 3.0),  # 16 components are no 3 rings
        put(2, -1.0),
        put(3, 0.0),
        put(3, 17.0),
        put(3, size - 1.0),
        put(4, -0.1),  # a weight
        put(4, 0.9),
        put(7, -1.0),  # a variance
        put(8, 1e9),  # a correlation
        put(5, np.nan),
    ):
        with pytest.raises(ValueError, match="state is"):
            f.restore(damaged(change))
        assert (told(f), f.save()) == before


# ---- Replay.


def trial(folder, stations=STATIONS, turn=150.0, end=300.0):
    """A log of velocities and ranges; start.csv knows the heading and nothing else."""
    time_s = np.arange(0.0, end + 0.5, 0.5)
    heading = np.where(time_s < turn, 0.0, np.pi / 2)
    rate = np.where(np.isclose(time_s, turn), np.pi, 0.0)  # for half a second
    truth, at = [], np.array([-50.0, 40.0])
    for h in heading:
        truth.append(at.copy())
        at += 0.5 * np.array([np.cos(h), np.sin(h)])
    truth = np.array(truth)
    k = np.arange(1, int(end / 5))
    source = k % len(stations)
    rng = np.random.default_rng(2)
    ranges = np.hypot(*(truth[10 * k] - stations[source]).T) + 0.3 * rng.standard_normal(len(k))
    write_file(
        folder, "odometry.csv", time_s=time_s, speed_m_s=np.ones_like(time_s), yaw_rate_rad_s=rate
    )
    write_file(
        folder, "beacons.csv",
        source=np.arange(len(stations)), x_m=stations[:, 0], y_m=stations[:, 1],
    )  # fmt: skip
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    write_file(folder, "truth.csv", time_s=time_s, x_m=truth[:, 0], y_m=truth[:, 1])
    write_file(folder, "ranges.csv", time_s=5.0 * k, source=source, range_m=ranges)
    return LogFolder(folder), truth


def unknown(components=16, **more):
    return settings_from(
        {
            "filter": {"kernel": "igg", "components": components},
            "start": {"sigma_position_m": 1e4, "sigma_heading_rad": 0.05},
            "ranges": {"sigma_m": 0.5},
            **more,
        }
    )


def test_a_replay_finds_its_start_and_says_when(tmp_path):
    log, truth = trial(tmp_path / "log")
    result = replay(log, unknown(), folder=tmp_path, causes=False)
    assert result.health.verdict == "sound", result.findings
    assert result.numbers["convergence"] == "settled"
    assert 25.0 < result.numbers["settled_s"] < 100.0  # six ranges, after the first that tell
    errors = result.errors.columns()  # all of them: they are few
    since = errors["time_s"] >= result.numbers["settled_s"]
    square = errors["error_x_m"][since] ** 2 + errors["error_y_m"][since] ** 2
    assert result.numbers["settled_rmse_m"] == pytest.approx(np.sqrt(square.mean()), rel=1e-12)
    assert result.numbers["settled_rmse_m"] < 1.0
    assert result.numbers["rmse_m"] > 10.0
    said = dict(rows(result))
    assert said["unknown start"].startswith("settled first at ")
    table = parquet.read_table(tmp_path / "estimates.parquet")
    assert table.column_names[-2:] == ["convergence", "mixture_size"]
    first, *_, last = table.to_pylist()
    assert (first["convergence"], first["mixture_size"]) == ("not converged", 1)
    assert (last["convergence"], last["mixture_size"]) == ("settled", 1)
    assert np.hypot(last["x_m"] - truth[-1, 0], last["y_m"] - truth[-1, 1]) < 1.0
    assert json.loads(json.dumps(result.document()))["convergence"] == "settled"


def test_a_replay_that_ends_between_two_places_is_not_trusted(tmp_path):
    """Two beacons on a line and a course along it: either side is as good."""
    beacons = np.array([[-100.0, 0.0], [100.0, 0.0]])
    log, _ = trial(tmp_path / "log", beacons, turn=1e9, end=150.0)
    result = replay(log, unknown())
    assert result.health.verdict == "not_trusted"
    assert [one.cause for one in result.findings] == ["ambiguous"]
    assert "several places, the estimate is between; it never settled" in result.health.reason
    assert warnings(result)[0].startswith("NOT_TRUSTED".replace("_", " "))
    assert "never settled" in html(result)
    checked = checks.check(tmp_path / "log", unknown())
    assert checked.verdict == "not_trusted"
    assert checked.findings == result.findings


def test_a_replay_whose_end_is_not_confirmed_is_doubtful(tmp_path):
    log, _ = trial(tmp_path / "log", end=150.0)
    whole = replay(log, unknown(), causes=False)
    short, _ = trial(tmp_path / "short", end=whole.numbers["settled_s"] - 6.0)
    result = replay(short, unknown(), causes=False)
    assert result.numbers["convergence"] == "settling"
    assert result.health.verdict == "doubtful"
    assert "not yet confirmed" in result.health.reason


def test_one_gaussian_that_no_range_places_is_not_trusted(tmp_path):
    """Silence was the old answer: every range is accepted and nothing converges."""
    log, _ = trial(tmp_path / "log")
    result = replay(log, unknown(components=1))
    assert result.numbers["rejected"] == 0
    assert "convergence" not in result.numbers
    assert result.health.verdict == "not_trusted"
    assert result.findings[0] == finding(
        "not_converged",
        "the first 59 of 59 ranges did not tell where the craft is: a start that is not known "
        "needs components in [filter], 16 or 32",
    )
    known = replace(unknown(1), start=replace(unknown(1).start, sigma_position_m=30.0))
    assert "not_converged" not in {one.cause for one in replay(log, known, causes=False).findings}


@pytest.mark.parametrize(
    ("lost_ranges", "ranges", "verdict"),
    [(0, 50, None), (12, 20, None), (13, 1000, "doubtful"), (51, 1000, "not_trusted"),
     (3, 3, "not_trusted")],
)  # fmt: skip
def test_how_long_one_gaussian_may_be_lost(lost_ranges, ranges, verdict):
    """Counted over the batches of a replay; one range later that says less is no lost start."""
    told = np.arange(ranges) >= lost_ranges
    if ranges > lost_ranges + 2:
        told[-1] = False
    residuals = Residuals()
    for part in np.array_split(told, 3):
        measured = tables.blank_measurements(len(part))
        nothing = dict.fromkeys((*tables.ESTIMATES, *tables.ERRORS), np.empty(0))
        residuals.add(Batch(nothing, measured, nothing, np.full(len(part), 50.0), part))
    assert [one.verdict for one in start_findings(residuals)] == [verdict] * (verdict is not None)


def test_settings_that_are_for_ranges_are_refused_for_fixes(tmp_path):
    folder = tmp_path / "fixes"
    one = np.ones(9)
    write_file(
        folder, "fixes.csv",
        time_s=np.arange(9.0), source=one.astype(int), range_m=20 * one, bearing_rad=0.1 * one,
    )  # fmt: skip
    write_file(folder, "beacons.csv", source=[1], x_m=[0.0], y_m=[0.0])
    with pytest.raises(ValueError, match=r"\[filter\] components and headings are for logs of"):
        replay(LogFolder(folder), unknown())
    path = tmp_path / "wrong.toml"
    path.write_text("[filter]\ncomponents = 300\n")
    with pytest.raises(ValueError, match=r"\[filter\] components must lie in 1\.\.255, not 300"):
        read_settings(path)
    log, _ = trial(tmp_path / "log", end=20.0)
    with pytest.raises(ValueError, match="components must be 1, or at least 8"):
        replay(log, unknown(5))
