"""``auvest reproduce aukf``: its claims, and that the committed page is its output."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from result_support import tracking_result
from typer.testing import CliRunner

from auvest import Aukf, MahalanobisInterval
from auvest.cli import app
from auvest.commands import reproduce
from auvest.commands.console import to_json
from auvest.reproduce import claims as every_claim
from auvest.reproduce.aukf import claims as aukf_claims
from auvest.reproduce.aukf import measure as aukf
from auvest.reproduce.claims import TOO_FEW
from auvest.reproduce.markdown import fill, number, table
from auvest.simulation.paper_aukf import (
    ASSUMPTIONS,
    TrackName,
    paper_filter,
    paper_noise,
    paper_track,
)
from auvest.simulation.tracking import Scenario, simulate

COMMITTED = Path(__file__).parents[2] / "docs" / "reproduction" / "aukf"
FIGURES = [f"fig{number:02d}" for number in range(1, 11)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reproduce-aukf")


@pytest.fixture(scope="module")
def output(folder: Path) -> dict[str, Any]:
    """The command as it stands, default settings."""
    result = CliRunner().invoke(app, ["reproduce", "aukf", "--json", "--output", str(folder)])
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    assert '"failed_runs": 0' in result.stdout
    value: dict[str, Any] = json.loads(result.stdout)
    return value


@pytest.fixture(scope="module")
def small() -> aukf.Reproduction:
    return aukf.measure(runs=6, seed=3)


def test_figure3_has_the_papers_shape(output: dict[str, Any]) -> None:
    interval = np.array(output["figure3"]["interval_s"])
    assert interval.shape == (60,)
    assert interval[0] == 0.5
    assert interval[:6].min() < 0.45
    assert interval[15] > 0.5
    assert interval[-20:].min() > 0.55
    assert interval[-20:].max() < 0.65
    assert output["figure3"]["ukf_interval_s"] == pytest.approx([0.5] * 60)


def test_table1_collapses(output: dict[str, Any]) -> None:
    table1 = output["table1"]
    assert table1["interval_s"][0] == 0.5
    assert len(table1["interval_s"]) == 60
    assert max(table1["max_interval_s"][4:]) <= max(0.018, table1["t_min_s"])


def test_errors_are_reported_for_each_noise(output: dict[str, Any]) -> None:
    assert list(output["errors"]) == ["uniform", "normal", "lognormal"]
    for errors in output["errors"].values():
        equal = errors["equal_rate"]
        assert 0 < errors["ukf_rmse_m"] < 1
        assert errors["aukf_rmse_m"] == equal["aukf_rmse_m"]
        assert equal["interval_s"] == pytest.approx(errors["mean_interval_s"], rel=1e-12)
        assert errors["aukf_excess"] == pytest.approx(
            errors["aukf_rmse_m"] / errors["ukf_rmse_m"] - 1, rel=1e-9
        )
        assert errors["runs"] == output["runs"] == 200
        assert 0 < errors["ukf_rmse_standard_error_m"] < 0.05 * errors["ukf_rmse_m"]


def test_errors_are_those_of_a_direct_simulation(output: dict[str, Any]) -> None:
    noise = paper_noise("lognormal")
    scenario = Scenario(track=paper_track(), noise=noise, runs=200, seed=1)
    errors = output["errors"]["lognormal"]
    for name in ("ukf", "aukf", "ekf"):
        result = simulate(paper_filter(name, noise=noise), scenario)
        assert errors[f"{name}_rmse_m"] == pytest.approx(result.rmse_m, rel=1e-12)


def test_bias_costs(output: dict[str, Any]) -> None:
    for kind, clean in output["errors_bias_removed"].items():
        assert clean["ukf_rmse_m"] < 0.7 * output["errors"][kind]["ukf_rmse_m"]
        assert clean["ukf_nees"] < 2.2 < output["errors"][kind]["ukf_nees"]


def test_tau0_acts_on_the_first_interval_only(output: dict[str, Any]) -> None:
    cases = output["tau0"]
    assert list(cases) == ["0.1", "0.3", "0.5", "0.9"]
    first = [case["interval_s"][1] for case in cases.values()]
    assert first == sorted(first)
    assert first[3] - first[0] > 0.5
    later = np.array([case["interval_s"][8:] for case in cases.values()])
    assert np.ptp(later, axis=0).max() < 0.01
    assert cases["0.5"]["interval_s"] == output["figure3"]["interval_s"]


def test_distance_knows_growth_and_not_size(output: dict[str, Any]) -> None:
    findings = output["findings"]
    for case in findings["constant_offset"]:
        assert case["mahalanobis_squared"] == pytest.approx(1.5, abs=0.02)
    for case in findings["growing_offset"]:
        g2 = case["growth"] ** 2
        expected = 0.75 + 1.5 * g2 / (1 + g2)
        assert case["mahalanobis_squared"] == pytest.approx(expected, rel=1e-6)
        assert case["tau"] == pytest.approx(1.6 / (expected + 1), rel=1e-6)


def test_law_has_two_states(output: dict[str, Any]) -> None:
    starts = output["findings"]["start_interval"]
    assert starts[0]["quiet_s"] > 0.5
    assert starts[0]["collapsed"] == 0
    assert starts[-1]["initial_s"] == 0.002
    assert starts[-1]["quiet_s"] == pytest.approx(0.002)
    assert starts[-1]["collapsed"] == 1


def test_float32_follows_float64_with_the_papers_alpha(output: dict[str, Any]) -> None:
    assert 0 < output["findings"]["float32_difference_m"] < 1e-4


def test_claims_cover_every_figure(output: dict[str, Any]) -> None:
    text = " ".join(claim["where"] for claim in output["claims"])
    for word in ("Introduction", "Abstract", "2.1", "2.2", "3.1", "3.2", "3.3", "3.4", "4"):
        assert word in text
    for figure in ("Fig. 1", "Fig. 2", "Fig. 3", "Figs 4 to 7", "Fig. 8", "Fig. 9", "Fig. 10"):
        assert figure in text
    assert len(output["claims"]) == 24
    assert len(output["assumptions"]) == len(ASSUMPTIONS)


def test_verdicts_follow_the_numbers(
    small: aukf.Reproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert {claim.verdict for claim in aukf_claims.claims(small)} == {TOO_FEW}  # six runs
    monkeypatch.setattr(every_claim, "LEAST_RUNS", 6)

    def verdict(result: aukf.Reproduction, where: str) -> str:
        return next(c.verdict for c in aukf_claims.claims(result) if c.where == where)

    case = small.noises["normal"]
    swapped = aukf.Comparison(
        noise=case.noise,
        ukf=case.aukf,
        aukf=case.ukf,
        equal_rate=case.equal_rate,
        same_time=case.same_time,
        ekf=case.ekf,
    )
    other = aukf.Reproduction(**{**vars(small), "noises": {**small.noises, "normal": swapped}})
    assert verdict(small, "3.4, Fig. 9") == aukf_claims.NO
    assert verdict(other, "3.4, Fig. 9") == aukf_claims.YES
    assert verdict(other, "3.2, Fig. 3") == aukf_claims.NO


@pytest.mark.parametrize("name", ["README.md", *(f"{stem}.csv" for stem in FIGURES)])
def test_committed_page_is_fresh(output: dict[str, Any], folder: Path, name: str) -> None:
    del output
    fresh = (folder / name).read_text(encoding="utf-8").splitlines()
    committed = (COMMITTED / name).read_text(encoding="utf-8").splitlines()
    hint = "run: auvest reproduce aukf --output docs/reproduction/aukf"
    assert len(fresh) == len(committed), hint
    for made, kept in zip(fresh, committed, strict=True):
        assert made == kept or _same_numbers(made, kept), hint


def _same_numbers(made: str, kept: str) -> bool:
    """CSV rows: equal to the last printed digit or so."""
    a, b = made.split(","), kept.split(",")
    try:
        return len(a) == len(b) and all(
            abs(float(x) - float(y)) <= 1e-5 * max(1e-3, abs(float(y)))
            for x, y in zip(a, b, strict=True)
        )
    except ValueError:
        return False


def test_committed_results_are_fresh(output: dict[str, Any]) -> None:
    committed = json.loads((COMMITTED / "results.json").read_text(encoding="utf-8"))
    fresh = dict(output)
    for value in (committed, fresh):
        value.pop("version")
    _compare(fresh, committed, "")


def _compare(made: Any, kept: Any, path: str) -> None:
    if isinstance(kept, dict):
        assert list(made) == list(kept), path
        for key in kept:
            _compare(made[key], kept[key], f"{path}.{key}")
    elif isinstance(kept, list):
        assert len(made) == len(kept), path
        for index, item in enumerate(kept):
            _compare(made[index], item, f"{path}[{index}]")
    elif isinstance(kept, float):
        # The largest of many rounding differences is itself not reproducible to many digits.
        loose = path.endswith("float32_difference_m")
        assert made == pytest.approx(kept, rel=0.5 if loose else 1e-6), path
    else:
        assert made == kept, path


def test_every_figure_is_there_and_shown(output: dict[str, Any], folder: Path) -> None:
    del output
    page = (folder / "README.md").read_text(encoding="utf-8")
    for stem in FIGURES:
        assert f"({stem}.png)" in page
        for place in (folder, COMMITTED):
            picture = (place / f"{stem}.png").read_bytes()
            assert picture.startswith(b"\x89PNG")
            assert 10_000 < len(picture) < 150_000
        with (folder / f"{stem}.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        assert len(rows) == 60


def test_the_page_names_assumptions_and_findings(output: dict[str, Any], folder: Path) -> None:
    del output
    page = (folder / "README.md").read_text(encoding="utf-8")
    for assumption in ASSUMPTIONS:
        assert f"| {assumption.quantity} |" in page
    for heading in ("### 1. Table 1", "### 2. What gives", "### 3. Noise of", "### 4. tau carries"):
        assert heading in page
    assert "nan" not in page


def test_workers_do_not_change_the_numbers(small: aukf.Reproduction) -> None:
    again = aukf.measure(runs=6, seed=3, workers=1)
    assert to_json(aukf.summary(again)) == to_json(aukf.summary(small))


def test_progress_ends_with_everything_done() -> None:
    calls: list[tuple[int, int]] = []
    aukf.measure(runs=2, progress=lambda done, total: calls.append((done, total)))
    assert [done for done, _ in calls] == list(range(1, len(calls) + 1))
    assert {total for _, total in calls} == {len(calls)}


def test_one_run_is_enough_for_a_page(tmp_path: Path) -> None:
    arguments = ["reproduce", "aukf", "--runs", "1", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert str(tmp_path / "README.md") in result.stdout
    value = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert value["errors"]["normal"]["ukf_rmse_standard_error_m"] is None


def test_interrupt_keeps_what_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(reproduce, "save_figures", interrupted)
    arguments = ["reproduce", "aukf", "--runs", "2", "--json", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 130
    assert result.stdout == ""
    assert "12 files are written" in result.stderr
    assert (tmp_path / "README.md").exists()


def test_observed_law_matches_the_class() -> None:
    """The page's constants are those of the presets, not copies of them."""
    law = MahalanobisInterval("table1")
    assert (law.gamma1_m2, law.gamma2, law.epsilon, law.scale) == (10, 100, 1.6, 0.1)
    assert (law.initial_s, law.max_s) == (0.5, 1)
    filter_ = paper_filter("aukf", noise=paper_noise())
    assert isinstance(filter_, Aukf)
    assert (filter_.alpha, filter_.beta, filter_.kappa) == (1e-6, 2, -3)
    assert filter_.process.discretisation == "euler"
    assert filter_.x[:4].tolist() == [0.2, 2, 0.1, 0.2]


