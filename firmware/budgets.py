"""Measure what auvest takes on the chip: flash, RAM, stack and cycles, on the simulated board.

    python -m firmware.budgets            compare with firmware/budgets.csv
    python -m firmware.budgets --write    write firmware/budgets.csv and its two pages of docs anew
    python -m firmware.budgets --target cortex-m0 --target atmega328p     these only

On the ATmega2560 every program is measured, on other chips one of each filter. On an AVR a program
is a sketch, compiled as the Arduino IDE does, with the library from its zip; cycles of the
simulated chip are exact: the same program takes the same number each time. Elsewhere it is compiled
with the options of Arduino's cores and runs in QEMU (firmware/chips.py), which counts no cycles.
"""

from __future__ import annotations

import argparse
import csv
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from auvest import mission_line, telemetry
from auvest.board import Board, BoardError, SerialLine, find_runner
from auvest.firmware.package import package
from auvest.firmware.sketch import MEGA2560, UNO, Compiled, SketchError, compile_sketch
from auvest.simulation import cooperative
from auvest.simulation.paper_aukf import FilterName, paper_filter, paper_noise
from auvest.simulation.tracking import Scenario, Track, simulate
from auvest.simulation.vehicle_in_the_loop import (
    PERIOD_S,
    ChipFlight,
    Vehicle,
    chip_mission,
    fly_simulated,
    new_pilot,
    new_world,
)
from firmware import chips
from firmware.chips import CHIPS, ChipError
from firmware.parity.slatf import fields_of, paper_world
from firmware.parity.targets import AVR_PARTICLES
from firmware.parity.vehicle import MissionRecord, zigzag
from firmware.power_cuts import Craft

ROOT = Path(__file__).resolve().parents[1]
BUDGETS = ROOT / "firmware" / "budgets.csv"
PAGE = ROOT / "docs" / "budgets.md"
BOARDS_PAGE = ROOT / "docs" / "boards.md"
EXAMPLES = ROOT / "firmware" / "library" / "examples"
SKETCHES = ROOT / "firmware" / "budget_sketches"

TARGET = "atmega2560"
SMALL_AVR = "atmega328p"
#: The boards of Arduino with these chips.
AVR_BOARDS = {TARGET: MEGA2560, SMALL_AVR: UNO}
TARGETS = (SMALL_AVR, TARGET, *CHIPS)

#: Growth beyond this share of a committed figure is refused.
TOLERANCE = 0.02

#: Steps that each filter is measured over. The vehicle reaches every bearing and the near field.
STEPS = {
    "ekf": 1_000,
    "ukf": 1_000,
    "ckf": 1_000,
    "robust_ukf": 1_000,
    "aukf": 10_000,
    "aukf_covariance_budget": 1_000,
}
STEPS.update(robust_ekf_predict=1_000, robust_ekf_update=1_000)
STEPS.update(unknown_start_predict=1_000, unknown_start_update=1_000)
#: Periods of 0.1 s of a mission with two legs and the arc between them, a fix every fifth.
STEPS.update(heading_filter=1_300, model_aided_predict=1_300, guidance_control=1_300)
STEPS.update(model_aided_update=259)
STEPS.update(hull3_rk4=500, hull3_semi_implicit=500, hull6_rk4=500, hull6_semi_implicit=500)
STEPS.update(rov_allocation=500, rov_thrust_inverse=500)
STEPS.update(pilot_steer=1_000, pilot_predict=1_000, pilot_update=199)  # one fix of five periods

#: Particles of SlatfJoint: whole blocks that the RAM holds beside the stack.
JOINT_PARTICLES = 32
#: Of SlatfShared, which takes 36 bytes for each: as many as the paper has on the desk.
SHARED_PARTICLES = 100
#: Of them in the sketch slave_tracking.
SKETCH_PARTICLES = 64

#: Echoes that SLATF and its relatives are measured over, and the seconds between two of them.
ECHOES = 25
SONAR_PERIOD_S = 2.0

COLUMNS = (
    "target",
    "program",
    "flash_bytes",
    "static_ram_bytes",
    "stack_bytes",
    "cycles_min",
    "cycles_median",
    "cycles_max",
)


#: What is measured on every chip: a program of each filter, and the pilot. Of those that are timed
#: in parts, the update.
FILTERS = (
    *("ekf", "ukf", "ckf", "robust_ukf", "aukf", "aukf_covariance_budget", "robust_ekf_update"),
    *("unknown_start_update", "model_aided_update", "ekf_slat", "ekf_slat_imm"),
    *("slatf1", "slatf2", "slatf_joint", "slatf_shared", "pilot_update"),
)


class BudgetError(RuntimeError):
    """A figure has grown, or a program could not be measured; the message says which."""


@dataclass(frozen=True)
class Row:
    """What one program takes.

    Attributes
    ----------
    flash_bytes, static_ram_bytes : int
        As the Arduino IDE reports them: code and constants; .data, .bss and .noinit.
    stack_bytes : int
        Deepest stack of the whole run, interrupts included, from the end of the RAM.
    cycles_min, cycles_median, cycles_max : int or None
        Of one step; None where a program has no steps.
    """

    target: str
    program: str
    flash_bytes: int
    static_ram_bytes: int
    stack_bytes: int
    cycles_min: int | None
    cycles_median: int | None
    cycles_max: int | None


