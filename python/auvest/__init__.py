"""auvest: estimators for small autonomous underwater vehicles.

The same C++ filters run here, on a Cortex-M and on an ATmega2560, in float32 with the same bits.
SI units, angles in rad; bearings from +x towards +y.
"""

from __future__ import annotations

from auvest import metrics, scenarios
from auvest._core import SelfTestPart, SelfTestResult, Status, self_test
from auvest.commands.version import version
from auvest.errors import FilterError
from auvest.filters import Aukf, Ekf, RunResult, Ukf
from auvest.intervals import CovarianceBudget, FixedInterval, MahalanobisInterval
from auvest.models import ConstantAcceleration, RangeBearing

__all__ = [
    "Aukf",
    "ConstantAcceleration",
    "CovarianceBudget",
    "Ekf",
    "FilterError",
    "FixedInterval",
    "MahalanobisInterval",
    "RangeBearing",
    "RunResult",
    "SelfTestPart",
    "SelfTestResult",
    "Status",
    "Ukf",
    "metrics",
    "scenarios",
    "self_test",
]

__version__ = version()
