"""The version of the installed package: it lives in pyproject.toml only."""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """Version of the installed distribution; "unknown" in a source tree that is not installed."""
    try:
        return metadata.version("auvest")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"
