"""The counting of code lines: what is a line of code, and the table of two revisions."""

import subprocess

import pytest

from tests import code_lines

PYTHON = '''\
"""A module
of two lines."""

import os  # 1

# a comment
NAME = "no # comment"  # 2
TEXT = """3

4 # in a string"""


def f(
    a,  # 5 (def f), 6
):  # 7
    """Docstring."""
    x = (  # 8
        1
        # a comment between 9 and 10
    )
    return f"{x}"  # 11


class C:  # 12
    """Docstring."""

    y = 1  # 13
    """Docstring of an attribute."""
'''

CXX = """\
// a comment
/* another
   one */
#include <x>  // 1

int a = 1; /* behind */  // 2
/* before */ int b = 2;  // 3
const char* s = "// no comment /*";  // 4
const char* r = R"x(5 /*

6
7 */ )")x";
char quote = '"';  // 8
char slash = '/';  // 9
int thousand = 1'000;  /* 10 isn't
  a character */
// a comment that goes on \\
   on the next line
int c = 3;  // 11
"""


def test_python():
    assert code_lines.python_lines(PYTHON) == 13
    assert code_lines.python_lines("") == 0


def test_cxx():
    assert code_lines.cxx_lines(CXX) == 11
    assert code_lines.cxx_lines("") == 0


def test_only_python_and_cxx_count():
    assert code_lines.count("a/b.hpp", "int a;\n") == 1
    assert code_lines.count("a/b.ino", "int a;\n\n// b\n") == 1
    assert code_lines.count("a/b.pyi", "# b\na: int\n") == 1
    assert code_lines.count("a/b.md", "words\n") is None


@pytest.fixture
def repository(tmp_path):
    def git(*arguments):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *identity, *arguments], cwd=tmp_path, check=True)

    files = {"cpp/a.hpp": "int a;\nint b;\n", "python/x/a.py": "a = 1\n", "python/x/b.md": "c\n"}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / ".gitignore").write_text("ignored.py\n")
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "one")
    (tmp_path / "python/x/a.py").write_text("a = 1\nb = 2\nc = 3\n")
    (tmp_path / "python/x/new.py").write_text("d = 4\n")
    (tmp_path / "python/x/ignored.py").write_text("e = 5\n")
    (tmp_path / "cpp/a.hpp").unlink()
    return tmp_path


def test_table_of_a_working_tree_and_a_revision(repository, capsys):
    code_lines.main(["--base", "HEAD"], repository)
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["folder", "before", "lines", "change"],
        ["cpp", "2", "0", "-2"],
        ["python/x", "1", "4", "+3"],
        ["all", "3", "4", "+1"],
    ]
    code_lines.main(["python/x/a.py"], repository)
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["folder", "lines"],
        ["python/x", "3"],
        ["all", "3"],
    ]


def test_unknown_revision_is_said(repository):
    with pytest.raises(SystemExit, match="nowhere"):
        code_lines.main(["--base", "nowhere"], repository)
