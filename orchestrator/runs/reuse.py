"""Whether a finished case is what the code as it is now would make.

The name of a case is the digest of what it depends on, and of a `recipe` that is raised
when the code makes other inputs of the same. Where that was forgotten, such as by
somebody who tries another force law, the old results would be taken for the new ones.
So a case that other code has made is compared: its inputs are written anew, and its
tables are made anew of its results.
"""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs import files
from orchestrator.runs.case import (
    CODE,
    DONE,
    IDENTITY,
    Case,
    code_digest,
    done_state,
    inputs_written,
)
from orchestrator.runs.files import Folder, read_json


def is_as_made_now(case: Case, cases: Path) -> bool:
    """Tell whether a finished case is what the code as it is now would make.

    Parameters
    ----------
    case
        The case, which is done.
    cases
        Directory of the cases.

    Returns
    -------
    bool
        True if the same code made it, or if the inputs that this code writes, and the
        tables that it makes of the results, are the same byte for byte. That is noted
        in the case. False also where it is not known: what the tables were made of was
        pruned.
    """
    directory = cases / case.name
    about = read_json(directory / IDENTITY)
    if about.get(CODE) == code_digest():
        return True
    try:
        with tempfile.TemporaryDirectory() as folder:
            is_same = _is_made_alike(case, cases, Path(folder))
    except (OSError, OrchestratorError):
        return False
    if is_same:
        noted = files.text_of({**about, CODE: code_digest()})
        # a directory that cannot be written is compared the next time, too
        with contextlib.suppress(OSError):
            files.write_durably(directory / IDENTITY, noted)
    return is_same


def _is_made_alike(case: Case, cases: Path, beside: Path) -> bool:
    """Whether a case has the inputs and tables that are made of it anew."""
    directory = cases / case.name
    folder = beside / case.name
    folder.mkdir()
    for need in case.needs:
        (beside / need.name).symlink_to((cases / need.name).absolute())
    inputs = inputs_written(case, folder, cases)
    if inputs != read_json(directory / IDENTITY).get("inputs_sha256"):
        return False
    tables = read_json(directory / DONE).get("derived_sha256", {})
    for path in directory.rglob("*"):
        name = path.relative_to(directory).as_posix()
        place = folder / name
        if path.is_file() and name not in tables and not os.path.lexists(place):
            place.parent.mkdir(parents=True, exist_ok=True)
            place.symlink_to(path.absolute())
    case.collect(folder)
    made = [folder / name for name in tables]
    return bool(files.digest_files(made, root=folder) == tables)


def elsewhere(
    cases: Mapping[str, Case], here: Path, beside: Sequence[Path]
) -> dict[str, Path]:
    """Find cases that are done in other directories of results and not in one.

    Parameters
    ----------
    cases
        The cases by their names.
    here
        The directory of cases in which they are wanted.
    beside
        Other directories of results.

    Returns
    -------
    dict of str to Path
        The directory of cases in which each was found first, by its name.
    """
    found = {}
    for name, case in cases.items():
        if not beside or done_state(case, here):
            continue
        for root in beside:
            if done_state(case, root / here.name):
                found[name] = root / here.name
                break
    return found


def taken(cases: Mapping[str, Case], here: Path, beside: Sequence[Path]) -> int:
    """Copy cases that are done in other directories of results.

    What is copied is checked as all finished cases are. Bulky files stay behind, as if
    they were pruned.

    Parameters
    ----------
    cases
        The cases by their names.
    here
        The directory of cases in which they are wanted, whose holder calls this.
    beside
        Other directories of results.

    Returns
    -------
    int
        How many were copied.
    """
    count = 0
    for name, source in elsewhere(cases, here, beside).items():
        bulky = read_json(source / name / DONE).get("bulky", ())
        place = Folder(here.parent).clear(f"{here.name}/{name}")
        # whatever cannot be copied is run
        with contextlib.suppress(OSError):
            here.mkdir(parents=True, exist_ok=True)
            _copy(source / name, place, bulky)
        count += done_state(cases[name], here) is not None
    return count


def _copy(source: Path, place: Path, but: Collection[str]) -> None:
    """Copy a directory without some files, with its times; links stay links."""

    def left(folder: str, names: list[str]) -> list[str]:
        inside = Path(folder).relative_to(source)
        return [name for name in names if (inside / name).as_posix() in but]

    shutil.copytree(source, place, symlinks=True, ignore=left)
