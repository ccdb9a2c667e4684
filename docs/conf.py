"""The settings of Sphinx for `make docs`: the Markdown of the repository as a site.

The page `docs/functions.md` has a table of modules; in the site the functions of each
follow it, as their docstrings describe them.
"""

import re
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "orchestrator"
author = "the maintainers of orchestrator"
copyright = author
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
root_doc = "README"
include_patterns = ["*.md", "docs/*.md", "**/README.md"]
exclude_patterns = ["results", "site", ".*"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
suppress_warnings = ["myst.strikethrough"]
html_theme = "furo"
html_title = "orchestrator"
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False

ROOT = Path(__file__).parents[1]
FUNCTIONS = "docs/functions"


def setup(app: Sphinx) -> None:
    """Formulas without a network, and the contents of `docs/README.md` beside each page."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("source-read", _with_contents)


def _inline(writer: HTML5Translator, node: nodes.math) -> None:
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _block(writer: HTML5Translator, node: nodes.math_block) -> None:
    writer.body.append(f"<div>{convert(node.astext(), display='block')}</div>")
    raise nodes.SkipNode


def _with_contents(_: Sphinx, name: str, source: list[str]) -> None:
    """Give the first page the index, and the page of functions their docstrings."""
    if name == root_doc:
        source[0] += "\n\n" + "\n\n".join(_parts())
    if name == FUNCTIONS:
        modules = re.findall(r"(?m)^\| `(orchestrator[.\w]*)` \|", source[0])
        before, title, after = source[0].partition("## Where to go next")
        source[0] = "\n\n".join([before, *map(_functions, modules), title + after])


def _parts() -> list[str]:
    text = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    parts = re.split(r"(?m)^## ", text)[1:]
    return [_tree("Contents", ["README.md"]), *(_tree(*_pages(part)) for part in parts)]


def _pages(part: str) -> tuple[str, list[str]]:
    """The heading of a part of the index, and the pages that it names."""
    title, text = part.split("\n", 1)
    return title, [*dict.fromkeys(re.findall(r"\]\(([^)#]+\.md)\)", text))]


def _tree(title: str, pages: list[str]) -> str:
    listed = [str((ROOT / "docs" / page).resolve().relative_to(ROOT)) for page in pages]
    return "\n".join(
        ["```{toctree}", ":hidden:", f":caption: {title}", "", *listed, "```"]
    )


def _functions(module: str) -> str:
    """The section of the functions of a module."""
    return "\n".join(
        [
            f"## {module}",
            "",
            "```{eval-rst}",
            f".. automodule:: {module}",
            "   :members:",
            "```",
        ]
    )
