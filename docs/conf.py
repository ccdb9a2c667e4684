"""The settings of Sphinx for `make docs`: the Markdown of the repository as a site."""

import re
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "orchestrator"
author = "the maintainers of orchestrator"
copyright = author
extensions = ["myst_parser"]
root_doc = "README"
include_patterns = ["README.md", "CHANGELOG.md", "docs/*.md", "**/README.md"]
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
    """Give the first page the pages of the index, part by part."""
    if name == root_doc:
        source[0] += "\n\n" + "\n\n".join(_parts())


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
