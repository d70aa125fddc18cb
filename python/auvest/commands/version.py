"""``auvest version``: the version of the installed package, and what this build lacks.

It is what ``auvest --version`` shows. The version lives in pyproject.toml only.

Examples
--------
  auvest version
"""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """Version of the installed distribution; "unknown" in a source tree that is not installed."""
    try:
        return metadata.version("auvest")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"


def lines() -> list[str]:
    """Give the name with the version and, of a build that lacks something, a line that says it."""
    from auvest._build import lacks

    return [f"auvest {version()}", *lacks()]


def command() -> None:
    """Show the version."""
    print("\n".join(lines()))
