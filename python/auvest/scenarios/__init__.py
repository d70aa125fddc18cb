"""Simulated worlds in which the filters are tried."""

from auvest.scenarios import tracking

__all__ = ["tracking"]
