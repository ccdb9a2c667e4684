"""Pages: a list of sections, templates, captions, and values in HTML."""

import base64
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Any, Union
from urllib.parse import quote

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from orchestrator import __version__
from orchestrator.report.card import Card, in_terminal, marked_lines
from orchestrator.report.field import is_field
from orchestrator.runs.files import Folder

if TYPE_CHECKING:
    from orchestrator.report.sheets import Sheet
    from orchestrator.report.style import Figure

HERE = Path(__file__).parent
IN_ADDRESS = " <>/=:;,.'()!*?[]{}|~+-"
"""Letters that stand for themselves in the address of a picture."""
MOST_ROWS = 60
"""Rows of a table that a page of an experiment shows; more are folded away."""
IN_LEGEND = {"card": "Card", "figures": "Figure", "table": "Sheet"}
"""What the legend of a page explains where it is there, by the kind of element."""
IN_SENTENCES = "The answer in sentences"
"""The line that opens the text below the figure of a card."""
UNITS = r"(?:%|°C|mm|µm|m|m/s|m²/s|kg/m³|Pa|g/m²|s|h|d)(?![\w/²³])"
"""Units that stay on the line of their number."""
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


def filled(text: str, /, **values: Any) -> str:
    """Fill the text of a caption.

    Parameters
    ----------
    text
        A template, which may take macros from ``captions.j2``.
    values
        Values by the names that it has for them.

    Returns
    -------
    str
        Plain text on one line.
    """
    template = _templates(HERE, autoescape=False).from_string(text)
    return " ".join(template.render(**values).split())


def page_text(name: str, /, **values: Any) -> Markup:
    """Write what the page of a study says somewhere.

    Parameters
    ----------
    name
        Name of its macro in ``texts.html.j2``.
    values
        Arguments of the macro.

    Returns
    -------
    Markup
        The HTML; empty where there is nothing to say.
    """
    template = _templates(HERE).get_template("texts.html.j2")
    return Markup(str(getattr(template.module, name)(**values)).strip())


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
        "sentence": sentence,
        "n": _number,
        "address": address,
        "is_field": is_field,
        "inline": _inline,
        "cell": _cell,
        "kind": _kind,
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
    parts = html.split("`")
    parts[::2] = map(_unbroken, parts[::2])  # not in code, which is copied
    html = "`".join(parts)
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", html))


def _unbroken(html: str) -> str:
    """A text without line breaks in intervals, equations, numbers with units."""
    html = re.sub(r"(?<=\d) … (?=[\d−+])", "\u00a0…\u00a0", html)
    html = re.sub(rf"(?<=\d) (?={UNITS})", "\u00a0", html)
    return re.sub(r"(?<=[^\W\d_]) = (?=[−\d])", "\u00a0=\u00a0", html)


def sentence(text: str) -> str:
    """Begin a text with a capital, unless it begins with a symbol.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> sentence("by the model"), sentence("u* = √(τ_b/ρ)"), sentence("τ_b of the flow")
    ('By the model', 'u* = √(τ_b/ρ)', 'τ_b of the flow')
    """
    first, *_ = text.split(" ", 1)
    is_word = first == "a" or (first.strip(",;:").isalpha() and len(first) > 1)
    return f"{text[0].upper()}{text[1:]}" if is_word else text


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


def _number(value: Any, form: str) -> str:
    """A number by a format, with a space before a percent sign and a true minus."""
    return format(value, form).replace("%", " %").replace("-", "−")


def _kind(element: object) -> str:
    """The name of the class of an element of a page, by which it is shown."""
    return type(element).__name__


def _cell(value: Any) -> str:
    """A value of a table: a number to four digits, a dash for a missing value."""
    if pd.isna(value):
        return "—"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Paragraphs:
    """A text of a page, which a terminal can have too.

    Attributes
    ----------
    text
        Plain text; an empty line parts two paragraphs.
    look
        The class of its paragraphs in the style of the page, such as ``lead``.
    fold
        Of a text that is folded away the line that opens it.
    """

    text: str
    look: str = ""
    fold: str = ""

    @property
    def lines(self) -> Iterator[str]:
        """Its paragraphs in lines of a terminal."""
        for paragraph in filter(None, self.text.split("\n")):
            yield from in_terminal(paragraph)


@dataclass(frozen=True)
class Text:
    """A text of a page that is HTML already.

    Attributes
    ----------
    html
        The text.
    fold
        Of a text that is folded away the line that opens it.
    """

    html: Markup
    fold: str = ""


@dataclass(frozen=True)
class Lines:
    """Lines of a file or a command, which a page and a terminal have as they are.

    Attributes
    ----------
    text
        The lines.
    """

    text: str


