"""``auvest import``: recordings as logs that ``auvest replay`` reads.

SOURCE is a file of a recorder (ROS bag, DataFlash, tlog, ULog, .alog, NMEA, JSON or CSV of a DVL
or USBL), or the folder of a data set. Of a recorder's file the format is found out; FORMAT says it.
--list says what is in it: topics, times, fields, some messages. --mapping says which topics become
which columns of the log. docs/importers.md has the formats and the mapping.

Data sets are goats14, hat_charles, labyrinth_uwb, mrclam6 and ugps_pier59 as the project's
validation data have them, others of the same layout, and mrclam: the original text files of any
UTIAS MR.CLAM set; mrclam6_tracks and mrclam_tracks make logs of echoes of these, two_vehicles one
of a slave and its master. Their logs are named by SOURCE.

Examples
--------
  auvest import --list dive.tlog

  auvest import dive.tlog logs/dive --mapping dive.toml

  auvest import goats14 data/goats14 logs
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from auvest.commands import options
from auvest.commands.console import Terminal, shown, table
from auvest.commands.version import version
from auvest.importers import (
    FORMATS,
    import_recording,
    listing,
    open_recording,
    read_mapping,
    recipe,
)
from auvest.importers.sets import IMPORTERS, layout_of


def command(
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="[FORMAT] SOURCE [OUT]",
            help="The recording, and the folder for the log; made if missing.",
            show_default=False,
        ),
    ],
    listed: Annotated[
        bool, typer.Option("--list", help="Say what the recording holds; write nothing.")
    ] = False,
    mapping: Annotated[
        Path | None,
        typer.Option(
            "--mapping", help="TOML file: which topics become which columns.", show_default=False
        ),
    ] = None,
    at: Annotated[
        list[int] | None,
        typer.Option("--at", min=1, help="With --list: show this message of each topic, too."),
    ] = None,
    force: options.Force = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Import; the help text is the module's."""
    terminal = Terminal(as_json=as_json, quiet=quiet)
    expected = 1 if listed else 2
    if not expected <= len(words) <= expected + 1:
        wanted = "[FORMAT] SOURCE" if listed else "[FORMAT] SOURCE OUT"
        raise typer.BadParameter(f"expected {wanted}.")
    kind = words[0] if len(words) > expected else None
    if kind is not None and kind not in {**FORMATS, **IMPORTERS}:
        raise typer.BadParameter(
            f"{kind!r} is none of the formats {', '.join(FORMATS)}, nor of the sets "
            f"{', '.join(IMPORTERS)}.",
            param_hint="FORMAT",
        )
    if at and not listed:
        raise typer.BadParameter("is for --list.", param_hint="'--at'")
    given = list(map(Path, words if kind is None else words[1:]))
    if kind is None and not listed:
        kind = layout_of(given[0])
    if mapping is not None and (listed or kind in IMPORTERS):
        raise typer.BadParameter("is for logs of recordings.", param_hint="'--mapping'")
    with terminal.usage_errors():
        if listed:
            found = listing(open_recording(given[0], kind), at or ())
            terminal.result_json({"command": "import", "version": version(), **found})
            _show(terminal, found)
        elif kind is not None and kind in IMPORTERS:
            _import_set(terminal, kind, *given, force=force)
        else:
            _import_recording(terminal, kind, *given, mapping=mapping, force=force)


def _import_set(terminal: Terminal, kind: str, source: Path, output: Path, *, force: bool) -> None:
    with terminal.writing(output):
        folders = IMPORTERS[kind](source, output, force=force, note=terminal.warn)
    terminal.result_json(
        {"command": "import", "version": version(), "logs": [str(folder) for folder in folders]}
    )
    for folder in folders:
        terminal.result(f"log       {shown(folder)}")


def _import_recording(
    terminal: Terminal,
    kind: str | None,
    source: Path,
    output: Path,
    *,
    mapping: Path | None,
    force: bool,
) -> None:
    recording = open_recording(source, kind)
    wanted = recipe(recording.name) if mapping is None else read_mapping(mapping)
    with terminal.writing(output):
        made = import_recording(recording, wanted, output, force=force)
    for note in made.notes:
        terminal.warn(note)
    terminal.result_json(
        {
            "command": "import",
            "version": version(),
            "format": recording.name,
            "logs": [str(made.path)],
            "rows": made.rows,
            "notes": made.notes,
        }
    )
    terminal.result(f"log       {shown(made.path)}")


def _show(terminal: Terminal, found: dict[str, Any]) -> None:
    if terminal.as_json:
        return
    terminal.result(
        table(
            f"{found['recording']}: {found['format']}, {found['messages']} messages",
            ("topic", "messages", "from (s)", "to (s)", "Hz", "fields"),
            [
                (
                    shown(name),
                    str(topic["messages"]),
                    _number(topic["first_s"], ".3f"),
                    _number(topic["last_s"], ".3f"),
                    _number(topic["rate_hz"], ".3g"),
                    shown(", ".join(topic["fields"])),
                )
                for name, topic in found["topics"].items()
            ],
            right=(1, 2, 3, 4),
        )
    )
    for name, count in found["skipped"].items():
        terminal.warn(f"passed over: {count} x {name}")


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
