"""JSON Schema of the settings, for editors: made of the settings' own descriptions and comments.

``settings.schema.json`` beside this file is what it makes; ``python -m auvest.replay.schema``
writes it anew.
"""

from __future__ import annotations

import inspect
import json
import math
import re
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from auvest.logs.layout import COLUMNS, FILES
from auvest.logs.reading import UNITS, columns_of
from auvest.replay import config
from auvest.replay.config import Settings

SCHEMA = Path(__file__).with_name("settings.schema.json")


def schema() -> dict[str, Any]:
    """Make the schema."""
    sections = {
        name: _section(kind) for name, kind in get_type_hints(Settings).items() if name != "files"
    }
    sections["columns"] = _of_files("how a file of your own is read", _columns)
    sections["units"] = _of_files("units of its columns", _units)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Settings of auvest replay",
        **_object(sections),
    }


def _object(properties: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"type": "object", **more, "properties": properties, "additionalProperties": False}


def _section(kind: type[Any]) -> dict[str, Any]:
    """Describe a section, or what is said of one source."""
    hints, comments = get_type_hints(kind), _comments(kind)
    properties = {}
    for entry in fields(kind):
        made = _value(hints[entry.name], entry.metadata.get("schema", {}))
        if entry.name in comments:
            made["description"] = comments[entry.name]
        if isinstance(entry.default, (str, bool, int, float)) and entry.default != math.inf:
            made["default"] = entry.default
        properties[entry.name] = made
    return _object(properties, description=inspect.cleandoc(kind.__doc__ or ""))


def _value(hint: Any, taken: Mapping[str, Any]) -> dict[str, Any]:
    if taken:
        return dict(taken)
    if get_origin(hint) is Literal:
        return {"enum": list(get_args(hint))}
    if get_origin(hint) in (Union, types.UnionType):
        return _value(get_args(hint)[0], {})
    one = get_args(hint)[1]  # of each source
    assert is_dataclass(one)
    return {
        "type": "object",
        "patternProperties": {"^[0-9]+$": _section(one)},  # type: ignore[arg-type]
        "additionalProperties": False,
    }


def _comments(kind: type[Any]) -> dict[str, str]:
    """Give the comments behind the fields of a class."""
    found = re.findall(r"^    (\w+): .*?  # (.+)$", inspect.getsource(kind), re.MULTILINE)
    return dict(found)


def _of_files(description: str, make: Any) -> dict[str, Any]:
    return _object(
        {name.removesuffix(".csv"): _object(make(name)) for name in FILES}, description=description
    )


def _columns(name: str) -> dict[str, Any]:
    text = {"type": "string", "minLength": 1}
    made: dict[str, Any] = {
        key: {"enum": list(kinds)} if kinds else dict(text)
        for key, kinds in config.FILE_KEYS.items()
    }
    return made | {column: dict(text) for column in columns_of(name)}


def _units(name: str) -> dict[str, Any]:
    return {
        column: {"enum": list(UNITS[COLUMNS[column].unit])}
        for column in columns_of(name)
        if COLUMNS[column].unit
    }


def text() -> str:
    """Give the schema as it is shipped."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    SCHEMA.write_text(text(), encoding="utf-8")
