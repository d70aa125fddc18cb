"""Damage lines in every way that a serial line has, and count those taken for another value.

``python -m firmware.line_attack`` damages answers to the sketch, which the chip's own parser reads
(``auvest/board/line.hpp``, compiled for the desk), and reports of the sketch, which
:class:`auvest.telemetry.Reader` reads. Taken for another value is what is believed, and is not what
was sent. ``--chip N --elf FILE`` damages N answers to ``tracking_loop`` on the simulated board.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from auvest import telemetry
from auvest.board import Board, SerialLine

ROOT = Path(__file__).resolve().parents[1]
#: Answers that fit between a request and the sketch's time-out.
PER_SAMPLE = 16
#: Bytes that are replaced or lost at once; a line that is shorter is damaged enough.
MOST_BYTES = 4

NAMES = (
    "sample#,time_s,dt_s,range_m,bearing_rad,desired_x_m,desired_y_m,x_m,y_m,vx_m_s,vy_m_s,"
    "ax_m_s2,ay_m_s2,P00_m2,P10_m2,P11_m2,nis,interval_s,status#,missed#,refused#,late#,awake_us#"
)
DESCRIPTION = telemetry.frame(f"COLUMNS,AUV,{NAMES}")


# ---- What a line does to text --------------------------------------------------------------------


def _flip_bits(line: bytearray, dice: random.Random) -> None:
    for place in dice.sample(range(8 * len(line)), dice.randint(1, 6)):
        line[place // 8] ^= 1 << place % 8


def _replace_bytes(line: bytearray, dice: random.Random) -> None:
    for place in dice.sample(range(len(line)), dice.randint(1, MOST_BYTES)):
        line[place] = dice.randrange(256)


def _burst(line: bytearray, dice: random.Random) -> None:
    size = dice.randint(1, 12)
    place = dice.randrange(len(line))
    line[place : place + size] = dice.randbytes(size)


def _lose_bytes(line: bytearray, dice: random.Random) -> None:
    count = dice.randint(1, MOST_BYTES)
    for place in sorted(dice.sample(range(len(line)), count), reverse=True):
        del line[place]


def _lose_equal_bytes(line: bytearray, dice: random.Random) -> None:
    """Two that are the same: what an exclusive or does not see."""
    chosen = dice.choice(line)
    places = [i for i, byte in enumerate(line) if byte == chosen]
    for place in sorted(dice.sample(places, min(2, len(places))), reverse=True):
        del line[place]


def _double_bytes(line: bytearray, dice: random.Random) -> None:
    for _ in range(dice.randint(1, 4)):
        place = dice.randrange(len(line))
        line.insert(place, line[place])


def _swap_bytes(line: bytearray, dice: random.Random) -> None:
    for _ in range(dice.randint(1, 2)):
        i, k = dice.sample(range(len(line)), 2)
        line[i], line[k] = line[k], line[i]


def _change_digits(line: bytearray, dice: random.Random) -> None:
    digits = [i for i, byte in enumerate(line) if 48 <= byte <= 57]
    for place in dice.sample(digits, min(len(digits), dice.randint(1, 3))):
        line[place] = dice.randrange(48, 58)


def _lose_part(line: bytearray, dice: random.Random) -> None:
    begin, end = sorted(dice.sample(range(len(line) + 1), 2))
    del line[begin:end]


def _repeat_part(line: bytearray, dice: random.Random) -> None:
    begin, end = sorted(dice.sample(range(len(line) + 1), 2))
    line[end:end] = line[begin:end]


def _cut(line: bytearray, dice: random.Random) -> None:
    """End the line within itself."""
    line.insert(dice.randrange(len(line)), 10)


Damage = Callable[[bytearray, random.Random], None]
DAMAGES: tuple[Damage, ...] = (
    _flip_bits, _replace_bytes, _burst, _lose_bytes, _lose_equal_bytes, _double_bytes, _swap_bytes,
    _change_digits, _lose_part, _repeat_part, _cut,
)  # fmt: skip


def damaged(line: str, other: str, dice: random.Random) -> bytes:
    """Damage a line once or twice; now and then it runs into the line before it."""
    whole = line.encode("latin-1")
    while True:
        text = bytearray(whole)
        if dice.random() < 0.1:
            text[:0] = other.encode("latin-1")[: dice.randrange(1, len(other))]
        for _ in range(dice.choice((1, 1, 2))):
            if len(text) >= MOST_BYTES:
                dice.choice(DAMAGES)(text, dice)
        if text and bytes(text) != whole:
            return bytes(text)


# ---- To the chip ---------------------------------------------------------------------------------


def _answer(dice: random.Random) -> tuple[int, str]:
    sample = dice.randrange(1, 100_000)
    return sample, telemetry.answer(sample, dice.uniform(0.1, 75.0), dice.uniform(-3.14, 3.14))


def attack_answers(count: int, dice: random.Random) -> dict[str, int]:
    """Damage answers, and let the chip's parser read them."""
    wrong = believed = 0
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "line_attack"
        source = ROOT / "firmware" / "line_attack.cpp"
        include = ROOT / "cpp" / "include"
        command = ["g++", "-std=c++11", "-O2", f"-I{include}", str(source), "-o", str(program)]
        subprocess.run(command, check=True)
        for done in range(0, count, 50_000):
            cases, sent = [], []
            for _ in range(min(50_000, count - done)):
                sample, line = _answer(dice)
                text = damaged(line, _answer(dice)[1], dice) + b"\r\n"
                cases.append(struct.pack("=II", sample, len(text)) + text)
                sent.append(tuple(map(telemetry.number, line[:-9].split(",")[2:])))
            run = subprocess.run([program], input=b"".join(cases), stdout=-1, check=True)
            heard = np.frombuffer(run.stdout, [("count", "u4"), ("z", "f4", 2)])
            assert len(heard) == len(cases)
            taken = heard["count"] > 0
            believed += int(taken.sum())
            wrong += int((heard["z"] != np.array(sent, np.float32)).any(axis=1)[taken].sum())
    return {"tried": count, "believed": believed, "accepted_wrong": wrong}