@pytest.mark.parametrize("track", ["paper", "straight", "turn"])
def test_the_filter_starts_as_its_track_does(track: TrackName) -> None:
    """Acceleration of x0 = second difference of the truth, for the discretisation of the track."""
    quiet = paper_noise(range_m=1e-6, bearing_rad=1e-6)
    interval_s = 1e-3
    filter_ = paper_filter("ukf", noise=quiet, track=track)
    scenario = Scenario(
        track=paper_track(track), noise=quiet, steps=2, runs=1, interval_s=interval_s
    )
    truth = simulate(filter_, scenario).truth[0]
    velocity = (truth[0] - filter_.x[:2]) / interval_s
    acceleration = (truth[1] - 2 * truth[0] + filter_.x[:2]) / interval_s**2
    assert velocity == pytest.approx(filter_.x[2:4], abs=1e-4)
    assert acceleration == pytest.approx(filter_.x[4:], abs=1e-5)
    assert filter_.process.discretisation == ("euler" if track == "paper" else "exact")


def test_the_figures_of_a_result_by_hand() -> None:
    """Two runs with mean squares of (0 + 2) / 2 = 1 and (36 + 62) / 2 = 49 m^2."""
    result = tracking_result([[[0, 0], [1, -1]], [[0, 6], [np.sqrt(62), 0]]])
    assert aukf.square_per_run(result) == pytest.approx([1, 49])
    assert aukf.square_per_run(result, 1) == pytest.approx([0.5, 18])
    # The mean of 1 and 49 is 25 with a standard error of 24; that of the root is 24 / (2 * 5).
    assert aukf.rmse(result) == aukf.Estimate(pytest.approx(5.0), pytest.approx(2.4))
    assert aukf.rmse(result, 0).value == pytest.approx(np.sqrt((0.5 + 31) / 2))
    one = aukf.rmse(tracking_result([[[3, 4]]]))
    assert one.value == 5.0
    assert np.isnan(one.standard_error)
    # First step: 0 and 36; second: 2 and 62.
    assert aukf.halves(result) == pytest.approx((np.sqrt(18), np.sqrt(32)))
    # An odd number of steps: the one in the middle belongs to the second half.
    assert aukf.halves(tracking_result([[[1, 0], [2, 0], [4, 0]]])) == pytest.approx(
        (1, np.sqrt(10))
    )
    assert aukf.rms_per_step(result, 1) == pytest.approx([np.sqrt(18), np.sqrt(0.5)])
    # At even times, between samples too: 8 / 2 and 50 / 1, a mean of 27 with an error of 23.
    probed = tracking_result(
        [[[0, 0]], [[0, 0]]],
        probe_square_sum=np.array([8.0, 50.0]),
        probe_count=np.array([2.0, 1.0]),
    )
    over_time = aukf.rmse_over_time(probed)
    assert over_time.value == pytest.approx(np.sqrt(27))
    assert over_time.standard_error == pytest.approx(23 / (2 * np.sqrt(27)))


