"""The build backend: scikit-build-core's, with a source distribution that needs only a compiler.

It has what git tracks, and the headers of Eigen and xsimd in ``cpp/vendored``. What lies about in a
checkout is in no archive, ignored by git or not. Outside of a checkout, as in an unpacked source
distribution, everything is taken.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from scikit_build_core.build import *  # noqa: F403 (the hooks)
from scikit_build_core.build import build_sdist as _build_sdist

from auvest._headers import eigen_folder

#: What is tracked and is no part of it; of Eigen, what is for other libraries than the compiler's.
_EXCLUDED = (".ci", "/cpp/vendored/**/*_BLAS.h", "/cpp/vendored/**/*_MKL.h")

#: The licence-clean part of Eigen, which the wheel ships, too (cpp/bindings/CMakeLists.txt).
_EIGEN = ("Eigen/Core", "Eigen/src/Core", "Eigen/src/plugins")
_XSIMD = ("/usr/include/xsimd", "/usr/local/include/xsimd")


def build_sdist(
    sdist_directory: str, config_settings: dict[str, list[str] | str] | None = None
) -> str:
    """Build the source distribution, without files that git does not track."""
    settings: dict[str, list[str] | str] = {**(config_settings or {})}
    settings["sdist.exclude"] = [*_EXCLUDED, *map(_pattern, _untracked())]
    for source, target in _vendored().items():
        settings[f"sdist.force-include.{source}"] = target
    return _build_sdist(sdist_directory, settings)


def _vendored() -> dict[Path, str]:
    """Say which headers of others go where; none if they are there, as they are when unpacked."""
    target = "cpp/vendored"
    if Path(target).exists():
        return {}
    eigen = eigen_folder()
    xsimd = [path for path in map(Path, _XSIMD) if (path / "xsimd.hpp").is_file()]
    if eigen is None or not xsimd:
        raise FileNotFoundError("a source distribution takes up libeigen3-dev and libxsimd-dev")
    headers = {eigen / part: f"{target}/{part}" for part in _EIGEN}
    return {**headers, xsimd[0]: f"{target}/xsimd"}


def _untracked() -> list[str]:
    if not Path(".git").exists():
        return []
    command = ["git", "ls-files", "--others", "--directory", "-z"]
    done = subprocess.run(command, capture_output=True, check=True)
    return [name for name in done.stdout.decode().split("\0") if name]


def _pattern(path: str) -> str:
    """Write a path as .gitignore would have it."""
    return "/" + re.sub(r"([\\*?\[\]!# ])", r"\\\1", path)
