"""What a filter with these models takes on the chip, and whether it keeps the bits of the desk.

The sketch of the filter is compiled as the Arduino IDE does and runs on the simulated ATmega2560,
over a record that is simulated with the models themselves; Python runs the same filter over the
same record in float32.
"""

from __future__ import annotations

import ast
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import auvest
from auvest._arguments import Floats, as_array, as_integer, as_kind, as_number
from auvest._headers import firmware_folder, include_folders
from auvest.board import Board, Report
from auvest.errors import FilterError, ModelError
from auvest.firmware import simulator
from auvest.firmware.package import package
from auvest.firmware.sketch import Compiled, SketchError, compile_sketch
from auvest.models import PROCESSES, SENSORS, MeasurementModel, Model, ProcessModel
from auvest.models._compile import Found, explain, find_models, sources_of
from auvest.models.library import LoadedModels, load_models
from auvest.registry import filter_named

#: Kernels and policies by the names of the command line, and their types in C++.
KERNELS = {"hampel": "Hampel", "huber": "Huber", "igg": "Igg"}
POLICIES = {"mahalanobis": "MahalanobisInterval", "covariance-budget": "CovarianceBudget"}

_FLOAT64 = np.dtype(np.float64)
_EMPTY = "#include <auvest.h>\nvoid setup() {}\nvoid loop() {}\n"
# The sketch only calls: Arduino declares the functions of an .ino file at its top, before types.
_CALLS = """#define AUVEST_SHOW @
#include "filter.hpp"
void setup() { start(); }
void loop() { sample(); }
"""
#: Standard deviation of what drives the process, about its mean.
_INPUT_SIGMA = 0.1
#: Where the filter has a kernel, one row of so many is seen from as many sigmas of P0 away.
_OUTLIER_EVERY, _OUTLIER_SIGMAS = 10, 30.0

