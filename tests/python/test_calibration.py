"""Noises from logs alone: what is found, from where, and what the command writes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_check import arc
from typer.testing import CliRunner

from auvest.cli import app
from auvest.logs import LogFolder
from auvest.logs.reading import FileReading
from auvest.logs.write import write_file
from auvest.montecarlo import Store
from auvest.replay import Settings, calibration, find_settings, read_settings, settings_from
from auvest.replay.calibration import (
    Noise,
    autocorrelation_time,
    calibrate,
    noises_of,
    with_noises,
)
from auvest.replay.config import packaged_settings
from auvest.replay.toml import settings_text

BEACONS = {1: (-60.0, 80.0), 2: (60.0, -80.0), 3: (-70.0, -50.0)}
#: What the simulated log is made with.
SIGMA_M, DRIFT = 0.5, 0.2


def drifting(folder: Path) -> LogFolder:
    """300 s at 1 m/s among three beacons, whose positions drift off the odometry, and no truth."""
    random = np.random.default_rng(5)
    time = np.arange(1.0, 301.0)
    heading = 0.02 * time
    still = np.zeros(len(time))
    steps = np.column_stack([np.cos(heading - 0.02), np.sin(heading - 0.02)])
    place = np.cumsum(steps + random.normal(0, DRIFT, steps.shape), axis=0)
    write_file(folder, "odometry.csv", time_s=time, forward_m=still + 1, left_m=still,
               turn_rad=still + 0.02)  # fmt: skip
    source = 1 + np.arange(len(time)) % 3
    beacons = np.array([BEACONS[one] for one in source])
    ranges = np.hypot(*(place - beacons).T) + random.normal(0, SIGMA_M, len(time))
    write_file(folder, "ranges.csv", time_s=time, source=source, range_m=ranges)
    x, y = zip(*BEACONS.values(), strict=True)
    write_file(folder, "beacons.csv", source=list(BEACONS), x_m=x, y_m=y)
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    return LogFolder(folder)


@pytest.mark.parametrize("times", [0.1, 10.0])
def test_the_noises_of_a_log_are_found(tmp_path: Path, times: float) -> None:
    log = drifting(tmp_path)
    wrong = settings_from(
        {
            "start": {"sigma_heading_rad": 0.001},
            "odometry": {"sigma_distance": 0, "sigma_drift": times * DRIFT, "sigma_turn": 1e-5},
            "ranges": {"sigma_m": times * SIGMA_M},
        }
    )
    found = calibrate([log], wrong)
    likeliest = {one.name: one.likeliest for one in found.noises}
    # A spread from n numbers is known to 1 / sqrt(2 n), 4 %; both noises share what 300 ranges say.
    assert likeliest["ranges.sigma_m"] == pytest.approx(SIGMA_M, rel=0.2)
    assert likeliest["odometry.sigma_drift"] == pytest.approx(DRIFT, rel=0.3)
    assert "odometry.sigma_distance" not in likeliest
    # Innovations of a filter that knows its noises are independent of each other; what 300 of them
    # do not refuse is then a factor of 1 + sqrt(1.92 / 300).
    assert found.correlation < 1.6
    assert 1.04 < found.raised < 1.13
    for one in found.noises:
        raised = with_noises(wrong, noises_of(log, wrong), [one.value for one in found.noises])
        assert found.settings == raised
        assert one.value == pytest.approx(found.raised * one.likeliest, rel=0.01)
    ranges = next(one for one in found.noises if one.name == "ranges.sigma_m")
    assert ranges.low is not None
    assert ranges.high is not None
    assert ranges.low < SIGMA_M < ranges.high
    assert max(value for _, value in ranges.profile) == 0.0
    # A noise that the log knows nothing of stays where it was, and is said not to be told.
    turn = next(one for one in found.noises if one.name == "odometry.sigma_turn")
    assert turn.low is None


def rows(*series: np.ndarray) -> dict[str, np.ndarray]:
    """Innovations of one source after the other, of sigma 1."""
    whole = np.concatenate(series)
    none = np.full(len(whole), math.nan)
    return {
        "source": np.repeat(np.arange(len(series)), [len(one) for one in series]),
        "sensor": np.full(len(whole), "range"),
        "innovation_0": whole, "innovation_1": none, "innovation_2": none,
        "sigma_0": np.ones(len(whole)), "sigma_1": none, "sigma_2": none,
    }  # fmt: skip


def test_the_autocorrelation_time_is_that_of_the_process() -> None:
    random = np.random.default_rng(1)
    white = random.normal(0, 0.5, 20_000)
    red = np.zeros(20_000)
    for k in range(1, len(red)):
        red[k] = 0.6 * red[k - 1] + white[k]
    # Of a first order process (1 + rho) / (1 - rho), of white noise 1.
    assert autocorrelation_time([rows(red)]) == pytest.approx(1.6 / 0.4, rel=0.1)
    assert autocorrelation_time([rows(white)]) == pytest.approx(1.0, abs=0.1)
    # Offsets of two sources, one up and one down: only source by source do they show.
    up, down = random.normal(0.5, 0.1, (2, 50))
    assert autocorrelation_time([rows(up, -down)]) > 20
    # Each log by itself: what one ends with has nothing to do with what the next begins with.
    assert autocorrelation_time([rows(np.ones(1)), rows(-np.ones(1))]) == 1.0


def test_which_noises_a_log_tells(tmp_path: Path) -> None:
    settings = settings_from({"odometry": {"sigma_turned": 0.1}})
    log = arc(tmp_path / "arc")
    own = ["odometry.sigma_distance", "odometry.sigma_drift", "odometry.sigma_turn"]
    named = [one.name for one in noises_of(LogFolder(log), settings)]
    assert named == [*own, "odometry.sigma_turned", "ranges.sigma_m"]
    one = tmp_path / "tracked"
    write_file(one, "beacons.csv", source=[0], x_m=[0.0], y_m=[0.0])
    write_file(one, "fixes.csv", time_s=[0.0], source=[0], range_m=[1.0], bearing_rad=[0.0])
    write_file(one, "positions.csv", time_s=[0.0], x_m=[1.0], y_m=[0.0], sigma_m=[2.0])
    named = [one.name for one in noises_of(LogFolder(one), Settings())]
    fixes = ["fixes.sigma_range_m", "fixes.sigma_bearing_rad"]
    # position_psd is 0 by default, and positions say their sigmas themselves.
    assert named == ["process.velocity_psd", "process.acceleration_psd", *fixes]


def test_how_far_a_noise_is_told() -> None:
    # A parabola in the logarithm, looked at where it has fallen by 1 and by 4: 2.25 are at 1.5.
    falling = [(math.exp(k), -float(k * k)) for k in range(-2, 3)]
    low, high = calibration._told(falling, 2.25)
    assert low == pytest.approx(math.exp(-1.5))
    assert high == pytest.approx(math.exp(1.5))
    # Flat below: not told there. A place that is a little better than the one found is no matter.
    flat = [(0.1, -0.2), (0.5, 0.3), (1.0, 0.0), (2.0, 0.1), (8.0, -4.0)]
    low, high = calibration._told(flat, 1.0)
    assert low is None
    assert high == pytest.approx(2.0 * 4**0.5)
    # A filter that cannot go there refuses it.
    assert calibration._told([(0.5, -math.inf), (1.0, 0.0)], 1.0) == (0.5, None)


def test_a_source_keeps_its_ratio() -> None:
    settings = settings_from({"ranges": {"sigma_m": 2.0, "sources": {"7": {"sigma_m": 3.0}}}})
    changed = with_noises(settings, [Noise("ranges", "sigma_m")], [0.5])
    assert changed.ranges.sigma_m == 0.5
    assert changed.ranges.sources[7].sigma_m == 0.75


def test_what_cannot_be_calibrated(tmp_path: Path) -> None:
    log = LogFolder(arc(tmp_path))
    with pytest.raises(ValueError, match="chooses its fixes by the noises"):
        calibrate([log], Settings(), filter_name="aukf")
    with pytest.raises(ValueError, match="outliers must be above 0"):
        calibrate([log], Settings(), outliers=0.0)
    with pytest.raises(ValueError, match="too few to calibrate by"):
        calibrate([LogFolder(arc(tmp_path / "short", seconds=20))], Settings())


@pytest.mark.parametrize("name", ["", *packaged_settings()])
def test_settings_are_written_as_they_are_read(tmp_path: Path, name: str) -> None:
    settings = find_settings(name)
    reading = FileReading(file="a.csv", separator=";", columns={"time_s": "t"}, where="")
    own = settings_from({"ranges": {"sources": {"7": {"latency_s": 0.5}}, "largest_m": 90.0}})
    settings = replace(
        settings,
        ranges=replace(own.ranges, sigma_m=settings.ranges.sigma_m),
        filter=replace(settings.filter, dtype="float32", recovery=False, longest_step_s=math.inf),
        files={"odometry.csv": reading},
    )
    path = tmp_path / "settings.toml"
    path.write_text(settings_text(settings, {"positions.sigma_m": "as it was"}))
    read = read_settings(path)
    assert "\nsigma_m = 1.0  # as it was\n" in path.read_text()
    files = {file: replace(one, where="") for file, one in read.files.items()}
    assert replace(read, files=files) == settings


def test_a_stopped_calibration_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = LogFolder(arc(tmp_path / "log"))
    runs: list[int] = []
    whole = calibration.replay_of

    def counted(*arguments: Any) -> Any:
        runs.append(1)
        if len(runs) == stop_at:
            raise KeyboardInterrupt
        return whole(*arguments)

    monkeypatch.setattr(calibration, "replay_of", counted)
    stop_at = 60
    with pytest.raises(KeyboardInterrupt):
        calibrate([log], Settings(), store=Store(tmp_path / "store", {}))
    kept = len(list((tmp_path / "store").glob("*.npz")))
    assert kept >= 55
    stop_at = -1
    alone = calibrate([log], Settings())
    runs.clear()
    told: list[tuple[int, int]] = []
    store = Store(tmp_path / "store", {})
    resumed = calibrate([log], Settings(), store=store, progress=lambda *at: told.append(at))
    assert resumed == alone
    # The start and two looks at the innovations themselves are always run.
    assert len(runs) == alone.replays - kept + 3
    assert told[-1][0] == alone.replays
    assert all(done <= most for done, most in told)


def test_the_command_writes_settings_to_use(tmp_path: Path) -> None:
    log, out = arc(tmp_path / "log"), tmp_path / "out"
    arguments = ["calibrate", log, "--set", "ranges.sigma_m=1", "--output", out, "--json"]
    ran = CliRunner().invoke(app, [*map(str, arguments), "--quiet"])
    assert ran.exit_code == 0, ran.output
    told = json.loads(ran.stdout)
    assert json.loads((out / "results.json").read_text()) == told
    assert told["settings"]["settings"]["ranges"]["sigma_m"] == 1.0
    found = {one["name"]: one for one in told["results"]["noises"]}
    settings = read_settings(out / "settings.toml")
    for name, one in found.items():
        section, key = name.split(".")
        assert getattr(getattr(settings, section), key) == one["value"]
        assert one["likeliest"] <= one["value"] * 1.01
    # Ranges were made with 0.1 m; the settings said ten times that.
    assert found["ranges.sigma_m"]["likeliest"] == pytest.approx(0.1, rel=0.4)
    header, *lines = (out / "profiles.csv").read_text().splitlines()
    assert header.split(",")[:2] == [
        "odometry.sigma_distance",
        "odometry.sigma_distance.log_likelihood",
    ]
    assert len(lines) == 1 + len(calibration.ALONG)
    assert (out / "figure.png").stat().st_size > 0
    assert not (tmp_path / "out.runs").exists()
