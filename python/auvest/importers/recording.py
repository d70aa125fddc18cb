"""What every reader of a recorder's file gives: messages by topic, each with its time and place.

A reader goes through its file once, from its beginning to its end, and holds one message at a time.
What does not follow the format ends it with an error that names the file and the place; what a
recorder itself marks as broken (a checksum that is wrong) is left out and counted.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import IO, Any, ClassVar, TypeAlias

from auvest._outputs import is_plain_file
from auvest.logs.reader import LogError

#: What a field holds; None where the recorder wrote nothing.
Value: TypeAlias = float | int | bool | str | None

#: Longer lines, messages and lists are no recorder's.
LONGEST_LINE = 1 << 20
LONGEST_LIST = 64
#: Times beyond are none, ns.
_LATEST_NS = 10**11 * 10**9
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?", re.ASCII)


@dataclass(frozen=True)
class Message:
    """One message of a recording.

    Attributes
    ----------
    topic : str
        Its topic, or its type where a recorder knows no topics.
    time_ns : int or None
        When it was recorded, on the recorder's clock; None if the file does not say.
    values : mapping
        Its fields by name; those of a part are ``part.field``, those of a list ``list[0]``.
    where : str
        Its place in the file, to be named in an error.
    stamp_ns : int or None
        When it was measured, where it carries a time of its own, on the sender's clock.
    """

    topic: str
    time_ns: int | None
    values: Mapping[str, Value]
    where: str
    stamp_ns: int | None = None


class RecordingError(LogError):
    """A recording cannot be read; ``where`` is the place in its file."""

    def __init__(self, path: Path, where: str, message: str, *, column: str | None = None) -> None:
        super().__init__(path, message, column=column)
        self.where = where
        field = f", field {column}" if column is not None else ""
        self.args = (f"{path}, {where}{field}: {message}",)


class MissingPackage(ValueError):
    """A format needs an optional package that is not installed; the message says which."""

    def __init__(self, what: str, package: str, extra: str) -> None:
        super().__init__(f"{what} with the package {package}: pip install 'auvest[{extra}]'")


class Recording(ABC):
    """One file of a recorder, or a folder if the recorder writes such.

    Attributes
    ----------
    path : Path
        The file.
    types : dict
        For each topic seen so far the name of its type, where the format has such names.
    facts : dict
        What the file says of itself.
    skipped : Counter
        What was left out, and how often.
    """

    #: As the command names it, and in words.
    name: ClassVar[str]
    title: ClassVar[str]

    def __init__(self, path: Path) -> None:
        self.path = path
        self.types: dict[str, str] = {}
        self.facts: dict[str, Value] = {}
        self.skipped: Counter[str] = Counter()

    @classmethod
    @abstractmethod
    def recognises(cls, path: Path, head: bytes) -> bool:
        """Say whether a file that begins so is of this format."""

    @abstractmethod
    def messages(self, topics: Container[str] | None = None) -> Iterator[Message]:
        """Give the messages of these topics, or all, in the order of the file.

        Raises
        ------
        RecordingError
            At the first place that does not follow the format.
        """

    def error(self, where: str, message: str) -> RecordingError:
        """Make an error of this file."""
        return RecordingError(self.path, where, message)


def opened(path: Path) -> IO[bytes]:
    """Open a file, and nothing that is none.

    Raises
    ------
    LogError
        If it cannot be opened.
    """
    try:
        if path.exists() and not is_plain_file(path):  # a pipe would be waited for
            raise LogError(path, "is not a file")
        return path.open("rb")
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from None


def text_lines(path: Path, *, errors: str = "strict") -> Iterator[tuple[int, str, bool]]:
    """Give number, text without its end, and whether it has one, of each line.

    Raises
    ------
    LogError
        If a line is not UTF-8, or longer than any recorder's.
    """
    with opened(path) as file:
        number = 0
        while raw := file.readline(LONGEST_LINE + 1):
            number += 1
            if len(raw) > LONGEST_LINE:
                raise LogError(path, f"is longer than {LONGEST_LINE} bytes", line=number)
            if number == 1:
                raw = raw.removeprefix(b"\xef\xbb\xbf")
            try:
                text = raw.decode("utf-8", errors)
            except UnicodeDecodeError:
                raise LogError(path, "is not UTF-8 text", line=number) from None
            yield number, text.rstrip("\r\n"), raw.endswith(b"\n")


def value_of(text: str) -> Value:
    """Take a cell or field for what it is: nothing, a truth value, a number, else its text.

    A number too large for any float stays text, so that it is an error where a number is wanted.
    """
    bare = text.strip()
    if not bare or bare.lower() == "nan":
        return None
    if bare in ("True", "true"):
        return True
    if bare in ("False", "false"):
        return False
    if not _NUMBER.fullmatch(bare):
        return bare
    if len(bare) <= 18 and bare.lstrip("+-").isdigit():
        return int(bare)
    number = float(bare)
    return number if math.isfinite(number) else bare


def nanoseconds(seconds: str) -> int | None:
    """Turn seconds as they are written into whole nanoseconds; None if they are no time."""
    bare = seconds.strip()
    if len(bare) > 40 or not _NUMBER.fullmatch(bare):
        return None
    try:
        nanoseconds = int(Decimal(bare) * 10**9)
    except (InvalidOperation, OverflowError):
        return None
    return plausible(nanoseconds)


def plausible(time_ns: int) -> int | None:
    """Give a time, or None if it cannot be one."""
    return time_ns if abs(time_ns) <= _LATEST_NS else None


def flat(tree: Any, name: str = "") -> dict[str, Value]:
    """Name the leaves of what JSON and the like make: ``part.field`` and ``list[0]``.

    Of a list that is longer than :data:`LONGEST_LIST` only its length is kept.
    """
    if isinstance(tree, Mapping):
        leaves: dict[str, Value] = {}
        for key, item in tree.items():
            leaves |= flat(item, f"{name}.{key}" if name else str(key))
        return leaves
    if isinstance(tree, (list, tuple)):
        if len(tree) > LONGEST_LIST:
            return {f"{name}.length": len(tree)}
        leaves = {}
        for k, item in enumerate(tree):
            leaves |= flat(item, f"{name}[{k}]")
        return leaves
    if tree is None or isinstance(tree, (bool, int, float, str)):
        return {name: tree}
    return {name: str(tree)}
