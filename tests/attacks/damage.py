"""Damage to text files: what editors, spreadsheets, half written disks and users do to them."""

from __future__ import annotations

import random
from collections.abc import Mapping

#: In the place of a cell.
CELLS = (
    b"nan", b"inf", b"-inf", b"1e308", b"1e400", b"-1e308", b"9223372036854775808", b"9" * 500,
    b"0x10", b"1_000", b"", b" ", b"\x00", b"1\x00", b"<script>alert(1)</script>", b"=1+1",
    b'"1"', b"'1'", b"1;2", b"1,2", b"\xff\xfe", "１２".encode(), b"1e-400", b"-0", b"1.5.2",
    b"../../x", b"5e-324", b"1000000", b"90", b"360", b"1e6", b"-1", b"0.5", b"1e5", b"%s%n",
    b"True", b"None", b"1e", b"+1", b"1.0f", b"\t1", b"1\r", b"1.7", b"x", b"#", b"0", b"65.535",
)  # fmt: skip
KINDS = (
    *("cell",) * 6, "cut", "line out", "line in", "exchange", "bit", "insert", "crlf", "bom",
    "utf-16", "cr", "longer line", "column", "file out", "column of one", "header", "head only",
    "long line", "bytes", "blank end", "semicolons",
)  # fmt: skip

#: Kind, and three numbers that say where and what.
Step = tuple[str, str, int, int, int]


def steps(rng: random.Random, names: list[str]) -> tuple[Step, ...]:
    return tuple(
        (rng.choice(KINDS), rng.choice(names), *(rng.randrange(2**20) for _ in range(3)))
        for _ in range(rng.choice((1, 1, 1, 2, 3)))
    )


def damaged(files: Mapping[str, bytes], wanted: tuple[Step, ...]) -> dict[str, bytes]:
    """The files after these steps; a step on a file that is gone does nothing."""
    left = dict(files)
    for kind, name, a, b, c in wanted:
        if name not in left:
            continue
        if kind == "file out":
            del left[name]
        else:
            left[name] = one(left[name], kind, a, b, c)
    return left


def one(text: bytes, kind: str, a: int, b: int, c: int) -> bytes:
    lines = text.split(b"\n")
    i, j = a % len(lines), b % len(lines)
    cells = lines[i].split(b",")
    at = a % (len(text) + 1)
    if kind == "cell":
        cells[b % len(cells)] = CELLS[c % len(CELLS)]
        lines[i] = b",".join(cells)
    elif kind == "line out":
        del lines[i]
    elif kind == "line in":
        lines.insert(i, lines[j])
    elif kind == "exchange":
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == "longer line":
        lines[i] += b",1"
    elif kind == "column":
        lines = [line + b",0" if line else line for line in lines]
    elif kind == "column of one":
        rows = [line.split(b",") for line in lines]
        for row in rows[1:-1]:
            row[b % len(row)] = CELLS[c % len(CELLS)]
        lines = [b",".join(row) for row in rows]
    elif kind == "header":
        names = lines[0].split(b",")
        random.Random(c).shuffle(names)
        lines[0] = b",".join(names)
    elif kind == "head only":
        lines = [lines[0], b""]
    elif kind == "long line":
        lines[i] = b"9" * 20_000
    elif kind == "blank end":
        lines += [b""] * (1 + b % 3)
    else:
        return whole(text, kind, at, b, c)
    return b"\n".join(lines)


def whole(text: bytes, kind: str, at: int, b: int, c: int) -> bytes:
    """Damage that knows no lines."""
    if kind == "cut":
        return text[:at]
    if kind == "bit" and text:
        raw = bytearray(text)
        raw[at % len(raw)] ^= 1 << b % 8
        return bytes(raw)
    if kind == "insert":
        return text[:at] + CELLS[c % len(CELLS)] + text[at:]
    if kind == "bytes":
        return random.Random(c).randbytes(b % 200)
    coded = {
        "crlf": lambda: text.replace(b"\n", b"\r\n"),
        "cr": lambda: text.replace(b"\n", b"\r"),
        "bom": lambda: b"\xef\xbb\xbf" + text,
        "utf-16": lambda: text.decode("latin-1").encode("utf-16"),
        "semicolons": lambda: text.replace(b",", b";").replace(b".", b","),
    }
    return coded[kind]() if kind in coded else text
