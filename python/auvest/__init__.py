"""auvest: estimators for small autonomous underwater vehicles.

The same C++ filters run here, on a Cortex-M and on an ATmega2560, in float32 with the same bits.
SI units, angles in rad; bearings from +x towards +y.

Every name is imported when it is first used: neither ``import auvest`` nor ``auvest --help`` waits
for NumPy. To add a name: a line for type checkers and one for Python, both sorted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from auvest import metrics as metrics
    from auvest import montecarlo as montecarlo
    from auvest import plots as plots
    from auvest import simulation as simulation
    from auvest._core import Convergence as Convergence
    from auvest._core import Decision as Decision
    from auvest._core import SelfTestPart as SelfTestPart
    from auvest._core import SelfTestResult as SelfTestResult
    from auvest._core import Status as Status
    from auvest._core import self_test as self_test
    from auvest._headers import get_include as get_include
    from auvest.errors import FilterError as FilterError
    from auvest.errors import ModelError as ModelError
    from auvest.errors import SweepError as SweepError
    from auvest.filters import Aukf as Aukf
    from auvest.filters import Ekf as Ekf
    from auvest.filters import Mixture as Mixture
    from auvest.filters import Report as Report
    from auvest.filters import RobustEkf as RobustEkf
    from auvest.filters import RobustUkf as RobustUkf
    from auvest.filters import RunResult as RunResult
    from auvest.filters import RunsResult as RunsResult
    from auvest.filters import SmoothResult as SmoothResult
    from auvest.filters import Ukf as Ukf
    from auvest.filters.ckf import Ckf as Ckf
    from auvest.intervals import CovarianceBudget as CovarianceBudget
    from auvest.intervals import FixedInterval as FixedInterval
    from auvest.intervals import MahalanobisInterval as MahalanobisInterval
    from auvest.kernels import Hampel as Hampel
    from auvest.kernels import Huber as Huber
    from auvest.kernels import Igg as Igg
    from auvest.kernels import RejectionStreak as RejectionStreak
    from auvest.kernels import Unit as Unit
    from auvest.models import BodyVelocity as BodyVelocity
    from auvest.models import ConstantAcceleration as ConstantAcceleration
    from auvest.models import Depth as Depth
    from auvest.models import FunctionProcess as FunctionProcess
    from auvest.models import FunctionSensor as FunctionSensor
    from auvest.models import HeadingSpeed as HeadingSpeed
    from auvest.models import LeaderRange as LeaderRange
    from auvest.models import MeasurementModel as MeasurementModel
    from auvest.models import Odometry as Odometry
    from auvest.models import OdometryConstants as OdometryConstants
    from auvest.models import PlanarHull as PlanarHull
    from auvest.models import Position as Position
    from auvest.models import ProcessModel as ProcessModel
    from auvest.models import RangeBearing as RangeBearing
    from auvest.models import RangeBearingElevation as RangeBearingElevation
    from auvest.models import ScaledRange as ScaledRange
    from auvest.models import SpeedHeading as SpeedHeading
    from auvest.models import SpeedHeadingCurrent as SpeedHeadingCurrent
    from auvest.models import WhiteAcceleration as WhiteAcceleration
    from auvest.models.library import load_models as load_models
    from auvest.slat import UNKNOWN_MASTER as UNKNOWN_MASTER
    from auvest.slat import DeadReckoning as DeadReckoning
    from auvest.slat import EkfSlat as EkfSlat
    from auvest.slat import Outage as Outage
    from auvest.slat import Slatf as Slatf
    from auvest.slat import SlatfJoint as SlatfJoint
    from auvest.slat import SlatRun as SlatRun
    from auvest.slat.models import CompassMotion as CompassMotion
    from auvest.slat.models import ConstantVelocity as ConstantVelocity
    from auvest.slat.models import CoordinatedTurn as CoordinatedTurn
    from auvest.slat.models import Imm as Imm
    from auvest.slat.models import PiecewiseAcceleration as PiecewiseAcceleration
    from auvest.slat.models import Sonar as Sonar
    from auvest.slat.models import UnicycleMotion as UnicycleMotion
    from auvest.sweeps import sweep as sweep

    __version__: str
else:
    from importlib import import_module

    _SUBMODULES = ("metrics", "montecarlo", "plots", "simulation")
    _HOME = {
        "Aukf": "filters",
        "BodyVelocity": "models",
        "Ckf": "filters.ckf",
        "CompassMotion": "slat.models",
        "ConstantAcceleration": "models",
        "ConstantVelocity": "slat.models",
        "Convergence": "_core",
        "CoordinatedTurn": "slat.models",
        "CovarianceBudget": "intervals",
        "DeadReckoning": "slat",
        "Decision": "_core",
        "Depth": "models",
        "Ekf": "filters",
        "EkfSlat": "slat",
        "FilterError": "errors",
        "FixedInterval": "intervals",
        "FunctionProcess": "models",
        "FunctionSensor": "models",
        "Hampel": "kernels",
        "HeadingSpeed": "models",
        "Huber": "kernels",
        "Igg": "kernels",
        "Imm": "slat.models",
        "LeaderRange": "models",
        "MahalanobisInterval": "intervals",
        "MeasurementModel": "models",
        "Mixture": "filters",
        "ModelError": "errors",
        "Odometry": "models",
        "OdometryConstants": "models",
        "Outage": "slat",
        "PiecewiseAcceleration": "slat.models",
        "PlanarHull": "models",
        "Position": "models",
        "ProcessModel": "models",
        "RangeBearing": "models",
        "RangeBearingElevation": "models",
        "RejectionStreak": "kernels",
        "Report": "filters",
        "RobustEkf": "filters",
        "RobustUkf": "filters",
        "RunResult": "filters",
        "RunsResult": "filters",
        "SmoothResult": "filters",
        "SelfTestPart": "_core",
        "SelfTestResult": "_core",
        "SlatRun": "slat",
        "Slatf": "slat",
        "SlatfJoint": "slat",
        "Sonar": "slat.models",
        "ScaledRange": "models",
        "SpeedHeading": "models",
        "SpeedHeadingCurrent": "models",
        "Status": "_core",
        "SweepError": "errors",
        "UNKNOWN_MASTER": "slat",
        "Ukf": "filters",
        "UnicycleMotion": "slat.models",
        "Unit": "kernels",
        "WhiteAcceleration": "models",
        "get_include": "_headers",
        "load_models": "models.library",
        "self_test": "_core",
        "sweep": "sweeps",
    }
    __all__ = sorted([*_HOME, *_SUBMODULES])

    def __getattr__(name):
        if name in _HOME:
            value = getattr(import_module(f"auvest.{_HOME[name]}"), name)
        elif name in _SUBMODULES:
            value = import_module(f"auvest.{name}")
        elif name == "__version__":
            from auvest.commands.version import version

            value = version()
        else:
            raise AttributeError(f"module 'auvest' has no attribute {name!r}")
        globals()[name] = value  # so that the next use does not come here
        return value

    def __dir__():
        return sorted({*globals(), *__all__, "__version__"})
