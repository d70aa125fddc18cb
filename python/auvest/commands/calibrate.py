"""``auvest calibrate``: noises of the settings from logs alone.

LOG is a folder of CSV files, as for 'auvest replay'; several are of one craft, or of some like it,
and get one set of noises. The log is replayed some 200 times, and those noises are taken under
which its innovations are likeliest, raised as far as what hangs together in them demands. No truth
is looked at. settings.toml in the output folder has them with all else that --config says:
'auvest replay LOG --config auvest-output/calibrate/settings.toml'. Noises that are 0 stay 0, and
what is known of the start stays, too. After Ctrl-C the same command goes on where it was.

Examples
--------
  auvest calibrate my_log --config my_log/auvest.toml

  auvest calibrate logs/robot1 logs/robot2 --config mrclam6 --json --quiet | jq .results.noises
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.table import Table

from auvest import montecarlo
from auvest.commands import log_options, options
from auvest.commands.console import Terminal, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_text
from auvest.commands.session import Session
from auvest.commands.version import version
from auvest.errors import FilterError
from auvest.logs import LogFolder
from auvest.replay.calibration import Calibrated, Calibration, calibrate
from auvest.replay.diagnosis import OUTLIERS
from auvest.replay.toml import SCHEMA_LINE, settings_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Outliers = Annotated[
    float,
    typer.Option(
        "--outliers",
        callback=options.open_unit,
        help="Share of outliers among the measurements.",
        metavar="SHARE",
    ),
]


def command(
    logs: log_options.Logs,
    filter_name: log_options.Filter = None,
    config: log_options.Config = None,
    changes: log_options.Set = None,
    kernel: log_options.KernelOption = None,
    outliers: Outliers = OUTLIERS,
    output: options.Output = Path("auvest-output/calibrate"),
    no_figure: options.NoFigure = False,
    force: options.Force = False,
    layout: log_options.Layout = False,  # noqa: ARG001 (shown when it is read)
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Calibrate; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    log_options.note_unread_settings(terminal, config, logs)
    with terminal.usage_errors():
        settings = log_options.settings_of(config, changes, kernel)
        folders = [LogFolder(path, reading=settings.reading) for path in logs]
    head = {
        "logs": [str(path) for path in logs],
        "filter": filter_name,
        "outliers": outliers,
        "settings": asdict(settings),
    }
    session = Session(terminal, output, "calibrate", head, force=force)
    store = output.with_name(f"{output.name}.runs")
    with terminal.writing(store), terminal.usage_errors():
        kept = montecarlo.Store(store, {**head, "version": version(), "files": _files(folders)})
        try:
            found = session.run_some(
                calibrate,
                folders,
                settings,
                what="replays",
                filter_name=filter_name,
                outliers=outliers,
                store=kept,
            )
        except FilterError as error:
            terminal.fail(str(error), ExitCode.FAILED)
    if found is None:
        terminal.fail(
            "interrupted: the replays that are done are kept; the same command goes on from there",
            ExitCode.INTERRUPTED,
        )
    with terminal.writing(output):
        session.add("settings", write_text(session.part / "settings.toml", text(found, folders)))
    session.write_csv("profiles", profiles(found))
    if not no_figure:
        session.draw(_figure, found)
    results = {**found.document(), "settings": asdict(found.settings)}
    session.report(results, _table(found))
    montecarlo.discard(store)


def _files(folders: list[LogFolder]) -> list[Any]:
    """Say which files the logs have, so that those of changed ones are computed anew."""
    return [
        (name, one.path.stat().st_size, one.path.stat().st_mtime_ns)
        for folder in folders
        for name, one in folder.tables.items()
    ]


def text(found: Calibration, folders: list[LogFolder]) -> str:
    """Write the settings, with what is known of each noise behind it."""
    names = ", ".join(folder.path.resolve().name for folder in folders)
    lines = [
        SCHEMA_LINE,
        "# Written by auvest calibrate: noises from the innovations of",
        f"# {''.join(one if one.isprintable() else '?' for one in names)}",
        f"# with {found.filter_name}, {found.measurements} measurements. All are "
        f"{found.raised:.3g} times the likeliest (densities its square):",
        f"# the measurements tell as much as {found.measurements / found.correlation:.0f} "
        "independent ones.",
    ]
    about = {one.name: f"was {one.before:g}; {_told(one)}" for one in found.noises}
    return "\n".join(lines) + "\n" + settings_text(found.settings, about)


def _told(one: Calibrated) -> str:
    """Say what the log tells of a noise."""
    low = "" if one.low is None else f"{one.low:.2g}"
    high = "" if one.high is None else f"{one.high:.2g}"
    if low and high:
        return f"the log tells {low} to {high}"
    if high:
        return f"the log tells less than {high}"
    return f"the log tells more than {low}" if low else "the log does not tell it"


def _table(found: Calibration) -> Table:
    rows = [
        (one.name, *(f"{value:.3g}" for value in (one.before, one.likeliest, one.value)),
         *("" if value is None else f"{value:.2g}" for value in (one.low, one.high)))
        for one in found.noises
    ]  # fmt: skip
    fit = (found.log_likelihood_before, found.log_likelihood)
    rows.append(("log likelihood", *(f"{value:.1f}" for value in fit), "", "", ""))
    independent = found.measurements / found.correlation
    title = (
        f"{found.filter_name}, {found.replays} replays; {found.measurements} measurements, as "
        f"{independent:.0f} independent ones; sigmas {found.raised:.3g} times the likeliest"
    )
    header = ("noise", "before", "likeliest", "to use", "told from", "to")
    return table(title, header, rows, right=range(1, len(header)))


def profiles(found: Calibration) -> dict[str, Any]:
    """Give values of each noise, and the log likelihood there less its maximum, as columns."""
    columns: dict[str, Any] = {}
    for one in found.noises:
        value, less = np.array(one.profile).T
        columns |= {one.name: value, f"{one.name}.log_likelihood": less}
    return columns


def _figure(found: Calibration) -> Figure:
    from auvest import plots  # here, because matplotlib takes long to import

    count = len(found.noises)
    title = "Log likelihood / nats along each noise, the others as found"
    figure = plots.new_figure((3.2 * count, 3.4), title)
    panels = figure.subplots(1, count, squeeze=False)[0]
    for one, axes in zip(found.noises, panels, strict=True):
        value, less = np.array(one.profile).T
        axes.plot(value, less, ".-", color=plots.BLUE)
        bar = {"color": plots.BLACK, "linewidth": 0.8, "linestyle": "--"}
        axes.axhline(-found.refused, label="refused below", **bar)
        axes.axvline(one.before, color=plots.GREY, linewidth=1.0, linestyle=":", label="before")
        axes.axvline(one.value, color=plots.VERMILION, linewidth=1.2, label="to use")
        reach = (-6 * found.refused, 0.5 * found.refused)
        plots.style(axes, xlabel=one.name, xscale="log", ylim=reach)
    plots.legend_below(figure, panels[0], 3)
    return figure
