"""The bench of mistakes: what counts as right, and that the page is what was measured."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

from auvest.reproduce.mistakes import measure, page
from auvest.reproduce.mistakes.injected import MISTAKES
from auvest.reproduce.mistakes.measure import Bench, Recording, Row
from auvest.reproduce.mistakes.trials import KINDS

PAGE = ROOT / "docs" / "reproduction" / "mistakes"


@pytest.mark.parametrize(
    ("mistake", "named", "right"),
    [
        ("latency", ["latency"], True),
        ("latency", ["innovations", "recoveries", "latency", "slant_range"], True),
        ("latency", ["range_scale", "slant_range", "latency"], False),  # three are a guess
        ("latency", ["innovations"], False),
        ("latency", [], False),
        (measure.CLEAN, [], True),
        (measure.CLEAN, ["innovations"], False),
        (measure.TENTH, ["noise_too_small"], True),
    ],
)
def test_what_is_right(mistake: str, named: list[str], right: bool) -> None:
    assert measure.right(mistake, named) is right


def test_an_aim_is_for_all_kinds_of_a_mistake_and_clean_trials_are_all_sound() -> None:
    rows = [
        Row("slant", "leaders", "slant_range", 10, 10, ()),
        Row("slant", "beacons", "slant_range", 10, 8, ("nothing", "range_scale")),
        Row("latency", "leaders", "latency", 10, 8, ("nothing", "nothing")),
        Row(measure.CLEAN, "leaders", "", 100, 99, ("latency",)),
    ]
    recordings = [Recording("a", "doubtful", ("range_scale",)), Recording("b", "not_trusted", ())]
    held = Bench(rows, recordings).held()
    assert held == {"slant": True, "latency": False, measure.CLEAN: False, "a": True, "b": False}
    header, cells = measure.mistake_table(Bench(rows, recordings))
    latency = dict(zip(header, cells[1], strict=True))
    assert (latency["leaders"], latency["beacons"]) == ("8 of 10", "")
    assert (latency["right"], latency["otherwise"]) == ("80 %", "2: nothing")


def test_a_trial_is_that_of_its_seed(tmp_path: Path) -> None:
    for seed, folder in ((1, "a"), (1, "b"), (2, "c")):
        measure.trial("scale", "leaders", seed, tmp_path / folder)
    a, b, c = ((tmp_path / one / "ranges.csv").read_text() for one in "abc")
    assert a == b != c


@pytest.mark.parametrize(
    ("name", "kind"), [(name, kind) for name, one in MISTAKES.items() for kind in one.kinds]
)
def test_a_mistake_is_in_the_files_of_its_trial(name: str, kind: str, tmp_path: Path) -> None:
    measure.trial(measure.CLEAN, kind, 3, tmp_path / "clean")
    measure.trial(name, kind, 3, tmp_path / "spoiled")
    clean, spoiled = (
        {path.name: path.read_text() for path in (tmp_path / one).iterdir()}
        for one in ("clean", "spoiled")
    )
    assert spoiled != clean


def test_bearings_and_turns_of_degrees_are_180_over_pi_of_those_in_radians() -> None:
    for kind, file, column in (
        ("tracking", "fixes.csv", "bearing_rad"),
        ("leaders", "odometry.csv", "turn_rad"),
    ):
        files = KINDS[kind].make(np.random.default_rng(3))
        rad = files[file][column].copy()
        MISTAKES["degrees"].spoil(files, np.random.default_rng(3))
        np.testing.assert_allclose(files[file][column], rad * 180 / np.pi, rtol=1e-15)


def test_the_page_is_what_was_measured_and_every_aim_is_reached() -> None:
    document = json.loads((PAGE / "results.json").read_text(encoding="utf-8"))
    rows = [Row(**{**row, "wrong": tuple(row["wrong"])}) for row in document["rows"]]
    recordings = [
        Recording(**{**one, "causes": tuple(one["causes"])}) for one in document["recordings"]
    ]
    bench = Bench(rows, recordings)
    assert page.page(bench) == (PAGE / "README.md").read_text(encoding="utf-8")
    assert set(MISTAKES) <= set(bench.mistakes)
    assert len({one.name.split(",")[0] for one in recordings}) == len(measure.SETS)
    missed = [name for name, held in bench.held().items() if not held]
    assert missed == []
