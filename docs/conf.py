"""The documentation as a site (scripts/docs): Sphinx, Markdown by MyST, the theme furo. Everything in it is local."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
HEADER = ROOT / "include/sgrt.h"
sys.path.insert(0, str(ROOT / "docs/_ext"))

project = "libsgrt"
author = "the authors of libsgrt"
copyright = author + ", Apache-2.0"
version = release = ".".join(re.findall(r"define SGRT_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", HEADER.read_text()))

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_click",
    "c_manual",  # c/*.rst from include/sgrt.h
    "python_reference",  # the docstrings' own style
    "command_line",  # the help of sphinx-click as plain text
    "equations",  # the theory's equations to MathML
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_ext", "_static"]
suppress_warnings = ["toc.empty_glob"]
highlight_language = "none"
nitpicky = True
nitpick_ignore = [("c:identifier", name) for name in ("int32_t", "uint32_t", "int64_t", "size_t", "uint8_t")]
# numpy's and Python's own types: their pages are elsewhere, and there may be no network.
OUTSIDE = (
    r"(numpy|np|npt|ArrayLike|NDArray|Array|Images|float64|uint8|Buffer|collections|typing|pathlib|os|Path|PathLike|Any|click|dict\[str"
    r"|optional|Iterator|Sequence|Mapping|Iterable|Callable|Literal|ClassVar|SupportsIndex)\b.*"
)
nitpick_ignore_regex = [("py:.*", OUTSIDE)]

myst_enable_extensions = ["colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 4

autodoc_member_order = "bysource"
maximum_signature_line_length = 100
toc_object_entries_show_parents = "hide"
smartquotes = False  # "--check" is two hyphens
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"libsgrt {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "friendly"
pygments_dark_style = "github-dark"


def without_empty_globs(app, name, content):
    """A pattern of a toctree that matches no page (yet) is left out: it would be a warning."""
    kept = [
        line
        for line in content[0].split("\n")
        if not re.fullmatch(r"[\w/]+\*", line) or [*app.srcdir.glob(line + ".md")]
    ]
    content[0] = "\n".join(kept)


def setup(app):
    app.connect("source-read", without_empty_globs)
