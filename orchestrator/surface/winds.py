"""The winds of a place beside what they move: a rose, and hours a year."""

import numpy as np
from matplotlib.figure import Figure as Canvas
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from orchestrator.report import style
from orchestrator.surface import cards, onset
from orchestrator.surface.answer import SurfaceAnswer
from orchestrator.types import FloatArray

SECTORS = (8, 12, 16, 36)
"""Numbers of sectors of the drawn rose."""
HEIGHT = 3.6
"""Height of each of its parts, inches."""
SHARES = {onset.STARTS: "1 %", cards.TENTH: "10 %", cards.HALF: "50 %"}
"""Parts of the surface whose hours are drawn."""
LOOKS = {
    "below threshold": "#dccfae",
    "some of the surface in motion": "#e59a5b",
    "at least half of it": "#9c3f00",
}
"""Hours of the rose by what moves in them, and their colours."""


def rose_figure(answer: SurfaceAnswer, width: float) -> Canvas:
    """Draw the winds of a place, and the hours a year in which parts of a bed move.

    Parameters
    ----------
    answer
        The answer on the bed, with its rose.
    width
        Width of the drawing, inches.

    Returns
    -------
    Canvas
        The figure.
    """
    is_wide = width >= style.WIDE
    shape = (1, 2) if is_wide else (2, 1)
    size = (width, HEIGHT * shape[0] + 0.8)
    canvas = Canvas(figsize=size, layout="constrained")
    grid = canvas.add_gridspec(*shape)
    polar = canvas.add_subplot(grid[0], projection="polar")
    assert isinstance(polar, PolarAxes)
    _rose(polar, answer)
    ax = canvas.add_subplot(grid[1])
    found = [cards.hours(answer, share) for share in SHARES]
    values = np.array([each.value for each in found])
    ends = np.array([[each.low, each.high] for each in found]).T
    off = np.abs(ends - values)
    names = [*SHARES.values()]
    ax.bar(names, values, width=0.6, color=style.PALE, ec=style.ANSWER)
    ax.errorbar(names, values, off, fmt="none", ecolor=style.INK, capsize=4)
    ax.set_xlabel("fraction of the surface in motion, at least")
    ax.set_ylabel("hours a year")
    ax.set_ylim(0, None)
    samples = [style.entry(name, colour) for name, colour in LOOKS.items()]
    style.legends_below(canvas, [], samples)
    return canvas


def _rose(ax: PolarAxes, answer: SurfaceAnswer) -> None:
    """Draw hours a year by direction, by what moves in them."""
    calm, moving = _hours_of_sectors(answer)
    count = len(calm)
    angles = np.radians(360 / count * np.arange(count))
    below = calm
    above = [*moving[1:], np.zeros(count)]
    for (name, colour), least, more in zip(LOOKS.items(), moving, above, strict=True):
        look: style.Look = {"color": colour, "label": name}
        width = np.radians(0.9 * 360 / count)
        ax.bar(angles, least - more, width, bottom=below, **look)
        below = below + least - more
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    ax.set_xticks(np.radians(90.0 * np.arange(4)))
    ax.set_xticklabels(["N", "E", "S", "W"])
    ax.yaxis.set_major_locator(MaxNLocator(3))
    ax.set_title("hours a year", loc="left")


def _hours_of_sectors(answer: SurfaceAnswer) -> tuple[FloatArray, list[FloatArray]]:
    """Hours a year of each sector: its part of the calms, and of winds.

    Of these all, those in which some of the surface moves, and half of it.
    """
    solved = answer.rose
    assert solved is not None
    table = solved.table[solved.table["speed_m_s"] > 0]
    written = {way for way, speed, _ in solved.rose.rows if speed > 0}
    count = next((each for each in SECTORS if each >= len(written)), SECTORS[-1])
    width = 360 / count
    sector = np.round(table["from_deg"].to_numpy(float) / width).astype(int) % count
    hours = onset.HOURS * table["share"].to_numpy(float)
    every = np.bincount(sector, hours, count).astype(float)
    calm = onset.HOURS * float(solved.table["share"].sum()) - hours.sum()
    moving: list[FloatArray] = [every]
    for share in (onset.STARTS, cards.HALF):
        of_sector = [
            answer.hours_of(share, rows=table[sector == place])
            for place in range(count)
        ]
        moving.append(np.array(of_sector))
    # calms are a disc, shared by all directions
    return np.full(count, calm / count), moving
