"""Noises ten times off: what counts, and that the page is what was measured."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import ROOT

from auvest.importers.sets import IMPORTERS
from auvest.logs import LogFolder
from auvest.replay import find_settings
from auvest.replay.calibration import calibrate
from auvest.reproduce.calibration import measure, page
from auvest.reproduce.calibration.measure import Bench, Figures, Row

PAGE = ROOT / "docs" / "reproduction" / "calibration"
DATA = os.environ.get("AUVEST_DATA")
needs_data = pytest.mark.skipif(
    DATA is None, reason="AUVEST_DATA does not name the folder of the validation recordings"
)


def read(name: str) -> Bench:
    """The bench as results.json has it."""
    document = json.loads((PAGE / name).read_text(encoding="utf-8"))
    rows = [
        Row(**{**row, "wrong": Figures(**row["wrong"]), "right": Figures(**row["right"])})
        for row in document["rows"]
    ]
    return Bench({name: Figures(**one) for name, one in document["documented"].items()}, rows)


def test_the_page_is_what_was_measured_and_every_aim_is_reached() -> None:
    bench = read("results.json")
    assert set(bench.documented) == set(measure.SETS)
    assert all(bench.held().values())
    assert page.page(bench) == (PAGE / "README.md").read_text(encoding="utf-8")


def test_what_holds() -> None:
    good = Figures(1.0, 0.99, 1.2)
    row = Row("goats14", "all", 0.1, Figures(5.0, 0.1, 0.2), replace(good, rmse_m=1.14), 200, 1.0)
    documented = {"goats14": good}
    assert Bench(documented, [row]).held() == {"goats14": True, "goats14, sigmas": True}
    for right, held in (
        (Figures(1.16, 0.99, 1.2), (False, True)),  # 15 % and no more
        (Figures(1.0, 0.94, 1.2), (True, False)),  # sigmas too small
        (Figures(1.0, 0.99, 2.1), (True, False)),  # and too large
    ):
        bench = Bench(documented, [row, replace(row, right=right)])
        assert tuple(bench.held().values()) == held
    # Without a truth there is nothing to compare sigmas with.
    row = replace(row, set_name="ugps_pier59", right=Figures(0.6, None, None))
    bench = Bench({"ugps_pier59": Figures(0.6, None, None)}, [row])
    assert bench.held() == {"ugps_pier59": True}


def test_figures_are_means_over_the_logs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the errors where there is a truth, else of what was held out, which has no sigmas."""

    def replayed(log: Any, *_: object, **__: object) -> SimpleNamespace:
        numbers, sigmas = log
        columns = {"sigma_x_m": np.array(sigmas[0]), "sigma_y_m": np.array(sigmas[1])}
        return SimpleNamespace(numbers=numbers, errors=SimpleNamespace(columns=lambda: columns))

    monkeypatch.setattr(measure, "replay", replayed)
    first = {"truth": True, "rmse_m": 1.0, "inside_3_sigma": 0.75, "held_out_rmse_m": 50.0}
    second = {"truth": True, "rmse_m": 3.0, "inside_3_sigma": 0.25, "held_out_rmse_m": 70.0}
    logs: list[Any] = [(first, ([3.0, 6.0], [4.0, 8.0])), (second, ([5.0], [12.0]))]
    settings = find_settings("goats14")
    assert measure.figures(logs, settings) == Figures(2.0, 0.5, (7.5 + 13) / 2)
    logs = [({**numbers, "truth": False}, sigmas) for numbers, sigmas in logs]
    assert measure.figures(logs, settings) == Figures(60.0, None, None)


@needs_data
@pytest.mark.parametrize("times", measure.OFF)
def test_a_recording_brings_its_noises_back(tmp_path: Path, times: float) -> None:
    assert DATA is not None
    name = "labyrinth_uwb"
    logs = [LogFolder(one) for one in IMPORTERS[name](Path(DATA) / name, tmp_path)]
    spoilt = measure.spoilt(logs[0], find_settings(name))["all", times]
    documented = measure.figures(logs, find_settings(name))
    row = Row(
        name, "all", times, measure.figures(logs, spoilt),
        measure.figures(logs, calibrate(logs, spoilt).settings), 0, 0.0,
    )  # fmt: skip
    assert not all(Bench({name: documented}, [replace(row, right=row.wrong)]).held().values())
    assert all(Bench({name: documented}, [row]).held().values())
