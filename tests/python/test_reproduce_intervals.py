"""The comparison of interval policies: its judgement, its page, and that the page is not stale."""

import json
import math
import re

import numpy as np
import pytest
from conftest import ROOT
from kept import written
from result_support import tracking_result
from typer.testing import CliRunner

from auvest.cli import app
from auvest.reproduce.intervals import measure as intervals
from auvest.reproduce.intervals.page import page

PAGE = ROOT / "docs" / "reproduction" / "intervals"


def figures(rmse_m, above):
    return intervals.Figures(0.5, rmse_m, above, 0.001, 0)


def case(budget, fixed, law):
    policies = dict(zip(intervals.POLICIES, (budget, fixed, law, law), strict=True))
    return intervals.Case("near, straight", "normal", 0.1, policies)


@pytest.mark.parametrize(
    ("budget", "fixed", "law", "dominates"),
    [
        ((0.10, 0.01), (0.11, 0.02), (0.12, 0.02), True),
        ((0.1019, 0.01), (0.10, 0.02), (0.12, 0.02), True),  # level: at most 2 % above the best
        ((0.1021, 0.01), (0.10, 0.02), (0.12, 0.02), False),
        ((0.10, 0.02), (0.11, 0.02), (0.12, 0.03), False),  # not less time above than the fixed
        ((0.10, 0.02), (0.11, 0.03), (0.12, 0.01), False),  # nor than the law
    ],
)
def test_what_dominates_means(budget, fixed, law, dominates):
    assert case(figures(*budget), figures(*fixed), figures(*law)).dominates is dominates


def test_clearly_less_is_two_standard_errors():
    """Standard errors of 3 % and 4 % are 5 % together: 10 % apart is not enough, 10.1 % is."""

    def with_errors(fixed, law):
        budget = intervals.Figures(0.5, 0.1, 0.1, 0.03, 0)
        rivals = [intervals.Figures(0.5, 0.1, above, 0.04, 0) for above in (fixed, law)]
        return case(budget, *rivals)

    assert with_errors(0.201, 0.201).clearly_less
    assert not with_errors(0.199, 0.201).clearly_less
    assert not with_errors(0.201, 0.199).clearly_less


def test_the_rmse_is_compared_with_the_best():
    one = case(figures(0.3, 0.01), figures(0.2, 0.02), figures(0.25, 0.02))
    assert one.rmse_ratio == pytest.approx(1.5)
    assert case(figures(0.1, 0.01), figures(0.2, 0.02), figures(0.3, 0.02)).rmse_ratio == 1.0


def test_the_figures_of_a_policy_by_hand():
    """Two runs: 1 and 3 of 10 probes above; 10 m^2 in 20 probes; 24 s in 8 samples."""
    result = tracking_result(
        np.zeros((2, 5, 2)),
        time_s=np.array([[2.0, 4.0, 6.0, 8.0, 10.0], [5.0, 10.0, 14.0, np.nan, np.nan]]),
        samples=np.array([5, 3]),
        status=np.array([0, 1]),
        probe_square_sum=np.array([4.0, 6.0]),
        probe_above=np.array([1.0, 3.0]),
        probe_count=np.array([10.0, 10.0]),
    )
    got = intervals._figures(result)
    assert got.interval_s == pytest.approx(3.0)
    assert got.rmse_m == pytest.approx(math.sqrt(0.5))
    assert got.above == pytest.approx(0.2)
    assert got.above_error == pytest.approx(0.1)  # of 0.1 and 0.3: their distance by two
    assert got.failed == 1


def test_summary_and_page_say_what_the_cases_are():
    def point(noise, budget, fixed, law, interval_s=0.4):
        policies = {
            name: intervals.Figures(interval_s, rmse_m, above, 0.01, failed)
            for (rmse_m, above), failed, name in zip(
                (budget, fixed, law, law), range(4), intervals.POLICIES, strict=True
            )
        }
        return intervals.Case("far, straight", noise, 0.45, policies)

    good = point("normal", (0.1, 0.02), (0.12, 0.08), (0.13, 0.09))
    close = point("uniform", (0.1, 0.02), (0.12, 0.03), (0.13, 0.09))
    bad = point("lognormal", (0.15, 0.04), (0.12, 0.03), (0.13, 0.04))
    result = intervals.Reproduction(7, 9, [good, close, bad])
    cases = intervals.summary(result)["cases"]
    assert [c["dominates"] for c in cases] == [True, True, False]
    assert [c["less_time_above"] for c in cases] == [True, True, False]
    assert cases[2]["rmse_over_best"] == pytest.approx(1.25)
    for c in cases:
        assert c["error_budget_m"] == pytest.approx(0.9)  # two sigma
        for failed, name in enumerate(intervals.POLICIES):
            assert c[name]["samples_per_s"] == pytest.approx(2.5)
            assert c[name]["failed_runs"] == failed
    words = " ".join(page(result).split())
    assert "in 2 of 3 points, in 2 of the 2 with normal or uniform noise" in words
    assert "has less time above in 2 of 3." in words
    # 6 % is more than two standard errors of 1.4 %, 1 % is not.
    assert "Of the 2 points, 1 have less time above by more than two standard errors" in words
    assert "the other points: far, straight (1)." in words
    assert "no: RMSE +25.0 %, time above 4.0 against 3.0 %, time above 4.0 against 4.0 %" in words


