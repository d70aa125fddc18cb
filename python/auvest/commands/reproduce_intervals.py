"""``auvest reproduce intervals``: the interval policies side by side at equal sampling rate."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.reproduce import intervals

HELP = """\
For near and far, straight and turning tracks and three noises: RMSE and time above the error budget
of the covariance budget, the fixed interval and the paper's law. Writes a page README.md, a picture
and results.json.

Examples:

  auvest reproduce intervals

  auvest reproduce intervals --runs 50 --json --quiet | jq '.cases[0]'
"""


def command(
    runs: options.PageRuns = intervals.DEFAULT_RUNS,
    seed: options.Seed = intervals.DEFAULT_SEED,
    workers: options.Workers = None,
    output: options.Output = Path("auvest-output/reproduce-intervals"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    terminal.make_folder(output)
    cases: list[intervals.Case] = []
    points = intervals.points()
    interrupted = False
    try:
        with terminal.progress("points") as progress, terminal.usage_errors():
            for point in points:
                cases.append(intervals.measure_case(*point, runs=runs, seed=seed, workers=workers))
                progress(len(cases), len(points))
    except KeyboardInterrupt:
        interrupted = True
        if not cases:
            terminal.fail("interrupted: nothing was done yet", ExitCode.INTERRUPTED)
    document = {
        "command": "reproduce intervals",
        "version": version(),
        **intervals.summary(cases, runs=runs, seed=seed),
    }
    with terminal.writing(output):
        write_results(output, cases, document, runs=runs, seed=seed)
    if interrupted:
        terminal.fail(
            f"interrupted: {len(cases)} of {len(points)} points are written to {output}",
            ExitCode.INTERRUPTED,
        )
    terminal.result_json(document)
    terminal.result(_table(cases))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"figure    {output / 'intervals.png'}")
    failed = sum(figures.failed for case in cases for figures in case.policies.values())
    if failed:
        terminal.fail(f"{failed} runs failed; see failed_runs in results.json", ExitCode.FAILED)


def write_results(
    folder: Path,
    cases: list[intervals.Case],
    document: dict[str, object],
    *,
    runs: int,
    seed: int,
) -> None:
    """Write results.json, the page and its picture."""
    from auvest import plots  # here, because matplotlib takes long to import
    from auvest.reproduce import intervals_figures

    (folder / "results.json").write_text(console.to_json(document) + "\n", encoding="utf-8")
    (folder / "README.md").write_text(intervals.page(cases, runs=runs, seed=seed), encoding="utf-8")
    plots.save(intervals_figures.plane(cases), folder / "intervals.png")


def _table(cases: list[intervals.Case]) -> Table:
    table = Table(
        title="At equal sampling rate: covariance budget | fixed interval | the paper's law",
        title_justify="left",
        title_style="bold",
    )
    for title in ("track", "noise", "budget / m", "T / s", "RMSE / m", "above / %", "dominates"):
        table.add_column(title)
    for case in cases:
        figures = [case.policies[name] for name in ("budget", "fixed", "law")]
        table.add_row(
            case.track,
            case.noise,
            f"{intervals.BUDGET_SIGMAS * case.sigma_m:.2f}",
            f"{figures[0].interval_s:.3f}",
            " | ".join(f"{f.rmse_m:.3f}" for f in figures),
            " | ".join(f"{100 * f.above:.1f}" for f in figures),
            "yes" if case.dominates else "no",
        )
    return table
