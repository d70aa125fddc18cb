"""SLATF, EKF-SLAT, dead reckoning and the outage switch under Python."""

from __future__ import annotations

import copy
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import auvest
from auvest import (
    UNKNOWN_MASTER,
    CompassMotion,
    DeadReckoning,
    EkfSlat,
    FilterError,
    Outage,
    PiecewiseAcceleration,
    Slatf,
    SlatfJoint,
    Sonar,
    Status,
    UnicycleMotion,
)
from auvest.slat import MAX_MASTERS, SlatFilter, available_lanes

Floats = npt.NDArray[np.float64]

START = np.zeros(2)
CERTAIN = np.zeros((2, 2))
MASTER_X = np.array([0.0, 300.0, 5.0, 1.3, 0.0, 0.0])
MASTER_P = np.diag([1.0, 1.0, 0.0025, 0.0025, 1e-8, 1e-8])
SECOND_X = np.array([100.0, -200.0, 4.0, 2.0, 0.0, 0.0])


def record(steps: int = 60, masters: int = 2, seed: int = 5) -> dict[str, Any]:
    """Two masters on straight lines, pinged every other second and, once, in between."""
    random = np.random.default_rng(seed)
    time_s = np.arange(steps + 1.0)
    u = np.stack([5 + random.normal(0, 2, steps), 0.5 + random.normal(0, 0.3, steps)], axis=1)
    heard = np.concatenate([time_s[2::2], [7.25]])
    truth = np.outer(heard, [5 * np.cos(0.5), 5 * np.sin(0.5)])
    rows = []
    for n, start in enumerate((MASTER_X, SECOND_X)[:masters]):
        to_slave = truth - (start[:2] + np.outer(heard, start[2:4]))
        noise = random.normal(size=(len(heard), 2)) * (1, 0.06)
        z = np.stack([np.hypot(*to_slave.T), np.arctan2(to_slave[:, 1], to_slave[:, 0])], axis=1)
        rows += [(t, n, *one) for t, one in zip(heard, z + noise, strict=True)]
    rows.sort()
    table = np.array(rows)
    return {
        "time_s": time_s,
        "u": u,
        "z": table[:, 2:],
        "z_time_s": table[:, 0],
        "master": table[:, 1].astype(int),
        "changes": random.normal(0, 0.01, (steps, masters, 2)),
    }


def with_masters(filter_: SlatFilter, count: int = 2) -> Any:
    for x in (MASTER_X, SECOND_X)[:count]:
        filter_.add_master(x, MASTER_P)
    return filter_


def everything(filter_: Any, result: auvest.SlatRun) -> bytes:
    """All bits of a run and of the filter after it."""
    arrays = [getattr(result, name) for name in result.__dataclass_fields__]
    if isinstance(filter_, Slatf):
        arrays += [filter_.weights, filter_.poses]
    return b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)


# The bits.


@pytest.mark.parametrize("lanes", ["sse2", "avx2", "avx512"])
@pytest.mark.parametrize("motion", [CompassMotion(), UnicycleMotion()], ids=["compass", "unicycle"])
@pytest.mark.parametrize("version", [1, 2])
def test_lanes_keep_the_bits(lanes: Any, motion: Any, version: Any) -> None:
    if lanes not in available_lanes():
        pytest.skip(f"this processor or this build has no {lanes}")
    n = motion.pose_states
    bearing: Any = "from_heading" if n == 3 else "master_to_slave"

    def fly(name: Any, particles: int) -> bytes:
        filter_ = with_masters(
            Slatf(
                np.zeros(n),
                0.01 * np.eye(n),
                version=version,
                particles=particles,
                motion=motion,
                sonar=Sonar(bearing=bearing),
                gate=16,
                lanes=name,
                dtype="float32",
                seed=7,
            )
        )
        assert filter_.lanes == name
        return everything(filter_, filter_.run(**record(30)))

    for particles in (1, 37, 100):
        assert fly(lanes, particles) == fly("scalar", particles)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("name", ["slatf1", "slatf2", "ekf"])
