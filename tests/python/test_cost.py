"""`auvest cost`: what it understands, and what it refuses before a tool is called."""

import numpy as np
import pytest
from typer.testing import CliRunner

from auvest import _core
from auvest.cli import app
from auvest.firmware import cost


def test_the_types_are_those_of_the_core():
    processes, sensors = _core.models()
    assert set(cost.registered()) == {*processes, *(name for name, _ in sensors)}
    assert cost.registered()["BodyVelocity3"] == "auvest::BodyVelocity<Scalar, N, 3>"
    assert cost.registered()["SpeedHeadingBias"] == "auvest::SpeedHeading<Scalar, true>"


def test_a_model_is_a_name_with_parameters():
    assert cost._call("Walk") == ("Walk", {})
    assert cost._call(" Walk(psd=-0.5, axes=3) ") == ("Walk", {"psd": -0.5, "axes": 3})
    others = ("Walk(0.5)", "Walk(psd=open('x'))", "a.Walk()", "a.Walk", "Walk(", "3", "Walk(**{})")
    for text in others:
        with pytest.raises(ValueError, match=r"a model is Name or Name\(parameter=value"):
            cost._call(text)


@pytest.mark.parametrize(
    ("column", "name"),
    enumerate(["x[a]", "x[b]", "P[a, a]", "P[b, a]", "P[b, b]", "interval"]),
)
def test_the_first_bit_that_differs_is_named(column, name):
    """Of a row: the state, the lower triangle of P row by row, the interval."""
    desk = np.arange(12, dtype=np.float32).reshape(2, 6).view(np.uint32)
    chip = desk.copy()
    assert cost._first_difference(chip, desk, ["a", "b"]) is None
    chip[1, column:] = np.float32(0.5).view(np.uint32)
    said = f"row 1, {name}: 0.5 on the chip, {6 + column} on the desk"
    assert cost._first_difference(chip, desk, ["a", "b"]) == said


def test_parameters_that_differ_are_written_with_all_their_digits():
    model = cost._model("LeaderRange(sigma_range_m=0.1)", {}, None).model
    text = cost.made(model, "Sensor0", "make")
    number = text.partition("value = ")[2].partition("f;")[0]
    assert np.float32(number) == np.float32(0.1)
    assert text.count("strcmp") == 1
    default = cost._model("LeaderRange", {}, None).model
    assert cost.made(default, "Sensor0", "make") == "Sensor0 make() { return Sensor0(); }"


@pytest.mark.parametrize("name", ["LeaderRange", "ScaledRange", "BodyVelocity(axes=2)"])
def test_a_sensor_that_does_not_say_where_it_stands_stands_where_the_chip_has_it(name):
    model = cost._model(name, {}, None).model
    assert model.stands
    assert cost.made(model, "Sensor0", "make") == "Sensor0 make() { return Sensor0(); }"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "process must be named"),
        (["none.hpp"], "file 'none.hpp' does not exist"),
        (["--process", "Odometry"], "sensor must be named"),
        (["--process", "Odometri"], "there is no model 'Odometri', but BodyVelocity, "),
        (["--process", "Position"], "process must be a process, but Position is a sensor"),
        (["--process", "Odometry", "--sensor", "SpeedHeading"], "SpeedHeading is a process"),
        (["--process", "Odometry", "--sensor", "Depth"], "Depth observes x_m, y_m, z_m"),
        (["--process", "Odometry", "--sensor", "Position", "--kernel", "tukey"], "kernel must be"),
        (["--process", "Odometry", "--sensor", "Position", "--policy", "no"], "policy must be"),
        (["--process", "Odometry", "--sensor", "Position", "--x0", "1,2"], r"x0 has shape (2,)"),
        (["--process", "Odometry", "--sensor", "Position", "--sigma0", "1,0,1"], "sigma0 must be"),
        (["--filter", "slatf1"], "filter must be one with process and sensors"),
        (["--filter", "kf"], "filter must be ekf, ukf"),
    ],
)
def test_wrong_arguments_are_refused_by_name(arguments, message):
    done = CliRunner().invoke(app, ["cost", *arguments])
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.split())


def test_a_record_that_the_filter_cannot_follow_is_explained(tmp_path):
    with pytest.raises(ValueError, match=r"at row 0 on the desk: .* another start"):
        cost.measure(
            process="Odometry", sensors=["Position"], sigma0=[1e18] * 3, input=[1e38, 0, 0],
            output=tmp_path,
        )  # fmt: skip
