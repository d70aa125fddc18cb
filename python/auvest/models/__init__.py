"""Process and measurement models: one module each."""

from __future__ import annotations

from typing import Any

from auvest.models._base import MeasurementModel, Model, ProcessModel
from auvest.models.body_velocity import BodyVelocity
from auvest.models.constant_acceleration import ConstantAcceleration
from auvest.models.depth import Depth
from auvest.models.functions import FunctionProcess, FunctionSensor, from_names
from auvest.models.heading_speed import HeadingSpeed
from auvest.models.leader_range import LeaderRange
from auvest.models.odometry import Odometry
from auvest.models.odometry_constants import OdometryConstants
from auvest.models.planar_hull import PlanarHull
from auvest.models.position import Position
from auvest.models.range_bearing import RangeBearing
from auvest.models.range_bearing_elevation import RangeBearingElevation
from auvest.models.scaled_range import ScaledRange
from auvest.models.speed_heading import SpeedHeading
from auvest.models.speed_heading_current import SpeedHeadingCurrent
from auvest.models.white_acceleration import WhiteAcceleration

#: Every process and every sensor, by the name of its class.
PROCESSES: dict[str, type[ProcessModel]] = {
    model.__name__: model
    for model in (
        ConstantAcceleration,
        Odometry,
        OdometryConstants,
        PlanarHull,
        SpeedHeading,
        SpeedHeadingCurrent,
        WhiteAcceleration,
    )
}
SENSORS: dict[str, type[MeasurementModel]] = {
    model.__name__: model
    for model in (
        BodyVelocity,
        Depth,
        HeadingSpeed,
        LeaderRange,
        Position,
        RangeBearing,
        RangeBearingElevation,
        ScaledRange,
    )
}


def from_description(description: dict[str, Any]) -> Model:
    """Make the model again that :func:`auvest._state.describe` described.

    Raises
    ------
    ValueError
        If there is no such model.
    """
    params = dict(description)
    name = params.pop("class", None)
    if name == "FunctionSensor":
        return from_names(params)
    if "header" in params:
        from auvest.models.library import from_header  # most programs load no header

        return from_header(name, params)
    model = {**PROCESSES, **SENSORS}.get(name)
    if model is None:
        raise ValueError(f"there is no model {name!r}")
    return model(**{key: _plain(value) for key, value in params.items()})


def _plain(value: Any) -> Any:
    return tuple(_plain(item) for item in value) if isinstance(value, list) else value


__all__ = [
    "PROCESSES",
    "SENSORS",
    "BodyVelocity",
    "ConstantAcceleration",
    "Depth",
    "FunctionProcess",
    "FunctionSensor",
    "HeadingSpeed",
    "LeaderRange",
    "MeasurementModel",
    "Model",
    "Odometry",
    "OdometryConstants",
    "PlanarHull",
    "Position",
    "ProcessModel",
    "RangeBearing",
    "RangeBearingElevation",
    "ScaledRange",
    "SpeedHeading",
    "SpeedHeadingCurrent",
    "WhiteAcceleration",
    "from_description",
]
