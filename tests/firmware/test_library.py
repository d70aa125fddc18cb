"""The Arduino library: what Arduino's specification and its linter's strict mode ask of it.

https://arduino.github.io/arduino-cli/latest/library-specification
https://arduino.github.io/arduino-lint/latest/rules/library

And what PlatformIO's schema asks of library.json, as its package manager checks it.
https://docs.platformio.org/en/latest/manifests/library-json
"""

import json
import re
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

import auvest
from auvest import _headers
from auvest.cli import app
from auvest.firmware import package

CATEGORIES = {
    "Communication", "Data Processing", "Data Storage", "Device Control", "Display", "Other",
    "Sensors", "Signal Input/Output", "Timing",
}  # fmt: skip
KEYWORD_KINDS = {"KEYWORD1", "KEYWORD2", "KEYWORD3", "LITERAL1", "LITERAL2"}
MAX_NAME = 63  # characters of a file or folder
SEMVER = r"(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)(-[0-9A-Za-z.-]+)?(\+[0-9A-Za-z.-]+)?"


@pytest.fixture(scope="module")
def folder(library) -> Path:
    """Return the unpacked library."""
    return library.parent / "auvest"


@pytest.fixture(scope="module")
def properties(folder) -> dict[str, str]:
    """Return the fields of library.properties."""
    lines = (folder / "library.properties").read_text().splitlines()
    fields = [line.split("=", 1) for line in lines]
    assert all(len(field) == 2 for field in fields), "each line is name=value"
    assert len({name for name, _ in fields}) == len(fields), "no field twice"
    return dict(fields)


@pytest.fixture(scope="module")
def files(library) -> list[zipfile.ZipInfo]:
    """Return the entries of the zip."""
    with zipfile.ZipFile(library) as archive:
        assert archive.testzip() is None
        return archive.infolist()


# ---- The zip -------------------------------------------------------------------------------------


def test_same_sources_same_bytes(library, tmp_path):
    again = package.package(tmp_path)
    assert again.name == library.name == f"auvest-{auvest.__version__}.zip"
    assert again.read_bytes() == library.read_bytes()


def test_entries_are_plain_sorted_files_in_one_folder(files):
    names = [entry.filename for entry in files]
    assert names == sorted(names)
    assert {name.split("/")[0] for name in names} == {"auvest"}
    for entry in files:
        assert entry.date_time == (1980, 1, 1, 0, 0, 0)
        assert entry.external_attr >> 16 == 0o100644, "a regular file, no link, not executable"


def test_the_unpacked_folder_is_the_zip(library, folder):
    with zipfile.ZipFile(library) as archive:
        zipped = {name: archive.read(name) for name in archive.namelist()}
    unpacked = {
        path.relative_to(folder.parent).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }
    assert unpacked == zipped


def test_packaging_again_leaves_nothing_old_behind(tmp_path):
    stale = package.package(tmp_path).parent / "auvest" / "src" / "stale.hpp"
    stale.touch()
    package.package(tmp_path)
    assert not stale.exists()


def test_names_of_files(files):
    names = [entry.filename for entry in files]
    assert len({name.lower() for name in names}) == len(names), "some file systems ignore case"
    for name in names:
        for part in name.split("/"):
            assert len(part) <= MAX_NAME
            assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", part), name
        assert Path(name).suffix not in {".exe", ".o", ".a", ".so", ".pyc", ".orig"}
        assert Path(name).name != ".development"


def test_size(library):
    assert library.stat().st_size < 1_000_000


# ---- library.properties and library.json ---------------------------------------------------------


def test_required_fields(properties):
    required = [
        "name",
        "version",
        "author",
        "maintainer",
        "sentence",
        "paragraph",
        "category",
        "url",
        "architectures",
    ]
    for field in required:
        assert properties.get(field, "").strip(), field
    assert set(properties) <= {*required, "includes", "depends"}, "misspelt, or of no use here"
    assert all(value == value.strip() for value in properties.values())


def test_name(properties):
    name = properties["name"]
    assert name == "auvest"
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9 _.-]*", name)
    assert not re.search("arduino", name, re.IGNORECASE)
    assert len(name) <= 16


def test_version_is_the_projects(properties, root):
    assert re.fullmatch(SEMVER, properties["version"])
    assert f'\nversion = "{properties["version"]}"\n' in (root / "pyproject.toml").read_text()


