"""What a page and a terminal say: the card, its table, remarks, and all other words."""

from collections.abc import Iterator, Sequence

import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.report import answers, lines, remarks, sheets, theory
from orchestrator.report.bed_text import bed_lines
from orchestrator.report.by_place import places_sheet
from orchestrator.report.card import (
    WIDTH,
    Card,
    in_terminal,
    marked_lines,
    remark_lines,
)
from orchestrator.report.lines import BETWEEN, head_width
from orchestrator.report.page import Guest
from orchestrator.report.results import Results
from orchestrator.report.sheets import Sheet
from orchestrator.tables import missing

MOST_LACKING = 3
"""Columns that a message on tables of another version names."""
MOST_LETTERS = 30
"""Letters of a column in a terminal; longer cells stand on several lines."""
FEWER_LETTERS = (20, 14, 11)
"""The same where a line would be too long."""


def answer_text(results: Results, guests: Sequence[Guest] = ()) -> str:
    """Write the answer card, its table and its caveats, for a terminal.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card in place of the study's own.

    Returns
    -------
    str
        The lines, with the marks of `terminal.bold`.

    Raises
    ------
    OrchestratorError
        If the tables lack columns, as those of another version do.
    """
    check_version(results)
    answered = answer_card(results, guests)
    table = sheet(results, guests)
    caveats = remarks.remarks(results)
    said = [*marked_lines(answered)]
    drawn = [] if any(guest.card for guest in guests) else [*bed_lines(results)]
    if drawn:
        said += ["", *drawn]
    if table is not None:
        said += ["", *sheet_lines(table)]
    by_place = None if any(guest.card for guest in guests) else places_sheet(results)
    if by_place is not None:
        said += ["", by_place.title, *sheet_lines(by_place)]
    if caveats:
        said += ["", *remark_lines(caveats)]
    return "\n".join(said)


def check_version(results: Results) -> None:
    """Refuse tables that another version wrote.

    Raises
    ------
    OrchestratorError
        If the tables lack columns, as those of another version do.
    """
    lacking = missing(results.tables)
    if lacking:
        listed = ", ".join(lacking[:MOST_LACKING])
        if len(lacking) > MOST_LACKING:
            listed += f" and {len(lacking) - MOST_LACKING} more columns"
        what = f"its tables lack {listed}: another version of this program wrote them"
        where = str(results.cases.parent)
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(what, where, remedy)


def answer_card(results: Results, guests: Sequence[Guest] = ()) -> Card:
    """Choose the card of a study: that of a guest, or its own.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card.

    Returns
    -------
    Card
        The card.
    """
    for guest in guests:
        if guest.card is not None:
            return guest.card
    return answers.card(results)


def sheet(results: Results, guests: Sequence[Guest] = ()) -> Sheet | None:
    """Choose the table below the card: of a guest, of laws, of sizes, of thresholds.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a table.

    Returns
    -------
    Sheet or None
        The table; None without thresholds.
    """
    for guest in guests:
        if guest.sheet is not None:
            return guest.sheet
    if answers.is_of_hills(results):
        return sheets.hills(results)
    best = theory.best(theory.ranked(results))
    if len(best) > theory.MANY:
        frame = theory.theory_sheet(best)
        title = "The best entrainment angle and z₀ of each force law"
        return Sheet(title, frame, file="tables/single_grain.csv")
    return sheets.sizes_sheet(results) or sheets.short(results)


def sheet_lines(table: Sheet) -> Iterator[str]:
    """Write a table for a terminal, of at most `card.WIDTH` letters a line.

    Parameters
    ----------
    table
        The table.

    Yields
    ------
    str
        What its rows share, the rows, the reasons against some, and its terms.
    """
    if table.shared:
        yield from in_terminal(f"all rows: {', '.join(table.shared)}")
    frame, most = _narrow(table)
    yield from _as_lines(frame, most)
    left_out = [str(name) for name in table.frame if name not in frame]
    if left_out:
        yield ""
        yield from in_terminal(f"Not shown: {'; '.join(left_out)}. File: {table.file}.")
    if table.notes or table.terms:
        yield ""
    for number, note in enumerate(table.notes, 1):
        yield from in_terminal(f"({number}) Not usable: {note}.")
    for term in table.terms:
        yield from in_terminal(f"{term[:1].upper()}{term[1:]}.")


def _narrow(table: Sheet) -> tuple[pd.DataFrame, int]:
    """The columns of a table that fit a terminal, and how wide cells may be.

    The last ones are left out, but the verdict; what names a row is broken into lines
    before the number that a reader should take is left out.
    """
    for most in (MOST_LETTERS, *FEWER_LETTERS):
        shown = table.frame
        least = _needed(table, shown)
        while _width(shown, most) > WIDTH and len(shown.columns) > least:
            place = -2 if shown.columns[-1] == sheets.VERDICT else -1
            shown = shown.drop(columns=shown.columns[place])
        if _width(shown, most) <= WIDTH:
            return shown, most
    while _width(shown, most) > WIDTH and len(shown.columns) > 1:
        shown = shown.drop(columns=shown.columns[-1])
    return shown, most


def _needed(table: Sheet, frame: pd.DataFrame) -> int:
    """How many columns a terminal needs: up to the interval, and the verdict."""
    heads = [*frame]
    if table.main not in heads:
        return 2
    return heads.index(table.main) + 2 + (sheets.VERDICT in heads)


def _width(frame: pd.DataFrame, most: int) -> int:
    """Letters of a line of a table, whose cells have a most."""
    widths = _widths(frame, most)
    return sum(widths) + BETWEEN * (len(widths) - 1)


def _widths(frame: pd.DataFrame, most: int) -> list[int]:
    """Letters of each column: as few as leave heads two lines, and cells theirs."""
    found = []
    for head, column in frame.items():
        cells = max(map(len, column.astype(str)), default=1)
        found.append(max(min(cells, most), head_width(str(head))))
    return found


def _as_lines(frame: pd.DataFrame, most: int) -> list[str]:
    """The lines of a table of texts; long heads and cells stand on several lines."""
    heads = [str(name) for name in frame]
    rows = frame.to_numpy(str).tolist()
    return lines.table(_without_repeats(rows), heads, _widths(frame, most))


def _without_repeats(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Leave out the first cells of a row that are those of the row above it."""
    shown = []
    above: Sequence[str] = ("",) * len(rows[0]) if rows else ()
    for row in rows:
        alike = [one == other for one, other in zip(row[:-1], above, strict=False)]
        count = [*alike, False].index(False)
        shown.append([*("" for _ in range(count)), *row[count:]])
        above = row
    return shown
