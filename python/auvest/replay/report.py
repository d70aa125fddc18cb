"""One HTML file with everything about a replay, or several of one log: a map and plots to explore.

It needs no network: script and style are in it, and its own policy lets it load nothing and run
nothing but that script.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from html import escape
from importlib import resources
from typing import Any

from auvest._texts import beside, counted
from auvest.registry import filter_named
from auvest.replay import drawing, tables
from auvest.replay.constants import Found
from auvest.replay.health import Health
from auvest.replay.run import Result


def html(*results: Result) -> str:
    """Make the page of a replay, or of several of one log, side by side."""
    first = results[0]
    names = [filter_named(one.filter_name).title for one in results]
    alone = len(results) == 1
    script = _text("report.js")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    titles = [name if not alone else "" for name in names]
    return _text("report.html").format(
        title=escape(f"{first.name}: replay with {_listed([one.filter_name for one in results])}"),
        digest=f"sha256-{digest}",
        style=_text("report.css"),
        verdicts="\n".join(
            _verdict(one, title) for one, title in zip(results, titles, strict=True)
        ),
        warnings="\n".join(
            f'<p class="warning">{escape(f"{title}: {text}" if title else text)}</p>'
            for title, found in by_filter(titles, [_beside_verdict(one) for one in results])
            for text in found
        ),
        numbers=columns_table(names, [rows(one) for one in results]),
        health="\n".join(
            (f"<h3>{escape(title)}</h3>\n" if title else "") + _health(one)
            for one, title in zip(results, titles, strict=True)
        ),
        settings=f'<div id="settings">{_table(_settings(first))}</div>',
        thinned=escape(thinned(results)),
        # No end of the element that it is in can stand in it.
        data=json.dumps(drawing.document(results), allow_nan=False).replace("<", "\\u003c"),
        script=script,
    )


def thinned(results: Sequence[Result]) -> str:
    """Say how much of the tables the plots show."""
    kinds = ("estimates", "measurements", "errors")
    strides = {kind: max(getattr(one, kind).stride for one in results) for kind in kinds}
    parts = [f"one row in {stride} of {kind}" for kind, stride in strides.items() if stride > 1]
    return f"Drawn: {_listed(parts)}; the tables have all." if parts else ""


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def by_filter(titles: Sequence[str], found: Sequence[list[str]]) -> list[tuple[str, list[str]]]:
    """Put what is said of all filters first, once."""
    if len(found) == 1:
        return [("", found[0])]
    common = [text for text in found[0] if all(text in other for other in found[1:])]
    own = [[text for text in texts if text not in common] for texts in found]
    return [("", common), *zip(titles, own, strict=True)]


def _verdict(result: Result, title: str) -> str:
    health = result.health
    words = health.verdict.replace("_", " ")
    who = f"{escape(title)}: " if title else ""
    return (
        f'<p>{who}<span class="verdict {health.verdict}">{escape(words)}</span>'
        f"{escape(health.reason)}.</p>"
    )


def _beside_verdict(result: Result) -> list[str]:
    """Give the warnings without the one that the verdict has said."""
    return [text for text in warnings(result) if not text.endswith(f": {result.health.reason}.")]


def _health(result: Result) -> str:
    lines = [
        *sources(result.health),
        ("not to be trusted", untrusted(result.health) or "nothing"),
    ]
    return f'<div class="scroll words">{_table(lines)}</div>'


def _settings(result: Result) -> list[tuple[str, str]]:
    return [
        (f"[{section}] {key}", str(value))
        for section, values in result.document()["settings"].items()
        for key, value in values.items()
        if value not in (None, {})
    ]


def warnings(result: Result) -> list[str]:
    """Say what is wrong with the log, what of it was not used, and why."""
    found = ["The run was interrupted; this is what was done until then."] * result.interrupted
    if result.health.verdict != "sound":
        words = result.health.verdict.replace("_", " ").upper()
        found.append(f"{words}: {result.health.reason}.")
    found += [
        f"{one.cause}: {one.text}." for one in result.findings if one.text != result.health.reason
    ]
    for name, late in result.numbers["late"].items():
        if late["dropped"]:
            lines = ", ".join(map(str, late["lines"]))
            more = " ..." if late["dropped"] > len(late["lines"]) else ""
            found.append(
                f"{name}: {late['dropped']} not used, later than the window of "
                f"{result.settings.log.reorder_s:g} s allows (line {lines}{more})."
            )
    reasons = {
        tables.BEFORE_START: "taken before the start of the run",
        tables.AFTER_END: "taken after the last line of the odometry",
        tables.NO_POSITION: "the position of the source is not known at that time",
        tables.TOO_SHORT: "the range is shorter than the difference in depth",
    }
    for outcome, reason in reasons.items():
        count = result.numbers[outcome.replace(" ", "_")]
        if count:
            found.append(f"Measurements: {count} not used, {reason}.")
    return found


def rows(result: Result) -> list[tuple[str, str]]:
    """Give the figures of the run, in words and with units, for tables."""
    n, health = result.numbers, result.health
    made = [
        ("verdict", health.verdict.replace("_", " ")),
        ("time", f"{n['first_s']:.1f} to {n['last_s']:.1f} s"),
        ("measurements", f"{n['measurements']}"),
        *((outcome, f"{n[outcome.replace(' ', '_')]}") for outcome in tables.OUTCOMES[:4]),
        ("start", _started(n)),
        ("unknown start", _convergence(n)),
        ("recoveries from lock-out", f"{n['recovered']}"),
        ("taken as positions (near field)", f"{n['near_field']}"),
        ("late lines put in order", f"{sum(f['reordered'] for f in n['late'].values())}"),
        ("late lines not used", f"{sum(f['dropped'] for f in n['late'].values())}"),
        ("position RMSE", _metres(n["rmse_m"])),
        ("position RMSE since settled", _metres(n.get("settled_rmse_m"))),
        ("largest error", _metres(n["max_error_m"])),
        ("dead reckoning alone, RMSE", _metres(n["dead_reckoned_rmse_m"])),
        ("truth within 3 sigma", _share(n["inside_3_sigma"])),
        *_smoothed(n),
        *_masters(n),
        *((f"constant {one['name']}", Found(**one).text) for one in n.get("constants", ())),
        ("held-out measurements, RMSE", _metres(n["held_out_rmse_m"])),
        ("NIS, mean, rejected ones too", _nis(n)),
        ("NIS within three sigma, mean", _nis_within(health)),
        ("measurements beyond three sigma", _share(health.beyond_share)),
    ]
    return [(name, text) for name, text in made if text]


def _started(numbers: dict[str, Any]) -> str:
    file = numbers["started_from"]
    if file is None:
        return "the first place that is measured"
    return f"{file}, first line" + (": no start.csv says it" if file == "truth.csv" else "")


def _convergence(numbers: dict[str, Any]) -> str:
    if "convergence" not in numbers:
        return ""
    if numbers["settled_s"] is None:
        return f"{numbers['convergence']} at the end, never settled"
    return f"settled first at {numbers['settled_s']:.1f} s, {numbers['convergence']} at the end"


def _smoothed(numbers: dict[str, Any]) -> list[tuple[str, str]]:
    if "smoothed" not in numbers:
        return []
    own = numbers["smoothed"]
    what = "smoothed" if own["lag_s"] is None else f"smoothed, lag {own['lag_s']:g} s"
    return [
        (f"{what}: position RMSE", _metres(own["rmse_m"])),
        (f"{what}: largest error", _metres(own["max_error_m"])),
        (f"{what}: truth within 3 sigma", _share(own["inside_3_sigma"])),
    ]


def _masters(numbers: dict[str, Any]) -> list[tuple[str, str]]:
    made = []
    for source, own in numbers.get("masters", {}).items():
        made.append((f"master {source}: position RMSE", _metres(own["rmse_m"])))
        made.append(
            (f"master {source}: seen from the slave, RMSE", _metres(own["relative_rmse_m"]))
        )
    return made


def _metres(value: float | None) -> str:
    return "" if value is None else f"{value:.3f} m"


def _share(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.1f} %"


def _nis(numbers: dict[str, Any]) -> str:
    if numbers["nis_mean"] is None:
        return ""
    return _against(numbers["nis_mean"], *numbers["nis_bounds_95"])


def _nis_within(health: Health) -> str:
    if health.nis_mean is None or health.nis_bounds_95 is None:
        return ""
    return _against(health.nis_mean, *health.nis_bounds_95)


def _against(mean: float, low: float, high: float) -> str:
    where = beside(mean, low, high)
    return f"{mean:.3f}, {where} the {low:.3f} to {high:.3f} of a consistent filter"


def sources(health: Health) -> list[tuple[str, str]]:
    """Give what each source's ranges left, in words."""
    return [
        (
            f"source {one.source}",
            f"{counted(one.measurements, 'measurement')}, "
            f"{100 * one.beyond_share:.0f} % beyond three sigma, "
            f"median {one.median_m:+.2f} m, spread {one.spread_m:.2f} m, "
            f"{100 * one.trend:+.2f} % of the range",
        )
        for one in health.sources
    ]


