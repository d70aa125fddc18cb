"""Figures: what is drawn is what was measured, and the same figure has the same bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import auvest
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
    assert f"the consistent {low:.2f} to {high:.2f} (95 %)" in figure.axes[0].get_title(loc="left")


def test_nis_of_one_run_with_gaps() -> None:
    values = np.random.default_rng(3).chisquare(1, size=60)
    values[::7] = np.nan
    figure = plots.nis(values, 1, level=0.9)
    y = lines(figure)["NIS"].get_ydata()
    assert np.array_equal(y, values, equal_nan=True)
    known = values[np.isfinite(values)]
    low, high = metrics.chi2_bounds(1, known.size, 0.9)
    assert figure.axes[0].get_title(loc="left") == (
        f"mean of all: {known.mean():.2f}, within the consistent {low:.2f} to {high:.2f} (90 %)"
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


def curve(axes: Any, label: str) -> tuple[list[float], list[float]]:
    (line,) = [one for one in axes.get_lines() if one.get_label() == label]
    return line.get_xdata().tolist(), line.get_ydata().tolist()


def test_a_run_is_drawn_with_what_it_claims() -> None:
    """Ranges of 10 m too much at rows 3 and 7; the rest is what the filter expects."""
    beacon = auvest.LeaderRange(leader=(50.0, 0.0), sigma_range_m=1.0)
    truth = np.column_stack([np.arange(1.0, 11.0), np.zeros(10)])
    z = 50.0 - truth[:, 0]
    z[[2, 6]] += 10.0
    inputs = np.tile([1.0, 0.0, 0.0], (10, 1))

    def robust() -> auvest.RobustEkf:
        return auvest.RobustEkf(
            [0.0, 0.0], np.eye(2), process=auvest.SpeedHeading(), sensors=beacon, kernel="hampel"
        )

    result = robust().run(z, dt=1.0, input=inputs)
    assert result.counts["rejected"] == 2
    figure = plots.run(result, truth=truth, places=[(50, 0)], title="a run", time_s=2 * truth[:, 0])
    plane, x, y = figure.axes
    assert figure.get_suptitle() == "a run"
    assert curve(plane, "truth") == (truth[:, 0].tolist(), [0.0] * 10)
    assert curve(plane, "estimate") == (result.x[:, 0].tolist(), result.x[:, 1].tolist())
    assert curve(plane, "measurement rejected")[0] == result.x[[2, 6], 0].tolist()
    assert curve(plane, "places") == ([50.0], [0.0])
    for k, axes in enumerate((x, y)):
        time, error = curve(axes, "error")
        assert time == (2 * truth[:, 0]).tolist()
        assert error == (result.x[:, k] - truth[:, k]).tolist()
        (band,) = axes.collections
        highest = 3 * np.sqrt(result.P[:, k, k].max())
        assert band.get_datalim(axes.transData).ymax == pytest.approx(highest, rel=1e-12)
    assert y.get_xlabel() == "time / s"

    # Without a truth: innovations and the NIS. Without covariances: no band.
    plane, innovation, nis = plots.run(result).axes
    assert curve(innovation, "innovation") == (list(range(1, 11)), result.innovation[:, 0].tolist())
    (band,) = innovation.collections
    highest = 3 * np.sqrt(result.S.max())
    assert band.get_datalim(innovation.transData).ymax == pytest.approx(highest, rel=1e-12)
    assert nis.get_lines()[0].get_ydata().tolist() == result.nis.tolist()
    assert nis.get_xlabel() == "row"
    lean = robust().run(z, dt=1.0, input=inputs, covariance=False)
    for given in (None, truth):
        assert not any(axes.collections for axes in plots.run(lean, truth=given).axes)
    smoothed = robust().smooth(z, dt=1.0, input=inputs)
    plane, x, _ = plots.run(smoothed, truth=truth).axes
    assert curve(plane, "smoothed")[0] == smoothed.smoothed_x[:, 0].tolist()
    assert curve(x, "smoothed: error")[1] == (smoothed.smoothed_x - truth)[:, 0].tolist()
    bounds = [band.get_datalim(x.transData).ymax for band in x.collections]
    highest = [3 * np.sqrt(P[:, 0, 0].max()) for P in (smoothed.P, smoothed.smoothed_P)]
    assert bounds == pytest.approx(highest, rel=1e-12)

    # Where nobody knows the truth there is no error, and no places are none.
    known = truth.copy()
    known[3, 1] = np.nan
    plane, x, _ = plots.run(result, truth=known, places=np.empty((0, 2))).axes
    assert np.isnan(curve(x, "error")[1]).tolist() == [k == 3 for k in range(10)]
    assert "places" not in [line.get_label() for line in plane.get_lines()]


def test_gross_outliers_flatten_nothing() -> None:
    beacon = auvest.LeaderRange(leader=(50.0, 0.0))
    z = np.full(60, 50.0)
    for scale in ("linear", "symlog"):
        f = auvest.RobustEkf([0, 0], np.eye(2), process=auvest.SpeedHeading(), sensors=beacon)
        result = f.run(
            z + np.random.default_rng(1).normal(size=60), dt=1.0, input=np.zeros((60, 3))
        )
        assert [axes.get_yscale() for axes in plots.run(result).axes] == ["linear", scale, scale]
        z[::9] += 2000.0


def test_a_start_that_is_known_badly_does_not_flatten_the_rest() -> None:
    beacon = auvest.LeaderRange(leader=(50.0, 0.0))
    truth = np.zeros((40, 2))
    for start_m, told in ((1.0, False), (100.0, True)):
        f = auvest.Ekf(
            [0, 0],
            np.diag([start_m**2, 1.0]),
            process=auvest.SpeedHeading(sigma_forward=0.1),
            sensors=beacon,
        )
        z = np.full(40, 50.5)
        z[:2] = np.nan  # until the third row it knows no more than at the start
        result = f.run(z, dt=1.0, input=np.zeros((40, 3)))
        x = plots.run(result, truth=truth).axes[1]
        (band,) = x.collections
        assert (x.get_ylim()[1] < 0.1 * band.get_datalim(x.transData).ymax) == told
        assert x.get_ylim()[1] > np.abs(result.x[:, 0]).max()


def test_a_run_that_has_no_track_and_a_truth_of_another_length_are_refused() -> None:
    depth = auvest.FunctionProcess(lambda x, _dt: x, np.eye(1), state=("z_m",))
    sensor = auvest.FunctionSensor(lambda x: x, np.eye(1))
    one = auvest.Ukf([0.0], np.eye(1), process=depth, sensors=sensor).run([1.0, 2.0], dt=1.0)
    with pytest.raises(ValueError, match="result has 1 state, but a track has x and y"):
        plots.run(one)
    still = auvest.Position()
    fixes = auvest.Ekf([0, 0], np.eye(2), process=auvest.SpeedHeading(), sensors=still)
    two = fixes.run([[0, 0], [1, 0]], dt=1.0, input=np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"truth has shape \(3, 2\), expected \(2, 2\)"):
        plots.run(two, truth=np.zeros((3, 2)))
    with pytest.raises(TypeError, match=r"many runs: draw one of them, result.run\(0\)"):
        plots.run(fixes.run(np.zeros((3, 2, 2)), dt=1.0, input=np.zeros((2, 3))))
    with pytest.raises(TypeError, match=r"must be an auvest\.RunResult, not ndarray"):
        plots.run(np.zeros((3, 2)))
    with pytest.raises(ValueError, match=r"places has shape \(2,\), expected"):
        plots.run(two, places=(1.0, 2.0))
    with pytest.raises(ValueError, match=r"time_s has shape \(3,\), expected \(2,\)"):
        plots.run(two, time_s=[1, 2, 3])


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