@pytest.fixture(scope="module")
def committed():
    return json.loads((PAGE / "results.json").read_text())


@pytest.mark.parametrize("index", [0, 17, 35])
def test_committed_results_are_what_the_code_gives(committed, index):
    wanted = committed["cases"][index]
    sigma_m = wanted["error_budget_m"] / intervals.BUDGET_SIGMAS
    got = intervals.measure_case(
        wanted["track"], wanted["noise"], sigma_m, runs=committed["runs"], seed=committed["seed"]
    )
    assert got.dominates is wanted["dominates"]
    for name, f in got.policies.items():
        # The same streams and float64: what is left is the last digit of another C library.
        assert f.rmse_m == pytest.approx(wanted[name]["rmse_m"], rel=1e-6)
        assert f.above == pytest.approx(wanted[name]["time_above_budget"], rel=1e-3)
        assert f.interval_s == pytest.approx(got.policies["budget"].interval_s, rel=0.03)
        assert f.failed == 0


def test_committed_page_is_that_of_the_committed_results(committed):
    cases = [
        intervals.Case(
            c["track"],
            c["noise"],
            c["error_budget_m"] / intervals.BUDGET_SIGMAS,
            {
                name: intervals.Figures(
                    c[name]["mean_interval_s"],
                    c[name]["rmse_m"],
                    c[name]["time_above_budget"],
                    c[name]["time_above_budget_standard_error"],
                    c[name]["failed_runs"],
                )
                for name in intervals.POLICIES
            },
        )
        for c in committed["cases"]
    ]
    result = intervals.Reproduction(committed["runs"], committed["seed"], cases)
    assert page(result) == (PAGE / "README.md").read_text()
    assert (PAGE / "intervals.png").stat().st_size > 10_000


def test_covariance_budget_dominates_without_heavy_tails(committed):
    """The claim of the page, at 200 runs or more."""
    assert committed["runs"] >= 200
    calm = [c for c in committed["cases"] if c["noise"] != "lognormal"]
    assert len(calm) == 24
    assert all(c["dominates"] for c in calm)


def test_command(tmp_path, monkeypatch, kept):
    turning = {name: track for name, track in intervals.TRACKS.items() if "turning" in name}
    monkeypatch.setattr(intervals, "TRACKS", turning)
    monkeypatch.setattr(intervals, "NOISES", ("normal",))
    monkeypatch.setattr(intervals, "BUDGETS", {"near": (0.2,), "far": (0.5,)})
    command = ["reproduce", "intervals", "--runs", "3", "--output", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    kept("reproduce_intervals.txt", written(tmp_path))
    document = json.loads(result.stdout)
    assert [c["track"] for c in document["cases"]] == ["near, turning", "far, turning"]
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        ".auvest.json",
        "README.md",
        "intervals.png",
        "intervals.svg",
        "results.json",
    ]
    assert re.search(r"\| near, turning \| normal \| 0.40 ", (tmp_path / "README.md").read_text())


def test_ctrl_c_keeps_the_points_done(tmp_path, monkeypatch):
    measured = intervals.measure_case
    calls = []

    def interrupted(*point, **options):
        calls.append(point)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return measured(*point, **options)

    monkeypatch.setattr(intervals, "measure_case", interrupted)
    command = ["reproduce", "intervals", "--runs", "2", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 130
    assert "2 of 36 points are written" in result.stderr
    assert len(json.loads((tmp_path / "results.json").read_text())["cases"]) == 2
    assert (tmp_path / "README.md").exists()


def test_command_refuses_no_runs():
    result = CliRunner().invoke(app, ["reproduce", "intervals", "--runs", "0"])
    assert result.exit_code == 2
    assert "--runs" in result.stderr
