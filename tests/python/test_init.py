"""``auvest init``: a first settings file, of a log as it is and of what recorders left."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_check import arc
from typer.testing import CliRunner

from auvest.cli import app
from auvest.logs.guess import _by_size, guess, table_of
from auvest.logs.layout import FILES, SPELLINGS, WHAT
from auvest.logs.write import write_file
from auvest.replay import Settings, read_settings
from auvest.replay.checks import check
from auvest.replay.first import first_settings
from auvest.replay.schema import SCHEMA, text


def recorders(folder: Path) -> Path:
    """The log of ``arc`` as others write it: a DVL in mm/s, a yaw rate in degrees, milliseconds."""
    arc(folder)
    time = np.arange(61)
    rows = "".join(f"{1764316800000 + 1000 * t};1000,0;1,1459156\n" for t in time)
    (folder / "odometry.csv").unlink()
    (folder / "dvl_export.csv").write_text(f"Timestamp;Vx;Yaw rate [deg/s]\n{rows}")
    ranges = (folder / "ranges.csv").read_text().splitlines()[1:]
    (folder / "ranges.csv").unlink()
    parted = [line.split(",") for line in ranges]
    lines = [f"{1764316800 + float(t)}\t{k}\t{r}\tx\n" for t, k, r in parted]
    (folder / "modem.txt").write_text("t [s]\tBeacon\tSlant range (m)\tcomment\n" + "".join(lines))
    write_file(folder, "start.csv", time_s=[1764316800.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    (folder / "truth.csv").unlink()
    (folder / "voltages.csv").write_text("a,b\n1,2\n3,4\n")
    return folder


def test_recorders_files_are_guessed_and_the_log_is_sound(tmp_path: Path) -> None:
    made = first_settings(recorders(tmp_path))
    assert made.unknown == ["voltages.csv"]
    assert made.checked.verdict == "sound"
    (tmp_path / "auvest.toml").write_text(made.text)
    files = read_settings(tmp_path / "auvest.toml").files
    assert set(files) == {"odometry.csv", "ranges.csv"}
    dvl, modem = files["odometry.csv"], files["ranges.csv"]
    assert (dvl.file, dvl.separator, dvl.decimal) == ("dvl_export.csv", ";", ",")
    assert dvl.columns == {
        "time_s": "Timestamp", "speed_m_s": "Vx", "yaw_rate_rad_s": "Yaw rate [deg/s]",
    }  # fmt: skip
    assert dvl.units == {"time_s": "ms", "speed_m_s": "mm/s", "yaw_rate_rad_s": "deg/s"}
    assert (modem.file, modem.separator) == ("modem.txt", "\t")
    assert modem.columns["range_m"] == "Slant range (m)"


def test_a_log_as_it_is_needs_no_mapping_and_its_noise_is_seen(tmp_path: Path) -> None:
    """The ranges of ``arc`` have 0.1 m; the default is ten times that."""
    made = first_settings(arc(tmp_path))
    (tmp_path / "auvest.toml").write_text(made.text)
    settings = read_settings(tmp_path / "auvest.toml")
    assert (settings.files, settings.odometry) == ({}, Settings().odometry)
    assert 0.05 < settings.ranges.sigma_m < 0.2


def test_what_is_found_stands_in_comments(tmp_path: Path) -> None:
    arc(tmp_path)
    (tmp_path / "range.csv").write_text("time_s,source\n0,1\n")
    made = first_settings(tmp_path)
    assert "# auvest check says: sound" in made.text
    assert "#   ignored_file: range.csv: is not read" in made.text
    assert "# Nothing is known of range.csv." in made.text


@pytest.mark.parametrize(
    ("name", "header", "row", "kind"),
    [
        ("gps.csv", "utc,lat,lon", "2026-05-04T06:30:00Z,43.1,5.9", "positions.csv"),
        ("gps_truth.csv", "utc,lat,lon", "2026-05-04T06:30:00Z,43.1,5.9", "truth.csv"),
        ("buoys.csv", "id,Easting [m],Northing [m]", "1,5.0,7.0", "beacons.csv"),
        ("ships.csv", "t,ship,x,y", "1.0,3,5.0,7.0", "leaders.csv"),
        ("usbl.csv", "t,id,range,azimuth (deg)", "1.0,3,50.0,270", "fixes.csv"),
        ("keller.csv", "t,depth_cm", "1.0,330", "depth.csv"),
        ("hdt.csv", "t,heading", "1.0,330", "compass.csv"),
        ("wheel.csv", "t,distance,turn_rad", "1.0,0.5,0.1", None),
        ("notes.txt", "in the morning, rain", "then, sun", None),
    ],
)
def test_what_a_table_is(tmp_path: Path, name: str, header: str, row: str, kind: Any) -> None:
    (tmp_path / name).write_text(f"{header}\n{row}\n{row}\n")
    found = guess(tmp_path)
    assert list(found.files) == ([kind] if kind else [])
    assert found.unknown == ([] if kind else [name])


@pytest.mark.parametrize("name", ["time", "Time", "time (s)", "time_sec", "seconds", "t"])
@pytest.mark.parametrize("file", ["ranges.csv", "nav.csv"])
def test_a_column_of_seconds_is_one_whatever_its_name(tmp_path: Path, name: str, file: str) -> None:
    """``time`` of a log is in ISO 8601, but most people call their seconds so."""
    arc(tmp_path)
    taken = "ranges.csv" if file == "ranges.csv" else "odometry.csv"
    header, rows = (tmp_path / taken).read_text().split("\n", 1)
    (tmp_path / taken).unlink()
    (tmp_path / file).write_text(f"{header.replace('time_s', name)}\n{rows}")
    made = first_settings(tmp_path)
    assert made.files[taken].columns["time_s"] == name
    assert made.checked.verdict == "sound"


def test_names_of_beacons_are_refused_where_they_stand(tmp_path: Path) -> None:
    arc(tmp_path)
    for file, column in (("ranges.csv", 1), ("beacons.csv", 0)):
        header, *rows = [line.split(",") for line in (tmp_path / file).read_text().splitlines()]
        for row in rows:
            row[column] = f"B{row[column]}"
        text = [",".join(["beacon" if one == "source" else one for one in header])]
        (tmp_path / file).write_text("\n".join([*text, *map(",".join, rows)]) + "\n")
    (found,) = first_settings(tmp_path).checked.findings
    assert (found.file, found.line) == ("ranges.csv", 2)
    assert "column beacon: 'B1' is not a number; sources have numbers" in found.message


def test_a_finding_names_the_file_that_was_taken(tmp_path: Path) -> None:
    log = recorders(tmp_path)
    settings = Settings(files=first_settings(log).files)
    with (log / "dvl_export.csv").open("a") as file:
        file.write("1764316861000;x;0;0\n")
    (found,) = [one for one in check(log, settings).findings if one.cause == "unreadable"]
    assert (found.file, found.line) == ("dvl_export.csv", 63)


def test_units_by_name_and_by_size(tmp_path: Path) -> None:
    (tmp_path / "usbl.csv").write_text("t [ms],id,range (cm),bearing\n1,3,50.0,270\n2,3,51,1\n")
    (made,) = guess(tmp_path).files.values()
    assert made.units == {"time_s": "ms", "range_m": "cm", "azimuth_rad": "deg"}


def test_both_speeds_of_an_instrument_are_in_its_unit(tmp_path: Path) -> None:
    """Forward some 1,000 mm/s; to starboard so few that they might be metres."""
    lines = "".join(f"{t},{1000 + t},{t % 3}\n" for t in range(20))
    (tmp_path / "dvl.csv").write_text(f"time_s,Vx,Vy\n{lines}")
    (made,) = guess(tmp_path).files.values()
    assert (made.units["speed_m_s"], made.units["starboard_m_s"]) == ("mm/s", "mm/s")


@pytest.mark.parametrize(
    ("depth", "step_s", "range_m", "unit"),
    [
        ([330, 331, 329, 334, 335], 0.2, None, "cm"),  # in metres it would dive at 5 m/s and more
        ([330.5, 331.2, 329.9, 330.1, 330.2], 0.2, 50.0, "cm"),  # deeper than any range
        ([3.30, 3.31, 3.29, 3.34, 3.35], 0.2, 50.0, None),
        ([12, 13, 13, 14, 16], 5.0, 50.0, None),  # whole metres
        ([12, 12, 12, 12, 12], 0.2, 50.0, None),
        ([330, 330.5, 329, 330, 331], 0.2, 500.0, None),  # a deep craft
    ],
)
def test_a_depth_in_centimetres_is_seen(
    tmp_path: Path, depth: list[float], step_s: float, range_m: float | None, unit: str | None
) -> None:
    rows = [f"{k * step_s},{value}" for k, value in enumerate(depth)]
    (tmp_path / "keller.csv").write_text("\n".join(["t,depth", *rows, ""]))
    if range_m is not None:
        (tmp_path / "ranges.csv").write_text(f"time_s,source,range_m\n1,3,{range_m}\n2,3,9\n")
    assert guess(tmp_path).files["depth.csv"].units.get("depth_m") == unit


def test_a_table_has_a_header_of_names(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for wrong in ("1,2\n3,4\n", "a\nb\n", "", "a,a\n1,2\n"):
        path.write_text(wrong)
        assert table_of(path) is None
    path.write_bytes(b"\xff\xfe")
    assert table_of(path) is None


def call(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_the_command_writes_once(tmp_path: Path) -> None:
    arc(tmp_path / "log")
    told = call("init", tmp_path / "log", "--json", "--quiet")
    assert told.exit_code == 0, told.output
    document = json.loads(told.stdout)
    path = tmp_path / "log" / "auvest.toml"
    assert (document["settings"], document["verdict"]) == (str(path), "sound")
    assert path.read_text().startswith(f"#:schema {SCHEMA.as_uri()}\n")
    path.write_text("# mine\n")
    refused = call("init", tmp_path / "log")
    assert refused.exit_code == 2
    assert "--force replaces it" in refused.stderr
    assert path.read_text() == "# mine\n"
    assert call("init", tmp_path / "log", "--force", "--quiet").exit_code == 0
    assert path.read_text() != "# mine\n"
    said = call("init", tmp_path / "nowhere").stderr
    assert said == f"Error: LOG: {tmp_path / 'nowhere'}: there is no such folder\n"


def test_a_full_turn_that_was_rounded_is_not_in_degrees() -> None:
    assert _by_size("heading_rad", [0.0, 6.2832]) == ""
    assert _by_size("heading_rad", [0.0, 6.2834]) == "deg"


def test_the_command_says_what_it_took_for_what_and_what_is_wrong(tmp_path: Path) -> None:
    log = recorders(tmp_path / "log")
    (log / "start.csv").unlink()
    told = call("init", log)
    lines = told.stdout.splitlines()
    assert "odometry.csv dvl_export.csv, time_s from 'Timestamp' in ms, speed_m_s from" in lines[1]
    assert any("no start.csv (time_s,x_m,y_m,heading_rad" in line for line in lines[2:])
    assert lines[-1] == "verdict     not trusted"


@pytest.mark.parametrize("command", ["check", "replay", "calibrate", "compare"])
def test_settings_beside_a_log_are_not_overlooked_in_silence(tmp_path: Path, command: str) -> None:
    own = arc(tmp_path / "log") / "auvest.toml"
    own.write_text("")
    options = ["--filter", "ekf", "--filter", "ukf"] if command == "compare" else []
    results = [] if command == "check" else ["--output", tmp_path / "out"]
    given = [command, tmp_path / "log", *options, *results]
    assert f"{own} is not read: add --config {own}" in call(*given).stderr.replace("\n", "")
    assert "is not read" not in call(*given, "--config", own).stderr


def test_the_command_prints_the_schema() -> None:
    assert call("init", "--schema").stdout == text()


@pytest.mark.parametrize("command", ["init", "check", "replay", "compare", "calibrate"])
def test_layout_shows_every_file_and_column_of_a_log(command: str) -> None:
    """What it shows of each file is taken as the header of one."""
    shown = CliRunner().invoke(app, [command, "--layout"])
    assert (shown.exit_code, shown.stderr) == (0, "")
    name, seen = "", dict.fromkeys(FILES, 0)
    for line in shown.stdout.split("Other names")[0].splitlines():
        if (file := line[:17].strip()) in FILES:
            name = file
            assert line[18:] == WHAT[file]
        elif name and line:
            layout = FILES[name][seen[name]]
            required, _, optional = line[5:].rstrip("]").partition("[,")
            assert required.split(",") == [column.name for column in layout.required]
            assert [one for one in optional.split(",") if one] == [
                column.name for column in layout.optional
            ]
            seen[name] += 1
    assert seen == {file: len(layouts) for file, layouts in FILES.items()}
    assert list(WHAT) == list(FILES)
    for names, others in SPELLINGS.items():
        assert f"  {','.join(names):14} {','.join(others[0])}" in shown.stdout
