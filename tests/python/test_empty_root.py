"""The packages in an empty Debian, where nothing is but Python: no compiler, no network."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.slow import SLOW

pytestmark = [
    SLOW,
    pytest.mark.skipif(
        shutil.which("debootstrap") is None or os.geteuid() != 0,
        reason="debootstrap (of Debian), as root",
    ),
]

COMMAND = ["auvest", "simulate", "aukf", "--runs", "20", "--json"]


@pytest.fixture
def empty_root(tmp_path, run):
    """Return a function that makes a Debian with packages: its folder, and a shell in it."""

    def empty_root(*packages):
        folder = tmp_path / "debian"
        suite = run("sh", "-c", ". /etc/os-release && echo $VERSION_CODENAME").strip()
        included = ",".join(("python3-venv", *packages))
        run("debootstrap", "--variant=minbase", f"--include={included}", suite, folder)

        def inside(script):
            empty = ["env", "-i", "HOME=/root", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]
            command = [
                "unshare",
                "--net",
                "chroot",
                folder,
                *empty,
                "bash",
                "-euc",
                f"cd\n{script}",
            ]
            return run(*command)

        found = inside("python3 -c 'import sys; print(sys.version_info[:2])'").strip()
        if found != str(sys.version_info[:2]):
            pytest.skip(f"{suite} has Python {found}: the wheel is for this one")
        return folder, inside

    return empty_root


def download(folder, *packages):
    """Bring wheels of packages, and of what they need, to where pip finds them without network."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--only-binary", ":all:"]
    subprocess.run([*command, "--dest", folder, *packages], check=True)


def install(package):
    return (
        "python3 -m venv venv\n"
        f"venv/bin/pip install --quiet --no-index --find-links packages packages/{package.name}\n"
    )


def same_numbers(there, run):
    """Say whether the scenario came out as here, to the bit."""
    here = run(sys.executable, "-m", *COMMAND)
    return json.loads(there) == json.loads(here)


def test_wheel_runs_without_a_compiler(wheel, empty_root, run):
    folder, inside = empty_root()
    download(folder / "root" / "packages", wheel)
    inside("! command -v cc gcc g++ clang cmake make")
    assert same_numbers(inside(install(wheel) + f"venv/bin/{' '.join(COMMAND)}"), run)


def test_sdist_builds_with_a_compiler_alone(sdist, root, empty_root, run):
    """Of Debian g++ and Python's headers, which Debian has in a package of their own."""
    folder, inside = empty_root("g++", "python3-dev")
    packages = folder / "root" / "packages"
    project = (root / "pyproject.toml").read_text()
    lists = re.findall(r"(?ms)^(?:requires|dependencies) = \[(.*?)\]$", project)
    listed = [name for part in lists for name in re.findall(r'"([^"]+)"', part)]
    download(packages, *listed, "cmake", "ninja")
    shutil.copy(sdist, packages)
    inside("test ! -e /usr/include/eigen3 -a ! -e /usr/include/xsimd")
    inside("! command -v cmake ninja make")
    assert same_numbers(inside(install(sdist) + f"venv/bin/{' '.join(COMMAND)}"), run)
