"""Figures and page of a study."""

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from orchestrator.runs import terminal

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.report.results import Results
    from orchestrator.runs.case import Case
    from orchestrator.runs.files import Folder

PAGE = "report.html"
FIGURES = "figures"


def write(
    results: "Results",
    failures: Mapping[str, str],
    folder: "Folder",
    guests: Sequence["Guest"] = (),
    every: bool = False,
) -> None:
    """Draw the figures of a study and write its page into its directory.

    `failures` are the cases that failed, with why. A figure that fails, such as for memory, costs a
    line of the page. Those that the page folds away are drawn only if `every` one is asked for.
    """
    from orchestrator.report import along, bed, flows, page, piles, shields, style, words

    figures: list[style.Figure] = []
    faults: list[str] = []
    with style.settings():
        for draw in (
            *(flows.hills, along.draw, bed.draw, shields.draw, shields.singles, shields.piles),
            *(piles.fractions, piles.wear, shields.accuracy, piles.poured),
            *(flows.stress, flows.flow, flows.mesh),
        ):
            try:
                for figure in draw(results):
                    now = every or not (figure.fold and figure.drawing)
                    figures.append(style.saved(figure, folder) if now else figure)
            except Exception as error:
                faults.append(f"{draw.__module__}.{draw.__name__}: {type(error).__name__}: {error}")
                print(f"a figure could not be drawn: {faults[-1]}", file=sys.stderr)
            terminal.check()
    figures.sort(key=lambda figure: not figure.leads)
    names = [figure.name for figure in figures]
    for name, text in (item for guest in guests for item in guest.files.items()):
        folder.put(name, text)
    parts = {**words.contents(results, failures), "faults": faults, "figures": figures}
    sections = [guest.section(names) for guest in guests]
    terminal.check()
    folder.put(PAGE, page.fill("page.html.j2", **parts, guests=guests, sections=sections))


def drawn_from(results: "Results") -> "list[Case]":
    """The cases whose bulky files the page's pictures are drawn from."""
    from orchestrator.report import bed, flows

    if "pile_threshold" not in results.tables:
        return []
    shown = [run for _, pile in bed.chosen(results) for run in pile.runs]
    return [*shown, *(pile.flow for pile in flows.drawn(results))]


def said(results: "Results", guests: Sequence["Guest"] = ()) -> str:
    """The answer of a study for a terminal, see `words.text`."""
    from orchestrator.report import words

    return words.text(results, guests)
