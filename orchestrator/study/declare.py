"""How the fields of a scene are declared: their words, their ranges, their base class.

Each field is declared once: its name and default are the study file's, its words and
the text under it are what tables, figures and the reference of study files say of it.
Lines of the text that begin with a dash give the meaning of one word each. Angles are
in degrees and say so in their names; all else is in SI units or in the unit that is
declared. Ranges are limits of nature.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.fields import FieldInfo

List = Field(strict=False)
"""Beside a type of tuples: a list of TOML is taken as one."""
Fraction = Annotated[float, Field(ge=1e-6, le=1)]
Roughness = Annotated[float, Field(ge=1e-12, le=10)]
"""From smooth walls to the largest boulder, m."""
Height = Annotated[float, Field(ge=1e-6, le=1e4)]
"""From five of the smallest grains to mountains, m."""
Length = Annotated[float, Field(ge=1e-12, le=1e4)]
"""The least length that the fields above allow, to the largest, m."""
Viscosity = Annotated[float, Field(ge=1e-8, le=1e3)]
"""From liquid helium, 2e-8, to thin gases and lava, m2/s."""


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str = "leave it out") -> None:
        self.field = field
        self.what = what
        self.remedy = remedy
        super().__init__(f"{field}: {what} ({remedy})")


@dataclass(frozen=True)
class Info:
    """The words for a field; its meaning is the text under its declaration.

    Attributes
    ----------
    label
        What figures and tables call it.
    symbol
        As formulas write it, an index after an underscore.
    unit
        Its unit.
    column
        Its column in tables, with the unit, where that is not its name; "-" for none.
    scope
        The scenes on which it has an effect, a key of `scopes.APPLIES`.
    choices
        Meanings of its words.
    read
        Property of a scene with the value in use, where the field may be left open.
    also
        What a study file may write in place of its value, in words.
    """

    label: str = ""
    symbol: str = ""
    unit: str = ""
    column: str = ""
    scope: str = "every scene"
    choices: Mapping[str, str] = dataclasses.field(default_factory=dict)
    read: str = ""
    also: str = ""


WORDS = tuple(one.name for one in dataclasses.fields(Info))


def field(default: Any = ..., **settings: Any) -> Any:
    """Declare a field.

    Parameters
    ----------
    default
        The default; none for a field that is required.
    **settings
        Words of `Info`, and rules of `pydantic.Field` such as ``ge``.

    Returns
    -------
    Any
        The declaration, for pydantic.
    """
    words = {name: settings.pop(name) for name in WORDS if name in settings}
    declared: FieldInfo = Field(default, **settings)
    declared.metadata.append(Info(**words))
    return declared


def info_of(declared: FieldInfo) -> Info:
    """Find the words of a field.

    Parameters
    ----------
    declared
        Its declaration.

    Returns
    -------
    Info
        Its words; none of a field that is declared without `field`.
    """
    for each in declared.metadata:
        if isinstance(each, Info):
            return each
    return Info()


class Part(BaseModel):
    """Base of the parts of a scene: immutable, exact types, no unknown keys, no NaN."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    @model_validator(mode="after")
    def _without_minus_zero(self) -> Self:
        """Make one number of 0.0 and -0.0, which are equal.

        Else they would be two scenes.
        """
        zeros = {}
        for name, value in vars(self).items():
            if type(value) is float and value == 0.0:
                zeros[name] = 0.0
        vars(self).update(zeros)
        return self
