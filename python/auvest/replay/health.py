"""Whether a replay is to be trusted, judged by its innovations; no truth is needed.

The mean NIS of all measurements misleads: a few outliers that the filter threw away make it a
hundred. What is judged is the NIS of those within three sigma, against its mean for a consistent
filter (which that limit makes smaller than the number of degrees of freedom), how many are beyond,
how often the filter lost its track, and whether one source stands apart from the others.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from auvest._arguments import Floats
from auvest._texts import counted
from auvest.logs.findings import Finding, Verdict, finding, worst
from auvest.replay import tables
from auvest.replay.samples import Samples
from auvest.replay.tables import Batch, Columns

#: Measurements that are kept to be judged: evenly taken from all, so that memory stays bounded.
KEPT = 20_000
#: A measurement is within three sigma if its NIS is below these, by its numbers.
WITHIN = {1: 9.0, 2: 11.829, 3: 14.156}
#: 95 % of a consistent filter's NIS lie below these.
BELOW_95 = {1: 3.841, 2: 5.991, 3: 7.815}
#: Fewer measurements than this say nothing.
FEW = 12
#: Share beyond three sigma that makes a replay doubtful, and not to be trusted; clean acoustic
#: ranges have a tenth of multipath.
BEYOND_DOUBTFUL, BEYOND_NOT_TRUSTED = 0.25, 0.4
#: Mean NIS within three sigma over that of a consistent filter: its sigmas are too small.
NIS_DOUBTFUL = 1.9
#: Recoveries from lock-out, at least so many and at least in this share of the measurements; the
#: recovery itself does no more, in the long run, than one in fifty.
RECOVERIES_DOUBTFUL, RECOVERIES_NOT_TRUSTED, RECOVERY_SHARE = 2, 8, 0.01
#: Share of the ranges of one Gaussian until the first that told where the craft is.
LOST_NOT_TRUSTED = 0.05
#: Share of a source beyond three sigma that makes it stand apart from the others, and how many
#: times more it is than theirs.
SOURCE_OFF, SOURCE_TIMES = 0.45, 3.0
#: So many measurements in a row beyond three sigma: the track is not to be trusted there.
ASTRAY = 5
#: So many at the very beginning: it is the start that does not fit.
START_ASTRAY = 4
#: Ranges so many times as long as the start says, or as short, are in other units or from another
#: origin than the positions.
LENGTHS_APART = 3.0
#: Share of the measurements that no filter was given, which makes a replay doubtful.
UNUSED_DOUBTFUL = 0.25

#: Why a measurement was not used, by its outcome.
WHY = {
    tables.BEFORE_START: "before the start",
    tables.AFTER_END: "after the last line of the odometry",
    tables.NO_POSITION: "of a source whose position is not known then",
    tables.TOO_SHORT: "shorter than the difference in depth",
}

#: What a replay keeps of each measurement.
COLUMNS = (
    "time_s", "source", "outcome", "innovation_0", "innovation_1", "sigma_0", "sigma_1",
    "near_field", "nis", "recovered", "range_m", "sensor", "innovation_2", "sigma_2",
)  # fmt: skip


@dataclass(frozen=True)
class SourceHealth:
    """One source's innovations.

    Attributes
    ----------
    source : int
    measurements : int
        How many were compared with a prediction.
    beyond_share : float
        Share beyond three sigma.
    median_m, spread_m : float
        Median of the innovations of range, and 1.4826 times their median absolute deviation.
    trend : float
        How innovations grow with the range, m/m: a slope is a scale error.
    """

    source: int
    measurements: int
    beyond_share: float
    median_m: float
    spread_m: float
    trend: float


@dataclass(frozen=True)
class Health:
    """One verdict with its reason, and the figures behind it.

    Attributes
    ----------
    verdict : str
        "sound", "doubtful" or "not_trusted".
    reason : str
        Why.
    measurements : int
        How many were compared with a prediction.
    nis_mean : float or None
        Mean NIS of those within three sigma.
    nis_bounds_95 : list of float or None
        Where it lies for a consistent filter, with 95 % probability.
    below_95 : float or None
        Share of all whose NIS is below the 95 % quantile.
    beyond_share, rejected_share : float or None
        Share beyond three sigma, and share that the filter threw away.
    recoveries : int
        How often the filter lost its track and widened its covariance.
    recovery_times_s : list of float
        When, at most the first twenty.
    sources : list of SourceHealth
        Each source.
    untrusted_s : list of (float, float)
        From when to when the track is not to be trusted: measurements in a row beyond three sigma.
    """

    verdict: Verdict
    reason: str
    measurements: int
    nis_mean: float | None
    nis_bounds_95: list[float] | None
    below_95: float | None
    beyond_share: float | None
    rejected_share: float | None
    recoveries: int
    recovery_times_s: list[float]
    sources: list[SourceHealth]
    untrusted_s: list[tuple[float, float]]

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


class Residuals:
    """What the measurements of a replay left, gathered batch by batch."""

    def __init__(self) -> None:
        self.recoveries = 0
        self.unused: Counter[tuple[int, str]] = Counter()  # by source and outcome
        self.lines: Counter[int] = Counter()  # by source
        self.sensors: Counter[str] = Counter()
        self.judged = 0  # echoes that a filter of masters took or refused
        self.refused = 0
        self.ranges = 0
        self.lost = 0  # ranges until the first that told where the craft is
        self.convergence = ""
        self.settled_s = math.inf
        self._samples = Samples(COLUMNS, KEPT)
        self._beginning: list[Columns] = []

    def add(self, batch: Batch) -> None:
        """Take one batch."""
        measured = batch.measurements
        self.recoveries += int(measured["recovered"].sum())
        rows = {**measured, "range_m": batch.ranges_m}
        self._samples.add(rows)
        self.sensors.update(tables.counts(measured["sensor"]))
        became = tables.counts(measured["outcome"])
        if batch.masters is not None:
            self.refused += became.get(tables.REJECTED, 0)
            self.judged += sum(n for name, n in became.items() if name not in tables.UNUSED)
        for source in np.unique(measured["source"]).tolist():
            mine = measured["source"] == source
            self.lines[int(source)] += int(mine.sum())
            for outcome in (name for name in tables.UNUSED if name in became):
                self.unused[int(source), outcome] += int(
                    (measured["outcome"][mine] == outcome).sum()
                )
        if len(self._beginning) < FEW:
            compared = np.flatnonzero(~np.isnan(measured["nis"]))
            self._beginning += [
                {name: rows[name][k : k + 1] for name in COLUMNS} for k in compared[:FEW].tolist()
            ]
        told = np.flatnonzero(batch.located)
        if self.lost == self.ranges:
            self.lost += int(told[0]) if len(told) else len(batch.located)
        self.ranges += len(batch.located)
        said = batch.estimates.get("convergence", np.empty(0, "U1"))
        if len(said):
            self.convergence = str(said[-1])
            self.settled_s = min(self.settled_s, tables.settled_s(batch.estimates))

    def rows(self) -> Columns:
        """Give those that were compared with a prediction."""
        columns = self._samples.columns()
        compared = ~np.isnan(columns["nis"])
        return {name: values[compared] for name, values in columns.items()}

    def beginning(self) -> Columns:
        """Give the first of them, however many there are."""
        parts = self._beginning or [dict.fromkeys(COLUMNS, np.empty(0))]
        return {name: np.concatenate([part[name] for part in parts]) for name in COLUMNS}


def numbers_of(rows: Columns) -> npt.NDArray[np.int64]:
    """How many numbers each measurement has: a range one, range and bearing two."""
    more = [~np.isnan(rows[name]) for name in ("innovation_1", "innovation_2")]
    return 1 + more[0].astype(np.int64) + more[1].astype(np.int64)


def _of_numbers(values: Mapping[int, float], numbers: npt.NDArray[np.int64]) -> Floats:
    """Give each measurement the value for its numbers."""
    table = np.array([math.nan, *(values[k] for k in sorted(values))])
    found: Floats = table[numbers]
    return found


def within(rows: Columns) -> npt.NDArray[np.bool_]:
    """Say which measurements are within three sigma."""
    inside: npt.NDArray[np.bool_] = rows["nis"] < _of_numbers(WITHIN, numbers_of(rows))
    return inside


def _expected(rows: Columns) -> tuple[float, float]:
    """Mean and spread of a consistent filter's NIS within three sigma, in these rows."""
    kinds, counts = np.unique(numbers_of(rows), return_counts=True)
    moments = [truncated_moments(k, WITHIN[k]) for k in kinds.tolist()]
    if len(moments) == 1:
        return moments[0]
    mean = float(np.average([one[0] for one in moments], weights=counts))
    square = float(np.average([one[1] ** 2 for one in moments], weights=counts))
    return mean, math.sqrt(square)


