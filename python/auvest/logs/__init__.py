"""Recorded runs: a folder of CSV files with units in the headers; see docs/logs.md.

:class:`LogFolder` knows the layout, :class:`CsvTable` reads one file strictly and in chunks, and
:func:`merge` brings the files of a folder together in the order of time.
"""

from __future__ import annotations

from auvest.logs.layout import FILES, Column, Layout
from auvest.logs.merge import Stream, merge
from auvest.logs.reader import CsvTable, LogError, LogFolder

__all__ = ["FILES", "Column", "CsvTable", "Layout", "LogError", "LogFolder", "Stream", "merge"]
