"""What ``auvest check`` and the verdict of a replay say of a log."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import ROOT
from typer.testing import CliRunner

from auvest.cli import app
from auvest.importers.sets import IMPORTERS
from auvest.logs import LogError, LogFolder, reader
from auvest.logs.check import survey
from auvest.logs.findings import CAUSES, Finding, finding, worst
from auvest.logs.write import write_file
from auvest.replay import Settings, checks, diagnosis, find_settings, replay, report, settings_from
from auvest.replay.checks import Checked, check, files, limits
from auvest.replay.health import (
    RECOVERIES_NOT_TRUSTED,
    Residuals,
    SourceHealth,
    health,
    truncated_moments,
)
from auvest.replay.health import findings as health_findings
from auvest.replay.tables import Batch, blank_measurements
from auvest.reproduce.mistakes import measure
from auvest.reproduce.mistakes.injected import MISTAKES
from auvest.reproduce.mistakes.trials import KINDS, write

BEACONS = {1: (0.0, 40.0), 2: (60.0, -10.0)}


def arc(folder: Path, seconds: int = 60) -> Path:
    """A craft at 1 m/s on an arc, a line a second, a range every other second from one of two."""
    random = np.random.default_rng(3)
    time = np.arange(seconds + 1.0)
    pose = np.zeros((len(time), 3))
    for k in range(1, len(time)):
        heading = pose[k - 1, 2]
        pose[k] = pose[k - 1] + [math.cos(heading + 0.01), math.sin(heading + 0.01), 0.02]
    used = np.arange(2, len(time), 2)
    source = np.where(used % 4, 1, 2)
    places = np.array([BEACONS[one] for one in source])
    ranges = np.hypot(*(pose[used, :2] - places).T) + random.normal(0, 0.1, len(used))
    write_file(
        folder, "odometry.csv", time_s=time, speed_m_s=np.ones(len(time)),
        yaw_rate_rad_s=np.full(len(time), 0.02),
    )  # fmt: skip
    write_file(folder, "ranges.csv", time_s=time[used], source=source, range_m=ranges)
    x, y = zip(*BEACONS.values(), strict=True)
    write_file(folder, "beacons.csv", source=list(BEACONS), x_m=x, y_m=y)
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    write_file(folder, "truth.csv", time_s=time, x_m=pose[:, 0], y_m=pose[:, 1])
    return folder


def edit(path: Path, line: int, text: str) -> None:
    """Put another line in place of one, counted from 1."""
    lines = path.read_text().splitlines()
    lines[line - 1] = text
    path.write_text("\n".join(lines) + "\n")


def named(checked: Checked) -> list[tuple[str, str, int | None]]:
    return [(one.cause, one.file, one.line) for one in checked.findings]


@pytest.mark.parametrize("late", ["ranges", "positions"])
def test_a_forgotten_latency_is_the_cause_and_not_that_there_is_none(
    tmp_path: Path, late: str
) -> None:
    """2 s at 3 m/s, of ranges or of positions; innovations that it explains are no finding."""
    random = np.random.default_rng(3)
    time = np.arange(0, 600.05, 0.5)
    heading = 0.7 * np.sin(time / 60) + 1.6 * (time // 150)
    way = np.cumsum(np.concatenate([[0.0], 1.5 * np.exp(1j * heading[:-1])]))
    rate = np.diff(heading, append=heading[-1]) / 0.5
    write_file(tmp_path, "odometry.csv", time_s=time, speed_m_s=np.full(len(time), 3.0),
               yaw_rate_rad_s=rate)  # fmt: skip
    used = np.arange(10, len(time) - 10, 10)
    source = np.where(used % 20, 1, 2)
    beacons = {1: 100 + 200j, 2: 300 - 100j}
    places = np.array([beacons[one] for one in source])
    ranges = np.abs(way[used] - places) + random.normal(0, 1, len(used))
    told_s = {"ranges": 0.0, "positions": 0.0, late: 2.0}
    write_file(tmp_path, "ranges.csv", time_s=time[used] + told_s["ranges"], source=source,
               range_m=ranges)  # fmt: skip
    fixed = way[used[::2]] + random.normal(0, 1, (len(used[::2]), 2)) @ [1, 1j]
    write_file(tmp_path, "positions.csv", time_s=time[used[::2]] + told_s["positions"],
               x_m=fixed.real, y_m=fixed.imag)  # fmt: skip
    write_file(tmp_path, "beacons.csv", source=[1, 2], x_m=[100, 300], y_m=[200, -100])
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    sure = {"sigma_distance": 0.01, "sigma_drift": 0.02, "sigma_turn": 0.001}
    checked = check(tmp_path, settings_from({"odometry": sure}))
    wrong = [one for one in checked.findings if one.verdict != "sound"]
    assert [one.cause for one in wrong if one.cause != "recoveries"] == ["latency"]
    assert wrong[0].message.startswith(f"{late} fit when taken 2 s before their time")
    assert checked.health is not None
    if len(wrong) == 1:
        assert checked.health.reason == wrong[0].text


def test_the_documented_causes_are_the_causes() -> None:
    text = (ROOT / "docs" / "logs.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| (.+) \| (sound|doubtful|not_trusted) \|$", text, re.M)
    assert {name: (what, verdict) for name, what, verdict in rows} == CAUSES


def test_a_clean_log_is_sound_and_says_what_is_there(tmp_path: Path) -> None:
    checked = check(arc(tmp_path), Settings())
    assert (checked.verdict, checked.findings) == ("sound", [])
    ranges = checked.files["ranges.csv"].document()
    assert (ranges["lines"], ranges["first_s"], ranges["last_s"]) == (30, 2.0, 60.0)
    assert (ranges["usual_step_s"], ranges["longest_step_s"]) == (2.0, 2.0)
    assert ranges["sources"]["1"]["lines"] == 15
    assert "truth.csv" not in checked.files


def test_the_worst_verdict_counts() -> None:
    assert worst([]) == "sound"
    assert worst(["doubtful", "sound"]) == "doubtful"
    assert worst(["doubtful", "not_trusted", "sound"]) == "not_trusted"


def test_a_file_that_no_log_has_is_a_note(tmp_path: Path) -> None:
    arc(tmp_path)
    (tmp_path / "battery.csv").write_text("time_s,voltage_v\n0,5\n")
    (tmp_path / "range.csv").write_text("time_s,source,range_m\n0,1,5\n")
    checked = check(tmp_path, Settings())
    assert named(checked) == [
        ("ignored_file", "battery.csv", None),
        ("ignored_file", "range.csv", None),
    ]
    said = "is not read: no file of a log has that name"
    listed, meant = " (auvest check --layout lists them)", "; is it meant to be ranges.csv?"
    assert [one.message for one in checked.findings] == [said + listed, said + meant]
    assert checked.verdict == "sound"


@pytest.mark.parametrize("lines", [7, 32768])
def test_findings_have_the_line_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    """Odometry line 2 is that of 0 s, so line 22 is that of 20 s."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    back = arc(tmp_path / "back")
    for k in range(20, 61):
        edit(back / "odometry.csv", k + 2, f"{k - 15},1.0,0.02")
    assert named(check(back, Settings()))[0] == ("clock_jump", "odometry.csv", 22)
    gap = arc(tmp_path / "gap")
    kept = (gap / "odometry.csv").read_text().splitlines()
    (gap / "odometry.csv").write_text("\n".join(kept[:22] + kept[38:]) + "\n")  # 20 s, then 37 s
    found = named(check(gap, Settings()))
    assert ("odometry_gap", "odometry.csv", 23) in found
    zero = arc(tmp_path / "zero")
    for line in (11, 13, 15):
        edit(zero / "ranges.csv", line, f"{2 * line - 2},2,0.0")
    assert ("no_echo", "ranges.csv", 11) in named(check(zero, Settings()))
    cut = arc(tmp_path / "cut")
    edit(cut / "ranges.csv", 9, "16.0,1")
    assert named(check(cut, Settings())) == [("unreadable", "ranges.csv", 9)]