Progress = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a filter takes on the ATmega2560.

    Attributes
    ----------
    filter, process, sensors, kernel, policy
        What was measured.
    flash_bytes, static_ram_bytes : int
        As the Arduino IDE reports them, of a sketch with nothing else in it.
    flash_above_empty_bytes : int
        Of those, what the empty sketch does not have.
    stack_bytes : int
        Deepest stack of the whole run.
    cycles_min, cycles_median, cycles_max : int
        Of a step: predict, update, and feedback where there is a policy; 16 million are a second.
    steps : int
        Rows of the record.
    numbers : int
        How many were compared bit by bit: state, covariance and interval after each row.
    difference : str or None
        The first number that differs between chip and desk; None: all bits are the same.
    """

    filter: str
    process: str
    sensors: tuple[str, ...]
    kernel: str | None
    policy: str | None
    flash_bytes: int
    flash_above_empty_bytes: int
    static_ram_bytes: int
    stack_bytes: int
    cycles_min: int
    cycles_median: int
    cycles_max: int
    steps: int
    numbers: int
    difference: str | None

    def row(self) -> dict[str, Any]:
        """Give what ``auvest cost --json`` prints."""
        return {**asdict(self), "same_bits": self.difference is None}


def measure(
    header: str | Path | None = None,
    *,
    output: str | Path,
    filter: str = "ukf",  # noqa: A002
    process: str | None = None,
    sensors: Sequence[str] = (),
    kernel: str | None = None,
    policy: str | None = None,
    x0: npt.ArrayLike | None = None,
    sigma0: npt.ArrayLike | None = None,
    input: npt.ArrayLike | None = None,
    dt: float = 0.5,
    steps: int = 300,
    seed: int = 1,
    progress: Progress | None = None,
) -> Cost:
    """Compile a filter with its models for the MEGA2560, run it there and on the desk.

    Parameters
    ----------
    header : str or Path, optional
        Models of one's own, as for :func:`auvest.load_models`.
    output : str or Path
        Folder for the sketch, ``filter``, and the programs.
    filter : str
        One of the Kalman filters of ``auvest filters``.
    process : str, optional
        A struct of the header or a class of the package, with parameters if not the default ones:
        ``"SpeedHeading(heading_bias=True)"``; default: the first process of the header.
    sensors : sequence of str, optional
        Likewise; default: those of the header that suit the process.
    kernel : {"hampel", "huber", "igg"}, optional
        Robust kernel, with the recovery from lock-out; default: that of the filter.
    policy : {"mahalanobis", "covariance-budget"}, optional
        Interval policy; default: that of the filter.
    x0, sigma0 : array_like, shape (n,), optional
        Start and its standard deviations; default: 0 and 1.
    input : array_like, shape (k,), optional
        Mean of what drives the process; default: 0. Each row adds a draw of sigma 0.1.
    dt : float
        Seconds between rows, for a filter without a policy.
    steps : int
        Rows of the record.
    seed : int
        Of the record.
    progress : callable, optional
        Called with what is done, and of how much.

    Raises
    ------
    ModelError
        If a compiler does not take the header.
    ValueError, TypeError
        If an argument is wrong.
    SketchError, SimulatorError, FileNotFoundError
        If a tool is missing; the message says what to install.
    BoardError
        If the program fails on the board.
    """
    entry = filter_named(filter)
    if entry.family != "gaussian":
        raise ValueError(f"filter must be one with process and sensors, not {filter!r}")
    kind = entry.cls.removeprefix("Robust").removeprefix("A").capitalize()
    if kernel is None and entry.cls.startswith("Robust"):
        kernel = "hampel"
    if policy is None and entry.cls == "Aukf":
        policy = "mahalanobis"
    for name, value, known in (("kernel", kernel, KERNELS), ("policy", policy, POLICIES)):
        if value is not None:
            as_kind(name, value, tuple(known))
    say = progress or (lambda _done, _total: None)
    moves, sees = _find(header, process, sensors)
    record = _Record(
        moves.model,
        [sensor.model for sensor in sees],
        start=_vector("x0", x0, len(moves.model.state), 0.0),
        sigmas=_vector("sigma0", sigma0, len(moves.model.state), 1.0),
        mean=_vector("input", input, len(moves.model.input), 0.0),
        outliers=kernel is not None,
        seed=as_integer("seed", seed, 0, 2**63 - 1),
    )
    on_desk = record.play(
        _filter(kind, record, kernel, policy),
        as_number("dt", dt, "positive"),
        as_integer("steps", steps, 1, 100_000),
    )
    say(1, 6)

    folder = Path(output).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    text = _sketch(kind, moves, sees, kernel, policy, header)
    runner = simulator.find_or_build()
    library = package(folder)
    say(2, 6)
    compiled = {}
    for name, source in (
        ("empty", _EMPTY),
        ("filter", _CALLS.replace("@", "0")),
        ("shown", _CALLS.replace("@", "1")),
    ):
        compiled[name] = _compile(folder / name, source, text, library, header)
        say(2 + len(compiled), 6)
    (folder / "record.bin").write_bytes(record.words())
    report = _run(compiled["filter"], folder, runner)
    _run(compiled["shown"], folder, runner)
    on_chip = np.fromfile(folder / "trace.bin", "<u4").reshape(on_desk.shape)
    say(6, 6)
    return Cost(
        filter=filter,
        process=type(moves.model).__name__,
        sensors=tuple(type(sensor.model).__name__ for sensor in sees),
        kernel=kernel,
        policy=policy,
        flash_bytes=compiled["filter"].flash,
        flash_above_empty_bytes=compiled["filter"].flash - compiled["empty"].flash,
        static_ram_bytes=compiled["filter"].ram,
        stack_bytes=report.stack_bytes,
        cycles_min=report.sections[1].minimum,
        cycles_median=report.sections[1].median,
        cycles_max=report.sections[1].maximum,
        steps=len(on_desk),
        numbers=int(on_desk.size),
        difference=_first_difference(on_chip, on_desk, moves.model.state),
    )


def _vector(name: str, given: npt.ArrayLike | None, size: int, default: float) -> Floats:
    if given is None:
        return np.full(size, default)
    return as_array(name, given, (size,), _FLOAT64)


# ---- Models --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Model:
    """A model in Python, and its type in C++ over float and, for sensors, N states."""

    model: Any
    type: str


def registered() -> dict[str, str]:
    """Give the C++ types of the core's registry, over ``Scalar`` and ``N``, by their names."""
    (folder,) = (f for f in include_folders() if (f / "auvest" / "registry.hpp").is_file())
    text = (folder / "auvest" / "registry.hpp").read_text(encoding="utf-8")
    entries = re.findall(r"X\(\"(\w+)\", (?:[^<>]*N [=>][^,]*, )?(\w+<.*>)\)", text)
    return {name: f"auvest::{type_}" for name, type_ in entries}


