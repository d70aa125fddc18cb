"""Cut the power of a board at random moments, and see from what it goes on.

``python -m firmware.power_cuts`` runs the sketch ``power_cuts`` on the simulated board, in a craft
that moves between its beacons, and cuts the power: while it starts, while it writes a checkpoint,
and in between. A byte of EEPROM that is being written then reads back as anything. For some time
the board is off; then it starts again from the same EEPROM. Each start must resume from the newest
checkpoint that was begun or, where that was not complete, from the one before; never from a mix;
and it must say a bound of the checkpoint's age that holds.

What checkpoints cost is measured beside it: cycles awake with them and without.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import shutil
import struct
import sys
import tempfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from auvest import telemetry
from auvest.board import Board, Report, SerialLine
from auvest.firmware.package import package
from auvest.firmware.sketch import compile_sketch

ROOT = Path(__file__).resolve().parents[1]
SKETCH = ROOT / "firmware" / "library" / "examples" / "power_cuts"

#: What a byte of EEPROM bears, by the datasheet.
WRITES = 100_000
#: One byte, erased and written [s].
BYTE_S = 3.4e-3
#: Bytes of a slot before the payload: header, sequence, time.
BEFORE = 21
#: Bytes that the checkpoints have in the EEPROM of an ATmega2560, and one of the sketch.
MEMORY = 4096 - 16
SLOT = BEFORE + 4 * (4 + 10) + 30 + 4
#: A start that lives for so long has been counted [s].
COUNTED_S = 0.1
#: Progress is said after so many cuts.
PROGRESS = 100
_YEAR_S = 365.25 * 86400


def endurance_years(memory_bytes: int, slot_bytes: int, period_s: float) -> float:
    """Years of being switched on until a byte has been written as often as it bears.

    The slots are written in turn: a byte once in as many periods as there are slots.
    """
    return memory_bytes // slot_bytes * WRITES * period_s / _YEAR_S


@dataclass(frozen=True)
class Checkpoint:
    """One that lies in the EEPROM, whole."""

    sequence: int
    sum: int
    payload: bytes


def newest(eeprom: bytes, kind: int = 1) -> Checkpoint | None:
    """Read what the EEPROM holds, as the format says it (auvest/board/checkpoint_ring.hpp)."""
    slots = MEMORY // SLOT
    found = None
    for place in range(slots):
        slot = eeprom[place * SLOT : (place + 1) * SLOT]
        header, sequence = struct.unpack_from("<II", slot)
        (total,) = struct.unpack("<I", slot[-4:])
        ours = header == kind << 16 | SLOT and sequence % slots == place and sequence > 0
        if ours and zlib.crc32(slot[:-4]) == total and (not found or sequence > found.sequence):
            found = Checkpoint(sequence, total, slot[BEFORE:-4])
    return found


class Craft:
    """Goes to and fro between the beacons, slowly; its clock is right."""

    beacons = ((0.0, 0.0), (80.0, 0.0), (40.0, 70.0))

    def answer(self, line: str, at_s: float, *, clock: bool) -> str | None:
        """Give the sonar's or the clock's answer to what the sketch asks, if it asks."""
        sample = telemetry.requested_sample(line)
        if sample is not None:
            x, y = self.position(at_s)
            beacon = sample % 3
            bx, by = self.beacons[beacon]
            distance = telemetry.decimal(math.hypot(x - bx, y - by), 3)
            return telemetry.frame(f"RANGE,{sample},{distance},{beacon}")
        sample = telemetry.requested_sample(line, "CLOCK")
        if sample is not None and clock:
            days, seconds = divmod(int(at_s), 86400)
            return telemetry.frame(f"CLOCK,{sample},{days + 20},{seconds}")
        return None

    def position(self, at_s: float) -> tuple[float, float]:
        """Where it is."""
        return 40 + 20 * math.sin(at_s / 200), 25 + 10 * math.cos(at_s / 200)


@dataclass
class Found:
    """What all starts have said; what must be 0 is listed in `WRONG`."""

    cuts: int = 0
    cut_while_writing: int = 0  #: a checkpoint was under way
    resumed_newest: int = 0  #: from the last that was begun
    resumed_one_before: int = 0  #: the last was not complete
    resumed_none: int = 0  #: there was none yet
    cut_before_resuming: int = 0  #: a start that did not come so far
    mixes: int = 0  #: a checkpoint that was never begun so
    older: int = 0  #: there was a newer one that was complete
    other_state: int = 0  #: the filter is not where the checkpoint has it
    age_wrong: int = 0  #: the age is not within the bounds that were said
    longest_age_s: float = 0.0
    longest_bound_s: float = 0.0
    with_clock: int = 0
    widest_with_clock_s: float = 0.0  #: distance of the bounds


#: Of the filter's time, for keeping.
MOST_SHARE = 0.02

WRONG = ("mixes", "older", "other_state", "age_wrong")


@dataclass
class Begun:
    """A checkpoint as the sketch announced it."""

    sequence: int
    sum: int
    belief_s: float  #: the moment of what is in it
    announced_s: float


@dataclass
class History:
    """What the desk knows of the EEPROM, from what the sketch said and how long it lived."""

    now_s: float = 1000.0
    begun: list[Begun] = field(default_factory=list)
    complete: Begun | None = None  #: the newest that must be whole
    under_way: Begun | None = None  #: begun after that, in this life
    torn: Begun | None = None  #: begun after that, and cut


def attack(
    elf: Path,
    cuts: int,
    seed: int = 1,
    *,
    longest_life_s: float = 4.5,
    longest_off_s: float = 60.0,
    runner: Path | None = None,
) -> Found:
    """Cut the power of a board with the sketch ``power_cuts`` so often, and let it start again.

    The board is off for up to ``longest_off_s``, with what starts it has in between that are too
    short to be counted.
    """
    dice = random.Random(seed)
    found, history, craft = Found(), History(), Craft()
    with tempfile.TemporaryDirectory() as folder:
        eeprom, clock, left_s = Path(folder) / "eeprom", False, longest_off_s
        for cut in range(cuts):
            life_s = dice.uniform(0, 0.7 if dice.random() < 0.3 else longest_life_s)
            clock ^= dice.random() < 0.2
            before = newest(eeprom.read_bytes()) if eeprom.exists() else None
            _live(elf, eeprom, life_s, cut, clock, before, history, craft, found, runner)
            found.cuts += 1
            left_s = longest_off_s if life_s > COUNTED_S else left_s - life_s
            off_s = dice.uniform(0, max(left_s, 0.0))
            left_s -= off_s
            history.now_s += life_s + off_s
            if found.cuts % PROGRESS == 0:
                print(f"{found.cuts} of {cuts} cuts", file=sys.stderr, flush=True)
    return found


def _live(
    elf: Path,
    eeprom: Path,
    life_s: float,
    seed: int,
    clock: bool,
    before: Checkpoint | None,
    history: History,
    craft: Craft,
    found: Found,
    runner: Path | None,
) -> None:
    """Let the board run from a start to a cut."""
    frequency = 16_000_000
    resumed = False
    belief_s = 0.0
    with Board(
        elf, runner=runner, eeprom=eeprom, cut_cycle=max(1, round(life_s * frequency)), seed=seed
    ) as board:
        for event in board:
            if not isinstance(event, SerialLine):
                continue
            at_s = history.now_s + event.time_s
            reply = craft.answer(event.text, at_s, clock=clock)
            if reply is not None:
                board.send(reply, 0.005)
            if event.text.startswith("$PING"):
                belief_s = at_s
            if not event.text.startswith(("$RESUME", "$SAVE")):
                continue
            kind, *cells = telemetry.body_of(event.text).split(",")
            if kind == "RESUME":
                resumed = True
                belief_s = at_s
                judge(cells, at_s, clock, before, history, found)
            else:
                _complete(history, at_s)
                history.torn = None  # what is written now takes its slot
                begun = Begun(int(cells[0]), int(cells[1], 16), belief_s, at_s)
                history.begun.append(begun)
                history.under_way = begun
    found.cut_before_resuming += not resumed
    _complete(history, history.now_s + life_s)
    found.cut_while_writing += history.under_way is not None
    history.torn = history.under_way or history.torn
    history.under_way = None


def _complete(history: History, at_s: float) -> None:
    """By now, what was begun in this life may be whole."""
    begun = history.under_way
    if begun is not None and at_s > begun.announced_s + SLOT * BYTE_S:
        history.complete, history.under_way = begun, None


def number(bits: str) -> float:
    """Read a float of 8 hexadecimal digits."""
    return struct.unpack(">f", bytes.fromhex(bits))[0]


def judge(
    cells: Sequence[str],
    at_s: float,
    clock: bool,
    before: Checkpoint | None,
    history: History,
    found: Found,
) -> None:
    """Hold what a start has resumed from against what was there."""
    sequence, total = int(cells[0]), int(cells[2], 16)
    least, most, x, y = (number(cells[i]) for i in (3, 4, 6, 7))
    torn, complete = history.torn, history.complete
    if sequence == 0:
        found.resumed_none += 1
        found.older += complete is not None
        return
    same = [b for b in history.begun if (b.sequence, b.sum) == (sequence, total)]
    if not same:
        found.mixes += 1
        return
    begun = same[-1]
    if begun is torn or (torn is None and begun is complete):
        found.resumed_newest += 1
        history.complete = begun
    elif begun is complete:
        found.resumed_one_before += 1
    else:
        found.older += 1
    position = struct.unpack_from("<ff", before.payload) if before else None
    found.other_state += before is None or (before.sequence, before.sum) != (sequence, total)
    found.other_state += position != (x, y)
    age = at_s - begun.belief_s
    found.age_wrong += not least <= age <= most
    found.longest_age_s = max(found.longest_age_s, age)
    found.longest_bound_s = max(found.longest_bound_s, most)
    if clock and most - least < 10:
        found.with_clock += 1
        found.widest_with_clock_s = max(found.widest_with_clock_s, most - least)


# ---- What it costs -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cost:
    """What keeping takes.

    Attributes
    ----------
    checkpoint_cycles : float
        Of one checkpoint: to copy it, to sum it up, to announce it, and all that the EEPROM's
        interrupt wakes the chip for.
    filter_cycles : float
        Of the filter's predictions and updates in a second.
    """

    checkpoint_cycles: float
    filter_cycles: float

    def share(self, period_s: float) -> float:
        """Give the share of the filter's time, with a checkpoint in each period."""
        return self.checkpoint_cycles / (period_s * self.filter_cycles)


