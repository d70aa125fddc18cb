"""What is imported when: `import auvest` and `auvest --help` wait for nothing they do without."""

import ast
import importlib.util
import sys

import pytest
from conftest import ROOT
from typer.testing import CliRunner

import auvest
from auvest.cli import COMMANDS, app

spec = importlib.util.spec_from_file_location("startup", ROOT / "cpp" / "benchmarks" / "startup.py")
startup = importlib.util.module_from_spec(spec)
spec.loader.exec_module(startup)

#: Large, and not needed by a filter.
EXTRAS = {"scipy", "matplotlib", "pyarrow", "rich", "typer"}


def loaded(run, code):
    """Return the packages that a new interpreter has after this code."""
    code += "\nimport sys; print(*{name.split('.')[0] for name in sys.modules}, file=sys.stderr)"
    code = f"import sys\nsys.stderr = sys.stdout\n{code}"
    return set(run(sys.executable, "-c", code).split())


def test_importing_auvest_imports_no_package(run):
    packages = loaded(run, "import auvest; dir(auvest)")
    assert "auvest" in packages
    assert not packages & {*EXTRAS, "numpy"}


def test_a_filter_needs_numpy_only(run):
    packages = loaded(run, "from auvest import Ukf, Aukf, RobustEkf, Slatf, metrics")
    assert "numpy" in packages
    assert not packages & EXTRAS


@pytest.mark.parametrize("words", [["--help"], ["simulate", "--help"], ["reproduce", "-h"]])
def test_help_of_groups_does_without_numpy(run, words):
    call = f"from auvest.cli import app\ntry:\n    app({words})\nexcept SystemExit:\n    pass"
    packages = loaded(run, call)
    assert "typer" in packages
    assert not packages & {"numpy", "matplotlib", "pyarrow", "scipy"}


def test_public_names_are_complete_and_the_same_for_type_checkers():
    (checked,) = [
        node
        for node in ast.parse((ROOT / "python/auvest/__init__.py").read_text()).body
        if isinstance(node, ast.If)
    ]
    homes = {}
    for node in checked.body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                assert alias.asname == alias.name  # exported on purpose
                homes[alias.name] = node.module
    assert list(auvest.__all__) == sorted(homes)
    assert {*auvest.__all__, "__version__"} <= set(dir(auvest))
    for name, module in homes.items():
        value = getattr(auvest, name)
        assert value is getattr(sys.modules[module], name)
        assert name in vars(auvest)  # found at once from now on
    scope = {}
    exec("from auvest import *", scope)
    assert set(homes) <= set(scope)


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="module 'auvest' has no attribute 'Ukv'"):
        _ = auvest.Ukv
    assert not hasattr(auvest, "__wrapped__")


@pytest.mark.parametrize("words", COMMANDS)
def test_each_command_has_its_line_in_its_group_and_on_top_of_its_help(words, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    (*group, name), line = words, COMMANDS[words]
    listed = CliRunner().invoke(app, [*group, "--help"])
    assert f" {name} " in listed.stdout
    assert line in listed.stdout
    own = CliRunner().invoke(app, [*words, "--help"])
    assert own.exit_code == 0
    assert line in own.stdout
    assert "Examples:" in own.stdout
    assert "Exit codes: 0 done;" in own.stdout
    assert f"auvest {' '.join(words)} " in own.stdout  # one of the examples


def test_an_unknown_command_is_refused_with_what_is_meant():
    done = CliRunner().invoke(app, ["simulate", "aukff"])
    assert done.exit_code == 2
    assert "Did you mean 'aukf'?" in done.stderr


def test_the_benchmarks_ratios():
    times = {startup.BARE: 1.0, startup.NUMPY: 3.0, startup.IMPORT: 2.0, startup.FILTER: 5.0}
    times[startup.HELP] = 3 * startup.HELP_BEFORE
    found = startup.ratios(times)
    assert found == {startup.IMPORT: 0.5, startup.FILTER: 2.0, startup.HELP: 1.0}
    page = startup.page(times)
    assert "interpreter that imports nothing, 1000 ms" in page
    assert "| `import numpy` | 2000 | 1 |" in page
    assert "| `import auvest` | 1000 | 0.50 |" in page
    assert "| `auvest --help` | 13380 | 1.00 of what" in page


def test_the_benchmark_counts_processor_time_and_wants_success():
    assert 0 < startup.seconds(startup.command(startup.BARE)) < 5
    sleeping = startup.seconds([sys.executable, "-c", "import time; time.sleep(1)"])
    assert sleeping < 0.8
    with pytest.raises(RuntimeError, match="exit code 3"):
        startup.seconds([sys.executable, "-c", "raise SystemExit(3)"])