# ---- The programs --------------------------------------------------------------------------------

_FIXED_STEP = """auvest::Status status = filter.predict(0.5f);
  if (status == auvest::Status::kOk) status = filter.update(z, sonar).status;
  return status;"""
_ADAPTIVE_STEP = """auvest::Status status = filter.predict(filter.interval());
  if (status == auvest::Status::kOk) status = filter.update(z, sonar).status;
  if (status == auvest::Status::kOk) status = filter.feedback(desired);
  return status;"""


class Program(NamedTuple):
    """A template in SKETCHES, what stands in its places, and the section that is reported."""

    template: str
    values: Mapping[str, str]
    section: int = 1


def _filter(kind: str, arguments: str, step: str) -> Program:
    return Program("filter", {"FILTER": kind, "ARGUMENTS": arguments, "STEP": step})


#: What follows the number of masters where a filter is the paper's: nothing guards it.
_PLAIN = {
    "Slatf1": ", auvest::SystematicResampling, auvest::OneLane<float>, auvest::NoSafeguards",
    "SlatfJoint": ", auvest::SystematicResampling, auvest::NoSafeguards",
    "EkfSlat": ", auvest::NoSafeguards",
}
_PLAIN["Slatf2"] = _PLAIN["Slatf1"]


def _slat(
    kind: str,
    particles: int = 0,
    master: str = "PiecewiseAcceleration<float>",
    *,
    guarded: bool = False,
) -> Program:
    """Give a filter that localises and tracks, with particles or, with 0 of them, without.

    ``guarded``: as it comes, with a gate and recovery of a lost master.
    """
    places = {"KIND": kind, "MASTER": master, "STORAGE": "", "PARTICLES": ""}
    places["REST"] = "" if guarded else _PLAIN[kind]
    places["GATE"] = "13.8f" if guarded else "0"
    if particles:
        places["STORAGE"] = f"Filter::Storage<{particles}> particles;"
        places["PARTICLES"] = ", particles"
    return Program("slatf", places)


_IMM = "Imm<{}>".format(
    ", ".join(
        f"auvest::{model}<float>"
        for model in ("ConstantVelocity", "ExactAcceleration", "CoordinatedTurn")
    )
)


def _parts(template: str, *names: str, **values: str) -> dict[str, Program]:
    """Give a program that is compiled and run once, with the names of its sections from 1 on."""
    return {name: Program(template, values, section) for section, name in enumerate(names, 1)}


#: By the names of their rows.
_PROGRAMS: Mapping[str, Program] = {
    "empty": Program("empty", {}),
    "ekf": _filter("auvest::Ekf<Process>", "Process()", _FIXED_STEP),
    "ukf": _filter("auvest::Ukf<Process>", "Process(), points()", _FIXED_STEP),
    "ckf": _filter("auvest::Ckf<Process>", "Process()", _FIXED_STEP),
    "robust_ukf": _filter(
        "auvest::Robust<auvest::Ukf<Process>, auvest::RobustUpdate<auvest::Hampel<float>, "
        "auvest::RejectionStreak<float>>>",
        "auvest::Ukf<Process>(Process(), points())",
        _FIXED_STEP,
    ),
    "aukf": _filter("auvest::Aukf<Process>", "Process(), points()", _ADAPTIVE_STEP),
    "aukf_covariance_budget": _filter(
        "auvest::Aukf<Process, auvest::CovarianceBudget<float>>",
        "Process(), points()",
        _ADAPTIVE_STEP,
    ),
    **_parts(
        *("range_filter", "robust_ekf_predict", "robust_ekf_update"), FILTER="Inside", BYTES="112"
    ),
    **_parts(
        *("range_filter", "unknown_start_predict", "unknown_start_update"),
        FILTER="auvest::GaussianSum<Inside>",
        BYTES="600",
    ),
    **_parts(
        "mission", "heading_filter", "model_aided_predict", "model_aided_update", "guidance_control"
    ),
    **{
        f"hull{n}_{method}": Program("hull", {"FREEDOM": freedom, "METHOD": kind})
        for n, freedom in ((3, "ThreeDof"), (6, "SixDof"))
        for method, kind in (("rk4", "Rk4"), ("semi_implicit", "SemiImplicit"))
    },
    **_parts("allocation", "rov_allocation", "rov_thrust_inverse"),
    **_parts("pilot", "pilot_steer", "pilot_predict", "pilot_update"),
    "slatf1": _slat("Slatf1", AVR_PARTICLES),
    "slatf2": _slat("Slatf2", AVR_PARTICLES),
    "slatf_joint": _slat("SlatfJoint", JOINT_PARTICLES),
    "slatf_shared": _slat("SlatfShared", SHARED_PARTICLES, guarded=True),
    "ekf_slat": _slat("EkfSlat"),
    "ekf_slat_imm": _slat("EkfSlat", master=_IMM),
}


def _sections(program: str) -> list[str]:
    """Give the rows of the program of a row, in the order of the table."""
    return [name for name, other in _PROGRAMS.items() if other[:2] == _PROGRAMS[program][:2]]


