"""From a header with models to a compiled library: find the models, generate, compile, keep.

Compiled libraries are kept in ``$AUVEST_CACHE``, ``$XDG_CACHE_HOME/auvest`` or ``~/.cache/auvest``
under a name that stands for all they are made of.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from auvest._headers import include_folders
from auvest.errors import ModelError

_FLAGS = ("-std=c++17", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
_SCREEN = 24  # lines of a message at most

#: The numbers of states that the models of the package have.
_STATES = (2, 3, 4, 6)

# Comments, and strings and characters, which may hold what looks like a comment.
_LITERAL = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
_TOKEN = re.compile(
    r"(?P<open>(?:inline\s+)?namespace(?P<namespace>\s+[\w:]+)?\s*\{|\{)|(?P<close>\})|"
    r"(?:template\s*<(?P<template>[^<>]*)>\s*)?\b(?:struct|class)\s+(?P<name>\w+)\s*"
    r"(?:final\s*)?:\s*(?:public\s+)?(?:::)?(?:auvest::)?"
    r"(?P<base>ProcessModel|MeasurementModel)\s*<"
)


@dataclass(frozen=True)
class Found:
    """A model in a header."""

    kind: str  # "process" or "sensor"
    name: str
    qualified: str  # with its namespaces
    line: int
    sizes: int  # its template parameters behind Scalar: 0, or 1 for the number of states
    observed: int | None  # how many leading states it depends on, where a number says so


def find_models(text: str, path: Path) -> list[Found]:
    """Find the structs that derive from ProcessModel or MeasurementModel, in the header's order.

    Raises
    ------
    ModelError
        If there is none, or one has a form that cannot be made for both precisions.
    """
    code = _LITERAL.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    found: list[Found] = []
    scopes: list[str | None] = []  # names of namespaces; None: any other braces
    for match in _TOKEN.finditer(code):
        if match["open"]:
            named = match["open"] != "{"
            scopes.append((match["namespace"] or "").strip() if named else None)
        elif match["close"]:
            scopes[-1:] = []
        elif None not in scopes:
            line = code.count("\n", 0, match.start("name")) + 1
            arguments = _arguments(code, match.end())
            found.append(_as_found(match, line, path, arguments, [s for s in scopes if s]))
    if not found:
        raise ModelError(
            f"{path}: no model found. A model is a struct like\n"
            "    template <class Scalar>\n"
            "    struct Drift : auvest::ProcessModel<Drift<Scalar>, Scalar, 2> { ... };\n"
            "    template <class Scalar, int N>\n"
            "    struct Range : auvest::MeasurementModel<Range<Scalar, N>, Scalar, N, 1> { ... };"
        )
    names = [model.name for model in found]
    for model in found:
        if names.count(model.name) > 1:
            raise ModelError(f"{path}:{model.line}: there are two models called {model.name}")
    return found


def _as_found(
    match: re.Match[str], line: int, path: Path, arguments: list[str], scopes: list[str]
) -> Found:
    name = match["name"]
    kind = "process" if match["base"] == "ProcessModel" else "sensor"
    parameters = [part.split() for part in (match["template"] or "").split(",")]
    typed = parameters[0][:1] in (["class"], ["typename"])
    sized = [part[:1] == ["int"] and "=" not in part for part in parameters[1:]]
    if not typed or len(sized) > 1 or not all(sized) or (sized and kind == "process"):
        form = "template <class Scalar>"
        if kind == "sensor":
            form += " or, for any number of states, template <class Scalar, int N>"
        raise ModelError(f"{path}:{line}: {name} must begin with {form}")
    observed = arguments[4] if len(arguments) > 4 else "1"
    return Found(
        kind,
        name,
        "::".join([*scopes, name]),
        line,
        len(sized),
        int(observed) if observed.isdigit() else None,
    )


def _arguments(code: str, start: int) -> list[str]:
    """Split the template arguments that begin at ``start``."""
    parts, depth = [""], 1
    for letter in code[start:]:
        depth += {"<": 1, "(": 1, ">": -1, ")": -1}.get(letter, 0)
        if depth == 0:
            break
        if letter == "," and depth == 1:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def generate(models: Sequence[Found], name: str, prefix: str, states: Sequence[int]) -> str:
    """Write the file that adds the models of the header ``name`` to the catalogues."""
    own = [f"{model.qualified}<Scalar>" for model in models if model.kind == "process"]
    sizes = [str(n) for n in states] + [f"{process}::kStates" for process in own]
    lines = ['#include "desk/library.hpp"', f'#include "{name}"', "", "namespace {"]
    lines += ["template <class Scalar>", "void add(auvest::desk::Library<Scalar>& library) {"]
    for model in models:
        lines.append(f'#line {model.line} "{name}"')
        if model.sizes == 0:
            type_ = f"{model.qualified}<Scalar>"
            lines.append(f'library.template {model.kind}<{type_}>("{model.name}");')
            continue
        for n in sizes or [str(n) for n in _STATES]:
            least = 1 if model.observed is None else model.observed
            type_ = f"{model.qualified}<Scalar, {n}>"
            lines.append(
                f"if constexpr (auvest::desk::suits<Scalar>({n}, {least})) "
                f'library.template sensor<{type_}>("{model.name}");'
            )
            lines.append(f'#line {model.line} "{name}"')
    lines += ['#line 1 "load_models"', "}", "}", f'AUVEST_LIBRARY("{prefix}", add)', ""]
    return "\n".join(lines)


def sources_of(header: Path) -> dict[Path, str]:
    """Read the header and those that it includes from beside it."""
    sources: dict[Path, str] = {}
    waiting = [header]
    while waiting:
        path = waiting.pop()
        if path in sources:
            continue
        sources[path] = path.read_text(encoding="utf-8", errors="replace")
        for name in _INCLUDE.findall(sources[path]):
            beside = Path(os.path.normpath(path.parent / name))
            if beside.is_file():
                waiting.append(beside)
    return sources


def digest_of(sources: dict[Path, str], header: Path) -> str:
    """Name the contents of a header and of what it includes, wherever they lie."""
    parts = [f"{os.path.relpath(path, header.parent)}\0{text}" for path, text in sources.items()]
    return _digest(*parts)


def compiled(header: Path, sources: dict[Path, str], code: str) -> Path:
    """Give the library of this generated code: the one that is kept, or a new one.

    Raises
    ------
    ModelError
        If there is no compiler, or it refuses the header.
    """
    compiler, version = find_compiler()
    folders = include_folders()
    key = _digest(digest_of(sources, header), code, version, *_FLAGS, _shipped(folders))
    cache = cache_folder()
    library = cache / f"{key}.so"
    if library.is_file():
        return library
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache) as folder:
        source, made = Path(folder) / "models.cpp", Path(folder) / "models.so"
        source.write_text(code)
        includes = [f"-I{header.parent}", *(f"-isystem{folder}" for folder in folders)]
        command = [*compiler, *_FLAGS, *includes, str(source), "-o", str(made)]
        environment = {**os.environ, "LC_ALL": "C"}
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        if done.returncode != 0:
            log = cache / f"{key}.txt"
            log.write_text(f"{shlex.join(command)}\n\n{done.stdout}{done.stderr}")
            raise ModelError(explain(done.stderr, header, sources, log))
        made.replace(library)  # whole or not at all, whoever else does the same
    return library


def find_compiler() -> tuple[list[str], str]:
    """Find ``$CXX``, g++ or clang++; give its command and its version.

    Raises
    ------
    ModelError
        If there is none.
    """
    named = os.environ.get("CXX")
    for command in [shlex.split(named)] if named else [["g++"], ["clang++"], ["c++"]]:
        if shutil.which(command[0]) is None:
            continue
        done = subprocess.run([*command, "--version"], capture_output=True, text=True)
        if done.returncode == 0:
            return command, f"{shlex.join(command)} {done.stdout}"
    missing = f"CXX names {named!r}, which is not there" if named else "there is none in PATH"
    raise ModelError(
        f"load_models needs a C++ compiler, and {missing}: install g++ (Debian, Ubuntu: apt "
        "install g++; Fedora: dnf install gcc-c++) or clang++, or set CXX"
    )


def cache_folder() -> Path:
    """Give the folder of compiled libraries."""
    own = os.environ.get("AUVEST_CACHE")
    if own:
        return Path(own).resolve()
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").resolve() / "auvest"


def _shipped(folders: Sequence[Path]) -> str:
    """Name the contents of auvest's headers and the version of Eigen."""
    parts = []
    for folder in folders:
        for name in ("auvest", "desk"):
            for path in sorted((folder / name).rglob("*.hpp")):
                parts += [str(path.relative_to(folder)), path.read_text()]
        macros = folder / "Eigen" / "src" / "Core" / "util" / "Macros.h"
        if macros.is_file():
            parts.append(macros.read_text())
    return _digest(*parts)


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