def test_run_is_predict_and_update_is_step(name: str, dtype: Any) -> None:
    data = record(40)
    made: dict[str, Callable[[], SlatFilter]] = {
        "slatf1": lambda: Slatf(START, CERTAIN, version=1, dtype=dtype),
        "slatf2": lambda: Slatf(START, CERTAIN, version=2, dtype=dtype),
        "ekf": lambda: EkfSlat(START, CERTAIN, dtype=dtype),
    }
    whole, apart, fused = (with_masters(made[name]()) for _ in range(3))
    result = whole.run(**data)
    # The ping at 7.25 s splits an interval, whose plan is shared out.
    for k in range(40):
        begin, end = data["time_s"][k : k + 2]
        stops = [t for t in np.unique(data["z_time_s"]) if begin < t < end]
        changes = data["changes"][k]
        for one, step in ((apart, False), (fused, True)):
            now = begin
            for t in [*stops, end]:
                there = data["z_time_s"] == t
                z, master = data["z"][there], data["master"][there]
                share = np.asarray(t - now, dtype) * np.asarray(changes, dtype)
                if step:
                    one.step(t - now, data["u"][k], z if len(z) else None, master, changes=share)
                else:
                    one.predict(t - now, data["u"][k], changes=share)
                    one.update(z if len(z) else None, master)
                now = t
            assert np.array_equal(one.x, result.x[k])
            assert np.array_equal(one.P, result.P[k])
            for n in range(2):
                assert np.array_equal(one.master(n)[0], result.masters_x[k, n])
                assert np.array_equal(one.master(n)[1], result.masters_P[k, n])
            assert one.log_likelihood == result.log_likelihood[k]
    if isinstance(whole, Slatf):
        assert whole.resamplings == fused.resamplings == result.resamplings[-1] > 0
        assert whole.effective_size == result.effective_size[-1]
        assert np.array_equal(whole.poses, fused.poses)
        assert 1 <= result.effective_size.min() <= result.effective_size.max() <= 100
    else:
        assert whole.nis == result.nis[-1] > 0


def test_a_record_may_be_split() -> None:
    data = record(20)
    whole, split = (with_masters(Slatf(START, CERTAIN, dtype="float32")) for _ in range(2))
    result = whole.run(**data)
    parts = []
    for rows in (slice(0, 9), slice(9, 20)):
        times = data["time_s"][rows.start : rows.stop + 1]
        there = (data["z_time_s"] > times[0]) & (data["z_time_s"] <= times[-1])
        parts.append(
            split.run(
                times,
                data["u"][rows],
                z=data["z"][there],
                z_time_s=data["z_time_s"][there],
                master=data["master"][there],
                changes=data["changes"][rows],
            )
        )
    assert np.array_equal(np.concatenate([p.x for p in parts]), result.x)
    assert np.array_equal(whole.poses, split.poses)


def test_a_copy_goes_on_with_the_same_bits_and_alone() -> None:
    one = with_masters(Slatf(START, CERTAIN))
    one.predict(1, [5, 0.5])
    two = copy.deepcopy(one)
    before = one.x
    z, master = [300, -1.5], 0
    two.step(1, [5, 0.5], z, master)
    assert np.array_equal(one.x, before)
    one.step(1, [5, 0.5], z, master)
    assert np.array_equal(one.x, two.x)
    assert np.array_equal(one.poses, two.poses)


def test_a_filter_in_use_refuses_a_second_thread_whatever_it_asks() -> None:
    filter_ = with_masters(Slatf(START, CERTAIN, particles=50))
    asked: dict[str, Callable[[], object]] = {
        "x": lambda: filter_.x,
        "P": lambda: filter_.P,
        "master": lambda: filter_.master(0),
        "weights": lambda: filter_.weights,
        "poses": lambda: filter_.poses,
        "save": filter_.save,
        "predict": lambda: filter_.predict(1.0, [5.0, 0.5]),
        "run": lambda: filter_.run(**record(steps=8)),
    }
    with ThreadPoolExecutor(1) as pool, filter_._exclusive:
        why = {name: str(pool.submit(ask).exception()) for name, ask in asked.items()}
    assert [name for name, said in why.items() if "in use by another thread" not in said] == []
    for ask in asked.values():
        ask()


def test_the_seed_decides() -> None:
    runs = [with_masters(Slatf(START, CERTAIN, seed=s)).run(**record(10)).x for s in (1, 1, 2)]
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


# The numbers, against formulas written anew.


@pytest.mark.parametrize("compensate", [True, False])
def test_dead_reckoning_is_equation_2(compensate: bool) -> None:
    motion = CompassMotion(sigma_speed_m_s=1.5, sigma_heading_rad=0.2, compensate_bias=compensate)
    filter_ = DeadReckoning([10, -3], np.diag([0.5, 0.25]), motion=motion)
    filter_.predict(2.0, [4.0, 0.7])
    reach = 2.0 * (np.exp(0.02) if compensate else 1.0)
    c, s = np.cos(0.7), np.sin(0.7)
    assert filter_.x == pytest.approx([10 + reach * 4 * c, -3 + reach * 4 * s], rel=1e-14)
    g = reach * np.array([[c, -4 * s], [s, 4 * c]])
    expected = np.diag([0.5, 0.25]) + g @ np.diag([1.5**2, 0.2**2]) @ g.T
    assert pytest.approx(expected, rel=1e-13) == filter_.P
    filter_.update([1, 1])  # it hears nothing
    assert filter_.x == pytest.approx([10 + reach * 4 * c, -3 + reach * 4 * s], rel=1e-14)
    assert filter_.masters == 0


