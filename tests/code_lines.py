"""Counts lines of code, without comments, docstrings and blank lines, in each folder.

    python -m tests.code_lines                          # the working tree
    python -m tests.code_lines --base main              # and what has changed since that revision
    python -m tests.code_lines --base main python/auvest/commands python/auvest/reproduce

A line counts if it holds a token of code. In a string of several lines each line that is not blank
counts, unless the string is a statement by itself: a docstring. Files of other kinds (Markdown,
TOML, assembler) do not count.

With --base, what existed before is compared with what became of it: ``code_lines.toml`` names what
is a new capability, which is counted apart, and where files of before have gone. A second table
adds the folders up by their roles.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import subprocess
import sys
import tarfile
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
RULES = Path(__file__).with_suffix(".toml")
FOLDERS = ("cpp", "firmware", "python", "tests")
PYTHON = (".py", ".pyi")
CXX = (".hpp", ".cpp", ".h", ".ino")

_LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}

#: What must be skipped as a whole, the first that matches at a place: a comment in a string is
#: none, nor is a quote in a comment; an apostrophe between digits begins no character.
_CXX = re.compile(
    r"""
    (?P<comment> //(?:\\\n|[^\n])* | /\*.*?\*/ )
    | R"(?P<mark>[^\s()\\]{0,16})\(.*?\)(?P=mark)"
    | "(?:\\.|[^"\\\n])*"
    | (?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])*'
    """,
    re.VERBOSE | re.DOTALL,
)


@dataclass(frozen=True)
class Rules:
    """What code_lines.toml says; all names are patterns whose ``*`` matches any characters.

    Attributes
    ----------
    new : mapping of str to str
        Why a file is a new capability, or a definition in one: ``path::Class.name`` in Python,
        ``path::name`` in C++: all functions or classes of that name.
    moved : mapping of str to str
        Where a file of before belongs now: a folder.
    roles : mapping of str to sequence of str
        Folders and files of each role; the first role that matches counts.
    """

    new: Mapping[str, str]
    moved: Mapping[str, str]
    roles: Mapping[str, Sequence[str]]

    @classmethod
    def read(cls, path: Path) -> Rules:
        """Read them from a file."""
        rules = tomllib.loads(path.read_text(encoding="utf-8"))
        return cls(rules["new"], rules["moved"], rules["roles"])

    def folder(self, name: str) -> str:
        """Say in which folder a file is counted."""
        for pattern, folder in self.moved.items():
            if fnmatchcase(name, pattern):
                return folder
        return str(PurePosixPath(name).parent)

    def role(self, folder: str) -> str:
        """Say which role a folder has."""
        for role, patterns in self.roles.items():
            if any(fnmatchcase(folder, pattern) for pattern in patterns):
                return role
        return "rest"

    def split(self, name: str, source: str) -> tuple[int, int]:
        """Count the lines of a file: what existed before, and what is new."""
        lines = count(name, source) or 0
        new = 0
        for pattern in self.new:
            path, _, definition = pattern.partition("::")
            if fnmatchcase(name, path):
                new += definition_lines(path, source, definition) if definition else lines
        return lines - new, new


def python_lines(source: str) -> int:
    """Count the lines of code of a Python module."""
    return len(_python_code(source))


def definition_lines(path: str, source: str, name: str) -> int:
    """Count the lines of code of a definition in a file.

    Raises
    ------
    LookupError
        If there is none of that name.
    """
    find = _python_definition if path.endswith(PYTHON) else _cxx_definitions
    lines = find(source, name)
    if not lines:
        raise LookupError(f"{path}: there is no {name}")
    return len(lines)


def _python_definition(source: str, name: str) -> set[int]:
    body: list[ast.stmt] = ast.parse(source).body
    lines = range(0)
    for part in name.split("."):
        found = [node for node in body if getattr(node, "name", None) == part]
        if not found:
            return set()
        node = found[0]
        assert isinstance(node, ast.FunctionDef | ast.ClassDef)
        first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        lines = range(first, (node.end_lineno or first) + 1)
        body = node.body
    return _python_code(source) & set(lines)


def _cxx_definitions(source: str, name: str) -> set[int]:
    """Find definitions: from the end of what stands before to the bracket that closes the body."""
    text = _without_comments(source)
    lines: set[int] = set()
    for found in re.finditer(rf"\b{name}\b(?=\(| (?::|\{{))[^;{{]*\{{", text):
        start = max(text.rfind(end, 0, found.start()) for end in ";{}:")
        stop, depth = found.end(), 1
        while depth:
            depth += {"{": 1, "}": -1}.get(text[stop], 0)
            stop += 1
        first = text.count("\n", 0, start) + 1
        for number, line in enumerate(text[start + 1 : stop].split("\n")):
            if line.strip():
                lines.add(first + number)
    return lines


def _python_code(source: str) -> set[int]:
    text = source.split("\n")
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _LAYOUT:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            code.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return {number for number in code if text[number - 1].strip()}


def cxx_lines(source: str) -> int:
    """Count the lines of code of a C++ file."""
    return sum(bool(line.strip()) for line in _without_comments(source).split("\n"))


def _without_comments(source: str) -> str:
    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", found[0]) if found["comment"] else found[0]

    return _CXX.sub(blank, source)


def count(name: str, source: str) -> int | None:
    """Count the lines of a file by its name; None if it is of another kind."""
    suffix = PurePosixPath(name).suffix
    if suffix in PYTHON:
        return python_lines(source)
    return cxx_lines(source) if suffix in CXX else None


def working_tree(root: Path) -> Iterator[tuple[str, str]]:
    """Give name and text of each file that git has or would take."""
    listed = _git(root, "ls-files", "--cached", "--others", "--exclude-standard", "-z")
    for name in sorted(set(listed.decode().split("\0"))):
        path = root / name
        if name and path.is_file() and path.suffix in PYTHON + CXX:
            yield name, path.read_text(encoding="utf-8")


def revision(root: Path, name: str) -> Iterator[tuple[str, str]]:
    """Give name and text of each file of a revision."""
    with tarfile.open(fileobj=io.BytesIO(_git(root, "archive", name))) as archive:
        for member in archive.getmembers():
            if member.isfile() and PurePosixPath(member.name).suffix in PYTHON + CXX:
                file = archive.extractfile(member)
                assert file is not None
                yield member.name, file.read().decode()


def by_folder(
    files: Iterator[tuple[str, str]], below: Sequence[str], rules: Rules
) -> tuple[Counter[str], Counter[str]]:
    """Add up the files of each folder that is one of ``below`` or inside one: the old, the new."""
    old: Counter[str] = Counter()
    new: Counter[str] = Counter()
    for name, source in files:
        if any(name == one or name.startswith(f"{one}/") for one in below):
            folder = rules.folder(name)
            lines = rules.split(name, source)
            old[folder] += lines[0]
            new[folder] += lines[1]
    return old, new


def by_role(lines: Counter[str], rules: Rules) -> Counter[str]:
    """Add up the folders of each role."""
    sums: Counter[str] = Counter()
    for folder, number in lines.items():
        sums[rules.role(folder)] += number
    return sums


def table(head: str, columns: Mapping[str, Counter[str]]) -> str:
    """Lay out the counts, one row per name; with two columns or more the change from 1 to 2."""
    names = sorted(set().union(*columns.values()))
    rows = [(name, [column[name] for column in columns.values()]) for name in names]
    rows.append(("all", [sum(column.values()) for column in columns.values()]))
    width = max(len(name) for name in [head, *names])
    heads = [*columns]
    if len(columns) > 1:
        heads.insert(2, "change")
    text = [f"{head:{width}}" + "".join(f"{one:>9}" for one in heads)]
    for name, numbers in rows:
        cells = [f"{number:9,}" for number in numbers]
        if len(numbers) > 1:
            cells.insert(2, f"{numbers[1] - numbers[0]:+9,}")
        text.append(f"{name:{width}}" + "".join(cells))
    return "\n".join(text)


def _git(root: Path, *arguments: str) -> bytes:
    done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, check=False)
    if done.returncode != 0:
        sys.exit(f"git {arguments[0]}: {done.stderr.decode().strip()}")
    return done.stdout


def main(
    arguments: Sequence[str] | None = None,
    root: Path = ROOT,
    rules: Path = RULES,
) -> None:
    """Print the tables."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", metavar="REV", help="compare with this revision")
    parser.add_argument("folders", nargs="*", help=f"default: {' '.join(FOLDERS)}")
    given = parser.parse_args(arguments)
    below = [folder.rstrip("/") for folder in given.folders] or FOLDERS
    said = Rules.read(rules)
    now, new = by_folder(working_tree(root), below, said)
    if given.base is None:
        print(table("folder", {"lines": now + new}))
        return
    before, _ = by_folder(revision(root, given.base), below, replace(said, new={}))
    columns = {"before": before, "now": now, "new": new}
    print(table("folder", columns))
    print()
    print(table("role", {name: by_role(one, said) for name, one in columns.items()}))


if __name__ == "__main__":
    main()
