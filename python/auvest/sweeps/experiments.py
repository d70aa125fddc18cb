"""What a point of a sweep is: one scenario or log with its parameters, ready to be run.

To add a scenario: a function that takes its parameters and a seed, and a line in
:data:`EXPERIMENTS`.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, get_args

import numpy as np

from auvest import montecarlo
from auvest._arguments import as_kind
from auvest.intervals import CovarianceBudget, FixedInterval, IntervalPolicy, MahalanobisInterval
from auvest.kernels import RejectionStreak
from auvest.montecarlo import Columns

#: Rows of all runs that are simulated at once: more would only need more memory.
_BLOCK = 200_000

_INTERVALS: Mapping[str, Callable[..., IntervalPolicy]] = {
    "fixed": FixedInterval,
    "mahalanobis": MahalanobisInterval,
    "covariance-budget": CovarianceBudget,
}


@dataclass(frozen=True)
class Experiment:
    """One point of a sweep.

    Attributes
    ----------
    rows : callable
        ``rows(first, count)`` does these runs and gives columns, a row per run.
    cost : float
        Time of one run on one core, s, as far as it is known before: tasks are made by it.
    identity : object
        What the rows depend on beside the version, the seed and their numbers, for JSON.
    single : bool
        There is one run, without chance: a log.
    """

    rows: Callable[[int, int], Columns]
    cost: float
    identity: Any
    single: bool = False


def experiment(scenario: str, parameters: Mapping[str, Any], seed: int) -> Experiment:
    """Make a point ready.

    Parameters
    ----------
    scenario : str
        One of :data:`EXPERIMENTS`.
    parameters : mapping
        Values by dotted names, as ``noise.range_m``.
    seed : int
        Of the scenario.

    Raises
    ------
    ValueError
        If a parameter is unknown or wrong.
    """
    try:
        as_kind("scenario", scenario, tuple(EXPERIMENTS))
        return EXPERIMENTS[scenario](_nested(parameters), seed)
    except TypeError as error:
        raise ValueError(str(error)) from None


def _tracking(tree: dict[str, Any], seed: int) -> Experiment:
    from auvest.simulation import paper_aukf, tracking

    given = _canonical(tree)
    noise = _make(tracking.Noise, tree, "noise")
    track: Any = as_kind("track", tree.pop("track", "paper"), get_args(paper_aukf.TrackName))
    options = _table(tree, "filter")
    kind: Any = as_kind("filter.kind", options.pop("kind", "aukf"), get_args(paper_aukf.FilterName))
    policy = _interval(tree)
    if policy is not None and kind != "aukf":
        raise ValueError(f"interval is for filter.kind 'aukf', not {kind!r}: give interval_s")
    if kind == "ekf" and options.keys() & {"alpha", "beta", "kappa"}:
        raise ValueError("filter.alpha, beta and kappa are for ukf and aukf, not for ekf")
    make = partial(paper_aukf.paper_filter, kind, noise=noise, track=track, policy=policy)
    filter_ = _make(make, options, "filter.")
    world = _make(
        partial(tracking.Scenario, track=paper_aukf.paper_track(track), noise=noise, seed=seed),
        tree,
        "",
    )
    return _simulated(tracking.simulate, filter_, world, world.steps, 1.5e-6, given)


def _slat(tree: dict[str, Any], seed: int) -> Experiment:
    from auvest.simulation import paper_slatf, slat

    given = _canonical(tree)
    level = tree.pop("level", None)
    if level is not None:
        known = {one.number: one for one in paper_slatf.LEVELS}
        if level not in known:
            raise ValueError(f"level must lie in 1..{len(known)}, not {level!r}")
        for name in ("sigma_range_m", "sigma_bearing_rad"):
            tree.setdefault(name, getattr(known[level], name))
    if "masters" in tree:
        tree["masters"] = slat.paper_masters(tree["masters"])
    options = _table(tree, "filter")
    kind: Any = as_kind("filter.kind", options.pop("kind", "slatf2"), tuple(paper_slatf.FILTERS))
    scenario = _make(
        partial(slat.SlatScenario, slave=_make(slat.Vehicle, tree, "slave"), seed=seed), tree, ""
    )
    filter_ = paper_slatf.paper_filter(kind, scenario, **options)
    particles = options.get("particles", paper_slatf.PARTICLES)
    per_ping = 0.6e-6 * (particles if "slatf" in kind else 10)
    return _simulated(slat.simulate, filter_, scenario, scenario.pings, per_ping, given)


def _cooperative(tree: dict[str, Any], seed: int) -> Experiment:
    from auvest.simulation import cooperative

    given = _canonical(tree)
    noise = _make(cooperative.RangeNoise, tree, "noise")
    options = _table(tree, "filter")
    if "rejections" in options:
        options["recovery"] = _streak(options.pop("rejections"))
    filter_ = _make(cooperative.slave_filter, options, "filter.")
    scenario = _make(partial(cooperative.Scenario, noise=noise, seed=seed), tree, "")
    return _simulated(cooperative.simulate, filter_, scenario, scenario.steps, 1e-6, given)


def _mission(tree: dict[str, Any], seed: int) -> Experiment:
    from auvest.simulation import mission

    given = _canonical(tree)
    policy = _interval(tree)
    if policy is not None:
        tree["interval"] = policy
    if "rejections" in tree:
        tree["recovery"] = _streak(tree.pop("rejections"))
    plan = _make(partial(mission.Mission, seed=seed), tree, "")

    def some(first: int, count: int) -> Columns:
        flown = mission.simulate(replace(plan, runs=count), record=False, first=first, workers=1)
        return flown.per_run()

    return Experiment(some, 5e-3, given)


def _log(tree: dict[str, Any], _seed: int) -> Experiment:
    from auvest.logs import LogFolder
    from auvest.replay import find_settings, replay

    if "log" not in tree:
        raise ValueError("log must name the folder of a log")
    path = Path(tree.pop("log"))
    changes = [f"{name}={_toml(value)}" for name, value in flat(tree, keep=("config",)).items()]
    settings = find_settings(str(tree.get("config", "")), changes)
    folder = LogFolder(path, reading=settings.reading)

    def one(_first: int, _count: int) -> Columns:
        result = replay(folder, settings, causes=False)
        if result.interrupted:
            raise KeyboardInterrupt
        numbers = {
            name: np.nan if value is None else value
            for name, value in result.numbers.items()
            if value is None or isinstance(value, (int, float))
        }
        return {name: np.array([value]) for name, value in numbers.items()}

    identity = {"settings": asdict(settings), "files": _digests(folder.path)}
    return Experiment(one, 1.0, identity, single=True)


#: Scenarios by their names in the settings of a sweep.
EXPERIMENTS: Mapping[str, Callable[[dict[str, Any], int], Experiment]] = {
    "tracking": _tracking,
    "slat": _slat,
    "cooperative": _cooperative,
    "mission": _mission,
    "log": _log,
}


def _simulated(
    simulate: Callable[..., Any],
    filter_: Any,
    scenario: Any,
    steps: int,
    cost_per_step: float,
    identity: Any,
) -> Experiment:
    """Make the experiment of a scenario with a filter."""

    def some(first: int, count: int) -> Columns:
        world = replace(scenario, runs=count)
        return dict(simulate(filter_, world, first=first, workers=1).per_run())

    def rows(first: int, count: int) -> Columns:
        block = max(1, _BLOCK // steps)
        return montecarlo.run(some, count, first=first, chunk=block, workers=1)

    return Experiment(rows, cost_per_step * steps, identity)


def _interval(tree: dict[str, Any]) -> IntervalPolicy | None:
    if "interval" not in tree:
        return None
    options = _table(tree, "interval")
    kind = options.pop("policy", "mahalanobis")
    kind = as_kind("interval.policy", kind, tuple(_INTERVALS))
    return _make(_INTERVALS[kind], options, "interval.")


def _streak(rejections: int) -> RejectionStreak | None:
    """Give the recovery after so many rejections in a row; 0: none."""
    return RejectionStreak(rejections=rejections) if rejections != 0 else None


def _make(make: Callable[..., Any], tree: dict[str, Any], where: str) -> Any:
    """Call with the parameters of a table, which is ``tree[where]`` if that is a plain name."""
    own = tree if where == "" or where.endswith(".") else _table(tree, where)
    prefix = where if where == "" or where.endswith(".") else f"{where}."
    taken = set(getattr(make, "keywords", {})) | {"runs", "seed"}
    known = [name for name in inspect.signature(make).parameters if name not in taken]
    for name in own:
        if name not in known:
            raise ValueError(f"{prefix}{name} is unknown; known are {', '.join(known)}")
    values = {name: tuple(v) if isinstance(v, list) else v for name, v in own.items()}
    return make(**values)


def _table(tree: dict[str, Any], name: str) -> dict[str, Any]:
    """Take a table out of the parameters; none is an empty one."""
    table = tree.pop(name, {})
    if not isinstance(table, dict):
        raise ValueError(f"{name} must be a table, as {name}.kind, not {table!r}")
    return dict(table)


def _nested(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Give tables for dotted names."""
    tree: dict[str, Any] = {}
    for name, value in parameters.items():
        *tables, key = name.split(".")
        at = tree
        for table in tables:
            at = at.setdefault(table, {})
            if not isinstance(at, dict):
                raise ValueError(f"{name}: {table} is a value, and no table")
        if key in at:
            raise ValueError(f"{name} is a table, and a value")
        at[key] = value
    return tree


def flat(tree: Mapping[str, Any], keep: tuple[str, ...] = (), prefix: str = "") -> dict[str, Any]:
    """Give dotted names for tables; those in ``keep`` are left out."""
    found: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, Mapping):
            found.update(flat(value, prefix=f"{prefix}{name}."))
        elif name not in keep or prefix:
            found[prefix + name] = value
    return found


def _canonical(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Give the parameters so that 1 and 1.0 are the same."""
    return {name: _plain(value) for name, value in flat(tree).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _toml(value: Any) -> str:
    """Write a value as TOML has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value)


def _digests(folder: Path) -> dict[str, str]:
    """Digest what a log is made of: its files at the top."""
    found = {}
    for path in sorted(folder.iterdir()):
        if path.is_file():
            digest = hashlib.sha256()
            with path.open("rb") as file:
                while block := file.read(1 << 20):
                    digest.update(block)
            found[path.name] = digest.hexdigest()
    return found
