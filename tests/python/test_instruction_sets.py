"""Code for one instruction set has names of its own (AUVEST_INSTRUCTIONS in auvest/config.hpp)."""

from __future__ import annotations

import platform
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "cpp" / "include"
HEADERS = sorted(INCLUDE.rglob("*.hpp"))

PROGRAM = """\
#include <auvest/auvest.hpp>
#include <auvest/slat/slatf.hpp>

using Filter = auvest::Ukf<auvest::ExactAcceleration<float>>;

auvest::Status use(Filter& filter, auvest::math::Random& random) {
  return filter.reset(Filter::State::Constant(auvest::math::sin(random.normal<float>())),
                      Filter::Covariance::Identity());
}
"""

SETS = {
    "baseline": [],
    "with_avx2": ["-mavx2"],
    "with_avx512": ["-mavx512f", "-mfma"],
    "of_my_own": ["-mavx2", "-DAUVEST_INSTRUCTIONS=of_my_own"],
}


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: str(path.relative_to(INCLUDE)))
def test_nothing_of_a_header_is_outside_the_namespace_of_the_instruction_set(header: Path) -> None:
    text = header.read_text(encoding="utf-8")
    opened = re.findall(r"^namespace auvest \{\n(.*)$", text, re.MULTILINE)
    assert all(line == "inline namespace AUVEST_INSTRUCTIONS {" for line in opened)
    closed = "}  // namespace AUVEST_INSTRUCTIONS\n}  // namespace auvest\n"
    assert text.count(closed) == len(opened) == len(re.findall(r"^namespace auvest\b", text, re.M))


def _functions(tmp_path: Path, name: str) -> set[str]:
    """Functions of auvest that a linker may take from any file that has them."""
    source, target = tmp_path / "use.cpp", tmp_path / f"{name}.o"
    source.write_text(PROGRAM)
    folders = ["-I", str(INCLUDE), "-isystem", "/usr/include/eigen3"]
    flags = ["-std=c++11", "-O0", "-ffp-contract=off", *SETS[name]]
    subprocess.run(["g++", *flags, *folders, "-c", str(source), "-o", str(target)], check=True)
    listing = subprocess.run(
        ["nm", "--defined-only", str(target)], check=True, capture_output=True, text=True
    ).stdout
    return {line[19:] for line in listing.splitlines() if " W " in line and "6auvest" in line}


@pytest.mark.skipif(platform.machine() not in {"x86_64", "AMD64"}, reason="the sets are x86's")
def test_no_function_of_one_set_can_be_taken_for_that_of_another(tmp_path: Path) -> None:
    functions = {name: _functions(tmp_path, name) for name in SETS}
    for name, own in functions.items():
        assert len(own) > 10
        assert all(f"{len(name)}{name}" in function for function in own)
