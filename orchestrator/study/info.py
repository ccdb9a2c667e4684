"""Words for a field of a scene, beside its name, its range and its default."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Scope = Literal[
    "every scene",
    "single grains",
    "piles",
    "dunes",
    "beds with level parts",
    "profiles",
    "disordered piles",
    "poured beds",
    "random beds and replicas",
    "solved flows",
    "DEM",
    "DEM of piles",
    "DEM and peeling",
    "DEM and peeling of piles",
]
"""The scenes on which a field has an effect."""
About = Literal["question", "answer", "replica"]
"""Role of a field: a question to nature, a way to answer it, or a choice among many alike."""


@dataclass(frozen=True)
class Info:
    """The words for a field; its meaning is the text under it.

    Attributes
    ----------
    label : str
        A short name.
    symbol, unit : str
        As formulas write them, an index after an underscore; empty where there is none.
    column : str
        What tables call it, with its unit, where that is not its name; "-" for what is in none.
    scope : str
        The scenes on which it has an effect; for all others its column is empty.
    about : {"question", "answer", "replica"}
        A level of fidelity may change what is about the answer alone.
    choices : mapping of str to str
        For a field of words, what each of them stands for.
    read : str
        The property of a scene that has the value in use, where the field may be left open.
    """

    label: str
    symbol: str = ""
    unit: str = ""
    column: str = ""
    scope: Scope = "every scene"
    about: About = "question"
    choices: Mapping[str, str] = field(default_factory=dict)
    read: str = ""
