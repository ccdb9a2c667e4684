"""How force laws are told apart in figures."""

from collections.abc import Iterable
from typing import Any

from orchestrator.physics.laws import LAWS
from orchestrator.physics.threshold import LAWS_OF

PAIR = LAWS_OF["transition"]
"""The paper's two, which hold at no common Re*: their lines need not be told apart."""
Dash = Any
"""A line's style, as matplotlib has it."""
LOOKS: tuple[tuple[str, Dash], ...] = (
    ("#5a5a5a", "--"),
    ("#5a5a5a", "-"),
    ("#c8102e", "-"),
    ("#c8102e", (0, (4, 1.5))),
    ("#009e73", "-"),
    ("#7b3294", "-"),
    ("#e69f00", "-"),
    ("#e69f00", (0, (4, 1.5))),
    ("#e377c2", "-"),
    ("#009e73", (0, (4, 1.5))),
    ("#7b3294", (0, (4, 1.5))),
)
"""Colour and dash where colours mean laws, in the order of `LAWS`: variants share a colour. Neither
blue, which is water, nor brown, which is air, nor black, which is measured."""
FEW = 2
"""Laws that are told apart by their dashes alone."""
DASHES: tuple[Dash, ...] = (
    "-",
    (0, (5, 1.2)),
    (0, (6, 1.2, 1, 1.2)),
    (0, (2.5, 1)),
    (0, (6, 1, 1, 1, 1, 1)),
    (0, (9, 1.5)),
    (0, (4, 1, 4, 1, 1, 1)),
)
"""Where colours mean something else. Dotted is where a law does not hold."""


def look(name: str) -> tuple[str, Dash]:
    """Colour and dash of a law where colours mean laws."""
    return LOOKS[list(LAWS).index(name) % len(LOOKS)]


def drawn(names: Iterable[str]) -> list[str]:
    """The laws that are drawn for some scenes: of the paper's pair both if either is there."""
    used = set(names)
    pair = set(PAIR) if used & set(PAIR) else set()
    return [name for name in LAWS if name in used | pair]


def many(names: Iterable[str]) -> bool:
    """Whether there are so many laws that colours must tell them apart."""
    return len(set(dashes(names).values())) > FEW


def dashes(names: Iterable[str]) -> dict[str, Dash]:
    """A dash for each of the laws that are drawn; the paper's pair has one."""
    listed = drawn(names)
    families = dict.fromkeys(PAIR if name in PAIR else (name,) for name in listed)
    return {name: dash for family, dash in zip(families, DASHES, strict=False) for name in family}
