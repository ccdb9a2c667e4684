"""Figure of beds that change: the threshold at each n/N beside that of the frozen bed."""

from collections.abc import Iterator

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D

from orchestrator.report import captions, labels, style
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results, split

PANELS = ("alpha_deg", "packing", "method")
MOST = 6
"""Panels of a figure."""


def draw(results: Results) -> Iterator[Figure]:
    """Panels by slope, packing and method; none of a study where no bed changes."""
    rows = results.joined("bed_change")
    if rows.empty:
        return
    colours = style.palette("d_m", sorted(set(rows["d_m"])))
    panels = [part for _, part in split(rows, *PANELS)]
    for start in range(0, len(panels), MOST):
        some = panels[start : start + MOST]
        named = pd.concat(some)["scene_id"].unique()
        cases = tuple(results.plan.piles[one].runs[-1].name for one in named)
        name, title = "wear", "Frozen bed and bed that changes"
        if start:
            number = start // MOST + 1
            name, title = f"{name}-{number}", f"{title} ({number})"
        yield Figure(name, title, captions.wear(), cases, _canvas(some, colours))


def _canvas(panels: list[pd.DataFrame], colours: dict[float, str]) -> Canvas:
    figure, axes = style.grid(len(panels), 2.1)
    for ax, part in zip(axes, panels, strict=True):
        for _, own in split(part, "scene_id"):
            _pile(ax, own, colours[float(own["d_m"].iloc[0])])
        ax.set_title(labels.panel(part.iloc[0], list(PANELS)), loc="left")
    axes[0].set(xlim=(0, None), ylim=(0, None))  # the panels share both
    for ax in axes[-2:]:
        ax.set_xlabel("$n/N$")
    for ax in axes[::2]:
        ax.set_ylabel("Shields number $θ$")
    entries = [style.entry(labels.written("d_m", d), colour) for d, colour in colours.items()]
    looks = [
        Line2D([], [], color="0.2", ls="--", lw=0.9, label="flow of the whole pile"),
        Line2D([], [], color="0.2", lw=1.3, label="flow of the bed as it is"),
        Line2D([], [], color="0.2", ls="", marker="o", ms=4, label="first 5 % apart"),
    ]
    style.legends(figure, entries, looks)
    return figure


def _pile(ax: Axes, own: pd.DataFrame, colour: str) -> None:
    ax.plot(own["fraction_moved"], own["shields_frozen"], color=colour, ls="--", lw=0.9)
    ax.plot(own["fraction_moved"], own["shields"], color=colour, lw=1.3)
    end = own[own["fraction_moved"] == own["holds_until"]]
    ax.plot(end["fraction_moved"], end["shields"], color=colour, ls="", marker="o", ms=4)
