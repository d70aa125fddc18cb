"""Assemble the Arduino library: an installable zip.

    python -m auvest.firmware.package [--output build/firmware]

The library is ``firmware/library``, completed with what lives elsewhere or is generated:

- ``src/auvest``: the headers;
- ``src/Eigen``: the headers of Eigen that these include, as the compilers list them;
- ``src/*``: the C++ standard headers of ``firmware/avr_std``. Arduino puts ``src`` on the include
  path of every board, so each of them gives way to the toolchain's own where there is one;
- the names of types and of the values of ``Status``, which the IDE colours, from the headers;
- the version and the licences.

The same sources give the same bytes, whenever and wherever the zip is made.
"""

from __future__ import annotations

import argparse
import io
import re
import shlex
import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

from auvest._headers import firmware_folder, include_folders

NAME = "auvest"

# What includes what differs between a chip and a host; the library serves both kinds.
_COMPILERS = {
    "avr-g++": ("gcc-avr avr-libc", ["-mmcu=atmega2560", "-std=gnu++11"]),
    "g++": ("g++", ["-DARDUINO", "-std=gnu++17"]),
}
# A type of namespace auvest, which begins a line; what is for the library's own use.
_TYPE = re.compile(r"^(?:class|struct|enum class|using) (\w+)(?![\w<;])", re.MULTILINE)
_DETAIL = re.compile(r"namespace detail \{.*?\n\}  // namespace detail", re.DOTALL)


class PackageError(RuntimeError):
    """The library could not be assembled; the message says what to do."""


def _holding(name: str, folders: list[Path]) -> Path:
    """Give the folder that has the file."""
    return next(folder for folder in folders if (folder / name).is_file())


def eigen_headers() -> tuple[Path, list[Path]]:
    """Return Eigen's include folder and, relative to it, the headers that auvest includes."""
    folders = include_folders(sources_first=True)
    eigen = _holding("Eigen/Core", folders)
    umbrella = _holding("auvest/auvest.hpp", folders) / "auvest" / "auvest.hpp"
    found = set()
    for compiler, (packages, options) in _COMPILERS.items():
        if shutil.which(compiler) is None:
            raise PackageError(f"{compiler} is not installed: install {packages}")
        command = [compiler, "-M", *options, *(f"-I{folder}" for folder in folders)]
        if compiler == "avr-g++":
            command.append(f"-I{firmware_folder() / 'avr_std'}")
        done = subprocess.run([*command, str(umbrella)], capture_output=True, text=True)
        if done.returncode != 0:
            raise PackageError(f"{shlex.join([*command, str(umbrella)])} failed:\n{done.stderr}")
        for word in shlex.split(done.stdout.replace("\\\n", " ")):
            path = Path(word)
            if path.is_relative_to(eigen / "Eigen"):
                found.add(path.relative_to(eigen))
    return eigen, sorted(found)


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
    eigen, used = eigen_headers()
    for header in used:
        origins[f"src/{header.as_posix()}"] = eigen / header
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


def package(output: Path) -> Path:
    """Write ``auvest-<version>.zip`` and, beside it, the unpacked folder; return the zip's path.

    Parameters
    ----------
    output
        Folder for both; made if it does not exist.

    Raises
    ------
    PackageError
        If a compiler or Eigen is missing.
    """
    files = contents()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(f"{NAME}/{name}")  # of 1 January 1980
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content)

    folder = output / NAME
    if folder.exists():
        shutil.rmtree(folder)
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    archive_path = output / f"{NAME}-{version(NAME)}.zip"
    archive_path.write_bytes(buffer.getvalue())
    return archive_path


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        prog="auvest.firmware.package", description=__doc__.split("\n")[0]
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("build/firmware"),
        metavar="DIR",
        help="where the zip and the unpacked folder go (default: %(default)s)",
    )
    arguments = parser.parse_args()
    try:
        print(package(arguments.output))
    except PackageError as error:
        print(f"auvest.firmware.package: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
