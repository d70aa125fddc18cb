"""What a sweep computes: its points, and the tasks that they are parted into."""

from __future__ import annotations

import hashlib
import itertools
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from auvest._arguments import as_integer
from auvest.commands.version import version
from auvest.montecarlo import Columns
from auvest.sweeps.experiments import Experiment, experiment, flat

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: Values by dotted names.
Parameters: TypeAlias = dict[str, Any]

#: Time that a task takes about, s: long beside what it costs to hand one out.
_TASK_S = 5.0
#: Rows of a task at most, where runs are short.
_MOST_ROWS = 200_000
_MOST_POINTS = 100_000
_MOST_TASKS = 1_000_000

_SWEEP_KEYS = ("scenario", "runs", "seed", "runs_per_task", "measure")
_SECTIONS = ("sweep", "fixed", "grid", "points")


@dataclass(frozen=True)
class Task:
    """Some runs of one point, which are computed and kept together.

    Attributes
    ----------
    key : str
        Digest of version, settings and runs: the name of the part that holds the rows.
    point : int
        Number of the point in the plan.
    scenario, parameters, seed
        What is run.
    first, count : int
        The runs ``first .. first + count - 1``.
    """

    key: str
    point: int
    scenario: str
    parameters: Parameters
    seed: int
    first: int
    count: int


@dataclass(frozen=True)
class Plan:
    """Points and tasks of a sweep.

    Attributes
    ----------
    scenario : str
        What is run at each point.
    axes : tuple of str
        The parameters that are swept, in their order.
    points : list of dict
        Parameters of each point, those that are fixed too.
    identities : list of str
        What the rows of each point depend on beside their runs, as JSON.
    tasks : list of Task
        Point by point.
    runs, seed : int
        Of each point.
    measure : str
        The column that figures show; "": the first.
    """

    scenario: str
    axes: tuple[str, ...]
    points: list[Parameters]
    identities: list[str]
    tasks: list[Task]
    runs: int
    seed: int
    measure: str

    def part(self, index: int, count: int) -> list[Task]:
        """Give every ``count``-th task, from number ``index`` (1 .. count) on."""
        as_integer("number of parts", count, 1, _MOST_TASKS)
        as_integer("part", index, 1, count)
        return self.tasks[index - 1 :: count]


def read_plan(config: Path | str | Mapping[str, Any]) -> Plan:
    """Read the settings of a sweep and make its plan.

    Parameters
    ----------
    config : path or mapping
        A TOML file, or what would be in it: docs/sweeps.md. Paths in a file are relative to it.

    Raises
    ------
    ValueError
        If the settings cannot be read, or say something that is unknown or wrong; the message
        names file and parameter.
    """
    if isinstance(config, Mapping):
        return _plan(config, "settings", Path())
    path = Path(config)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: is not TOML: {error}") from None
    return _plan(document, str(path), path.parent)


def run_task(task: Task) -> Columns:
    """Do the runs of a task.

    Raises
    ------
    ValueError
        If what it would run is not what was planned: another version here, or a log or a settings
        file that differs from that of the planner.
    """
    made = experiment(task.scenario, task.parameters, task.seed)
    if _key(identity_of(made, task.scenario, task.seed), task.first, task.count) != task.key:
        raise ValueError(
            f"the version, the log or the settings file here (auvest {version()}) is not the one "
            "that the sweep was planned with"
        )
    return made.rows(task.first, task.count)


def identity_of(made: Experiment, scenario: str, seed: int) -> str:
    """Say in JSON what the rows of a point depend on beside their runs."""
    settings = {"scenario": scenario, "settings": made.identity, "version": version()}
    if not made.single:
        settings["seed"] = seed
    return json.dumps(settings, sort_keys=True, default=str)


def _key(identity: str, first: int, count: int) -> str:
    return hashlib.sha256(f"{identity} {first} {count}".encode()).hexdigest()[:32]


