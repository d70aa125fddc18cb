"""The program of `auvest hil`: a bench for one filter with its models, and the rows for it.

The sources are ``firmware/bench``; ``rows.hpp`` there and the header of each family say what passes
over the line.
"""

from __future__ import annotations

import re
import shutil
import zlib
from collections import deque
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from auvest._headers import firmware_folder
from auvest.firmware import hil_slat
from auvest.firmware.cost import assigned, literal, made, registered
from auvest.firmware.hil_record import Record, bits, place_given, place_names
from auvest.firmware.hil_slat import SlatRecord
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
        for path in ("bench/frames.hpp", "bench/rows.hpp", "bench/port.hpp", "board/board.hpp"):
            shutil.copy(source / path, sketch)
        return sketch


@dataclass(frozen=True)
class _Sensor:
    """Models of one type: one object in the program, and what of it changes from row to row."""

    type: str
    model: MeasurementModel
    changing: tuple[str, ...]


def bench(record: Record | SlatRecord) -> Bench:
    """Write the program for a record.

    Raises
    ------
    ValueError
        If a model is not one of the registry.
    """
    if isinstance(record, SlatRecord):
        template, places, rows = "slat.hpp.in", hil_slat.places(record), hil_slat.rows(record)
    else:
        sensors = _sensors(record)
        template, places, rows = "gaussian.hpp.in", _places(record, sensors), _rows(record, sensors)
    text = (firmware_folder() / "bench" / template).read_text(encoding="utf-8")
    header = re.sub(r"@(?!DIGEST)(\w+)@", lambda place: places[place[1]], text)
    digest = zlib.crc32(header.encode())
    header = header.replace("@DIGEST@", f"0x{digest:08x}")
    return Bench(header, digest, [row_frame(k, *words) for k, words in enumerate(rows)])


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


def _rows(record: Record, sensors: dict[str, _Sensor]) -> list[list[int]]:
    """Give the words of the start and of all rows, without their numbers."""
    measured, placed = record.measured, place_given(record)
    names = list(sensors)
    most = max(len(sensor.changing) for sensor in sensors.values())
    values = [model._core_params() for model in record.sensors]
    frames: list[list[int]] = [record.start.tolist()]
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
        age = [] if record.age is None else [record.age[k]]
        numbers = np.concatenate([[record.dt[k]], z, record.input[k], settings, age])
        frames.append([flags, *bits(numbers).tolist()])
    return frames


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


def _places(record: Record, sensors: dict[str, _Sensor]) -> dict[str, str]:
    """Give what stands in the places of gaussian.hpp.in."""
    filter_ = record.filter
    kind = next(name for name, number in _KINDS.items() if number == filter_._linearisation)
    types, make, inside = _inside(record, kind)
    update = []
    for i, sensor in enumerate(sensors.values()):
        make += [f"using Sensor{i} = {sensor.type};"]
        make += [made(sensor.model, f"Sensor{i}", f"make_sensor_{i}")]
        make += [f"Sensor{i} sensor_{i} = make_sensor_{i}();", ""]
        update.append(f"      case {i}:")
        if sensor.changing:
            make += [*_setter(i, sensor), ""]
            update.append(f"        set(sensor_{i}, seen);")
        update.append(f"        return correct(z, sensor_{i});")
    inputs = record.input.shape[1]
    driven = []
    if inputs:
        driven = [
            "  Process::Input input;",
            "  for (uint8_t i = 0; i < kInputs; ++i) input(i) = number(kInput + i);",
        ]
    given = ", input" if inputs else ""
    predict = f"  Status status = filter.predict(number(2){given});"
    correct = ["  return filter.update(z, seen);"]
    reset = ["  Status status = filter.reset(x, P);"]
    if filter_.longest_step_s != 3600:
        reset.insert(0, f"  filter.limit_steps({literal(filter_.longest_step_s)});")
    if filter_.headings > 1:
        several = f"static_cast<Inside&>(filter).reset(x, P, {filter_.headings})"
        reset.append(f"  if (status == Status::kOk) status = {several};")
    made_filter = [*_policy(record), f"Filter filter = {_whole(record, inside)};"]
    if record.age is not None:
        made_filter += _memory(record)
        predict = f"  Status status = memory.predict(filter, number(2), {given[2:] or '{}'});"
        correct = ["  const float age = number(kAge);"]
        correct.append("  if (age > kOldest) return Report(Status::kTimeBackwards);")
        correct.append("  return memory.update(filter, z, seen, age);")
        reset.append("  if (status == Status::kOk) memory.restart(filter);")
    feedback, show = [], []
    if filter_.kernel is not None:
        show.append("  for (float value : last.weight) put(out, value);")
    if filter_.components > 1:
        show.append("  put(out, static_cast<float>(filter.size()));")
        show.append("  put(out, static_cast<float>(static_cast<uint8_t>(filter.convergence())));")
    if filter_.policy is not None:
        second = min(1, len(filter_.x) - 1)
        feedback = [
            "  if (status != Status::kOk) return status;",
            "  auvest::Vector<float, 2> here;",
            "  here(0) = filter.x()(0);",
            f"  here(1) = filter.x()({second});",
            "  status = filter.feedback(here);",
        ]
        show.append("  put(out, filter.interval());")
    return {
        "PROCESS": _type(filter_.process.core_name, len(filter_.x)),
        "KIND": kind,
        "TYPES": "\n".join(types),
        "SIZE": str(record.z.shape[1]),
        "INPUTS": str(inputs),
        "SETTINGS": str(max(len(sensor.changing) for sensor in sensors.values())),
        "AGES": str(int(record.age is not None)),
        "MAKE": _lines(make),
        "UPDATE": _lines(update),
        "FILTER": "\n".join(made_filter),
        "CORRECT": _lines(correct),
        "PREDICT": _lines([*driven, predict]),
        "FEEDBACK": _lines(feedback),
        "RESET": _lines([*reset, "  return status;"]),
        "SHOW": _lines(show),
    }


