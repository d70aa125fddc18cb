"""The text that the sketches and their instruments speak over a serial line.

Every line is ``$body*hhhhhhhh``; ``hhhhhhhh`` is the CRC-32 of the characters of the body, and the
body is a name and fields. A sketch says why it has started, names the columns of its samples, and
sends them::

    $BOOT,17,1*...                             how many starts, and why this one
    $RESUME,9,...*...                          from which checkpoint it goes on, if it keeps any
    $COLUMNS,AUV,sample#,time_s,x_m,...*...    of the lines that begin with AUV
    $AUV,1,0.500000,3e4ccccd,...*...

Columns with ``#`` are whole numbers; in others eight hexadecimal digits are the bits of a float.
It asks its sonar with ``PING,sample`` and is answered with ``SONAR,sample,range,bearing``; the
sketch ``slave_tracking`` also asks with ``ODO,sample`` for ``MOTION,sample,speed,heading``.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from dataclasses import dataclass

import numpy as np

from auvest._texts import counted

#: One sample; NaN where the sketch had nothing to send.
Row = dict[str, float]

_BITS = re.compile(r"[0-9a-f]{8}")
_DECIMALS = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*#?")
_KIND = re.compile(r"[A-Z][A-Z0-9_]*")
_COUNT = re.compile(r"[0-9]{1,9}")
_NUMBER = re.compile(r"(-?)(\d*)(?:\.(\d*))?", re.ASCII)
#: What a number to a sketch has at most.
_DIGITS = 9
_EARLIER = (
    "the sketch is of an earlier version, whose checksum two lost characters pass: load it anew"
)


class LineError(ValueError):
    """A line that is not what was sent, or that this version does not understand."""


@dataclass(frozen=True)
class Boot:
    """The board has started.

    Attributes
    ----------
    count : int
        How many times until now, this one included.
    cause : int
        The chip's register: see `reason`.
    """

    count: int
    cause: int

    @property
    def reason(self) -> str:
        """Why: in words."""
        causes = ("power came on", "its reset pin", "the supply was too low", "its watchdog")
        said = [text for bit, text in enumerate(causes) if self.cause >> bit & 1]
        return " and ".join(said) or "unknown: its bootloader clears the cause"


@dataclass(frozen=True)
class Resumed:
    """The board goes on from a checkpoint.

    Attributes
    ----------
    sequence : int
        Its number; 0: there was none to go on from.
    least_s, most_s : float
        Bounds of its age, s.
    """

    sequence: int
    least_s: float
    most_s: float


def frame(body: str) -> str:
    """Wrap a body in ``$`` and its checksum."""
    return f"${body}*{_checksum(body):08x}"


def body_of(line: str) -> str:
    """Give the body of a line.

    Raises
    ------
    LineError
        If the line is not whole.
    """
    match = re.fullmatch(r"\$([^$*]*)\*([0-9A-Fa-f]{8})", line)
    if match is None:
        if re.fullmatch(r"\$[^$*]*\*[0-9A-Fa-f]{2}", line):
            raise LineError(f"a checksum of two digits: {_EARLIER}: {line!r}")
        raise LineError(f"not a whole line: {line!r}")
    body, given = match[1], int(match[2], 16)
    if given != _checksum(body):
        raise LineError(f"checksum {given:08x}, but {_checksum(body):08x} computed: {line!r}")
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
    """Write the sonar's answer, to 1 um and 1 urad where nine digits hold them."""
    return frame(f"SONAR,{sample},{decimal(range_m, 6)},{decimal(bearing_rad, 6)}")


def decimal(value: float, decimals: int) -> str:
    """Write a number for a sketch, with fewer decimals where it has more than nine digits.

    Raises
    ------
    ValueError
        If it is not finite, or nine digits do not hold it.
    """
    for places in range(decimals, -1, -1):
        text = f"{value:.{places}f}"
        if math.isfinite(value) and sum(map(str.isdigit, text)) <= _DIGITS:
            return text
    raise ValueError(f"nine digits do not hold {value!r}")