def _find(
    header: str | Path | None, process: str | None, sensors: Sequence[str]
) -> tuple[_Model, list[_Model]]:
    own: dict[str, Found] = {}
    loaded = None
    if header is not None:
        path = Path(header).resolve()
        found = find_models(path.read_text(encoding="utf-8", errors="replace"), path)
        own = {model.name: model for model in found}
    if process is None:
        process = next((name for name, model in own.items() if model.kind == "process"), None)
    if process is None:
        raise ValueError("process must be named where no header has one")
    if header is not None:
        built_in = process.partition("(")[0] not in own
        states = (len(_model(process, {}, None).model.state),) if built_in else ()
        loaded = load_models(header, states=states)
    moves = _model(process, own, loaded)
    if not isinstance(moves.model, ProcessModel):
        raise ValueError(f"process must be a process, but {process} is a sensor")
    if sensors:
        sees = [_model(text, own, loaded) for text in sensors]
        for sensor in sees:
            if not isinstance(sensor.model, MeasurementModel):
                name = type(sensor.model).__name__
                raise ValueError(f"sensor must be a sensor, but {name} is a process")
            sensor.model.check_process(moves.model)
        return moves, sees
    named = [name for name, model in own.items() if model.kind == "sensor"]
    sees = [
        sensor
        for sensor in (_model(name, own, loaded) for name in named)
        if _suits(sensor.model, moves.model)
    ]
    if not sees:
        raise ValueError(f"sensor must be named where no header has one that suits {process}")
    return moves, sees


def _suits(sensor: MeasurementModel, process: ProcessModel) -> bool:
    try:
        sensor.check_process(process)
        sensor.core(len(process.state), _FLOAT64)
    except ValueError:
        return False
    return True


def _model(text: str, own: Mapping[str, Found], loaded: LoadedModels | None) -> _Model:
    """Make ``Name`` or ``Name(parameter=value, ...)``."""
    name, arguments = _call(text)
    if name in own:
        size = ", N" if own[name].sizes else ""
        type_ = f"{own[name].qualified}<float{size}>"
        return _Model(getattr(loaded, name)(**arguments), type_)
    classes: dict[str, Any] = {**PROCESSES, **SENSORS}
    if name not in classes:
        known = ", ".join([*own, *sorted(classes)])
        raise ValueError(f"there is no model {name!r}, but {known}")
    model = classes[name](**arguments)
    if isinstance(model, MeasurementModel):
        model = model.standing()
    return _Model(model, registered()[model.core_name].replace("Scalar", "float"))


def _call(text: str) -> tuple[str, dict[str, Any]]:
    try:
        call = ast.parse(text.strip(), mode="eval").body
        if isinstance(call, ast.Name):
            return call.id, {}
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            values = {part.arg or "**": ast.literal_eval(part.value) for part in call.keywords}
            if "**" not in values:
                return call.func.id, values
    except (SyntaxError, ValueError):
        pass
    raise ValueError(f"a model is Name or Name(parameter=value, ...), not {text!r}")


# ---- On the desk ---------------------------------------------------------------------------------


