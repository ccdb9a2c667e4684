"""State on disk: canonical JSON, digests, durable writing, directories of results."""

import contextlib
import errno
import hashlib
import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from io import BufferedReader
from pathlib import Path, PurePosixPath
from typing import Any

from orchestrator.errors import InputError, OrchestratorError

RECORD = "written.sha256"
"""Name of the file with the digests of the files that were put.

`sha256sum` reads it. A line is added before its file is written: a killed process
leaves no file that is not listed.
"""
_NO_LINKS = "remove the link; the directory as a whole may lie elsewhere: --out"
_LISTED = re.compile(r"(?m)^([0-9a-f]{64})  (.+)(?<!\.json)$")
"""A line of the record.

Former versions listed the markers, too, which are JSON.
"""


PACKAGE = Path(__file__).absolute().parents[1]
"""The folder of the package."""


def beside_package(name: str) -> Path:
    """Find a folder that lies beside the package, or inside it in a wheel.

    Parameters
    ----------
    name
        Name of the folder.

    Returns
    -------
    Path
        The folder.
    """
    inside = PACKAGE / name
    return inside if inside.is_dir() else PACKAGE.parent / name


def canonical_json(value: Any) -> str:
    """Write a JSON value as its one text.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Its text: sorted keys, no spaces.

    Raises
    ------
    ValueError
        If a number is infinite or NaN.

    Examples
    --------
    >>> canonical_json({"b": 1.0, "a": [1, None]})
    '{"a":[1,null],"b":1.0}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def text_of(value: Any) -> str:
    """Write a JSON value as a file for people.

    Parameters
    ----------
    value
        The value.

    Returns
    -------
    str
        Its text: indented, with sorted keys.

    Raises
    ------
    ValueError
        If a number is infinite or NaN.
    """
    return json.dumps(value, indent=2, sort_keys=True, allow_nan=False) + "\n"


def digest_text(text: str) -> str:
    """Compute the SHA-256 of a text.

    Parameters
    ----------
    text
        The text.

    Returns
    -------
    str
        Its digest, in hexadecimal.

    Examples
    --------
    >>> digest_text("a")[:12]
    'ca978112ca1b'
    """
    return hashlib.sha256(text.encode()).hexdigest()


def digest_file(path: Path) -> str:
    """Compute the SHA-256 of a file's content.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    str
        Its digest, in hexadecimal.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    with opened(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def digest_files(paths: Iterable[Path], *, root: Path) -> dict[str, str]:
    """Compute the SHA-256 of each of some files.

    Parameters
    ----------
    paths
        The files.
    root
        A directory that holds all of them.

    Returns
    -------
    dict
        Digests by path relative to `root`, in order.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    digests = {}
    for path in sorted(paths):
        digests[path.relative_to(root).as_posix()] = digest_file(path)
    return digests


def opened(path: Path) -> BufferedReader:
    """Open a file to read it.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    BufferedReader
        Its bytes.

    Raises
    ------
    OSError
        If it cannot be read, also for a pipe or a device, which might never end.
    """
    if path.is_fifo() or path.is_char_device():
        raise OSError(errno.EINVAL, "not a file", str(path))
    return path.open("rb")


def read_json(path: Path) -> dict[str, Any]:
    """Read the JSON object of a file that marks something as done.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    dict
        The object; empty where there is none that can be read: unreadable is undone.
    """
    try:
        with opened(path) as stream:
            value = json.load(stream)
    except (OSError, ValueError, RecursionError):
        return {}
    return value if isinstance(value, dict) else {}


def write_durably(path: Path, content: str | bytes) -> None:
    """Replace a file in one step.

    A reader, or a crash, sees the old or the new content whole.

    Parameters
    ----------
    path
        The file.
    content
        Its new content.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
        # the name, too, survives a crash
        handle = os.open(path.parent, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)
    finally:
        temporary.unlink(missing_ok=True)


def state_of(path: Path) -> tuple[int, int, int]:
    """Tell a file from one that was written again at its path.

    With it a cache by the path of a file sees a case that was run again.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple of int
        Its number, its size, bytes, and the time of its change, ns.

    Raises
    ------
    OSError
        If there is no such file.
    """
    state = path.stat()
    return state.st_ino, state.st_size, state.st_mtime_ns


def size_of(path: Path) -> int:
    """Add up the size of a file, or of all files below a directory.

    Parameters
    ----------
    path
        The file or directory.

    Returns
    -------
    int
        Size, bytes. A file that vanishes meanwhile counts 0.
    """
    files = [path]
    if path.is_dir():
        files = _files_below(path)
    total = 0
    for file in files:
        with contextlib.suppress(OSError):
            total += file.lstat().st_size
    return total


def _files_below(directory: Path) -> list[Path]:
    """All files below a directory."""
    files = []
    for folder, _, names in os.walk(directory):
        files += [Path(folder, name) for name in names]
    return files


class Folder:
    """A directory that this program writes.

    It is the one way for files to get into the directory and out of it. The names that
    are written are this program's: what is there under such a name is replaced. Files
    under other names stay, but for those in a sub-directory that is made anew.

    Names are paths relative to the directory. A link in the way, or a directory in the
    place of a file, raises InputError; the directory itself may be a link.

    Parameters
    ----------
    root
        The directory.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def path(self, name: str) -> Path:
        """Find the path of a name.

        Parameters
        ----------
        name
            A path relative to the directory, with slashes.

        Returns
        -------
        Path
            Its path.

        Raises
        ------
        InputError
            If the name leads out of the directory, or a part of it is a link.
        """
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            what = f"{name!r} leads out of the directory"
            raise InputError(what, where=str(self.root))
        path = self.root
        for part in parts:
            path = path / part
            if path.is_symlink():
                to = os.readlink(path)
                what = f"it is a link to {to}, and this program writes through none"
                raise InputError(what, where=str(path), remedy=_NO_LINKS)
        return path

    def put(self, name: str, content: str | bytes) -> None:
        """Write a file in one step, and record it.

        Parameters
        ----------
        name
            Its path relative to the directory.
        content
            Its content.
        """
        data = content.encode() if isinstance(content, str) else content
        digest = hashlib.sha256(data).hexdigest()
        self._record([*self._listed(), (digest, name)])
        write_durably(self._place(name), data)

    def note(self, name: str, content: str | bytes) -> None:
        """Write a file in one step without recording it, as the state of a study is.

        Parameters
        ----------
        name
            Its path relative to the directory.
        content
            Its content.
        """
        write_durably(self._place(name), content)

    def drop(self, name: str) -> None:
        """Remove a file, if it is there.

        Parameters
        ----------
        name
            Its path relative to the directory.
        """
        self._place(name).unlink(missing_ok=True)

    def clear(self, name: str) -> Path:
        """Remove a sub-directory with all that is in it; no link in it is followed.

        Parameters
        ----------
        name
            Path of the sub-directory relative to the directory.

        Returns
        -------
        Path
            The path of the sub-directory, which is not made.
        """
        path = self._place(name, of_folder=True)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
        return path

    @contextlib.contextmanager
    def renewed(self) -> Iterator[None]:
        """Put all files anew within the block; those not put again are removed.

        All stay where the block ends with an exception.

        Yields
        ------
        None
            While the files are put.
        """
        before = self._listed()
        yield
        new = self._listed()[len(before) :]
        names = {name for _, name in new}
        for _, name in before:
            if name not in names:
                self.drop(name)
        self._record(dict.fromkeys(new))

    def written(self) -> dict[str, str]:
        """List the files that were put.

        Returns
        -------
        dict
            Their digests by name.
        """
        return {name: digest for digest, name in self._listed()}

    def is_whole(self) -> bool:
        """Check that all files that were put are unchanged.

        Returns
        -------
        bool
            Whether they are.
        """
        written = self.written()
        return all(self._digest(name) == digest for name, digest in written.items())

    def read(self, name: str) -> bytes:
        """Read a file that was put.

        Parameters
        ----------
        name
            Its path relative to the directory.

        Returns
        -------
        bytes
            Its content.

        Raises
        ------
        OrchestratorError
            If it is not as it was put.
        OSError
            If it cannot be read.
        """
        path = self.path(name)
        data = path.read_bytes()
        if hashlib.sha256(data).hexdigest() != self.written().get(name):
            what = "it is not as it was written"
            remedy = "`orchestrator report` writes it again"
            raise OrchestratorError(what, where=str(path), remedy=remedy)
        return data

    def _place(self, name: str, *, of_folder: bool = False) -> Path:
        """The path of a name, where a file, or a sub-directory, can be written."""
        path = self.path(name)
        # an empty directory is in nobody's way
        with contextlib.suppress(OSError):
            path.rmdir()
        if path.is_dir() and not of_folder:
            what = "a directory is where this program writes a file"
            raise InputError(what, where=str(path), remedy="move it away")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError):
            what = "a file is where this program writes a directory"
            raise InputError(what, str(path.parent), "move it away") from None
        return path

    def _digest(self, name: str) -> str | None:
        """Digest of a file; None where it is missing or cannot be read."""
        try:
            return digest_file(self.path(name))
        except (OSError, InputError):
            return None

    def _listed(self) -> list[tuple[str, str]]:
        """Digests and names of the record, as far as it can be read."""
        record = self.path(RECORD)
        if not record.is_file():
            return []
        return _LISTED.findall(os.fsdecode(record.read_bytes()))

    def _record(self, lines: Iterable[tuple[str, str]]) -> None:
        """Write the record.

        A name has several lines while its file is being replaced.
        """
        text = "".join(f"{digest}  {name}\n" for digest, name in lines)
        self.note(RECORD, os.fsencode(text))
