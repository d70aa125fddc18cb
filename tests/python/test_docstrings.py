"""The examples in docstrings run, and give what they show."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest

MODULES = (
    "auvest.metrics",
    "auvest.montecarlo",
    "auvest.plots",
    "auvest.simulation.tracking",
    "auvest.sweeps.run",
)


@pytest.mark.parametrize("module", MODULES)
def test_examples_run(module: str) -> None:
    found = doctest.testmod(import_module(module))
    assert found.attempted >= 3
    assert found.failed == 0
