"""The formats of recorders that are known, and which of them a file has."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from auvest.importers.alog import Alog
from auvest.importers.csv_table import CsvTableRecording
from auvest.importers.dataflash import DataFlash
from auvest.importers.json_lines import JsonLines
from auvest.importers.mavlink import Tlog
from auvest.importers.nmea import Nmea
from auvest.importers.recording import Recording, opened
from auvest.importers.ros import RosBag
from auvest.importers.ulog import ULog
from auvest.logs.reader import LogError

#: By their names; the first that recognises a file reads it, so text comes last.
FORMATS: Mapping[str, type[Recording]] = {
    kind.name: kind
    for kind in (RosBag, ULog, DataFlash, Tlog, Alog, CsvTableRecording, JsonLines, Nmea)
}
#: Enough for a header and some lines, to tell a format by.
_HEAD_BYTES = 1 << 16


def open_recording(path: Path, kind: str | None = None) -> Recording:
    """Find the reader of a file; nothing but its beginning is read yet.

    Parameters
    ----------
    path : Path
        The file, or the folder of a ROS 2 bag.
    kind : str, optional
        One of :data:`FORMATS`; by default the one that recognises it.

    Raises
    ------
    LogError
        If it cannot be read or no format recognises it.
    """
    if kind is not None:
        return FORMATS[kind](path)
    head = b""
    if not path.is_dir():
        with opened(path) as file:
            head = file.read(_HEAD_BYTES)
    for candidate in FORMATS.values():
        if candidate.recognises(path, head):
            return candidate(path)
    known = ", ".join(FORMATS)
    raise LogError(path, f"is of no format known here ({known}); name one before it")
