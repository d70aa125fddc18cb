"""Simulated worlds in which the filters are tried."""

from auvest.scenarios import slat, tracking

__all__ = ["slat", "tracking"]
from auvest.scenarios import cooperative, matched

__all__ = ["cooperative", "matched", "tracking"]
