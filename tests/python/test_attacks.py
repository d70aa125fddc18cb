"""Short versions of the attacks (tests/attacks), and that they see what they are for."""

from __future__ import annotations

import os
import random
from collections import Counter

import numpy as np
import pytest

import auvest
from tests.attacks import frame, importers, interface, logs, recorders, states
from tests.attacks.frame import Case, Failed


class Numbers:
    """Fails where two even numbers come; number 7 ends the process, where it is deadly."""

    unit = "numbers"

    def __init__(self, deadly=False):
        self.deadly = deadly

    def case(self, rng: random.Random) -> Case:
        return Case("f", tuple(rng.randrange(1, 100) for _ in range(8)))

    def text(self, case: Case) -> str:
        return f"{case.steps}"

    def run(self, case: Case, counts: Counter[str]) -> None:
        counts["numbers"] += len(case.steps)
        if self.deadly and 7 in case.steps:
            os._exit(3)
        even = [n for n in case.steps if n % 2 == 0]
        if not self.deadly and len(even) >= 2:
            raise Failed("two even numbers", f"{even}")


def test_a_failing_case_is_made_small(capsys):
    result = frame.run(Numbers(), 400, seed=3)
    (text,) = result.failures.values()
    left = text.splitlines()[1]
    assert left.count(",") == 1  # two steps of eight, both even
    assert all(int(n) % 2 == 0 for n in left.strip("()").split(","))
    assert 40 < result.times["two even numbers"] <= 50 == result.cases
    assert "two even numbers" in capsys.readouterr().out


def test_a_crash_is_a_failure_and_the_attack_goes_on(capsys):
    deadly = [k for k in range(60) if 7 in frame.numbered(Numbers(), 3, k).steps]
    assert 1 <= len(deadly) <= 6
    result = frame.run_apart(Numbers(deadly=True), 8 * (60 - len(deadly)), seed=3)
    kind = "crash: the process ended with 3"
    assert result.times == {kind: len(deadly)}
    assert f"seed 3, case {deadly[0]}\n" in result.failures[kind]
    assert result.cases == 60
    assert result.counts["numbers"] == 8 * (60 - len(deadly))
    capsys.readouterr()


def attacked(attack, amount, seed=1):
    result = frame.run(attack, amount, seed)
    assert list(result.failures) == []
    return result.counts


def test_states():
    counts = attacked(states.ATTACK, 600)
    assert counts["with a new checksum"] > 240
    assert counts["loaded"] > 60
    assert counts["refused"] > 360


def test_the_attack_on_states_sees_what_is_not_checked(monkeypatch, capsys):
    adaptive = {name: f for name, f in states.subjects().items() if "late, Mahalanobis" in name}
    monkeypatch.setattr(states, "subjects", lambda: adaptive)
    monkeypatch.setattr(auvest.filters.GaussianFilter, "_require_interval", lambda *_: None)
    result = frame.run(states.ATTACK, 300, seed=1)
    assert any("out of its limits" in kind for kind in result.failures)
    capsys.readouterr()


def test_interface():
    counts = attacked(interface.ATTACK, 1500, seed=4)
    assert counts["done"] > 750
    assert counts["refused"] > 100
    assert counts["constructions"] > 75


def test_the_attack_on_the_interface_sees_a_change_by_a_refusal(monkeypatch, capsys):
    update = auvest.Ekf.update

    def changes(self, *arguments, **options):
        try:
            update(self, *arguments, **options)
        except ValueError:
            self.predict(0.25, [0.1] * len(self.process.input) or None)
            raise

    monkeypatch.setattr(auvest.filters.GaussianFilter, "update", changes)
    result = frame.run(interface.ATTACK, 600, seed=1)
    assert any("changed by a refusal" in kind for kind in result.failures)
    capsys.readouterr()


@pytest.mark.parametrize("name", ["policy", "event_sensor", "status", "report_flags", "x"])
def test_a_state_without_one_of_its_arrays_is_refused(name):
    f = states.subjects()["Aukf, late, Mahalanobis, float32"]
    header, payload = states.opened(f.save())
    place = [row[0] for row in header["arrays"]].index(name)
    header["arrays"][place][0] = "other"
    with pytest.raises(ValueError, match=rf"state is damaged: ({name}|other) is (missing|new)"):
        f.restore(states.closed(header, bytes(payload)))


