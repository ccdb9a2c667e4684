"""Figures and page of a study."""

import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from orchestrator.runs import second, terminal

if TYPE_CHECKING:
    import pandas as pd

    from orchestrator.report.kept import Kept
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
    written: Mapping[str, str] | None = None,
    times: "pd.DataFrame | None" = None,
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
    written
        Digests of the tables where they are written already, as of `write_tables`.
    times
        The times of the cases, as of `tables.timings`.

    Returns
    -------
    list of str
        A line for each figure that could not be drawn, such as for want of memory. The
        page has the line in its place.
    """
    from orchestrator.report import foot, page, sections
    from orchestrator.report.kept import Kept

    is_paper = any(guest.is_paper for guest in guests)
    kept = Kept(folder, results, written or {}, every=every, is_paper=is_paper)
    figures, faults = _drawn(results, kept, every, is_paper, packages)
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
        foot=foot.of_page(folder, sections.programs(results), _wall_s(times)),
        links=sections.links(results),
        is_paper=is_paper,
    )
    return faults


def _wall_s(times: "pd.DataFrame | None") -> float | None:
    """The wall time of all cases; None without any."""
    if times is None or times.empty:
        return None
    return float(times[["solver_s", "outside_s"]].sum().sum())


def _drawn(
    results: "Results",
    kept: "Kept",
    every: bool,
    is_paper: bool,
    packages: Sequence[str],
) -> "tuple[list[Figure], list[str]]":
    """The figures of a study, and a line for each that failed."""
    from orchestrator.report import figures, style
    from orchestrator.report.kept import Drawn

    kinds = figures.kinds(packages)
    found: list[Drawn | None] = [kept.get(kind.name) for kind in kinds]
    missing = [number for number, drawn in enumerate(found) if drawn is None]

    def of_kind(place: int) -> Drawn:
        """The figures of a kind that is missing."""
        drawn = figures.drawn(results, kinds[missing[place]], every, is_paper)
        terminal.check_signals()
        return drawn

    with style.settings(style.LETTERS):
        made = second.shared(of_kind, len(missing))
    for number, drawn in zip(missing, made, strict=True):
        found[number] = drawn
        if drawn.fault:
            print(f"a figure could not be drawn: {drawn.fault}", file=sys.stderr)
    every_one = [each for each in found if each is not None]
    for kind, each in zip(kinds, every_one, strict=True):
        kept.put(kind.name, each)
    kept.close()
    faults = [each.fault for each in every_one if each.fault]
    return [figure for each in every_one for figure in each.figures], faults


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


def said(
    results: "Results", guests: Sequence["Guest"] = (), *, marked: bool = False
) -> str:
    """Write the answer of a study for a terminal, see `words.answer_text`.

    Parameters
    ----------
    results
        The study with its tables.
    guests
        Others, of which one may have a card.
    marked
        Whether its numbers and its verdict have the marks of `terminal.bold`.

    Returns
    -------
    str
        The lines.
    """
    from orchestrator.report import words

    text = words.answer_text(results, guests)
    return text if marked else terminal.plain(text)