def test_where_the_unit_of_time_is_wrong_no_step_of_it_is_a_gap(tmp_path: Path) -> None:
    """Steps of a second, written as 1000, are what one finding says, not sixty."""
    arc(tmp_path)
    for name in ("odometry.csv", "ranges.csv"):
        lines = (tmp_path / name).read_text().splitlines()
        cells = [line.split(",", 1) for line in lines[1:]]
        for k, (time, rest) in enumerate(cells):
            edit(tmp_path / name, k + 2, f"{1000 * float(time)!r},{rest}")
    seen = survey(LogFolder(tmp_path), limits(Settings()))
    assert [(one.cause, one.file) for one in seen.findings] == [("milliseconds", "odometry.csv")]


@pytest.mark.parametrize("lines", [7, 32768])
def test_equal_times_are_counted_over_all_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    """A line a second under a clock of steps of 4 s: of each four, three have the time before."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    arc(tmp_path)
    for k in range(61):
        edit(tmp_path / "odometry.csv", k + 2, f"{k // 4 * 4},1.0,0.02")
    seen = survey(LogFolder(tmp_path), limits(Settings()))
    assert seen.files["odometry.csv"].equal == 45
    assert ("times_equal", "odometry.csv", 3) in [
        (one.cause, one.file, one.line) for one in seen.findings
    ]


def test_a_craft_that_stands_may_be_silent(tmp_path: Path) -> None:
    log = arc(tmp_path)
    kept = (log / "odometry.csv").read_text().splitlines()
    kept[21] = "20.0,0.0,0.0"
    (log / "odometry.csv").write_text("\n".join(kept[:22] + kept[42:]) + "\n")
    assert "odometry_gap" not in [cause for cause, _, _ in named(check(log, Settings()))]


@pytest.mark.parametrize("lines", [1, 3, 32768])
def test_a_velocity_holds_no_longer_than_a_gap_may_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lines: int
) -> None:
    """1 m/s at 0 s and at 100 s: 4 m in the gap and, after 110 s, 4 m more at the end."""
    monkeypatch.setattr(reader, "CHUNK_LINES", lines)
    arc(tmp_path, seconds=4)
    write_file(
        tmp_path, "odometry.csv", time_s=[0.0, 100.0], speed_m_s=[1.0, 1.0],
        yaw_rate_rad_s=[0.0, 0.0],
    )  # fmt: skip
    write_file(tmp_path, "ranges.csv", time_s=[110.0], source=[9], range_m=[5.0])
    settings = settings_from({"odometry": {"gap_s": 4.0, "max_step_s": 1.0}})
    track = replay(LogFolder(tmp_path), settings, causes=False).estimates.columns()
    reckoned = dict(zip(track["time_s"].tolist(), track["dead_reckoned_x_m"].tolist(), strict=True))
    assert reckoned[3.0] == pytest.approx(3.0, abs=1e-12)
    assert reckoned[4.0] == reckoned[100.0] == pytest.approx(4.0, abs=1e-12)
    assert reckoned[104.0] == reckoned[110.0] == pytest.approx(8.0, abs=1e-12)


def test_odometry_without_lines_and_too_many_steps_are_refused(tmp_path: Path) -> None:
    empty = arc(tmp_path / "empty")
    (empty / "odometry.csv").write_text("time_s,speed_m_s,yaw_rate_rad_s\n")
    slow = arc(tmp_path / "slow")
    for name in ("odometry.csv", "ranges.csv", "start.csv", "truth.csv"):
        rows = np.loadtxt(slow / name, delimiter=",", skiprows=1, ndmin=2)
        header = (slow / name).read_text().splitlines()[0]
        rows[:, 0] *= 1000
        np.savetxt(slow / name, rows, delimiter=",", header=header, comments="", fmt="%.10g")
    out = tmp_path / "out"
    for log, words in ((empty, "no line below the header"), (slow, "milliseconds for seconds")):
        with pytest.raises(LogError, match=words):
            replay(LogFolder(log), Settings())
        ran = CliRunner().invoke(app, ["replay", str(log), "--output", str(out)])
        assert ran.exit_code == 2
        assert [path for path in out.rglob("*") if path.is_file()] == []


def test_no_look_at_the_truth(tmp_path: Path) -> None:
    """The answers are the same without it, and with one that is nonsense."""
    folder = tmp_path / "log"
    measure.trial("slant", "beacons", 1, folder)
    settings = KINDS["beacons"].settings
    answers = []
    for truth in (None, "nonsense\n"):
        if truth is not None:
            (folder / "truth.csv").write_text(truth)
        answers.append(json.dumps(check(folder, settings).document()))
    (folder / "truth.csv").unlink()
    answers.append(json.dumps(check(folder, settings).document()))
    assert answers[0] == answers[1] == answers[2]
    assert "slant_range" in answers[0]


def test_replay_says_the_same_and_warns(tmp_path: Path) -> None:
    folder = tmp_path / "log"
    measure.trial("axes exchanged", "beacons", 2, folder)
    config = tmp_path / "own.toml"
    config.write_text(
        "[start]\nsigma_heading_rad = 0.05\n[ranges]\nsigma_m = 0.8\n"
        "[odometry]\nsigma_distance = 0.02\nsigma_drift = 0.05\nsigma_turn = 0.003\n"
    )
    arguments = [str(folder), "--config", str(config), "--json"]
    told = json.loads(CliRunner().invoke(app, ["check", *arguments]).stdout)
    out = str(tmp_path / "out")
    ran = CliRunner().invoke(app, ["replay", *arguments, "--output", out])
    assert ran.exit_code == 0
    assert "NOT TRUSTED: " in ran.stderr
    (log,) = json.loads(ran.stdout)["logs"]
    assert (told["verdict"], log["health"]["verdict"]) == ("not_trusted", "not_trusted")
    assert "axes_exchanged" in [one["cause"] for one in told["findings"]]
    by_text = [
        sorted(one["message"] for one in said) for said in (told["findings"], log["findings"])
    ]
    assert by_text[0] == by_text[1]
    assert all({"cause", "file", "line", "message"} <= set(one) for one in told["findings"])
    for command, options in {"check": [], "replay": ["--output", out]}.items():
        strict = CliRunner().invoke(app, [command, *arguments, *options, "--strict"])
        assert strict.exit_code == 1
        assert strict.stderr.endswith("--strict: log is not trusted\n")
        assert json.loads(strict.stdout)["command"] == command
    report = (tmp_path / "out" / "log" / "report.html").read_text(encoding="utf-8")
    assert '<span class="verdict not_trusted">not trusted</span>' in report


def test_moments_below_three_sigma() -> None:
    """E[z^2 | |z| < 3] = 1 - 6 phi(3) / (2 Phi(3) - 1); of two numbers, by hand: exponential."""
    density = math.exp(-4.5) / math.sqrt(2 * math.pi)
    mean, spread = truncated_moments(1, 9.0)
    inside = math.erf(3 / math.sqrt(2))
    assert mean == pytest.approx(1 - 6 * density / inside, rel=1e-12)
    fourth = 3 - (54 + 18) * density / inside
    assert spread == pytest.approx(math.sqrt(fourth - mean**2), rel=1e-9)
    limit = 4.0
    tail = math.exp(-limit / 2)
    assert truncated_moments(2, limit)[0] == pytest.approx(2 - limit * tail / (1 - tail), rel=1e-12)


def test_coordinates_of_a_map_lose_an_origin_and_get_it_back(tmp_path: Path) -> None:
    east, north = 388_096.0, 3_948_996.0
    near, far = arc(tmp_path / "near"), arc(tmp_path / "far")
    for name, first in (("beacons.csv", 1), ("start.csv", 1), ("truth.csv", 1)):
        rows = np.loadtxt(far / name, delimiter=",", skiprows=1, ndmin=2)
        rows[:, first : first + 2] += (east, north)
        header = (far / name).read_text().splitlines()[0]
        np.savetxt(far / name, rows, delimiter=",", header=header, comments="", fmt="%.12g")
    here, there = (replay(LogFolder(log), Settings()) for log in (near, far))
    a, b = here.estimates.columns(), there.estimates.columns()
    np.testing.assert_allclose(b["x_m"] - east, a["x_m"], rtol=0, atol=1e-5)
    np.testing.assert_allclose(b["dead_reckoned_y_m"] - north, a["dead_reckoned_y_m"], atol=1e-5)
    np.testing.assert_allclose(there.errors.columns()["true_y_m"].min(), north, atol=1e-5)
    assert there.numbers["rmse_m"] == pytest.approx(here.numbers["rmse_m"], abs=1e-5)
    assert there.numbers["origin_m"] == [388_000.0, 3_949_000.0]
    assert [one.cause for one in there.findings] == ["local_origin"]
    assert (here.numbers["origin_m"], here.findings) == (None, [])


#: For each mistake one kind of trial; `auvest reproduce mistakes` does all, 20 times each.
SHORT = [(name, one.kinds[len(name) % len(one.kinds)]) for name, one in MISTAKES.items()]


@pytest.mark.parametrize(("mistake", "kind"), SHORT, ids=[name for name, _ in SHORT])
def test_the_cause_of_a_mistake_is_named(mistake: str, kind: str) -> None:
    named = measure.answer(mistake, kind, 3)
    assert measure.right(mistake, named), named


@pytest.mark.parametrize("kind", KINDS)
def test_a_clean_trial_is_sound_and_one_with_tenth_sigmas_is_not(kind: str, tmp_path: Path) -> None:
    assert measure.answer(measure.CLEAN, kind, 3) == ()
    settings = measure.trial(measure.TENTH, kind, 3, tmp_path)
    checked = check(tmp_path, settings)
    assert checked.verdict in ("doubtful", "not_trusted")
    assert "noise_too_small" in measure.causes(checked)


@pytest.mark.parametrize("others", [[], [finding("innovations", "they do not fit")]])
def test_recoveries_have_possible_causes_where_nothing_else_is_wrong(
    monkeypatch: pytest.MonkeyPatch, others: list[Finding]
) -> None:
    lost = finding("recoveries", "the filter lost its track 9 times in 99 measurements")
    monkeypatch.setattr(checks, "start_findings", lambda _: [])
    monkeypatch.setattr(checks, "findings", lambda _: [*others, lost])
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: [])
    log: Any = SimpleNamespace(echoing=False)
    left: Any = None
    *_, told = checks.innovations(log, Settings(), "ekf", left, [])
    causes = "; possible causes: a range scale, a wrong survey or sigmas that are too small"
    assert told.message == lost.message + ("" if others else causes)


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (2e3, "2000 s apart, 200000 s in all: milliseconds for seconds? Then they are 2 s apart"),
        (2e6, "2000000 s apart, 200000000 s in all: microseconds for seconds? Then they are 2 s"),
        (5e8, "500000000 s apart, 5e+10 s in all: nanoseconds for seconds? Then they are 0.5 s"),
    ],
)
def test_a_clock_that_is_too_fast_is_told_its_unit(tmp_path: Path, step: float, said: str) -> None:
    arc(tmp_path)
    time = step * np.arange(101)
    still = np.zeros(len(time))
    write_file(tmp_path, "odometry.csv", time_s=time, speed_m_s=still, yaw_rate_rad_s=still)
    cause = "milliseconds" if step < 1e4 else "microseconds"
    (told,) = [one for one in check(tmp_path, Settings()).findings if one.cause == cause]
    assert told.message.startswith(f"lines are {said}")


def test_recoveries_again_and_again_are_not_trusted(tmp_path: Path) -> None:
    """Ranges that are too long by a scale against sigmas that leave no room for it."""
    random = np.random.default_rng(5)
    files = KINDS["beacons"].make(random)
    files["ranges.csv"]["range_m"] = 1.1 * files["ranges.csv"]["range_m"]
    write(tmp_path, files)
    checked = check(tmp_path, KINDS["beacons"].settings)
    assert checked.health is not None
    assert checked.health.recoveries >= RECOVERIES_NOT_TRUSTED
    (told,) = [one for one in checked.findings if one.cause == "recoveries"]
    assert told.verdict == checked.verdict == "not_trusted"
    assert "range_scale" in measure.causes(checked)


def test_a_unit_of_speed_is_named(tmp_path: Path) -> None:
    """1852 m an hour are 0.514 m/s; what is 5 % off is a scale, and no unit."""
    settings = measure.trial("knots", "beacons", 3, tmp_path)
    told = {found.cause: found.text for found in check(tmp_path, settings).findings}
    factor, unit = re.findall(
        r"times ([0-9.]+) \(written in (.+)\?\); each me", told["speed_scale"]
    )[0]
    assert (float(factor), unit) == (pytest.approx(1852 / 3600, rel=0.03), "knots")
    log = LogFolder(tmp_path)
    for scale, unit in ((0.48, ""), (0.3, "feet per second"), (0.28, "km/h")):
        written = unit and f" (written in {unit}?)"
        assert diagnosis._speeds(log, scale).message.endswith(f"{scale:.3f}{written}")


def test_speeds_that_are_too_small_are_a_scale_too(tmp_path: Path) -> None:
    settings = measure.trial("clean", "beacons", 3, tmp_path)
    rows = np.loadtxt(tmp_path / "odometry.csv", delimiter=",", skiprows=1)
    header = (tmp_path / "odometry.csv").read_text().splitlines()[0]
    rows[:, header.split(",").index("speed_m_s")] *= 0.4
    np.savetxt(tmp_path / "odometry.csv", rows, delimiter=",", header=header, comments="")
    told = {found.cause: found.text for found in check(tmp_path, settings).findings}
    factor = re.findall(r"times ([0-9.]+)", told["speed_scale"])[0]
    assert float(factor) == pytest.approx(2.5, rel=0.03)


def test_a_source_that_stands_apart_is_named(tmp_path: Path) -> None:
    measure.trial("one source", "beacons", 3, tmp_path)
    checked = check(tmp_path, KINDS["beacons"].settings)
    messages = [one.message for one in checked.findings if one.cause == "source_off"]
    assert messages
    assert all(message.startswith("source 1") for message in messages)


def test_a_source_of_which_most_is_thrown_away_stands_apart() -> None:
    """Twenty ranges of each of two sources: of one 12 are beyond three sigma, of the other 2."""
    rows: dict[str, Any] = blank_measurements(40)
    rows["time_s"] = np.arange(40.0)
    rows["source"] = np.tile([4, 7], 20)
    rows["nis"] = np.where(np.arange(40) % 2, np.arange(40) < 24, np.arange(40) < 4) * 20.0
    rows["innovation_0"] = np.sqrt(rows["nis"])
    rows["sigma_0"] = np.ones(40)
    residuals = Residuals()
    nothing: dict[str, Any] = {}
    residuals.add(Batch(nothing, rows, nothing, np.full(40, 50.0)))
    (beyond, apart) = health_findings(residuals)
    assert (beyond.cause, beyond.verdict, apart.cause) == ("innovations", "doubtful", "source_off")
    assert apart.message.startswith("source 7: 60 % beyond three sigma, of the others at most 10 %")
    judged = health(residuals, [beyond, apart])
    assert (judged.verdict, judged.beyond_share) == ("doubtful", 14 / 40)
    # Rows 0 to 3 are all beyond, then every other: only a run of five would be named.
    assert judged.untrusted_s == []
    rows["nis"][4] = 20.0
    more = Residuals()
    more.add(Batch(nothing, rows, nothing, np.full(40, 50.0)))
    assert health(more, []).untrusted_s == [(0.0, 5.0)]


@pytest.mark.parametrize(
    ("of_4", "of_7", "apart"), [(2, 12, [7]), (12, 12, []), (0, 2, []), (12, 0, [4])]
)
def test_a_source_is_off_where_most_of_it_is_and_the_others_are_not(
    of_4: int, of_7: int, apart: list[int]
) -> None:
    """Of each twenty so many beyond three sigma: a tenth is outliers, and both are no source's."""
    rows: dict[str, Any] = blank_measurements(40)
    rows["time_s"] = np.arange(40.0)
    rows["source"] = np.tile([4, 7], 20)
    rows["nis"] = np.column_stack([np.arange(20) < of_4, np.arange(20) < of_7]).ravel() * 20.0
    rows["innovation_0"], rows["sigma_0"] = np.sqrt(rows["nis"]), np.ones(40)
    residuals = Residuals()
    nothing: dict[str, Any] = {}
    residuals.add(Batch(nothing, rows, nothing, np.full(40, 50.0)))
    told = [one.message for one in health_findings(residuals) if one.cause == "source_off"]
    assert [int(message.split()[1].rstrip(":")) for message in told] == apart


