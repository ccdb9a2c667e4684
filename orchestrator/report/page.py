"""Pages: templates, captions, values in HTML, and the page of an experiment."""

import base64
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from orchestrator import __version__
from orchestrator.runs.files import Folder

if TYPE_CHECKING:
    from orchestrator.report.card import Card
    from orchestrator.report.sheets import Sheet
    from orchestrator.report.style import Figure

HERE = Path(__file__).parent
IN_ADDRESS = " <>/=:;,.'()!*?[]{}|~+-"
"""Letters that stand for themselves in the address of a picture."""
PACKAGES = (
    "gmsh",
    "matplotlib",
    "meshio",
    "numpy",
    "pandas",
    "pyvista",
    "scipy",
    "vtk",
)
"""Libraries whose versions a page names."""


def fill(template: str, folder: Path = HERE, /, **values: Any) -> str:
    """Fill a template.

    Parameters
    ----------
    template
        Its file name.
    folder
        The directory that it is in, by default that of this file.
    values
        Values by the names that the template has for them.

    Returns
    -------
    str
        The text.
    """
    script = (HERE / "page.js").read_text("utf-8")
    digest = base64.b64encode(sha256(script.encode()).digest()).decode("ascii")
    given = {
        "css": Markup((HERE / "page.css").read_text("utf-8")),
        "script": Markup(script),
        "script_digest": f"sha256-{digest}",
        **values,
    }
    return _templates(folder).get_template(template).render(**given)


def caption(name: str, /, **values: Any) -> str:
    """Write a caption or a sentence.

    Parameters
    ----------
    name
        Name of its macro in ``captions.j2``.
    values
        Arguments of the macro.

    Returns
    -------
    str
        Plain text on one line.
    """
    template = _templates(HERE, autoescape=False).get_template("captions.j2")
    macro = getattr(template.module, name)
    return " ".join(str(macro(**values)).split())


@cache
def _templates(folder: Path, autoescape: bool = True) -> Environment:
    """The templates of a directory, with the filters of all pages."""
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters |= {
        "typeset": typeset,
        "n": format,
        "address": address,
        "inline": _inline,
        "cell": _cell,
    }
    environment.policies["json.dumps_kwargs"] = {
        "separators": (",", ":"),
        "ensure_ascii": False,
        "allow_nan": False,
    }
    return environment


@cache
def typeset(text: str) -> Markup:
    """Write a text as HTML: indices, and code.

    Parameters
    ----------
    text
        The text. A symbol such as ``V_f`` gets an index, a name such as ``why_not``
        none; words in backticks are code.

    Returns
    -------
    Markup
        The HTML.

    Examples
    --------
    >>> print(typeset("V_f < 1, see `why_not`"))
    V<sub>f</sub> &lt; 1, see <code>why_not</code>
    """
    index = r"\b([^\W\d_]|[^\W\d_a-z][^\W\d_]{1,2})_([A-Za-z]+)\b(?!_)"
    html = re.sub(index, r"\1<sub>\2</sub>", str(escape(text)))
    # no line breaks within an interval
    html = re.sub(r"(?<=\d) … (?=\d)", "\u00a0…\u00a0", html)
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", html))


def address(image: bytes) -> str:
    """Write an image as the address of a picture in a page.

    Parameters
    ----------
    image
        A PNG or an SVG file.

    Returns
    -------
    str
        A ``data:`` address, which may stand in double quotation marks.
    """
    if image.startswith(b"\x89PNG"):
        return f"data:image/png;base64,{base64.b64encode(image).decode('ascii')}"
    # a text takes less room as it is than in base64; browsers drop the ends of lines
    text = " ".join(image.decode("utf-8").split("\n"))
    text = re.sub('"([^"\']*)"', r"'\1'", text)
    return Markup("data:image/svg+xml;utf8," + quote(text, safe=IN_ADDRESS))


