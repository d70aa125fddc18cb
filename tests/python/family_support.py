"""The family of filters as its tests go through it: every kind, process and sensor, with a record.

A new filter joins by its line in the registry, a process or a sensor by being in ``PROCESSES`` or
``SENSORS``.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import itertools
from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

import auvest
from auvest.models import PROCESSES, SENSORS
from auvest.registry import FILTERS

KINDS = tuple(
    getattr(auvest, entry.cls) for entry in FILTERS.values() if entry.family == "gaussian"
)

#: What the numbers of a record are, by the unit at the end of a name: a size and a deviation.
UNITS = {
    "_m_s2": (0.01, 0.02),
    "_m_s": (0.4, 0.1),
    "_m": (40.0, 1.5),
    "_rad_s": (0.02, 0.01),
    "_rad": (0.3, 0.05),
    "": (0.02, 0.05),
}


def variants(model: type[Any]) -> Iterator[Any]:
    """A model with each choice that makes it another class of the core."""
    hints = get_type_hints(model)
    choices = {
        name: (False, True) if hints[name] is bool else get_args(hints[name])
        for name in model.structural
        if hints[name] is bool or get_origin(hints[name]) is Literal
    }
    for values in itertools.product(*choices.values()):
        yield model(**dict(zip(choices, values, strict=True)))


#: Where a sensor stands that has to be told.
STANDS = {"leader": (0.0, 0.0), "heading_rad": 0.0}


def standing(model: auvest.MeasurementModel) -> auvest.MeasurementModel:
    """A sensor that says where it stands."""
    if model.stands:
        return model
    return dataclasses.replace(model, **{model.place: STANDS[model.place]})  # type: ignore[type-var]


#: Every sensor in every size.
ALL_SENSORS: tuple[auvest.MeasurementModel, ...] = (
    *map(standing, itertools.chain.from_iterable(map(variants, SENSORS.values()))),
    auvest.Position(covariance_m2=[[1.0, 0.3, 0.1], [0.3, 2.0, -0.2], [0.1, -0.2, 0.5]]),
)


# ---- Models as functions, which a module names.


def glide(x, dt):
    """Position, speed and drag in the plane: linear."""
    return np.array([x[0] + dt * x[2], x[1] + dt * x[3], x[2] - 0.1 * dt * x[2], x[3]])


def glide_noise(dt):
    return dt * np.diag([1e-3, 1e-3, 1e-2, 2e-2])


def turn(x, dt, u):
    """A pose that is driven by speed and turn rate; the heading is wrapped."""
    heading = x[2] + dt * u[1]
    return np.array(
        [
            x[0] + dt * u[0] * np.cos(x[2]),
            x[1] + dt * u[0] * np.sin(x[2]),
            (heading + np.pi) % (2 * np.pi) - np.pi,
        ]
    )


def squares(x):
    return np.array([np.hypot(x[0] - 5.0, x[1] + 3.0), np.arctan2(x[1] + 3.0, x[0] - 5.0)])


def glider() -> auvest.FunctionProcess:
    state = ("x_m", "y_m", "vx_m_s", "vy_m_s")
    return auvest.FunctionProcess(glide, glide_noise, state=state)


def turner() -> auvest.FunctionProcess:
    return auvest.FunctionProcess(
        turn,
        np.diag([1e-3, 1e-3, 1e-4]),
        state=("x_m", "y_m", "theta_rad"),
        input=("speed_m_s", "rate_rad_s"),
        angles=(2,),
    )


def fix() -> auvest.FunctionSensor:
    return auvest.FunctionSensor(squares, np.diag([0.25, 0.01]), angles=(1,))


# ---- Every process by name.

BUILT_IN = {
    process.core_name: process for model in PROCESSES.values() for process in variants(model)
}
FUNCTIONS = {"functions": glider(), "driven functions": turner()}
ALL: dict[str, auvest.ProcessModel] = {**BUILT_IN, **FUNCTIONS}

CASES = [(kind, name) for kind in KINDS for name in ALL]
#: Functions have no float32.
PRECISE_CASES = [
    (kind, name, dtype)
    for kind, name in CASES
    for dtype in ("float32", "float64")
    if name in BUILT_IN or dtype == "float64"
]


#: Those that can range in the plane, and so start anywhere.
RANGING_CASES = [case for case in PRECISE_CASES if ALL[case[1]].state[:2] == ("x_m", "y_m")]


def of_unit(name: str) -> tuple[float, float]:
    return next(value for unit, value in UNITS.items() if name.endswith(unit))


def sensors_for(process: auvest.ProcessModel) -> dict[str, auvest.MeasurementModel]:
    """Every sensor that suits the process, the first of them twice."""
    found: dict[str, auvest.MeasurementModel] = {}
    for model in ALL_SENSORS:
        try:
            model.check_process(process)
        except ValueError:
            continue
        found[model.core_name] = model
    if isinstance(process, auvest.FunctionProcess):
        found["fix"] = fix()
    assert found, f"no sensor suits {process}"
    first = next(iter(found.values()))
    sigma = next(f.name for f in dataclasses.fields(first) if f.name.startswith("sigma_"))
    found["again"] = dataclasses.replace(first, **{sigma: 2 * getattr(first, sigma)})
    return found


def start(process: auvest.ProcessModel) -> tuple[np.ndarray, np.ndarray]:
    """A belief about 50 m from the origin, with correlations."""
    values = np.array([of_unit(name) for name in process.state])
    x0 = values[:, 0] * (1 - 0.2 * np.arange(len(values)))
    root = np.diag(values[:, 1])
    for i in range(1, len(values)):
        root[i, i - 1] = 0.3 * values[i, 1]
    return x0, root @ root.T


def make(kind, name: str, dtype: str = "float64", **options: Any):
    """A filter of this kind over the process of that name, with all sensors that suit it."""
    process = ALL[name]
    options = {"sensors": sensors_for(process), **options}
    return kind(*start(process), process=process, dtype=dtype, **options)


def make_lost(kind, name: str, dtype: str = "float64", **options: Any):
    """The same with a start that is known to some kilometres, of up to 16 components."""
    process = ALL[name]
    x0, p0 = start(process)
    wide = np.ones(len(x0))
    wide[:2] = 2e3
    options = {"kernel": "igg", "components": 16, "sensors": sensors_for(process), **options}
    return kind(x0, p0 * np.outer(wide, wide), process=process, dtype=dtype, **options)


@dataclasses.dataclass
class Record:
    """What run() takes, row by row; `sensor` are names."""

    z: np.ndarray
    dt: np.ndarray
    input: np.ndarray | None
    sensor: list[str]
    place: np.ndarray
    age_s: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.z)

    def __getitem__(self, rows: slice) -> Record:
        parts = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return Record(**{k: None if part is None else part[rows] for k, part in parts.items()})

    def run(self, f, **options: Any):
        """The whole record at once."""
        given = {
            "dt": self.dt,
            "input": self.input,
            "sensor": self.sensor,
            "place": self.place if self.place.size > 0 else None,
            "age_s": self.age_s,
        }
        return f.run(self.z, **{**given, **options})

    def step(self, f, k: int) -> None:
        """Row k by single steps."""
        f.predict(self.dt[k], None if self.input is None else self.input[k])
        self.update(f, k)
        if f.policy is not None:
            f.feedback()

    def update(self, f, k: int, age_s: float | None = None) -> None:
        model = f.sensors[self.sensor[k]]
        place = self.place[k][~np.isnan(self.place[k])]
        if age_s is None and self.age_s is not None:
            age_s = self.age_s[k]
        f.update(
            self.z[k, : len(model.measures)],
            self.sensor[k],
            place=place if len(place) > 0 else None,
            age_s=age_s,
        )

    def drive(self, f) -> list[dict[str, bytes]]:
        """All rows by single steps; what can be read after each, and all at the end."""
        seen = []
        for k in range(len(self)):
            self.step(f, k)
            seen.append(readable(f))
        return [*seen, everything(f)]


def record(process: auvest.ProcessModel) -> Record:
    """The record of this process, to be changed at will."""
    return copy.deepcopy(cached_record(process))


@functools.cache
def cached_record(process: auvest.ProcessModel) -> Record:
    """Uneven times, several sensors in turn, missing rows, stations that move; outliers, small and
    large, alone and in a row.
    """
    rng, steps = np.random.default_rng(1), 60
    sensors = sensors_for(process)
    names = [list(sensors)[k % len(sensors)] for k in range(steps)]
    width = max(len(model.measures) for model in sensors.values())
    dt = 0.5 + 0.25 * (np.arange(steps) % 3)
    inputs = None
    if process.input:
        sizes = np.array([of_unit(name)[0] for name in process.input])
        sizes = np.minimum(sizes, 0.6)
        wave = np.sin(np.add.outer(0.2 * np.arange(steps), np.arange(len(sizes))))
        inputs = sizes * (1 + 0.5 * wave)
    x0, p0 = start(process)
    truth = x0 + np.linalg.cholesky(p0) @ rng.standard_normal(len(x0))
    z = np.full((steps, width), np.nan)
    place_width = max((place_size(model) for model in sensors.values()), default=0)
    place = np.full((steps, place_width), np.nan)
    for k in range(steps):
        truth = process.f(truth, dt[k], None if inputs is None else inputs[k])
        model = sensors[names[k]]
        if place_size(model) and k % 4 >= 2:
            place[k, : place_size(model)] = [10.0 + 0.1 * k, -5.0 - 0.2 * k, 3.0][
                : place_size(model)
            ]
            model = moved(model, place[k, : place_size(model)])
        if k % 5 == 4:
            continue
        sigma = noise(model)
        off = 12.0 if k % 7 == 3 or 40 <= k < 47 else 2.5 if k % 7 == 5 else 0.0
        z[k, : len(sigma)] = model.h(truth) + sigma * (off + rng.standard_normal(len(sigma)))
    return Record(z, dt, inputs, names, place)


def noise(model: auvest.MeasurementModel) -> np.ndarray:
    """Standard deviations of its numbers, or something of that size."""
    if isinstance(model, auvest.FunctionSensor):
        return np.sqrt(np.diag(model.R))
    if isinstance(model, auvest.Position):
        return np.sqrt(np.diag(model.covariance_m2))
    fields = [f.name for f in dataclasses.fields(model) if f.name.startswith("sigma_")]
    given = [np.ravel(getattr(model, name))[0] for name in fields]
    size = len(model.measures)
    return np.array((given * size)[:size] if len(given) < size else given[:size], float)


def place_size(model: auvest.MeasurementModel) -> int:
    """How many coordinates say where the sensor stands, or how."""
    return 0 if model.place is None else np.size(getattr(model, model.place))


def moved(model: auvest.MeasurementModel, place: np.ndarray) -> auvest.MeasurementModel:
    assert model.place is not None
    there = tuple(place.tolist()) if len(place) > 1 else float(place[0])
    return dataclasses.replace(model, **{model.place: there})  # type: ignore[type-var]


def row(f, width: int) -> dict[str, np.ndarray]:
    """What run() writes down of a filter as it is."""
    report, nan = f.report, np.full(width, np.nan, f.dtype)
    columns: dict[str, Any] = {"x": f.x, "P": f.P, "nis": np.array(f.nis, f.dtype)}
    size = 0 if report is None else len(report.innovation)
    for name in ("innovation", "standardised", "weight"):
        columns[name] = nan.copy()
        if report is not None:
            columns[name][:size] = getattr(report, name)
    columns["S"] = np.full((width, width), np.nan, f.dtype)
    if report is not None:
        columns["S"][:size, :size] = report.S
    columns["near_field"] = np.array(report is not None and report.near_field)
    columns["recovered"] = np.array(report is not None and report.recovered)
    columns["decision"] = np.array(0 if report is None else int(report.decision), np.uint8)
    columns["iterations"] = np.array(0 if report is None else report.iterations, np.uint8)
    if f.policy is not None:
        columns["interval_s"] = np.array(f.interval, f.dtype)
    if f.components > 1:
        columns["convergence"] = np.array(int(f.convergence), np.uint8)
        columns["mixture_size"] = np.array(len(f.mixture), np.uint8)
    return columns


def readable(f) -> dict[str, bytes]:
    """All that can be read from a filter, but for its status, as bytes."""
    found = {name: np.asarray(getattr(f, name)).tobytes() for name in ("x", "P", "innovation", "S")}
    for name, value in row(f, 6).items():
        found[f"last {name}"] = value.tobytes()
    if isinstance(f.policy, auvest.MahalanobisInterval):
        for name in ("tau", "ratio", "mahalanobis_squared"):
            found[name] = np.float64(getattr(f, name)).tobytes()
    for name in ("weight", "x", "P"):
        found[f"mixture {name}"] = getattr(f.mixture, name).tobytes()
    return found


def everything(f) -> dict[str, bytes]:
    """All that can be read from a filter, as bytes, and all that it carries along."""
    return {**readable(f), "status": f.status.name.encode(), "save": f.save()}


def drive_elsewhere(f, rest: Record) -> list[dict[str, bytes]]:
    """For a process that was started for it: what the filter does from here."""
    return rest.drive(f)
