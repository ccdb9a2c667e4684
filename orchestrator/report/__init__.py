"""Figures and page of a study."""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from orchestrator.runs import terminal

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.report.results import Results
    from orchestrator.report.style import Figure
    from orchestrator.runs.case import Case
    from orchestrator.runs.files import Folder

PAGE = "report.html"


def write(
    results: "Results",
    failures: Mapping[str, str],
    folder: "Folder",
    guests: Sequence["Guest"] = (),
    every: bool = False,
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

    Returns
    -------
    list of str
        A line for each figure that could not be drawn, such as for want of memory. The
        page has the line in its place.
    """
    from orchestrator.report import page, words

    numbers: dict[str, str] = {}
    for guest in guests:
        numbers |= guest.numbers
    figures, faults = _drawn(results, folder, every, numbers)
    for guest in guests:
        for name, text in guest.files.items():
            folder.put(name, text)
    names = [figure.name for figure in figures]
    parts = words.contents(results, failures, guests)
    parts["faults"] = faults
    parts["figures"] = figures
    parts["guests"] = guests
    parts |= _heads(results, guests, faults)
    parts["sections"] = [guest.section(names) for guest in guests]
    terminal.check()
    folder.put(PAGE, page.fill("page.html.j2", **parts))
    return faults


def _heads(
    results: "Results", guests: Sequence["Guest"], faults: list[str]
) -> "dict[str, Any]":
    """The picture below the card, and what stands under a picture of grains."""
    from orchestrator.report import drawing, head, style

    shown: dict[str, Any] = {"head": None, "under": None}
    if guests:
        return shown
    for name, choose in {"head": head.of, "under": head.below}.items():
        try:
            with style.settings():
                chosen = choose(results)
                if chosen is not None:
                    shown[name] = (chosen, drawing.written(chosen))
        except Exception as error:
            fault = f"{head.__name__}: {type(error).__name__}: {error}"
            faults.append(fault)
            print(f"a figure could not be drawn: {fault}", file=sys.stderr)
        if shown["head"]:
            break
    return shown


def _drawn(
    results: "Results", folder: "Folder", every: bool, numbers: Mapping[str, str]
) -> "tuple[list[Figure], list[str]]":
    """The figures of a study, leading ones first, and a line for each that failed."""
    from orchestrator.report import along, bed, flows, piles, poured, shields, style

    drawing: list[Callable[[Results], Iterator[Figure]]] = [
        flows.hills,
        along.draw,
        bed.draw,
        shields.draw,
        shields.singles,
        shields.piles,
        piles.fractions,
        piles.fractions_by_reynolds,
        piles.wear,
        shields.accuracy,
        poured.draw,
        flows.stress,
        flows.flow,
        flows.mesh,
    ]
    figures: list[Figure] = []
    faults: list[str] = []
    with style.settings():
        for draw in drawing:
            try:
                for figure in draw(results):
                    figure = _numbered(figure, numbers)
                    is_folded = bool(figure.fold and figure.drawing)
                    if every or not is_folded:
                        figure = style.saved(figure, folder)
                    figures.append(figure)
            except Exception as error:
                name = f"{draw.__module__}.{draw.__name__}"
                fault = f"{name}: {type(error).__name__}: {error}"
                faults.append(fault)
                print(f"a figure could not be drawn: {fault}", file=sys.stderr)
            terminal.check()
    figures.sort(key=lambda figure: not figure.leads)
    return figures, faults


def _numbered(figure: "Figure", numbers: Mapping[str, str]) -> "Figure":
    """A figure with the number that others gave it, which is drawn then."""
    is_further = ", more panels" in figure.title
    for name, number in numbers.items():
        if figure.name.startswith(name) and not is_further:
            return replace(figure, number=number, fold=False)
    return figure


def drawn_from(results: "Results") -> "list[Case]":
    """Find the cases whose bulky files the page's pictures are drawn from.

    Parameters
    ----------
    results
        The study with its tables.

    Returns
    -------
    list of Case
        The cases.
    """
    from orchestrator.report import bed, flows

    if "pile_threshold" not in results.tables:
        return []
    shown = [run for _, pile in bed.chosen(results) for run in pile.runs]
    return [*shown, *(pile.flow for pile in flows.drawn(results))]


def said(results: "Results", guests: Sequence["Guest"] = ()) -> str:
    """Write the answer of a study for a terminal, see `words.text`.

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

    return words.text(results, guests)
