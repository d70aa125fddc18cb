"""The documentation site: built as `make docs` does, opened from disk in a real browser."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import zlib
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote, urlsplit

import pytest
from browser import dom_of

import auvest

pytest.importorskip("sphinx", reason="make setup-dev installs it")

ROOT = Path(__file__).resolve().parents[2]
CONFIGURATION = ROOT / "docs" / "site"
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
FORMULA = re.compile(r"^```math\n", re.MULTILINE)

#: Says what a browser makes of a page: errors, fonts, the sizes of formulas.
PROBE = """<script>
const trouble = [];
addEventListener("error", (e) => trouble.push(String(e.message || e.target.src)), true);
console.error = console.warn = (...what) => trouble.push(what.join(" "));
addEventListener("load", async () => {
  await document.fonts.ready;
  const formulas = [...document.querySelectorAll(".katex-display > .katex > .katex-html")];
  document.documentElement.dataset.seen = JSON.stringify({
    trouble,
    fonts: [...document.fonts].filter((f) => f.status == "loaded").map((f) => f.family),
    heights: formulas.map((f) => f.getBoundingClientRect().height),
    loaded: performance.getEntriesByType("resource").map((e) => e.name),
  });
});
</script>"""


def build(source: Path, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Build a site as the Makefile does."""
    return subprocess.run(
        [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", "-j", "2",
         "-d", str(folder / "trees"), "-c", str(CONFIGURATION), *options, str(source),
         str(folder / "site")],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the whole site; return its folder."""
    folder = tmp_path_factory.mktemp("docs")
    done = build(ROOT, folder)
    assert done.returncode == 0, done.stderr
    return folder / "site"


def build_pages(
    folder: Path, pages: dict[str, str]
) -> tuple[subprocess.CompletedProcess[str], Path]:
    """Build a site of a few pages, the first its root; return what was said, and its folder."""
    for name, text in pages.items():
        page = folder / "source" / f"{name}.md"
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(text)
    return build(folder / "source", folder, "-D", f"root_doc={next(iter(pages))}"), folder / "site"


class Links(HTMLParser):
    """The anchors of a page and what it refers to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.anchors.add(value or "")
            if name == "src" or (name == "href" and tag in ("a", "link")):
                self.links.add(value or "")


def seen(page: Path, folder: Path) -> dict:
    """Return what the browser says about a page."""
    probed = page.with_name(f"probed-{page.name}")
    probed.write_text(page.read_text().replace("<head>", f"<head>{PROBE}", 1))
    try:
        shown, said = dom_of(probed.as_uri(), folder)
    finally:
        probed.unlink()
    found = re.search(r'data-seen="([^"]*)"', shown)
    assert found is not None, said[-2000:]
    return json.loads(unescape(found[1]))


def test_every_link_of_every_page_leads_somewhere_on_the_disk(site: Path) -> None:
    pages = {path: Links(path.read_text()) for path in site.rglob("*.html")}
    assert len(pages) > 60
    broken = []
    for page, found in pages.items():
        for link in found.links:
            address = urlsplit(link)
            if address.scheme:
                # Nothing is loaded from elsewhere; sources that are cited may be.
                assert address.scheme in ("https", "http", "data", "mailto"), link
                continue
            target = page if not address.path else (page.parent / unquote(address.path)).resolve()
            anchors = pages[target].anchors if target in pages else None
            known = anchors is None or not address.fragment or unquote(address.fragment) in anchors
            if not target.exists() or not known:
                broken.append(f"{page.relative_to(site)}: {link}")
    assert broken == []


@pytest.mark.parametrize(
    "name",
    [
        "docs/index",
        "docs/tutorials/first_filter",
        "docs/algorithms/ukf",
        "docs/api/cpp/filters",
        "docs/api/python/filters",
    ],
)
def test_a_page_opens_from_disk_without_an_error(site: Path, tmp_path: Path, name: str) -> None:
    found = seen(site / f"{name}.html", tmp_path)
    assert found["trouble"] == []
    assert all(address.startswith(("file:", "data:")) for address in found["loaded"])


def test_formulas_are_drawn_in_their_own_fonts(site: Path, tmp_path: Path) -> None:
    page = ROOT / "docs" / "algorithms" / "ukf.md"
    found = seen(site / "docs" / "algorithms" / "ukf.html", tmp_path)
    assert {"KaTeX_Main", "KaTeX_Math"} <= set(found["fonts"])
    written = len(FORMULA.findall(page.read_text()))
    assert len(found["heights"]) == written > 15
    assert min(found["heights"]) > 10
    html = (site / "docs" / "algorithms" / "ukf.html").read_text()
    assert "[UKF D2]" in html


def test_search_finds_lock_out_and_shows_the_place(site: Path, tmp_path: Path) -> None:
    shown, said = dom_of((site / "search.html").as_uri() + "?q=lock-out", tmp_path)
    results = re.findall(r'<li class="kind-\w+"><a href="([^"]*)', shown)
    assert any(link.startswith("docs/algorithms/mekf.html#lock-out") for link in results), said
    excerpts = re.findall(r'<p class="context">(.*?)</p>', shown, re.DOTALL)
    assert any("lock-out" in re.sub("<.*?>", "", text).lower() for text in excerpts)


def printing_blocks(page: Path) -> int:
    """Count the Python blocks of a page that print, themselves or by a function of the page."""
    printing, blocks = {"print"}, 0
    for code in re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL):
        statements = ast.parse(code).body
        functions = [s for s in statements if isinstance(s, ast.FunctionDef)]
        printing |= {f.name for f in functions if calls(f) & printing}
        blocks += any(calls(s) & printing for s in statements if s not in functions)
    return blocks


