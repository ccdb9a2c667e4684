"""The figures of the page of a study: each is a file of this folder.

A file has a `FIGURE`, a `FigureKind` that says where it stands among the others, which
tables it needs and how it is drawn. The folder is the list: a figure more is a file
more.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pkgutil import iter_modules

from orchestrator.report import style
from orchestrator.report.kept import Drawn
from orchestrator.report.results import Results
from orchestrator.report.style import Figure
from orchestrator.runs.case import Case


def no_files(results: Results) -> Sequence[Case]:
    """Find no case: a figure that is drawn from tables alone.

    Parameters
    ----------
    results
        The study, which matters not.

    Returns
    -------
    sequence of Case
        None.
    """
    del results
    return ()


@dataclass(frozen=True)
class FigureKind:
    """What a file of figures gives.

    Attributes
    ----------
    order
        Its place among the figures of a page, the lowest first.
    draws
        Makes its figures from a study; there may be none.
    needs
        Tables without whose rows there is none.
    uses
        Further tables that it is drawn from where they have rows.
    files
        Finds the cases whose bulky files it is drawn from, which are kept for it.
    name
        The name of its file, by `kinds`.
    """

    order: int
    draws: Callable[[Results], Iterator[Figure]]
    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    files: Callable[[Results], Sequence[Case]] = no_files
    name: str = ""

    def draw(self, results: Results) -> Iterator[Figure]:
        """Make its figures.

        Yields
        ------
        Figure
            A figure with the names of the tables that it is drawn from.
        """
        if not all(_has_rows(results, name) for name in self.needs):
            return
        used = [name for name in self.uses if _has_rows(results, name)]
        for figure in self.draws(results):
            yield replace(figure, tables=(*self.needs, *used))


def _has_rows(results: Results, name: str) -> bool:
    """Whether a study has a table with rows."""
    return name in results.tables and not results.tables[name].empty


def kinds(packages: Sequence[str] = ()) -> list[FigureKind]:
    """List the figures of this folder, and of those of guests.

    Parameters
    ----------
    packages
        Names of further packages whose modules are figures.

    Returns
    -------
    list of Kind
        What each file gives, in the order of a page.
    """
    found = []
    for package in (__name__, *packages):
        for module in iter_modules(import_module(package).__path__):
            kind: FigureKind = import_module(f"{package}.{module.name}").FIGURE
            found.append(replace(kind, name=module.name))
    return sorted(found, key=lambda kind: kind.order)


def files(results: Results, packages: Sequence[str] = ()) -> list[Case]:
    """Find the cases whose bulky files the figures of a page are drawn from.

    Parameters
    ----------
    results
        The study with its tables.
    packages
        As of `kinds`.

    Returns
    -------
    list of Case
        The cases.
    """
    return [case for kind in kinds(packages) for case in kind.files(results)]


def drawn(results: Results, kind: FigureKind, every: bool, is_paper: bool) -> Drawn:
    """Draw the figures of one file.

    Parameters
    ----------
    results
        The study with its tables.
    kind
        The file.
    every
        Whether the figures that the page folds away are drawn too.
    is_paper
        Whether figures that follow one of the paper are not folded away.

    Returns
    -------
    Drawn
        The figures that could be drawn, with what they were drawn from.
    """
    made: list[Figure] = []
    fault = ""
    with results.noted() as reads:
        try:
            for figure in kind.draw(results):
                if is_paper and figure.follows:
                    figure = replace(figure, place="")
                is_drawn = every or figure.place != "folded"
                made.append(
                    style.drawn_as(figure)
                    if is_drawn
                    else replace(figure, drawing=None)
                )
        except Exception as error:
            fault = f"{kind.name}: {type(error).__name__}: {error}"
    return Drawn(made, reads, fault)
