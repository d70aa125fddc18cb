"""The HTML report in a real browser: what its plots say, and that it needs no network."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import dom_of

from auvest import plots
from auvest.logs import LogFolder
from auvest.logs.write import write_file
from auvest.replay import Result, Settings, drawing, report, tables
from auvest.replay import replay as run_replay
from auvest.replay.samples import Samples
from auvest.replay.shown import Shown

PROBE = (Path(__file__).parent / "report_probe.js").read_text(encoding="utf-8")
WALK = (Path(__file__).parent / "report_steps.js").read_text(encoding="utf-8")


def opened(page: str, folder: Path, steps: str = "") -> dict[str, Any]:
    """What the browser says about a page, without a network, after some steps."""
    path = folder / "page.html"
    assert page.count("<head>") == 1
    probe = f"<script>{PROBE.replace('STEPS;', steps)}</script>"
    path.write_text(page.replace("<head>", f"<head>{probe}"), encoding="utf-8")
    shown, said = dom_of(path.as_uri(), folder)
    seen = re.search(r'data-seen="([^"]*)"', shown)
    assert seen is not None, said[-2000:]
    value: dict[str, Any] = json.loads(unescape(seen[1]))
    return value


def log(folder: Path, *, truth: bool) -> LogFolder:
    """Forty metres along x past a beacon, with one range that is 50 m too long, at 31 s."""
    time_s = 1.0 * np.arange(1, 41)
    write_file(folder, "odometry.csv", time_s=time_s, forward_m=0 * time_s + 1, left_m=0 * time_s,
               turn_rad=0 * time_s)  # fmt: skip
    ranges = np.hypot(time_s - 20, 15.0)
    ranges[30] += 50.0
    write_file(folder, "ranges.csv", time_s=time_s, source=[0] * 40, range_m=ranges)
    write_file(folder, "beacons.csv", source=[0], x_m=[20.0], y_m=[15.0])
    write_file(folder, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    if truth:
        write_file(folder, "truth.csv", time_s=time_s, x_m=time_s, y_m=0 * time_s)
    return LogFolder(folder)


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, str, dict[str, Any]]:
    """A replay, its page, and what a reader who does all of the above sees."""
    folder = tmp_path_factory.mktemp("page")
    result = run_replay(log(folder / "log <1>", truth=True), Settings())
    page = report.html(result)
    # The range that is 50 m too long ends on the line from the beacon through the estimate.
    true_m = float(np.hypot(11, 15))
    place = [estimate(result, 10.0)[name] for name in ("x_m", "y_m")]
    steps = WALK.replace("REACH", repr((true_m + 50) / true_m)).replace("...PLACE", f"...{place}")
    return result, page, opened(page, folder, steps)


def estimate(result: Result, time_s: float) -> dict[str, float]:
    rows = result.estimates.columns()
    k = int(np.argmin(np.abs(rows["time_s"] - time_s)))
    return {name: float(values[k]) for name, values in rows.items()}


def test_it_needs_no_network_and_nothing_goes_wrong(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    _, page, found = walked
    assert found["trouble"] == []
    assert found["loaded"] == []
    assert found["drawn"]
    # Nothing in the file even asks for another one.
    assert not re.search(r"(\bsrc=|href|url\(|@import|https?:)", page)
    assert "log &lt;1&gt;: replay with robust-ekf" in page
    assert '<th>rejected</th><td class="number">1</td>' in page


def test_the_track_is_drawn_in_the_colour_of_its_filter(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    text = plots.FILTER_COLOURS["robust-ekf"]
    colour = [int(text[k : k + 2], 16) for k in (1, 3, 5)]
    assert [*colour, 255] in walked[2]["seen"]["colours"]


def test_hovering_gives_time_position_and_sigma(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    result, _, found = walked
    known = estimate(result, 10.0)
    tip = found["seen"]["hovered"]["tip"]
    numbers = [float(text) for text in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", tip)]
    expected = [
        10.0,
        known["x_m"],
        known["y_m"],
        known["var_x_m2"] ** 0.5,
        known["var_y_m2"] ** 0.5,
    ]
    assert numbers == pytest.approx(expected, rel=2e-3, abs=1e-3)
    assert tip.startswith("10.0 s  robust EKF\nx ")
    assert found["seen"]["left"]["tip"] is None
    # In a plot: the measurement that is nearest.
    start, end = result.numbers["first_s"], result.numbers["last_s"]
    measured = result.measurements.columns()
    k = int(np.argmin(np.abs(measured["time_s"] - 0.5 * (start + end))))
    when, _, value = found["seen"]["chart"]["tip"].split("\n")
    assert when in (f"{measured['time_s'][k]:.1f} s", f"{measured['time_s'][k] + 1:.1f} s")
    assert float(value) < 9


def test_a_range_that_was_rejected_ends_where_it_says(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    result, _, found = walked
    first, second, third = found["seen"]["rejected"]["tip"].split("\n")
    assert first == "31.0 s  robust EKF"
    assert second == f"rejected: {np.hypot(11, 15) + 50:.2f} m to source 0"
    off = result.outliers.columns()["innovation_0"]
    assert third.startswith(f"innovation {off[0]:.2f} m, NIS ")
    assert third.endswith("weight 0")


def test_zoom_moves_all_plots(walked: tuple[Result, str, dict[str, Any]]) -> None:
    result, _, found = walked
    start, end = result.numbers["first_s"], result.numbers["last_s"]
    half = 0.5 * (end - start)
    cursor = found["seen"]["plus"]["map"]["cursor"]
    windows = {
        "opened": (start, end),
        "zoomed": (start, start + half),
        "later": (start + 0.5 * half, start + 1.5 * half),
        "all": (start, end),
        "plus": tuple(cursor + 0.8 * (edge - cursor) for edge in (start, end)),
        "zero": (start, end),
    }
    for name, window in windows.items():
        seen = found["seen"][name]
        ids = ["error-x", "error-y", "sigma", "innovation-range-0-0", "nis", "weight", "interval"]
        assert list(seen["charts"]) == ids
        for one in (*seen["charts"].values(), seen["map"]):
            assert (one["from"], one["to"]) == pytest.approx(window, abs=1e-9), name


def test_the_slider_and_the_keys_move_all_plots(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    result, _, found = walked
    step = (result.numbers["last_s"] - result.numbers["first_s"]) / 50
    for name, time in (("slid", 20.0), ("key", 20.0 + step)):
        seen = found["seen"][name]
        cursors = [one["cursor"] for one in (*seen["charts"].values(), seen["map"])]
        # The slider has a thousand steps.
        assert cursors == pytest.approx([time] * 8, abs=0.02)
        assert seen["now"] == f"{cursors[0]:.1f} s"
        known, measured = estimate(result, time), result.measurements.columns()
        k = int(np.argmin(np.abs(measured["time_s"] - time)))
        assert seen["map"]["at"] == [pytest.approx([known["x_m"], known["y_m"]], abs=1e-5)]
        expected = {
            "sigma": known["var_x_m2"] ** 0.5,
            "innovation-range-0-0": measured["innovation_0"][k],
            "nis": measured["nis"][k],
            "weight": 1.0,
            "interval": 1.0,
            "error-x": known["x_m"] - round(time),
        }
        for chart, value in expected.items():
            if chart == "sigma":  # the longer axis is no shorter than sigma along x
                assert seen["charts"][chart]["values"][0] >= value * (1 - 1e-6)
            else:
                assert seen["charts"][chart]["values"] == [pytest.approx(value, rel=1e-5, abs=1e-6)]


def test_the_map_is_moved_with_keys(walked: tuple[Result, str, dict[str, Any]]) -> None:
    seen = walked[2]["seen"]
    before, nearer, moved, after = (
        seen[name]["map"] for name in ("zero", "nearer", "moved", "fitted")
    )
    assert nearer["scale"] == pytest.approx(before["scale"] / 0.8)
    assert moved["x"] == pytest.approx(nearer["x"] + 40 / nearer["scale"])
    assert after["scale"] == pytest.approx(before["scale"])


def test_all_of_it_is_reached_by_the_keyboard_in_order(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    seen = walked[2]["seen"]
    assert seen["order"] == [
        "time", "in", "out", "earlier", "later", "all",
        "nearer", "farther", "fit", "map", "checkbox", "checkbox", "checkbox", "checkbox",
        "error-x", "error-y", "sigma", "innovation-range-0-0", "nis", "weight", "interval",
    ]  # fmt: skip
    assert seen["nameless"] == 0


def test_the_probe_sees_what_is_wrong(tmp_path: Path) -> None:
    page = report.html(run_replay(log(tmp_path / "log", truth=False), Settings()))
    # Another script than the one whose sum the policy has, and a picture from elsewhere.
    broken = page.replace('"use strict";', '"use strict"; ', 1)
    broken = broken.replace("<h1>", '<img alt="far" src="http://example.org/a.png"><h1>')
    found = opened(broken, tmp_path)
    assert not found["drawn"]
    assert {"img-src", "script-src-elem"} <= set(found["trouble"])


def test_columns_come_back_as_they_were() -> None:
    """Times to the bit, positions far from the origin to a tenth of a millimetre."""

    def decoded(name: str, values: list[float]) -> list[float]:
        made = drawing.encoded(name, np.array(values))
        raw = np.frombuffer(base64.b64decode(made["bytes"]), f"<{made['kind']}")
        return (raw.astype(float) + made["offset"]).tolist()

    times = [1.6e9 + 0.1, 1.6e9 + 0.2]
    assert decoded("time_s", times) == times
    easting = [np.nan, 512345.67891, 512399.0]
    assert decoded("x_m", easting)[1:] == pytest.approx(easting[1:], abs=1e-4)
    assert decoded("nis", [1e6, 0.5]) == pytest.approx([1e6, 0.5], rel=1e-7)


def test_where_craft_and_source_were(tmp_path: Path) -> None:
    """Of a leader that moves, and with the origin of a map: all in the log's coordinates."""
    east = 500_000.0
    time_s = 1.0 * np.arange(1, 11)
    write_file(tmp_path, "odometry.csv", time_s=time_s, forward_m=0 * time_s + 1, left_m=0 * time_s,
               turn_rad=0 * time_s)  # fmt: skip
    write_file(tmp_path, "ranges.csv", time_s=time_s[1::2], source=[7] * 5, range_m=[50.0] * 5)
    write_file(tmp_path, "leaders.csv", time_s=time_s, source=[7] * 10, x_m=east + time_s,
               y_m=0 * time_s + 50)  # fmt: skip
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[east], y_m=[0.0], heading_rad=[0.0])
    result = run_replay(LogFolder(tmp_path), Settings(), causes=False)
    rows, estimates = result.measurements.columns(), result.estimates.columns()
    assert rows["place_x_m"] == pytest.approx(east + time_s[1::2], abs=1e-9)
    assert rows["place_y_m"] == pytest.approx([50.0] * 5)
    assert rows["range_m"].tolist() == [50.0] * 5
    at = np.searchsorted(estimates["time_s"], rows["time_s"])
    assert rows["x_m"].tolist() == estimates["x_m"][at].tolist()
    assert rows["interval_s"][1:].tolist() == [2.0] * 4
    (leader,) = drawing.document([result])["leaders"]
    assert leader["source"] == 7
    assert drawing.document([result])["beacons"] == []


