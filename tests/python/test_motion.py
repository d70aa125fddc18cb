"""The odometry of a log as segments: what was driven before the start, arcs, and what is kept."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from auvest.logs import CsvTable, LogError
from auvest.logs.write import write_file
from auvest.replay.config import OdometrySettings
from auvest.replay.motion import Compass, Motion, carry, dead_reckon, phi

SETTINGS = OdometrySettings()


def increments(
    folder: Path,
    rows: list[list[float]],
    start_s: float,
    settings: OdometrySettings = SETTINGS,
) -> Motion:
    """Lines ``[time, forward, left, turn]``."""
    time_s, forward, left, turn = np.array(rows).T
    write_file(folder, "odometry.csv", time_s=time_s, forward_m=forward, left_m=left, turn_rad=turn)
    return Motion(CsvTable(folder / "odometry.csv"), start_s, settings)


def velocities(
    folder: Path,
    rows: list[list[float]],
    start_s: float,
    settings: OdometrySettings = SETTINGS,
) -> Motion:
    """Lines ``[time, speed, yaw rate]``."""
    time_s, speed, rate = np.array(rows).T
    write_file(folder, "odometry.csv", time_s=time_s, speed_m_s=speed, yaw_rate_rad_s=rate)
    return Motion(CsvTable(folder / "odometry.csv"), start_s, settings)


def place(motion: Motion, start_s: float, time_s: float) -> complex:
    """Where a craft stands that starts at the origin towards +x."""
    segments = motion.until(time_s)
    inner = segments.edges[(segments.edges > start_s) & (segments.edges < time_s)]
    bounds = np.unique(np.concatenate([[start_s], inner, [time_s]]))
    chord, turn = segments.steps(bounds[:-1], np.diff(bounds))
    x, y, _ = dead_reckon(np.zeros((1, 3)), chord, turn)[-1].tolist()
    return complex(x, y)


def test_increments_that_end_at_the_start_or_before_have_been_driven(tmp_path: Path) -> None:
    rows = [[0.5, 100, 0, 0], [1.0, 10, 0, 0], [2.0, 1, 0, 0], [3.0, 0, 2, 0]]
    motion = increments(tmp_path, rows, start_s=1.0)
    motion.add(np.array(rows[:1]))  # nothing of it is left
    assert motion.known_until == 1.0
    motion.add(np.array(rows[1:]))
    assert motion.edges.tolist() == [1.0, 2.0, 3.0]
    assert place(motion, 1.0, 2.0) == pytest.approx(1.0)
    assert place(motion, 1.0, 3.0) == pytest.approx(1 + 2j)


def test_calibration_scales_speed_and_turn_and_adds_the_drift_of_the_gyroscope(
    tmp_path: Path,
) -> None:
    """2 s at 3 m/s and 0.25 rad/s as recorded, whichever way it was."""
    settings = OdometrySettings(speed_factor=2.0, turn_factor=3.0, turn_offset_rad_s=0.125)
    driven = increments(tmp_path, [[1.0, 0, 0, 0], [3.0, 6.0, 0.5, 0.5]], 1.0, settings)
    driven.add(np.array([[1.0, 0, 0, 0], [3.0, 6.0, 0.5, 0.5]]))
    chord, turn = driven.until(3.0).steps(np.array([1.0]), np.array([2.0]))
    assert turn == pytest.approx([3.0 * 0.5 + 0.125 * 2])
    assert chord == pytest.approx([2.0 * (6 + 0.5j)])  # an increment is a chord
    held = velocities(tmp_path, [[1.0, 3.0, 0.25], [3.0, 0, 0]], 1.0, settings)
    held.add(np.array([[1.0, 3.0, 0.25], [3.0, 0, 0]]))
    chord, turn = held.until(3.0).steps(np.array([1.0]), np.array([2.0]))
    assert turn == pytest.approx([(3.0 * 0.25 + 0.125) * 2])
    assert np.abs(chord) == pytest.approx(2.0 * 3.0 * 2 * np.sin(turn / 2) / (turn / 2))


def test_an_increment_that_straddles_the_start_is_all_driven_after_it(tmp_path: Path) -> None:
    """It is the motion since the start: the log begins there."""
    rows = [[2.0, 4.0, 0.0, 0.0]]
    motion = increments(tmp_path, rows, start_s=1.0)
    motion.add(np.array(rows))
    assert place(motion, 1.0, 1.25) == pytest.approx(1.0)


def test_two_increments_at_one_time_are_refused_once_the_run_is_on(tmp_path: Path) -> None:
    rows = [[2.0, 1.0, 0.0, 0.0]]
    motion = increments(tmp_path, rows, start_s=1.0)
    motion.add(np.array(rows))
    with pytest.raises(LogError, match=r"two increments end at 2 s") as caught:
        motion.add(np.array(rows))  # the first of another chunk
    assert caught.value.column == "time_s"


def test_what_the_compass_does_not_reach_yet_waits_with_its_own_time():
    """Increments of 1, 2, 4 and 8 m; headings of 0.1 rad/s, first to 1.5 s, then to 3 s."""
    compass = Compass(10.0, increments=True)
    time, moved = np.arange(4.0), 2.0 ** np.arange(4) + 0j
    early, late = ([[t, 0.1 * t] for t in times] for times in ((0.0, 1.5), (3.0,)))
    done = compass.joined(time, moved, np.array(early), last=False)
    rest = compass.joined(np.empty(0), np.empty(0, complex), np.array(late), last=True)
    for found, expected in ((done, slice(0, 2)), (rest, slice(2, 4))):
        assert found[0].tolist() == time[expected].tolist()
        assert found[1].tolist() == moved[expected].tolist()
        assert found[2] == pytest.approx(0.1 * time[expected], abs=1e-15)


@pytest.mark.parametrize("lines", [1, 2, 3])
def test_the_last_velocity_before_the_start_holds_there(tmp_path: Path, lines: int) -> None:
    """9 m/s, then 2 m/s with 0.5 rad/s; the start; from 3 s on 1 m/s straight on."""
    rows = [[-2.0, 9.0, 0.0], [-1.0, 2.0, 0.5], [3.0, 1.0, 0.0]]
    motion = velocities(tmp_path, rows, start_s=0.0)
    for first in range(0, len(rows), lines):
        motion.add(np.array(rows[first : first + lines]))
    assert motion.edges.tolist() == [0.0, 0.0, 0.0, 3.0]  # nothing lies before the start
    radius = 4.0  # 2 m/s over 0.5 rad/s
    at_2_s = radius * (math.sin(1.0) + 1j * (1 - math.cos(1.0)))
    assert place(motion, 0.0, 2.0) == pytest.approx(at_2_s, rel=1e-12)
    at_3_s = radius * (math.sin(1.5) + 1j * (1 - math.cos(1.5)))
    assert place(motion, 0.0, 5.0) == pytest.approx(at_3_s + 2 * np.exp(1.5j), rel=1e-12)


def test_before_its_first_velocity_the_craft_stands(tmp_path: Path) -> None:
    rows = [[2.0, 3.0, 0.5]]
    motion = velocities(tmp_path, rows, start_s=1.0)
    motion.add(np.array(rows))
    assert place(motion, 1.0, 2.0) == 0.0
    # 2 s of 3 m/s and 0.5 rad/s: a radian of a circle of 6 m.
    arc = 6 * (math.sin(1.0) + 1j * (1 - math.cos(1.0)))
    assert place(motion, 1.0, 4.0) == pytest.approx(arc, rel=1e-12)


def test_phi_is_the_chord_of_the_unit_arc() -> None:
    """A half circle of length 1 has a diameter of 2 / pi, to the left of where it began."""
    assert phi(np.array([0.0]))[0] == 1.0
    assert phi(np.array([math.pi]))[0] == pytest.approx(2j / math.pi, abs=1e-15)
    quarter = 2 / math.pi * (1 - 1j)
    assert phi(np.array([-math.pi / 2]))[0] == pytest.approx(quarter, abs=1e-15)


def test_what_ended_is_forgotten_and_what_holds_is_kept(tmp_path: Path) -> None:
    rows = [[float(k), float(k), 0.0, 0.0] for k in (1, 2, 3)]
    motion = increments(tmp_path, rows, start_s=0.0)
    motion.add(np.array(rows))
    motion.forget(1.5)
    assert motion.edges.tolist() == [1.0, 2.0, 3.0]
    assert place(motion, 1.0, 3.0) == pytest.approx(5.0)
    motion.forget(2.0)
    assert motion.edges.tolist() == [2.0, 3.0]
    motion.forget(9.0)  # the end of the last increment is where the next begins
    assert motion.edges.tolist() == [3.0]
    motion.add(np.array([[4.0, 7.0, 0.0, 0.0]]))
    assert place(motion, 3.0, 4.0) == pytest.approx(7.0)


def test_carry_goes_on_from_the_last_pose_before(tmp_path: Path) -> None:
    """2 m/s; poses at 1 s (heading +y) and at 2 s (heading -x)."""
    rows = [[0.0, 2.0, 0.0]]
    motion = velocities(tmp_path, rows, start_s=0.0)
    motion.add(np.array(rows))
    poses = np.array([[10.0, 0.0, math.pi / 2], [20.0, 0.0, math.pi]])
    asked = np.array([1.0, 1.75, 2.0, 2.5])
    went = carry(motion.until(3.0), poses, np.array([1.0, 2.0]), asked)
    np.testing.assert_allclose(went, [[10, 0], [10, 1.5], [20, 0], [19, 0]], atol=1e-12)
