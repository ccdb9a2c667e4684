"""One page over several studies: a card each, with its answer and its picture."""

import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from orchestrator import face
from orchestrator.digits import number
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.report import LIST, PAGE, page
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import STUDY

NAME = "gallery.html"
VIEW = re.compile(r'viewBox="\S+ \S+ (\S+) (\S+)"')
"""Width and height of an SVG."""
WIDE = 2.5
"""Width over height from which a picture fills its card; others are shown whole."""


def write_gallery(directory: Path) -> Path:
    """Write the gallery of the studies in a directory.

    Parameters
    ----------
    directory
        The directory that holds the directories of the studies.

    Returns
    -------
    Path
        The page; one that was there is replaced.

    Raises
    ------
    InputError
        If there is no study with a page.
    """
    cards = []
    for path in sorted(directory.glob(f"*/{PAGE}")):
        if (path.parent / STUDY.marker).is_file():
            cards.append(_card(path.parent))
    if not cards:
        what = "there is no study with a page"
        remedy = "name the directory that holds directories of studies, such as results"
        raise InputError(what, where=str(directory), remedy=remedy)
    folder = Folder(directory.absolute())
    counted = number(len(cards), "result page")
    title = "Studies: what each found"
    folder.note(
        NAME, page.fill("gallery.html.j2", title=title, counted=counted, cards=cards)
    )
    return folder.root / NAME


def _card(study: Path) -> dict[str, Any]:
    """What the page shows of a study."""
    try:
        opened = face.open(study)
        title = opened.title
        answer = opened.card
        says = [answer.question]
    except OrchestratorError as error:
        title = study.name
        says = [error.what]
        answer = None
    return {
        "title": title,
        "directory": study.name,
        "link": quote(f"{study.name}/{PAGE}"),
        "says": says,
        "answer": answer,
        "image": (image := _picture(study / LIST)),
        "is_wide": _is_wide(image),
    }


def _is_wide(image: bytes) -> bool:
    """Whether a picture loses little where it is cut to the form of a card."""
    found = VIEW.search(image.decode("utf-8")[:2000])
    if found is None:
        return False
    width, height = map(float, found.groups())
    return width > WIDE * height


def _picture(listed: Path) -> bytes:
    """The first figure that leads a page, of its list; empty if there is none."""
    if not listed.is_file():
        return b""
    figures = pd.read_csv(listed)
    for name in figures.loc[figures["place"] == "lead", "name"]:
        path = listed.with_name(f"{name}.svg")
        if path.is_file():
            return path.read_bytes()
    return b""
