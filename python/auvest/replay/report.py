"""One HTML file with everything about a replay: no network, no script, pictures inside."""

from __future__ import annotations

import base64
import io
from html import escape
from importlib import resources
from typing import Any

from matplotlib import rc_context

from auvest.replay import tables
from auvest.replay.figures import figures
from auvest.replay.health import Health
from auvest.replay.run import Result


def html(result: Result) -> str:
    """Make the page of a replay."""
    pictures = "\n".join(
        f'<h2>{escape(title)}</h2>\n<img alt="{escape(title)}" src="{_svg(figure)}">'
        for title, figure in figures(result).items()
    )
    settings = [
        (f"[{section}] {key}", str(value))
        for section, values in result.document()["settings"].items()
        for key, value in values.items()
        if value is not None
    ]
    # The page's policy lets it load nothing but the pictures that are in it.
    template = resources.files("auvest.replay").joinpath("report.html")
    return template.read_text(encoding="utf-8").format(
        title=escape(f"{result.name}: replay with {result.filter_name}"),
        warnings="\n".join(f'<p class="warning">{escape(text)}</p>' for text in warnings(result)),
        numbers=_table(rows(result)),
        verdict=escape(result.health.verdict.replace("_", " ")),
        reason=escape(result.health.reason),
        health=_table(
            [*sources(result.health), ("not to be trusted", untrusted(result.health) or "nothing")]
        ),
        pictures=pictures,
        settings=_table(settings),
    )


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
        ("start", _start(n)),
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
        ("held-out measurements, RMSE", _metres(n["held_out_rmse_m"])),
        ("NIS, mean", _nis(n)),
        ("NIS within three sigma, mean", _nis_within(health)),
        ("measurements beyond three sigma", _share(health.beyond_share)),
    ]
    return [(name, text) for name, text in made if text]


def _start(numbers: dict[str, Any]) -> str:
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


def _metres(value: float | None) -> str:
    return "" if value is None else f"{value:.3f} m"


def _share(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.1f} %"


def _nis(numbers: dict[str, Any]) -> str:
    if numbers["nis_mean"] is None:
        return ""
    low, high = numbers["nis_bounds_95"]
    return f"{numbers['nis_mean']:.3f} (consistent: {low:.3f} to {high:.3f})"


def _nis_within(health: Health) -> str:
    if health.nis_mean is None or health.nis_bounds_95 is None:
        return ""
    low, high = health.nis_bounds_95
    return f"{health.nis_mean:.3f} (consistent: {low:.3f} to {high:.3f})"


def sources(health: Health) -> list[tuple[str, str]]:
    """Give what each source's ranges left, in words."""
    return [
        (
            f"source {one.source}",
            f"{one.measurements} measurements, {100 * one.beyond_share:.0f} % beyond three sigma, "
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


def _table(lines: list[tuple[str, str]]) -> str:
    cells = (
        f'<tr><th>{escape(name)}</th><td class="number">{escape(text)}</td></tr>'
        for name, text in lines
    )
    return "<table>\n" + "\n".join(cells) + "\n</table>"


def _svg(figure: Any) -> str:
    buffer = io.StringIO()
    with rc_context({"svg.hashsalt": "auvest"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    data = base64.b64encode(buffer.getvalue().encode()).decode()
    return f"data:image/svg+xml;base64,{data}"