def _share(rows: Columns, inside: npt.NDArray[np.bool_]) -> float:
    """How large the mean NIS within three sigma is beside that of a consistent filter."""
    kept = {name: values[inside] for name, values in rows.items()}
    return float(kept["nis"].mean()) / _expected(kept)[0]


def _size(share: float) -> str:
    """Say in words how large innovations are that are not too large."""
    if share > 1 / NIS_DOUBTFUL:
        return "innovations are as large as the settings say"
    return (
        f"innovations are {math.sqrt(share):.2g} times as large as the settings say: smaller "
        "sigmas would make more of the log (auvest calibrate)"
    )


def truncated_moments(numbers: int, limit: float) -> tuple[float, float]:
    """Mean and standard deviation of a chi-square value of one or two numbers below a limit."""
    from scipy.special import chdtr  # here, because it is slow to import

    inside = chdtr(numbers, limit)
    mean = numbers * chdtr(numbers + 2, limit) / inside
    square = numbers * (numbers + 2) * chdtr(numbers + 4, limit) / inside
    return float(mean), math.sqrt(float(square - mean * mean))


def findings(residuals: Residuals) -> list[Finding]:
    """Say what the innovations of a replay show, without asking why."""
    rows = residuals.rows()
    count = len(rows["nis"])
    found = _unused(residuals) + _refused(residuals)
    if count < FEW:
        return found
    inside = within(rows)
    beyond = 1 - float(inside.mean())
    found += _beginning(residuals.beginning(), beyond)
    blind = float(_blind(rows).mean())
    if blind > BEYOND_DOUBTFUL:
        message = (
            f"the filter does not know where it is: at {100 * blind:.0f} % of {count} measurements "
            "the sigma of its prediction is larger than any range"
        )
        found.append(finding("innovations", message, verdict="not_trusted"))
    if beyond > BEYOND_DOUBTFUL:
        bad = beyond > BEYOND_NOT_TRUSTED
        message = f"{100 * beyond:.0f} % of {count} measurements are beyond three sigma"
        verdict: Verdict = "not_trusted" if bad else "doubtful"
        found.append(finding("innovations", message, verdict=verdict))
    else:
        mean = _share(rows, inside)
        if mean > NIS_DOUBTFUL:
            message = (
                f"innovations are {math.sqrt(mean):.2g} times as large as the settings say, "
                "outliers apart"
            )
            found.append(finding("innovations", message))
    found += _apart(rows, inside)
    least = max(RECOVERIES_DOUBTFUL, RECOVERY_SHARE * count)
    if residuals.recoveries >= least:
        message = f"the filter lost its track {residuals.recoveries} times in {count} measurements"
        bad = residuals.recoveries >= RECOVERIES_NOT_TRUSTED
        found.append(finding("recoveries", message, verdict="not_trusted" if bad else "doubtful"))
    return found


