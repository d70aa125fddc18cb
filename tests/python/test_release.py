"""What `make release` adds to the packages: the wheel's tag, bill of materials, checksums."""

import json
import re
import shutil
import subprocess
import sys
import zipfile

import pytest
from packaging.requirements import Requirement

Bom = pytest.importorskip("cyclonedx.model.bom", reason="auvest[release]").Bom


@pytest.fixture(scope="module")
def release(root, wheel, sdist, tmp_path_factory):
    """Return a folder with a release."""
    folder = tmp_path_factory.mktemp("release")
    for path in (wheel, sdist):
        shutil.copy(path, folder)
    site = tmp_path_factory.mktemp("site")
    (site / "index.html").write_text("<p>where to begin")
    command = [sys.executable, root / "python" / "release.py", folder, site]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_wheel_says_the_oldest_glibc_that_has_what_it_calls(release, tmp_path, run):
    (wheel,) = release.glob("*.whl")
    tag = re.fullmatch(r"auvest-[\d.]+-cp\d+-cp\d+-manylinux_2_(\d+)_x86_64\.whl", wheel.name)
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if re.search(r"/_core\..*\.so$", name))
        module = archive.extract(name, tmp_path)
    called = run("objdump", "--dynamic-syms", module)
    assert int(tag[1]) >= max(int(minor) for minor in re.findall(r"\(?GLIBC_2\.(\d+)", called))
    # libstdc++ and libgcc_s, of every system for which wheels are; nothing else but the C library.
    needed = set(re.findall(r"NEEDED +(\S+)", run("objdump", "--private-headers", module)))
    system = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "libstdc++.so.6", "libgcc_s.so.1"}
    assert needed <= system


def test_checksums_are_of_all_files(release, run):
    listed = {line.split()[1] for line in (release / "SHA256SUMS").read_text().splitlines()}
    assert listed == {path.name for path in release.iterdir()} - {"SHA256SUMS"}
    assert len(listed) == 4
    run("sha256sum", "--check", "--strict", "SHA256SUMS", cwd=release)
    (wheel,) = release.glob("*.whl")
    content = wheel.read_bytes()
    try:
        wheel.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        with pytest.raises(pytest.fail.Exception, match="FAILED"):
            run("sha256sum", "--check", "SHA256SUMS", cwd=release)
    finally:
        wheel.write_bytes(content)


def test_documentation_is_one_file(release):
    (path,) = release.glob("auvest-*-docs.zip")
    with zipfile.ZipFile(path) as archive:
        assert archive.read("index.html") == b"<p>where to begin"


def test_bill_of_materials_names_what_is_within_and_what_is_asked_for(release, root, run):
    (path,) = release.glob("*.cdx.json")
    text = json.loads(path.read_text())
    bom = Bom.from_json(text)
    assert (text["bomFormat"], text["specVersion"]) == ("CycloneDX", "1.6")
    parts = {part.name: part for part in bom.components}
    # As Debian's packages say it, "3.4.0-4".
    for name, package in (("eigen", "libeigen3-dev"), ("xsimd", "libxsimd-dev")):
        shown = run("dpkg-query", "--show", "--showformat=${Version}", package)
        assert parts[name].version == shown.rpartition("-")[0]
    pybind11 = run(sys.executable, "-m", "pybind11", "--version").strip()
    assert parts["pybind11"].version == pybind11
    project = (root / "pyproject.toml").read_text()
    declared = re.search(r"(?ms)^dependencies = \[(.*?)^\]", project)[1]
    asked = {Requirement(line) for line in re.findall(r'"([^"]+)",', declared)}
    assert {need.name for need in asked} == parts.keys() - {"eigen", "xsimd", "pybind11"}
    assert bom.metadata.component.name == "auvest"
    (root_of_graph,) = (node for node in text["dependencies"] if node["ref"] == "auvest")
    assert set(root_of_graph["dependsOn"]) == parts.keys()


def test_licence_of_the_package_covers_all_that_is_within(release):
    (path,) = release.glob("*.cdx.json")
    text = json.loads(path.read_text())

    def named(part):
        return {x for entry in part.get("licenses", []) for x in entry["expression"].split(" AND ")}

    within = set().union(*map(named, text["components"]))
    assert named(text["metadata"]["component"]) == {"MIT"} | within


def test_citation_names_version_and_papers(root):
    yaml = pytest.importorskip("ruamel.yaml").YAML(typ="safe")
    citation = yaml.load(root / "docs" / "CITATION.cff")
    project = (root / "pyproject.toml").read_text()
    assert f'version = "{citation["version"]}"' in project
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    papers = citation["references"]
    assert [len(paper["authors"]) for paper in papers] == [3, 5, 6]
    assert all(re.fullmatch(r"10\.\d{4,5}/\S+", paper["doi"]) for paper in papers)
    assert papers[0]["doi"] in (root / "docs" / "algorithms" / "aukf.md").read_text()
