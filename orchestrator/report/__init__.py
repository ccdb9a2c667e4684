"""Figures and page of a study."""

import contextlib
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.errors import OrchestratorError
from orchestrator.report import settings
from orchestrator.report.guest import Guest

if TYPE_CHECKING:
    import pandas as pd

    from orchestrator.plan import Plan
    from orchestrator.runs.case import Case
    from orchestrator.runs.files import Folder
    from orchestrator.study.study import Study
    from orchestrator.tables import Tables

PAGE = "report.html"
FIGURES = "figures"
LOADED_AFTER_S = 1.0
"""Time that the first runs have for themselves before the drawing libraries are loaded, s."""


@contextlib.contextmanager
def loading() -> Iterator[None]:
    """Load what draws beside the runs of a block: after the last of them nobody waits for it."""
    with settings.own():
        pass  # matplotlib is imported here: that changes what other threads see of the environment
    timer = threading.Timer(LOADED_AFTER_S, _load)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


def _load() -> None:
    with contextlib.suppress(Exception), settings.own():  # who draws says what does not load
        from orchestrator.report import drawing

        drawing.warm()


def write(
    study: "Study",
    plan: "Plan",
    tables: "Tables",
    timings: "pd.DataFrame",
    failures: Mapping[str, str],
    folder: "Folder",
    guests: Sequence[Guest] = (),
    beside: Callable[[], None] = lambda: None,
) -> None:
    """Draw the figures of a study and write its page.

    Parameters
    ----------
    study, plan, tables
        As the pipeline made them.
    timings : DataFrame
        Wall times of the finished cases.
    failures : mapping of str to str
        The cases that failed, with why.
    folder : Folder
        The study's directory: it holds ``cases`` and gets ``figures`` and the page.
    guests : sequence of callable
        Whoever may add to the page.
    beside : callable
        Called once, while other processes draw.
    """
    said: dict[str, Any] = {}

    def meanwhile() -> None:
        beside()
        said.update(page.said(results, timings, failures))

    with settings.own():
        # the drawing libraries take half a second to import: only who draws waits for them
        from orchestrator.report import drawing, page
        from orchestrator.report.results import Results

        results = Results(study, plan, tables, folder.root / "cases")
        folder.make(FIGURES)
        drawn = drawing.draw(results, folder, meanwhile)
    figures = [figure for figure in drawn if not figure.fault]
    said["undrawn"] = [figure.fault for figure in drawn if figure.fault]
    for fault in said["undrawn"]:
        print(f"a figure could not be drawn: {fault}", file=sys.stderr)
    names = [figure.name for figure in figures]
    added = [one for one in (guest(study, tables, names) for guest in guests) if one]
    for name, text in (item for one in added for item in one.files.items()):
        folder.put(name, text)
    sections = [one.section for one in added]
    folder.put(PAGE, page.render(said, figures, sections))


def drawn_from(study: "Study", plan: "Plan", tables: "Tables", cases: Path) -> "list[Case]":
    """The cases whose bulky files the page's pictures are drawn from."""
    with settings.own():
        from orchestrator.report.pictures import bed, flow
        from orchestrator.report.results import Results

    results = Results(study, plan, tables, cases)
    if "pile_threshold" not in tables:
        return []
    shown = [one for _, pile in bed.chosen(results) for one in pile.runs]
    return [*shown, *(pile.flow for pile in flow.chosen(results))]


def said(study: "Study", plan: "Plan", tables: "Tables", cases: Path) -> str:
    """The answer of a study for a terminal: thresholds with their intervals, and sentences."""
    with settings.own():
        from orchestrator.report import answer as found
        from orchestrator.report.results import Results

    try:
        return found.text(Results(study, plan, tables, cases))
    except KeyError as error:
        raise OrchestratorError(
            f"its tables lack {error}: another version of this program wrote them",
            where=str(cases.parent),
            remedy="`orchestrator study` of the same file runs it again",
        ) from None