def test_people(properties):
    for field in ("author", "maintainer"):
        assert not re.search("arduino", properties[field], re.IGNORECASE)


def test_texts(properties):
    sentence, paragraph = properties["sentence"], properties["paragraph"]
    assert sentence.endswith(".")
    assert sentence[0].isupper()
    assert sentence not in paragraph, "the paragraph is shown behind the sentence"
    assert not re.search(r"\blibrary for arduino\b", sentence, re.IGNORECASE)


def test_category(properties):
    assert properties["category"] in CATEGORIES - {"Other"}


def test_url(properties):
    assert re.fullmatch(r"https://[a-z0-9.-]+\.[a-z]+/\S*", properties["url"])


def test_architectures(properties):
    assert properties["architectures"] == "*"


def test_includes_is_the_header_named_like_the_library(properties, folder):
    assert properties["includes"] == f"{properties['name']}.h"
    assert (folder / "src" / properties["includes"]).is_file()


def test_library_json_agrees(properties, folder):
    manifest = json.loads((folder / "library.json").read_text())
    assert manifest["name"] == properties["name"]
    assert manifest["version"] == properties["version"]
    assert manifest["description"] == properties["sentence"]
    assert manifest["headers"] == properties["includes"]
    assert manifest["homepage"] == properties["url"]
    assert [author["name"] for author in manifest["authors"]] == [properties["author"]]
    assert manifest["platforms"] == manifest["frameworks"] == properties["architectures"]
    assert manifest["license"].split(" AND ")[0] == "MIT"


#: PlatformIO's rules for the fields that it knows: characters, and the pattern of a text or of each
#: text of a list.
MANIFEST = {
    "name": (1, 100, r"[^:;/,@<>]+"),
    "version": (1, 50, SEMVER),
    "description": (1, 1000, r".+"),
    "keywords": (1, 50, r"[a-z\d\-_+. ]+"),
    "homepage": (1, 255, r"https?://[^\s/]+\.[a-z]+(/\S*)?"),
    "license": (1, 255, r"\S+( (AND|OR|WITH) \S+)*"),
    "frameworks": (1, 50, r"[a-z\d\-_]+|\*"),
    "platforms": (1, 50, r"[a-z\d\-_]+|\*"),
    "headers": (1, 255, r"[\w./-]+\.h(pp)?"),
}
AUTHOR = {
    "name": (1, 50, r".+"),
    "email": (1, 50, r"[^@\s]+@[^@\s]+"),
    "url": (1, 255, r"https?://\S+"),
}
#: Of the SPDX list, those that the library has.
SPDX = {"MIT", "MPL-2.0", "BSD-3-Clause", "Apache-2.0"}


def faults(manifest):
    """Name the fields that break a rule; those that PlatformIO does not know are misspelt."""

    def wrong(rule, value):
        least, most, pattern = rule
        texts = value if isinstance(value, list) else [value]
        return not texts or any(
            not isinstance(text, str)
            or not least <= len(text) <= most
            or not re.fullmatch(pattern, text)
            for text in texts
        )

    found = [name for name in ("name", "version") if name not in manifest]
    for name, value in manifest.items():
        if name == "authors":
            for author in value:
                known = {**AUTHOR, "maintainer": None}
                found += [f"authors.{key}" for key in author if key not in known]
                found += [
                    f"authors.{key}"
                    for key, rule in AUTHOR.items()
                    if (key in author or key == "name") and wrong(rule, author.get(key))
                ]
                if not isinstance(author.get("maintainer", False), bool):
                    found.append("authors.maintainer")
        elif name not in MANIFEST or wrong(MANIFEST[name], value):
            found.append(name)
    if not set(re.split(r" (?:AND|OR|WITH) ", manifest.get("license", "MIT"))) <= SPDX:
        found.append("license")
    return found


