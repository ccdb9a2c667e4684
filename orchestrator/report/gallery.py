"""All figures of a study, in the order of the page."""

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from matplotlib import rc_context

from orchestrator.report import (
    animation,
    flow_picture,
    grain_picture,
    pictures,
    piles,
    single,
    stress,
    style,
)
from orchestrator.report.figure import Figure
from orchestrator.report.results import Results


def draw(results: Results, folder: Path) -> Iterator[tuple[Figure, bytes]]:
    """Write each figure's files into a folder; give it with its image, or b"" if it is missing.

    The image is a PNG, of an animation a GIF.
    """
    with rc_context(style.RC):
        yield from _saved(single.draw(results), folder)
        yield from _saved(_pictures(results), folder)
        yield from animation.draw(results, folder)
        yield from _saved(stress.draw(results), folder)
        yield from _saved(piles.draw(results), folder)


def _saved(figures: Iterable[Figure], folder: Path) -> Iterator[tuple[Figure, bytes]]:
    for figure in figures:
        yield figure, style.save(figure.canvas, folder, figure.name) if figure.canvas else b""


def _pictures(results: Results) -> Iterator[Figure]:
    with tempfile.TemporaryDirectory(prefix="orchestrator-") as name:
        folder = Path(name)
        planned = [*flow_picture.plan(results, folder), *grain_picture.plan(results, folder)]
        cause = ""
        if planned:
            cause = pictures.run([job for picture in planned for job in picture.jobs], folder)
        for picture in planned:
            yield picture.finished(cause)
