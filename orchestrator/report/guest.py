"""The seam for whoever adds to the page of a study: a section of its own, and files beside it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markupsafe import Markup

    from orchestrator.study.study import Study
    from orchestrator.tables import Tables


@dataclass(frozen=True)
class Addition:
    """The part of a study's page that a guest adds.

    Attributes
    ----------
    section : Markup
        A section of the page, before its figures.
    files : mapping of str to str
        Texts beside the page, by the names of their files.
    """

    section: "Markup"
    files: Mapping[str, str] = field(default_factory=dict)


Guest = Callable[["Study", "Tables", Sequence[str]], Addition | None]
"""Given a study, its tables and the names of its figures in their order: what it adds, if any."""