def _refused(residuals: Residuals) -> list[Finding]:
    """Find echoes that the gate has kept out; particles have no NIS to be judged by."""
    share = residuals.refused / max(residuals.judged, 1)
    if residuals.judged < FEW or share <= BEYOND_DOUBTFUL:
        return []
    message = f"the gate refused {100 * share:.0f} % of {residuals.judged} echoes"
    verdict: Verdict = "not_trusted" if share > BEYOND_NOT_TRUSTED else "doubtful"
    return [finding("innovations", message, verdict=verdict)]


def _unused(residuals: Residuals) -> list[Finding]:
    """Find measurements that no filter was given."""
    files = {
        "range": "ranges.csv", "fix": "fixes.csv", "position": "positions.csv",
        "echo": "echoes.csv",
    }  # fmt: skip
    file = next((files[one] for one in files if residuals.sensors[one]), "ranges.csv")
    lines = sum(residuals.lines.values())
    found = []
    for source, of_source in sorted(residuals.lines.items()):
        unknown = residuals.unused[source, tables.NO_POSITION]
        if unknown == of_source and source >= 0:
            message = (
                f"source {source}: its position is known at none of its {of_source} lines: is its "
                "number in beacons.csv or leaders.csv, and has leaders.csv the same clock?"
            )
            found.append(finding("not_used", message, file=file))
    counts = {
        outcome: sum(residuals.unused[source, outcome] for source in residuals.lines)
        for outcome in tables.UNUSED
    }
    unused = sum(counts.values())
    if lines and (unused == lines or (unused > UNUSED_DOUBTFUL * lines and not found)):
        why = ", ".join(f"{count} {WHY[outcome]}" for outcome, count in counts.items() if count)
        message = f"{unused} of {lines} lines are not used: {why}"
        verdict: Verdict = "not_trusted" if unused == lines else "doubtful"
        found.append(finding("not_used", message, file=file, verdict=verdict))
    return found


