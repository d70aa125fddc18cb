"""Tutorials are run when the site is built, and shown with what they print and draw.

The blocks of a page are those of its Markdown, which GitHub shows as well:

- ```python blocks run one after the other in one interpreter, in an empty folder;
- ```console blocks: each line `$ ...` is run by the shell, and its output stands below it;
- `<!-- file: NAME -->` on the line before a block: its text goes into that file;
- `<!-- picture: NAME -->`: a picture that a command has left is shown there;
- `<!-- no-run: WHY -->`: the block is only shown, and a test runs it.

`$AUVEST_SOURCE` is the folder of the repository. Other languages are only shown. A block that fails
ends the build, with page and line.
"""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)
FOLDER = "docs/tutorials/"
FENCE = re.compile(
    r"(?:^<!-- (?P<mark>file|no-run): (?P<what>[^\n]*) -->\n)?"
    r"^```(?P<language>[\w-]*)[^\n]*\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
PICTURE = re.compile(r"<!-- picture: (\S+) -->")
RUN = Path(__file__).with_name("run_page.py")
LONGEST_S = 240


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    code: str
    line: int
    file: str
    runs: bool


def blocks_of(text: str) -> list[Block]:
    """Return the fenced blocks of a page, in order."""
    fences = [match for match in FENCE.finditer(text) if match["language"] != "math"]
    return [
        Block(
            match["language"],
            match["code"],
            text.count("\n", 0, match.start("code")) + 1,
            match["what"] if match["mark"] == "file" else "",
            match["mark"] == "file"
            or (match["mark"] is None and match["language"] in ("python", "console")),
        )
        for match in fences
    ]


def run(page: str, blocks: list[Block], folder: Path) -> list[dict[str, object]] | str:
    """Run those blocks in a folder; return what each printed and drew, or what went wrong."""
    task = {"page": page, "blocks": [vars(block) for block in blocks]}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [sys.executable, str(RUN)],
        input=json.dumps(task), capture_output=True, text=True, cwd=folder, timeout=LONGEST_S,
        env={**os.environ, "PATH": path, "COLUMNS": "100", "NO_COLOR": "1",
             "AUVEST_SOURCE": str(RUN.parents[2])},
    )  # fmt: skip
    return json.loads(done.stdout) if done.returncode == 0 else done.stderr.strip()


def image(data: bytes | str, what: str) -> nodes.raw:
    """Return a PNG as a node of the page."""
    text = data if isinstance(data, str) else base64.b64encode(data).decode()
    element = f'<p class="drawn"><img src="data:image/png;base64,{text}" alt="{what}"></p>'
    return nodes.raw("", element, format="html")


def execute(app: Sphinx, doctree: nodes.document) -> None:
    """Run a tutorial and put its outputs behind its blocks."""
    name = app.env.docname
    if not name.startswith(FOLDER):
        return
    page = f"{name}.md"
    blocks = blocks_of((Path(app.srcdir) / page).read_text(encoding="utf-8"))
    shown = list(doctree.findall(nodes.literal_block))
    if [node.rawsource for node in shown] != [block.code for block in blocks]:
        LOGGER.warning("its blocks are not those that Sphinx sees", location=name)
        return
    with tempfile.TemporaryDirectory() as folder:
        ran = run(page, [block for block in blocks if block.runs], Path(folder))
        if isinstance(ran, str):
            LOGGER.warning("%s", ran, location=name)
            return
        results = iter(ran)
        for node, block in zip(shown, blocks, strict=True):
            if not block.runs:
                continue
            result = next(results)
            text = str(result["text"]).rstrip("\n")
            if block.language == "console" and not block.file:
                node.replace_self(nodes.literal_block(text, text, language="console"))
                continue
            place = node.parent.index(node) + 1
            added: list[nodes.Node] = [
                image(data, "what the code above draws") for data in result["pictures"]
            ]
            if text:
                printed = nodes.literal_block(text, text, language="none", classes=["printed"])
                added.insert(0, printed)
            node.parent.insert(place, added)
        for node in list(doctree.findall(nodes.raw)):
            if match := PICTURE.search(node.astext()):
                node.replace_self(image((Path(folder) / match[1]).read_bytes(), match[1]))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register it: before the search index and other collectors read the page."""
    app.connect("doctree-read", execute, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
