"""The simulation of the AUKF paper (Deng, Yin, Duan 2019), section 3: the one definition of it.

``auvest simulate aukf`` and ``auvest reproduce aukf`` both run what this module builds. The paper
leaves much open; every choice stands in :data:`ASSUMPTIONS` with its reason.
"""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from auvest import (
    Aukf,
    ConstantAcceleration,
    Ekf,
    FixedInterval,
    MahalanobisInterval,
    RangeBearing,
    Ukf,
)
from auvest.intervals import IntervalPolicy
from auvest.simulation.assumptions import read_assumptions
from auvest.simulation.tracking import Noise, Track

FilterName: TypeAlias = Literal["ekf", "ukf", "aukf"]
NoiseKind: TypeAlias = Literal["uniform", "normal", "lognormal"]
TrackName: TypeAlias = Literal["paper", "straight", "turn"]
DTypeName: TypeAlias = Literal["float32", "float64"]
Filter: TypeAlias = Ekf | Ukf | Aukf

NOISE_KINDS: tuple[NoiseKind, ...] = ("uniform", "normal", "lognormal")

# Table 1.
STEPS = 60
ALPHA = 1e-6
BETA = 2.0
KAPPA = -3.0
FIXED_INTERVAL_S = FixedInterval().interval_s
TAU0_STUDIED = (0.1, 0.3, 0.5, 0.9)

# Not in the paper: see ASSUMPTIONS.
P0_SIGMA = (0.05, 0.02, 0.005)
TURN_RATE_RAD_S = 0.05


def paper_noise(
    kind: NoiseKind = "normal",
    *,
    range_m: float | None = None,
    bearing_rad: float | None = None,
    centred: bool = False,
    dropout: float = 0.0,
) -> Noise:
    """Make one of the paper's three noises, by default at the size of the preset ``figure3``.

    Parameters
    ----------
    kind : {"uniform", "normal", "lognormal"}
        U(0, 1), N(0, 1) or exp(N(0, 1)), times the two scales.
    range_m, bearing_rad : float, optional
        Scales of the range noise (m) and the bearing noise (rad).
    centred : bool
        Subtract the mean, which is not zero for uniform and lognormal.
    dropout : float
        Probability that a measurement is missing.
    """
    default = RangeBearing()
    return Noise(
        kind=kind,
        range_m=default.sigma_range_m if range_m is None else range_m,
        bearing_rad=default.sigma_bearing_rad if bearing_rad is None else bearing_rad,
        centred=centred,
        dropout=dropout,
    )


def paper_track(name: TrackName = "paper") -> Track:
    """Make the true and desired track.

    Parameters
    ----------
    name : {"paper", "straight", "turn"}
        "paper": Eq. (4) stepped with the filter's own interval. "straight": the same start, speed
        and acceleration, exact in time. "turn": the same start and speed, a steady turn.
    """
    if name == "turn":
        return Track(kind="turn", turn_rate=TURN_RATE_RAD_S)
    return Track(kind="euler" if name == "paper" else "straight")


def paper_filter(
    name: FilterName = "aukf",
    *,
    noise: Noise,
    track: TrackName = "paper",
    policy: IntervalPolicy | None = None,
    alpha: float = ALPHA,
    beta: float = BETA,
    kappa: float = KAPPA,
    p0_sigma: tuple[float, float, float] = P0_SIGMA,
    dtype: DTypeName = "float64",
) -> Filter:
    """Set up a filter as the paper's simulation needs it.

    Parameters
    ----------
    name : {"ekf", "ukf", "aukf"}
        The AUKF takes ``policy``, by default the paper's law with the preset ``figure3``.
    noise : Noise
        What it will meet: the standard deviations of the measurement model are those of the noise.
    track : {"paper", "straight", "turn"}
        Eq. (4) for "paper", the exact discretisation for the others.
    policy : FixedInterval, MahalanobisInterval or CovarianceBudget, optional
        Interval policy of the AUKF.
    alpha, beta, kappa : float
        Sigma points of UKF and AUKF; Table 1 by default.
    p0_sigma : (float, float, float)
        Standard deviations of the start: position (m), velocity (m/s), acceleration (m/s^2).
    dtype : {"float64", "float32"}
        Precision.
    """
    x0 = np.array(paper_track(track).start)
    P0 = np.diag(np.repeat(np.square(p0_sigma), 2))
    process = ConstantAcceleration(discretisation="euler" if track == "paper" else "exact")
    sigma_range_m, sigma_bearing_rad = noise.standard_deviation
    sensor = RangeBearing(sigma_range_m=sigma_range_m, sigma_bearing_rad=sigma_bearing_rad)
    options: dict[str, Any] = {"process": process, "sensors": sensor, "dtype": dtype}
    if name == "ekf":
        return Ekf(x0, P0, **options)
    options.update(alpha=alpha, beta=beta, kappa=kappa)
    if name == "ukf":
        return Ukf(x0, P0, **options)
    return Aukf(x0, P0, policy=policy or MahalanobisInterval(), **options)


def observed_positions(
    z: npt.NDArray[np.float64], station: tuple[float, float]
) -> npt.NDArray[np.float64]:
    """Turn measured range and bearing into positions.

    Parameters
    ----------
    z : ndarray, shape (T, 2)
        Range (m) and bearing (rad).
    station : (float, float)
        Position of the station, m.

    Returns
    -------
    ndarray, shape (T, 2)
        m; NaN where the measurement is missing.
    """
    r, bearing = z[:, 0], z[:, 1]
    return np.stack([station[0] + r * np.cos(bearing), station[1] + r * np.sin(bearing)], axis=-1)


#: Everything the simulation needs and the paper does not say, or says in two ways.
ASSUMPTIONS = read_assumptions(
    __name__,
    track=paper_track(),
    sigma=P0_SIGMA,
    process=ConstantAcceleration(discretisation="euler"),
    noise=paper_noise(),
    sensor=RangeBearing(),
    law=MahalanobisInterval(),
    table1=MahalanobisInterval("table1"),
)
