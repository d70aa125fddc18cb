"""Settings as the text of a TOML file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from auvest.logs.reading import FileReading
from auvest.replay.config import Settings
from auvest.replay.schema import SCHEMA

#: The first line: by it editors complete and check the file.
SCHEMA_LINE = f"#:schema {SCHEMA.as_uri()}"


def settings_text(settings: Settings, about: Mapping[str, str]) -> str:
    """Write all that is not as the defaults have it.

    Parameters
    ----------
    settings : Settings
        The settings.
    about : mapping
        Comments, by "section.key"; what has one is written even where it is the default.
    """
    lines: list[str] = []
    default = Settings()
    for entry in fields(settings):
        name = entry.name
        section, usual = getattr(settings, name), getattr(default, name)
        if name == "files":
            for file, reading in section.items():
                lines += file_sections(file.removesuffix(".csv"), reading)
            continue
        lines += _section(name, section, usual, about)
        for source, own in getattr(section, "sources", {}).items():
            lines += _section(f"{name}.sources.{source}", own, None, {})
    return "\n".join(lines) + "\n"


def _section(name: str, section: Any, usual: Any, about: Mapping[str, str]) -> Iterator[str]:
    said = []
    for entry in fields(section):
        value = getattr(section, entry.name)
        comment = about.get(f"{name}.{entry.name}")
        default = None if usual is None else getattr(usual, entry.name)
        if entry.name != "sources" and value is not None and (comment or value != default):
            behind = f"  # {comment}" if comment else ""
            said.append(f"{entry.name} = {_value(value)}{behind}")
    if said:
        yield from ("", f"[{name}]", *said)


def _value(value: Any) -> str:
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else f"{value:g}"
    return json.dumps(value)


def file_sections(stem: str, one: FileReading) -> Iterator[str]:
    """Give [columns] and [units] of a file."""
    said = {"file": one.file} if one.file else {}
    said |= {"separator": one.separator} if one.separator != "," else {}
    said |= {"decimal": one.decimal} if one.decimal != "." else {}
    for section, values in (("columns", {**said, **one.columns}), ("units", one.units)):
        if values:
            yield from ("", f"[{section}.{stem}]")
            yield from (f"{key} = {json.dumps(value)}" for key, value in values.items())