def measure(often: Path, never: Path, period_s: float, runner: Path | None = None) -> Cost:
    """Compare the sketch with a checkpoint in each period and without; both have marks."""
    periods = 4
    for_s = (periods + 0.5) * period_s
    kept, bare = (run_quietly(elf, for_s, runner) for elf in (often, never))
    awake = [report.cycles - report.cycles_asleep for report in (kept, bare)]
    section = bare.sections[1]
    return Cost((awake[0] - awake[1]) / periods, section.count * section.median / for_s)


def run_quietly(elf: Path, for_s: float, runner: Path | None = None) -> Report:
    """Run the sketch without a cut."""
    craft = Craft()
    with Board(elf, runner=runner, for_s=for_s) as board:
        for event in board:
            if isinstance(event, SerialLine):
                reply = craft.answer(event.text, event.time_s, clock=False)
                if reply is not None:
                    board.send(reply, 0.005)
    return board.report


# ---- The sketch ----------------------------------------------------------------------------------


def setting(name: str) -> float:
    """Read a setting of the sketch."""
    config = (SKETCH / "config.h").read_text(encoding="utf-8")
    return float(config.partition(f" {name} = ")[2].partition(";")[0])


def edited(folder: Path, checkpoint_period: str) -> Path:
    """Copy the sketch, with another period and the filter marked as section 1."""
    target = folder / SKETCH.name
    shutil.copytree(SKETCH, target)
    shutil.copy(ROOT / "firmware" / "board" / "board.hpp", target)
    begin, end = "  sample.status = filter.predict(dt);", "  // What is kept, and the line."
    period = " kCheckpointPeriod = "
    for name, old, new in (
        (
            "config.h",
            f"{period}{setting('kCheckpointPeriod'):.0f};",
            f"{period}{checkpoint_period};",
        ),
        ("power_cuts.ino", begin, f"  board::begin(1);\n{begin}"),
        ("power_cuts.ino", end, f"  board::end(1);\n{end}"),
        ("power_cuts.ino", "#include <Arduino.h>", '#include <Arduino.h>\n#include "board.hpp"'),
    ):
        text = (target / name).read_text(encoding="utf-8")
        assert text.count(old) == 1, old
        (target / name).write_text(text.replace(old, new), encoding="utf-8")
    return target


