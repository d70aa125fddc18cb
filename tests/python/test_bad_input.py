"""Bad input: every case says which argument, what was given and what was expected.

Cases at the constructors, and at calls on a filter: those must leave it as it was, to the bit.
"""

from __future__ import annotations

import math
from decimal import Decimal

import numpy as np
import pytest
from filter_support import PAPER, everything, make, measure, straight

import auvest

X0, P0 = np.zeros(6), np.eye(6)
NAN, INF = math.nan, math.inf


def changed(array, index, value):
    result = np.array(array, dtype=np.float64)
    result[index] = value
    return result


def law(**options):
    return lambda: auvest.MahalanobisInterval(**options)


def ukf(*args, **options):
    x0, p0 = args or (X0, P0)
    return lambda: auvest.Ukf(x0, p0, **{**PAPER, **options})


SKEW = changed(P0, (0, 1), 0.5)
INDEFINITE = changed(changed(P0, (0, 1), 2.0), (1, 0), 2.0)
HUGE = np.broadcast_to(np.float64(1.0), (10**12, 2))  # 16 TB, were it copied

CONSTRUCTORS = {
    # x0
    "x0 None": (ukf(None, P0), TypeError, r"x0 must be an array of shape \(6,\), not None"),
    "x0 str": (ukf("abcdef", P0), TypeError, r"x0 must be .* of real numbers, not of str"),
    "x0 text": (ukf(["a"] * 6, P0), TypeError, r"x0 must be .* of real numbers, not of str"),
    "x0 complex": (ukf(X0 + 1j, P0), TypeError, r"x0 must be .*, not of complex128"),
    "x0 bool": (ukf([True] * 6, P0), TypeError, r"x0 must be .*, not of bool"),
    "x0 object": (ukf([None] * 6, P0), TypeError, r"x0 must be .*, not of object"),
    "x0 Decimal": (ukf([Decimal(1)] * 6, P0), TypeError, r"x0 must be .*, not of Decimal"),
    "x0 dict": (ukf({}, P0), TypeError, r"x0 must be .*, not of dict"),
    "x0 masked": (ukf(np.ma.masked_equal(X0, 0), P0), TypeError, r"x0 must .*; use x0\.filled"),
    "x0 column": (
        ukf(X0[:, None], P0),
        ValueError,
        r"x0 has shape \(6, 1\), expected \(6,\); row and column vectors are refused, "
        r"use x0\.ravel\(\)",
    ),
    "x0 row": (ukf(X0[None], P0), ValueError, r"x0 has shape \(1, 6\).* use x0\.ravel\(\)"),
    "x0 short": (ukf(X0[:5], P0), ValueError, r"x0 has shape \(5,\), expected \(6,\)$"),
    "x0 empty": (ukf([], P0), ValueError, r"x0 has shape \(0,\), expected \(6,\)$"),
    "x0 number": (ukf(1.0, P0), ValueError, r"x0 has shape \(\), expected \(6,\)$"),
    "x0 ragged": (ukf([[1], [1, 2]], P0), ValueError, "x0 must .* not rows of different lengths"),
    "x0 NaN": (ukf(changed(X0, 3, NAN), P0), ValueError, r"x0\[3\] is nan; .* must be finite"),
    "x0 inf": (ukf(changed(X0, 0, -INF), P0), ValueError, r"x0\[0\] is -inf; .* must be finite"),
    "x0 beyond float32": (
        ukf(changed(X0, 2, 1e39), P0, dtype="float32"),
        ValueError,
        r"x0\[2\] is 1e\+39: beyond the range of float32, which ends at 3\.4e\+38",
    ),
    # P0
    "P0 vector": (ukf(X0, np.ones(6)), ValueError, r"P0 has shape \(6,\), expected \(6, 6\)"),
    "P0 small": (ukf(X0, np.eye(5)), ValueError, r"P0 has shape \(5, 5\), expected \(6, 6\)"),
    "P0 NaN": (ukf(X0, changed(P0, (2, 2), NAN)), ValueError, r"P0\[2, 2\] is nan"),
    "P0 complex": (ukf(X0, P0 * 1j), TypeError, r"P0 must be .*, not of complex128"),
    "P0 zero variance": (
        ukf(X0, changed(P0, (4, 4), 0.0)),
        ValueError,
        r"P0\[4, 4\] is 0\.0; a variance must be positive",
    ),
    "P0 negative variance": (ukf(X0, -P0), ValueError, r"P0\[0, 0\] is -1\.0; a variance must"),
    "P0 vanishes in float32": (
        ukf(X0, 1e-60 * P0, dtype="float32"),
        ValueError,
        r"P0\[0, 0\] is 0\.0; a variance must be positive in float32",
    ),
    "P0 asymmetric": (
        ukf(X0, SKEW),
        ValueError,
        r"P0 must be symmetric, but P0\[0, 1\] is 0\.5 and P0\[1, 0\] is 0\.0",
    ),
    "P0 indefinite": (
        ukf(X0, INDEFINITE),
        ValueError,
        "P0 must be positive definite in float64, but its smallest eigenvalue is -1$",
    ),
    "P0 singular": (
        ukf(X0, np.ones((6, 6))),
        ValueError,
        "P0 must be positive definite in float64, but its smallest eigenvalue is",
    ),
    # dtype and parameters
    "dtype unknown": (ukf(dtype="float16"), ValueError, "dtype must be .*, not 'float16'"),
    "dtype text": (ukf(dtype="quad"), ValueError, "'float32' or 'float64', not 'quad'"),
    "dtype None": (ukf(dtype=None), ValueError, "dtype must be .*, not None"),
    "dtype swapped": (ukf(dtype=">f4"), ValueError, "dtype must be .*, not '>f4'"),
    "alpha 0": (ukf(alpha=0.0), ValueError, r"alpha must lie in 1e-8\.\.1, not 0\.0"),
    "alpha tiny": (ukf(alpha=1e-9), ValueError, r"alpha must lie in 1e-8\.\.1, not 1e-09"),
    "alpha 1.5": (ukf(alpha=1.5), ValueError, r"alpha must lie in 1e-8\.\.1, not 1\.5"),
    "alpha NaN": (ukf(alpha=NAN), ValueError, "alpha must be finite, not nan"),
    "alpha str": (ukf(alpha="1"), TypeError, "alpha must be a number, not str"),
    "alpha bool": (ukf(alpha=True), TypeError, "alpha must be a number, not bool"),
    "beta small": (ukf(beta=0.5), ValueError, r"beta must be at least alpha\*\*2 = 1\.0, not 0\.5"),
    "kappa -6": (ukf(kappa=-6), ValueError, r"kappa must be above -6 .*, not -6\.0"),
    "kappa inf": (ukf(kappa=INF), ValueError, "kappa must be finite, not inf"),
    "kappa near -6 in float32": (
        ukf(kappa=-6 + 1e-9, dtype="float32"),
        ValueError,
        "kappa=-5.99.* do not suit float32",
    ),
    "process": (
        ukf(process="exact"),
        TypeError,
        r"process must be an auvest\.ProcessModel, not str",
    ),
    "process that measures": (
        ukf(process=auvest.RangeBearing()),
        TypeError,
        r"process must be an auvest\.ProcessModel, not RangeBearing",
    ),
    "no process": (
        lambda: auvest.Ukf(X0, P0),
        TypeError,
        "missing 1 required keyword-only argument: 'process'",
    ),
    "sensors": (
        ukf(sensors=None),
        TypeError,
        "sensors must be a measurement model, a sequence of them or a dict of them by name, "
        "not None$",
    ),
    "sensors str": (ukf(sensors="sonar"), TypeError, "sensors must be a measurement .*, not str"),
    "a sensor": (
        ukf(sensors=[auvest.RangeBearing(), auvest.ConstantAcceleration()]),
        TypeError,
        r"sensors\['ConstantAcceleration'\] must be an auvest\.MeasurementModel, "
        "not ConstantAcceleration",
    ),
    "sensors by number": (
        ukf(sensors={1: auvest.RangeBearing()}),
        TypeError,
        "the names of sensors must be str, not int",
    ),
    "sensors of one class": (
        ukf(sensors=[auvest.RangeBearing(), auvest.RangeBearing(station=(1.0, 2.0))]),
        ValueError,
        "sensors has two RangeBearing; name them: sensors={'first': ",
    ),
    "policy": (
        lambda: auvest.Aukf(X0, P0, policy=0.5),
        TypeError,
        r"policy must be an auvest\.FixedInterval or .*, not float",
    ),
    "reference": (
        lambda: auvest.Aukf(X0, P0, reference=[1, 2, 3]),
        ValueError,
        r"reference has shape \(3,\), expected \(2,\)",
    ),
    "reference NaN": (
        lambda: auvest.Aukf(X0, P0, reference=[1, NAN]),
        ValueError,
        r"reference\[1\] is nan",
    ),
    "Ekf positional": (
        lambda: auvest.Ekf(X0, P0, auvest.ConstantAcceleration()),
        TypeError,
        "positional argument",
    ),
    # models
    "discretisation": (
        lambda: auvest.ConstantAcceleration(discretisation="midpoint"),
        ValueError,
        "discretisation must be 'exact' or 'euler', not 'midpoint'",
    ),
    "discretisation type": (
        lambda: auvest.ConstantAcceleration(discretisation=1),
        TypeError,
        "discretisation must be a str, not int",
    ),
    "psd": (
        lambda: auvest.ConstantAcceleration(velocity_psd=-1e-9),
        ValueError,
        "velocity_psd must not be negative, not -1e-09",
    ),
    "psd in float32": (
        ukf(process=auvest.ConstantAcceleration(acceleration_psd=1e40), dtype="float32"),
        ValueError,
        r"acceleration_psd = 1e\+40 does not suit float32",
    ),
    "Phi dt": (
        lambda: auvest.ConstantAcceleration().Phi(-1),
        ValueError,
        r"dt must not be negative, not -1\.0",
    ),
    "sigma range": (
        lambda: auvest.RangeBearing(sigma_range_m=0),
        ValueError,
        r"sigma_range_m must be positive, not 0\.0",
    ),
    "sigma bearing": (
        lambda: auvest.RangeBearing(sigma_bearing_rad=-0.01),
        ValueError,
        r"sigma_bearing_rad must be positive, not -0\.01",
    ),
    "sigma in float32": (
        ukf(sensors=auvest.RangeBearing(sigma_range_m=1e-25), dtype="float32"),
        ValueError,
        "sigma_range_m = 1e-25 does not suit float32: the square of sigma_range_m",
    ),
    "near_field": (
        lambda: auvest.RangeBearing(near_field=-1),
        ValueError,
        "near_field must not be negative",
    ),
    "station": (
        lambda: auvest.RangeBearing(station=(1, 2, 3)),
        ValueError,
        r"station has shape \(3,\), expected \(2,\)",
    ),
    "station inf": (
        lambda: auvest.RangeBearing(station=(INF, 0)),
        ValueError,
        r"station\[0\] is inf",
    ),
    "h": (
        lambda: auvest.RangeBearing().h(np.zeros((3, 1))),
        ValueError,
        r"x has shape \(3, 1\), expected \(n,\) or \(K, n\) with n at least 2",
    ),
    "h column": (
        lambda: auvest.RangeBearing().h(np.zeros((6, 1))),
        ValueError,
        r"x has shape \(6, 1\), expected \(n,\) or \(K, n\) with n at least 2",
    ),
    "h 3-d": (
        lambda: auvest.RangeBearing().h(np.zeros((2, 3, 6))),
        ValueError,
        r"x has shape \(2, 3, 6\), expected \(n,\) or \(K, n\)",
    ),
    "h number": (
        lambda: auvest.RangeBearing().h(1.0),
        ValueError,
        r"x has shape \(\), expected \(n,\) or \(K, n\)",
    ),
    # interval policies
    "preset": (law(preset="fig3"), ValueError, "preset must be 'figure3' or 'table1', not 'fig3'"),
    "min above initial": (
        law(min_s=0.6),
        ValueError,
        r"min_s <= initial_s <= max_s is required, not min_s=0\.6, initial_s=0\.5, max_s=1\.0",
    ),
    "min 0": (law(min_s=0), ValueError, r"min_s must be positive, not 0\.0"),
    "max below initial": (law(max_s=0.4), ValueError, r"is required, not .*max_s=0\.4"),
    "tau0": (law(tau0=1.0), ValueError, r"0 < tau_min <= tau0 <= tau_max < 1 .* tau0=1\.0"),
    "tau_max": (law(tau_max=1), ValueError, r"tau_max < 1 is required"),
    "tau_max in float32": (
        lambda: auvest.Aukf(
            X0, P0, dtype="float32", policy=auvest.MahalanobisInterval(tau_max=1 - 1e-12)
        ),
        ValueError,
        r"MahalanobisInterval\(.*\) does not suit float32",
    ),
    "scale": (law(scale=1.1), ValueError, r"scale must lie in 0\.\.1, not 1\.1"),
    "ratio_max": (law(ratio_max=0), ValueError, "ratio_max must be above 0 and at most 1"),
    "gamma1": (law(gamma1_m2=-1), ValueError, r"gamma1_m2 must be positive, not -1\.0"),
    "gamma2": (law(gamma2=NAN), ValueError, "gamma2 must be finite, not nan"),
    "epsilon": (law(epsilon="x"), TypeError, "epsilon must be a number, not str"),
    "fixed": (
        lambda: auvest.FixedInterval(interval_s=-0.5),
        ValueError,
        r"interval_s must be positive, not -0\.5",
    ),
    "budget": (
        lambda: auvest.CovarianceBudget(position_sigma_m=0),
        ValueError,
        "position_sigma_m must be positive",
    ),
    "budget limits": (
        lambda: auvest.CovarianceBudget(max_s=0.1),
        ValueError,
        "min_s <= initial_s <= max_s is required",
    ),
}


