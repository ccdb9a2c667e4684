"""What a reader sees of a drawing: letters of 12 pixels, few entries in a legend."""

import numpy as np
from matplotlib.figure import Figure as Canvas
from matplotlib.text import Text

from orchestrator.report import style

SHOWN = {style.NARROW: 350, style.WIDE: 1000}
"""Width at which a page shows drawings of a width, at least, pixels."""
LEAST = 12
MOST = 7
POINTS = 72


def small(canvas: Canvas) -> list[tuple[str, float]]:
    """The texts that are shown with letters of less than `LEAST` pixels."""
    canvas.draw_without_rendering()
    width = float(canvas.get_figwidth())
    (shown,) = (SHOWN[known] for known in SHOWN if np.isclose(known, width))
    found = []
    for text in canvas.findobj(Text):
        if not text.get_text().strip() or not text.get_visible():
            continue
        pixels = float(text.get_fontsize()) * shown / (POINTS * width)
        if pixels < LEAST:
            found.append((text.get_text(), round(pixels, 1)))
    return found


def entries(canvas: Canvas) -> list[str]:
    """The entries of its longest legend."""
    legends = [*canvas.legends, *(ax.get_legend() for ax in canvas.axes)]
    said = [[text.get_text() for text in one.texts] for one in legends if one]
    return max(said, key=len, default=[])


def check(*drawings: Canvas) -> None:
    """See that all letters of some drawings can be read, and their legends held."""
    for canvas in drawings:
        assert small(canvas) == []
        assert len(entries(canvas)) <= MOST
