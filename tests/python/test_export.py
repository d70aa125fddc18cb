"""Results of a replay in other programs' formats: read back, every number is that of the tables."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from typer.testing import CliRunner, Result

from auvest.cli import app
from auvest.logs.write import write_file

EPOCH = 1_700_000_000
ORIGIN = (43.0, 10.0)


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A vehicle that goes past a beacon, one range of which is grossly wrong."""
    folder = tmp_path_factory.mktemp("replayed")
    log = folder / "log"
    time_s = np.arange(0, 30, 0.3)
    one = np.ones(len(time_s))
    ranges = np.hypot(0.5 * time_s - 5, 20)
    ranges[40] += 100
    write_file(log, "odometry.csv", time_s=time_s, speed_m_s=0.5 * one, yaw_rate_rad_s=0.01 * one)
    write_file(log, "beacons.csv", source=[1], x_m=[5.0], y_m=[20.0])
    write_file(log, "start.csv", time_s=[0.0], x_m=[0.0], y_m=[0.0], heading_rad=[0.1])
    write_file(log, "ranges.csv", time_s=time_s, source=one.astype(int), range_m=ranges)
    write_file(
        log, "truth.csv", time_s=time_s, x_m=0.5 * time_s, y_m=0.1 * one, heading_rad=0.3 * one
    )
    result = call("replay", log, "--output", folder / "out", "--quiet")
    assert result.exit_code == 0, result.output
    return folder / "out" / "log"


def table(results: Path, name: str) -> dict[str, list[Any]]:
    return parquet.read_table(results / f"{name}.parquet").to_pydict()


def nanoseconds(time_s: list[float], epoch: int = EPOCH) -> list[int]:
    return [round(t * 1e9) + epoch * 10**9 for t in time_s]


def exported(results: Path, folder: Path, *options: object) -> dict[str, Any]:
    result = call("export", results, folder, "--epoch", EPOCH, "--json", *options)
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads(result.stdout)
    return document


