"""The guests: packages that add commands, cards and kinds of beds to the core.

Each stands in a room of its own, which no module of the core imports. The package of a
guest has an `OFFER`; the core asks what is offered. Here stands the one list of guests:
below the commands, since the answers of the Python functions have cards of guests, too.
"""

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from orchestrator.command import Command

if TYPE_CHECKING:
    from orchestrator.report.page import Guest
    from orchestrator.study.study import Study
    from orchestrator.tables import Tables

GUESTS = ("benchmark", "lab", "paper", "stockpile", "surface")
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
    take_over
        Runs a command on a study file of beds that the core does not know, and returns
        its exit code, or None for other beds; None for a guest without beds.
    """

    commands: tuple[Command, ...] = ()
    cards: "Callable[[Study, Tables], list[Guest]] | None" = None
    take_over: Callable[[Namespace], int | None] | None = None


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


def taken_over(options: Namespace) -> int | None:
    """Let a guest run a command, if the study file has beds of that guest.

    Parameters
    ----------
    options
        The options of the command, with its name and its study file.

    Returns
    -------
    int or None
        The exit code of the command; None for a study of the core's own beds.
    """
    for offer in offers():
        code = offer.take_over(options) if offer.take_over is not None else None
        if code is not None:
            return code
    return None
