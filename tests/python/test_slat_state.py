"""Saved states of the SLAT filters: each goes on with the same bits, and takes only its own."""

from __future__ import annotations

import contextlib
import copy
import multiprocessing
import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import auvest
from auvest.slat import Slatf, available_lanes

DTYPES = ("float32", "float64")
NAMES = (
    "slatf1",
    "slatf2",
    "slatf_imm",
    "births",
    "joint1",
    "joint2",
    "shared",
    "ekf",
    "ekf_imm",
    "reckoning",
)

UNICYCLE = {
    "motion": auvest.UnicycleMotion(sigma_speed_m_s=0.2),
    "sonar": auvest.Sonar(sigma_range_m=0.5, bearing="from_heading"),
}
MAKE: dict[str, Callable[..., Any]] = {
    "slatf1": lambda x, p, **o: auvest.Slatf(
        x, p, version=1, particles=37, resample_below=0.9, **{"gate": 16, **o}
    ),
    "slatf2": lambda x, p, **o: auvest.Slatf(x, p, particles=37, resampling="residual", **o),
    "slatf_imm": lambda x, p, **o: auvest.Slatf(x, p, particles=20, master=auvest.Imm(), **o),
    "births": lambda x, p, **o: auvest.Slatf(
        x, p, particles=20, birth_velocity_m_s=2, **{"gate": 16, **o}
    ),
    "joint1": lambda x, p, **o: auvest.SlatfJoint(x, p, particles=20, **o),
    "joint2": lambda x, p, **o: auvest.SlatfJoint(
        x, p, particles=20, max_masters=2, kept=0, **{"gate": 0, **o}
    ),
    "shared": lambda x, p, **o: auvest.SlatfJoint(
        x, p, particles=20, covariance="shared", max_masters=2, **{"gate": 0, **o}
    ),
    "ekf": lambda x, p, **o: auvest.EkfSlat(x, p, **{"gate": 16, **o}),
    "ekf_imm": lambda x, p, **o: auvest.EkfSlat(x, p, master=auvest.Imm(), **o),
    "reckoning": lambda x, p, **o: auvest.DeadReckoning(x, p, **o),
}
MASTER = ([0, 300, 5, 1.3, 0, 0], np.diag([1, 1, 0.0025, 0.0025, 1e-8, 1e-8]))
#: (range, bearing) from a heading of 0, from two places; of nobody knows whom.
HEARD = [(300, 1.6), (310, 1.58), (200, -1.0), (330, 1.55), (205, -1.02), None, (333, 1.5)]


def make(name: str, dtype: str, seed: int = 1, **options: Any) -> Any:
    unicycle = name in ("slatf2", "joint2", "ekf_imm")  # all poses, all sonars
    n = 3 if unicycle else 2
    if name not in ("ekf", "ekf_imm", "reckoning"):
        options["seed"] = seed
    if unicycle:
        options = {**UNICYCLE, **options}
    return MAKE[name](np.zeros(n), 0.01 * np.eye(n), dtype=dtype, **options)


def started(name: str, dtype: str) -> Any:
    """A filter in the midst of its work."""
    filter_ = make(name, dtype)
    if name != "births":
        filter_.add_master(*MASTER)
    if name == "joint2":
        filter_.add_master([100, -200, 4, 2, 0, 0], MASTER[1])
    drive(filter_, HEARD[: 1 if name == "births" else 4])
    return filter_


def drive(filter_: Any, heard: Any) -> None:
    # Particles with one covariance cannot differ in whose echo it was.
    unknown = 0 if filter_._shared else auvest.UNKNOWN_MASTER
    for k, z in enumerate(heard):
        if z is not None and filter_.motion.pose_states == 2:
            z = (z[0], -z[1])  # from the master
        if k % 2:
            filter_.predict(0.5, [5, 0.1])
            filter_.update(z, unknown)
        elif isinstance(filter_, auvest.Outage):
            filter_.predict(0.5, [4, 0.2])
            filter_.update(z, unknown)
        else:
            filter_.step(0.5, [4, 0.2], z, unknown)


