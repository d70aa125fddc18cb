"""``auvest reproduce slatf``: the SLATF paper's table, figures and claims beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import save_figures, write_page
from auvest.commands.version import version
from auvest.reproduce import slatf, slatf_page
from auvest.scenarios.paper_aukf import DTypeName
from auvest.scenarios.paper_slatf import FILTERS, FilterName

HELP = """\
Writes each figure as PNG and CSV, a page README.md that sets the paper's table, figures and claims
beside what was measured, with all assumptions, and results.json.

Examples:

  auvest reproduce slatf

  auvest reproduce slatf --runs 200 --output results

  auvest reproduce slatf --json --quiet | jq '.table1[] | [.level, .slatf1, .slatf2]'
"""


def command(
    runs: options.PageRuns = slatf.DEFAULT_RUNS,
    particles: Annotated[
        int, typer.Option(min=1, max=100_000, help="N of SLATF 1.0, 2.0 and joint.")
    ] = slatf.DEFAULT_PARTICLES,
    dtype: Annotated[
        DTypeName,
        typer.Option(help="Precision; float32 gives the bits of the vehicle and is faster."),
    ] = slatf.DEFAULT_DTYPE,
    seed: options.Seed = slatf.DEFAULT_SEED,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/reproduce-slatf"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Reproduce; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    terminal.make_folder(output)
    done: list[Path] = []
    try:
        with terminal.progress("runs") as progress, terminal.usage_errors():
            result = slatf.measure(
                runs=runs,
                particles=particles,
                seed=seed,
                dtype=dtype,
                workers=workers,
                progress=progress,
            )
        document = {
            "command": "reproduce slatf",
            "version": version(),
            **slatf.summary(result),
            "claims": [claim.as_dict() for claim in slatf_page.claims(result)],
        }
        with terminal.writing(output):
            write_page(output, document, slatf.tables(result), slatf_page.page(result), done)
        with terminal.progress("figures") as progress, terminal.writing(output):
            draw_figures(output, result, progress, done)
    except KeyboardInterrupt:
        terminal.fail(
            f"interrupted: {len(done)} files are written to {output}", ExitCode.INTERRUPTED
        )
    terminal.result_json(document)
    terminal.result(_table(document["table1"]))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"figures   {output / 'fig02.png'} to fig06.png, numbers beside them as CSV")
    terminal.result(f"results   {output / 'results.json'}")
    if result.failed_runs:
        terminal.fail(f"{result.failed_runs} runs failed; numbers are missing", ExitCode.FAILED)


def draw_figures(
    folder: Path,
    result: slatf.Reproduction,
    progress: console.ProgressCallback,
    done: list[Path],
) -> None:
    """Write the PNG files."""
    from auvest.reproduce import slatf_figures  # here, because matplotlib takes long to import

    save_figures(folder, slatf_figures.FIGURES, result, progress, done)


#: Short, so that the table fits into 80 columns.
_HEADS: dict[FilterName, str] = {
    "dr": "DR",
    "dr_compensated": "no bias",
    "slatf1": "SLATF 1.0",
    "slatf2": "SLATF 2.0",
    "slatf_joint": "joint",
    "ekf_slat": "EKF",
}


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(
        title=f"RMSE of the slave's position / m, {rows[0]['runs']} runs, "
        f"N = {rows[0]['particles']} (the paper's in brackets)",
        title_justify="left",
        title_style="bold",
    )
    table.add_column("level")
    table.add_column("noise")
    for name in FILTERS:
        table.add_column(_HEADS[name], justify="right", no_wrap=True)
    for row in rows:
        paper = row["paper"] or {}
        cells = (
            f"{row[name]:.1f}" + (f" ({paper[name]:.0f})" if name in paper else "")
            for name in FILTERS
        )
        noise = f"{row['sigma_r']:g} m, {row['sigma_theta']:g}"
        table.add_row(str(row["level"]), noise, *cells)
    return table
