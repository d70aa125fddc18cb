"""``auvest reproduce mekf`` and ``simulate mekf``: targets, the committed page, the commands."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from conftest import ROOT
from typer.testing import CliRunner

from auvest import metrics
from auvest.cli import app
from auvest.reproduce import mekf

PAGE = ROOT / "docs" / "reproduction" / "mekf"


@pytest.fixture(scope="module")
def committed():
    return json.loads((PAGE / "results.json").read_text())


def test_the_committed_table_is_within_a_tenth_of_the_reference(committed):
    assert committed["runs"] == mekf.DEFAULT_RUNS
    assert len(committed["contamination"]) == len(mekf.CONTAMINATION)
    for row in committed["contamination"]:
        reference = mekf.CONTAMINATION[row["fraction"], row["outlier_sigma"]]
        for name, wanted in reference.items():
            assert row[name] == pytest.approx(wanted, rel=0.1)
    assert committed["improvement_at_5_percent"] >= 0.3
    assert committed["loss_on_clean_data"] <= 0.03


def test_the_committed_consistency_is_as_it_must_be(committed):
    for row in committed["consistency"]:
        matched = (row["q_factor"], row["r_factor"]) == (1, 1)
        assert row["nis"]["consistent"] is matched, row
        assert row["nees"]["consistent"] is matched, row


def test_the_committed_lock_outs_end_within_twelve_ranges(committed):
    displaced = committed["displaced"]
    assert displaced["igg, recovery"]["back"] == mekf.DISPLACED_RUNS
    assert displaced["igg, recovery"]["settled"] == mekf.DISPLACED_RUNS
    assert displaced["igg, no recovery"]["back"] == 0
    assert displaced["igg, no recovery"]["slowest"] is None


def test_the_committed_numbers_are_what_the_code_gives(committed):
    wanted = committed["contamination"][1]
    noise = mekf.RangeNoise(
        outlier_fraction=wanted["fraction"], outlier_sigma_m=wanted["outlier_sigma"]
    )
    for name in ("ekf", "igg"):
        scenario = mekf.Scenario(noise=noise, runs=committed["runs"], seed=committed["seed"])
        result = mekf.cooperative.simulate(mekf.slave_filter(mekf.KERNELS[name]), scenario)
        assert result.rmse_m == pytest.approx(wanted[name], rel=1e-6)


def test_the_committed_page_shows_the_committed_numbers(committed):
    page = (PAGE / "README.md").read_text()
    for row in committed["contamination"]:
        for name in mekf.KERNELS:
            assert f"{row[name]:.2f} ±" in page
    for picture in re.findall(r"\((\w+\.png)\)", page):
        assert (PAGE / picture).is_file()


def test_reproduce_writes_its_files_and_one_json_object(tmp_path, monkeypatch):
    monkeypatch.setattr(mekf, "CONSISTENCY_STEPS", 60)
    monkeypatch.setattr(mekf, "DISPLACED_STEPS", 60)
    measure = mekf.measure
    monkeypatch.setattr(
        mekf,
        "measure",
        lambda **options: measure(
            **options, steps=300, consistency_runs=4, displaced_runs=mekf.DIRECTIONS
        ),
    )
    arguments = ["reproduce", "mekf", "--runs", "2", "--output", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    row = document["contamination"][0]
    assert set(row) >= {"fraction", "outlier_sigma", "ekf", "igg", "huber", "hampel", "runs"}
    names = {path.name for path in tmp_path.iterdir()}
    assert names >= {"README.md", "results.json", "fig05.png", "fig06.png", "kernels.png",
                     "consistency.png", "fig05.csv", "fig06.csv", "kernels.csv"}  # fmt: skip


QUICK = ["simulate", "mekf", "--runs", "4", "--steps", "400", "--no-figure", "--json"]


def simulated(folder, *options):
    result = CliRunner().invoke(app, [*QUICK, *options, "--output", str(folder)])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["results"]


def test_every_option_of_simulate_changes_the_numbers(tmp_path):
    base = simulated(tmp_path)["robust"]
    options = {
        "kernel": ["--kernel", "huber"],
        "filter": ["--filter", "ukf"],
        "residual": ["--residual", "post-fit"],
        "rejections": ["--rejections", "1"],
        "dtype": ["--dtype", "float32"],
        "noise": ["--noise", "multipath"],
        "range noise": ["--range-noise", "2"],
        "outliers": ["--outliers", "0.2"],
        "outlier sigma": ["--outlier-sigma", "30"],
        "timing": ["--timing", "at-once"],
        "dropout": ["--dropout", "0.3"],
        "late": ["--late", "0.3"],
        "displaced": ["--displaced", "20"],
        "seed": ["--seed", "2"],
    }
    for name, given in options.items():
        assert simulated(tmp_path, *given)["robust"]["rmse_m"] != base["rmse_m"], name
    student = [simulated(tmp_path, "--noise", "student", "--degrees-of-freedom", d)["robust"]
               for d in ("2", "9")]  # fmt: skip
    assert student[0]["rmse_m"] != student[1]["rmse_m"]


def test_unit_is_the_plain_filter(tmp_path):
    results = simulated(tmp_path, "--kernel", "unit")
    assert results["improvement"] == 0
    assert results["plain"]["rmse_m"] == results["robust"]["rmse_m"]


def test_every_message_of_simulate_is_in_its_numbers(tmp_path):
    """80 ranges in 400 s, in each of 4 runs; a range is complete two ranges later."""
    options = ["--timing", "own-time", "--dropout", "0.3", "--late", "0.3"]
    robust = simulated(tmp_path, *options)["robust"]
    assert 0.2 * 320 < robust["lost"] < 0.4 * 320
    assert (robust["too_late"], robust["overflowed"]) == (0, 0)
    on_their_way = 320 - robust["ranges_taken"] - robust["lost"]
    assert 0 < on_their_way <= 4 * 4

    command = [*QUICK, *options, "--output", str(tmp_path)]
    command.remove("--json")
    table = CliRunner().invoke(app, command).stdout
    (shown,) = re.findall(r"lost in the water\D+(\d+)\D+(\d+)", table)
    assert shown == (str(robust["lost"]), str(robust["lost"]))
    assert re.search(r"too many in flight\D+0\D+0", table)


def test_consistency_is_judged_by_the_right_bounds():
    rng = np.random.default_rng(1)
    good = rng.chisquare(2, (200, 300))
    for judge in (metrics.nees_consistency, metrics.nis_consistency):
        assert judge(good, 2).consistent
        assert 0.9 < judge(good, 2).steps_inside < 0.99
        assert not judge(4 * good, 2).consistent
        assert judge(4 * good, 2).steps_inside == 0
    assert metrics.nees_consistency(good, 2).low == metrics.chi2_bounds(2, 200)[0]
    assert metrics.nis_consistency(good, 2).low == metrics.chi2_bounds(2, 60_000)[0]
    good[:, ::2] = np.nan
    assert metrics.nis_consistency(good, 2).low == metrics.chi2_bounds(2, 30_000)[0]
    with pytest.raises(ValueError, match=r"nis has shape \(300,\), expected \(runs, steps\)"):
        metrics.nis_consistency(good[0], 2)