def test_what_is_shown_does_not_depend_on_how_the_log_was_cut() -> None:
    def batch(time_s: list[float], at: list[float]) -> tables.Batch:
        measured = tables.blank_measurements(len(at))
        measured["time_s"], measured["nis"] = np.array(at), np.ones(len(at))
        estimates = {"time_s": time_s, "x_m": time_s, "y_m": [-t for t in time_s]}
        return tables.Batch(
            estimates={name: np.array(values) for name, values in estimates.items()},
            measurements=measured,
            errors={},
            ranges_m=np.array(at),
            places=np.zeros((len(at), 2)),
        )

    def of(*batches: tables.Batch) -> dict[str, list[float]]:
        shown, parts = Shown(), []
        for one in batches:
            parts.append(shown.of(one))
        return {
            name: np.concatenate([part[name] for part in parts]).tolist()
            for name in ("x_m", "y_m", "interval_s")
        }

    whole = of(batch([1.0, 2.0, 3.0, 4.0], [2.0, 3.5, 4.0]))
    parts = of(batch([1.0, 2.0, 3.0], [2.0]), batch([4.0], [3.5, 4.0]))
    assert str(whole) == str(parts)
    assert whole["x_m"] == [2.0, 3.0, 4.0]
    assert whole["y_m"] == [-2.0, -3.0, -4.0]
    assert whole["interval_s"][1:] == [1.5, 0.5]


