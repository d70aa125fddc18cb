"""``auvest compare``: one recorded run through several filters, side by side.

LOG is a folder of CSV files, as for 'auvest replay'. The output folder gets one self-contained HTML
report with all tracks in one map and one set of plots, results.json, and for each filter a folder
with its tables and track. Settings are the same for all filters. With --smooth each goes back over
the log from its end, and has two tracks.

Examples
--------
  auvest compare logs/goats14 --config goats14 --filter ekf --filter robust-ekf

  auvest compare logs/goats14 --config goats14 --filter ekf --filter robust-ekf --smooth

  auvest compare logs/robot1 --filter ekf --filter ukf --filter ckf --json --quiet
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer
from rich.markup import escape

from auvest.commands import log_options, options
from auvest.commands.console import Terminal, shown, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_results, write_text
from auvest.commands.version import version
from auvest.errors import FilterError
from auvest.logs import LogFolder
from auvest.registry import filter_named, replayable
from auvest.replay import Result
from auvest.replay import replay as run_replay
from auvest.replay.config import FilterName

Log = Annotated[Path, typer.Argument(metavar="LOG", help="Folder of a log.", show_default=False)]
Filters = Annotated[
    list[str],
    typer.Option(
        "--filter",
        help=f"A filter, one of {', '.join(replayable())}; again for each of them.",
        metavar="FILTER",
        show_default=False,
    ),
]


def command(
    log: Log,
    filters: Filters,
    config: log_options.Config = None,
    changes: log_options.Set = None,
    kernel: log_options.KernelOption = None,
    smooth: log_options.Smooth = False,
    lag_s: log_options.Lag = None,
    output: options.Output = Path("auvest-output/compare"),
    force: options.Force = False,
    layout: log_options.Layout = False,  # noqa: ARG001 (shown when it is read)
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    log_options.require_smooth(smooth=smooth, lag_s=lag_s)
    log_options.note_unread_settings(terminal, config, [log])
    with terminal.usage_errors():
        names = [cast(FilterName, filter_named(one, replayable()).name) for one in filters]
        if len(filters) < 2 or len(set(filters)) < len(filters):
            raise ValueError("--filter: give two filters or more, each once")
        settings = log_options.settings_of(config, changes, kernel)
        folder = LogFolder(log, reading=settings.reading)
    name = folder.path.resolve().name
    target = terminal.new_folder(output / name, "compare", force=force)
    results: list[Result] = []
    for filter_name in names:
        with (
            terminal.progress(f"{escape(shown(name))}, {filter_name}, bytes") as progress,
            terminal.usage_errors(),
            terminal.writing(target.path),
        ):
            tables = target.part / filter_name
            tables.mkdir()
            try:
                result = run_replay(
                    folder,
                    settings,
                    filter_name=filter_name,
                    folder=tables,
                    progress=progress,
                    smooth=smooth,
                    lag_s=lag_s,
                )
            except FilterError as error:
                terminal.fail(f"{name}, {filter_name}: {error}", ExitCode.FAILED)
        results.append(result)
        if result.interrupted:
            break
    document = {
        "command": "compare",
        "version": version(),
        "log": name,
        "filters": [result.document() for result in results],
    }
    from auvest.replay import report

    with terminal.writing(target.path):
        write_results(target.part, document)
        write_text(target.part / "report.html", report.html(*results))
    interrupted = results[-1].interrupted
    terminal.publish(target, interrupted=interrupted)
    terminal.result_json(document)
    titles = [filter_named(one.filter_name).title for one in results]
    figures = report.side_by_side([report.rows(one) for one in results])
    right = range(1, 1 + len(results))
    terminal.result(table(name, ("quantity", *titles), figures, right=right))
    terminal.result(f"report    {shown(output / name / 'report.html')}")
    terminal.result(f"tables    {shown(output / name)}: a folder for each filter\n")
    for who, found in report.by_filter(titles, [report.warnings(one) for one in results]):
        for warning in found:
            terminal.warn(f"{who or name}: {warning}")
    if interrupted:
        terminal.fail(
            f"interrupted in {results[-1].filter_name}: what was done is written to {output}",
            ExitCode.INTERRUPTED,
        )
