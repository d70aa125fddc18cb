"""Put a bench behind a pseudo-terminal, damage what passes, and play a log over it.

    python -m firmware.hil_line LOG [--config FILE] [--filter NAME] [--rows N]
        [--bench host|atmega2560|atmega2560-uart] [--damage 0.01] [--seed 1]

The port is one as a board's, and ``auvest hil --target serial:PORT`` plays to it. On the simulated
MEGA2560 bytes are there at once; ``atmega2560-uart`` has its serial port, at 115,200 baud. In both
directions a frame in a hundred loses or changes bits, bytes or parts, comes twice, loses its end or
is lost. The bits must be those of the desk; exit code 1 if they are not.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from auvest.board import Board, SerialLine, WaitsForInput
from auvest.firmware import hil, simulator
from auvest.firmware.hil_bench import Bench, bench
from auvest.logs import LogFolder
from auvest.models._compile import find_compiler
from auvest.replay import Settings, find_settings
from firmware.line_attack import damaged

#: What a bench says to a line, in the same moment: one line.
Answer = Callable[[str], str]


class Noise:
    """Damages frames on their way, and counts them.

    Parameters
    ----------
    share : float
        Of the frames, in each direction.
    seed : int
        Of what happens to which.
    """

    def __init__(self, share: float, seed: int = 1) -> None:
        self._share, self._dice = share, random.Random(seed)
        self._last = "$"
        self.damaged = 0

    def pass_on(self, line: str) -> bytes:
        """Give what comes of a line, its end included."""
        whole, before, self._last = f"{line}\n".encode("latin-1"), self._last, line
        if self._dice.random() >= self._share:
            return whole
        self.damaged += 1
        kind = self._dice.choice(("damage", "damage", "damage", "lose", "double", "no end"))
        if kind == "damage":
            return damaged(line, before, self._dice) + b"\n"
        return {"lose": b"", "double": whole + whole, "no end": whole[:-1]}[kind]


class Line:
    """A pseudo-terminal, and a thread that hands on what comes to a bench and back.

    Attributes
    ----------
    port : str
        Name of the serial port.
    """

    def __init__(self, first: str, answer: Answer, noise: Noise) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._first, self._answer, self._noise = first, answer, noise

    def serve(self) -> None:
        """Hand on until the port is closed."""
        try:
            self._serve()
        finally:
            os.close(self._master)

    def _serve(self) -> None:
        os.write(self._master, self._noise.pass_on(self._first))
        come = b""
        while True:
            try:
                received = os.read(self._master, 4096)
            except OSError:  # nobody has the other side any more
                return
            come += received
            *lines, come = come.split(b"\n")
            for line in lines:
                there = self._noise.pass_on(line.decode("latin-1"))
                *whole, rest = there.split(b"\n")
                come = rest + come
                for part in whole:
                    if part.strip(b"\r"):  # a bench says nothing to an empty line
                        said = self._answer(part.decode("latin-1"))
                        os.write(self._master, self._noise.pass_on(said))

    def close(self) -> None:
        """Unplug."""
        os.close(self._slave)


@contextmanager
def _on_host(program: Bench, folder: Path) -> Iterator[tuple[str, Answer]]:
    compiler, _ = find_compiler()
    built = hil.build_host(program, folder, compiler, ("-O0",))
    process = subprocess.Popen(
        [built], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="latin-1"
    )
    assert process.stdin is not None
    assert process.stdout is not None

    def answer(line: str) -> str:
        process.stdin.write(f"{line}\n")  # type: ignore[union-attr]
        process.stdin.flush()  # type: ignore[union-attr]
        return process.stdout.readline().rstrip("\n")  # type: ignore[union-attr]

    with process:
        yield process.stdout.readline().rstrip("\n"), answer
        process.kill()


@contextmanager
def _on_board(program: Bench, folder: Path) -> Iterator[tuple[str, Answer]]:
    """Not held to a baud rate."""
    compiled = hil.build_sketch(program, folder)
    runner = simulator.find_or_build()
    with Board(compiled.elf, runner=runner, limit_s=10.0 * len(program.rows), raw=True) as board:
        waits = (event for event in board if isinstance(event, WaitsForInput))

        def said() -> str:
            return next(waits).output.decode("ascii").rstrip("\n")

        def answer(line: str) -> str:
            board.feed(f"{line}\n".encode("latin-1"))
            return said()

        yield said(), answer


@contextmanager
def _on_serial_port(program: Bench, folder: Path) -> Iterator[tuple[str, Answer]]:
    compiled = hil.build_sketch(program, folder, serial=True)
    runner = simulator.find_or_build()
    with Board(compiled.elf, runner=runner, limit_s=10.0 * len(program.rows)) as board:
        events = iter(board)

        def said() -> str:
            return next(event.text for event in events if isinstance(event, SerialLine))

        def answer(line: str) -> str:
            board.send(line)
            return said()

        yield said(), answer


BENCHES = {"host": _on_host, "atmega2560": _on_board, "atmega2560-uart": _on_serial_port}


@contextmanager
def served(first: str, answer: Answer, noise: Noise) -> Iterator[Line]:
    """Give a bench a serial port."""
    line = Line(first, answer, noise)
    thread = threading.Thread(target=line.serve, daemon=True)
    thread.start()
    try:
        yield line
    finally:
        line.close()
        thread.join(timeout=10)


@contextmanager
def behind_a_port(where: str, program: Bench, folder: Path, noise: Noise) -> Iterator[Line]:
    """Build one of `BENCHES`, and give it a serial port."""
    with (
        BENCHES[where](program, folder) as (first, answer),
        served(first, answer, noise) as line,
    ):
        yield line


def main() -> int:
    """Run the command line."""
    text = (__doc__ or "").splitlines()[0]
    parser = argparse.ArgumentParser(prog="firmware.hil_line", description=text)
    parser.add_argument("log", type=Path, metavar="LOG", help="folder of a log")
    parser.add_argument("--config", metavar="FILE", help="settings, as of auvest replay")
    parser.add_argument("--filter", metavar="NAME", help="(default: as of auvest replay)")
    parser.add_argument("--rows", type=int, help="so many rows (default: all)")
    parser.add_argument("--bench", choices=list(BENCHES), default="host", help="(default: host)")
    parser.add_argument("--damage", type=float, default=0.01, help="share (default: 0.01)")
    parser.add_argument("--seed", type=int, default=1, help="(default: 1)")
    given = parser.parse_args()
    settings = find_settings(given.config) if given.config else Settings()
    record = hil.record_of(LogFolder(given.log), settings, given.filter, rows=given.rows)
    noise = Noise(given.damage, given.seed)
    with (
        tempfile.TemporaryDirectory() as name,
        behind_a_port(given.bench, bench(record), Path(name), noise) as line,
    ):
        leg = hil.run(record, f"{hil.SERIAL}{line.port}", Path(name))
    print(json.dumps({**leg.document(record), "frames_hurt": noise.damaged}, indent=2))
    return 0 if leg.difference is None else 1


if __name__ == "__main__":
    sys.exit(main())
