"""How the fields of a scene are declared: base class, words of a field, shared ranges."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator
from pydantic.fields import FieldInfo

List = Field(strict=False)  # beside a type of tuples: a list of TOML is taken as one
# Limits of nature, not of the methods, in SI units. Each has its extremes beside it.
Roughness = Annotated[float, Field(ge=1e-12, le=10)]  # from smooth walls to the largest boulder
Height = Annotated[float, Field(ge=1e-6, le=1e4)]  # from five of the smallest grains to mountains
Length = Annotated[float, Field(ge=1e-12, le=1e4)]  # the least that the fields above allow
Viscosity = Annotated[float, Field(ge=1e-8, le=1e3)]  # liquid helium, 2e-8, to thin gases and lava


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str = "leave it out") -> None:
        self.field, self.what, self.remedy = field, what, remedy
        super().__init__(f"{field}: {what} ({remedy})")


@dataclass(frozen=True)
class Info:
    """The words for a field; its meaning is the text under its declaration."""

    label: str = ""
    symbol: str = ""  # as formulas write it, an index after an underscore
    unit: str = ""
    column: str = ""  # of tables, with the unit, where that is not its name; "-" for none
    scope: str = "every scene"  # the scenes on which it has an effect, a key of `fields.APPLIES`
    about: Literal["question", "answer", "replica"] = "question"
    """A question to nature, a way to answer it, which alone a level of fidelity may change, or a
    choice among many alike."""
    choices: Mapping[str, str] = dataclasses.field(default_factory=dict)  # meanings of words
    read: str = ""  # property of a scene with the value in use, where the field may be left open


def field(default: Any = ..., *words: str, since: bool = False, **settings: Any) -> Any:
    """Declare a field: default (none: required), symbol, unit, column, label, `read` of `Info`.

    `settings` are the same or further words of `Info`, and rules of `pydantic.Field` such as
    ``ge``. A field that came after the first studies is `since`: a scene that has its default
    leaves it out of its digest, and keeps its id.
    """
    about = {name: settings.pop(name) for name in Info.__annotations__ if name in settings}
    about |= dict(zip(("symbol", "unit", "column", "label", "read"), words, strict=False))
    if since:
        settings["exclude_if"] = lambda value: value == default
    declared: FieldInfo = Field(default, **settings)
    declared.metadata.append(Info(**about))
    return declared


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