def calls(statement: ast.stmt) -> set[str]:
    """Return the names that a statement calls."""
    found = [node.func for node in ast.walk(statement) if isinstance(node, ast.Call)]
    return {name.id for name in found if isinstance(name, ast.Name)}


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_tutorials_show_what_their_code_has_printed(site: Path, page: Path) -> None:
    text, html = page.read_text(), (site / "docs/tutorials" / f"{page.stem}.html").read_text()
    assert html.count('class="printed') == printing_blocks(page) > 0
    if "plt.subplots" in text or "<!-- picture" in text:
        assert 'src="data:image/png;base64,' in html


def test_a_tutorial_runs_its_blocks_in_order(tmp_path: Path) -> None:
    page = (
        "# Page\n\nIt is [here](#page).\n\n<!-- file: sub/numbers.txt -->\n```text\n6\n7\n```\n\n"
        "```python\na, b = map(int, open('sub/numbers.txt'))\na * b\n```\n\n"
        "```python\nimport matplotlib.pyplot as plt\nplt.plot([a, b])\n"
        "plt.savefig('kept.png')\n```\n\n"
        "```console\n$ cat sub/numbers.txt | head -1\n$ echo $((6 * \\\n  7 + 1))\n```\n\n"
        "<!-- picture: kept.png -->\n\n<!-- no-run: a reason -->\n```python\n1 / 0\n```\n"
    )
    done, built = build_pages(tmp_path, {"docs/tutorials/page": page})
    assert done.returncode == 0, done.stderr
    html = (built / "docs/tutorials/page.html").read_text()
    text = re.sub("<.*?>", "", html)
    assert re.search(r"a \* b\s*42\s", text)
    assert re.search(r"head -1\s*6\s", text)
    assert re.search(r"7 \+ 1\)\)\s*43\s", text)
    assert html.count('src="data:image/png;base64,') == 2
    # The same as a notebook: what runs are cells, and nothing else is.
    notebook = json.loads((built / "docs/tutorials/page.ipynb").read_text())
    cells = [cell["source"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert cells == [
        "%%writefile sub/numbers.txt\n6\n7",
        "a, b = map(int, open('sub/numbers.txt'))\na * b",
        "import matplotlib.pyplot as plt\nplt.plot([a, b])\nplt.savefig('kept.png')",
        "!cat sub/numbers.txt | head -1\n!echo $((6 * \\\n  7 + 1))",
    ]
    texts = [cell["source"] for cell in notebook["cells"] if cell["cell_type"] == "markdown"]
    assert texts == ["# Page\n\nIt is here.", "```python\n1 / 0\n```"]
    assert 'href="page.ipynb"' in html


def test_the_page_of_the_firmware_is_part_of_the_site_where_it_was_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(CONFIGURATION))
    import navigation

    app = SimpleNamespace(
        srcdir=tmp_path, outdir=tmp_path / "site", builder=SimpleNamespace(format="html")
    )
    app.outdir.mkdir()
    home = (ROOT / "docs" / "index.md").read_text()
    for made in (False, True):
        if made:
            (tmp_path / "dist").mkdir()
            (tmp_path / "dist" / "page.html").write_text("the page")
        source = [home]
        navigation.add_contents(app, "docs/index", source)
        navigation.add_entrance(app, None)
        assert ('href="../page.html"' in source[0]) is made
        assert (app.outdir / "page.html").exists() is made
        assert "## Begin here" in source[0]
        assert "url=docs/index.html" in (app.outdir / "index.html").read_text()


def test_what_is_broken_ends_the_build_and_is_said_where_it_is(tmp_path: Path) -> None:
    pages = {
        "docs/page": "# Page\n\n```{toctree}\n:glob:\ntutorials/*\n```\n\n"
        "[a](nowhere.md) [b](#no-such) [c](page.md#no-more) [d](no.hpp)\n\n"
        "```math\nx = \\nothing{1}\n```\n",
        "docs/tutorials/a": "# A\n\n```python\nx = 1\nx.absent\n```\n",
        "docs/tutorials/b": "# B\n\n```console\n$ echo said; exit 3\n```\n",
        "docs/tutorials/c": "# C\n\n```python\nx = 1\nx = (\n```\n",
    }
    done, _ = build_pages(tmp_path, pages)
    assert done.returncode != 0
    for expected in (
        "nowhere.md", "no-such", "no-more", "no.hpp",
        "page.md:10: WARNING: ParseError: KaTeX parse error: Undefined control sequence: \\nothing",
        "docs/tutorials/a.md:5: AttributeError",
        "docs/tutorials/b.md:4: RuntimeError: exit code 3",
        "docs/tutorials/c.md:5: SyntaxError",
    ):  # fmt: skip
        assert expected in done.stderr


def test_formulas_within_a_line_are_those_that_github_shows_too() -> None:
    """GitHub takes a backslash before a punctuation mark for Markdown's own, and `|` for a cell.

    And it refuses `operatorname`, there and in blocks.
    """
    for page in (ROOT / "docs").rglob("*.md"):
        assert "operatorname" not in page.read_text(), page
        text = re.sub(
            r"^```.*?^```$|`[^`\n]*`", "", page.read_text(), flags=re.DOTALL | re.MULTILINE
        )
        for formula in re.findall(r"\$([^$]+)\$", text):
            assert not re.search(r"\\[^A-Za-z\s]", formula), f"{page}: {formula}"
        for row in re.findall(r"^\|.*\|$", text, re.MULTILINE):
            for formula in re.findall(r"\$([^$]+)\$", row):
                assert "|" not in formula, f"{page}: {formula}"


def test_the_guide_and_the_readme_have_one_table_of_filters() -> None:
    tables = []
    for page in (ROOT / "README.md", ROOT / "docs" / "guides" / "which_filter.md"):
        table = re.search(r"^\| I have \| take .*?\n\n", page.read_text(), re.MULTILINE | re.DOTALL)
        assert table is not None
        tables.append(re.sub(r"\]\(.*?\)", "]", table[0]))
    assert tables[0] == tables[1]


def test_every_name_of_the_interfaces_is_documented(site: Path) -> None:
    inventory = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode()
    names = {line.split()[0] for line in inventory.splitlines()}
    missing = [name for name in auvest.__all__ if f"auvest.{name}" not in names]
    assert missing == []
    for header in (ROOT / "cpp" / "include" / "auvest").rglob("*.hpp"):
        folder = header.parent.relative_to(ROOT / "cpp" / "include" / "auvest").as_posix()
        page = site / "docs" / "api" / "cpp" / f"{'basics' if folder == '.' else folder}.html"
        assert header.name in page.read_text(), header
