"""What a page and a terminal say: the card, its table, remarks, and all other words."""

from collections.abc import Iterator, Sequence

import pandas as pd

from orchestrator.errors import OrchestratorError
from orchestrator.report import answers, lines, remarks, sheets, theory
from orchestrator.report.card import Card, remark_lines
from orchestrator.report.card import lines as card_lines
from orchestrator.report.page import Guest
from orchestrator.report.results import Results
from orchestrator.report.sheets import Sheet
from orchestrator.tables import missing

MOST_LETTERS = 46
"""Letters of a column in a terminal; longer cells stand on several lines."""


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
        The lines.

    Raises
    ------
    OrchestratorError
        If the tables lack columns, as those of another version do.
    """
    lacking = missing(results.tables)
    if lacking:
        listed = ", ".join(lacking)
        what = f"its tables lack {listed}: another version of this program wrote them"
        where = str(results.cases.parent)
        remedy = "`orchestrator study` of the same file runs it again"
        raise OrchestratorError(what, where, remedy)
    answered = answer_card(results, guests)
    table = sheet(results, guests)
    caveats = remarks.remarks(results)
    said = [*card_lines(answered)]
    if table is not None:
        said += ["", *sheet_lines(table)]
    if caveats:
        said += ["", *remark_lines(caveats)]
    return "\n".join(said)


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
    """Write a table for a terminal.

    Parameters
    ----------
    table
        The table.

    Yields
    ------
    str
        What its rows share, the rows, and its terms.
    """
    if table.shared:
        yield f"all rows: {', '.join(table.shared)}"
    yield from _as_lines(table.frame)
    if table.terms:
        yield ""
    for term in table.terms:
        yield term[:1].upper() + term[1:] + "."


def _as_lines(frame: pd.DataFrame) -> list[str]:
    """The lines of a table of texts; long heads and cells stand on several lines."""
    heads = [str(name) for name in frame]
    rows = frame.to_numpy(str).tolist()
    widths = []
    for head, column in zip(heads, zip(*rows, strict=True), strict=True):
        longest = max(map(len, (*column, *head.split())))
        widths.append(min(longest, MOST_LETTERS))
    return lines.table(rows, heads, widths)
