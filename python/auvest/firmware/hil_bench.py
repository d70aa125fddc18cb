"""The program of `auvest hil`: a bench for one filter with its models, and the rows for it.

The sources are ``firmware/bench``; ``bench.hpp.in`` there says what passes over the line.
"""

from __future__ import annotations

import re
import shutil
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from auvest._headers import firmware_folder
from auvest.firmware.cost import assigned, literal, made, registered
from auvest.firmware.hil_record import Record, Words, bits, place_given, place_names
from auvest.models import MeasurementModel
from auvest.telemetry import LineError, body_of, frame

_KINDS = {"Ekf": 0, "Ukf": 1, "Ckf": 2}
#: Row that asks who answers, and begins the record anew.
ANEW = 0xFFFFFFFF


@dataclass(frozen=True, eq=False)
class Bench:
    """A program for a filter, and the frames that it is played.

    Attributes
    ----------
    header : str
        ``bench.hpp``.
    digest : int
        By which the program names itself.
    rows : list of str
        Frames: the start, then each row.
    """

    header: str
    digest: int
    rows: list[str]

    def write(self, folder: Path, *, serial: bool = False) -> Path:
        """Write the sketch ``bench``, which is also what the other targets include; its folder."""
        sketch = folder / "bench"
        sketch.mkdir(parents=True, exist_ok=True)
        source = firmware_folder()
        (sketch / "bench.hpp").write_text(self.header, encoding="utf-8")
        text = (source / "bench" / "bench.ino.in").read_text(encoding="utf-8")
        text = text.replace("@SERIAL@", str(int(serial)))
        (sketch / "bench.ino").write_text(text, encoding="utf-8")
        for path in ("bench/frames.hpp", "bench/port.hpp", "board/board.hpp"):
            shutil.copy(source / path, sketch)
        return sketch


@dataclass(frozen=True)
class _Sensor:
    """Models of one type: one object in the program, and what of it changes from row to row."""

    type: str
    model: MeasurementModel
    changing: tuple[str, ...]


def bench(record: Record) -> Bench:
    """Write the program for a record.

    Raises
    ------
    ValueError
        If a model is not one of the registry.
    """
    sensors = _sensors(record)
    header = _header(record, sensors)
    digest = zlib.crc32(header.encode())
    return Bench(header.replace("@DIGEST@", f"0x{digest:08x}"), digest, _rows(record, sensors))


def row_frame(*words: int) -> str:
    """Write a row: a line without its end."""
    return frame(",".join(["R", *(f"{word:08x}" for word in words)]))


def answer_of(line: str) -> tuple[str, list[int]]:
    """Give the kind and the words of what a bench has said.

    Raises
    ------
    LineError
        If the line is damaged.
    """
    kind, *words = body_of(line).split(",")
    if not all(re.fullmatch("[0-9a-f]{8}", word) for word in words):
        raise LineError(f"not an answer of a bench: {line!r}")
    return kind, [int(word, 16) for word in words]


def _rows(record: Record, sensors: dict[str, _Sensor]) -> list[str]:
    """Write the start and all rows as frames."""
    measured, placed = record.measured, place_given(record)
    names = list(sensors)
    most = max(len(sensor.changing) for sensor in sensors.values())
    values = [model._core_params() for model in record.sensors]
    frames = [row_frame(0, *record.start.tolist())]
    for k in range(len(record)):
        model = record.sensors[record.sensor[k]]
        sensor = sensors[model.core_name]
        changed = dict(values[record.sensor[k]])
        if placed[k]:
            place = place_names(model)
            changed.update(zip(place, record.place[k, : len(place)].tolist(), strict=True))
        settings = [changed[name] for name in sensor.changing]
        settings += [0.0] * (most - len(settings))
        flags = int(measured[k]) | names.index(model.core_name) << 8
        z = np.nan_to_num(record.z[k])
        numbers = np.concatenate([[record.dt[k]], z, record.input[k], settings])
        frames.append(row_frame(k + 1, flags, *_integers(bits(numbers))))
    return frames


def _integers(words: Words) -> list[int]:
    integers: list[int] = words.tolist()
    return integers


def _sensors(record: Record) -> dict[str, _Sensor]:
    """Give what measures by its name in the core."""
    states = len(record.filter.process.state)
    placed = place_given(record)
    found = {}
    for name in dict.fromkeys(model.core_name for model in record.sensors):
        which = [i for i, model in enumerate(record.sensors) if model.core_name == name]
        models = [record.sensors[i] for i in which]
        params = [model._core_params() for model in models]
        changing = {key for key in params[0] if any(p[key] != params[0][key] for p in params)}
        if placed[np.isin(record.sensor, which)].any():
            changing |= set(place_names(models[0]))
        order = tuple(key for key in models[0]._core_defaults() if key in changing)
        found[name] = _Sensor(_type(name, states), models[0], order)
    return found


def _type(name: str, states: int) -> str:
    types = registered()
    if name not in types:
        raise ValueError(
            f"{name} is no model of the registry: auvest cost measures models of yours"
        )
    return re.sub(r"\bN\b", str(states), types[name].replace("Scalar", "float"))


