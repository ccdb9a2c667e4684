"""The card of a page in a file beside it, which a page over several results reads."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from orchestrator.report.card import Card, Number, Worth
from orchestrator.runs import files

CARD = "card.json"


class Noted(NamedTuple):
    """What a page over several results shows of one.

    Attributes
    ----------
    title
        The title of its page.
    card
        Its card.
    figures
        The names of its figures in their order.
    """

    title: str
    card: Card
    figures: Sequence[str]


def text_of(title: str, card: Card, figures: Sequence[str]) -> str:
    """Write a card as the text of its file.

    Parameters
    ----------
    title, card, figures
        As those of `Noted`.

    Returns
    -------
    str
        JSON; numbers that are not known are left out.
    """
    told = asdict(card)
    told["numbers"] = [_known(number) for number in told["numbers"]]
    return files.text_of({"title": title, "card": told, "figures": list(figures)})


def _known(number: dict[str, Any]) -> dict[str, Any]:
    """The fields of a number that are known."""
    return {
        name: value
        for name, value in number.items()
        if not isinstance(value, float) or math.isfinite(value)
    }


def read(root: Path) -> Noted | None:
    """Read the card of a directory.

    Parameters
    ----------
    root
        The directory of results.

    Returns
    -------
    Noted or None
        What was noted; None where nothing was.
    """
    noted = files.read_json(root / CARD)
    if not noted:
        return None
    told = dict(noted["card"])
    numbers = [Number(**{"value": math.nan, **each}) for each in told.pop("numbers")]
    worth = Worth(**told.pop("worth"))
    heads = tuple(told.pop("heads"))
    card = Card(**told, numbers=tuple(numbers), worth=worth, heads=heads)
    return Noted(str(noted["title"]), card, noted["figures"])
