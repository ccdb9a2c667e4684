"""One figure of the page."""

from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure as Canvas


@dataclass(frozen=True)
class Figure:
    """A drawing with what must be said about it.

    Attributes
    ----------
    name : str
        Stem of its files' names.
    title, caption : str
        A heading, and what it shows, by which equations and protocol, with which uncertainty.
    cases : tuple of str
        Directories of the cases behind it.
    canvas : matplotlib.figure.Figure or None
        The drawing; None once its files are written.
    image : bytes
        The picture that the page shows, SVG or PNG, once it is made.
    data : object
        What the page's script needs to answer a pointer or a slider, as JSON; None if nothing.
    fold : bool
        Whether the page shows it on demand alone.
    first : bool
        Whether it answers the study's question and stands before all others.
    fault : str
        Why it could not be drawn, in place of all else; empty of a figure.
    """

    name: str
    title: str
    caption: str
    cases: tuple[str, ...]
    canvas: Canvas | None
    image: bytes = b""
    data: Any = None
    fold: bool = False
    first: bool = False
    fault: str = ""

    @property
    def leads(self) -> bool:
        """Whether it stands at the head of the page."""
        return self.first or (self.data is not None and not self.fold)
