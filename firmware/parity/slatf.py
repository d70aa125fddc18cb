"""Records of SLATF: what happens in the paper's scenario, and a filter that meets it.

The world is that of ``simulation/slat.hpp`` (configuration R1), computed in C++. Records and
traces are little-endian 32-bit words (see ``slatf_replay.hpp``).
"""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from firmware.parity.targets import HERE, INCLUDES

Kind = Literal["slatf1", "slatf2"]

#: A belief: mean, and the lower triangle of the covariance row by row.
SLAVE = np.dtype([("x", "<f4", 2), ("P", "<f4", 3)])
MASTER = np.dtype([("x", "<f4", 6), ("P", "<f4", 21)])

#: A reading of speed [m/s] and heading [rad], good for dt [s]; the master's planned velocity
#: change in that time [m/s]; and the echo that followed, if one was heard.
READING = np.dtype(
    [("dt", "<f4"), ("u", "<f4", 2), ("change", "<f4", 2), ("heard", "<u4"), ("z", "<f4", 2)]
)

#: Numbers of a particle: log weight, pose (2.0: with its covariance), master.
FIELDS: dict[Kind, int] = {"slatf1": 1 + 2 + 27, "slatf2": 1 + 2 + 3 + 27}


@dataclass(frozen=True, eq=False)
class World:
    """What the slave meets while communication is broken.

    Attributes
    ----------
    slave : ndarray, dtype SLAVE
        Its state when communication broke.
    master : ndarray, dtype MASTER
        What it was told of the master.
    readings : ndarray, dtype READING, shape (400,)
        What it then measured.
    """

    slave: npt.NDArray[Any]
    master: npt.NDArray[Any]
    readings: npt.NDArray[Any]


@cache
def paper_world(seed: int = 1) -> World:
    """Let C++ play the scenario of section 7, 400 s with 200 pings.

    Parameters
    ----------
    seed : int
        Of the noise.

    Returns
    -------
    World
        What the slave meets.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "slatf_world"
        flags = ["-std=c++11", "-O1", "-ffp-contract=off"]
        source = str(HERE / "slatf_world.cpp")
        subprocess.run(["g++", *flags, *INCLUDES, source, "-o", str(program)], check=True)
        words = subprocess.run([program, str(seed)], check=True, capture_output=True).stdout
    slave, master = SLAVE.itemsize, SLAVE.itemsize + MASTER.itemsize
    return World(
        np.frombuffer(words[:slave], SLAVE)[0],
        np.frombuffer(words[slave:master], MASTER)[0],
        np.frombuffer(words[master:], READING),
    )


@dataclass(frozen=True, eq=False)
class Record:
    """A filter and the world that it meets; the defaults are those of R1 at noise level 3."""

    kind: Kind
    particles: int
    world: World = field(default_factory=paper_world)
    seed: int = 1
    sigma_speed_m_s: float = 2.0
    sigma_heading_rad: float = 0.3
    compensate_bias: bool = True
    acceleration_m_s2: float = 1e-4
    resample_below: float = 0.5
    gate: float = 0.0
    sigma_range_m: float = 1.0
    sigma_bearing_rad: float = 0.06

    def to_bytes(self) -> bytes:
        """Return the record as the replay programs read it."""
        kind = ("slatf1", "slatf2").index(self.kind)
        readings = self.world.readings
        parts = [
            np.array([kind, self.particles, len(readings), self.seed], "<u4"),
            np.array([self.sigma_speed_m_s, self.sigma_heading_rad], "<f4"),
            np.array([self.compensate_bias], "<u4"),
            np.array([self.acceleration_m_s2, self.resample_below, self.gate], "<f4"),
            np.array([self.sigma_range_m, self.sigma_bearing_rad], "<f4"),
            self.world.slave,
            self.world.master,
            readings,
        ]
        return b"".join(part.tobytes() for part in parts)

    @property
    def trace(self) -> np.dtype[Any]:
        """What the filter shows after an echo; floats as their bits."""
        return np.dtype(
            [
                ("particles", "<u4", (self.particles, FIELDS[self.kind])),
                ("slave_x", "<u4", 2),
                ("slave_P", "<u4", 3),
                ("master_x", "<u4", 6),
                ("master_P", "<u4", 21),
                ("effective_size", "<u4"),
                ("log_likelihood", "<u4"),
                ("resamplings", "<u4"),
                ("status", "<u4"),
            ]
        )

    def trace_of(self, data: bytes) -> npt.NDArray[Any]:
        """Take a trace apart.

        Parameters
        ----------
        data : bytes
            What a replay program wrote.

        Returns
        -------
        ndarray, dtype `trace`, shape (echoes,)
            A row for each echo.

        Raises
        ------
        ValueError
            If the filter refused to start or the trace is not of this record.
        """
        prefix, echoes = 8, int((self.world.readings["heard"] != 0).sum())
        if any(data[:prefix]):
            statuses = np.frombuffer(data[:prefix], "<u4").tolist()
            raise ValueError(f"{self.kind}: statuses of reset and add_master: {statuses}")
        if len(data) != prefix + echoes * self.trace.itemsize:
            raise ValueError(f"{self.kind}: a trace of {len(data)} bytes is not of {echoes} echoes")
        return np.frombuffer(data, self.trace, offset=prefix)
