"""The extended Kalman filter, and the M-estimation EKF as a preset of it."""

from __future__ import annotations

from auvest.filters._base import GaussianFilter
from auvest.filters._robust import RobustByDefault


class Ekf(GaussianFilter):
    """Extended Kalman filter: models are linearised at the mean.

    Parameters
    ----------
    x0 : array_like, shape (n,)
        First estimate; n and the meaning of its components are those of ``process.state``.
        Coordinates count from a local origin: where they are coarse in the precision against the
        sigmas, as those of UTM in float32, they are refused.
    P0 : array_like, shape (n, n)
        Its covariance, symmetric positive definite.
    process : ProcessModel
        How the state moves: :class:`auvest.ConstantAcceleration`, :class:`auvest.SpeedHeading`, ...
    sensors : MeasurementModel, sequence or dict of them
        What ``update`` and ``run`` take unless told otherwise, or by name.
    kernel : Kernel or {"igg", "huber", "hampel", "unit"}, optional
        Robust kernel: how far a measurement is believed. A name stands for its default thresholds;
        None: every measurement counts fully.
    recovery : RejectionStreak, optional
        Recovery from lock-out, for filters with a kernel.
    policy : FixedInterval, MahalanobisInterval or CovarianceBudget, optional
        Interval policy: the filter then chooses when to sample next (``feedback``, ``interval``).
    late_s : float
        How long ago a measurement may have been taken, s: it goes in at its own time, and what came
        since is done again.
    longest_step_s : float
        A prediction longer than this, s, is refused: a clock that jumped, or another unit of time;
        infinity: none is.
    components : int
        For a start that is not known, which a sigma of many times the distances says: how many
        Gaussians the belief may be made of, 8..255; 16 to 32 are enough. The first range is then a
        ring of them, and ``convergence`` says how far the ranges tell where the craft is. Use a
        kernel that rejects. 1: one Gaussian, for a start that is known.
    headings : int
        For a heading, the third state, that is not known at all: how many the start is made of,
        2..``components`` / 8. That of ``x0`` and its part of ``P0`` do not count then.
    residual : {"innovation", "post-fit"}
        What the kernel judges: the innovation by its own standard deviation, or what is left of it
        after the update by that of the sensor.
    max_iterations : int
        Solutions of one update for "post-fit", 2..255; "innovation" takes one.
    tolerance : float
        For "post-fit": the end is where no weight changes by more than this, not negative.
    reference : array_like, shape (2,), optional
        Desired position (m) at the start, for the policy; default: that of ``x0``.
    dtype : {"float64", "float32"}
        Precision; float32 gives the bits of the filter on the vehicle.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """

    _linearisation = 0
    _jacobians = True


class RobustEkf(RobustByDefault, Ekf):
    """M-estimation EKF (Li, Du, Fan, Chen, Mao, Luo 2020): an :class:`Ekf` with a robust kernel.

    Parameters
    ----------
    x0, P0
        As for :class:`Ekf`.
    kernel, recovery
        As for :class:`Ekf`; here Hampel's kernel and a recovery from lock-out are the default.
    **options
        Everything else of :class:`Ekf`.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; the message names it.
    """
