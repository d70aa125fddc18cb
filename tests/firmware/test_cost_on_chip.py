"""`auvest cost`: what a model takes on the chip, and whether it keeps the bits there."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from auvest.errors import ModelError
from auvest.firmware import cost, simulator
from auvest.firmware.sketch import SketchError
from auvest.registry import FILTERS
from tests.slow import SLOW

pytest_plugins = ["board_support"]

#: One state and the size of a step, which the compiler sees on the chip only where it is not PC's.
HEADER = """#pragma once
#include "auvest/auvest.hpp"

template <class Scalar_>
struct Walk : auvest::ProcessModel<Walk<Scalar_>, Scalar_, 2> {
  using Base = auvest::ProcessModel<Walk<Scalar_>, Scalar_, 2>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  static constexpr const char* kStateNames = "x_m y_m";
  struct Params {
    Scalar psd = Scalar(0.01);
    template <class Visitor>
    void visit(Visitor&& v) { v("psd", psd); }
  };
  Params params;
  State f(const State& x, Scalar dt) const {
    State next = x;
    next(0) = x(0) + dt * Scalar(@SPEED@);
    return next;
  }
  Covariance Phi(const State&, Scalar) const { return Covariance::Identity(); }
  Covariance Q(Scalar dt) const { return Covariance::Identity() * (params.psd * dt); }
};
"""
ONE_SPEED = HEADER.replace("@SPEED@", "0.25")
TWO_SPEEDS = HEADER.replace("@SPEED@", "kSpeed").replace(
    "template <class Scalar_>",
    "#ifdef __AVR__\nconstexpr double kSpeed = 0.26;\n#else\n"
    "constexpr double kSpeed = 0.25;\n#endif\n\ntemplate <class Scalar_>",
    1,
)
ONLY_ON_DESK = HEADER.replace("@SPEED@", "kOnDesk").replace(
    "template <class Scalar_>",
    "#ifndef __AVR__\nconstexpr double kOnDesk = 0.25;\n#endif\n\ntemplate <class Scalar_>",
    1,
)


@pytest.fixture(scope="module")
def measure(runner, tmp_path_factory):
    """Return `cost.measure` with runner and folder filled in."""
    # One for all: Arduino's core is compiled once, and the empty sketch, which none changes.
    folder = tmp_path_factory.mktemp("cost")
    compile_, empty = cost._compile, []

    def compile_once(sketch, *arguments):
        if sketch.name != "empty":
            return compile_(sketch, *arguments)
        empty[:] = empty or [compile_(sketch, *arguments)]
        return empty[0]

    def measure(*arguments, **options):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("AUVEST_BOARD", str(runner))
            patch.setattr(cost, "_compile", compile_once)
            return cost.measure(*arguments, output=folder, **options)

    return measure


@pytest.fixture
def written(tmp_path):
    """Return a function that writes a header and gives its path."""

    def written(text):
        (tmp_path / "walk.hpp").write_text(text)
        return tmp_path / "walk.hpp"

    return written


def test_models_of_ones_own_cost_what_the_built_in_ones_do(measure, root):
    mine = measure(root / "cpp/examples/my_models.hpp", filter="aukf")
    built_in = measure(process="ConstantAcceleration", sensors=["RangeBearing"], filter="aukf")
    for name, value in mine.row().items():
        if name.endswith("_bytes") or name.startswith("cycles"):
            # The limits of a range, 4 bytes each, are what the example leaves out.
            known = 8 if name == "static_ram_bytes" else 0
            assert value + known == pytest.approx(getattr(built_in, name), rel=0.02), name
    assert mine.difference is built_in.difference is None
    # x, the lower triangle of P, and the interval.
    assert mine.numbers == built_in.numbers == 300 * (6 + 21 + 1)
    # The tutorial shows what the command has printed for this header.
    tutorial = (root / "docs" / "tutorials" / "paper_to_chip.md").read_text()
    command = "$ auvest cost cpp/examples/my_models.hpp --filter aukf\n"
    shown = tutorial.partition(command)[2].partition("```")[0]
    for what, name in [("flash", "flash_bytes"), ("static RAM", "static_ram_bytes"),
                       ("stack", "stack_bytes"), ("a step, median", "cycles_median")]:  # fmt: skip
        number = re.search(rf"^ {what} +([\d,]+)", shown, re.MULTILINE)[1]
        assert int(number.replace(",", "")) == pytest.approx(mine.row()[name], rel=0.02), what
    assert f"every bit: {mine.numbers:,} numbers" in shown


def test_the_figures_are_those_of_the_budgets(measure, root):
    """The same filter in a sketch of its own: what differs is the model's discretisation."""
    euler = "ConstantAcceleration(discretisation='euler')"
    here = measure(process=euler, sensors=["RangeBearing"], filter="aukf")
    lines = (root / "firmware" / "budgets.csv").read_text().splitlines()
    (there,) = (line.split(",") for line in lines if line.startswith("atmega2560,aukf,"))
    flash, ram, stack = (int(value) for value in there[2:5])
    assert here.difference is None
    # Rows that carry a sensor's number and a time step are 16 bytes of code and 9 of stack.
    assert here.flash_bytes == pytest.approx(flash, rel=0.05)
    assert here.static_ram_bytes == ram
    assert here.stack_bytes == pytest.approx(stack, rel=0.02)


