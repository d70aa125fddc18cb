"""The simulation of the SLATF paper (Lu, Chen, Liu, Ma, He 2020), section 7: its one definition.

``auvest simulate slatf`` and ``auvest reproduce slatf`` both run what this module builds. The paper
leaves much open; every choice stands in :data:`ASSUMPTIONS` with its reason. Together they are
configuration R1 of docs/algorithms/slatf.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from auvest.simulation.assumptions import read_assumptions
from auvest.simulation.paper_aukf import DTypeName
from auvest.simulation.slat import SlatScenario
from auvest.slat import DeadReckoning, EkfSlat, Slatf, SlatFilter, SlatfJoint
from auvest.slat.models import PiecewiseAcceleration

#: The columns of Table 1, ours beside the paper's.
FilterName: TypeAlias = Literal[
    "dr", "dr_compensated", "slatf1", "slatf2", "slatf_joint", "ekf_slat"
]
FILTERS: dict[FilterName, str] = {
    "dr": "dead reckoning",
    "dr_compensated": "dead reckoning, bias compensated",
    "slatf1": "SLATF 1.0",
    "slatf2": "SLATF 2.0",
    "slatf_joint": "SLATF, joint",
    "ekf_slat": "EKF-SLAT",
}

#: Section 7: 50 runs of 100 particles.
RUNS = 50
PARTICLES = 100


@dataclass(frozen=True)
class Level:
    """A noise level of section 7, and what Table 1 prints for it: RMSE in m."""

    number: int
    sigma_range_m: float
    sigma_bearing_rad: float
    paper: dict[FilterName, float] | None = None


def _row(dr: float, slatf1: float, slatf2: float) -> dict[FilterName, float]:
    return {"dr": dr, "slatf1": slatf1, "slatf2": slatf2}


#: Levels 1 to 4 are Table 1's; 5 to 7 are those that Fig. 6 adds.
LEVELS: tuple[Level, ...] = (
    Level(1, 15, 0.4, _row(59.9892, 33.2032, 27.7221)),
    Level(2, 10, 0.3, _row(58.1659, 29.1760, 25.6497)),
    Level(3, 1, 0.06, _row(59.0700, 35.4430, 20.2979)),
    Level(4, 0.5, 0.03, _row(57.1940, 39.7212, 17.5921)),
    Level(5, 1.5, 0.09),
    Level(6, 0.8, 0.05),
    Level(7, 0.3, 0.015),
)


def paper_scenario(level: Level, *, runs: int = RUNS, seed: int = 1) -> SlatScenario:
    """Make the scenario of section 7 at a noise level; each level has noise of its own."""
    return SlatScenario(
        sigma_range_m=level.sigma_range_m,
        sigma_bearing_rad=level.sigma_bearing_rad,
        runs=runs,
        seed=(seed + (level.number << 60)) % 2**64,
    )


def paper_filter(
    name: FilterName,
    scenario: SlatScenario,
    *,
    particles: int = PARTICLES,
    compensate_bias: bool = True,
    acceleration_m_s2: float = PiecewiseAcceleration().acceleration_m_s2,
    dtype: DTypeName = "float64",
    **options: Any,
) -> SlatFilter:
    """Set up a filter as the scenario needs it: it knows the noise of all sensors.

    Parameters
    ----------
    name : {"dr", "dr_compensated", "slatf1", "slatf2", "slatf_joint", "ekf_slat"}
    scenario : SlatScenario
    particles : int
        Of SLATF 1.0, 2.0 and joint.
    compensate_bias : bool
        Make up for the bias of the heading's noise, except in "dr".
    acceleration_m_s2 : float
        q of the master's model.
    dtype : {"float64", "float32"}
        Precision.
    **options
        Of the filter that hears echoes, beside its models.
    """
    x0 = np.array([scenario.slave.x_m, scenario.slave.y_m])
    P0 = np.zeros((2, 2))
    motion = replace(scenario.motion, compensate_bias=compensate_bias and name != "dr")
    if name in ("dr", "dr_compensated"):
        return DeadReckoning(x0, P0, motion=motion, dtype=dtype)
    master = PiecewiseAcceleration(acceleration_m_s2=acceleration_m_s2)
    # The paper has no gate, and no more in its covariance than the particles say.
    options = {"gate": 0.0, **options}
    if name in ("slatf1", "slatf2"):
        options.setdefault("monte_carlo", False)
    options.update(motion=motion, master=master, sonar=scenario.sonar, dtype=dtype)
    if name == "ekf_slat":
        return EkfSlat(x0, P0, **options)
    if name == "slatf_joint":
        masters = len(scenario.masters)
        return SlatfJoint(x0, P0, particles=particles, max_masters=masters, **options)
    return Slatf(x0, P0, particles=particles, version=1 if name == "slatf1" else 2, **options)


_R1 = SlatScenario()

#: Everything the simulation needs and the paper does not say, or says in two ways.
ASSUMPTIONS = read_assumptions(
    __name__,
    scenario=_R1,
    master=_R1.masters[0],
    ping_s=_R1.odometry_s * _R1.odometry_per_ping,
    q=PiecewiseAcceleration().acceleration_m_s2,
)