def test_library_json_keeps_the_schema(folder):
    assert faults(json.loads((folder / "library.json").read_text())) == []


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        ({"name": "auvest/filters"}, "name"),
        ({"version": "0.1"}, "version"),
        ({"keywords": ["Kalman filter"]}, "keywords"),
        ({"keywords": []}, "keywords"),
        ({"homepage": "auvest.org"}, "homepage"),
        ({"license": "MIT, MPL-2.0"}, "license"),
        ({"license": "MIT AND MPL2"}, "license"),
        ({"platforms": "Atmel AVR"}, "platforms"),
        ({"framework": "arduino"}, "framework"),
        ({"authors": [{"maintainer": True}]}, "authors.name"),
        ({"authors": [{"name": "x" * 51}]}, "authors.name"),
    ],
)
def test_a_manifest_that_breaks_a_rule_is_noticed(folder, edit, named):
    manifest = json.loads((folder / "library.json").read_text())
    assert named in faults({**manifest, **edit})


# ---- Structure -----------------------------------------------------------------------------------


def test_top_of_the_library(folder):
    assert {path.name for path in folder.iterdir()} == {
        "LICENSE", "LICENSE-Eigen.txt", "README.md", "examples", "keywords.txt", "library.json",
        "library.properties", "src",
    }  # fmt: skip


def test_licences(folder, root):
    assert (folder / "LICENSE").read_bytes() == (root / "LICENSE").read_bytes()
    text = (folder / "LICENSE-Eigen.txt").read_text()
    assert "Mozilla Public License Version 2.0" in text
    assert "Exhibit A - Source Code Form License Notice" in text
    assert "some are under the BSD licence" in text
    head = (folder / "src/Eigen/src/Core/util/MKL_support.h").read_text()
    assert "Redistribution and use in source and binary forms" in head


def test_source_folder_has_our_headers_and_those_for_avr(folder, root):
    source = folder / "src"
    ours = {p.relative_to(source / "auvest") for p in (source / "auvest").rglob("*.hpp")}
    assert ours == {
        p.relative_to(root / "cpp/include/auvest") for p in (root / "cpp/include").rglob("*.hpp")
    }
    standard = {path.name for path in (root / "firmware" / "avr_std").iterdir()}
    assert standard <= {path.name for path in source.iterdir()}
    assert not list(source.rglob("*.c*")), "header-only"


def test_examples(folder):
    sketches = list((folder / "examples").iterdir())
    assert {sketch.name for sketch in sketches} >= {"first_steps"}
    for sketch in sketches:
        assert (sketch / f"{sketch.name}.ino").is_file()
        assert [path.name for path in sketch.glob("*.ino")] == [f"{sketch.name}.ino"]
    assert len(list(folder.rglob("*.ino"))) == len(sketches), "no sketch elsewhere"


def test_every_example_compiles(folder, example, root):
    """From the source tree, where they are the same to the byte and other tests run them."""
    for sketch in (folder / "examples").iterdir():
        source = root / "firmware/library/examples" / sketch.name
        files = sorted(path.relative_to(sketch) for path in sketch.rglob("*"))
        assert files == sorted(path.relative_to(source) for path in source.rglob("*"))
        assert all((sketch / name).read_bytes() == (source / name).read_bytes() for name in files)
        warned = re.findall(rf"{sketch.name}/\S+: warning: .*", example(sketch.name).report)
        assert not warned


# ---- keywords.txt --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def keywords(folder) -> dict[str, str]:
    """Return the keywords: name to kind."""
    lines = (folder / "keywords.txt").read_text().splitlines()
    entries = [line for line in lines if line and not line.startswith("#")]
    for line in entries:
        assert re.fullmatch(r"\w+\t\w+", line), f"{line!r}: name, one tab, kind"
    pairs = [line.split("\t") for line in entries]
    assert len({name for name, _ in pairs}) == len(pairs), "no name twice"
    assert {kind for _, kind in pairs} <= KEYWORD_KINDS
    return dict(pairs)


def test_keywords_are_the_types_that_a_sketch_names(keywords, folder):
    types = {name for name, kind in keywords.items() if kind == "KEYWORD1"}
    sketches = [*(folder / "examples").rglob("*.ino"), *(folder / "examples").rglob("*.h")]
    code = "".join(path.read_text() for path in sketches)
    named = set(re.findall(r"\bauvest::([A-Z]\w+)", code))
    assert {"Aukf", "Vector", "SlatfShared"} <= named <= types
    # One of each form: class, struct, enum class, using; and none of what is in a detail namespace.
    assert {"Ckf", "Hampel", "Decision", "RobustEkf", "Status"} <= types
    assert "DoubleTrigonometry" not in types
    text = "".join(path.read_text() for path in (folder / "src" / "auvest").rglob("*.hpp"))
    for name in types:
        assert re.search(rf"\b{name}\b[^;]*[{{=]", text), name


