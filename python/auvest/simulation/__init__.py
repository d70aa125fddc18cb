"""Simulated worlds in which filters and vehicles are tried.

A hull that is steered is imported by name: ``mission`` and ``vehicle_in_the_loop``.
"""

from auvest.simulation import cooperative, matched, slat, tracking

__all__ = ["cooperative", "matched", "slat", "tracking"]