# ---- What the compiler says --------------------------------------------------------------------

_PLACE = re.compile(r"^(?P<file>[^\s:][^:\n]*):(?P<line>\d+)(?::\d+)?:\s+(?P<rest>.*)$")
_ERROR = re.compile(r"^(?:fatal )?error: (?P<text>.*)$")
_WORDS = re.compile(r"((?:\w+\([^)]*\) of )?your model .*?)\"?$")


@dataclass
class _Error:
    text: str
    places: list[tuple[str, int]]


def explain(output: str, header: Path, sources: dict[Path, str], log: Path) -> str:
    """Cut the compiler's output to what concerns the user's files: one screen."""
    lines = {str(path): text.splitlines() for path, text in sources.items()}
    lines[header.name] = lines[str(header)]  # as #line has it
    incomplete: dict[tuple[str, int, str], str] = {}
    wrong: dict[tuple[str, int, str], str] = {}
    others = []
    for error in _errors(output):
        own = next((place for place in error.places if place[0] in lines), None)
        said = _WORDS.search(error.text)
        if own is None:
            others.append(error)
        elif said:
            incomplete[(*own, said[1])] = said[1]
        else:  # once for both precisions
            wrong.setdefault((*own, re.sub(r"\b(float|double)\b", "", error.text)), error.text)
    message = []
    for (file, line, _), text in (incomplete or wrong).items():  # the first explain the others
        source = lines[file][line - 1].strip() if line <= len(lines[file]) else ""
        message += [f"{Path(file).name}:{line}: {text}", f"    {source}"]
    if not message:
        message = [f"{header.name} does not compile"]
        message += [f"{error.places[0][0]}: {error.text}" for error in others]
        if not others:
            message += output.splitlines()
    message = [line[:200] for line in message]
    if len(message) > _SCREEN:
        rest = f"... {len(message) - _SCREEN} lines more"
        message = [*message[:_SCREEN], rest]
    return "\n".join([*message, f"All that the compiler said: {log}"])


def _errors(output: str) -> list[_Error]:
    """Give each error with the places that it names, its own first.

    gcc says before an error in which instantiations it happened, clang behind it; both begin with
    the innermost.
    """
    errors: list[_Error] = []
    before: list[tuple[str, int]] = []
    for line in output.splitlines():
        match = _PLACE.match(line)
        if match is None:
            continue
        place = (os.path.normpath(match["file"]), int(match["line"]))
        error = _ERROR.match(match["rest"])
        if error:
            errors.append(_Error(error["text"], [place, *before]))
            before = []
        elif "required from" in match["rest"]:
            before.append(place)
        elif "in instantiation of" in match["rest"] and errors:
            errors[-1].places.append(place)
    return errors
