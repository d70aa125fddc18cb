"""What filters say after a record: the report of the last row; how P0 and kappa are taken."""

from __future__ import annotations

import numpy as np
import pytest
from filter_support import PAPER, same_bits

import auvest
from auvest import Decision, LeaderRange, Odometry, RangeBearing, RejectionStreak, SpeedHeading

PLAIN = (auvest.Ekf, auvest.Ukf, auvest.Aukf)
ROBUST = (auvest.RobustEkf, auvest.RobustUkf)


def approaching(kind):
    """A craft 6 m east of a station at the origin that comes in at 2 m/s, known to 1 cm."""
    given = {
        "process": auvest.ConstantAcceleration(),
        "sensors": RangeBearing(station=(0.0, 0.0), near_field=5.0),
    }
    return kind([6.0, 0.0, -2.0, 0.0, 0.0, 0.0], 1e-4 * np.eye(6), **given)


@pytest.mark.parametrize("kind", PLAIN + ROBUST)
def test_near_field_after_a_record_is_that_of_its_last_row(kind):
    """The form is near within 5 sqrt(P_xx + P_yy), here some centimetres."""
    f = approaching(kind)

    def near():
        return f.report.near_field if kind in ROBUST else f.near_field

    result = f.run([[4.0, 0.0], [2.0, 0.0], [0.001, 0.0]], dt=1.0)
    assert result.near_field.tolist() == [False, False, True]
    assert near() is True
    result = f.run([[0.001, np.pi], [2.0, np.pi]], dt=[0.0, 1.0])  # and out on the other side
    assert result.near_field.tolist() == [True, False]
    assert near() is False


def ranging(kind=auvest.RobustEkf, **options):
    """A craft that stands at the origin, 100 m from a leader, and takes 1 m for its own doubt."""
    given = {
        "process": SpeedHeading(),
        "sensors": LeaderRange(leader=(100.0, 0.0), sigma_range_m=1.0),
        **options,
    }
    return kind([0.0, 0.0], np.eye(2), **given)


def still(rows):
    return {"dt": 1.0, "input": np.zeros((rows, 3))}


@pytest.mark.parametrize("kind", ROBUST)
def test_iterations_after_a_record_are_those_of_its_last_row(kind):
    """An innovation takes one solution, a missing measurement none."""
    f = ranging(kind)
    result = f.run([np.nan, 100.0], **still(2))
    assert result.iterations.tolist() == [0, 1]
    assert f.report.iterations == 1
    result = f.run([100.0, np.nan], **still(2))
    assert result.iterations.tolist() == [1, 0]
    assert f.report is None


@pytest.mark.parametrize("kind", ROBUST)
def test_recovered_after_a_record_is_that_of_its_last_row(kind):
    """Ranges 60 m too long are refused: evidence 4, then 7 for each that repeats it; 12 is enough.

    The units and the limit of four per rejection are those of docs/algorithms/mekf.md.
    """
    f = ranging(kind, recovery=RejectionStreak(rejections=3))
    result = f.run([160.0, 160.0, 160.0], **still(3))
    assert result.recovered.tolist() == [False, False, True]
    assert f.report.recovered is True
    assert f.report.decision == Decision.rejected
    # The belief is now as wide as the 60 m that were asked for: a good range is taken.
    f.run([100.0], **still(1))
    assert f.report.recovered is False
    assert f.report.decision == Decision.accepted


def bits(f):
    f.predict(2.0, [1.5, 0.2, 0.3])
    f.update(98.0)
    return f.x, f.P


@pytest.mark.parametrize(("process", "states"), [(SpeedHeading(), 2), (Odometry(), 3)])
def test_kappa_is_3_minus_n_unless_given(process, states):
    """The kurtosis of a Gaussian is 3: n + kappa = 3 puts the sigma points at sqrt(3) sigma."""

    def ukf(**options):
        start, spread = np.zeros(states), np.diag([400.0, 400.0, 0.25][:states])
        return auvest.RobustUkf(
            start, spread, process=process, sensors=LeaderRange(leader=(100.0, 0.0)), **options
        )

    default = bits(ukf())
    for ours, given in zip(default, bits(ukf(kappa=3 - states)), strict=True):
        assert same_bits(ours, given)
    # Where the points stand is seen in the result: this leader is near, its range is curved.
    assert not same_bits(default[0], bits(ukf(kappa=4 - states))[0])


def skewed(share):
    """Two states with standard deviations 20 and 30; P[0, 1] is that share of 600, P[1, 0] is 0."""
    p0 = np.diag([400.0, 900.0, 1.0, 1.0, 1.0, 1.0])
    p0[0, 1] += share * 20.0 * 30.0
    return p0


@pytest.mark.parametrize("kind", PLAIN)
def test_p0_is_symmetric_to_a_millionth_of_its_standard_deviations(kind):
    assert np.array_equal(kind(np.zeros(6), skewed(1e-7), **PAPER).P, np.diag(np.diag(skewed(0.0))))
    with pytest.raises(ValueError, match=r"P0 must be symmetric, but P0\[0, 1\] is 0\.006"):
        kind(np.zeros(6), skewed(1e-5), **PAPER)