def test_keywords_are_the_values_of_status(keywords, folder):
    text = (folder / "src/auvest/status.hpp").read_text()
    values = re.search(r"enum class Status.*?\{(.*?)\}", text, re.DOTALL)[1]
    literals = {name for name, kind in keywords.items() if kind == "LITERAL1"}
    assert literals == set(re.findall(r"^  (k\w+)", values, re.MULTILINE))


def test_keywords_are_functions_that_exist(keywords, folder):
    text = "".join(path.read_text() for path in (folder / "src/auvest").rglob("*.hpp"))
    for name in (name for name, kind in keywords.items() if kind == "KEYWORD2"):
        assert re.search(rf"\b{name}\(|\b{name};", text), name


# ---- It compiles where there is nothing else -----------------------------------------------------


ARDUINO = "-DARDUINO=10819"
MEGA2560 = "-mmcu=atmega2560"


@pytest.mark.parametrize(
    ("compiler", "options"),
    [
        ("avr-g++", [MEGA2560, "-std=gnu++11", ARDUINO]),
        ("avr-g++", [MEGA2560, "-std=gnu++11"]),
        ("avr-g++", [MEGA2560, "-std=gnu++14"]),
        ("arm-none-eabi-g++", ["-mcpu=cortex-m0plus", "-mthumb", "-std=gnu++11", ARDUINO]),
        ("arm-none-eabi-g++", ["-mcpu=cortex-m7", "-mfloat-abi=hard", "-std=gnu++17"]),
        ("g++", ["-std=c++11", ARDUINO]),
        ("g++", ["-std=c++20", ARDUINO]),
        ("clang++", ["-std=c++11", ARDUINO]),
    ],
)
def test_the_source_folder_is_all_it_needs(compile_cpp, folder, compiler, options):
    strict = ["-Wall", "-Wextra", "-Werror"]
    compile_cpp(compiler, "#include <auvest.h>\n", "-c", *options, *strict, f"-I{folder / 'src'}")


def test_eigen_is_what_is_included_and_no_more(compile_cpp, folder, tmp_path):
    source = folder / "src"
    found = set()
    for compiler, options in (
        ("avr-g++", [MEGA2560, "-std=gnu++11"]),
        ("g++", [ARDUINO, "-std=gnu++17"]),
    ):
        compile_cpp(compiler, "#include <auvest.h>\n", "-M", *options, f"-I{source}")
        found |= set((tmp_path / "object").read_text().replace("\\\n", " ").split())
    brought = {str(path) for path in (source / "Eigen").rglob("*") if path.is_file()}
    asked = {name for name in found if name.startswith(str(source / "Eigen"))}
    assert asked <= brought
    assert len(brought) < 1.1 * len(asked)  # some stand behind conditions that never hold
    vector_code = {path.name for path in (source / "Eigen/src/Core/arch").iterdir()} - {"Default"}
    assert not vector_code


# ---- What goes wrong -----------------------------------------------------------------------------


def test_missing_eigen_names_the_package(monkeypatch, tmp_path):
    monkeypatch.setattr(_headers, "_EIGEN", (tmp_path,))
    monkeypatch.setattr(_headers, "_installed", lambda: None)
    with pytest.raises(FileNotFoundError, match="install libeigen3-dev"):
        package.package(tmp_path)


def test_command(tmp_path, library):
    """Under the name that is given, or into the folder; nothing else is left."""
    for given, written in (("my.zip", "my.zip"), ("", library.name)):
        folder = tmp_path / written
        folder.mkdir()
        called = CliRunner().invoke(app, ["library", "--output", str(folder / given), "--json"])
        assert called.exit_code == 0, called.output
        assert json.loads(called.stdout)["file"] == str(folder / written)
        assert (folder / written).read_bytes() == library.read_bytes()
        assert [path.name for path in folder.iterdir()] == [written]
    called = CliRunner().invoke(app, ["library", "--output", str(tmp_path / "none" / "my.zip")])
    assert called.exit_code == 1
    assert "none" in called.stderr


def test_no_compiler_takes_part(monkeypatch, tmp_path, library):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert package.archive() == library.read_bytes()
