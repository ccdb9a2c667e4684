"""The winds of a place beside what they move: a rose, and hours a year."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Canvas
from matplotlib.projections.polar import PolarAxes

from orchestrator.report import style
from orchestrator.surface import cards, onset
from orchestrator.surface.answer import SurfaceAnswer
from orchestrator.surface.rose import SolvedRose

CLASSES = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0)
"""Lower ends of the speeds that are drawn apart, m/s."""
SECTORS = (8, 12, 16, 36)
"""Numbers of sectors of the drawn rose."""
HEIGHT = 3.3
"""Height of the figure, inches."""
SHARES = {onset.STARTS: "1 %", cards.TENTH: "10 %", cards.HALF: "50 %"}
"""Parts of the surface whose hours are drawn."""


def rose_figure(answer: SurfaceAnswer) -> Canvas:
    """Draw the winds of a place, and the hours a year in which parts of a bed move.

    Parameters
    ----------
    answer
        The answer on the bed, with its rose.

    Returns
    -------
    Canvas
        The figure.
    """
    assert answer.rose is not None
    canvas = Canvas(figsize=(style.WIDTH, HEIGHT), layout="constrained")
    grid = canvas.add_gridspec(1, 2, width_ratios=[1.4, 1.0])
    polar = canvas.add_subplot(grid[0], projection="polar")
    assert isinstance(polar, PolarAxes)
    _rose(polar, answer.rose)
    ax = canvas.add_subplot(grid[1])
    found = [cards.hours(answer, share) for share in SHARES]
    values = np.array([each.value for each in found])
    ends = np.array([[each.low, each.high] for each in found]).T
    off = np.abs(ends - values)
    ax.bar([*SHARES.values()], values, width=0.6, color="0.75")
    ax.errorbar([*SHARES.values()], values, off, fmt="none", ecolor="black", capsize=4)
    ax.set_xlabel("part of the surface that moves, at least")
    ax.set_ylabel("hours a year")
    ax.set_ylim(0, None)
    return canvas


def _rose(ax: PolarAxes, solved: SolvedRose) -> None:
    """Draw hours a year by direction, stacked by speed."""
    table = solved.table[solved.table["speed_m_s"] > 0]
    written = {way for way, speed, _ in solved.rose.rows if speed > 0}
    count = next((each for each in SECTORS if each >= len(written)), SECTORS[-1])
    width = 360 / count
    sector = np.round(table["from_deg"].to_numpy(float) / width).astype(int) % count
    speeds = table["speed_m_s"].to_numpy(float)
    hours = onset.HOURS * table["share"].to_numpy(float)
    calm = onset.HOURS * float(solved.table["share"].sum()) - hours.sum()
    # calms are a disc, shared by all directions
    below = np.full(count, calm / count)
    angles = np.radians(width * np.arange(count))
    ends = [*CLASSES[1:], np.inf]
    for place, (low, high) in enumerate(zip(CLASSES, ends, strict=True)):
        is_here = (speeds > low) & (speeds <= high)
        if not is_here.any():
            continue
        added = np.bincount(sector[is_here], hours[is_here], minlength=count)
        name = f"above {low:g}" if np.isinf(high) else f"{low:g} to {high:g}"
        colour = to_hex(colormaps["viridis"](0.95 - 0.9 * place / len(CLASSES)))
        ax.bar(
            angles,
            added,
            np.radians(0.9 * width),
            bottom=below,
            color=colour,
            label=f"{name} m/s",
        )
        below = below + added
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    ax.set_xticks(np.radians(45.0 * np.arange(8)))
    ax.set_xticklabels(["N", "NE", "E", "SE", "S", "SW", "W", "NW"])
    ax.tick_params(labelsize="small")
    ax.legend(loc="center left", bbox_to_anchor=(1.12, 0.5), fontsize="small")