def attack_chip(
    count: int, dice: random.Random, elf: Path, runner: Path | None = None
) -> dict[str, int]:
    """Damage answers to the sketch on the simulated board; every tenth sample gets a whole one."""
    reader = telemetry.Reader()
    asked: dict[int, tuple[float, float] | None] = {}
    tried = wrong = believed = 0
    with Board(elf, runner=runner, limit_s=1e6) as board:
        for event in board:
            if not isinstance(event, SerialLine):
                continue
            sample = telemetry.requested_sample(event.text)
            if sample is not None:
                range_m, bearing_rad = 5 + 0.001 * (sample % 1000), 0.5
                line = telemetry.answer(sample, range_m, bearing_rad)
                numbers = tuple(float(telemetry.number(c)) for c in line[:-9].split(",")[2:])
                asked[sample] = (numbers[0], numbers[1])
                for _ in range(PER_SAMPLE if sample % 10 else 0):
                    text = damaged(line, line, dice).replace(b"\n", b"\r").decode("latin-1")
                    board.send(text, 0.001)
                    tried += 1
                if sample % 10 == 0:
                    board.send(line, 0.001)
                continue
            row = reader.read(event.text)
            if not isinstance(row, dict):
                continue
            measured = math.isfinite(row["range_m"])
            believed += measured and row["sample"] % 10 != 0
            wrong += measured and asked.pop(int(row["sample"])) != (
                row["range_m"],
                row["bearing_rad"],
            )
            if tried >= count:
                break
    return {"tried": tried, "believed": believed, "accepted_wrong": wrong}


# ---- From the chip -------------------------------------------------------------------------------


def _report(dice: random.Random) -> str:
    cells = [str(dice.randrange(1, 100_000)), f"{dice.uniform(0, 1e5):.6f}"]
    cells += [struct.pack(">f", dice.gauss(0, 100)).hex() for _ in range(16)]
    cells += [str(dice.randrange(3)), *(str(dice.randrange(100)) for _ in range(3)), "15000"]
    return telemetry.frame(",".join(["AUV", *cells]))


def attack_reports(count: int, dice: random.Random) -> dict[str, int]:
    """Damage reports and, one in ten, the names of their columns; let the desk read them."""
    wrong = believed = 0
    ready = telemetry.Reader()
    ready.read(DESCRIPTION)
    other = _report(dice)
    for _ in range(count):
        line = _report(dice)
        if dice.random() < 0.1:
            reader, expected = telemetry.Reader(), None
            for text in damaged(DESCRIPTION, line, dice).split(b"\n"):
                _heard(reader, text)
            taken = bool(reader.columns)
            wrong += taken and (reader.kind, reader.columns) != (ready.kind, ready.columns)
        else:
            expected = [ready.read(line), ready.read(other)]
            rows = [_heard(ready, text) for text in damaged(line, other, dice).split(b"\n")]
            rows = [row for row in rows if row is not None]
            taken = bool(rows)
            wrong += any(row not in expected for row in rows)
            other = line
        believed += taken
    return {"tried": count, "believed": believed, "accepted_wrong": wrong}


def _heard(reader: telemetry.Reader, text: bytes) -> object:
    try:
        return reader.read(text.decode("latin-1").rstrip("\r"))
    except telemetry.LineError:
        return None


def main(arguments: list[str] | None = None) -> int:
    """Attack both directions; 1 if a damaged line was taken for another value."""
    parser = argparse.ArgumentParser(
        prog="python -m firmware.line_attack",
        description="Damage lines to and from a board; count those taken for another value.",
    )
    parser.add_argument("--count", type=int, default=1_000_000, help="lines in each direction")
    parser.add_argument("--chip", type=int, default=0, help="answers on the simulated board")
    parser.add_argument("--elf", type=Path, help="the sketch tracking_loop, compiled, for --chip")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(arguments)
    if options.chip and options.elf is None:
        parser.error("--chip needs --elf")
    dice = random.Random(options.seed)
    found = {
        "answers": attack_answers(options.count, dice),
        "reports": attack_reports(options.count, dice),
    }
    if options.chip:
        found["chip"] = attack_chip(options.chip, dice, options.elf)
    if options.json:
        print(json.dumps(found, indent=2))
    else:
        for name, counts in found.items():
            said = ", ".join(f"{key.replace('_', ' ')} {n:,}" for key, n in counts.items())
            print(f"{name}: {said}")
    return int(any(counts["accepted_wrong"] for counts in found.values()))


if __name__ == "__main__":
    sys.exit(main())
