"""The sketch tracking_loop on the simulated board, and what it must compute, on the desk.

A test file takes the fixtures with ``pytest_plugins = ["closed_loop_support"]``.
"""

import contextlib
import copy
import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pytest

from auvest import Aukf, ConstantAcceleration, FilterError, RangeBearing, telemetry
from auvest.board import PinChange, Report, SerialLine
from auvest.commands.capture import TRIGGER_PIN
from auvest.simulation.tracking import Track

pytest_plugins = ["board_support"]

TICKS_PER_S = 250_000
IMPLAUSIBLE = 14  # of Status in auvest/status.hpp
START = ("x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2")


@dataclass
class Run:
    """What the sketch did: its lines as rows, when it triggered, what the simulator counted."""

    rows: list = field(default_factory=list)
    triggers_s: list = field(default_factory=list)
    comments: list = field(default_factory=list)
    report: Report | None = None

    def column(self, name):
        return np.array([row[name] for row in self.rows])

    @property
    def measured(self):
        return np.isfinite(self.column("range_m"))

    @property
    def moments_s(self):
        """When it triggered each sample that it reported, from the first on."""
        triggers = np.array(self.triggers_s[: len(self.rows)])
        return triggers - triggers[0]


@pytest.fixture(scope="session")
def build_loop(build_edited):
    """Return a function that compiles tracking_loop, edited as a user would."""
    return partial(build_edited, "tracking_loop")


@pytest.fixture
def play(board):
    """Return a function that runs tracking_loop with a sonar for a number of samples.

    ``sonar(sample, true_range, true_bearing)`` gives the answers to a request: pairs of the delay
    after it (s) and the text.
    """

    def play(elf, sonar, samples=60):
        track, run, reader = Track(kind="straight"), Run(), telemetry.Reader()
        station = RangeBearing().station
        with board(elf, watch=[TRIGGER_PIN], limit_s=2.0 * samples) as running:
            for event in running:
                if isinstance(event, PinChange):
                    if event.level:
                        run.triggers_s.append(event.time_s)
                    continue
                assert isinstance(event, SerialLine), event
                sample = telemetry.requested_sample(event.text)
                if sample is None:
                    row = reader.read(event.text)
                    if not isinstance(row, dict):
                        run.comments.append((event.time_s, event.text))
                    else:
                        run.rows.append(row)
                    if len(run.rows) == samples:
                        break
                    continue
                assert sample == len(run.triggers_s), "one request for each trigger"
                x, y = track.position_at(0.5 + run.triggers_s[-1] - run.triggers_s[0])
                dx, dy = x - station[0], y - station[1]
                for delay_s, text in sonar(sample, math.hypot(dx, dy), math.atan2(dy, dx)):
                    running.send(text, delay_s)
        run.report = running.report
        return run

    return play


@pytest.fixture
def on_the_desk():
    """Return a function that computes in Python, float32, what the sketch reported.

    Only measurements and commanded or measured times come from the sketch; the rest must follow.
    """

    def on_the_desk(run, policy):
        sigma = np.repeat(np.float32([0.05, 0.02, 0.005]), 2)
        filter_ = Aukf(
            np.float32([0.2, 2.0, 0.1, 0.2, 0.01, 0.02]),
            np.diag(sigma * sigma),
            process=ConstantAcceleration(discretisation="euler"),
            sensors=RangeBearing(largest_range_m=75.0),
            policy=policy,
            alpha=np.float32(1e-6),
            dtype="float32",
        )
        rows, ticks, late = [], 0, 0
        taken_m, taken_s = 0.0, -math.inf
        for k, row in enumerate(run.rows):
            due = round_to_ticks(filter_.interval)
            now = round(row["time_s"] * TICKS_PER_S)
            if row["late"] == late:
                assert now - ticks == due, f"sample {k + 1} is at its deadline"
                dt = filter_.interval
            else:
                assert now - ticks > due, f"sample {k + 1} is late"
                dt = float(np.float32(now - ticks) * np.float32(1 / TICKS_PER_S))
            ticks, late = now, row["late"]
            filter_.predict(dt)
            nis, status = math.nan, 0
            if math.isfinite(row["range_m"]):
                z = row["range_m"], row["bearing_rad"]
                corrected = copy.copy(filter_)
                with contextlib.suppress(FilterError):
                    corrected.update(z)
                    nis = corrected.nis
                status = int(corrected.status)
                reach = 2.0 + 10.0 * (row["time_s"] - taken_s)
                jumped = abs(z[0] - taken_m) > reach or abs(z[1]) > 6.2842
                if status == 0 and (jumped or nis > 13.8):
                    status, nis = IMPLAUSIBLE, math.nan if jumped else nis
                if status == 0:
                    filter_, taken_m, taken_s = corrected, z[0], row["time_s"]
            position = desired(ticks)
            filter_.feedback(position)
            expected = {
                "time_s": ticks / TICKS_PER_S,
                "dt_s": dt,
                "desired_x_m": float(position[0]),
                "desired_y_m": float(position[1]),
                **dict(zip(START, filter_.x.tolist(), strict=True)),
                "nis": nis,
                "status": status,
                "interval_s": filter_.interval,
            }
            for name in row:
                if name.startswith("P"):
                    expected[name] = float(filter_.P[int(name[1]), int(name[2])])
            rows.append(expected)
        return rows

    return on_the_desk


def round_to_ticks(interval_s):
    """Turn an interval into ticks as the sketch does, in float."""
    return int(np.float32(interval_s) * np.float32(TICKS_PER_S) + np.float32(0.5))


def desired(ticks):
    """Compute the desired position as the sketch does, in float."""
    seconds, rest = divmod(ticks, TICKS_PER_S)
    t = np.float32(seconds) + np.float32(rest) * np.float32(1 / TICKS_PER_S)
    start, velocity = np.float32([0.2, 2.0]), np.float32([0.1, 0.2])
    acceleration = np.float32([0.01, 0.02])
    return start + t * (velocity + np.float32(0.5) * acceleration * t)