def _header(record: Record, sensors: dict[str, _Sensor]) -> str:
    """Fill the places of bench.hpp.in, but for the digest."""
    filter_ = record.filter
    kernel, policy = filter_.kernel, filter_.policy
    kind = next(name for name, number in _KINDS.items() if number == filter_._linearisation)
    types, make = _filter(record, kind)
    update = []
    for i, sensor in enumerate(sensors.values()):
        make += [f"using Sensor{i} = {sensor.type};"]
        make += [made(sensor.model, f"Sensor{i}", f"make_sensor_{i}")]
        make += [f"Sensor{i} sensor_{i} = make_sensor_{i}();", ""]
        update.append(f"    case {i}:")
        if sensor.changing:
            make += [*_setter(i, sensor), ""]
            update.append(f"      set(sensor_{i});")
            update.append(
                f"      if (sensor_{i}.check() != Status::kOk) return sensor_{i}.check();"
            )
        update.append(f"      return correct(sensor_{i});")
    inputs = record.input.shape[1]
    predict = ["  Status status = filter.predict(number(2));"]
    if inputs:
        predict = [
            "  Process::Input input;",
            "  for (uint8_t i = 0; i < kInputs; ++i) input(i) = number(kInput + i);",
            "  Status status = filter.predict(number(2), input);",
        ]
    feedback, show = [], []
    if kernel is not None:
        show.append("  for (float value : weight) out.word(auvest::math::to_bits(value));")
    if policy is not None:
        second = min(1, len(filter_.x) - 1)
        feedback = [
            "  if (status != Status::kOk) return status;",
            "  auvest::Vector<float, 2> here;",
            "  here(0) = filter.x()(0);",
            f"  here(1) = filter.x()({second});",
            "  status = filter.feedback(here);",
        ]
        show.append("  out.word(auvest::math::to_bits(filter.interval()));")
    limit = []
    if filter_.longest_step_s != 3600:
        limit = [f"  filter.limit_steps({literal(filter_.longest_step_s)});"]
    places = {
        "PROCESS": _type(filter_.process.core_name, len(filter_.x)),
        "KIND": kind,
        "TYPES": "\n".join(types),
        "SIZE": str(record.z.shape[1]),
        "INPUTS": str(inputs),
        "SETTINGS": str(max(len(sensor.changing) for sensor in sensors.values())),
        "MAKE": "\n".join(make).rstrip(),
        "UPDATE": _lines(update),
        "PREDICT": _lines(predict),
        "FEEDBACK": _lines(feedback),
        "LIMIT": _lines(limit),
        "SHOW": _lines(show),
        "DIGEST": "@DIGEST@",
    }
    text = (firmware_folder() / "bench" / "bench.hpp.in").read_text(encoding="utf-8")
    return re.sub(r"@(\w+)@", lambda place: places[place[1]], text)


def _lines(lines: list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _filter(record: Record, kind: str) -> tuple[list[str], list[str]]:
    """Write the types of the filter, and what makes it as it is on the desk."""
    filter_ = record.filter
    kernel, recovery, policy = filter_.kernel, filter_.recovery, filter_.policy
    make = [made(filter_.process, "Process", "make_process"), ""]
    filter_type, value = "Plain", "Plain(make_process())"
    types = []
    if kind == "Ukf":
        points = {"alpha", "beta", "kappa"}
        given = {name: x for name, x in filter_._parameters.items() if name in points}
        make += [
            "Plain make_plain() {",
            "  Plain::Params points = Plain::default_params();",
            *assigned("points", given),
            "  return Plain(make_process(), points);",
            "}",
            "",
        ]
        value = "make_plain()"
    if kernel is not None:
        of_recovery = "NoRecovery" if recovery is None else "RejectionStreak"
        types.append(f"using Kernel = auvest::{type(kernel).__name__}<float>;")
        types.append(f"using Rule = auvest::RobustUpdate<Kernel, auvest::{of_recovery}<float>>;")
        types.append("using Guarded = auvest::Robust<Plain, Rule>;")
        options = filter_._options
        residual = {"innovation": "kInnovation", "post-fit": "kPostFit"}[filter_.residual]
        make += ["Rule make_rule() {", "  Rule rule;"]
        make += assigned("rule.kernel.params", asdict(kernel))
        if recovery is not None:
            make.append(f"  rule.recovery.params.rejections = {recovery.rejections};")
        make += [
            f"  rule.params.residual = auvest::Residual::{residual};",
            f"  rule.params.max_iterations = {options['max_iterations']};",
            f"  rule.params.tolerance = {literal(options['tolerance'])};",
            "  return rule;",
            "}",
            "",
        ]
        filter_type, value = "Guarded", f"Guarded({value}, make_rule())"
    if policy is not None:
        types.append(f"using Policy = auvest::{type(policy).__name__}<float>;")
        law = {name: x for name, x in asdict(policy).items() if name != "preset"}
        make += ["Policy make_policy() {", "  Policy::Params params;"]
        make += [*assigned("params", law), "  return Policy(params);", "}", ""]
        filter_type = f"auvest::AdaptiveInterval<{filter_type}, Policy>"
        value = f"Filter({value}, make_policy())"
    types.append(f"using Filter = {filter_type};")
    return types, [*make, f"Filter filter = {value};", ""]


def _setter(i: int, sensor: _Sensor) -> list[str]:
    """Write the function that gives a sensor what the row says of it."""
    order = list(sensor.model._core_defaults())
    lines = [f"void set(Sensor{i}& sensor) {{", "  uint8_t i = 0;"]
    lines.append("  sensor.params.visit([&i](const char*, float& value) {")
    for k, name in enumerate(sensor.changing):
        lines.append(
            f"    if (i == {order.index(name)}) value = number(kSetting + {k});  // {name}"
        )
    return [*lines, "    ++i;", "  });", "}"]
