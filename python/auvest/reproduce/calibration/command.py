"""``auvest reproduce calibration``: noises ten times off, brought back by the logs alone.

Each noise of the documented settings of each recording, and all of them at once, is made ten times
too small and ten times too large, and calibrated as 'auvest calibrate' does it. Needs the
recordings, which are not part of the package. Writes a page README.md and results.json.

Examples
--------
  auvest reproduce calibration --data recordings

  AUVEST_DATA=recordings auvest reproduce calibration --json --quiet | jq .held
"""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from auvest.commands import options
from auvest.commands.console import table
from auvest.commands.reproduce import command as command_of
from auvest.reproduce.calibration import measure, page


def _shown(result: measure.Bench) -> Iterator[Table]:
    yield table("Position RMSE / m", *measure.rmse_table(result))


command = command_of(measure, page, _shown, figures=False, data=options.Data)