#: A process each, with sensors that suit it; several sensors take turns.
PLANE = ("LeaderRange", "Position", "RangeBearing")
SPACE = ("Position(covariance_m2=((4, 1, 0), (1, 2, 0), (0, 0, 1)))", "Depth",
         "BodyVelocity(axes=3)", "RangeBearingElevation")  # fmt: skip
REGISTRY = [
    ("ekf", "SpeedHeading", PLANE),
    ("ukf", "SpeedHeading(heading_bias=True)", PLANE),
    ("robust-ukf", "SpeedHeading(speed_scale=True)", PLANE),
    ("robust-ekf", "SpeedHeading(heading_bias=True, speed_scale=True)", PLANE),
    ("ckf", "Odometry", PLANE),
    ("robust-ekf", "WhiteAcceleration", (*PLANE, "BodyVelocity")),
    ("robust-ukf", "WhiteAcceleration(axes=3)", SPACE),
    ("ckf", "WhiteAcceleration(axes=3)", SPACE),
    ("robust-ekf", "SpeedHeadingCurrent", PLANE),
    ("ekf", "ConstantAcceleration", PLANE),
    ("aukf", "ConstantAcceleration(discretisation='euler')", PLANE),
    ("ekf", "PlanarHull", ("RangeBearing", "HeadingSpeed")),
    ("robust-ekf", "OdometryConstants", ("ScaledRange",)),
]
#: What drives a process: speed and heading, a way and a turn, rudder and propeller.
DRIVEN = {"Speed": [1.0, 0.0, 0.5], "Odometry": [1.0, 0.0, 0.5], "PlanarHull": [0.05, 12.0]}


#: Rows of the registry that are always tried: each takes two compilers ten seconds. An AUKF with
#: the discretisation of Euler is measured for its figures, above.
ALWAYS = [REGISTRY[k] for k in (3, 4, 6)]


@pytest.mark.parametrize(
    ("filter_name", "process", "sensors"),
    [pytest.param(*row, marks=() if row in ALWAYS else SLOW) for row in REGISTRY],
)
def test_every_model_of_the_registry_keeps_its_bits_on_the_chip(
    measure, filter_name, process, sensors
):
    driven = next((mean for name, mean in DRIVEN.items() if name in process), None)
    found = measure(filter=filter_name, process=process, sensors=sensors, input=driven, steps=60)
    assert found.difference is None
    assert found.numbers >= 60 * 5


def test_the_records_name_every_model_and_filter():
    names = {cost._model(text, {}, None).model.core_name for _, text, _ in REGISTRY}
    names |= {cost._model(text, {}, None).model.core_name for *_, s in REGISTRY for text in s}
    assert names == set(cost.registered())
    filters = {entry.name for entry in FILTERS.values() if entry.family == "gaussian"}
    assert {name for name, *_ in REGISTRY} == filters