@pytest.mark.parametrize("bearing", ["master_to_slave", "slave_to_master"])
def test_ekf_slat_is_the_textbook_filter(bearing: Any) -> None:
    """Slave and two masters in one dense Kalman filter, with Joseph's form and np.linalg."""
    q, dt = 0.02, 0.5
    sonar = Sonar(sigma_range_m=2, sigma_bearing_rad=0.1, bearing=bearing)
    p0 = np.array([[4.0, 1.0], [1.0, 9.0]])
    master = PiecewiseAcceleration(acceleration_m_s2=q)
    filter_ = EkfSlat(START, p0, master=master, sonar=sonar, gate=0)
    filter_.add_master(MASTER_X, 25 * np.eye(6))
    filter_.add_master(SECOND_X, 16 * np.eye(6))
    changes = np.array([[0.2, -0.1], [0.05, 0.3]])
    filter_.predict(dt, [5, 0.4], changes=changes)
    z = np.array([330.0, -1.7 if bearing == "master_to_slave" else 1.5])
    filter_.update(z, 0)

    x = np.concatenate([START, MASTER_X, SECOND_X])
    P = np.zeros((14, 14))
    P[:2, :2], P[2:8, 2:8], P[8:, 8:] = p0, 25 * np.eye(6), 16 * np.eye(6)
    motion = CompassMotion()
    reach = dt * np.exp(motion.sigma_heading_rad**2 / 2)
    c, s = np.cos(0.4), np.sin(0.4)
    g = reach * np.array([[c, -5 * s], [s, 5 * c]])
    Q = np.zeros((14, 14))
    Q[:2, :2] = g @ np.diag([motion.sigma_speed_m_s**2, motion.sigma_heading_rad**2]) @ g.T
    phi1 = np.eye(6) + dt * np.eye(6, k=2) + dt**2 / 2 * np.eye(6, k=4)
    gain = np.kron(np.array([[dt**2 / 2], [dt], [1.0]]), np.eye(2))
    Phi = np.eye(14)
    for n in range(2):
        block = slice(2 + 6 * n, 8 + 6 * n)
        Phi[block, block] = phi1
        Q[block, block] = q**2 * gain @ gain.T
    x = Phi @ x
    x[:2] += reach * 5 * np.array([c, s])
    for n in range(2):
        x[2 + 6 * n : 4 + 6 * n] += dt / 2 * changes[n]
        x[4 + 6 * n : 6 + 6 * n] += changes[n]
    P = Phi @ P @ Phi.T + Q
    d = x[2:4] - x[:2]
    sign = -1 if bearing == "master_to_slave" else 1
    r = np.hypot(*d)
    v = z - [r, np.arctan2(sign * d[1], sign * d[0])]
    H = np.zeros((2, 14))
    H[:, 2:4] = np.array([d / r, [-d[1] / r**2, d[0] / r**2]])
    H[:, :2] = -H[:, 2:4]
    R = np.diag([4, 0.01])
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    x = x + K @ v
    A = np.eye(14) - K @ H
    P = A @ P @ A.T + K @ R @ K.T

    assert filter_.x == pytest.approx(x[:2], rel=1e-10)
    assert pytest.approx(P[:2, :2], rel=1e-10) == filter_.P
    for n in range(2):
        mean, covariance = filter_.master(n)
        block = slice(2 + 6 * n, 8 + 6 * n)
        assert mean == pytest.approx(x[block], rel=1e-10, abs=1e-12)
        assert covariance == pytest.approx(P[block, block], rel=1e-9, abs=1e-12)
    nis = v @ np.linalg.solve(S, v)
    assert filter_.nis == pytest.approx(nis, rel=1e-10)
    density = -0.5 * (nis + np.log(np.linalg.det(2 * np.pi * S)))
    assert filter_.log_likelihood == pytest.approx(density, rel=1e-9)


def test_many_particles_come_near_the_joint_filter() -> None:
    """A nearly linear case: a loud sonar far away. The error of the mean is sigma / sqrt(N)."""
    data = record(10)
    joint = with_masters(EkfSlat(START, CERTAIN))
    joint.run(**data)
    for version in (1, 2):
        cloud = with_masters(Slatf(START, CERTAIN, version=version, particles=20_000))  # type: ignore[arg-type]
        cloud.run(**data)
        sigma = np.sqrt(np.diag(joint.P))
        assert np.abs(cloud.x - joint.x) == pytest.approx(0, abs=float(0.15 * sigma.max()))
        assert np.sqrt(np.diag(cloud.P)) == pytest.approx(sigma, rel=0.1)


