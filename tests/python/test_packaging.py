"""The wheel and the sdist: what they contain, and that the wheel works outside the source tree."""

import hashlib
import json
import os
import re
import subprocess
import sys
import tarfile
import zipfile
from importlib.metadata import version

import pytest

import auvest
from auvest.firmware import package


@pytest.fixture(scope="module")
def declared_version(root):
    """Return the version that pyproject.toml declares."""
    text = (root / "pyproject.toml").read_text()
    return re.search(r'^version = "(.+)"$', text, re.MULTILINE)[1]


@pytest.fixture(scope="module")
def wheel(root, tmp_path_factory):
    """Return the path of a fresh wheel; compiled objects of earlier builds are reused."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", root]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


def test_version_has_one_source(declared_version, wheel):
    assert version("auvest") == auvest.__version__ == declared_version
    assert wheel.name.split("-")[:2] == ["auvest", declared_version]


def test_wheel_contents(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    package = [name for name in names if ".dist-info/" not in name]
    assert {"auvest/__init__.py", "auvest/_core.pyi", "auvest/py.typed"} <= set(package)
    assert [name for name in package if re.fullmatch(r"auvest/_core\..*\.so", name)]
    # No tests, no caches; C++ only where it is compiled from: headers, library, board, bench.
    assert not [name for name in package if not name.startswith("auvest/")]
    assert not [name for name in package if re.search(r"\btests?\b|__pycache__", name)]
    sources = {name.rpartition("/")[0] for name in package if re.search(r"\.([ch]pp|S|ino)$", name)}
    brought = (
        "include",
        *(f"firmware/{part}" for part in ("library", "avr_std", "board", "bench")),
    )
    assert all(folder.startswith(tuple(f"auvest/{part}" for part in brought)) for folder in sources)
    headers = [name.split("/")[2] for name in package if name.startswith("auvest/include/")]
    assert set(headers) == {"Eigen", "auvest", "desk"}


def test_wheel_ships_what_models_are_compiled_against(wheel, root, tmp_path):
    """All headers of the core and the desk, those of Eigen that they need, and its licence."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    include = tmp_path / "auvest" / "include"
    for folder in (root / "cpp" / "include" / "auvest", root / "cpp" / "desk"):
        for path in folder.rglob("*.hpp"):
            shipped = include / folder.name / path.relative_to(folder)
            assert shipped.read_bytes() == path.read_bytes()
    assert "Mozilla Public License Version 2.0" in (include / "Eigen/COPYING.MPL2").read_text()
    # The compiler finds all in there, and takes Eigen from nowhere else.
    (tmp_path / "all.cpp").write_text('#include "auvest/auvest.hpp"\n#include "desk/library.hpp"\n')
    command = ["g++", "-std=c++17", "-M", "-I", include, tmp_path / "all.cpp"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    named = re.findall(r"\S*/(?:Eigen|auvest|desk)/\S+", done.stdout)
    assert len(named) > 150
    assert all(name.startswith(str(include)) for name in named)


@pytest.mark.skipif("AUVEST_SLOW_TESTS" not in os.environ, reason="AUVEST_SLOW_TESTS is not set")
def test_load_models_from_an_installed_wheel(wheel, root, tmp_path, run):
    """In an empty environment, with the dependencies from where pip finds them."""
    run(sys.executable, "-m", "venv", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", wheel)
    (tmp_path / "my_models.hpp").write_bytes((root / "cpp/examples/my_models.hpp").read_bytes())
    code = (
        "import auvest, numpy\n"
        "models = auvest.load_models('my_models.hpp')\n"
        "ukf = auvest.Ukf([1, 2, 0, 0, 0, 0], numpy.eye(6),"
        " process=models.MyAcceleration(), sensors=models.MyRangeBearing(), dtype='float32')\n"
        "ukf.predict(0.1)\n"
        "ukf.update([3, 0.5])\n"
        "print(auvest.get_include(), models.path, ukf.innovation)\n"
    )
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": str(tmp_path),
        "AUVEST_CACHE": str(tmp_path / "cache"),
    }
    printed = run(python, "-c", code, env=environment)
    assert printed.startswith(str(tmp_path / "venv"))
    assert len(list((tmp_path / "cache").glob("*.so"))) == 1


def test_wheel_ships_what_firmware_is_made_from(wheel, root):
    with zipfile.ZipFile(wheel) as archive:
        shipped = {name: archive.read(name) for name in archive.namelist()}
    for folder in ("library", "avr_std", "board", "cost", "bench"):
        paths = [path for path in (root / "firmware" / folder).rglob("*") if path.is_file()]
        assert paths
        for path in paths:
            assert shipped[f"auvest/firmware/{path.relative_to(root / 'firmware')}"] == (
                path.read_bytes()
            )
    assert shipped["auvest/firmware/LICENSE"] == (root / "LICENSE").read_bytes()
    budgets = (root / "firmware" / "budgets.csv").read_bytes()  # what `auvest fit` says
    assert shipped["auvest/firmware/budgets.csv"] == budgets


@pytest.mark.skipif("AUVEST_SLOW_TESTS" not in os.environ, reason="AUVEST_SLOW_TESTS is not set")
def test_cost_from_an_installed_wheel(wheel, root, tmp_path, run):
    """In an empty environment: the library is packed and the board built from what it brings."""
    run(sys.executable, "-m", "venv", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", wheel)
    (tmp_path / "my_models.hpp").write_bytes((root / "cpp/examples/my_models.hpp").read_bytes())
    environment = {
        "PATH": f"{tmp_path / 'venv' / 'bin'}:{os.environ['PATH']}",
        "HOME": str(tmp_path),
        "AUVEST_CACHE": str(tmp_path / "cache"),
    }
    command = ("auvest", "cost", tmp_path / "my_models.hpp", "--filter", "aukf", "--json")
    printed = json.loads(run(*command, env=environment, cwd=tmp_path))
    assert printed["same_bits"] is True
    assert printed["flash_bytes"] > printed["flash_above_empty_bytes"] > 10_000
    assert list((tmp_path / "cache").glob("auvest-board-*"))


def test_wheel_outside_the_source_tree(wheel, declared_version, tmp_path, run):
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    run(
        *(sys.executable, "-m", "pip", "--python", python),
        *("install", "--no-deps", "--no-index", wheel),
    )
    # The dependencies come from this environment, behind the new one's own packages. An editable
    # auvest among them stays out: its .pth file counts in a site folder only.
    dependencies = [p for p in sys.path if p.endswith("site-packages")]
    code = (
        f"import sys; sys.path += {dependencies!r}\n"
        "import auvest._core, auvest.cli, hashlib, importlib.metadata\n"
        "from auvest.firmware import package\n"
        "print(importlib.metadata.version('auvest'), auvest.__file__, auvest._core.__file__, "
        "hashlib.sha256(package.archive()).hexdigest(), sep='\\n', flush=True)\n"
        "auvest.cli.app(['simulate', 'aukf', '--runs', '2'])"
    )
    found, *files, library = run(python, "-c", code).splitlines()[:4]
    assert found == declared_version
    assert all(file.startswith(str(tmp_path)) for file in files)
    # The Arduino library, from what the wheel brings: byte for byte that of the source tree.
    assert library == hashlib.sha256(package.archive()).hexdigest()


def test_sdist_has_what_git_tracks(root, tmp_path, declared_version, run):
    """No more, whatever lies about in the checkout, and no less."""
    stray = root / "python" / "auvest" / "left [over] by someone.txt"
    code = "import backend, sys; print(backend.build_sdist(sys.argv[1]))"
    stray.write_text("not tracked, not ignored")
    try:
        environment = {**os.environ, "PYTHONPATH": str(root / "python")}
        run(sys.executable, "-c", code, tmp_path, cwd=root, env=environment)
    finally:
        stray.unlink()
    with tarfile.open(tmp_path / f"auvest-{declared_version}.tar.gz") as archive:
        files = [member.name for member in archive.getmembers() if member.isfile()]
    names = {name.split("/", 1)[1] for name in files}
    tracked = set(run("git", "ls-files", "-z", cwd=root).split("\0")) - {"", ".ci/run"}
    assert names - {"PKG-INFO"} == {name for name in tracked if (root / name).exists()}


def test_tests_run_with_the_packages_of_the_lock(root):
    """Every one that is installed here is in it, in its version."""
    lock = (root / "tests/requirements.lock").read_text()
    entries = re.split(r"(?m)^(?=[a-z0-9])", lock)[1:]
    assert len(entries) > 40
    locked = {}
    for entry in entries:
        name, found = re.match(r"([a-z0-9-]+)==([^ ;]+)", entry).groups()
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), name
        locked.setdefault(name, set()).add(found)
    text = (root / "pyproject.toml").read_text()
    lists = re.findall(r"(?ms)^(?:requires|dependencies|test|dev) = \[(.*?)\]$", text)
    wanted = [name for part in lists for name in re.findall(r'"([A-Za-z0-9-]+)[>=]', part)]
    assert {"pybind11", "numpy", "hypothesis", "mypy"} <= set(wanted)
    for name in wanted:
        assert name in locked, f"{name}: make lock"
        if "CI" in os.environ and name != "tomli":  # which newer versions of Python have
            assert version(name) in locked[name], f"{name}: make install-editable"
