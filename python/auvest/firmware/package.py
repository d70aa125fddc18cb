"""Assemble the Arduino library: an installable zip. ``auvest library`` writes it.

The library is ``firmware/library``, completed with what lives elsewhere or is generated:

- ``src/auvest``: the headers;
- ``src/Eigen``: the headers of Eigen that these include, without those for vector instructions;
- ``src/*``: the C++ standard headers of ``firmware/avr_std``. Arduino puts ``src`` on the include
  path of every board, so each of them gives way to the toolchain's own where there is one;
- the names of types and of the values of ``Status``, which the IDE colours, from the headers;
- the version and the licences.

No compiler takes part, and the same sources give the same bytes, whenever and wherever the zip is
made: from the source tree or from an installed package.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import zipfile
from importlib.metadata import version
from pathlib import Path, PurePosixPath

from auvest._headers import firmware_folder, include_folders

NAME = "auvest"

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^<>"]+)[>"]', re.MULTILINE)
_FOREIGN = re.compile(r"/arch/(?!Default/)|_BLAS\.h$|_MKL\.h$|/misc/")
# A type of namespace auvest, which begins a line; what is for the library's own use.
_TYPE = re.compile(r"^(?:class|struct|enum class|using) (\w+)(?![\w<;])", re.MULTILINE)
_DETAIL = re.compile(r"namespace detail \{.*?\n\}  // namespace detail", re.DOTALL)


def _holding(name: str, folders: list[Path]) -> Path:
    """Give the folder that has the file."""
    return next(folder for folder in folders if (folder / name).is_file())


def eigen_headers(eigen: Path) -> list[PurePosixPath]:
    """Give the headers that Eigen/Core includes under some condition, relative to its folder.

    Those for vector instructions and for other libraries are left out: chips have none.
    """
    found: set[PurePosixPath] = set()
    left = [PurePosixPath("Eigen/Core")]
    while left:
        header = left.pop()
        found.add(header)
        for name in _INCLUDE.findall((eigen / header).read_text(encoding="utf-8")):
            for folder in (header.parent, PurePosixPath()):
                path = PurePosixPath(os.path.normpath(folder / name))
                if path.parts[0] != "Eigen" or not (eigen / path).is_file():
                    continue
                if _FOREIGN.search(str(path)):
                    break
                if path not in found:
                    left.append(path)
                break
    return sorted(found)


def contents() -> dict[str, bytes]:
    """Return the library's files: path inside the library to content."""
    origins: dict[str, Path] = {}

    def add(folder: Path, target: str = "") -> None:
        for path in folder.rglob("*"):
            if path.is_file():
                origins[target + path.relative_to(folder).as_posix()] = path

    sources = firmware_folder()
    add(sources / "library")
    headers = _holding("auvest/auvest.hpp", include_folders(sources_first=True))
    add(headers / "auvest", "src/auvest/")
    add(sources / "avr_std", "src/")
    eigen = _holding("Eigen/Core", include_folders(sources_first=True))
    for header in eigen_headers(eigen):
        origins[f"src/{header}"] = eigen / header
    tree = sources.parent
    origins["LICENSE"] = _holding("LICENSE", [sources, tree]) / "LICENSE"

    files = {name: path.read_bytes() for name, path in origins.items()}
    for name in ("library.properties", "library.json"):
        files[name] = files[name].replace(b"{version}", version(NAME).encode())
    files["keywords.txt"] += _keywords(headers / "auvest").encode()
    licences = _holding("README.Eigen", [eigen / "Eigen", tree / "cpp" / "licences"])
    parts = [(licences / name).read_bytes() for name in ("README.Eigen", "COPYING.MPL2")]
    files["LICENSE-Eigen.txt"] = b"\n".join(parts)
    return dict(sorted(files.items()))


def _keywords(headers: Path) -> str:
    """Name the types of namespace auvest and the values of its Status, as keywords.txt has them."""
    types = set()
    for path in headers.rglob("*.hpp"):
        types |= set(_TYPE.findall(_DETAIL.sub("", path.read_text(encoding="utf-8"))))
    status = (headers / "status.hpp").read_text(encoding="utf-8")
    values = re.findall(r"^  (k\w+)", status, re.MULTILINE)
    lines = ["", "# Types", *(f"{name}\tKEYWORD1" for name in sorted(types))]
    lines += ["", "# Values of Status", *(f"{name}\tLITERAL1" for name in values), ""]
    return "\n".join(lines)


def file_name() -> str:
    """Give the name of the zip: that of the library and its version."""
    return f"{NAME}-{version(NAME)}.zip"


def archive() -> bytes:
    """Return the zip.

    Raises
    ------
    FileNotFoundError
        If Eigen or the sources of the library are not here.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        for name, content in contents().items():
            entry = zipfile.ZipInfo(f"{NAME}/{name}")  # of 1 January 1980
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, wherever it is made
            entry.external_attr = 0o100644 << 16
            file.writestr(entry, content)
    return buffer.getvalue()


def package(output: Path) -> Path:
    """Write the zip and, beside it, the unpacked folder; return the zip's path.

    Parameters
    ----------
    output
        Folder for both; made if it does not exist.

    Raises
    ------
    FileNotFoundError
        If Eigen or the sources of the library are not here.
    """
    content = archive()
    folder = output / NAME
    if folder.exists():
        shutil.rmtree(folder)
    output.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        file.extractall(output)
    path = output / file_name()
    path.write_bytes(content)
    return path
