"""The friction velocity along beds by the solved flow."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from orchestrator.digits import signed_percent
from orchestrator.grains.pile import Pile
from orchestrator.report import labels, solved, style
from orchestrator.report.figures import FigureKind
from orchestrator.report.page import filled
from orchestrator.report.results import Results
from orchestrator.report.solved import FELT, REVERSED, USTAR
from orchestrator.report.style import Figure, Look

ESTIMATES: dict[str, Look] = {
    "wall": {
        "label": "wall stress",
        "color": "black",
        "lw": 1.3,
    },
    "eq10": {
        "label": "Eq. 10, ln((zₑ + z₀)/z₀)",
        "color": "#0072b2",
        "lw": 1.0,
    },
}
"""Looks of the estimates of the friction velocity, by the ending of their column."""
LEAD = (
    "Signed friction velocity along the bed over that upstream, u*₀; below zero the "
    "flow at the bed is reversed."
)
"""What stands under the drawing."""
CAPTION = """\
Signed friction velocity along the bed over the undisturbed u*₀ = 0.41 U_e/ln((10 h +
z₀)/z₀). Black: from the wall shear stress of the OpenFOAM solution. Blue: Eq. 10 at the
centre of the first cell, with the logarithm of the rough wall. Eq. 10 differs from the
u* of the wall stress by {{ mean }} on the mean of the windward face and by {{ crest }}
at the crest; every threshold of a pile has this model uncertainty. The stress at the
crest is a spike of one cell that does not converge with the mesh. A grain therefore
feels the stress averaged over {{ averaged }} of bed (orange). Shaded: flow that runs
back. Below: the bed of height h, exaggerated. All panels share the axes."""


def draw(results: Results) -> Iterator[Figure]:
    """The friction velocity along beds, for each slope at its least and largest z0.

    Yields
    ------
    Figure
        The figures.
    """
    piles = []
    for smoothest, *rougher in solved.piles_by_kind(results):
        piles += [smoothest, *rougher[-1:]]
    if not piles:
        return
    names = tuple(pile.flow.name for pile in piles)
    mean, crest = solved.eq10_over_wall(results, names)
    lengths = [
        labels.value("averaging_length", pile.scene.forces.averaging_length)
        for pile in piles
    ]
    averaged = ", ".join(dict.fromkeys(lengths))
    text = filled(
        CAPTION,
        mean=signed_percent(mean),
        crest=signed_percent(crest),
        averaged=f"max(d, {averaged})",
    )
    title = "Friction velocity over the pile"
    drawing = partial(_stress, results, piles)
    yield Figure("wall-stress", title, text, names, drawing, place="folded", lead=LEAD)


def _stress(results: Results, piles: list[Pile]) -> Canvas:
    titles = [solved.title(results, pile) for pile in piles]
    figure, axes = style.grid(titles, 2.6, "x/h", USTAR)
    for ax, pile in zip(axes, piles, strict=True):
        _along(results, pile, ax)
    toes = [pile.model.line.x[-2] / pile.bed.height for pile in piles]
    axes[0].set_xlim(-4, max(toes) + 10)
    style.legends_below(figure, [], style.samples(axes))
    return figure


def _along(results: Results, pile: Pile, ax: Axes) -> None:
    """Friction velocities along the bed of a pile, over the bed."""
    bed = pile.bed
    h = bed.height
    rows = solved.stress_on(pile, results)
    rows = rows.replace([np.inf, -np.inf], np.nan)
    x = bed.along(rows["x_m"]) / h
    wall = rows["ustar_over_ustar0_wall"].to_numpy()
    for name, look in ESTIMATES.items():
        ax.plot(x, rows[f"ustar_over_ustar0_{name}"], gid=name, **look)
    ax.axhline(0, color="0.4", lw=0.6)
    ax.fill_between(x, wall, 0, where=(wall < 0).tolist(), **REVERSED)
    grains = results.joined("pile_grain")
    if len(grains):
        grains = grains[grains["flow_case"] == pile.flow.name]
    if len(grains):
        # of the scenes that share the flow, the last
        grains = grains[grains["scene_id"] == grains["scene_id"].max()]
        bed = results.plan.piles[str(grains["scene_id"].iloc[0])].bed
        ax.plot(bed.along(grains["x_m"]) / h, grains["ustar_over_ustar0"], **FELT)
    ax.margins(y=0.25)
    line = pile.model.line
    low = min(line.z) / h
    high = max(line.z) / h
    below = ax.twinx()
    below.set(ylim=(low - 0.2, low + 6 * (high - low)), yticks=[])
    solved.draw_bed(below, pile)
    ax.set(zorder=1, frame_on=False)  # the lines lie over the bed


FIGURE = FigureKind(order=160, draws=draw, needs=("wall_stress",))
