"""The templates: pages, captions, and values in HTML."""

import base64
import json
import re
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

if TYPE_CHECKING:
    from orchestrator.report.style import Figure

FOLDER = Path(__file__).parent


def fill(template: str, folder: Path = FOLDER, /, **values: Any) -> str:
    """The text of a template, by default of one beside this file."""
    css, script = (Markup((FOLDER / name).read_text("utf-8")) for name in ("page.css", "page.js"))
    digest = base64.b64encode(sha256(script.encode()).digest()).decode("ascii")
    given = {"css": css, "script": script, "script_digest": f"sha256-{digest}", **values}
    return _templates(folder).get_template(template).render(**given)


def caption(name: str, /, **values: Any) -> str:
    """A caption or a sentence from its macro in ``captions.j2``, as plain text on one line."""
    macro = getattr(_templates(FOLDER, autoescape=False).get_template("captions.j2").module, name)
    return " ".join(str(macro(**values)).split())


@cache
def _templates(folder: Path, autoescape: bool = True) -> Environment:
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=autoescape,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["json"] = _json
    environment.filters["n"] = format  # a number by a format specification
    return environment


def typeset(text: str) -> Markup:
    """HTML of a text: ``V_f`` has an index, ``why_not`` none; words in backticks are code."""
    index = r"\b([^\W\d_]|[^\W\d_a-z][^\W\d_]{1,2})_([A-Za-z]+)\b(?!_)"
    html = re.sub(index, r"\1<sub>\2</sub>", str(escape(text)))
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", html))


def _json(data: Any) -> Markup:
    """JSON that no browser takes for the end of its element."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))


def entry(figure: "Figure") -> dict[str, Any]:
    """The values of a figure for the templates, with its image; an interactive one is inline."""
    names = ("name", "title", "caption", "cases", "data", "fold", "leads")
    values = {name: getattr(figure, name) for name in names}
    is_svg = figure.image.lstrip().startswith((b"<svg", b"<?xml"))
    values["type"] = "svg+xml" if is_svg else "png"
    if figure.data is None:
        return {**values, "base64": base64.b64encode(figure.image).decode("ascii")}
    # a part of the page: without prolog and metadata, with a title
    text = figure.image.decode("utf-8")
    svg = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    label = f'<svg role="img" aria-label="{escape(figure.title)}"'
    svg = svg if 'role="img"' in svg[:400] else svg.replace("<svg", label, 1)
    return {**values, "svg": Markup(svg)}