def _inline(figure: "Figure") -> Markup:
    """The SVG of a figure for a page: without prolog and metadata, with titles.

    A point whose group has texts in the figure's data has them as its title, which a
    browser shows beside a pointer.
    """
    text = figure.image.decode("utf-8")
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    if 'role="img"' not in svg[:400]:
        label = f'<svg role="img" aria-label="{escape(figure.title)}"'
        svg = svg.replace("<svg", label, 1)
    if "frames" not in (figure.data or {"frames": ()}):
        for group, points in figure.data.items():
            svg = _with_titles(svg, group, points)
    return Markup(svg)


def _with_titles(svg: str, group: str, points: Sequence[Sequence[str]]) -> str:
    """An SVG whose points of a group have titles, in their order."""
    if not points:
        return svg  # a count of 0 would replace all that follow
    start = svg.index(f'id="{group}"')
    before, after = svg[:start], svg[start:]
    said = iter(points)

    def titled(found: re.Match[str]) -> str:
        scene, threshold, why, case = next(said)
        worth = f"not usable: {why}" if why else "usable"
        lines = "\n".join(filter(None, (scene, threshold, worth, case)))
        return f"<use {found[1]}><title>{escape(lines)}</title></use>"

    return before + re.sub(r"<use ([^>]*)/>", titled, after, count=len(points))


def _cell(value: Any) -> str:
    """A value of a table: a number to four digits, a dash for a missing value."""
    if pd.isna(value):
        return "—"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Guest:
    """What another package adds to a page.

    Attributes
    ----------
    name
        The anchor of its section.
    section
        Makes the section from the names of the page's figures in their order.
    files
        Texts of files beside the page, by name.
    card
        The answer card, in place of the study's own.
    sheet
        The table below it.
    numbers
        Numbers that others gave to figures, by the beginning of their names; such
        figures are drawn even where the page of another study folds them away.
    """

    name: str
    section: Callable[[Sequence[str]], Markup]
    files: Mapping[str, str]
    card: "Card | None" = None
    sheet: "Sheet | None" = None
    numbers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Section:
    """A part of the page of an experiment.

    Attributes
    ----------
    title
        Its title; the answer of the experiment has none.
    text
        What stands before its figures.
    figures, tables
        What it shows.
    limits
        What a reader should not conclude.
    card
        The answer card of the page.
    """

    title: str
    text: str = ""
    figures: Sequence["Figure"] = ()
    tables: Sequence[pd.DataFrame] = ()
    limits: Sequence[str] = ()
    card: "Card | None" = None


def versions(solvers: Mapping[str, str]) -> pd.DataFrame:
    """List the programs that results come from.

    Parameters
    ----------
    solvers
        Versions of the solvers, by name.

    Returns
    -------
    DataFrame
        Programs and versions: solvers, this package, and `PACKAGES`.
    """
    rows = sorted(solvers.items())
    rows.append(("orchestrator", __version__))
    rows.append(("Python", python_version()))
    for name in PACKAGES:
        if name not in solvers:
            rows.append((name, metadata.version(name)))
    return pd.DataFrame(rows, columns=["program", "version"])


def write(
    title: str,
    sections: Sequence[Section],
    folder: Folder,
    name: str,
    solvers: Mapping[str, str],
) -> None:
    """Write the page of an experiment, with its figures as PNG and SVG beside it.

    Parameters
    ----------
    title
        Its title.
    sections
        Its parts, the answer first.
    folder
        The directory of the experiment.
    name
        File name of the page.
    solvers
        Versions of the solvers, by name.
    """
    from orchestrator.report import style  # it imports matplotlib

    drawn = []
    for section in sections:
        figures = [style.saved(figure, folder, png=True) for figure in section.figures]
        drawn.append(replace(section, figures=figures))
    text = fill(
        "document.html.j2",
        title=title,
        card=next((part.card for part in sections if part.card), None),
        sections=drawn,
        programs=versions(solvers),
        links={},
    )
    folder.put(name, text)
