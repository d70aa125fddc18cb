"""``auvest replay``: recorded runs through a filter, with tables, a figure and a report of each.

A LOG is a folder of CSV files, as --layout shows it and 'auvest import' makes it. For each the
output folder gets a folder with the estimates, measurements and errors as Parquet, the track as
TUM text, a figure, one self-contained HTML report and results.json. --write says which of them,
--format csv how tables are written; --every 1 writes one estimate a second. A log of echoes also
gets the masters that were tracked.

The log is checked on the way as 'auvest check' does it, and the result has a verdict: sound,
doubtful or not to be trusted, with the reason; no truth is looked at for it.

With --smooth it goes back over the log from its end: tables, figures and report then have two
tracks, that of the filter and the smoothed one, and smoothed.tum is the other as TUM text. --lag is
what a craft would know so much later on the way.

Examples
--------
  auvest import goats14 data/goats14 logs

  auvest replay logs/goats14 --config goats14

  auvest replay logs/goats14 --config goats14 --kernel huber --set ranges.sigma_m=2.5

  auvest replay logs/goats14 --config goats14 --smooth

  auvest replay logs/robot* --filter ekf --json --quiet | jq '.logs[].rmse_m'

  auvest replay logs/day --write estimates,errors --format csv --every 1
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.markup import escape

from auvest.commands import log_options, options
from auvest.commands.console import Terminal, shown, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_results, write_text
from auvest.commands.version import version
from auvest.errors import FilterError
from auvest.logs import LogFolder
from auvest.replay import Result
from auvest.replay import replay as run_replay
from auvest.replay.run import FORMATS, PAGES, TABLES, WRITTEN

_ALL = ",".join(WRITTEN)
Write = Annotated[
    str,
    typer.Option(
        "--write", help=f"What is written beside results.json: {', '.join(WRITTEN)}.",
        metavar="LIST", show_default="all",
    ),
]  # fmt: skip
Format = Annotated[
    Literal["parquet", "csv", "both"], typer.Option("--format", help="How tables are written.")
]
Every = Annotated[
    float,
    typer.Option(
        "--every", help="One row in so many seconds of estimates, errors, masters and tracks.",
        metavar="S", callback=options.not_negative, show_default="all",
    ),
]  # fmt: skip


def command(
    logs: log_options.Logs,
    filter_name: log_options.Filter = None,
    config: log_options.Config = None,
    changes: log_options.Set = None,
    kernel: log_options.KernelOption = None,
    smooth: log_options.Smooth = False,
    lag_s: log_options.Lag = None,
    write: Write = _ALL,
    kind: Format = "parquet",
    every_s: Every = 0.0,
    strict: log_options.Strict = False,
    output: options.Output = Path("auvest-output/replay"),
    force: options.Force = False,
    layout: log_options.Layout = False,  # noqa: ARG001 (shown when it is read)
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Replay; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    log_options.require_smooth(smooth=smooth, lag_s=lag_s)
    wanted = [word.strip() for word in write.split(",")]
    for word in wanted:
        if word not in WRITTEN:
            message = f"{word!r} is not one of {', '.join(WRITTEN)}."
            raise typer.BadParameter(message, param_hint="'--write'")
    formats = FORMATS if kind == "both" else (kind,)
    log_options.note_unread_settings(terminal, config, logs)
    with terminal.usage_errors():
        settings = log_options.settings_of(config, changes, kernel)
        folders = [LogFolder(path, reading=settings.reading) for path in logs]
        names = [folder.path.resolve().name for folder in folders]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"LOG: two logs have the name {name}, and so would their results")
    targets = [terminal.new_folder(output / name, "replay", force=force) for name in names]
    results: list[Result] = []
    for folder, name, target in zip(folders, names, targets, strict=True):
        with (
            terminal.progress(f"{escape(shown(name))}, bytes") as progress,
            terminal.usage_errors(),
            terminal.writing(target.path),
        ):
            try:
                result = run_replay(
                    folder,
                    settings,
                    filter_name=filter_name,
                    folder=target.part,
                    progress=progress,
                    smooth=smooth,
                    lag_s=lag_s,
                    write=wanted,
                    formats=formats,
                    every_s=every_s,
                )
            except FilterError as error:
                terminal.fail(f"{name}: {error}", ExitCode.FAILED)
        results.append(result)
        with terminal.writing(target.path):
            _write(target.part, result, wanted)
        terminal.publish(target, interrupted=result.interrupted)
        if result.interrupted:
            break
    interrupted = results[-1].interrupted
    document = {
        "command": "replay",
        "version": version(),
        "logs": [result.document() for result in results],
    }
    terminal.result_json(document)
    for result in results:
        _show(terminal, result, output / result.name, wanted, formats)
    if interrupted:
        terminal.fail(
            f"interrupted in {results[-1].name}: what was done is written to {output}",
            ExitCode.INTERRUPTED,
        )
    if strict:
        log_options.require_sound(terminal, ((one.name, one.health.verdict) for one in results))


def _write(folder: Path, result: Result, wanted: list[str]) -> None:
    """Write results.json, the figure and the report."""
    write_results(folder, result.document())
    if not {*wanted} & {*PAGES}:
        return
    from auvest import plots  # here, because matplotlib takes long to import
    from auvest.replay import figures, report

    with plots.own_style():
        if "figure" in wanted:
            plots.save(figures.overview(result), folder / "figure.png")
        if "report" in wanted:
            write_text(folder / "report.html", report.html(result))


def _show(
    terminal: Terminal, result: Result, folder: Path, wanted: list[str], formats: Collection[str]
) -> None:
    from auvest.replay import report

    title = f"{result.name}, {result.filter_name}"
    terminal.result(table(title, ("quantity", "value"), report.rows(result), right={1}))
    if "figure" in wanted:
        terminal.result(f"figure    {shown(folder / 'figure.png')}")
    if "report" in wanted:
        terminal.result(f"report    {shown(folder / 'report.html')}")
    made = [name for name in TABLES if any((folder / f"{name}.{one}").exists() for one in formats)]
    if made:
        kinds = " and ".join(f".{one}" for one in formats)
        terminal.result(f"tables    {shown(folder)}: {', '.join(made)} as {kinds}")
    if "tracks" in wanted:
        terminal.result(f"track     {shown(folder / 'trajectory.tum')}")
    if "smoothed" in result.numbers and "tracks" in wanted:
        terminal.result(f"smoothed  {shown(folder / 'smoothed.tum')}")
    terminal.result("")
    for warning in report.warnings(result):
        terminal.warn(f"{result.name}: {warning}")
