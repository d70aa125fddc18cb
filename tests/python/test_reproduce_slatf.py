"""``auvest simulate slatf`` and ``auvest reproduce slatf``."""

from __future__ import annotations

import csv
import functools
import json
import math
import re
import signal
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import PATIENCE_S, start_program, wait_until
from result_support import slat_result
from typer.testing import CliRunner, Result

from auvest.cli import app
from auvest.commands import reproduce, simulate_slatf
from auvest.commands.console import to_json
from auvest.reproduce import claims as every_claim
from auvest.reproduce.claims import NO, TOO_FEW, YES
from auvest.reproduce.slatf import claims as slatf_claims
from auvest.reproduce.slatf import measure as slatf
from auvest.reproduce.slatf.figures import FIGURES
from auvest.simulation import slat
from auvest.simulation.paper_slatf import (
    ASSUMPTIONS,
    FILTERS,
    LEVELS,
    paper_filter,
    paper_scenario,
)

COMMITTED = Path(__file__).parents[2] / "docs" / "reproduction" / "slatf"

#: What two independent prototypes in double precision give in R1 with 200 runs, RMSE in m, level by
#: level; their statistical error is about 1 m.
PROTOTYPE: dict[int, dict[str, float]] = {
    1: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 24.5, "slatf2": 22.9, "ekf_slat": 22.6},
    2: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 22.9, "slatf2": 23.4, "ekf_slat": 22.2},
    3: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 35.9, "slatf2": 25.6, "ekf_slat": 21.0},
    4: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 40.0, "slatf2": 26.2, "ekf_slat": 20.8},
    5: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 33.2, "slatf2": 26.6},
    6: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 37.5, "slatf2": 25.1},
    7: {"dr": 58.4, "dr_compensated": 34.4, "slatf1": 41.6, "slatf2": 26.8},
}
PROTOTYPE_ERROR_M = 1.0


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def plain(text: str) -> str:
    """Text without the boxes, colours and line breaks that rich draws."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return " ".join(re.sub(r"[─-╿]", " ", text).split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("slatf")


@pytest.fixture(scope="module")
def output(folder: Path) -> dict[str, Any]:
    """The command at its defaults, as the committed page is made."""
    result = call("reproduce", "slatf", "--json", "--output", str(folder))
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    value: dict[str, Any] = json.loads(result.stdout)
    return value


@pytest.fixture(scope="module")
def small() -> slatf.Reproduction:
    return slatf.measure(runs=3, particles=20, seed=3)


# Table 1.


def test_table1_is_what_readers_of_the_json_expect(output: dict[str, Any]) -> None:
    rows = output["table1"]
    assert [row["level"] for row in rows] == [1, 2, 3, 4, 5, 6, 7]
    for row, level in zip(rows, LEVELS, strict=True):
        assert row["sigma_r"] == level.sigma_range_m
        assert row["sigma_theta"] == level.sigma_bearing_rad
        assert row["runs"] == 50
        assert row["particles"] == 100
        assert set(row["se"]) == set(FILTERS)
        for name in FILTERS:
            assert 5 < row[name] < 100
            assert 0.3 < row["se"][name] < 6
    assert rows[0]["paper"] == {"dr": 59.9892, "slatf1": 33.2032, "slatf2": 27.7221}
    assert rows[3]["paper"] == {"dr": 57.194, "slatf1": 39.7212, "slatf2": 17.5921}
    assert [row["paper"] is None for row in rows] == [False] * 4 + [True] * 3
    assert output["failed_runs"] == 0


def test_every_figure_agrees_with_the_prototypes(output: dict[str, Any]) -> None:
    """Within 3 standard errors of both and 5 %."""
    for row in output["table1"]:
        for name, expected in PROTOTYPE[row["level"]].items():
            error = 3 * math.hypot(row["se"][name], PROTOTYPE_ERROR_M)
            assert abs(row[name] - expected) <= error + 0.05 * expected, (row["level"], name)


def test_the_table_is_the_scenario(output: dict[str, Any]) -> None:
    scenario = paper_scenario(LEVELS[3])
    direct = slat.simulate(paper_filter("slatf1", scenario, dtype="float32"), scenario)
    assert output["table1"][3]["slatf1"] == direct.rmse_m
    assert output["table1"][3]["se"]["slatf1"] == direct.rmse_standard_error_m


# The page.


def verdict(result: slatf.Reproduction, words: str) -> str:
    (claim,) = [one for one in slatf_claims.claims(result) if words in one.paper]
    return claim.verdict


def test_verdicts_follow_the_numbers(
    small: slatf.Reproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sign of a claim turns when the results are exchanged."""
    assert {claim.verdict for claim in slatf_claims.claims(small)} == {TOO_FEW}  # three runs
    monkeypatch.setattr(every_claim, "LEAST_RUNS", 3)
    words = "1.0 becomes worse when the sonar becomes more precise"
    levels = {n: dict(row) for n, row in small.levels.items()}
    loud, precise = levels[1]["slatf1"], levels[4]["slatf1"]
    for better, worse, expected in ((1, 4, YES), (4, 1, NO)):
        for number, factor in ((better, 1.0), (worse, 10.0)):
            source = loud if number == 1 else precise
            levels[number]["slatf1"] = slat.SlatResult(
                **{**vars(source), "error": source.error * 0 + factor + np.arange(3)[:, None, None]}
            )
        changed = slatf.Reproduction(**{**vars(small), "levels": levels})
        assert verdict(changed, words) == expected


