"""Noises of the settings from a log alone: those under which its innovations are likeliest.

A log is replayed under one choice of noises after another, and the likelihood of the innovations,
a mixture with a share of outliers (:func:`auvest.replay.diagnosis.log_likelihoods`), maximised in
the logarithms of the noises by a bounded simplex search (Nelder and Mead 1965). What no search can
find in a log that does not tell it stays near what the settings had: a noise ten times off costs
half a nat.

The likeliest noises alone make a filter too sure where what is off stays off (a scale, a reflected
signal), for its innovations then hang together and are no independent evidence. They count as their
number over their integrated autocorrelation time (Geyer 1992), and all noises are raised by the
largest common factor that so much evidence does not refuse at 5 %. A common factor leaves the
filter's gain, and so its track, as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from auvest._arguments import Floats
from auvest.errors import FilterError
from auvest.logs import LogError, LogFolder
from auvest.logs.changed import HeldLog
from auvest.logs.origin import local_origin, shifted
from auvest.montecarlo import Store
from auvest.replay import diagnosis
from auvest.replay.checks import filter_of
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import replay_of
from auvest.replay.health import COLUMNS, FEW
from auvest.replay.tables import Batch, Columns

#: The search leaves no noise this many times larger or smaller than the settings have it.
REACH = 1000.0
#: A noise so many times off what the settings have costs half a nat.
OPINION = 10.0
#: Common factors that are tried first: from all settings too large to all too small.
FACTORS = tuple(10.0 ** (half / 2) for half in range(-4, 5))
#: Evaluations of the two searches, per noise, and the edges of the simplexes they begin with.
SEARCHES = ((35, math.log(2.5)), (20, math.log(1.3)))
#: Where the likelihood is looked at along each noise, as factors of what was found.
ALONG = tuple(2.0**octave for octave in (-4, -2, -1, -0.5, 0.5, 1, 2, 4))
#: Half the 95 % quantile of chi squared: what the log refuses is less likely by so many nats.
REFUSED = 1.92
#: No common factor is larger, and it is found to this.
MOST, FINE = 10.0, 1.01


@dataclass(frozen=True)
class Noise:
    """A noise of the settings.

    Attributes
    ----------
    section, key : str
        Where it stands.
    power : int
        2 for densities of power, which grow with the square of a standard deviation.
    """

    section: str
    key: str
    power: int = 1

    @property
    def name(self) -> str:
        """As ``--set`` has it."""
        return f"{self.section}.{self.key}"

    def of(self, settings: Settings) -> float:
        """Give what the settings say."""
        return float(getattr(getattr(settings, self.section), self.key))


@dataclass(frozen=True)
class Calibrated:
    """A noise that was calibrated.

    Attributes
    ----------
    name : str
        Section and key.
    before, likeliest, value : float
        What the settings had, under what the log is likeliest, and what is to be used.
    low, high : float or None
        From where to where the log does not refuse it, the others as found; None: as far as was
        looked.
    profile : list of (float, float)
        Values, and the logarithm of the likelihood there less its maximum, the others as found.
    """

    name: str
    before: float
    likeliest: float
    value: float
    low: float | None
    high: float | None
    profile: list[tuple[float, float]]


@dataclass(frozen=True)
class Calibration:
    """What :func:`calibrate` found.

    Attributes
    ----------
    settings : Settings
        Those given, with the noises found.
    filter_name : str
        The filter.
    noises : list of Calibrated
        Each of them.
    log_likelihood_before, log_likelihood : float
        Of all innovations under the settings given, and the likeliest.
    measurements : int
        How many there are.
    correlation : float
        The integrated autocorrelation time of the innovations: 1 if they are independent.
    refused : float
        What is less likely than the likeliest by more, in nats, the log refuses.
    raised : float
        The common factor on all standard deviations.
    replays : int
        How often each log was replayed.
    """

    settings: Settings
    filter_name: FilterName
    noises: list[Calibrated]
    log_likelihood_before: float
    log_likelihood: float
    measurements: int
    correlation: float
    refused: float
    raised: float
    replays: int

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def noises_of(log: LogFolder, settings: Settings) -> list[Noise]:
    """Name the noises of the settings that a log of this kind can tell.

    A noise of 0 stays 0. What a file says itself, a sigma of each position, is not touched; a
    source with a sigma of its own keeps its ratio to the others.
    """
    if log.tracking:
        found = [Noise("process", "velocity_psd", 2)]
        spatial = "elevation_rad" in log["fixes.csv"].names if "fixes.csv" in log else (
            "depth_m" in log["positions.csv"].names
        )  # fmt: skip
        if spatial:
            found.append(Noise("process", "vertical_velocity_psd", 2))
        else:
            found += [Noise("process", key, 2) for key in ("position_psd", "acceleration_psd")]
        if "velocities.csv" in log:
            keys = ("sigma_forward_m_s", "sigma_left_m_s")
            found += [Noise("velocities", key) for key in keys]
        if spatial and "depth.csv" in log:
            found.append(Noise("depth", "sigma_m"))
    else:
        driven = ("sigma_distance", "sigma_drift", "sigma_turn", "sigma_turned")
        found = [Noise("odometry", key) for key in driven]
    if "ranges.csv" in log:
        found.append(Noise("ranges", "sigma_m"))
    if "fixes.csv" in log:
        found += [Noise("fixes", key) for key in ("sigma_range_m", "sigma_bearing_rad")]
        if "elevation_rad" in log["fixes.csv"].names:
            found.append(Noise("fixes", "sigma_elevation_rad"))
    if "positions.csv" in log and "sigma_m" not in log["positions.csv"].names:
        found.append(Noise("positions", "sigma_m"))
    return [one for one in found if one.of(settings) > 0]


def with_noises(settings: Settings, noises: Sequence[Noise], values: Sequence[float]) -> Settings:
    """Give settings with these values of noises."""
    for noise, value in zip(noises, values, strict=True):
        section = getattr(settings, noise.section)
        changed: dict[str, Any] = {noise.key: value}
        if noise.section in ("ranges", "fixes"):
            ratio = value / noise.of(settings)
            sources = {}
            for source, own in section.sources.items():
                said = getattr(own, noise.key)
                sources[source] = own if said is None else replace(own, **{noise.key: said * ratio})
            changed["sources"] = sources
        settings = replace(settings, **{noise.section: replace(section, **changed)})
    return settings


def calibrate(
    logs: Sequence[LogFolder],
    settings: Settings,
    *,
    filter_name: FilterName | None = None,
    outliers: float = diagnosis.OUTLIERS,
    store: Store | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Calibration:
    """Find the noises under which the innovations are likeliest; no truth is looked at.

    Parameters
    ----------
    logs : sequence of LogFolder
        Logs of one kind, of one craft or of several like it: their likelihoods are multiplied. Of
        each at most the first :data:`auvest.replay.diagnosis.LINES` lines of a file count.
    settings : Settings
        Where the search begins, and all that is no noise.
    filter_name : str, optional
        The filter; default: that of the settings, else robust-ekf for ranges and ukf for fixes.
    outliers : float
        The share of outliers that the likelihood allows for, above 0 and below 1.
    store : Store, optional
        Keeps each likelihood; what is there from a run that was stopped is not computed again.
    progress : callable, optional
        Called with the replays that are done, and an upper bound of all.

    Raises
    ------
    ValueError
        If the logs, the settings or the filter do not fit, or there is too little to calibrate by.
    FilterError
        If the filter cannot do a step with the settings given.
    """
    if not 0 < outliers < 1:
        raise ValueError(f"outliers must be above 0 and below 1, not {outliers}")
    if len({log.tracking for log in logs}) != 1:
        raise ValueError("logs must be of one kind: all of a craft with odometry, or all without")
    name = filter_of(logs[0], settings, filter_name)
    if name == "aukf":
        raise ValueError("filter aukf chooses its fixes by the noises: calibrate with ukf")
    named = {noise.name: noise for log in logs for noise in noises_of(log, settings)}
    noises = list(named.values())
    likelihood = _Likelihood(logs, settings, name, noises, outliers, store, progress)
    before = likelihood.at_start()
    search = _Search(likelihood, noises, settings)
    found = search.maximum()
    best = likelihood(found)
    correlation = autocorrelation_time(likelihood.rows(found))
    refused = REFUSED * correlation
    profiles = [_profile(likelihood, found, k, best) for k in range(len(noises))]
    powers = np.array([noise.power for noise in noises], dtype=np.float64)
    raised = _raised(lambda factor: likelihood(found + powers * math.log(factor)) >= best - refused)
    values = [float(f"{value:.3g}") for value in np.exp(found + powers * math.log(raised))]
    calibrated = []
    for noise, likeliest, value, profile in zip(
        noises, np.exp(found).tolist(), values, profiles, strict=True
    ):
        low, high = _told(profile, refused)
        calibrated.append(
            Calibrated(noise.name, noise.of(settings), likeliest, value, low, high, profile)
        )
    return Calibration(
        settings=with_noises(settings, noises, values),
        filter_name=name,
        noises=calibrated,
        log_likelihood_before=before,
        log_likelihood=best,
        measurements=likelihood.measurements,
        correlation=correlation,
        refused=refused,
        raised=raised,
        replays=likelihood.replays,
    )


def autocorrelation_time(parts: Sequence[Columns]) -> float:
    """Integrated autocorrelation time of the innovations of each source, pooled; 1 at least.

    Parameters
    ----------
    parts : sequence of mapping
        Innovations of one log each, in the order of time, with the columns
        :data:`auvest.replay.health.COLUMNS`.

    Notes
    -----
    ``1 + 2 sum rho_k`` over the lags in pairs, up to the first pair with a negative sum (the
    initial positive sequence of Geyer 1992). Innovations are divided by their sigma and limited to
    three, so that no outlier hides what the others share.
    """
    series = [one for rows in parts for one in _series(rows)]
    longest = max((len(one) for one in series), default=0)
    if longest < 2:
        return 1.0
    square = sum(float(one @ one) for one in series)

    def correlation(lag: int) -> float:
        return sum(float(one[lag:] @ one[:-lag]) for one in series) / square

    time = 1.0
    for lag in range(1, longest - 1, 2):
        pair = correlation(lag) + correlation(lag + 1)
        if pair <= 0:
            break
        time += 2 * pair
    return time


def _series(rows: Columns) -> Iterator[Floats]:
    """Give the innovations of each number of each source, over their sigma."""
    kinds = np.unique(np.column_stack([rows["source"], rows["sensor"]]).astype(str), axis=0)
    for source, sensor in kinds.tolist():
        mine = (rows["source"].astype(str) == source) & (rows["sensor"] == sensor)
        for k in range(3):
            over = rows[f"innovation_{k}"][mine] / rows[f"sigma_{k}"][mine]
            over = over[~np.isnan(over)]
            if len(over):
                yield np.clip(over, -3, 3)


class _Likelihood:
    """The logarithm of the likelihood of logs held in memory, by the logarithms of the noises."""

    def __init__(
        self,
        logs: Sequence[LogFolder],
        settings: Settings,
        name: FilterName,
        noises: list[Noise],
        outliers: float,
        store: Store | None,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._settings, self._name, self._noises = settings, name, noises
        self._outliers, self._store, self._progress = outliers, store, progress
        self._logs = [_held(log, settings, name) for log in logs]
        self._kept: dict[bytes, float] = {}
        self._most = len(FACTORS) + 2 + math.ceil(math.log2(math.log(MOST) / math.log(FINE)))
        self._most += len(noises) * (len(ALONG) + sum(most for most, _ in SEARCHES))
        self.measurements = 0
        self._read()

    @property
    def replays(self) -> int:
        """How many values were computed, by this run or the one it goes on with."""
        return len(self._kept)

    def at_start(self) -> float:
        """Give it under the settings as they are; what goes wrong there is an error."""
        start = np.log([noise.of(self._settings) for noise in self._noises])
        rows = self.rows(start)
        self.measurements = sum(len(one["nis"]) for one in rows)
        if self.measurements < FEW:
            raise ValueError(
                f"{self.measurements} measurements are too few to calibrate by: {FEW} at least"
            )
        return self(start)

    def rows(self, logarithms: Floats) -> list[Columns]:
        """Give the innovations of each log."""
        settings = with_noises(self._settings, self._noises, np.exp(logarithms).tolist())
        found: list[Columns] = []
        for log in self._logs:
            parts = [_compared(batch) for batch in replay_of(log, settings, self._name).batches()]
            found.append({name: np.concatenate([one[name] for one in parts]) for name in COLUMNS})
        return found

    def __call__(self, logarithms: Floats) -> float:
        """Give it; minus infinity where the filter cannot go."""
        key = logarithms.tobytes()
        if key not in self._kept:
            try:
                parts = [
                    diagnosis.log_likelihoods(rows, self._outliers)
                    for rows in self.rows(logarithms)
                ]
                value = float(sum(part.sum() for part in parts))
            except (LogError, FilterError):
                value = -math.inf
            if self._store is not None:
                columns = {"logarithms": logarithms, "log_likelihood": np.array([value])}
                self._store.write(len(self._kept), 1, columns)
            self._kept[key] = value
        if self._progress is not None:
            self._progress(min(len(self._kept), self._most), self._most)
        return self._kept[key]

    def _read(self) -> None:
        """Take over what a run that was stopped has left."""
        while self._store is not None:
            columns = self._store.read(len(self._kept), 1)
            if columns is None or set(columns) != {"logarithms", "log_likelihood"}:
                return
            self._kept[columns["logarithms"].tobytes()] = float(columns["log_likelihood"][0])


class _Search:
    """Where the likelihood is largest."""

    def __init__(self, likelihood: _Likelihood, noises: list[Noise], settings: Settings) -> None:
        self._likelihood = likelihood
        self._start = np.log([noise.of(settings) for noise in noises])
        self._powers = np.array([noise.power for noise in noises], dtype=np.float64)

    def maximum(self) -> Floats:
        """Search: a common factor first, then all noises apart."""
        from scipy.optimize import minimize  # here, because it takes long to import

        tried = [self._start + self._powers * math.log(factor) for factor in FACTORS]
        best: Floats = min(tried, key=self._cost)
        reach = self._powers * math.log(REACH)
        bounds = np.column_stack([self._start - reach, self._start + reach])
        for most, edge in SEARCHES:
            corners = np.vstack([best, best + edge * np.diag(self._powers)])
            found = minimize(
                self._cost,
                best,
                method="Nelder-Mead",
                bounds=bounds,
                options={
                    "maxfev": most * len(best),
                    "xatol": 0.02,
                    "fatol": 0.02,
                    "initial_simplex": np.clip(corners, bounds[:, 0], bounds[:, 1]),
                },
            )
            best = np.asarray(found.x)
        return best

    def _cost(self, logarithms: Floats) -> float:
        """Give what is made small: how unlikely the log is, and how far off the settings."""
        off = (logarithms - self._start) / (self._powers * math.log(OPINION))
        return -self._likelihood(logarithms) + 0.5 * float(off @ off)


def _held(log: LogFolder, settings: Settings, name: FilterName) -> LogFolder:
    local = shifted(log, local_origin(log))
    start = replay_of(local, settings, name).start
    lines = diagnosis.LINES
    return HeldLog(local, lines, lines, start if math.isfinite(start[0]) else None)


def _compared(batch: Batch) -> Columns:
    """Give the measurements of a batch that were compared with a prediction, as judged later."""
    rows = {**batch.measurements, "range_m": batch.ranges_m}
    compared = ~np.isnan(rows["nis"])
    return {name: rows[name][compared] for name in COLUMNS}


def _profile(
    likelihood: _Likelihood, found: Floats, k: int, best: float
) -> list[tuple[float, float]]:
    """Give values of a noise, and the likelihood there less the best one."""
    points = [(math.exp(float(found[k])), 0.0)]
    for factor in ALONG:
        moved = found.copy()
        moved[k] += math.log(factor)
        points.append((math.exp(float(moved[k])), likelihood(moved) - best))
    return sorted(points)


def _told(profile: list[tuple[float, float]], less: float) -> tuple[float | None, float | None]:
    """Give where a profile falls below its top by so much, on both sides; None: nowhere."""
    top = next(k for k, (_, value) in enumerate(profile) if value == 0.0)

    def crossing(points: list[tuple[float, float]]) -> float | None:
        for (inner, above), (outer, below) in pairwise(points):
            if below < -less:
                if not math.isfinite(below):
                    return outer
                # Near its top the likelihood falls with the square: between two points, its root.
                # What the opinion has kept the search from may be above the top.
                fallen = math.sqrt(max(-above, 0.0))
                share = (math.sqrt(less) - fallen) / (math.sqrt(-below) - fallen)
                return math.exp(math.log(inner) + share * math.log(outer / inner))
        return None

    return crossing(profile[top::-1]), crossing(profile[top:])


def _raised(allowed: Callable[[float], bool]) -> float:
    """Give the largest common factor that is allowed, by bisection."""
    low, high = 1.0, MOST
    while high / low > FINE:
        middle = math.sqrt(low * high)
        if allowed(middle):
            low = middle
        else:
            high = middle
    return low
