"""``auvest replay``: recorded runs through a filter, with tables, a figure and a report of each.

A LOG is a folder of CSV files, as docs/logs.md describes it and 'auvest import' makes it. For each
the output folder gets a folder with the estimates, measurements and errors as CSV and Parquet, the
track as TUM text, a figure, one self-contained HTML report and results.json.

The log is checked on the way as 'auvest check' does it, and the result has a verdict: sound,
doubtful or not to be trusted, with the reason; no truth is looked at for it.

Examples
--------
  auvest import goats14 data/goats14 logs

  auvest replay logs/goats14 --config goats14

  auvest replay logs/goats14 --config goats14 --kernel huber --set ranges.sigma_m=2.5

  auvest replay logs/robot* --filter ekf --json --quiet | jq '.logs[].rmse_m'
"""

from __future__ import annotations

from pathlib import Path

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


def command(
    logs: log_options.Logs,
    filter_name: log_options.Filter = None,
    config: log_options.Config = None,
    changes: log_options.Set = None,
    kernel: log_options.KernelOption = None,
    output: options.Output = Path("auvest-output/replay"),
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Replay; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
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
                    folder, settings, filter_name=filter_name, folder=target.part, progress=progress
                )
            except FilterError as error:
                terminal.fail(f"{name}: {error}", ExitCode.FAILED)
        results.append(result)
        with terminal.writing(target.path):
            _write(target.part, result)
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
        _show(terminal, result, output / result.name)
    if interrupted:
        terminal.fail(
            f"interrupted in {results[-1].name}: what was done is written to {output}",
            ExitCode.INTERRUPTED,
        )


def _write(folder: Path, result: Result) -> None:
    """Write results.json, the figure and the report."""
    from auvest import plots  # here, because matplotlib takes long to import
    from auvest.replay import figures, report

    write_results(folder, result.document())
    with plots.own_style():
        plots.save(figures.overview(result), folder / "figure.png")
        write_text(folder / "report.html", report.html(result))


def _show(terminal: Terminal, result: Result, folder: Path) -> None:
    from auvest.replay import report

    title = f"{result.name}, {result.filter_name}"
    terminal.result(table(title, ("quantity", "value"), report.rows(result), right={1}))
    terminal.result(f"report    {shown(folder / 'report.html')}")
    terminal.result(
        f"tables    {shown(folder)}: estimates, measurements, errors as .csv and .parquet"
    )
    terminal.result(f"track     {shown(folder / 'trajectory.tum')}\n")
    for warning in report.warnings(result):
        terminal.warn(f"{result.name}: {warning}")
