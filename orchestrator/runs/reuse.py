"""Whether a finished case is what the code as it is now would make.

The name of a case is the digest of what it depends on, and of a `recipe` that is raised
when the code makes other inputs of the same. Where that was forgotten, such as by
somebody who tries another force law, the old results would be taken for the new ones.
So a case that other code has made is compared: its inputs are written anew, and its
tables are made anew of its results.
"""

import contextlib
import os
import tempfile
from pathlib import Path

from orchestrator.errors import OrchestratorError
from orchestrator.runs import files
from orchestrator.runs.case import (
    CODE,
    DONE,
    IDENTITY,
    Case,
    code_digest,
    inputs_written,
)
from orchestrator.runs.files import read_json


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
