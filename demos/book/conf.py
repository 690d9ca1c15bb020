"""Sphinx: lessons as executed notebooks, a theme, MathJax from a package; nothing is loaded from the network."""

import importlib
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))  # the packages of this checkout

project, author = "zerogap: contact, node by node", "the authors of zerogap"
copyright = "the authors of zerogap, MIT licence"
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["notebooks/*"]

myst_enable_extensions = ["amsmath", "attrs_block", "attrs_inline", "colon_fence", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # the build has executed them, each in a folder of its own
nb_merge_streams = True
nb_render_markdown_format = "myst"  # tables that cells show

suppress_warnings = ["ref.python"]  # names of parameters are no references

html_theme = "sphinx_book_theme"
html_title = project
html_css_files = ["book.css"]
html_theme_options = {"use_download_button": False, "use_fullscreen_button": False, "show_toc_level": 2}
html_context = {"default_mode": "auto"}  # dark or light as the reader has it
html_copy_source = False
html_show_sourcelink = False
pygments_style, pygments_dark_style = "a11y-high-contrast-light", "a11y-high-contrast-dark"

# One file with SVG for letters: no font is loaded, which browsers may forbid pages that come from disk.
mathjax_path = "mathjax.js"
mathjax3_config = {"options": {"enableMenu": False}, "svg": {"fontCache": "global"}}

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say more
napoleon_use_rtype = False
napoleon_use_ivar = True


def plain(app, what, name, thing, options, lines):
    """Keep bars, stars and underscores of plain formulas in docstrings, which are markup to docutils."""
    code = r"^[ ]*(?:>>>|\.\.\.|\.\. |:).*$|``.*?``|`[^`]+`"  # doctests, directives, fields, and what is marked as code
    parts = re.split(f"({code})", "\n".join(lines), flags=re.MULTILINE)
    parts[::2] = [
        re.sub(r"(?<!\\)([|*`])|(?<=\w)_(?!\w)", lambda m: "\\" + m[0], part) for part in parts[::2]
    ]
    lines[:] = "".join(parts).split("\n")


def setup(app):
    """Add what the packages bring."""
    app.connect("autodoc-process-docstring", plain, priority=100)  # before napoleon
    mathjax = Path(importlib.import_module("sphinx-mathjax-offline").__file__).parent / "static" / "mathjax"
    app.connect("build-finished", lambda app, error: error or _copy(mathjax / "tex-svg-full.js", app.outdir))


def _copy(script, out):
    (Path(out) / "_static" / "mathjax.js").write_bytes(script.read_bytes())
