"""Where the C++ headers and the sources of the firmware are that the package brings."""

from __future__ import annotations

import sys
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
#: The first one comes with a source distribution.
_EIGEN = (
    _PACKAGE.parents[1] / "cpp" / "vendored",
    Path("/usr/include/eigen3"),
    Path("/usr/local/include/eigen3"),
)


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


def include_folders(*, sources_first: bool = False) -> list[Path]:
    """Give all folders that a compiler needs.

    Those that were installed with the module, or those of the source tree: of both there may be,
    and the tree may have been edited since.
    """
    cpp = _PACKAGE.parents[1] / "cpp"
    eigen = eigen_folder()
    sources = [cpp, cpp / "include", eigen] if (cpp / "desk").is_dir() and eigen else []
    installed = _installed()
    if sources and (sources_first or installed is None):
        return sources
    if installed is None:
        what = "headers here: install it anew" if eigen else "Eigen here: install libeigen3-dev"
        raise FileNotFoundError(f"auvest has no {what}")
    return [installed]


def eigen_folder() -> Path | None:
    """Give the folder in which Eigen's headers are on this computer."""
    return next((folder for folder in _EIGEN if (folder / "Eigen" / "Core").is_file()), None)


def firmware_folder() -> Path:
    """Give the folder with the sources of the Arduino library and of the simulated board.

    Raises
    ------
    FileNotFoundError
        If they did not come with the package.
    """
    for folder in (_PACKAGE.parents[1] / "firmware", _PACKAGE / "firmware"):
        if (folder / "board" / "board.hpp").is_file():
            return folder
    raise FileNotFoundError("auvest has no sources of the firmware here: install it anew")


def _installed() -> Path | None:
    """Beside this file, or beside the compiled module: an editable install has them apart."""
    core = sys.modules.get("auvest._core")
    beside = [] if core is None or core.__file__ is None else [Path(core.__file__).parent]
    for folder in (_PACKAGE, *beside):
        if (folder / "include" / "auvest" / "auvest.hpp").is_file():
            return folder / "include"
    return None