def seen(filter_: Any) -> dict[str, Any]:
    """All that can be read, to the last bit."""
    found: dict[str, Any] = {"x": filter_.x.tobytes(), "P": filter_.P.tobytes()}
    readings = ("masters", "log_likelihood", "effective_size", "resamplings", "nis", "status")
    found |= {name: getattr(filter_, name) for name in readings if hasattr(filter_, name)}
    for n in range(found.get("masters", 0)):
        found[f"master {n}"] = tuple(part.tobytes() for part in filter_.master(n))
        if isinstance(filter_._settings.get("master"), auvest.Imm):
            found[f"modes {n}"] = filter_.mode_probabilities(n).tobytes()
    if hasattr(filter_, "weights"):
        found |= {"weights": filter_.weights.tobytes(), "poses": filter_.poses.tobytes()}
    return found


def by_save(filter_: Any) -> Any:
    other = copy.deepcopy(filter_)
    drive(other, HEARD[::-1])  # a state of its own, to be replaced
    assert other.save() != filter_.save()
    other.restore(filter_.save())
    return other


WAYS: dict[str, Callable[[Any], Any]] = {
    "save": by_save,
    "pickle": lambda f: pickle.loads(pickle.dumps(f)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", NAMES)
def test_it_goes_on_with_the_same_bits(name: str, dtype: str, way: str) -> None:
    filter_ = started(name, dtype)
    twin = WAYS[way](filter_)
    before = seen(filter_)
    assert seen(twin) == before
    drive(twin, HEARD)
    assert seen(filter_) == before  # it is a copy
    drive(filter_, HEARD)
    assert seen(twin) == seen(filter_) != before
    assert twin.save() == filter_.save()


def test_the_filters_of_these_tests_do_what_they_are_there_for() -> None:
    """States without resamplings, births or second masters would show nothing."""
    births = started("births", "float64")
    assert births.masters == 1
    drive(births, HEARD)
    assert births.masters > 1
    for name in ("slatf1", "slatf2", "joint2"):
        filter_ = started(name, "float64")
        drive(filter_, HEARD)
        assert filter_.resamplings > 0
    assert started("joint2", "float32").masters == 2


@pytest.mark.parametrize("dtype", DTYPES)
def test_a_filter_that_heard_nothing_yet_can_be_saved(dtype: str) -> None:
    for name in NAMES:
        filter_ = make(name, dtype)
        other = started(name, dtype)
        other.restore(filter_.save())
        assert seen(other) == seen(filter_)
        if name != "births":
            other.add_master(*MASTER)
            filter_.add_master(*MASTER)
        drive(filter_, HEARD)
        drive(other, HEARD)
        assert seen(other) == seen(filter_)


@pytest.mark.parametrize("version", [1, 2])
def test_all_lanes_share_one_state(version: Any) -> None:
    def fresh(lanes: Any) -> Slatf:
        filter_ = Slatf(
            [0, 0], np.eye(2), version=version, particles=37, lanes=lanes, dtype="float32"
        )
        filter_.add_master(*MASTER)
        return filter_

    scalar = fresh("scalar")
    drive(scalar, HEARD)
    state = scalar.save()
    drive(scalar, HEARD)
    for lanes in available_lanes():
        other = fresh(lanes)
        drive(other, HEARD)
        assert other.save() == state
        other.restore(state)
        assert pickle.loads(pickle.dumps(other)).lanes == lanes
        drive(other, HEARD)
        assert seen(other) == seen(scalar)


def test_a_pickle_of_lanes_that_are_not_here_runs_in_those_that_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    filter_ = Slatf([0, 0], np.eye(2), dtype="float32")
    pickled = pickle.dumps(filter_)
    monkeypatch.setattr("auvest.slat.slatf.available_lanes", lambda _: ("scalar",))
    here = pickle.loads(pickled)
    assert here.lanes == "scalar"
    assert seen(here) == seen(filter_)


# Outage.


def outage(name: str, dtype: str, word: str) -> auvest.Outage:
    made = auvest.Outage(make(name, dtype))
    if word != "never":
        share(made, name)
    if word == "down":
        drive(made, HEARD[:4])
    return made


def share(made: auvest.Outage, name: str) -> None:
    n = made.motion.pose_states
    made.share(np.ones(n), 0.1 * np.eye(n), [] if name == "births" else [MASTER])


def told(made: auvest.Outage) -> list[Any]:
    found: list[Any] = [made.communication]
    if made.communication != "never":
        found += [made.x.tobytes(), made.P.tobytes()]
        for n in range(made._core_steps.masters):
            found += [part.tobytes() for part in made.master(n)]
    return found


@pytest.mark.parametrize("word", ["never", "up", "down"])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", NAMES)
def test_an_outage_goes_on_with_the_same_bits(name: str, dtype: str, word: str) -> None:
    def by_restore(one: auvest.Outage) -> auvest.Outage:
        other = outage(name, dtype, "down")
        other.restore(one.save())
        return other

    for way in (by_restore, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))):
        one = outage(name, dtype, word)
        two = way(one)
        assert told(two) == told(one)
        if word == "never":
            for each in (one, two):
                share(each, name)
        before = told(one)
        drive(two, HEARD)
        assert told(one) == before
        drive(one, HEARD)
        assert told(two) == told(one) != before
        assert two.save() == one.save()


