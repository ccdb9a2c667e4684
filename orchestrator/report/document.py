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
    """A part of the page: its heading, its text in paragraphs, its figures and tables.

    The canvases of the figures are made under `settings.own`, the tables by `sheet`; `limits` say
    what a reader must not conclude.
    """

    title: str
    text: str = ""
    figures: Sequence[Figure] = field(default_factory=tuple)
    tables: Sequence[pd.DataFrame] = field(default_factory=tuple)
    limits: Sequence[str] = field(default_factory=tuple)


def write(
    title: str, sections: Sequence[Section], folder: Folder, name: str, solvers: Mapping[str, str]
) -> None:
    """Put the page of an experiment into a directory as a file `name`, and its figures beside it.

    The figures are written as PNG and SVG; `solvers` are the programs that ran, with their
    versions.
    """
    parts: list[dict[str, Any]] = []
    for section in sections:
        figures = []
        for figure in section.figures:
            assert figure.canvas is not None
            image = style.save(figure.canvas, folder, figure.name)
            figures.append(page.entry(replace(figure, canvas=None, image=image)))
        parts.append({**vars(section), "figures": figures})
    values = {"sections": parts, "long": LONG, "programs": words.versions(solvers), "links": {}}
    folder.put(name, page.fill("document.html.j2", title=title, **values))


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
