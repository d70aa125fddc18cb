"""The documentation site: what Sphinx asks for. `make docs` builds it.

Sphinx with MyST, because the pages are Markdown that GitHub shows as well, and because broken
references, docstrings and code blocks are warnings there, which `-W` makes errors. The source is
the whole repository, so that README, CHANGELOG, firmware/README.md and docs/ keep the links they
have. What the pages lack for that is in the modules beside this file:

    formulas     LaTeX to HTML by KaTeX when the site is built: pages need no script for it
    executed     runs the code of the tutorials and puts in what it prints and draws
    notebooks    the tutorials to take along, for Jupyter
    headers      the C++ interface, from the headers and their comments
    navigation   the order of the pages, which no Markdown page has to carry
    excerpts     search results with their text from disk, too, where a page may not fetch another
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "auvest"
author = "The auvest authors"
project_copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "formulas",
    "executed",
    "notebooks",
    "headers",
    "navigation",
    "excerpts",
]

root_doc = "docs/index"
include_patterns = ["docs/*.md", "docs/**/*.md", "README.md", "CHANGELOG.md", "firmware/README.md"]
exclude_patterns = [".*", "build", "dist", "cpp", "python", "tests", "auvest-output", "docs/site"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]  # as GitHub has them
myst_heading_anchors = 4
# Pages may begin with what is no heading; attributes of several classes have one name.
suppress_warnings = ["myst.header", "ref.python"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings have them
autodoc_class_signature = "mixed"
napoleon_google_docstring = False
napoleon_custom_sections = [("Attributes", "params_style")]

copybutton_exclude = ".linenos, .gp, .go"
highlight_language = "none"
pygments_style = "friendly"

html_theme = "furo"
html_title = "auvest"
html_static_path = ["static"]
html_css_files = ["katex.css", "site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#005f8a", "color-brand-content": "#00699a"},
    "dark_css_variables": {"color-brand-primary": "#59b8e6", "color-brand-content": "#6cc3ee"},
}
