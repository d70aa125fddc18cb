"""``auvest reproduce logs``: real recordings through the filters, beside the targets.

Needs the recordings, which are not part of the package: the folder with goats14, hat_charles,
mrclam6, labyrinth_uwb and ugps_pier59. Writes a page README.md and results.json.

Examples
--------
  auvest reproduce logs --data recordings

  AUVEST_DATA=recordings auvest reproduce logs --json --quiet | jq .held
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.logs import measure, page


def _shown(result: measure.Reproduction) -> Iterator[Table]:
    header, rows = measure.set_table(result)
    wanted = ("set", "odometry", "EKF", measure.KERNEL, "target", "holds")
    places = [header.index(name) for name in wanted]
    yield table(
        "Position RMSE / m: odometry alone, EKF, robust EKF",
        wanted,
        [[row[k] for k in places] for row in rows],
    )
    yield table("RMSE of predicted fixes / m", *measure.tracking_table(result))


command = command_of(measure, page, _shown, figures=False, data=options.Data)
