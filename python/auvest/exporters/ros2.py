"""A ROS 2 bag (MCAP storage): ``/auvest/odometry`` and ``/auvest/pose`` for every estimate.

They are nav_msgs/Odometry and geometry_msgs/PoseWithCovarianceStamped, in the frame ``map``. The
velocities of Odometry are not estimated: they are zero, with a variance that says so, -1.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, Literal

from auvest.exporters.foxglove import pose_of
from auvest.exporters.results import ReplayResults
from auvest.importers.recording import MissingPackage

_ODOMETRY, _POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseWithCovarianceStamped"
_VERSION: Literal[9] = 9  # of the bag's format: ROS 2 Jazzy, which Humble reads, too


def export_ros2(results: ReplayResults, folder: Path) -> dict[str, int]:
    """Write a bag into a folder; say how many messages each topic has.

    Raises
    ------
    MissingPackage
        If the package rosbags is not installed.
    ValueError
        If the results cannot be read.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise MissingPackage("ROS bags are written", "rosbags", "ros") from None
    store = get_typestore(Stores.ROS2_HUMBLE)
    bag = folder / "bag"
    count = 0
    with Writer(bag, version=_VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        odometry = writer.add_connection("/auvest/odometry", _ODOMETRY, typestore=store)
        pose = writer.add_connection("/auvest/pose", _POSE, typestore=store)
        for row in results.rows():
            if row.table == "estimates":
                messages = _messages(store.types, row.time_ns, row.values)
                for connection, message in zip((odometry, pose), messages, strict=True):
                    raw = store.serialize_cdr(message, message.__msgtype__)
                    writer.write(connection, row.time_ns, raw)
                count += 1
    for path in bag.iterdir():  # so that the folder itself is the bag
        shutil.move(path, folder / path.name)
    bag.rmdir()
    return {"/auvest/odometry": count, "/auvest/pose": count}


def _messages(types: Any, time_ns: int, estimate: dict[str, Any]) -> tuple[Any, Any]:
    import numpy as np

    def make(name: str, **values: Any) -> Any:
        return types[f"{name.partition('/')[0]}/msg/{name.partition('/')[2]}"](**values)

    stamp = make("builtin_interfaces/Time", sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    header = make("std_msgs/Header", stamp=stamp, frame_id="map")
    place = pose_of(estimate)
    covariance = np.zeros(36)
    covariance[[0, 1, 6, 7]] = [
        estimate[name] for name in ("var_x_m2", "cov_xy_m2", "cov_xy_m2", "var_y_m2")
    ]
    pose = make(
        "geometry_msgs/PoseWithCovariance",
        pose=make(
            "geometry_msgs/Pose",
            position=make("geometry_msgs/Point", **place["position"]),
            orientation=make("geometry_msgs/Quaternion", **place["orientation"]),
        ),
        covariance=covariance,
    )
    zero = make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0)
    unknown = np.zeros(36)
    unknown[0] = -1.0
    twist = make(
        "geometry_msgs/TwistWithCovariance",
        twist=make("geometry_msgs/Twist", linear=zero, angular=zero),
        covariance=unknown,
    )
    odometry = make(
        "nav_msgs/Odometry", header=header, child_frame_id="base_link", pose=pose, twist=twist
    )
    return odometry, make("geometry_msgs/PoseWithCovarianceStamped", header=header, pose=pose)
