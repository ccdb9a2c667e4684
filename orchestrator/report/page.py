"""Pages: templates, captions, values in HTML, and the page of an experiment in sections."""

import base64
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Any

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from orchestrator import __version__
from orchestrator.runs.files import Folder

if TYPE_CHECKING:
    from orchestrator.report.style import Figure

HERE = Path(__file__).parent
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


def fill(template: str, folder: Path = HERE, /, **values: Any) -> str:
    """The text of a template, by default of one beside this file."""
    css, script = (
        Markup((HERE / name).read_text("utf-8")) for name in ("page.css", "page.js")
    )
    digest = base64.b64encode(sha256(script.encode()).digest()).decode("ascii")
    given = {
        "css": css,
        "script": script,
        "script_digest": f"sha256-{digest}",
        **values,
    }
    return _templates(folder).get_template(template).render(**given)


def caption(name: str, /, **values: Any) -> str:
    """A caption or a sentence from its macro in ``captions.j2``, as plain text on one line."""
    macro = getattr(
        _templates(HERE, autoescape=False).get_template("captions.j2").module, name
    )
    return " ".join(str(macro(**values)).split())


@cache
def _templates(folder: Path, autoescape: bool = True) -> Environment:
    strict: dict[str, Any] = {"undefined": StrictUndefined, "trim_blocks": True}
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=autoescape, **strict
    )
    filters = {"typeset": typeset, "n": format, "address": address, "inline": _inline}
    environment.filters.update({**filters, "cell": _cell})
    short = {"separators": (",", ":"), "ensure_ascii": False, "allow_nan": False}
    environment.policies["json.dumps_kwargs"] = short
    return environment


@cache
def typeset(text: str) -> Markup:
    """HTML of a text: ``V_f`` has an index, ``why_not`` none; words in backticks are code."""
    index = r"\b([^\W\d_]|[^\W\d_a-z][^\W\d_]{1,2})_([A-Za-z]+)\b(?!_)"
    html = re.sub(index, r"\1<sub>\2</sub>", str(escape(text)))
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", html))


def address(image: bytes) -> str:
    """A PNG or SVG image as the address of a picture in a page."""
    kind = "png" if image.startswith(b"\x89PNG") else "svg+xml"
    return f"data:image/{kind};base64,{base64.b64encode(image).decode('ascii')}"


def _inline(figure: "Figure") -> Markup:
    """The SVG of a figure as a part of the page: without prolog and metadata, with a title."""
    svg = figure.image.decode("utf-8")
    svg = re.sub(
        r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL
    )
    label = f'<svg role="img" aria-label="{escape(figure.title)}"'
    return Markup(svg if 'role="img"' in svg[:400] else svg.replace("<svg", label, 1))


def _cell(value: Any) -> str:
    """A value of a table: a number to four digits, a dash for a missing value."""
    if pd.isna(value):
        return "—"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class Guest:
    """What another package adds to a page: a sentence at its head, a section, texts of files.

    `section`, of an anchor `name`, gets the names of the page's figures in their order.
    """

    name: str
    said: str
    section: Callable[[Sequence[str]], Markup]
    files: Mapping[str, str]


@dataclass(frozen=True)
class Section:
    """A part of an experiment's page, its answer if untitled; `limits` is what not to conclude."""

    title: str
    text: str = ""
    figures: Sequence["Figure"] = ()
    tables: Sequence[pd.DataFrame] = ()
    limits: Sequence[str] = ()


def versions(solvers: Mapping[str, str]) -> pd.DataFrame:
    """Solvers with their versions, this package, and the libraries that are not among them."""
    rows = [
        *sorted(solvers.items()),
        ("orchestrator", __version__),
        ("Python", python_version()),
    ]
    rows += [(name, metadata.version(name)) for name in PACKAGES if name not in solvers]
    return pd.DataFrame(rows, columns=["program", "version"])


def write(
    title: str,
    sections: Sequence[Section],
    folder: Folder,
    name: str,
    solvers: Mapping[str, str],
) -> None:
    """Put the page of an experiment, a file `name`, with its figures as PNG and SVG beside it."""
    from orchestrator.report import style  # it imports matplotlib

    images = (
        [style.saved(item, folder, png=True) for item in part.figures]
        for part in sections
    )
    shown = [
        replace(part, figures=each) for part, each in zip(sections, images, strict=True)
    ]
    values = {"sections": shown, "programs": versions(solvers), "links": {}}
    folder.put(name, fill("document.html.j2", title=title, **values))
