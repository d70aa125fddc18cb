"""The self-test as Python sees it; what it finds in other builds is tests/parity."""

from __future__ import annotations

import ctypes
import platform

import pytest

import auvest
from auvest import SelfTestPart

FE_UPWARD = {"x86_64": 0x800, "aarch64": 0x400000}


def test_it_passes_here():
    result = auvest.self_test()
    assert result.ok
    assert result.failed == SelfTestPart.none
    assert result.message == "ok"
    assert repr(result) == "SelfTestResult(ok)"


@pytest.fixture
def round_upward():
    libm = ctypes.CDLL("libm.so.6")
    assert libm.fesetround(FE_UPWARD[platform.machine()]) == 0
    yield
    libm.fesetround(0)


@pytest.mark.usefixtures("round_upward")
def test_a_wrong_rounding_mode_is_named():
    result = auvest.self_test()
    assert not result.ok
    assert result.failed == SelfTestPart.rounding
    assert result.message == "sums are not rounded to nearest, ties to even"