def untrusted(health: Health) -> str:
    """Give the seconds that are not to be trusted, in words."""
    spans = [f"{a:.1f} to {b:.1f} s" for a, b in health.untrusted_s[:10]]
    more = " ..." * (len(health.untrusted_s) > len(spans))
    return ", ".join(spans) + more


def columns_table(names: Sequence[str], columns: Sequence[list[tuple[str, str]]]) -> str:
    """Write the figures of each filter in a column of its own."""
    if len(names) == 1:
        return f'<div class="scroll">{_table(columns[0])}</div>'
    head = "".join(f"<td>{escape(name)}</td>" for name in names)
    body = "\n".join(
        f"<tr><th>{escape(name)}</th>"
        + "".join(f'<td class="number">{escape(cell)}</td>' for cell in cells)
        + "</tr>"
        for name, *cells in side_by_side(columns)
    )
    return (
        f'<div class="scroll"><table>\n<thead><tr><th></th>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody></table></div>"
    )


def side_by_side(columns: Sequence[list[tuple[str, str]]]) -> list[tuple[str, ...]]:
    """Join figures by their names, in the order of the one that has most; "" where one has none."""
    longest = max(columns, key=len)
    names = [name for name, _ in longest]
    names += [name for column in columns for name, _ in column if name not in names]
    known = [dict(column) for column in columns]
    return [(name, *(column.get(name, "") for column in known)) for name in dict.fromkeys(names)]


def _table(lines: list[tuple[str, str]]) -> str:
    cells = (
        f'<tr><th>{escape(name)}</th><td class="number">{escape(text)}</td></tr>'
        for name, text in lines
    )
    return "<table>\n" + "\n".join(cells) + "\n</table>"


def _text(name: str) -> str:
    return resources.files("auvest.replay").joinpath(name).read_text(encoding="utf-8")