def _plan(document: Mapping[str, Any], source: str, folder: Path) -> Plan:
    _refuse_unknown(document, _SECTIONS, source)
    head = _section(document, "sweep", source)
    _refuse_unknown(head, _SWEEP_KEYS, f"{source}: [sweep]")
    if "scenario" not in head:
        raise ValueError(f"{source}: [sweep] needs a scenario")
    scenario = head["scenario"]
    single = scenario == "log"
    try:
        runs = 1 if single else as_integer("runs", head.get("runs", 100), 1, 10**9)
        seed = as_integer("seed", head.get("seed", 1), 0, 2**64 - 1)
        size = head.get("runs_per_task")
        if size is not None:
            size = as_integer("runs_per_task", size, 1, _MOST_ROWS)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{source}: [sweep] {error}") from None
    if single and head.keys() & {"runs", "seed", "runs_per_task"}:
        raise ValueError(f"{source}: [sweep] a log is run once: no runs, seed or runs_per_task")
    axes, points = _points(document, source)
    names = [_named(point, axes) for point in points]
    if single:
        points = [_located(point, folder) for point in points]
    identities: list[str] = []
    tasks: list[Task] = []
    for number, point in enumerate(points):
        try:
            made = experiment(scenario, point, seed)
        except (ValueError, OSError) as error:
            raise ValueError(f"{source}: {names[number]}: {error}") from None
        identity = identity_of(made, scenario, seed)
        identities.append(identity)
        each = size or max(1, min(int(_TASK_S / made.cost), _MOST_ROWS))
        if len(tasks) + runs / each > _MOST_TASKS:
            raise ValueError(f"{source}: more than {_MOST_TASKS:,} tasks: runs_per_task is small")
        for first in range(0, runs, each):
            count = min(each, runs - first)
            key = _key(identity, first, count)
            tasks.append(Task(key, number, scenario, point, seed, first, count))
    _refuse_twins(identities, names, source)
    return Plan(scenario, axes, points, identities, tasks, runs, seed, str(head.get("measure", "")))


def _points(document: Mapping[str, Any], source: str) -> tuple[tuple[str, ...], list[Parameters]]:
    """Give the names of what is swept, and the parameters of each point."""
    fixed = flat(_section(document, "fixed", source))
    grid = flat(_section(document, "grid", source))
    for name, values in grid.items():
        if not isinstance(values, (list, tuple)) or not values:
            raise ValueError(f"{source}: [grid] {name} must be a list of values, not {values!r}")
    listed = document.get("points", [{}])
    if not isinstance(listed, (list, tuple)) or not all(isinstance(x, Mapping) for x in listed):
        raise ValueError(f"{source}: [[points]] must be tables, one for each point")
    rows = [flat(point) for point in listed] or [{}]
    axes = dict.fromkeys(name for row in rows for name in row)
    axes.update(dict.fromkeys(grid))
    for name in grid:
        if any(name in row for row in rows):
            raise ValueError(f"{source}: {name} is in [grid] and in [[points]]")
    for name in fixed:
        if name in axes:
            raise ValueError(f"{source}: {name} is in [fixed], and swept")
    if not axes:
        raise ValueError(f"{source}: nothing is swept: give [grid] or [[points]]")
    count = len(rows)
    for values in grid.values():
        count *= len(values)
    if count > _MOST_POINTS:
        raise ValueError(f"{source}: {count:,} points, at most {_MOST_POINTS:,} are taken")
    points = [
        {**fixed, **row, **dict(zip(grid, values, strict=True))}
        for row in rows
        for values in itertools.product(*grid.values())
    ]
    return tuple(axes), points


def _located(point: Parameters, folder: Path) -> Parameters:
    """Give a point of a log with paths that hold in any working folder."""
    located = dict(point)
    for name in ("log", "config"):
        value = located.get(name)
        if isinstance(value, str) and (name == "log" or (folder / value).exists()):
            located[name] = str((folder / value).resolve())
    return located


def _named(point: Parameters, axes: tuple[str, ...]) -> str:
    return ", ".join(f"{name} = {point[name]!r}" for name in axes if name in point)


def _refuse_twins(identities: list[str], names: list[str], source: str) -> None:
    seen: dict[str, str] = {}
    for identity, name in zip(identities, names, strict=True):
        if identity in seen:
            raise ValueError(f"{source}: the same point twice: {seen[identity]}, and {name}")
        seen[identity] = name


def _section(document: Mapping[str, Any], name: str, source: str) -> Mapping[str, Any]:
    section = document.get(name, {})
    if not isinstance(section, Mapping):
        raise ValueError(f"{source}: [{name}] must be a section")
    return section


def _refuse_unknown(values: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in values:
        if key not in known:
            raise ValueError(f"{where} has no {key!r}; known are {', '.join(known)}")
