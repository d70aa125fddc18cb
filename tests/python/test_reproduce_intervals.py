"""The comparison of interval policies: its judgement, its page, and that the page is not stale."""

import json
import re

import pytest
from conftest import ROOT
from typer.testing import CliRunner

from auvest.cli import app
from auvest.reproduce import intervals

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
    page = intervals.page(cases, runs=committed["runs"], seed=committed["seed"])
    assert page == (PAGE / "README.md").read_text()
    assert (PAGE / "intervals.png").stat().st_size > 10_000


def test_covariance_budget_dominates_without_heavy_tails(committed):
    """The claim of the page, at 200 runs or more."""
    assert committed["runs"] >= 200
    calm = [c for c in committed["cases"] if c["noise"] != "lognormal"]
    assert len(calm) == 24
    assert all(c["dominates"] for c in calm)


def test_command(tmp_path, monkeypatch):
    turning = {name: track for name, track in intervals.TRACKS.items() if "turning" in name}
    monkeypatch.setattr(intervals, "TRACKS", turning)
    monkeypatch.setattr(intervals, "NOISES", ("normal",))
    monkeypatch.setattr(intervals, "BUDGETS", {"near": (0.2,), "far": (0.5,)})
    command = ["reproduce", "intervals", "--runs", "3", "--output", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert [c["track"] for c in document["cases"]] == ["near, turning", "far, turning"]
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "README.md",
        "intervals.png",
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
