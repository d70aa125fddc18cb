"""auvest::auvest in a user's CMake project: by add_subdirectory, and by find_package."""

import pytest

SOURCE = """\
#include <auvest/types.hpp>
#include <cstdio>

int main() {
    const Eigen::Vector2d v(3.0, 4.0);
    std::printf("%g", v.norm());
    return v.norm() == 5.0 ? 0 : 1;
}
"""


def test_add_subdirectory(run_cpp, tmp_path):
    assert run_cpp(SOURCE) == "5"
    # A subproject builds nothing of its own.
    assert not list((tmp_path / "build" / "auvest").rglob("*.o"))


@pytest.fixture
def prefix(root, tmp_path, run):
    """Return a folder into which `cmake --install` has put auvest."""
    build, prefix = tmp_path / "auvest-build", tmp_path / "prefix"
    run("cmake", "-S", root, "-B", build)
    run("cmake", "--install", build, "--prefix", prefix)
    return prefix


def test_find_package(run_cpp, prefix):
    find = "find_package(auvest 0.1 REQUIRED)"
    assert run_cpp(SOURCE, find, [f"CMAKE_PREFIX_PATH={prefix}"]) == "5"


def test_installed_headers_are_all_headers(root, prefix):
    installed, public = (
        {path.relative_to(include) for path in include.rglob("*") if path.is_file()}
        for include in (prefix / "include", root / "cpp" / "include")
    )
    assert installed == public


def test_install_without_contraction(prefix):
    (targets,) = prefix.rglob("auvestTargets.cmake")
    assert "-ffp-contract=off" in targets.read_text()