def _source(program: str) -> str:
    template = _PROGRAMS[program].template
    text = (SKETCHES / f"{template}.ino.in").read_text(encoding="utf-8")
    for name, value in _PROGRAMS[program].values.items():
        text = text.replace(f"@{name}@", value)
    return text


def _slatf_record() -> bytes:
    """Return the beginning of the paper's scenario."""
    world = paper_world()
    readings = world.readings[: 2 * ECHOES]
    end = np.full(2 * readings.itemsize // 4, np.nan, "<f4")
    return b"".join(part.tobytes() for part in (world.slave, world.master, readings, end))


@cache
def _words(program: str) -> bytes:
    """Give the record that a program is played."""
    template = _PROGRAMS[program].template
    if template == "slatf":
        return _slatf_record()
    return _pilot_record() if template == "pilot" else _record(program)


def _record(program: str) -> bytes:
    """Start, variances and the steps of a vehicle that circles through the station."""
    template = _PROGRAMS[program].template
    if template == "range_filter":
        variance = 1e10 if program.startswith("unknown_start") else 4.0
        return _range_record(STEPS[program], variance)
    if template in ("mission", "hull", "allocation"):
        return _vehicle_record(template)
    adaptive = program.startswith("aukf")
    name: FilterName = "aukf" if adaptive else "ekf" if program == "ekf" else "ukf"
    filter_ = paper_filter(name, noise=paper_noise("normal"), track="turn", dtype="float32")
    scenario = Scenario(
        track=Track(kind="turn", turn_rate=0.05, wander_m=0.2),
        noise=paper_noise("normal"),
        steps=STEPS[program],
        runs=1,
    )
    start = np.concatenate([filter_.x, np.diagonal(filter_.P)])
    result = simulate(filter_, scenario, workers=1)
    z = result.z[0].copy()
    z[:, 0] = np.abs(z[:, 0])  # no sonar reports a range below 0; the noise of the scenario does
    rows = np.hstack([z, result.truth[0]])
    end = np.full(4, np.nan)
    return np.concatenate([start, rows.ravel(), end]).astype("<f4").tobytes()


def _range_record(steps: int, variance: float) -> bytes:
    """Variance and the steps of a slave among two leaders, one range of ten an outlier.

    Half-way the slave is 200 m from where it was, as if set down there: the filter locks out and
    recovers.
    """
    rng = np.random.default_rng(1)
    slave, leaders = cooperative.tracks(5 * steps)
    slave, leaders = slave[4::5], leaders[4::5, :]
    leader = leaders[np.arange(steps), np.arange(steps) % 2]
    moved = np.diff(slave, axis=0, prepend=[[0.0, 0.0]]) / 5
    motion = np.stack(
        [np.hypot(*moved.T), np.zeros(steps), np.arctan2(moved[:, 1], moved[:, 0])], axis=1
    )
    motion += rng.standard_normal((steps, 3)) * [0.05, 0.0, 0.01]
    slave[steps // 2 :, 1] += 200.0
    z = np.hypot(*(slave - leader).T)
    z += rng.standard_normal(steps) * np.where(rng.random(steps) < 0.1, 10.0, 1.0)
    rows = np.column_stack([motion, leader, z])
    return np.concatenate([[variance], rows.ravel(), np.full(6, np.nan)]).astype("<f4").tobytes()


def _vehicle_record(template: str) -> bytes:
    """Return readings of a mission, commands of a torpedo, or demands on an ROV, some too large."""
    if template == "mission":
        record = MissionRecord(name="arcs", arc_m=15.0, seconds=130.0)
        told = b"".join(row.tobytes() for row in record.readings)
        return record.start_m.tobytes() + told + np.full(9, np.nan, "<f4").tobytes()
    if template == "hull":
        return np.append(zigzag(500, 0.05), np.full((1, 3), np.nan, "<f4"), axis=0).tobytes()
    rng = np.random.default_rng(1)
    demands = rng.standard_normal((500, 6)) * [20.0, 20.0, 20.0, 1.0, 1.0, 4.0]
    demands[::4] *= 4
    return np.append(demands, np.full((1, 6), np.nan), axis=0).astype("<f4").tobytes()


def _pilot_record() -> bytes:
    """Start and the readings of a vehicle on its first leg and round its first corners."""
    plan = chip_mission()
    world, pilot = new_world(plan, 0), new_pilot(plan)
    start = [*world.guess_m, world.heading_rad]
    pilot.start(*start)
    rows = []
    for k in range(STEPS["pilot_steer"]):
        readings, fix = world.sense().astype(np.float32), [np.nan, np.nan]
        pilot.predict(readings, mission_line.ALL_HEARD, PERIOD_S)
        if pilot.wants_fix():
            pilot.asked()
            world.ask()
            ((range_m, bearing_rad, _),) = world.take_fixes()
            pilot.update(range_m, bearing_rad, 0.0)
            fix = [range_m, bearing_rad]
        rows.append([*readings, *fix])
        world.advance(pilot.steer()[1:], PERIOD_S, (k + 1) * PERIOD_S)
    return np.concatenate([start, np.ravel(rows), [np.nan]]).astype("<f4").tobytes()


# ---- Measure -------------------------------------------------------------------------------------


def measure(output: Path, compiled: Mapping[str, Compiled] | None = None) -> list[Row]:
    """Compile all programs for the ATmega2560 and run them on the simulated board.

    Parameters
    ----------
    output : Path
        A folder for what is built.
    compiled : mapping
        Programs that are compiled already, by name.

    Returns
    -------
    list of Row
        `empty`, the filters, the examples.
    """
    library = package(output)
    programs: dict[str, Callable[[Compiled, Path], list[Row]]]
    programs = {_sections(name)[0]: _run_on_board for name in _PROGRAMS}
    programs["empty"] = _run_empty
    programs["first_steps"] = _run_first_steps
    programs["replay"] = _run_replay
    programs["tracking_loop"] = _run_tracking_loop
    programs["slave_tracking"] = _run_slave_tracking
    programs["beacon_navigation"] = _run_beacon_navigation
    programs["mission"] = _run_mission
    programs["power_cuts"] = _run_power_cuts
    ready = dict(compiled or {})
    for program in programs:  # one after the other: they share Arduino's core
        folder = output / "sketches" / program
        shutil.rmtree(folder, ignore_errors=True)
        if (EXAMPLES / program).is_dir():
            shutil.copytree(EXAMPLES / program, folder)
        else:
            folder.mkdir(parents=True)
            (folder / f"{program}.ino").write_text(_source(program), encoding="utf-8")
            shutil.copy(ROOT / "firmware" / "board" / "board.hpp", folder)
        if program not in ready:
            ready[program] = compile_sketch(folder, library, output / "compiled")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = {
            program: pool.submit(run, ready[program], output / "sketches" / program)
            for program, run in programs.items()
        }
        return [row for run in runs.values() for row in run.result()]


def measure_elsewhere(output: Path, wanted: Iterable[tuple[str, str]] | None = None) -> list[Row]:
    """Measure filters on the chips beside the ATmega2560.

    Parameters
    ----------
    output : Path
        A folder for what is built.
    wanted : iterable of (str, str), optional
        Targets and programs; default: all of :data:`FILTERS` on all of them.

    Returns
    -------
    list of Row
        Without those that do not fit into an ATmega328P.
    """
    if wanted is None:
        wanted = [(name, program) for name in TARGETS if name != TARGET for program in FILTERS]
    wanted, rows = list(wanted), []
    library = package(output) if any(name == SMALL_AVR for name, _ in wanted) else None
    for target, program in wanted:
        folder = output / target / program
        folder.mkdir(parents=True, exist_ok=True)
        if target == SMALL_AVR:
            assert library is not None
            row = _measure_small_avr(program, folder, library, output / f"compiled-{SMALL_AVR}")
        else:
            row = _measure_chip(CHIPS[target], program, folder)
        if row is not None:
            rows.append(row)
    return rows


def _measure_small_avr(program: str, folder: Path, library: Path, output: Path) -> Row | None:
    (folder / f"{program}.ino").write_text(_source(program), encoding="utf-8")
    shutil.copy(ROOT / "firmware" / "board" / "board.hpp", folder)
    try:
        compiled = compile_sketch(folder, library, output, board=AVR_BOARDS[SMALL_AVR])
    except SketchError as error:
        if re.search(r"will not fit in region|is not within region", str(error)):
            return None
        raise
    try:
        rows = _run_on_board(compiled, folder, SMALL_AVR)
    except BoardError as error:
        if error.report.reason == "stack overflow":
            return None
        raise
    return next(row for row in rows if row.program == program)


def _measure_chip(chip: chips.Chip, program: str, folder: Path) -> Row:
    source = folder / f"{program}.cpp"
    main = "\nint main() {\n  setup();\n  for (;;) loop();\n}\n"
    source.write_text(_source(program) + main, encoding="utf-8")
    built = chips.build(chip, [source], folder / "program.elf")
    run = chips.run(chip, built, _words(program), folder / "run")
    sizes = chips.sizes(chip, built)
    return Row(chip.name, program, sizes.flash, sizes.ram, run.stack_bytes, None, None, None)


def _row(
    program: str, compiled: Compiled, stack_bytes: int, cycles: list[int], target: str = TARGET
) -> Row:
    low, median, high = (
        (min(cycles), int(np.median(cycles)), max(cycles)) if cycles else (None, None, None)
    )
    return Row(target, program, compiled.flash, compiled.ram, stack_bytes, low, median, high)


def _run_empty(compiled: Compiled, folder: Path) -> list[Row]:
    with Board(compiled.elf, for_s=0.1) as board:
        report = board.run()
    return [_row(folder.name, compiled, report.stack_bytes, [])]


def _run_on_board(compiled: Compiled, folder: Path, target: str = TARGET) -> list[Row]:
    """Run the program of a filter on its record: a row for each of its sections."""
    record = folder / "record.bin"
    record.write_bytes(_words(folder.name))
    with Board(compiled.elf, mcu=target, input=record, limit_s=1000.0) as board:
        report = board.run()
    rows = []
    for name in _sections(folder.name):
        steps = ECHOES if _PROGRAMS[name].template == "slatf" else STEPS[name]
        step = report.sections[_PROGRAMS[name].section]
        if step.count != steps:
            raise BudgetError(f"{name}: {step.count} steps instead of {steps}")
        cycles = [step.minimum, step.median, step.maximum]
        rows.append(_row(name, compiled, report.stack_bytes, cycles, target))
    return rows


def _run_first_steps(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure one run; its cycles are those until its last line is through."""
    with Board(compiled.elf, for_s=1.0) as board:
        lines = [event for event in board if isinstance(event, SerialLine)]
    return [_row(folder.name, compiled, board.report.stack_bytes, [lines[-1].cycle])]


def _run_replay(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure one run; the sketch counts its cycles itself, in eights."""
    with Board(compiled.elf, for_s=2.0) as board:
        lines = [event.text for event in board if isinstance(event, SerialLine)]
    cycles = [int(line.rsplit(",", 1)[1]) for line in lines if line[:1].isdigit()]
    return [_row(folder.name, compiled, board.report.stack_bytes, cycles)]


def _samples(
    elf: Path, count: int, answers: Callable[[SerialLine], Iterable[tuple[str, float]]]
) -> tuple[list[float], int]:
    """Play to a sketch until it has reported so many samples: cycles awake of each, and the stack.

    ``answers`` gives what a line is answered, each with its delay in s.
    """
    reader = telemetry.Reader()
    cycles: list[float] = []
    with Board(elf, limit_s=120.0) as board:
        for event in board:
            if not isinstance(event, SerialLine):
                continue
            row = reader.read(event.text)
            if isinstance(row, dict):
                cycles.append(16 * row["awake_us"])
            if len(cycles) == count:
                break
            for text, delay_s in answers(event):
                board.send(text, delay_s)
    return cycles, board.report.stack_bytes


def _run_tracking_loop(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure 60 samples of a vehicle at rest: the cycles awake, by the sketch's own clock."""

    def answers(line: SerialLine) -> Iterator[tuple[str, float]]:
        sample = telemetry.requested_sample(line.text)
        if sample is not None:
            yield telemetry.answer(sample, 5.0, 0.5), 0.01

    cycles, stack = _samples(compiled.elf, 60, answers)
    return [_row(folder.name, compiled, stack, [round(count) for count in cycles])]


def _run_slave_tracking(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure 20 pings of the paper's scenario: the cycles awake between two of them."""
    readings = paper_world().readings

    def answers(line: SerialLine) -> Iterator[tuple[str, float]]:
        sample = telemetry.requested_sample(line.text, "ODO")
        if sample is not None:
            speed, heading = readings["u"][sample - 1]
            yield telemetry.frame(f"MOTION,{sample},{speed:.6f},{heading:.6f}"), 0.005
        sample = telemetry.requested_sample(line.text)
        if sample is not None:
            yield telemetry.answer(sample, *readings["z"][sample - 1]), 0.4

    cycles, stack = _samples(compiled.elf, 41, answers)
    # The first sample counts the start too.
    pairs = np.array(cycles[1:]).reshape(-1, 2).sum(axis=1)
    return [_row(folder.name, compiled, stack, [round(count) for count in pairs])]


def _run_beacon_navigation(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure 40 samples of a vehicle at rest, its ranges 2.3 s late: the cycles awake of each."""
    ranges = (14.142, 110.454, 94.340)  # of (10, 10) m from the sketch's beacons

    def answers(line: SerialLine) -> Iterator[tuple[str, float]]:
        sample = telemetry.requested_sample(line.text, "ODO")
        if sample is not None:
            yield telemetry.frame(f"MOTION,{sample},0.000,0.5000"), 0.005
            yield telemetry.frame(f"RANGE,{sample},{ranges[sample % 3]:.3f}"), 2.3

    cycles, stack = _samples(compiled.elf, 40, answers)
    return [_row(folder.name, compiled, stack, [round(count) for count in cycles[4:]])]


def _run_power_cuts(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure 125 samples, in one of which a checkpoint begins: the cycles awake in each."""
    craft = Craft()

    def answers(line: SerialLine) -> Iterator[tuple[str, float]]:
        answer = craft.answer(line.text, line.time_s, clock=False)
        if answer is not None:
            yield answer, 0.01

    cycles, stack = _samples(compiled.elf, 126, answers)
    # The first sample counts the start too.
    return [_row(folder.name, compiled, stack, [round(count) for count in cycles[1:]])]


def _run_mission(compiled: Compiled, folder: Path) -> list[Row]:
    """Measure 60 s of a vehicle in the loop: the cycles awake per sample, telemetry's share too."""
    chip = ChipFlight(Vehicle(chip_mission()))
    fly_simulated(compiled.elf, chip, samples=600)
    samples = np.diff([row["sample"] for row in chip.rows])
    awake_us = np.array([row["awake_us"] for row in chip.rows[1:]]) / samples
    return [_row(folder.name, compiled, chip.stack_bytes, [round(16 * us) for us in awake_us])]


# ---- Compare and write ---------------------------------------------------------------------------


def read_budgets(path: Path = BUDGETS) -> list[Row]:
    """Read the committed figures."""
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Row(
                line["target"],
                line["program"],
                *(int(line[name]) for name in COLUMNS[2:5]),
                *(int(line[name]) if line[name] else None for name in COLUMNS[5:]),
            )
            for line in csv.DictReader(file)
        ]


def growth(measured: list[Row], committed: list[Row]) -> list[str]:
    """Say what has grown beyond the tolerance, or is not in both lists; one line each."""
    before = {(row.target, row.program): row for row in committed}
    lines = []
    for row in measured:
        old = before.pop((row.target, row.program), None)
        if old is None:
            lines.append(f"{row.target} {row.program}: not in {BUDGETS.name}")
            continue
        for name in COLUMNS[2:]:
            now, was = getattr(row, name), getattr(old, name)
            if (now is None) != (was is None):
                lines.append(f"{row.target} {row.program} {name}: {now} instead of {was}")
            elif now is not None and now > was * (1 + TOLERANCE):
                lines.append(
                    f"{row.target} {row.program} {name}: {now:,} instead of {was:,} "
                    f"(+{now / was - 1:.1%}, at most {TOLERANCE:.0%})"
                )
    lines += [f"{target} {program}: no longer measured" for target, program in before]
    return lines


def write_budgets(rows: list[Row], path: Path = BUDGETS) -> None:
    """Write the table that is committed."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            writer.writerow("" if value is None else value for value in vars(row).values())


def page(rows: list[Row]) -> str:
    """Return the page of the documentation on the ATmega2560."""
    rows = [row for row in rows if row.target == TARGET]
    empty = next(row for row in rows if row.program == "empty")
    lines = [
        "# What it takes on the chip",
        "",
        "Written by `python -m firmware.budgets --write`; the tests measure again and refuse",
        f"growth beyond {TOLERANCE:.0%}. ATmega2560 at 16 MHz, simulated; every program is a",
        "sketch, compiled with the Arduino IDE's own options (-Os -flto, avr-gcc of Debian). Other",
        "chips: [boards.md](boards.md).",
        "",
        "| program | flash | above the empty sketch | static RAM | stack | cycles per step: min "
        "| median | max | median at 16 MHz |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for row in rows:
        cells = [f"`{row.program}`", f"{row.flash_bytes:,}"]
        cells += [f"{row.flash_bytes - empty.flash_bytes:,}"]
        cells += [f"{row.static_ram_bytes:,}", f"{row.stack_bytes:,}"]
        cycles = (row.cycles_min, row.cycles_median, row.cycles_max)
        cells += ["" if value is None else f"{value:,}" for value in cycles]
        cells += ["" if row.cycles_median is None else f"{row.cycles_median / 16e3:.2f} ms"]
        lines.append(f"| {' | '.join(cells)} |")
    lines += [
        "",
        "`ekf`, `ukf`, `ckf`: predict and update; `robust_ukf`: with Hampel's kernel and the",
        "recovery; `aukf` and `aukf_covariance_budget`: with the",
        "interval feedback (the paper's law; the covariance budget). Six states, float, the",
        f"paper's model, alpha = 1e-6, range and bearing, {STEPS['ekf']:,} steps (`aukf`:",
        f"{STEPS['aukf']:,}); the vehicle circles through the station, so the near field and every",
        "bearing occur. `robust_ekf_predict` and `robust_ekf_update`: dead reckoning by speed and",
        "heading and one range, M-estimation EKF of two states with IGG and the recovery, a range",
        "of ten an outlier, and a lock-out half-way; the same program, its two halves.",
        "`unknown_start_predict` and `unknown_start_update`: the same from a sigma of 100 km, with",
        "16 components (a ring at the start and after the lock-out); the medians are with one.",
        f"`slatf1` and `slatf2`: N = {AVR_PARTICLES}, one master, two predictions and one echo,",
        f"{ECHOES} times at the beginning of the paper's scenario; `slatf_joint`: the same with",
        f"N = {JOINT_PARTICLES}; `slatf_shared`: with one covariance, N = {SHARED_PARTICLES},",
        "a gate and recovery; `ekf_slat` and, with the three models of an `Imm` for the master,",
        "`ekf_slat_imm`: the same without particles. The examples: `first_steps` is",
        "its whole run, serial text included; `replay` counts predict, update and feedback by the",
        "chip's timer; `tracking_loop` counts the cycles awake between two samples,",
        "`slave_tracking` those between two pings, `beacon_navigation` those of a sample with a",
        "range that is 3 s old, serial text included, `power_cuts` those per",
        "sample of 0.5 s, a checkpoint in one of 120 included, and `mission` those per",
        "sample of 0.1 s. Its pilot by itself, in 100 s of the same mission: `pilot_steer` is",
        "guidance and control, `pilot_predict` heading and estimate, each twice because of late",
        "fixes, `pilot_update` one fix.",
        "",
        "Flash and static RAM are what the IDE reports (bytes); the stack is the deepest of the",
        "whole run from the end of the RAM, interrupts included.",
        "",
    ]
    lines += [
        "## What was asked of the AUKF",
        "",
        "| figure of `aukf` | asked | measured | |",
        "|---|---:|---:|---|",
    ]
    for figure in targets(rows):
        measured = f"{figure.measured:,.{figure.digits}f}"
        verdict = "met" if figure.met else "**not met**"
        lines.append(f"| {figure.name} | {figure.limit:,} | {measured} | {verdict} |")
    lines += slatf_page(rows)
    lines += vehicle_page(rows)
    return "\n".join([*lines, ""])


#: How the page names the chips.
_CHIP_NAMES = {
    SMALL_AVR: "ATmega328P",
    TARGET: "ATmega2560",
    "cortex-m0": "Cortex-M0",
    "cortex-m0plus": "Cortex-M0+",
    "cortex-m3": "Cortex-M3",
    "cortex-m4f": "Cortex-M4F",
    "cortex-m7": "Cortex-M7",
    "riscv32imc": "RV32IMC",
}


def boards_page(rows: list[Row]) -> str:
    """Return the page of the documentation on all chips."""
    found = {(row.target, row.program): row for row in rows}

    def table(cell: Callable[[Row], str], targets: Iterable[str]) -> list[str]:
        names = [_CHIP_NAMES[target] for target in targets]
        lines = ["", f"| filter | {' | '.join(names)} |", f"|---|{'---:|' * len(names)}"]
        for program in FILTERS:
            cells = [
                cell(found[target, program]) if (target, program) in found else "-"
                for target in targets
            ]
            lines.append(f"| `{program}` | {' | '.join(cells)} |")
        return lines

    avr = (SMALL_AVR, TARGET)
    return "\n".join(
        [
            "# Every filter on every board",
            "",
            "Written by `python -m firmware.budgets --write`; the tests measure some of it again",
            f"and refuse growth beyond {TOLERANCE:.0%}. What each program is:",
            "[budgets.md](budgets.md); those that are timed there in parts are one program here.",
            "Which of them fit a chip of yours: `auvest fit --ram 2048 --flash 32256`.",
            "",
            "`-`: does not fit the chip. On an AVR a program is a sketch of the Arduino IDE, with",
            "its core. Elsewhere it is compiled by Debian's compilers as Arduino's cores do",
            "(-Os, no link-time optimisation, newlib-nano or picolibc), without a core, and",
            "without the start-up of the emulated board. Flash is code, constants and what the",
            "variables start from. An ATmega328P has 32,256 B of flash beside the bootloader, and",
            "2,048 B of RAM.",
            "",
            "## Flash, bytes",
            *table(lambda row: f"{row.flash_bytes:,}", TARGETS),
            "",
            "## Static RAM + stack, bytes",
            "",
            "The stack is the deepest of the whole run.",
            *table(lambda row: f"{row.static_ram_bytes:,} + {row.stack_bytes:,}", TARGETS),
            "",
            "## Cycles of a step, median / largest",
            "",
            "Of the two chips that are simulated to the cycle; QEMU's time is not a chip's.",
            *table(lambda row: f"{row.cycles_median:,} / {row.cycles_max:,}", avr),
            "",
        ]
    )


#: What the vehicle's own part of a period is made of; cycles that were asked for, in the median.
PERIOD_PARTS = ("heading_filter", "model_aided_predict", "guidance_control")
MAX_GUIDANCE_CONTROL = 20_000


def vehicle_page(rows: list[Row]) -> list[str]:
    """Return the lines of the page on the vehicle: a period of a mission."""
    cycles = {row.program: row.cycles_median or 0 for row in rows}
    control, steered = cycles["guidance_control"], cycles["pilot_steer"]
    plain = sum(cycles[name] for name in PERIOD_PARTS)
    fixed = plain + cycles["model_aided_update"]
    limit = MAX_GUIDANCE_CONTROL
    period = 16e6 * PERIOD_S
    verdict = "met" if max(control, steered) <= limit else "**not met**"
    worst = max(row.cycles_max or 0 for row in rows if row.program == "pilot_steer")
    return [
        "",
        "## What a vehicle takes",
        "",
        "Ten times a second: `heading_filter`, `model_aided_predict` (EKF of dead reckoning with",
        "the current in its state, IGG and the recovery), `model_aided_update` where there is a",
        "fix, and `guidance_control`: two legs of a plan and the arc between them, crab",
        "feed-forward, and the autopilot of heading, speed, depth and pitch. The four are one",
        "program of which a part is counted; the largest step of `guidance_control` switches to",
        "an arc. `hull3` is the torpedo in the plane, `hull6` in six degrees of freedom, one",
        "checked step; `rov_allocation` gives a demand to eight thrusters by priority, one of four",
        "out of reach, and `rov_thrust_inverse` finds the eight inputs by Newton's method.",
        "",
        f"Guidance and control: {control:,} cycles in the median, as the pilot has them, with its",
        f"watch over the sensors, {steered:,}; asked {limit:,}: {verdict}. Behind a corner, where",
        f"the leg after the next is formed, the pilot takes {worst:,}. All but the fix take",
        f"{plain:,} cycles, {plain / period:.1%} of a period, and with a fix {fixed:,},",
        f"{fixed / period:.1%}.",
    ]


def slatf_page(rows: list[Row]) -> list[str]:
    """Return the lines of the page on SLATF: cost per particle, and share of the sonar period."""
    by_name = {row.program: row for row in rows}
    lines = [
        "",
        "## What SLATF takes",
        "",
        f"The paper's sonar pings every {SONAR_PERIOD_S:g} s, with two readings of the odometry in",
        "between. The cycles of one such step, divided by the particles; `slave_tracking`, which",
        "is `slatf_shared`, has its serial line and both estimates beside them:",
        "",
        "| program | particles | cycles per particle and step | of the sonar period |",
        "|---|---:|---:|---:|",
    ]
    counts = {"slatf1": AVR_PARTICLES, "slatf2": AVR_PARTICLES}
    counts.update(slatf_joint=JOINT_PARTICLES, slatf_shared=SHARED_PARTICLES)
    counts.update(slave_tracking=SKETCH_PARTICLES, ekf_slat=0, ekf_slat_imm=0)
    for name, particles in counts.items():
        cycles = by_name[name].cycles_median
        if cycles is None:
            raise BudgetError(f"{name} has no cycles")
        share = cycles / (16e6 * SONAR_PERIOD_S)
        each = f"{cycles // particles:,}" if particles else ""
        lines.append(f"| `{name}` | {particles or ''} | {each} | {share:.1%} |")
    slave, shared = by_name["slave_tracking"], by_name["slatf_shared"]
    asleep = 1 - awake_share(slave)
    particles = 4 * fields_of("slatf2") * AVR_PARTICLES
    left = 8_192 - shared.static_ram_bytes - shared.stack_bytes
    return [
        *lines,
        "",
        "Asked: 40 particles that meet the sonar period, with half of the time asleep. Measured,",
        f"in the sketch with {SKETCH_PARTICLES}: {asleep:.0%} asleep where it is least; its echo",
        "comes back after as much as 0.6 s, and is told before the next reading, 0.4 s later.",
        f"Particles come in blocks of 16: of the 8,192 B of RAM {AVR_PARTICLES} of SLATF 2.0 take",
        f"{particles:,}. With one covariance {SHARED_PARTICLES} leave {left:,} B of it beside the",
        "stack.",
    ]


def awake_share(slave_tracking: Row) -> float:
    """Share of the sonar period that the sketch is awake, where it is largest."""
    if slave_tracking.cycles_max is None:
        raise BudgetError("slave_tracking has no cycles")
    return slave_tracking.cycles_max / (16e6 * SONAR_PERIOD_S)


@dataclass(frozen=True)
class Target:
    """A figure of the design, and what became of it."""

    name: str
    limit: float
    measured: float
    digits: int = 0

    @property
    def met(self) -> bool:
        """Whether the measured value is at most the limit."""
        return self.measured <= self.limit


def targets(rows: list[Row]) -> list[Target]:
    """Compare the AUKF with what the design asks; 320 B for its object are held when compiled."""
    by_name = {row.program: row for row in rows}
    aukf, empty = by_name["aukf"], by_name["empty"]
    if aukf.cycles_median is None or aukf.cycles_max is None:
        raise BudgetError("aukf has no cycles")
    return [
        Target("cycles per step, median", 95_000, aukf.cycles_median),
        Target("worst step over the median", 1.3, aukf.cycles_max / aukf.cycles_median, 2),
        Target("stack, bytes", 450, aukf.stack_bytes),
        Target("flash above the empty sketch, bytes", 12_288, aukf.flash_bytes - empty.flash_bytes),
    ]


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="firmware.budgets",
        description="Measure flash, RAM, stack and cycles of every program on the simulated chips, "
        "and compare them with firmware/budgets.csv. The simulated board must be built: "
        "cmake -S . -B build/firmware -D AUVEST_BUILD_FIRMWARE=ON && cmake --build build/firmware; "
        "then set AUVEST_BOARD to the path of auvest-board.",
    )
    parser.add_argument(
        "--write",
        action="store_true",
        help="write firmware/budgets.csv, docs/budgets.md and docs/boards.md anew",
    )
    parser.add_argument(
        "--target",
        action="append",
        choices=TARGETS,
        help="measure this chip only; may be repeated (default: all)",
    )
    arguments = parser.parse_args()
    chosen = [name for name in TARGETS if name in (arguments.target or TARGETS)]
    try:
        if {TARGET, SMALL_AVR}.intersection(chosen):
            find_runner()  # before minutes are spent without one
        with tempfile.TemporaryDirectory() as folder:
            rows = measure(Path(folder)) if TARGET in chosen else []
            elsewhere = [name for name in chosen if name != TARGET]
            wanted = [(name, program) for name in elsewhere for program in FILTERS]
            rows += measure_elsewhere(Path(folder), wanted)
    except (BoardError, BudgetError, ChipError, SketchError, FileNotFoundError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    committed = read_budgets()
    if arguments.write:
        rows += [row for row in committed if row.target not in chosen]
        rows.sort(key=lambda row: TARGETS.index(row.target))  # programs stay in their order
        write_budgets(rows)
        PAGE.write_text(page(rows), encoding="utf-8")
        BOARDS_PAGE.write_text(boards_page(rows), encoding="utf-8")
        return 0
    lines = growth(rows, [row for row in committed if row.target in chosen])
    for line in lines:
        print(f"error: {line}", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
