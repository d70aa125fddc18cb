"""An MCAP file for Foxglove, in the JSON form of its schemas.

======================  ====================  ====================================================
``/auvest/pose``        foxglove.PoseInFrame  every estimate
``/auvest/ellipse``     foxglove.SceneUpdate  the 3-sigma ellipse, once a second
``/auvest/fix``         foxglove.LocationFix  every estimate, if it is known where (0, 0) is
``/auvest/innovation``  auvest.Innovation     every measurement: innovation, sigma, NIS, weight, and
                                              what became of it
======================  ====================  ====================================================
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from auvest.exporters.results import ReplayResults, Row
from auvest.importers.recording import MissingPackage

_FRAME = "map"
_ELLIPSE_EVERY_NS = 10**9
_ELLIPSE_POINTS = 33
_KNOWN = 3  # the kind of covariance of a LocationFix

_NUMBER = {"type": "number"}
_TIME = {
    "type": "object",
    "title": "time",
    "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer"}},
}


def _object(title: str, **properties: Any) -> dict[str, Any]:
    return {"title": title, "type": "object", "properties": properties}


def _list(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POINT = _object("foxglove.Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_COLOR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_TEXT = {"type": "string"}
_LINE = _object(
    "foxglove.LinePrimitive", type={"type": "integer"}, pose=_POSE, thickness=_NUMBER,
    scale_invariant={"type": "boolean"}, points=_list(_POINT), color=_COLOR, colors=_list(_COLOR),
    indices=_list({"type": "integer"}),
)  # fmt: skip
_PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "triangles", "texts", "models")
_ENTITY = _object(
    "foxglove.SceneEntity", timestamp=_TIME, frame_id=_TEXT, id=_TEXT,
    lifetime=_object("duration", sec={"type": "integer"}, nsec={"type": "integer"}),
    frame_locked={"type": "boolean"}, metadata=_list(_object("foxglove.KeyValuePair")),
    lines=_list(_LINE), **{name: _list({"type": "object"}) for name in _PRIMITIVES},
)  # fmt: skip

#: By topic.
SCHEMAS = {
    "/auvest/pose": _object("foxglove.PoseInFrame", timestamp=_TIME, frame_id=_TEXT, pose=_POSE),
    "/auvest/ellipse": _object(
        "foxglove.SceneUpdate", deletions=_list({"type": "object"}), entities=_list(_ENTITY)
    ),
    "/auvest/fix": _object(
        "foxglove.LocationFix", timestamp=_TIME, frame_id=_TEXT, latitude=_NUMBER,
        longitude=_NUMBER, altitude=_NUMBER, position_covariance=_list(_NUMBER),
        position_covariance_type={"type": "integer"},
    ),
    "/auvest/innovation": _object(
        "auvest.Innovation", timestamp=_TIME, source={"type": "integer"}, outcome=_TEXT,
        innovation=_list(_NUMBER), sigma=_list(_NUMBER), nis=_NUMBER, weight=_list(_NUMBER),
    ),
}  # fmt: skip


def export_foxglove(results: ReplayResults, folder: Path) -> dict[str, int]:
    """Write ``auvest.mcap`` into a folder; say how many messages each topic has.

    Raises
    ------
    MissingPackage
        If the package mcap is not installed.
    ValueError
        If the results cannot be read.
    """
    try:
        from mcap.writer import CompressionType, Writer
    except ImportError:
        raise MissingPackage("MCAP is written", "mcap", "mcap") from None
    counts: Counter[str] = Counter()
    with (folder / "auvest.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="auvest")
        channels: dict[str, int] = {}
        for topic, schema in SCHEMAS.items():
            if topic == "/auvest/fix" and results.origin is None:
                continue
            encoded = json.dumps(schema).encode()
            number = writer.register_schema(schema["title"], "jsonschema", encoded)
            channels[topic] = writer.register_channel(topic, "json", number)
        for topic, row, message in _messages(results):
            text = json.dumps(message, allow_nan=False).encode()
            writer.add_message(channels[topic], row.time_ns, text, row.time_ns)
            counts[topic] += 1
        writer.finish()  # type: ignore[no-untyped-call]
    return dict(counts)


def _messages(results: ReplayResults) -> Iterator[tuple[str, Row, dict[str, Any]]]:
    ellipse_ns: int | None = None
    for row in results.rows():
        time = {"sec": row.time_ns // 10**9, "nsec": row.time_ns % 10**9}
        if row.table == "measurements":
            yield "/auvest/innovation", row, {"timestamp": time, **_innovation(row.values)}
            continue
        head = {"timestamp": time, "frame_id": _FRAME}
        yield "/auvest/pose", row, {**head, "pose": pose_of(row.values)}
        if results.origin is not None:
            yield "/auvest/fix", row, {**head, **_fix(row.values, results.origin)}
        if ellipse_ns is None or row.time_ns >= ellipse_ns + _ELLIPSE_EVERY_NS:
            ellipse_ns = row.time_ns
            entity = {**head, "id": "3 sigma", **_ellipse(row.values)}
            yield "/auvest/ellipse", row, {"deletions": [], "entities": [entity]}


def pose_of(estimate: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Position and orientation of an estimate, on the plane."""
    half = 0.5 * (estimate.get("heading_rad") or 0.0)
    return {
        "position": {"x": estimate["x_m"], "y": estimate["y_m"], "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)},
    }


def _innovation(measurement: dict[str, Any]) -> dict[str, Any]:
    def numbers(name: str) -> list[float]:
        both = (measurement.get(f"{name}_{k}") for k in (0, 1, 2))
        return [number for number in both if number is not None]

    return {
        "source": measurement["source"],
        "outcome": measurement["outcome"],
        "innovation": numbers("innovation"),
        "sigma": numbers("sigma"),
        "nis": measurement["nis"],
        "weight": numbers("weight"),
    }


def _fix(estimate: dict[str, Any], origin: tuple[float, float]) -> dict[str, Any]:
    from pymap3d import enu2geodetic  # here, because few results need it

    latitude, longitude, _ = enu2geodetic(estimate["x_m"], estimate["y_m"], 0.0, *origin, 0.0)
    xx, xy, yy = (estimate[name] for name in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
    return {
        "latitude": float(latitude),
        "longitude": float(longitude),
        "altitude": 0.0,
        "position_covariance": [xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, 0.0],
        "position_covariance_type": _KNOWN,
    }


def _ellipse(estimate: dict[str, Any]) -> dict[str, Any]:
    """Three standard deviations in every direction, as a line around the estimate."""
    xx, xy, yy = (estimate[name] for name in ("var_x_m2", "cov_xy_m2", "var_y_m2"))
    # P = L L': the points L u of the unit circle make its ellipse.
    a = math.sqrt(max(xx, 0.0))
    b = xy / a if a > 0 else 0.0
    c = math.sqrt(max(yy - b * b, 0.0))
    points = []
    for k in range(_ELLIPSE_POINTS):
        angle = math.tau * k / (_ELLIPSE_POINTS - 1)
        u, v = 3 * math.cos(angle), 3 * math.sin(angle)
        x, y = estimate["x_m"] + a * u, estimate["y_m"] + b * u + c * v
        points.append({"x": x, "y": y, "z": 0.0})
    line = {
        "type": 0,
        "pose": {
            "position": {"x": 0, "y": 0, "z": 0},
            "orientation": {"x": 0, "y": 0, "z": 0, "w": 1},
        },
        "thickness": 2.0,
        "scale_invariant": True,
        "points": points,
        "color": {"r": 0.1, "g": 0.4, "b": 0.8, "a": 1.0},
        "colors": [],
        "indices": [],
    }
    return {
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        "lines": [line],
        **{name: [] for name in _PRIMITIVES},
    }
