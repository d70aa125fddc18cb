"""Assemble the Arduino library: an installable zip.

    python -m firmware.package [--output build/firmware]

The library is ``firmware/library``, completed with what lives elsewhere or is generated:

- ``src/auvest``: the headers of ``cpp/include``;
- ``src/Eigen``: the headers of Eigen that these include, as the compilers list them;
- ``src/*``: the C++ standard headers of ``firmware/avr_std``. Arduino puts ``src`` on the include
  path of every board, so each of them gives way to the toolchain's own where there is one;
- the version, from ``pyproject.toml``, and the licences.

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
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAME = "auvest"

_LIBRARY = ROOT / "firmware" / "library"
_AVR_STD = ROOT / "firmware" / "avr_std"
_HEADERS = ROOT / "cpp" / "include"
_EIGEN = Path("/usr/include/eigen3")
_EIGEN_LICENCE = Path("/usr/share/doc/libeigen3-dev/copyright")

# What includes what differs between a chip and a host; the library serves both kinds.
_COMPILERS = {
    "avr-g++": ("gcc-avr avr-libc", ["-mmcu=atmega2560", "-std=gnu++11", f"-I{_AVR_STD}"]),
    "g++": ("g++", ["-DARDUINO", "-std=gnu++17"]),
}


class PackageError(RuntimeError):
    """The library could not be assembled; the message says what to do."""


def version() -> str:
    """Return the project's version."""
    match = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    if match is None:
        raise PackageError("pyproject.toml: no line 'version = \"...\"'")
    return match[1]


def eigen_headers() -> list[Path]:
    """Return the headers of Eigen that auvest includes, relative to Eigen's include folder."""
    if not (_EIGEN / "Eigen" / "Core").is_file():
        raise PackageError(f"no Eigen in {_EIGEN}: install libeigen3-dev")
    found = set()
    for compiler, (packages, options) in _COMPILERS.items():
        if shutil.which(compiler) is None:
            raise PackageError(f"{compiler} is not installed: install {packages}")
        command = [compiler, "-M", *options, f"-I{_HEADERS}", f"-I{_EIGEN}"]
        umbrella = _HEADERS / NAME / f"{NAME}.hpp"
        done = subprocess.run([*command, str(umbrella)], capture_output=True, text=True)
        if done.returncode != 0:
            raise PackageError(f"{shlex.join([*command, str(umbrella)])} failed:\n{done.stderr}")
        for word in shlex.split(done.stdout.replace("\\\n", " ")):
            path = Path(word)
            if path.is_relative_to(_EIGEN):
                found.add(path.relative_to(_EIGEN))
    return sorted(found)


def contents() -> dict[str, bytes]:
    """Return the library's files: path inside the library to content."""
    origins: dict[str, Path] = {}

    def add(folder: Path, target: str = "") -> None:
        for path in folder.rglob("*"):
            if path.is_file():
                origins[target + path.relative_to(folder).as_posix()] = path

    add(_LIBRARY)
    add(_HEADERS, "src/")
    add(_AVR_STD, "src/")
    for header in eigen_headers():
        origins[f"src/{header.as_posix()}"] = _EIGEN / header
    origins["LICENSE"] = ROOT / "LICENSE"
    if not _EIGEN_LICENCE.is_file():
        raise PackageError(f"no {_EIGEN_LICENCE}, Eigen's licence: install libeigen3-dev")
    origins["LICENSE-Eigen.txt"] = _EIGEN_LICENCE

    files = {name: path.read_bytes() for name, path in origins.items()}
    for name in ("library.properties", "library.json"):
        files[name] = files[name].replace(b"{version}", version().encode())
    return dict(sorted(files.items()))


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
    archive_path = output / f"{NAME}-{version()}.zip"
    archive_path.write_bytes(buffer.getvalue())
    return archive_path


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="firmware.package", description=__doc__.split("\n")[0])
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
        print(f"firmware.package: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
