"""``auvest compare``: what it prints and writes is what the replays of its filters give."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from test_replay_report import log, opened
from typer.testing import CliRunner

from auvest import plots
from auvest.cli import app
from auvest.logs import LogFolder
from auvest.replay import Settings, replay, report, settings_from

FILTERS = ("ekf", "robust-ekf")


def compare(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder of a comparison, and what it printed for machines."""
    folder = tmp_path_factory.mktemp("compared")
    log(folder / "log", truth=True)
    options = [part for name in FILTERS for part in ("--filter", name)]
    options += ["--set", "ranges.sigma_m=0.5", "--output", folder / "out", "--json", "--quiet"]
    ran = compare(folder / "log", *options)
    assert ran.exit_code == 0, ran.output
    # Once more: it takes the place of what was there.
    assert compare(folder / "log", *options).exit_code == 0
    return folder, json.loads(ran.stdout)


def test_each_filter_is_replayed_as_alone(compared: tuple[Path, dict[str, Any]]) -> None:
    folder, told = compared
    settings = settings_from({"ranges": {"sigma_m": 0.5}}, "test")
    for name, one in zip(FILTERS, told["filters"], strict=True):
        alone = replay(LogFolder(folder / "log"), settings, filter_name=name)  # type: ignore[arg-type]
        assert one["filter"] == name
        assert one["rmse_m"] == alone.numbers["rmse_m"]
        assert one["settings"]["ranges"]["sigma_m"] == 0.5
    # The outlier of 50 m takes the filter along that has no kernel.
    assert told["filters"][0]["rmse_m"] > 3 * told["filters"][1]["rmse_m"]


def test_each_filter_goes_back_over_the_log(
    compared: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    folder, told = compared
    options = [part for name in FILTERS for part in ("--filter", name)]
    options += ["--set", "ranges.sigma_m=0.5", "--output", str(tmp_path), "--json", "--quiet"]
    ran = compare(folder / "log", *options, "--smooth", "--lag", 20)
    assert ran.exit_code == 0, ran.output
    settings = settings_from({"ranges": {"sigma_m": 0.5}}, "test")
    found = json.loads(ran.stdout)["filters"]
    for name, one, causal in zip(FILTERS, found, told["filters"], strict=True):
        alone = replay(
            LogFolder(folder / "log"),
            settings,
            filter_name=name,
            smooth=True,
            lag_s=20.0,  # type: ignore[arg-type]
        )
        assert one["smoothed"] == alone.numbers["smoothed"]
        assert one["rmse_m"] == causal["rmse_m"]
        assert (tmp_path / "log" / name / "smoothed.tum").is_file()
    page = (tmp_path / "log" / "report.html").read_text(encoding="utf-8")
    assert '"label": "EKF, smoothed"' in page
    assert '"label": "robust EKF, smoothed"' in page
    assert compare(folder / "log", *options, "--lag", 20).exit_code == 2


def test_what_it_writes(compared: tuple[Path, dict[str, Any]]) -> None:
    folder, told = compared
    made = folder / "out" / "log"
    assert json.loads((made / "results.json").read_text()) == told
    for name in FILTERS:
        tables = {path.name for path in (made / name).iterdir()}
        assert {"estimates.parquet", "measurements.parquet", "trajectory.tum"} <= tables


def test_a_warning_is_of_its_filter_or_of_the_log_where_all_have_it(
    compared: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, _ = compared
    monkeypatch.setattr(report, "warnings", lambda one: ["of all", f"of {one.filter_name}"])
    options = [part for name in FILTERS for part in ("--filter", name)]
    ran = compare(folder / "log", *options, "--output", tmp_path)
    assert ran.exit_code == 0, ran.output
    notes = [line.removeprefix("Note: ") for line in ran.stderr.splitlines() if "of " in line]
    assert notes == ["log: of all", "EKF: of ekf", "robust EKF: of robust-ekf"]


def test_one_page_has_all_tracks(compared: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = compared
    page = (folder / "out" / "log" / "report.html").read_text(encoding="utf-8")
    steps = """
    await step("opened", () => slide(35));
    await step("hidden", () => $("#legend input").click());
    """
    found = opened(page, tmp_path, steps)
    assert found["trouble"] == []
    seen, hidden = found["seen"]["opened"], found["seen"]["hidden"]
    # Of both tracks at one time the places and the errors, and without the first of the second.
    assert len(seen["map"]["at"]) == 2
    (ekf_x, _), (robust_x, _) = seen["map"]["at"]
    errors = seen["charts"]["error-x"]["values"]
    assert errors == pytest.approx([ekf_x - 35, robust_x - 35], abs=1e-3)
    assert hidden["map"]["at"] == seen["map"]["at"][1:]
    assert hidden["charts"]["error-x"]["values"] == errors[1:]
    assert f'"colour": "{plots.FILTER_COLOURS["ekf"]}"' in page
    assert "<td>EKF</td><td>robust EKF</td>" in page
    assert '<tr><th>rejected</th><td class="number">0</td><td class="number">1</td></tr>' in page


def test_figures_are_joined_by_their_names() -> None:
    joined = report.side_by_side([[("a", "1"), ("c", "3")], [("a", "2"), ("b", "4"), ("c", "5")]])
    assert joined == [("a", "1", "2"), ("b", "", "4"), ("c", "3", "5")]


def test_what_is_said_of_all_is_said_once() -> None:
    found = report.by_filter(["EKF", "UKF"], [["late", "own"], ["late"]])
    assert found == [("", ["late"]), ("EKF", ["own"]), ("UKF", [])]


@pytest.mark.parametrize(
    ("filters", "said"),
    [
        (["ekf"], "--filter: give two filters or more, each once"),
        (["ekf", "ekf"], "--filter: give two filters or more, each once"),
        (["ekf", "kalman"], "filter must be ekf,"),
        (["ekf", "aukf"], "filter aukf chooses when to take"),
    ],
)
def test_what_it_refuses(tmp_path: Path, filters: list[str], said: str) -> None:
    log(tmp_path / "log", truth=False)
    options = [part for name in filters for part in ("--filter", name)]
    ran = compare(tmp_path / "log", *options, "--output", tmp_path / "out")
    assert ran.exit_code == 2
    assert said in ran.output.replace("\n", " ")
    assert not list((tmp_path / "out").rglob("*.html"))


def test_the_table_has_a_column_for_each_filter(tmp_path: Path) -> None:
    log(tmp_path / "log", truth=True)
    ran = compare(
        tmp_path / "log", "--filter", "ekf", "--filter", "ckf", "--output", tmp_path / "out"
    )
    assert ran.exit_code == 0
    shown = {row.split("│")[1].strip(): row for row in ran.stdout.splitlines() if "│" in row}
    expected = [
        dict(report.rows(replay(LogFolder(tmp_path / "log"), Settings(), filter_name=name)))
        for name in ("ekf", "ckf")
    ]
    cells = [cell.strip() for cell in shown["position RMSE"].split("│")[2:4]]
    assert cells == [one["position RMSE"] for one in expected]
