"""Why the innovations of a replay do not fit: it is run again with one mistake undone at a time.

Each hypothesis changes the log as a mistake of a known cause would be undone (the heading mirrored,
x and y exchanged, a latency taken off, ...). What makes the innovations an order more likely than
the log as it is, and than any other, is the cause that is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from auvest._arguments import Floats
from auvest._texts import short
from auvest.errors import FilterError
from auvest.logs import LogError, LogFolder
from auvest.logs.changed import Change, ChangedLog, HeldLog, columns_changed
from auvest.logs.findings import Finding, finding
from auvest.logs.reader import CsvTable, Rows
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import replay_of
from auvest.replay.health import FEW, Residuals, numbers_of
from auvest.replay.instruments import Instruments
from auvest.replay.sources import Sources
from auvest.replay.tables import Columns

#: So many lines of each file are looked at: a diagnosis of a day takes no longer than of an hour.
LINES = 100_000
#: So many measurements tell all causes apart that any number does.
MEASUREMENTS = 10_000
#: Share of outliers that the likelihood allows for, and over how many metres they are spread.
OUTLIERS, OUTLIER_REACH_M = 0.05, 100.0
#: A cause must make the innovations so much likelier: in all, and per measurement (nats).
GAIN, GAIN_EACH = 12.0, 0.08
#: Of two that explain the log within this share of the gain, and so many nats, both are named.
TIE_SHARE, TIE = 0.05, 6.0

#: What is tried of a number at first; around the best it is then tried more finely.
LATENCIES_S = (0.5, 2.0, 8.0)
DEPTHS_M = (8.0, 24.0, 72.0)
SCALES = (0.9, 0.96, 1.04, 1.1)
#: Metres per second in what a speed may have been told in.
SPEED_UNITS = {
    "knots": 1852 / 3600, "feet per second": 0.3048, "km/h": 1 / 3.6, "miles per hour": 0.44704,
}  # fmt: skip
#: Of speeds, the usual mistakes among them, and the same the other way.
SPEEDS = (0.29, SPEED_UNITS["knots"], *SCALES, 1 / SPEED_UNITS["knots"], 3.4)
#: A scale so near to that of a unit, as a share, is taken for it.
NEAR_UNIT = 0.05
NOISES = (3.0, 10.0)
FINER = 3

_FOURTH = math.pi / 2


@dataclass(frozen=True)
class Hypothesis:
    """One mistake, and the log or the settings with it undone.

    Attributes
    ----------
    cause : str
        One of :data:`auvest.logs.findings.CAUSES`.
    changes : mapping
        What becomes of the rows of each file.
    message : str
        What it says of the log.
    settings : callable
        What becomes of the settings.
    source : int or None
        A source that is left out.
    """

    cause: str
    changes: Mapping[str, Change]
    message: str
    settings: Callable[[Settings], Settings] = lambda settings: settings
    source: int | None = None


@dataclass(frozen=True)
class Number:
    """A mistake of some size: a hypothesis for each value of it, and the values to begin with."""

    make: Callable[[float], Hypothesis]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Fit:
    """A hypothesis and the logarithm of the likelihood of the innovations under it."""

    hypothesis: Hypothesis
    log_likelihood: float


def diagnose(
    log: LogFolder, settings: Settings, filter_name: FilterName, *, gross: bool = True
) -> list[Finding]:
    """Name the cause, or the causes that the log cannot tell apart; none if nothing explains it.

    Parameters
    ----------
    log : LogFolder
        The log; of its truth no more is used than where the run starts, if nothing else says so.
    settings : Settings
        Filter, noise and the rest.
    filter_name : str
        The filter. The refits are made with a robust one where there is one.
    gross : bool
        Whether to look for mistakes that no filter overlooks, such as another axis, too.
    """
    kind: FilterName = "ukf" if log.tracking else "robust-ekf"
    if filter_name in ("robust-ukf", "robust-ekf"):
        kind = filter_name
    start = replay_of(log, settings, kind).start
    held = HeldLog(log, LINES, MEASUREMENTS, start if math.isfinite(start[0]) else None)
    run = _Refits(held, settings, kind)
    as_is = run.run(Hypothesis("", {}, ""))
    if as_is is None or len(as_is.rows["nis"]) < FEW:
        return []
    count = len(as_is.rows["nis"])
    base = float(np.sum(log_likelihoods(as_is.rows)))
    fits = [
        fit
        for family in _families(held, as_is.rows, gross=gross)
        for fit in run.best(family, base, count)
    ]
    if not fits:
        return []
    best = max(fits, key=lambda fit: fit.log_likelihood)
    gain = best.log_likelihood - base
    if gain < max(GAIN, GAIN_EACH * count):
        return []
    slack = max(TIE, TIE_SHARE * gain)
    named = [fit for fit in fits if fit.log_likelihood > best.log_likelihood - slack]
    if best.hypothesis.cause != "noise_too_small":
        named = [fit for fit in named if fit.hypothesis.cause != "noise_too_small"]
    named.sort(key=lambda fit: -fit.log_likelihood)
    found = {}
    for fit in named[:2]:
        other = " (or another cause that the log cannot tell from it)" * (len(named) > 1)
        times = short(math.exp((fit.log_likelihood - base) / count))
        each = f"each measurement is then {times} times as likely"
        message = f"{fit.hypothesis.message}{other}; {each}"
        found[fit.hypothesis.cause] = finding(fit.hypothesis.cause, message)
    return list(found.values())


def log_likelihoods(rows: Columns, outliers: float = OUTLIERS) -> Floats:
    """Logarithm of the likelihood of each measurement, given those before it.

    A measurement is an outlier with a small probability, and then anywhere within a wide reach;
    this makes gross errors cost the same under every hypothesis.
    """
    numbers = numbers_of(rows)
    sigma = rows["sigma_0"]
    inlier = -0.5 * rows["nis"] - np.log(sigma) - 0.5 * numbers * math.log(2 * math.pi)
    reach = math.log(OUTLIER_REACH_M) * np.ones(len(sigma))
    fix = rows["sensor"] == "fix"
    near = fix & (rows["near_field"] != 0)  # there all numbers are metres
    for k in (1, 2):
        more = numbers > k
        inlier[more] -= np.log(rows[f"sigma_{k}"][more])
        inlier[more & near] += np.log(np.maximum(rows["range_m"][more & near], 1e-3))
        reach[more] += np.where(fix[more], math.log(2 * math.pi), math.log(OUTLIER_REACH_M))
    return _with_outliers(inlier, reach, outliers)


def _with_outliers(inlier: Floats, reach: Floats | float, outliers: float = OUTLIERS) -> Floats:
    return np.logaddexp(math.log(1 - outliers) + inlier, math.log(outliers) - reach)


@dataclass(frozen=True)
class Run:
    """What a refit left: innovations, and the track (time, x, y)."""

    rows: Columns
    track: Rows


class _Refits:
    """Runs a log again under hypotheses."""

    def __init__(self, log: LogFolder, settings: Settings, kind: FilterName) -> None:
        self._log = log
        self._settings = settings
        self._kind = kind

    def run(self, one: Hypothesis) -> Run | None:
        """Run it; None if it cannot be run."""
        residuals, track = Residuals(), [np.empty((0, 3))]
        log = ChangedLog(self._log, one.changes)
        try:
            for batch in replay_of(log, one.settings(self._settings), self._kind).batches():
                residuals.add(batch)
                columns = [batch.estimates[name] for name in ("time_s", "x_m", "y_m")]
                track.append(np.column_stack(columns))
        except (LogError, FilterError):
            return None
        return Run(residuals.rows(), np.concatenate(track))

    def best(self, family: list[Hypothesis] | Number, base: float, count: int) -> list[Fit]:
        """Give the likeliest of a family, in a list; none if the family is empty."""
        if not isinstance(family, Number):
            fits = [self._fit(one, count) for one in family]
            return [max(fits, key=_likelihood)] if fits else []
        values = sorted(family.values)
        tried = {value: self._fit(family.make(value), count) for value in values}
        for _ in range(FINER):
            top = max(tried, key=lambda value: tried[value].log_likelihood)
            if tried[top].log_likelihood < base:  # far off everywhere: not this
                break
            at = values.index(top)
            low = values[at - 1] if at > 0 else top * top / values[1]
            high = values[at + 1] if at + 1 < len(values) else top * top / values[-2]
            for value in (math.sqrt(low * top), math.sqrt(top * high)):
                tried[value] = self._fit(family.make(value), count)
            values = sorted(tried)
        return [max(tried.values(), key=_likelihood)]

    def _fit(self, one: Hypothesis, count: int) -> Fit:
        run = self.run(one)
        if run is None or len(run.rows["nis"]) == 0:
            return Fit(one, -math.inf)
        each = log_likelihoods(run.rows)
        if one.source is None:
            return Fit(one, float(each.mean()) * count)
        # What was left out is judged by its own offset and spread from the track of the others.
        apart, off_m, spread_m = self._apart(run, one.source)
        told = replace(one, message=one.message.format(off=off_m, spread=spread_m))
        left = max(count - len(each), 0)
        return Fit(told, float(each.sum()) + left * (float(apart.mean()) if len(apart) else 0.0))

    def _apart(self, run: Run, source: int) -> tuple[Floats, float, float]:
        """Likelihoods of a source's measurements given the track that the others gave.

        Each number that it measures has an offset and a spread of its own: the median and the
        median absolute deviation of its differences from the track; those of range are returned.
        """
        name = "ranges.csv" if "ranges.csv" in self._log else "fixes.csv"
        sources = _sources(self._log, self._settings)
        instruments = Instruments(self._log, self._settings, sources, spatial=False)
        if "depth.csv" in self._log:
            instruments.depths.add(_rows(self._log["depth.csv"]))
        lines = _rows(self._log[name])
        measured = instruments.read(name, lines[lines[:, 1] == source])
        inside = measured.located
        inside &= measured.taken_s >= run.track[0, 0]
        inside &= measured.taken_s <= run.track[-1, 0]
        measured = measured[inside]
        if len(measured) == 0:
            return np.empty(0), math.nan, math.nan
        at = [np.interp(measured.taken_s, run.track[:, 0], run.track[:, k]) for k in (1, 2)]
        away = (at[0] - measured.place[:, 0]) + 1j * (at[1] - measured.place[:, 1])
        numbers = [measured.z[:, 0] - np.abs(away)]
        least = [self._settings.ranges.sigma_m]
        if name == "fixes.csv":
            bearing = measured.z[:, 1]
            numbers.append(np.angle(np.exp(1j * bearing) / np.exp(1j * np.angle(away))))
            fixes = self._settings.fixes
            least = [fixes.sigma_range_m, fixes.sigma_bearing_rad]
        inlier = np.zeros(len(measured))
        found = []
        for off, sigma in zip(numbers, least, strict=True):
            median = float(np.median(off))
            spread = max(1.4826 * float(np.median(np.abs(off - median))), sigma)
            inlier += -0.5 * ((off - median) / spread) ** 2 - math.log(spread)
            inlier -= 0.5 * math.log(2 * math.pi)
            found.append((median, spread))
        reach = math.log(OUTLIER_REACH_M) + (len(numbers) - 1) * math.log(2 * math.pi)
        return _with_outliers(inlier, reach), *found[0]


def _sources(log: LogFolder, settings: Settings) -> Sources:
    sources = Sources(log.beacons(), settings.log.leader_gap_s)
    if "leaders.csv" in log:
        sources.add(_rows(log["leaders.csv"]))
    return sources


def _likelihood(fit: Fit) -> float:
    return fit.log_likelihood


def _families(log: LogFolder, rows: Columns, *, gross: bool) -> Iterator[list[Hypothesis] | Number]:
    """Give the hypotheses, those of one cause together."""
    tracking = log.tracking
    names = ("ranges.csv", "fixes.csv")

    def measured(change: Change) -> dict[str, Change]:
        return dict.fromkeys(names, change)

    if gross:
        yield list(_axes(log))
        yield list(_headings(log, mirrored=True))
        yield list(_headings(log, mirrored=False))
        yield list(_degrees(log))
        yield list(_noises())
    if not tracking:
        yield Number(partial(_speeds, log), SPEEDS)
    if not tracking and "positions.csv" in log:
        yield _latency("positions", {"positions.csv"})
    if not any(name in log for name in names):  # absolute positions alone
        return
    yield Number(
        lambda scale: Hypothesis(
            "range_scale",
            measured(_of_range(lambda r: r * scale)),
            f"ranges times {scale:.3f} fit: a wrong speed of sound, or another unit? water.csv "
            "corrects the first, [constants] range_scale finds it",
        ),
        SCALES,
    )
    if "depth.csv" not in log and not _has_elevations(log):
        yield Number(
            lambda depth: Hypothesis(
                "slant_range",
                measured(_of_range(lambda r: _level(r, depth))),
                f"ranges fit with a depth difference of about {depth:.2g} m to the sources",
            ),
            DEPTHS_M,
        )
    if not tracking:
        yield _latency("ranges", names)
    sources = np.unique(rows["source"][rows["source"] >= 0]).astype(int).tolist()
    if gross and len(sources) > 1:
        yield [
            Hypothesis(
                "source_off",
                measured(_without(source)),
                f"source {source}: its ranges are {{off:+.3g}} m off the track that the others "
                "give, with a spread of {spread:.2g} m",
                source=source,
            )
            for source in sources
        ]


def _latency(what: str, names: Iterable[str]) -> Number:
    return Number(
        lambda latency: Hypothesis(
            "latency",
            dict.fromkeys(names, _earlier(latency)),
            f"{what} fit when taken {latency:.2g} s before their time",
        ),
        LATENCIES_S,
    )


def _has_elevations(log: LogFolder) -> bool:
    return "fixes.csv" in log and "elevation_rad" in log["fixes.csv"].names


def _of_range(compute: Callable[[Rows], Rows]) -> Change:
    return columns_changed({2: lambda rows: compute(rows[:, 2])})


def _level(range_m: Rows, depth_m: float) -> Rows:
    return np.sqrt(np.maximum(range_m**2 - depth_m**2, 0.0))


def _earlier(latency_s: float) -> Change:
    return columns_changed({0: lambda rows: rows[:, 0] - latency_s})


def _axes(log: LogFolder) -> Iterator[Hypothesis]:
    def exchange(first: int) -> Change:
        return columns_changed(
            {first: lambda rows: rows[:, first + 1], first + 1: lambda rows: rows[:, first]}
        )

    changes = {"beacons.csv": exchange(1), "leaders.csv": exchange(2)}
    message = "it fits with x and y of the sources exchanged (NED, ENU)"
    if not log.tracking or len(log.beacons()) > 1 or "leaders.csv" in log:
        yield Hypothesis("axes_exchanged", changes, message)


def _headings(log: LogFolder, *, mirrored: bool) -> Iterator[Hypothesis]:
    """Headings, or bearings, that turn the wrong way or count from another axis."""
    tracking = log.tracking
    cause = "heading_mirrored" if mirrored else "heading_turned"
    what = "bearing" if tracking else "heading"
    angles = (0.0, _FOURTH, 2 * _FOURTH, -_FOURTH)[0 if mirrored else 1 :]
    sign = -1.0 if mirrored else 1.0
    for angle in angles:
        degrees = math.degrees(angle)
        more = f"{'less' if degrees < 0 else 'plus'} {abs(degrees):g} degrees"
        message = f"it fits with the {what} {more}"
        if mirrored:
            message = f"it fits with the {what} of the other sign" + f", {more}" * (angle != 0)
        turned = columns_changed({3: partial(_turned, sign, angle)})
        if tracking:
            yield Hypothesis(cause, {"fixes.csv": turned}, message)
            continue
        changes: dict[str, Change] = {"start.csv": turned}
        if mirrored:
            changes |= _turning(log, lambda turn: -turn)
        yield Hypothesis(cause, changes, message)
    if mirrored and not tracking:
        message = "it fits with turns of the other sign"
        yield Hypothesis(cause, _turning(log, lambda turn: -turn), message)


def _degrees(log: LogFolder) -> Iterator[Hypothesis]:
    if log.tracking:
        change = columns_changed({3: lambda rows: np.radians(rows[:, 3])})
        yield Hypothesis("degrees", {"fixes.csv": change}, "it fits with bearings in degrees")
        return
    message = "it fits with turns in degrees"
    yield Hypothesis("degrees", _turning(log, np.radians), message)


def _turning(log: LogFolder, compute: Callable[[Rows], Rows]) -> dict[str, Change]:
    """Change how the craft turns: by its compass, or by what the odometry has."""
    file = "compass.csv" if "compass.csv" in log else "odometry.csv"
    names = log[file].names
    turns = ("turn_rad", "yaw_rate_rad_s", "heading_rad")
    at = next(k for k, name in enumerate(names) if name in turns)
    return {file: columns_changed({at: lambda rows: compute(rows[:, at])})}


def _speeds(log: LogFolder, scale: float) -> Hypothesis:
    """Speeds or distances of another scale."""
    moved = ("forward_m", "left_m", "speed_m_s", "left_m_s")
    at = [k for k, name in enumerate(log["odometry.csv"].names) if name in moved]
    changes = columns_changed({k: lambda rows, k=k: scale * rows[:, k] for k in at})  # type: ignore[misc]
    off, unit = min((abs(scale / size - 1), unit) for unit, size in SPEED_UNITS.items())
    told = f" (written in {unit}?)" if off < NEAR_UNIT else ""
    message = f"it fits with speeds and distances times {scale:.3f}{told}"
    return Hypothesis("speed_scale", {"odometry.csv": changes}, message)


def _noises() -> Iterator[Hypothesis]:
    for times in NOISES:

        def louder(settings: Settings, times: float = times) -> Settings:
            s = settings
            return replace(
                s,
                start=replace(
                    s.start, **{name: times * value for name, value in vars(s.start).items()}
                ),
                odometry=replace(
                    s.odometry,
                    sigma_distance=times * s.odometry.sigma_distance,
                    sigma_drift=times * s.odometry.sigma_drift,
                    sigma_turn=times * s.odometry.sigma_turn,
                    sigma_turned=times * s.odometry.sigma_turned,
                ),
                ranges=replace(s.ranges, sigma_m=times * s.ranges.sigma_m),
                positions=replace(s.positions, sigma_m=times * s.positions.sigma_m),
                fixes=replace(
                    s.fixes,
                    sigma_range_m=times * s.fixes.sigma_range_m,
                    sigma_bearing_rad=times * s.fixes.sigma_bearing_rad,
                ),
                process=replace(
                    s.process,
                    **{
                        name: times**2 * value
                        for name, value in vars(s.process).items()
                        if name.endswith("_psd")
                    },
                ),
            )

        message = f"it fits with all standard deviations of the settings times {times:g}"
        yield Hypothesis("noise_too_small", {}, message, louder)


def _turned(sign: float, angle: float, rows: Rows) -> Rows:
    turned = sign * rows[:, 3] + angle
    return np.arctan2(np.sin(turned), np.cos(turned))


def _without(source: int) -> Change:
    return lambda rows: rows[rows[:, 1] != source]


def _rows(table: CsvTable) -> Rows:
    parts = [np.empty((0, len(table.columns)))]
    return np.concatenate(parts + [rows for rows, _ in table.chunks()])
