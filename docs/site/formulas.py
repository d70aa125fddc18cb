"""Formulas: KaTeX turns LaTeX into HTML when the site is built; a formula that is wrong ends it.

KaTeX is Debian's (libjs-katex) and runs in QuickJS. Its fonts go into the style sheet: a page that
is opened from disk may not load fonts from another folder in every browser.
"""

from __future__ import annotations

import base64
import json
import re
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import quickjs
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)
KATEX = Path("/usr/share/javascript/katex")
RENDER = """
function render(text, display) {
  // As JSON: long strings that JavaScript has joined do not cross to Python.
  return JSON.stringify(
    katex.renderToString(text, {displayMode: display, throwOnError: true, strict: true}));
}
"""


@cache
def renderer() -> Any:
    """KaTeX's function, in an interpreter of its own."""
    script = KATEX / "katex.js"
    if not script.exists():
        raise SphinxError(f"no {script}: apt-get install libjs-katex (make setup-dev does it)")
    context = quickjs.Context()
    context.eval(script.read_text(encoding="utf-8") + RENDER)
    return context.get("render")


def html(node: nodes.Element, text: str, *, display: bool) -> str:
    """Return one formula as HTML."""
    try:
        return json.loads(renderer()(text, display))
    except quickjs.JSException as error:
        LOGGER.warning("%s", str(error).splitlines()[0], location=node)
        return escape(text)


def inline(translator: Any, node: nodes.math) -> None:
    """Write a formula within a line."""
    translator.body.append(html(node, node.astext(), display=False))
    raise nodes.SkipNode


def block(translator: Any, node: nodes.math_block) -> None:
    """Write a formula on lines of its own."""
    text = html(node, node.astext(), display=True)
    translator.body.append(f'<div class="formula" tabindex="0">{text}</div>\n')
    raise nodes.SkipNode


def style_sheet() -> str:
    """Return KaTeX's style sheet with its fonts in it."""
    sheet = (KATEX / "katex.min.css").read_text(encoding="utf-8")

    def font(match: re.Match[str]) -> str:
        data = base64.b64encode((KATEX / match[1]).read_bytes()).decode()
        return f'src:url(data:font/woff2;base64,{data}) format("woff2")'

    named = r"""src:url\((fonts/[\w-]+\.woff2)\) format\(['"]woff2['"]\)[^;}]*"""
    sheet, count = re.subn(named, font, sheet)
    if count == 0:
        raise SphinxError("KaTeX's style sheet names its fonts in a way that is not known")
    return sheet


def write_style_sheet(app: Sphinx, error: Exception | None) -> None:
    """Put the style sheet among the site's files."""
    if app.builder.format == "html" and error is None:
        (Path(app.outdir) / "_static" / "katex.css").write_text(style_sheet(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("katex", (inline, None), (block, None))
    app.connect("build-finished", write_style_sheet)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
