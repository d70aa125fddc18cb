"""A bench behind a serial line: one row at a time, and again where the line has damaged one.

Every row has its number. The bench takes only the next one, and answers the last one again; so what
is lost, damaged or doubled in either direction is sent again, and no row is taken twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

from auvest._texts import os_reason
from auvest.firmware.hil_bench import ANEW, Bench, answer_of, row_frame
from auvest.telemetry import LineError

BAUD = 115200
#: A row is sent again after so long without an answer, s. A row of 45 words takes 35 ms to come, a
#: step of the slowest filter on the slowest chip 0.1 s.
PATIENCE_S = 1.0
#: So often at most.
ATTEMPTS = 20


class LineLost(RuntimeError):
    """The port does not open, is silent, or is not that of the bench."""


class Link(Protocol):
    """A serial line."""

    def write(self, line: str) -> None:
        """Send a line."""

    def read(self, until_s: float) -> str | None:
        """Give the next line; None if none ends before this time of ``time.monotonic``."""


class _Port:
    """A serial port of this computer."""

    def __init__(self, name: str) -> None:
        try:
            import serial
        except ImportError:
            raise LineLost("serial needs pyserial: pip install 'auvest[serial]'") from None
        self._failure = (serial.SerialException, OSError)
        self._name = name
        self._received = b""
        try:
            self._port = serial.Serial(name, BAUD, timeout=0.1)
        except self._failure as error:
            raise LineLost(f"{name}: {os_reason(error)}") from None

    def __enter__(self) -> _Port:
        return self

    def __exit__(self, *_: object) -> None:
        self._port.close()

    def write(self, line: str) -> None:
        try:
            self._port.write(f"{line}\n".encode("ascii"))
        except self._failure as error:
            raise LineLost(f"{self._name}: {error}") from None

    def read(self, until_s: float) -> str | None:
        while True:
            try:
                self._port.timeout = max(0.0, min(0.1, until_s - time.monotonic()))
                self._received += self._port.readline()
            except self._failure as error:
                raise LineLost(f"{self._name}: {error}") from None
            if self._received.endswith(b"\n"):
                line, self._received = self._received.decode("latin-1"), b""
                return line.rstrip("\r\n")
            if time.monotonic() >= until_s:
                return None


def over_serial(
    program: Bench,
    port: str,
    figures: dict[str, int],
    progress: Callable[[int, int], None] | None = None,
) -> list[str]:
    """Play a record to the board at a port; give its answers, a line each.

    Raises
    ------
    LineLost
        If there is no port, no answer, or another program.
    """
    with _Port(port) as link:
        return play(link, program, figures, progress)


def play(
    link: Link,
    program: Bench,
    figures: dict[str, int],
    progress: Callable[[int, int], None] | None = None,
) -> list[str]:
    """Play a record over a line; ``figures`` gets what was damaged and what was sent again.

    Raises
    ------
    LineLost
        If there is no answer, another program, or the board has started anew.
    """
    figures.update(damaged_frames=0, repeated_rows=0)
    _begin(link, program, figures)
    answers = []
    for k, row in enumerate(program.rows):
        answers.append(_exchange(link, k, row, figures))
        if progress is not None:
            progress(k, len(program.rows) - 1)
    return answers


def _begin(link: Link, program: Bench, figures: dict[str, int]) -> None:
    """Ask until the bench of this record says that it waits for the start.

    Whoever opens the port of an Arduino resets it: what it says then is waited for first, and its
    bootloader hears no questions.
    """
    for attempt in range(ATTEMPTS):
        if attempt > 0:
            link.write(row_frame(ANEW))
        until_s = time.monotonic() + PATIENCE_S
        while (line := link.read(until_s)) is not None:
            kind, words = _heard(line, figures)
            if kind == "B" and words[0] != program.digest:
                raise LineLost(
                    f"the board runs the bench {words[0]:08x}, not {program.digest:08x}: of "
                    "another log, filter or version; load the sketch bench"
                )
            if kind == "B" and words[1] == 0:
                return
            if kind in ("", "N"):
                break
    raise LineLost("no bench answers: load the sketch bench, and close what else has the port")


def _exchange(link: Link, k: int, row: str, figures: dict[str, int]) -> str:
    """Send a row until its answer comes."""
    for attempt in range(ATTEMPTS):
        figures["repeated_rows"] += attempt > 0
        link.write(row)
        until_s = time.monotonic() + PATIENCE_S
        while (line := link.read(until_s)) is not None:
            kind, words = _heard(line, figures)
            if kind == "A" and words[0] == k:
                return line[line.rfind("$") :]
            if k > 0 and (kind == "B" or (kind == "N" and words[0] == 0)):
                raise LineLost(f"the board has started anew at row {k}")
            if kind in ("", "N"):
                break  # the row, or its answer, was damaged
            # Otherwise an answer has come twice.
    raise LineLost(f"row {k} was sent {ATTEMPTS} times, and no answer has come")


def _heard(line: str, figures: dict[str, int]) -> tuple[str, list[int]]:
    """Give the kind and the words of a line; no kind: it is damaged."""
    try:
        kind, words = answer_of(line[max(line.rfind("$"), 0) :])
    except LineError:
        figures["damaged_frames"] += 1
        return "", []
    if kind == "N":
        figures["damaged_frames"] += 1
    return kind, words
