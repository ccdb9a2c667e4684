"""All figures of a study, in the order of the page."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

from matplotlib import rc_context

from orchestrator.report import (
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
    """Write each figure's files into a folder; give it with its PNG, or b"" if it is missing."""
    with rc_context(style.RC):
        for figure in _figures(results):
            yield figure, style.save(figure.canvas, folder, figure.name) if figure.canvas else b""


def _figures(results: Results) -> Iterator[Figure]:
    yield from single.draw(results)
    yield from _pictures(results)
    yield from stress.draw(results)
    yield from piles.draw(results)


def _pictures(results: Results) -> Iterator[Figure]:
    with tempfile.TemporaryDirectory(prefix="orchestrator-") as name:
        folder = Path(name)
        planned = [*flow_picture.plan(results, folder), *grain_picture.plan(results, folder)]
        cause = ""
        if planned:
            cause = pictures.run([job for picture in planned for job in picture.jobs], folder)
        for picture in planned:
            yield picture.finished(cause)
