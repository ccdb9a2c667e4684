"""A page of sections, for experiments and the benchmark; one file like a study's page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd

from orchestrator.report import facts, page, style
from orchestrator.report.facts import Sheet
from orchestrator.report.figure import Figure
from orchestrator.runs.files import Folder

LONG = 60
"""Rows of a table that is folded away."""


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes
    ----------
    title, text : str
        Its heading and what it says; an empty line parts paragraphs.
    figures : sequence of Figure
        With canvases that were made under `settings.own`.
    tables : sequence of Sheet
        As `sheet` makes them.
    limits : sequence of str
        What a reader must not conclude.
    """

    title: str
    text: str = ""
    figures: Sequence[Figure] = field(default_factory=tuple)
    tables: Sequence[Sheet] = field(default_factory=tuple)
    limits: Sequence[str] = field(default_factory=tuple)


def write(
    title: str, sections: Sequence[Section], folder: Folder, name: str, solvers: Mapping[str, str]
) -> None:
    """Put the page of an experiment into a directory, and its figures.

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
    html = page.fill(
        "document.html.j2",
        title=title,
        sections=[_drawn(section, folder) for section in sections],
        long=LONG,
        programs=facts.versions(solvers),
        links={},
    )
    folder.put(name, html)


def _drawn(section: Section, folder: Folder) -> dict[str, Any]:
    """A section as the template needs it, its figures as entries with images."""
    drawn = (_saved(figure, folder) for figure in section.figures)
    names = ("title", "text", "tables", "limits")
    parts = {name: getattr(section, name) for name in names}
    return {**parts, "figures": [page.entry(figure) for figure in drawn]}


def _saved(figure: Figure, folder: Folder) -> Figure:
    """As a study's, with a PNG beside the SVG, for documents elsewhere."""
    image = style.save(figure.canvas, folder, figure.name) if figure.canvas else figure.image
    return replace(figure, canvas=None, image=image)


def sheet(table: pd.DataFrame) -> Sheet:
    """A table for the page: numbers to four digits, a dash where nothing is known."""
    rows = (tuple(_cell(value) for value in row) for row in table.itertuples(index=False))
    return Sheet(tuple(str(column) for column in table), tuple(rows))


def _cell(value: Any) -> str:
    if pd.isna(value):
        return "—"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
