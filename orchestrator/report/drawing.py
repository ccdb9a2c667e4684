"""All figures of a study drawn side by side, in the order of the page."""

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

from orchestrator.errors import OrchestratorError
from orchestrator.report import (
    FIGURES,
    compared,
    hills,
    labels,
    mixture,
    overview,
    page,
    piles,
    single,
    stress,
    style,
    wear,
    where,
)
from orchestrator.report.figure import Figure
from orchestrator.report.pictures import bed, flow, mesh
from orchestrator.report.results import Results
from orchestrator.runs import process
from orchestrator.runs.files import Folder

Draw = Callable[[Results], Iterable[Figure]]
SECTIONS: tuple[tuple[int, tuple[Draw, ...]], ...] = (
    (5, (single.by_angle,)),
    (2, (piles.extended,)),
    (3, (piles.fractions, wear.draw)),
    (9, (stress.draw,)),
    (10, (flow.draw,)),
    (0, (bed.draw,)),
    (6, (single.by_slope,)),
    (12, (where.draw, hills.draw)),
    (8, (mixture.draw,)),
    (4, (compared.draw,)),
    (11, (mesh.draw,)),
    (7, (single.accuracy,)),
    (1, (overview.draw,)),
)
"""Functions that one process draws, the dearest first, each with its place on the page."""


def warm() -> None:
    """Do once what every process that draws would do first: libraries, fonts, mathematics."""
    import pyvista  # noqa: F401

    figure = style.canvas(1.0)
    figure.subplots().set(xlabel=labels.RE_AXIS, ylabel=labels.TAU_AXIS, xscale="log")
    style.svg(figure)
    page.template_of("page.html.j2", page.FOLDER)


def draw(results: Results, folder: Folder, beside: Callable[[], None]) -> list[Figure]:
    """Put each figure's files into a directory; give it with its image.

    The sections are drawn side by side: matplotlib holds one core for seconds a figure.

    Parameters
    ----------
    results : Results
        The results of the study.
    folder : Folder
        The study's directory.
    beside : callable
        Called once, while other processes draw.

    Raises
    ------
    OrchestratorError
        If the processes that draw are killed again and again.
    """
    _shared.append(results)
    try:
        parts = _parts(folder, beside)
    finally:
        _shared.clear()
    places = [place for place, _ in SECTIONS]
    order = sorted(zip(places, parts, strict=True), key=lambda pair: pair[0])
    figures = [figure for _, part in order for figure in part]
    return sorted(figures, key=lambda figure: (not figure.first, not figure.leads))


def _parts(folder: Folder, beside: Callable[[], None]) -> list[list[Figure]]:
    # forked, the workers have the results and the imported libraries already
    context = multiprocessing.get_context("fork")
    workers = min(os.cpu_count() or 1, len(SECTIONS))
    for tried in range(process.TRIES):
        pool = ProcessPoolExecutor(workers, context, process.follow, (os.getpid(),))
        # no `pool.map`: it cancels what a pool that is killed then ends, which prints a traceback
        try:
            drawn = [pool.submit(_section, number, folder) for number in range(len(SECTIONS))]
            if not tried:
                beside()
            return [one.result() for one in drawn]
        except BrokenProcessPool:
            continue
        finally:
            pool.shutdown(cancel_futures=True)
    raise OrchestratorError(
        "a process that draws figures was killed",
        where=str(folder.root),
        remedy="out of memory? `orchestrator report` draws them again",
    )


_shared: list[Results] = []
"""Results that the workers inherit: they are too large to be sent to each."""


def _section(number: int, folder: Folder) -> list[Figure]:
    _, draws = SECTIONS[number]
    return [figure for draw in draws for figure in _drawn(draw, folder)]


def _drawn(draw: Draw, folder: Folder) -> Iterator[Figure]:
    """The figures of a function; one that fails has its fault in its place.

    The answer of a study does not depend on its pictures: none of them may cost the page.
    """
    figures = draw(_shared[0])
    try:
        for figure in figures:
            yield saved(figure, folder)
    except Exception as error:  # of any cause, such as too little memory
        what = f"{draw.__module__.rpartition('.')[2]}: {type(error).__name__}: {error}"
        yield Figure("", "", "", (), None, fault=what)


def saved(figure: Figure, folder: Folder) -> Figure:
    """The figure with its image in place of its canvas, its file written."""
    image = style.svg(figure.canvas) if figure.canvas else figure.image
    folder.put(f"{FIGURES}/{figure.name}.svg", image)
    return replace(figure, canvas=None, image=image)