def test_filters_are_told_apart_without_colour() -> None:
    """Each has its own line style."""
    assert set(plots.FILTER_COLOURS) == set(plots.FILTER_DASHES)
    assert len(set(plots.FILTER_DASHES.values())) == len(plots.FILTER_DASHES)
    assert len(set(plots.FILTER_COLOURS.values())) == len(plots.FILTER_COLOURS)


def test_what_is_left_out_of_the_plots_is_said(
    walked: tuple[Result, str, dict[str, Any]],
) -> None:
    result = walked[0]
    assert report.thinned([result]) == ""
    thin = Samples(tables.ERRORS, limit=10)
    thin.add(result.errors.columns())
    assert len(thin.columns()["time_s"]) == 20
    said = report.thinned([result, replace(result, errors=thin)])
    assert said == "Drawn: one row in 2 of errors; the tables have all."


def test_a_smoothed_track_is_drawn_beside_the_filters(
    walked: tuple[Result, str, dict[str, Any]], tmp_path: Path
) -> None:
    """Its columns stand behind those of the estimates and errors, where a replay has them."""
    result = walked[0]

    def with_smoothed(samples: Samples, **columns: Any) -> Samples:
        made = Samples((*samples.columns(), *columns))
        made.add({**samples.columns(), **columns})
        return made

    estimates, errors = result.estimates.columns(), result.errors.columns()
    names = ("heading_rad", "cov_xy_m2", "var_x_m2", "var_y_m2")
    smoothed = replace(
        result,
        estimates=with_smoothed(
            result.estimates,
            smoothed_x_m=estimates["time_s"],
            smoothed_y_m=0 * estimates["time_s"] + 2.0,
            **{f"smoothed_{name}": 0.25 * estimates[name] for name in names},
        ),
        errors=with_smoothed(
            result.errors,
            smoothed_error_x_m=0 * errors["time_s"],
            smoothed_error_y_m=0 * errors["time_s"] + 2.0,
            smoothed_sigma_x_m=0.5 * errors["sigma_x_m"],
            smoothed_sigma_y_m=0.5 * errors["sigma_y_m"],
        ),
    )
    steps = 'await step("slid", () => slide(20)); await step("hovered", () => hover(30, 2));'
    found = opened(report.html(smoothed), tmp_path, steps)
    assert found["trouble"] == []
    seen = found["seen"]["slid"]
    assert seen["map"]["at"][1] == pytest.approx([20, 2], abs=1e-6)
    assert seen["charts"]["error-y"]["values"][1] == pytest.approx(2.0)
    ours, theirs = seen["charts"]["sigma"]["values"]
    assert theirs == pytest.approx(0.5 * ours, rel=1e-5)
    assert len(seen["charts"]["nis"]["values"]) == 1
    assert found["seen"]["hovered"]["tip"].startswith(
        "30.0 s  robust EKF, smoothed\nx 30.00 m, y 2.000 m"
    )