class _Record:
    """The process as it moves itself, seen by each sensor in turn; rows are made as they pass."""

    def __init__(
        self,
        process: ProcessModel,
        sensors: Sequence[MeasurementModel],
        *,
        start: Floats,
        sigmas: Floats,
        mean: Floats,
        outliers: bool,
        seed: int,
    ) -> None:
        if not (sigmas > 0).all():
            raise ValueError(f"sigma0 must be positive, not {sigmas.tolist()}")
        self.process = process
        self.sensors = {f"sensor_{i}": sensor for i, sensor in enumerate(sensors)}
        self.start = start.astype(np.float32)
        self.variances = (sigmas**2).astype(np.float32)
        self._sigmas, self._mean, self._outliers = sigmas, mean, outliers
        self._random = np.random.default_rng(seed)
        self._truth = start + sigmas * self._draw(len(start))
        self._rows: list[Floats] = []

    def play(self, filter_: Any, dt: float, steps: int) -> npt.NDArray[np.uint32]:
        """Run the filter over a record of so many rows; give the bits after each."""
        lower = np.tril_indices(len(self.start))
        adaptive = filter_.policy is not None
        bits = []
        try:
            for k in range(steps):
                interval = filter_.interval if adaptive else float(np.float32(dt))
                name, z, driven, position = self._next(k, interval)
                filter_.predict(interval, driven)
                filter_.update(z, name)
                shown: list[Floats] = [filter_.x, filter_.P[lower]]
                if adaptive:
                    shown.append(_words(filter_.feedback(position)))
                bits.append(np.concatenate(shown).view(np.uint32))
        except FilterError as error:
            raise ValueError(
                f"the record ends at row {k} on the desk: {error}; another start (x0, sigma0, dt) "
                "may suit the models"
            ) from None
        return np.array(bits)

    def words(self) -> bytes:
        """Give what the sketch reads."""
        parts = [self.start, self.variances, *self._rows, _words(np.nan)]
        return np.concatenate(parts).astype("<f4").tobytes()

    def _next(self, k: int, dt: float) -> tuple[str, Floats, Floats | None, Floats]:
        """Move on by dt; give the sensor's name, its measurement, the input, the position."""
        driven = (self._mean + _INPUT_SIGMA * self._draw(len(self._mean))).astype(np.float32)
        given = driven if len(driven) else None
        q = self.process.Q(dt, given)
        values, vectors = np.linalg.eigh(q)
        noise = vectors @ (np.sqrt(np.maximum(values, 0.0)) * self._draw(len(q)))
        self._truth = self.process.f(self._truth, dt, given) + noise
        seen = self._truth
        if self._outliers and k % _OUTLIER_EVERY == _OUTLIER_EVERY - 1:
            seen = seen + _OUTLIER_SIGMAS * self._sigmas * self._draw(len(seen))
        which = k % len(self.sensors)
        name = f"sensor_{which}"
        z = self.sensors[name].h(seen).astype(np.float32)
        if not np.isfinite(z).all():
            kind = type(self.sensors[name]).__name__
            raise ValueError(f"{kind} measures {z.tolist()} at {seen.tolist()}: begin elsewhere")
        size = max(len(sensor.measures) for sensor in self.sensors.values())
        padded = np.concatenate([z, np.zeros(size - len(z), np.float32)])
        position = self._truth[[0, min(1, len(seen) - 1)]].astype(np.float32)
        self._rows.append(np.concatenate([_words(dt, which), padded, driven, position]))
        return name, z, given, position

    def _draw(self, size: int) -> npt.NDArray[np.float64]:
        return self._random.standard_normal(size)


def _words(*numbers: float) -> npt.NDArray[np.float32]:
    return np.array(numbers, np.float32)


def _filter(kind: str, record: _Record, kernel: str | None, policy: str | None) -> Any:
    """Make the filter in Python as the sketch makes it."""
    options: dict[str, Any] = {}
    if kernel is not None:
        options.update(kernel=kernel, recovery=auvest.RejectionStreak())
    if policy is not None:
        options.update(policy=getattr(auvest, POLICIES[policy])())
    return getattr(auvest, kind)(
        record.start,
        np.diag(record.variances),
        process=record.process,
        sensors=record.sensors,
        dtype="float32",
        **options,
    )


def _first_difference(
    chip: npt.NDArray[np.uint32], desk: npt.NDArray[np.uint32], state: Sequence[str]
) -> str | None:
    different = np.argwhere(chip != desk)
    if len(different) == 0:
        return None
    row, column = different[0]
    names = [f"x[{name}]" for name in state]
    names += [f"P[{a}, {b}]" for i, a in enumerate(state) for b in state[: i + 1]]
    names.append("interval")
    there, here = (bits[row].view(np.float32)[column] for bits in (chip, desk))
    return f"row {row}, {names[column]}: {there:.9g} on the chip, {here:.9g} on the desk"


# ---- On the chip ---------------------------------------------------------------------------------


