"""The end of a page: when, by which programs and by which command it was made."""

from collections.abc import Mapping
from pathlib import PurePath
from shlex import quote
from typing import Any

from orchestrator import __version__
from orchestrator.errors import printable
from orchestrator.runs.engine import human
from orchestrator.runs.files import Folder
from orchestrator.runs.workspace import COMMANDS, STUDY, is_dated, read_marker


def of_page(
    folder: Folder, programs: Mapping[str, str], wall_s: float | None = None
) -> dict[str, Any]:
    """Find what stands at the end of a page.

    Parameters
    ----------
    folder
        The directory of the results; what was asked in it, and when, is noted there, so
        that the same directory has the same page whenever that is drawn.
    programs
        Versions of the solvers, by name.
    wall_s
        Wall time of the cases, s; None where it is not known.

    Returns
    -------
    dict of str to object
        Values of the macro ``foot`` of the page's texts, by name.
    """
    about = read_marker(folder.root, STUDY)
    return {
        "date": about.get("begun", ""),
        "version": __version__,
        "programs": programs,
        "run": human(wall_s) if wall_s and not is_dated() else "",
        "command": _command(about),
    }


def _command(about: Mapping[str, Any]) -> str:
    """The command of what is in a directory; empty where there is no file of it."""
    source = about.get("source")
    name = str(about.get("name", ""))
    if "study" in about:
        if not isinstance(source, dict) or "file" not in source:
            return ""
        words = ["study", _named(source["file"])]
        if about.get("tolerance") is not None:
            words += ["--tolerance", f"{about['tolerance']:g}"]
    elif name:
        words = [COMMANDS.get(name, name)]
        if isinstance(source, dict) and "file" in source:
            words.append(_named(source["file"]))
    else:
        return ""
    return " ".join(["orchestrator", *words])


def _named(file: object) -> str:
    """The name of a study file in a command, as it can be printed."""
    return quote(printable(PurePath(str(file)).name))