def test_an_excess_is_that_of_paired_runs() -> None:
    """RMSE of 2 m over 1 m: an excess of 1, without any doubt if every run has that ratio."""
    a = tracking_result([[[2, 0]], [[4, 0]], [[6, 0]]])
    b = tracking_result([[[1, 0]], [[2, 0]], [[3, 0]]])
    assert aukf.excess(a, b) == aukf.Estimate(pytest.approx(1.0), pytest.approx(0.0, abs=1e-12))
    # Mean squares of a 4 and 28, of b 4 and 4: the ratio of the means is 4. Left over are 4 - 16
    # and 28 - 16, whose mean has a standard error of 12, 3 in units of b's 4; that of the root is
    # 3 / (2 * 2).
    a, b = tracking_result([[[2, 0]], [[np.sqrt(28), 0]]]), tracking_result([[[0, 2]], [[0, 2]]])
    assert aukf.excess(a, b) == aukf.Estimate(pytest.approx(1.0), pytest.approx(0.75))
    one = aukf.excess(tracking_result([[[3, 0]]]), tracking_result([[[2, 0]]]))
    assert one.value == pytest.approx(0.5)
    assert np.isnan(one.standard_error)


def test_a_run_has_collapsed_if_its_last_five_intervals_are_short() -> None:
    limit = aukf.COLLAPSED_S
    last_long = [1.0] * 6 + [0.0] * 4 + [5.1 * limit]
    last_short = [1.0] * 6 + [0.0] * 4 + [4.9 * limit]
    assert aukf.collapsed(np.array([last_long, last_short, last_short, last_long])) == 0.5


