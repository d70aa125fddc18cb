"""`auvest hil` on the simulated MEGA2560, on a Cortex-M in QEMU, and over a line to the board."""

import numpy as np
import pytest

import auvest
from auvest.firmware import hil, hil_serial
from auvest.firmware.hil_bench import bench
from auvest.firmware.hil_record import Record
from firmware import hil_line

pytest_plugins = ["board_support"]

ROWS = 40
FIELDS = 1 + 3 + 6 + 1 + 2  # status, x, P, NIS, weights


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Programs; Arduino's core among them is compiled once."""
    return tmp_path_factory.mktemp("hil")


@pytest.fixture
def _board(runner, monkeypatch):
    monkeypatch.setenv("AUVEST_BOARD", str(runner))


@pytest.fixture(scope="module")
def record():
    """A leader that moves and a station in turn, a row in five without either, an outlier."""
    process = auvest.SpeedHeading(heading_bias=True)
    leader = auvest.LeaderRange(sigma_range_m=0.3)
    sensors = (leader, auvest.RangeBearing(sigma_range_m=0.5))
    random = np.random.default_rng(4)
    truth = np.array([5.0, -3.0, 0.02])
    filter_ = auvest.RobustUkf(
        truth, 0.04 * np.eye(3), process=process, sensors=sensors,
        kernel="igg", dtype="float32",
    )  # fmt: skip
    sensor = np.arange(ROWS) % 2
    dt = np.full(ROWS, 0.5)
    driven = np.column_stack([np.full(ROWS, 1.5), np.zeros(ROWS), 0.1 * np.arange(ROWS)])
    z, place = np.full((ROWS, 2), np.nan), np.full((ROWS, 2), np.nan)
    for k in range(ROWS):
        truth = process.f(truth, dt[k], driven[k])
        if sensor[k] == 0:
            place[k] = 40.0 - k, 10.0 + 0.3 * k
            model = auvest.LeaderRange(leader=tuple(place[k]))
        else:
            model = sensors[1]
        if k % 5 != 4:
            sizes = len(model.measures)
            z[k, :sizes] = model.h(truth) + [0.2, 0.01][:sizes] * random.standard_normal(sizes)
    z[20, 0] += 30.0
    columns = (np.asarray(column, np.float32) for column in (dt, z, driven, place))
    return Record(filter_, sensors, sensor, *columns)


def test_the_record_asks_for_all_that_is_compared(record):
    desk = record.on_desk()
    decisions = {int(word) >> 8 & 0xFF for word in desk[:, 0]}
    assert {int(auvest.Decision.accepted), int(auvest.Decision.rejected)} <= decisions
    assert (desk[:, 0] & 0xFF == 0).all()


@pytest.mark.usefixtures("_board")
def test_the_simulated_mega_keeps_every_bit_and_says_what_it_takes(record, folder):
    leg = hil.run(record, "atmega2560", folder)
    assert leg.difference is None
    assert leg.words.shape == (ROWS + 1, FIELDS)
    figures = leg.figures
    assert figures["cycles_min"] < figures["cycles_median"] <= figures["cycles_max"]
    assert 5_000 < figures["flash_bytes"] < 60_000
    # Its own clock counts in 4 us, and in the interrupts that keep it.
    slowest_us = figures["cycles_max"] / 16
    assert leg.microseconds.max() == pytest.approx(slowest_us, rel=0.02, abs=8)
    share = leg.awake_share(record)
    assert share == pytest.approx(leg.microseconds[1:].sum() * 1e-6 / (0.5 * ROWS))


@pytest.fixture(scope="module")
def lost():
    """A craft that knows its place to 10 km: a ring, then one place; then all is 900 m off.

    Three stations in turn, a craft almost at rest. One range in seven comes a row late.
    """
    sensor = auvest.LeaderRange()
    filter_ = auvest.RobustEkf(
        [12.0, 9.0], 1e8 * np.eye(2), process=auvest.SpeedHeading(), sensors=sensor,
        kernel="igg", components=16, late_s=6.0, dtype="float32",
    )  # fmt: skip
    late = np.arange(40) % 7 == 3
    taken = np.arange(40) - late
    stations = np.array([(0.0, 0.0), (120.0, 0.0), (60.0, 90.0)])[taken % 3]
    at = np.array([46.0, 53.0]) + taken[:, None] * [0.38, 0.32]
    z = np.linalg.norm(at - stations, axis=1)[:, None]
    shift = np.where(taken < 16, 0.0, 900.0)[:, None] * [1.0, 0.0]
    columns = (np.full(40, 5.0), z, np.tile([0.1, 0.0, 0.7], (40, 1)), stations - shift, 5.0 * late)
    kept = (np.asarray(column, np.float32) for column in columns)
    return Record(filter_, (sensor,), np.zeros(40, int), *kept)


def test_the_start_that_is_not_known_becomes_a_place_twice(lost):
    desk = dict(zip(lost.fields, lost.on_desk().T.view(np.float32), strict=True))
    components, says = desk["components"], desk["convergence"]
    x = np.column_stack([desk["x[x_m]"], desk["x[y_m]"]])
    k = np.arange(-1, 40)[:, None]
    truth = np.array([46.0, 53.0]) + k * [0.38, 0.32] - np.where(k < 16, 0.0, [900.0, 0.0])
    error = np.linalg.norm(x - truth, axis=1)
    settled = int(auvest.Convergence.settled)
    assert components[1] == 16
    assert (components[8:17] == 1).all()
    assert error[16] < 0.2
    assert says[16] == settled
    assert (components[17:31] > 8).any()  # a ring after the recovery
    assert error[-1] < 0.2
    assert says[-1] == settled


@pytest.mark.usefixtures("_board")
def test_the_simulated_mega_finds_its_place_with_the_bits_of_the_desk(lost, folder):
    leg = hil.run(lost, "atmega2560", folder)
    assert leg.difference is None
    assert leg.words.shape == (41, 1 + 2 + 3 + 1 + 1 + 2)


def test_cortex_m_keeps_every_bit(record, folder):
    leg = hil.run(record, "cortex-m4f", folder)
    assert leg.difference is None
    assert leg.words.shape == (ROWS + 1, FIELDS)
    assert leg.microseconds is None


@pytest.mark.usefixtures("_board")
def test_the_board_keeps_every_bit_over_a_line_that_damages_frames(record, folder, monkeypatch):
    monkeypatch.setattr(hil_serial, "PATIENCE_S", 0.5)
    noise = hil_line.Noise(0.1, seed=2)
    with hil_line.behind_a_port("atmega2560-uart", bench(record), folder, noise) as line:
        leg = hil.run(record, f"serial:{line.port}", folder)
    assert leg.difference is None
    assert noise.damaged >= 5
    assert leg.figures["repeated_rows"] >= 2
    assert leg.microseconds.max() > 1000