def test_what_a_source_left_is_said_in_metres_and_percent() -> None:
    """Ranges that are 7 % too long, a quarter of them beyond three sigma."""
    left = SourceHealth(7, 40, beyond_share=0.25, median_m=-1.5, spread_m=0.5, trend=0.07)
    judged = replace(health(Residuals(), []), sources=[left])
    said = (
        "40 measurements, 25 % beyond three sigma, median -1.50 m, spread 0.50 m, "
        "+7.00 % of the range"
    )
    assert report.sources(judged) == [("source 7", said)]


@pytest.mark.parametrize(
    ("kind", "section", "key"), [("beacons", "fixes", "every_s"), ("tracking", "ranges", "sigma_m")]
)
def test_settings_for_the_other_kind_of_log_are_named(
    kind: str, section: str, key: str, tmp_path: Path
) -> None:
    write(tmp_path, KINDS[kind].make(np.random.default_rng(5)))
    settings = settings_from({section: {key: 7.0}})
    notes = [one for one in files(LogFolder(tmp_path), settings) if one.cause == "ignored_settings"]
    assert [one.verdict for one in notes] == ["sound"]
    assert notes[0].message.startswith(f"[{section}] of the settings is of no use here")
    assert files(LogFolder(tmp_path), Settings()) == []