# Another process.


def finish(filter_: Any) -> bytes:
    """Runs in the spawned process."""
    drive(filter_, HEARD)
    state: bytes = filter_.save()
    return state


def test_filters_go_on_in_a_spawned_process() -> None:
    filters = [started(name, dtype) for name in NAMES for dtype in DTYPES]
    filters += [outage(name, "float32", "down") for name in NAMES]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map(finish, filters)
    assert there == [finish(filter_) for filter_ in filters]


# What is refused.


def other_than(name: str) -> list[tuple[Any, str]]:
    """Filters whose state is not that of ``make(name, "float32")``, and what is said."""
    n = 2
    x, p = np.zeros(n), np.eye(n)
    others: list[tuple[Any, str]] = [
        (make(name, "float64"), "dtype is 'float64', expected 'float32'"),
    ]
    compass = auvest.CompassMotion(sigma_speed_m_s=1)
    if name != "reckoning":
        sonar = auvest.Sonar(sigma_range_m=3)
        others += [
            (
                make(name, "float32", motion=compass),
                r"motion\.sigma_speed_m_s is 1\.0, expected 2\.0",
            ),
            (make(name, "float32", sonar=sonar), r"sonar\.sigma_range_m is 3\.0, expected 1\.0"),
            (auvest.DeadReckoning(x, p, dtype="float32"), "class DeadReckoning, expected"),
        ]
    if name == "slatf1":
        others += [
            (auvest.Slatf(x, p, version=2, particles=37, gate=16, dtype="float32"), "version is 2"),
            (auvest.Slatf(x, p, version=1, particles=38, gate=16, dtype="float32"), "38, expected"),
            (auvest.Slatf(x, p, version=1, particles=37, dtype="float32"), r"gate is 13\.8, expec"),
            (
                auvest.Slatf(
                    x, p, version=1, particles=37, gate=16, dtype="float32", master=auvest.Imm()
                ),
                "master is Imm, expected PiecewiseAcceleration",
            ),
            (
                auvest.Slatf(
                    x, p, version=1, particles=37, gate=16, dtype="float32", resampling="residual"
                ),
                "resampling is 'residual', expected 'systematic'",
            ),
        ]
    if name == "joint1":
        two = auvest.SlatfJoint(x, p, particles=20, max_masters=2, dtype="float32")
        others.append((two, "max_masters is 2, expected 1"))
    return others


@pytest.mark.parametrize("name", ["slatf1", "joint1", "ekf", "reckoning"])
def test_a_foreign_state_is_refused_and_changes_nothing(name: str) -> None:
    filter_ = started(name, "float32")
    before = filter_.save()
    for other, message in other_than(name):
        with pytest.raises(ValueError, match=message):
            filter_.restore(other.save())
        assert filter_.save() == before


def test_an_outage_refuses_the_state_of_one_with_another_filter() -> None:
    one = outage("slatf1", "float32", "down")
    before = one.save()
    with pytest.raises(ValueError, match=r"filter is EkfSlat, expected Slatf"):
        one.restore(outage("ekf", "float32", "down").save())
    with pytest.raises(ValueError, match=r"filter\.dtype is 'float64', expected 'float32'"):
        one.restore(outage("slatf1", "float64", "down").save())
    with pytest.raises(ValueError, match="class Slatf, expected Outage"):
        one.restore(started("slatf1", "float32").save())
    assert one.save() == before


