"""The guests: packages that add commands, cards, figures and kinds of beds to the core.

Each stands in a room of its own, which no module of the core imports. The package of a
guest has an `OFFER`; the core asks what is offered. Here stands the one list of guests:
below the commands, since the answers of the Python functions have cards of guests, too.
"""

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orchestrator.command import Command, Extension

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.study.study import Beds, Study
    from orchestrator.tables import Tables

GUESTS = ("benchmark", "hours", "lab", "paper", "stockpile", "surface")
"""The packages of the guests."""


@dataclass(frozen=True)
class Offer:
    """What a guest offers to the core.

    Attributes
    ----------
    commands
        Its commands.
    cards
        Makes its cards on the page of a study; None for a guest without cards.
    beds
        Its kinds of beds, by their words for `bed.kind`.
    figures
        Name of a package whose modules are figures of the page of a study, as those of
        `report.figures`; empty for a guest without figures.
    take_over
        Runs a command on a study of its beds, and returns its exit code, or None for
        other beds; None for a guest without beds.
    threshold
        What it adds to the command `threshold`; None for nothing.
    """

    commands: tuple[Command, ...] = ()
    cards: "Callable[[Study, Tables], list[Guest]] | None" = None
    beds: "Beds" = field(default_factory=dict)
    figures: str = ""
    take_over: "Callable[[Study[Any], Namespace], int | None] | None" = None
    threshold: Extension | None = None


def offers() -> Iterator[Offer]:
    """Ask each guest for its offer.

    Yields
    ------
    Offer
        What it offers.
    """
    for name in GUESTS:
        offer: Offer = import_module(f"orchestrator.{name}").OFFER
        yield offer


def cards(study: "Study", tables: "Tables") -> "list[Guest]":
    """Make the cards of all guests on the page of a study.

    Parameters
    ----------
    study
        The study.
    tables
        Its tables.

    Returns
    -------
    list of Guest
        The cards; none for most studies.
    """
    made = []
    for offer in offers():
        if offer.cards is not None:
            made += offer.cards(study, tables)
    return made


def figures() -> list[str]:
    """List the packages of guests whose modules are figures of the page of a study.

    Returns
    -------
    list of str
        Their names.
    """
    return [offer.figures for offer in offers() if offer.figures]


def load_study(source: str | Path, tolerance: float | None) -> "Study[Any]":
    """Read a study file, also on the beds of a guest.

    Parameters
    ----------
    source
        The path of the file, or the name of a preset.
    tolerance
        Relative error that tau_c may have, in place of the file's.

    Returns
    -------
    Study
        The study.

    Raises
    ------
    InputError
        With the file, the field and the remedy.
    """
    from orchestrator.study.study import load_any

    beds: Beds = {}
    for offer in offers():
        beds = {**beds, **offer.beds}
    return load_any(source, tolerance, beds)


def taken_over(study: "Study[Any]", options: Namespace) -> int | None:
    """Let a guest run a command, if the study has beds of that guest.

    Parameters
    ----------
    study
        The study, as `load_study` reads it.
    options
        The options of the command.

    Returns
    -------
    int or None
        The exit code of the command; None for a study of the core's own beds.
    """
    for offer in offers():
        code = offer.take_over(study, options) if offer.take_over is not None else None
        if code is not None:
            return code
    return None
