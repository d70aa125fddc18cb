"""Write the record that the example ``replay`` plays: one run of the paper's simulation.

    python -m firmware.replay_record [--output firmware/library/examples/replay/record.h]

The run is that of ``auvest simulate aukf --seed 1 --dtype float32``: the paper's 60 steps with the
preset figure3. Floats are written as their bits, and so is the last estimate, which the chip must
find again.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from auvest import Aukf
from auvest.simulation import paper_aukf
from auvest.simulation.tracking import Scenario, sensor_of, simulate

HEADER = Path(__file__).resolve().parent / "library" / "examples" / "replay" / "record.h"


Floats = npt.NDArray[np.float32]


def record() -> tuple[Floats, Floats, Floats, Floats]:
    """Compute the run.

    Returns
    -------
    start, variances : ndarray, shape (6,)
        State at time 0 and the diagonal of its covariance.
    rows : ndarray, shape (60, 4)
        Range, bearing and desired position of each step.
    last : ndarray, shape (6,)
        State after the last step.
    """
    noise = paper_aukf.paper_noise()
    filter_ = paper_aukf.paper_filter("aukf", noise=noise, dtype="float32")
    if not isinstance(filter_, Aukf):
        raise TypeError("the paper's filter is not an AUKF")
    scenario = Scenario(
        track=paper_aukf.paper_track(), noise=noise, steps=paper_aukf.STEPS, runs=1, seed=1
    )
    start, variances = filter_.x.copy(), np.diagonal(filter_.P).copy()
    result = simulate(filter_, scenario)
    rows = np.hstack([result.z[0], result.truth[0]]).astype(np.float32)
    # The noise is not cut off at a range of 0, as a sonar's is.
    sonar = replace(sensor_of(filter_), smallest_range_m=-1e6)
    last = filter_.run(rows[:, :2], sensor=sonar, reference=rows[:, 2:]).x[-1]
    if not np.array_equal(last, result.x[0, -1]):
        raise RuntimeError("the record does not give the estimates of the simulation")
    return start, variances, rows, last


def header() -> str:
    """Return the text of the header."""
    start, variances, rows, last = record()
    lines = [f"    {{{', '.join(_bits(row))}}}," for row in rows]
    return f"""\
// One run of the AUKF paper's simulation. Written by `python -m firmware.replay_record`.
// clang-format off
#pragma once

#include <avr/pgmspace.h>
#include <stdint.h>

constexpr uint8_t kSteps = {len(rows)};

// State at time 0 and the diagonal of its covariance: bits of floats.
const uint32_t kStart[6] PROGMEM = {{
    {", ".join(_bits(start))}}};
const uint32_t kStartVariances[6] PROGMEM = {{
    {", ".join(_bits(variances))}}};

// Range [m], bearing [rad] and desired position x, y [m] of each step.
const uint32_t kRecord[kSteps][4] PROGMEM = {{
{chr(10).join(lines)}
}};

// The state after the last step, as the desk computes it.
const uint32_t kLastState[6] PROGMEM = {{
    {", ".join(_bits(last))}}};
"""


def _bits(values: npt.NDArray[np.float32]) -> list[str]:
    return [f"0x{bits:08x}" for bits in values.view(np.uint32).tolist()]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--output", type=Path, default=HEADER, help="(default: the example's own)")
    parser.parse_args().output.write_text(header(), encoding="utf-8")


if __name__ == "__main__":
    main()
