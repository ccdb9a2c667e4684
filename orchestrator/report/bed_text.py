"""The form of a bed in a line of a terminal, and the point of first motion below it."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from orchestrator.grains.pile import Pile
from orchestrator.report import answers, single
from orchestrator.report.results import Results
from orchestrator.report.subjects import digits_of_place, length, place_of_file

BLOCKS = "▁▂▃▄▅▆▇█"
"""Heights, from the lowest."""
COLUMNS = 54
"""Letters of the bed."""
HEAD = 12
"""Letters before it."""


def bed_lines(results: Results) -> Iterator[str]:
    """Draw the bed of a study, seen in the direction of the flow.

    Parameters
    ----------
    results
        The study with its tables.

    Yields
    ------
    str
        Two lines; none of a level bed, of grains, of hills that others measured, and of
        beds of several forms.
    """
    rows = results.exemplars
    if rows.empty or answers.is_of_hills(results):
        return
    piles = [results.plan.piles[str(scene)] for scene in rows["scene_id"]]
    is_one = len({pile.model.line for pile in piles}) == 1
    starts = rows[rows["first_ustar0_m_s"] > 0]
    if not is_one or starts.empty or any(_is_level(rows)):
        return
    lowest = starts.sort_values("first_ustar0_m_s", kind="stable").iloc[0]
    told = single.quantity_of_row(lowest).flow
    yield from _drawn(piles[0], float(lowest["first_x_m"]), told)


def _is_level(rows: pd.DataFrame) -> Iterator[bool]:
    """Which beds are level."""
    return (single.is_level(row) for _, row in rows.iterrows())


def _drawn(pile: Pile, first_x: float, flow: str) -> Iterator[str]:
    """The heights of a bed line, and below them its ends and the point."""
    line = pile.model.line
    ends = float(line.x[1]), float(line.x[-2])
    x = np.linspace(*ends, COLUMNS)
    z = np.interp(x, line.x, line.z)
    part = (z - z.min()) / (np.ptp(z) or 1.0)
    levels = np.minimum((part * len(BLOCKS)).astype(int), len(BLOCKS) - 1)
    heights = "".join(BLOCKS[level] for level in levels.tolist())
    yield f"{f'  {flow} ->':{HEAD}}{heights}"
    at = _along_flow(pile, first_x)
    column = round((at - ends[0]) / (ends[1] - ends[0]) * (COLUMNS - 1))
    column = min(max(column, 0), COLUMNS - 1)
    first, last = (_place(pile, end) for end in ends)
    mark = f"^ {_told(pile, first_x)}"
    yield f"{'':{HEAD}}{_labelled(first, mark, column, last)}".rstrip()


def _labelled(first: str, mark: str, column: int, last: str) -> str:
    """The ends below a bed line, and between them the mark of a column.

    An end that would meet the mark is left out.
    """
    letters = [" "] * (COLUMNS + len(mark))
    letters[column : column + len(mark)] = mark
    for at, text in ((0, first), (COLUMNS - len(last), last)):
        room = letters[max(0, at - 1) : at + len(text) + 1]
        if not "".join(room).strip():
            letters[at : at + len(text)] = text
    return "".join(letters)


def _along_flow(pile: Pile, x: float) -> float:
    """A place of tables as the bed line has it, m."""
    profile = pile.bed.profile
    if profile is None:
        return x
    line = np.array(pile.model.line.x[1:-1])
    own = profile.place(line)
    order = np.argsort(own)
    return float(np.interp(x, own[order], line[order]))


def _place(pile: Pile, x: float) -> str:
    """A place along the flow as the user has it."""
    profile = pile.bed.profile
    if profile:
        return f"{place_of_file(float(profile.place(x)), profile)} m"
    return length(x) if x else "0"


def _told(pile: Pile, x: float) -> str:
    """The point of first motion as the card has it."""
    profile = pile.bed.profile
    if profile:
        return f"{x:.{digits_of_place(profile)}f} m"
    return length(x)
