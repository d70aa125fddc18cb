"""The text that the sketches and their instruments speak over a serial line.

Every line is ``$body*hh``; ``hh`` is the exclusive or of the characters of the body, as in
NMEA 0183. A sketch asks its sonar with ``PING,sample``, is answered with
``SONAR,sample,range,bearing`` and reports each sample as ``AUV,...``; a comment names the columns.
The sketch ``slave_tracking`` also asks with ``ODO,sample`` for ``MOTION,sample,speed,heading``, and
reports as ``SLAVE,...``.
"""

from __future__ import annotations

import math
import re
import struct
from functools import reduce
from operator import xor

#: One sample; NaN where the sketch had nothing to send.
Row = dict[str, float]

_COLUMNS = "# columns: "
_BITS = re.compile(r"[0-9a-f]{8}")
_DECIMALS = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_COUNT = re.compile(r"[0-9]{1,10}")
#: Columns that are always decimal: eight digits there are not the bits of a float.
_DECIMAL = frozenset(
    {"sample", "time_s", "resamplings", "status", "missed", "refused", "late", "awake_us"}
)


class LineError(ValueError):
    """A line that is not what was sent, or that this version does not understand."""


def frame(body: str) -> str:
    """Wrap a body in ``$`` and its checksum."""
    return f"${body}*{_checksum(body):02x}"


def body_of(line: str) -> str:
    """Give the body of a line.

    Raises
    ------
    LineError
        If the line is not whole.
    """
    match = re.fullmatch(r"\$([^$*]*)\*([0-9A-Fa-f]{2})", line)
    if match is None:
        raise LineError(f"not a whole line: {line!r}")
    body, given = match[1], int(match[2], 16)
    if given != _checksum(body):
        raise LineError(f"checksum {given:02x}, but {_checksum(body):02x} computed: {line!r}")
    return body


def requested_sample(line: str, request: str = "PING") -> int | None:
    """Give the number of the sample that a sketch asks for, its sonar as a rule; else None."""
    if not line.startswith(f"${request},"):
        return None
    try:
        count = body_of(line).removeprefix(f"{request},")
    except LineError:
        return None
    return int(count) if _COUNT.fullmatch(count) else None


def answer(sample: int, range_m: float, bearing_rad: float) -> str:
    """Write the sonar's answer, to 1 um and 1 urad."""
    return frame(f"SONAR,{sample},{range_m:.6f},{bearing_rad:.6f}")


class Reader:
    """Reads what a sketch sends, line by line.

    Parameters
    ----------
    kind : str
        With what its samples begin: ``AUV`` of ``tracking_loop``, ``SLAVE`` of ``slave_tracking``.

    Attributes
    ----------
    columns : tuple of str
        Names with units; empty until the comment that names them has come.
    """

    def __init__(self, kind: str = "AUV") -> None:
        self._kind = kind
        self.columns: tuple[str, ...] = ()

    def read(self, line: str) -> Row | None:
        """Read a line without its end.

        Returns
        -------
        dict or None
            One sample; None for comments and for what is said to the sonar.

        Raises
        ------
        LineError
            If the line is damaged, or a sample comes before the names of its columns.
        """
        if line.startswith(_COLUMNS):
            names = tuple(line.removeprefix(_COLUMNS).split(","))
            if len(set(names)) < len(names) or not all(map(_NAME.fullmatch, names)):
                raise LineError(f"the names of the columns are damaged: reset the board: {line!r}")
            self.columns = names
            return None
        if not line or line.startswith("#"):
            return None
        kind, *cells = body_of(line).split(",")
        if kind != self._kind:
            return None
        if not self.columns:
            raise LineError("the names of the columns have not come: reset the board")
        if len(cells) != len(self.columns):
            raise LineError(f"{len(cells)} values for {len(self.columns)} columns: {line!r}")
        try:
            pairs = zip(self.columns, cells, strict=True)
            return {name: _number(name, cell) for name, cell in pairs}
        except ValueError:
            raise LineError(f"not a number in {line!r}") from None


def _checksum(body: str) -> int:
    try:
        return reduce(xor, body.encode("latin-1"), 0)
    except UnicodeEncodeError as error:
        character = body[error.start : error.end]
        raise LineError(f"no character of a serial line: {character!r}") from None


def _number(name: str, cell: str) -> float:
    if cell == "":
        return math.nan
    if name not in _DECIMAL and _BITS.fullmatch(cell):
        return struct.unpack(">f", bytes.fromhex(cell))[0]
    if cell in ("ovf", "nan"):  # what Arduino prints where there is no number
        return math.nan
    if not _DECIMALS.fullmatch(
        cell
    ):  # float() also takes what no sketch sends: 1_0, foreign digits
        raise ValueError(cell)
    return float(cell)
