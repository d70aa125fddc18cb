"""Names and files that a user may have: one clear line or no effect, and never a traceback."""

import io
import json
import os
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from auvest.cli import app
from auvest.commands.console import Terminal
from auvest.logs import LogError, LogFolder
from auvest.logs.write import write_file
from auvest.replay import read_settings

#: A formula that is none, markup that is none, a line break, letters that no font has, no text.
HOSTILE = "dive$\\frac{$1[old]\n\u6df1\udcff"


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "1000"})


def small_log(folder: Path) -> Path:
    time_s = np.arange(12.0)
    ranges = np.hypot(time_s - 5, 30)
    one = np.ones(12)
    write_file(folder, "odometry.csv", time_s=time_s, speed_m_s=one, yaw_rate_rad_s=0 * one)
    write_file(folder, "beacons.csv", source=[1], x_m=[5.0], y_m=[30.0])
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    write_file(folder, "ranges.csv", time_s=time_s, source=one.astype(int), range_m=ranges)
    return folder


def test_any_name_of_a_log_is_replayed_and_shown_as_it_is(tmp_path: Path) -> None:
    """With a matplotlibrc that asks for LaTeX, which is not there."""
    log = small_log(tmp_path / HOSTILE)
    output = tmp_path / "out[" / "x]"  # together the end of a markup
    with mpl.rc_context({"text.usetex": True}):
        result = call("replay", log, "--output", output)
        assert mpl.rcParams["text.usetex"]  # the user's own is as it was
    assert result.exit_code == 0, result.output
    assert [path.name for path in output.iterdir()] == [HOSTILE]
    folder = output / HOSTILE
    assert (folder / "report.html").stat().st_size > 50_000
    assert json.loads((folder / "results.json").read_text())["log"] == HOSTILE
    name = "dive$\\frac{$1[old]\\n\u6df1\\udcff"  # what cannot be printed, as Python has it
    assert f"{name}, robust-ekf" in result.stdout
    assert f"out[/x]/{name}/report.html" in result.stdout
    assert result.stderr == ""


def test_a_console_that_cannot_show_a_name_shows_its_code(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(shown, encoding="cp1252"))
    Terminal(as_json=False, quiet=False).result("dive_\u6df1")
    sys.stdout.flush()
    assert shown.getvalue() == b"dive_\\u6df1\n"


def test_settings_may_begin_with_a_mark_and_have_no_endless_brackets(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_bytes(b"\xef\xbb\xbf[filter]\nkind = 'ekf'\n")  # as Windows writes it
    assert read_settings(path).filter.kind == "ekf"
    path.write_text("x = " + "[" * 800 + "]" * 800)
    with pytest.raises(ValueError, match=r"settings\.toml: is not TOML: brackets in brackets"):
        read_settings(path)


def test_what_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    log = small_log(tmp_path / "log")
    os.mkfifo(log / "truth.csv")
    with pytest.raises(LogError, match=r"truth\.csv: is not a file"):
        LogFolder(log)
    with pytest.raises(ValueError, match=r"truth\.csv: is not a file"):
        read_settings(log / "truth.csv")
    with pytest.raises(ValueError, match="null: is not a file"):
        read_settings(Path("/dev/null"))
    os.mkfifo(tmp_path / "fixes_1.csv")
    result = call("import", "ugps_pier59", tmp_path, tmp_path / "out")
    assert result.exit_code == 2
    assert "fixes_1.csv: is not a file" in result.stderr
    assert not (tmp_path / "out").exists()
