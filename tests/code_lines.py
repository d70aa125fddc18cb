"""Counts lines of code, without comments, docstrings and blank lines, in each folder.

    python -m tests.code_lines                          # the working tree
    python -m tests.code_lines --base main              # and what has changed since that revision
    python -m tests.code_lines --base main python/auvest/commands python/auvest/reproduce

A line counts if it holds a token of code. In a string of several lines each line that is not blank
counts, unless the string is a statement by itself: a docstring. Files of other kinds (Markdown,
TOML, assembler) do not count.
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
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath

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


def python_lines(source: str) -> int:
    """Count the lines of code of a Python module."""
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
    return sum(bool(text[number - 1].strip()) for number in code)


def cxx_lines(source: str) -> int:
    """Count the lines of code of a C++ file."""

    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", found[0]) if found["comment"] else found[0]

    return sum(bool(line.strip()) for line in _CXX.sub(blank, source).split("\n"))


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


def by_folder(files: Iterator[tuple[str, str]], below: Sequence[str]) -> Counter[str]:
    """Add up the files of each folder that is one of ``below`` or inside one."""
    lines: Counter[str] = Counter()
    for name, source in files:
        if any(name == one or name.startswith(f"{one}/") for one in below):
            lines[str(PurePosixPath(name).parent)] += count(name, source) or 0
    return lines


def table(now: Counter[str], before: Counter[str] | None = None) -> str:
    """Lay out the counts, with those before and the differences if they are given."""
    names = sorted({*now, *(before or ())})
    columns = [now] if before is None else [before, now]
    rows = [(name, *(column[name] for column in columns)) for name in names]
    rows.append(("all", *(sum(column.values()) for column in columns)))
    heads = ["lines"] if before is None else ["before", "lines", "change"]
    width = max(len(name) for name, *_ in rows)
    text = [f"{'folder':{width}}" + "".join(f"{head:>9}" for head in heads)]
    for name, *numbers in rows:
        cells = "".join(f"{number:9,}" for number in numbers)
        text.append(f"{name:{width}}{cells}")
        if before is not None:
            text[-1] += f"{numbers[1] - numbers[0]:+9,}"
    return "\n".join(text)


def _git(root: Path, *arguments: str) -> bytes:
    done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, check=False)
    if done.returncode != 0:
        sys.exit(f"git {arguments[0]}: {done.stderr.decode().strip()}")
    return done.stdout


def main(arguments: Sequence[str] | None = None, root: Path = Path(__file__).parents[1]) -> None:
    """Print the table."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", metavar="REV", help="compare with this revision")
    parser.add_argument("folders", nargs="*", help=f"default: {' '.join(FOLDERS)}")
    given = parser.parse_args(arguments)
    below = [folder.rstrip("/") for folder in given.folders] or FOLDERS
    before = by_folder(revision(root, given.base), below) if given.base else None
    print(table(by_folder(working_tree(root), below), before))


if __name__ == "__main__":
    main()
