"""One page over several studies: a card each, with what was found and its picture."""

import base64
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from orchestrator import face
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.report import FIGURES, PAGE, page
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import STUDY

NAME = "gallery.html"
PICTURES = ("bed-*.svg", "shields.svg")
"""The figure that a card shows: the first that there is."""


@dataclass(frozen=True)
class Card:
    """A study's card in the gallery.

    Attributes
    ----------
    title : str
        Title of the study.
    link : str
        To its page, relative to the gallery.
    says : tuple of str
        What was found, or why that cannot be read.
    image : str
        Its picture, SVG in base64; empty if there is none.
    """

    title: str
    link: str
    says: tuple[str, ...]
    image: str


def write(directory: Path) -> Path:
    """Write the gallery of the studies that a directory holds, and give its path.

    Raises
    ------
    InputError
        If it holds no study with a page.
    """
    found = sorted(path.parent for path in directory.glob(f"*/{PAGE}"))
    cards = [_card(one) for one in found if (one / STUDY.marker).is_file()]
    if not cards:
        remedy = "name the directory that holds directories of studies, such as results"
        raise InputError("there is no study with a page", where=str(directory), remedy=remedy)
    path = directory.absolute() / NAME
    Folder(path.parent).put(NAME, page.fill("gallery.html.j2", title="Studies", cards=cards))
    return path


def _card(study: Path) -> Card:
    try:
        opened = face.open(study)
        title, says = opened.title, opened.sentences
    except OrchestratorError as error:
        title, says = study.name, (error.what,)
    pictures = (path for name in PICTURES for path in sorted((study / FIGURES).glob(name)))
    image = next(pictures, None)
    data = base64.b64encode(image.read_bytes()).decode("ascii") if image else ""
    return Card(title, quote(f"{study.name}/{PAGE}"), says, data)