def test_weights_and_poses_give_the_mean() -> None:
    open_ = {"resample_below": 0, "gate": 0, "monte_carlo": False}
    filter_ = with_masters(Slatf(START, np.eye(2), version=1, **open_))
    filter_.run(**record(12))
    w, poses = filter_.weights, filter_.poses
    assert w.sum() == pytest.approx(1, rel=1e-12)
    assert filter_.x == pytest.approx(w @ poses, rel=1e-12)
    off = poses - filter_.x
    assert pytest.approx(off.T @ (w[:, None] * off), rel=1e-9) == filter_.P
    assert filter_.effective_size == pytest.approx(1 / np.square(w).sum(), rel=1e-9)
    assert filter_.resamplings == 0


def test_resampling_policies_differ_and_threshold_counts() -> None:
    data = record(40)
    poses = {}
    for policy in ("systematic", "stratified", "residual", "multinomial"):
        filter_ = with_masters(Slatf(START, CERTAIN, version=1, resampling=policy))  # type: ignore[arg-type]
        filter_.run(**data)
        assert filter_.resamplings > 0
        poses[policy] = filter_.poses.tobytes()
    assert len(set(poses.values())) == 4
    always = with_masters(Slatf(START, CERTAIN, version=1, resample_below=1))
    assert always.run(**data).resamplings[-1] == len(np.unique(data["z_time_s"]))


def test_an_unknown_echo_goes_to_its_master() -> None:
    known, unknown = (with_masters(Slatf(START, CERTAIN, gate=16)) for _ in range(2))
    data = record(20)
    a = known.run(**data)
    b = unknown.run(**{**data, "master": UNKNOWN_MASTER})
    assert b.x == pytest.approx(a.x, rel=1e-9)  # the masters are 500 m apart


def test_a_master_is_born_from_an_unknown_echo() -> None:
    filter_ = Slatf(START, CERTAIN, gate=16, birth_velocity_m_s=2)
    assert filter_.masters == 0
    filter_.update([100, np.pi / 2])  # the bearing points from the master to the slave
    assert filter_.masters == 1
    assert filter_.master(0)[0][:2] == pytest.approx([0, -100], abs=1e-9)
    result = filter_.run([0, 1, 2], [[5, 0.5]] * 2, z=[[900, 0.0]], z_time_s=[2])
    assert result.masters_x.shape == (2, 2, 6)
    assert np.isnan(result.masters_x[0, 1]).all()
    assert np.isfinite(result.masters_x[1]).all()


def test_the_gate_stops_an_outlier() -> None:
    for gate, moved in ((0, True), (16, False)):
        filter_ = EkfSlat(START, np.eye(2), gate=gate)
        filter_.add_master(MASTER_X, MASTER_P)
        filter_.update([3000, 1.0])
        assert (np.abs(filter_.x).max() > 1) == moved


# Outage.


def test_outage_starts_the_filter_from_the_shared_state() -> None:
    prototype = Slatf([50, 50], np.eye(2), dtype="float32", seed=3)
    outage = Outage(copy.deepcopy(prototype))
    assert outage.communication == "never"
    with pytest.raises(FilterError, match="no belief yet"):
        _ = outage.x
    with pytest.raises(FilterError, match="no belief yet"):
        outage.predict(1, [5, 0.5])
    outage.share(START, 0.25 * np.eye(2), [(MASTER_X, MASTER_P)])
    assert outage.communication == "up"
    outage.update([300, -1.5], 0)  # communication works: the echo says nothing
    assert np.array_equal(outage.x, START)
    assert np.array_equal(outage.master(0)[0], MASTER_X.astype(np.float32))
    data = record(8, masters=1)
    result = outage.run(**data)
    assert outage.communication == "down"
    assert np.array_equal(outage.x, result.x[-1])
    assert result.masters_x.shape == (8, 1, 6)
    # The same as a filter that starts there, with the random numbers of the prototype.
    outage.share([1, 2], np.eye(2))
    assert outage.communication == "up"
    assert outage.x.tolist() == [1, 2]
    with pytest.raises(ValueError, match="no master 0"):
        outage.master(0)