def _sketch(
    kind: str,
    process: _Model,
    sensors: Sequence[_Model],
    kernel: str | None,
    policy: str | None,
    header: str | Path | None,
) -> str:
    """Write the sketch of a filter: firmware/cost/filter.hpp.in with its places filled."""
    states = len(process.model.state)
    guarded, filter_ = "Plain", "Guarded"
    arguments = "process()"
    if kernel is not None:
        kernel_type = f"auvest::{KERNELS[kernel]}<float>"
        rule = f"auvest::RobustUpdate<{kernel_type}, auvest::RejectionStreak<float>>"
        guarded, arguments = f"auvest::Robust<Plain, {rule}>", "Plain(process())"
    if policy is not None:
        filter_ = f"auvest::AdaptiveInterval<Guarded, auvest::{POLICIES[policy]}<float>>"
        arguments = "process(), Plain::default_params()" if kind == "Ukf" else "Plain(process())"
        if kernel is not None:
            arguments = "Guarded(Plain(process()))"
    types = [re.sub(r"\bN\b", str(states), sensor.type) for sensor in sensors]
    make = [made(process.model, "Process", "process"), ""]
    cases = []
    for i, (sensor, type_) in enumerate(zip(sensors, types, strict=True)):
        make.append(f"using Sensor{i} = {type_};")
        make.append(made(sensor.model, f"Sensor{i}", f"make_sensor_{i}"))
        make.append(f"const Sensor{i} sensor_{i} = make_sensor_{i}();")
        cases.append(f"    case {i}: status = correct(row, sensor_{i}); break;")
    update = "status = filter.update(row.z, sensor_0).status;"
    if len(sensors) > 1:
        update = "\n".join(["switch (row.sensor) {", *cases, "  }"])
    inputs = len(process.model.input)
    ok = "if (status == auvest::Status::kOk)"
    places = {
        "INCLUDE": "" if header is None else f'#include "{Path(header).resolve()}"',
        "PROCESS": process.type,
        "KIND": kind,
        "GUARDED": guarded,
        "FILTER": filter_,
        "SIZE": str(max(len(sensor.model.measures) for sensor in sensors)),
        "INPUT": "  Process::Input input;\n" if inputs else "",
        "MAKE": "\n".join(make),
        "ARGUMENTS": arguments,
        "PREDICT": ("filter.interval()" if policy else "row.dt")
        + (", row.input" if inputs else ""),
        "UPDATE": f"  {ok} {update}\n",
        "FEEDBACK": f"  {ok} status = filter.feedback(row.desired);\n" if policy else "",
        "READ": "  read(row.input);\n" if inputs else "",
        "SHOW": "  show(filter.interval());\n" if policy else "",
    }
    text = (firmware_folder() / "cost" / "filter.hpp.in").read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda place: places[place[1]], text)


def made(model: Model, type_: str, function: str) -> str:
    """Write the function that makes a model with the parameters that it has on the desk."""
    defaults = model._core_defaults()
    own = {name: value for name, value in model._core_params().items() if value != defaults[name]}
    if not own:
        return f"{type_} {function}() {{ return {type_}(); }}"
    lines = [f"{type_} {function}() {{", f"  {type_} model;", *assigned("model.params", own)]
    return "\n".join([*lines, "  return model;", "}"])


def assigned(params: str, values: Mapping[str, float]) -> list[str]:
    """Write the lines that give members of a struct ``params`` these values, by their names."""
    if not values:
        return []
    lines = [f"  {params}.visit([](const char* name, float& value) {{"]
    for name, value in values.items():
        lines.append(f'    if (strcmp(name, "{name}") == 0) value = {literal(value)};')
    return [*lines, "  });"]


def literal(value: float) -> str:
    """Write the float32 of a number in C++."""
    if np.isinf(value):
        return f"{'-' if value < 0 else ''}auvest::math::infinity()"
    return f"{np.float32(value):.8e}f"


def _compile(
    sketch: Path, source: str, filter_: str, library: Path, header: str | Path | None
) -> Compiled:
    sketch.mkdir(exist_ok=True)
    (sketch / f"{sketch.name}.ino").write_text(source, encoding="utf-8")
    (sketch / "filter.hpp").write_text(filter_, encoding="utf-8")
    shutil.copy(firmware_folder() / "board" / "board.hpp", sketch)
    try:
        return compile_sketch(sketch, library, sketch.parent / "compiled")
    except SketchError as error:
        if header is None or "does not compile" not in str(error):
            raise
        path = Path(header).resolve()
        log = sketch / "compiler.txt"
        log.write_text(str(error), encoding="utf-8")
        raise ModelError(explain(str(error), path, sources_of(path), log)) from None


def _run(compiled: Compiled, folder: Path, runner: Path) -> Report:
    board = Board(
        compiled.elf,
        runner=runner,
        limit_s=3600.0,
        input=folder / "record.bin",
        output=folder / "trace.bin",
    )
    with board:
        return board.run()