def test_the_limits_of_the_law_belong_to_it():
    for scale in (0.0, 1.0):
        assert auvest.MahalanobisInterval(scale=scale).scale == scale
    assert auvest.MahalanobisInterval(ratio_max=1.0).ratio_max == 1


def test_a_record_may_have_as_many_rows_as_are_taken_at_once(monkeypatch):
    f = make(auvest.Ekf)
    z = measure(straight(5))
    monkeypatch.setattr("auvest._arguments.MAX_ROWS", 5)
    assert len(f.run(z, dt=0.5)) == 5
    before = everything(f)
    with pytest.raises(ValueError, match="z has 6 rows, at most 5 are taken at once"):
        f.run(measure(straight(6)), dt=0.5)
    assert everything(f) == before


@pytest.mark.parametrize("case", CONSTRUCTORS)
def test_constructors(case):
    call, error, message = CONSTRUCTORS[case]
    with pytest.raises(error, match=message):
        call()


Z = measure(straight(8))

CALLS = {
    # predict
    "dt negative": (lambda f: f.predict(-0.5), ValueError, r"dt must not be negative, not -0\.5"),
    "dt NaN": (lambda f: f.predict(NAN), ValueError, "dt must be finite, not nan"),
    "dt inf": (lambda f: f.predict(INF), ValueError, "dt must be finite, not inf"),
    "dt str": (lambda f: f.predict("0.5"), TypeError, "dt must be a number, not str"),
    "dt bool": (lambda f: f.predict(True), TypeError, "dt must be a number, not bool"),
    "dt complex": (lambda f: f.predict(1j), TypeError, "dt must be a number, not complex"),
    "dt array": (
        lambda f: f.predict(np.ones(1)),
        TypeError,
        r"dt must be a number, not ndarray of shape \(1,\)",
    ),
    "dt beyond float32": (lambda f: f.predict(1e39), ValueError, r"dt = 1e\+39 is beyond the"),
    "dt int beyond all": (
        lambda f: f.predict(10**400),
        ValueError,
        "^dt is beyond the range of float64$",
    ),
    # update
    "z short": (lambda f: f.update([1.0]), ValueError, r"z has shape \(1,\), expected \(2,\)"),
    "z empty": (lambda f: f.update([]), ValueError, r"z has shape \(0,\), expected \(2,\)"),
    "z column": (lambda f: f.update([[1.0], [2.0]]), ValueError, r"z has .*use z\.ravel\(\)"),
    "z half NaN": (
        lambda f: f.update([NAN, 1.0]),
        ValueError,
        r"z\[0\] is nan and the rest of the measurement is not; a measurement that is missing is N",
    ),
    "z inf": (lambda f: f.update([1.0, INF]), ValueError, r"z\[1\] is inf; all elements must be"),
    "z NaN and inf": (lambda f: f.update([NAN, INF]), ValueError, r"z\[0\] is nan"),
    "z beyond float32": (lambda f: f.update([1e39, 0]), ValueError, r"z\[0\] is 1e\+39: beyond"),
    "z complex": (lambda f: f.update([1j, 0]), TypeError, "z must be .*, not of complex128"),
    "z bool": (lambda f: f.update([True, False]), TypeError, "z must be .*, not of bool"),
    "z str": (lambda f: f.update("12"), TypeError, "z must be .*, not of str"),
    "z with None": (lambda f: f.update([None, 1.0]), TypeError, "z must be .*, not of object"),
    "z dates": (
        lambda f: f.update(np.array(["2020-01-01", "2020-01-02"], "datetime64[D]")),
        TypeError,
        "z must be .*, not of datetime64",
    ),
    "station": (
        lambda f: f.update([1, 2], (0, 0)),
        TypeError,
        r"sensor must be an auvest\.MeasurementModel, not tuple",
    ),
    "sensor name": (
        lambda f: f.update([1, 2], "Sonar"),
        ValueError,
        "sensor must be 'RangeBearing', not 'Sonar'",
    ),
    "z masked": (
        lambda f: f.update(np.ma.masked_array([4.0, -0.8], [True, False])),
        TypeError,
        r"z must be .*, not a masked array; use z\.filled\(np\.nan\)",
    ),
    "place short": (
        lambda f: f.update([1, 2], place=[1.0]),
        ValueError,
        r"place has shape \(1,\), expected \(2,\)",
    ),
    "place NaN": (lambda f: f.update([1, 2], place=[1.0, NAN]), ValueError, r"place\[1\] is nan"),
    "place str": (
        lambda f: f.update([1, 2], place="xy"),
        TypeError,
        "place must be .*, not of str",
    ),
    "age negative": (
        lambda f: f.update([1, 2], age_s=-0.5),
        ValueError,
        r"age_s must not be negative, not -0\.5",
    ),
    "age NaN": (lambda f: f.update([1, 2], age_s=NAN), ValueError, "age_s must be finite, not nan"),
    "age str": (
        lambda f: f.update([1, 2], age_s="1"),
        TypeError,
        "age_s must be a number, not str",
    ),
    "input": (
        lambda f: f.predict(0.5, [1.0]),
        TypeError,
        "input must be None: ConstantAcceleration has no input",
    ),
    # run
    "run empty": (lambda f: f.run(np.zeros((0, 2)), dt=0.5), ValueError, r"z is empty: shape \(0"),
    "run empty list": (lambda f: f.run([], dt=0.5), ValueError, r"z has shape \(0,\), expected"),
    "run one row": (lambda f: f.run([1, 2], dt=0.5), ValueError, r"one row is z\[np\.newaxis\]"),
    "run wide": (lambda f: f.run(Z.T, dt=0.5), ValueError, r"z has shape \(2, 8\)"),
    "run 4-d": (lambda f: f.run(Z[None, None], dt=0.5), ValueError, r"z has shape \(1, 1, 8, 2\)"),
    "run half NaN": (
        lambda f: f.run(changed(Z, (3, 1), NAN), dt=0.5),
        ValueError,
        r"z\[3, 1\] is nan and the rest of the measurement is not",
    ),
    "run inf": (lambda f: f.run(changed(Z, (3, 1), INF), dt=0.5), ValueError, r"z\[3, 1\] is inf"),
    "run huge": (
        lambda f: f.run(HUGE, dt=0.5),
        ValueError,
        "z has 1000000000000 rows, at most 10000000 are taken at once; split the record",
    ),
    "run dt negative": (lambda f: f.run(Z, dt=-1), ValueError, "dt must not be negative"),
    "run dt column": (
        lambda f: f.run(Z, dt=np.ones((8, 1))),
        ValueError,
        r"dt has shape \(8, 1\), expected \(T,\)",
    ),
    "run dt length": (
        lambda f: f.run(Z, dt=np.ones(7)),
        ValueError,
        "dt has 7 rows and z has 8; they must have the same",
    ),
    "run dt NaN": (lambda f: f.run(Z, dt=changed(np.ones(8), 2, NAN)), ValueError, r"dt\[2\] is"),
    "run dt backwards": (
        lambda f: f.run(Z, dt=changed(np.ones(8), 5, -0.25)),
        ValueError,
        r"dt\[5\] must not be negative, not -0\.25",
    ),
    "run dt ragged": (
        lambda f: f.run(Z, dt=[0.5, [0.5]]),
        ValueError,
        r"dt must be an array of shape \(T,\), not rows of different lengths",
    ),
    "run dt complex": (lambda f: f.run(Z, dt=1j), TypeError, "dt must be a number, not complex"),
    "run station": (
        lambda f: f.run(Z, dt=0.5, sensor=1),
        TypeError,
        "sensor must be a name, a model or a sequence of these, one per row",
    ),
    "run sensor set": (
        lambda f: f.run(Z, dt=0.5, sensor={"RangeBearing"}),
        TypeError,
        "sensor must be a name, a model or a sequence of these, one per row",
    ),
    "run sensor numbers": (
        lambda f: f.run(Z, dt=0.5, sensor=["RangeBearing"] * 7 + [0]),
        TypeError,
        "sensor must be a name, a model or a sequence of these, one per row",
    ),
    "run sensor none": (
        lambda f: f.run(Z, dt=0.5, sensor=[]),
        TypeError,
        "sensor must be a name, a model or a sequence of these, one per row",
    ),
    "run sensor name": (
        lambda f: f.run(Z, dt=0.5, sensor=["RangeBearing"] * 7 + ["Sonar"]),
        ValueError,
        "sensor must be 'RangeBearing', not 'Sonar'",
    ),
    "run sensor length": (
        lambda f: f.run(Z, dt=0.5, sensor=["RangeBearing"] * 7),
        ValueError,
        "sensor has 7 rows and z has 8; they must have the same",
    ),
    "run input": (
        lambda f: f.run(Z, dt=0.5, input=np.ones((8, 1))),
        TypeError,
        "input must be None: ConstantAcceleration has no input",
    ),
    "run place shape": (
        lambda f: f.run(Z, dt=0.5, place=np.ones((8, 3))),
        ValueError,
        r"place has shape \(8, 3\), expected \(T, 2\)",
    ),
    "run place length": (
        lambda f: f.run(Z, dt=0.5, place=np.ones((7, 2))),
        ValueError,
        "place has 7 rows and z has 8; they must have the same",
    ),
    "run place half NaN": (
        lambda f: f.run(Z, dt=0.5, place=changed(np.ones((8, 2)), (3, 1), NAN)),
        ValueError,
        r"^place\[3, 1\] is nan and the rest of the place is not; a place that is missing is N",
    ),
    "run age length": (
        lambda f: f.run(Z, dt=0.5, age_s=np.zeros(7)),
        ValueError,
        "age_s has 7 rows and z has 8; they must have the same",
    ),
    "run age negative": (
        lambda f: f.run(Z, dt=0.5, age_s=changed(np.zeros(8), 5, -1.0)),
        ValueError,
        r"age_s\[5\] must not be negative, not -1\.0",
    ),
}