def test_outage_refuses_a_state_that_is_none() -> None:
    outage = Outage(fresh())
    outage.share([1, 2], np.eye(2))

    def shared(p: Any, master_p: Any = MASTER_P) -> Callable[[], None]:
        return lambda: outage.share([3, 4], p, [(MASTER_X, master_p)])

    skew = MASTER_P.copy()
    skew[0, 2] = 0.01
    for call, message in (
        (shared([[1.0, 0.5], [0.0, 1.0]]), "^P must be symmetric"),
        (shared([[1.0, 0.0], [0.5, 1.0]]), "^P must be symmetric"),
        (shared([[1.0, 2.0], [2.0, 1.0]]), "^P must not have negative eigenvalues, it has -1"),
        (shared(CERTAIN, skew), r"^masters\[0\]\[1\] must be symmetric"),
        (shared(CERTAIN, 0 * MASTER_P), r"^masters\[0\]\[1\] must be positive definite"),
        (
            lambda: outage.share([3, 4], CERTAIN, [(MASTER_X, MASTER_P)] * 5),
            "masters has 5 elements, at most 4",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    assert outage.x.tolist() == [1, 2]  # nothing has changed
    outage.share([3, 4], [[1.0, 0.5], [0.5, 1.0]], [(MASTER_X, MASTER_P)] * 4)
    assert outage.x.tolist() == [3, 4]
    assert np.array_equal(outage.P, [[1.0, 0.5], [0.5, 1.0]])


def test_outage_of_dead_reckoning_equals_it() -> None:
    outage = Outage(DeadReckoning(START, CERTAIN))
    outage.share([3, 4], np.eye(2), [(MASTER_X, MASTER_P)])
    with pytest.raises(ValueError, match="there is no master 0: none was added"):
        outage.master(0)  # it tracks none, so that there is none before the outage either
    alone = DeadReckoning([3, 4], np.eye(2))
    for one in (outage, alone):
        one.predict(1.5, [4, 0.2])
        one.update([10, 0.1])
    assert np.array_equal(outage.x, alone.x)
    assert np.array_equal(outage.P, alone.P)


# Refusals.


def fresh() -> Slatf:
    made: Slatf = with_masters(Slatf(START, CERTAIN))
    return made


BAD_MAKE: list[tuple[dict[str, Any], str]] = [
    ({"x0": [0, 0, 0]}, r"x0 has shape \(3,\), expected \(2,\)"),
    ({"x0": [0, np.nan]}, r"x0\[1\] is nan"),
    ({"P0": -np.eye(2)}, "P0 must not have negative eigenvalues"),
    ({"P0": [[1, 0.5], [0, 1]]}, "P0 must be symmetric"),
    ({"version": 3}, r"version must lie in 1\.\.2, not 3"),
    ({"version": "2.0"}, "version must be an integer, not str"),
    ({"particles": 0}, r"particles must lie in 1\.\."),
    ({"particles": 10.0}, "particles must be an integer"),
    ({"resampling": "random"}, "resampling must be 'systematic'"),
    ({"resample_below": 1.5}, r"resample_below must lie in 0\.\.1, not 1.5"),
    ({"gate": -1}, "gate must not be negative"),
    ({"carry_covariance": 1}, "carry_covariance must be True or False"),
    ({"birth_velocity_m_s": 1, "gate": 0}, "birth_velocity_m_s needs a gate"),
    ({"birth_velocity_m_s": 2e9}, r"birth_velocity_m_s must be at most 1e\+09"),
    ({"rebirth_acceleration_m_s2": 1e200}, "rebirth_acceleration_m_s2 must be at most"),
    ({"birth_acceleration_m_s2": 0}, "birth_acceleration_m_s2 must be positive"),
    ({"motion": Sonar()}, "motion must be an auvest.CompassMotion or auvest.UnicycleMotion"),
    ({"master": None}, "master must be an auvest.PiecewiseAcceleration"),
    ({"sonar": 3}, "sonar must be an auvest.Sonar, not int"),
    ({"sonar": Sonar(bearing="from_heading")}, "needs a heading in the pose"),
    ({"dtype": "float16"}, "dtype must be 'float32' or 'float64'"),
    ({"lanes": "neon"}, "lanes must be 'scalar', 'sse2', 'avx2' or 'avx512'"),
    ({"lanes": "avx2"}, "lanes 'avx2' do not run here in float64; scalar do"),
    ({"seed": -1}, r"seed must lie in 0\.\."),
    ({"sonar": Sonar(sigma_range_m=1e30), "dtype": "float32"}, "sigma_range_m = 1e[+]30 does not"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD_MAKE, ids=[m for _, m in BAD_MAKE])
def test_a_bad_filter_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Slatf(**{"x0": START, "P0": CERTAIN, **arguments})


BAD_CALL: list[tuple[Callable[[Slatf], object], str]] = [
    (lambda f: f.predict(-1, [5, 0]), "dt must not be negative, not -1"),
    (lambda f: f.predict(np.inf, [5, 0]), "dt must be finite"),
    (lambda f: f.predict(1, [5]), r"u has shape \(1,\), expected \(2,\)"),
    (lambda f: f.predict(1, [5, np.nan]), r"u\[1\] is nan"),
    (lambda f: f.predict(1, [5, 0], changes=[[0, 0]]), r"changes has shape \(1, 2\), expected \(2"),
    (lambda f: f.update([100, 0]), "master must be given: the filter has 2 masters"),
    (lambda f: f.update([100, 0], 2), "master is 2, but the filter has 2 masters"),
    (lambda f: f.update([100, 0], -2), "master is -2, but the filter has 2 masters"),
    (lambda f: f.update([100, 0], 0.0), "master must be an int"),
    (lambda f: f.update([[100, 0], [90, 0]], [0, 0]), "master names a master twice"),
    (lambda f: f.update([[100, 0], [90, 0]], [0, 1, 1]), r"master has shape \(3,\)"),
    (lambda f: f.update([100, np.nan], 0), r"z\[1\] is nan and the rest"),
    (lambda f: f.update([1e10, 0], 0), r"z\[0, 0\] is 10000000000.0, beyond 1e9"),
    (lambda f: f.update([100, np.inf], 0), r"z\[1\] is inf"),
    (lambda f: f.update([100, 0], 0, sonar=1), "sonar must be an auvest.Sonar"),  # type: ignore[arg-type]
    (lambda f: f.step(1, [5, 0], [100, 0], 7), "master is 7"),
    (lambda f: f.add_master([1, 2], np.eye(6)), r"x has shape \(2,\), expected \(6,\)"),
    (lambda f: f.add_master(MASTER_X, np.zeros((6, 6))), "P must be positive definite"),
    (lambda f: f.master(2), r"n must lie in 0\.\.1, not 2"),
    (lambda f: f.run([0], np.empty((0, 2))), "time_s must have at least 2 elements"),
    (lambda f: f.run([0, 1], [[5, 0], [5, 0]]), r"u has shape \(2, 2\), expected \(1, 2\)"),
    (lambda f: f.run([1, 0], [[5, 0]]), r"time_s\[1\] = 0.0 lies before time_s\[0\] = 1.0"),
    (lambda f: f.run([0, 1], [[5, 0]], z=[[1, 0]]), "z and z_time_s belong together"),
    (
        lambda f: f.run([0, 1], [[5, 0]], z=[[1, 0]], z_time_s=[2], master=0),
        "z_time_s must lie within time_s, 0.0 to 1.0",
    ),
    (
        lambda f: f.run([0, 1], [[5, 0]], z=[[1, 0]] * 2, z_time_s=[1, 0], master=0),
        r"z_time_s\[1\] = 0.0 lies before",
    ),
    (
        lambda f: f.run([0, 1], [[5, 0]], z=[[1, np.nan]], z_time_s=[1], master=0),
        r"z\[0, 1\] is nan",
    ),
    (lambda f: f.run([0, 1], [[5, 0]], changes=np.zeros((1, 3, 2))), "changes has shape"),
]


@pytest.mark.parametrize(("call", "message"), BAD_CALL, ids=[m for _, m in BAD_CALL])
def test_a_bad_call_is_refused_and_changes_nothing(
    call: Callable[[Slatf], object], message: str
) -> None:
    filter_, twin = fresh(), fresh()
    with pytest.raises((ValueError, TypeError), match=message):
        call(filter_)
    assert filter_.masters == 2
    assert np.array_equal(filter_.poses, twin.poses)
    for one in (filter_, twin):
        one.step(1, [5, 0.5], [300, -1.5], 0)
    assert np.array_equal(filter_.poses, twin.poses)  # the random numbers too are where they were


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CompassMotion(sigma_speed_m_s=-1), "sigma_speed_m_s must not be negative"),
        (lambda: CompassMotion(sigma_heading_rad=4), "sigma_heading_rad must be at most 3"),
        (lambda: CompassMotion(compensate_bias=0), "compensate_bias must be True or False"),
        (lambda: UnicycleMotion(sigma_yaw_rate_rad_s=np.nan), "sigma_yaw_rate_rad_s must be fin"),
        (lambda: PiecewiseAcceleration(acceleration_m_s2=-1), "acceleration_m_s2 must not be neg"),
        (lambda: Sonar(sigma_range_m=0), "sigma_range_m must be positive"),
        (lambda: Sonar(sigma_bearing_rad=1e-7), "sigma_bearing_rad must be above 1e-6"),
        (lambda: Sonar(bearing="north"), "bearing must be 'master_to_slave'"),
        (lambda: Outage(Sonar()), "filter must be an auvest.Slatf"),
        (lambda: EkfSlat(START, CERTAIN, gate=np.inf), "gate must be finite"),
        (lambda: EkfSlat(START, CERTAIN).master(0), "there is no master 0: none was added"),
    ],
)
def test_bad_parts_are_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        make()