def times(file: str, column: str, factor: float) -> Callable[[Any], None]:
    def spoil(files: Any) -> None:
        files[file][column] = files[file][column] * factor

    return spoil


def plus(file: str, column: str, by: float) -> Callable[[Any], None]:
    def spoil(files: Any) -> None:
        files[file][column] = files[file][column] + by

    return spoil


def other_number(files: Any) -> None:
    files["ranges.csv"]["source"] = np.where(files["ranges.csv"]["source"] == 2, 7.0, 1.0)


def half_of_the_odometry(files: Any) -> None:
    files["odometry.csv"] = {name: rows[:900] for name, rows in files["odometry.csv"].items()}


def degrees_of_latitude(files: Any) -> None:
    leaders = files["leaders.csv"]
    leaders["x_m"], leaders["y_m"] = 5.9 + leaders["x_m"] / 81400, 43 + leaders["y_m"] / 111194


#: What a new user does, what must be named, and the verdict. All were sound once, or named another.
SLIPS = {
    "ranges in cm": (times("ranges.csv", "range_m", 100), "lengths_apart", "not_trusted"),
    "ranges in s": (times("ranges.csv", "range_m", 1 / 1500), "lengths_apart", "not_trusted"),
    "sources of a map": (plus("leaders.csv", "x_m", 388096), "lengths_apart", "not_trusted"),
    "degrees of latitude": (degrees_of_latitude, "lengths_apart", "doubtful"),
    "increments in cm": (times("odometry.csv", "forward_m", 100), "millimetres", "not_trusted"),
    "other numbers": (plus("ranges.csv", "source", 10), "not_used", "not_trusted"),
    "one other number": (other_number, "not_used", "doubtful"),
    "half of the odometry": (half_of_the_odometry, "not_used", "doubtful"),
    "a late start": (plus("start.csv", "time_s", 300), "not_used", "doubtful"),
    "a start elsewhere": (plus("start.csv", "x_m", 50), "start_off", "doubtful"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_that_leaves_small_innovations_is_named(slip: str, tmp_path: Path) -> None:
    """A filter that has lost its track altogether, or was given nothing, meets no contradiction."""
    spoil, cause, verdict = SLIPS[slip]
    files = KINDS["leaders"].make(np.random.default_rng(5))
    spoil(files)
    write(tmp_path, files)
    result = replay(LogFolder(tmp_path), KINDS["leaders"].settings, causes=False)
    assert result.health.verdict == verdict
    assert cause in [one.cause for one in result.findings]


@pytest.mark.parametrize(("lines", "cause"), [(2, "clock_jump"), (3, "milliseconds")])
def test_of_which_unit_a_time_is_takes_two_gaps_to_say(
    lines: int, cause: str, tmp_path: Path
) -> None:
    """One of 100 s can be anything; a second, with 1.5 m on the way, is 0.1 s of a craft."""
    write_file(
        tmp_path, "fixes.csv", time_s=100.0 * np.arange(lines), source=np.ones(lines),
        range_m=10.0 + 1.5 * np.arange(lines), bearing_rad=np.zeros(lines),
    )  # fmt: skip
    write_file(tmp_path, "beacons.csv", source=[1], x_m=[0.0], y_m=[0.0])
    seen = survey(LogFolder(tmp_path), limits(Settings()))
    assert [one.cause for one in seen.findings] == [cause]


def test_a_filter_that_does_not_know_where_it_is_is_not_trusted() -> None:
    """Everything fits a prediction that is a megametre wide."""
    rows: dict[str, Any] = blank_measurements(40)
    rows["time_s"], rows["nis"] = np.arange(40.0), np.full(40, 0.5)
    rows["innovation_0"], rows["sigma_0"] = np.full(40, 0.7), np.full(40, 1.0)
    nothing: dict[str, Any] = {}
    for wide, verdicts in ((10, []), (11, ["not_trusted"])):
        rows["sigma_0"][:wide] = 1e6
        residuals = Residuals()
        residuals.add(Batch(nothing, rows, nothing, np.full(40, 50.0)))
        found = health_findings(residuals)
        assert [one.verdict for one in found] == verdicts
        assert health(residuals, found).untrusted_s == [(0.0, wide - 1.0)]
        rows["near_field"][:] = True  # there it is a position that is wide
        near = Residuals()
        near.add(Batch(nothing, rows, nothing, np.full(40, 50.0)))
        assert health_findings(near) == []
        rows["near_field"][:] = False


def test_command_shows_one_screen_and_refuses_what_is_no_folder(tmp_path: Path) -> None:
    shown = CliRunner().invoke(app, ["check", str(arc(tmp_path / "arc"))])
    assert shown.exit_code == 0
    assert shown.stdout.count("\n") <= 24
    assert "verdict     sound" in shown.stdout
    strict = CliRunner().invoke(app, ["check", "--strict", str(tmp_path / "arc")])
    assert (strict.exit_code, strict.stdout) == (0, shown.stdout)
    refused = CliRunner().invoke(app, ["check", str(tmp_path / "nowhere")])
    assert refused.exit_code == 2
    assert refused.stderr == f"Error: LOG: {tmp_path / 'nowhere'}: there is no such folder\n"


DATA = os.environ.get("AUVEST_DATA")


@pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)
@pytest.mark.parametrize(
    ("name", "expected"),
    [("goats14", "sound"), ("hat_charles", "sound"), ("labyrinth_uwb", "range_scale")],
)
def test_recordings_with_their_own_settings(tmp_path: Path, name: str, expected: str) -> None:
    assert DATA is not None
    (folder,) = IMPORTERS[name](Path(DATA) / name, tmp_path)
    checked = check(folder, find_settings(name))
    assert checked.verdict != "not_trusted"
    told: Any = checked.verdict if expected == "sound" else measure.causes(checked)
    assert told == expected or expected in told