ADAPTIVE = {
    "reference shape": (
        lambda f: f.feedback([1, 2, 3]),
        ValueError,
        r"reference has shape \(3,\), expected \(2,\)",
    ),
    "reference NaN": (lambda f: f.feedback([NAN, NAN]), ValueError, r"reference\[0\] is nan"),
    "reference str": (lambda f: f.feedback("xy"), TypeError, "reference must be .*, not of str"),
    "run reference length": (
        lambda f: f.run(Z, reference=np.zeros((7, 2))),
        ValueError,
        "reference has 7 rows and z has 8; they must have the same",
    ),
    "run reference NaN": (
        lambda f: f.run(Z, reference=changed(Z, 1, NAN)),
        ValueError,
        r"reference\[1, 0\] is nan; all elements must be finite",
    ),
    "run reference wide": (
        lambda f: f.run(Z, reference=np.zeros((2, 8))),
        ValueError,
        r"reference has shape \(2, 8\), expected \(T, 2\)",
    ),
}


def require_refusal(f, call, error, message):
    f.predict(0.5)
    f.update([4.0, -0.8])
    before = everything(f)
    with pytest.raises(error, match=message):
        call(f)
    assert everything(f) == before
    assert f.status == auvest.Status.ok


@pytest.mark.parametrize("case", CALLS)
@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf, auvest.Aukf])
def test_calls(kind, case):
    require_refusal(make(kind, "float32"), *CALLS[case])


