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
from auvest.board import Board, PinChange, Report, SerialLine
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


WRONG = ("mixes", "older", "other_state", "age_wrong")


@dataclass
class _Begun:
    """A checkpoint as the sketch announced it."""

    sequence: int
    sum: int
    belief_s: float  #: the moment of what is in it
    announced_s: float


@dataclass
class _History:
    now_s: float = 1000.0
    begun: list[_Begun] = field(default_factory=list)
    complete: _Begun | None = None  #: the newest that must be whole
    under_way: _Begun | None = None  #: begun after that, in this life
    torn: _Begun | None = None  #: begun after that, and cut


def attack(
    elf: Path,
    cuts: int,
    seed: int = 1,
    *,
    longest_life_s: float = 4.5,
    longest_off_s: float = 60.0,
    runner: Path | None = None,
) -> Found:
    """Cut the power of a board with the sketch ``power_cuts`` so often, and let it start again."""
    dice = random.Random(seed)
    found, history, craft = Found(), _History(), Craft()
    with tempfile.TemporaryDirectory() as folder:
        eeprom, clock = Path(folder) / "eeprom", False
        for cut in range(cuts):
            life_s = dice.uniform(0, 0.7 if dice.random() < 0.3 else longest_life_s)
            clock ^= dice.random() < 0.2
            before = newest(eeprom.read_bytes()) if eeprom.exists() else None
            _live(elf, eeprom, life_s, cut, clock, before, history, craft, found, runner)
            found.cuts += 1
            history.now_s += life_s + dice.uniform(0, longest_off_s)
    return found


def _live(
    elf: Path,
    eeprom: Path,
    life_s: float,
    seed: int,
    clock: bool,
    before: Checkpoint | None,
    history: _History,
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
                _judge(cells, at_s, clock, before, history, found)
            else:
                _complete(history, at_s)
                history.torn = None  # what is written now takes its slot
                begun = _Begun(int(cells[0]), int(cells[2]), belief_s, at_s)
                history.begun.append(begun)
                history.under_way = begun
    found.cut_before_resuming += not resumed
    _complete(history, history.now_s + life_s)
    found.cut_while_writing += history.under_way is not None
    history.torn = history.under_way or history.torn
    history.under_way = None


def _complete(history: _History, at_s: float) -> None:
    """By now, what was begun in this life may be whole."""
    begun = history.under_way
    if begun is not None and at_s > begun.announced_s + SLOT * BYTE_S:
        history.complete, history.under_way = begun, None


def _judge(
    cells: Sequence[str],
    at_s: float,
    clock: bool,
    before: Checkpoint | None,
    history: _History,
    found: Found,
) -> None:
    """Hold what a start has resumed from against what was there."""
    sequence, total = int(cells[0]), int(cells[2])
    least, most, x, y = (struct.unpack(">f", bytes.fromhex(cells[i]))[0] for i in (3, 4, 6, 7))
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


# ---- What it costs ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cost:
    """Cycles of one checkpoint, all that it wakes the chip for, and of the filter in a period."""

    checkpoint: float
    filter: float
    period_s: float

    @property
    def share(self) -> float:
        """Of the filter's time."""
        return self.checkpoint / self.filter

    @property
    def share_of_all(self) -> float:
        """Of all time."""
        return self.checkpoint / (self.period_s * 16e6)


def edited(folder: Path, settings: dict[str, str], *, marks: bool = False) -> Path:
    """Copy the sketch to ``folder``, with other settings; ``marks``: the filter is section 1."""
    target = folder / "power_cuts"
    shutil.copytree(SKETCH, target)
    config = (target / "config.h").read_text(encoding="utf-8")
    for name, value in settings.items():
        before, found, rest = config.partition(f" {name} = ")
        assert found, name
        config = f"{before} {name} = {value};{rest.partition(';')[2]}"
    (target / "config.h").write_text(config, encoding="utf-8")
    if marks:
        shutil.copy(ROOT / "firmware" / "board" / "board.hpp", target)
        sketch = target / "power_cuts.ino"
        text = '#include "board.hpp"\n' + sketch.read_text(encoding="utf-8")
        begin, end = "  sample.status = filter.predict(dt);", "  // What is kept, and the line."
        assert text.count(begin) == text.count(end) == 1
        text = text.replace(begin, f"  board::begin(1);\n{begin}")
        text = text.replace(end, f"  board::end(1);\n{end}")
        sketch.write_text(text, encoding="utf-8")
    return target


def compiled(folder: Path, settings: dict[str, str], *, marks: bool = False) -> Path:
    """Compile the sketch with other settings."""
    library = package(folder / "library")
    return compile_sketch(edited(folder, settings, marks=marks), library, folder / "built").elf


def run_quietly(elf: Path, for_s: float, runner: Path | None = None) -> Report:
    """Run the sketch without a cut."""
    craft = Craft()
    with Board(elf, runner=runner, for_s=for_s) as board:
        for event in board:
            if isinstance(event, SerialLine):
                reply = craft.answer(event.text, event.time_s, clock=False)
                if reply is not None:
                    board.send(reply, 0.005)
            assert not isinstance(event, PinChange)
    return board.report


def cost(with_: Path, without: Path, period_s: float, runner: Path | None = None) -> Cost:
    """Compare two builds of the sketch: one that keeps a checkpoint each period, and one that does
    not."""  # noqa: D205, D209
    periods = 3
    for_s = (periods + 0.5) * period_s
    kept, bare = (run_quietly(elf, for_s, runner) for elf in (with_, without))
    awake = [report.cycles - report.cycles_asleep for report in (kept, bare)]
    section = bare.sections[1]
    return Cost(
        checkpoint=(awake[0] - awake[1]) / periods,
        filter=section.count * section.median / (periods + 0.5),
        period_s=period_s,
    )


def main(arguments: list[str] | None = None) -> int:
    """Attack; 1 if a start went on from anything but what it should, or the writing costs more."""
    parser = argparse.ArgumentParser(
        prog="python -m firmware.power_cuts",
        description="Cut the power of the simulated board at random moments.",
    )
    parser.add_argument("--cuts", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name) / part for part in ("often", "kept", "bare")]
        for folder in folders:
            folder.mkdir()
        often = compiled(folders[0], {"kCheckpointPeriod": "2"})
        kept = compiled(folders[1], {}, marks=True)
        bare = compiled(folders[2], {"kCheckpointPeriod": "1e9f"}, marks=True)
        found = attack(often, options.cuts, options.seed)
        costs = cost(kept, bare, 30.0)
    years = endurance_years(MEMORY, SLOT, 30.0)
    said = {
        **vars(found),
        "cycles_per_checkpoint": round(costs.checkpoint),
        "share_of_filter": round(costs.share, 5),
        "share_of_time": round(costs.share_of_all, 7),
        "endurance_years": round(years, 2),
    }
    if options.json:
        print(json.dumps(said, indent=2))
    else:
        for key, value in said.items():
            print(f"{key.replace('_', ' '):24}{value:,}")
    return int(any(getattr(found, name) for name in WRONG) or costs.share > 0.02)


if __name__ == "__main__":
    sys.exit(main())
