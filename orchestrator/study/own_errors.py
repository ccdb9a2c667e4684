"""The numerical errors that a ladder of the user measured, in place of the package's.

Nothing here imports a library: a finished study is told from its bytes in a tenth of a
second.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

from orchestrator import __version__
from orchestrator.errors import InputError
from orchestrator.runs.files import digest_file
from orchestrator.runs.workspace import EXPERIMENT, read_marker

TABLES = ("errors.csv", "domain.csv")
"""The tables of a ladder that are read."""
ANEW = "measure it with this one: orchestrator ladder FILE --out DIR"


@dataclass(frozen=True)
class OwnErrors:
    """What a ladder measured.

    Attributes
    ----------
    directory
        Absolute path of its directory.
    sha256
        Digest of its tables of errors and of the scenes on which they were measured.
    """

    directory: str
    sha256: str

    @property
    def tables(self) -> Path:
        """The directory of its tables."""
        return Path(self.directory) / "tables"

    @property
    def name(self) -> str:
        """Its directory and the beginning of its digest, for people."""
        return f"{Path(self.directory).name} (sha256 {self.sha256[:12]})"

    def described(self, root: Path) -> dict[str, str]:
        """Describe it as JSON, for a directory of results.

        Parameters
        ----------
        root
            The directory of results, to which its path is relative.

        Returns
        -------
        dict
            Its directory and its digest.
        """
        directory = os.path.relpath(self.directory, root)
        return {"directory": directory, "sha256": self.sha256}


def own_errors(directory: Path) -> OwnErrors:
    """Find the errors that a ladder measured.

    Parameters
    ----------
    directory
        The directory of its results.

    Returns
    -------
    OwnErrors
        The errors.

    Raises
    ------
    InputError
        For a directory without a finished ladder of this version of the program.
    """
    root = directory.absolute()
    where = f"--errors {directory}"
    marker = read_marker(root, EXPERIMENT)
    if (marker.get("kind"), marker.get("name")) != (EXPERIMENT.word, "ladder"):
        what = "this directory holds no ladder"
        raise InputError(what, where, "orchestrator ladder FILE --out DIR measures one")
    version = marker.get("orchestrator")
    if version != __version__:
        what = f"it was measured by version {version}, this is {__version__}"
        raise InputError(what, where, ANEW)
    digest = hashlib.sha256()
    for name in TABLES:
        path = root / "tables" / name
        if not path.is_file():
            what = f"its ladder is not finished: there is no tables/{name}"
            raise InputError(what, where, "the same ladder goes on")
        digest.update(digest_file(path).encode())
    return OwnErrors(str(root), digest.hexdigest())


def noted(about: object, root: Path) -> OwnErrors | None:
    """Find the errors that a directory of results notes.

    Parameters
    ----------
    about
        What it notes, by `OwnErrors.described`; None for those of the package.
    root
        The directory of results.

    Returns
    -------
    OwnErrors or None
        The errors.

    Raises
    ------
    InputError
        If they are gone or others now.
    """
    if not isinstance(about, dict):
        return None
    directory = Path(os.path.normpath(root / str(about.get("directory"))))
    found = own_errors(directory)
    if found.sha256 != about.get("sha256"):
        what = "its errors are not those by which the study was answered"
        raise InputError(what, f"--errors {directory}", "run the study again with them")
    return found
