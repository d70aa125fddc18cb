"""The wheel and the sdist: what they contain, and that the wheel works outside the source tree."""

import hashlib
import json
import os
import re
import subprocess
import sys
import tarfile
import zipfile
from email.parser import HeaderParser
from importlib.metadata import version

import pytest

import auvest
from auvest.firmware import package

CODE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def files_of(sdist, folder=""):
    """Return the files of a source distribution by name, or those below a folder by name in it."""
    with tarfile.open(sdist) as archive:
        files = {
            member.name.split("/", 1)[1]: archive.extractfile(member).read()
            for member in archive.getmembers()
            if member.isfile()
        }
    return {
        name.removeprefix(folder): content
        for name, content in files.items()
        if name.startswith(folder)
    }


@pytest.fixture(scope="module")
def declared_version(root):
    """Return the version that pyproject.toml declares."""
    text = (root / "pyproject.toml").read_text()
    return re.search(r'^version = "(.+)"$', text, re.MULTILINE)[1]


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


def test_sdist_has_what_git_tracks(root, sdist, run):
    """No more, whatever lies about in the checkout, and no less; headers of others beside it."""
    names = files_of(sdist)
    tracked = set(run("git", "ls-files", "-z", cwd=root).split("\0")) - {"", ".ci/run"}
    own = {name for name in names if not name.startswith("cpp/vendored/")}
    assert own - {"PKG-INFO"} == {name for name in tracked if (root / name).exists()}


def test_sdist_has_the_headers_that_the_wheel_ships(sdist, wheel):
    """Of Eigen the same ones, which are under licences that allow it; and those of xsimd."""
    brought = files_of(sdist, "cpp/vendored/")
    eigen = {name: content for name, content in brought.items() if name.startswith("Eigen/")}
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if name.startswith("auvest/include/Eigen/")]
        shipped = {name.removeprefix("auvest/include/"): archive.read(name) for name in names}
    licences = {"Eigen/COPYING.MPL2", "Eigen/README.Eigen"}
    assert len(eigen) > 150
    assert eigen == {name: shipped[name] for name in shipped.keys() - licences}
    assert "xsimd/xsimd.hpp" in brought
    assert {name.partition("/")[0] for name in brought} == {"Eigen", "xsimd"}


def test_sdist_is_compiled_with_its_own_headers(sdist, tmp_path, run):
    """Eigen and xsimd of this computer are not looked at."""
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.glob("auvest-*")
    build = tmp_path / "build"
    run(
        *("cmake", "-S", unpacked, "-B", build, "-G", "Ninja", "-DAUVEST_BUILD_BINDINGS=ON"),
        *("-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON"),
        f"-DPython_EXECUTABLE={sys.executable}",
        f"-Dpybind11_DIR={run(sys.executable, '-m', 'pybind11', '--cmakedir').strip()}",
    )
    cache = (build / "CMakeCache.txt").read_text()
    assert f"xsimd_include_dir:PATH={unpacked}/cpp/vendored" in cache
    commands = json.loads((build / "compile_commands.json").read_text())
    (command,) = (
        entry["command"] for entry in commands if entry["file"].endswith("/wide_avx2.cpp")
    )
    compile_only, _, source = command.partition(" -o ")
    includes = run(*compile_only.split(), "-M", source.split()[-1], cwd=build)
    named = re.findall(r"\S*/(?:Eigen|xsimd)/\S+", includes)
    assert any("/Eigen/" in name for name in named)
    assert any("/xsimd/" in name for name in named)
    assert all(name.startswith(f"{unpacked}/cpp/vendored/") for name in named)


def test_readme_of_the_package_leads_nowhere_that_is_not_there(sdist):
    """Its links are into the repository: their texts remain. Blocks of code are as they were."""
    readme = files_of(sdist)["README.md"].decode()
    shown = HeaderParser().parsestr(files_of(sdist)["PKG-INFO"].decode()).get_payload()
    link = re.compile(r"\[([^\]]+)\]\((?!https?:)[^)]+\)")
    texts = link.findall(re.sub(r"!\[[^\]]*\]\([^)]*\)", "", readme))
    assert len(texts) > 20
    assert not link.search(shown)
    assert all(text in shown for text in texts)
    assert [*CODE.findall(shown)] == [*CODE.findall(readme)]


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
    lists = re.findall(r"(?ms)^(?:requires|dependencies|test|dev|release) = \[(.*?)\]$", text)
    wanted = [name for part in lists for name in re.findall(r'"([A-Za-z0-9-]+)[>=]', part)]
    assert {"pybind11", "numpy", "hypothesis", "mypy"} <= set(wanted)
    for name in wanted:
        assert name in locked, f"{name}: make lock"
        if "CI" in os.environ and name != "tomli":  # which newer versions of Python have
            assert version(name) in locked[name], f"{name}: make install-editable"
