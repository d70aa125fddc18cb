"""The counting of code lines: what is a line of code, and the tables of two revisions."""

import subprocess
from fnmatch import fnmatchcase

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


RULES = """
[new]
"python/x/new.py" = "a capability"
"python/x/a.py::C.method" = "a method"

[moved]
"python/old/*.py" = "python/x"

[roles]
filters = ["python/*"]
"""


def test_a_definition_counts_with_its_decorators_and_without_its_docstring():
    source = 'a = 1\n\n\n@b\ndef f(\n    x,\n):\n    """Doc."""\n\n    return x\n\n\nc = 2\n'
    assert code_lines.definition_lines("a.py", source, "f") == 5
    inside = "class C:\n    a = 1\n\n    def f(self):\n        return 1\n\n    def g(self): ...\n"
    assert code_lines.definition_lines("a.py", inside, "C.f") == 2
    assert code_lines.definition_lines("a.py", inside, "C") == 5
    with pytest.raises(LookupError, match=r"C\.h"):
        code_lines.definition_lines("a.py", inside, "C.h")


CLASSES = """\
class A : public B {  // 1
 public:
  // about f
  template <class T>  // 3
  void f(T x) const {  // 4

    if (x) { g(x); }  // 5
  }  // 6
  void f();
  int h() { return f(1) + f(2); }
};

struct C {  // 1
  int f(
      int a  // a comment with { in it
  ) { return a; }
};
"""


def test_definitions_in_cxx_count_from_their_template_to_their_last_bracket():
    assert code_lines.definition_lines("a.hpp", CLASSES, "f") == 4 + 3
    assert code_lines.definition_lines("a.hpp", CLASSES, "h") == 1
    assert code_lines.definition_lines("a.hpp", CLASSES, "C") == 5
    with pytest.raises(LookupError, match=r"a\.hpp: there is no g"):
        code_lines.definition_lines("a.hpp", CLASSES, "g")


@pytest.fixture
def repository(tmp_path):
    def git(*arguments):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *identity, *arguments], cwd=tmp_path, check=True)

    def write(files):
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).write_text(text)

    write(
        {
            "cpp/a.hpp": "int a;\nint b;\n",
            "python/old/a.py": "a = 1\n",
            "python/old/b.py": "b = 1\nc = 1\n",
            "python/x/a.py": "class C: ...\n",  # has no method yet
            "python/x/b.md": "c\n",
            ".gitignore": "ignored.py\n",
        }
    )
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "one")
    for gone in ("cpp/a.hpp", "python/old/a.py", "python/old/b.py"):
        (tmp_path / gone).unlink()
    write(
        {
            "python/x/a.py": "class C:\n    a = 1\n\n    def method(self):\n        return 2\n",
            "python/x/new.py": "d = 4\n",
            "python/x/ignored.py": "e = 5\n",
        }
    )
    return tmp_path


@pytest.fixture
def rules(tmp_path):
    path = tmp_path / "rules.toml"
    path.write_text(RULES)
    return path


def test_what_existed_before_is_compared_where_it_is_now(repository, rules, capsys):
    code_lines.main(["--base", "HEAD"], repository, rules)
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["folder", "before", "now", "change", "new"],
        ["cpp", "2", "0", "-2", "0"],
        ["python/x", "4", "2", "-2", "3"],  # one line of new.py and two of the method are new
        ["all", "6", "2", "-4", "3"],
        [],
        ["role", "before", "now", "change", "new"],
        ["filters", "4", "2", "-2", "3"],
        ["rest", "2", "0", "-2", "0"],
        ["all", "6", "2", "-4", "3"],
    ]


def test_without_a_base_all_lines_count(repository, rules, capsys):
    code_lines.main(["python/x/a.py"], repository, rules)
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["folder", "lines"],
        ["python/x", "4"],
        ["all", "4"],
    ]


def test_the_rules_name_files_and_definitions_that_are_there():
    files = dict(code_lines.working_tree(code_lines.ROOT))
    rules = code_lines.Rules.read(code_lines.RULES)
    for pattern in rules.new:
        path, _, definition = pattern.partition("::")
        found = [name for name in files if fnmatchcase(name, path)]
        assert found, pattern
        if definition:
            assert code_lines.definition_lines(found[0], files[found[0]], definition) > 0, pattern
    folders = {rules.folder(name) for name in files}
    for role, patterns in rules.roles.items():
        for pattern in patterns:
            assert any(fnmatchcase(folder, pattern) for folder in folders), (role, pattern)
    assert {*rules.moved.values()} <= folders


def test_unknown_revision_is_said(repository, rules):
    with pytest.raises(SystemExit, match="nowhere"):
        code_lines.main(["--base", "nowhere"], repository, rules)