def test_logs():
    counts = attacked(logs.ATTACK, 60)
    assert counts["replayed"] > 3
    assert counts["LogError"] > 30


def test_importers():
    counts = attacked(importers.ATTACK, 150)
    assert counts["imported"] > 20
    assert counts["refused"] > 50


def test_recorders():
    counts = attacked(recorders.ATTACK, 100)
    for kind in recorders.recordings():
        assert counts[f"{kind} listed"] + counts[f"{kind} not listed"] > 0
    assert sum(count for what, count in counts.items() if what.endswith("imported")) > 20


def test_the_attack_on_recorders_sees_an_exception(monkeypatch, capsys):
    kinds = {"alog": recorders.recordings()["alog"]}
    monkeypatch.setattr(recorders, "recordings", lambda: kinds)
    monkeypatch.setattr("auvest.importers.alog.nanoseconds", lambda text: int(float(text) * 1e9))
    result = frame.run(recorders.ATTACK, 60, seed=1)
    assert "alog: list: ValueError" in result.failures
    capsys.readouterr()


def test_the_attack_on_importers_sees_an_exception(monkeypatch, capsys):
    """And what is left of a failing case is one step, or what the step needs."""
    goats14 = importers.IMPORTERS["goats14"]

    def careless(source, output):
        text = (source / "ranges.csv").read_bytes()
        text.decode("ascii")
        return goats14(source, output)

    monkeypatch.setattr(importers, "IMPORTERS", {"goats14": careless})
    one = {"goats14": importers.recordings()["goats14"]}
    monkeypatch.setattr(importers, "recordings", lambda: one)
    result = frame.run(importers.ATTACK, 200, seed=1)
    assert "goats14: UnicodeDecodeError" in result.failures
    capsys.readouterr()


@pytest.mark.parametrize("kind", [auvest.Slatf, auvest.EkfSlat])
def test_an_echo_beside_a_missing_one_needs_a_master(kind):
    """Refused like the echo alone; the two ways of reading arguments had disagreed."""
    f = kind([0, 0], np.eye(2))
    for z in ([50.0, -0.7], [[50.0, -0.7], [np.nan, np.nan]]):
        with pytest.raises(auvest.FilterError) as refused:
            f.update(z)
        assert refused.value.status == auvest.Status.bad_parameter
    f.update([[np.nan, np.nan], [np.nan, np.nan]])  # nothing was heard


def test_a_state_with_a_correlation_beyond_1_is_refused():
    """1e38 beside small variances: elimination of P meets a pivot that is no number."""
    f = auvest.Ekf(
        np.ones(6),
        np.diag([0.28, 0.19, 4e-4, 4e-4, 8e-5, 8e-5]),
        process=auvest.ConstantAcceleration(),
        sensors=auvest.RangeBearing(),
        dtype="float32",
    )
    header, payload = states.opened(f.save())
    names = [row[0] for row in header["arrays"]]
    assert names[:2] == ["x", "P"]
    p = f.P
    p[4, 0] = p[0, 4] = 1e38
    payload[24 : 24 + p.nbytes] = p.tobytes()
    before = f.save()
    with pytest.raises(ValueError, match="state is"):
        f.restore(states.closed(header, bytes(payload)))
    assert f.save() == before


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (auvest.Ekf, {}),
        (auvest.Ukf, {"kappa": 0}),
        (auvest.Ckf, {}),
        (auvest.RobustEkf, {"kernel": "huber", "residual": "post-fit"}),
        (auvest.Aukf, {"late_s": 5.0}),
    ],
)
def test_a_measurement_finer_than_the_format_leaves_a_covariance(kind, options):
    """Hours without one, then 0.07 m: 1e-14 of the variance is lost in single precision."""
    f = kind(
        [0, 0, 0, 0, 0, 0],
        np.diag([1e3, 1e3, 1e3, 1e3, 1, 1]),
        process=auvest.ConstantAcceleration(),
        sensors=auvest.RangeBearing(sigma_range_m=0.07, near_field=100.0),
        dtype="float32",
        **options,
    )
    for _ in range(4):
        f.predict(3600)
    for _ in range(5):
        f.update([44.0, -1.8])
        interface.require_sound(f)
        f.restore(f.save())
    assert f.P[0, 0] < 0.1**2 * 44**2


