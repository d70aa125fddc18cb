"""auvest: estimators for small autonomous underwater vehicles.

The same C++ filters run here, on a Cortex-M and on an ATmega2560, in float32 with the same bits.
SI units, angles in rad; bearings from +x towards +y.
"""

from __future__ import annotations

from auvest import metrics, montecarlo, scenarios
from auvest._core import Decision, SelfTestPart, SelfTestResult, Status, self_test
from auvest.commands.version import version
from auvest.errors import FilterError
from auvest.filters import Aukf, Ekf, RunResult, Ukf
from auvest.intervals import CovarianceBudget, FixedInterval, MahalanobisInterval
from auvest.kernels import Hampel, Huber, Igg, RejectionStreak, Unit
from auvest.models import (
    ConstantAcceleration,
    LeaderRange,
    Odometry,
    RangeBearing,
    SpeedHeading,
)
from auvest.robust_filters import RobustEkf, RobustReport, RobustRunResult, RobustUkf
from auvest.slat import (
    UNKNOWN_MASTER,
    DeadReckoning,
    EkfSlat,
    Outage,
    Slatf,
    SlatfJoint,
    SlatRun,
)
from auvest.slat.models import (
    CompassMotion,
    ConstantVelocity,
    CoordinatedTurn,
    Imm,
    PiecewiseAcceleration,
    Sonar,
    UnicycleMotion,
)

__all__ = [
    "UNKNOWN_MASTER",
    "Aukf",
    "CompassMotion",
    "ConstantAcceleration",
    "ConstantVelocity",
    "CoordinatedTurn",
    "CovarianceBudget",
    "DeadReckoning",
    "Decision",
    "Ekf",
    "EkfSlat",
    "FilterError",
    "FixedInterval",
    "Hampel",
    "Huber",
    "Igg",
    "Imm",
    "LeaderRange",
    "MahalanobisInterval",
    "Odometry",
    "Outage",
    "PiecewiseAcceleration",
    "RangeBearing",
    "RejectionStreak",
    "RobustEkf",
    "RobustReport",
    "RobustRunResult",
    "RobustUkf",
    "RunResult",
    "SelfTestPart",
    "SelfTestResult",
    "SlatRun",
    "Slatf",
    "SlatfJoint",
    "Sonar",
    "SpeedHeading",
    "Status",
    "Ukf",
    "UnicycleMotion",
    "Unit",
    "metrics",
    "montecarlo",
    "scenarios",
    "self_test",
]

__version__ = version()
