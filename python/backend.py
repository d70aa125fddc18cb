"""The build backend: scikit-build-core's, with a source distribution of what git tracks.

What lies about in a checkout is in no archive, ignored by git or not. Outside of a checkout, as
in an unpacked source distribution, everything is taken.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from scikit_build_core.build import *  # noqa: F403 (the hooks)
from scikit_build_core.build import build_sdist as _build_sdist

#: What is tracked and is no part of it.
_EXCLUDED = (".ci",)


def build_sdist(
    sdist_directory: str, config_settings: dict[str, list[str] | str] | None = None
) -> str:
    """Build the source distribution, without files that git does not track."""
    excluded = [*_EXCLUDED, *map(_pattern, _untracked())]
    return _build_sdist(sdist_directory, {**(config_settings or {}), "sdist.exclude": excluded})


def _untracked() -> list[str]:
    if not Path(".git").exists():
        return []
    command = ["git", "ls-files", "--others", "--directory", "-z"]
    done = subprocess.run(command, capture_output=True, check=True)
    return [name for name in done.stdout.decode().split("\0") if name]


def _pattern(path: str) -> str:
    """Write a path as .gitignore would have it."""
    return "/" + re.sub(r"([\\*?\[\]!# ])", r"\\\1", path)
