"""A figure framed around what a process of its own draws or samples for it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure as Canvas

from orchestrator.report.figure import Figure


@dataclass(frozen=True)
class Picture:
    """A figure to be.

    Attributes
    ----------
    figure : Figure
        All but its canvas.
    jobs : tuple of mapping
        For `orchestrator.report.pictures.run`; each leaves the file named by its ``out``.
    frame : callable
        Makes the canvas when the jobs are done.
    """

    figure: Figure
    jobs: tuple[Mapping[str, Any], ...]
    frame: Callable[[], Canvas]

    def finished(self, cause: str) -> Figure:
        """The figure, or why it is missing, where the jobs left no files."""
        if all(Path(job["out"]).is_file() for job in self.jobs):
            return replace(self.figure, canvas=self.frame())
        return replace(self.figure, missing=cause or "the drawing process left no picture")
