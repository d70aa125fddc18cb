"""The benchmarks: the exact bound on instructions, filters that agree, targets and bounds."""

import math
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "cpp" / "benchmarks"))

import checks
import python_steps
import speed

counted = pytest.mark.skipif(
    shutil.which("valgrind") is None, reason="valgrind is not installed; `make setup-dev` does it"
)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """ukf_step, compiled as cpp/benchmarks/CMakeLists.txt does."""
    out = tmp_path_factory.mktemp("speed") / "ukf_step"
    source = ROOT / "cpp" / "benchmarks" / "ukf_step.cpp"
    flags = ["-std=c++11", "-O3", "-DNDEBUG", "-march=x86-64-v3", "-ffp-contract=off"]
    folders = ["-I", str(ROOT / "cpp" / "include"), "-isystem", "/usr/include/eigen3"]
    subprocess.run(["g++", *flags, *folders, str(source), "-o", str(out)], check=True)
    return out


@counted
def test_a_step_takes_no_more_instructions_than_tinyekfs_ekf(program):
    assert 0 < speed.instructions(program, "double") <= speed.MAX_INSTRUCTIONS


@counted
def test_float_takes_fewer_than_double(program):
    assert 0 < speed.instructions(program, "float") < speed.instructions(program, "double")


def test_the_three_filters_of_the_benchmark_agree():
    z = speed.record()[:500]
    ours = speed.run_auvest(z, "float64")
    assert abs(speed.run_filterpy(z)[:, :2] - ours[:, :2]).max() < 1e-3
    assert abs(speed.numba_estimates(z)[:, :2] - ours[:, :2]).max() < 1e-3


@pytest.mark.parametrize("pair", python_steps.PAIRS, ids=lambda pair: pair.what)
def test_single_steps_of_both_libraries_agree(pair):
    assert python_steps.disagreement_m(pair) < pair.agree_m


def test_a_bound_lies_beyond_its_target_by_the_margin():
    assert checks.MARGIN == 0.3
    more, less = checks.Check("a", 60.0, ">=", 60.0), checks.Check("b", 2.0, "<=", 2.0)
    assert (more.bound, less.bound) == (pytest.approx(42.0), pytest.approx(2.6))
    exact = checks.Check("c", 1.0, "<=", 1.0, margin=0.0)
    assert exact.bound == 1.0
    for one in (more, less, exact):
        assert one.reached
        assert one.passed
        assert one.verdict == ""


@pytest.mark.parametrize(
    ("value", "sign", "target", "verdict", "code"),
    [
        (61.0, ">=", 60.0, "", 0),
        (49.5, ">=", 60.0, "short of the target", 0),  # seen on another machine
        (41.9, ">=", 60.0, "MISSED", 1),
        (2.5, "<=", 2.0, "short of the target", 0),
        (2.7, "<=", 2.0, "MISSED", 1),
        (math.nan, ">=", 60.0, "MISSED", 1),
        (math.nan, "<=", 60.0, "MISSED", 1),
        (0.0, ">=", None, "", 0),
    ],
)
def test_only_a_missed_bound_fails(capsys, value, sign, target, verdict, code):
    one = checks.Check("ratio", value, sign, target)
    assert one.verdict == verdict
    assert checks.judge([one]) == code
    line = capsys.readouterr().err
    assert line.startswith(verdict or "ok")
    assert f"ratio: {value:.3g}" in line
    assert checks.judge([one, checks.Check("good", 1.0)]) == code


def test_the_table_shows_target_and_bound():
    rows = [
        checks.Check("fast", 84.9, ">=", 60.0),
        checks.Check("slow", 2.9, "<=", 2.0),
        checks.Check("seen", 11.2),
    ]
    assert checks.table(rows).splitlines()[2:] == [
        "| fast | 84.9 | >= 60 | >= 42 |  |",
        "| slow | 2.9 | <= 2 | <= 2.6 | MISSED |",
        "| seen | 11.2 |  |  |  |",
    ]