@pytest.mark.parametrize("case", ADAPTIVE)
def test_calls_of_the_adaptive_filter(case):
    require_refusal(make(auvest.Aukf, "float64"), *ADAPTIVE[case])


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_filters_without_an_interval_of_their_own_need_dt(kind):
    f = make(kind)
    before = everything(f)
    with pytest.raises(TypeError, match="dt must be a number"):
        f.predict(None)
    with pytest.raises(TypeError, match="dt must be a number or an array"):
        f.run(Z, dt=None)
    with pytest.raises(TypeError, match="dt must be a number"):
        f.predict()
    with pytest.raises(TypeError, match="dt must be a number or an array"):
        f.run(Z)
    with pytest.raises(TypeError, match="reference must be None: this filter has no interval"):
        f.run(Z, dt=0.5, reference=Z)
    with pytest.raises(AttributeError, match=r"feedback\(\) needs an interval policy; this filter"):
        f.feedback()
    assert everything(f) == before


def test_what_looks_odd_but_is_accepted():
    f = auvest.Ukf([0] * 6, np.eye(6, dtype=int), **PAPER, kappa=-5.9)
    f.predict(0)
    f.predict(np.float32(0.5))
    f.predict(np.array(0.5))
    f.update((4, 7))  # a bearing of more than a turn is wrapped
    g = auvest.Ukf([0.0] * 6, np.eye(6), **PAPER, kappa=-5.9)
    g.predict(0.5)
    g.predict(0.5)
    g.update([4.0, 7.0 - 2 * math.pi])
    assert f.x == pytest.approx(g.x, rel=1e-12)
    # An asymmetry of rounding is not refused.
    auvest.Ukf(X0, changed(P0, (0, 1), 1e-9), **PAPER)
