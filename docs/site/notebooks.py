"""Each tutorial as a notebook to take along: the same blocks, as cells of Jupyter."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from executed import FENCE, FOLDER
from sphinx.application import Sphinx

COMMENT = re.compile(r"^<!--.*?-->\n", re.MULTILINE)
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\([^)]*\)")


def cell(kind: str, text: str) -> dict[str, Any]:
    """Return a cell of a notebook."""
    if kind == "markdown":  # the pages that it links to are not beside a notebook
        text = LINK.sub(r"\1", COMMENT.sub("", text))
    source = {"cell_type": kind, "metadata": {}, "source": text.strip("\n")}
    return source if kind == "markdown" else {**source, "execution_count": None, "outputs": []}


def code_of(match: re.Match[str]) -> str | None:
    """Return what a block of a page is in Jupyter; None if it is only shown."""
    if match["mark"] == "file":
        return f"%%writefile {match['what']}\n{match['code']}"
    if match["mark"] == "no-run":
        return None
    if match["language"] == "console":
        return re.sub(r"^\$ ", "!", match["code"], flags=re.MULTILINE)
    return match["code"] if match["language"] == "python" else None


def notebook(text: str) -> dict[str, Any]:
    """Return a page as a notebook: text, and cells for what runs."""
    cells, written, at = [], "", 0
    for match in FENCE.finditer(text):
        written += text[at : match.start()]
        at = match.end()
        code = code_of(match)
        if code is None:
            written += match[0]
            continue
        if written.strip():
            cells.append(cell("markdown", written))
        cells.append(cell("code", code))
        written = ""
    if (written + text[at:]).strip():
        cells.append(cell("markdown", written + text[at:]))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 4}


def offer(app: Sphinx, doctree: nodes.document) -> None:
    """Put a link to it below the title of each tutorial."""
    name = app.env.docname
    if name.startswith(FOLDER):
        link = (
            f'<p class="notebook"><a href="{Path(name).name}.ipynb" download>As a notebook</a></p>'
        )
        title = next(doctree.findall(nodes.title))
        title.parent.insert(1, nodes.raw("", link, format="html"))


def write(app: Sphinx, error: Exception | None) -> None:
    """Write all of them."""
    if app.builder.format == "html" and error is None:
        for name in sorted(app.env.found_docs):
            if name.startswith(FOLDER):
                text = Path(app.env.doc2path(name)).read_text(encoding="utf-8")
                path = Path(app.outdir) / f"{name}.ipynb"
                path.write_text(json.dumps(notebook(text), indent=1), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register both."""
    app.connect("doctree-read", offer)
    app.connect("build-finished", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
