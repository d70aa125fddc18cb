"""``auvest check``: what a log holds, and what may be wrong with it, before it is used.

A LOG is a folder of CSV files; --layout shows which, docs/logs.md has more. They are read for
rates, gaps, units and clocks; then it is replayed, and what the measurements leave is judged: a
compass from another axis, x and y exchanged, a latency, a slant range, a scale, speeds in knots, a
source that stands apart. Each mistake is undone in turn, and the one that makes the measurements
likelier by far is named.

The verdict is sound, doubtful or not_trusted. A truth, if there is one, is not looked at. The words
for causes are those of docs/logs.md. The settings matter: with sigmas that are ten times too small
no log is sound.

Examples
--------
  auvest check logs/goats14 --config goats14

  auvest check my_log --strict --quiet && auvest replay my_log

  auvest check my_log --json | jq '.logs[].findings[] | .cause, .file, .line, .message'
"""

from __future__ import annotations

import math

from rich.table import Table

from auvest._texts import short
from auvest.commands import log_options, options
from auvest.commands.console import Terminal, table
from auvest.commands.version import version
from auvest.logs.check import FileSeen, SourceSeen
from auvest.logs.findings import worst
from auvest.logs.reader import not_a_folder
from auvest.replay.checks import Checked, check


def command(
    logs: log_options.Logs,
    filter_name: log_options.Filter = None,
    config: log_options.Config = None,
    changes: log_options.Set = None,
    strict: log_options.Strict = False,
    layout: log_options.Layout = False,  # noqa: ARG001 (shown when it is read)
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Check; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    log_options.note_unread_settings(terminal, config, logs)
    with terminal.usage_errors():
        settings = log_options.settings_of(config, changes)
        for path in logs:
            if not path.is_dir():
                raise ValueError(f"LOG: {path}: {not_a_folder(path)}")
        checked = [check(path, settings, filter_name) for path in logs]
    terminal.result_json(
        {
            "command": "check",
            "version": version(),
            "verdict": worst(one.verdict for one in checked),
            "findings": [
                {"log": one.name, **each.document()} for one in checked for each in one.findings
            ],
            "logs": [one.document() for one in checked],
        }
    )
    for one in checked:
        _show(terminal, one)
    if strict:
        log_options.require_sound(terminal, ((one.name, one.verdict) for one in checked))


def _show(terminal: Terminal, one: Checked) -> None:
    if one.files:
        terminal.result(_files(one))
    if one.health is not None and one.health.sources:
        terminal.result(_sources(one))
    log_options.show_findings(terminal, one.findings)
    words = one.verdict.replace("_", " ")
    reason = f", {one.health.reason}" if one.verdict == "sound" and one.health else ""
    terminal.result(f"verdict     {words}{reason}\n")


def _files(one: Checked) -> Table:
    rows = [
        (
            name,
            f"{seen.lines}",
            f"{seen.first_s:.10g} to {seen.last_s:.10g}" if seen.lines else "",
            short(seen.usual_step_s) if seen.lines > 1 else "",
            _longest(seen),
        )
        for name, seen in one.files.items()
    ]
    header = ("file", "lines", "time / s", "usual step / s", "longest / s")
    return table(one.name, header, rows, right={1, 3, 4})


def _longest(seen: FileSeen) -> str:
    return f"{short(seen.long[0].length_s)} (line {seen.long[0].line})" if seen.long else ""


def _sources(one: Checked) -> Table:
    assert one.health is not None
    seen: dict[int, SourceSeen] = {}
    for name in ("fixes.csv", "ranges.csv"):
        seen |= one.files[name].sources if name in one.files else {}
    rows = [
        (
            f"{source.source}",
            f"{source.measurements}",
            f"{short(seen[source.source].low_m, 4)} to {short(seen[source.source].high_m, 4)}",
            f"{source.median_m:+.2f}" if math.isfinite(source.median_m) else "",
            f"{source.spread_m:.2f}" if math.isfinite(source.spread_m) else "",
            f"{100 * source.beyond_share:.0f}",
            f"{100 * source.trend:+.2f}" if math.isfinite(source.trend) else "",
        )
        for source in one.health.sources
    ]
    header = (
        "source",
        "used",
        "range / m",
        "median / m",
        "spread / m",
        "> 3 sigma / %",
        "trend / %",
    )
    return table("innovations of range", header, rows, right=set(range(7)))