@pytest.mark.parametrize("name", [*NAMES, "outage"])
def test_a_damaged_state_is_refused_and_changes_nothing(name: str) -> None:
    filter_ = outage("slatf1", "float32", "down") if name == "outage" else started(name, "float32")
    state = filter_.save()
    drive(filter_, HEARD[:2])
    before = filter_.save()
    random = np.random.default_rng(1)
    for place in random.integers(0, len(state), 200):
        damaged = bytearray(state)
        damaged[place] ^= 1 << random.integers(8)
        with pytest.raises(ValueError, match="state is"):
            filter_.restore(bytes(damaged))
    with pytest.raises(ValueError, match="state is"):
        filter_.restore(state[:-1])
    with pytest.raises(TypeError, match="must be bytes"):
        filter_.restore({})
    assert filter_.save() == before
    filter_.restore(state)
    assert filter_.save() == state


@pytest.mark.parametrize("name", [*NAMES, "outage"])
def test_the_core_refuses_numbers_that_are_not_a_state(name: str) -> None:
    filter_ = outage("slatf1", "float64", "down") if name == "outage" else started(name, "float64")
    core = filter_._core_steps
    state = core.save()
    numbers, counts = state["numbers"], state["counts"]
    bad = [(numbers[:-1], counts), (np.append(numbers, 0), counts), (numbers, counts[:-1])]
    bad.append((numbers, np.append(counts, 0)))
    for place in range(len(counts)):
        for wrong in (-1, 2**31):
            changed = counts.copy()
            changed[place] = wrong
            bad.append((numbers, changed))
    for wrong_numbers, wrong_counts in bad:
        with pytest.raises(ValueError, match="not the state of such a filter"):
            core.restore(wrong_numbers, wrong_counts)
    after = core.save()
    assert np.array_equal(after["numbers"], numbers)
    assert np.array_equal(after["counts"], counts)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "reckoning"])
def test_a_covariance_that_is_none_is_refused_wherever_the_filter_keeps_it(name: str) -> None:
    # One number of the state is far too large, in places over all of it. What is taken all the same
    # (a mean, a variance, a weight) stays a number.
    filter_ = started(name, "float32")
    numbers, counts = (filter_._core_steps.save()[part] for part in ("numbers", "counts"))
    refused = 0
    for place in np.unique(np.linspace(0, len(numbers) - 1, 400).astype(int)):
        changed = numbers.copy()
        changed[place] = 1e9
        other = copy.deepcopy(filter_)
        try:
            other._core_steps.restore(changed, counts)
        except ValueError:
            refused += 1
            continue
        with contextlib.suppress(auvest.FilterError), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            drive(other, HEARD[:3])
        for n in range(other.masters):
            assert all(np.isfinite(part).all() for part in other.master(n)), place
        assert np.isfinite(other.x).all(), place
        assert np.isfinite(other.P).all(), place
    assert refused > 0


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("births", "reckoning")])
def test_a_filter_takes_its_own_state_whatever_it_was_told(name: str, dtype: str) -> None:
    # Without a gate an absurd echo throws a master: 1e9 m off in 2 s is some 1e9 m/s.
    filter_ = make(name, dtype, gate=0)
    filter_.add_master([100, 50, 1, 1, 0, 0], np.eye(6))
    filter_.predict(2.0, [1.0, 0.0])
    with contextlib.suppress(auvest.FilterError), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        filter_.update([1e9, 1.479], 0)
    assert np.abs(filter_.master(0)[0][2:4]).max() > 1e7
    state = filter_.save()
    other = make(name, dtype, gate=0)
    other.restore(state)
    assert other.save() == state


def test_the_status_is_pickled() -> None:
    filter_ = started("ekf", "float64")
    with pytest.raises(auvest.FilterError):
        filter_.run([0, 1], [[1, 0]], z=[[10, 0], [10, 0]], z_time_s=[1, 1], master=0)
    assert filter_.status == auvest.Status.bad_parameter
    assert pickle.loads(pickle.dumps(filter_)).status == auvest.Status.bad_parameter
