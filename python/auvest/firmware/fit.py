"""Which filters fit a chip: its flash and RAM beside what each filter was measured to take.

The figures are those of ``firmware/budgets.csv``, which comes with the package: programs that hold
one filter and nothing else.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

from auvest._arguments import as_integer
from auvest._headers import firmware_folder

#: Chips with figures, and how each is called.
CHIPS = {
    "atmega328p": "ATmega328P: Arduino UNO, Nano",
    "atmega2560": "ATmega2560: Arduino MEGA2560",
    "cortex-m0": "Cortex-M0: micro:bit V1, STM32F0",
    "cortex-m0plus": "Cortex-M0+: Arduino Zero, Raspberry Pi Pico",
    "cortex-m3": "Cortex-M3: Arduino Due, STM32F1",
    "cortex-m4f": "Cortex-M4F: Nano 33 BLE, Teensy 3, STM32F4",
    "cortex-m7": "Cortex-M7: Teensy 4, STM32F7",
    "riscv32imc": "RISC-V RV32IMC: ESP32-C3",
}

#: The same, for the head of a column.
SHORT = {
    "atmega328p": "328P",
    "atmega2560": "2560",
    "cortex-m0": "M0",
    "cortex-m0plus": "M0+",
    "cortex-m3": "M3",
    "cortex-m4f": "M4F",
    "cortex-m7": "M7",
    "riscv32imc": "RV32",
}

#: What the programs hold, by the names of budgets.csv. Six states are those of an acceleration
#: model, two are a position.
_PROGRAMS = {
    "ekf": "EKF, 6 states",
    "ukf": "UKF, 6 states",
    "ckf": "cubature filter, 6 states",
    "robust_ukf": "UKF with Hampel's kernel and recovery, 6 states",
    "aukf": "UKF that chooses when to measure next, 6 states",
    "aukf_covariance_budget": "the same by a bound on the covariance",
    "robust_ekf_update": "M-estimation EKF with recovery, 2 states, ranges to beacons",
    "unknown_start_update": "the same from an unknown start: 16 components",
    "model_aided_update": "EKF with the current in its state, heading filter, guidance, autopilot",
    "ekf_slat": "EKF that localises and tracks a master",
    "ekf_slat_imm": "the same with three models of the master",
    "slatf1": "SLATF 1.0, 48 particles",
    "slatf2": "SLATF 2.0, 48 particles",
    "slatf_joint": "SLATF, joint Gaussians, 32 particles",
    "slatf_shared": "SLATF, joint, one covariance, gate and recovery, 100 particles",
    "pilot_update": "the pilot of the sketch mission: filter with late fixes, guidance, control",
}


def _name(program: str) -> str:
    return program.removesuffix("_update").replace("_", "-")


#: The filters, and what each is.
FILTERS = {_name(program): what for program, what in _PROGRAMS.items()}


@dataclass(frozen=True)
class Fit:
    """A filter on a chip.

    Attributes
    ----------
    filter, chip : str
    flash_bytes, static_ram_bytes, stack_bytes : int
        What the program of the filter takes there.
    flash_left_bytes, ram_left_bytes : int
        What is left of flash and RAM for all else, the reserve for the stack taken off; below 0
        what is missing.
    """

    filter: str
    chip: str
    flash_bytes: int
    static_ram_bytes: int
    stack_bytes: int
    flash_left_bytes: int
    ram_left_bytes: int

    @property
    def fits(self) -> bool:
        """Whether nothing is missing."""
        return self.flash_left_bytes >= 0 and self.ram_left_bytes >= 0

    def row(self) -> dict[str, Any]:
        """Give what ``auvest fit --json`` prints of it."""
        return {**asdict(self), "fits": self.fits}


@cache
def figures() -> dict[tuple[str, str], tuple[int, int, int]]:
    """Give flash, static RAM and stack in bytes, by chip and filter.

    Raises
    ------
    FileNotFoundError
        If they did not come with the package.
    """
    path = firmware_folder() / "budgets.csv"
    with path.open(newline="", encoding="utf-8") as file:
        return {
            (row["target"], _name(row["program"])): (
                int(row["flash_bytes"]),
                int(row["static_ram_bytes"]),
                int(row["stack_bytes"]),
            )
            for row in csv.DictReader(file)
            if row["program"] in _PROGRAMS
        }


def fit(ram: int, flash: int, stack: int = 0, chips: Sequence[str] | None = None) -> list[Fit]:
    """Compare what filters take with what a chip has.

    Parameters
    ----------
    ram, flash : int
        Bytes that the chip has: of RAM all, of flash what the bootloader leaves.
    stack : int
        Bytes of RAM to spare beside the filter's own stack: for the functions that call it, and for
        interrupts.
    chips : sequence of str, optional
        Those of :data:`CHIPS` whose code is meant; default: all.

    Returns
    -------
    list of Fit
        By filter, then by chip. A filter that has no figures on a chip, because it does not fit the
        one that was measured, is not there.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    FileNotFoundError
        If the figures did not come with the package.
    """
    ram = as_integer("ram", ram, 1, 2**32)
    flash = as_integer("flash", flash, 1, 2**32)
    stack = as_integer("stack", stack, 0, 2**32)
    for chip in chips or ():
        if chip not in CHIPS:
            raise ValueError(f"chip must be one of {', '.join(CHIPS)}, not {chip!r}")
    found = figures()
    return [
        Fit(name, chip, code, data, deepest, flash - code, ram - data - deepest - stack)
        for name in FILTERS
        for chip in (chips or CHIPS)
        if (chip, name) in found
        for code, data, deepest in (found[chip, name],)
    ]
