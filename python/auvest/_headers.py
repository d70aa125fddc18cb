"""Where the C++ headers are that the package brings."""

from __future__ import annotations

import sys
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def get_include() -> str:
    """Folder with the headers of auvest and of Eigen, for a compiler's ``-I``.

    Raises
    ------
    FileNotFoundError
        If auvest is not installed but runs from its sources.
    """
    installed = _installed()
    if installed is None:
        raise FileNotFoundError("the headers come with an installed auvest: pip install .")
    return str(installed)


def include_folders() -> list[Path]:
    """Give all folders that a compiler needs; from the sources where auvest is not installed."""
    installed = _installed()
    if installed is not None:
        return [installed]
    cpp = _PACKAGE.parents[1] / "cpp"
    eigen = [Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3")]
    found = [folder for folder in eigen if (folder / "Eigen" / "Core").is_file()]
    if not (cpp / "desk").is_dir() or not found:
        raise FileNotFoundError("auvest has no headers here: install it anew")
    return [cpp, cpp / "include", found[0]]


def _installed() -> Path | None:
    """Beside this file, or beside the compiled module: an editable install has them apart."""
    core = sys.modules.get("auvest._core")
    beside = [] if core is None or core.__file__ is None else [Path(core.__file__).parent]
    for folder in (_PACKAGE, *beside):
        if (folder / "include" / "auvest" / "auvest.hpp").is_file():
            return folder / "include"
    return None