def test_a_variance_that_is_lost_among_others_near_the_smallest_number_is_no_0():
    """A heading without noise of its own: its 1e-300 is lost, and its floor is subnormal."""
    f = auvest.Ukf(
        [-0.8216, -0.08508, -0.0749, 0.7808, 0.4466, 0.07459, 0.7752, 0.202],
        np.eye(8) * 1e-300,
        process=auvest.PlanarHull(surge_psd=1.469, current_psd=1.436e-05),
        sensors=auvest.LeaderRange(),
    )
    f.predict(1.033, [-1.087, -0.6333])
    assert (np.diagonal(f.P) > 0).all()
    f.restore(f.save())


def test_a_variance_beside_one_that_is_nothing_is_no_0():
    f = auvest.Ckf(
        [0.7, -0.2],
        np.diag([1e-37, 1e37]),
        process=auvest.SpeedHeading(),
        sensors=auvest.Position(),
        dtype="float32",
    )
    f.update([-1.7, 1.3])
    assert (np.diagonal(f.P) > 0).all()
    f.restore(f.save())


@pytest.mark.parametrize("kind", [auvest.Slatf, auvest.SlatfJoint, auvest.EkfSlat])
def test_slat_takes_no_start_that_leaves_no_room(kind):
    """Coordinates that are coarse, and variances whose sums or inverses are no numbers."""
    eye = np.eye(2)
    for x, P, why in (
        ([0, 1e38], 1e-5 * eye, r"^x0?\[1\] = 1e\+38 m is no place on Earth$"),
        (
            [0, 9e8],
            1e-5 * eye,
            r"^x0? = \(0, 900000000\) is too far from the origin: float32 tells",
        ),
        ([5e5, 4.2e6], 1e-2 * eye, r"origin, such as \(500000, 4200000\)"),
        ([0, 0], 1e36 * eye, "would not be finite"),
        ([0, 0], 1e-38 * eye, "would not be finite"),
    ):
        with pytest.raises(ValueError, match=why):
            kind(x, P, dtype="float32")
        with pytest.raises(ValueError, match=why):
            auvest.Outage(kind([0, 0], eye, dtype="float32")).share(x, P)
        f = kind([0, 0], eye, dtype="float32")
        master = np.diag([P[0, 0], P[0, 0], 1, 1, 1, 1])
        with pytest.raises(ValueError, match=f"{why}|positive definite"):
            f.add_master([*x, 0, 0, 0, 0], master)
    kind([5e5, 4.2e6], 1e-2 * eye, dtype="float64")
    kind([4e3, -4e3], 0 * eye, dtype="float32")


def test_an_echo_finer_than_nothing_is_refused():
    f = auvest.Slatf([0, 0], np.eye(2), dtype="float32", gate=16, birth_velocity_m_s=2)
    before = f.save()
    for sonar in (
        auvest.Sonar(sigma_range_m=1e16),
        auvest.Sonar(sigma_range_m=1, sigma_bearing_rad=1e15),
    ):
        with pytest.raises(auvest.FilterError) as refused:
            f.update([29.0, -3.0], sonar=sonar)
        assert refused.value.status == auvest.Status.overflow
        assert f.save() == before


def test_an_outage_that_cannot_begin_leaves_the_filter_as_it_was():
    f = auvest.Outage(auvest.Slatf([0, 0], np.eye(2), particles=7, dtype="float32"))
    f.share([0, 0], np.eye(2))
    before = interface.state_of(f)
    with pytest.raises(auvest.FilterError, match="would not be finite"):
        f.predict(1.0, [1e30, 0.0])
    assert interface.state_of(f) == before
    f.predict(1.0, [1.0, 0.0])
    assert f.communication == "down"


def test_a_filter_with_endless_noise_takes_back_its_state():
    """An hour of this noise is no number; it goes into the state, which was refused."""
    motion = auvest.CompassMotion(sigma_speed_m_s=1e18)
    f = auvest.DeadReckoning([0, 0], np.eye(2), motion=motion, dtype="float32")
    f.restore(f.save())
