"""The board on the desk, simulated: run firmware and play the world around it.

An AVR program runs on ``auvest-board``, which counts cycles, stack and sleep to the cycle and
refuses what a real chip would let pass in silence: resets, accesses outside of the memory, a
stack that reaches the data. Program and world are in lock-step, so a run is deterministic::

    with Board("sketch.elf", watch=["PORTB7"]) as board:
        for event in board:
            if isinstance(event, SerialLine) and event.text.startswith("?"):
                board.send("12.5,0.31", delay_s=0.02)
    print(board.report.awake_share)

The power can be cut: what the EEPROM held is in the file ``eeprom``, and another `Board` with the
same file starts from it; all else is lost. A byte that was being written reads back as anything.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from auvest._arguments import as_number

_HOW_TO_BUILD = (
    "build it with `cmake -S . -B build/firmware -D AUVEST_BUILD_FIRMWARE=ON && "
    "cmake --build build/firmware --target auvest-board` and put it on the PATH, or name it in "
    "the environment variable AUVEST_BOARD"
)

# Every byte is a character.
_ENCODING = "latin-1"


@dataclass(frozen=True)
class SerialLine:
    """The program has sent a line on its first serial port.

    Attributes
    ----------
    time_s : float
        When the stop bit of its newline had passed, in simulated time.
    text : str
        Without the line's end; each character is one byte (Latin-1).
    cycle : int
        The time as a number of clock cycles.
    """

    time_s: float
    text: str
    cycle: int


@dataclass(frozen=True)
class PinChange:
    """A watched pin has a new level.

    Attributes
    ----------
    time_s : float
        When the instruction that changed it began, in simulated time.
    pin : str
        Like ``PORTB7``.
    level : bool
        The new level.
    cycle : int
        The time as a number of clock cycles.
    """

    time_s: float
    pin: str
    level: bool
    cycle: int


@dataclass(frozen=True)
class WaitsForInput:
    """The program waits in ``board::read`` for bytes; see `Board.feed`.

    Attributes
    ----------
    time_s : float
        Simulated time.
    output : bytes
        What ``board::write`` has written since the last of these events.
    cycle : int
        The time as a number of clock cycles.
    """

    time_s: float
    output: bytes
    cycle: int


@dataclass(frozen=True)
class Section:
    """Passes through a section of the program, between ``board::begin`` and ``board::end``.

    Attributes
    ----------
    count : int
        Number of passes.
    first, minimum, median, maximum : int
        Cycles of a pass, interrupts included.
    stack_bytes : int
        Deepest stack below the stack pointer at the section's beginning.
    """

    count: int
    first: int
    minimum: int
    median: int
    maximum: int
    stack_bytes: int


@dataclass(frozen=True)
class Report:
    """What a run has measured.

    Attributes
    ----------
    reason : str
        Why it ended: finished, elapsed, stopped or cut; or, as a failure, failed, crashed, reset,
        illegal access, stack overflow or limit.
    message : str
        What happened and where, for a failure.
    frequency_hz : int
        Clock frequency.
    cycles : int
        Length of the run.
    cycles_asleep : int
        Of those, cycles in which the chip slept.
    ram_end : int
        Last address of the memory: the stack begins there.
    static_end : int
        First address after the static data: the heap begins there.
    heap_bytes : int
        Heap in use at the end.
    lowest_stack_pointer : int
        Lowest stack pointer of the run.
    serial_overruns : int
        Bytes that the program lost because it did not read them in time.
    sections : mapping of int to Section
        The sections that were passed at least once.
    pins : tuple of PinChange
        Changes of the watched pins.
    """

    reason: str
    message: str
    frequency_hz: int
    cycles: int
    cycles_asleep: int
    ram_end: int
    static_end: int
    heap_bytes: int
    lowest_stack_pointer: int
    serial_overruns: int
    sections: Mapping[int, Section]
    pins: tuple[PinChange, ...]

    @classmethod
    def from_json(cls, text: str) -> Report:
        """Read the runner's report.

        Parameters
        ----------
        text : str
            What ``auvest-board --report`` has written.

        Returns
        -------
        Report
            The same, typed.
        """
        fields: dict[str, Any] = json.loads(text)
        sections = {int(k): Section(**v) for k, v in fields.pop("sections").items()}
        frequency = fields["frequency_hz"]
        pins = tuple(PinChange(time_s=p["cycle"] / frequency, **p) for p in fields.pop("pins"))
        return cls(sections=sections, pins=pins, **fields)

    @property
    def time_s(self) -> float:
        """Length of the run in simulated time."""
        return self.cycles / self.frequency_hz

    @property
    def awake_share(self) -> float:
        """Share of the time in which the chip did not sleep."""
        return 1 - self.cycles_asleep / self.cycles

    @property
    def stack_bytes(self) -> int:
        """Deepest stack of the run."""
        return self.ram_end - self.lowest_stack_pointer

    @property
    def free_bytes(self) -> int:
        """Memory that neither data, nor heap, nor the deepest stack has used."""
        return self.lowest_stack_pointer + 1 - self.static_end - self.heap_bytes


@dataclass(frozen=True)
class Finished:
    """The run is over, without a failure.

    Attributes
    ----------
    report : Report
        What it has measured.
    """

    report: Report


Event = SerialLine | PinChange | WaitsForInput | Finished


class BoardError(RuntimeError):
    """The program failed, or did something that a chip must not do.

    Attributes
    ----------
    report : Report
        What was measured until then; ``reason`` and ``message`` say what happened.
    """

    def __init__(self, report: Report) -> None:
        super().__init__(report)
        self.report = report

    def __str__(self) -> str:
        return f"{self.report.reason}: {self.report.message}"


def find_runner(runner: str | os.PathLike[str] | None = None) -> Path:
    """Find ``auvest-board``.

    Parameters
    ----------
    runner : path, optional
        Where it is; by default the environment variable AUVEST_BOARD says so, else the PATH.

    Returns
    -------
    Path
        The program.

    Raises
    ------
    FileNotFoundError
        If it is not there; the message says how to build it.
    """
    named = runner or os.environ.get("AUVEST_BOARD")
    found = shutil.which(named or "auvest-board")
    if found is None:
        raise FileNotFoundError(f"no program {named or 'auvest-board'}: {_HOW_TO_BUILD}")
    return Path(found)


class Board:
    """A program for an AVR on a simulated board; a context manager.

    Iterate over it for its events. While an event is being handled the chip stands still; it
    goes on when the next event is asked for. Leaving the block stops a run that is not over.

    Parameters
    ----------
    elf : path
        The program.
    runner : path, optional
        The program ``auvest-board``; see `find_runner`.
    watch : sequence of str
        Pins whose changes are events, like ``PORTB7``; ``all`` is every pin.
    limit_s : float
        Simulated time after which a program that has not finished has failed.
    for_s : float, optional
        Run for exactly this long instead; that is success.
    mcu : str
        The chip.
    frequency_hz : int
        Its clock.
    input : path, optional
        File of the bytes for ``board::read``.
    output : path, optional
        File for the bytes from ``board::write``, written at the end.
    raw : bool
        Where ``input`` ends, the program's ``board::read`` waits, which is an event, for what
        `feed` gives it: bytes in both directions that no baud rate holds up.
    eeprom : path, optional
        File of what the EEPROM holds, read at the start and written at the end. One that is not
        there is erased memory.
    reset_cause : str
        What the program's MCUSR says: ``power-on``, ``external``, ``brown-out`` or ``watchdog``.
    cut_cycle : int, optional
        The cycle in which the power goes off; see also `cut`.
    seed : int
        Decides what a byte of EEPROM that is being written at a cut reads back as.

    Raises
    ------
    FileNotFoundError
        If the program or the runner is not there.
    ValueError
        If the runner refuses an argument.
    """

    def __init__(
        self,
        elf: str | os.PathLike[str],
        *,
        runner: str | os.PathLike[str] | None = None,
        watch: Sequence[str] = (),
        limit_s: float = 60.0,
        for_s: float | None = None,
        mcu: str = "atmega2560",
        frequency_hz: int = 16_000_000,
        input: str | os.PathLike[str] | None = None,
        output: str | os.PathLike[str] | None = None,
        raw: bool = False,
        eeprom: str | os.PathLike[str] | None = None,
        reset_cause: str = "power-on",
        cut_cycle: int | None = None,
        seed: int = 1,
    ) -> None:
        if isinstance(watch, str):
            raise ValueError(f"watch must be a sequence of pins; got the string {watch!r}")
        if not Path(elf).is_file():
            raise FileNotFoundError(f"elf: no file {os.fspath(elf)}")
        self.frequency_hz = frequency_hz
        self._command = [os.fspath(find_runner(runner)), "--interactive"]
        self._command += ["--mcu", mcu, "--frequency", str(frequency_hz)]
        if for_s is None:
            self._command += ["--limit", repr(as_number("limit_s", limit_s, "positive"))]
        else:
            self._command += ["--for", repr(as_number("for_s", for_s, "positive"))]
        for pin in watch:
            self._command += ["--watch", pin]
        if input is not None:
            self._command += ["--input", os.fspath(input)]
        if output is not None:
            self._command += ["--output", os.fspath(output)]
        if raw:
            self._command.append("--raw")
        if eeprom is not None:
            self._command += ["--eeprom", os.fspath(eeprom)]
        self._command += ["--reset-cause", reset_cause, "--seed", str(seed)]
        if cut_cycle is not None:
            self._command += ["--cut", str(cut_cycle)]
        self._command += ["--", os.fspath(elf)]
        self._process: subprocess.Popen[bytes] | None = None
        self._waiting = False  # the runner waits for commands
        self._report: Report | None = None

    def __enter__(self) -> Board:
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        try:
            self._receive()  # start
        except BaseException:
            self._close()
            raise
        self._waiting = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if self._waiting and kind is None:
                self._write("stop")
                self._next()
        finally:
            self._close()

    def __iter__(self) -> Iterator[Event]:
        while self._report is None:
            self._write("go")
            yield self._next()

    def send(self, text: str, delay_s: float = 0.0) -> None:
        """Send a line to the program's first serial port.

        Parameters
        ----------
        text : str
            The line, without its end; each character is one byte (Latin-1).
        delay_s : float
            From the event being handled to the line's first start bit. A line that is being
            sent then is finished first.

        Raises
        ------
        ValueError
            If the text holds a newline or a character that is no byte, or the delay is negative.
        RuntimeError
            If the run is over.
        """
        if "\n" in text:
            raise ValueError(f"text must be one line; got {text!r}")
        try:
            text.encode(_ENCODING)
        except UnicodeEncodeError:
            raise ValueError(f"text must have one byte per character; got {text!r}") from None
        delay = as_number("delay_s", delay_s, "not negative")
        self._write(f"send {round(delay * self.frequency_hz)} {text}", keep_waiting=True)

    def feed(self, data: bytes) -> None:
        """Give the program bytes for ``board::read``, which are there at once.

        A program that waits for some, and gets none before the next event is asked for, has failed.

        Raises
        ------
        RuntimeError
            If the run is over.
        """
        self._write(f"feed {data.hex()}", keep_waiting=True)

    def cut(self, delay_s: float = 0.0) -> None:
        """Cut the power: the run ends, as ``cut``, and what the EEPROM holds is kept.

        Parameters
        ----------
        delay_s : float
            From the event being handled to the cut. It takes the place of one planned before.

        Raises
        ------
        ValueError
            If the delay is negative.
        RuntimeError
            If the run is over.
        """
        delay = as_number("delay_s", delay_s, "not negative")
        self._write(f"cut {round(delay * self.frequency_hz)}", keep_waiting=True)

    def run(self) -> Report:
        """Let the program run to its end; nobody reacts to it.

        Returns
        -------
        Report
            What it has measured.
        """
        for _ in self:
            pass
        return self.report

    @property
    def report(self) -> Report:
        """What the run has measured, once it is over.

        Raises
        ------
        RuntimeError
            If it is not over.
        """
        if self._report is None:
            raise RuntimeError("the run is not over: there is no report yet")
        return self._report

    def _write(self, command: str, *, keep_waiting: bool = False) -> None:
        if not self._waiting:
            raise RuntimeError("the board is not running: use it inside `with Board(...)`")
        self._waiting = keep_waiting
        self._pipe("stdin").write(f"{command}\n".encode(_ENCODING))
        self._pipe("stdin").flush()

    def _receive(self) -> tuple[str, str]:
        """Read a message of the runner: its kind and the rest."""
        message = self._pipe("stdout").readline().decode(_ENCODING).removesuffix("\n")
        kind, _, rest = message.partition(" ")
        if not kind:
            raise self._refusal()
        return kind, rest

    def _next(self) -> Event:
        kind, rest = self._receive()
        if kind == "report":
            return self._end(Report.from_json(rest))
        self._waiting = True
        cycle, _, text = rest.partition(" ")
        time_s = int(cycle) / self.frequency_hz
        if kind == "pin":
            pin, level = text.split()
            return PinChange(time_s=time_s, pin=pin, level=level == "1", cycle=int(cycle))
        if kind == "input":
            return WaitsForInput(time_s=time_s, output=bytes.fromhex(text), cycle=int(cycle))
        return SerialLine(time_s=time_s, text=text, cycle=int(cycle))

    def _end(self, report: Report) -> Finished:
        self._report = report
        assert self._process is not None
        code = self._process.wait()  # an output file is complete when the runner has ended
        if code not in (0, 1):
            raise self._refusal()
        if code == 1:
            raise BoardError(report)
        return Finished(report)

    def _refusal(self) -> ValueError:
        """Return what the runner said about its arguments or files before it ended."""
        text = self._pipe("stderr").read().decode().strip().removeprefix("auvest-board: ")
        return ValueError(text or "auvest-board ended without a report")

    def _pipe(self, name: str) -> IO[bytes]:
        return getattr(self._process, name)

    def _close(self) -> None:
        assert self._process is not None
        self._waiting = False
        self._process.kill()
        self._process.communicate()
