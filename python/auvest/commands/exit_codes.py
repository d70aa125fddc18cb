"""What the shell sees of a command's end."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What the shell sees."""

    OK = 0
    FAILED = 1
    USAGE = 2
    INTERRUPTED = 130


EXIT_CODES = (
    "Exit codes: 0 done; 1 a run failed or a file could not be written; 2 wrong usage; "
    "130 interrupted (what was done is kept)."
)