def test_parameters_kernel_and_policy_reach_the_chip(measure, written):
    header = written(ONE_SPEED)
    plain = measure(header, sensors=["Position"], steps=40)
    assert (plain.process, plain.sensors, plain.difference) == ("Walk", ("Position",), None)
    other = measure(
        header, process="Walk(psd=0.3)", sensors=["LeaderRange(sigma_range_m=0.2)", "Position"],
        kernel="igg", policy="covariance-budget", steps=40,
    )  # fmt: skip
    assert (other.kernel, other.policy, other.difference) == ("igg", "covariance-budget", None)
    assert other.flash_bytes > plain.flash_bytes


def test_a_difference_is_named(measure, written):
    found = measure(written(TWO_SPEEDS), sensors=["Position"], steps=10)
    match = re.fullmatch(r"row 0, x\[x_m\]: (\S+) on the chip, (\S+) on the desk", found.difference)
    # Half a second at 0.01 m/s more; P = 1.005 before an update with R = 1 leaves R / (P + R).
    assert float(match[1]) - float(match[2]) == pytest.approx(0.005 / 2.005, rel=1e-4)


def test_what_does_not_compile_for_the_chip_begins_with_the_users_line(measure, written):
    header = written(ONLY_ON_DESK)
    line = 1 + header.read_text().splitlines().index("    next(0) = x(0) + dt * Scalar(kOnDesk);")
    with pytest.raises(ModelError, match=rf"^walk.hpp:{line}: .*kOnDesk.* not declared"):
        measure(header, sensors=["Position"], steps=10)


def test_the_command_prints_the_figures(runner, root):
    command = [sys.executable, "-m", "auvest", "cost", "cpp/examples/my_models.hpp", "--json"]
    environment = {**os.environ, "AUVEST_BOARD": str(runner)}
    command += ["--steps", "20", "--filter", "ekf"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=root)
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert printed["same_bits"] is True
    assert printed["numbers"] == 20 * 27
    assert printed["cycles_min"] <= printed["cycles_median"] <= printed["cycles_max"]


def test_a_missing_tool_is_named(monkeypatch, tmp_path):
    programs = {name: shutil.which(name) for name in ("g++", "avr-g++", "arduino-builder")}

    def without(missing):
        folder = tmp_path / missing
        folder.mkdir()
        for name in set(programs) - {missing}:
            (folder / name).symlink_to(programs[name])
        monkeypatch.setenv("PATH", str(folder))

    options = {"process": "Odometry", "sensors": ["Position"], "steps": 2, "output": tmp_path}
    board = shutil.which("true")
    monkeypatch.setenv("AUVEST_BOARD", board)
    without("avr-g++")
    with pytest.raises(SketchError, match="install gcc-avr"):
        cost.measure(**options)
    without("arduino-builder")
    with pytest.raises(SketchError, match="install arduino-builder"):
        cost.measure(**options)


def test_the_simulated_board_is_built_once(monkeypatch, tmp_path, runner):
    monkeypatch.delenv("AUVEST_BOARD", raising=False)
    monkeypatch.setenv("AUVEST_CACHE", str(tmp_path))
    monkeypatch.setattr(simulator.shutil, "which", lambda _name: None)
    monkeypatch.setattr(simulator, "find_compiler", lambda: (["g++"], "g++"))
    monkeypatch.setattr(simulator, "_FLAGS", ("-std=c++17", "-O0"))  # half of the time
    built = simulator.find_or_build()
    version = subprocess.run([built, "--help"], capture_output=True, text=True)
    assert (
        version.stdout == subprocess.run([runner, "--help"], capture_output=True, text=True).stdout
    )
    stamp = built.stat().st_mtime_ns
    assert simulator.find_or_build() == built
    assert built.stat().st_mtime_ns == stamp
    built.unlink()
    monkeypatch.setattr(simulator, "_HEADERS", ())
    with pytest.raises(simulator.SimulatorError, match="apt install libsimavr-dev libelf-dev"):
        simulator.find_or_build()
