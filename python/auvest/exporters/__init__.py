"""Results of a replay for other programs: Foxglove (MCAP) and ROS 2 (a bag).

One function per format in :data:`EXPORTERS`; :class:`auvest.exporters.results.ReplayResults` reads
what ``auvest replay`` has written, a stretch at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from auvest.exporters.foxglove import export_foxglove
from auvest.exporters.results import ReplayResults
from auvest.exporters.ros2 import export_ros2

#: ``export(results, folder)`` writes into a folder and says how many messages of each topic.
EXPORTERS: Mapping[str, Callable[[ReplayResults, Path], dict[str, int]]] = {
    "foxglove": export_foxglove,
    "ros2": export_ros2,
}

__all__ = ["EXPORTERS", "ReplayResults", "export_foxglove", "export_ros2"]
