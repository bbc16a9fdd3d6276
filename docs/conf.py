"""The documentation site: ``scripts/docs`` builds it from this folder into build/site."""

import re
import sys
from itertools import pairwise
from os.path import relpath
from pathlib import Path, PurePosixPath

import jaxtyping  # noqa: F401  # before kedfem: its types of arrays stand in signatures
from sphinx.application import Sphinx
from sphinx.util import logging

import kedfem

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

project = "kedfem"
author = "The kedfem developers"
copyright = "the kedfem developers, GPL 3.0 or later"
version = release = kedfem.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
exclude_patterns = ["README.md", "site"]

# pages are Markdown; their headings are anchors as on a code host
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]
suppress_warnings = ["myst.header"]  # a page's figures may begin below a table
smartquotes_action = "D"  # dashes alone: a prime is a derivative
nb_execution_mode = "cache"
nb_execution_timeout = 600  # the first run compiles
nb_execution_raise_on_error = True

# names of other packages are no targets here: nothing is fetched while building
nitpicky = True
inner = r"kedfem\.(scene\.base|accuracy|results\.(differences|kinematic|forces\.load_cases)|links|dynamics)\..*"
nitpick_ignore_regex = [("py:.*", r"(?!kedfem\.).*"), ("py:class", inner)]
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_preprocess_types = False

html_theme = "furo"
html_title = f"kedfem {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


FETCHED = r"""<(script|img|iframe)[^>]*\ssrc=["'](https?:)?//|<link[^>]*rel=["']stylesheet["'][^>]*["'](https?:)?//"""
# what pages link to outside this folder, so that they read on a code host too → the page that the site has for it
OUTSIDE = {
    "SECURITY.md": "security",
    "examples": "gallery/index",
    "src/kedfem/cli/__init__.py": "reference/command-line",
    "tests/rooms/bad_scenes.toml": "reference/messages",
}
OUTSIDE |= {f"examples/{path.parent.name}/scene.toml": f"gallery/{path.parent.name}" for path in
            (HERE.parent / "examples").glob("*/scene.toml")}  # fmt: skip
LINK = re.compile(r"\]\((?:\.\./)*(" + "|".join(map(re.escape, sorted(OUTSIDE, reverse=True))) + r")\)")


def _links(_app: Sphinx, page: str, content: list[str]) -> None:
    """Links that leave this folder lead to the pages of the site."""
    here = PurePosixPath(page).parent
    content[0] = LINK.sub(lambda found: f"]({relpath(OUTSIDE[found[1]], here)}.md)", content[0])


def _fields(_app: Sphinx, what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Lines `field : meaning` of a record's docstring become a list."""
    if what != "class":
        return
    out: list[str] = []
    for line in lines:
        field = re.match(r"([\w, ]+) : (.*)", line)
        if field:
            out += [] if out and out[-1].startswith(("* ", "  ")) else [""]
            out.append(f"* **{field[1]}**: {field[2]}")
        else:
            goes_on = line.startswith("    ") and out[-1].startswith(("* ", "  "))
            out.append(f"  {line.strip()}" if goes_on else line)
    lines[:] = out


def _parameters(_app: Sphinx, what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Lines `name : meaning` below a heading such as Parameters: what follows the colon is no type."""
    if what == "class":
        return
    out: list[str] = []
    headed = False
    for line, after in pairwise([*lines, ""]):
        headed = headed or set(after) == {"-"}
        found = re.match(r"([\w*, ]+) : (.*)", line) if headed else None
        out += [found[1], f"    {found[2]}"] if found else [line]
    lines[:] = out


def _offline(app: Sphinx, failed: Exception | None) -> None:
    """A page that would fetch something from a host is a warning, and so an error."""
    if failed or app.builder.format != "html":
        return
    for page in Path(app.outdir).rglob("*.html"):
        if page.parent.name != "reports" and (found := re.search(FETCHED, page.read_text("utf-8"))):
            logging.getLogger(__name__).warning("%s fetches %s", page.name, found[0])


def setup(app: Sphinx) -> None:
    """Pages that commands make are made before the sources are read."""
    from docs.site.pages import write_pages

    app.connect("config-inited", lambda app, config: write_pages(Path(app.srcdir), Path(app.outdir)))
    app.connect("source-read", _links)
    app.connect("include-read", lambda app, path, page, content: _links(app, page, content))
    app.connect("build-finished", _offline)
    app.connect("autodoc-process-docstring", _fields, priority=100)
    app.connect("autodoc-process-docstring", _parameters, priority=100)  # before napoleon
