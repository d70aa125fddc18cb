"""The bound on the instructions of one UKF step: exact, so no machine is too slow for it."""

import importlib.util
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

spec = importlib.util.spec_from_file_location("speed", ROOT / "cpp" / "benchmarks" / "speed.py")
speed = importlib.util.module_from_spec(spec)
sys.modules["speed"] = speed
spec.loader.exec_module(speed)

pytestmark = pytest.mark.skipif(
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


def test_a_step_takes_no_more_instructions_than_tinyekfs_ekf(program):
    assert 0 < speed.instructions(program, "double") <= speed.MAX_INSTRUCTIONS


def test_float_takes_fewer_than_double(program):
    assert 0 < speed.instructions(program, "float") < speed.instructions(program, "double")


def test_the_three_filters_of_the_benchmark_agree():
    z = speed.record()[:500]
    ours = speed.run_auvest(z, "float64")
    assert abs(speed.run_filterpy(z)[:, :2] - ours[:, :2]).max() < 1e-3
    assert abs(speed.numba_estimates(z)[:, :2] - ours[:, :2]).max() < 1e-3
