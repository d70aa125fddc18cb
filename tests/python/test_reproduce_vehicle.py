"""``auvest reproduce vehicle``: the committed page holds what it must, and the code gives it."""

import json
import math

import numpy as np
import pytest
from conftest import ROOT
from typer.testing import CliRunner

from auvest.cli import app
from auvest.reproduce.vehicle import measure
from auvest.simulation import mission

PAGE = ROOT / "docs" / "reproduction" / "vehicle"


@pytest.fixture(scope="module")
def committed():
    return json.loads((PAGE / "results.json").read_text())


def test_every_number_without_noise_is_the_prototypes(committed):
    assert len(committed["checks"]) == 16 + sum(
        12 * len(run["rows"]) for run in measure.reference_runs().values()
    )
    assert all(check["ok"] for check in committed["checks"])


def test_the_code_gives_the_checks_of_the_page(committed):
    by_name = {check["name"]: check for check in committed["checks"]}
    for check in measure._reference_runs():
        assert check.ok
        assert check.value == pytest.approx(by_name[check.name]["value"], abs=1e-9)


def test_the_closed_loop_is_within_its_errors_of_the_prototype(committed):
    rows = committed["closed_loop"]
    assert {row["source"] for row in rows} == set(mission.SOURCES)
    assert all(row["failed_runs"] == 0 for row in rows)
    distances = []
    for row in rows:
        compares = row["source"] != "model_aided_outliers" or (
            row["model_position_m2_s"] == measure.PROTOTYPE_POSITION
        )
        known = measure.REFERENCE.get((row["source"], row["interval_s"]))
        if known is None or not compares:
            continue
        for name, value, error in (
            ("settled", row["settled_rms_m"], row["settled_se_m"]),
            ("all", row["all_rms_m"], row["all_se_m"]),
            ("position", row["position_rms_m"], row["position_se_m"]),
        ):
            wanted, spread = known[row["track"]][name]
            if not math.isnan(wanted):
                both = math.hypot(error, error if math.isnan(spread) else spread)
                distances.append(abs(value - wanted) / both)
    assert len(distances) > 50
    assert np.mean(np.array(distances) <= 2) >= 0.95
    assert max(distances) <= 3.5


def test_the_model_is_worth_half_the_error(committed):
    settled = {
        (row["source"], row["track"], row["interval_s"]): row["settled_rms_m"]
        for row in committed["closed_loop"]
    }
    for track, limit in (("lawnmower", 0.305), ("circle", 0.45)):
        aided = settled["model_aided_crab", track, 0.5]
        assert aided < limit
        assert aided < 0.6 * settled["ukf", track, 0.5]
        assert settled["model_aided_crab", track, 2.0] < settled["ukf", track, 0.5]
        robust = settled["robust_model_aided", track, 0.5]
        assert settled["robust_model_aided_outliers", track, 0.5] < 1.2 * robust


def test_the_filter_is_consistent_where_its_model_holds(committed):
    matched = committed["consistency"][0]
    assert matched["bias_deg"] == 0
    for name, due in (("nis", 2), ("nees_position", 2), ("nees", 4)):
        assert matched[f"{name}_inside"] >= 0.9
        assert matched[name] == pytest.approx(due, rel=0.1)


def test_bounds_are_those_of_the_runs_that_have_a_value():
    """Two of 2 degrees of freedom: from 0.484 / 2 to 11.143 / 2, the table's chi-squared of 4."""
    nan = math.nan
    values = [[2.0, 0.24, 0.25, 5.5, 50.0], [2.0, 0.24, 0.25, 5.5, nan]]
    values += [[2.0, nan, nan, nan, nan]] * 2
    mean, inside = measure._inside(np.array(values), 2)
    assert mean == pytest.approx((2.0 + 0.24 + 0.25 + 5.5) / 4)  # one of four runs is too few
    assert inside == 3 / 4


def test_the_command_makes_page_and_pictures(tmp_path):
    done = CliRunner().invoke(
        app, ["reproduce", "vehicle", "--runs", "2", "--output", str(tmp_path), "--json"]
    )
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert all(check["ok"] for check in document["checks"])
    assert {path.name for path in tmp_path.iterdir()} == {
        ".auvest.json", "README.md", "results.json", "closed_loop.png", "closed_loop.svg",
        "tracks.png", "tracks.svg",
    }  # fmt: skip
    assert document["closed_loop"][0]["runs"] == 2
