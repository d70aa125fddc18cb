"""Files of other recorders: what they hold, and logs made of them.

:data:`FORMATS` are the readers, one per kind of file; :func:`open_recording` finds the one for a
file; :func:`listing` says what is in it; :func:`import_recording` makes a log of it, by a mapping
from topics to columns. Whole data sets with a layout of their own are in
:mod:`auvest.importers.sets`.
"""

from __future__ import annotations

from auvest.importers.expressions import MappingError
from auvest.importers.formats import FORMATS, open_recording
from auvest.importers.listing import listing
from auvest.importers.mapping import LogMapping, read_mapping, recipe
from auvest.importers.recording import Message, MissingPackage, Recording, RecordingError
from auvest.importers.to_log import Imported, import_recording

__all__ = [
    "FORMATS",
    "Imported",
    "LogMapping",
    "MappingError",
    "Message",
    "MissingPackage",
    "Recording",
    "RecordingError",
    "import_recording",
    "listing",
    "open_recording",
    "read_mapping",
    "recipe",
]
