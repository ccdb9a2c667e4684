"""How grains are drawn: windows, colours and symbols by what they did, the ground under them."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from orchestrator.grains.motion import MODES
from orchestrator.grains.pile import Pile
from orchestrator.report.pictures.snapshot import Snapshot

LYING, FIXED, INSIDE = "#e6decc", "#8c8c8c", "#c9c9c9"
WAITING = "#fff7d0"
UNCOUNTED = "#666666"
HOW = {"rolled": ("#d55e00", "o"), "slid": ("#008060", "_"), "lifted": ("#6a2c91", "^")}
"""Colour and symbol of a grain by how it moved: either tells."""
EDGE = "#595959"
INKS = (
    "white", "black", EDGE, UNCOUNTED, LYING, FIXED, INSIDE, WAITING, *(c for c, _ in HOW.values())
)  # fmt: skip
"""All colours of a drawing with these marks alone."""
LONG = 25.0
"""Half length of a pile, d, beyond which its crest is shown alone."""
Window = tuple[float, float, float, float]
"""Left, right, bottom, top."""


def windows(pile: Pile) -> list[Window]:
    """The whole pile and, if that is long, its crest; d."""
    x, z = (float(edge) for edge in pile.line.crest)
    whole = -6.0, 2 * x + 6, -2.5, z + 6
    return [whole, (x - 28, x + 14, z - 9, z + 5)] if x > LONG else [whole]


def shape(window: Window) -> float:
    """Height of a window over its width."""
    left, right, bottom, top = window
    return (top - bottom) / (right - left)


def by_mode(found: Snapshot) -> NDArray[np.str_]:
    """A colour for each grain by how it has moved, or why not."""
    moved = np.array([WAITING, *(HOW[name][0] for name in MODES[1:])])
    kept = np.where(found.mobile, LYING, FIXED)
    return np.where(found.exposed, moved[found.mode], kept)


def edges(found: Snapshot) -> list[str]:
    """Outlines of the grains that have left the box."""
    return [str(c) for c in np.where(found.mode > 0, by_mode(found), UNCOUNTED)[found.gone]]


def ground(ax: Axes, pile: Pile, window: Window) -> None:
    """Fill what lies under the bed line of the flow, and show no more than a window."""
    (x, z), (left, right, bottom, top) = pile.line.crest, window
    line = np.unique(np.clip([left, 0, x, 2 * x, right], left, right))
    height = np.interp(line, [0, x, 2 * x], [0, z, 0])
    ax.fill_between(line, height, bottom, color=INSIDE, lw=0, zorder=0.5, gid="inside")
    ax.set(xlim=(left, right), ylim=(bottom, top), ylabel="$z/d$", aspect="equal")


def discs(ax: Axes, places: NDArray[np.float64], **look: Any) -> EllipseCollection:
    """Circles one d wide."""
    drawn = EllipseCollection(
        1, 1, 0, units="xy", offsets=places, offset_transform=ax.transData, **look
    )
    ax.add_collection(drawn)
    return drawn


def symbols(ax: Axes, window: Window) -> dict[str, tuple[Line2D, Line2D]]:
    """For each way to move the symbols, none yet, of grains that are here and that are gone."""
    size = 170 / (window[1] - window[0])
    shared: dict[str, Any] = {"ls": "", "ms": size, "mew": 0.25 * size}
    found = {}
    for name, (colour, marker) in HOW.items():
        here = Line2D([], [], color="white", marker=marker, zorder=3, gid=f"{name}, here", **shared)
        # lower: another grain may be where it lay
        gone = Line2D(
            [], [], color=colour, marker=marker, zorder=1.6, gid=f"{name}, gone", **shared
        )
        found[name] = ax.add_line(here), ax.add_line(gone)
    return found


def place(marks: dict[str, tuple[Line2D, Line2D]], found: Snapshot) -> None:
    """Put the symbols where the grains are, or lay."""
    for name, (here, gone) in marks.items():
        own = found.mode == MODES.index(name)
        here.set_data(*found.place[own & ~found.gone].T)
        gone.set_data(*found.start[own & found.gone].T)


def mode_legend(figure: Canvas, pile: Pile) -> None:
    """What colours and symbols by mode mean, under the panels."""
    entries: dict[str, tuple[Line2D | Patch, ...]] = {
        name: (_disc(colour, colour), _sample(marker, "white"))
        for name, (colour, marker) in HOW.items()
    }
    colour, marker = HOW["rolled"]
    entries["the same, left the box: where it lay"] = (
        _disc("white", colour),
        _sample(marker, colour),
    )
    entries["exposed, has not moved"] = (_disc(WAITING, EDGE),)
    if (pile.packing.mobile & ~pile.packing.windward).any():
        entries["mobile under it"] = (_disc(LYING, "none"),)
    entries["fixed"] = (_disc(FIXED, "none"),)
    entries["inside, not in the case"] = (Patch(color=INSIDE, lw=0),)
    handles: list[Any] = list(entries.values())  # its stubs know no samples of two marks
    figure.legend(handles, list(entries), loc="outside lower center", ncols=4)


def _disc(face: str, edge: str) -> Line2D:
    return Line2D([], [], ls="", marker="o", ms=7, mfc=face, mec=edge, mew=0.8)


def _sample(marker: str, ink: str) -> Line2D:
    return Line2D([], [], ls="", marker=marker, ms=3.4, mew=1.0, mec=ink, mfc=ink)