def test_foxglove(results: Path, tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    document = exported(results, tmp_path / "out", "--origin", *ORIGIN)
    found: dict[str, list[tuple[int, dict[str, Any]]]] = {}
    with (tmp_path / "out" / "auvest.mcap").open("rb") as file:
        schemas = {}
        for schema, channel, message in reader.make_reader(file).iter_messages():
            assert message.log_time == message.publish_time
            schemas[channel.topic] = schema.name
            assert json.loads(schema.data)["title"] == schema.name
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    assert schemas == {
        "/auvest/pose": "foxglove.PoseInFrame",
        "/auvest/ellipse": "foxglove.SceneUpdate",
        "/auvest/fix": "foxglove.LocationFix",
        "/auvest/innovation": "auvest.Innovation",
    }
    assert document["messages"] == {topic: len(messages) for topic, messages in found.items()}

    estimates = table(results, "estimates")
    times = nanoseconds(estimates["time_s"])
    poses = found["/auvest/pose"]
    assert [time for time, _ in poses] == times
    stamps = [pose["timestamp"] for _, pose in poses]
    assert [stamp["sec"] * 10**9 + stamp["nsec"] for stamp in stamps] == times
    assert [pose["pose"]["position"]["x"] for _, pose in poses] == estimates["x_m"]
    assert [pose["pose"]["position"]["y"] for _, pose in poses] == estimates["y_m"]
    halves = [pose["pose"]["orientation"] for _, pose in poses]
    assert [half["z"] for half in halves] == [math.sin(h / 2) for h in estimates["heading_rad"]]
    assert [half["w"] for half in halves] == [math.cos(h / 2) for h in estimates["heading_rad"]]

    fixes = [fix for _, fix in found["/auvest/fix"]]
    covariances = [fix["position_covariance"] for fix in fixes]
    assert [cov[0] for cov in covariances] == estimates["var_x_m2"]
    assert [cov[1] for cov in covariances] == [cov[3] for cov in covariances]
    assert [cov[1] for cov in covariances] == estimates["cov_xy_m2"]
    assert [cov[4] for cov in covariances] == estimates["var_y_m2"]
    # One metre is 1/111 km degrees: to a part in 1e3 within 20 m, by the radii of WGS 84.
    north = 6335439 / (1 - 0.00669438 * math.sin(math.radians(43)) ** 2) ** 1.5
    east = 6378137 / math.sqrt(1 - 0.00669438 * math.sin(math.radians(43)) ** 2)
    east *= math.cos(math.radians(43))
    for fix, x, y in zip(fixes, estimates["x_m"], estimates["y_m"], strict=True):
        assert math.radians(fix["latitude"] - 43) * north == pytest.approx(y, abs=1e-3)
        assert math.radians(fix["longitude"] - 10) * east == pytest.approx(x, abs=1e-3)

    measurements = table(results, "measurements")
    innovations = found["/auvest/innovation"]
    assert [time for time, _ in innovations] == nanoseconds(measurements["time_s"])
    said = [innovation for _, innovation in innovations]
    assert [one["outcome"] for one in said] == measurements["outcome"]
    assert "rejected" in measurements["outcome"]
    assert [one["innovation"] for one in said] == [[one] for one in measurements["innovation_0"]]
    assert [one["sigma"] for one in said] == [[one] for one in measurements["sigma_0"]]
    assert [one["weight"] for one in said] == [[one] for one in measurements["weight_0"]]
    assert [one["nis"] for one in said] == measurements["nis"]


def test_messages_stand_in_the_file_in_the_order_of_their_times(
    results: Path, tmp_path: Path
) -> None:
    """Estimates and measurements are of two tables."""
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    exported(results, tmp_path / "out")
    with (tmp_path / "out" / "auvest.mcap").open("rb") as file:
        messages = [
            (channel.topic, message.log_time)
            for _, channel, message in reader.make_reader(file).iter_messages(log_time_order=False)
        ]
    times = [time for _, time in messages]
    assert times == sorted(times)
    assert len({topic for topic, _ in messages[:20]}) > 1


def test_the_ellipse_is_where_the_covariance_has_three_sigma(results: Path, tmp_path: Path) -> None:
    """d' P^-1 d is 9 on it; one a second."""
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    exported(results, tmp_path / "out")
    estimates = table(results, "estimates")
    by_time = {time: k for k, time in enumerate(nanoseconds(estimates["time_s"]))}
    times = []
    with (tmp_path / "out" / "auvest.mcap").open("rb") as file:
        messages = reader.make_reader(file).iter_messages(topics=["/auvest/ellipse"])
        for _, _, message in messages:
            times.append(message.log_time)
            k = by_time[message.log_time]
            (entity,) = json.loads(message.data)["entities"]
            points = np.array([[one["x"], one["y"]] for one in entity["lines"][0]["points"]])
            offsets = points - [estimates["x_m"][k], estimates["y_m"][k]]
            xx, xy, yy = (estimates[name][k] for name in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
            inverse = np.linalg.inv([[xx, xy], [xy, yy]])
            np.testing.assert_allclose(np.einsum("ki,ij,kj->k", offsets, inverse, offsets), 9)
            np.testing.assert_allclose(points[0], points[-1])  # closed
    assert np.diff(times).min() >= 10**9
    assert np.diff(times).max() <= 1.3e9  # an estimate every 0.3 s


def test_without_an_origin_there_is_no_fix(results: Path, tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    assert "/auvest/fix" not in exported(results, tmp_path / "out")["messages"]


def test_ros2(results: Path, tmp_path: Path) -> None:
    """Read by auvest's own reader of bags, whose numbers are those of rosbags."""
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    from auvest.importers import open_recording

    document = exported(results, tmp_path / "out", "--format", "ros2")
    estimates = table(results, "estimates")
    count = len(estimates["time_s"])
    assert document["messages"] == {"/auvest/odometry": count, "/auvest/pose": count}
    bag = open_recording(tmp_path / "out")
    found: dict[str, list[Any]] = {"/auvest/odometry": [], "/auvest/pose": []}
    for message in bag.messages():
        found[message.topic].append(message)
    assert bag.types == {
        "/auvest/odometry": "nav_msgs/msg/Odometry",
        "/auvest/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    }
    for messages in found.values():
        assert [one.time_ns for one in messages] == nanoseconds(estimates["time_s"])
        assert [one.stamp_ns for one in messages] == nanoseconds(estimates["time_s"])
        values = [one.values for one in messages]
        for field, name in (
            ("pose.pose.position.x", "x_m"), ("pose.pose.position.y", "y_m"),
            ("pose.covariance[0]", "var_x_m2"), ("pose.covariance[1]", "cov_xy_m2"),
            ("pose.covariance[6]", "cov_xy_m2"), ("pose.covariance[7]", "var_y_m2"),
        ):  # fmt: skip
            assert [one[field] for one in values] == estimates[name]
        halves = [math.sin(h / 2) for h in estimates["heading_rad"]]
        assert [one["pose.pose.orientation.z"] for one in values] == halves
    assert {one.values["twist.covariance[0]"] for one in found["/auvest/odometry"]} == {-1}


def test_the_truth_is_beside_the_track(results: Path) -> None:
    truth = np.loadtxt(results / "truth.tum")
    time_s = np.arange(0, 30, 0.3)
    expected = np.zeros((len(time_s), 8))
    expected[:, 0], expected[:, 1], expected[:, 2] = time_s, 0.5 * time_s, 0.1
    expected[:, 6], expected[:, 7] = np.sin(0.15), np.cos(0.15)
    np.testing.assert_array_equal(truth, expected)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--epoch", "-1e9"], "is none that can be exported"),
        (["--epoch", "inf"], "Invalid value for '--epoch': inf is no time"),
        (["--origin", "91", "0"], "Invalid value for '--origin': (91.0, 0.0) is no place on Earth"),
    ],
)
def test_what_cannot_be_exported_leaves_nothing(
    results: Path, tmp_path: Path, options: list[str], message: str
) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    result = call("export", results, tmp_path / "out", *options)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_tables_is_refused(tmp_path: Path) -> None:
    result = call("export", tmp_path, tmp_path / "out")
    assert result.exit_code == 2
    assert "has no estimates.parquet" in result.stderr


@pytest.mark.parametrize(
    ("format_name", "message"),
    [
        ("foxglove", "MCAP is written with the package mcap: pip install 'auvest[mcap]'"),
        ("ros2", "ROS bags are written with the package rosbags: pip install 'auvest[ros]'"),
    ],
)
def test_a_missing_package_is_said(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format_name: str, message: str
) -> None:
    for module in ("mcap.writer", "rosbags.rosbag2"):
        monkeypatch.setitem(sys.modules, module, None)  # an import of it fails
    result = call("export", results, tmp_path / "out", "--format", format_name)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


def test_tables_that_are_damaged_are_refused(results: Path, tmp_path: Path) -> None:
    pytest.importorskip("mcap", reason="mcap is not installed")
    for name in ("estimates", "measurements"):
        raw = (results / f"{name}.parquet").read_bytes()
        (tmp_path / f"{name}.parquet").write_bytes(raw[: len(raw) // 2])
    result = call("export", tmp_path, tmp_path / "out")
    assert result.exit_code == 2
    assert "estimates.parquet cannot be read" in result.stderr
    assert not (tmp_path / "out").exists()