def test_intervals_are_those_that_led_to_each_sample() -> None:
    result = tracking_result(np.zeros((1, 3, 2)), time_s=np.array([[0.5, 0.75, 1.75]]))
    assert aukf.intervals(result).tolist() == [[0.5, 0.25, 1.0]]


def test_roughness_is_the_second_difference_of_the_error() -> None:
    """A steady drift is smooth; 0, 3, 0 along x and 0, 4, 0 along y bend by 6 and by 8: 10."""
    drift = [[k, -2 * k] for k in range(5)]
    assert aukf.roughness(tracking_result([drift])) == pytest.approx(0.0, abs=1e-12)
    assert aukf.roughness(tracking_result([[[0, 0], [3, 4], [0, 0]]])) == pytest.approx(10.0)


def test_the_ratio_before_its_clamp_is_equation_7() -> None:
    """Desired steps of 1 m, estimated ones of 3 m, gamma1 = 1: M = 1 / (9 + 1)."""
    result = tracking_result([[[0, 0], [2, 0], [4, 0]]])
    desired = np.array([[[0, 0], [1.0, 0], [2, 0]]])
    result = replace(result, truth=desired, x=result.x + np.pad(desired, ((0, 0), (0, 0), (0, 4))))
    assert aukf.raw_ratio(result, 1.0) == pytest.approx(np.array([[0.1, 0.1]]))


