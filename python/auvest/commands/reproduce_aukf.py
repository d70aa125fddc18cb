"""``auvest reproduce aukf``: the AUKF paper's figures and claims beside what we measure."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import save_figures, write_page
from auvest.commands.version import version
from auvest.reproduce import aukf, aukf_page
from auvest.reproduce.claims import Claim

HELP = """\
Writes each figure as PNG and CSV, a page README.md that sets the paper's figures and claims beside
what was measured, with all assumptions and contradictions, and results.json.

Examples:

  auvest reproduce aukf

  auvest reproduce aukf --runs 40 --output results

  auvest reproduce aukf --json --quiet | jq .figure3.interval_s
"""


def command(
    runs: options.PageRuns = aukf.DEFAULT_RUNS,
    seed: options.Seed = aukf.DEFAULT_SEED,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/reproduce-aukf"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Reproduce; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    terminal.make_folder(output)
    done: list[Path] = []
    try:
        with terminal.progress("experiments") as progress, terminal.usage_errors():
            result = aukf.measure(runs=runs, seed=seed, workers=workers, progress=progress)
        claims = aukf_page.claims(result)
        document = {
            "command": "reproduce aukf",
            "version": version(),
            **aukf.summary(result),
            "claims": [claim.as_dict() for claim in claims],
        }
        with terminal.writing(output):
            write_page(output, document, aukf.tables(result), aukf_page.page(result), done)
        with terminal.progress("figures") as progress, terminal.writing(output):
            draw_figures(output, result, progress, done)
    except KeyboardInterrupt:
        terminal.fail(
            f"interrupted: {len(done)} files are written to {output}", ExitCode.INTERRUPTED
        )
    terminal.result_json(document)
    terminal.result(_table(claims))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"figures   {output / 'fig01.png'} to fig10.png, numbers beside them as CSV")
    terminal.result(f"results   {output / 'results.json'}")
    if result.failed_runs:
        terminal.fail(f"{result.failed_runs} runs failed; numbers are missing", ExitCode.FAILED)


def draw_figures(
    folder: Path,
    result: aukf.Reproduction,
    progress: console.ProgressCallback,
    done: list[Path],
) -> None:
    """Write the PNG files."""
    from auvest.reproduce import aukf_figures  # here, because matplotlib takes long to import

    save_figures(folder, aukf_figures.FIGURES, result, progress, done)


def _table(claims: list[Claim]) -> Table:
    table = Table(title="Claims of the paper", title_justify="left", title_style="bold")
    for title in ("where", "the paper", "verdict"):
        table.add_column(title)
    for claim in claims:
        table.add_row(claim.where, claim.paper, claim.verdict)
    return table
