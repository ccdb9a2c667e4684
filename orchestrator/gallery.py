"""One page over several studies: a card each, with its answer and its picture."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from orchestrator import __version__, face
from orchestrator.digits import number
from orchestrator.errors import InputError, OrchestratorError
from orchestrator.report import LIST, PAGE, noted, page
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import STUDY, now

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
    foot = page.page_text(
        "foot",
        date=now(),
        version=__version__,
        programs={},
        run="",
        command="orchestrator gallery DIR",
        reading=page.page_text("reading", of={"cards"}),
    )
    folder.note(
        NAME,
        page.fill(
            "gallery.html.j2", title=title, counted=counted, cards=cards, foot=foot
        ),
    )
    return folder.root / NAME


def _card(study: Path) -> dict[str, Any]:
    """What the page shows of a study."""
    noted_ = noted.read(study)
    if noted_ is not None:
        title, answer, figures = noted_
        says = [answer.question]
    else:
        figures = _leading(study / LIST)
        try:
            opened = face.open(study)
            title, answer = opened.title, opened.card
            says = [answer.question]
        except OrchestratorError as error:
            title, answer = study.name, None
            says = [error.what]
    image = _picture((study / LIST).parent, figures)
    return {
        "title": title,
        "directory": study.name,
        "link": quote(f"{study.name}/{PAGE}"),
        "says": says,
        "answer": answer,
        "image": image,
        "is_wide": _is_wide(image),
    }


def _is_wide(image: bytes) -> bool:
    """Whether a picture loses little where it is cut to the form of a card."""
    found = VIEW.search(image.decode("utf-8")[:2000])
    if found is None:
        return False
    width, height = map(float, found.groups())
    return width > WIDE * height


def _leading(listed: Path) -> Sequence[str]:
    """The figures that lead the page of a study, of their list."""
    if not listed.is_file():
        return ()
    figures = pd.read_csv(listed)
    return [*figures.loc[figures["place"] == "lead", "name"]]


def _picture(folder: Path, figures: Sequence[str]) -> bytes:
    """The first of some figures that there is; empty if there is none."""
    for name in figures:
        path = folder / f"{name}.svg"
        if path.is_file():
            return path.read_bytes()
    return b""
