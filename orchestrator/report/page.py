"""The page of a study: one file that needs no other and no network."""

import base64
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from orchestrator.physics.measured import MEASURED_SOURCE
from orchestrator.report import answer, captions, facts, fits, laws, measured
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results

FOLDER = Path(__file__).parent


def said(results: Results, timings: pd.DataFrame, failures: Mapping[str, str]) -> dict[str, Any]:
    """The words and numbers of the page beside its figures, by the names of its template.

    Parameters
    ----------
    results : Results
        The results of the study.
    timings : DataFrame
        Wall times of the finished cases.
    failures : mapping of str to str
        Causes by name of case.
    """
    return {
        "title": results.study.title,
        "study": results.study,
        "scene_count": len(results.scenes),
        "case_count": len(results.plan.cases),
        "piles": facts.piles(results),
        "grains": answer.grains(results),
        "single_grains": facts.single_grains(results),
        "levels": facts.levels(results),
        "checks": facts.checks(results),
        "remarks": facts.remarks(results, failures),
        "paper_pair": bool(results.scenes["force_law"].isin(laws.PAIR).any()),
        "force_laws": facts.force_laws(results),
        "measured": measured_section(results),
        "answer": answer.sentences(results),
        "short": answer.sheet(results),
        "failures": failures,
        "links": links(results),
        "tables": list(results.tables),
        "parameters": facts.parameters(results),
        "programs": facts.programs(results),
        "times": facts.times(timings),
        **_flow_facts(results),
        **_grain_facts(results),
        **_examples(results),
    }


def render(
    parts: Mapping[str, Any], figures: Sequence[Figure], sections: Sequence[Markup] = ()
) -> str:
    """The page's HTML.

    Parameters
    ----------
    parts : mapping of str to Any
        The words and numbers that `said` gives.
    figures : sequence of Figure
        With their images.
    sections : sequence of Markup
        What guests add, before the figures.
    """
    entries = [{**entry(one), "number": n} for n, one in enumerate(figures, 1)]
    return fill("page.html.j2", **parts, sections=sections, figures=entries)


def fill(template: str, folder: Path = FOLDER, /, **values: Any) -> str:
    """The text of a template, by default of one beside this file."""
    css, script = (Markup(_text(name)) for name in ("page.css", "page.js"))
    digest = base64.b64encode(sha256(script.encode()).digest()).decode("ascii")
    given = {"css": css, "script": script, "script_digest": f"sha256-{digest}", **values}
    return template_of(template, folder).render(**given)


@cache
def _text(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


@cache
def template_of(name: str, folder: Path) -> Template:
    """A template, read once."""
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["json"] = _json
    return environment.get_template(name)


def typeset(text: str) -> Markup:
    """HTML of a text: ``V_f`` has an index, ``why_not`` none; what backticks hold is code."""
    index = r"\b([^\W\d_]|[^\W\d_a-z][^\W\d_]{1,2})_([A-Za-z]+)\b(?!_)"
    html = re.sub(index, r"\1<sub>\2</sub>", str(escape(text)))
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", html))


def _json(data: Any) -> Markup:
    """JSON that no browser takes for the end of its element."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))


def entry(figure: Figure) -> dict[str, Any]:
    """The values of a figure for the templates, with its image; an interactive one is inline."""
    kept = ("name", "title", "caption", "cases", "data", "fold", "leads")
    drawn = {
        "type": "svg+xml" if figure.image.lstrip().startswith((b"<svg", b"<?xml")) else "png",
        "base64": base64.b64encode(figure.image).decode("ascii"),
        "svg": Markup("" if figure.data is None else _inline(figure)),
    }
    return {**drawn, **{name: getattr(figure, name) for name in kept}}


def _inline(figure: Figure) -> str:
    """The SVG as a part of a page: without its prolog and metadata, with a title."""
    text = figure.image.decode("utf-8")
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    label = f'<svg role="img" aria-label="{escape(figure.title)}"'
    return text if 'role="img"' in text[:400] else text.replace("<svg", label, 1)


def links(results: Results) -> dict[str, str]:
    """A link to the directory of each case that has one, relative to the page."""
    root = results.cases.name
    names = (name for name in results.plan.cases if (results.cases / name).is_dir())
    return {name: quote(f"{root}/{name}/") for name in names}


def measured_section(results: Results) -> dict[str, Any] | None:
    """Force laws against measurements, where a study has single grains on a flat bed."""
    found = fits.fits(results)
    if not found:
        return None
    return {
        "source": MEASURED_SOURCE,
        "factors_from": fits.FACTORS_FROM,
        "says": measured.sentences(results.beds("grain"), found),
        "best": measured.sheet(fits.best(found)),
        "all": measured.sheet(found),
    }


def _flow_facts(results: Results) -> dict[str, Any]:
    if not results.flows:
        return {"wall_stress": False}
    mean, crest = captions.eq10_over_wall(results, results.flows)
    return {"wall_stress": True, "eq10_mean": mean, "eq10_crest": crest}


def _grain_facts(results: Results) -> dict[str, bool]:
    methods = set(results.scenes["answered_method"])
    scenes = [pile.scene for pile in results.plan.piles.values()]
    return {
        "by_dem": "dem" in methods,
        "without_dem": bool(methods - {"dem"}),
        "mixed": any(scene.grain.sizes is not None for scene in scenes),
        "strips": any(pile.bed.width for pile in results.plan.piles.values()),
    }


def _examples(results: Results) -> dict[str, str]:
    names = list(links(results))
    foams = (path for name in names for path in sorted((results.cases / name).glob("*.foam")))
    foam = next(foams, None)
    return {
        "example_case": names[-1] if names else "NAME",
        "example_foam": f"{foam.parent.name}/{foam.name}" if foam else "",
    }
