"""What takes minutes of compilers or of a chip's time is tested where that is asked for."""

from __future__ import annotations

import os

import pytest

ASKED = "AUVEST_SLOW_TESTS" in os.environ
SLOW = pytest.mark.skipif(not ASKED, reason="AUVEST_SLOW_TESTS is not set")
