"""``auvest reproduce mekf``: the M-estimation EKF paper beside what we measure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import save_figures, write_page
from auvest.commands.version import version
from auvest.reproduce import mekf, mekf_page

HELP = """\
Range-only cooperative localisation with outliers: EKF, IGG, Huber and Hampel over contamination,
message timing and kinds of noise; consistency; lock-out. Writes the figures as PNG and CSV, a page
README.md and results.json.

Examples:

  auvest reproduce mekf

  auvest reproduce mekf --runs 10 --output results

  auvest reproduce mekf --json --quiet | jq .contamination
"""


def command(
    runs: Annotated[
        int, typer.Option("--runs", min=2, max=500, help="Monte Carlo runs of each world.")
    ] = mekf.DEFAULT_RUNS,
    seed: options.Seed = mekf.DEFAULT_SEED,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/reproduce-mekf"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Reproduce; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    terminal.make_folder(output)
    done: list[Path] = []
    try:
        with terminal.progress("experiments") as progress, terminal.usage_errors():
            result = mekf.measure(runs=runs, seed=seed, workers=workers, progress=progress)
        claims = mekf_page.claims(result)
        document = {
            "command": "reproduce mekf",
            "version": version(),
            **mekf.summary(result),
            "claims": [claim.as_dict() for claim in claims],
        }
        with terminal.writing(output):
            write_page(output, document, mekf.tables(result), mekf_page.page(result), done)
        with terminal.progress("figures") as progress, terminal.writing(output):
            draw_figures(output, result, progress, done)
    except KeyboardInterrupt:
        terminal.fail(
            f"interrupted: {len(done)} files are written to {output}", ExitCode.INTERRUPTED
        )
    terminal.result_json(document)
    terminal.result(_claims(claims))
    terminal.result(_kernels(result))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"figures   {output / 'fig05.png'}, fig06.png, kernels.png, consistency.png")
    terminal.result(f"results   {output / 'results.json'}")
    if result.failed_runs:
        terminal.fail(f"{result.failed_runs} runs failed; numbers are missing", ExitCode.FAILED)


def draw_figures(
    folder: Path,
    result: mekf.Reproduction,
    progress: console.ProgressCallback,
    done: list[Path],
) -> None:
    """Write the PNG files."""
    from auvest.reproduce import mekf_figures  # here, because matplotlib takes long to import

    save_figures(folder, mekf_figures.FIGURES, result, progress, done)


def _claims(claims: list[mekf_page.Claim]) -> Table:
    table = Table(title="Claims and targets", title_justify="left", title_style="bold")
    for title in ("where", "claim", "measured", ""):
        table.add_column(title)
    for claim in claims:
        table.add_row(claim.where, claim.claim, claim.measured, claim.verdict)
    return table


def _kernels(result: mekf.Reproduction) -> Table:
    table = Table(title="RMSE / m over contamination", title_justify="left", title_style="bold")
    table.add_column("outliers")
    for name in mekf.KERNELS:
        table.add_column(name, justify="right")
    for (fraction, sigma), row in result.contamination.items():
        cells = [f"{row[n].rmse_m:.3f} ± {row[n].standard_error_m:.3f}" for n in mekf.KERNELS]
        table.add_row(f"{100 * fraction:g} % at {sigma:g} m", *cells)
    return table
