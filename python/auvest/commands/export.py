"""``auvest export``: results of a replay for Foxglove or ROS 2.

RESULTS is the folder of one log below the --output of a replay. 'foxglove' writes auvest.mcap with
poses, covariance ellipses, innovations and, with --origin, fixes on Earth; 'ros2' makes OUT a bag
with Odometry and PoseWithCovarianceStamped. The track as TUM text is in the results already.

Examples
--------
  auvest export auvest-output/replay/goats14 goats14-foxglove

  auvest export auvest-output/replay/goats14 goats14-bag --format ros2
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from auvest.commands import options
from auvest.commands.console import Terminal
from auvest.commands.version import version
from auvest.exporters import EXPORTERS, ReplayResults


def command(
    results: Annotated[
        Path,
        typer.Argument(metavar="RESULTS", help="Folder of a log's results.", show_default=False),
    ],
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="Folder to be made.", show_default=False)
    ],
    kind: Annotated[Literal["foxglove", "ros2"], typer.Option("--format")] = "foxglove",
    origin: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--origin",
            metavar="LATITUDE LONGITUDE",
            help="Where the log's (0, 0) is, degrees; x is east, y north.",
            show_default=False,
        ),
    ] = None,
    epoch: Annotated[
        float, typer.Option("--epoch", help="Seconds to be added to the times.")
    ] = 0.0,
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Export; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    if not abs(epoch) < 1e11:
        raise typer.BadParameter(f"{epoch} is no time.", param_hint="'--epoch'")
    if origin is not None and not (abs(origin[0]) <= 90 and abs(origin[1]) <= 360):
        raise typer.BadParameter(f"{origin} is no place on Earth.", param_hint="'--origin'")
    with terminal.usage_errors():
        found = ReplayResults(results, epoch_s=epoch, origin=origin)
    new = terminal.new_folder(output, "export", force=force)
    with terminal.usage_errors(), terminal.writing(output):
        counts = EXPORTERS[kind](found, new.part)
    terminal.publish(new)
    files = sorted(path.name for path in new.path.iterdir() if not path.name.startswith("."))
    terminal.result_json(
        {
            "command": "export",
            "version": version(),
            "format": kind,
            "folder": str(new.path),
            "files": files,
            "messages": counts,
        }
    )
    terminal.files({name: new.path / name for name in files})
