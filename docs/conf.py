"""The documentation as a site: `.venv/bin/sphinx-build -W -c docs . dist/docs`.

The sources are the Markdown files where they lie, so that their links are the same on the site, in an editor and in a
repository's own view. README.md is the home. The navigation is added to it here.
"""

import gc
from pathlib import Path

import sphinx.application

gc.disable()  # garbage stays, up to 0.9 GB: to search for it takes two fifths of the time

project = "Capture Studio"
author = "The authors of Capture Studio"
language = "en"
root_doc = "README"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
include_patterns = ["*.md", "docs/**.md", "examples/*.md"]
exclude_patterns = [".*", "dist", "docker", "node_modules", "sessions", "studio", "tests", "typings"]

myst_heading_anchors = 4
myst_enable_extensions = ["fieldlist"]

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
default_role = "code"  # docstrings say `name` as Markdown does
napoleon_google_docstring = True
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = "Capture Studio"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}

NAVIGATION = {
    "Guide": [
        "docs/guide/README",
        "docs/guide/cameras",
        "docs/guide/phones",
        "docs/guide/calibrate",
        "docs/guide/record",
        "docs/guide/import",
        "docs/guide/points",
        "docs/guide/replay",
        "docs/guide/compare",
        "docs/guide/export",
        "docs/guide/stream",
        "docs/guide/set",
        "docs/guide/share",
        "docs/hardware",
        "docs/devices",
    ],
    "Using it": [
        "docs/switches",
        "docs/export",
        "docs/robots",
        "docs/streaming",
        "docs/timecode",
        "docs/triggers",
        "docs/rigid_bodies",
        "docs/batch",
        "docs/blind_tests",
        "docs/study",
        "docs/depth_simulator",
    ],
    "Running it": [
        "docs/configuration",
        "docs/docker",
        "docs/security",
        "docs/scale",
        "docs/performance",
    ],
    "Reference": [
        "docs/metrics",
        "docs/formats",
        "docs/edits",
        "docs/protocol",
        "docs/api",
        "docs/python",
        "examples/README",
    ],
    "Working on it": [
        "ARCHITECTURE",
        "docs/extending",
        "CONTRIBUTING",
        "docs/decisions/README",
        "docs/experiments/README",
        "CHANGELOG",
    ],
}


def add_navigation(app: sphinx.application.Sphinx, docname: str, source: list[str]) -> None:
    """Append what the site's sidebar shows: to the home its parts, to an index of numbered pages those pages."""
    if docname == root_doc:
        for caption, pages in NAVIGATION.items():
            source[0] += toctree(pages, caption)
    elif docname in ("docs/decisions/README", "docs/experiments/README"):
        folder = Path(app.srcdir) / docname
        names = sorted(path.stem for path in folder.parent.glob("*.md") if path.name != "README.md")
        source[0] += toctree(names)


def toctree(pages: list[str], caption: str = "") -> str:
    """Return a hidden table of contents in MyST's words."""
    options = [":hidden:", f":caption: {caption}"] if caption else [":hidden:"]
    return "\n".join(["\n", "```{toctree}", *options, "", *pages, "```", ""])


def write_index(app: sphinx.application.Sphinx, error: Exception | None) -> None:
    """Let the site's folder open at its home."""
    if error is None and app.builder.name == "html":
        link = f'<meta http-equiv="refresh" content="0; url={root_doc}.html">'
        Path(app.outdir, "index.html").write_text(f"<!doctype html>{link}\n", encoding="utf-8")


def setup(app: sphinx.application.Sphinx) -> None:
    """Hook into the build."""
    app.connect("source-read", add_navigation)
    app.connect("build-finished", write_index)
