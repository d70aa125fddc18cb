"""``auvest sweep``: a grid or list of parameters over a scenario or a log, on all cores.

CONFIG.toml says what is swept: docs/sweeps.md. Every finished task is a Parquet file in DIR/parts,
named by what it depends on. What is there is not computed again: the same command goes on after a
stop, adds the points that are new in CONFIG.toml, and merges what several jobs have computed.

Examples
--------
  auvest sweep noise.toml

  auvest sweep noise.toml --part 2/8 --output /shared/noise --quiet

  auvest sweep noise.toml --scheduler tcp://head:8786 --json > noise.json
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from auvest import montecarlo
from auvest._outputs import OutputError
from auvest._texts import counted
from auvest.commands import options
from auvest.commands.console import Terminal, table
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_results
from auvest.commands.version import version
from auvest.errors import SweepError
from auvest.sweeps.dask import Dask
from auvest.sweeps.result import SweepResult, level
from auvest.sweeps.run import Executor, sweep

#: Points that the terminal shows.
_MOST_LINES = 100


def _part(text: str | None) -> str | None:
    if text is not None and not re.fullmatch(r"[0-9]+/[0-9]+", text):
        raise typer.BadParameter(f"{text} is not I/N, as 2/8.")
    return text


def command(
    config: Annotated[
        Path,
        typer.Argument(metavar="CONFIG.toml", help="What is swept.", show_default=False),
    ],
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            min=1,
            max=256,
            help="Processes on this machine.",
            show_default="one per processor",
        ),
    ] = None,
    part: Annotated[
        str | None,
        typer.Option(
            "--part",
            metavar="I/N",
            callback=_part,
            help="Compute only the I-th of N parts, for an array of jobs with one --output.",
            show_default="all",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="tcp://HOST:PORT",
            help="Compute on the workers of this Dask cluster (auvest[dask]).",
            show_default="this machine",
        ),
    ] = None,
    measure: Annotated[
        str | None,
        typer.Option(
            "--measure",
            help="Column of the figures.",
            show_default="that of CONFIG, else the first",
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("--output", file_okay=False, help="Folder of the sweep: it grows."),
    ] = Path("auvest-output/sweep"),
    no_figure: options.NoFigure = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Sweep; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if scheduler is not None and workers is not None:
        raise typer.BadParameter("give one of the two.", param_hint="'--scheduler' / '--workers'")
    executor: Executor | None = None
    if scheduler is not None:
        executor = Dask(scheduler, warn=terminal.warn)
    number, _, count = (part or "1/1").partition("/")
    interrupted = False
    with terminal.progress("tasks") as progress, terminal.writing(output):
        try:
            result = sweep(
                config,
                output=output,
                workers=workers,
                part=(int(number), int(count)),
                executor=executor,
                progress=progress,
            )
        except OutputError as error:
            terminal.fail(f"--output: {error}", ExitCode.USAGE)
        except (ValueError, TypeError) as error:
            terminal.fail(str(error), ExitCode.USAGE)
        except SweepError as error:
            terminal.fail(f"{error}; what was done is kept in {output}", ExitCode.FAILED)
        except montecarlo.Interrupted as stop:
            interrupted, result = True, stop.partial
    with terminal.usage_errors():
        if measure is not None:
            result = result.showing(measure)
        shown = result.measure
    with terminal.writing(output):
        files = _write(output, result, no_figure=no_figure)
    document = {
        "command": "sweep",
        "version": version(),
        "scenario": result.plan.scenario,
        "axes": list(result.plan.axes),
        "runs": result.plan.runs,
        "seed": result.plan.seed,
        "complete": result.complete,
        "tasks": len(result.plan.tasks),
        "missing_tasks": result.missing,
        "computed_tasks": result.computed,
        "digest": result.digest(),
        "measure": shown,
        "points": result.table(),
        "files": {name: str(path) for name, path in files.items()},
    }
    with terminal.writing(output):
        files["results"] = write_results(output, document)
    terminal.result_json(document)
    terminal.result(_table(result))
    terminal.files({**files, "parts": output / "parts"})
    if interrupted:
        terminal.fail("interrupted: the same command goes on from there", ExitCode.INTERRUPTED)
    if not result.complete:
        terminal.warn(
            f"{result.missing} of {len(result.plan.tasks)} tasks are not computed yet: those of "
            "other parts; the command without --part computes what is missing"
        )


def _write(output: Path, result: SweepResult, *, no_figure: bool) -> dict[str, Path]:
    files: dict[str, Path] = {}
    lines = result.table()
    columns = {name: np.array([line[name] for line in lines]) for name in lines[0]}
    files["table"] = montecarlo.write_table(output / "table.csv", columns)
    if no_figure or not result.measures:
        return files
    from auvest import plots  # here, because matplotlib takes long to import
    from auvest.sweeps import figures

    drawn: dict[str, Any] = {"profiles": figures.profiles}
    if len(figures.axes_of(result)) > 1:
        drawn["heat_map"] = figures.heat_map
    with plots.own_style():
        for name, draw in drawn.items():
            figure = draw(result)
            files[name] = plots.save(figure, output / f"{name}.png")
            plots.save(figure, output / f"{name}.svg")
    return files


def _table(result: SweepResult) -> Table:
    plan = result.plan
    axes = list(plan.axes)
    rows = []
    unknown = np.full(len(plan.points), np.nan)
    mean, error = result.values(result.measure) if result.measures else (unknown, unknown)
    for number, line in enumerate(result.table()[:_MOST_LINES]):
        cells = [level(plan.points[number], axis) for axis in axes]
        value = ""
        if np.isfinite(mean[number]):
            value = f"{mean[number]:.4g}"
            if np.isfinite(error[number]):
                value += f" ± {error[number]:.2g}"
        rows.append((*cells, str(line["runs"]), str(line["failed_runs"]), value))
    more = len(plan.points) - len(rows)
    title = (
        f"{plan.scenario}: {counted(len(plan.points), 'point')} of {counted(plan.runs, 'run')}, "
        f"seed {plan.seed}" + (f"; the first {len(rows)}, the rest is in table.csv" if more else "")
    )
    names = (*axes, "runs", "failed", result.measure)
    return table(title, names, rows, right=range(len(axes), len(names)))
