"""Write the record that the page checks itself by: answers of a sonar, and the bits of the desk.

    python -m firmware.browser.trace [--output firmware/browser/trace.json]

The sketch ``tracking_loop`` takes 60 samples of the AUKF paper's simulation. After each, Python's
filter in float32 has the bits that the chip, and the same C++ as WebAssembly, must have too.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from auvest import Aukf, ConstantAcceleration, MahalanobisInterval, RangeBearing, telemetry
from auvest.commands.capture import SimulatedSonar

TRACE = Path(__file__).resolve().parent / "trace.json"
SAMPLES = 60
TICKS_PER_S = 250_000


def trace(samples: int = SAMPLES, seed: int = 1) -> dict[str, Any]:
    """Compute the record.

    Parameters
    ----------
    samples : int
    seed : int
        Of the sonar's noise.

    Returns
    -------
    dict
        ``answers``: bodies of the sonar's lines. ``words``: after each, the bits of state (6), P's
        first rows (3), NIS and interval.
    """
    sonar = SimulatedSonar(seed=seed)
    sigma = np.repeat(np.array([0.05, 0.02, 0.005], np.float32), 2)
    estimator = Aukf(
        np.array([0.2, 2.0, 0.1, 0.2, 0.01, 0.02], np.float32),
        np.diag(sigma * sigma),
        process=ConstantAcceleration(discretisation="euler"),
        sensors=RangeBearing(largest_range_m=75.0),
        policy=MahalanobisInterval(),
        alpha=np.float32(1e-6),
        dtype="float32",
    )
    answers, words, ticks = [], [], 0
    for sample in range(1, samples + 1):
        interval_s = estimator.interval
        ticks += int(np.float32(interval_s) * np.float32(TICKS_PER_S) + np.float32(0.5))
        answer = sonar.measure(sample, ticks / TICKS_PER_S)
        if answer is None:
            raise RuntimeError("the paper's sonar loses no answer")
        body = telemetry.body_of(answer[0])
        z = [float(telemetry.number(text)) for text in body.split(",")[2:]]
        estimator.predict(interval_s)
        estimator.update(z)
        estimator.feedback(_desired(ticks))
        P = estimator.P
        numbers = [*estimator.x, P[0, 0], P[1, 0], P[1, 1], estimator.nis, estimator.interval]
        if not all(map(math.isfinite, numbers)):
            raise RuntimeError(f"sample {sample} has a number that is none")
        answers.append(body)
        words.append(np.array(numbers, np.float32).view(np.uint32).tolist())
    return {"answers": answers, "words": words}


def _desired(ticks: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Give the desired position as the sketch computes it, in float."""
    seconds, rest = divmod(ticks, TICKS_PER_S)
    t = np.float32(seconds) + np.float32(rest) * np.float32(1 / TICKS_PER_S)
    start, velocity, acceleration = np.array([[0.2, 2.0], [0.1, 0.2], [0.01, 0.02]], np.float32)
    return np.asarray(start + t * (velocity + np.float32(0.5) * acceleration * t))


def text() -> str:
    """Return the record as it is stored."""
    record = trace()
    answers = ",\n".join(f'  "{body}"' for body in record["answers"])
    words = ",\n".join(f"  {json.dumps(row)}" for row in record["words"])
    return f'{{"answers": [\n{answers}\n],\n"words": [\n{words}\n]}}\n'


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="firmware.browser.trace", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--output", type=Path, default=TRACE, help="(default: the page's own)")
    parser.parse_args().output.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    main()
