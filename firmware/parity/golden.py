"""Writes the golden values of ``auvest::self_test()`` into its header.

``python -m firmware.parity.golden`` after a change of the arithmetic that is meant; with
``--check`` it only tells whether the header is up to date. The values come from the headers as g++
compiles them here; that every target finds the same is what ``tests/parity`` shows.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from firmware.parity.targets import INCLUDES, ROOT

HEADER = ROOT / "cpp/include/auvest/self_test.hpp"


def golden_values() -> tuple[str, list[list[str]]]:
    """Compute the hash of the functions and those of each step of the trace, in hexadecimal."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "golden"
        source = ROOT / "firmware/parity/golden.cpp"
        flags = ["-std=c++11", "-O1", "-ffp-contract=off"]
        subprocess.run(["g++", *flags, *INCLUDES, str(source), "-o", str(program)], check=True)
        printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    functions, *steps = printed.splitlines()
    return functions, [step.split() for step in steps]


def with_values(header: str, functions: str, steps: list[list[str]]) -> str:
    """Put the values into the text of the header."""
    value = f"kGoldenMath = 0x{functions}u;"
    header = replace_once(r"kGoldenMath = 0x[0-9a-f]{8}u;", value, header)
    rows = "".join(f"        {{{', '.join(f'0x{h}u' for h in step)}}},\n" for step in steps)
    table = r"(kGolden\[kGoldenSteps\].*\{\n)[^;]*?(    \};)"
    return replace_once(table, rf"\g<1>{rows}\g<2>", header)


def replace_once(pattern: str, replacement: str, text: str) -> str:
    """Replace the one match of a pattern."""
    result, count = re.subn(pattern, replacement, text)
    if count != 1:
        raise RuntimeError(f"{HEADER.name} has {count} places like {pattern!r}, expected one")
    return result


def main() -> int:
    """Rewrite the header, or check it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing; exit 1 if it would")
    check = parser.parse_args().check
    header = HEADER.read_text(encoding="utf-8")
    wanted = with_values(header, *golden_values())
    if wanted == header:
        print(f"{HEADER.name} is up to date", file=sys.stderr)
        return 0
    if check:
        print(f"{HEADER.name} is out of date: python -m firmware.parity.golden", file=sys.stderr)
        return 1
    HEADER.write_text(wanted, encoding="utf-8")
    print(f"{HEADER.name} rewritten", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
