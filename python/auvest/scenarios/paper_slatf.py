"""The simulation of the SLATF paper (Lu, Chen, Liu, Ma, He 2020), section 7: its one definition.

``auvest simulate slatf`` and ``auvest reproduce slatf`` both run what this module builds. The paper
leaves much open; every choice stands in :data:`ASSUMPTIONS` with its reason. Together they are
configuration R1 of docs/algorithms/slatf.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from auvest.scenarios.paper_aukf import Assumption, DTypeName
from auvest.scenarios.slat import SlatScenario
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
    carry_covariance: bool = False,
    acceleration_m_s2: float = PiecewiseAcceleration().acceleration_m_s2,
    dtype: DTypeName = "float64",
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
    carry_covariance : bool
        Eq. (50) to the letter, in "slatf2".
    acceleration_m_s2 : float
        q of the master's model.
    dtype : {"float64", "float32"}
        Precision.
    """
    x0 = np.array([scenario.slave.x_m, scenario.slave.y_m])
    P0 = np.zeros((2, 2))
    motion = replace(scenario.motion, compensate_bias=compensate_bias and name != "dr")
    if name in ("dr", "dr_compensated"):
        return DeadReckoning(x0, P0, motion=motion, dtype=dtype)
    master = PiecewiseAcceleration(acceleration_m_s2=acceleration_m_s2)
    if name == "ekf_slat":
        return EkfSlat(x0, P0, motion=motion, master=master, sonar=scenario.sonar, dtype=dtype)
    if name == "slatf_joint":
        return SlatfJoint(
            x0,
            P0,
            particles=particles,
            motion=motion,
            master=master,
            sonar=scenario.sonar,
            dtype=dtype,
        )
    return Slatf(
        x0,
        P0,
        version=1 if name == "slatf1" else 2,
        particles=particles,
        motion=motion,
        master=master,
        sonar=scenario.sonar,
        carry_covariance=carry_covariance,
        dtype=dtype,
    )


_R1 = SlatScenario()
_MASTER = _R1.masters[0]
_Q = PiecewiseAcceleration().acceleration_m_s2

#: Everything the simulation needs and the paper does not say, or says in two ways.
ASSUMPTIONS: tuple[Assumption, ...] = (
    Assumption(
        "Rate of the odometry",
        "T^S = T^M; only the sonar's 2 s are given",
        f"a reading every {_R1.odometry_s:g} s, an echo every "
        f"{_R1.odometry_s * _R1.odometry_per_ping:g} s",
        "dead reckoning at 1 Hz gives Table 1's 58.6 m; at 0.5 Hz it gives 67 m",
    ),
    Assumption(
        "Start of the vehicles",
        "not stated",
        f"slave at ({_R1.slave.x_m:g}, {_R1.slave.y_m:g}) m, master at ({_MASTER.x_m:g}, "
        f"{_MASTER.y_m:g}) m",
        "not legible in Fig. 2; errors depend on it through the range only",
    ),
    Assumption(
        "What the slave is told of the master when communication breaks",
        "not stated",
        f"position to {_R1.prior_position_m:g} m, velocity to {_R1.prior_velocity_m_s:g} m/s, "
        f"acceleration to {_R1.prior_acceleration_m_s2:g} m/s^2, drawn accordingly",
        "the velocity decides how good any filter can be, see Sensitivity",
    ),
    Assumption(
        "What the slave is told of itself",
        "not stated",
        "its position, exactly",
        "all errors are those of the outage",
    ),
    Assumption(
        "u(k) of the master",
        "known in Eq. (15); 'no information is exchanged' elsewhere",
        "known: the true velocity change of every second, a plan from before the outage",
        "Eq. (15) needs it; what the filters lose without it is under Sensitivity",
    ),
    Assumption(
        "Phi, E, G and Q of the master",
        "left to a reference",
        f"exact Phi with t^2/2, E u = [t/2 u, u, 0], G = [t^2/2, t, 1], q = {_Q:g} m/s^2",
        "the usual model of that state",
    ),
    Assumption(
        "Process noise of the true master",
        "not stated",
        "none: straight, then a steady turn, as Fig. 2 draws it",
        "Fig. 2",
    ),
    Assumption(
        "Noise of the readings",
        "V_k = V_mk + w",
        "measured = true + noise, independent from reading to reading",
        "the other sign has the same distribution; a bias would make 400 s of it 100 m",
    ),
    Assumption(
        "Noise of the levels",
        "not stated; dead reckoning differs from level to level",
        "each level draws its own; all filters of a level meet the same",
        "as Table 1 shows it; filters are compared run by run",
    ),
    Assumption(
        "Bias of the heading's noise",
        "not mentioned; in the paper's dead reckoning",
        "made up for in the filters and in a second dead reckoning, left in the first",
        "E[cos(phi + w)] = exp(-0.3^2 / 2) cos(phi): 4.4 %, some 90 m in 400 s",
    ),
    Assumption(
        "State of the slave",
        "x, y and a heading that feeds nothing",
        "x, y",
        "Eq. (2) moves the position by the measured heading",
    ),
    Assumption(
        "Resampling",
        "'resample below a threshold'",
        "systematic, below N_eff = N / 2",
        "the usual choice",
    ),
    Assumption(
        "Covariance of the pose, Eq. (50)",
        "carried, although the particle (9) has none",
        "G Q G' gathered since the last draw; the paper's reading under Sensitivity",
        "a drawn pose is a point, as in FastSLAM 2.0",
    ),
    Assumption(
        "Signs and factors of Eqs. (54) and (65)",
        "exp(+1/2 ...), old weight dropped, -G_S X_S missing",
        "exp(-1/2 ...), times the old weight, with -G_S X_S",
        "misprints, see docs/algorithms/slatf.md",
    ),
    Assumption(
        "RMSE",
        "not defined",
        "root mean square over the pings of a run, averaged over the runs",
        "the usual definition",
    ),
    Assumption(
        "Mean and variance of the error, Figs 3 and 6",
        "not defined",
        "of the distance between estimate and truth, over pings and runs",
        "one number per level",
    ),
    Assumption(
        "Error over time, Figs 4 and 5",
        "not defined",
        "root mean square over the runs at each ping",
        "one run cannot rank filters",
    ),
)