def test_a_row_that_cannot_be_done_is_named() -> None:
    filter_ = fresh()
    with pytest.raises(FilterError, match="run at row 2") as caught:
        filter_.run(
            np.arange(5.0),
            np.tile([5, 0.5], (4, 1)),
            z=[[300, -1.5], [300, -1.5], [300, -1.5]],
            z_time_s=[1, 3, 3],
            master=[0, 1, 1],
        )
    assert caught.value.step == 2
    assert caught.value.status == Status.bad_parameter == filter_.status
    assert len(caught.value.partial) == 2


def test_no_more_masters_than_there_is_room_for() -> None:
    filter_ = fresh()
    for number in (2, 3):
        assert filter_.add_master(MASTER_X, MASTER_P) == number
    with pytest.raises(ValueError, match="the filter has 4 masters already"):
        filter_.add_master(MASTER_X, MASTER_P)


def test_an_echo_of_each_master_at_once_and_no_more() -> None:
    filter_ = EkfSlat(START, CERTAIN, gate=16.0)
    places = [(100.0, 0.0), (0.0, 200.0), (-300.0, 0.0), (0.0, -400.0)]
    assert len(places) == MAX_MASTERS
    for x, y in places:
        filter_.add_master([x, y, 0, 0, 0, 0], MASTER_P)
    filter_.predict(1, [0, 0])
    # From the master to the slave at the origin: back along the line.
    z = [[np.hypot(x, y), np.arctan2(-y, -x)] for x, y in places]
    filter_.update(z, [0, 1, 2, 3])
    assert filter_.nis == pytest.approx(0.0, abs=1e-9)  # each is what was expected
    assert filter_.P.diagonal().max() < 9.0  # and all were heard: dead reckoning has 2 m/s
    before = filter_.x, filter_.P
    with pytest.raises(ValueError, match="z has 5 echoes; at most 4 are taken at once"):
        filter_.update([*z, [50.0, 1.0]], [0, 1, 2, 3, UNKNOWN_MASTER])
    assert np.array_equal(filter_.x, before[0])
    assert np.array_equal(filter_.P, before[1])