def test_what_the_interval_reacts_to_is_found() -> None:
    """Intervals made of the error of the sample before, and a tau made of its growth."""
    random = np.random.default_rng(1)
    runs, steps = 50, 40
    size = np.exp(random.standard_normal((runs, steps)))
    # The interval after sample k leads to sample k + 1.
    pace = np.concatenate([np.full((runs, 1), 0.5), 3.0 + size[:, :-1]], axis=1)
    tau = np.full((runs, steps), 0.5)
    tau[:, 1:] -= 0.01 * np.log(size[:, 1:] / size[:, :-1])
    error = np.stack([0 * size, size], axis=-1)
    found = aukf.reaction(tracking_result(error, time_s=np.cumsum(pace, axis=1), tau=tau))
    assert found.error == pytest.approx(1.0)
    assert abs(found.previous) < 0.15  # 50 * 24 pairs of independent deviates
    assert found.growth == pytest.approx(-1.0)


def test_failed_runs_end_with_exit_code_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*args: Any, **options: Any) -> Any:
        result = simulate(*args, **options)
        result.status[0] = 2
        return result

    monkeypatch.setattr(aukf, "simulate", failing)
    monkeypatch.setattr(reproduce, "save_figures", lambda *_: None)
    arguments = ["reproduce", "aukf", "--runs", "2", "--json", "--output", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1
    assert json.loads(result.stdout)["failed_runs"] > 0
    assert "runs failed" in result.stderr


def test_markdown() -> None:
    assert table(("a", "b"), [("x|y", 1)]) == "| a | b |\n| --- | --- |\n| x\\|y | 1 |\n"
    assert number(0) == "0"
    assert number(0.00001234, 2) == "1.2e-5"
    assert number(0.01774) == "0.0177"
    assert fill("one\ntwo\n\n- a\n  b\n- c\n\n| x |", 8) == "one two\n\n- a b\n- c\n\n| x |"
