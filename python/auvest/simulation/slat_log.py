"""The log of a run of :mod:`auvest.simulation.slat`, and the settings to replay it with."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from auvest import _core
from auvest._arguments import as_instance
from auvest._outputs import new_file
from auvest.logs.write import write_file
from auvest.replay.config import SlatSettings
from auvest.simulation.slat import SlatScenario
from auvest.slat import EkfSlat, Slatf, SlatFilter, SlatfJoint
from auvest.slat.models import CompassMotion, PiecewiseAcceleration


def write_log(folder: Path, filter_: SlatFilter, scenario: SlatScenario, run: int = 0) -> None:
    """Write what a filter is told in one run, the truth, and auvest.toml with the filter.

    A replay with these settings has the estimates of :func:`auvest.simulation.slat.simulate`, to
    the bit.

    Parameters
    ----------
    folder : Path
        Made if missing.
    filter_ : Slatf, SlatfJoint or EkfSlat
        As for ``simulate``.
    scenario : SlatScenario
    run : int
        Number of the run.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or a log cannot hold it: a range below 0.
    OSError
        If a file cannot be written.
    """
    as_instance("filter_", filter_, (Slatf, SlatfJoint, EkfSlat))
    record = _core.slat_record(scenario._as_core(), scenario.seed, run)
    dt, steps, masters = scenario.odometry_s, len(record["u"]), len(scenario.masters)
    u = np.concatenate([record["u"], record["u"][-1:]])  # the last line ends the last reading
    write_file(
        folder, "odometry.csv", time_s=dt * np.arange(steps + 1), speed_m_s=u[:, 0],
        heading_rad=u[:, 1],
    )  # fmt: skip
    echoes = {"range_m": record["z"][:, 0], "bearing_rad": record["z"][:, 1]}
    if scenario.identified:
        echoes["source"] = record["master"]
    write_file(folder, "echoes.csv", time_s=dt * record["step"], **echoes)
    start = scenario.slave
    write_file(folder, "start.csv", time_s=[0.0], x_m=[start.x_m], y_m=[start.y_m])
    names = ("x_m", "y_m", "vx_m_s", "vy_m_s", "ax_m_s2", "ay_m_s2")
    write_file(
        folder,
        "masters.csv",
        time_s=np.zeros(masters),
        source=np.arange(masters),
        **dict(zip(names, record["priors"].T, strict=True)),
        sigma_m=np.full(masters, scenario.prior_position_m),
        sigma_velocity_m_s=np.full(masters, scenario.prior_velocity_m_s),
        sigma_acceleration_m_s2=np.full(masters, scenario.prior_acceleration_m_s2),
    )
    if scenario.plan_known:
        _write_plans(folder, record["changes"] / dt, dt)
    time = np.concatenate([[0.0], record["time_s"]])
    truth = np.concatenate([[[start.x_m, start.y_m]], record["truth"]])
    write_file(folder, "truth.csv", time_s=time, x_m=truth[:, 0], y_m=truth[:, 1])
    begun = [[[one.x_m, one.y_m] for one in scenario.masters]]
    true = np.concatenate([begun, record["masters"]]).reshape(-1, 2)
    write_file(
        folder, "master_truth.csv", time_s=np.repeat(time, masters),
        source=np.tile(np.arange(masters), len(time)), x_m=true[:, 0], y_m=true[:, 1],
    )  # fmt: skip
    with new_file(folder / "auvest.toml", "w", encoding="utf-8", newline="\n") as file:
        file.write(_toml(_settings(filter_, scenario, run)))


def _write_plans(folder: Path, accelerations: Any, dt: float) -> None:
    """Write the masters' accelerations, a line where one changes."""
    before = np.concatenate([np.zeros_like(accelerations[:1]), accelerations[:-1]])
    step, master = np.nonzero((accelerations != before).any(axis=2))
    ax, ay = accelerations[step, master].T
    write_file(folder, "plans.csv", time_s=dt * step, source=master, ax_m_s2=ax, ay_m_s2=ay)


def _settings(filter_: SlatFilter, scenario: SlatScenario, run: int) -> dict[str, dict[str, Any]]:
    """Give the settings with which a replay makes this filter."""
    if isinstance(filter_, Slatf):
        kind = f"slatf{filter_.version}"
    else:
        kind = "slatf-joint" if isinstance(filter_, SlatfJoint) else "ekf-slat"
    motion: CompassMotion = as_instance("filter_.motion", filter_.motion, CompassMotion)
    sonar, own = filter_.sonar, filter_._settings
    master = as_instance("filter_.master", own["master"], PiecewiseAcceleration)
    known = {entry.name for entry in fields(SlatSettings)}
    slat = {key: value for key, value in own.items() if key in known}
    if kind != "ekf-slat":
        slat |= {"seed": scenario.seed, "stream": 2 * run + 1}
    return {
        "filter": {"kind": kind, "dtype": filter_.dtype.name},
        "start": {"sigma_position_m": 0.0},
        "odometry": {"gap_s": max(15.0, 2 * scenario.odometry_s)},
        "slave": {
            "sigma_speed_m_s": motion.sigma_speed_m_s,
            "sigma_heading_rad": motion.sigma_heading_rad,
            "compensate_bias": motion.compensate_bias,
        },
        "sonar": {
            "sigma_range_m": sonar.sigma_range_m,
            "sigma_bearing_rad": sonar.sigma_bearing_rad,
            "bearing": sonar.bearing,
        },
        "masters": {
            "acceleration_m_s2": master.acceleration_m_s2,
            "position_psd": master.position_psd,
        },
        "slat": slat,
        "log": {"leader_gap_s": scenario.odometry_per_ping * scenario.odometry_s},
    }


def _toml(document: dict[str, dict[str, Any]]) -> str:
    lines = ["# Written by auvest simulate slatf: the filter of the simulation."]
    for section, values in document.items():
        lines += ["", f"[{section}]"]
        for key, value in values.items():
            text = str(value).lower() if isinstance(value, bool) else repr(value)
            lines.append(f"{key} = {text}")
    return "\n".join(lines) + "\n"
