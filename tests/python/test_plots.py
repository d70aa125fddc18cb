"""Figures: what is drawn is what was measured, and the same figure has the same bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from auvest import metrics, plots
from auvest.registry import replayable


def lines(figure: Any) -> dict[str, Any]:
    return {line.get_label(): line for line in figure.axes[0].get_lines()}


def test_nees_is_drawn_with_the_bounds_of_so_many_runs() -> None:
    rng = np.random.default_rng(7)
    error = rng.normal(size=(30, 50, 3))
    P = np.broadcast_to(np.eye(3), (30, 50, 3, 3)).copy()
    error[:10, 40:] = np.nan  # ten runs end early
    figure = plots.nees(error, P, time_s=np.linspace(0, 5, 50))
    drawn = lines(figure)
    x, y = drawn["NEES"].get_data()
    assert x[-1] == 5.0
    assert y[3] == pytest.approx(np.square(error[:, 3]).sum(axis=-1).mean(), rel=1e-12)
    assert y[45] == pytest.approx(np.square(error[10:, 45]).sum(axis=-1).mean(), rel=1e-12)
    assert drawn["expected: 3"].get_ydata()[0] == 3
    (band,) = figure.axes[0].collections
    corners = {round(float(v), 9) for v in band.get_paths()[0].vertices[:, 1]}
    wanted = {*metrics.chi2_bounds(3, 30), *metrics.chi2_bounds(3, 20)}
    assert corners == {round(v, 9) for v in wanted}
    low, high = metrics.chi2_bounds(3, 20)
    assert f"consistent: {low:.2f} to {high:.2f} (95 %)" in figure.axes[0].get_title(loc="left")


def test_nis_of_one_run_with_gaps() -> None:
    values = np.random.default_rng(3).chisquare(1, size=60)
    values[::7] = np.nan
    figure = plots.nis(values, 1, level=0.9)
    y = lines(figure)["NIS"].get_ydata()
    assert np.array_equal(y, values, equal_nan=True)
    known = values[np.isfinite(values)]
    low, high = metrics.chi2_bounds(1, known.size, 0.9)
    assert figure.axes[0].get_title(loc="left") == (
        f"mean of all: {known.mean():.2f}, consistent: {low:.2f} to {high:.2f} (90 %)"
    )
    assert figure.axes[0].get_ylabel() == "NIS"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plots.nis(np.ones((2, 3, 4)), 2), r"NIS has shape \(2, 3, 4\), expected"),
        (lambda: plots.nis(np.ones(5), 2, time_s=np.ones(4)), r"time_s has shape \(4,\), expe"),
        (lambda: plots.nis(np.full(5, np.nan), 2), "nis has no finite element"),
        (lambda: plots.nees(np.ones((5, 2)), np.ones((5, 3, 3))), "error has shape"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_across_and_along_are_those_of_a_circle() -> None:
    angle = np.linspace(0, np.pi, 400)
    circle = 10 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)  # to the left
    across, along = plots.off_track(circle, 0.9 * circle)  # a metre inside
    assert across[1:-1] == pytest.approx(np.ones(398), abs=1e-3)
    assert along[1:-1] == pytest.approx(np.zeros(398), abs=1e-9)


@pytest.mark.parametrize(("kind", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_same_figure_has_the_same_bytes(tmp_path: Path, kind: str, begins: bytes) -> None:
    made = []
    for name in ("a", "b"):
        with plots.own_style():
            figure = plots.nis(np.arange(1.0, 9.0), 2, title="$x$")
            made.append(plots.save(figure, tmp_path / f"{name}.{kind}").read_bytes())
    assert made[0] == made[1]
    assert made[0].startswith(begins)


def test_no_two_filters_of_a_figure_share_a_colour() -> None:
    for colours in (plots.FILTER_COLOURS, plots.SLAT_COLOURS, plots.KERNEL_COLOURS):
        assert len(set(colours.values())) == len(colours)
    assert set(plots.FILTER_COLOURS) >= set(replayable())
    assert plots.KERNEL_COLOURS["ekf"] == plots.FILTER_COLOURS["ekf"]
    assert plots.KERNEL_COLOURS["igg"] == plots.FILTER_COLOURS["robust-ekf"]