def test_the_page_says_where_the_papers_best_value_lies(
    output: dict[str, Any], folder: Path
) -> None:
    page = " ".join((folder / "README.md").read_text(encoding="utf-8").split())
    joint = output["table1"][3]["ekf_slat"]
    assert "its 17.6 m lies below what the joint filter reaches" in page
    assert f"{joint:.1f} ± {output['table1'][3]['se']['ekf_slat']:.1f} m" in page
    assert joint > 17.6
    claims = {claim["paper"]: claim["verdict"] for claim in output["claims"]}
    assert claims["RMSE of SLATF 2.0 at level 4: 17.6 m"] == NO
    for assumption in ASSUMPTIONS:
        assert f"| {assumption.quantity} |" in page
    assert "nan" not in page


@pytest.mark.parametrize(
    "name", ["README.md", "results.json", *(f"{stem}.csv" for stem in FIGURES)]
)
def test_committed_page_is_fresh(output: dict[str, Any], folder: Path, name: str) -> None:
    """Filters in float32 keep their bits everywhere: the world's noise is rounded to it."""
    del output
    number = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
    fresh, kept = (
        re.sub(r'"version": .*', "", (where / name).read_text(encoding="utf-8"))
        for where in (folder, COMMITTED)
    )
    hint = "run: auvest reproduce slatf --output docs/reproduction/slatf"
    assert number.sub("#", fresh) == number.sub("#", kept), hint
    made, old = (np.array([float(n) for n in number.findall(text)]) for text in (fresh, kept))
    assert made == pytest.approx(old, rel=1e-4, abs=1e-6), hint


