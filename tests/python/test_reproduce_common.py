"""What the commands share that reproduce or simulate: pages, claims, estimates, ends."""

from __future__ import annotations

import ast
import json
import string
import sys
import types
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
import typer
from conftest import ROOT
from typer.testing import CliRunner

from auvest.commands import reproduce
from auvest.commands.console import Terminal, discard_unpublished
from auvest.commands.session import Session, failure, mean_over_runs
from auvest.reproduce import markdown
from auvest.reproduce.claims import NO, PARTLY, YES, Claim, Claims, graded, tally
from auvest.reproduce.estimate import Estimate, all_below_zero
from auvest.reproduce.ticks import Ticks

FOLDERS = sorted(path.parent for path in (ROOT / "python/auvest/reproduce").glob("*/page.md"))


def places(text: str) -> set[str]:
    """The names that a template has places for."""
    fields = (field for _, field, _, _ in string.Formatter().parse(text) if field)
    return {field.replace("[", ".").split(".")[0] for field in fields}


def test_there_is_a_template_for_each_command() -> None:
    assert [path.name for path in FOLDERS] == [
        "aukf", "calibration", "constants", "intervals", "logs", "mekf", "mistakes", "mrclam6",
        "slatf", "vehicle",
    ]  # fmt: skip


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_a_page_gets_what_its_template_has_places_for(folder: Path) -> None:
    (call,) = (
        node
        for node in ast.walk(ast.parse((folder / "page.py").read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "markdown.page"
    )
    given = {keyword.arg for keyword in call.keywords}
    wanted = places((folder / "page.md").read_text(encoding="utf-8"))
    if None in given:  # mrclam6 hands over its JSON, whose names the others must not hide
        results = json.loads((ROOT / "docs/reproduction/mrclam6/results.json").read_text())
        assert not given & set(results)
        assert wanted <= given | set(results)
        assert given - {None} <= wanted
    else:
        assert given == wanted


@pytest.mark.parametrize("name", ["aukf", "mekf", "slatf"])
def test_every_text_of_a_claim_is_used(name: str) -> None:
    folder = ROOT / "python/auvest/reproduce" / name
    source = (folder / "claims.py").read_text(encoding="utf-8")
    texts = [
        line[1:-1]
        for line in (folder / "claims.toml").read_text(encoding="utf-8").splitlines()
        if line.startswith("[")
    ]
    assert len(texts) > 5
    for text in texts:
        assert f'"{text}"' in source


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of pages and claims called `made_up`."""
    folder = tmp_path / "made_up"
    folder.mkdir()
    (folder / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "made_up", raising=False)
    return folder


def test_a_page_is_its_template_filled(package: Path) -> None:
    (package / "page.md").write_text(
        "# {one.name}\n\n{two:.2f}\nm\n\n| a |\n| --- |\n{rows}\n\n| b |\n"
    )
    page = markdown.page(
        "made_up.page",
        one=types.SimpleNamespace(name="N"),
        two=1.234,
        rows=markdown.rows([("x|y",), (3,)]) + "\n",
    )
    assert page == "# N\n\n1.23 m\n\n| a |\n| --- |\n| x\\|y |\n| 3 |\n\n| b |\n"
    with pytest.raises(KeyError, match="one"):
        markdown.page("made_up.page", two=1.0, rows="")


def test_a_claim_is_its_text_filled(package: Path) -> None:
    (package / "claims.toml").write_text(
        '[first]\nwhere = "Fig. {figure}"\npaper = "it is\\nso"\nmeasured = """\n{x:.1f}\nm"""\n'
    )
    claim = Claims("made_up.claims", Claim)
    assert claim("first", YES, figure=3, x=0.25) == Claim("Fig. 3", "it is so", "0.2 m", YES)
    with pytest.raises(KeyError, match="second"):
        claim("second", YES)


def test_verdicts() -> None:
    assert (graded(True), graded(True, partly=True), graded()) == (YES, YES, NO)
    assert graded(partly=True) == PARTLY
    judged = [Claim("", "", "", verdict) for verdict in (NO, YES, NO)]
    assert tally(judged) == f"2 {NO}; 1 {YES}"


def test_an_estimate_in_words_and_its_sign() -> None:
    assert Estimate(1.234, 0.056).text(2) == "1.23 ± 0.06"
    assert Estimate(12.34, 0.56).text(1, " %", "+") == "+12.3 % ± 0.6 %"
    assert Estimate(1.234, float("nan")).text(1) == "1.2"
    below = Estimate(-2.1, 1.0)
    assert below.below_zero
    assert not Estimate(-2.0, 1.0).below_zero
    assert not Estimate(-2.0, float("nan")).below_zero
    assert all_below_zero([below, below])
    assert not all_below_zero([below, Estimate(0.0, 0.0)])


def test_ticks_count() -> None:
    calls: list[tuple[int, int]] = []
    tick = Ticks(2, lambda *both: calls.append(both))
    tick()
    tick()
    assert calls == [(1, 2), (2, 2)]
    Ticks(1, None)()


def test_mean_over_runs_is_that_of_what_is_known() -> None:
    values = np.array([[1.0, np.nan, np.nan], [3.0, 5.0, np.nan]])
    np.testing.assert_array_equal(mean_over_runs(values), [2.0, 5.0, np.nan])


def test_the_first_failure_is_named() -> None:
    status = np.array([0, 0, 2, 1])
    result = types.SimpleNamespace(failed=status > 0, status=status, samples=np.array([9, 9, 4, 5]))
    assert failure(result, " of the plain filter").startswith(
        "2 of 4 runs of the plain filter failed; the first, run 2, after 4 steps: "
    )
    del result.samples
    assert failure(result).startswith("2 of 4 runs failed; the first, run 2: ")
    result.failed = status > 5
    assert failure(result) == ""


def test_a_session_ends_with_what_happened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def session() -> Session:
        discard_unpublished()
        return Session(Terminal(as_json=False, quiet=False), tmp_path / "out", "simulate x", {})

    def stopped(partial: Any, **_: Any) -> Any:
        stop = KeyboardInterrupt()
        stop.partial = partial  # type: ignore[attr-defined]
        raise stop

    done = session()
    assert done.run(lambda number, **_: number, 3) == 3
    assert not done.interrupted
    done.end("kept", "", "")  # nothing to say
    with pytest.raises(typer.Exit) as end:
        done.end("kept", "", "two runs failed")
    assert end.value.exit_code == 1
    halted = session()
    assert halted.run(stopped, 2) == 2
    with pytest.raises(typer.Exit) as end:
        halted.end("2 of 3 are kept", "two runs failed")
    assert end.value.exit_code == 130
    assert "interrupted: 2 of 3 are kept" in capsys.readouterr().err
    empty = session()
    assert empty.run_some(stopped, None) is None
    with pytest.raises(typer.Exit) as end:
        empty.nothing_done()
    assert end.value.exit_code == 130
    with pytest.raises(typer.Exit) as end:
        empty.run(stopped, None)
    assert end.value.exit_code == 130
    assert capsys.readouterr().err.count("no run was done") == 2


@dataclass
class Result:
    """What the made-up experiment below measures."""

    runs: int
    failed_runs: int = 0
    unfinished: str = ""


@pytest.fixture
def experiment() -> types.SimpleNamespace:
    """The modules of a made-up experiment; its measure() gives `result`, or raises it."""
    measure = types.ModuleType("auvest.reproduce.made_up.measure")
    page = types.ModuleType("auvest.reproduce.made_up.page")
    made = types.SimpleNamespace(measure=measure, page=page, result=Result(7))

    def measured(*, runs: int = 7, progress: Any) -> Result:
        progress(1, 1)
        if isinstance(made.result, BaseException):
            raise made.result
        made.result.runs = runs
        return made.result  # type: ignore[no-any-return]

    measure.measure = measured  # type: ignore[attr-defined]
    measure.summary = vars  # type: ignore[attr-defined]
    page.page = lambda result: f"{result.runs} runs\n"  # type: ignore[attr-defined]
    return made


def call(experiment: types.SimpleNamespace, *arguments: str) -> Any:
    app = typer.Typer()
    command = reproduce.command(
        experiment.measure,
        experiment.page,
        lambda _: ["a table"],
        figures=False,
        runs=Annotated[int, typer.Option("--runs", min=1)],
    )
    app.command()(command)
    return CliRunner().invoke(app, list(arguments))


def test_reproduce_writes_page_and_json_with_the_defaults_of_measure(
    experiment: types.SimpleNamespace, tmp_path: Path
) -> None:
    output = ["--output", str(tmp_path)]
    done = call(experiment, *output)
    assert done.exit_code == 0, done.output
    assert (tmp_path / "README.md").read_text() == "7 runs\n"
    assert done.stdout.splitlines() == [
        "a table",
        f"page      {tmp_path / 'README.md'}",
        f"results   {tmp_path / 'results.json'}",
    ]
    done = call(experiment, *output, "--runs", "3", "--json")
    document = json.loads(done.stdout)
    assert document["command"] == "reproduce made-up"
    assert document["runs"] == 3
    assert document == json.loads((tmp_path / "results.json").read_text())
    assert call(experiment, *output, "--runs", "0").exit_code == 2


@pytest.mark.parametrize(
    ("result", "code", "says", "files"),
    [
        (Result(7, failed_runs=2), 1, "2 runs failed", 3),
        (Result(7, unfinished="2 of 3 points"), 130, "2 of 3 points are written", 3),
        (KeyboardInterrupt(), 130, "0 files are written", 0),
        (ValueError("runs is odd"), 2, "runs is odd", 0),
    ],
)
def test_reproduce_ends_with_what_happened(
    experiment: types.SimpleNamespace,
    tmp_path: Path,
    result: Any,
    code: int,
    says: str,
    files: int,
) -> None:
    experiment.result = result
    done = call(experiment, "--output", str(tmp_path))
    assert done.exit_code == code
    assert says in " ".join(done.stderr.split())
    assert len(list(tmp_path.iterdir())) == files


def test_reproduce_refuses_before_it_writes(
    experiment: types.SimpleNamespace, tmp_path: Path
) -> None:
    def check(*, runs: int) -> None:
        raise ValueError(f"{runs} is not enough")

    experiment.measure.check = check
    done = call(experiment, "--output", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert "7 is not enough" in done.stderr
    assert not (tmp_path / "out").exists()
