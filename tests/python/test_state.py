"""Save and restore, pickle and copy: the filter goes on with the same bits."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest
from filter_support import DTYPES, PAPER, everything, make, measure, same_bits, straight

import auvest
from auvest import _state

LAWS = (
    None,
    auvest.MahalanobisInterval("table1", tau0=0.3),
    auvest.CovarianceBudget(position_sigma_m=0.2),
    auvest.FixedInterval(interval_s=0.4),
)
KINDS = [(auvest.Ekf, None), (auvest.Ukf, None), *((auvest.Aukf, law) for law in LAWS[1:])]
Z = measure(straight(40))


def build(kind, law, dtype):
    options = {} if law is None else {"policy": law}
    if kind is not auvest.Ekf:
        options["alpha"] = 1e-3
    return make(
        kind,
        dtype,
        process=auvest.ConstantAcceleration(discretisation="euler", velocity_psd=1e-3),
        sensors=auvest.RangeBearing(station=(0.1, 1.9), sigma_range_m=0.07),
        **options,
    )


def drive(f, z):
    """Goes on for the rows of z; all that was seen on the way."""
    seen = []
    for row in z:
        if isinstance(f, auvest.Aukf):
            f.predict()
            f.update(row)
            f.feedback(row)
        else:
            f.predict(0.5)
            f.update(row)
        seen.append(everything(f))
    return seen


def by_save(f, kind, law, dtype):
    other = build(kind, law, dtype)
    drive(other, Z[:3])  # a state of its own, to be replaced
    other.restore(f.save())
    return other


WAYS = {
    "save": by_save,
    "pickle": lambda f, *_: pickle.loads(pickle.dumps(f)),
    "deepcopy": lambda f, *_: copy.deepcopy(f),
    "copy": lambda f, *_: copy.copy(f),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize(("kind", "law"), KINDS)
def test_goes_on_with_the_same_bits(kind, law, dtype, way):
    f = build(kind, law, dtype)
    drive(f, Z[:20])
    twin = WAYS[way](f, kind, law, dtype)
    assert everything(twin) == everything(f)
    expected = drive(f, Z[20:])
    assert drive(twin, Z[20:]) == expected
    assert expected[0] != expected[-1]
    assert (twin.process, twin.sensors, twin.dtype) == (f.process, f.sensors, f.dtype)


def test_copies_are_independent():
    f = build(auvest.Aukf, LAWS[1], "float32")
    drive(f, Z[:5])
    before = everything(f)
    drive(copy.deepcopy(f), Z[5:])
    drive(copy.copy(f), Z[5:])
    assert everything(f) == before


@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_what_drives_the_process_is_part_of_the_state(kind):
    """An interval policy predicts with it: Q of a slave that sails is not that of one at rest."""
    options = {
        "process": auvest.SpeedHeading(sigma_forward=0.1, sigma_heading=0.1),
        "sensors": auvest.LeaderRange(),
        "policy": auvest.CovarianceBudget(position_sigma_m=0.3, min_s=0.1, initial_s=1.0, max_s=4),
    }
    f, other, at_rest = (kind([0.0, 0.0], 0.01 * np.eye(2), **options) for _ in range(3))
    f.predict(0.0, [2.0, 0.0, 0.5])
    other.restore(f.save())
    copied = copy.copy(f)
    # 0.02 + dt (0.1^2 + 0.1^2 2^2) = 0.3^2, and at rest 0.02 + dt 0.1^2, which 4 s do not reach.
    assert f.feedback() == pytest.approx(1.4, abs=3.9 / 1024)
    assert at_rest.feedback() == 4
    assert other.feedback() == copied.feedback() == f.interval


def test_a_fresh_filter_can_be_saved():
    f = make(auvest.Ukf)
    twin = pickle.loads(pickle.dumps(f))
    assert everything(twin) == everything(f)
    assert np.isnan(twin.nis)


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_near_field_flag_is_part_of_the_state(dtype):
    f = auvest.Ukf([0.2, 2.0, 0, 0, 0, 0], np.eye(6), **PAPER, dtype=dtype)
    f.update([0.3, 1.0])
    assert f.near_field
    assert everything(pickle.loads(pickle.dumps(f))) == everything(f)


def test_status_survives_a_pickle_and_an_error_does_too():
    f = make(auvest.Ukf, "float32")
    with pytest.raises(auvest.FilterError) as caught:
        f.run([[4.0, -0.8], [1e30, 0.0]], dt=0.5)
    assert pickle.loads(pickle.dumps(f)).status == auvest.Status.overflow
    error = pickle.loads(pickle.dumps(caught.value))
    assert str(error) == str(caught.value)
    assert (error.step, error.status) == (1, auvest.Status.overflow)
    assert same_bits(error.partial.P, caught.value.partial.P)


def test_one_number_in_place_of_rows_is_refused_by_name():
    f = make(auvest.Ukf)
    before, description = f.save(), f._description()
    arrays = _state.unpack(before, "Ukf", description)
    for name, array in arrays.items():
        shape = (1,) if array.ndim == 0 else ()
        other = {**arrays, name: np.zeros(shape, array.dtype)}
        with pytest.raises(ValueError, match=f"^state is damaged: {name} has the shape"):
            f.restore(_state.pack("Ukf", description, other))
        assert f.save() == before


def test_a_remembered_measurement_of_a_sensor_that_does_not_fit_is_refused():
    """A depth is no number of a state that ends with a heading."""
    sensor = auvest.LeaderRange(leader=(5, 0))
    f = auvest.Ekf(np.zeros(3), np.eye(3), process=auvest.Odometry(), sensors=sensor, late_s=9)
    f.predict(1.0, [1, 0, 0])
    f.update([4.0])
    before, description = f.save(), f._description()
    arrays = _state.unpack(before, "Ekf", description)
    depth = json.dumps([_state.describe(auvest.Depth())]).encode()
    arrays["event_models"] = np.frombuffer(depth, np.uint8)
    with pytest.raises(
        ValueError, match="models cannot be made: Depth observes x_m, y_m, z_m, but"
    ):
        f.restore(_state.pack("Ekf", description, arrays))
    assert f.save() == before


FOREIGN = {
    "not bytes": (lambda: [1, 2], TypeError, "state must be bytes from save"),
    "empty": (lambda: b"", ValueError, "^state is cut short: it has 0 bytes, a state at least 28$"),
    "cut": (lambda: b"auvest\r\n", ValueError, "^state is cut short: it has 8 bytes, a state at"),
    "text": (
        lambda: b"a" * 30,
        ValueError,
        "^state is not from save.*begins with b'aaaaaaaa', exp",
    ),
    "class": (lambda: make(auvest.Ekf, "float32").save(), ValueError, "class Ekf, expected Ukf"),
    "precision": (
        lambda: make(auvest.Ukf).save(),
        ValueError,
        "dtype is 'float64', expected 'float32'",
    ),
    "parameter": (
        lambda: make(auvest.Ukf, "float32", alpha=0.5).save(),
        ValueError,
        "alpha is 0.5, expected 1.0",
    ),
    "process": (
        lambda: make(
            auvest.Ukf, "float32", process=auvest.ConstantAcceleration(velocity_psd=1.0)
        ).save(),
        ValueError,
        "process.velocity_psd is 1.0, expected 0.0001",
    ),
    "sensor": (
        lambda: make(auvest.Ukf, "float32", sensors=auvest.RangeBearing(station=(1.0, 2.0))).save(),
        ValueError,
        "sensors.RangeBearing.station is",
    ),
    "kernel": (
        lambda: make(auvest.Ukf, "float32", kernel="igg").save(),
        ValueError,
        "kernel is Igg, expected None",
    ),
    "damaged": (
        lambda: make(auvest.Ukf, "float32").save()[:-5] + bytes(5),
        ValueError,
        "state is damaged: its CRC-32",
    ),
}


@pytest.mark.parametrize("case", FOREIGN)
def test_a_wrong_state_is_refused_and_changes_nothing(case):
    state, error, message = FOREIGN[case]
    f = make(auvest.Ukf, "float32")
    f.update([4.0, -0.8])
    before = everything(f)
    with pytest.raises(error, match=message):
        f.restore(state())
    assert everything(f) == before