def test_every_figure_is_there_and_shown(output: dict[str, Any], folder: Path) -> None:
    del output
    page = (folder / "README.md").read_text(encoding="utf-8")
    for stem in FIGURES:
        assert f"({stem}.png)" in page
        for place in (folder, COMMITTED):
            picture = (place / f"{stem}.png").read_bytes()
            assert picture.startswith(b"\x89PNG")
            assert 10_000 < len(picture) < 150_000
    with (folder / "fig04.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 200
    assert float(rows[-1]["time_s"]) == 400


def test_workers_and_progress(small: slatf.Reproduction) -> None:
    calls: list[tuple[int, int]] = []
    again = slatf.measure(
        runs=3, particles=20, seed=3, workers=1, progress=lambda *both: calls.append(both)
    )
    assert to_json(slatf.summary(again)) == to_json(slatf.summary(small))
    assert calls[-1][0] == calls[-1][1]
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_the_figures_of_a_result_by_hand() -> None:
    """Distances of 5 and 1 m in one run, 7 and 7 m in the other."""
    result = slat_result([[[3, -4], [0, 1]], [[7, 0], [0, -7]]])
    roots = (math.sqrt(13), 7.0)
    rmse = slatf.rmse(result)
    assert rmse.value == pytest.approx(sum(roots) / 2)
    assert rmse.standard_error == pytest.approx((7 - math.sqrt(13)) / 2)  # |a - b| / 2 of two
    assert slatf.mean_error(result) == 5.0
    assert slatf.error_variance(result) == 6.0  # (0 + 16 + 4 + 4) / 4
    assert slatf.rms_per_ping(result) == pytest.approx([math.sqrt(37), 5.0])


def test_a_difference_is_that_of_paired_runs() -> None:
    """Of 5 and 8 m against 4 and 5 m: 1 and 3 m, 2 m with a standard error of 1 m."""
    a, b = slat_result([[[3, 4]], [[0, 8]]]), slat_result([[[4, 0]], [[0, 5]]])
    assert slatf.difference(a, b) == slatf.Estimate(pytest.approx(2.0), pytest.approx(1.0))
    one = slatf.difference(slat_result([[[3, 4]]]), slat_result([[[0, 1]]]))
    assert one.value == pytest.approx(4.0)
    assert math.isnan(one.standard_error)


def test_one_run_is_enough_for_a_page(tmp_path: Path) -> None:
    result = call(
        "reproduce", "slatf", "--runs", "1", "--particles", "10", "--output", str(tmp_path)
    )
    assert result.exit_code == 0, result.output
    assert "SLATF 2.0" in plain(result.stdout)
    assert str(tmp_path / "README.md") in result.stdout
    assert "nan" not in (tmp_path / "README.md").read_text(encoding="utf-8")
    value = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert value["table1"][0]["se"]["slatf1"] is None


def test_interrupt_and_failed_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small: slatf.Reproduction
) -> None:
    monkeypatch.setattr(slatf, "measure", functools.wraps(slatf.measure)(lambda **_: small))
    arguments = ["reproduce", "slatf", "--json", "--output", str(tmp_path)]
    small.levels[1]["slatf1"].status[0] = 2
    monkeypatch.setattr(reproduce, "save_figures", lambda *_: None)
    failed = call(*arguments)
    assert failed.exit_code == 1
    assert json.loads(failed.stdout)["failed_runs"] == 1
    assert "Error: 1 run failed; numbers are missing" in failed.stderr
    small.levels[1]["slatf1"].status[0] = 0

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(reproduce, "save_figures", interrupted)
    result = call(*arguments)
    assert result.exit_code == 130
    assert result.stdout == ""
    assert "8 files are written" in result.stderr


# auvest simulate slatf.

QUICK = ["--runs", "4", "--duration", "40", "--particles", "30", "--no-figure"]


def test_simulate_prints_a_table_and_writes_files(tmp_path: Path) -> None:
    result = call("simulate", "slatf", "--runs", "6", "--duration", "40", "--output", str(tmp_path))
    assert result.exit_code == 0
    assert result.stderr == ""
    text = plain(result.stdout)
    for word in ("SLATF 2.0", "position RMSE / m", "resamplings per run", "failed runs"):
        assert word in text
    assert {path.name for path in tmp_path.iterdir()} == {
        ".auvest.json",
        "figure.png",
        "per_ping.csv",
        "results.json",
        "runs.csv",
    }
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["run"] for row in rows] == [str(r) for r in range(6)]
    value = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    mean = np.mean([float(row["rmse_m"]) for row in rows])
    assert value["results"]["rmse_m"] == pytest.approx(mean, rel=1e-12)
    assert len(value["per_ping"]["time_s"]) == 20


@pytest.mark.parametrize(
    ("options", "settings"),
    [
        (["--filter", "slatf1", "--level", "4", "--dtype", "float32"], {"filter": "slatf1"}),
        (["--filter", "slatf2", "--masters", "3", "--association", "unknown", "--gate", "16"], {}),
        (["--filter", "slatf2", "--resampling", "residual", "--lanes", "scalar"], {}),
        (["--range-noise", "2", "--bearing-noise", "0.1", "--plan", "unknown"], {"gate": 0.0}),
        (["--dropout", "0.3", "--outlier", "0.1", "--gate", "16"], {"gate": 16.0}),
    ],
)
def test_simulate_options(tmp_path: Path, options: list[str], settings: dict[str, Any]) -> None:
    result = call("simulate", "slatf", *QUICK, *options, "--output", str(tmp_path), "--json")
    assert result.exit_code == 0, result.output
    value = json.loads(result.stdout)
    assert value["complete"] is True
    assert settings.items() <= value["settings"].items()
    assert 0 < value["results"]["rmse_m"] < 100


