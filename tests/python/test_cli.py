"""The command line: what it prints where, what it writes, how it refuses and how it ends."""

from __future__ import annotations

import csv
import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import PATIENCE_S, start_program, wait_until
from typer.testing import CliRunner, Result

from auvest.cli import app
from auvest.commands import simulate_aukf
from auvest.simulation.paper_aukf import paper_filter, paper_noise, paper_track
from auvest.simulation.tracking import Scenario, simulate

QUICK = ["--runs", "4", "--steps", "12", "--no-figure"]


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


def plain(text: str) -> str:
    """Text without the boxes, colours and line breaks that rich draws."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", text)
    return " ".join(re.sub(r"[─-╿]", " ", text).split())


def simulated(folder: Path, *options: str) -> dict[str, Any]:
    result = call("simulate", "aukf", *QUICK, *options, "--output", str(folder), "--json")
    assert result.exit_code == 0, result.output
    value: dict[str, Any] = json.loads(result.stdout)
    return value


def test_version() -> None:
    result = call("--version")
    assert result.exit_code == 0
    assert result.stdout.startswith("auvest ")
    assert call("version").stdout == result.stdout
    assert len(result.stdout.splitlines()) == 1  # this build lacks nothing


def test_a_build_without_xsimd_says_so() -> None:
    """At import and with the version, in one line each."""
    without = "from auvest import _core; _core.slat_lanes = lambda single: ['scalar']\n"
    code = f"{without}import auvest; auvest.Slatf; auvest.EkfSlat"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stderr.splitlines() if "xsimd" in line]
    assert len(told) == 1
    assert "RuntimeWarning: auvest was built without xsimd: " in told[0]
    code = f"{without}from auvest.cli import app; app(['version'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    name, line = done.stdout.splitlines()
    assert name.startswith("auvest ")
    assert line.startswith("built without xsimd: ")
    assert "libxsimd-dev" in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--help"], ["simulate", "reproduce", "auvest simulate aukf", "Exit codes", "130"]),
        (["simulate", "--help"], ["aukf"]),
        (["reproduce", "--help"], ["aukf"]),
        (
            ["simulate", "aukf", "--help"],
            ["Examples", "--interval covariance-budget", "--noise-bias", "--tau0", "figure3"],
        ),
        (["reproduce", "aukf", "--help"], ["Examples", "--json", "README.md"]),
        (["hil", "--help"], ["Examples", "--target serial:/dev/ttyACM0", "pyserial", "cortex-m4f"]),
    ],
)
def test_help_teaches(arguments: list[str], words: list[str]) -> None:
    result = call(*arguments)
    assert result.exit_code == 0
    for word in words:
        assert word in plain(result.stdout)


def test_no_command_shows_the_help() -> None:
    assert "simulate" in plain(call().output)


BAD = [
    (["--filter", "pf"], ["--filter", "'pf'", "'ekf'", "'ukf'", "'aukf'"]),
    (["--interval", "adaptive"], ["--interval", "'adaptive'", "covariance-budget"]),
    (["--preset", "table2"], ["--preset", "'table2'", "figure3", "table1"]),
    (["--noise", "cauchy"], ["--noise", "'cauchy'", "lognormal"]),
    (["--noise-bias", "half"], ["--noise-bias", "'half'", "remove"]),
    (["--track", "circle"], ["--track", "'circle'", "turn"]),
    (["--dtype", "float16"], ["--dtype", "'float16'", "float32"]),
    (["--runs", "0"], ["--runs", "1"]),
    (["--runs", "many"], ["--runs", "valid integer"]),
    (["--steps", "1"], ["--steps", "2"]),
    (["--seed", "-1"], ["--seed", "0"]),
    (["--workers", "0"], ["--workers", "1"]),
    (["--range-noise", "0"], ["--range-noise", "0.0 is not a finite number above 0"]),
    (["--range-noise", "nan"], ["--range-noise", "nan is not a finite number above 0"]),
    (["--bearing-noise", "-0.1"], ["--bearing-noise", "-0.1 is not a finite number above 0"]),
    (["--dropout", "1"], ["--dropout", "1.0 is not a probability of at least 0 and below 1"]),
    (["--tau0", "1"], ["--tau0", "1.0 is not strictly between 0 and 1"]),
    (["--tau0", "0.999"], ["--interval mahalanobis", "tau_max", "0.999"]),
    (["--fixed-interval", "0.5"], ["--fixed-interval", "belongs to --interval fixed"]),
    (["--budget", "0.1"], ["--budget", "belongs to --interval covariance-budget"]),
    (["--filter", "ekf", "--alpha", "1"], ["--alpha", "belongs to --filter ukf or aukf"]),
    (["--filter", "ekf", "--kappa", "-3"], ["--kappa", "belongs to --filter ukf or aukf"]),
    (["--interval", "fixed", "--tau0", "0.5"], ["--tau0", "belongs to --interval mahalanobis"]),
    (["--interval", "fixed", "--preset", "table1"], ["--preset", "--interval mahalanobis"]),
    (["--filter", "ukf", "--interval", "mahalanobis"], ["--interval", "needs --filter aukf"]),
    (["--interval", "fixed", "--fixed-interval", "inf"], ["--fixed-interval", "inf"]),
    (["--alpha", "2"], ["alpha", "2"]),
    (["--kappa", "-6"], ["kappa", "-6"]),
    (["--beta", "nan"], ["--beta", "nan is not a finite number"]),
    (["--runs", "100000", "--steps", "100000"], ["runs * steps", "10000000"]),
    (["--colour"], ["No such option", "--colour"]),
]


@pytest.mark.parametrize(("options", "words"), BAD, ids=[" ".join(options) for options, _ in BAD])
def test_bad_input_is_refused_in_words(
    tmp_path: Path, options: list[str], words: list[str]
) -> None:
    folder = tmp_path / "out"
    result = call("simulate", "aukf", *options, "--output", str(folder), "--quiet", "--json")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    message = plain(result.stderr)
    for word in words:
        assert word in message
    assert not folder.exists()


def test_output_that_is_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.touch()
    result = call("simulate", "aukf", *QUICK, "--output", str(path))
    assert result.exit_code == 2
    assert "--output" in plain(result.stderr)
    below = call("simulate", "aukf", *QUICK, "--output", str(path / "below"))
    assert below.exit_code == 1
    said = f"Error: --output {path / 'below'}: {path} is a file, not a folder"
    assert plain(below.stderr) == said
    assert below.stdout == ""


def test_simulate_prints_a_table_and_writes_files(tmp_path: Path) -> None:
    result = call("simulate", "aukf", "--runs", "6", "--output", str(tmp_path))
    assert result.exit_code == 0
    assert result.stderr == ""
    text = plain(result.stdout)
    for word in ("position RMSE / m", "mean interval / s", "NIS", "NEES", "failed runs"):
        assert word in text
    assert str(tmp_path / "figure.png") in result.stdout
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "per_step.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 60
    assert float(rows[0]["time_s"]) == 0.5
    with (tmp_path / "one_run.csv").open(encoding="utf-8") as file:
        one = list(csv.DictReader(file))
    assert float(one[1]["time_s"]) == pytest.approx(0.5 + float(one[1]["interval_s"]), rel=1e-5)
    r, bearing = float(one[9]["range_m"]), float(one[9]["bearing_rad"])
    assert float(one[9]["observed_x_m"]) == pytest.approx(0.2 + r * np.cos(bearing), abs=1e-4)
    assert float(one[9]["observed_y_m"]) == pytest.approx(2 + r * np.sin(bearing), abs=1e-4)


def test_json_is_what_the_library_computes(tmp_path: Path) -> None:
    value = simulated(tmp_path, "--noise", "lognormal", "--seed", "9")
    noise = paper_noise("lognormal")
    direct = simulate(
        paper_filter("aukf", noise=noise),
        Scenario(track=paper_track(), noise=noise, steps=12, runs=4, seed=9),
    )
    results = value["results"]
    assert results["rmse_m"] == direct.rmse_m
    assert results["mean_interval_s"] == direct.mean_interval_s
    assert results["nis_mean"] == pytest.approx(direct.nis.mean(), rel=1e-12)
    assert results["nees_mean"] == pytest.approx(direct.nees.mean(), rel=1e-12)
    assert results["samples"] == 48
    assert results["samples_per_second"] == pytest.approx(1 / direct.mean_interval_s)
    low, high = results["nis_bounds_95"]
    assert 1 < low < 2 < high < 3
    assert results["rmse_x_m"] ** 2 + results["rmse_y_m"] ** 2 == pytest.approx(
        direct.rmse_m**2, rel=1e-12
    )
    per_run = np.square(direct.error).sum(axis=-1).mean(axis=1)
    spread = per_run.std(ddof=1) / 2 / (2 * direct.rmse_m)
    assert results["rmse_standard_error_m"] == pytest.approx(spread, rel=1e-12)
    assert value["per_step"]["interval_s"][1] == pytest.approx(direct.interval_s[:, 0].mean())
    assert value["per_step"]["rmse_m"][-1] ** 2 == pytest.approx(
        np.square(direct.error[:, -1]).sum(axis=-1).mean(), rel=1e-12
    )
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8")) == value


CHANGES = [
    ["--filter", "ukf"],
    ["--filter", "ekf"],
    ["--interval", "fixed", "--fixed-interval", "0.4"],
    ["--filter", "ukf", "--fixed-interval", "0.3"],
    ["--filter", "ekf", "--fixed-interval", "0.3"],
    ["--interval", "covariance-budget"],
    ["--interval", "covariance-budget", "--budget", "0.03"],
    ["--preset", "table1"],
    ["--tau0", "0.1"],
    ["--noise", "uniform"],
    ["--noise", "uniform", "--noise-bias", "remove"],
    ["--range-noise", "0.2"],
    ["--bearing-noise", "0.2"],
    ["--dropout", "0.5"],
    ["--steps", "13"],
    ["--runs", "5"],
    ["--seed", "2"],
    ["--dtype", "float32"],
    ["--alpha", "1"],
    ["--alpha", "1", "--beta", "1"],
    ["--alpha", "1", "--kappa", "3"],
    ["--track", "straight"],
    ["--track", "turn"],
]


def test_every_option_changes_the_numbers(tmp_path: Path) -> None:
    seen: dict[str, str] = {}
    for options in [[], *CHANGES]:
        value = simulated(tmp_path, *options)
        numbers = json.dumps([value["results"], value["per_step"]])
        assert numbers not in seen, f"{options} gives what {seen[numbers]} gives"
        seen[numbers] = " ".join(options)


@pytest.mark.parametrize(
    ("options", "interval"),
    [
        (["--interval", "fixed", "--fixed-interval", "0.4"], 0.4),
        (["--filter", "ukf", "--fixed-interval", "0.4"], 0.4),
        (["--filter", "ekf"], 0.5),
    ],
)
def test_fixed_interval_is_kept(tmp_path: Path, options: list[str], interval: float) -> None:
    value = simulated(tmp_path, *options)
    assert value["per_step"]["interval_s"] == pytest.approx([interval] * 12)


def test_aukf_at_a_fixed_interval_is_a_ukf(tmp_path: Path) -> None:
    aukf = simulated(tmp_path, "--interval", "fixed", "--fixed-interval", "0.4")
    ukf = simulated(tmp_path, "--filter", "ukf", "--fixed-interval", "0.4")
    assert aukf["per_step"] == ukf["per_step"]


def test_noise_bias_remove_lowers_the_error(tmp_path: Path) -> None:
    options = ["--noise", "uniform", "--steps", "60"]
    kept = simulated(tmp_path, *options)["results"]["rmse_m"]
    removed = simulated(tmp_path, *options, "--noise-bias", "remove")["results"]["rmse_m"]
    assert removed < 0.6 * kept


@pytest.mark.parametrize("track", ["paper", "straight", "turn"])
def test_the_filter_fits_its_track(tmp_path: Path, track: str) -> None:
    value = simulated(tmp_path, "--track", track, "--steps", "100", "--runs", "40")
    assert 1.2 < value["results"]["nees_mean"] < 2.4


def test_workers_do_not_change_the_numbers(tmp_path: Path) -> None:
    one = simulated(tmp_path, "--runs", "9", "--workers", "1")
    three = simulated(tmp_path, "--runs", "9", "--workers", "3")
    assert one["per_step"] == three["per_step"]


def test_one_run_has_no_standard_error(tmp_path: Path) -> None:
    assert simulated(tmp_path, "--runs", "1")["results"]["rmse_standard_error_m"] is None


def test_missing_measurements_are_empty_cells(tmp_path: Path) -> None:
    value = simulated(tmp_path, "--dropout", "0.9", "--steps", "40")
    with (tmp_path / "one_run.csv").open(encoding="utf-8") as file:
        ranges = [row["range_m"] for row in csv.DictReader(file)]
    assert "" in ranges
    assert value["results"]["failed_runs"] == 0


def test_failed_runs_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*args: Any, **options: Any) -> Any:
        result = simulate(*args, **options)
        result.status[2] = 2
        result.samples[2] = 5
        for array in (result.time_s, result.x, result.truth, result.nis, result.z):
            array[2, 5:] = np.nan
        return result

    monkeypatch.setattr(simulate_aukf, "simulate", failing)
    result = call("simulate", "aukf", *QUICK, "--output", str(tmp_path), "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["results"]["failed_runs"] == 1
    assert "1 of 4 runs failed; the first, run 2, after 5 steps" in plain(result.stderr)


def test_interrupt_keeps_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(filter_: Any, scenario: Scenario, **_: Any) -> Any:
        stop = KeyboardInterrupt()
        done = Scenario(track=scenario.track, noise=scenario.noise, steps=12, runs=3)
        stop.partial = simulate(filter_, done)  # type: ignore[attr-defined]
        raise stop

    monkeypatch.setattr(simulate_aukf, "simulate", interrupted)
    result = call("simulate", "aukf", *QUICK, "--output", str(tmp_path), "--json")
    assert result.exit_code == 130
    value = json.loads(result.stdout)
    assert value["complete"] is False
    assert value["results"]["runs"] == 3
    assert "3 of 4 runs are done and kept" in plain(result.stderr)
    assert (tmp_path / "per_step.csv").exists()


def test_interrupt_before_anything_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(simulate_aukf, "simulate", interrupted)
    result = call("simulate", "aukf", *QUICK, "--output", str(tmp_path))
    assert result.exit_code == 130
    assert "no run was done" in plain(result.stderr)
    assert list(tmp_path.iterdir()) == []


def interrupt_after(seconds: float, command: list[str], cwd: Path) -> tuple[int, str, str]:
    """Run a command, interrupt it at work, and return its exit code, stdout and stderr."""
    output = cwd / f"after-{seconds}"
    program = start_program([*command, "--output", output], cwd=cwd)
    part = output.with_name(f"{output.name}.unfinished")
    wait_until(part.exists, "the work has not begun", program)  # made just before it
    time.sleep(seconds)
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=PATIENCE_S)
    return program.returncode, out, err


def test_ctrl_c_keeps_the_runs_done(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "auvest", "simulate", "aukf", "--json", "--no-figure"]
    command += ["--runs", "90000", "--steps", "110", "--workers", "1"]
    # On any machine one of these lies between the first chunk and the last, 20 times as late.
    for seconds in (2.0**k for k in range(9)):
        code, out, err = interrupt_after(seconds, command, tmp_path)
        if out:
            break
    assert code == 130, err
    assert 0 < json.loads(out)["results"]["runs"] < 90000
    assert "are done and kept" in plain(err)


def test_as_a_program(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "auvest", "simulate", "aukf", *QUICK, "--json"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0
    assert done.stderr == ""
    assert json.loads(done.stdout)["command"] == "simulate aukf"
    assert (tmp_path / "auvest-output" / "simulate-aukf" / "results.json").exists()
