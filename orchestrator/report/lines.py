"""Tables of texts for a terminal and for the documents."""

import textwrap
from collections.abc import Sequence
from io import StringIO

from rich.console import Console
from rich.table import Table
from rich.text import Text

BETWEEN = 2
"""Letters between two columns."""
WIDEST = 10_000
"""Letters of a line that is not to be wrapped."""


def table(
    rows: Sequence[Sequence[str]],
    heads: Sequence[str] = (),
    widths: Sequence[int] | None = None,
) -> list[str]:
    """Write a table whose columns stand below each other.

    Parameters
    ----------
    rows
        The cells of each row.
    heads
        Heads of the columns; none for a table without.
    widths
        Letters of each column, in which longer cells and heads stand on several lines;
        by default as many as the longest has.

    Returns
    -------
    list of str
        The lines, without spaces at their ends.

    Examples
    --------
    >>> table([("1 mm", "0.3"), ("10 mm", "0.25")], ("d", "u*"))
    ['d      u*', '1 mm   0.3', '10 mm  0.25']
    """
    # heads are a row like all: rich would set them at the bottom of theirs
    shown = [heads, *rows] if heads else rows
    drawn = Table(
        box=None, padding=(0, BETWEEN, 0, 0), show_header=False, pad_edge=False
    )
    for number in range(len(shown[0])):
        width = widths[number] if widths else None
        drawn.add_column(width=width, no_wrap=widths is None)
    for cells in shown:
        drawn.add_row(*map(Text, cells))
    out = StringIO()
    # in a notebook rich would show the table itself, and write nothing
    console = Console(file=out, width=WIDEST, color_system=None, force_jupyter=False)
    console.print(drawn)
    return [line.rstrip() for line in out.getvalue().splitlines()]


def head_width(head: str, most: int = 2) -> int:
    """Find how wide a column must be for its head to have few lines.

    Parameters
    ----------
    head
        The head.
    most
        Lines that it may have.

    Returns
    -------
    int
        Letters.

    Examples
    --------
    >>> head_width("wind at 10 m, m/s"), head_width("u*")
    (9, 2)
    """
    width = max(map(len, head.split()), default=1)
    while len(textwrap.wrap(head, width, break_on_hyphens=False)) > most:
        width += 1
    return width
