"""One page over several studies: a card each, with its answer and its picture."""

from pathlib import Path
from urllib.parse import quote

from orchestrator import face
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.report import FIGURES, PAGE, page
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import STUDY

NAME = "gallery.html"
PICTURES = ("bed-*.svg", "shields.svg", "*.svg")
"""The figure that a card shows: the first that there is."""


def write(directory: Path) -> Path:
    """Write the gallery of the studies in a directory, an `InputError` if there is none."""
    cards = []
    for study in sorted(path.parent for path in directory.glob(f"*/{PAGE}")):
        if not (study / STUDY.marker).is_file():
            continue
        try:
            opened = face.open(study)
            title, says = opened.title, opened.answer.split("\n\n")[0].splitlines()
        except OrchestratorError as error:
            title, says = study.name, [error.what]
        figures = [
            path for name in PICTURES for path in sorted((study / FIGURES).glob(name))
        ]
        image = figures[0].read_bytes() if figures else b""
        about = {
            "title": title,
            "directory": study.name,
            "link": quote(f"{study.name}/{PAGE}"),
        }
        cards.append({**about, "says": says, "image": image})
    if not cards:
        remedy = "name the directory that holds directories of studies, such as results"
        raise InputError(
            "there is no study with a page", where=str(directory), remedy=remedy
        )
    path = directory.absolute() / NAME
    Folder(path.parent).put(
        NAME, page.fill("gallery.html.j2", title="Studies", cards=cards)
    )
    return path
