"""The order of the pages: put behind the front page as tables of contents that it does not show.

The page where the firmware runs (`make page` writes dist/page.html) becomes part of the site where
it is there, and the front page then leads to it.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from sphinx.application import Sphinx

PAGES = {
    "Tutorials": [
        "tutorials/first_filter",
        "tutorials/own_model",
        "tutorials/own_log",
        "tutorials/monte_carlo",
        "Three beacons on a MEGA <firmware>",
        "tutorials/paper_to_chip",
    ],
    "Guides": [
        "guides/which_filter",
        "guides/tuning",
        "guides/consistency",
        "guides/frames_units",
        "guides/timing",
        "guides/power",
        "models",
        "logs",
        "importers",
        "sweeps",
        "On a microcontroller </firmware/README>",
    ],
    "Algorithms": [
        "Unscented filter <algorithms/ukf>",
        "AUKF: when to sample <algorithms/aukf>",
        "M-estimation EKF <algorithms/mekf>",
        "Unknown start <algorithms/unknown_start>",
        "Smoother <algorithms/smoother>",
        "SLATF <algorithms/slatf>",
        "The hull <algorithms/vehicle>",
        "Guidance and control <algorithms/guidance>",
        "Functions and random numbers <algorithms/math>",
    ],
    "Reproductions": ["reproduction/index"],
    "Reference": [
        "api/python",
        "api/cpp",
        "notation",
        "glossary",
        "boards",
        "budgets",
        "speed",
        "speed_runs",
        "speed_slat",
        "speed_vehicle",
        "speed_startup",
    ],
    "Project": ["contributing", "/CHANGELOG", "SECURITY", "Readme </README>"],
}

FIRMWARE = """\
<p class="firmware"><a href="../page.html">See the firmware run in this browser</a>: the sketches'
machine code on a simulated ATmega2560.</p>

## Begin here
"""


def add_contents(app: Sphinx, name: str, source: list[str]) -> None:
    """Append the tables of contents to the pages that have them."""
    if name == "docs/index":
        if firmware_page(app).exists():
            source[0] = source[0].replace("## Begin here\n", FIRMWARE)
        for caption, pages in PAGES.items():
            source[0] += contents(pages, f":hidden:\n:caption: {caption}")
    if name == "docs/reproduction/index":
        folder = Path(app.srcdir) / "docs/reproduction"
        pages = sorted(page.parent.name + "/README" for page in folder.glob("*/README.md"))
        source[0] += contents(pages, ":hidden:")
    if name in ("docs/api/python", "docs/api/cpp"):
        folder = Path(app.srcdir) / name
        pages = sorted(f"{folder.name}/{page.stem}" for page in folder.glob("*.md"))
        source[0] += contents(pages, ":hidden:")


def contents(pages: list[str], options: str) -> str:
    """Return one table of contents."""
    return "\n\n```{toctree}\n" + options + "\n\n" + "\n".join(pages) + "\n```\n"


def firmware_page(app: Sphinx) -> Path:
    """Return where `make page` writes."""
    return Path(app.srcdir) / "dist" / "page.html"


def add_entrance(app: Sphinx, error: Exception | None) -> None:
    """Lead from the site's folder to its front page; bring the firmware's page."""
    if app.builder.format == "html" and error is None:
        if firmware_page(app).exists():
            shutil.copy(firmware_page(app), app.outdir)
        (Path(app.outdir) / "index.html").write_text(
            '<!doctype html><meta charset="utf-8"><title>auvest</title>'
            '<meta http-equiv="refresh" content="0; url=docs/index.html">'
            '<a href="docs/index.html">auvest</a>\n',
            encoding="utf-8",
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Register both."""
    app.connect("source-read", add_contents)
    app.connect("build-finished", add_entrance)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
