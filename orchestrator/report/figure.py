"""One figure of the page."""

from dataclasses import dataclass

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
        The drawing; None once its files are written, and of an animation.
    image : bytes
        The picture that the page shows, PNG or GIF, once it is made.
    """

    name: str
    title: str
    caption: str
    cases: tuple[str, ...]
    canvas: Canvas | None
    image: bytes = b""
