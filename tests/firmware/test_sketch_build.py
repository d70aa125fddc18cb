"""Sketches, compiled as the Arduino IDE does it."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from auvest.firmware import sketch

EMPTY = "void setup() {}\nvoid loop() {}\n"

# One step of the AUKF on volatile numbers, so that the compiler cannot compute it beforehand.
AUKF = """
#include <auvest.h>

using Process = auvest::EulerAcceleration<float>;
auvest::Aukf<Process> aukf{auvest::Ukf<Process>(Process())};
const auvest::RangeBearing<float, 6> sonar;
volatile float numbers[4] = {3.6f, 0.65f, 3.0f, 4.0f};
volatile float next;

void setup() {
  auvest::Vector<float, 6> x;
  x << float(numbers[2]), float(numbers[3]), 0.1f, 0.2f, 0, 0;
  aukf.reset(x, 0.01f * auvest::Matrix<float, 6, 6>::Identity());
}

void loop() {
  aukf.predict(aukf.interval());
  aukf.update(auvest::Vector<float, 2>(float(numbers[0]), float(numbers[1])), sonar);
  aukf.feedback(auvest::Vector<float, 2>(float(numbers[2]), float(numbers[3])));
  next = aukf.interval();
}
"""

# What Arduino's macros mean must not depend on auvest being there.
MACROS = """
static_assert(abs(-1.5f) == 1.5f && min(1, 2.5f) == 1 && max(1, 2.5f) == 2.5f, "");
static_assert(round(2.5f) == 3 && round(-2.5f) == -3, "");
static_assert(sizeof(round(2.5f)) == sizeof(long), "round is Arduino's, which gives a long");
static_assert(sq(3) == 9 && bit(3) == 8 && B1 == 1 && B0 == 0 && B101 == 5, "");
static_assert(lowByte(0x1234) == 0x34 && highByte(0x1234) == 0x12 && constrain(5, 1, 3) == 3, "");
static_assert(PI > 3.14 && radians(180) > 3.14 && degrees(PI) > 179, "");
static_assert(sizeof(uint16_t) == 2 && sizeof(word) > 0, "");
void setup() { Serial.println(F("text in flash")); Serial.println(word(1, 2)); }
void loop() {}
"""
WORD = "uint16_t word_of(uint8_t high, uint8_t low) { return word(high, low); }\n"


def symbols(elf: Path) -> set[str]:
    """Return the names, mangled, of what is in a program."""
    if shutil.which("avr-nm") is None:
        pytest.fail("avr-nm is not installed: install binutils-avr")
    done = subprocess.run(["avr-nm", elf], capture_output=True, text=True, check=True)
    return {line.split()[-1] for line in done.stdout.splitlines()}


def heap(elf: Path) -> set[str]:
    """Return those of the functions that manage a heap."""
    names = {"malloc", "free", "calloc", "realloc", "__brkval", "__flp"}
    # operator new and delete, except those that construct in place (last argument: void*)
    operators = re.compile(r"_Z(nw|na)j(?!Pv)\w*|_Z(dl|da)Pv(?!S_)\w*")
    return {name for name in symbols(elf) if name in names or operators.fullmatch(name)}


@pytest.fixture(scope="module")
def empty(build_sketch):
    """Return the empty sketch."""
    return build_sketch(EMPTY)


@pytest.fixture(scope="module")
def aukf(build_sketch):
    """Return the sketch with one step of the AUKF."""
    return build_sketch(AUKF, warnings="all")


# ---- Sizes ---------------------------------------------------------------------------------------


def test_empty_sketch(empty):
    assert empty.elf.is_file()
    assert empty.hex.read_text().startswith(":")
    assert 500 < empty.flash < 1000
    assert empty.ram < 20
    assert (empty.flash_size, empty.ram_size) == (253952, 8192)


def test_sizes_are_those_of_the_elf(aukf):
    done = subprocess.run(["avr-size", "-A", aukf.elf], capture_output=True, text=True, check=True)
    size = {name: int(number) for name, number in re.findall(r"^(\.\w+) +(\d+)", done.stdout, re.M)}
    assert aukf.flash == size[".text"] + size[".data"]
    assert aukf.ram == size[".data"] + size[".bss"]


def test_aukf_sketch(aukf, empty):
    assert 5_000 < aukf.flash - empty.flash < 20_000
    # The filter, its model and policy, the sensor, and the constants that they start from.
    assert aukf.ram - empty.ram < 450
    assert "warning" not in aukf.report.replace("warning: unused parameter ‘tag’", "")


# ---- No heap -------------------------------------------------------------------------------------


def test_aukf_sketch_has_no_heap(aukf):
    assert not heap(aukf.elf)


def test_a_heap_would_be_found(build_sketch):
    source = "int* volatile p;\nvoid setup() { p = new int[7]; }\nvoid loop() { delete[] p; }\n"
    found = heap(build_sketch(source).elf)
    assert {"malloc", "free"} <= found


# ---- Beside <Arduino.h> --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "headers",
    [
        ["Arduino.h", "auvest.h"],
        ["auvest.h", "Arduino.h"],
        ["Arduino.h", "cmath", "algorithm", "auvest.h"],
        ["auvest.h", "Arduino.h", "auvest/math/random.hpp", "cstdlib", "limits"],
    ],
)
def test_either_order_of_includes(library, compile_cpp, headers):
    """The IDE puts <Arduino.h> first in a sketch; a sketch's .cpp and .h files choose."""
    core = sketch.find_hardware() / "arduino" / "avr"
    source = "".join(f"#include <{header}>\n" for header in headers) + WORD + MACROS
    compile_cpp(
        "avr-g++", source, "-c", "-mmcu=atmega2560", "-std=gnu++11", "-Os", "-Wall", "-Wextra",
        "-Werror", "-DARDUINO=10819", "-DF_CPU=16000000L",
        f"-I{core / 'cores' / 'arduino'}", f"-I{core / 'variants' / 'mega'}",
        f"-I{library.parent / 'auvest' / 'src'}",
    )  # fmt: skip