@dataclass(frozen=True)
class Limits:
    """What a reader should not conclude.

    Attributes
    ----------
    said
        A remark each.
    """

    said: Sequence[str]


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Attributes
    ----------
    frame
        Its values by the heads of their columns.
    file
        The file that has its columns; a narrow page leaves some away then.
    kept
        How many columns a narrow page keeps.
    fold
        Of a table that is folded away the line that opens it.
    """

    frame: pd.DataFrame
    file: str = ""
    kept: int = 4
    fold: str = ""

    @classmethod
    def of(cls, frame: pd.DataFrame) -> "Table":
        """Make a table that is folded away if it is long.

        Parameters
        ----------
        frame
            Its values.

        Returns
        -------
        Table
            The table.
        """
        is_long = len(frame) > MOST_ROWS
        return cls(frame, fold=f"All {len(frame)} rows" if is_long else "")


Element = Union[Card, "Figure", "Sheet", Table, Paragraphs, Lines, Text, Limits]
"""What a section holds."""


@dataclass(frozen=True)
class Section:
    """A part of a page.

    Attributes
    ----------
    title
        Its title; the first part has none.
    content
        What it holds, in its order.
    name
        Its anchor.
    label
        What the links at the head of the page call it; empty without a link.
    in_grid
        Whether its figures stand side by side.
    """

    title: str
    content: Sequence[Element]
    name: str = ""
    label: str = ""
    in_grid: bool = False

    @property
    def figures(self) -> "list[Figure]":
        """Its figures."""
        from orchestrator.report.style import Figure  # it imports matplotlib

        return [each for each in self.content if isinstance(each, Figure)]

    @property
    def told(self) -> str:
        """What a terminal says of it: its card, and its text if it has no title.

        The card has the marks of `terminal.bold`.
        """
        told: list[str] = []
        for each in self.content:
            if isinstance(each, Card):
                told += [*marked_lines(each), ""]
            elif isinstance(each, Lines):
                told += [each.text, ""]
            elif isinstance(each, Paragraphs) and not self.title:
                told += [*each.lines]
        return "\n".join(told)


@dataclass(frozen=True)
class Guest:
    """What another package adds to the page of a study.

    Attributes
    ----------
    sections
        Makes its sections, which take the place of the leading figure, from the names
        of the page's figures in their order.
    files
        Texts of files beside the page, by name.
    card
        The answer card, in place of the study's own.
    sheet
        The table below it.
    is_paper
        Whether figures that follow one of the paper have its number; such figures are
        drawn even where the page of another study folds them away.
    """

    sections: Callable[[Sequence[str]], Sequence[Section]]
    files: Mapping[str, str]
    card: Card | None = None
    sheet: "Sheet | None" = None
    is_paper: bool = False


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


def write_page(
    folder: Folder,
    name: str,
    title: str,
    sections: Sequence[Section],
    *,
    above: str = "",
    foot: Mapping[str, Any],
    links: Mapping[str, str] | None = None,
    is_paper: bool = False,
) -> None:
    """Write a page.

    Parameters
    ----------
    folder
        The directory of its results.
    name
        File name of the page.
    title
        Its title.
    sections
        Its parts, the answer first; their figures have images.
    above
        What stands above the first part, by default the title.
    foot
        What stands at its end, as of `foot.of_page`.
    links
        Addresses of cases by their names.
    is_paper
        Whether figures that follow one of the paper have its number.
    """
    kinds = {_kind(each) for section in sections for each in section.content}
    of = {name for name, kind in IN_LEGEND.items() if kind in kinds}
    text = fill(
        "page.html.j2",
        title=title,
        above=above or title,
        foot=page_text("foot", **foot, reading=page_text("reading", of=of)),
        sections=sections,
        links=links or {},
        is_paper=is_paper,
    )
    folder.put(name, text)


def write_experiment(
    title: str,
    sections: Sequence[Section],
    folder: Folder,
    name: str,
    solvers: Mapping[str, str],
    wall_s: float | None = None,
) -> None:
    """Write the page of an experiment, with its figures as PNG and SVG beside it.

    Its card stands in a file, too, for a page over several results.

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
    wall_s
        Wall time of the cases, s; None where it is not known.
    """
    from orchestrator.report import foot, noted, style  # style imports matplotlib

    listed = []
    for section in sections:
        content: list[Element] = []
        for each in section.content:
            if isinstance(each, style.Figure):
                each = style.saved(each, folder, png=True)
            content.append(each)
        listed.append(replace(section, content=content))
    files: list[Element] = [Table(versions(solvers))]
    if any(section.figures for section in sections):
        files.insert(0, Text(page_text("files_of_figures")))
    listed.append(Section("Files", files))
    for card in _cards(listed):
        leading = [figure.name for section in listed for figure in section.figures]
        folder.put(noted.CARD, noted.text_of(title, card, leading))
    write_page(folder, name, title, listed, foot=foot.of_page(folder, solvers, wall_s))


def _cards(sections: Sequence[Section]) -> Iterator[Card]:
    """The card of a page, of one that has it."""
    for section in sections[:1]:
        yield from (each for each in section.content if isinstance(each, Card))