def test_simulate_is_what_the_library_computes(tmp_path: Path) -> None:
    arguments = ["--filter", "ekf-slat", "--runs", "4", "--duration", "40", "--no-figure"]
    result = call("simulate", "slatf", *arguments, "--output", str(tmp_path), "--json")
    value = json.loads(result.stdout)["results"]
    scenario = slat.SlatScenario(duration_s=40, runs=4)
    direct = slat.simulate(paper_filter("ekf_slat", scenario), scenario)
    assert value["rmse_m"] == direct.rmse_m
    assert value["nees_mean"] == pytest.approx(direct.nees.mean(), rel=1e-12)
    assert value["covered_95"] == direct.covered
    end = np.sqrt(np.square(direct.error[:, -1]).sum(axis=-1).mean())
    assert value["end_error_m"] == pytest.approx(end, rel=1e-12)


def test_parquet(tmp_path: Path) -> None:
    from pyarrow import parquet

    result = call("simulate", "slatf", *QUICK, "--table", "parquet", "--output", str(tmp_path))
    assert result.exit_code == 0, result.output
    assert parquet.read_table(tmp_path / "runs.parquet").num_rows == 4


BAD = [
    (["--filter", "slatf3"], ["--filter", "'slatf3'", "'slatf2'"]),
    (["--particles", "0"], ["--particles", "1"]),
    (["--gate", "-1"], ["--gate", "-1.0 is not a finite number of at least 0"]),
    (["--level", "8"], ["--level", "7"]),
    (["--masters", "5"], ["--masters", "4"]),
    (["--dropout", "1"], ["--dropout", "1.0 is not a probability"]),
    (["--range-noise", "0"], ["--range-noise", "0.0 is not a finite number above 0"]),
    (["--range-noise", "1e-7"], ["sigma_range_m must be above 1e-6"]),
    (["--duration", "1"], ["duration_s = 1 is too short for one ping: a ping comes every 2 s"]),
    (["--lanes", "avx2"], ["lanes 'avx2' do not run here in float64"]),
    (
        ["--filter", "ekf-slat", "--particles", "10"],
        ["--particles", "belongs to slatf1, slatf2 and slatf-joint"],
    ),
    (["--filter", "dead-reckoning", "--gate", "16"], ["--gate", "dead reckoning hears no echo"]),
]


@pytest.mark.parametrize(("options", "words"), BAD, ids=[" ".join(options) for options, _ in BAD])
def test_bad_input_is_refused_in_words(
    tmp_path: Path, options: list[str], words: list[str]
) -> None:
    folder = tmp_path / "out"
    result = call("simulate", "slatf", *options, "--output", str(folder), "--quiet", "--json")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    for word in words:
        assert word in plain(result.stderr)
    assert not folder.exists()


def test_help_teaches() -> None:
    for command, words in (
        ("simulate", ["Examples", "--association", "goes on where it was stopped"]),
        ("reproduce", ["Examples", "--json", "README.md", "--particles"]),
    ):
        result = call(command, "slatf", "--help")
        assert result.exit_code == 0
        for word in words:
            assert word in plain(result.stdout)


def test_ctrl_c_keeps_runs_and_the_same_command_goes_on(tmp_path: Path) -> None:
    options = ["--runs", "300", "--particles", "400", "--no-figure", "--workers", "2"]
    command = [sys.executable, "-m", "auvest", "simulate", "slatf", *options]
    command += ["--output", str(tmp_path / "out")]
    with start_program(command) as program:
        runs = tmp_path / "out.runs"
        wait_until(lambda: len(list(runs.glob("*.npz"))) >= 3, "three chunks are kept", program)
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 130, err
    assert "are done and kept; the same command goes on from there" in plain(err)
    assert "SLATF 2.0" in plain(out)
    value = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert value["complete"] is False
    kept = value["results"]["runs"]
    assert 10 <= kept < 300
    with (tmp_path / "out" / "runs.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == kept

    few = ["--runs", "20", "--particles", "400", "--no-figure"]
    fresh = call("simulate", "slatf", *few, "--output", str(tmp_path / "fresh"))
    again = call("simulate", "slatf", *few, "--output", str(tmp_path / "out"))
    assert fresh.exit_code == again.exit_code == 0
    tables = [(tmp_path / name / "runs.csv").read_bytes() for name in ("fresh", "out")]
    assert tables[0] == tables[1]
    assert not (tmp_path / "out.runs").exists()


def test_identity_leaves_out_what_does_not_change_a_run() -> None:
    settings = {"lanes": "avx2", "gate": 1, "scenario": {"runs": 5, "seed": 2}}
    identity = simulate_slatf._identity(settings)
    assert identity["scenario"] == {"seed": 2}
    assert "lanes" not in identity
    assert identity["gate"] == 1