def test_every_sensor_has_plots_of_its_own(tmp_path: Path) -> None:
    """Ranges and fixes in one log: a plot for each number, and the NIS over limits of their own."""
    time_s = 1.0 * np.arange(1, 21)
    write_file(
        tmp_path, "odometry.csv", time_s=time_s, speed_m_s=0 * time_s + 1,
        yaw_rate_rad_s=0 * time_s,
    )  # fmt: skip
    write_file(tmp_path, "fixes.csv", time_s=time_s, source=[0] * 20, range_m=9 + time_s,
               bearing_rad=0 * time_s)  # fmt: skip
    write_file(tmp_path, "ranges.csv", time_s=time_s[::2], source=[0] * 10,
               range_m=9.5 + time_s[::2])  # fmt: skip
    write_file(tmp_path, "beacons.csv", source=[0], x_m=[-9.0], y_m=[0.0])
    write_file(tmp_path, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.0])
    result = run_replay(LogFolder(tmp_path), Settings(), causes=False)
    made = drawing.document([result])
    assert made["nis_95"] is None
    found = opened(report.html(result), tmp_path, 'await step("end", () => slide(20));')
    assert found["trouble"] == []
    charts = found["seen"]["end"]["charts"]
    assert [name for name in charts if name.startswith("innovation")] == [
        "innovation-range-0-0", "innovation-fix-0-0", "innovation-fix-0-1",
    ]  # fmt: skip
    # The last range is of 19 s, the last fix of 20 s.
    rows = result.measurements.columns()
    for name, time_s in (("range", 19.0), ("fix", 20.0)):
        (k,) = np.flatnonzero((rows["sensor"] == name) & (rows["time_s"] == time_s))
        value = charts[f"innovation-{name}-0-0"]["values"]
        assert value == [pytest.approx(rows["innovation_0"][k], rel=1e-5)]


def test_a_log_of_one_fix_has_a_window_of_time(tmp_path: Path) -> None:
    write_file(tmp_path, "fixes.csv", time_s=[5.0], source=[0], range_m=[9.0], bearing_rad=[0.0])
    write_file(tmp_path, "beacons.csv", source=[0], x_m=[0.0], y_m=[0.0])
    made = drawing.document([run_replay(LogFolder(tmp_path), Settings(), causes=False)])
    assert made["to_s"] > made["from_s"]