def _lines(lines: list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _memory(record: Record) -> list[str]:
    """Write what keeps the last events for late measurements."""
    events = f"auvest::EventArray<auvest::LateEvent<Seeing, Seen>, {_events(record)}>"
    return [
        # An age may be a sum that was rounded.
        f"constexpr float kOldest = {literal(record.filter.late_s)} * 1.00001f;",
        f"auvest::LateMemory<Seeing, Seen, {events}> memory(filter);",
    ]


def _events(record: Record) -> int:
    """Count the events that the late memory of the desk holds at most, and two to spare."""
    events: deque[float] = deque()
    reach = most = 0.0
    for dt, measured in zip(record.dt.tolist(), record.measured, strict=True):
        for step in (dt, 0.0) if measured else (dt,):
            while events and reach - events[0] >= record.filter.late_s:
                reach -= events.popleft()
            events.append(step)
            reach += step
            most = max(most, len(events))
    return int(most) + 2


def _inside(record: Record, kind: str) -> tuple[list[str], list[str], str]:
    """Give types, functions that make them, and the value of the filter without its policy."""
    filter_ = record.filter
    kernel, recovery = filter_.kernel, filter_.recovery
    make = [made(filter_.process, "Process", "make_process"), ""]
    type_, value = "Plain", "Plain(make_process())"
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
    if kernel is not None or filter_.components > 1:
        of_kernel = "Unit" if kernel is None else type(kernel).__name__
        of_recovery = "NoRecovery" if recovery is None else "RejectionStreak"
        types.append(f"using Kernel = auvest::{of_kernel}<float>;")
        types.append(f"using Rule = auvest::RobustUpdate<Kernel, auvest::{of_recovery}<float>>;")
        types.append("using Guarded = auvest::Robust<Plain, Rule>;")
        options = filter_._options
        residual = {"innovation": "kInnovation", "post-fit": "kPostFit"}[filter_.residual]
        make += ["Rule make_rule() {", "  Rule rule;"]
        if kernel is not None:
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
        type_, value = "Guarded", f"Guarded({value}, make_rule())"
    if filter_.components > 1:
        type_ = f"auvest::GaussianSum<Guarded, {filter_.components}>"
        value = f"Inside({value})"
    types.append(f"using Inside = {type_};")
    return types, make, value


def _policy(record: Record) -> list[str]:
    """Write the type of the filter, and what makes its policy."""
    policy = record.filter.policy
    if policy is None:
        return ["using Filter = Seeing;"]
    law = {name: x for name, x in asdict(policy).items() if name != "preset"}
    lines = [f"using Policy = auvest::{type(policy).__name__}<float>;"]
    lines += ["Policy make_policy() {", "  Policy::Params params;"]
    lines += [*assigned("params", law), "  return Policy(params);", "}", ""]
    return [*lines, "using Filter = auvest::AdaptiveInterval<Seeing, Policy>;"]


def _whole(record: Record, inside: str) -> str:
    if record.filter.policy is None:
        return f"Filter({inside})"
    return f"Filter(Seeing({inside}), make_policy())"


def _setter(i: int, sensor: _Sensor) -> list[str]:
    """Write the function that gives a sensor what the row says of it."""
    order = list(sensor.model._core_defaults())
    lines = [f"void set(Sensor{i}& sensor, const Seen& seen) {{", "  uint8_t i = 0;"]
    lines.append("  sensor.params.visit([&i, &seen](const char*, float& value) {")
    for k, name in enumerate(sensor.changing):
        lines.append(f"    if (i == {order.index(name)}) value = seen.setting[{k}];  // {name}")
    return [*lines, "    ++i;", "  });", "}"]