def _blind(rows: Columns) -> npt.NDArray[np.bool_]:
    """Tell measurements that say nothing: the filter's own prediction is wider than all ranges.

    To a filter that has lost its track altogether everything fits.
    """
    ranged = ~np.isnan(rows["range_m"])
    blind: npt.NDArray[np.bool_] = rows["sigma_0"] > rows["range_m"][ranged].max(initial=0.0)
    return blind & ranged & (rows["near_field"] == 0)


def _beginning(rows: Columns, beyond: float) -> list[Finding]:
    """Find a start that does not fit: the first measurements are beyond three sigma."""
    out = ~within(rows)
    first = len(out) if out.all() else int(np.argmin(out))
    if first < START_ASTRAY:
        return []
    plain = np.flatnonzero((rows["near_field"] == 0) & ~np.isnan(rows["range_m"]))
    plain = plain[plain < first]
    measured = rows["range_m"][plain]
    expected = np.maximum(np.abs(measured - rows["innovation_0"][plain]), 1e-3)
    ratio = float(np.median(measured / expected)) if len(plain) else 1.0
    if not 1 / LENGTHS_APART < ratio < LENGTHS_APART:
        message = (
            f"ranges are {ratio:.3g} times as long as the way from the start to the sources: have "
            "they the same unit and origin?"
        )
        return [finding("lengths_apart", message)]
    if beyond > BEYOND_DOUBTFUL:
        return []
    message = (
        f"the first {first} measurements lie beyond three sigma, and most of the others do not: is "
        "the place, the heading or the time of the start wrong, or are its sigmas too small?"
    )
    return [finding("start_off", message)]


def _apart(rows: Columns, inside: npt.NDArray[np.bool_]) -> list[Finding]:
    """Find a source whose measurements are thrown away while the others' are not."""
    shares = {
        int(source): 1 - float(inside[rows["source"] == source].mean())
        for source in np.unique(rows["source"][rows["source"] >= 0])
        if (rows["source"] == source).sum() >= FEW
    }
    found = []
    for source, share in shares.items():
        others = max([other for name, other in shares.items() if name != source], default=share)
        if share > SOURCE_OFF and share > SOURCE_TIMES * others:
            message = (
                f"source {source}: {100 * share:.0f} % beyond three sigma, of the others at most "
                f"{100 * others:.0f} %: is its position, number or calibration wrong?"
            )
            found.append(finding("source_off", message))
    return found


