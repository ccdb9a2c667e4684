"""All figures of a study, in the order of the page."""

import contextlib
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace

from orchestrator.errors import OrchestratorError
from orchestrator.report import (
    animation,
    compared,
    flow_picture,
    grain_picture,
    mesh_picture,
    piles,
    single,
    stress,
    style,
)
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results
from orchestrator.runs import process, retry
from orchestrator.runs.folder import Folder

Drawn = tuple[Figure, bytes]
"""A figure without its canvas, and its image: PNG, of an animation GIF."""


def draw(results: Results, folder: Folder) -> list[Drawn]:
    """Put each figure's files into a directory; give it with its image.

    The sections are drawn side by side: matplotlib holds one core for seconds a figure.

    Raises
    ------
    OrchestratorError
        If the processes that draw are killed again and again.
    """
    _shared.append(results)
    try:
        parts = _parts(folder)
    finally:
        _shared.clear()
    # the order of the page: the pictures stand behind the single grains
    order = [part for _, part in sorted(zip(PLACES, parts, strict=True), key=lambda pair: pair[0])]
    return [drawn for part in order for drawn in part]


def _parts(folder: Folder) -> list[list[Drawn]]:
    # forked, the workers have the results and the imported libraries already
    context = multiprocessing.get_context("fork")
    workers = min(os.cpu_count() or 1, len(SECTIONS))
    for _ in range(retry.MOST):
        with (
            contextlib.suppress(BrokenProcessPool),
            ProcessPoolExecutor(workers, context, process.follow, (os.getpid(),)) as pool,
        ):
            return list(pool.map(_section, range(len(SECTIONS)), [folder] * len(SECTIONS)))
    raise OrchestratorError(
        "a process that draws figures was killed",
        where=str(folder.root),
        remedy="out of memory? `orchestrator report` draws them again",
    )


_shared: list[Results] = []
"""What the workers inherit: results are too large to be sent to each."""


def _section(number: int, folder: Folder) -> list[Drawn]:
    return list(SECTIONS[number](_shared[0], folder))


def _saved(figures: Iterable[Figure], folder: Folder) -> Iterator[Drawn]:
    for figure in figures:
        if figure.canvas:
            image = style.save(figure.canvas, folder, figure.name)
            yield replace(figure, canvas=None), image


def _pictures(results: Results, folder: Folder) -> Iterator[Drawn]:
    yield from _saved(mesh_picture.draw(results), folder)
    yield from _saved(flow_picture.draw(results), folder)
    yield from _saved(grain_picture.draw(results), folder)
    yield from animation.draw(results, folder)


def _single(results: Results, folder: Folder) -> Iterator[Drawn]:
    yield from _saved(compared.draw(results), folder)
    yield from _saved(single.draw(results), folder)


def _stress(results: Results, folder: Folder) -> Iterator[Drawn]:
    yield from _saved(stress.draw(results), folder)


def _fractions(results: Results, folder: Folder) -> Iterator[Drawn]:
    yield from _saved(piles.fractions(results), folder)


def _extended(results: Results, folder: Folder) -> Iterator[Drawn]:
    yield from _saved(piles.extended(results), folder)


SECTIONS: tuple[Callable[[Results, Folder], Iterator[Drawn]], ...]
SECTIONS = (_pictures, _fractions, _extended, _single, _stress)
"""The dearest first."""
PLACES = (1, 3, 4, 0, 2)
"""Their places on the page."""