#: For the attack, and for what it costs: how often the sketch keeps a checkpoint.
OFTEN_S = 2.0
OFTEN, NEVER = "2", "1e9f"


def main(arguments: list[str] | None = None) -> int:
    """Attack; 1 if a start went on from anything but what it should, or keeping costs too much."""
    parser = argparse.ArgumentParser(
        prog="python -m firmware.power_cuts",
        description="Cut the power of the simulated board at random moments.",
    )
    parser.add_argument("--cuts", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        elves = []
        for period in (OFTEN, NEVER):
            folder = Path(name) / period
            folder.mkdir()
            library = package(Path(name) / "library")
            elf = compile_sketch(edited(folder, period), library, Path(name) / "built").elf
            elves.append(Path(shutil.copy(elf, folder / "power_cuts.elf")))
        cost = measure(elves[0], elves[1], OFTEN_S)
        found = attack(elves[0], options.cuts, options.seed)
    period_s = setting("kCheckpointPeriod")
    said = {
        **vars(found),
        "cycles_per_checkpoint": round(cost.checkpoint_cycles),
        "share_of_filter": round(cost.share(period_s), 5),
        "endurance_years": round(endurance_years(MEMORY, SLOT, period_s), 2),
    }
    if options.json:
        print(json.dumps(said, indent=2))
    else:
        for key, value in said.items():
            print(f"{key.replace('_', ' '):24}{value:,}")
    return int(any(getattr(found, name) for name in WRONG) or cost.share(period_s) > MOST_SHARE)


if __name__ == "__main__":
    sys.exit(main())
