"""Figures and words of a replay: what is drawn is what was measured."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from auvest.logs import LogFolder
from auvest.logs.write import write_file
from auvest.replay import Result, Settings, figures, replay, report, tables
from auvest.replay.samples import Samples

NAN = math.nan


@pytest.fixture
def result(tmp_path: Path) -> Result:
    """Something to fill with made-up numbers."""
    for name, columns in (
        ("fixes.csv", {"time_s": [1.0], "source": [0], "range_m": [9.0], "bearing_rad": [0.0]}),
        ("beacons.csv", {"source": [0], "x_m": [0.0], "y_m": [0.0]}),
    ):
        write_file(tmp_path, name, **columns)
    return replay(LogFolder(tmp_path), Settings())


def samples(names: tuple[str, ...], rows: int, **columns: list[Any]) -> Samples:
    table: dict[str, Any] = {name: np.full(rows, NAN) for name in names}
    table |= {"time_s": np.arange(float(rows)), "near_field": np.zeros(rows, bool)}
    if "outcome" in names:
        table["outcome"] = np.full(rows, tables.ACCEPTED, "U12")
        table["sensor"] = np.full(rows, "range")
    table |= {name: np.array(values) for name, values in columns.items()}
    made = Samples(names)
    made.add(table)
    return made


def measured(result: Result, **columns: list[Any]) -> Result:
    rows = len(next(iter(columns.values())))
    names = (*tables.MEASUREMENTS, *tables.SHOWN)
    made, doubted = samples(names, rows, **columns), Samples(names)
    full = made.columns()
    away = np.isin(full["outcome"], (tables.DOWNWEIGHTED, tables.REJECTED))
    doubted.add({name: values[away] for name, values in full.items()})
    return replace(result, measurements=made, outliers=doubted)


def curve(axes: Axes, label: str) -> tuple[list[float], list[float]]:
    (line,) = [one for one in axes.get_lines() if str(one.get_label()).startswith(label)]
    x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    return x.tolist(), y.tolist()


def test_the_nis_is_drawn_with_its_one_sided_bound(result: Result) -> None:
    """95 % of a squared normal deviate are below 1.959964^2, of two below -2 ln 0.05."""
    ranges = measured(result, nis=[1.0, 2.0], innovation_0=[1.0, 1.0])
    axes = figures.overview(ranges).axes[2]
    assert curve(axes, "95 %")[1] == pytest.approx([1.959964**2] * 2, rel=1e-6)
    assert curve(axes, "NIS") == ([0.0, 1.0], [1.0, 2.0])
    fixes = measured(result, nis=[1.0, 2.0], innovation_1=[NAN, 0.1])
    axes = figures.overview(fixes).axes[2]
    assert curve(axes, "95 %")[1] == pytest.approx([-2 * math.log(0.05)] * 2, rel=1e-12)


def test_the_error_is_drawn_with_three_sigma(result: Result) -> None:
    errors = samples(
        tables.ERRORS, 2, error_x_m=[1.0, -1.0], error_y_m=[2.0, 3.0], sigma_x_m=[0.5, 1.0],
        sigma_y_m=[2.0, 4.0],
    )  # fmt: skip
    _, x, y = figures.overview(replace(result, errors=errors)).axes
    assert curve(x, "error")[1] == [1.0, -1.0]
    assert curve(y, "error")[1] == [2.0, 3.0]
    for axes, bound in ((x, 3.0), (y, 12.0)):
        (band,) = axes.collections
        assert band.get_datalim(axes.transData).ymax == pytest.approx(bound)
        assert band.get_datalim(axes.transData).ymin == pytest.approx(-bound)


def test_innovations_near_the_station_are_not_drawn(result: Result) -> None:
    """There they are errors of a position, in metres along x and y."""
    filled = measured(
        result,
        innovation_0=[0.5, 9.0, -0.25],
        innovation_1=[0.01, 9.0, 0.02],
        sigma_0=[1.0, 1.0, 2.0],
        sigma_1=[0.1, 1.0, 0.2],
        near_field=[False, True, False],
        outcome=[tables.ACCEPTED, tables.ACCEPTED, tables.REJECTED],
    )
    along = figures.overview(filled).axes[1]
    assert curve(along, "innovation") == ([0.0, 2.0], [0.5, -0.25])
    assert curve(along, "rejected") == ([2.0], [-0.25])
    (band,) = along.collections
    assert band.get_datalim(along.transData).ymax == pytest.approx(6.0)
    assert along.get_yscale() == "linear"


def test_where_a_measurement_was_rejected_is_on_the_track(result: Result) -> None:
    filled = measured(
        result,
        x_m=[1.0, 2.0, 3.0],
        y_m=[-1.0, -2.0, -3.0],
        outcome=[tables.REJECTED, tables.DOWNWEIGHTED, tables.ACCEPTED],
    )
    assert curve(figures.overview(filled).axes[0], "measurement rejected") == ([1.0], [-1.0])
    labels = [line.get_label() for line in figures.overview(result).axes[0].get_lines()]
    assert "measurement rejected" not in labels


def test_the_title_has_the_verdict_and_the_error(result: Result) -> None:
    figure = figures.overview(replace(result, name="one", numbers=NUMBERS))
    assert figure.get_suptitle() == "one, ukf: sound, RMSE 0.123 m, of dead reckoning 2.25 m"
    unknown = {**NUMBERS, "rmse_m": None, "dead_reckoned_rmse_m": None}
    figure = figures.overview(replace(result, name="one", numbers=unknown))
    assert figure.get_suptitle() == "one, ukf: sound"


def test_gross_errors_do_not_flatten_the_rest(result: Result) -> None:
    """The axis is logarithmic beyond four bounds of three sigma, if something is beyond eight."""
    columns = {"sigma_0": [1.0] * 4}
    near = measured(result, innovation_0=[0.1, 0.2, 0.3, 23.9], **columns)
    far = measured(result, innovation_0=[0.1, 0.2, 0.3, -24.1], **columns)
    assert figures.overview(near).axes[1].get_yscale() == "linear"
    assert figures.overview(far).axes[1].get_yscale() == "symlog"


NUMBERS: dict[str, Any] = {
    "first_s": 1.25,
    "last_s": 20.0,
    "estimates": 7,
    "measurements": 28,
    "accepted": 1,
    "downweighted": 2,
    "rejected": 3,
    "held_out": 4,
    "before_start": 5,
    "after_end": 6,
    "no_position": 7,
    "too_short": 3,
    "started_from": "truth.csv",
    "recovered": 8,
    "near_field": 9,
    "rmse_m": 0.12345,
    "max_error_m": 1.5,
    "dead_reckoned_rmse_m": 2.25,
    "inside_3_sigma": 0.9875,
    "truth": 80,
    "held_out_rmse_m": 0.75,
    "nis_mean": 1.25,
    "nis_bounds_95": [0.5, 1.75],
    "late": {
        "ranges.csv": {"reordered": 1, "dropped": 5, "lines": [2, 3, 4, 5, 6]},
        "truth.csv": {"reordered": 2, "dropped": 6, "lines": [2, 3, 4, 5, 6]},
        "odometry.csv": {"reordered": 3, "dropped": 0, "lines": []},
    },
}


def test_figures_in_words(result: Result) -> None:
    assert dict(report.rows(replace(result, numbers=NUMBERS))) == {
        "verdict": "sound",
        "time": "1.2 to 20.0 s",
        "measurements": "28",
        "accepted": "1",
        "downweighted": "2",
        "rejected": "3",
        "held out": "4",
        "start": "truth.csv, first line: no start.csv says it",
        "recoveries from lock-out": "8",
        "taken as positions (near field)": "9",
        "late lines put in order": "6",
        "late lines not used": "11",
        "position RMSE": "0.123 m",
        "largest error": "1.500 m",
        "dead reckoning alone, RMSE": "2.250 m",
        "truth within 3 sigma": "98.8 %",
        "held-out measurements, RMSE": "0.750 m",
        "NIS, mean, rejected ones too": "1.250, within the 0.500 to 1.750 of a consistent filter",
    }
    for nis, where in ((0.25, "below"), (2.0, "above")):
        told = dict(report.rows(replace(result, numbers={**NUMBERS, "nis_mean": nis})))
        words = f"{nis:.3f}, {where} the 0.500 to 1.750 of a consistent filter"
        assert told["NIS, mean, rejected ones too"] == words
    # What is not known has no row.
    unknown = {**NUMBERS, "rmse_m": None, "nis_mean": None, "inside_3_sigma": None}
    known = dict(report.rows(replace(result, numbers=unknown)))
    for name in ("position RMSE", "NIS, mean, rejected ones too", "truth within 3 sigma"):
        assert name not in known


def test_what_was_not_used_in_words(result: Result) -> None:
    found = report.warnings(replace(result, numbers=NUMBERS, interrupted=True))
    assert found == [
        "The run was interrupted; this is what was done until then.",
        "ranges.csv: 5 not used, later than the window of 0 s allows (line 2, 3, 4, 5, 6).",
        "truth.csv: 6 not used, later than the window of 0 s allows (line 2, 3, 4, 5, 6 ...).",
        "Measurements: 5 not used, taken before the start of the run.",
        "Measurements: 6 not used, taken after the last line of the odometry.",
        "Measurements: 7 not used, the position of the source is not known at that time.",
        "Measurements: 3 not used, the range is shorter than the difference in depth.",
    ]
    document = replace(result, numbers=NUMBERS, interrupted=True).document()
    assert document["interrupted"] is True
    assert document["filter"] == "ukf"
