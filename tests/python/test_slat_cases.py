"""The page on SlatfJoint and the IMM: its cases, its numbers, and the committed page."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from conftest import ROOT

from auvest import plots
from auvest.reproduce.slat_cases import measure as slat_cases
from auvest.reproduce.slat_cases.figures import FIGURES
from auvest.reproduce.slat_cases.page import page, page_of
from auvest.simulation.slat import SlatResult, simulate

PAGE = ROOT / "docs" / "reproduction" / "slat_cases"


@pytest.fixture(scope="module")
def committed():
    return json.loads((PAGE / "results.json").read_text())


@pytest.fixture(scope="module")
def quick():
    seen = []
    cases = slat_cases.measure(runs=3, particles=8, progress=lambda *both: seen.append(both))
    assert seen[-1] == (40 * 3, 40 * 3)
    return cases


def test_the_masters_meet_where_and_when_they_should():
    for number, level in enumerate(slat_cases.CROSSING_LEVELS):
        scenario = slat_cases.crossing_scenario(number, runs=1, seed=1)
        assert scenario.sigma_range_m == level.sigma_range_m
        assert not scenario.identified
        result = simulate(slat_cases.slat_filter("ekf_slat", scenario), scenario)
        apart = np.hypot(*(result.masters[:, 0] - result.masters[:, 1]).T)
        assert result.time_s[49] == 100.0
        assert apart[49] == pytest.approx(0, abs=1e-6)
        # Straight lines: 50 m at 0 s, 0 m at 100 s, 50 m at 200 s.
        assert apart == pytest.approx(np.abs(100 - result.time_s) / 2, abs=1e-6)
        way = np.sqrt(514.44**2 - 25**2)  # what both have gone along the paper's course, 15 degrees
        middle = [way * np.cos(np.pi / 12), 100 + way * np.sin(np.pi / 12)]
        assert result.masters[49, 0] == pytest.approx(middle, rel=1e-6)


def made_up(estimates, masters):
    """A result of one run in which these were the estimates of two masters: (pings, 2, 2)."""
    columns = {field.name: None for field in fields(SlatResult)}
    columns["masters"] = masters
    columns["master_error"] = (estimates - masters)[None]
    return SlatResult(**columns)


def test_swapped_is_where_both_are_nearer_to_the_other():
    masters = np.array([[[0.0, 0.0], [10.0, 0.0]]] * 4)
    estimates = np.array(
        [
            [[1.0, 0.0], [9.0, 0.0]],
            [[9.0, 0.0], [1.0, 0.0]],
            # One is where the other should be, and the sum of the distances decides.
            [[9.0, 0.0], [10.0, 0.0]],
            [[9.0, 3.0], [4.0, 0.0]],
        ]
    )
    assert slat_cases.swapped(made_up(estimates, masters)).tolist() == [[False, True, False, True]]


def test_a_difference_is_clear_from_two_standard_errors_on():
    assert slat_cases.lower({"mean": -2.1, "standard_error": 1.0})
    assert not slat_cases.lower({"mean": -1.9, "standard_error": 1.0})
    assert not slat_cases.lower({"mean": 2.1, "standard_error": 1.0})


def test_the_imm_has_the_three_models_and_one_straight_model_alone():
    three = slat_cases.imm()
    assert three.share == (0.6, 0.2, 0.2)
    assert (three.straight.velocity_psd, three.turning.acceleration_psd) == (1e-5, 1e-6)
    assert three.accelerated == replace(three.accelerated, acceleration_psd=1e-6, velocity_psd=0.0)
    for name, changes in slat_cases.IMM_CHANGES.items():
        changed = slat_cases.imm(*changes)
        numbers = [
            changed.straight.velocity_psd / three.straight.velocity_psd,
            changed.turning.acceleration_psd / three.turning.acceleration_psd,
            changed.accelerated.acceleration_psd / three.accelerated.acceleration_psd,
            changed.switch_rate_hz / three.switch_rate_hz,
        ]
        expected = {"sw": [1, 1, 1, 4], "st": [10, 1, 1, 1], "ot": [1, 10, 10, 1]}
        kind = "sw" if name.startswith("switching") else "st" if "straight" in name else "ot"
        assert numbers == pytest.approx(expected[kind]), name


def test_a_measurement_holds_what_the_page_and_the_figures_need(quick, tmp_path):
    document = json.loads(json.dumps(slat_cases.summary(quick)))
    assert page_of(document) == page(quick)
    for name, draw in FIGURES.items():
        path = plots.save(draw(quick), tmp_path / f"{name}.png")
        assert path.stat().st_size > 10_000


def test_who_is_told_whose_echo_it_is_swaps_no_masters(quick):
    for row in quick.results["crossing"]:
        assert row["filters"]["told"]["swapped"] == 0
    # While they meet, at 100 s, nearness says nothing.
    far = np.abs(quick.curves["crossing_time_s"] - 100) > 50
    assert quick.curves["crossing_swapped_told"][far].max() == 0


def test_of_each_single_model_the_best_noise_is_compared(committed):
    for case in committed["turning"]:
        for model in ("constant acceleration", "constant velocity"):
            rows = [row for row in case["models"] if row["model"] == model]
            best = min(rows, key=lambda row: row["relative_rmse_m"]["mean"])
            assert [row["compared"] for row in rows] == [row is best for row in rows]
            # It lies within what was tried: neither more nor less would have been better.
            assert best not in (rows[0], rows[-1])
        assert [row["compared"] for row in case["models"] if row["model"] == "IMM"] == [
            True, False, False, False,
        ]  # fmt: skip


def test_differences_are_those_of_the_means(committed):
    for row in committed["crossing"]:
        for rival in ("ekf_slat", "slatf2"):
            for number, difference in row[f"joint_less_{rival}"].items():
                means = [row["filters"][f][number]["mean"] for f in ("slatf_joint", rival)]
                assert difference["mean"] == pytest.approx(means[0] - means[1], abs=1e-9)
    for case in committed["turning"]:
        compared = {row["model"]: row for row in case["models"] if row["compared"]}
        for model, difference in case["imm_less"].items():
            for number in ("relative_rmse_m", "slave_rmse_m"):
                means = [compared[m][number]["mean"] for m in ("IMM", model)]
                assert difference[number]["mean"] == pytest.approx(means[0] - means[1], abs=1e-9)


def test_the_committed_page_is_that_of_the_committed_results(committed):
    assert committed["runs"] == slat_cases.DEFAULT_RUNS
    assert page_of(committed) == (PAGE / "README.md").read_text()
    filters = [f for row in committed["crossing"] for f in row["filters"].values()]
    rows = [row for case in committed["turning"] for row in case["models"]]
    assert not any(one["failed_runs"] for one in (*filters, *rows))


def test_the_committed_numbers_are_what_the_code_gives(committed):
    """Of EKF-SLAT, which takes no time."""
    options = {"runs": committed["runs"], "seed": committed["seed"]}
    scenario = slat_cases.crossing_scenario(0, **options)
    found = simulate(slat_cases.slat_filter("ekf_slat", scenario), scenario)
    row = committed["crossing"][0]["filters"]["ekf_slat"]
    assert found.rmse_m == pytest.approx(row["slave_rmse_m"]["mean"], rel=1e-6)
    ends = slat_cases.swapped(found)[:, -10:].mean(axis=1)
    assert (ends > 0.5).mean() == row["swapped"]

    scenario = slat_cases.turning_scenario(precise=True, **options)
    found = simulate(slat_cases.ekf_slat(scenario, slat_cases.imm()), scenario)
    (row,) = [r for r in committed["turning"][1]["models"] if r["noise"] == "as set"]
    error = found.master_error[:, :, 0] - found.error
    relative = np.sqrt(np.square(error).sum(axis=-1).mean(axis=1))
    assert relative.mean() == pytest.approx(row["relative_rmse_m"]["mean"], rel=1e-6)
    spread = relative.std(ddof=1) / np.sqrt(len(relative))
    assert spread == pytest.approx(row["relative_rmse_m"]["standard_error"], rel=1e-6)
