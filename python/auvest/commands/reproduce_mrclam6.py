"""``auvest reproduce mrclam6``: SLATF and EKF-SLAT with an IMM master on real robots."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.version import version
from auvest.reproduce import mrclam6

HELP = """\
Each track of the UTIAS recording (one robot seen by another for at least 15 s) is run through dead
reckoning, EKF-SLAT and SLATF 2.0 with an IMM master of unknown velocity. Writes a page README.md, a
picture and results.json. The recording is not part of auvest: DIR/mrclam6 holds groundtruth.csv,
odometry.csv and sightings.csv.

Examples:

  auvest reproduce mrclam6 --data recordings

  AUVEST_DATA=recordings auvest reproduce mrclam6 --json --quiet | jq '.filters'
"""


def command(
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", envvar="AUVEST_DATA", file_okay=False, help="Folder with the recordings."
        ),
    ] = None,
    runs: Annotated[
        int, typer.Option("--runs", min=1, max=1000, help="Runs of SLATF 2.0 over all tracks.")
    ] = mrclam6.DEFAULT_RUNS,
    seed: options.Seed = mrclam6.DEFAULT_SEED,
    output: options.Output = Path("auvest-output/reproduce-mrclam6"),
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Reproduce; the help text is :data:`HELP`."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if data is None:
        terminal.fail(
            "--data is missing: the folder of the recordings (or set AUVEST_DATA)", ExitCode.USAGE
        )
    try:
        recording = mrclam6.Recording(data)
    except FileNotFoundError as error:
        terminal.fail(f"--data {data}: {error}", ExitCode.USAGE)
    terminal.make_folder(output)
    tracks = recording.tracks()
    figures: dict[str, list[mrclam6.Figures]] = {}
    paths: dict[str, list[mrclam6.Path2D]] = {}
    work = [(name, run) for name in mrclam6.NAMES for run in range(runs if name == "slatf2" else 1)]
    done = 0
    try:
        with terminal.progress("tracks") as progress:
            for name, run in work:
                found = []
                for track in tracks:
                    found.append(mrclam6.follow(track, name, seed=seed + run))
                    done += 1
                    progress(done, len(work) * len(tracks))
                figures.setdefault(name, []).append(mrclam6.measure(tracks, found))
                paths.setdefault(name, found)
    except KeyboardInterrupt:
        terminal.fail("interrupted: nothing was written", ExitCode.INTERRUPTED)
    results = {
        "command": "reproduce mrclam6",
        "version": version(),
        **mrclam6.summary(tracks, figures, recording.drift(), seed=seed),
    }
    with terminal.writing(output):
        write_results(output, results, tracks, paths)
    terminal.result_json(results)
    terminal.result(_table(results))
    terminal.result(f"page      {output / 'README.md'}")
    terminal.result(f"figure    {output / 'tracks.png'}")


def write_results(
    folder: Path,
    results: dict[str, Any],
    tracks: list[mrclam6.Track],
    paths: dict[str, list[mrclam6.Path2D]],
) -> None:
    """Write results.json, the page and its picture."""
    from auvest import plots  # here, because matplotlib takes long to import
    from auvest.reproduce import mrclam6_figures

    (folder / "results.json").write_text(console.to_json(results) + "\n", encoding="utf-8")
    (folder / "README.md").write_text(mrclam6.page(results), encoding="utf-8")
    plots.save(mrclam6_figures.some_tracks(tracks, paths), folder / "tracks.png")


def _table(results: dict[str, Any]) -> Table:
    table = Table(
        title=f"{results['tracks']} tracks, RMSE over all steps; (worst run)",
        title_justify="left",
        title_style="bold",
    )
    for title in ("filter", "runs", "slave / m", "over dead reckoning", "relative / m"):
        table.add_column(title)
    for row in results["filters"]:
        mastered = row["filter"] != "dead_reckoning"
        table.add_row(
            mrclam6.NAMES[row["filter"]],
            str(row["runs"]),
            f"{row['slave_rmse_m']:.3f}",
            f"{row['ratio']:.3f} ({row['ratio_worst']:.3f})",
            f"{row['relative_rmse_m']:.3f} ({row['relative_rmse_worst_m']:.3f})"
            if mastered
            else "",
        )
    return table
