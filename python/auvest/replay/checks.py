"""All that is checked of a log: what its files show, and what a replay of it leaves.

``auvest check`` and ``auvest replay`` do the same, without a look at the truth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from auvest.errors import FilterError
from auvest.logs import LogError, LogFolder
from auvest.logs.check import FileSeen, Limits, from_error, ignored_files, survey
from auvest.logs.findings import VERDICTS, Finding, Verdict, finding, worst
from auvest.logs.origin import local_origin, shifted
from auvest.replay import diagnosis
from auvest.replay.config import FilterName, Settings
from auvest.replay.engine import replay_of
from auvest.replay.health import Health, Residuals, findings, health, start_findings

#: Sections of the settings that are not for all kinds of log.
_SECTIONS = {
    "odometry": ("ranging", "echoes"),
    "ranges": ("ranging",),
    "constants": ("ranging",),
    "fixes": ("tracking",),
    "process": ("tracking",),
    "interval": ("tracking",),
    "sonar": ("echoes",),
    "slave": ("echoes",),
    "masters": ("echoes",),
    "slat": ("echoes",),
}


@dataclass(frozen=True)
class Checked:
    """A log that was checked.

    Attributes
    ----------
    name : str
        Name of the log's folder.
    verdict : str
        "sound", "doubtful" or "not_trusted".
    findings : list of Finding
        What is wrong, the worst first.
    files : dict of str to FileSeen
        What is there; those that could be read.
    health : Health or None
        The figures of the innovations; None if no filter could be run.
    """

    name: str
    verdict: Verdict
    findings: list[Finding]
    files: dict[str, FileSeen]
    health: Health | None

    def document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "log": self.name,
            "verdict": self.verdict,
            "findings": [one.document() for one in self.findings],
            "files": {name: seen.document() for name, seen in self.files.items()},
            "health": self.health.document() if self.health else None,
        }


def filter_of(log: LogFolder, settings: Settings, chosen: FilterName | None) -> FilterName:
    """Give the filter: that which is chosen, that of the settings, or that which fits the log."""
    fits: FilterName = "ukf" if log.tracking else "robust-ekf"
    return chosen or settings.filter.kind or ("slatf-joint" if log.echoing else fits)


def limits(settings: Settings) -> Limits:
    """Give what the survey of the files asks of the settings."""
    return Limits(
        gap_s=settings.odometry.gap_s,
        reorder_s=settings.log.reorder_s,
        max_step_s=settings.odometry.max_step_s,
    )


def files(log: LogFolder, settings: Settings) -> list[Finding]:
    """Say what the files of a log show; end where a replay cannot be right.

    Raises
    ------
    LogError
        If a file cannot be read, or a replay is refused (:meth:`auvest.logs.check.Survey.refuse`).
    """
    asked = limits(settings)
    seen = survey(log, asked)
    seen.refuse(log, asked)
    return [*seen.findings, *_idle(log, settings)]


def _idle(log: LogFolder, settings: Settings) -> Iterator[Finding]:
    """Name what was set, and is for the other kind of log."""
    kind = "echoes" if log.echoing else "tracking" if log.tracking else "ranging"
    default = Settings()
    for name, kinds in _SECTIONS.items():
        if kind not in kinds and getattr(settings, name) != getattr(default, name):
            message = (
                f"[{name}] of the settings is of no use here: it is for logs of "
                f"{' and '.join(kinds)}"
            )
            yield finding("ignored_settings", message)


def innovations(
    log: LogFolder,
    settings: Settings,
    filter_name: FilterName,
    residuals: Residuals,
    found: list[Finding],
    *,
    causes: bool = True,
) -> list[Finding]:
    """Say what a replay left, and why.

    Where the files have shown already what is wrong, the start was not found, or masters move as
    nobody knows, no other cause is looked for.
    """
    lost = start_findings(residuals)
    shown = [*lost, *findings(residuals)]
    if log.echoing or not causes or worst(one.verdict for one in [*found, *lost]) != "sound":
        return shown
    named = diagnosis.diagnose(log, settings, filter_name, gross=bool(shown))
    if not named:
        return [_with_causes(shown[0])] if len(shown) == 1 else shown
    # It explains why measurements do not fit, and why one source has more of it than others.
    explained = [one for one in shown if one.cause in ("innovations", "source_off", "start_off")]
    gravest = worst([named[0].verdict, *(one.verdict for one in explained)])
    named[0] = replace(named[0], verdict=gravest)
    return [*named, *(one for one in shown if one not in explained)]


def _with_causes(alone: Finding) -> Finding:
    """Say what may lie behind recoveries that nothing else explains."""
    if alone.cause != "recoveries":
        return alone
    causes = "a range scale, a wrong survey or sigmas that are too small"
    return replace(alone, message=f"{alone.message}; possible causes: {causes}")


def check(path: Path, settings: Settings, filter_name: FilterName | None = None) -> Checked:
    """Check a log; what cannot be read is a finding, not an error.

    Parameters
    ----------
    path : Path
        The log's folder.
    settings : Settings
        Noise and the rest, as of a replay.
    filter_name : str, optional
        The filter; default: that of the settings, else robust-ekf for ranges and ukf for fixes.
    """
    found: list[Finding] = []
    seen: dict[str, FileSeen] = {}
    left: Residuals | None = None
    try:
        log = LogFolder(path, truth=False, reading=settings.reading)
        shown = survey(log, limits(settings))
        found += [*shown.findings, *_idle(log, settings)]
        seen = shown.files
        if worst(one.verdict for one in found) != "not_trusted":
            shown.refuse(log, limits(settings))
            left = Residuals()
            found += _replayed(log, settings, filter_name, left, found)
    except FilterError as error:
        message = f"the filter cannot do a step: {error}"
        found.append(finding("innovations", message, verdict="not_trusted"))
    except LogError as error:
        if path.is_dir() and not seen:
            found += ignored_files(path, [one.file for one in settings.files.values()])
        found.append(from_error(error))
    found.sort(key=lambda one: -VERDICTS.index(one.verdict))
    verdict = worst(one.verdict for one in found)
    judged = health(left, found) if left is not None else None
    return Checked(path.resolve().name, verdict, found, seen, judged)


def _replayed(
    log: LogFolder,
    settings: Settings,
    filter_name: FilterName | None,
    left: Residuals,
    found: list[Finding],
) -> list[Finding]:
    name = filter_of(log, settings, filter_name)
    local = shifted(log, local_origin(log))
    engine = replay_of(local, settings, name)
    for batch in engine.batches():
        left.add(batch)
    return [*engine.findings(), *innovations(local, settings, name, left, found)]
