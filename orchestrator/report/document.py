"""A page of sections, for experiments and the benchmark; one file like a study's page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from orchestrator.report import page, style, words
from orchestrator.report.style import Figure
from orchestrator.runs.files import Folder

LONG = 60
"""Rows of a table beyond which it is folded away."""


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes
    ----------
    title, text : str
        Its heading and its text; an empty line parts paragraphs.
    figures : sequence of Figure
        With canvases that were made under `settings.own`.
    tables : sequence of DataFrame
        As `sheet` makes them.
    limits : sequence of str
        What a reader must not conclude.
    """

    title: str
    text: str = ""
    figures: Sequence[Figure] = field(default_factory=tuple)
    tables: Sequence[pd.DataFrame] = field(default_factory=tuple)
    limits: Sequence[str] = field(default_factory=tuple)


def write(
    title: str, sections: Sequence[Section], folder: Folder, name: str, solvers: Mapping[str, str]
) -> None:
    """Put the page of an experiment into a directory, and its figures as PNG and SVG.

    Parameters
    ----------
    title : str
        Title of the page.
    sections : sequence of Section
        Its parts, in their order.
    folder : Folder
        The directory; the figures go into its ``figures``.
    name : str
        Name of the page's file.
    solvers : mapping of str to str
        The programs that ran, with their versions.
    """
    parts: list[dict[str, Any]] = []
    for section in sections:
        figures = []
        for figure in section.figures:
            assert figure.canvas is not None
            image = style.save(figure.canvas, folder, figure.name)
            figures.append(page.entry(replace(figure, canvas=None, image=image)))
        parts.append({**vars(section), "figures": figures})
    programs = words.versions(solvers)
    html = page.fill(
        "document.html.j2", title=title, sections=parts, long=LONG, programs=programs, links={}
    )
    folder.put(name, html)


def sheet(table: pd.DataFrame) -> pd.DataFrame:
    """A table for the page: numbers to four digits, a dash for a missing value."""

    def cell(value: Any) -> str:
        if pd.isna(value):
            return "—"
        if isinstance(value, bool):
            return "yes" if value else "no"
        return f"{value:.4g}" if isinstance(value, float) else str(value)

    rows = [[cell(value) for value in row] for row in table.itertuples(index=False)]
    return pd.DataFrame(rows, columns=[str(name) for name in table])
