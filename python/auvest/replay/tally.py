"""The figures of a replay, gathered as it goes: errors, consistency, what became of what."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest.metrics import chi2_bounds
from auvest.replay import tables
from auvest.replay.tables import Batch, Columns


class Tally:
    """Sums over the batches of one replay."""

    def __init__(self) -> None:
        self.outcomes = dict.fromkeys(tables.OUTCOMES, 0)
        self.recovered = 0
        self.near_field = 0
        self.estimates = 0
        self.first_s = math.nan
        self.last_s = math.nan
        self._truth = 0
        self._square = 0.0
        self._settled_s = math.inf
        self._settled = 0
        self._settled_square = 0.0
        self._reckoned_square = 0.0
        self._worst = 0.0
        self._inside = 0
        self._smoothed_square = 0.0
        self._smoothed_worst = 0.0
        self._smoothed_inside = 0
        self._held = 0
        self._held_square = 0.0
        self._nis = 0.0
        self._nis_count = 0
        self._numbers = 0
        self._masters: dict[int, npt.NDArray[np.float64]] = {}

    def add(self, batch: Batch) -> None:
        """Take one batch."""
        measured, errors = batch.measurements, batch.errors
        names, counts = np.unique(measured["outcome"], return_counts=True)
        for name, count in zip(names.tolist(), counts.tolist(), strict=True):
            self.outcomes[name] += count
        self.recovered += int(measured["recovered"].sum())
        self.near_field += int(measured["near_field"].sum())
        compared = ~np.isnan(measured["nis"])
        nis = measured["nis"][compared]
        self._nis += float(nis.sum())
        self._nis_count += len(nis)
        self._numbers += len(nis)
        for name in ("innovation_1", "innovation_2"):  # of those with more numbers than one
            self._numbers += int((~np.isnan(measured[name][compared])).sum())
        held = measured["held_out_error_m"]
        held = held[~np.isnan(held)]
        self._held += len(held)
        self._held_square += float(np.square(held).sum())

        times = batch.estimates["time_s"]
        self.estimates += len(times)
        if len(times):
            self.first_s = float(times[0]) if math.isnan(self.first_s) else self.first_s
            self.last_s = float(times[-1])
        x, y = errors["error_x_m"], errors["error_y_m"]
        square = x * x + y * y
        self._truth += len(x)
        self._square += float(square.sum())
        self._settled_s = min(self._settled_s, tables.settled_s(batch.estimates))
        since = errors["time_s"] >= self._settled_s
        self._settled += int(since.sum())
        self._settled_square += float(square[since].sum())
        self._worst = max(self._worst, math.sqrt(float(square.max(initial=0.0))))
        self._reckoned_square += float(np.square(errors["dead_reckoned_error_m"]).sum())
        inside = (np.abs(x) <= 3 * errors["sigma_x_m"]) & (np.abs(y) <= 3 * errors["sigma_y_m"])
        self._inside += int(inside.sum())
        if "smoothed_error_x_m" in errors:
            x, y = errors["smoothed_error_x_m"], errors["smoothed_error_y_m"]
            square = x * x + y * y
            self._smoothed_square += float(square.sum())
            self._smoothed_worst = max(
                self._smoothed_worst, math.sqrt(float(square.max(initial=0.0)))
            )
            inside = np.abs(x) <= 3 * errors["smoothed_sigma_x_m"]
            inside &= np.abs(y) <= 3 * errors["smoothed_sigma_y_m"]
            self._smoothed_inside += int(inside.sum())

        if batch.masters is not None:
            self._add_masters(batch.masters)

    def _add_masters(self, rows: Columns) -> None:
        """Add up rows, squares of their errors, and of the relative ones, with their counts."""
        square = rows["error_x_m"] ** 2 + rows["error_y_m"] ** 2
        relative = rows["relative_error_m"] ** 2
        for source in np.unique(rows["source"]).tolist():
            mine = rows["source"] == source
            sums = [float(mine.sum())]
            for values in (square[mine], relative[mine]):
                known = values[~np.isnan(values)]
                sums += [float(known.sum()), float(len(known))]
            before = self._masters.get(source, np.zeros(5))
            self._masters[source] = before + sums

    def masters(self) -> dict[str, dict[str, Any]]:
        """Give the figures of each master, by its number; RMSE None without a truth."""
        return {
            str(source): {
                "estimates": int(rows),
                "rmse_m": self._root(square, int(count)),
                "relative_rmse_m": self._root(relative, int(both)),
            }
            for source, (rows, square, count, relative, both) in sorted(self._masters.items())
        }

    def numbers(self) -> dict[str, Any]:
        """All figures by name; None where there is nothing to compute one from."""
        bounds: tuple[float | None, float | None] = (None, None)
        if self._nis_count:
            low, high = chi2_bounds(self._numbers, 1)
            bounds = (low / self._nis_count, high / self._nis_count)
        return {
            "first_s": self.first_s,
            "last_s": self.last_s,
            "estimates": self.estimates,
            "measurements": sum(self.outcomes.values()),
            **{name.replace(" ", "_"): count for name, count in self.outcomes.items()},
            "recovered": self.recovered,
            "near_field": self.near_field,
            "rmse_m": self._root(self._square, self._truth),
            "max_error_m": self._worst if self._truth else None,
            "dead_reckoned_rmse_m": self._root(self._reckoned_square, self._truth),
            "inside_3_sigma": self._inside / self._truth if self._truth else None,
            "truth": self._truth,
            "held_out_rmse_m": self._root(self._held_square, self._held),
            "nis_mean": self._nis / self._nis_count if self._nis_count else None,
            "nis_bounds_95": list(bounds),
        }

    def smoothed(self) -> dict[str, float | None]:
        """Give the figures of the smoothed track; None without a truth."""
        return {
            "rmse_m": self._root(self._smoothed_square, self._truth),
            "max_error_m": self._smoothed_worst if self._truth else None,
            "inside_3_sigma": self._smoothed_inside / self._truth if self._truth else None,
        }

    def settled_rmse_m(self) -> float | None:
        """RMSE since the filter settled first; None if it never did, or without a truth."""
        return self._root(self._settled_square, self._settled)

    @staticmethod
    def _root(square: float, count: int) -> float | None:
        return math.sqrt(square / count) if count and math.isfinite(square) else None