def test_both_orders_give_the_same_program(build_sketch, tmp_path):
    def program(name, *headers):
        """Build a sketch whose second file includes the headers in this order."""
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"{name}.ino").write_text("")
        includes = "".join(f"#include <{header}>\n" for header in headers)
        (folder / "aukf.cpp").write_text(includes + AUKF)
        return build_sketch(folder).hex.read_text()

    assert program("first", "Arduino.h", "auvest.h") == program("last", "auvest.h", "Arduino.h")


def test_every_macro_that_meets_eigen_is_put_aside(root, library, compile_cpp, tmp_path):
    """A macro of <Arduino.h> that Eigen uses as a name must be in the list of eigen.hpp."""
    core = sketch.find_hardware() / "arduino" / "avr"
    paths = [f"-I{core / 'cores' / 'arduino'}", f"-I{core / 'variants' / 'mega'}"]

    def macros(*headers):
        source = "".join(f"#include <{header}>\n" for header in headers)
        avr = ["-mmcu=atmega2560", "-std=gnu++11", "-DF_CPU=16000000L", *paths]
        compile_cpp("avr-g++", source, "-dM", "-E", *avr)
        return set(re.findall(r"^#define (\w+)", (tmp_path / "object").read_text(), re.M))

    c_headers = [
        "assert",
        "errno",
        "float",
        "limits",
        "math",
        "stddef",
        "stdint",
        "stdlib",
        "string",
    ]
    arduino = macros("Arduino.h") - macros(*(f"{name}.h" for name in c_headers))
    assert {"F", "min", "sq", "B101", "PI"} <= arduino

    code = ""
    for path in (library.parent / "auvest" / "src" / "Eigen").rglob("*"):
        if path.is_file():
            code += re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(), flags=re.DOTALL)
    met = arduino & set(re.findall(r"\w+", code))
    header = (root / "cpp" / "include" / "auvest" / "eigen.hpp").read_text()
    put_aside, removed, restored = (
        re.findall(pattern, header, re.M)
        for pattern in (
            r'^#pragma push_macro\("(\w+)"\)$',
            r"^#undef (?!uint16_t)(\w+)$",
            r'^#pragma pop_macro\("(\w+)"\)$',
        )
    )
    assert put_aside == removed == restored
    assert set(put_aside) == met | {"abs"}  # <stdlib.h> has abs too


# Eigen's arithmetic and Arduino's macros, side by side; then the chip sleeps for good.
MIXED = """
#include <auvest.h>
#include <avr/sleep.h>
volatile float number = -2.5f;
void setup() {
  Serial.begin(115200);
  auvest::Matrix<float, 2, 2> a;
  a << float(number), 2, 3, -4;
  Serial.println(a.cwiseAbs().sum(), 3);
  Serial.println((a * a.transpose()).eval()(1, 0), 3);
  Serial.println(a.col(1).norm(), 3);
  Serial.println(a.maxCoeff(), 3);
  Serial.println(a.cwiseMin(1.0f).sum(), 3);
  Serial.println(abs(float(number)), 3);
  Serial.println(round(float(number)));
  Serial.flush();
  cli();
  sleep_mode();
}
void loop() {}
"""


