"""The product's voice: every message that a test provokes is one of those in messages.txt.

A test that asks for a part of a message (``match=``) says what matters in it; that the rest of it
holds the right names and values is seen here, where they are read one after the other.  A message
that is meant to be new or another is taken with ``pytest tests/python --renew``, which adds to the
file what that run provokes; remove the file before it to be rid of messages that nothing provokes.
"""

from __future__ import annotations

import re
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
from typer.testing import CliRunner

import auvest
from auvest.commands.version import version

FILE = Path(__file__).with_name("messages.txt")

#: Where the package is: messages of other libraries are not ours.
_PACKAGE = str(Path(auvest.__file__).parent)

#: What differs from run to run beside folders, and what stands for it.
_VARIES = (
    (
        re.compile(
            r"\b0x[0-9a-f]{6,}\b|(?<![\w.])(?=\d*[a-f])([0-9a-f]{8}|[0-9a-f]{32}|[0-9a-f]{64})\b"
        ),
        "HEX",
    ),
    (re.compile(r"(checksum HEX, but HEX computed): .*"), r"\1: LINE"),
    (re.compile(r"\bhas \d+ bytes"), "has N bytes"),
    (re.compile(r"-?\d(\.\d+)?e-1\d\b"), "ROUNDING"),
    (re.compile(r"/tmp/[\w.-]+"), "/tmp/NAME"),
    (re.compile(r"\bruns \d+ to \d+ of [^:]*:"), "runs N to M of A TASK:"),
    (re.compile(r"\btcp://[\w.]+:\d+"), "tcp://ADDRESS"),
    (re.compile(r'(?<="version": )"unknown"'), '"VERSION"'),  # of sources that are not installed
    (re.compile(rf"(?<![\w.]){re.escape(version())}(?![\w.])"), "VERSION"),
)


def read() -> set[str]:
    """Return the messages of the file, which are separated by empty lines."""
    text = FILE.read_text(encoding="utf-8") if FILE.exists() else ""
    return set(text.strip("\n").split("\n\n"))


def write(messages: set[str]) -> None:
    """Write the file."""
    FILE.write_text("\n\n".join(sorted(messages)) + "\n", encoding="utf-8")


def _is_ours(error: BaseException) -> bool:
    """Return whether the package, its compiled part included, raised the error."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and trace.tb_frame.f_code.co_filename.startswith(_PACKAGE)


def neutral(text: str, places: dict[str, str]) -> str:
    """Return the text without what differs from run to run; ``places`` are folders and names."""
    for place, name in places.items():
        text = re.sub(re.escape(place) + r"(/[\w-]+\d+)?", name, text)
    for pattern, name in _VARIES:
        text = pattern.sub(name, text)
    return text


class Messages:
    """What one test has provoked; for ``places`` see :func:`neutral`."""

    def __init__(self, places: dict[str, str]) -> None:
        self.said: list[str] = []
        self._places = places

    def add(self, text: str) -> None:
        """Note a message as it stands in the file, which has no empty lines in messages."""
        if "All that the compiler said" in text:
            return  # in its own words, which change with its version
        lines = neutral(text, self._places).strip().split("\n")
        self.said.append("\n".join(line.rstrip() or "." for line in lines))

    def add_error(self, error: BaseException) -> None:
        """Note the message of an error that the package raised."""
        if _is_ours(error):
            text = str(error)
            cause = error.__cause__ or error.__context__
            if cause is not None and str(cause) and not _is_ours(cause):
                text = text.replace(str(cause), "CAUSE")
            self.add(f"{type(error).__name__}: {text}")

    def add_lines(self, stderr: str) -> None:
        """Note the errors and notes that a command printed."""
        for line in stderr.split("\n"):
            if line.startswith(("Error:", "Note:")):
                self.add(line)


class _Raises:
    """``pytest.raises(...)`` that notes what was raised."""

    def __init__(self, context: Any, messages: Messages) -> None:
        self._context = context
        self._messages = messages

    def __enter__(self) -> Any:
        return self._context.__enter__()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> Any:
        expected = self._context.__exit__(kind, error, trace)
        if expected and error is not None:
            self._messages.add_error(error)
        return expected


def watch(monkeypatch: pytest.MonkeyPatch, messages: Messages) -> None:
    """Have ``pytest.raises`` and commands that run in this process note what they say."""
    raises, invoke = pytest.raises, CliRunner.invoke

    def watched_raises(*arguments: Any, **options: Any) -> Any:
        return _Raises(raises(*arguments, **options), messages)

    def watched_invoke(*arguments: Any, **options: Any) -> Any:
        result = invoke(*arguments, **options)
        messages.add_lines(result.stderr)
        return result

    monkeypatch.setattr(pytest, "raises", watched_raises)
    monkeypatch.setattr(CliRunner, "invoke", watched_invoke)
