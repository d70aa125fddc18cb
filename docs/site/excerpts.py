"""Search results with their text, also where the site is opened from disk.

Sphinx's search page fetches each page that it has found, to show some of its text. Browsers refuse
that to a page from disk, so the texts are one script, and the search page's `fetch` reads there.
"""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

SCRIPT = """\
const pages = %s;
window.fetch = async (url) => {
  const name = url.replace(document.documentElement.dataset.content_root, "");
  return { text: async () => pages[name.replace(/\\.html$/, "")] || "" };
};
"""


def text_of(node: nodes.Node) -> str:
    """Return the text of a page in its sections, as the least HTML that search looks for."""
    if isinstance(node, nodes.section):
        inner = " ".join(text_of(child) for child in node.children)
        for name in node["ids"]:
            inner = f'<section id="{html.escape(name)}">{inner}</section>'
        return inner
    if isinstance(node, nodes.document):
        return " ".join(text_of(child) for child in node.children)
    if isinstance(node, (nodes.raw, nodes.comment)):
        return ""
    return html.escape(" ".join(node.astext().split()))


def write_script(app: Sphinx, error: Exception | None) -> None:
    """Write all texts."""
    if app.builder.format != "html" or error is not None:
        return
    pages = {
        name: f'<div role="main">{text_of(app.env.get_doctree(name))}</div>'
        for name in sorted(app.env.found_docs)
    }
    script = SCRIPT % json.dumps(pages, ensure_ascii=False)
    (Path(app.outdir) / "_static" / "excerpts.js").write_text(script, encoding="utf-8")


def add_script(
    app: Sphinx, pagename: str, _template: str, _context: dict[str, Any], _doctree: Any
) -> None:
    """Let the search page load them, before its own scripts."""
    if pagename == "search":
        app.add_js_file("excerpts.js", priority=100)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register both."""
    app.connect("html-page-context", add_script)
    app.connect("build-finished", write_script)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
