"""Examples are tests: every code block of the READMEs and docs/ runs as it stands there.

- ```python blocks run in a new interpreter;
- ```cpp blocks with an `int main` are compiled as C++11 with warnings as errors, and run;
- ```console blocks: of each line `$ auvest ...` the CLI must accept the arguments.

The blocks of docs/tutorials build on each other: the documentation site runs them
(docs/site/executed.py), and ends where one fails.

`<!-- no-test -->` on the line before a python or cpp block says that it is a fragment.
"""

import re
import shlex
import sys
from contextlib import suppress

import pytest
import typer
from conftest import ROOT

from auvest.cli import app

BLOCK = re.compile(
    r"(?P<no_test><!-- no-test -->\n)?^```(?P<language>\w+)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


def blocks(language):
    """Return the blocks of one language as pytest parameters named file:line."""
    readmes = [ROOT / "README.md", ROOT / "firmware" / "README.md"]
    pages = sorted((ROOT / "docs").rglob("*.md"))
    pages = [page for page in pages if page.parent != ROOT / "docs" / "tutorials"]
    for page in [*readmes, *pages]:
        text = page.read_text()
        for match in BLOCK.finditer(text):
            if match["language"] == language and not match["no_test"]:
                line = text.count("\n", 0, match.start("code")) + 1
                yield pytest.param(match["code"], id=f"{page.relative_to(ROOT)}:{line}")


def commands():
    """Return each `$ auvest ...` line of the console blocks as a pytest parameter."""
    for block in blocks("console"):
        code = block.values[0].replace("\\\n", " ")
        for line in re.findall(r"^\$ (auvest .*)$", code, re.MULTILINE):
            words = shlex.split(line, comments=True)
            for end, word in enumerate(words):  # what the shell would do with the rest
                if word in ("|", ">", ">>", "2>", "&&", ";"):
                    words = words[:end]
                    break
            yield pytest.param(words[1:], id=f"{block.id} {line}")


@pytest.mark.parametrize("code", list(blocks("python")))
def test_python_block(code, run, tmp_path):
    (tmp_path / "block.py").write_text(code)
    run(sys.executable, "block.py")


@pytest.mark.parametrize("code", [b for b in blocks("cpp") if "int main" in b.values[0]])
def test_cpp_block(code, run_cpp):
    run_cpp(code)


@pytest.mark.parametrize("arguments", list(commands()))
def test_console_line(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in arguments:
        if name.endswith((".elf", ".hpp")):  # what the lines before would have made
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
    command = typer.main.get_command(app)
    while arguments and arguments[0] in getattr(command, "commands", {}):
        command = command.commands[arguments[0]]
        arguments = arguments[1:]
    with suppress(typer.Exit):  # of --help and --version
        command.make_context("auvest", arguments)  # parses, runs nothing