def test_a_sketch_runs(build_sketch):
    if shutil.which("simavr") is None:
        pytest.fail("simavr is not installed: install simavr")
    command = ["simavr", "-m", "atmega2560", "-f", "16000000", build_sketch(MIXED).elf]
    # It ends by itself; the timeout is for a sketch that hangs, not for a slow machine.
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    lines = re.findall(r"\x1b\[32m(.*)\.\.\n", done.stderr)  # it prints CR and LF as dots
    eigen = ["11.500", "-15.500", "4.472", "3.000", "-4.500"]
    assert lines == [*eigen, "2.500", "-3"], done.stderr


# ---- The builder ---------------------------------------------------------------------------------


def test_functions_may_be_used_before_their_definition(build_sketch):
    build_sketch("void setup() { later(); }\nvoid loop() {}\nvoid later() {}\n")


def test_define_reaches_the_sketch(build_sketch):
    source = 'static_assert(ANSWER == 42, "");\n' + EMPTY
    build_sketch(source, define={"ANSWER": "42"})
    with pytest.raises(sketch.SketchError, match="ANSWER"):
        build_sketch(source)


def test_define_reaches_the_core(library, tmp_path):
    """Even where the same core has been compiled and kept before."""
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "s.ino").write_text("void setup() { Serial.begin(9600); }\nvoid loop() {}\n")
    plain, larger = (
        sketch.compile_sketch(tmp_path / "s", library, tmp_path / "out", define=define)
        for define in ({}, {"SERIAL_RX_BUFFER_SIZE": "256"})  # 64 otherwise
    )
    assert larger.ram - plain.ram == 256 - 64


def test_a_sketch_that_does_not_compile_says_where(build_sketch):
    with pytest.raises(sketch.SketchError, match=r"\.ino:1:\d+: error: .*nonsense"):
        build_sketch("void setup() { nonsense(); }\nvoid loop() {}\n")


def test_a_new_library_replaces_the_old(library, tmp_path):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "s.ino").write_text("#include <auvest.h>\n" + EMPTY)
    sketch.compile_sketch(tmp_path / "s", library, tmp_path / "out")
    broken = tmp_path / "broken.zip"
    with zipfile.ZipFile(broken, "w") as archive:
        archive.write(library.parent / "auvest" / "library.properties", "auvest/library.properties")
        archive.writestr("auvest/src/auvest.h", "#error broken\n")
    with pytest.raises(sketch.SketchError, match="broken"):
        sketch.compile_sketch(tmp_path / "s", broken, tmp_path / "out")


@pytest.mark.parametrize(
    ("hide", "message"),
    [("arduino-builder", "install arduino-builder"), ("core", "install arduino-core-avr")],
)
def test_what_is_missing_is_named(monkeypatch, library, tmp_path, hide, message):
    if hide == "core":
        monkeypatch.setenv("XDG_DATA_DIRS", str(tmp_path))
    else:
        monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "s.ino").write_text(EMPTY)
    with pytest.raises(sketch.SketchError, match=message):
        sketch.compile_sketch(tmp_path / "s", library, tmp_path / "out")


def test_bad_arguments_are_named(library, tmp_path):
    with pytest.raises(sketch.SketchError, match=r"a folder with a file nothing\.ino"):
        sketch.compile_sketch(tmp_path / "nothing", library, tmp_path / "out")
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "s.ino").write_text(EMPTY)
    with pytest.raises(sketch.SketchError, match=r"no\.zip: no such library"):
        sketch.compile_sketch(tmp_path / "s", tmp_path / "no.zip", tmp_path / "out")


def test_command_line(library, tmp_path, root):
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "s.ino").write_text('static_assert(N == 3, "");\n' + EMPTY)
    command = [
        sys.executable, "-m", "auvest.firmware.sketch", tmp_path / "s", "--library", library,
        "--output", tmp_path / "out", "--define", "N=3", "--warnings", "all",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, cwd=root)
    assert done.returncode == 0, done.stderr
    elf, hex_file = done.stdout.splitlines()
    assert Path(elf).is_file()
    assert Path(hex_file).is_file()
    assert re.search(r"Sketch uses \d+ bytes", done.stderr)
    done = subprocess.run([*command, "--define", "N"], capture_output=True, text=True, cwd=root)
    assert done.returncode == 2
    assert "'N' is not NAME=VALUE" in done.stderr
    done = subprocess.run([*command, "--define", "N=4"], capture_output=True, text=True, cwd=root)
    assert done.returncode == 1
    assert done.stderr.startswith("auvest.firmware.sketch: s does not compile")
