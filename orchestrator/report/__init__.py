"""Figures and page of a study."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from orchestrator.runs import second, terminal

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.report.results import Results
    from orchestrator.report.style import Figure
    from orchestrator.runs.case import Case
    from orchestrator.runs.files import Folder

PAGE = "report.html"
LIST = "figures/figures.csv"
"""The figures of a page in their order."""


def write(
    results: "Results",
    failures: Mapping[str, str],
    folder: "Folder",
    guests: Sequence["Guest"] = (),
    every: bool = False,
    packages: Sequence[str] = (),
) -> list[str]:
    """Draw the figures of a study and write its page into its directory.

    Parameters
    ----------
    results
        The study with its tables.
    failures
        The cases that failed, with why.
    folder
        The directory of the study.
    guests
        Sections that others add to the page, with their files.
    every
        Whether the figures that the page folds away are drawn too.
    packages
        Packages of others with further figures, as of `figures.kinds`.

    Returns
    -------
    list of str
        A line for each figure that could not be drawn, such as for want of memory. The
        page has the line in its place.
    """
    from orchestrator.report import page, sections

    is_paper = any(guest.is_paper for guest in guests)
    figures, faults = _drawn(results, folder, every, is_paper, packages)
    folder.put(LIST, _listed(figures))
    for guest in guests:
        for name, text in guest.files.items():
            folder.put(name, text)
    listed = sections.of_study(results, failures, guests, figures, faults)
    terminal.check_signals()
    page.write_page(
        folder,
        PAGE,
        results.study.title,
        listed,
        above=f"Study “{results.study.title}”",
        links=sections.links(results),
        is_paper=is_paper,
    )
    return faults


def _drawn(
    results: "Results",
    folder: "Folder",
    every: bool,
    is_paper: bool,
    packages: Sequence[str],
) -> "tuple[list[Figure], list[str]]":
    """The figures of a study, and a line for each that failed."""
    from orchestrator.report import figures, style

    kinds = figures.kinds(packages)

    def of_kind(number: int) -> "tuple[list[Figure], str]":
        """The figures of one kind, and why others of it could not be drawn."""
        made: list[Figure] = []
        kind = kinds[number]
        try:
            for figure in kind.draw(results):
                if is_paper and figure.follows:
                    figure = replace(figure, place="")
                is_drawn = every or figure.place != "folded"
                made.append(
                    style.drawn(figure) if is_drawn else replace(figure, drawing=None)
                )
        except Exception as error:
            return made, f"{kind.name}: {type(error).__name__}: {error}"
        terminal.check_signals()
        return made, ""

    found: list[Figure] = []
    faults: list[str] = []
    with style.settings():
        for made, fault in second.shared(of_kind, len(kinds)):
            found += made
            if fault:
                faults.append(fault)
                print(f"a figure could not be drawn: {fault}", file=sys.stderr)
    for figure in found:
        if figure.image:
            folder.put(f"{style.FIGURES}/{figure.name}.svg", figure.image)
    return found, faults


def _listed(figures: "Sequence[Figure]") -> str:
    """The figures as a table: names of their files, and where the page has them."""
    import pandas as pd

    rows = [(figure.name, figure.title, figure.place) for figure in figures]
    return pd.DataFrame(rows, columns=["name", "title", "place"]).to_csv(index=False)


def drawn_from(results: "Results", packages: Sequence[str] = ()) -> "list[Case]":
    """Find the cases whose bulky files the page's pictures are drawn from.

    Parameters
    ----------
    results
        The study with its tables.
    packages
        As of `write`.

    Returns
    -------
    list of Case
        The cases.
    """
    from orchestrator.report import figures

    return figures.files(results, packages)


def said(results: "Results", guests: Sequence["Guest"] = ()) -> str:
    """Write the answer of a study for a terminal, see `words.answer_text`.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card.

    Returns
    -------
    str
        The lines.
    """
    from orchestrator.report import words

    return words.answer_text(results, guests)
