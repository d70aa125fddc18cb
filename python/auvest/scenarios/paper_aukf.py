"""The simulation of the AUKF paper (Deng, Yin, Duan 2019), section 3: the one definition of it.

``auvest simulate aukf`` and ``auvest reproduce aukf`` both run what this module builds. The paper
leaves much open; every choice stands in :data:`ASSUMPTIONS` with its reason.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

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
from auvest.scenarios.tracking import Noise, Track

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


@dataclass(frozen=True)
class Assumption:
    """One thing the paper leaves open: what we chose, and why."""

    quantity: str
    paper: str
    ours: str
    reason: str


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
    if name == "ekf":
        return Ekf(x0, P0, process=process, sensors=sensor, dtype=dtype)
    points = {"alpha": alpha, "beta": beta, "kappa": kappa}
    if name == "ukf":
        return Ukf(x0, P0, process=process, sensors=sensor, dtype=dtype, **points)
    return Aukf(
        x0,
        P0,
        process=process,
        sensors=sensor,
        policy=MahalanobisInterval() if policy is None else policy,
        dtype=dtype,
        **points,
    )


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


_SIGMA_P, _SIGMA_V, _SIGMA_A = P0_SIGMA
_PROCESS = ConstantAcceleration(discretisation="euler")
_MEASUREMENT = RangeBearing()
_LAW = MahalanobisInterval()
_NOISE = paper_noise()
_TRACK = paper_track()

#: Everything the simulation needs and the paper does not say, or says in two ways.
ASSUMPTIONS: tuple[Assumption, ...] = (
    Assumption(
        "Start of the filter, x0",
        "position, speed and acceleration in Table 1",
        f"the true start: {_TRACK.position} m, {_TRACK.velocity} m/s, {_TRACK.acceleration} m/s^2",
        "Table 1 gives them, and the vehicle is launched from the station",
    ),
    Assumption(
        "Direction of speed and acceleration",
        "not stated; sizes 0.224 m/s and 0.0224 m/s^2",
        f"components {_TRACK.velocity} m/s and {_TRACK.acceleration} m/s^2, a straight line",
        "0.224 = |(0.1, 0.2)| and 0.0224 = |(0.01, 0.02)| to the printed digits",
    ),
    Assumption(
        "Covariance of the start, P0",
        "not stated",
        f"standard deviations {_SIGMA_P} m, {_SIGMA_V} m/s, {_SIGMA_A} m/s^2",
        "launched from the deck: position known to the range sensor's noise, speed and "
        "acceleration to a fraction of their size. With an exact x0 any P0 is pessimistic; a much "
        "larger one lets the first estimates jump (see finding 3)",
    ),
    Assumption(
        "Process noise, Q",
        "not stated; w in Eq. (4)",
        f"T diag(q), q = {_PROCESS.position_psd:g} m^2/s, {_PROCESS.velocity_psd:g} m^2/s^3, "
        f"{_PROCESS.acceleration_psd:g} m^2/s^5 (the package's defaults)",
        "the simulated truth follows Eq. (4) without noise, so even 0 would be consistent; these "
        "values let the speed wander by 1 cm/s in one second, which a real vehicle needs, and "
        "leave NIS and NEES a little below 2",
    ),
    Assumption(
        "Measurement noise, R",
        "not stated",
        "the variances of the simulated noise, without its bias",
        "the filter knows its sensors; a zero-mean model is all that Eq. (6) offers",
    ),
    Assumption(
        "Size of the noise",
        "uniform, Gaussian and logarithmic noise '(0, 1)' in metres",
        f"scaled to {_NOISE.range_m} m and {_NOISE.bearing_rad} rad in the figures; the paper's "
        "size in finding 3",
        "with noise of 1 m the figures cannot be reproduced",
    ),
    Assumption(
        "How the noise maps to range and bearing",
        "not stated; one '(0, 1)' for both, 'in metres'",
        "independent draws of the same kind for range and bearing, each with its own scale",
        "Eq. (6) has v_r and v_phi; one unit cannot serve both",
    ),
    Assumption(
        "Bias of uniform and logarithmic noise",
        "not mentioned",
        "kept, as in the paper; also measured with the mean removed",
        "U(0, 1) has mean 0.5, exp(N(0, 1)) has mean 1.65 and standard deviation 2.16",
    ),
    Assumption(
        "'Logarithmic' noise",
        "'log noise, mean and variance (0, 1)'",
        "exp(N(0, 1)): the logarithm has mean 0 and variance 1",
        "the usual lognormal distribution",
    ),
    Assumption(
        "Shortest interval, T_min",
        "named, value not stated",
        f"{_LAW.min_s} s (preset figure3), {MahalanobisInterval('table1').min_s} s (preset table1)",
        "far below both 0.5 s and what the law settles at, and above what an ATmega2560 needs for "
        "a step; table1: below the 0.018 s of finding 1, so that T_min hides nothing",
    ),
    Assumption(
        "gamma1, gamma2",
        "10 and 100 in Table 1",
        f"{_LAW.gamma1_m2:g} m^2 and {_LAW.gamma2:g} (preset figure3); Table 1's in preset table1",
        "Table 1 and Fig. 3 exclude each other, finding 1",
    ),
    Assumption(
        "Order inside a step",
        "circular as printed: (8) needs tau(k), (12) gives tau(k+1)",
        "update, M(k), T(k) with the tau in hand, d(k), tau(k+1); T(k) leads to the next sample",
        "the only causal reading",
    ),
    Assumption(
        "Limits of M and tau",
        "0 < M < 0.9 and tau in (0, 1)",
        f"M clamped to 0..{_LAW.ratio_max}, tau to {_LAW.tau_min}..{_LAW.tau_max}",
        "Eqs. (7) and (12) alone keep neither",
    ),
    Assumption(
        "(d)_2 in Eq. (12)",
        "printed as a subscript",
        "d^2, the squared Mahalanobis distance",
        "a subscript has no meaning there; d itself would be 1.22 where d^2 is 1.5",
    ),
    Assumption(
        "Divisor of cov in Eq. (10)",
        "'cov' only",
        "N - 1 = 3",
        "the default of the usual programs; with N = 4, d^2 is 4/3 as large",
    ),
    Assumption(
        "Singular covariance in Eq. (11)",
        "not mentioned; singular at the start and on noise-free straight legs",
        "machine epsilon times its trace is added to its diagonal",
        "gives the distance along the line there, and changes nothing elsewhere",
    ),
    Assumption(
        "Reference track R(k)",
        "'true desired' track",
        "the truth, moved by Eq. (4) with the filter's own T(k), without noise",
        "in the paper's figures reference and observation shift with tau(0)",
    ),
    Assumption(
        "Sigma points for the update",
        "not stated",
        "redrawn from the predicted mean and covariance",
        "the process is linear, so the prediction is exact in closed form",
    ),
    Assumption(
        "Arctangent in Eq. (6)",
        "arctan",
        "atan2, innovations wrapped to (-pi, pi]",
        "arctan folds the plane",
    ),
    Assumption(
        "Measurement at the station",
        "start and station are the same point: range 0, no bearing",
        f"position form while the range is below {_MEASUREMENT.near_field:g} standard deviations "
        "of the position",
        "there a bearing has no useful slope; see docs/algorithms",
    ),
    Assumption(
        "Number of runs",
        "one",
        "means over many runs, with standard errors",
        "one run cannot rank two filters",
    ),
)
