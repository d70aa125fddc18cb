"""What instruments are off by: the models, the settings, and what a replay finds."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from test_check import arc
from typer.testing import CliRunner

import auvest
from auvest.cli import app
from auvest.importers.sets import IMPORTERS
from auvest.logs import LogError, LogFolder
from auvest.logs.write import write_file
from auvest.replay import Settings, find_settings, replay, report, settings_from
from auvest.replay.constants import Constants, Found
from auvest.replay.water import range_changes, sound_speed_m_s
from auvest.reproduce.constants import measure, page, trials
from auvest.reproduce.constants.measure import Bench, Recording, Row

PAGE = ROOT / "docs" / "reproduction" / "constants"
DATA = os.environ.get("AUVEST_DATA")
needs_data = pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)


def settings(**sections: object) -> Settings:
    return settings_from(sections, "test")


def test_each_has_its_place_in_the_state() -> None:
    chosen = settings(
        constants={"range_scale": 0.05, "speed_factor": 0.1, "range_offset_m": 0.5, "walk": 0.6},
        ranges={"sources": {"3": {"constant_offset_m": 2.0}}},
        odometry={"sigma_turned": 0.2},
    )
    constants = Constants(chosen)
    names = ["range_scale", "range_offset_m", "speed_factor", "range_offset_m.3"]
    assert list(constants.priors) == names
    assert [constants.place(name) for name in names] == [3, 4, 5, 6]
    assert constants.place("turn_offset_rad_s") == 0
    # A source with an offset of its own has no part in that of all.
    assert (constants.offset_of(3), constants.offset_of(7)) == (6, 4)
    process = constants.process
    assert isinstance(process, auvest.OdometryConstants)
    assert (process.speed_state, process.turn_state, process.sigma_turned) == (5, 0, 0.2)
    # 60 % of the prior in an hour is 1 % of it in a second.
    assert process.walk_0 == pytest.approx(0.05 * 0.01)
    assert process.walk_3 == pytest.approx(2.0 * 0.01)
    state, sigmas = constants.begin([1.0, 2.0, 0.5], [0.1, 0.1, 0.02])
    assert state == [1.0, 2.0, 0.5, 0, 0, 0, 0, 0]
    assert sigmas[:7] == [0.1, 0.1, 0.02, 0.05, 0.5, 0.1, 2.0]
    # Without any it is the odometry of before.
    none = Constants(settings(odometry={"sigma_turned": 0.2}))
    assert type(none.process) is auvest.Odometry
    assert none.begin([1.0, 2.0, 0.5], [0.1, 0.1, 0.02]) == ([1.0, 2.0, 0.5], [0.1, 0.1, 0.02])


def test_what_cannot_be(tmp_path: Path) -> None:
    many = {str(source): {"constant_offset_m": 1.0} for source in range(6)}
    with pytest.raises(ValueError, match="6 of them are too many, 5 at most"):
        Constants(settings(ranges={"sources": many}))
    with pytest.raises(ValueError, match="components do not go together"):
        Constants(settings(constants={"range_scale": 0.1}, filter={"components": 8}))
    log = LogFolder(arc(tmp_path))
    with pytest.raises(ValueError, match="no compass says how the craft is headed"):
        replay(log, settings(constants={"compass_offset_rad": 0.1}))
    steered = trials.write(tmp_path / "steered", "compass_offset_rad", 0.0, 0)
    with pytest.raises(ValueError, match="is for turns and yaw rates"):
        replay(steered, settings(constants={"turn_offset_rad_s": 0.1}))
    for place in (1, 2, 8):
        with pytest.raises(ValueError, match=rf"^speed_state must be 0 or 3\.\.7, not {place}$"):
            auvest.OdometryConstants(speed_state=place)


def test_models_as_python_has_them() -> None:
    process = auvest.OdometryConstants(speed_state=3, turn_state=4)
    x = process.f([0, 0, 0, 0.1, 0.02, 0, 0, 0], 2.0, [1.0, 0.0, 0.5])
    assert x == pytest.approx([1.1, 0, 0.54, 0.1, 0.02, 0, 0, 0])
    sensor = auvest.ScaledRange(leader=(3.0, 4.0), scale_state=5, offset_state=7)
    assert sensor.h([0, 0, 0, 0, 0, 0.1, 0, 0.25]) == pytest.approx([5.75])
    with pytest.raises(ValueError, match="ScaledRange observes"):
        sensor.check_process(auvest.Odometry())


def test_what_is_said_of_one() -> None:
    certain = Found("range_scale", 0.07, 0.003, 0.05, indistinguishable=False)
    assert certain.text == "+0.07 ± 0.003"
    none = Found("turn_offset_rad_s", -1e-5, 2e-5, 0.01, indistinguishable=True)
    assert none.text == "-1e-05 ± 2e-05 rad/s, indistinguishable from none"
    assert Found("range_offset_m.3", 0.5, 0.1, 1.0, indistinguishable=False).text.endswith(" m")


@pytest.mark.parametrize("error", trials.ERRORS, ids=lambda error: error.name)
def test_an_error_is_found(tmp_path: Path, error: trials.Error) -> None:
    looks = trials.settings({error.name: error.prior})
    log = trials.write(tmp_path / "wrong", error.name, error.size, 0)
    found = replay(log, looks, causes=False)
    (told,) = found.numbers["constants"]
    assert told["name"] == error.name
    assert told["prior"] == error.prior
    assert abs(told["value"] - error.size) <= 2 * told["sigma"]
    assert told["sigma"] < 0.3 * error.prior
    assert not told["indistinguishable"]
    ignored = replay(log, trials.settings({}), causes=False)
    assert ignored.numbers["constants"] == []
    if error.name != "compass_offset_rad":  # without it the start's heading takes it
        assert found.numbers["rmse_m"] < 0.2 * ignored.numbers["rmse_m"]
    assert f"constant {error.name}" in dict(report.rows(found))
    if error.name == "compass_offset_rad":  # looked for in memory, with the start as it was
        assert replay(log, looks).numbers["rmse_m"] == found.numbers["rmse_m"]
    # Where there is none, that is said.
    clean = trials.write(tmp_path / "clean", error.name, 0.0, 0)
    (told,) = replay(clean, looks, causes=False).numbers["constants"]
    assert told["indistinguishable"]
    assert abs(told["value"]) <= 2 * told["sigma"]


def test_an_offset_of_one_beacon_is_its_own(tmp_path: Path) -> None:
    log = trials.write(tmp_path, "range_scale", 0.0, 1)
    path = tmp_path / "ranges.csv"
    header, *lines = path.read_text().splitlines()
    changed = [header]
    for line in lines:
        time, source, range_m = line.split(",")
        changed.append(f"{time},{source},{float(range_m) + 4 * (float(source) == 2)}")
    path.write_text("\n".join(changed) + "\n")
    chosen = trials.settings({"range_offset_m": 1.0})
    own = settings(ranges={"sources": {"2": {"constant_offset_m": 5.0}}}).ranges.sources
    chosen = replace(chosen, ranges=replace(chosen.ranges, sources=own))
    found = {one["name"]: one for one in replay(log, chosen, causes=False).numbers["constants"]}
    assert found["range_offset_m.2"]["value"] == pytest.approx(
        4.0, abs=2 * found["range_offset_m.2"]["sigma"]
    )
    assert found["range_offset_m"]["indistinguishable"]


def test_the_track_is_carried_at_the_speed_that_was_found(tmp_path: Path) -> None:
    # Lines of the odometry are 10 s apart, the truth is read between them.
    time = 10.0 * np.arange(61)
    place = {"x_m": 1.1 * time, "y_m": 0 * time}
    write_file(tmp_path, "odometry.csv", time_s=time[1:], forward_m=10 + 0 * time[1:],
               turn_rad=0 * time[1:])  # fmt: skip
    source = np.arange(60) % 2
    beacon_x, beacon_y = np.array([300.0, 300.0]), np.array([200.0, -150.0])
    ranges = np.hypot(place["x_m"][1:] - beacon_x[source], beacon_y[source])
    write_file(tmp_path, "ranges.csv", time_s=time[1:], source=source, range_m=ranges)
    write_file(tmp_path, "beacons.csv", source=[0, 1], x_m=beacon_x, y_m=beacon_y)
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    between = time[1:] - 0.5
    write_file(tmp_path, "truth.csv", time_s=between, x_m=1.1 * between, y_m=0 * between)
    chosen = settings(
        constants={"speed_factor": 0.1},
        odometry={"sigma_distance": 0.001, "sigma_drift": 0.001, "sigma_turn": 1e-4},
        ranges={"sigma_m": 0.1},
        start={"sigma_position_m": 0.01, "sigma_heading_rad": 0.001},
    )
    result = replay(LogFolder(tmp_path), chosen, causes=False)
    assert result.numbers["constants"][0]["value"] == pytest.approx(0.1, abs=0.002)
    # 9.5 s at 1 m/s instead of 1.1 m/s would be 0.95 m.
    errors = result.errors.columns()
    assert np.abs(errors["error_x_m"][30:]).max() < 0.2


def test_the_command_says_it(tmp_path: Path) -> None:
    log = trials.write(tmp_path / "log", "range_scale", 0.07, 0)
    arguments = ["replay", log.path, "--output", tmp_path / "out", "--json", "--quiet"]
    arguments += ["--set", "constants.range_scale=0.05", "--set", "ranges.sigma_m=0.5"]
    ran = CliRunner().invoke(app, [*map(str, arguments)])
    assert ran.exit_code == 0, ran.output
    (told,) = json.loads(ran.stdout)["logs"][0]["constants"]
    assert told["name"] == "range_scale"
    assert told["value"] == pytest.approx(0.07, abs=0.002)
    text = (tmp_path / "out" / "log" / "report.html").read_text(encoding="utf-8")
    assert "constant range_scale" in text


def test_the_speed_of_sound() -> None:
    # Mackenzie's (1981) formula, another fit: 1550.744 m/s at 25 °C, 35 psu and 1000 m.
    assert sound_speed_m_s(25.0, 35.0, 1000.0) == pytest.approx(1550.744, abs=1.0)
    # Fresh water at 20 °C: 1482.3 m/s (Del Grosso and Mader 1972).
    assert sound_speed_m_s(20.0, 0.0, 0.0) == pytest.approx(1482.3, abs=1.0)
    assert sound_speed_m_s([4, 20], 35, [0, 100]).shape == (2,)
    for bad, said in (
        ((-1, 35, 0), "temperature_c must lie in 0..35, where the formula holds, not -1"),
        ((36, 35, 0), "temperature_c must lie in 0..35, where the formula holds, not 36"),
        (([10, 37], 35, 0), "temperature_c must lie in 0..35, where the formula holds, not 37"),
        ((10, 46, 0), "salinity_psu must lie in 0..45, where the formula holds, not 46"),
        ((10, 35, 1001), "depth_m must lie in 0..1000, where the formula holds, not 1001"),
        ((10, 35, np.nan), "depth_m must lie in 0..1000, where the formula holds, not nan"),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(said)}$"):
            sound_speed_m_s(*bad)


@pytest.mark.parametrize(
    ("water", "depth_m", "psu", "said"),
    [
        (
            "1,20,35\n0,37,35\n",
            0,
            35,
            "water.csv, line 3, column temperature_c: 37 is outside 0..35",
        ),
        ("0,20,50\n", 0, 35, "water.csv, line 2, column salinity_psu: 50 is outside 0..45"),
        ("0,20\n", 0, 50, "water.csv: [water] salinity_psu: 50 is outside 0..45"),
        ("0,20\n", 1350, 35, "depth.csv, column depth_m: 1350 is outside 0..1000 m"),
    ],
)
def test_water_beyond_the_formula_is_named(
    tmp_path: Path, water: str, depth_m: float, psu: float, said: str
) -> None:
    log = trials.write(tmp_path, "range_scale", 0.0, 0).path
    salinity = ",salinity_psu" * (water.split("\n")[0].count(",") > 1)
    (log / "water.csv").write_text(f"time_s,temperature_c{salinity}\n{water}")
    (log / "depth.csv").write_text(f"time_s,depth_m\n0,{depth_m}\n")
    with pytest.raises(LogError) as caught:
        range_changes(LogFolder(log), settings(water={"salinity_psu": psu}))
    told = f"{said}, where the formula for the speed of sound holds"
    assert str(caught.value) == f"{log}/{told}"


def test_ranges_are_corrected_by_the_water(tmp_path: Path) -> None:
    log = trials.write(tmp_path, "range_scale", 0.0, 0)
    plain = replay(log, trials.settings({}), causes=False).numbers["rmse_m"]
    # The instrument took 1500 m/s; sound was slower in the cold water above and faster below.
    water_s, temperature = np.array([0.0, 900.0]), np.array([4.0, 25.0])
    write_file(tmp_path, "water.csv", time_s=water_s, temperature_c=temperature)
    write_file(tmp_path, "depth.csv", time_s=water_s, depth_m=np.array([-0.1, 0.0]))
    path = tmp_path / "ranges.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    speed = np.interp(table[:, 0], water_s, sound_speed_m_s(temperature, 35.0, 0.0))
    write_file(tmp_path, "ranges.csv", time_s=table[:, 0], source=table[:, 1],
               range_m=table[:, 2] * 1500.0 / speed)  # fmt: skip
    mended = replay(LogFolder(tmp_path), trials.settings({}), causes=False).numbers["rmse_m"]
    assert mended == pytest.approx(plain, rel=0.01)
    (tmp_path / "water.csv").unlink()
    assert (
        replay(LogFolder(tmp_path), trials.settings({}), causes=False).numbers["rmse_m"] > 2 * plain
    )
    write_file(tmp_path, "water.csv", time_s=water_s, temperature_c=temperature - 8)
    with pytest.raises(ValueError, match=r"water\.csv, line 2, column temperature_c: -4 is outs"):
        replay(LogFolder(tmp_path), trials.settings({}), causes=False)


@needs_data
def test_a_recording_with_a_scale(tmp_path: Path) -> None:
    assert DATA is not None
    name = "labyrinth_uwb"
    (log,) = (LogFolder(one) for one in IMPORTERS[name](Path(DATA) / name, tmp_path))
    (changes,) = measure.RECORDINGS[name]
    result = replay(log, find_settings(name, changes), causes=False)
    assert result.numbers["rmse_m"] <= measure.LABYRINTH_M
    assert result.numbers["inside_3_sigma"] >= 0.95


def test_what_holds() -> None:
    good = Row("range_scale", 0.07, 0.05, 1.0, 1.1, 1.05, 20.0, [0.5] * 9 + [2.5], 0.01, 10)
    assert all(Bench([good], []).held().values())
    for bad in ({"found_m": 1.11}, {"without_m": 1.06}, {"off": [0.5] * 8 + [2.5, -2.5]}):
        held = Bench([Row(**{**vars(good), **bad})], []).held()
        assert sorted(held.values()) == [False, True, True]
    one = Recording("labyrinth_uwb", (), 0.14, 0.056, [[]])
    assert Bench([], [one]).held() == {"labyrinth_uwb": False}


def test_the_page_is_what_was_measured_and_every_aim_is_reached() -> None:
    document = json.loads((PAGE / "results.json").read_text(encoding="utf-8"))
    rows = [Row(**row) for row in document["rows"]]
    recordings = [
        Recording(**{**one, "changes": tuple(one["changes"])}) for one in document["recordings"]
    ]
    bench = Bench(rows, recordings)
    assert {row.name for row in rows} == {error.name for error in trials.ERRORS}
    assert {one.set_name for one in recordings} == set(measure.RECORDINGS)
    assert all(bench.held().values())
    assert page.page(bench) == (PAGE / "README.md").read_text(encoding="utf-8")
    alone = page.page(Bench(rows, []))
    assert alone.startswith("# Constants\n\nMade by `auvest reproduce constants`; ")
    for of_recordings in ("--data", "ecordings", "labyrinth", "hat_charles"):
        assert of_recordings not in alone
    assert alone.count("\n| ") == 2 + len(rows)
    assert alone.endswith(" |\n")