def start_findings(residuals: Residuals) -> list[Finding]:
    """Say whether the ranges told where the craft is."""
    said = residuals.convergence
    lost, ranges = residuals.lost, residuals.ranges
    if not said and lost > 0 and (lost == ranges or lost > FEW):
        message = (
            f"the first {lost} of {ranges} ranges did not tell where the craft is: a start that is "
            "not known needs components in [filter], 16 or 32"
        )
        bad = lost > LOST_NOT_TRUSTED * ranges
        return [finding("not_converged", message, verdict="not_trusted" if bad else "doubtful")]
    if not said or said == tables.SETTLED:
        return []
    since = "it never settled"
    if math.isfinite(residuals.settled_s):
        since = f"it settled first at {residuals.settled_s:.6g} s"
    texts = {
        tables.NOT_CONVERGED: "at the end the ranges do not say where the craft is",
        tables.AMBIGUOUS: "at the end the ranges leave several places, the estimate is between",
        tables.SETTLING: "at the end the ranges leave one place, not yet confirmed",
    }
    return [finding(said.replace(" ", "_"), f"{texts[said]}; {since}")]


def health(residuals: Residuals, found: Iterable[Finding]) -> Health:
    """Give the verdict of all findings, and the figures of the innovations."""
    found = list(found)
    verdict = worst(one.verdict for one in found)
    rows = residuals.rows()
    count, inside = len(rows["nis"]), within(rows)
    reasons = [one.text for one in found if one.verdict == verdict]
    if verdict == "sound":
        few = f"only {counted(count, 'measurement')}: hardly anything to judge by"
        reasons = [few if count < FEW else _size(_share(rows, inside))]
        if count == 0 and residuals.judged:
            reasons = [f"the gate refused {residuals.refused} of {residuals.judged} echoes"]
    if count == 0:
        return Health(
            verdict, reasons[0], 0, None, None, None, None, None, residuals.recoveries, [], [], []
        )
    mean, spread = _expected(rows)
    reach = 1.96 * spread / math.sqrt(max(int(inside.sum()), 1))
    sources = np.unique(rows["source"][rows["source"] >= 0]).tolist()
    return Health(
        verdict=verdict,
        reason=reasons[0],
        measurements=count,
        nis_mean=float(rows["nis"][inside].mean()) if inside.any() else None,
        nis_bounds_95=[mean - reach, mean + reach],
        below_95=float((rows["nis"] < _of_numbers(BELOW_95, numbers_of(rows))).mean()),
        beyond_share=1 - float(inside.mean()),
        rejected_share=float((rows["outcome"] == tables.REJECTED).mean()),
        recoveries=residuals.recoveries,
        recovery_times_s=rows["time_s"][rows["recovered"] != 0][:20].tolist(),
        sources=[_source(rows, inside, source) for source in sources],
        untrusted_s=_astray(rows["time_s"], inside & ~_blind(rows)),
    )


def _source(rows: Columns, inside: npt.NDArray[np.bool_], source: float) -> SourceHealth:
    mine = rows["source"] == source
    plain = mine & (rows["near_field"] == 0)
    off, range_m = rows["innovation_0"][plain], rows["range_m"][plain]
    median = float(np.median(off)) if len(off) else math.nan
    spread = 1.4826 * float(np.median(np.abs(off - median))) if len(off) else math.nan
    kept = inside[plain]
    trend = math.nan
    if kept.sum() > 2 and np.ptp(range_m[kept]) > 0:
        trend = float(np.polyfit(range_m[kept], off[kept], 1)[0])
    return SourceHealth(
        source=int(source),
        measurements=int(mine.sum()),
        beyond_share=1 - float(inside[mine].mean()),
        median_m=median,
        spread_m=spread,
        trend=trend,
    )


def _astray(time_s: npt.NDArray[Any], inside: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Give the times in which measurement after measurement is beyond three sigma."""
    order = np.argsort(time_s, kind="stable")
    time, out = time_s[order], ~inside[order]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], out, [False]]).astype(int)))
    spans = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(float(time[a]), float(time[b - 1])) for a, b in spans if b - a >= ASTRAY]
