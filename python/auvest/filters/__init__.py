"""The Kalman filters: one family of any process, sensors, kernel and interval policy."""

from __future__ import annotations

from auvest.filters._base import GaussianFilter, Residual, Sensors
from auvest.filters.ekf import Ekf, RobustEkf
from auvest.filters.results import Mixture, Report, RunResult, RunsResult, SmoothResult
from auvest.filters.ukf import Aukf, RobustUkf, Ukf

__all__ = [
    "Aukf",
    "Ekf",
    "GaussianFilter",
    "Mixture",
    "Report",
    "Residual",
    "RobustEkf",
    "RobustUkf",
    "RunResult",
    "RunsResult",
    "Sensors",
    "SmoothResult",
    "Ukf",
]
