"""What a sweep gives: all rows, and a line for each point."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest import montecarlo
from auvest.montecarlo import Columns
from auvest.sweeps.plan import Parameters, Plan

Floats = npt.NDArray[np.float64]

#: Columns that measure nothing.
_NO_MEASURES = ("run", "status", "finished")


@dataclass(frozen=True)
class SweepResult:
    """What :func:`auvest.sweep` returns.

    Attributes
    ----------
    plan : Plan
        Points, tasks and settings.
    rows : list of dict of ndarray
        For each point its rows, one per run, in the order of the runs: ``run``, and the columns of
        the scenario. Empty where nothing is computed.
    missing : int
        Tasks that are not computed.
    computed : int
        Tasks that this call has computed; all others were there.
    """

    plan: Plan
    rows: list[Columns]
    missing: int
    computed: int

    @property
    def complete(self) -> bool:
        """Whether all rows are there."""
        return self.missing == 0

    @property
    def measures(self) -> list[str]:
        """Columns that measure something."""
        first = next((rows for rows in self.rows if rows), {})
        return [name for name in first if name not in _NO_MEASURES]

    @property
    def measure(self) -> str:
        """The column that figures show.

        Raises
        ------
        ValueError
            If the settings name one that there is not.
        """
        chosen = self.plan.measure
        if chosen and self.measures and chosen not in self.measures:
            raise ValueError(f"measure must be one of {', '.join(self.measures)}, not {chosen!r}")
        return chosen or next(iter(self.measures), "")

    def showing(self, measure: str) -> SweepResult:
        """Give the same with another column for the figures.

        Raises
        ------
        ValueError
            If there is no such column.
        """
        other = replace(self, plan=replace(self.plan, measure=measure))
        other.measure  # noqa: B018  (refuses what there is not)
        return other

    def values(self, measure: str) -> tuple[Floats, Floats]:
        """Give mean and standard error of a column at each point: two arrays, NaN if unknown.

        Over the runs that did not fail; the standard error of one run is NaN.
        """
        mean = np.full(len(self.rows), np.nan)
        error = np.full(len(self.rows), np.nan)
        for number, rows in enumerate(self.rows):
            if not rows:
                continue
            known = np.asarray(rows[measure], np.float64)[_good(rows)]
            known = known[~np.isnan(known)]
            if known.size:
                mean[number] = known.mean()
            if known.size > 1:
                error[number] = known.std(ddof=1) / math.sqrt(known.size)
        return mean, error

    def table(self) -> list[dict[str, Any]]:
        """Give a line for each point: parameters, runs, failed runs, means, standard errors."""
        lines: list[dict[str, Any]] = []
        for point, rows in zip(self.plan.points, self.rows, strict=True):
            line = {axis: point.get(axis) for axis in self.plan.axes}
            runs = len(rows["run"]) if rows else 0
            line |= {"runs": runs, "failed_runs": int((~_good(rows)).sum()) if rows else 0}
            lines.append(line)
        for name in self.measures:
            for line, mean, error in zip(lines, *self.values(name), strict=True):
                line[name] = float(mean)
                line[f"{name}_se"] = float(error)
        return lines

    def columns(self) -> Columns:
        """Give all rows in one table, the swept parameters beside them."""
        there = [number for number, rows in enumerate(self.rows) if rows]
        if not there:
            return {}
        counts = [len(self.rows[number]["run"]) for number in there]
        swept = {
            axis: np.repeat(_array([self.plan.points[n].get(axis) for n in there]), counts)
            for axis in self.plan.axes
        }
        return {**swept, **montecarlo.join({n: self.rows[n] for n in there})}

    def digest(self) -> str:
        """Digest all rows: the same wherever and in whatever parts they were computed."""
        whole = hashlib.sha256()
        named = zip(self.plan.identities, self.rows, strict=True)
        for identity, rows in sorted(named, key=lambda pair: pair[0]):
            whole.update(identity.encode())
            for name in sorted(rows):
                whole.update(name.encode())
                whole.update(_bytes(rows[name]))
        return whole.hexdigest()


def _good(rows: Columns) -> Any:
    """Say which runs did not fail."""
    good = np.ones(len(rows["run"]), bool)
    if "status" in rows:
        good &= rows["status"] == 0
    if "finished" in rows:
        good &= rows["finished"].astype(bool)
    return good


def _bytes(values: Any) -> bytes:
    if values.dtype.kind == "f":
        floats = values.astype("<f8")
        return np.where(np.isnan(floats), np.nan, floats).tobytes()  # one of the many NaN
    return values.astype("<i8").tobytes()


def _array(values: Sequence[Any]) -> Any:
    """Make a column of parameters: numbers, or else texts."""
    if all(isinstance(value, (int, float, bool)) for value in values):
        return np.array(values)
    return np.array(["" if value is None else str(value) for value in values])


def level(point: Parameters, axis: str) -> str:
    """Write a parameter of a point for people."""
    value = point.get(axis)
    if value is None:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)