def number(text: str) -> np.float32:
    """Read a number with the bits of the chip: digits / 10^decimals, each rounded once.

    Raises
    ------
    LineError
        If it is none, or has more than nine digits.
    """
    match = _NUMBER.fullmatch(text)
    sign, whole, decimals = match.groups(default="") if match else ("", "", "")
    if not 1 <= len(whole + decimals) <= _DIGITS:
        raise LineError(f"not a number of up to nine digits: {text!r}")
    size = np.float32(int(whole + decimals)) / np.float32(10 ** len(decimals))
    return -size if sign else size


class Reader:
    """Reads what a sketch sends, line by line.

    Attributes
    ----------
    kind : str
        With what its samples begin: the kind that it has described first; empty until then.
    columns : tuple of str
        Their names, with units.
    others : set of str
        Kinds of the other lines: what the sketch says to its instruments, or samples whose
        description was missed.
    """

    def __init__(self) -> None:
        self.kind = ""
        self.columns: tuple[str, ...] = ()
        self.others: set[str] = set()
        self._whole: frozenset[str] = frozenset()

    def read(self, line: str) -> Row | Boot | Resumed | None:
        """Read a line without its end.

        Returns
        -------
        dict, Boot, Resumed or None
            One sample, that the board has started, or from what; None for everything else.

        Raises
        ------
        LineError
            If the line is damaged, or describes other columns than before; what was described
            stays.
        """
        if line.startswith("# columns:"):
            raise LineError(f"names of columns without a checksum: {_EARLIER}")
        if not line or line.startswith("#"):
            return None
        kind, *cells = body_of(line).split(",")
        if kind == "BOOT":
            if len(cells) != 2 or not all(map(_COUNT.fullmatch, cells)):
                raise LineError(f"not a start of the board: {line!r}")
            return Boot(*map(int, cells))
        if kind == "RESUME":
            return _resumed(line, cells)
        if kind == "COLUMNS":
            self._describe(line, *cells)
        elif kind == self.kind:
            return self._sample(line, cells)
        else:
            self.others.add(kind)
        return None

    def _describe(self, line: str, kind: str = "", *names: str) -> None:
        columns = tuple(name.removesuffix("#") for name in names)
        right = _KIND.fullmatch(kind) and names and all(map(_NAME.fullmatch, names))
        if not right or len(set(columns)) < len(columns):
            raise LineError(f"not a description of columns: {line!r}")
        if self.kind and kind != self.kind:
            self.others.add(kind)
            return
        if self.columns and columns != self.columns:
            raise LineError("the board describes other columns than before: another sketch?")
        self.kind, self.columns = kind, columns
        self._whole = frozenset(name[:-1] for name in names if name.endswith("#"))
        self.others.discard(kind)

    def _sample(self, line: str, cells: list[str]) -> Row:
        if len(cells) != len(self.columns):
            raise LineError(
                f"{counted(len(cells), 'value')} for {counted(len(self.columns), 'column')}: "
                f"{line!r}"
            )
        try:
            pairs = zip(self.columns, cells, strict=True)
            return {name: _value(cell, whole=name in self._whole) for name, cell in pairs}
        except ValueError:
            raise LineError(f"not a number in {line!r}") from None


def _resumed(line: str, cells: list[str]) -> Resumed:
    """Read sequence, seconds, sum, least and most age; a sketch may add to them."""
    if (
        len(cells) < 5
        or not _COUNT.fullmatch(cells[0])
        or not all(map(_BITS.fullmatch, cells[3:5]))
    ):
        raise LineError(f"not what a board resumes from: {line!r}")
    least_s, most_s = (_value(cell, whole=False) for cell in cells[3:5])
    return Resumed(int(cells[0]), least_s, most_s)


def _checksum(body: str) -> int:
    try:
        return zlib.crc32(body.encode("latin-1"))
    except UnicodeEncodeError as error:
        character = body[error.start : error.end]
        raise LineError(f"no character of a serial line: {character!r}") from None


def _value(cell: str, *, whole: bool) -> float:
    if cell == "":
        return math.nan
    if not whole and _BITS.fullmatch(cell):
        return struct.unpack(">f", bytes.fromhex(cell))[0]
    if cell in ("ovf", "nan"):  # what Arduino prints where there is no number
        return math.nan
    if not _DECIMALS.fullmatch(cell):  # float() takes 1_0 and foreign digits, too
        raise ValueError(cell)
    return float(cell)
