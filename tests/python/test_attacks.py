"""Short versions of the attacks (tests/attacks), and that they see what they are for."""

from __future__ import annotations

import os
import random
import re
from collections import Counter

import numpy as np
import pytest

import auvest
from tests.attacks import frame, importers, interface, logs, states
from tests.attacks.frame import Case, Failed

#: What the attacks still find, by the kind of failure.
KNOWN = (
    # Single precision at the end of its range.
    r"(EkfSlat|Slatf|SlatfJoint|DeadReckoning|Outage)( \(master\))?: not finite after ok",
    # Measurements that are 1e7 times as precise as what they correct.
    r"\w+: (variance of 0|P indefinite) after ok",
    r"\w+\.(restore|loads): its own state is refused",
)


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
    new = [kind for kind in result.failures if not any(re.fullmatch(k, kind) for k in KNOWN)]
    assert new == []
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
