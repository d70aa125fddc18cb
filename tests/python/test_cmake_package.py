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

#: CMake breaks lines.
TOO_OLD = r"(?s)needs\s+Eigen\s+3\.4\s+or\s+later.*3\.3\.9"


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


@pytest.fixture
def eigen_that_says(tmp_path):
    """Return a function that gives the folder of an Eigen with this version and these rules.

    Eigen 5 is compatible with what asks for 5, Eigen 3 with what asks for 3.
    """

    def eigen_that_says(version):
        folder = tmp_path / f"eigen-{version}"
        folder.mkdir()
        (folder / "Eigen3Config.cmake").write_text(
            "add_library(Eigen3::Eigen INTERFACE IMPORTED)\n"
            "target_include_directories(Eigen3::Eigen INTERFACE /usr/include/eigen3)\n"
        )
        (folder / "Eigen3ConfigVersion.cmake").write_text(
            f'set(PACKAGE_VERSION "{version}")\n'
            f"if(PACKAGE_FIND_VERSION_MAJOR STREQUAL {version[0]} OR NOT PACKAGE_FIND_VERSION)\n"
            "  set(PACKAGE_VERSION_COMPATIBLE TRUE)\n"
            "endif()\n"
        )
        return folder

    return eigen_that_says


def test_eigen_5_is_taken(run_cpp, prefix, eigen_that_says):
    given = f"Eigen3_DIR={eigen_that_says('5.0.1')}"
    assert run_cpp(SOURCE, definitions=[given]) == "5"
    found = [f"CMAKE_PREFIX_PATH={prefix}", given]
    assert run_cpp(SOURCE, "find_package(auvest 0.1 REQUIRED)", found) == "5"


def test_eigen_3_3_is_refused(root, tmp_path, prefix, eigen_that_says, run):
    given = f"-DEigen3_DIR={eigen_that_says('3.3.9')}"
    with pytest.raises(
        pytest.fail.Exception, match=r"(?s)needs\s+Eigen\s+3\.4\s+or\s+later.*3\.3\.9"
    ):
        run("cmake", "-S", root, "-B", tmp_path / "old", given)
    (tmp_path / "user").mkdir()
    (tmp_path / "user" / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(user CXX)\nfind_package(auvest REQUIRED)\n"
    )
    command = ["cmake", "-S", tmp_path / "user", "-B", tmp_path / "user-build", given]
    with pytest.raises(
        pytest.fail.Exception, match=r"(?s)needs\s+Eigen\s+3\.4\s+or\s+later.*3\.3\.9"
    ):
        run(*command, f"-DCMAKE_PREFIX_PATH={prefix}")


def test_install_without_contraction(prefix):
    (targets,) = prefix.rglob("auvestTargets.cmake")
    assert "-ffp-contract=off" in targets.read_text()
