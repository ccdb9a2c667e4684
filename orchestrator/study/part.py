"""Base of the parts of a scene, the words that their fields are declared with, shared ranges."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

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

# Limits of nature, not of the methods, in SI units. Each has its extremes beside it.
Roughness = Annotated[float, Field(ge=1e-12, le=10)]
"""From far below any grain, where a wall is smooth, to the largest boulder."""
Height = Annotated[float, Field(ge=1e-6, le=1e4)]
"""From five of the smallest grains to the largest mountains."""
Length = Annotated[float, Field(ge=1e-12, le=1e4)]
"""From the least that the fields above allow to the largest mountains."""
Viscosity = Annotated[float, Field(ge=1e-8, le=1e3)]
"""Kinematic, from liquid helium, 2e-8, to thin gases and lava."""


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str) -> None:
        self.field, self.what, self.remedy = field, what, remedy
        super().__init__(f"{field}: {what} ({remedy})")


@dataclass(frozen=True)
class Info:
    """The words for a field, beside its name, its range and its default.

    The meaning of the field is the text under its declaration.
    """

    label: str
    symbol: str = ""
    """As formulas write it, an index after an underscore; empty where there is none."""
    unit: str = ""
    column: str = ""
    """Its column in tables, with the unit, where that is not its name; "-" for none."""
    scope: Scope = "every scene"
    """The scenes on which it has an effect; for all others its column is empty."""
    about: About = "question"
    """A level of fidelity may change only fields about the answer."""
    choices: Mapping[str, str] = field(default_factory=dict)
    """For a field of words, the meaning of each."""
    read: str = ""
    """The property of a scene that has the value in use, where the field may be left open."""


class Part(BaseModel):
    """Base of a scene's parts: immutable, exact types, no unknown keys, no NaN."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    @field_validator("*", mode="after")
    @classmethod
    def _without_minus_zero(cls, value: Any) -> Any:
        """Make one number of 0.0 and -0.0, which are equal: else they are two scenes."""
        return value + 0.0 if isinstance(value, float) else value


def unless(default: Any) -> Any:
    """Leave a field with its default out of the digest: scenes from before it keep their ids."""
    return Field(exclude_if=lambda value: value == default)
