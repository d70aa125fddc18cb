"""What the compiled module lacks of what it could have on this processor."""

from __future__ import annotations

import platform

from auvest import _core


def lacks() -> list[str]:
    """Give a line for each thing; the log of a build, which pip hides, says it too."""
    vectors = platform.machine() in ("x86_64", "AMD64")
    if vectors and _core.slat_lanes(True) == ["scalar"]:
        return [
            "built without xsimd: Slatf takes its particles one by one, several times slower "
            "(Debian: apt-get install libxsimd-dev, and install auvest again)"
        ]
    return []
