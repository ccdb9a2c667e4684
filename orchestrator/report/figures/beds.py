"""Beds: Shields diagrams by slope, as Figs. 15 and 16 of the paper."""

from collections.abc import Iterator

from orchestrator.report import labels, shields, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.figures.shields import FEW
from orchestrator.report.page import filled
from orchestrator.report.results import Results, case_names, drawable, split_by
from orchestrator.report.style import Figure

LEAD = (
    "Critical Shields number of the beds of this study against the grain Reynolds "
    "number, by the fraction entrained."
)
"""What stands under the drawing."""
CAPTION = """\
{% from "captions.j2" import laws, protocol, is_open, low_regime, references %} After
Figs. 15 and 16 of the paper. A marker shows the mean {{ about.stress }} over the grains
that had moved when they first were the fraction n/N of the counted ones; Re* is that of
this stress. A fraction that was not reached has no marker. Thin lines join beds that
differ in d alone. A bar holds the step between two flows and the resolution of the
count, which is half a grain. An arrow stands where half a grain more was not
reached. Black: the closed form of one grain at the same slope, entrainment angle and
z₀/d. A line ends where its force law does. It is dotted where this study has grains
beyond the law {%- if about.pair %}; the Re* of such a grain can lie outside the shaded
range by one of the two laws{% endif %}. Force laws: {{ laws(about) }}. {{
protocol(answers) }} {{ is_open(answers) }} {{ low_regime(about) }} {{
references(about) }}"""
FOLLOWED = {"d/10": "Fig. 15", "d/30": "Fig. 16"}
"""Figures of the paper, by the roughness."""


def draw(results: Results) -> Iterator[Figure]:
    """Make the extended Shields diagrams by slope.

    Parameters
    ----------
    results
        The study.

    Yields
    ------
    Figure
        The figures for each z0/d.
    """
    every = results.joined("pile_threshold")
    reached = every[drawable(every, "reynolds", "shields")]
    if reached.empty:
        return
    colours = style.palette("fraction", sorted(set(reached["fraction"])))
    has_one_slope = reached["alpha_deg"].nunique() == 1
    # the one diagram shows all of few piles on one slope
    is_shown = has_one_slope and every["scene_id"].nunique() <= FEW
    smoothest = reached["z0_over_d"].min()
    for (ratio,), of_ratio in split_by(reached, "z0_over_d"):
        written_ = labels.ratio_in_words(float(str(ratio)), "d")
        stem = f"extended-shields-{written_}".replace("/", "").replace(" ", "")
        title = f"Thresholds of beds by slope, z₀ = {written_}"
        follows = FOLLOWED.get(written_, "")
        for part in shields.by_stress(of_ratio):
            for sheet, shown, drawing in shields.panels(part.rows, "fraction", colours):
                is_further = bool(sheet.name)
                is_folded = is_further or is_shown or ratio != smoothest
                about = shields.about(sheet.rows)
                is_followed = bool(follows) and not is_further
                yield Figure(
                    stem + part.name + sheet.name,
                    title + part.title + sheet.title,
                    filled(CAPTION, about=about, answers=shields.about(shown)),
                    case_names(shown),
                    drawing,
                    place="folded" if is_folded else "",
                    follows=follows + part.after if is_followed else "",
                    lead=LEAD,
                )


FIGURE = FigureKind(order=110, draws=draw, needs=("pile_threshold",))
