"""Each equation of the papers stands where it is computed: tests/equations.toml against the code.

The labels `[SLATF 57]` are the same in the list, in the code and in docs/algorithms.
"""

import re
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
EQUATIONS = tomllib.loads((ROOT / "tests/equations.toml").read_text())
COMPUTED = {label: entry["code"] for label, entry in EQUATIONS.items() if "code" in entry}
LAST_NUMBER = {"AUKF": 12, "SLATF": 65, "MEKF": 20}  # of each paper
# Where this project derives its own.
OWN = {
    "UKF": "ukf.md", "HULL": "vehicle.md", "GUIDE": "guidance.md", "CONTROL": "guidance.md",
    "SMO": "smoother.md",
}  # fmt: skip

# Also what is no label but was meant as one: "[SLATF 57, 58]", or one that a line break cuts.
LABEL = re.compile(r"\[(?:AUKF|SLATF|MEKF|UKF|HULL|GUIDE|CONTROL|SMO)\b(?:[^\]\n]*\])?")
# Those that a // comment begins with: none where it is ///.
OPENING = re.compile(rf"\s*(?:{LABEL.pattern}\s*)*")
OLD_FORM = re.compile(r"\bEqs?\.|\(\d+\)-\(\d+\)")
# Lines of code that compute nothing.
FRAME = re.compile(
    r"\s*(?:#|template\b|namespace\b|struct\b|class\b|enum\b|(?:public|private|protected):|[})])"
    r"|(?!.*\b(?:for|if|else|while)\b)(?!.*\[[&=]).*\{\s*$"  # the head of a function
)


def files(folder: str, *suffixes: str) -> list[Path]:
    return sorted(p for p in (ROOT / folder).rglob("*.*") if p.suffix in suffixes)


def labelled_statements(text: str) -> set[str]:
    """Return the labels that open a comment beside a statement or directly above it.

    Others are mentions: within a sentence, or in the documentation of a function, type or member.
    """
    labelled: set[str] = set()
    above: set[str] = set()
    for line in text.splitlines():
        code, slashes, comment = line.partition("//")
        labels = set(LABEL.findall(OPENING.match(comment)[0]))
        if code.strip():
            labelled |= set() if FRAME.match(code) else above | labels
            above = set()
        else:
            above = above | labels if slashes else set()
    return labelled


def test_statements_are_told_from_mentions():
    text = """
// [UKF D1]: a file is no statement
#pragma once

/// [UKF D2]: nor is documentation
using Values = Value[3];
// [UKF N1]: nor a template
template <class Value>
// [UKF N2]: nor a function
Value f(Value x) const {
  // [UKF D3]: differs from [UKF B1]
  // in two lines
  const Value y = x * x;
  // [UKF D4]: a blank line below

  add(x, y);  // [UKF R1] [UKF R2]
}
// [UKF S2]: a loop is
for (int i = 0; i < 3; ++i) {
Value z;  ///< [UKF S1]
"""
    computed = {"[UKF D3]", "[UKF R1]", "[UKF R2]", "[UKF S2]"}
    assert labelled_statements(text) == computed


def test_the_list_has_every_number():
    papers = [f"[{paper} {n + 1}]" for paper, last in LAST_NUMBER.items() for n in range(last)]
    own = [label for label in EQUATIONS if label[1:].split()[0] in OWN]
    assert len(papers) == 97
    assert list(EQUATIONS) == papers + own


def test_an_entry_names_a_place_or_a_reason():
    for label, entry in EQUATIONS.items():
        assert set(entry) in ({"what", "code"}, {"what", "none"}), label
        assert all(entry.values()), label
        mentioned = LABEL.findall(" ".join(entry.values()))
        assert set(mentioned) <= set(EQUATIONS), label


@pytest.mark.parametrize("label", COMPUTED)
def test_an_equation_stands_where_it_is_computed(label):
    place = ROOT / COMPUTED[label]
    headers = [place] if place.is_file() else files(COMPUTED[label], ".hpp")
    assert headers, f"{COMPUTED[label]}: no such place"
    assert any(label in labelled_statements(header.read_text()) for header in headers)


def test_no_statement_has_the_label_of_an_equation_that_is_not_computed():
    for header in files("cpp/include", ".hpp"):
        assert labelled_statements(header.read_text()) <= set(COMPUTED), header


def test_no_other_label_is_in_the_code_or_the_documents():
    suffixes = (".hpp", ".cpp", ".h", ".S", ".ino", ".py", ".md")
    for folder in ("cpp", "firmware", "python", "docs", "tests"):
        for file in files(folder, *suffixes):
            if file != Path(__file__):
                assert set(LABEL.findall(file.read_text())) <= set(EQUATIONS), file


@pytest.mark.parametrize(("source", "page"), OWN.items())
def test_the_own_labels_are_those_of_the_derivation(source, page):
    derived = LABEL.findall((ROOT / "docs/algorithms" / page).read_text())
    own = {label for label in EQUATIONS if label.startswith(f"[{source} ")}
    assert own == {label for label in derived if label.startswith(f"[{source} ")}


def test_equations_are_named_by_their_labels_only():
    for file in [*files("cpp/include", ".hpp"), *files("docs/algorithms", ".md")]:
        assert not OLD_FORM.findall(file.read_text()), file
