"""Mutated files of recorders through the readers and into logs, in this process.

    python -m tests.attacks.recorders --files 60000 --seed 1

A file is refused by an error that names it, and leaves nothing; or what is listed are numbers, and
what is written is a file of a log that the reader takes. The file itself stays as it was.
"""

from __future__ import annotations

import json
import random
import shutil
import tempfile
import warnings
from collections import Counter
from pathlib import Path
from typing import ClassVar

from auvest.importers import import_recording, listing, open_recording, read_mapping, recipe
from auvest.importers.expressions import MappingError
from auvest.logs import CsvTable, LogError
from auvest.logs.reader import Frame
from tests.attacks.damage import one, steps
from tests.attacks.frame import Case, Failed, main
from tests.attacks.recordings import recordings

_BINARY = ("flip", "set", "cut", "out", "twice", "insert", "zeros", "exchange")
#: Where a length or a count stands, these are what hurts.
_BYTES = (b"\x00", b"\xff", b"\x7f", b"\x80", b"\xff\xff\xff\xff", b"\x00\x00\x00\x80")


def binary_steps(rng: random.Random) -> tuple[tuple[object, ...], ...]:
    return tuple(
        (rng.choice(_BINARY), *(rng.randrange(2**20) for _ in range(3)))
        for _ in range(rng.choice((1, 1, 1, 2, 3, 8)))
    )


def damaged(raw: bytes, wanted: tuple[tuple[object, ...], ...]) -> bytes:
    """The file after these steps: those of text have a name in the second place."""
    for kind, *numbers in wanted:
        if isinstance(numbers[0], str):
            a, b, c = (int(str(number)) for number in numbers[1:])
            raw = one(raw, str(kind), a, b, c)
        elif raw:
            a, b, c = (int(str(number)) for number in numbers)
            raw = _binary(raw, str(kind), a % len(raw), b, c)
    return raw


def _binary(raw: bytes, kind: str, at: int, b: int, c: int) -> bytes:
    length = 1 + b % 64
    if kind == "flip":
        return raw[:at] + bytes([raw[at] ^ 1 << b % 8]) + raw[at + 1 :]
    if kind == "set":
        piece = _BYTES[b % len(_BYTES)]
        return raw[:at] + piece + raw[at + len(piece) :]
    if kind == "cut":
        return raw[:at]
    if kind == "out":
        return raw[:at] + raw[at + length :]
    if kind == "twice":
        return raw[: at + length] + raw[at:]
    if kind == "insert":
        return raw[:at] + random.Random(c).randbytes(length) + raw[at:]
    if kind == "zeros":
        return raw[:at] + bytes(length) + raw[at + length :]
    other = c % len(raw)
    piece = raw[other : other + length]
    return raw[:at] + piece + raw[at + len(piece) :]


class Recorders:
    """The attack."""

    unit: ClassVar[str] = "files"

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="auvest-attack-"))

    def case(self, rng: random.Random) -> Case:
        kind = rng.choice(list(recordings()))
        text = recordings()[kind][1].isascii()
        as_text = text and rng.random() < 0.7
        return Case(kind, steps(rng, ["file"]) if as_text else binary_steps(rng))

    def text(self, case: Case) -> str:
        name, _, mapping = recordings()[case.subject]
        return (
            "from tests.attacks import recorders, recordings\n"
            f"raw = recordings.recordings()[{case.subject!r}][1]\n"
            f"Path({name!r}).write_bytes(recorders.damaged(raw, {case.steps!r}))\n"
            f"# auvest import --list {name}; with the mapping {mapping!r}"
        )

    def run(self, case: Case, counts: Counter[str]) -> None:
        kind = case.subject
        counts["files"] += 1
        name, raw, mapping = recordings()[kind]
        source, output = self._folder / "set", self._folder / "log"
        for folder in (source, output):
            shutil.rmtree(folder, ignore_errors=True)
        source.mkdir(parents=True)
        path = source / name
        raw = damaged(raw, case.steps)
        path.write_bytes(raw)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                json.dumps(listing(open_recording(path)), allow_nan=False)
                counts[f"{kind} listed"] += 1
        except LogError as refused:
            self._require_name(kind, name, refused)
            counts[f"{kind} not listed"] += 1
        except BaseException as wrong:
            raise Failed(f"{kind}: list: {type(wrong).__name__}", repr(wrong)) from None
        self._import(kind, path, mapping, output, counts)
        if path.read_bytes() != raw:
            raise Failed(f"{kind}: the source was changed", "")

    def _import(
        self, kind: str, path: Path, mapping: str, output: Path, counts: Counter[str]
    ) -> None:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                recording = open_recording(path)
                wanted = recipe(recording.name)
                if mapping:
                    settings = self._folder / "mapping.toml"
                    settings.write_text(mapping)
                    wanted = read_mapping(settings)
                made = import_recording(recording, wanted, output)
        except MappingError:
            counts[f"{kind} without a field"] += 1
        except LogError as refused:
            self._require_name(kind, path.name, refused)
            counts[f"{kind} refused"] += 1
        except BaseException as wrong:
            raise Failed(f"{kind}: import: {type(wrong).__name__}", repr(wrong)) from None
        else:
            counts[f"{kind} imported"] += 1
            self._require_log(kind, made.path)
            return
        left = [str(one) for one in output.parent.glob("log*")]
        if left:
            raise Failed(f"{kind}: a refused import leaves files", f"{left}")

    def _require_name(self, kind: str, name: str, refused: LogError) -> None:
        if name not in str(refused):
            raise Failed(f"{kind}: a refusal does not name the file", str(refused))

    def _require_log(self, kind: str, folder: Path) -> None:
        frame = Frame()
        frame.origin = (0.0, 0.0)
        try:
            for path in folder.glob("*.csv"):
                for rows, _ in CsvTable(path, frame=frame).chunks():
                    if not len(rows):
                        raise Failed(f"{kind}: writes a file without rows", path.name)
        except LogError as refused:
            raise Failed(f"{kind}: writes what the reader refuses", str(refused)) from None


ATTACK = Recorders()

if __name__ == "__main__":
    main(ATTACK, __doc__, 60000)
