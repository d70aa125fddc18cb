"""Run the code of one tutorial: blocks come as JSON, what they print and draw goes back as JSON.

All Python blocks share one namespace, as the cells of a notebook do; a value that the last line of
a block leaves is printed. Console blocks are run line by line by the shell. Whatever fails ends it.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import re
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")
import matplotlib.pyplot as plt

COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)$", re.MULTILINE)


def run_python(code: str, line: int, page: str, names: dict[str, Any]) -> str:
    """Return what a block prints, and the value of its last line if that is an expression."""
    tree = ast.parse("\n" * (line - 1) + code, page)
    shown = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, page, "exec"), names)
        if shown is not None:
            value = eval(compile(ast.Expression(shown.value), page, "eval"), names)
            if value is not None and not type(value).__module__.startswith("matplotlib"):
                print(value)
    return printed.getvalue()


def run_console(code: str) -> str:
    """Return the block as a terminal would show it: each command with its output."""
    shown = []
    for command in COMMAND.findall(code):
        done = subprocess.run(
            ["bash", "-c", command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        shown.append(f"$ {command}\n{done.stdout}")
        if done.returncode != 0:
            raise RuntimeError(f"exit code {done.returncode}:\n{shown[-1]}")
    return "".join(shown)


def pictures() -> list[str]:
    """Return what was drawn since, as PNG in base64."""
    drawn = []
    for number in plt.get_fignums():
        image = io.BytesIO()
        plt.figure(number).savefig(image, format="png", dpi=144, bbox_inches="tight")
        drawn.append(base64.b64encode(image.getvalue()).decode())
    plt.close("all")
    return drawn


def line_of(error: Exception, page: str) -> int | None:
    """Return the line of the page at which its code failed, if it was the code."""
    if isinstance(error, SyntaxError) and error.filename == page:
        return error.lineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__)
             if frame.filename == page]  # fmt: skip
    return lines[-1] if lines else None


def main() -> None:
    """Read the page's blocks from standard input and write what became of them."""
    task = json.load(sys.stdin)
    names: dict[str, Any] = {"__name__": "__main__"}
    results = []
    for block in task["blocks"]:
        result: dict[str, Any] = {"text": "", "pictures": []}
        try:
            if block["file"]:
                path = Path(block["file"])
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block["code"], encoding="utf-8")
            elif block["language"] == "python":
                result["text"] = run_python(block["code"], block["line"], task["page"], names)
                result["pictures"] = pictures()
            else:
                result["text"] = run_console(block["code"])
        except Exception as error:
            line = line_of(error, task["page"]) or block["line"]
            sys.exit(f"{task['page']}:{line}: {type(error).__name__}: {error}")
        results.append(result)
    json.dump(results, sys.__stdout__)


if __name__ == "__main__":
    main()