def test_missing_echoes_change_nothing() -> None:
    filter_, twin = fresh(), fresh()
    filter_.update(None)
    filter_.update([np.nan, np.nan], 0)
    filter_.update([[np.nan, np.nan], [300, -1.5]], [0, 1])
    twin.update([300, -1.5], 1)
    assert np.array_equal(filter_.poses, twin.poses)


@pytest.mark.parametrize("make", [Slatf, SlatfJoint, EkfSlat, DeadReckoning])
def test_nan_rows_of_a_record_are_as_if_they_were_not_there(make: Any) -> None:
    data = record(10, masters=1)
    there = np.arange(len(data["z"])) % 3 != 1
    gaps = {**data, "z": np.where(there[:, None], data["z"], np.nan)}
    less = {**data, **{name: data[name][there] for name in ("z", "z_time_s", "master")}}
    silent = {**gaps, "z": np.full_like(data["z"], np.nan)}
    nothing = {name: data[name] for name in ("time_s", "u", "changes")}
    for one, other in ((gaps, less), (silent, nothing)):
        made = [with_masters(make(START, CERTAIN), 1) for _ in range(2)]
        runs = [filter_.run(**each) for filter_, each in zip(made, (one, other), strict=True)]
        assert everything(made[0], runs[0]) == everything(made[1], runs[1])
        assert made[0].save() == made[1].save()


def test_a_result_has_the_times_of_its_rows() -> None:
    data = record(10)
    result = with_masters(EkfSlat(START, CERTAIN)).run(**data)
    assert np.array_equal(result.time_s, data["time_s"][1:])
    frame = result.to_pandas(["x", "masters_x"])
    assert list(frame.index) == list(data["time_s"][1:])
    assert list(frame)[:4] == ["x_0", "x_1", "masters_x_0_0", "masters_x_0_1"]
    assert list(frame["masters_x_1_3"]) == list(result.masters_x[:, 1, 3])


def wide(value: Any) -> Any:
    """Every other column of a wider array: not contiguous."""
    array = np.asarray(value, float)
    return np.repeat(array, 2, axis=-1)[..., ::2]


