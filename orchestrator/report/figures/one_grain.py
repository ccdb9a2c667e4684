"""Single grains: Shields diagrams by entrainment angle, force law and slope."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from orchestrator.report import labels, shields, style, theory
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results, case_names, split_by
from orchestrator.report.style import Figure

LEAD = (
    "Critical Shields number of one grain against the grain Reynolds number, by the "
    "closed form and, where it was run, by DEM."
)
"""What stands under the drawing."""
CAPTION = """\
{% from "captions.j2" import laws, protocol, is_open, references %} {% if by !=
"force_law" %}After Fig. {{ 5 if by == "beta_deg" else 7 }} of the paper. {% endif %}
Threshold stress of one grain against the friction Reynolds number, by {{ {"beta_deg":
"entrainment angle β", "alpha_deg": "slope α (the flow goes up it)", "force_law": "force
law"}[by] }}, with δ = z₀. The place of a grain along its line follows from d, ν and the
densities. A line ends where its force law does. It is dotted where this study has
grains beyond the law {%- if about.pair %}; the Re* of such a grain can lie outside the
shaded range by one of the two laws{% endif %}. Force laws: {{ laws(about) }}. {% if
answers %} {% if by != "force_law" %}After Fig. {{ 6 if by == "beta_deg" else 8 }} of
the paper. {% endif %} Markers: thresholds of one mobile sphere on two fixed neighbours,
by LIGGGHTS. A bar runs from the last load step without motion to the first with motion;
most bars are smaller than the markers. {{ protocol(answers) }} {{ is_open(answers) }}
{% endif %} {{ references(about) }}"""
FOLLOWED = {
    ("beta_deg", False): "Fig. 5",
    ("beta_deg", True): "Figs. 5 and 6",
    ("alpha_deg", False): "Fig. 7",
    ("alpha_deg", True): "Figs. 7 and 8",
}
"""Figures of the paper, by the column that parts ours, and whether it has points."""


def draw(results: Results) -> Iterator[Figure]:
    """Draw Figs. 5 to 8: on a flat bed by entrainment angle or law, and on slopes.

    Yields
    ------
    Figure
        A figure for each.
    """
    grains = shields.diagram_rows(results)
    flat = grains[grains["alpha_deg"] == 0]
    has_dem = bool(grains["shields_dem"].notna().any())
    kind = "dem" if has_dem else "closed-form"
    ending = "closed form and DEM" if has_dem else "closed form"
    colours: dict[Any, str]
    has_many_laws = len(set(theory.dashes(flat["force_law"]).values())) > theory.MANY
    if has_many_laws:
        colours = {
            law: theory.look(law)[0] for law in theory.drawn_laws(flat["force_law"])
        }
        for (ratio,), group in split_by(flat, "z0_over_d"):
            written = labels.ratio_in_words(float(str(ratio)), "d")
            title = f"Force laws on a horizontal bed, z₀ = {written}"
            yield from _figures(
                group, "force_law", colours, f"shields-{written}", title
            )
    elif len(flat):
        colours = style.palette("beta_deg", results.values("beta_deg"))
        title = f"One grain on a horizontal bed: {ending}"
        yield from _figures(flat, "beta_deg", colours, f"{kind}-horizontal", title)
    colours = style.palette("alpha_deg", results.values("alpha_deg"))
    for (beta,), group in split_by(grains, "beta_deg"):
        if (group["alpha_deg"] > 0).any():
            name = f"{kind}-slope-beta{beta:g}"
            title = f"One grain on a slope, β = {beta:g}°: {ending}"
            yield from _figures(group, "alpha_deg", colours, name, title)


def _figures(
    rows: pd.DataFrame, by: str, colours: Mapping[Any, str], name: str, title: str
) -> Iterator[Figure]:
    """The figures by a column; that of slopes is drawn on demand."""
    stem = name.replace("/", "").replace(" ", "")
    for sheet, shown, drawing in shields.panels(rows, by, colours):
        about = shields.about(sheet.rows)
        text = filled(CAPTION, by=by, about=about, answers=shields.about(shown))
        is_further = bool(sheet.name)
        numbers = {} if is_further else FOLLOWED
        yield Figure(
            stem + sheet.name,
            title + sheet.title,
            text,
            case_names(shown),
            drawing,
            place="folded" if is_further or by == "alpha_deg" else "",
            follows=numbers.get((by, bool(len(shown))), ""),
            lead=LEAD,
        )


FIGURE = FigureKind(order=100, draws=draw, uses=("single_grain",))
