"""Base of the parts of a scene, and how they refuse what does not go together."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator


class UnfitError(ValueError):
    """Two fields of a scene that do not go together: which, why and what would."""

    def __init__(self, field: str, what: str, remedy: str) -> None:
        self.field, self.what, self.remedy = field, what, remedy
        super().__init__(f"{field}: {what} ({remedy})")


class Part(BaseModel):
    """Base of a scene's parts: immutable, exact types, no unknown keys, no NaN."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        strict=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
    )

    @field_validator("*", mode="after")
    @classmethod
    def _without_minus_zero(cls, value: Any) -> Any:
        """Make one number of 0.0 and -0.0, which are equal: else they are two scenes."""
        return value + 0.0 if isinstance(value, float) else value


def unless(default: Any) -> Any:
    """Leave a field with its default out of the digest: scenes from before it keep their ids."""
    return Field(exclude_if=lambda value: value == default)