#: (dt, u, z, master) that mean the same, as users may write them.
SAME: list[tuple[Any, Any, Any, Any]] = [
    (2.0, np.array([5, 0.5]), np.array([300.0, -1.5]), 0),
    (2, [5, 0.5], [300, -1.5], 0),
    (np.float64(2), (5.0, 0.5), (300, -1.5), np.int32(0)),
    (np.float32(2), np.array([5, 0.5], np.float32), np.array([[300, -1.5]], np.float32), [0]),
    (np.array(2.0), np.array([5, 0.5], np.float16), [[300, -1.5]], np.array([0])),
    (2, wide([5, 0.5]), wide([300, -1.5]), np.array(0)),
    (2, [np.float32(5), 0.5], wide([[300, -1.5]]), np.array([0], np.uint8)),
    (2, np.array([5, 0.5], ">f8"), np.array([300, -1.5], ">f4"), 0),
    (2, [5, 0.5], [[np.nan, np.nan], [300, -1.5]], [1, 0]),
    (2, [5, 0.5], np.array([[300, -1.5]] + 9 * [[np.nan] * 2]), [0] + 9 * [1]),
]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_numbers_mean_the_same_however_they_are_written(dtype: Any) -> None:
    states = []
    for dt, u, z, master in SAME:
        for fused in (False, True):
            filter_ = with_masters(Slatf(START, CERTAIN, dtype=dtype))
            if fused:
                filter_.step(dt, u, z, master)
            else:
                filter_.predict(dt, u)
                filter_.update(z, master)
            states.append(filter_.save())
    assert set(states) == {states[0]}


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_plans_mean_the_same_however_they_are_written(dtype: Any) -> None:
    plan = [[1, 2], [0.5, -0.25]]
    states = []
    for changes in (plan, np.array(plan, dtype), np.array(plan, np.float16), wide(plan)):
        filter_ = with_masters(EkfSlat(START, CERTAIN, dtype=dtype))
        filter_.predict(2, [5, 0.5], changes=changes)
        assert filter_.master(1)[0][2] == SECOND_X[2] + 0.5
        states.append(filter_.save())
    assert set(states) == {states[0]}


def test_what_is_no_number_is_not_taken_for_one() -> None:
    filter_ = fresh()
    masked = np.ma.masked_array([300.0, -1.5], mask=[True, False])
    bad: list[tuple[Callable[[], object], str]] = [
        (lambda: filter_.predict(True, [5, 0]), "dt must be a number, not bool"),
        (lambda: filter_.predict("1", [5, 0]), "dt must be a number, not str"),  # type: ignore[arg-type]
        (lambda: filter_.predict(10**400, [5, 0]), "^dt is beyond the range of float64$"),
        (lambda: filter_.predict(1, [5, None]), "u must be an array"),  # type: ignore[list-item]
        (lambda: filter_.predict(1, [5, 10**400]), "u must be an array"),
        (lambda: filter_.predict(1, masked), "u must be .* not a masked array"),
        (lambda: filter_.update(masked, 0), "z must be .* not a masked array"),
        (lambda: filter_.update([300, -1.5], True), "master must be an int"),
        (lambda: filter_.update([300, -1.5], 2**80), "master"),
        (lambda: filter_.update(np.zeros((1, 1, 2)), 0), "z has shape"),
        (lambda: filter_.update(np.zeros((5, 2)), [0, 1, 2, 3, 4]), "master is 2"),
        (lambda: filter_.update(np.zeros((5, 2)), -1), "z has 5 echoes; at most 4"),
    ]
    for call, message in bad:
        with pytest.raises((ValueError, TypeError), match=message):
            call()
    single = Slatf(START, CERTAIN, dtype="float32")
    with pytest.raises(ValueError, match=r"u\[0\] is 1e\+39: beyond the range of float32"):
        single.predict(1, [1e39, 0])
    with pytest.raises(ValueError, match=r"dt = 1e\+39 is beyond the range of float32"):
        single.predict(1e39, [5, 0])


def test_defaults_are_those_of_the_core() -> None:
    """One default, in C++: section 7's noise."""
    assert (CompassMotion().sigma_speed_m_s, CompassMotion().sigma_heading_rad) == (2, 0.3)
    assert (Sonar().sigma_range_m, Sonar().sigma_bearing_rad) == (1, 0.06)
    assert PiecewiseAcceleration().acceleration_m_s2 == 1e-4
    assert available_lanes("float64") == ("scalar",)
    assert available_lanes()[0] == "scalar"
    assert fresh().lanes == "scalar"
    assert Slatf(START, CERTAIN, dtype="float32").lanes == available_lanes()[-1]
    assert "masters=2" in repr(fresh())


@pytest.mark.parametrize("kind", [Slatf, SlatfJoint, EkfSlat, DeadReckoning])
def test_a_parameter_that_the_filter_does_not_have_is_refused_by_name(kind):
    with pytest.raises(TypeError, match=rf"{kind.__name__}.*unexpected keyword argument 'gates'"):
        kind([0, 0], np.eye(2), gates=9.0)
